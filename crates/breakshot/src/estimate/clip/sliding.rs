//! How a body slides to rest under Coulomb friction, with or without spin.
//!
//! Without spin the deceleration is `mu g` against the velocity until the body stops (Eq. 26 and 30).  Spin lowers it:
//! every point of the support slides in its own direction.  The simulator's law of the support holds here too: the
//! path stays straight, and sliding and spinning stop together.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;
use crate::physics::sliding::patch_friction::{PATCH_RADIUS_PER_ARM, mean_arm_m, patch_force_and_torque};
use std::f64::consts::FRAC_PI_2;
use std::sync::OnceLock;

/// Where a body is, and how it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Where it is.
    pub pose: Pose,
    /// The centroid's velocity (m/s).
    pub velocity: Vec2,
    /// The rate of turn (rad/s).
    pub spin_rad_s: f64,
}

impl Motion {
    /// The velocity of the body's point that is at `place` just now (Eq. 13).
    pub fn velocity_at(&self, place: Point) -> Vec2 {
        self.velocity + (place - self.pose.position).perpendicular() * self.spin_rad_s
    }
}

/// How the table holds a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grip {
    /// The coefficient of friction.
    pub(crate) friction: f64,
    /// The radius of the uniform disc that resists like the body's support (m).
    pub(crate) patch_radius_m: f64,
    /// The body's radius of gyration (m).
    pub(crate) gyration_m: f64,
}

/// A slide from one impact to the next, or to rest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Slide {
    start_s: f64,
    start: Motion,
    course: Course,
}

#[derive(Clone, Debug, PartialEq)]
enum Course {
    /// No spin that matters: the speed falls evenly, by `slowing_hz` of its first value a second.
    Straight { stop_after_s: f64, slowing_hz: f64 },
    /// Sliding and spinning along a direction, tabulated from start to rest.
    Spinning { along: Vec2, knots: Vec<Knot> },
    /// Slowed by whatever it is, evenly for a while; never at rest.
    Free(Rates),
}

/// How fast a velocity changes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Rates {
    /// Of the centroid (m/s^2).
    pub(crate) acceleration: Vec2,
    /// Of the spin (rad/s^2).
    pub(crate) spin_rad_s2: f64,
}

/// A moment of a spinning slide.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Knot {
    time_s: f64,
    distance_m: f64,
    turn_rad: f64,
    speed_m_s: f64,
    spin_rad_s: f64,
}

/// Below this rim speed over speed, spin changes the deceleration by less than 1e-9.
const SPIN_THAT_MATTERS: f64 = 1e-4;
/// Steps of a spinning slide: 16 leave an error below 1e-4 of the range.
const STEPS: usize = 16;

impl Slide {
    /// The slide that begins with this motion at `start_s`.
    pub(crate) fn new(start_s: f64, start: Motion, grip: &Grip) -> Self {
        let deceleration_m_s2 = grip.friction * GRAVITY_M_S2;
        let (speed_m_s, rim_m_s) = (start.velocity.length(), start.spin_rad_s.abs() * grip.patch_radius_m);
        let spinning = deceleration_m_s2 > 0.0 && rim_m_s > SPIN_THAT_MATTERS * speed_m_s;
        let course = if spinning {
            let along = if speed_m_s > 0.0 { start.velocity / speed_m_s } else { Vec2::ZERO };
            Course::Spinning { along, knots: knots(&start, speed_m_s, grip) }
        } else {
            let stops = deceleration_m_s2 > 0.0;
            let stop_after_s = if stops { speed_m_s / deceleration_m_s2 } else { f64::INFINITY };
            let slowing_hz = if speed_m_s > 0.0 { deceleration_m_s2 / speed_m_s } else { 0.0 };
            Course::Straight { stop_after_s, slowing_hz }
        };
        Self { start_s, start, course }
    }

    /// The slide that begins with this motion at `start_s` and whose velocity changes at constant rates.
    pub(crate) fn free(start_s: f64, start: Motion, rates: Rates) -> Self {
        Self { start_s, start, course: Course::Free(rates) }
    }

    /// Where the body is and how it moves; before the start it moved evenly.
    pub(crate) fn motion(&self, time_s: f64) -> Motion {
        let elapsed_s = time_s - self.start_s;
        match &self.course {
            Course::Straight { stop_after_s, slowing_hz } => {
                self.straight(elapsed_s, *stop_after_s, *slowing_hz)
            }
            Course::Spinning { along, knots } => self.spinning(elapsed_s, *along, knots),
            Course::Free(rates) => self.freely(elapsed_s, rates),
        }
    }

