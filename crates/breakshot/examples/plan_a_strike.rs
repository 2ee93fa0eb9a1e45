//! Plans the strike that singulates three objects, from values alone: no files, no camera.
//!
//! `cargo run --release --example plan_a_strike`

use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::geometry::Point;
use breakshot::object::{Object, Shape, pair_key};
use breakshot::plan::{Method, Options, plan};
use breakshot::properties::Properties;
use breakshot::scene::{Placed, Scene};
use breakshot::uncertain::Estimate;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // The cell: a workspace of 1.0 m x 0.8 m, and a rod of 15 mm radius that strikes at 0.05 to 1 m/s.
    let cell = Cell::from_above(1000.0, Workspace::centred([1.0, 0.8]), Striker::rod(0.015, [0.05, 1.0]));

    // Two discs and a square that lie close together.
    let object = |name: &str, shape| Object {
        name: name.into(),
        shape,
        height_m: 0.03,
        marker: None,
        mass_kg: None,
        support: None,
    };
    let objects = vec![
        object("a", Shape::Disc { radius_m: 0.04 }),
        object("b", Shape::Disc { radius_m: 0.03 }),
        object("c", Shape::Rectangle { size_m: [0.04, 0.04] }),
    ];
    let placed = |object: &str, x_m, y_m, yaw_rad| Placed {
        object: object.into(),
        position_m: Point::new(x_m, y_m),
        yaw_rad,
    };
    let pile =
        vec![placed("a", 0.0, 0.0, 0.0), placed("b", 0.062, 0.036, 0.0), placed("c", 0.062, -0.036, 0.3)];
    let scene = Scene::new(cell, objects, pile)?;

    // The properties, each with a standard deviation from strike to strike.
    let varying = |mean: f64, std: f64| Estimate { std: Some(std), ..Estimate::exact(mean) };
    let each = |values: [f64; 3], std: f64| {
        ["a", "b", "c"]
            .iter()
            .zip(values)
            .map(|(name, mean)| ((*name).to_owned(), varying(mean, std)))
            .collect()
    };
    let pairs = [("a", "b"), ("a", "c"), ("b", "c")];
    let properties = Properties {
        reference: "a".into(),
        friction: each([0.25, 0.3, 0.28], 0.01),
        striker_restitution: each([0.6, 0.55, 0.5], 0.03),
        restitution: pairs.map(|(a, b)| (pair_key(a, b), varying(0.6, 0.03))).into(),
        mass_ratio: each([1.0, 0.6, 0.5], 0.0),
        ..Properties::default()
    };

    let plan = plan(&scene, &properties, &Options { method: Method::Robust, seed: 1, ..Options::default() })?;
    println!("{}", plan.reason);

    let robustness = plan.robustness.ok_or("no strike reaches the pile")?;
    let probability = robustness.success_probability;
    assert!(probability > 0.5, "a success probability of {probability}");
    let min_distance_m = plan.prediction.and_then(|p| p.min_distance_m).ok_or("nothing is predicted")?;
    assert!(min_distance_m >= 0.09, "the closest two centres are {min_distance_m} m apart");
    Ok(())
}
