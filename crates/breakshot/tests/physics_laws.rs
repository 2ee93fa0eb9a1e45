//! Laws that hold in every simulation of every pile.

mod piles;

use breakshot::geometry::Pose;
use breakshot::physics::Trajectory;
use piles::{Pile, anything, depth_m, four_discs, four_shapes};

/// The deepest overlap of any two bodies at times in steps of `step_s`: depth (m), time (s), names.
fn deepest(pile: &Pile, run: &Trajectory, step_s: f64) -> (f64, f64, String) {
    let mut bodies = pile.bodies();
    if pile.options.after_strike == breakshot::physics::AfterStrike::Retract {
        bodies.push(("striker".into(), pile.scene.cell.striker.shape.clone()));
    }
    let mut worst = (f64::NEG_INFINITY, 0.0, String::new());
    let steps = (run.duration_s / step_s) as usize;
    for k in 0..=steps {
        let time_s = k as f64 * step_s;
        let poses: Vec<Pose> =
            bodies.iter().map(|(name, _)| run.pose(name, time_s).expect("known")).collect();
        for i in 0..bodies.len() {
            for j in i + 1..bodies.len() {
                let reach = bodies[i].1.outer_radius_m() + bodies[j].1.outer_radius_m();
                if poses[i].position.distance(poses[j].position) > reach {
                    continue;
                }
                let depth = depth_m((&bodies[i].1, poses[i]), (&bodies[j].1, poses[j]));
                if depth > worst.0 {
                    worst = (depth, time_s, format!("{} and {}", bodies[i].0, bodies[j].0));
                }
            }
        }
    }
    worst
}

/// Greatest overlap at any time (m): sustained contacts penetrate by less before they are resolved.
const DEEPEST_M: f64 = 2e-6;

fn check_depth(seeds: std::ops::Range<u64>, pile: impl Fn(u64) -> Pile) {
    for seed in seeds {
        let pile = pile(seed);
        let run = pile.run();
        let (depth, time_s, names) = deepest(&pile, &run, 5e-4);
        assert!(depth < DEEPEST_M, "seed {seed}: {names} overlap by {} um at {time_s} s", depth * 1e6);
    }
}

#[test]
fn bodies_never_penetrate_each_other() {
    check_depth(0..20, four_discs);
    check_depth(0..20, four_shapes);
    check_depth(0..50, anything);
}

/// The ten thousand scenes of the validation; about ten minutes.
#[test]
#[ignore = "long: cargo test --release -- --ignored"]
fn bodies_never_penetrate_each_other_in_ten_thousand_piles() {
    check_depth(1000..11_000, anything);
}

/// Rounding of a few thousand operations on millijoules.
const ENERGY_TOLERANCE_J: f64 = 1e-9;

#[test]
fn work_minus_losses_is_zero() {
    for seed in 0..60 {
        for pile in [four_discs(seed), four_shapes(seed), anything(seed)] {
            let energy = pile.run().energy;
            let open =
                energy.striker_work_j - energy.impact_loss_j - energy.friction_loss_j - energy.fallen_j;
            assert!(open.abs() < ENERGY_TOLERANCE_J, "seed {seed}: {open} J of {energy:?}");
        }
    }
}

#[test]
fn no_impact_gains_energy() {
    for seed in 0..60 {
        for event in anything(seed).run().events {
            assert!(event.loss_j > -1e-12, "seed {seed}: {event:?}");
        }
    }
}

#[test]
fn a_run_ends_after_a_bounded_number_of_impacts() {
    for seed in 0..100 {
        let run = anything(seed).run();
        assert!(run.events.len() < 100_000, "seed {seed}: {} impacts", run.events.len());
        assert!(run.duration_s.is_finite(), "seed {seed}: {} s", run.duration_s);
    }
}
