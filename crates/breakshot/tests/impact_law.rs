//! Single impacts with friction against an integration over the normal impulse in small steps (Routh 1905), and their energy.

mod piles;

use breakshot::geometry::{Point, Vec2};
use breakshot::physics::{ImpactBody, ImpactLaw, PairImpact};
use piles::draw;
use piles::splitmix::Draw;
use std::collections::BTreeMap;

/// Mass of a wall, which impacts do not move.
const WALL_KG: f64 = 1e12;

fn pair_impact(restitution: f64, friction: f64, law: ImpactLaw) -> PairImpact {
    PairImpact {
        point: Point::ORIGIN,
        normal_ab: Vec2::new(1.0, 0.0),
        restitution,
        friction,
        tangential_restitution: 0.0,
        law,
    }
}

/// A body that touches the origin with a corner of a rectangle, for which gyration = arm / sqrt 3.
fn corner(draw: &mut Draw, mass_kg: f64, side: f64) -> ImpactBody {
    let (arm_m, heading) = (draw.between(0.02, 0.06), draw.between(-1.2, 1.2));
    ImpactBody {
        mass_kg,
        gyration_m: arm_m / 3f64.sqrt(),
        position: Point::ORIGIN + Vec2::from_heading(heading) * (side * arm_m),
        velocity: Vec2::new(-side * draw.between(0.05, 0.6), draw.between(-0.8, 0.8)),
        yaw_rate_rad_s: draw.between(-5.0, 5.0),
    }
}

/// Velocity of the point of the body at the origin.
fn point_velocity(body: &ImpactBody) -> Vec2 {
    body.velocity + (Point::ORIGIN - body.position).perpendicular() * body.yaw_rate_rad_s
}

fn energy_j(body: &ImpactBody) -> f64 {
    0.5 * body.mass_kg * (body.velocity.length_squared() + (body.gyration_m * body.yaw_rate_rad_s).powi(2))
}

/// Approach speed and slip after an impact integrated in `steps` small normal impulses, and the history of the slip: Coulomb
/// friction in each step, the end where the work regained is e^2 times the work of compression.
fn stepped_impact(
    bodies: [&ImpactBody; 2],
    restitution: f64,
    friction: f64,
    steps: f64,
) -> ([f64; 2], &'static str) {
    let arms = bodies.map(|m| Point::ORIGIN - m.position);
    let softness = |i: usize, k: usize| -> f64 {
        let of = |m: &ImpactBody, r: Vec2| {
            let perpendicular = [-r.y, r.x];
            let own = if i == k { 1.0 } else { 0.0 };
            (own + perpendicular[i] * perpendicular[k] / (m.gyration_m * m.gyration_m)) / m.mass_kg
        };
        of(bodies[0], arms[0]) + of(bodies[1], arms[1])
    };
    let relative = point_velocity(bodies[0]) - point_velocity(bodies[1]);
    let (mut approach, mut slip) = (relative.x, relative.y);
    let part = approach / softness(0, 0) / steps;
    let (mut compression, mut regained, mut slip_history) = (0.0, 0.0, "slips");
    let first_slip = slip;
    while approach > 0.0 || regained < restitution * restitution * compression {
        let change_per_impulse =
            |sign: f64| [softness(0, 0) + softness(0, 1) * sign, softness(0, 1) + softness(1, 1) * sign];
        let hold = -softness(0, 1) / softness(1, 1);
        let slipping = change_per_impulse(friction * if slip < 0.0 { -1.0 } else { 1.0 });
        let stops = slip.abs() <= (part * slipping[1]).abs() && slip * slipping[1] >= 0.0;
        let change = if !stops {
            slipping
        } else if hold.abs() <= friction {
            slip = 0.0;
            if slip_history == "slips" {
                slip_history = if approach > 0.0 { "sticks early" } else { "sticks late" };
            }
            change_per_impulse(hold)
        } else {
            slip = 0.0;
            change_per_impulse(friction.copysign(hold))
        };
        let next = approach - part * change[0];
        let work = 0.5 * part * (approach + next);
        if work > 0.0 {
            compression += work;
        } else {
            regained -= work;
        }
        approach = next;
        slip -= part * change[1];
        if slip * first_slip < 0.0 && slip_history == "slips" {
            slip_history = if approach > 0.0 { "reverses early" } else { "reverses late" };
        }
    }
    ([approach, slip], slip_history)
}

#[test]
fn impacts_end_as_impulses_that_grow_in_small_steps() {
    let mut draw = draw(7);
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for _ in 0..4000 {
        let (a, b) = (corner(&mut draw, 0.1, -1.0), corner(&mut draw, 0.07, 1.0));
        let (restitution, friction) = (draw.between(0.3, 0.95), draw.between(0.05, 1.2));
        let before = point_velocity(&a) - point_velocity(&b);
        if before.x < 0.05 {
            continue;
        }
        let ([approach, slip], slip_history) = stepped_impact([&a, &b], restitution, friction, 20_000.0);
        let [a, b] = pair_impact(restitution, friction, ImpactLaw::Stronge).after([a, b]).expect("possible");
        let after = point_velocity(&a) - point_velocity(&b);
        let apart = (after.x - approach).hypot(after.y - slip);
        assert!(
            apart < 1e-3 * before.length(),
            "{slip_history}: {after:?}, in small steps [{approach}, {slip}], e {restitution}, mu {friction}"
        );
        *counts.entry(slip_history).or_default() += 1;
    }
    assert_eq!(counts.len(), 5, "the five cases of slip: {counts:?}");
}

/// The greatest energy gain (relative) of a hundred thousand impacts on a wall.
fn greatest_gain(law: ImpactLaw) -> f64 {
    let mut draw = draw(11);
    let mut greatest: f64 = -1.0;
    for _ in 0..100_000 {
        let wall = ImpactBody {
            mass_kg: WALL_KG,
            gyration_m: 1.0,
            position: Point::new(-1.0, 0.0),
            velocity: Vec2::ZERO,
            yaw_rate_rad_s: 0.0,
        };
        let body = corner(&mut draw, 0.1, 1.0);
        let law = pair_impact(draw.between(0.8, 1.0), draw.between(0.1, 1.0), law);
        let [_, after] = law.after([wall, body]).expect("possible");
        greatest = greatest.max(energy_j(&after) / energy_j(&body) - 1.0);
    }
    greatest
}

#[test]
fn stronge_and_poisson_make_no_energy_and_newton_does() {
    for law in [ImpactLaw::Stronge, ImpactLaw::Poisson] {
        let gain = greatest_gain(law);
        assert!(gain < 1e-9, "{law:?}: {:.3} %", 100.0 * gain);
    }
    // Kane's paradox: where slip reverses, Newton's law gains energy.
    let gain = greatest_gain(ImpactLaw::Newton);
    assert!(gain > 0.3, "{:.1} %", 100.0 * gain);
}
