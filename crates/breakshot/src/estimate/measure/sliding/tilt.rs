//! What the curves of one clip's slides show of a tilted table.
//!
//! Gravity's component along the table accelerates a body while it slides.  Across the slide this bends the path, which nothing else
//! in the fit can do; along it, friction explains the same motion, and only slides in several directions tell the two apart.

use crate::estimate::clip::added_parameters::AddedCauses;
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::motion_model::{BodyPath, Leg};
use crate::geometry::Vec2;
use crate::physics::GRAVITY_M_S2;
use nalgebra::{DMatrix, Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// What one clip shows of the slope of the table, gravity's component along it over gravity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClipTilt {
    /// The inverse of the covariance of the slope's errors: xx, xy, yy.
    information: [f64; 3],
    /// The information times the slope.
    gradient: [f64; 2],
}

impl ClipTilt {
    /// The information as a matrix, and its product with the slope.
    pub(crate) fn information(&self) -> (Matrix2<f64>, Vector2<f64>) {
        let [xx, xy, yy] = self.information;
        (Matrix2::new(xx, xy, xy, yy), Vector2::from(self.gradient))
    }

    /// Whether all numbers are finite and the information is none that is negative.
    pub(crate) fn is_valid(&self) -> bool {
        let [xx, xy, yy] = self.information;
        let finite = self.information.iter().chain(&self.gradient).all(|v| v.is_finite());
        finite && xx >= 0.0 && yy >= 0.0 && xy * xy <= xx * yy * (1.0 + 1e-6)
    }
}

/// What a tilt would do to a fit.
pub(crate) struct TiltEffect {
    /// The change of each parameter of the fit per slope along x and y.
    pub(crate) shifts: DMatrix<f64>,
    /// The tilt that the fit shows; `None` if its numbers are not finite.
    pub(crate) tilt: Option<ClipTilt>,
}

impl TiltEffect {
    /// Only the bends across the slides are evidence of a tilt: along a slide, spins that are not seen and friction that depends on
    /// speed look like one, in the same direction in all clips that are filmed alike.
    pub(crate) fn new(fitted: &MotionFit) -> Self {
        let bodies: Vec<Vec<Deflection>> = (fitted.paths.iter())
            .map(|path| path.legs().iter().filter_map(|leg| Deflection::new(path, leg)).collect())
            .collect();
        let caused = |displacement: fn(&Deflection, f64, Vec2) -> Vec2| {
            fitted.added_causes(|body, time_s| {
                let of_slope = |slope| {
                    bodies[body].iter().fold(Vec2::ZERO, |sum, leg| sum + displacement(leg, time_s, slope))
                };
                [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)].map(of_slope)
            })
        };
        let shifts = caused(Deflection::displacement).shifts;
        Self { shifts, tilt: clip_tilt(&caused(Deflection::across)) }
    }
}

/// The tilt that residuals show; `None` if its numbers are not finite.
fn clip_tilt(added: &AddedCauses) -> Option<ClipTilt> {
    let AddedCauses { information: i, gradient, .. } = added;
    let information = [i[(0, 0)].max(0.0), f64::midpoint(i[(0, 1)], i[(1, 0)]), i[(1, 1)].max(0.0)];
    let tilt = ClipTilt { information, gradient: [gradient[0], gradient[1]] };
    tilt.is_valid().then_some(tilt)
}

/// How a unit slope displaces a body during one slide.
struct Deflection {
    start_s: f64,
    along: Vec2,
    /// Time since the start (s), and displacement across the slide (m).
    across: Vec<[f64; 2]>,
}

/// Steps of the displacement across a slide, shorter towards its end, where the body is slow.
const STEPS: usize = 24;

impl Deflection {
    /// Friction is opposite to the velocity: across the slide a velocity `d` obeys `d' = g s - F d / v`, `F = -v'`, so that
    /// `d = v times the integral of g s / v`.
    fn new(path: &BodyPath, leg: &Leg) -> Option<Self> {
        let along = leg.velocity.direction()?;
        let duration_s = leg.end_s - leg.start_s;
        if !(duration_s.is_finite() && duration_s > 0.0) {
            return None;
        }
        let node_s = |k: f64| duration_s * (1.0 - (1.0 - k / STEPS as f64).powi(2));
        let speed_m_s = |elapsed_s: f64| path.motion_before(leg.start_s + elapsed_s).velocity.length();
        let (mut integral, mut distance_m, mut rate) = (0.0, 0.0, 0.0);
        let mut across = vec![[0.0; 2]];
        for k in 0..STEPS {
            let (from_s, to_s) = (node_s(k as f64), node_s(k as f64 + 1.0));
            let middle = speed_m_s(node_s(k as f64 + 0.5));
            if middle <= 0.0 {
                break;
            }
            integral += GRAVITY_M_S2 * (to_s - from_s) / middle;
            let next_rate = integral * speed_m_s(to_s);
            distance_m += 0.5 * (rate + next_rate) * (to_s - from_s);
            rate = next_rate;
            across.push([to_s, distance_m]);
        }
        Some(Self { start_s: leg.start_s, along, across })
    }

    /// The displacement at a time of the clip (s), per slope.
    fn displacement(&self, time_s: f64, slope: Vec2) -> Vec2 {
        let elapsed_s = self.elapsed_s(time_s);
        let along_m = 0.5 * GRAVITY_M_S2 * elapsed_s * elapsed_s;
        self.along * (along_m * slope.dot(self.along)) + self.across(time_s, slope)
    }

    /// Its part across the slide.
    fn across(&self, time_s: f64, slope: Vec2) -> Vec2 {
        let elapsed_s = self.elapsed_s(time_s);
        let next = self.across.partition_point(|node| node[0] <= elapsed_s).min(self.across.len() - 1).max(1);
        let across_m = match (self.across.get(next - 1), self.across.get(next)) {
            (Some([from_s, from_m]), Some([to_s, to_m])) => {
                from_m + (to_m - from_m) * ((elapsed_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
            }
            _ => 0.0,
        };
        let sideways = self.along.perpendicular();
        sideways * (across_m * slope.dot(sideways))
    }

    /// The time since the start of the slide, until its end (s).
    fn elapsed_s(&self, time_s: f64) -> f64 {
        (time_s - self.start_s).clamp(0.0, self.across[self.across.len() - 1][0])
    }
}
