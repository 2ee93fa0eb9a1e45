//! Where are a disc and the dot beside it that move during the exposure?
//!
//! Both fade, and they may merge into one streak. A template is fitted to the grey levels by least squares (compare Baker and Matthews 2004):
//! two discs of known size, blurred along their path, on a background that is a polynomial of second degree, since a shadow may lie over
//! part of it. Position, yaw, motion and contrast follow from all pixels at once.

use super::outline::{MarkerFit, UNKNOWN_YAW_STD_RAD, pose_stds};
use super::target::{BLUR_VARIANCE_PX2, Target};
use crate::capture::{Camera, GreyImage};
use crate::detect::label::Window;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point, Pose, Vec2};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;

/// Unknowns of the fit: x, y (m), yaw (rad), motion along x and y (m) and rotation (rad) during the exposure, contrast (grey levels), the
/// coefficients of the background (grey levels; see [`background_terms`]), and the width of an edge that lens and pixels blur (m).
const UNKNOWNS: usize = 14;
/// Index of the contrast.
const CONTRAST: usize = 6;
/// Index of the first coefficient of the background, and their number.
const BACKGROUND: usize = 7;
const TERMS: usize = 6;
/// Index of the width of an edge.
const EDGE: usize = BACKGROUND + TERMS;
type Unknowns = SVector<f64, UNKNOWNS>;
type Information = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Pixels within this distance of the blurred discs take part (px).
const MARGIN_PX: f64 = 4.0;
/// Pixels within this distance of the object's own outline do not (px).
const RIM_PX: f64 = 2.0;
/// A pixel is longer in one direction than in the other by at most this factor, where the camera looks obliquely.
const MOST_OBLIQUE: f64 = 1.5;
/// A path that reaches further from the object's centre than this multiple of its radius is not that of its marker.
const MOST_REACH: f64 = 4.0;
/// Steps along the path of a disc, in widths of its edge.
const STEPS_PER_EDGE: f64 = 1.5;
const MOST_STEPS: f64 = 64.0;
/// A single step would not show any motion.
const LEAST_STEPS: f64 = 2.0;
/// The template is fitted to a region that follows it, in at most this many rounds of this many steps each.
const ROUNDS: usize = 4;
const STEPS: usize = 8;
/// First damping of the steps (Levenberg-Marquardt), its factors after a step that improves the fit or does not, and its upper bound.
const DAMPING: f64 = 1e-2;
const LESS_DAMPING: f64 = 0.2;
const MORE_DAMPING: f64 = 8.0;
const MOST_DAMPING: f64 = 1e6;
/// A step that reduces the sum of squares by a smaller fraction is the last one of its round, ...
const SETTLED: f64 = 1e-3;
/// ... and a round that moves the marker by less than this (px) is the last one.
const SETTLED_PX: f64 = 0.02;
/// Standard deviation of the rotation during an exposure, as a prior (rad): 10 rad/s for 15 ms.
const ROTATION_STD_RAD: f64 = 0.15;
/// Least width of an edge (px), and the standard deviation of the width as a prior, as a part of the expected one.
const LEAST_EDGE_PX: f64 = 1.0;
const EDGE_STD: f64 = 0.5;
/// Number of neighbouring pixels that count as one: compression distorts them together.
const CORRELATED: f64 = 4.0;
/// The errors within a square of this side (px) count as one where they are larger than that, at the borders of shadows.
const BLOCK_PX: usize = 16;
/// Least standard deviation of the grey levels.
const LEAST_NOISE: f64 = 1.0;
/// Compression leaves an error that does not average out (px).
const FLOOR_STD_PX: f64 = 0.04;

/// A disc and a dot that move, and the image of them.
#[derive(Clone, Copy)]
pub(in crate::detect) struct PairView<'a> {
    pub image: &'a GreyImage,
    pub camera: &'a Camera,
    pub target: &'a Target<'a>,
    /// The background less the marker, and the background (grey levels).
    pub contrast: f64,
    pub background: f64,
}

/// A pose in the middle of the exposure, and the motion of the object's centroid during it (m).
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Guess {
    pub pose: Pose,
    pub motion_m: Vec2,
}

