//! Where exactly do the four sides of a tag run?
//!
//! Across each side the grey rises from black to white; a smooth step, its height and middle free to change along
//! the side, is fitted to every pixel of the band.  Blur widens the step and does not move it.

use crate::capture::GreyImage;
use crate::capture::lens::Lens;
use crate::capture::pose::Homography;
use crate::geometry::{Pixel, Point};
use nalgebra::{SMatrix, SVector};

/// The way from the picture to one in which straight lines are straight, and back.
pub(super) struct Straight<'a> {
    pub(super) lens: Option<&'a Lens>,
}

impl Straight<'_> {
    fn straightened(&self, pixel: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(pixel), |lens| lens.straightened(pixel))
    }

    pub(super) fn bent(&self, ideal: Pixel) -> Option<Pixel> {
        self.lens.map_or(Some(ideal), |lens| lens.bent(ideal))
    }
}

/// How much of a bit's width the band reaches to either side: past it the code and the table begin.
const BAND_BITS: f64 = 0.85;
/// A band never reaches farther (px): no step of a usable picture is wider.
const BAND_MOST_PX: f64 = 6.0;
/// Nor less far: a step needs pixels on both sides.
const BAND_LEAST_PX: f64 = 1.2;
/// Once the width of a step is known, this many of it show all of its rise.
const BAND_WIDTHS: f64 = 4.0;
/// Longer sides are sampled at this many places.
const MOST_COLUMNS: usize = 128;
/// Steps lower than this many grey levels to either side of their middle tell nothing.
const LEAST_STEP: f64 = 4.0;
/// A fit that moves the corners by less than this (px) is the last: what the next would add is of second order.
const SETTLED_PX: f64 = 0.02;
/// Fits until they settle.
const MOST_FITS: usize = 8;

/// The corners of the quad near these, where straight lines are straight; `None` unless each side is one dark to
/// light step.
pub(super) fn fitted(image: &GreyImage, straight: &Straight, near_px: [Pixel; 4]) -> Option<[Pixel; 4]> {
    let mut corners = [Pixel::default(); 4];
    for (ideal, near) in corners.iter_mut().zip(near_px) {
        *ideal = straight.straightened(near)?;
    }
    let start = corners;
    let mut steps: [Option<Step>; 4] = [None; 4];
    for _ in 0..MOST_FITS {
        let mut sides = [Side::between(corners[0], corners[1]); 4];
        let bands = bands_px(&corners)?;
        for k in 0..4 {
            let side = Side::between(corners[k], corners[(k + 1) % 4]);
            let width_px = steps[k].map(|step| step.width_px());
            let band_px =
                width_px.map_or(bands[k], |width| bands[k].min(BAND_WIDTHS * width + BAND_LEAST_PX));
            let samples = side.samples(image, straight, band_px, width_px)?;
            let step = Step::fitted(&samples, band_px, steps[k])?;
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
        if moved_px < SETTLED_PX {
            break;
        }
    }
    // Noise may keep the last digits moving; what is left is far below a pixel.
    Some(corners)
}

/// How far the band of each side may reach so as to stay within the border inside and the margin outside.
fn bands_px(corners: &[Pixel; 4]) -> Option<[f64; 4]> {
    let square = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)];
    let pairs: Vec<_> = (0..4).map(|k| (Point::new(square[k].0, square[k].1), corners[k])).collect();
    let pixel_from_bits = Homography::fitted(&pairs)?;
    let middles = [
        ((4.0, 0.0), (0.0, -1.0)),
        ((8.0, 4.0), (1.0, 0.0)),
        ((4.0, 8.0), (0.0, 1.0)),
        ((0.0, 4.0), (-1.0, 0.0)),
    ];
    let mut bands = [0.0; 4];
    for (k, ((x, y), (dx, dy))) in middles.into_iter().enumerate() {
        let side = Side::between(corners[k], corners[(k + 1) % 4]);
        let across = |bits: f64| {
            pixel_from_bits.pixel(Point::new(x + bits * dx, y + bits * dy)).map(|p| side.across(p))
        };
        let bit_px = across(1.0)?.min(-across(-1.0)?);
        bands[k] = (BAND_BITS * bit_px).clamp(BAND_LEAST_PX, BAND_MOST_PX);
    }
    Some(bands)
}

