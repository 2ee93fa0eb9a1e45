//! The simulator against closed forms.

use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::geometry::{Point, Pose};
use breakshot::object::{Marker, Object, Shape, pair_key};
use breakshot::physics::{AfterStrike, Options, Spin, Trajectory, trajectory};
use breakshot::properties::{ContactFriction, Properties};
use breakshot::scene::{Goal, Placed, Scene, Strike, Wall};
use breakshot::uncertain::Estimate;

/// Rounding of a few hundred operations on numbers of order 1.
const EXACT: f64 = 1e-9;
const G: f64 = 9.81;

struct Bench {
    scene: Scene,
    properties: Properties,
    options: Options,
    strike: Strike,
}

const STRIKER_RADIUS_M: f64 = 0.015;

impl Bench {
    /// A striker of 15 mm radius that moves along x at `speed_m_s`, from 0.5 m to the left of the origin.
    fn new(speed_m_s: f64) -> Self {
        let cell = Cell::from_above(
            1000.0,
            Workspace::centred([2.0, 2.0]),
            Striker::rod(STRIKER_RADIUS_M, [0.01, 2.0]),
        );
        let scene = Scene {
            cell,
            objects: Vec::new(),
            observed_unix_s: None,
            placed: Vec::new(),
            walls: Vec::new(),
            keep_out: Vec::new(),
            goal: Goal::default(),
        };
        let strike = Strike {
            object: None,
            start_m: Point::new(-0.5, 0.0),
            heading_rad: 0.0,
            speed_m_s,
            travel_m: 0.5,
        };
        let options =
            Options { spin: Spin::Decoupled, after_strike: AfterStrike::Lift, ..Options::default() };
        let none = Some(Estimate::exact(0.0));
        let contact_friction = ContactFriction { objects: none, striker: none };
        let properties = Properties { version: 1, contact_friction, ..Properties::default() };
        Self { scene, properties, options, strike }
    }

    fn object(
        mut self,
        name: &str,
        shape: Shape,
        (mass, friction, restitution): (f64, f64, f64),
        pose: Pose,
    ) -> Self {
        let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.005 }));
        let p = &mut self.properties;
        if p.reference.is_empty() {
            p.reference = name.into();
        }
        p.friction.insert(name.into(), Estimate::exact(friction));
        p.mass_ratio.insert(name.into(), Estimate::exact(mass));
        p.striker_restitution.insert(name.into(), Estimate::exact(restitution));
        self.scene.placed.push(Placed {
            object: name.into(),
            position_m: pose.position,
            yaw_rad: pose.yaw_rad,
        });
        self.scene.objects.push(Object {
            name: name.into(),
            shape,
            height_m: 0.03,
            marker,
            mass_kg: None,
            support: None,
        });
        self
    }

    fn pair(mut self, one: &str, other: &str, restitution: f64) -> Self {
        self.properties.restitution.insert(pair_key(one, other), Estimate::exact(restitution));
        self
    }

    fn contact_friction(mut self, friction: f64) -> Self {
        let both = Some(Estimate::exact(friction));
        self.properties.contact_friction = ContactFriction { objects: both, striker: both };
        self
    }

    /// Ends the strike just after the first contact at this distance (m).
    fn until(mut self, distance_m: f64) -> Self {
        self.strike.travel_m = distance_m + 1e-9;
        self
    }

    fn run(&self) -> Trajectory {
        trajectory(&self.scene, &self.properties, &self.strike, &self.options).expect("a valid scene")
    }
}

fn disc(radius_m: f64) -> Shape {
    Shape::Disc { radius_m }
}

fn assert_close(what: &str, found: f64, expected: f64) {
    assert!((found - expected).abs() < EXACT, "{what}: {found}, not {expected}");
}

#[test]
fn a_struck_disc_stops_after_v_squared_over_2_mu_g() {
    let bench = Bench::new(0.6)
        .object("a", disc(0.05), (1.0, 0.25, 0.675), Pose::new(0.0, 0.0, 0.0))
        .until(0.5 - 0.065);
    let end = bench.run();
    let speed = 1.675 * 0.6;
    assert_close("distance (m)", end.final_poses["a"].position.x, speed * speed / (2.0 * 0.25 * G));
    assert_close("distance (m)", end.final_poses["a"].position.x, 0.205_917_431);
    let start_s = (0.5 - 0.065) / 0.6;
    assert_close("stop (s)", end.duration_s, start_s + speed / (0.25 * G));
}

