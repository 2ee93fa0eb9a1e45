//! Where are the four sides of a tag, to a hundredth of a pixel?
//!
//! Across each side the grey rises from black to white.  A smooth step whose height and middle may vary along the side
//! is fitted to all pixels of a band about it; blur widens the step without moving it.  Once the tag is decoded, the
//! neighbouring steps are part of the model (the code inside, the table outside), so that their blur does not bias it.

use super::family;
use super::undistortion::Undistortion;
use crate::capture::homography::Homography;
use crate::capture::image::GreyImage;
use crate::geometry::{Pixel, Point};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};
use nalgebra::{SMatrix, SVector};

/// Reach of the band inwards and outwards before the tag is decoded (bits): beyond it the code and the table begin...
const UNREAD_BITS: [f64; 2] = [0.85, 0.85];
/// ... and after it is decoded: up to the middle of the code's first row, and to the end of the margin.
const READ_BITS: [f64; 2] = [1.5, 1.0];
/// Largest reach of a band before the step's width is known (px): steps of usable pictures are narrower.
const BAND_MOST_PX: f64 = 6.0;
/// Smallest reach (px): a step needs pixels on both sides.
const BAND_LEAST_PX: f64 = 1.2;
/// Reach of a band in widths of its step, once that is known: it contains the whole rise.
const BAND_WIDTHS: f64 = 4.0;
/// Largest number of sampled columns (or rows) along a side.
const MOST_COLUMNS: usize = 80;
/// Largest motion of the corners in the last fit (px), before and after the tag is decoded: a further fit would change
/// them to second order only.
const CONVERGED_PX: [f64; 2] = [0.2, 0.01];
/// Largest number of fits.
const MOST_FITS: usize = 6;

/// The undistorted corners of the quad near these pixels, and the steps of its sides; `None` unless each side is a step
/// from dark to light.
///
/// `word` is the tag's code, if it is known; the first corner is then its top left one.  `steps` are the results of an
/// earlier fit of the same sides.
pub(super) fn fitted(
    image: &GreyImage,
    undistortion: &Undistortion,
    near_px: [Pixel; 4],
    word: Option<u64>,
    mut steps: [Option<Step>; 4],
) -> Option<([Pixel; 4], [Option<Step>; 4])> {
    let mut corners = [Pixel::default(); 4];
    for (ideal, near) in corners.iter_mut().zip(near_px) {
        *ideal = undistortion.undistorted(near)?;
    }
    let start = corners;
    for _ in 0..MOST_FITS {
        let mut sides = [Side::between(corners[0], corners[1]); 4];
        let square = Square::of(&corners)?;
        for k in 0..4 {
            let side = Side::between(corners[k], corners[(k + 1) % 4]);
            let model =
                SideModel { square: &square, k, row: word.map(|word| family::outer_row(word, k)), side };
            let band = model.band(steps[k].as_ref())?;
            let samples = model.samples(image, undistortion, &band)?;
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
        if moved_px < CONVERGED_PX[usize::from(word.is_some())] {
            break;
        }
    }
    // Without convergence the rest of the motion is far below a pixel.
    Some((corners, steps))
}

/// The maps between the tag's black square (eight by eight bits) and the undistorted picture.
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

/// A side of a clockwise quad: its outside is on the left of its direction.
#[derive(Clone, Copy)]
struct Side {
    from: Pixel,
    length_px: f64,
    /// Unit vector from its start to its end.
    along: (f64, f64),
}

impl Side {
    fn between(from: Pixel, to: Pixel) -> Self {
        let length_px = from.distance_px(to).max(f64::MIN_POSITIVE);
        Self { from, length_px, along: ((to.x - from.x) / length_px, (to.y - from.y) / length_px) }
    }

    /// The distance of a pixel from the side's line, positive outside (px).
    fn across(&self, p: Pixel) -> f64 {
        (p.x - self.from.x) * self.along.1 - (p.y - self.from.y) * self.along.0
    }

    fn at(&self, fraction: f64, across_px: f64) -> Pixel {
        let (dx, dy) = self.along;
        let (a, b) = (fraction * self.length_px, across_px);
        Pixel::new(self.from.x + a * dx + b * dy, self.from.y + a * dy - b * dx)
    }

    fn moved(&self, step: &Step) -> Self {
        let [offset_px, slant_px, ..] = step.parameters;
        Self::between(self.at(0.0, offset_px - slant_px / 2.0), self.at(1.0, offset_px + slant_px / 2.0))
    }

    /// The intersection of two sides' lines.
    fn crossing(&self, next: &Self) -> Option<Pixel> {
        let sine = self.along.0 * next.along.1 - self.along.1 * next.along.0;
        let fraction = -next.across(self.from) / sine / self.length_px;
        let meets = sine.abs() > PARALLEL && fraction.is_finite();
        meets.then(|| self.at(fraction, 0.0))
    }
}

/// Smallest angle between neighbouring sides (rad).
const PARALLEL: f64 = 0.15;

/// Side `k` of the square and the bits on both sides of it.
struct SideModel<'a> {
    square: &'a Square,
    k: usize,
    side: Side,
    /// Which bits of the code's first row inside the border are white, along the side; `None` until the tag is decoded.
    row: Option<[bool; 6]>,
}

