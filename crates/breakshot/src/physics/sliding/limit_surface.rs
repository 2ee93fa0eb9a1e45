//! How does the table hold a body whose support is no round patch?
//!
//! Coulomb friction adds up over the support: `F = -mu m g sum w_i u_i / |u_i|`, `u_i` the velocity of the i-th point that presses
//! with the share `w_i` of the weight (the paper's non-uniform pressure distribution).  Force and torque do not change when all
//! speeds are scaled alike, so they are tabulated over the ratio of sliding to spinning and the direction of sliding, seen from
//! the body.  Such a body's way bends: it is followed in short stretches, each straight and evenly braked.

use crate::error::{Error, Result};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Shape, positive};
use crate::outline::Outline;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{Law, Motion, State, length};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Where a body presses on the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Pressure {
    /// Evenly, under its whole outline.
    #[default]
    Even,
    /// On feet.
    Feet {
        /// Where they are, seen from the centroid (m).
        at_m: Vec<Point>,
    },
    /// Under its whole outline, more on one side: the pressure is `1 + gradient . x`, never negative.
    Tilted {
        /// How fast it grows (1/m).
        gradient_per_m: Vec2,
    },
}

/// How the table's friction depends on speed and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Friction grows by this part of itself with each metre a second (s/m).
    pub growth_s_m: f64,
    /// The direction of the table's grain (rad).
    pub grain_rad: f64,
    /// Friction across the grain over friction along it.
    pub across: f64,
}

impl Default for Surface {
    /// The same in all directions and at all speeds.
    fn default() -> Self {
        Self { growth_s_m: 0.0, grain_rad: 0.0, across: 1.0 }
    }
}

impl Pressure {
    /// An error that names the object unless it can stand so.
    pub(crate) fn check(&self, kind: &str) -> Result<()> {
        let owner = format!("options: pressure of `{kind}`");
        match self {
            Self::Feet { at_m } if at_m.len() < 3 || !at_m.iter().all(|p| p.is_finite()) => {
                Err(Error::invalid(owner, "at_m", format!("{} feet", at_m.len()), "three or more places"))
            }
            Self::Tilted { gradient_per_m } if !(gradient_per_m.x + gradient_per_m.y).is_finite() => {
                Err(Error::invalid(owner, "gradient_per_m", "not a number", "numbers"))
            }
            _ => Ok(()),
        }
    }
}

impl Surface {
    pub(crate) fn check(&self) -> Result<()> {
        positive("options: surface", "across", self.across)?;
        if !(self.grain_rad.is_finite() && self.growth_s_m > -1.0 && self.growth_s_m.is_finite()) {
            let found = format!("{} and {}", self.grain_rad, self.growth_s_m);
            let needed = "a direction, and a growth above -1 s/m";
            return Err(Error::invalid("options: surface", "grain_rad and growth_s_m", found, needed));
        }
        Ok(())
    }
}

/// Outlines longer than this times their width (as their second moments tell) are no round patch.
const ELONGATED: f64 = 1.5;
/// Points along the longer side of an outline that stand for its pressure.
const POINTS: usize = 18;
/// Cells of the table over the ratio of spinning to sliding and over the direction of sliding.
const RATIOS: usize = 24;
const DIRECTIONS: usize = 32;
/// In one stretch the speeds change by this part.
const STRETCH: f64 = 0.1;
/// Slower bodies (m/s) stop on a straight line: they go less than ten micrometres.
const LAST_STRETCH_M_S: f64 = 5e-3;

/// How the table holds one kind of body: force over mu m g and torque over mu m g R.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hold {
    table: Vec<[f64; 3]>,
    surface: Surface,
    /// Along the grain.
    grain: Vec2,
    /// Whether a slide without spin stays straight and without spin.
    even: bool,
}

impl Hold {
    /// How the table holds a shape; none if the round patch is as good.
    pub(crate) fn new(shape: &Shape, pressure: &Pressure, surface: Surface, radius_m: f64) -> Option<Self> {
        let uniform = surface == Surface::default();
        if uniform && *pressure == Pressure::Even && !is_elongated(shape) {
            return None;
        }
        let points = pressing_points(shape, pressure);
        let mut table = Vec::with_capacity((RATIOS + 1) * DIRECTIONS);
        for i in 0..=RATIOS {
            let spin = Vec2::from_heading(FRAC_PI_2 * i as f64 / RATIOS as f64);
            for k in 0..DIRECTIONS {
                let velocity = Vec2::from_heading(TAU * k as f64 / DIRECTIONS as f64) * spin.y;
                table.push(held(&points, velocity, spin.x / radius_m, radius_m));
            }
        }
        let even = uniform && !matches!(pressure, Pressure::Tilted { .. });
        let grain = Vec2::from_heading(surface.grain_rad);
        Some(Self { table, surface, grain, even })
    }

