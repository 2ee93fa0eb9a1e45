//! What the curves of one clip's slides show of a tilted table.
//!
//! Gravity's component along the table accelerates a body while it slides.  Across the slide this bends the path; along it, friction explains
//! the same motion, and only slides in several directions tell the two apart.
//!
//! A body that spins bends its path too, because friction presses it onto the table at its front, where the spin moves it sideways (Penner
//! 2001, *The physics of sliding cylinders and curling rocks*).  How much depends on the contact with the table, which is not known: each
//! slide may curl by itself, with a prior, and what a slide with spin shows of the slope is known to within that.  An object whose spin is not
//! seen may spin once another one has hit it.

use crate::estimate::clip::added_parameters::AddedCauses;
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::motion_model::{BodyPath, Cause, Event, Leg};
use crate::estimate::clip::sliding::MotionState;
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
        let deflections = |k: usize| {
            let deflection = |leg: &Leg| Deflection::new(fitted, k, leg);
            fitted.paths[k].legs().iter().filter_map(deflection).collect()
        };
        let bodies: Vec<Vec<Deflection>> = (0..fitted.paths.len()).map(deflections).collect();
        let by_slope = |displacement: fn(&Deflection, f64, Vec2) -> Vec2, body: usize, time_s: f64| {
            [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)].map(|slope| {
                bodies[body].iter().fold(Vec2::ZERO, |sum, leg| sum + displacement(leg, time_s, slope))
            })
        };
        let along_and_across = fitted.added_causes(2, |body, time_s, displaced| {
            displaced.copy_from_slice(&by_slope(Deflection::displacement, body, time_s));
        });
        // The two components of the slope, and the curl of each slide with spin
        let curling = |leg: &&Deflection| leg.curl.is_some();
        let first_curls: Vec<usize> =
            (0..=bodies.len()).map(|k| 2 + bodies[..k].iter().flatten().filter(curling).count()).collect();
        let across = fitted.added_causes(first_curls[bodies.len()], |body, time_s, displaced| {
            displaced[..2].copy_from_slice(&by_slope(Deflection::across, body, time_s));
            let curls = bodies[body].iter().filter_map(|leg| leg.curled(time_s));
            displaced[first_curls[body]..].iter_mut().zip(curls).for_each(|(d, curled)| *d = curled);
        });
        Self { shifts: along_and_across.shifts, tilt: clip_tilt(&across) }
    }
}

/// The tilt that residuals show, for any curls of the slides; `None` if its numbers are not finite.
fn clip_tilt(AddedCauses { information: all, gradient, .. }: &AddedCauses) -> Option<ClipTilt> {
    let curls = all.nrows() - 2;
    let (of_slope, shared) = (all.fixed_view::<2, 2>(0, 0), all.view((0, 2), (2, curls)));
    let of_curls = all.view((2, 2), (curls, curls)) + DMatrix::identity(curls, curls) / CURL_STD.powi(2);
    let by_curls = of_curls.try_inverse()?;
    let information = of_slope - shared * &by_curls * shared.transpose();
    let gradient = gradient.fixed_rows::<2>(0) - shared * &by_curls * gradient.rows(2, curls);
    let (xx, yy) = (information[(0, 0)].max(0.0), information[(1, 1)].max(0.0));
    let xy = f64::midpoint(information[(0, 1)], information[(1, 0)]);
    let tilt = ClipTilt { information: [xx, xy, yy], gradient: [gradient[0], gradient[1]] };
    tilt.is_valid().then_some(tilt)
}

/// How a unit slope, and the curl of a uniform body, displace a body during one slide.
struct Deflection {
    start_s: f64,
    along: Vec2,
    /// Displacement across the slide by a unit slope.
    sloped: Across,
    /// The same by the curl; `None` without spin.
    curl: Option<Across>,
}

/// Displacement across a slide: time since its start (s), and distance (m).
struct Across(Vec<[f64; 2]>);

/// Steps of the displacement across a slide, shorter towards its end, where the body is slow.
const STEPS: usize = 24;
/// Standard deviation of a curl over the one of a body whose pressure on the table varies linearly.
const CURL_STD: f64 = 1.0;
/// A slide curls if the spin moves the rim by more than this part of the speed.
const LEAST_SPIN: f64 = 1e-3;
/// The same part by a spin that is not seen, of an object that another one has hit: contact friction of 0.2 lets a disc spin at 0.28, and most
/// impacts are not far off the centre.
const UNSEEN_SPIN: f64 = 0.2;