    /// When the body comes to rest; never, without friction.
    pub(crate) fn stop_s(&self) -> f64 {
        match &self.course {
            Course::Straight { stop_after_s, .. } => self.start_s + stop_after_s,
            Course::Spinning { knots, .. } => self.start_s + knots.last().map_or(0.0, |k| k.time_s),
            Course::Free(_) => f64::INFINITY,
        }
    }

    fn straight(&self, elapsed_s: f64, stop_after_s: f64, slowing_hz: f64) -> Motion {
        let t = elapsed_s.min(stop_after_s);
        let part = slowing_hz * t;
        // Before the start there is no friction to speak of: an impact that is tried too late must not gain speed.
        let (distance, left) = if t < 0.0 { (t, 1.0) } else { (t * (1.0 - part / 2.0), 1.0 - part) };
        let turn_rad = self.start.spin_rad_s * distance;
        self.moved(self.start.velocity * distance, turn_rad, left)
    }

    fn spinning(&self, elapsed_s: f64, along: Vec2, knots: &[Knot]) -> Motion {
        if elapsed_s <= 0.0 {
            return self.moved(self.start.velocity * elapsed_s, self.start.spin_rad_s * elapsed_s, 1.0);
        }
        let next = knots.partition_point(|k| k.time_s <= elapsed_s);
        let now = match (knots.get(next - 1), knots.get(next)) {
            (Some(from), Some(to)) => from.towards(to, elapsed_s),
            (Some(last), None) => *last,
            (None, _) => return self.start,
        };
        let mut motion = self.moved(along * now.distance_m, now.turn_rad, 0.0);
        motion.velocity = along * now.speed_m_s;
        motion.spin_rad_s = now.spin_rad_s;
        motion
    }

    fn freely(&self, elapsed_s: f64, rates: &Rates) -> Motion {
        let changed_s = elapsed_s.max(0.0);
        let half = changed_s * changed_s / 2.0;
        let way = self.start.velocity * elapsed_s + rates.acceleration * half;
        let turn_rad = self.start.spin_rad_s * elapsed_s + rates.spin_rad_s2 * half;
        let mut motion = self.moved(way, turn_rad, 1.0);
        motion.velocity += rates.acceleration * changed_s;
        motion.spin_rad_s += rates.spin_rad_s2 * changed_s;
        motion
    }

    fn moved(&self, way: Vec2, turn_rad: f64, left: f64) -> Motion {
        let Motion { pose, velocity, spin_rad_s } = self.start;
        Motion {
            pose: Pose { position: pose.position + way, yaw_rad: pose.yaw_rad + turn_rad },
            velocity: velocity * left,
            spin_rad_s: spin_rad_s * left,
        }
    }
}

impl Knot {
    /// The moment `time_s` between this one and the next, by the cubic that keeps both ends' speeds.
    fn towards(&self, next: &Self, time_s: f64) -> Self {
        let step_s = next.time_s - self.time_s;
        let u = if step_s > 0.0 { (time_s - self.time_s) / step_s } else { 1.0 };
        let cubic = |from: f64, to: f64, slope_from: f64, slope_to: f64| {
            let (d0, d1) = (slope_from * step_s, slope_to * step_s);
            let rise = to - from;
            from + u * (d0 + u * (3.0 * rise - 2.0 * d0 - d1 + u * (d0 + d1 - 2.0 * rise)))
        };
        Self {
            time_s,
            distance_m: cubic(self.distance_m, next.distance_m, self.speed_m_s, next.speed_m_s),
            turn_rad: cubic(self.turn_rad, next.turn_rad, self.spin_rad_s, next.spin_rad_s),
            speed_m_s: self.speed_m_s + u * (next.speed_m_s - self.speed_m_s),
            spin_rad_s: self.spin_rad_s + u * (next.spin_rad_s - self.spin_rad_s),
        }
    }
}

