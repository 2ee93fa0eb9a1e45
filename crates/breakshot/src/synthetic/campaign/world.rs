//! Bodies that slide on a table and hit each other, step by step.
//!
//! The table holds every body at many points of its support, each of which drags against its own velocity; impacts
//! are instantaneous, with Newton's restitution and Coulomb's friction at the contact point.  Slow and plain: it
//! is what the closed forms of the fit are tested against.

use super::{RETRACT_M_S, STRIKER_M};
use crate::geometry::{Point, Vec2};
use crate::object::{Object, Shape, kind, pair_key};
use crate::physics::GRAVITY_M_S2;
use crate::scene::Strike;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// The step of the motion (s).
pub(super) const STEP_S: f64 = 2.5e-4;
/// How far every pair's mass ratio is off because bodies rock (log, one deviation).
pub(super) const ROCKING_STD: f64 = 0.005;

/// What holds between the objects.
#[derive(Clone, Debug, Default)]
pub(super) struct Laws {
    pub(super) masses_kg: BTreeMap<String, f64>,
    pub(super) friction: BTreeMap<String, f64>,
    pub(super) striker_restitution: BTreeMap<String, f64>,
    pub(super) restitution: BTreeMap<String, f64>,
    pub(super) contact_friction: f64,
    pub(super) striker_friction: f64,
    /// The share of contact friction that acts upwards where the shorter strikes the taller, and where the taller
    /// strikes the shorter: the table takes its friction from that at once.
    pub(super) pressing: [f64; 2],
    /// The logarithm by which a pair's ratio is off.
    pub(super) rocking: BTreeMap<String, f64>,
}

/// One body.
#[derive(Clone, Debug)]
pub(super) struct Body {
    object: String,
    shape: Shape,
    height_m: f64,
    mass_kg: f64,
    inertia_kg_m2: f64,
    friction: f64,
    /// Points of the support, each holding the same share of the weight.
    support_m: Vec<Vec2>,
    sees_yaw: bool,
    position: Point,
    yaw_rad: f64,
    velocity: Vec2,
    spin_rad_s: f64,
}

/// Where a body was at every step.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub(super) object: String,
    pub(super) sees_yaw: bool,
    pub(super) poses: Vec<[f64; 3]>,
}

/// The table with everything on it.
pub(super) struct World {
    bodies: Vec<Body>,
    strike: Strike,
    begins_s: f64,
}

/// Where two bodies touch: the normal from the first to the second.
struct Touch {
    normal: Vec2,
    point: Point,
}

/// Half of what a body takes of the way across its face.
pub(super) fn half_width_m(shape: &Shape) -> f64 {
    match shape {
        Shape::Disc { radius_m } => *radius_m,
        other => other.reach_m(Vec2::new(1.0, 0.0)),
    }
}

/// How much later than a central one a striker meets a disc that it hits this far off its centre.
pub(super) fn deeper_m(shape: &Shape, aside_m: f64) -> f64 {
    match shape {
        Shape::Disc { radius_m } => {
            let sum = radius_m + STRIKER_M;
            sum - (sum * sum - aside_m * aside_m).max(0.0).sqrt()
        }
        _ => 0.0,
    }
}

/// The direction in which a body leaves a striker that meets it this far off its centre, without friction.
pub(super) fn leaves(shape: &Shape, along: Vec2, aside_m: f64) -> Vec2 {
    match shape {
        Shape::Disc { radius_m } => {
            let sin = -aside_m / (radius_m + STRIKER_M);
            along * (1.0 - sin * sin).max(0.0).sqrt() + along.perpendicular() * sin
        }
        _ => along,
    }
}