impl Deflection {
    /// That of body `k` during a slide; `None` for one of no length.
    fn new(fitted: &MotionFit, k: usize, leg: &Leg) -> Option<Self> {
        let along = leg.velocity.direction()?;
        let duration_s = leg.end_s - leg.start_s;
        if !(duration_s.is_finite() && duration_s > 0.0) {
            return None;
        }
        let (path, body) = (&fitted.paths[k], &fitted.model.bodies[k]);
        let is_hit = |(event, time_s): (&Event, f64)| {
            event.cause == Cause::Contact && event.members.contains(&k) && time_s == leg.start_s
        };
        // The spin as a part of the speed, at the rim
        let start = path.motion_before(leg.start_s + 0.5 * duration_s / STEPS as f64);
        let spin = if body.yaw_observed {
            start.spin_rad_s.abs() * body.gyration_m / start.velocity.length().max(f64::MIN_POSITIVE)
        } else if fitted.timed_events().any(is_hit) {
            UNSEEN_SPIN
        } else {
            0.0
        };
        // Friction F per mass below a centroid at height h displaces the centre of pressure by h F / g, where the spin moves the body
        // sideways by the angle between its velocity and that of its centroid.
        let curl_m_s2 = |motion: MotionState, friction_m_s2: f64| {
            let MotionState { velocity, spin_rad_s, .. } = motion;
            let speed_m_s = velocity.length();
            let spin_rad_s = if body.yaw_observed { spin_rad_s } else { spin * speed_m_s / body.gyration_m };
            let arm_m = body.height_m / 2.0 * friction_m_s2 / GRAVITY_M_S2;
            -friction_m_s2 * arm_m * spin_rad_s / speed_m_s.hypot(spin_rad_s * body.gyration_m)
        };
        let curl = (spin > LEAST_SPIN).then(|| Across::new(path, leg, curl_m_s2));
        Some(Self { start_s: leg.start_s, along, sloped: Across::new(path, leg, |_, _| GRAVITY_M_S2), curl })
    }

    /// The displacement at a time of the clip (s), per slope.
    fn displacement(&self, time_s: f64, slope: Vec2) -> Vec2 {
        let elapsed_s = self.sloped.within(time_s - self.start_s);
        let along_m = 0.5 * GRAVITY_M_S2 * elapsed_s * elapsed_s;
        self.along * (along_m * slope.dot(self.along)) + self.across(time_s, slope)
    }

    /// Its part across the slide.
    fn across(&self, time_s: f64, slope: Vec2) -> Vec2 {
        let sideways = self.along.perpendicular();
        sideways * (self.sloped.at_m(time_s - self.start_s) * slope.dot(sideways))
    }

    /// The displacement by the curl at a time of the clip (s); `None` without spin.
    fn curled(&self, time_s: f64) -> Option<Vec2> {
        Some(self.along.perpendicular() * self.curl.as_ref()?.at_m(time_s - self.start_s))
    }
}

impl Across {
    /// Friction is opposite to the velocity: across the slide a velocity `d` obeys `d' = a - F d / v`, `F = -v'`, for an acceleration `a`
    /// (m/s2, of the motion and of `F`), so that `d = v times the integral of a / v`.
    fn new(path: &BodyPath, leg: &Leg, acceleration_m_s2: impl Fn(MotionState, f64) -> f64) -> Self {
        let duration_s = leg.end_s - leg.start_s;
        let node_s = |k: f64| duration_s * (1.0 - (1.0 - k / STEPS as f64).powi(2));
        let motion = |elapsed_s: f64| path.motion_before(leg.start_s + elapsed_s);
        let (mut integral, mut distance_m, mut rate) = (0.0, 0.0, 0.0);
        let mut nodes = vec![[0.0; 2]];
        let mut from_m_s = leg.velocity.length();
        for k in 0..STEPS {
            let (from_s, to_s) = (node_s(k as f64), node_s(k as f64 + 1.0));
            let middle = motion(node_s(k as f64 + 0.5));
            let (middle_m_s, to_m_s) = (middle.velocity.length(), motion(to_s).velocity.length());
            if middle_m_s <= 0.0 {
                break;
            }
            let friction_m_s2 = (from_m_s - to_m_s) / (to_s - from_s);
            integral += acceleration_m_s2(middle, friction_m_s2) * (to_s - from_s) / middle_m_s;
            let next_rate = integral * to_m_s;
            distance_m += 0.5 * (rate + next_rate) * (to_s - from_s);
            (rate, from_m_s) = (next_rate, to_m_s);
            nodes.push([to_s, distance_m]);
        }
        Self(nodes)
    }

    /// The displacement at a time since the start of the slide (m); afterwards that at its end.
    fn at_m(&self, elapsed_s: f64) -> f64 {
        let elapsed_s = self.within(elapsed_s);
        let next = self.0.partition_point(|node| node[0] <= elapsed_s).min(self.0.len() - 1).max(1);
        match (self.0.get(next - 1), self.0.get(next)) {
            (Some([from_s, from_m]), Some([to_s, to_m])) => {
                from_m + (to_m - from_m) * ((elapsed_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0)
            }
            _ => 0.0,
        }
    }

    /// A time since the start of the slide, until its end (s).
    fn within(&self, elapsed_s: f64) -> f64 {
        elapsed_s.clamp(0.0, self.0[self.0.len() - 1][0])
    }
}