    /// Force over mu m g, seen from the body, and torque over mu m g R, at a velocity seen from the body and a rim's speed.
    fn at(&self, velocity: Vec2, rim: f64) -> [f64; 3] {
        // Turning everything around turns forces and torques around.
        let sign = if rim < 0.0 { -1.0 } else { 1.0 };
        let velocity = velocity * sign;
        let ratio = length(velocity).atan2(rim.abs()) / FRAC_PI_2 * RATIOS as f64;
        let heading = velocity.y.atan2(velocity.x).rem_euclid(TAU) / TAU * DIRECTIONS as f64;
        let (i, k) = ((ratio as usize).min(RATIOS - 1), heading as usize % DIRECTIONS);
        let (x, y) = (ratio - i as f64, (heading - heading.floor()).clamp(0.0, 1.0));
        let cell = |i: usize, k: usize| &self.table[i * DIRECTIONS + k % DIRECTIONS];
        let corners = [cell(i, k), cell(i, k + 1), cell(i + 1, k), cell(i + 1, k + 1)];
        let shares = [(1.0 - x) * (1.0 - y), (1.0 - x) * y, x * (1.0 - y), x * y];
        [0, 1, 2].map(|c| sign * corners.iter().zip(shares).map(|(v, share)| v[c] * share).sum::<f64>())
    }

    /// Acceleration (m/s2) and of the turn (rad/s2).
    fn accelerations(&self, body: &Body, velocity: Vec2, yaw_rad: f64, rate: f64) -> (Vec2, f64) {
        let turn = Rotation::new(yaw_rad);
        let rim = rate * body.patch_radius_m;
        let [fx, fy, torque] = self.at(turn.turned_back(velocity), rim);
        let force = turn.turned(Vec2::new(fx, fy));
        let surface = &self.surface;
        let across = force - self.grain * force.dot(self.grain);
        let force = force + across * (surface.across - 1.0);
        let torque = torque * 0.5 * (1.0 + surface.across);
        let speed = velocity.length_squared() + rim * rim;
        let grip = body.grip_m_s2 * (1.0 + surface.growth_s_m * speed.sqrt()).max(0.0);
        // kappa = (radius of gyration / R)^2: R inverse_inertia / inverse_mass = 1 / (kappa R).
        let per_kappa = body.patch_radius_m * body.inverse_inertia / body.inverse_mass;
        (force * grip, torque * grip * per_kappa)
    }
}

/// Whether the second moments along the principal axes differ much.
fn is_elongated(shape: &Shape) -> bool {
    let points = pressing_points(shape, &Pressure::Even);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (p, share) in &points {
        xx += share * p.x * p.x;
        xy += share * p.x * p.y;
        yy += share * p.y * p.y;
    }
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    mean + half > ELONGATED * ELONGATED * (mean - half)
}

/// Points that press, seen from the centroid, each with its share of the weight.
fn pressing_points(shape: &Shape, pressure: &Pressure) -> Vec<(Vec2, f64)> {
    let mut points: Vec<(Vec2, f64)> = match pressure {
        Pressure::Feet { at_m } => at_m.iter().map(|p| (p.to_vec(), 1.0)).collect(),
        Pressure::Even => inner_points(shape).into_iter().map(|p| (p, 1.0)).collect(),
        Pressure::Tilted { gradient_per_m } => {
            inner_points(shape).into_iter().map(|p| (p, (1.0 + gradient_per_m.dot(p)).max(0.0))).collect()
        }
    };
    let sum: f64 = points.iter().map(|p| p.1).sum();
    for point in &mut points {
        point.1 /= sum;
    }
    points
}

