//! Properties of accessible central strikes.

use super::{properties, scene};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;
use crate::plan::paper::{Blocked, CentralStrike, central_strikes};
use crate::plan::*;
use crate::scene::{KeepOut, Placed, Wall};
use crate::uncertain::Estimate;
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};

fn on(scene: &Scene, name: &str) -> std::result::Result<Vec<CentralStrike>, Blocked> {
    let target = scene.placed.iter().find(|p| p.object == name).expect("it is placed");
    central_strikes(scene, &properties(), None, target).expect("measured objects")
}

/// Distance between the line of action and a point (m).
fn lever_m(strike: &CentralStrike, about: Point) -> f64 {
    Vec2::from_heading(strike.line.heading_rad).cross(about - strike.line.contact_m).abs()
}

#[test]
fn every_strike_is_central_and_touches_without_overlap() {
    let scene =
        scene(&[("a", 0.0, 0.0, 0.4), ("b", 0.2, 0.0, 0.7), ("d", -0.2, 0.0, 0.2), ("t", 0.0, 0.25, 0.0)]);
    for placed in &scene.placed {
        let found = on(&scene, &placed.object).expect("reachable");
        let target = Outline::new(&scene.object(&placed.object).expect("known").shape, placed.pose());
        for candidate in &found {
            let lever = lever_m(candidate, placed.position_m);
            assert!(
                lever < 1e-12,
                "{}: the line of action passes {lever} m from the centroid",
                placed.object
            );
            let pose = Pose { position: candidate.line.contact_m, yaw_rad: candidate.line.heading_rad };
            let gap_m = Outline::new(&scene.cell.striker.shape, pose).gap_m(&target);
            assert!(gap_m.abs() < 1e-12, "{}: a gap of {gap_m} m at contact", placed.object);
        }
    }
    let count = |name| on(&scene, name).expect("reachable").len();
    assert_eq!((count("a"), count("b"), count("d")), (72, 3, 4));
}

#[test]
fn a_side_without_a_perpendicular_through_the_centroid_is_not_struck() {
    // On one side of a long obtuse triangle the foot of the perpendicular lies outside the side.
    let scene = scene(&[("t", 0.0, 0.0, 0.0)]);
    let corners = scene.object("t").expect("known").shape.corners();
    let found = on(&scene, "t").expect("reachable");
    assert!(found.len() < corners.len(), "{} of {} sides", found.len(), corners.len());
}

#[test]
fn a_flat_striker_touches_with_the_middle_of_its_front() {
    let mut scene = scene(&[("d", 0.0, 0.0, 0.0)]);
    scene.cell.striker.shape = Shape::Rectangle { size_m: [0.02, 0.06] };
    let found = on(&scene, "d").expect("reachable");
    let from_the_left =
        found.iter().find(|c| c.line.heading_rad.abs() < 1e-12).expect("a strike to the right");
    assert!(
        from_the_left.line.contact_m.distance(Point::new(-0.03, 0.0)) < 1e-12,
        "{:?}",
        from_the_left.line.contact_m
    );
}

#[test]
fn a_neighbour_blocks_the_headings_on_its_side_and_is_named() {
    let two = scene(&[("a", 0.0, 0.0, 0.0), ("c", 0.075, 0.0, 0.0)]);
    let found = on(&two, "a").expect("reachable");
    assert!(found.len() < 72 && found.iter().all(|c| c.line.contact_m.x < 0.04), "{} headings", found.len());
    assert!(
        found[0].line.heading_rad.abs() < 1e-12,
        "the first one points at the pile: {} rad",
        found[0].line.heading_rad
    );
    let ring: Vec<_> =
        (0..6).map(|k| TAU * f64::from(k) / 6.0).map(|t| (0.0751 * t.cos(), 0.0751 * t.sin())).collect();
    let names = ["c", "c#2", "c#3", "c#4", "c#5", "c#6"];
    let mut placed: Vec<_> = names.iter().zip(ring).map(|(name, (x, y))| (*name, x, y, 0.0)).collect();
    placed.push(("a", 0.0, 0.0, 0.0));
    let blocked = on(&scene(&placed), "a").expect_err("surrounded");
    assert_eq!(blocked.to_string(), "a is blocked by c, c#2, c#3, c#4, c#5, c#6");
}

