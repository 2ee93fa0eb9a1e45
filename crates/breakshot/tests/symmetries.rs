//! Results do not depend on names, order, the pose of the table, reflection, the unit of mass, or the number of threads.

mod piles;

use breakshot::geometry::{Point, Pose, Vec2};
use breakshot::object::{Shape, kind, pair_key};
use breakshot::physics::{Outcome, Perturbation, Simulator, World, rollouts};
use breakshot::properties::Properties;
use breakshot::scene::{Placed, Strike};
use piles::splitmix::Draw;
use piles::{Pile, anything, disc, draw, four_discs, four_shapes, touching_discs};
use std::collections::BTreeMap;

fn outcome(pile: &Pile) -> Outcome {
    let world = World::new(&pile.scene, &pile.properties, &pile.options).expect("a world");
    Simulator::new().run(&world, &pile.strike).expect("a strike")
}

fn final_poses(pile: &Pile) -> BTreeMap<String, Pose> {
    pile.scene.placed.iter().map(|p| p.object.clone()).zip(outcome(pile).poses).collect()
}

/// The same pile with other names, in another order.
fn relabelled(pile: &Pile, draw: &mut Draw) -> (Pile, BTreeMap<String, String>) {
    let mut other = pile.clone();
    let mut order: Vec<usize> = (0..pile.scene.placed.len()).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, draw.below(k + 1));
    }
    let names: BTreeMap<String, String> = (order.iter().enumerate())
        .map(|(new, &old)| (pile.scene.placed[old].object.clone(), format!("n{new:03}")))
        .collect();
    for (new, &old) in order.iter().enumerate() {
        other.scene.placed[new] = pile.scene.placed[old].clone();
        other.scene.placed[new].object.clone_from(&names[&pile.scene.placed[old].object]);
        other.scene.objects[new] = pile.scene.objects[old].clone();
        other.scene.objects[new].name.clone_from(&names[&pile.scene.objects[old].name]);
    }
    let p = &pile.properties;
    let rename = |(name, value): (&String, _)| (names[name].clone(), value);
    let rename_pair = |(pair, value): (&String, _)| {
        let (a, b) = pair.split_once('/').expect("a pair");
        (pair_key(&names[a], &names[b]), value)
    };
    other.properties = Properties {
        reference: names[&p.reference].clone(),
        friction: p.friction.clone().iter().map(|(k, v)| (k, *v)).map(rename).collect(),
        mass_ratio: p.mass_ratio.clone().iter().map(|(k, v)| (k, *v)).map(rename).collect(),
        striker_restitution: p.striker_restitution.clone().iter().map(|(k, v)| (k, *v)).map(rename).collect(),
        restitution: p.restitution.clone().iter().map(|(k, v)| (k, *v)).map(rename_pair).collect(),
        ..p.clone()
    };
    (other, names)
}

#[test]
fn names_and_order_change_not_one_bit() {
    let mut draw = draw(3);
    for seed in 0..25 {
        for pile in [four_discs(seed), four_shapes(seed), touching_discs(seed), anything(seed)] {
            let (other, names) = relabelled(&pile, &mut draw);
            let (one, two) = (final_poses(&pile), final_poses(&other));
            for (name, pose) in one {
                assert_eq!(
                    pose,
                    two[&names[&name]],
                    "seed {seed}: {} is called {}",
                    kind(&name),
                    names[&name]
                );
            }
        }
    }
}

#[test]
fn a_perturbed_world_equals_a_new_one_to_the_last_bit() {
    for seed in 0..25 {
        for pile in [four_discs(seed), four_shapes(seed), touching_discs(seed), anything(seed)] {
            let world = World::new(&pile.scene, &pile.properties, &pile.options).expect("a world");
            let mut other = pile.clone();
            for (placed, k) in other.scene.placed.iter_mut().zip(0u32..) {
                // Less than the overlap of a millimetre that is accepted.
                placed.position_m += Vec2::new(1e-4, -5e-5) * f64::from(k);
                placed.yaw_rad += 1e-3;
            }
            other.properties.friction.values_mut().for_each(|friction| friction.mean *= 1.1);
            other.properties.mass_ratio.values_mut().for_each(|mass| mass.mean *= 1.3);
            other.properties.restitution.values_mut().for_each(|restitution| restitution.mean *= 0.9);
            let poses: Vec<Pose> = other.scene.placed.iter().map(Placed::pose).collect();
            let multiple_impact = pile.options.multiple_impact;
            let sample = Perturbation { poses: &poses, properties: &other.properties, multiple_impact };
            let perturbed = world.perturbed(&sample).expect("a perturbed world");
            let found = Simulator::new().run(&perturbed, &pile.strike).expect("a strike");
            assert_eq!(found, outcome(&other), "seed {seed}");
        }
    }
}

/// The pile rotated about the origin and shifted.
fn rotated(pile: &Pile, rotation_rad: f64, shift: Vec2) -> Pile {
    let frame = Pose { position: Point::ORIGIN + shift, yaw_rad: rotation_rad };
    let mut other = pile.clone();
    for placed in &mut other.scene.placed {
        placed.position_m = frame.table_from_body(placed.position_m);
        placed.yaw_rad += rotation_rad;
    }
    for wall in &mut other.scene.walls {
        (wall.from_m, wall.to_m) = (frame.table_from_body(wall.from_m), frame.table_from_body(wall.to_m));
    }
    other.strike.start_m = frame.table_from_body(other.strike.start_m);
    other.strike.heading_rad += rotation_rad;
    other
}

