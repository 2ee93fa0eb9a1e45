//! What is marker and what is background in the part of a picture around a component?

use super::super::label::{Component, Window};
use super::super::threshold::Level;
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use crate::moments::Moments;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};

/// Beyond its threshold outline a marker fades over this far (px), whatever the lens: a point of light covers
/// about two pixels in a sharp picture.
pub(super) const RIM_PX: u8 = 3;
/// The local background is read in a band of this width around the rim (px).
const BAND_PX: u8 = 3;

/// Distances are counted in thirds of a pixel.
pub(super) const THIRDS: u8 = 3;

/// The part of the picture around a component; everything in it is stored row by row.
pub(super) struct Patch {
    window: Window,
    width: usize,
    height: usize,
}

fn grey(image: &GreyImage, x: usize, y: usize) -> f64 {
    f64::from(image.pixels[y * image.width + x])
}

/// The local background: a plane of grey levels.
pub(super) struct Plane {
    origin: Pixel,
    level: f64,
    slope: [f64; 2],
    /// Robust standard deviation of the grey levels about it.
    pub scatter: f64,
    /// Root mean square difference, outliers included.
    pub unevenness: f64,
}

impl Plane {
    pub(super) fn at_place(&self, place: Pixel) -> f64 {
        self.level + self.slope[0] * (place.x - self.origin.x) + self.slope[1] * (place.y - self.origin.y)
    }
}

impl Patch {
    pub(super) fn around(image: &GreyImage, component: &Component, blur_px: [f64; 2]) -> Self {
        let pad = |blur: f64| (f64::from(RIM_PX + BAND_PX) + blur.abs() / 2.0).ceil() as usize;
        let span = |[first, last]: [u32; 2], pad: usize, size: usize| {
            [(first as usize).saturating_sub(pad), (last as usize + 1 + pad).min(size)]
        };
        let window = Window {
            x: span(component.x, pad(blur_px[0]), image.width),
            y: span(component.y, pad(blur_px[1]), image.height),
        };
        let (width, height) = (window.x[1] - window.x[0], window.y[1] - window.y[0]);
        Self { window, width, height }
    }

    /// The background's grey level at each pixel, were there no marker.
    pub(super) fn light(&self, plane: &Plane) -> Vec<f64> {
        let Window { x, y } = self.window;
        let along: Vec<f64> = (x[0]..x[1]).map(|x| plane.slope[0] * (x as f64 - plane.origin.x)).collect();
        let mut light = Vec::with_capacity(self.width * self.height);
        for y in y[0]..y[1] {
            let level = plane.level + plane.slope[1] * (y as f64 - plane.origin.y);
            light.extend(along.iter().map(|more| level + more));
        }
        light
    }

    /// How far each pixel is from the background towards the marker's grey.
    pub(super) fn depths(&self, image: &GreyImage, light: &[f64], light_over_dark: f64) -> Vec<f64> {
        let Window { x, y } = self.window;
        let mut depths = Vec::with_capacity(light.len());
        for (y, light) in (y[0]..y[1]).zip(light.chunks_exact(self.width)) {
            let pixels = &image.pixels[y * image.width..][x[0]..x[1]];
            depths.extend(pixels.iter().zip(light).map(|(&p, l)| light_over_dark * (l - f64::from(p))));
        }
        depths
    }

    /// What the patch's pixels add up to, each counted by its weight; none without any.
    pub(super) fn moments(&self, weights: &[f64]) -> Option<Moments> {
        // About the patch's own corner: far from the picture's origin the sums would lose digits.
        let (mut area, mut first, mut second) = (0.0, [0.0; 2], [0.0; 3]);
        for (y, row) in weights.chunks_exact(self.width).enumerate() {
            let (mut sum, mut along, mut square) = (0.0, 0.0, 0.0);
            for (x, weight) in row.iter().enumerate() {
                let x = x as f64;
                (sum, along, square) = (sum + weight, along + weight * x, square + weight * x * x);
            }
            let y = y as f64;
            area += sum;
            first = [first[0] + along, first[1] + y * sum];
            second = [second[0] + square, second[1] + y * along, second[2] + y * y * sum];
        }
        if area <= 0.0 {
            return None;
        }
        let [x, y] = first.map(|sum| sum / area);
        let [xx, xy, yy] = second.map(|sum| sum / area);
        let corner = [self.window.x[0] as f64, self.window.y[0] as f64];
        Some(Moments {
            area,
            centroid: [corner[0] + x, corner[1] + y],
            covariance: [xx - x * x, xy - x * y, yy - y * y],
        })
    }