/// A disc and its dot fitted to the grey levels.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct PairFit {
    pub fit: MarkerFit,
    /// Motion of the object's centroid during the exposure (m).
    pub motion_m: Vec2,
    /// The background less the marker, and the background at the object's centroid (grey levels).
    pub contrast: f64,
    pub background: f64,
    /// Root mean square difference of the grey levels from the template.
    pub residual_rms: f64,
}

/// A pixel in the plane of the marker.
#[derive(Clone, Copy)]
struct TablePixel {
    at: Point,
    grey: f64,
    /// Column and row of its block.
    block: [usize; 2],
}

/// The disc or the dot, in the object's frame (m).
#[derive(Clone, Copy)]
struct Disc {
    at_m: Point,
    radius_m: f64,
}

/// The template on the pixels of a region.
struct Template {
    discs: [Disc; 2],
    region: Vec<TablePixel>,
    /// Yaw of the guess (rad), a weak prior.
    guessed_yaw_rad: f64,
    /// Expected width of an edge that a sharp lens and pixels blur, and the least one (m).
    expected_edge_m: f64,
    least_edge_m: f64,
}

/// Normal equations.
struct Sums {
    information: Information,
    side: Unknowns,
    /// Sum of the squared residuals (squared grey levels).
    squares: f64,
}

impl PairView<'_> {
    /// The template fitted from a guess; `None` where the image does not show enough of it.
    pub(in crate::detect) fn fitted(&self, guess: Guess) -> Option<PairFit> {
        let Guess { pose, motion_m } = guess;
        let height_m = self.target.height_m();
        let at = self.camera.pixel_from_table(pose.position, height_m);
        let scale_m_per_px = self.camera.scale_m_per_px(at, height_m);
        if !scale_m_per_px.is_finite() {
            return None;
        }
        let expected_edge_m = (12.0 * BLUR_VARIANCE_PX2).sqrt() * scale_m_per_px;
        let (feature, dot) = (&self.target.feature, self.target.feature.dot?);
        let disc = Disc { at_m: feature.at_m, radius_m: feature.shape.outer_radius_m() };
        let discs = [disc, Disc { at_m: dot.at_m, radius_m: dot.radius_m }];

        let Pose { position, yaw_rad } = pose;
        let mut unknowns = Unknowns::zeros();
        let known =
            [position.x, position.y, yaw_rad, motion_m.x, motion_m.y, 0.0, self.contrast, self.background];
        unknowns.as_mut_slice()[..=BACKGROUND].copy_from_slice(&known);
        unknowns[EDGE] = expected_edge_m;
        let mut template = Template {
            discs,
            region: Vec::new(),
            guessed_yaw_rad: yaw_rad,
            expected_edge_m,
            least_edge_m: LEAST_EDGE_PX * scale_m_per_px,
        };
        let mut solved = None;
        for _ in 0..ROUNDS {
            template.region = self.region(&discs, &unknowns, scale_m_per_px)?;
            let (best, sums) = template.solved(unknowns)?;
            let moved_m = Vec2::new(best[0] - unknowns[0], best[1] - unknowns[1]).length();
            unknowns = best;
            solved = Some(sums);
            if moved_m < SETTLED_PX * scale_m_per_px {
                break;
            }
        }
        PairFit::new(&template, &unknowns, &solved?, scale_m_per_px)
    }

    /// The pixels near the blurred discs that show the top of the object during the whole exposure.
    fn region(&self, discs: &[Disc; 2], unknowns: &Unknowns, scale_m_per_px: f64) -> Option<Vec<TablePixel>> {
        let height_m = self.target.height_m();
        let [first, middle, last] = [-0.5, 0.0, 0.5].map(|time| pose_of(unknowns, time));
        let margin_m = MARGIN_PX * scale_m_per_px;
        let motion_m = first.position.distance(last.position);
        let reach = |disc: &Disc| disc.at_m.to_vec().length() + disc.radius_m;
        let reach_m = discs.iter().map(reach).fold(0.0, f64::max) + margin_m + motion_m / 2.0;
        let is_bounded = reach_m < MOST_REACH * self.target.object.shape.outer_radius_m();
        if !is_bounded {
            return None;
        }
        let at = self.camera.pixel_from_table(middle.position, height_m);
        let window = Window::around(at, MOST_OBLIQUE * reach_m / scale_m_per_px, self.image);
        let paths = discs.map(|disc| {
            let [from, to] = [first, last].map(|pose| pose.table_from_body(disc.at_m));
            Outline::capsule(from, to, disc.radius_m + margin_m)
        });
        let top = Outline::new(&self.target.object.shape, Pose::default());
        let is_top = |at: Point| {
            [first, last]
                .into_iter()
                .map(|pose| pose.body_from_table(at))
                .all(|body| top.contains(body) && top.border_distance_m(body) > RIM_PX * scale_m_per_px)
        };
        // Which pixels take part is decided where the camera is linear, which it nearly is over a marker.
        let [[xx, xy], [yx, yy]] = self.camera.table_per_pixel_m(at, height_m);
        let nearly = |dx: f64, dy: f64| middle.position + Vec2::new(xx * dx + xy * dy, yx * dx + yy * dy);
        let mut region = Vec::new();
        for y in window.y[0]..window.y[1] {
            for x in window.x[0]..window.x[1] {
                let near = nearly(x as f64 - at.x, y as f64 - at.y);
                if !paths.iter().any(|path| path.contains(near)) || !is_top(near) {
                    continue;
                }
                if x == 0 || y == 0 || x + 1 == self.image.width || y + 1 == self.image.height {
                    // The border of the image cuts the marker off.
                    return None;
                }
                let grey = f64::from(self.image.pixels[y * self.image.width + x]);
                let at = self.camera.table_from_pixel(Pixel::new(x as f64, y as f64), height_m);
                region.push(TablePixel { at, grey, block: [x / BLOCK_PX, y / BLOCK_PX] });
            }
        }
        (region.len() > 4 * UNKNOWNS).then_some(region)
    }
}