#[test]
fn a_disc_struck_off_its_centre_rotates() {
    let (offset_m, e, v) = (0.02, 0.675, 0.6);
    let bench = Bench::new(v)
        .object("a", disc(0.05), (1.0, 0.25, e), Pose::new(0.0, -offset_m, 0.0))
        .contact_friction(0.2)
        .until(0.5 - (0.065f64.powi(2) - offset_m * offset_m).sqrt());
    let end = bench.run().final_poses["a"];
    assert_close("x (m)", end.position.x, 0.181_444_158);
    assert_close("y (m)", end.position.y, -0.046_040_682 - offset_m);
    assert_close("yaw (rad)", end.yaw_rad, -0.046_323_942);
}

#[test]
fn a_square_struck_off_its_centre_rotates() {
    let d = 0.02;
    let bench = Bench::new(0.6)
        .object("a", Shape::Rectangle { size_m: [0.08, 0.08] }, (1.0, 0.25, 0.675), Pose::new(0.0, -d, 0.0))
        .until(0.5 - 0.055);
    let end = bench.run().final_poses["a"];
    assert!((end.position.x - 0.108_915_005).abs() < 1e-7, "{} m", end.position.x);
    assert!((end.yaw_rad + 1.334_401_316).abs() < 1e-6, "{} rad", end.yaw_rad);
}

#[test]
fn the_striker_reaches_the_disc_again_after_2_e_v_over_mu_g() {
    let (e, v, mu) = (0.5, 0.4, 0.3);
    let end = Bench::new(v).object("a", disc(0.05), (1.0, mu, e), Pose::new(0.0, 0.0, 0.0)).run();
    let between_s = end.events[1].time_s - end.events[0].time_s;
    assert_close("time between the first two impacts (s)", between_s, 2.0 * e * v / (mu * G));
}

#[test]
fn two_discs_separate_by_momentum_and_restitution() {
    let (m, e, v) = ([0.143, 0.061], 0.6, 0.5);
    let mut bench = Bench::new(v)
        .object("a", disc(0.05), (m[0], 0.25, 0.7), Pose::new(0.0, 0.0, 0.0))
        .object("b", disc(0.03), (m[1], 0.3, 0.7), Pose::new(0.09, 0.04, 0.0))
        .pair("a", "b", e)
        .until(0.5 - 0.065);
    bench.options.after_strike = AfterStrike::Lift;
    let end = bench.run();
    let hit = &end.events[1];
    let n = hit.normal;
    let approach = hit.velocities_before_m_s[0].dot(n);
    assert_close(
        "a along the normal (m/s)",
        hit.velocities_after_m_s[0].dot(n),
        (m[0] - e * m[1]) * approach / (m[0] + m[1]),
    );
    assert_close(
        "b along the normal (m/s)",
        hit.velocities_after_m_s[1].dot(n),
        (1.0 + e) * m[0] * approach / (m[0] + m[1]),
    );
    let across = hit.velocities_before_m_s[0].cross(n);
    assert_close("a across (m/s)", hit.velocities_after_m_s[0].cross(n), across);
}

#[test]
fn a_disc_between_walls_loses_speed_by_restitution_and_friction() {
    let (mu, e_wall, gap_m) = (0.1, 0.8, 0.1);
    let mut bench =
        Bench::new(1.0).object("a", disc(0.03), (1.0, mu, 0.9), Pose::new(0.0, 0.0, 0.0)).until(0.5 - 0.045);
    for x in [-0.03 - gap_m, 0.03 + gap_m] {
        bench.scene.walls.push(Wall {
            from_m: Point::new(x, -0.2),
            to_m: Point::new(x, 0.2),
            restitution: e_wall,
        });
    }
    // The left wall crosses the path of the striker, which walls do not stop.
    let end = bench.run();
    let mut speed = 1.9f64;
    let mut distance_m = gap_m;
    for hit in &end.events[1..] {
        let before = (speed * speed - 2.0 * mu * G * distance_m).sqrt();
        assert!(
            (hit.velocities_before_m_s[0].length() - before).abs() < 1e-6,
            "{} m/s, not {before}",
            hit.velocities_before_m_s[0].length()
        );
        (speed, distance_m) = (e_wall * before, 2.0 * gap_m);
    }
    assert!(end.events.len() > 4, "{} impacts", end.events.len());
}

#[test]
fn the_closest_near_miss_has_the_exact_margin() {
    let reach = STRIKER_RADIUS_M + 0.05;
    for (offset_m, hit) in [(reach - 1e-4, true), (reach + 1e-4, false)] {
        let run =
            Bench::new(0.6).object("a", disc(0.05), (1.0, 0.25, 0.7), Pose::new(-0.25, offset_m, 0.0)).run();
        let near_miss = run.closest_near_miss.expect("a near miss");
        assert_eq!((near_miss.hit, run.events.is_empty()), (hit, !hit), "{near_miss:?}");
        assert!((near_miss.margin_m - 1e-4).abs() < 1e-9, "{near_miss:?}");
        assert_eq!(near_miss.bodies, ["striker", "a"]);
    }
}