/// A spinning slide from start to rest.
///
/// Let `u` be the length of (speed, rim speed) and `angle` its direction.  Both fall with the same clock, so
/// `angle` depends on `ln u` alone; `u` falls evenly from knot to knot, and the time follows.
fn knots(start: &Motion, speed: f64, grip: &Grip) -> Vec<Knot> {
    let Grip { friction, patch_radius_m: radius, gyration_m } = *grip;
    let inertia = (radius / gyration_m).powi(2);
    let turning = start.spin_rad_s.signum();
    let rim = start.spin_rad_s.abs() * radius;
    let u_start = speed.hypot(rim);
    let deceleration = friction * GRAVITY_M_S2;
    let mut angle = rim.atan2(speed);
    let mut knot =
        Knot { time_s: 0.0, distance_m: 0.0, turn_rad: 0.0, speed_m_s: speed, spin_rad_s: start.spin_rad_s };
    let mut all = Vec::with_capacity(STEPS + 1);
    all.push(knot);
    let (mut sin, mut cos) = angle.sin_cos();
    for (step, [to_mid, to_next]) in logarithms().iter().enumerate() {
        let u = u_start * (1.0 - step as f64 / STEPS as f64);
        let u_next = u_start * (1.0 - (step + 1) as f64 / STEPS as f64);
        // The midpoint stands for the step; the last one ends at rest, where the angle no longer changes.
        let (slowing, turning_rate) = resistance(angle, (sin, cos), inertia);
        let mid = (angle + turning_rate / slowing * to_mid).clamp(0.0, FRAC_PI_2);
        let (sin_mid, cos_mid) = mid.sin_cos();
        let (slowing, turning_rate) = resistance(mid, (sin_mid, cos_mid), inertia);
        let u_mid = f64::midpoint(u, u_next);
        let dt = (u - u_next) / (deceleration * slowing);
        knot.time_s += dt;
        knot.distance_m += u_mid * cos_mid * dt;
        knot.turn_rad += turning * u_mid * sin_mid / radius * dt;
        if step + 1 < STEPS {
            angle = (angle + turning_rate / slowing * to_next).clamp(0.0, FRAC_PI_2);
            (sin, cos) = angle.sin_cos();
        }
        knot.speed_m_s = u_next * cos;
        knot.spin_rad_s = turning * u_next * sin / radius;
        all.push(knot);
    }
    all
}

/// The logarithms of `u` at the middle and at the end of each step over that at its start.
fn logarithms() -> &'static [[f64; 2]; STEPS] {
    static TABLE: OnceLock<[[f64; 2]; STEPS]> = OnceLock::new();
    TABLE.get_or_init(|| {
        std::array::from_fn(|step| {
            let left = (STEPS - step) as f64;
            [0.5, 1.0].map(|part| ((left - part) / left).ln())
        })
    })
}

/// How fast `u` falls and `angle` turns, both over `mu g`; the latter times `u`.
fn resistance(angle: f64, (sin, cos): (f64, f64), inertia: f64) -> (f64, f64) {
    let [force, torque] = patch(angle);
    (force * cos + inertia * torque * sin, inertia * torque * cos - force * sin)
}

/// Force and torque of a uniform patch by the angle of (speed, rim speed), between tabulated values on straight lines:
/// off by less than 1e-6.
fn patch(angle: f64) -> [f64; 2] {
    const PARTS: usize = 1024;
    static TABLE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let angle = |k: usize| FRAC_PI_2 * k as f64 / PARTS as f64;
        (0..=PARTS).map(|k| patch_force_and_torque(angle(k).cos() / angle(k).sin())).collect()
    });
    let place = (angle / FRAC_PI_2).clamp(0.0, 1.0) * PARTS as f64;
    let k = (place as usize).min(PARTS - 1);
    let part = place - k as f64;
    [0, 1].map(|n| table[k][n] + part * (table[k + 1][n] - table[k][n]))
}

/// The radius of the uniform disc that resists like an outline resting on its whole area (m).
pub(crate) fn patch_radius_m(shape: &Shape) -> f64 {
    PATCH_RADIUS_PER_ARM * mean_arm_m(shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(friction: f64) -> Grip {
        Grip { friction, patch_radius_m: 0.04, gyration_m: 0.04 / 2f64.sqrt() }
    }

    fn launched(speed_m_s: f64, rim_m_s: f64) -> Motion {
        let velocity = Vec2::from_heading(0.7) * speed_m_s;
        Motion { pose: Pose::new(0.1, 0.2, 0.3), velocity, spin_rad_s: rim_m_s / 0.04 }
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
    fn a_spinning_disc_slides_as_far_as_the_published_table_says() {
        // Speed over rim speed; range and time over those without spin; way of the rim over twice that range.
        for (ratio, range, time, turn) in [
            (0.5, 1.967, 1.903, 1.87),
            (1.0, 1.275, 1.340, 0.724),
            (2.0, 1.065, 1.122, 0.343),
            (10.0, 1.0025, 1.009, 0.067),
        ] {
            let slide = Slide::new(0.0, launched(0.5, 0.5 / ratio), &disc(0.3));
            let (range_m, time_s) = (0.25 / (0.6 * GRAVITY_M_S2), 0.5 / (0.3 * GRAVITY_M_S2));
            let end = slide.motion(10.0);
            let distance_m = end.pose.position.distance(Point::new(0.1, 0.2));
            let turned = (end.pose.yaw_rad - 0.3) * 0.04 / (2.0 * range_m);
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
            assert!((turned / turn - 1.0).abs() < 4e-3, "eps {ratio}: turn {turned}");
        }
    }

    #[test]
    fn position_and_velocity_of_a_spinning_slide_go_together() {
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
