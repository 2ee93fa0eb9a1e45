//! The driver of an Indy in simulated time: what it does before the arm moves, and again before the strike.

use super::simulated::mock::Setup;
use super::simulated::mock::mishap::{Injection, Mishap};
use super::simulated::{Interrupt, Peer, Run, run};
use crate::{Ending, Fault};
use std::time::Duration;

/// A run in which the first message of a kind meets a mishap.
fn preflight(kind: &str, mishap: Mishap, interrupt: Interrupt) -> Run {
    let injection = Injection { kind: kind.into(), nth: 0, lasting: false, mishap };
    run(&Peer::Indy(Setup::default()), Some(injection), interrupt, false)
}

#[test]
fn a_preflight_and_a_first_state_that_are_not_answered_end_in_time() {
    for (kind, longest_s) in
        [("GetControlInfo answer", 31.0), ("GetSafetyLimits request", 31.0), ("GetControlData answer", 31.0)]
    {
        let run = preflight(kind, Mishap::Lost, None);
        let Err(Fault::LostLink { silent_s, .. }) = &run.ending else { panic!("{kind}: {:?}", run.ending) };
        assert!(*silent_s < longest_s, "{kind}: {silent_s} s");
        assert!(run.played.is_empty(), "{kind}: the arm moved");
    }
}

#[test]
fn the_user_ends_a_preflight_that_is_not_answered() {
    let soon = Duration::from_millis(500);
    for kind in ["GetControlInfo answer", "GetToolProperty request"] {
        let run = preflight(kind, Mishap::Lost, Some((0, soon)));
        assert!(matches!(run.ending, Err(Fault::Interrupted)), "{kind}: {:?}", run.ending);
        let waited = run.ended - run.happened.expect("a mishap");
        assert!(waited <= 2 * soon, "{kind}: {waited:?}");
        assert!(run.played.is_empty(), "{kind}: the arm moved");
    }
}

#[test]
fn a_setting_that_changes_during_the_approach_prevents_the_strike() {
    let run = run(&Peer::Indy(Setup { tool_kg_later: Some(1.0), ..Setup::default() }), None, None, false);
    let Ok(Ending::Refused { objections, arm_position }) = &run.ending else { panic!("{:?}", run.ending) };
    assert!(objections.len() == 1 && objections[0].starts_with("tool mass: 1.000 kg"), "{objections:?}");
    assert_eq!((*arm_position, run.played.len()), ("lowered, before its run-up", 2));
}