#[test]
fn walls_keep_out_areas_and_the_edge_shorten_the_lead_in_or_block_it() {
    let mut scene = scene(&[("a", 0.0, 0.0, 0.0)]);
    let to_the_right = |scene: &Scene| {
        on(scene, "a").expect("reachable").into_iter().find(|c| c.line.heading_rad.abs() < 1e-9)
    };
    let wall =
        |x_m: f64| Wall { from_m: Point::new(x_m, -0.2), to_m: Point::new(x_m, 0.2), restitution: 0.5 };
    assert_eq!(to_the_right(&scene).expect("free").lead_in_m, 0.07);
    // Contact at -55 mm, 20 mm of retraction, 15 mm of striker, 3 mm of clearance.
    for (x_m, lead_in_m) in [(-0.164, Some(0.07)), (-0.162, Some(0.05)), (-0.115, Some(0.02)), (-0.112, None)]
    {
        scene.walls = vec![wall(x_m)];
        assert_eq!(to_the_right(&scene).map(|c| c.lead_in_m), lead_in_m, "a wall at {x_m} m");
    }
    scene.walls = Vec::new();
    let points_m = [[-0.3, -0.01], [-0.2, -0.01], [-0.1, 0.0], [-0.2, 0.01]].map(Point::from).to_vec();
    scene.keep_out = vec![KeepOut { points_m }];
    assert_eq!(to_the_right(&scene), None);
    scene.keep_out = Vec::new();
    let outline_m = [[-0.1, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.1, 0.3]].map(Point::from).to_vec();
    scene.cell.table = Some(crate::cell::Table { outline_m });
    assert_eq!(to_the_right(&scene).map(|c| c.lead_in_m), Some(0.02));
}

#[test]
fn the_striker_stops_before_it_meets_the_object_again() {
    let mut properties = properties();
    properties.friction.insert("a".into(), Estimate::exact(0.3));
    properties.striker_restitution.insert("a".into(), Estimate::exact(0.5));
    let scene = scene(&[("a", 0.0, 0.0, 0.0)]);
    let found = central_strikes(&scene, &properties, None, &scene.placed[0]).expect("measured");
    let candidate = &found.expect("reachable")[0];
    // The striker at v t, the object at (1 + e) v t - mu g t2 / 2: they meet at 0.136 s, 54 mm (0.4 m/s).
    let (speed_m_s, time_s) = (0.4, 2.0 * 0.5 * 0.4 / (0.3 * GRAVITY_M_S2));
    let object_m = 1.5 * speed_m_s * time_s - 0.3 * GRAVITY_M_S2 * time_s * time_s / 2.0;
    let catch_up_m = candidate.catch_up_m(speed_m_s);
    assert!(
        (catch_up_m - speed_m_s * time_s).abs() < 1e-12 && (catch_up_m - object_m).abs() < 1e-12,
        "{catch_up_m} m"
    );
    assert!((catch_up_m - 0.054).abs() < 5e-4, "{catch_up_m} m");
    for speed_m_s in [0.13, 0.2, 0.4, 1.0] {
        let (on_m, catch_up_m) = (candidate.follow_through_m(speed_m_s), candidate.catch_up_m(speed_m_s));
        assert!(
            on_m < catch_up_m,
            "at {speed_m_s} m/s the striker moves on {on_m} m and meets the object after {catch_up_m} m"
        );
    }
}

proptest! {
    #[test]
    fn the_approach_keeps_its_clearance_to_all_other_objects(
        coordinates in proptest::collection::vec((-0.12..0.12f64, -0.12..0.12f64, -PI..PI), 4),
    ) {
        let names = ["a", "b", "c", "d"];
        let placed: Vec<_> = names.iter().zip(&coordinates).map(|(n, &(x, y, yaw))| (*n, x, y, yaw)).collect();
        let scene = scene(&placed);
        let outline = |p: &Placed| Outline::new(&scene.object(&p.object).expect("known").shape, p.pose());
        for target in &scene.placed {
            for candidate in on(&scene, &target.object).into_iter().flatten() {
                let along = Vec2::from_heading(candidate.line.heading_rad);
                for step in 0..=40 {
                    let back_m = (candidate.lead_in_m + crate::scene::RETRACT_PAST_START_M) * f64::from(step) / 40.0;
                    let at = candidate.line.contact_m - along * back_m;
                    let pose = Pose { position: at, yaw_rad: candidate.line.heading_rad };
                    let striker = Outline::new(&scene.cell.striker.shape, pose);
                    for other in scene.placed.iter().filter(|p| p.object != target.object) {
                        let gap_m = striker.gap_m(&outline(other));
                        prop_assert!(gap_m >= 0.003 - 1e-12, "{gap_m} m to {} before {}", other.object, target.object);
                    }
                }
            }
        }
    }

    #[test]
    fn rotating_the_table_rotates_every_strike(rotation_rad in -PI..PI) {
        let placed = [("a", 0.0, 0.0, 0.0), ("b", 0.07, 0.03, 0.5), ("d", 0.0, 0.09, 1.0)];
        let rotated = placed.map(|(name, x, y, yaw_rad)| {
            let position = Vec2::new(x, y).rotated(rotation_rad);
            (name, position.x, position.y, yaw_rad + rotation_rad)
        });
        for name in ["a", "b", "d"] {
            let (before, after) = (on(&scene(&placed), name), on(&scene(&rotated), name));
            let (before, after) = (before.unwrap_or_default(), after.unwrap_or_default());
            prop_assert_eq!(before.len(), after.len(), "{} headings", name);
            for one in before {
                let expected = Point::ORIGIN + one.line.contact_m.to_vec().rotated(rotation_rad);
                let nearest_m = after.iter().map(|c| c.line.contact_m.distance(expected)).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest_m < 1e-9, "{name}: {nearest_m} m");
            }
        }
    }
}
