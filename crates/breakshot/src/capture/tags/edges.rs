//! Where exactly do the four sides of a tag run?
//!
//! Across each side the grey rises from black to white; a smooth step, its height and middle free to change along
//! the side, is fitted to every pixel of the band.  Blur widens the step and does not move it.  Once the tag is read,
//! the next steps to either side are part of the model, the code inside and the table outside: what blurs in from
//! them does not move it either.

use super::family;
use super::undistorted::Straight;
use crate::capture::homography::Homography;
use crate::capture::image::GreyImage;
use crate::geometry::{Pixel, Point};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use nalgebra::{SMatrix, SVector};

/// How many bits the band reaches inwards and outwards before the tag is read: past them the code and the table begin...
const UNREAD_BITS: [f64; 2] = [0.85, 0.85];
/// ... and after: up to the middle of the code's first row, and to the end of the margin.
const READ_BITS: [f64; 2] = [1.5, 1.0];
/// A band never reaches farther before the step's width is known (px): none of a usable picture is wider.
const BAND_MOST_PX: f64 = 6.0;
/// Nor less far: a step needs pixels on both sides.
const BAND_LEAST_PX: f64 = 1.2;
/// Once the width of a step is known, this many of it show all of its rise.
const BAND_WIDTHS: f64 = 4.0;
/// Longer sides are sampled at this many places.
const MOST_COLUMNS: usize = 80;
/// A fit that moves the corners by less than this (px) is the last, before and after the tag is read: what the next
/// would add is of second order.
const SETTLED_PX: [f64; 2] = [0.2, 0.01];
/// Fits until they settle.
const MOST_FITS: usize = 6;

/// The corners of the quad near these, where straight lines are straight; `None` unless each side is one dark to
/// light step.
///
/// `word` is the tag's code, if it is known, its top left corner then being the first one; `steps` are those that an
/// earlier fit found at the same sides.
pub(super) fn fitted(
    image: &GreyImage,
    straight: &Straight,
    near_px: [Pixel; 4],
    word: Option<u64>,
    mut steps: [Option<Step>; 4],
) -> Option<([Pixel; 4], [Option<Step>; 4])> {
    let mut corners = [Pixel::default(); 4];
    for (ideal, near) in corners.iter_mut().zip(near_px) {
        *ideal = straight.straightened(near)?;
    }
    let start = corners;
    for _ in 0..MOST_FITS {
        let mut sides = [Side::between(corners[0], corners[1]); 4];
        let square = Square::of(&corners)?;
        for k in 0..4 {
            let side = Side::between(corners[k], corners[(k + 1) % 4]);
            let rim = Rim { square: &square, k, row: word.map(|word| family::outer_row(word, k)), side };
            let band = rim.band(steps[k].as_ref())?;
            let samples = rim.samples(image, straight, &band)?;
            let step = Step::fitted(&samples, &band, steps[k])?;
            sides[k] = side.moved(&step);
            steps[k] = Some(step);
        }
        let mut moved_px: f64 = 0.0;
        for k in 0..4 {
            let corner = sides[(k + 3) % 4].crossing(&sides[k])?;
            moved_px = moved_px.max(corner.distance_px(corners[k]));
            corners[k] = corner;
        }
        let strayed = (0..4).any(|k| corners[k].distance_px(start[k]) > 2.0 * BAND_MOST_PX);
        if strayed {
            return None;
        }
        if moved_px < SETTLED_PX[usize::from(word.is_some())] {
            break;
        }
    }
    // Noise may keep the last digits moving; what is left is far below a pixel.
    Some((corners, steps))
}

/// The tag's black square, eight bits by eight, in the straight picture.
struct Square {
    pixel_from_bits: Homography,
    bits_from_pixel: Homography,
}

impl Square {
    fn of(corners: &[Pixel; 4]) -> Option<Self> {
        let bits = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)].map(|(x, y)| Point::new(x, y));
        let pixel_from_bits = Homography::fitted(&[0, 1, 2, 3].map(|k| (bits[k], corners[k])))?;
        Some(Self { pixel_from_bits, bits_from_pixel: pixel_from_bits.inverse()? })
    }
}