impl Body {
    pub(super) fn new(
        name: String,
        object: &Object,
        laws: &Laws,
        (position, yaw_rad): (Point, f64),
        friction_scale: f64,
    ) -> Self {
        let of = |values: &BTreeMap<String, f64>| values.get(&object.name).copied().unwrap_or(f64::NAN);
        let mass_kg = of(&laws.masses_kg);
        Self {
            object: name,
            shape: object.shape.clone(),
            height_m: object.height_m,
            mass_kg,
            inertia_kg_m2: mass_kg * object.shape.radius_of_gyration_m().powi(2),
            friction: of(&laws.friction) * friction_scale,
            support_m: support_m(&object.shape),
            sees_yaw: !matches!(object.feature().shape, Shape::Disc { .. }),
            position,
            yaw_rad,
            velocity: Vec2::ZERO,
            spin_rad_s: 0.0,
        }
    }

    fn velocity_at(&self, point: Point) -> Vec2 {
        self.velocity + (point - self.position).perpendicular() * self.spin_rad_s
    }

    /// Acceleration and angular acceleration at this velocity.
    fn drag(&self, velocity: Vec2, spin_rad_s: f64) -> (Vec2, f64) {
        let pull = self.friction * GRAVITY_M_S2;
        if spin_rad_s == 0.0 {
            return (velocity.direction().map_or(Vec2::ZERO, |d| d * -pull), 0.0);
        }
        // In the body's own frame its support lies still.
        let own = velocity.rotated(-self.yaw_rad);
        let (mut force, mut torque) = (Vec2::ZERO, 0.0);
        for arm in &self.support_m {
            let slides = own + arm.perpendicular() * spin_rad_s;
            let speed = slides.length_squared().sqrt();
            if speed > 0.0 {
                force -= slides / speed;
                torque -= arm.cross(slides) / speed;
            }
        }
        let force = force.rotated(self.yaw_rad);
        let share = pull / self.support_m.len() as f64;
        (force * share, torque * share * self.mass_kg / self.inertia_kg_m2)
    }

    /// One step of sliding (midpoint rule); friction stops a body and never turns it back.
    fn slide(&mut self) {
        if self.velocity == Vec2::ZERO && self.spin_rad_s == 0.0 {
            return;
        }
        let slow = self.friction * GRAVITY_M_S2 * STEP_S;
        let rim_m_s = self.spin_rad_s.abs() * (self.inertia_kg_m2 / self.mass_kg).sqrt();
        // Sliding and spinning end together, within a step.
        if self.velocity.length() <= slow && rim_m_s <= 2.0 * slow {
            self.position += self.velocity * (self.velocity.length() / (2.0 * slow) * STEP_S);
            (self.velocity, self.spin_rad_s) = (Vec2::ZERO, 0.0);
            return;
        }
        let (pull, twist) = self.drag(self.velocity, self.spin_rad_s);
        let half = STEP_S / 2.0;
        let (pull, twist) = self.drag(self.velocity + pull * half, self.spin_rad_s + twist * half);
        let (velocity, spin) = (self.velocity + pull * STEP_S, self.spin_rad_s + twist * STEP_S);
        self.position += (self.velocity + velocity) * half;
        self.yaw_rad += (self.spin_rad_s + spin) * half;
        (self.velocity, self.spin_rad_s) = (velocity, spin);
    }

    /// A body's response to an impulse through a point: the change of the point's velocity along `n` and `t`.
    fn yields(&self, point: Point, n: Vec2, t: Vec2, mass_kg: f64) -> [f64; 3] {
        let arm = point - self.position;
        let (a, b) = (arm.cross(n), arm.cross(t));
        let inertia = self.inertia_kg_m2 * mass_kg / self.mass_kg;
        [1.0 / mass_kg + a * a / inertia, 1.0 / mass_kg + b * b / inertia, a * b / inertia]
    }

    fn push(&mut self, point: Point, impulse: Vec2, mass_kg: f64) {
        let inertia = self.inertia_kg_m2 * mass_kg / self.mass_kg;
        self.velocity += impulse / mass_kg;
        self.spin_rad_s += (point - self.position).cross(impulse) / inertia;
    }
}

impl World {
    pub(super) fn new(bodies: Vec<Body>, strike: Strike, begins_s: f64) -> Self {
        Self { bodies, strike, begins_s }
    }