    pub(super) fn index(&self, x: usize, y: usize) -> usize {
        (y - self.window.y[0]) * self.width + x - self.window.x[0]
    }

    /// The foreground pixels that hang together with the seed.
    ///
    /// Runs of a row take over from the rows beside them, downwards and upwards by turns until nothing is added.
    pub(super) fn connected(&self, image: &GreyImage, level: Level, seed: usize) -> Vec<bool> {
        let mut apart = self.runs(image, level);
        let mut connected = vec![false; self.width * self.height];
        connected[seed] = true;
        let mut before = apart.len() + 1;
        while apart.len() < before {
            before = apart.len();
            for _ in 0..2 {
                apart.retain(|&[start, stop]| {
                    let joins = self.touches(&connected, start, stop);
                    if joins {
                        connected[start..stop].fill(true);
                    }
                    !joins
                });
                apart.reverse();
            }
        }
        connected
    }

    /// The runs of foreground, row by row: each from its first pixel to behind its last.
    fn runs(&self, image: &GreyImage, level: Level) -> Vec<[usize; 2]> {
        let Window { x, y } = self.window;
        let mut runs = Vec::new();
        for (k, row) in (y[0]..y[1]).map(|y| &image.pixels[y * image.width..][x[0]..x[1]]).enumerate() {
            let mut at = 0;
            while let Some(ahead) = row[at..].iter().position(|&p| level.holds(p)) {
                let start = at + ahead;
                let length = row[start..].iter().position(|&p| !level.holds(p));
                at = length.map_or(row.len(), |length| start + length);
                runs.push([k * self.width + start, k * self.width + at]);
            }
        }
        runs
    }

    /// Whether a run touches the mask, in its own row or beside it.
    fn touches(&self, mask: &[bool], start: usize, stop: usize) -> bool {
        let row = start / self.width * self.width;
        let reach = [start.max(row + 1) - 1, (stop + 1).min(row + self.width)];
        let width = self.width.cast_signed();
        [0, -width, width].into_iter().any(|shift| {
            let [from, to] = reach.map(|k| k.wrapping_add_signed(shift));
            mask.get(from..to).is_some_and(|near| near.contains(&true))
        })
    }

    /// The mask drawn out to both sides by half the blur.
    pub(super) fn smeared(&self, mask: &[bool], [bx, by]: [f64; 2]) -> Vec<bool> {
        let steps = (bx.abs().max(by.abs()) / 2.0).ceil() as i32;
        let mut smeared = mask.to_vec();
        for step in -steps..=steps {
            let part = f64::from(step) / f64::from(2 * steps).max(1.0);
            let (dx, dy) = ((bx * part).round() as isize, (by * part).round() as isize);
            // Where a shifted row begins to be inside, and where it is taken from.
            let (to, from) = (dx.max(0) as usize, (-dx).max(0) as usize);
            for (y, row) in mask.chunks_exact(self.width).enumerate() {
                let under = y.wrapping_add_signed(dy);
                if under < self.height && to.max(from) < self.width {
                    let shifted = &mut smeared[under * self.width + to..(under + 1) * self.width - from];
                    shifted.iter_mut().zip(&row[from..]).for_each(|(s, &inside)| *s |= inside);
                }
            }
        }
        smeared
    }

    /// How far each pixel is from the mask, in thirds of a pixel (chamfer 3-4 distance, right within 8 %).
    pub(super) fn distances(&self, mask: &[bool]) -> Vec<u8> {
        let mut thirds: Vec<u8> = mask.iter().map(|&inside| if inside { 0 } else { u8::MAX }).collect();
        // The way forward looks left and up, the way back (the same on the reversed patch) right and down.
        let mut above = vec![u8::MAX; self.width + 2];
        for _ in 0..2 {
            above.fill(u8::MAX);
            for row in thirds.chunks_exact_mut(self.width) {
                let sides = above.iter().zip(&above[2..]).map(|(left, right)| *left.min(right));
                for (third, (up, side)) in row.iter_mut().zip(above[1..].iter().zip(sides)) {
                    *third = (*third).min(up.saturating_add(THIRDS)).min(side.saturating_add(THIRDS + 1));
                }
                let mut left = u8::MAX;
                for third in row.iter_mut() {
                    left = (*third).min(left.saturating_add(THIRDS));
                    *third = left;
                }
                above[1..=self.width].copy_from_slice(row);
            }
            thirds.reverse();
        }
        thirds
    }