/// A side of a quad that runs clockwise: its outside lies to the left as one looks along it.
#[derive(Clone, Copy)]
struct Side {
    from: Pixel,
    length_px: f64,
    /// Unit vector along it.
    along: (f64, f64),
}

impl Side {
    fn between(from: Pixel, to: Pixel) -> Self {
        let length_px = from.distance_px(to).max(f64::MIN_POSITIVE);
        Self { from, length_px, along: ((to.x - from.x) / length_px, (to.y - from.y) / length_px) }
    }

    /// How far outside the side's line a place lies (px).
    fn across(&self, p: Pixel) -> f64 {
        (p.x - self.from.x) * self.along.1 - (p.y - self.from.y) * self.along.0
    }

    fn at(&self, part: f64, across_px: f64) -> Pixel {
        let (dx, dy) = self.along;
        let (a, b) = (part * self.length_px, across_px);
        Pixel::new(self.from.x + a * dx + b * dy, self.from.y + a * dy - b * dx)
    }

    fn moved(&self, step: &Step) -> Self {
        let [offset_px, slant_px, ..] = step.numbers;
        Self::between(self.at(0.0, offset_px - slant_px / 2.0), self.at(1.0, offset_px + slant_px / 2.0))
    }

    /// Where two sides' lines meet.
    fn crossing(&self, next: &Self) -> Option<Pixel> {
        let turn = self.along.0 * next.along.1 - self.along.1 * next.along.0;
        let part = -next.across(self.from) / turn / self.length_px;
        let meets = turn.abs() > PARALLEL && part.is_finite();
        meets.then(|| self.at(part, 0.0))
    }
}

/// Neighbouring sides closer to parallel than this (rad) do not meet in a corner.
const PARALLEL: f64 = 0.15;

/// Side `k` of the square and what lies to either side of it.
struct Rim<'a> {
    square: &'a Square,
    k: usize,
    side: Side,
    /// Which bits of the code's row behind the border are white, along the side; unknown until the tag is read.
    row: Option<[bool; 6]>,
}

/// The pixels about a side that its step is fitted to.
#[expect(clippy::struct_field_names, reason = "each is told in pixels")]
struct Band {
    /// How far they reach inwards and outwards (px).
    reach_px: [f64; 2],
    /// How far they stay away from the side's ends, where the next side blurs in (px).
    ends_px: f64,
    /// How wide the step was found to be (px), if what lies next to it blurs into the band.
    mixed_px: Option<f64>,
}

/// A pixel near a side.
struct Sample {
    /// Where along it: -0.5 to 0.5.
    along: f64,
    /// How far outside it (px).
    across_px: f64,
    grey: f64,
    /// How far inside the side the code begins, and how far outside the table (px).
    next_px: [f64; 2],
    /// How white the code is there, 0 to 1.
    white: f64,
}

/// Farther than any blur (px): the distance of what is not there.
const FAR_PX: f64 = 1e3;

