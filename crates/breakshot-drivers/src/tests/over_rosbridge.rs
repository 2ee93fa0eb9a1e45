//! The rosbridge driver in simulated time: what it does when messages are late, wrong or missing.

use super::simulated::bridge::{InjectedFault, Setup};
use super::simulated::mock::simulated_arm::Played;
use super::simulated::{Interrupt, Peer, Run, dropped_over_bridge, run};
use crate::{Ending, Fault, StopReport};
use std::time::Duration;

fn bridge(setup: Setup, interrupt: Interrupt) -> Run {
    run(&Peer::Bridge(setup), None, interrupt, true)
}

fn stopped(run: &Run) -> (&Fault, &StopReport) {
    match &run.ending {
        Ok(Ending::Stopped { fault, stop, .. }) => (fault, stop),
        other => panic!("not stopped: {other:?}"),
    }
}

fn injected(fault: InjectedFault) -> Run {
    bridge(Setup { injected: Some(fault), ..Setup::default() }, None)
}

/// The number of requests of this kind.
fn count(run: &Run, kind: &str) -> usize {
    run.seen.iter().filter(|message| message.kind == format!("{kind} request")).count()
}

/// An interrupt in the middle of the strike.
const IN_THE_STRIKE: Interrupt = Some((3, Duration::from_millis(300)));

#[test]
fn a_strike_is_struck_at_every_rate_of_joint_states() {
    for ms in [5, 20, 100] {
        let setup = Setup { publishes_every: Duration::from_millis(ms), ..Setup::default() };
        let run = bridge(setup, None);
        assert!(matches!(run.ending, Ok(Ending::Struck { .. })), "{ms} ms: {:?}", run.ending);
        assert!(run.played.len() == 5 && run.played.iter().all(Played::is_whole), "{ms} ms");
    }
}

#[test]
fn joint_states_that_come_too_seldom_are_refused() {
    let run = bridge(Setup { publishes_every: Duration::from_millis(200), ..Setup::default() }, None);
    let Ok(Ending::Refused { objections, .. }) = &run.ending else { panic!("{:?}", run.ending) };
    assert!(objections.iter().any(|o| o.contains("200 ms apart")), "{objections:?}");
    assert!(run.played.is_empty());
}

#[test]
fn joint_states_that_are_all_late_are_refused_by_the_robots_clock() {
    let late = Duration::from_secs(1);
    let run = bridge(Setup { states_late: late, ..Setup::default() }, None);
    assert!(
        matches!(&run.ending, Err(Fault::LostLink { cause, .. }) if cause.contains("s old")),
        "{:?}",
        run.ending
    );
    assert!(run.played.is_empty());

    // Without the robot's clock the arm begins to move, and is not said to rest before the late states show that it does.
    let run = bridge(Setup { states_late: late, has_rosapi: false, ..Setup::default() }, None);
    let (fault, stop) = stopped(&run);
    assert!(matches!(fault, Fault::Behind { .. }), "{fault:?}");
    assert!(stop.at_rest_after_s.is_some() && run.moved_afterwards_rad < 1e-3, "{stop:?}");
}

#[test]
fn a_robot_without_rosapi_strikes() {
    let run = bridge(Setup { has_rosapi: false, ..Setup::default() }, None);
    assert!(matches!(run.ending, Ok(Ending::Struck { .. })), "{:?}", run.ending);
}

#[test]
fn ctrl_c_cancels_the_goal_and_holds_the_arm_where_it_comes_to_rest() {
    for ignores_cancel in [false, true] {
        let run = bridge(Setup { ignores_cancel, ..Setup::default() }, IN_THE_STRIKE);
        let (fault, stop) = stopped(&run);
        assert_eq!(*fault, Fault::Interrupted);
        assert_eq!((count(&run, "cancel_action_goal"), count(&run, "publish")), (1, 1));
        let [strike, hold] = &run.played[2..] else { panic!("{} motions", run.played.len()) };
        let [at, to] = hold.ends();
        // The arm brakes onto its path: it neither jumps nor comes back.
        let moved: Vec<f64> = at.iter().zip(to).map(|(at, to)| to - at).collect();
        let [from, end] = strike.ends();
        let travel = from.iter().zip(end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved.iter().all(|moved| moved.abs() < travel.max(0.05)), "{moved:?}");
        let ahead: f64 =
            moved.iter().zip(at.iter().zip(from)).map(|(moved, (at, from))| moved * (at - from)).sum();
        assert!(ahead > 0.0, "held behind the arm: {moved:?}");
        assert!(stop.at_rest_after_s.is_some_and(|s| s > 0.1), "{stop:?}");
        assert_eq!(stop.confirmed_after_s, stop.at_rest_after_s, "a rosbridge confirms no stop by itself");
    }
}

#[test]
fn a_stop_is_not_confirmed_before_the_arm_rests() {
    // The cancellation is not processed, and without a velocity the arm would be held where it was: 100 ms ago.
    let setup =
        Setup { ignores_cancel: true, publishes_every: Duration::from_millis(100), ..Setup::default() };
    let run = bridge(setup, IN_THE_STRIKE);
    let (_, stop) = stopped(&run);
    let rest = run.played.last().and_then(|played| played.ended).expect("it rests");
    let interrupted = run.played[2].begun + Duration::from_millis(300);
    let rests_after_s = (rest - interrupted).as_secs_f64();
    assert!(
        stop.confirmed_after_s.is_none_or(|s| s >= rests_after_s),
        "{stop:?}, at rest after {rests_after_s} s"
    );
}

#[test]
fn results_of_another_goal_are_ignored() {
    for fault in [InjectedFault::ForeignFailure, InjectedFault::ForeignSuccess] {
        let run = injected(fault);
        assert!(matches!(run.ending, Ok(Ending::Struck { .. })), "{fault:?}: {:?}", run.ending);
        assert!(run.played.len() == 5 && run.played.iter().all(Played::is_whole), "{fault:?}");
    }
}

#[test]
fn joint_states_that_are_not_measured_any_more_stop_the_arm_without_a_hold() {
    let run = injected(InjectedFault::FrozenStates);
    let (fault, _) = stopped(&run);
    assert!(matches!(fault, Fault::LostLink { silent_s, .. } if *silent_s < 0.2), "{fault:?}");
    assert_eq!(count(&run, "publish"), 0, "the arm's position is not known");
}

#[test]
fn joint_states_without_numbers_stop_the_arm_without_a_hold() {
    let run = injected(InjectedFault::NoNumbers);
    let (fault, _) = stopped(&run);
    assert!(matches!(fault, Fault::NoPose { .. }), "{fault:?}");
    assert_eq!(count(&run, "publish"), 0, "the arm's position is not known");
}

#[test]
fn a_link_that_is_closed_or_silent_is_lost() {
    for fault in [InjectedFault::Close, InjectedFault::Silence] {
        let run = injected(fault);
        let (found, stop) = stopped(&run);
        assert!(matches!(found, Fault::LostLink { .. }), "{fault:?}: {found:?}");
        assert_eq!((stop.confirmed_after_s, stop.at_rest_after_s), (None, None), "{fault:?}");
        assert!(stop.sentence().contains("emergency stop"), "{}", stop.sentence());
    }
}

#[test]
fn a_run_that_is_dropped_cancels_its_goal_before_the_connection_closes() {
    let kinds = dropped_over_bridge();
    assert_eq!(kinds[3..], ["send_action_goal", "cancel_action_goal", "publish"]);
}