    /// The plane through the band around the rim, whatever lies across part of it left out.
    pub(super) fn background(&self, image: &GreyImage, away: &[u8]) -> Option<Plane> {
        let mut band: Vec<(f64, f64, f64)> = Vec::new();
        for (y, row) in (self.window.y[0]..).zip(away.chunks_exact(self.width)) {
            for (x, away) in (self.window.x[0]..).zip(row) {
                if (THIRDS * RIM_PX + 1..=THIRDS * (RIM_PX + BAND_PX)).contains(away) {
                    band.push((x as f64, y as f64, grey(image, x, y)));
                }
            }
        }
        if band.len() < LEAST_BAND {
            return None;
        }
        let n = band.len() as f64;
        let mean = |f: fn(&(f64, f64, f64)) -> f64| band.iter().map(f).sum::<f64>() / n;
        let origin = Pixel::new(mean(|p| p.0), mean(|p| p.1));
        let level = upper_median(band.iter().map(|p| p.2))?;
        let mut plane = Plane { origin, level, slope: [0.0, 0.0], scatter: 0.0, unevenness: 0.0 };
        for _ in 0..PLANE_ROUNDS {
            let off: Vec<f64> = band.iter().map(|&(x, y, g)| g - plane.at_place(Pixel::new(x, y))).collect();
            plane.scatter =
                (STD_OVER_MEDIAN_ABSOLUTE * upper_median(off.iter().map(|r| r.abs()))?).max(ROUNDING_STD);
            plane.unevenness = (off.iter().map(|r| r * r).sum::<f64>() / n).sqrt();
            let limit = OUTLIER_STDS * plane.scatter;
            let near = band.iter().zip(&off).filter(|&(_, r)| r.abs() <= limit);
            let before = (plane.origin, plane.level, plane.slope);
            plane.fit(&near.map(|(&p, _)| p).collect::<Vec<_>>());
            if before == (plane.origin, plane.level, plane.slope) {
                break;
            }
        }
        Some(plane)
    }
}

/// A plane needs some pixels around it.
const LEAST_BAND: usize = 8;
/// Fits and rejections by turns, until nothing changes; more change nothing visible.
const PLANE_ROUNDS: usize = 5;
/// Standard deviations beyond which a grey level is something else than background.
const OUTLIER_STDS: f64 = 3.0;
/// The standard deviation of rounding to whole grey levels.
const ROUNDING_STD: f64 = 0.29;

impl Plane {
    /// Least squares; the sums about the pixels' own mean keep the three equations apart.
    fn fit(&mut self, pixels: &[(f64, f64, f64)]) {
        let n = pixels.len() as f64;
        let sum = |f: &dyn Fn(&(f64, f64, f64)) -> f64| pixels.iter().map(f).sum::<f64>();
        let (mx, my, mg) = (sum(&|p| p.0) / n, sum(&|p| p.1) / n, sum(&|p| p.2) / n);
        let (xx, xy, yy) = (
            sum(&|p| (p.0 - mx) * (p.0 - mx)),
            sum(&|p| (p.0 - mx) * (p.1 - my)),
            sum(&|p| (p.1 - my) * (p.1 - my)),
        );
        let (xg, yg) = (sum(&|p| (p.0 - mx) * p.2), sum(&|p| (p.1 - my) * p.2));
        let determinant = xx * yy - xy * xy;
        if n < LEAST_BAND as f64 || determinant <= 0.0 {
            return;
        }
        self.slope = [(yy * xg - xy * yg) / determinant, (xx * yg - xy * xg) / determinant];
        (self.origin, self.level) = (Pixel::new(mx, my), mg);
    }
}