impl Rim<'_> {
    /// A place so many bits along the side and so many inside it, in the square's bits.
    fn place(&self, along: f64, inside: f64) -> Point {
        match self.k {
            0 => Point::new(along, inside),
            1 => Point::new(8.0 - inside, along),
            2 => Point::new(8.0 - along, 8.0 - inside),
            _ => Point::new(inside, 8.0 - along),
        }
    }

    /// How far outside the side a place lies that is so many bits along and inside it (px).
    fn across_px(&self, along: f64, inside: f64) -> Option<f64> {
        self.square.pixel_from_bits.pixel(self.place(along, inside)).map(|p| self.side.across(p))
    }

    fn band(&self, step: Option<&Step>) -> Option<Band> {
        let width_px = step.map(Step::width_px);
        let bits = if self.row.is_some() { READ_BITS } else { UNREAD_BITS };
        let most_px = width_px.map_or(BAND_MOST_PX, |width| BAND_WIDTHS * width + BAND_LEAST_PX);
        let next_px = [-self.across_px(4.0, 1.0)?, self.across_px(4.0, -1.0)?];
        let reach_px = [0, 1].map(|k| (bits[k] * next_px[k]).min(most_px).max(BAND_LEAST_PX));
        let mixed = |width: &f64| (0..2).any(|k| next_px[k] - reach_px[k] < FLAT * width);
        let ends_px = width_px.map_or(2.0, |width| 1.0 + 1.5 * width).min(0.25 * self.side.length_px);
        Some(Band { reach_px, ends_px, mixed_px: width_px.filter(mixed) })
    }

    /// The pixels of the band.
    fn samples(&self, image: &GreyImage, straight: &Straight, band: &Band) -> Option<Vec<Sample>> {
        let side = &self.side;
        let (first, last) = (straight.bent(side.from)?, straight.bent(side.at(1.0, 0.0))?);
        let level = (last.x - first.x).abs() >= (last.y - first.y).abs();
        // `u` counts along the side in the picture, column by column or row by row, `v` across it.
        let (start, end) = if level { (first.x, last.x) } else { (first.y, last.y) };
        let (low, high) = (start.min(end).ceil() as i64, start.max(end).floor() as i64);
        let reach = (band.reach_px[0].max(band.reach_px[1]) * std::f64::consts::SQRT_2).ceil() as i64 + 1;
        let stride = 1 + (high - low).max(0) as usize / MOST_COLUMNS;
        let mut samples = Vec::new();
        for u in (low..=high).step_by(stride) {
            let middle = straight.bent(side.at((u as f64 - start) / (end - start), 0.0))?;
            let middle = (if level { middle.y } else { middle.x }).round() as i64;
            for v in middle - reach..=middle + reach {
                let (x, y) = if level { (u, v) } else { (v, u) };
                let grey = image.grey(x, y)?;
                let Some(ideal) = straight.straightened(Pixel::new(x as f64, y as f64)) else { continue };
                samples.extend(self.sample(ideal, grey, band));
            }
        }
        Some(samples)
    }

    fn sample(&self, ideal: Pixel, grey: f64, band: &Band) -> Option<Sample> {
        let side = &self.side;
        let along_px = (ideal.x - side.from.x) * side.along.0 + (ideal.y - side.from.y) * side.along.1;
        let across_px = side.across(ideal);
        let within = along_px >= band.ends_px
            && along_px <= side.length_px - band.ends_px
            && across_px >= -band.reach_px[0]
            && across_px <= band.reach_px[1];
        if !within {
            return None;
        }
        let along = along_px / side.length_px - 0.5;
        let mut sample = Sample { along, across_px, grey, next_px: [FAR_PX; 2], white: 0.0 };
        if let (Some(row), Some(width_px)) = (self.row, band.mixed_px) {
            let bits = self.square.bits_from_pixel.pixel(Point::new(ideal.x, ideal.y))?;
            let bits_along = [bits.x, bits.y, 8.0 - bits.x, 8.0 - bits.y][self.k];
            sample.next_px = [-self.across_px(bits_along, 1.0)?, self.across_px(bits_along, -1.0)?];
            let bit_px = side.length_px / 8.0;
            let edge = |bit: usize| rise((bits_along - bit as f64) * bit_px / width_px).0 / 2.0;
            sample.white = (0..6).filter(|&i| row[i]).map(|i| edge(i + 1) - edge(i + 2)).sum();
        }
        Some(sample)
    }
}

/// A step from black to white, and the next ones to either side of it.
///
/// Its numbers: offset, slant, width (px), middle and height of the step, how much these two change along the side,
/// and by how much the table is lighter than the margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    numbers: [f64; STEP_NUMBERS],
    /// The standard deviation of what it does not explain, dirt apart (grey levels).
    typical: f64,
    /// The same over everything, as a part of the step's height.
    misfit: f64,
}

