//! Properties of sequences of strikes.

use super::{paper_options, properties, scene};
use crate::geometry::Point;
use crate::plan::*;

fn row() -> Scene {
    scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.078, 0.002, 0.0)])
}

#[test]
fn the_loop_ends_as_soon_as_the_goal_holds() {
    let mut asked = 0;
    let mut as_expected = |plan: &Plan, _: &mut Properties| {
        asked += 1;
        Ok(expected(plan))
    };
    let ended = sequence(&row(), &mut properties(), &paper_options(), 5, &mut as_expected).expect("a scene");
    assert!(ended.singulated, "{}", ended.reason);
    assert_eq!(ended.plans.len(), 1);
    let again =
        sequence(&ended.left, &mut properties(), &paper_options(), 5, &mut as_expected).expect("a scene");
    assert!(again.singulated && again.plans.is_empty(), "{}", again.reason);
    assert_eq!(asked, 1);
}

#[test]
fn a_pile_that_never_moves_is_struck_as_often_as_allowed_and_not_singulated() {
    let mut nothing_moves = |plan: &Plan, _: &mut Properties| Ok(plan.scene.clone());
    let ended =
        sequence(&row(), &mut properties(), &paper_options(), 3, &mut nothing_moves).expect("a scene");
    assert!(!ended.singulated);
    assert_eq!(ended.plans.len(), 3);
    assert!(ended.reason.contains("3 strikes"), "{}", ended.reason);
}

#[test]
fn a_draw_determines_the_world() {
    let plan = plan(&row(), &properties(), &paper_options()).expect("a scene");
    let after = |draw| drawn(&plan, &properties(), &paper_options(), draw).expect("a scene").placed;
    assert_eq!(after(1), after(1));
    assert_ne!(after(1), after(2));
}

#[test]
fn updated_properties_are_used_for_the_next_strike() {
    let mut learns = |plan: &Plan, properties: &mut Properties| {
        properties.friction.clear();
        Ok(plan.scene.clone())
    };
    let ended = sequence(&row(), &mut properties(), &paper_options(), 2, &mut learns).expect("a scene");
    assert!(ended.plans[0].assumed.is_empty());
    assert_eq!(ended.plans[1].assumed.len(), row().placed.len(), "{:?}", ended.plans[1].assumed);
}

#[test]
fn an_object_that_falls_off_the_table_ends_the_sequence() {
    let mut scene = row();
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let outline_m = corners.map(|[x, y]| Point::new(x, y)).to_vec();
    scene.cell.table = Some(crate::cell::Table { outline_m });
    let mut falls = |plan: &Plan, _: &mut Properties| {
        let mut scene = plan.scene.clone();
        scene.placed[0].position_m = Point::new(0.5, 0.0);
        Ok(scene)
    };
    let ended = sequence(&scene, &mut properties(), &paper_options(), 3, &mut falls).expect("a scene");
    assert!(!ended.singulated && ended.plans.len() == 1, "{}", ended.reason);
    assert!(ended.reason.contains("a has fallen"), "{}", ended.reason);
}