    /// Lets it go for a while; every impact's restitution is multiplied by a draw of `scatter`.
    pub(super) fn run(
        &mut self,
        laws: &Laws,
        duration_s: f64,
        mut scatter: impl FnMut() -> f64,
    ) -> Vec<Path> {
        let mut paths: Vec<Path> = (self.bodies.iter())
            .map(|b| Path { object: b.object.clone(), sees_yaw: b.sees_yaw, poses: Vec::new() })
            .collect();
        for step in 0..(duration_s / STEP_S) as usize {
            for (path, body) in paths.iter_mut().zip(&self.bodies) {
                path.poses.push([body.position.x, body.position.y, body.yaw_rad]);
            }
            self.bodies.iter_mut().for_each(Body::slide);
            let time_s = (step + 1) as f64 * STEP_S;
            self.strike(laws, time_s, &mut scatter);
            for second in 1..self.bodies.len() {
                for first in 0..second {
                    self.collide(first, second, laws, &mut scatter);
                }
            }
        }
        paths
    }

    /// The striker's place and velocity.
    fn striker(&self, time_s: f64) -> (Point, Vec2) {
        let along = Vec2::from_heading(self.strike.heading_rad);
        let since_s = time_s - self.begins_s;
        let out_s = self.strike.travel_m / self.strike.speed_m_s;
        let back_m = self.strike.travel_m - RETRACT_M_S * (since_s - out_s);
        let (way_m, speed_m_s) = match since_s {
            s if s <= 0.0 => (0.0, 0.0),
            s if s < out_s => (s * self.strike.speed_m_s, self.strike.speed_m_s),
            _ if back_m > -0.02 => (back_m, -RETRACT_M_S),
            _ => (-0.02, 0.0),
        };
        (self.strike.start_m + along * way_m, along * speed_m_s)
    }

    fn strike(&mut self, laws: &Laws, time_s: f64, scatter: &mut impl FnMut() -> f64) {
        let (place, velocity) = self.striker(time_s);
        for body in &mut self.bodies {
            let Some(touch) = disc_touches(place, STRIKER_M, body) else { continue };
            let relative = velocity - body.velocity_at(touch.point);
            if relative.dot(touch.normal) <= 0.0 {
                continue;
            }
            let along = touch.normal.perpendicular();
            let give = body.yields(touch.point, touch.normal, along, body.mass_kg);
            let restitution = laws.striker_restitution.get(kind(&body.object)).copied().unwrap_or(f64::NAN);
            let [n, t] = impulses(
                [relative.dot(touch.normal), relative.dot(along)],
                give,
                restitution * scatter(),
                laws.striker_friction,
            );
            body.push(touch.point, touch.normal * n + along * t, body.mass_kg);
        }
    }

    fn collide(&mut self, first: usize, second: usize, laws: &Laws, scatter: &mut impl FnMut() -> f64) {
        let (head, tail) = self.bodies.split_at_mut(second);
        let (a, b) = (&mut head[first], &mut tail[0]);
        let touch = match (&a.shape, &b.shape) {
            (Shape::Disc { radius_m }, _) => disc_touches(a.position, *radius_m, b),
            (_, Shape::Disc { radius_m }) => {
                disc_touches(b.position, *radius_m, a).map(|touch| Touch { normal: -touch.normal, ..touch })
            }
            _ => None,
        };
        let Some(touch) = touch else { return };
        let relative = a.velocity_at(touch.point) - b.velocity_at(touch.point);
        if relative.dot(touch.normal) <= 0.0 {
            return;
        }
        let along = touch.normal.perpendicular();
        let key = pair_key(kind(&a.object), kind(&b.object));
        let [mass_a, mass_b] = masses_felt_kg(a, b, laws, &key);
        let (of_a, of_b) = (
            a.yields(touch.point, touch.normal, along, mass_a),
            b.yields(touch.point, touch.normal, along, mass_b),
        );
        let give = [0, 1, 2].map(|k| of_a[k] + of_b[k]);
        let restitution = laws.restitution.get(&key).copied().unwrap_or(f64::NAN) * scatter();
        let [n, t] = impulses(
            [relative.dot(touch.normal), relative.dot(along)],
            give,
            restitution,
            laws.contact_friction,
        );
        let impulse = touch.normal * n + along * t;
        a.push(touch.point, -impulse, mass_a);
        b.push(touch.point, impulse, mass_b);
    }
}

