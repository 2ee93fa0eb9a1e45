//! How a body slides to rest under Coulomb friction, with or without spin.
//!
//! Without spin the deceleration is `mu g` against the velocity until the body stops (Eq. 26 and 30).  Spin lowers it,
//! because every point of the contact patch slides in its own direction: for a round patch the path stays straight, and
//! sliding and spinning stop together (Farkas et al. 2003).  The force law is that of the simulator.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;
use crate::physics::sliding::patch_friction::{PATCH_RADIUS_PER_ARM, patch_force_and_torque};
use std::f64::consts::FRAC_PI_2;
use std::sync::OnceLock;

/// Pose and velocity of a body at one instant, in the table frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotionState {
    /// The pose of the centroid.
    pub pose: Pose,
    /// The centroid's velocity (m/s).
    pub velocity: Vec2,
    /// The angular velocity (rad/s).
    pub spin_rad_s: f64,
}

impl MotionState {
    /// The velocity of the material point of the body at this position (m/s; Eq. 13).
    pub fn velocity_at(&self, position: Point) -> Vec2 {
        self.velocity + (position - self.pose.position).perpendicular() * self.spin_rad_s
    }
}

/// What determines how the table decelerates a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SlideParameters {
    /// The coefficient of friction.
    pub(crate) friction: f64,
    /// The radius of the disc of uniform pressure with the same frictional torque as the body's contact patch (m).
    pub(crate) patch_radius_m: f64,
    /// The body's radius of gyration (m).
    pub(crate) gyration_m: f64,
}

/// The motion from one impact to the next, or to rest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slide {
    start_s: f64,
    start: MotionState,
    curve: SlideCurve,
}

#[derive(Clone, Debug, PartialEq)]
enum SlideCurve {
    /// Without relevant spin: the speed decreases linearly, by the fraction `deceleration_hz` of its initial value per second.
    Straight { stop_after_s: f64, deceleration_hz: f64 },
    /// Sliding along a direction and spinning, tabulated from start to rest.
    Spinning { along: Vec2, points: Vec<CurvePoint> },
    /// Constant linear and angular acceleration, whatever their cause; never at rest.
    ConstantRates(Rates),
}

/// Constant linear and angular acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rates {
    /// The acceleration of the centroid (m/s^2).
    pub(crate) acceleration: Vec2,
    /// The angular acceleration (rad/s^2).
    pub(crate) spin_rad_s2: f64,
}

/// An instant of a spinning slide, with distance and rotation since its start.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CurvePoint {
    time_s: f64,
    distance_m: f64,
    rotation_rad: f64,
    speed_m_s: f64,
    spin_rad_s: f64,
}

/// Below this ratio of rim speed to speed, spin changes the deceleration by less than 1e-9.
const NEGLIGIBLE_SPIN: f64 = 1e-4;
/// Steps of a spinning slide: with 16 the error is below 1e-4 of the range.
const STEPS: usize = 16;

impl Slide {
    /// The slide under Coulomb friction that begins with this motion at `start_s`.
    pub(crate) fn new(start_s: f64, start: MotionState, slide: &SlideParameters) -> Self {
        let deceleration_m_s2 = slide.friction * GRAVITY_M_S2;
        let (speed_m_s, rim_m_s) = (start.velocity.length(), start.spin_rad_s.abs() * slide.patch_radius_m);
        let spinning = deceleration_m_s2 > 0.0 && rim_m_s > NEGLIGIBLE_SPIN * speed_m_s;
        let curve = if spinning {
            let along = if speed_m_s > 0.0 { start.velocity / speed_m_s } else { Vec2::ZERO };
            SlideCurve::Spinning { along, points: spinning_curve(&start, speed_m_s, slide) }
        } else {
            let stops = deceleration_m_s2 > 0.0;
            let stop_after_s = if stops { speed_m_s / deceleration_m_s2 } else { f64::INFINITY };
            let deceleration_hz = if speed_m_s > 0.0 { deceleration_m_s2 / speed_m_s } else { 0.0 };
            SlideCurve::Straight { stop_after_s, deceleration_hz }
        };
        Self { start_s, start, curve }
    }

