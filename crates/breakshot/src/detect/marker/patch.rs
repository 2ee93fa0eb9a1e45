//! What is marker and what is background in the part of an image around a component?

use super::super::label::{Component, Window};
use super::super::threshold::Level;
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use crate::geometry::moments::Moments;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, upper_median};

/// Width of the rim around the thresholded outline in which a marker fades into the background (px), for any lens: a
/// point source covers about two pixels in a sharp image.
pub(super) const RIM_PX: u8 = 3;
/// Width of the band around the rim in which the background is measured (px).
const BAND_PX: u8 = 3;
/// Distances are counted in thirds of a pixel.
pub(super) const THIRDS: u8 = 3;
/// Least number of pixels in the band for a fit of a plane.
const LEAST_BAND_PX: usize = 8;
/// Rounds of fitting and rejecting outliers, unless the fit stops changing before; more have no visible effect.
const PLANE_ROUNDS: usize = 5;
/// A grey level further than this from the plane (standard deviations) is not background.
const OUTLIER_STDS: f64 = 3.0;
/// Standard deviation of rounding to integer grey levels.
const ROUNDING_STD: f64 = 0.29;

/// The part of the image around a component; masks and weights of its pixels are stored row by row.
pub(super) struct Patch {
    window: Window,
    width: usize,
    height: usize,
}

/// The local background: a plane of grey levels over x and y.
pub(super) struct Plane {
    origin: Pixel,
    grey_at_origin: f64,
    slope: [f64; 2],
    /// Robust standard deviation of the grey levels about the plane.
    pub scatter: f64,
    /// Root mean square difference from the plane, with outliers.
    pub rms: f64,
}

impl Patch {
    /// The bounding box of the component with its rim, band and half of its motion blur around it.
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

    /// The background's grey level at each pixel.
    pub(super) fn background_levels(&self, plane: &Plane) -> Vec<f64> {
        let Window { x, y } = self.window;
        let along: Vec<f64> = (x[0]..x[1]).map(|x| plane.slope[0] * (x as f64 - plane.origin.x)).collect();
        let mut levels = Vec::with_capacity(self.width * self.height);
        for y in y[0]..y[1] {
            let level = plane.grey_at_origin + plane.slope[1] * (y as f64 - plane.origin.y);
            levels.extend(along.iter().map(|more| level + more));
        }
        levels
    }

    /// Background minus grey level of each pixel, times `sign`.
    pub(super) fn depths(&self, image: &GreyImage, background: &[f64], sign: f64) -> Vec<f64> {
        let Window { x, y } = self.window;
        let mut depths = Vec::with_capacity(background.len());
        for (y, background) in (y[0]..y[1]).zip(background.chunks_exact(self.width)) {
            let pixels = &image.pixels[y * image.width..][x[0]..x[1]];
            depths.extend(pixels.iter().zip(background).map(|(&p, b)| sign * (b - f64::from(p))));
        }
        depths
    }

