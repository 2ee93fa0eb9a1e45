//! What would help where no strike works.

use super::robust::{QUICK, varying};
use super::{paper_options, scene};
use crate::plan::remedies::remedies;
use crate::plan::robust::robust;
use crate::plan::*;
use crate::scene::{KeepOut, Scene};

/// Two discs in a corridor along x that is closed on the right by `keep_out[2]`.
fn corridor() -> Scene {
    let mut corridor = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.0, 0.0)]);
    let area = |[from_x, to_x]: [f64; 2], [from_y, to_y]: [f64; 2]| KeepOut {
        points_m: [[from_x, from_y], [to_x, from_y], [to_x, to_y], [from_x, to_y]].map(Into::into).to_vec(),
    };
    corridor.goal.mean_distance_m = [0.25, 0.9];
    corridor.keep_out = vec![
        area([-0.4, 0.4], [0.05, 0.1]),
        area([-0.4, 0.4], [-0.1, -0.05]),
        area([0.125, 0.2], [-0.049, 0.049]),
    ];
    corridor
}

#[test]
fn a_plan_without_a_strike_names_the_obstacle_that_is_in_the_way() {
    let (scene, properties, options) = (corridor(), varying(), Options::default());
    let empty = Plan::unreachable(&scene, Method::Robust);
    let plan = robust(empty, &properties, &options, &QUICK).expect("a scene that can be simulated");
    let today = plan.robustness.as_ref().map_or(0.0, |robustness| robustness.success_probability);
    assert!(plan.outcome != Outcome::Found && today < 0.3, "{}", plan.reason);
    let found = remedies(&plan, &properties, &options).expect("a scene that can be simulated");
    let open = found.iter().find(|remedy| remedy.change.starts_with("keep_out[2]"));
    assert!(open.is_some_and(|remedy| remedy.success_probability > 0.5), "{found:?}");
    assert!(found.is_sorted_by(|a, b| a.success_probability >= b.success_probability), "{found:?}");
    assert!(found.iter().all(|remedy| remedy.success_probability >= today + 0.05), "{found:?}");
    assert_eq!(found, remedies(&plan, &properties, &options).expect("the same"));
}

#[test]
fn remedies_are_sought_only_where_they_are_wanted_and_no_strike_is_found() {
    let pair = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.0, 0.0)]);
    let planned = |scene: &Scene, remedies: bool| {
        let options = Options { remedies, ..paper_options() };
        plan(scene, &varying(), &options).expect("a scene that can be simulated")
    };
    let found = planned(&pair, true);
    assert_eq!((found.outcome, &found.remedies[..]), (Outcome::Found, &[][..]));
    assert!(planned(&corridor(), false).remedies.is_empty());
    // In this workspace, and in one a quarter larger, the discs cannot be as far apart as the goal wants.
    let mut small = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.0, 0.0)]);
    small.cell.workspace = crate::cell::Workspace::centred([0.1, 0.08]);
    small.goal.mean_distance_m = [0.2, 0.9];
    let explained = planned(&small, true);
    assert_eq!((explained.outcome, &explained.remedies[..]), (Outcome::Unreachable, &[][..]));
}
