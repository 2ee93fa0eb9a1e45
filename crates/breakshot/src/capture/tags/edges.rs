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
/// Longer sides are sampled at this many places.
const MOST_COLUMNS: usize = 200;
/// Steps lower than this many grey levels to either side of their middle tell nothing.
const LEAST_STEP: f64 = 4.0;
/// Between two fits the corners must settle to this (px), far below any noise.
const SETTLED_PX: f64 = 2e-3;
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
    let mut blur_px = [None; 4];
    for _ in 0..MOST_FITS {
        let mut sides = [Side::between(corners[0], corners[1]); 4];
        let bands = bands_px(&corners)?;
        for k in 0..4 {
            let side = Side::between(corners[k], corners[(k + 1) % 4]);
            let samples = side.samples(image, straight, bands[k], blur_px[k])?;
            let step = Step::fitted(&samples, bands[k])?;
            blur_px[k] = Some(step.width_px);
            sides[k] = side.moved(&step);
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
            return Some(corners);
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
    let middles = [((4.0, 0.0), (0.0, -1.0)), ((8.0, 4.0), (1.0, 0.0)), ((4.0, 8.0), (0.0, 1.0)), ((0.0, 4.0), (-1.0, 0.0))];
    let mut bands = [0.0; 4];
    for (k, ((x, y), (dx, dy))) in middles.into_iter().enumerate() {
        let side = Side::between(corners[k], corners[(k + 1) % 4]);
        let across = |bits: f64| pixel_from_bits.pixel(Point::new(x + bits * dx, y + bits * dy)).map(|p| side.across(p));
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
    fn samples(&self, image: &GreyImage, straight: &Straight, band_px: f64, blur_px: Option<f64>) -> Option<Vec<Sample>> {
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
        Self::between(self.at(0.0, step.offset_px - step.slant_px / 2.0), self.at(1.0, step.offset_px + step.slant_px / 2.0))
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

/// A step from black to white: grey = middle + height tanh((across - offset - slant along) / width).
struct Step {
    offset_px: f64,
    slant_px: f64,
    width_px: f64,
}

/// Gauss-Newton's steps until it settles.
const MOST_STEPS: usize = 25;
/// A residual beyond this many times the typical one is dirt, and counts less.
const TYPICAL_RESIDUALS: f64 = 3.0;
/// The widest and the narrowest step, as a part of the band and in px.
const WIDTHS: (f64, f64) = (0.35, 1.0);

impl Step {
    /// The step that fits best; `None` if there is none from dark to light, or not within the band.
    fn fitted(samples: &[Sample], band_px: f64) -> Option<Self> {
        if samples.len() < FEWEST_SAMPLES {
            return None;
        }
        let mean = |outside: bool| {
            let side = samples.iter().filter(|s| (s.across_px > 0.0) == outside);
            let (sum, n) = side.fold((0.0, 0.0), |(sum, n), s| (sum + s.grey, n + 1.0));
            (n > 0.0).then(|| sum / n)
        };
        let (black, white) = (mean(false)?, mean(true)?);
        // offset, slant, width, middle, height, and how the last two change along the side.
        let width_px = (band_px / 3.0).max(WIDTHS.0);
        let mut p = SVector::<f64, 7>::from([0.0, 0.0, width_px, f64::midpoint(black, white), (white - black) / 2.0, 0.0, 0.0]);
        let mut typical = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let (normal, right, residuals) = normal_equations(samples, &p, typical);
            typical = median(residuals).max(1.0) * 1.4826;
            let change = normal.cholesky()?.solve(&right);
            p += change;
            p[2] = p[2].clamp(WIDTHS.0, WIDTHS.1 * band_px);
            p[0] = p[0].clamp(-band_px, band_px);
            p[1] = p[1].clamp(-band_px, band_px);
            if change[0].abs() + change[1].abs() < SETTLED_PX / 4.0 {
                break;
            }
        }
        let rises = p[4] > LEAST_STEP && p[4] > typical / 2.0;
        let inside = p[0].abs() + p[1].abs() / 2.0 < band_px;
        (rises && inside).then(|| Self { offset_px: p[0], slant_px: p[1], width_px: p[2] })
    }
}

/// A step has seven numbers; a side worth fitting gives several pixels for each.
const FEWEST_SAMPLES: usize = 20;

type Normal = SMatrix<f64, 7, 7>;

fn normal_equations(samples: &[Sample], p: &SVector<f64, 7>, typical: f64) -> (Normal, SVector<f64, 7>, Vec<f64>) {
    let (mut normal, mut right) = (Normal::identity() * 1e-9, SVector::<f64, 7>::zeros());
    let mut residuals = Vec::with_capacity(samples.len());
    for s in samples {
        let z = (s.across_px - p[0] - p[1] * s.along) / p[2];
        let rise = z.tanh();
        let height = p[4] + p[6] * s.along;
        let residual = s.grey - (p[3] + p[5] * s.along + height * rise);
        let slope = -height * (1.0 - rise * rise) / p[2];
        let row = SVector::<f64, 7>::from([
            slope, slope * s.along, slope * z, 1.0, rise, s.along, s.along * rise,
        ]);
        let far = residual / (TYPICAL_RESIDUALS * typical);
        let weight = 1.0 / (1.0 + far * far);
        normal += row * row.transpose() * weight;
        right += row * (residual * weight);
        residuals.push(residual.abs());
    }
    (normal, right, residuals)
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