impl PairFit {
    /// The unknowns with what the residuals say about them; `None` where they are not determined.
    fn new(template: &Template, unknowns: &Unknowns, sums: &Sums, scale_m_per_px: f64) -> Option<Self> {
        let residual_rms = (sums.squares / template.region.len() as f64).sqrt();
        let variance = CORRELATED * residual_rms.max(LEAST_NOISE).powi(2);
        let inverse = sums.information.try_inverse()?;
        let by_pixel = pose_stds(&(inverse * variance));
        let by_block = pose_stds(&(inverse * template.block_information(unknowns) * inverse));
        let (std_m, yaw_std_rad) = (by_pixel.0.max(by_block.0), by_pixel.1.max(by_block.1));
        let fit = MarkerFit {
            pose: pose_of(unknowns, 0.0),
            visible_fraction: 1.0,
            std_m: std_m.hypot(FLOOR_STD_PX * scale_m_per_px),
            yaw_std_rad,
        };
        let all_finite = unknowns.iter().all(|u| u.is_finite()) && fit.std_m.is_finite();
        let motion_m = Vec2::new(unknowns[3], unknowns[4]);
        let (contrast, background) = (unknowns[CONTRAST], unknowns[BACKGROUND]);
        all_finite.then_some(Self { fit, motion_m, contrast, background, residual_rms })
    }
}

/// The terms of the background at a distance from the object's centroid (radii of the disc), each with its derivatives by x and y.
fn background_terms(Vec2 { x, y }: Vec2) -> [[f64; 3]; TERMS] {
    [
        [1.0, 0.0, 0.0],
        [x, 1.0, 0.0],
        [y, 0.0, 1.0],
        [x * x, 2.0 * x, 0.0],
        [x * y, y, x],
        [y * y, 0.0, 2.0 * y],
    ]
}

/// The pose at a time from -1/2 to 1/2 of the exposure.
fn pose_of(unknowns: &Unknowns, time: f64) -> Pose {
    let at = |i: usize| unknowns[i] + unknowns[i + 3] * time;
    Pose::new(at(0), at(1), at(2))
}