    /// Moments of the weights, in image coordinates (px); `None` if their sum is not positive.
    pub(super) fn moments(&self, weights: &[f64]) -> Option<Moments> {
        // Relative to the patch's corner: far from the image's origin the sums would lose digits.
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

    /// Index of an image's pixel in the patch.
    pub(super) fn index(&self, x: usize, y: usize) -> usize {
        (y - self.window.y[0]) * self.width + x - self.window.x[0]
    }

    /// Mask of the foreground that is 8-connected with the seed.
    ///
    /// Runs join the mask if they touch it, in alternating passes down and up until no run joins.
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

    /// The runs of foreground, row by row, as indices of their first pixel and of the one after their last.
    fn runs(&self, image: &GreyImage, level: Level) -> Vec<[usize; 2]> {
        let Window { x, y } = self.window;
        let mut runs = Vec::new();
        for (k, row) in (y[0]..y[1]).map(|y| &image.pixels[y * image.width..][x[0]..x[1]]).enumerate() {
            let mut at = 0;
            while let Some(ahead) = row[at..].iter().position(|&p| level.is_foreground(p)) {
                let start = at + ahead;
                let length = row[start..].iter().position(|&p| !level.is_foreground(p));
                at = length.map_or(row.len(), |length| start + length);
                runs.push([k * self.width + start, k * self.width + at]);
            }
        }
        runs
    }

    /// Whether a run touches the mask, in its own row or in a neighbouring one.
    fn touches(&self, mask: &[bool], start: usize, stop: usize) -> bool {
        let row = start / self.width * self.width;
        let reach = [start.max(row + 1) - 1, (stop + 1).min(row + self.width)];
        let width = self.width.cast_signed();
        [0, -width, width].into_iter().any(|shift| {
            let [from, to] = reach.map(|k| k.wrapping_add_signed(shift));
            mask.get(from..to).is_some_and(|near| near.contains(&true))
        })
    }

    /// The mask extended by half of the motion blur to either side.
    pub(super) fn smeared(&self, mask: &[bool], [bx, by]: [f64; 2]) -> Vec<bool> {
        let steps = (bx.abs().max(by.abs()) / 2.0).ceil() as i32;
        let mut smeared = mask.to_vec();
        for step in -steps..=steps {
            let fraction = f64::from(step) / f64::from(2 * steps).max(1.0);
            let (dx, dy) = ((bx * fraction).round() as isize, (by * fraction).round() as isize);
            // First column of a shifted row inside the patch, and the column it comes from.
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

    /// Distance of each pixel from the mask in thirds of a pixel (chamfer 3-4 distance, Borgefors 1986; within 8 %).
    pub(super) fn distance_thirds(&self, mask: &[bool]) -> Vec<u8> {
        let mut thirds: Vec<u8> = mask.iter().map(|&inside| if inside { 0 } else { u8::MAX }).collect();
        // The forward pass propagates from the left and from above; the backward pass is the same on the reversed
        // patch.
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

    /// Puts the pixels on a disc or on its rim that are nearer to that disc than to the mask beyond all distances from the mask.
    pub(super) fn leave_out(&self, centre: Pixel, radius_px: f64, thirds: &mut [u8]) {
        for (y, row) in (self.window.y[0]..).zip(thirds.chunks_exact_mut(self.width)) {
            for (x, thirds) in (self.window.x[0]..).zip(row) {
                let outside_px = Pixel::new(x as f64, y as f64).distance_px(centre) - radius_px;
                let is_on_rim = outside_px <= f64::from(RIM_PX);
                if is_on_rim && outside_px * f64::from(THIRDS) < f64::from(*thirds) {
                    *thirds = u8::MAX;
                }
            }
        }
    }

    /// The plane through the grey levels of the band around the rim, fitted without outliers.
    pub(super) fn background(&self, image: &GreyImage, thirds: &[u8]) -> Option<Plane> {
        let mut band: Vec<BandPixel> = Vec::new();
        for (y, row) in (self.window.y[0]..).zip(thirds.chunks_exact(self.width)) {
            for (x, thirds) in (self.window.x[0]..).zip(row) {
                if (THIRDS * RIM_PX + 1..=THIRDS * (RIM_PX + BAND_PX)).contains(thirds) {
                    let grey = f64::from(image.pixels[y * image.width + x]);
                    band.push(BandPixel { x: x as f64, y: y as f64, grey });
                }
            }
        }
        if band.len() < LEAST_BAND_PX {
            return None;
        }
        let n = band.len() as f64;
        let mean = |f: fn(&BandPixel) -> f64| band.iter().map(f).sum::<f64>() / n;
        let origin = Pixel::new(mean(|p| p.x), mean(|p| p.y));
        let grey_at_origin = upper_median(band.iter().map(|p| p.grey))?;
        let mut plane = Plane { origin, grey_at_origin, slope: [0.0, 0.0], scatter: 0.0, rms: 0.0 };
        for _ in 0..PLANE_ROUNDS {
            let residuals: Vec<f64> =
                band.iter().map(|p| p.grey - plane.grey_at(Pixel::new(p.x, p.y))).collect();
            let middle = upper_median(residuals.iter().map(|r| r.abs()))?;
            plane.scatter = (STD_OVER_MEDIAN_ABSOLUTE * middle).max(ROUNDING_STD);
            plane.rms = (residuals.iter().map(|r| r * r).sum::<f64>() / n).sqrt();
            let limit = OUTLIER_STDS * plane.scatter;
            let inliers = band.iter().zip(&residuals).filter(|&(_, r)| r.abs() <= limit);
            let before = (plane.origin, plane.grey_at_origin, plane.slope);
            plane.fit(&inliers.map(|(&p, _)| p).collect::<Vec<_>>());
            if before == (plane.origin, plane.grey_at_origin, plane.slope) {
                break;
            }
        }
        Some(plane)
    }
}

/// A pixel of the band around a marker.
#[derive(Clone, Copy)]
struct BandPixel {
    x: f64,
    y: f64,
    grey: f64,
}

impl Plane {
    /// Grey level of the plane at a position in the image.
    pub(super) fn grey_at(&self, position: Pixel) -> f64 {
        self.grey_at_origin
            + self.slope[0] * (position.x - self.origin.x)
            + self.slope[1] * (position.y - self.origin.y)
    }

    /// Fits it by least squares; sums about the mean of the pixels decouple the level from the slopes.
    fn fit(&mut self, pixels: &[BandPixel]) {
        let n = pixels.len() as f64;
        let sum = |f: &dyn Fn(&BandPixel) -> f64| pixels.iter().map(f).sum::<f64>();
        let (mx, my, mg) = (sum(&|p| p.x) / n, sum(&|p| p.y) / n, sum(&|p| p.grey) / n);
        let (xx, xy, yy) = (
            sum(&|p| (p.x - mx) * (p.x - mx)),
            sum(&|p| (p.x - mx) * (p.y - my)),
            sum(&|p| (p.y - my) * (p.y - my)),
        );
        let (xg, yg) = (sum(&|p| (p.x - mx) * p.grey), sum(&|p| (p.y - my) * p.grey));
        let determinant = xx * yy - xy * xy;
        if n < LEAST_BAND_PX as f64 || determinant <= 0.0 {
            return;
        }
        self.slope = [(yy * xg - xy * yg) / determinant, (xx * yg - xy * xg) / determinant];
        (self.origin, self.grey_at_origin) = (Pixel::new(mx, my), mg);
    }
}