const STEP_NUMBERS: usize = 8;
/// A side worth fitting gives several pixels for each number.
const FEWEST_SAMPLES: usize = 20;
/// Steps lower than this many grey levels to either side of their middle tell nothing.
const LEAST_STEP: f64 = 4.0;
/// The highest step to either side of its middle: light that saturates the sensor may be a few times its range.
const HIGHEST_STEP: f64 = 500.0;
/// Gauss-Newton's steps until it settles...
const MOST_STEPS: usize = 20;
/// ... to this (px) ...
const STEP_SETTLED_PX: f64 = 1e-3;
/// ... of which the first find out how large a residual is typical.
const WEIGHING_STEPS: usize = 4;
/// A residual beyond this many times the typical one is dirt, and counts less.
const TYPICAL_RESIDUALS: f64 = 3.0;
/// No residual below a grey level, nor below this part of the step's height, is dirt: real steps have other shapes.
const LEAST_RESIDUAL: (f64, f64) = (1.0, 0.04);
/// No step is narrower than a pixel's own width allows (px).
const NARROWEST_PX: f64 = 0.35;
/// By so many grey levels tables differ from margins.
const GREY_SPREAD: f64 = 50.0;
/// How much of a misfit is left in the place of a side.
const MISFIT_LEFT: f64 = 0.3;
/// The sensor's limits: what lies beyond them looks like them.
const SATURATED: (f64, f64) = (0.5, 254.5);

impl Step {
    /// The step that fits best; `None` if there is none from dark to light, or not within the band.
    fn fitted(samples: &[Sample], band: &Band, before: Option<Self>) -> Option<Self> {
        if samples.len() < FEWEST_SAMPLES {
            return None;
        }
        let most_px = band.reach_px[0].max(band.reach_px[1]);
        let mut step = before.map_or_else(|| Self::guessed(samples, most_px), Self::recentred);
        let weighing = if before.is_some() { 0 } else { WEIGHING_STEPS };
        for k in 0..MOST_STEPS {
            let (normal, right) = step.normal_equations(samples);
            let change = normal.cholesky()?.solve(&right);
            let p = &mut step.numbers;
            for (p, change) in p.iter_mut().zip(change.iter()) {
                *p += change;
            }
            p[0] = p[0].clamp(-most_px, most_px);
            p[1] = p[1].clamp(-most_px, most_px);
            p[2] = p[2].clamp(NARROWEST_PX, most_px);
            p[4] = p[4].min(HIGHEST_STEP);
            if k < weighing {
                let middle = upper_median(samples.iter().map(|s| step.linearised(s).0.abs()))?;
                let least = LEAST_RESIDUAL.0.max(LEAST_RESIDUAL.1 * step.numbers[4]);
                step.typical = (middle * STD_OVER_MEDIAN_ABSOLUTE).max(least);
            } else if change[0].abs() + change[1].abs() < STEP_SETTLED_PX {
                break;
            }
        }
        let squares: f64 = samples.iter().map(|s| step.linearised(s).0.powi(2)).sum();
        step.misfit = (squares / samples.len() as f64).sqrt() / step.numbers[4].abs();
        let p = &step.numbers;
        let rises = p[4] > LEAST_STEP && p[4] > step.typical / 2.0;
        let inside = p[0].abs() + p[1].abs() / 2.0 < most_px;
        (rises && inside).then_some(step)
    }

    fn guessed(samples: &[Sample], most_px: f64) -> Self {
        let mean = |outside: bool| {
            let side = samples.iter().filter(|s| (s.across_px > 0.0) == outside);
            let (sum, n) = side.fold((0.0, f64::MIN_POSITIVE), |(sum, n), s| (sum + s.grey, n + 1.0));
            sum / n
        };
        let (black, white) = (mean(false), mean(true));
        let (middle, height) = (f64::midpoint(black, white), (white - black) / 2.0);
        let width_px = (most_px / 2.5).max(NARROWEST_PX);
        Self {
            numbers: [0.0, 0.0, width_px, middle, height, 0.0, 0.0, 0.0],
            typical: f64::INFINITY,
            misfit: 0.0,
        }
    }

    /// The same step as seen from the side that was moved onto it.
    fn recentred(mut self) -> Self {
        (self.numbers[0], self.numbers[1]) = (0.0, 0.0);
        self
    }