/// Greatest difference of two results (m): the tolerance of the contact search, amplified by a few impacts.
const SAME_M: f64 = 2e-6;

#[test]
fn rotating_the_table_rotates_the_result() {
    for seed in 0..25 {
        for pile in [four_discs(seed), four_shapes(seed), touching_discs(seed)] {
            let (rotation_rad, shift) = (0.3 + seed as f64, Vec2::new(0.11, -0.07));
            let frame = Pose { position: Point::ORIGIN + shift, yaw_rad: rotation_rad };
            let (one, two) = (final_poses(&pile), final_poses(&rotated(&pile, rotation_rad, shift)));
            for (name, pose) in one {
                let off = frame.table_from_body(pose.position).distance(two[&name].position);
                assert!(off < SAME_M, "seed {seed}: {name} is off by {off} m");
            }
        }
    }
}

#[test]
fn reflecting_the_pile_reflects_the_result() {
    for seed in 0..25 {
        for pile in [four_discs(seed), four_shapes(seed), touching_discs(seed)] {
            let mut other = pile.clone();
            for (placed, object) in other.scene.placed.iter_mut().zip(&mut other.scene.objects) {
                placed.position_m.y = -placed.position_m.y;
                placed.yaw_rad = -placed.yaw_rad;
                if let Shape::Polygon { points_m } = &mut object.shape {
                    for point in points_m.iter_mut() {
                        point.y = -point.y;
                    }
                    points_m.reverse();
                }
            }
            other.strike.start_m.y = -other.strike.start_m.y;
            let (one, two) = (final_poses(&pile), final_poses(&other));
            for (name, pose) in one {
                let mirrored = Point::new(pose.position.x, -pose.position.y);
                let off = mirrored.distance(two[&name].position);
                assert!(off < SAME_M, "seed {seed}: {name} is off by {off} m");
            }
        }
    }
}

#[test]
fn the_unit_of_mass_does_not_matter() {
    for seed in 0..25 {
        for pile in [four_discs(seed), four_shapes(seed), touching_discs(seed), anything(seed)] {
            let mut other = pile.clone();
            other.properties.mass_ratio.values_mut().for_each(|m| m.mean *= 8.0);
            assert_eq!(final_poses(&pile), final_poses(&other), "seed {seed}");
        }
    }
}

#[test]
fn distant_objects_do_not_change_the_result() {
    for seed in 0..25 {
        for pile in [four_discs(seed), touching_discs(seed)] {
            let mut other = pile.clone();
            for k in 0..20 {
                let far = Pose::new(2.0 + 0.2 * f64::from(k), 3.0, 0.0);
                other.add(disc(0.03), (0.05, 0.3, 0.5), far);
            }
            let (one, two) = (final_poses(&pile), final_poses(&other));
            for (name, pose) in one {
                assert_eq!(pose, two[&name], "seed {seed}: {name}");
            }
        }
    }
}

/// Piles drawn without trigonometric functions, so that they are the same on every machine.
fn plain_pile(seed: u64) -> Pile {
    let mut draw = draw(seed ^ 0x601D);
    let mut pile = Pile::new();
    for k in 0..6 {
        let pose = Pose::new(
            0.09 * f64::from(k % 3) + draw.between(0.0, 0.008),
            0.09 * f64::from(k / 3) + draw.between(0.0, 0.008),
            draw.between(0.0, 1.5),
        );
        let shape = match k % 3 {
            0 => disc(draw.between(0.02, 0.039)),
            1 => Shape::Rectangle { size_m: [draw.between(0.03, 0.055), 0.05] },
            _ => Shape::Polygon {
                points_m: vec![Point::new(-0.02, -0.02), Point::new(0.03, -0.01), Point::new(-0.01, 0.03)],
            },
        };
        pile.add(shape, (draw.between(0.02, 0.2), draw.between(0.2, 0.5), draw.between(0.2, 0.9)), pose);
    }
    pile.contact_friction(0.2);
    pile.strike.start_m = Point::new(-0.08, draw.between(-0.02, 0.1));
    pile
}

fn strikes(pile: &Pile) -> Vec<Strike> {
    let strike = |k: u32| Strike {
        start_m: Point::new(pile.strike.start_m.x, 0.015 * f64::from(k)),
        ..pile.strike.clone()
    };
    (0..8).map(strike).collect()
}

/// Hash of the bits of a few hundred results; a change of the physics changes it and needs an entry in the changelog.
const GOLDEN: u64 = 0xd56a_abd8_50d7_8086;

#[test]
fn the_bits_are_the_same_in_debug_and_release_and_on_any_number_of_threads() {
    for threads in [1, 2, 8] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let hash = pool.install(|| {
            (0..40).fold(0u64, |hash, seed| {
                let pile = plain_pile(seed);
                let world = World::new(&pile.scene, &pile.properties, &pile.options).expect("a world");
                rollouts(&world, &strikes(&pile))
                    .into_iter()
                    .fold(hash, |hash, outcome| hash.rotate_left(1) ^ outcome.expect("a strike").bit_hash())
            })
        });
        assert_eq!(hash, GOLDEN, "{threads} threads: {hash:#x}");
    }
}
