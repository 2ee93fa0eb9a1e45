//! Laws of a million random impacts of two bodies: momentum, energy, separation.

mod piles;

use breakshot::geometry::{Point, Vec2};
use breakshot::physics::{ImpactBody, ImpactLaw, PairImpact};
use piles::draw;
use piles::splitmix::Draw;

const IMPACTS: usize = 1_000_000;

fn body(draw: &mut Draw) -> ImpactBody {
    let mass_kg = 10f64.powf(draw.between(-2.5, 0.5));
    ImpactBody {
        mass_kg,
        gyration_m: draw.between(0.005, 0.06),
        position: Point::new(draw.between(-0.05, 0.05), draw.between(-0.05, 0.05)),
        velocity: Vec2::new(draw.between(-1.0, 1.0), draw.between(-1.0, 1.0)),
        yaw_rate_rad_s: draw.between(-20.0, 20.0),
    }
}

fn pair_impact(draw: &mut Draw, law: ImpactLaw) -> PairImpact {
    PairImpact {
        point: Point::new(draw.between(-0.05, 0.05), draw.between(-0.05, 0.05)),
        normal_ab: Vec2::from_heading(draw.between(-3.2, 3.2)),
        restitution: draw.between(0.0, 1.0),
        friction: if draw.below(5) == 0 { 0.0 } else { draw.between(0.0, 1.0) },
        tangential_restitution: if draw.below(2) == 0 { 0.0 } else { draw.between(-1.0, 1.0) },
        law,
    }
}

fn energy_j(bodies: &[ImpactBody; 2]) -> f64 {
    let one = |m: &ImpactBody| {
        0.5 * m.mass_kg * (m.velocity.dot(m.velocity) + (m.gyration_m * m.yaw_rate_rad_s).powi(2))
    };
    bodies.iter().map(one).sum()
}

/// Linear momentum and angular momentum about the origin, and the sums of the absolute values of their terms.
fn momentum(bodies: &[ImpactBody; 2]) -> ([f64; 3], [f64; 3]) {
    let (mut sum, mut size) = ([0.0; 3], [0.0; 3]);
    for m in bodies {
        let (p, spin) = (m.velocity * m.mass_kg, m.mass_kg * m.gyration_m * m.gyration_m * m.yaw_rate_rad_s);
        for (k, part) in [p.x, p.y, m.position.to_vec().cross(p) + spin].into_iter().enumerate() {
            sum[k] += part;
            size[k] += part.abs();
        }
    }
    (sum, size)
}

fn approach(bodies: &[ImpactBody; 2], hit: &PairImpact) -> f64 {
    let at = |m: &ImpactBody| m.velocity + (hit.point - m.position).perpendicular() * m.yaw_rate_rad_s;
    (at(&bodies[0]) - at(&bodies[1])).dot(hit.normal_ab)
}

/// The greatest relative gain of energy, and the number of impacts that leave the bodies approaching.
fn statistics(law: ImpactLaw, impacts: usize) -> (f64, usize) {
    let mut draw = draw(law as u64 + 77);
    let (mut gain, mut approaching): (f64, usize) = (f64::NEG_INFINITY, 0);
    for _ in 0..impacts {
        let (before, hit) = ([body(&mut draw), body(&mut draw)], pair_impact(&mut draw, law));
        if approach(&before, &hit) <= 1e-6 {
            continue;
        }
        let after = hit.after(before).expect("a possible impact");
        let (old, size) = momentum(&before);
        let (new, grown) = momentum(&after);
        for k in 0..3 {
            let off = (new[k] - old[k]).abs() / size[k].max(grown[k]);
            assert!(off < 1e-12, "{law:?}: momentum {k} is off by {off}: {hit:?} {before:?}");
        }
        gain = gain.max(energy_j(&after) / energy_j(&before) - 1.0);
        approaching += usize::from(approach(&after, &hit) > 1e-12);
    }
    (gain, approaching)
}

#[test]
fn stronge_and_poisson_gain_no_energy_and_separate_all_bodies() {
    for law in [ImpactLaw::Stronge, ImpactLaw::Poisson] {
        let (gain, approaching) = statistics(law, IMPACTS);
        assert!(gain < 1e-12, "{law:?} makes {gain} of the energy");
        assert_eq!(approaching, 0, "{law:?}");
    }
}

#[test]
fn newtons_law_gains_energy_and_the_papers_leaves_bodies_approaching() {
    let (gain, approaching) = statistics(ImpactLaw::Newton, 100_000);
    assert!(gain > 0.01 && approaching == 0, "Newton: gain {gain}, {approaching} approach");
    let (gain, approaching) = statistics(ImpactLaw::Paper, 100_000);
    assert!(gain > 0.1 && approaching > 1000, "the paper's: gain {gain}, {approaching} approach");
}

#[test]
fn an_elastic_impact_without_friction_is_reversible() {
    let mut draw = draw(5);
    let reversed =
        |m: ImpactBody| ImpactBody { velocity: -m.velocity, yaw_rate_rad_s: -m.yaw_rate_rad_s, ..m };
    for _ in 0..10_000 {
        let before = [body(&mut draw), body(&mut draw)];
        let hit =
            PairImpact { restitution: 1.0, friction: 0.0, ..pair_impact(&mut draw, ImpactLaw::Stronge) };
        if approach(&before, &hit) <= 0.0 {
            continue;
        }
        let after = hit.after(before).expect("a possible impact");
        let back = hit.after(after.map(reversed)).expect("a possible impact").map(reversed);
        for (now, then) in back.iter().zip(&before) {
            let off =
                (now.velocity - then.velocity).length() + (now.yaw_rate_rad_s - then.yaw_rate_rad_s).abs();
            assert!(off < 1e-10, "off by {off}");
        }
    }
}