    fn width_px(&self) -> f64 {
        self.numbers[2]
    }

    /// About one standard deviation of the side's ends (px): grey that is not explained over the slope of the step;
    /// noise averages out over a side of some tens of pixels, a shadow's edge or dirt does not quite.
    pub(super) fn std_px(&self) -> f64 {
        MISFIT_LEFT * self.misfit * self.width_px()
    }

    /// What a pixel is lighter than expected, and how the expected grey changes with each number.
    fn linearised(&self, s: &Sample) -> (f64, [f64; STEP_NUMBERS]) {
        let [offset, slant, width, middle, height, middle_slant, height_slant, beyond] = self.numbers;
        let from_step = s.across_px - offset - slant * s.along;
        let height = height + height_slant * s.along;
        let z = [from_step / width, (-from_step - s.next_px[0]) / width, (from_step - s.next_px[1]) / width];
        let [(step, step_slope), (code, code_slope), (table, table_slope)] = z.map(rise);
        // From -1 in the black border to 1 in the margin, and up again where the code is white.
        let shape = step + s.white * (code + 1.0);
        let expected = middle + middle_slant * s.along + height * shape + beyond * (table + 1.0) / 2.0;
        let hidden =
            (s.grey > SATURATED.1 && expected > s.grey) || (s.grey < SATURATED.0 && expected < s.grey);
        if hidden {
            return (0.0, [0.0; STEP_NUMBERS]);
        }
        let by_place = height * (s.white * code_slope - step_slope) - beyond / 2.0 * table_slope;
        let by_width =
            height * (step_slope * z[0] + s.white * code_slope * z[1]) + beyond / 2.0 * table_slope * z[2];
        let changes = [
            by_place / width,
            by_place / width * s.along,
            -by_width / width,
            1.0,
            shape,
            s.along,
            s.along * shape,
            f64::midpoint(table, 1.0),
        ];
        (s.grey - expected, changes)
    }

    fn normal_equations(&self, samples: &[Sample]) -> Normal {
        let mut normal = SMatrix::identity() * SINGULAR;
        let mut right = SVector::zeros();
        for s in samples {
            let (residual, changes) = self.linearised(s);
            let far = residual / (TYPICAL_RESIDUALS * self.typical);
            let weight = 1.0 / (1.0 + far * far);
            for i in 0..STEP_NUMBERS {
                let weighed = weight * changes[i];
                right[i] += weighed * residual;
                for k in 0..=i {
                    normal[(i, k)] += weighed * changes[k];
                }
            }
        }
        // Where hardly any of the table is seen, its grey is the margin's.
        let believed = (self.typical.min(GREY_SPREAD) / GREY_SPREAD).powi(2);
        normal[(7, 7)] += believed;
        right[7] -= believed * self.numbers[7];
        (normal, right)
    }
}

/// From -1 to 1 as blur by a normal distribution of standard deviation 1 / sqrt(2) does it (the error function, to
/// four parts in ten thousand), and its slope.
fn rise(z: f64) -> (f64, f64) {
    if z < -FLAT {
        return (-1.0, 0.0);
    }
    let tanh = 1.0 - 2.0 / ((2.0 * z * (ERF.0 + ERF.1 * z * z)).exp() + 1.0);
    (tanh, (1.0 - tanh * tanh) * (ERF.0 + 3.0 * ERF.1 * z * z))
}

/// erf z is close to tanh (a z + b z^3), a being its slope at zero, 2 / sqrt(pi).
const ERF: (f64, f64) = (std::f64::consts::FRAC_2_SQRT_PI, 0.1009);
/// So far out the error function differs from one by less than a hundredth of a grey level.
const FLAT: f64 = 3.0;

type Normal = (SMatrix<f64, STEP_NUMBERS, STEP_NUMBERS>, SVector<f64, STEP_NUMBERS>);

/// Keeps the equations solvable where a number has no say, such as the width of a step between two pixels.
const SINGULAR: f64 = 1e-9;