/// The band of pixels about a side to which its step is fitted.
#[expect(clippy::struct_field_names, reason = "every field is in pixels")]
struct Band {
    /// Its reach inwards and outwards (px).
    reach_px: [f64; 2],
    /// Its distance from the side's ends, where the blur of the next side begins (px).
    ends_px: f64,
    /// The width of the step (px), if the blur of neighbouring steps extends into the band.
    mixed_px: Option<f64>,
}

/// A pixel near a side.
struct Sample {
    /// Position along the side, -0.5 to 0.5.
    along: f64,
    /// Distance from the side, positive outside (px).
    across_px: f64,
    grey: f64,
    /// Distance from the side to the code inside and to the table outside (px).
    next_px: [f64; 2],
    /// White fraction of the code there, 0 to 1.
    white: f64,
}

/// A distance beyond any blur (px), for neighbouring steps that are not modelled.
const FAR_PX: f64 = 1e3;

impl SideModel<'_> {
    /// The point at these distances along the side and inside it (bits), in the square's coordinates.
    fn square_point(&self, along: f64, inside: f64) -> Point {
        match self.k {
            0 => Point::new(along, inside),
            1 => Point::new(8.0 - inside, along),
            2 => Point::new(8.0 - along, 8.0 - inside),
            _ => Point::new(inside, 8.0 - along),
        }
    }

    /// The distance from the side's line of the point at these distances along and inside the side (px).
    fn across_px(&self, along: f64, inside: f64) -> Option<f64> {
        self.square.pixel_from_bits.pixel(self.square_point(along, inside)).map(|p| self.side.across(p))
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
    fn samples(&self, image: &GreyImage, undistortion: &Undistortion, band: &Band) -> Option<Vec<Sample>> {
        let side = &self.side;
        let (first, last) = (undistortion.distorted(side.from)?, undistortion.distorted(side.at(1.0, 0.0))?);
        let level = (last.x - first.x).abs() >= (last.y - first.y).abs();
        // `u` is the column (or row) along the side, `v` the row (or column) across it.
        let (start, end) = if level { (first.x, last.x) } else { (first.y, last.y) };
        let (low, high) = (start.min(end).ceil() as i64, start.max(end).floor() as i64);
        let reach = (band.reach_px[0].max(band.reach_px[1]) * std::f64::consts::SQRT_2).ceil() as i64 + 1;
        let stride = 1 + (high - low).max(0) as usize / MOST_COLUMNS;
        let mut samples = Vec::new();
        for u in (low..=high).step_by(stride) {
            let middle = undistortion.distorted(side.at((u as f64 - start) / (end - start), 0.0))?;
            let middle = (if level { middle.y } else { middle.x }).round() as i64;
            for v in middle - reach..=middle + reach {
                let (x, y) = if level { (u, v) } else { (v, u) };
                let grey = image.grey(x, y)?;
                let Some(ideal) = undistortion.undistorted(Pixel::new(x as f64, y as f64)) else { continue };
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

/// The model of a grey step from black to white with its neighbouring steps.
///
/// Its parameters: offset, slant, width (px), middle and height of the step (grey levels), the changes of these two along
/// the side, and the grey of the table minus that of the margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    parameters: [f64; STEP_PARAMETERS],
    /// Robust standard deviation of the residuals (grey levels).
    residual_std: f64,
    /// Root mean square of all residuals over the step's height.
    relative_rms: f64,
}

const STEP_PARAMETERS: usize = 8;
/// Smallest number of samples of a fit: several per parameter.
const FEWEST_SAMPLES: usize = 20;
/// Smallest height of a step above its middle (grey levels).
const LEAST_STEP: f64 = 4.0;
/// Largest height of a step above its middle (grey levels): light that saturates the sensor may be a few times its range.
const HIGHEST_STEP: f64 = 500.0;
/// Largest number of Gauss-Newton steps...
const MOST_STEPS: usize = 20;
/// ... the change of a converged step (px) ...
const STEP_CONVERGED_PX: f64 = 1e-3;
/// ... and the number of first steps that estimate the residuals' standard deviation.
const SCALE_STEPS: usize = 4;
/// Scale of the robust weight 1 / (1 + r^2) of a residual (Cauchy), in standard deviations.
const CAUCHY_SCALE: f64 = 3.0;
/// Smallest standard deviation of the residuals: grey levels, and a fraction of the step's height, because real steps
/// differ from the model.
const LEAST_STD: (f64, f64) = (1.0, 0.04);
/// Smallest width of a step (px): a pixel averages over its own width.
const NARROWEST_PX: f64 = 0.35;
/// Prior standard deviation of the table's grey minus the margin's (grey levels).
const GREY_SPREAD: f64 = 50.0;
/// Fraction of the residuals that remains in a side's position.
const REMAINING_FRACTION: f64 = 0.3;
/// Grey levels at which the sensor saturates.
const SATURATED: (f64, f64) = (0.5, 254.5);

impl Step {
    /// The fitted step; `None` if it does not rise from dark to light, or is outside the band.
    fn fitted(samples: &[Sample], band: &Band, before: Option<Self>) -> Option<Self> {
        if samples.len() < FEWEST_SAMPLES {
            return None;
        }
        let most_px = band.reach_px[0].max(band.reach_px[1]);
        let mut step = before.map_or_else(|| Self::guessed(samples, most_px), Self::recentred);
        let scale_steps = if before.is_some() { 0 } else { SCALE_STEPS };
        for k in 0..MOST_STEPS {
            let (normal, right) = step.normal_equations(samples);
            let change = normal.cholesky()?.solve(&right);
            let p = &mut step.parameters;
            for (p, change) in p.iter_mut().zip(change.iter()) {
                *p += change;
            }
            p[0] = p[0].clamp(-most_px, most_px);
            p[1] = p[1].clamp(-most_px, most_px);
            p[2] = p[2].clamp(NARROWEST_PX, most_px);
            p[4] = p[4].min(HIGHEST_STEP);
            if k < scale_steps {
                let sizes = samples.iter().map(|s| step.linearised(s).0.abs());
                let least = LEAST_STD.0.max(LEAST_STD.1 * step.parameters[4]);
                step.residual_std = (upper_median(sizes)? * STD_OVER_MEDIAN_ABSOLUTE).max(least);
            } else if change[0].abs() + change[1].abs() < STEP_CONVERGED_PX {
                break;
            }
        }
        let squares: f64 = samples.iter().map(|s| step.linearised(s).0.powi(2)).sum();
        step.relative_rms = (squares / samples.len() as f64).sqrt() / step.parameters[4].abs();
        let p = &step.parameters;
        let rises = p[4] > LEAST_STEP && p[4] > step.residual_std / 2.0;
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
            parameters: [0.0, 0.0, width_px, middle, height, 0.0, 0.0, 0.0],
            residual_std: f64::INFINITY,
            relative_rms: 0.0,
        }
    }

    /// The same step in the coordinates of the side that was moved onto it.
    fn recentred(mut self) -> Self {
        (self.parameters[0], self.parameters[1]) = (0.0, 0.0);
        self
    }

    fn width_px(&self) -> f64 {
        self.parameters[2]
    }

    /// About one standard deviation of the side's ends (px): residual grey over the slope of the step, times the fraction
    /// that does not average out over a side of some tens of pixels, as with a shadow's edge or dirt.
    pub(super) fn std_px(&self) -> f64 {
        REMAINING_FRACTION * self.relative_rms * self.width_px()
    }

    /// The residual of a sample (measured minus modelled grey) and the derivatives of the modelled grey by the parameters.
    fn linearised(&self, s: &Sample) -> (f64, [f64; STEP_PARAMETERS]) {
        let [offset, slant, width, middle, height, middle_slant, height_slant, beyond] = self.parameters;
        let from_step = s.across_px - offset - slant * s.along;
        let height = height + height_slant * s.along;
        let z = [from_step / width, (-from_step - s.next_px[0]) / width, (from_step - s.next_px[1]) / width];
        let [(step, step_slope), (code, code_slope), (table, table_slope)] = z.map(rise);
        // From -1 in the black border to 1 in the margin, and towards 1 where the code is white.
        let shape = step + s.white * (code + 1.0);
        let expected = middle + middle_slant * s.along + height * shape + beyond * (table + 1.0) / 2.0;
        let saturated =
            (s.grey > SATURATED.1 && expected > s.grey) || (s.grey < SATURATED.0 && expected < s.grey);
        if saturated {
            return (0.0, [0.0; STEP_PARAMETERS]);
        }
        let by_position = height * (s.white * code_slope - step_slope) - beyond / 2.0 * table_slope;
        let by_width =
            height * (step_slope * z[0] + s.white * code_slope * z[1]) + beyond / 2.0 * table_slope * z[2];
        let changes = [
            by_position / width,
            by_position / width * s.along,
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
            let far = residual / (CAUCHY_SCALE * self.residual_std);
            let weight = 1.0 / (1.0 + far * far);
            for i in 0..STEP_PARAMETERS {
                let weighted = weight * changes[i];
                right[i] += weighted * residual;
                for k in 0..=i {
                    normal[(i, k)] += weighted * changes[k];
                }
            }
        }
        // Prior: the table's grey equals the margin's
        let prior = (self.residual_std.min(GREY_SPREAD) / GREY_SPREAD).powi(2);
        normal[(7, 7)] += prior;
        right[7] -= prior * self.parameters[7];
        (normal, right)
    }
}

/// The error function (to 4e-4) and its derivative: a step from -1 to 1 blurred by a normal distribution.
fn rise(z: f64) -> (f64, f64) {
    if z < -FLAT {
        return (-1.0, 0.0);
    }
    let tanh = 1.0 - 2.0 / ((2.0 * z * (ERF.0 + ERF.1 * z * z)).exp() + 1.0);
    (tanh, (1.0 - tanh * tanh) * (ERF.0 + 3.0 * ERF.1 * z * z))
}

/// erf z is close to tanh (a z + b z^3), a being its slope at zero, 2 / sqrt(pi).
const ERF: (f64, f64) = (std::f64::consts::FRAC_2_SQRT_PI, 0.1009);
/// Argument beyond which the error function counts as one: the difference is below a hundredth of a grey level.
const FLAT: f64 = 3.0;

type Normal = (SMatrix<f64, STEP_PARAMETERS, STEP_PARAMETERS>, SVector<f64, STEP_PARAMETERS>);

/// Added to the diagonal of the normal matrix, which is singular where the samples do not determine a parameter.
const SINGULAR: f64 = 1e-9;