/// A side of a quad that runs clockwise: its outside lies to the left as one looks along it.
#[derive(Clone, Copy)]
struct Side {
    from: Pixel,
    to: Pixel,
    length_px: f64,
    /// Unit vector along it.
    along: (f64, f64),
}

/// A pixel near a side: where along it (-0.5 to 0.5), how far outside it (px), and its grey.
struct Sample {
    along: f64,
    across_px: f64,
    grey: f64,
}

impl Side {
    fn between(from: Pixel, to: Pixel) -> Self {
        let length_px = from.distance_px(to).max(f64::MIN_POSITIVE);
        Self { from, to, length_px, along: ((to.x - from.x) / length_px, (to.y - from.y) / length_px) }
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

    /// The pixels within `band_px` of the side, those near its ends left out: there the next side blurs in.
    fn samples(
        &self,
        image: &GreyImage,
        straight: &Straight,
        band_px: f64,
        blur_px: Option<f64>,
    ) -> Option<Vec<Sample>> {
        let ends_px = blur_px.map_or(2.0, |blur| 1.0 + 1.5 * blur).min(0.25 * self.length_px);
        let (first, last) = (straight.bent(self.from)?, straight.bent(self.to)?);
        let level = (last.x - first.x).abs() >= (last.y - first.y).abs();
        // `u` counts along the side in the picture, column by column or row by row, `v` across it.
        let (start, end) = if level { (first.x, last.x) } else { (first.y, last.y) };
        let (low, high) = (start.min(end).ceil() as i64, start.max(end).floor() as i64);
        let reach = (band_px * std::f64::consts::SQRT_2).ceil() as i64 + 1;
        let stride = 1 + (high - low).max(0) as usize / MOST_COLUMNS;
        let mut samples = Vec::new();
        for u in (low..=high).step_by(stride) {
            let middle = straight.bent(self.at((u as f64 - start) / (end - start), 0.0))?;
            let middle = (if level { middle.y } else { middle.x }).round() as i64;
            for v in middle - reach..=middle + reach {
                let (x, y) = if level { (u, v) } else { (v, u) };
                let grey = image.grey(x, y)?;
                let Some(ideal) = straight.straightened(Pixel::new(x as f64, y as f64)) else { continue };
                let (dx, dy) = (ideal.x - self.from.x, ideal.y - self.from.y);
                let along_px = dx * self.along.0 + dy * self.along.1;
                let across_px = self.across(ideal);
                let within = along_px >= ends_px && along_px <= self.length_px - ends_px;
                if within && across_px.abs() <= band_px {
                    samples.push(Sample { along: along_px / self.length_px - 0.5, across_px, grey });
                }
            }
        }
        Some(samples)
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

/// A step from black to white: grey = middle + height tanh((across - offset - slant along) / width), where middle and
/// height change evenly along the side.
///
/// Its numbers: offset, slant, width (px), middle, height, and how much the last two change along the side.
#[derive(Clone, Copy)]
struct Step {
    numbers: [f64; STEP_NUMBERS],
    /// The standard deviation of what it does not explain (grey levels).
    typical: f64,
}

const STEP_NUMBERS: usize = 7;
/// A side worth fitting gives several pixels for each number.
const FEWEST_SAMPLES: usize = 20;
/// Gauss-Newton's steps until it settles...
const MOST_STEPS: usize = 20;
/// ... to this (px) ...
const STEP_SETTLED_PX: f64 = 1e-3;
/// ... of which the first find out how large a residual is typical.
const WEIGHING_STEPS: usize = 4;
/// A residual beyond this many times the typical one is dirt, and counts less.
const TYPICAL_RESIDUALS: f64 = 3.0;
/// The standard deviation of normal noise over its median size.
const STD_OVER_MEDIAN: f64 = 1.4826;
/// No step is narrower than a pixel's own width allows (px).
const NARROWEST_PX: f64 = 0.35;

impl Step {
    /// The step that fits best; `None` if there is none from dark to light, or not within the band.
    fn fitted(samples: &[Sample], band_px: f64, before: Option<Self>) -> Option<Self> {
        if samples.len() < FEWEST_SAMPLES {
            return None;
        }
        let Self { numbers: mut p, mut typical } =
            before.map_or_else(|| Self::guessed(samples, band_px), Self::recentred);
        let weighing = if before.is_some() { 0 } else { WEIGHING_STEPS };
        for k in 0..MOST_STEPS {
            let (normal, right) = normal_equations(samples, &p, typical);
            let change = normal.cholesky()?.solve(&right);
            for (p, change) in p.iter_mut().zip(change.iter()) {
                *p += change;
            }
            p[0] = p[0].clamp(-band_px, band_px);
            p[1] = p[1].clamp(-band_px, band_px);
            p[2] = p[2].clamp(NARROWEST_PX, band_px);
            if k < weighing {
                typical = (median(samples.iter().map(|s| residual(s, &p).abs()).collect()) * STD_OVER_MEDIAN)
                    .max(1.0);
            } else if change[0].abs() + change[1].abs() < STEP_SETTLED_PX {
                break;
            }
        }
        let rises = p[4] > LEAST_STEP && p[4] > typical / 2.0;
        let inside = p[0].abs() + p[1].abs() / 2.0 < band_px;
        (rises && inside).then_some(Self { numbers: p, typical })
    }

    fn guessed(samples: &[Sample], band_px: f64) -> Self {
        let mean = |outside: bool| {
            let side = samples.iter().filter(|s| (s.across_px > 0.0) == outside);
            let (sum, n) = side.fold((0.0, f64::MIN_POSITIVE), |(sum, n), s| (sum + s.grey, n + 1.0));
            sum / n
        };
        let (black, white) = (mean(false), mean(true));
        let middle = f64::midpoint(black, white);
        let width_px = (band_px / 3.0).max(NARROWEST_PX);
        let numbers = [0.0, 0.0, width_px, middle, (white - black) / 2.0, 0.0, 0.0];
        Self { numbers, typical: f64::INFINITY }
    }

    /// The same step as seen from the side that was moved onto it.
    fn recentred(mut self) -> Self {
        (self.numbers[0], self.numbers[1]) = (0.0, 0.0);
        self
    }

    fn width_px(&self) -> f64 {
        self.numbers[2]
    }
}

/// The hyperbolic tangent; an ulp or two is given away for half the time.
fn tanh(z: f64) -> f64 {
    1.0 - 2.0 / ((2.0 * z).exp() + 1.0)
}

fn residual(s: &Sample, p: &[f64; STEP_NUMBERS]) -> f64 {
    let rise = tanh((s.across_px - p[0] - p[1] * s.along) / p[2]);
    s.grey - (p[3] + p[5] * s.along + (p[4] + p[6] * s.along) * rise)
}

type Normal = (SMatrix<f64, STEP_NUMBERS, STEP_NUMBERS>, SVector<f64, STEP_NUMBERS>);

fn normal_equations(samples: &[Sample], p: &[f64; STEP_NUMBERS], typical: f64) -> Normal {
    let mut normal = SMatrix::identity() * SINGULAR;
    let mut right = SVector::zeros();
    for s in samples {
        let z = (s.across_px - p[0] - p[1] * s.along) / p[2];
        let rise = tanh(z);
        let height = p[4] + p[6] * s.along;
        let residual = s.grey - (p[3] + p[5] * s.along + height * rise);
        let slope = -height * (1.0 - rise * rise) / p[2];
        let row = [slope, slope * s.along, slope * z, 1.0, rise, s.along, s.along * rise];
        let far = residual / (TYPICAL_RESIDUALS * typical);
        let weight = 1.0 / (1.0 + far * far);
        for i in 0..STEP_NUMBERS {
            let weighed = weight * row[i];
            right[i] += weighed * residual;
            for k in 0..=i {
                normal[(i, k)] += weighed * row[k];
            }
        }
    }
    (normal, right)
}

/// Keeps the equations solvable where a number has no say, such as the width of a step between two pixels.
const SINGULAR: f64 = 1e-9;

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