    /// The motion with constant accelerations that begins with this state at `start_s`.
    pub(crate) fn with_rates(start_s: f64, start: MotionState, rates: Rates) -> Self {
        Self { start_s, start, curve: SlideCurve::ConstantRates(rates) }
    }

    /// The state at a time (s); before the start the velocity is constant.
    pub(crate) fn motion(&self, time_s: f64) -> MotionState {
        let elapsed_s = time_s - self.start_s;
        match &self.curve {
            SlideCurve::Straight { stop_after_s, deceleration_hz } => {
                self.straight(elapsed_s, *stop_after_s, *deceleration_hz)
            }
            SlideCurve::Spinning { along, points } => self.spinning(elapsed_s, *along, points),
            SlideCurve::ConstantRates(rates) => self.at_constant_rates(elapsed_s, rates),
        }
    }

    /// When the body comes to rest (s); infinite without friction.
    pub(crate) fn stop_s(&self) -> f64 {
        match &self.curve {
            SlideCurve::Straight { stop_after_s, .. } => self.start_s + stop_after_s,
            SlideCurve::Spinning { points, .. } => self.start_s + points.last().map_or(0.0, |k| k.time_s),
            SlideCurve::ConstantRates(_) => f64::INFINITY,
        }
    }

    fn straight(&self, elapsed_s: f64, stop_after_s: f64, deceleration_hz: f64) -> MotionState {
        let t = elapsed_s.min(stop_after_s);
        let lost = deceleration_hz * t;
        // No friction before the start: a trial impact that is too late must not increase the speed.
        let (mean_s, left) = if t < 0.0 { (t, 1.0) } else { (t * (1.0 - lost / 2.0), 1.0 - lost) };
        let rotation_rad = self.start.spin_rad_s * mean_s;
        self.moved(self.start.velocity * mean_s, rotation_rad, left)
    }

    fn spinning(&self, elapsed_s: f64, along: Vec2, points: &[CurvePoint]) -> MotionState {
        if elapsed_s <= 0.0 {
            return self.moved(self.start.velocity * elapsed_s, self.start.spin_rad_s * elapsed_s, 1.0);
        }
        let next = points.partition_point(|k| k.time_s <= elapsed_s);
        let now = match (points.get(next - 1), points.get(next)) {
            (Some(from), Some(to)) => from.interpolated(to, elapsed_s),
            (Some(last), None) => *last,
            (None, _) => return self.start,
        };
        let mut motion = self.moved(along * now.distance_m, now.rotation_rad, 0.0);
        motion.velocity = along * now.speed_m_s;
        motion.spin_rad_s = now.spin_rad_s;
        motion
    }

    fn at_constant_rates(&self, elapsed_s: f64, rates: &Rates) -> MotionState {
        let changed_s = elapsed_s.max(0.0);
        let half = changed_s * changed_s / 2.0;
        let displacement = self.start.velocity * elapsed_s + rates.acceleration * half;
        let rotation_rad = self.start.spin_rad_s * elapsed_s + rates.spin_rad_s2 * half;
        let mut motion = self.moved(displacement, rotation_rad, 1.0);
        motion.velocity += rates.acceleration * changed_s;
        motion.spin_rad_s += rates.spin_rad_s2 * changed_s;
        motion
    }

    /// The start, displaced and rotated, with the fraction `left` of its velocity.
    fn moved(&self, displacement: Vec2, rotation_rad: f64, left: f64) -> MotionState {
        let MotionState { pose, velocity, spin_rad_s } = self.start;
        MotionState {
            pose: Pose { position: pose.position + displacement, yaw_rad: pose.yaw_rad + rotation_rad },
            velocity: velocity * left,
            spin_rad_s: spin_rad_s * left,
        }
    }
}