/// The masses that an impact seems to have: the table takes part in it, and bodies rock.
fn masses_felt_kg(a: &Body, b: &Body, laws: &Laws, key: &str) -> [f64; 2] {
    /// Heights that differ by less than this are alike.
    const ALIKE: f64 = 0.1;
    let a_strikes = a.velocity.length() >= b.velocity.length();
    let (striking, struck) = if a_strikes { (a.height_m, b.height_m) } else { (b.height_m, a.height_m) };
    let taller = ((striking - struck) / striking.min(struck) / ALIKE).clamp(-1.0, 1.0);
    let weight = f64::midpoint(1.0, taller);
    let share = laws.pressing[0] * (1.0 - weight) + laws.pressing[1] * weight;
    let rocking = laws.rocking.get(key).copied().unwrap_or(0.0);
    // The ratio is that of the first name over the second.
    let sign = if kind(&a.object) <= kind(&b.object) { 0.5 } else { -0.5 };
    let felt = |body: &Body, off: f64| {
        let nominal = laws.friction.get(kind(&body.object)).copied().unwrap_or(0.0);
        body.mass_kg * (off + share * laws.contact_friction * nominal).exp()
    };
    [felt(a, sign * rocking), felt(b, -sign * rocking)]
}

/// The impulses along the normal and the tangent on the second body, from the approach and the slip of the first
/// against it: restitution along the normal, and sticking or sliding along the tangent.
fn impulses([approach, slip]: [f64; 2], give: [f64; 3], restitution: f64, friction: f64) -> [f64; 2] {
    let [normal, tangent, both] = give;
    // The approach is reversed, the slip ended.
    let wanted = approach * (1.0 + restitution);
    let det = normal * tangent - both * both;
    let stick = [(wanted * tangent - slip * both) / det, (slip * normal - wanted * both) / det];
    if stick[1].abs() <= friction * stick[0] {
        return stick;
    }
    let pull = friction * slip.signum();
    let n = wanted / (normal + pull * both);
    [n, pull * n]
}

/// Where a disc touches a body, if it does.
fn disc_touches(centre: Point, radius_m: f64, body: &Body) -> Option<Touch> {
    let away = centre - body.position;
    if let Shape::Disc { radius_m: other } = body.shape {
        let normal = (-away).direction()?;
        let touches = away.length() <= radius_m + other;
        return touches.then(|| Touch { normal, point: centre + normal * radius_m });
    }
    let half = half_width_m(&body.shape);
    let local = away.rotated(-body.yaw_rad);
    let nearest = Vec2::new(local.x.clamp(-half, half), local.y.clamp(-half, half));
    let normal = (nearest - local).direction()?.rotated(body.yaw_rad);
    let touches = (local - nearest).length() <= radius_m;
    touches.then(|| Touch { normal, point: body.position + nearest.rotated(body.yaw_rad) })
}

/// Points of the support with equal shares of the weight.
fn support_m(shape: &Shape) -> Vec<Vec2> {
    const RINGS: usize = 6;
    const SPOKES: usize = 12;
    const ROWS: usize = 9;
    match shape {
        Shape::Disc { radius_m } => (0..RINGS * SPOKES)
            .map(|k| {
                let (ring, spoke) = (k / SPOKES, k % SPOKES);
                let part = ((ring as f64 + 0.5) / RINGS as f64).sqrt();
                Vec2::from_heading(TAU * (spoke as f64 + 0.5 * (ring % 2) as f64) / SPOKES as f64)
                    * (radius_m * part)
            })
            .collect(),
        other => {
            let half = half_width_m(other);
            let at = |k: usize| half * ((2 * k + 1) as f64 / ROWS as f64 - 1.0);
            (0..ROWS * ROWS).map(|k| Vec2::new(at(k % ROWS), at(k / ROWS))).collect()
        }
    }
}
