//! Objects that fall off the table, and bodies that enter keep-out areas.

mod piles;

use breakshot::cell::Table;
use breakshot::geometry::{Point, Pose};
use breakshot::physics::{EventKind, Trajectory};
use breakshot::scene::KeepOut;
use piles::{Pile, disc, four_shapes};

const G: f64 = 9.81;
const HIT_M_S: f64 = 0.6 * 1.7;

fn rectangle(low: [f64; 2], high: [f64; 2]) -> Vec<Point> {
    vec![low.into(), [high[0], low[1]].into(), high.into(), [low[0], high[1]].into()]
}

/// One disc of friction 0.25 at the origin, hit at 0.6 m/s with restitution 0.7.
fn one_disc() -> Pile {
    let mut pile = Pile::new();
    pile.add(disc(0.05), (0.1, 0.25, 0.7), Pose::default());
    pile.strike.travel_m = 0.2 - 0.065 + 1e-9;
    pile
}

fn energy_balance_j(run: &Trajectory) -> f64 {
    let e = &run.energy;
    e.striker_work_j - e.impact_loss_j - e.friction_loss_j - e.fallen_j
}

#[test]
fn an_object_falls_when_its_centre_passes_the_edge() {
    let mut pile = one_disc();
    pile.scene.cell.table = Some(Table { outline_m: rectangle([-1.0, -1.0], [0.1, 1.0]) });
    let run = pile.run();
    let fall = run.events.last().expect("events");
    assert_eq!((fall.kind, fall.bodies.as_slice()), (EventKind::Fallen, &["o000".to_string()][..]));
    let speed = (HIT_M_S * HIT_M_S - 2.0 * 0.25 * G * 0.1).sqrt();
    assert!((fall.velocities_after_m_s[0].x - speed).abs() < 1e-9, "{fall:?}, not {speed} m/s");
    assert!((run.final_poses["o000"].position.x - 0.1).abs() < 1e-12, "{:?}", run.final_poses);
    assert!((run.energy.fallen_j - 0.05 * speed * speed).abs() < 1e-9, "{:?}", run.energy);
    assert!(energy_balance_j(&run).abs() < 1e-9, "{} J", energy_balance_j(&run));
}

#[test]
fn an_object_that_stops_before_the_edge_stays() {
    let distance_m = HIT_M_S * HIT_M_S / (2.0 * 0.25 * G);
    for (edge_m, falls) in [(distance_m + 1e-9, false), (distance_m - 1e-9, true)] {
        let mut pile = one_disc();
        pile.scene.cell.table = Some(Table { outline_m: rectangle([-1.0, -1.0], [edge_m, 1.0]) });
        assert_eq!(
            pile.run().events.iter().any(|e| e.kind == EventKind::Fallen),
            falls,
            "edge at {edge_m} m"
        );
    }
}

#[test]
fn a_fallen_object_collides_with_nothing() {
    let mut pile = one_disc();
    pile.add(disc(0.03), (0.05, 0.25, 0.7), Pose::new(0.2, 0.0, 0.0));
    pile.scene.cell.table = Some(Table { outline_m: rectangle([-1.0, -1.0], [0.1, 1.0]) });
    let run = pile.run();
    assert_eq!(run.final_poses["o001"], Pose::new(0.2, 0.0, 0.0));
}

#[test]
fn entering_an_area_is_recorded_and_changes_no_motion() {
    let free = one_disc().run();
    let mut pile = one_disc();
    pile.scene.keep_out = vec![KeepOut { points_m: rectangle([0.1, -0.1], [0.12, 0.1]) }];
    let run = pile.run();
    let entered = &run.events[1];
    assert_eq!(entered.kind, EventKind::Entered);
    assert_eq!(entered.bodies, ["o000", "keep_out[0]"]);
    assert!((entered.point_m.x - 0.05).abs() < 1e-7, "{entered:?}");
    assert_eq!(run.final_poses, free.final_poses);
}

#[test]
fn work_minus_losses_is_zero_with_objects_that_fall() {
    for seed in 0..40 {
        let mut pile = four_shapes(seed);
        pile.scene.cell.table = Some(Table { outline_m: rectangle([-0.3, -0.12], [0.15, 0.12]) });
        let run = pile.run();
        assert!(energy_balance_j(&run).abs() < 1e-9, "seed {seed}: {} J", energy_balance_j(&run));
    }
}