/// Struck `a`, and `b` beyond it in the same line with a gap; masses, frictions against the table, restitutions.
fn in_line(gap_m: f64, masses: [f64; 2], frictions: [f64; 2], restitution: f64) -> Bench {
    Bench::new(0.6)
        .object("a", disc(0.05), (masses[0], frictions[0], 0.7), Pose::new(0.0, 0.0, 0.0))
        .object("b", disc(0.03), (masses[1], frictions[1], 0.7), Pose::new(0.08 + gap_m, 0.0, 0.0))
        .pair("a", "b", restitution)
        .until(0.5 - 0.065)
}

/// Speed of `a` after the striker has hit it.
const LAUNCH_M_S: f64 = 1.7 * 0.6;

#[test]
fn a_sliding_disc_arrives_at_the_root_of_a_quadratic() {
    let (mu, gap_m) = (0.25, 0.1);
    let end = in_line(gap_m, [0.143, 0.061], [mu, 0.3], 0.6).run();
    let left = (LAUNCH_M_S * LAUNCH_M_S - 2.0 * mu * G * gap_m).sqrt();
    let between_s = end.events[1].time_s - end.events[0].time_s;
    assert_close("time of the slide (s)", between_s, (LAUNCH_M_S - left) / (mu * G));
    assert_close("speed at the impact (m/s)", end.events[1].velocities_before_m_s[0].x, left);
}

#[test]
fn the_disc_with_less_friction_reaches_the_other_one_again() {
    let (mu, e, m) = ([0.1, 0.6], 0.2, [1.0, 0.2]);
    let gap_m = 0.05;
    let end = in_line(gap_m, m, mu, e).run();
    let speed = (LAUNCH_M_S * LAUNCH_M_S - 2.0 * mu[0] * G * gap_m).sqrt();
    let between_s = end.events[2].time_s - end.events[1].time_s;
    // Both still slide: the gap is e u t - (mu_b - mu_a) g t^2 / 2.
    assert_close("time between their impacts (s)", between_s, 2.0 * e * speed / ((mu[1] - mu[0]) * G));
}

#[test]
fn a_nanometre_decides_whether_a_disc_arrives() {
    let mu = 0.25;
    let distance_m = LAUNCH_M_S * LAUNCH_M_S / (2.0 * mu * G);
    let reached = in_line(distance_m - 1e-9, [0.143, 0.061], [mu, 0.3], 0.6).run();
    assert_eq!(reached.events.len(), 2, "{:?}", reached.events);
    let missed = in_line(distance_m + 1e-9, [0.143, 0.061], [mu, 0.3], 0.6).run();
    assert_eq!(missed.events.len(), 1, "{:?}", missed.events);
    assert_eq!(missed.final_poses["b"].position.x, 0.08 + distance_m + 1e-9);
}

#[test]
fn friction_between_two_discs_sticks_or_is_at_the_coulomb_limit() {
    for friction in [0.05, 2.0] {
        let m = [0.143, 0.061];
        let end = Bench::new(0.5)
            .object("a", disc(0.05), (m[0], 0.25, 0.7), Pose::new(0.0, 0.0, 0.0))
            .object("b", disc(0.03), (m[1], 0.3, 0.7), Pose::new(0.09, 0.04, 0.0))
            .pair("a", "b", 0.6)
            .contact_friction(friction)
            .until(0.5 - 0.065)
            .run();
        let hit = &end.events[1];
        let (n, t) = (hit.normal, hit.normal.perpendicular());
        let (approach, slip) = (hit.velocities_before_m_s[0].dot(n), hit.velocities_before_m_s[0].dot(t));
        let normal = 1.6 * approach / (1.0 / m[0] + 1.0 / m[1]);
        let tangent = (slip.abs() / (3.0 / m[0] + 3.0 / m[1])).min(friction * normal).copysign(slip);
        assert_close("impulse along the normal", hit.impulse_n_s.dot(n), normal);
        assert_close("impulse along the tangent", hit.impulse_n_s.dot(t), tangent);
        let yaw_rate = hit.yaw_rates_after_rad_s[1];
        assert_close("yaw rate of b (rad/s)", yaw_rate * 0.03, -2.0 * tangent / m[1]);
    }
}