impl CurvePoint {
    /// The instant `time_s` between this point and the next, by the cubic with both points' speeds.
    fn interpolated(&self, next: &Self, time_s: f64) -> Self {
        let step_s = next.time_s - self.time_s;
        let u = if step_s > 0.0 { (time_s - self.time_s) / step_s } else { 1.0 };
        let cubic = |from: f64, to: f64, slope_from: f64, slope_to: f64| {
            let (d0, d1) = (slope_from * step_s, slope_to * step_s);
            let difference = to - from;
            from + u * (d0 + u * (3.0 * difference - 2.0 * d0 - d1 + u * (d0 + d1 - 2.0 * difference)))
        };
        Self {
            time_s,
            distance_m: cubic(self.distance_m, next.distance_m, self.speed_m_s, next.speed_m_s),
            rotation_rad: cubic(self.rotation_rad, next.rotation_rad, self.spin_rad_s, next.spin_rad_s),
            speed_m_s: self.speed_m_s + u * (next.speed_m_s - self.speed_m_s),
            spin_rad_s: self.spin_rad_s + u * (next.spin_rad_s - self.spin_rad_s),
        }
    }
}

/// A spinning slide from start to rest.
///
/// Let `u` be the length of the vector (speed, rim speed) and `angle` its direction.  The rates of both are proportional
/// to `mu g`, so that `angle` is a function of `ln u` alone; `u` decreases by equal steps, and the time follows.
fn spinning_curve(start: &MotionState, speed: f64, slide: &SlideParameters) -> Vec<CurvePoint> {
    let SlideParameters { friction, patch_radius_m: radius, gyration_m } = *slide;
    let inertia = (radius / gyration_m).powi(2);
    let direction = start.spin_rad_s.signum();
    let rim = start.spin_rad_s.abs() * radius;
    let u_start = speed.hypot(rim);
    let deceleration = friction * GRAVITY_M_S2;
    let mut angle = rim.atan2(speed);
    let mut point = CurvePoint {
        time_s: 0.0,
        distance_m: 0.0,
        rotation_rad: 0.0,
        speed_m_s: speed,
        spin_rad_s: start.spin_rad_s,
    };
    let mut points = Vec::with_capacity(STEPS + 1);
    points.push(point);
    let (mut sin, mut cos) = angle.sin_cos();
    for (step, [to_mid, to_next]) in logarithms().iter().enumerate() {
        let u = u_start * (1.0 - step as f64 / STEPS as f64);
        let u_next = u_start * (1.0 - (step + 1) as f64 / STEPS as f64);
        // The midpoint rule; the last step ends at rest, where the angle is constant.
        let (decrease, angle_rate) = rates(angle, (sin, cos), inertia);
        let mid = (angle + angle_rate / decrease * to_mid).clamp(0.0, FRAC_PI_2);
        let (sin_mid, cos_mid) = mid.sin_cos();
        let (decrease, angle_rate) = rates(mid, (sin_mid, cos_mid), inertia);
        let u_mid = f64::midpoint(u, u_next);
        let dt = (u - u_next) / (deceleration * decrease);
        point.time_s += dt;
        point.distance_m += u_mid * cos_mid * dt;
        point.rotation_rad += direction * u_mid * sin_mid / radius * dt;
        if step + 1 < STEPS {
            angle = (angle + angle_rate / decrease * to_next).clamp(0.0, FRAC_PI_2);
            (sin, cos) = angle.sin_cos();
        }
        point.speed_m_s = u_next * cos;
        point.spin_rad_s = direction * u_next * sin / radius;
        points.push(point);
    }
    points
}

/// The logarithms of `u` at the middle and at the end of each step, over `u` at its start.
fn logarithms() -> &'static [[f64; 2]; STEPS] {
    static TABLE: OnceLock<[[f64; 2]; STEPS]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|step| {
            let left = (STEPS - step) as f64;
            [0.5, 1.0].map(|step| ((left - step) / left).ln())
        })
    })
}

/// The rate at which `u` decreases, and `u` times the rate of `angle`, both over `mu g`.
fn rates(angle: f64, (sin, cos): (f64, f64), inertia: f64) -> (f64, f64) {
    let [force, torque] = patch(angle);
    (force * cos + inertia * torque * sin, inertia * torque * cos - force * sin)
}