/// The middles of the cells of a grid that lie inside an outline.
fn inner_points(shape: &Shape) -> Vec<Vec2> {
    let outline = Outline::new(shape, Pose::default());
    let corners = shape.corners();
    let reach = |along: fn(&Point) -> f64| {
        let r = shape.outer_radius_m();
        let values = corners.iter().map(along);
        if corners.is_empty() {
            return (-r, r);
        }
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let ((left, right), (low, high)) = (reach(|p| p.x), reach(|p| p.y));
    let cell = (right - left).max(high - low) / POINTS as f64;
    let count = |from: f64, to: f64| ((to - from) / cell).round().max(6.0) as usize;
    let (columns, rows) = (count(left, right), count(low, high));
    let mut points = Vec::new();
    for i in 0..columns {
        for k in 0..rows {
            let part = |n: usize, of: usize| (n as f64 + 0.5) / of as f64;
            let p = Point::new(left + (right - left) * part(i, columns), low + (high - low) * part(k, rows));
            if outline.contains(p) {
                points.push(p.to_vec());
            }
        }
    }
    points
}

/// Force over mu m g and torque over mu m g R on points that move along with a velocity and a rate of turn.
fn held(points: &[(Vec2, f64)], velocity: Vec2, rate: f64, radius_m: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (p, share) in points {
        let slip = velocity + p.perpendicular() * rate;
        let speed = length(slip);
        if speed > 0.0 {
            let force = slip * (-share / speed);
            sum[0] += force.x;
            sum[1] += force.y;
            sum[2] += p.cross(force) / radius_m;
        }
    }
    sum
}

impl Motion {
    /// One stretch of a bent way; the last one leads to rest.
    pub(crate) fn bent(state: &State, time_s: f64, body: &Body, hold: &Hold) -> Option<Self> {
        let (velocity, rate) = (state.velocity, state.yaw_rate_rad_s);
        let radius_m = body.patch_radius_m;
        let (speed, rim) = (length(velocity), rate.abs() * radius_m);
        let both = speed.hypot(rim);
        if hold.even && rim <= 1e-6 * speed {
            return None;
        }
        let (pull, turn) = hold.accelerations(body, velocity, state.yaw_rad, rate);
        let mut motion = Self::rest(Pose { position: state.position, yaw_rad: state.yaw_rad }, time_s);
        motion.direction = velocity.direction().unwrap_or(Vec2::ZERO);
        (motion.speed_m_s, motion.yaw_rate_rad_s) = (speed, rate);
        if both < LAST_STRETCH_M_S {
            let lost = -(velocity.dot(pull) + rate * turn * radius_m * radius_m) / both;
            let time = both / lost.max(0.1 * body.grip_m_s2);
            motion.law = Law::Even;
            motion.stop_s = time_s + time;
            motion.deceleration_m_s2 = [speed / time; 2];
            motion.yaw_deceleration_rad_s2 = rate.abs() / time;
            let way = motion.direction * (0.5 * speed * time);
            motion.half_way_m = 0.25 * speed * time;
            motion.end = Pose { position: state.position + way, yaw_rad: state.yaw_rad + 0.5 * rate * time };
            return Some(motion);
        }
        let time = STRETCH * both / length(pull).hypot(turn * radius_m);
        let half = 0.5 * time;
        let middle_yaw_rad = state.yaw_rad + half * (rate + 0.5 * half * turn);
        let (pull, turn) =
            hold.accelerations(body, velocity + pull * half, middle_yaw_rad, rate + turn * half);
        let (onward, rate_onward) = (velocity + pull * time, rate + turn * time);
        // A turn that would reverse ends with the stretch.
        let rate_onward = if rate_onward * rate < 0.0 { 0.0 } else { rate_onward };
        let sign = 1.0f64.copysign(if rate == 0.0 { rate_onward } else { rate });
        motion.direction = (velocity + onward).direction().unwrap_or(Vec2::ZERO);
        motion.law = Law::Bent { onward };
        motion.stop_s = time_s + time;
        motion.deceleration_m_s2 = [(speed - length(onward)) / time; 2];
        motion.yaw_rate_rad_s = rate.abs().max(f64::MIN_POSITIVE).copysign(sign);
        motion.yaw_deceleration_rad_s2 = (rate.abs() - rate_onward.abs()) / time;
        motion.half_way_m = 0.5 * half * (speed + length(onward));
        motion.end = Pose {
            position: state.position + motion.direction * (2.0 * motion.half_way_m),
            yaw_rad: state.yaw_rad + half * (rate + rate_onward),
        };
        Some(motion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::contact::compound_shape::Plate;
    use crate::physics::sliding::motion::Spin;
    use crate::physics::sliding::patch_friction::{PATCH_RADIUS_PER_ARM, mean_arm_m};
    use crate::physics::sliding::slide_curve::SlideCurve;
    use std::sync::Arc;

    fn body(shape: &Shape, pressure: &Pressure, surface: Surface) -> Body {
        let patch_radius_m = PATCH_RADIUS_PER_ARM * mean_arm_m(shape);
        let gyration_m = shape.radius_of_gyration_m();
        Body {
            plate: Arc::new(Plate::new(shape)),
            pose: Pose::default(),
            inverse_mass: 10.0,
            inverse_inertia: 10.0 / (gyration_m * gyration_m),
            grip_m_s2: 0.3 * 9.81,
            patch_radius_m,
            curve: Arc::new(SlideCurve::new((gyration_m / patch_radius_m).powi(2))),
            hold: Hold::new(shape, pressure, surface, patch_radius_m).map(Arc::new),
            kind: 1,
        }
    }

    /// Where a launched body stops by stretches, and by friction summed over the points in steps of 50 microseconds.
    fn stops(shape: &Shape, pressure: &Pressure, surface: Surface, launch: &State) -> (Pose, Pose) {
        let body = body(shape, pressure, surface);
        let (mut time_s, mut state) = (0.0, *launch);
        let by_stretches = loop {
            let motion = Motion::slide(&state, time_s, &body, Spin::Coupled);
            let Law::Bent { onward } = motion.law else { break motion.end };
            time_s = motion.stop_s;
            state = State { velocity: onward, ..motion.state(time_s, &body) };
        };
        let points = pressing_points(shape, pressure);
        let (step_s, mut now) = (5e-5, *launch);
        while length(now.velocity) + now.yaw_rate_rad_s.abs() * body.patch_radius_m > 2e-3 {
            let turn = Rotation::new(now.yaw_rad);
            let velocity = turn.turned_back(now.velocity);
            let [x, y, t] = held(&points, velocity, now.yaw_rate_rad_s, body.patch_radius_m);
            let force = turn.turned(Vec2::new(x, y));
            let grain = Vec2::from_heading(surface.grain_rad);
            let across = force - grain * force.dot(grain);
            let grip = body.grip_m_s2 * (1.0 + surface.growth_s_m * length(now.velocity));
            now.velocity += (force + across * (surface.across - 1.0)) * (grip * step_s);
            now.yaw_rate_rad_s += t * body.patch_radius_m * body.inverse_inertia / 10.0 * grip * step_s;
            now.position += now.velocity * step_s;
            now.yaw_rad += now.yaw_rate_rad_s * step_s;
        }
        (by_stretches, Pose { position: now.position, yaw_rad: now.yaw_rad })
    }

    /// The median distance (m) between the two over launches of all directions and spins.
    fn median_error_m(shape: &Shape, pressure: &Pressure) -> f64 {
        let mut errors: Vec<f64> = (0..15)
            .map(|k| {
                let (k, rim) = (f64::from(k), [0.1, 0.3, 0.6, 0.9, 0.2][k as usize % 5]);
                let launch = State {
                    velocity: Vec2::from_heading(0.42 * k) * (0.2 + 0.05 * k),
                    yaw_rate_rad_s: rim / 0.04 * (0.42 * k).cos().signum(),
                    ..State::default()
                };
                let (one, two) = stops(shape, pressure, Surface::default(), &launch);
                one.position.distance(two.position)
            })
            .collect();
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    }

    #[test]
    fn a_bent_way_ends_where_summed_friction_leads() {
        let rectangle = |x: f64, y: f64| Shape::Rectangle { size_m: [x, y] };
        let feet = |angle: f64| Point::ORIGIN + Vec2::from_heading(angle) * 0.03;
        for (shape, pressure) in [
            (rectangle(0.1, 0.04), Pressure::Even),
            (rectangle(0.12, 0.015), Pressure::Even),
            (
                Shape::Disc { radius_m: 0.04 },
                Pressure::Feet { at_m: vec![feet(0.0), feet(2.0944), feet(4.1888)] },
            ),
            (rectangle(0.08, 0.08), Pressure::Tilted { gradient_per_m: Vec2::new(15.0, 0.0) }),
        ] {
            let error_m = median_error_m(&shape, &pressure);
            assert!(error_m < 8e-4, "{shape:?} {pressure:?}: {} mm", error_m * 1e3);
        }
    }

    #[test]
    fn friction_across_the_grain_turns_a_slide_along_it() {
        let surface = Surface { grain_rad: 0.0, across: 1.5, growth_s_m: 0.2 };
        let launch = State { velocity: Vec2::from_heading(0.8) * 0.6, ..State::default() };
        let shape = Shape::Disc { radius_m: 0.04 };
        let (one, two) = stops(&shape, &Pressure::Even, surface, &launch);
        assert!(one.position.distance(two.position) < 3e-4, "{one:?}, not {two:?}");
        assert!(one.position.to_vec().direction().expect("a way").y < 0.8f64.sin() - 0.02, "{one:?}");
    }

    #[test]
    fn a_square_needs_no_table() {
        let square = Shape::Rectangle { size_m: [0.08, 0.08] };
        assert!(body(&square, &Pressure::Even, Surface::default()).hold.is_none());
    }
}