impl Template {
    /// The unknowns of least squares, from a guess (Levenberg-Marquardt).
    fn solved(&self, guess: Unknowns) -> Option<(Unknowns, Sums)> {
        let (mut unknowns, mut sums) = (guess, self.sums(&guess));
        let mut damping = DAMPING;
        for _ in 0..STEPS {
            let mut damped = sums.information;
            for i in 0..UNKNOWNS {
                damped[(i, i)] *= 1.0 + damping;
            }
            let mut next = unknowns + damped.cholesky()?.solve(&sums.side);
            next[EDGE] = next[EDGE].max(self.least_edge_m);
            let next_sums = self.sums(&next);
            if next_sums.squares < sums.squares {
                let is_settled = next_sums.squares > (1.0 - SETTLED) * sums.squares;
                (unknowns, sums) = (next, next_sums);
                damping *= LESS_DAMPING;
                if is_settled {
                    break;
                }
            } else {
                damping *= MORE_DAMPING;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        Some((unknowns, sums))
    }

    fn sums(&self, unknowns: &Unknowns) -> Sums {
        let instants = self.instants(unknowns);
        let mut sums = Sums { information: Information::zeros(), side: Unknowns::zeros(), squares: 0.0 };
        for pixel in &self.region {
            let (derivatives, residual) = self.linearized(unknowns, &instants, pixel);
            sums.information += derivatives * derivatives.transpose();
            sums.side += derivatives * residual;
            sums.squares += residual * residual;
        }
        // What the image may hardly determine: the yaw by a small dot, the rotation, and the width of an edge
        let priors = [
            (2, self.guessed_yaw_rad, UNKNOWN_YAW_STD_RAD),
            (5, 0.0, ROTATION_STD_RAD),
            (EDGE, self.expected_edge_m, EDGE_STD * self.expected_edge_m),
        ];
        for (i, expected, std) in priors {
            let weight = CORRELATED * (LEAST_NOISE / std).powi(2);
            sums.information[(i, i)] += weight;
            sums.side[i] += weight * (expected - unknowns[i]);
            sums.squares += weight * (expected - unknowns[i]).powi(2);
        }
        sums
    }

    /// The derivatives of the grey level of a pixel by the unknowns, and its residual.
    fn linearized(&self, unknowns: &Unknowns, instants: &[Instant], pixel: &TablePixel) -> (Unknowns, f64) {
        let Coverage { fraction, by_pose, by_edge } = self.coverage(instants, pixel.at, unknowns[EDGE]);
        let contrast = unknowns[CONTRAST];
        let mut derivatives = Unknowns::zeros();
        for (i, by_pose) in by_pose.iter().enumerate() {
            derivatives[i] = -contrast * by_pose;
        }
        derivatives[CONTRAST] = -fraction;
        derivatives[EDGE] = -contrast * by_edge;
        let unit_m = self.discs[0].radius_m;
        let from_centroid = (pixel.at - Point::new(unknowns[0], unknowns[1])) / unit_m;
        let mut background = 0.0;
        for (i, [term, by_x, by_y]) in background_terms(from_centroid).into_iter().enumerate() {
            let coefficient = unknowns[BACKGROUND + i];
            background += coefficient * term;
            derivatives[BACKGROUND + i] = term;
            derivatives[0] -= coefficient * by_x / unit_m;
            derivatives[1] -= coefficient * by_y / unit_m;
        }
        (derivatives, pixel.grey - (background - contrast * fraction))
    }

    /// The covariance of the right side of the normal equations, whose errors are independent from block to block (Liang and Zeger 1986).
    fn block_information(&self, unknowns: &Unknowns) -> Information {
        let instants = self.instants(unknowns);
        let mut blocks: BTreeMap<[usize; 2], Unknowns> = BTreeMap::new();
        for pixel in &self.region {
            let (derivatives, residual) = self.linearized(unknowns, &instants, pixel);
            *blocks.entry(pixel.block).or_default() += derivatives * residual;
        }
        blocks.values().fold(Information::zeros(), |sum, side| sum + side * side.transpose())
    }

    /// Instants of the exposure between which an edge moves by less than its width.
    fn instants(&self, unknowns: &Unknowns) -> Vec<Instant> {
        let motion_m = unknowns[3].hypot(unknowns[4]);
        let count = (STEPS_PER_EDGE * motion_m / self.expected_edge_m).ceil().clamp(LEAST_STEPS, MOST_STEPS);
        let instant = |k: usize| {
            let time = (k as f64 + 0.5) / count - 0.5;
            let Pose { position, yaw_rad } = pose_of(unknowns, time);
            let (sin, cos) = yaw_rad.sin_cos();
            Instant { time, position, sin, cos }
        };
        (0..count as usize).map(instant).collect()
    }

    fn coverage(&self, instants: &[Instant], at: Point, edge_m: f64) -> Coverage {
        let mut sum = Coverage { fraction: 0.0, by_pose: [0.0; 6], by_edge: 0.0 };
        for instant in instants {
            let body = instant.body_from_table(at);
            for disc in &self.discs {
                let from_centre = body - disc.at_m;
                let squared_m2 = from_centre.length_squared();
                if squared_m2 >= (disc.radius_m + edge_m / 2.0).powi(2) {
                    continue;
                }
                let from_centre_m = squared_m2.sqrt();
                let distance_m = from_centre_m - disc.radius_m;
                let inside = 0.5 - distance_m / edge_m;
                sum.fraction += inside.min(1.0);
                if inside < 1.0 && from_centre_m > 0.0 {
                    let outward = from_centre / from_centre_m;
                    let slope = instant.table_from_body(outward) / edge_m;
                    let by_yaw = body.to_vec().perpendicular().dot(outward) / edge_m;
                    sum.by_edge += distance_m / (edge_m * edge_m);
                    for (i, by_pose) in [slope.x, slope.y, by_yaw].into_iter().enumerate() {
                        sum.by_pose[i] += by_pose;
                        sum.by_pose[i + 3] += by_pose * instant.time;
                    }
                }
            }
        }
        let count = instants.len() as f64;
        Coverage {
            fraction: sum.fraction / count,
            by_pose: sum.by_pose.map(|d| d / count),
            by_edge: sum.by_edge / count,
        }
    }
}

/// A pose at a time from -1/2 to 1/2 of the exposure.
struct Instant {
    time: f64,
    position: Point,
    sin: f64,
    cos: f64,
}

impl Instant {
    fn body_from_table(&self, at: Point) -> Point {
        let off = at - self.position;
        Point::new(self.cos * off.x + self.sin * off.y, self.cos * off.y - self.sin * off.x)
    }

    fn table_from_body(&self, direction: Vec2) -> Vec2 {
        Vec2::new(
            self.cos * direction.x - self.sin * direction.y,
            self.sin * direction.x + self.cos * direction.y,
        )
    }
}

/// The fraction of the exposure for which the marker covers a point, and its derivatives by x, y (1 / m), yaw (1 / rad), by the motion and
/// the rotation, and by the width of an edge (1 / m).
struct Coverage {
    fraction: f64,
    by_pose: [f64; 6],
    by_edge: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_equations_hold_the_derivatives_of_the_sum_of_squares() {
        // A grid of 0.4 mm under a dark disc and its dot, with grey levels that no template explains
        let region: Vec<TablePixel> = (0..80 * 60)
            .map(|k| {
                let (x, y) = (f64::from(k % 80) * 0.4e-3, f64::from(k / 80) * 0.4e-3);
                let grey = 120.0 + 40.0 * (2100.0 * x + 900.0 * y).sin();
                TablePixel { at: Point::new(x, y), grey, block: [0, 0] }
            })
            .collect();
        let discs = [
            Disc { at_m: Point::new(-0.003, 0.001), radius_m: 0.005 },
            Disc { at_m: Point::new(0.008, 0.002), radius_m: 0.003 },
        ];
        let template =
            Template { discs, region, guessed_yaw_rad: 0.3, expected_edge_m: 0.9e-3, least_edge_m: 0.4e-3 };
        let unknowns = Unknowns::from_row_slice(&[
            0.016, 0.012, 0.4, 0.006, -0.003, 0.1, 90.0, 150.0, 1.5, -1.0, 3.0, -2.0, 4.0, 1.1e-3,
        ]);
        let steps = [1e-9, 1e-9, 1e-7, 1e-9, 1e-9, 1e-7, 1e-2, 1e-2, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-9];
        let sums = template.sums(&unknowns);
        for (i, step) in steps.into_iter().enumerate() {
            let squares_at = |sign: f64| {
                let mut moved = unknowns;
                moved[i] += sign * step;
                template.sums(&moved).squares
            };
            let slope = (squares_at(1.0) - squares_at(-1.0)) / (4.0 * step);
            let scale = (sums.information[(i, i)] * sums.squares).sqrt();
            assert!((sums.side[i] + slope).abs() < 1e-4 * scale, "unknown {i}: {} and {slope}", sums.side[i]);
        }
    }
}