/// Normalized friction force and torque of a round patch of uniform pressure as a function of the angle of (speed, rim
/// speed): linear interpolation in a table, with an error below 1e-6.
fn patch(angle: f64) -> [f64; 2] {
    const INTERVALS: usize = 1024;
    static TABLE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let angle = |k: usize| FRAC_PI_2 * k as f64 / INTERVALS as f64;
        (0..=INTERVALS).map(|k| patch_force_and_torque(angle(k).cos() / angle(k).sin())).collect()
    });
    let position = (angle / FRAC_PI_2).clamp(0.0, 1.0) * INTERVALS as f64;
    let k = (position as usize).min(INTERVALS - 1);
    let fraction = position - k as f64;
    [0, 1].map(|n| table[k][n] + fraction * (table[k + 1][n] - table[k][n]))
}

/// The radius of the disc of uniform pressure whose frictional torque is that of an outline that rests on its whole area
/// (m).
pub(crate) fn patch_radius_m(shape: &Shape) -> f64 {
    PATCH_RADIUS_PER_ARM * shape.mean_arm_m()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(friction: f64) -> SlideParameters {
        SlideParameters { friction, patch_radius_m: 0.04, gyration_m: 0.04 / 2f64.sqrt() }
    }

    fn launched(speed_m_s: f64, rim_m_s: f64) -> MotionState {
        let velocity = Vec2::from_heading(0.7) * speed_m_s;
        MotionState { pose: Pose::new(0.1, 0.2, 0.3), velocity, spin_rad_s: rim_m_s / 0.04 }
    }

    #[test]
    fn a_sliding_body_stops_and_never_turns_back() {
        let slide = Slide::new(0.5, launched(0.6, 0.0), &disc(0.25));
        let range_m = 0.36 / (2.0 * 0.25 * GRAVITY_M_S2);
        for later_s in [0.3, 1.0, 100.0] {
            let motion = slide.motion(0.5 + later_s);
            let distance_m = motion.pose.position.distance(Point::new(0.1, 0.2));
            assert!((distance_m - range_m).abs() < 1e-12, "{later_s} s: {distance_m} m, not {range_m} m");
            assert_eq!(motion.velocity.length(), 0.0);
        }
    }

    #[test]
    fn a_spinning_disc_slides_as_far_as_in_the_published_table() {
        // Speed over rim speed; range and time over those without spin; path of the rim over twice that range.
        for (ratio, range, time, rotation) in [
            (0.5, 1.967, 1.903, 1.87),
            (1.0, 1.275, 1.340, 0.724),
            (2.0, 1.065, 1.122, 0.343),
            (10.0, 1.0025, 1.009, 0.067),
        ] {
            let slide = Slide::new(0.0, launched(0.5, 0.5 / ratio), &disc(0.3));
            let (range_m, time_s) = (0.25 / (0.6 * GRAVITY_M_S2), 0.5 / (0.3 * GRAVITY_M_S2));
            let end = slide.motion(10.0);
            let distance_m = end.pose.position.distance(Point::new(0.1, 0.2));
            let rotated = (end.pose.yaw_rad - 0.3) * 0.04 / (2.0 * range_m);
            assert!(
                (distance_m / range_m / range - 1.0).abs() < 2e-3,
                "eps {ratio}: range {}",
                distance_m / range_m
            );
            assert!(
                (slide.stop_s() / time_s / time - 1.0).abs() < 2e-3,
                "eps {ratio}: time {}",
                slide.stop_s() / time_s
            );
            assert!((rotated / rotation - 1.0).abs() < 4e-3, "eps {ratio}: rotation {rotated}");
        }
    }

    #[test]
    fn the_velocity_of_a_spinning_slide_is_the_derivative_of_its_position() {
        let slide = Slide::new(0.0, launched(0.4, 0.3), &disc(0.3));
        for k in 1..20 {
            let t = f64::from(k) * slide.stop_s() / 20.0;
            let (before, after) = (slide.motion(t - 1e-5), slide.motion(t + 1e-5));
            let numeric = (after.pose.position - before.pose.position) / 2e-5;
            let error_m_s = (numeric - slide.motion(t).velocity).length();
            assert!(error_m_s < 2e-3, "at {t} s: {error_m_s} m/s");
        }
    }
}
