//! Strikes one disc into another and compares the result with closed forms.
//!
//! `cargo run --example two_discs`
//!
//! The striker hits disc `a` centrally, `a` slides and hits `b` centrally.  Without spin and contact friction every number is
//! known: launch speeds from restitution, impact speed and final positions from Coulomb friction, and the speeds after the second
//! impact from the conservation of momentum and from Newton's law, which is exact here.

use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::geometry::{Point, Vec2};
use breakshot::object::{Object, Shape};
use breakshot::physics::{GRAVITY_M_S2, Options, trajectory};
use breakshot::properties::{ContactFriction, Properties};
use breakshot::scene::{Goal, Placed, Scene, Strike};
use breakshot::uncertain::Estimate;

const STRIKER_RADIUS_M: f64 = 0.015;
const STRIKE_M_S: f64 = 0.6;
/// Name, radius (m), mass (kg), friction on the table, restitution with the striker, and x of the centre (m).
const DISCS: [(&str, f64, f64, f64, f64, f64); 2] =
    [("a", 0.05, 0.143, 0.25, 0.7, 0.0), ("b", 0.03, 0.061, 0.35, 0.6, 0.12)];
const RESTITUTION_AB: f64 = 0.8;
/// Distances and speeds agree to this (m, m/s): the gap at which the contact search ends.
const TOLERANCE: f64 = 1e-7;

fn scene_and_properties() -> (Scene, Properties) {
    let none = Some(Estimate::exact(0.0));
    let mut properties = Properties {
        version: 1,
        reference: "a".into(),
        contact_friction: ContactFriction { objects: none, striker: none },
        ..Properties::default()
    };
    let (mut objects, mut placed) = (Vec::new(), Vec::new());
    for (name, radius_m, mass_kg, friction, restitution, x) in DISCS {
        let shape = Shape::Disc { radius_m };
        objects.push(Object {
            name: name.into(),
            shape,
            height_m: 0.03,
            marker: None,
            mass_kg: Some(mass_kg),
            support: None,
        });
        placed.push(Placed { object: name.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.0 });
        properties.friction.insert(name.into(), Estimate::exact(friction));
        properties.mass_ratio.insert(name.into(), Estimate::exact(mass_kg / DISCS[0].2));
        properties.striker_restitution.insert(name.into(), Estimate::exact(restitution));
    }
    properties.restitution.insert("a/b".into(), Estimate::exact(RESTITUTION_AB));
    let striker = Striker::rod(STRIKER_RADIUS_M, [0.01, 2.0]);
    let cell = Cell::from_above(1000.0, Workspace::centred([2.0, 2.0]), striker);
    let (walls, keep_out, goal) = (Vec::new(), Vec::new(), Goal::default());
    (Scene { cell, objects, observed_unix_s: None, placed, walls, keep_out, goal }, properties)
}

fn assert_close(what: &str, found: f64, expected: f64) {
    println!("{what:<42} simulated {found:>12.9}   closed form {expected:>12.9}");
    assert!((found - expected).abs() < TOLERANCE, "{what}: {found}, not {expected}");
}

fn main() -> breakshot::Result<()> {
    let (scene, properties) = scene_and_properties();
    let strike = Strike {
        start_m: Point::new(-0.2, 0.0),
        speed_m_s: STRIKE_M_S,
        // It stops just after the impact.
        travel_m: 0.2 - STRIKER_RADIUS_M - DISCS[0].1 + 1e-6,
        ..Strike::default()
    };
    let run = trajectory(&scene, &properties, &strike, &Options::default())?;
    let (hit_a, hit_b) = (&run.events[0], &run.events[1]);
    let [m_a, m_b] = DISCS.map(|disc| disc.2);
    let speed_at = |speed_m_s: f64, friction: f64, distance_m: f64| {
        (speed_m_s.powi(2) - 2.0 * friction * GRAVITY_M_S2 * distance_m).sqrt()
    };

    // The striker of prescribed motion launches `a` (Eq. 24).
    let launch = (1.0 + DISCS[0].4) * STRIKE_M_S;
    let normal_speed = |velocity: Vec2, normal: Vec2| velocity.dot(normal).abs();
    let a_after = hit_a.bodies.iter().position(|name| name == "a").unwrap_or(0);
    assert_close(
        "launch speed of a (m/s)",
        normal_speed(hit_a.velocities_after_m_s[a_after], hit_a.normal),
        launch,
    );

    // Coulomb friction slows `a` down until it reaches `b` (Eq. 26).
    let gap_m = DISCS[1].5 - DISCS[0].1 - DISCS[1].1;
    let approach = speed_at(launch, DISCS[0].3, gap_m);
    let [before_a, before_b] = [hit_b.velocities_before_m_s[0].x, hit_b.velocities_before_m_s[1].x];
    assert_close("speed of a at the impact with b (m/s)", before_a, approach);

    // Momentum is conserved, and the separation speed is e times the approach speed (Eq. 1).
    let [after_a, after_b] = [hit_b.velocities_after_m_s[0].x, hit_b.velocities_after_m_s[1].x];
    assert_close("momentum after (kg m/s)", m_a * after_a + m_b * after_b, m_a * before_a + m_b * before_b);
    assert_close("separation speed (m/s)", after_b - after_a, RESTITUTION_AB * approach);

    // Each disc stops after v^2 / (2 mu g) (Eq. 30).
    let v_a = (m_a - RESTITUTION_AB * m_b) * approach / (m_a + m_b);
    let v_b = (1.0 + RESTITUTION_AB) * m_a * approach / (m_a + m_b);
    for ((name, _, _, friction, _, _), start_m, speed) in
        [(DISCS[0], gap_m, v_a), (DISCS[1], DISCS[1].5, v_b)]
    {
        let rest_m = start_m + speed * speed / (2.0 * friction * GRAVITY_M_S2);
        assert_close(&format!("rest position of {name} (m)"), run.final_poses[name].position.x, rest_m);
    }
    Ok(())
}
