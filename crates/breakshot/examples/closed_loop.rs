//! The whole flow against a drawn truth: tracks of a synthetic campaign, estimation, planning, and the strike in the true world.
//!
//! `cargo run --release --example closed_loop --features synthetic`

use breakshot::estimate;
use breakshot::geometry::{Point, Vec2};
use breakshot::object::Object;
use breakshot::physics;
use breakshot::plan::{self, Method};
use breakshot::properties::{ContactFriction, Properties};
use breakshot::scene::singulation::Singulation;
use breakshot::scene::{Placed, Scene};
use breakshot::synthetic::campaign::{CampaignSpec, Truth, campaign};
use breakshot::uncertain::Estimate;
use std::collections::BTreeMap;

const SEED: u64 = 1;

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    // 1. Draw the truth and the tracks of strikes on single objects and on pairs.
    let drawn = campaign(&CampaignSpec { objects: 3, ..CampaignSpec::default() }, SEED);

    // 2. Estimate the properties from the tracks alone.
    let estimation =
        estimate::estimation(&drawn.clips, &drawn.cell, &drawn.objects, &estimate::Options::default())?;
    let friction = estimation.properties.friction("a")?.mean;
    let true_friction = drawn.truth.friction["a"];
    println!("friction of a: {friction:.3} estimated, {true_friction:.3} true");
    assert!((friction / true_friction - 1.0).abs() < 0.1, "friction is dimensionless");

    // 3. Plan the strike for a pile.
    let pile = pile(&drawn.objects);
    let scene = Scene::new(drawn.cell, drawn.objects, pile)?;
    let options = plan::Options { method: Method::Robust, seed: SEED, ..plan::Options::default() };
    let plan = plan::plan(&scene, &estimation.properties, &options)?;
    println!("{}", plan.reason);

    // 4. Execute the strike in the true world.
    let strike = plan.strike.ok_or("no strike was found")?;
    let truth = true_properties(&drawn.truth);
    let trajectory = physics::trajectory(&scene, &truth, &strike, &physics::Options::default())?;
    let singulation = Singulation::of(&scene, &trajectory.final_poses)?;
    let min_distance_mm = 1e3 * singulation.min_distance_m().ok_or("a single object")?;
    println!("in the true world the closest two centres are {min_distance_mm:.1} mm apart");
    assert!(singulation.violations().is_empty(), "{:?}", singulation.violations());
    Ok(())
}

/// The first object with the others close to it, one on the right and one above.
fn pile(objects: &[Object]) -> Vec<Placed> {
    let directions = [Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)];
    let first_m = objects[0].shape.outer_radius_m();
    objects
        .iter()
        .zip(directions)
        .map(|(object, direction)| {
            let distance_m = first_m + object.shape.outer_radius_m() + 0.001;
            let position_m = Point::ORIGIN + direction * distance_m;
            Placed { object: object.name.clone(), position_m, yaw_rad: 0.0 }
        })
        .collect()
}

/// The drawn truth as properties without uncertainty.
fn true_properties(truth: &Truth) -> Properties {
    let exact = |values: &BTreeMap<String, f64>| {
        values.iter().map(|(name, value)| (name.clone(), Estimate::exact(*value))).collect()
    };
    Properties {
        version: 1,
        reference: "a".into(),
        friction: exact(&truth.friction),
        striker_restitution: exact(&truth.striker_restitution),
        restitution: exact(&truth.restitution),
        mass_ratio: exact(&truth.mass_ratio),
        contact_friction: ContactFriction {
            objects: Some(Estimate::exact(truth.contact_friction)),
            striker: Some(Estimate::exact(truth.striker_friction)),
        },
        ..Properties::default()
    }
}
