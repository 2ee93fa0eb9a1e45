//! The driver against a mock controller that simulates an arm and injects faults.

mod mock;

use breakshot_drivers::{
    Driver, Ending, Event, EventLog, Fault, Job, Permission, Report, Watchdog, carry_out, strike,
};
use mock::example::{command, just_after};
use mock::{InjectedFault, Mock, Setup};
use std::time::Duration;

/// Long enough that a busy machine is not mistaken for a broken link.
const PATIENT: Watchdog = Watchdog {
    period: Duration::from_millis(10),
    silence: Duration::from_secs(20),
    grace: Duration::from_mins(1),
    pace: SPEEDUP,
};
/// How much faster than real time the mock runs.
const SPEEDUP: f64 = 10.0;
/// Short times: these tests check the order of the requests, not the reaction time.
const BRISK: Watchdog =
    Watchdog { silence: Duration::from_millis(300), grace: Duration::from_millis(1500), ..PATIENT };

/// Runs one strike at 0.2 m/s on a mock; `live` with the right hash.
async fn run(mock: &Mock, live: bool, watchdog: Watchdog) -> Report {
    let command = command(0.2);
    let hash = live.then(|| command.short_hash());
    let job = Job {
        command: &command,
        permission: Permission { hash, allow_fast: false },
        live,
        observe: &|| Ok(None),
        now_unix_s: just_after,
        watchdog,
    };
    let mut log = EventLog::new(&command, None, |_| ()).expect("an arm");
    let driver = Driver::Indy(mock.address.clone());
    strike(&driver, &job, &mut log, std::future::pending()).await.expect("the mock is there")
}

fn accelerated(injected: Option<(InjectedFault, usize, f64)>) -> Setup {
    Setup { speedup: SPEEDUP, injected, ..Setup::default() }
}

/// The requests that move or stop the arm, in order.
fn moves(mock: &Mock) -> Vec<String> {
    let moving = |name: &String| name.starts_with("Move") || name.starts_with("Stop") || name == "Recover";
    mock.controller.calls().into_iter().map(|call| call.name).filter(moving).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dry_run_sends_no_motion() {
    let mock = Mock::start(accelerated(None)).await;
    let report = run(&mock, false, PATIENT).await;
    assert_eq!(report.ending, Ending::Shown { objections: Vec::new() });
    assert!(report.checks.iter().all(|check| check.holds), "{:?}", report.checks);
    assert!(moves(&mock).is_empty(), "{:?}", moves(&mock));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_strike_is_five_motions_and_ends_at_home() {
    let mock = Mock::start(accelerated(None)).await;
    let report = run(&mock, true, PATIENT).await;
    assert_eq!(report.ending, Ending::Struck { simulated: None });
    assert_eq!(moves(&mock), ["MoveJointTraj"; 5]);
    let home = mock::HOME_DEG.map(f64::to_radians);
    for (q, home) in mock.controller.q_rad().iter().zip(home) {
        assert!((q - home).abs() < 1e-6, "{q} rad, not {home}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_preview_of_the_controllers_planner_is_reported() {
    let mock = Mock::start(accelerated(None)).await;
    let report = run(&mock, false, PATIENT).await;
    let preview = report.checks.iter().find(|check| check.what.contains("planner")).expect("a preview");
    let speed_m_s: f64 = preview.found.split(' ').next().expect("a number").parse().expect("a number");
    assert!((speed_m_s - 0.2).abs() < 0.002, "{}", preview.found);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_failed_preflight_check_prevents_motion() {
    let usual = Setup::default;
    let wrong: [(&str, Setup); 8] = [
        ("robot model", Setup { model: "IndyRP2".into(), ..usual() }),
        ("tool now", Setup { off_m: 0.01, ..usual() }),
        ("collision policy", Setup { detects_collisions: false, ..usual() }),
        ("speed ratio", Setup { speed_ratio: 50, ..usual() }),
        ("tool mass", Setup { tool_kg: 1.0, ..usual() }),
        ("arm at home", Setup { q_deg: [5.0, -15.0, -90.0, 0.0, -75.0, 0.0], ..usual() }),
        ("servos on", Setup { servos_on: false, ..usual() }),
        ("tip speed limit", Setup { tip_limit_m_s: 0.1, ..usual() }),
    ];
    for (what, setup) in wrong {
        let mock = Mock::start(setup).await;
        let report = run(&mock, true, PATIENT).await;
        let Ending::Refused { objections, .. } = &report.ending else {
            panic!("{what}: {:?}", report.ending)
        };
        assert!(objections.iter().any(|o| o.starts_with(what)), "{what}: {objections:?}");
        assert!(moves(&mock).is_empty(), "{what}: {:?}", moves(&mock));
    }
}

/// Injects a fault into the third motion, the strike; returns the fault detected, the stop and the requests received.
async fn failed(injected: InjectedFault) -> (Fault, breakshot_drivers::StopReport, Vec<String>) {
    let mock = Mock::start(accelerated(Some((injected, 3, 0.5)))).await;
    let report = run(&mock, true, BRISK).await;
    let Ending::Stopped { fault, stop, .. } = report.ending else {
        panic!("{injected:?}: {:?}", report.ending)
    };
    (fault, stop, moves(&mock))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_fault_ends_in_a_stop_and_no_further_motion() {
    use InjectedFault::{Collision, Drift, EmergencyStop, Endless, Refusal, Stall, Violation};
    for injected in [Violation, Collision, EmergencyStop, Drift, Stall, Endless, Refusal] {
        let (fault, stop, moves) = failed(injected).await;
        let fits = match injected {
            Violation => fault == Fault::Violation,
            Collision => fault == Fault::Collision,
            EmergencyStop => matches!(fault, Fault::NotReady { .. }),
            Drift => matches!(fault, Fault::OffPath { .. }),
            Stall => matches!(fault, Fault::Behind { .. }),
            Endless => matches!(fault, Fault::Overdue { .. }),
            _ => matches!(fault, Fault::Refused { .. }),
        };
        assert!(fits, "{injected:?}: {fault:?}");
        assert!(stop.confirmed_after_s.is_some() && stop.at_rest_after_s.is_some(), "{injected:?}: {stop:?}");
        assert_eq!(moves[..3], ["MoveJointTraj"; 3], "{injected:?}");
        assert!(!moves[3..].is_empty(), "{injected:?}: no stop");
        assert!(moves[3..].iter().all(|name| name.starts_with("StopMotion")), "{injected:?}: {moves:?}");
        assert_eq!(moves[3], "StopMotion 2", "{injected:?}");
        if injected == Violation {
            assert!(stop.sentence().contains("Velocity Exceeded"), "{}", stop.sentence());
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stop_is_sent_even_if_the_robot_does_not_answer() {
    for injected in [InjectedFault::LostLink, InjectedFault::SlowReplies] {
        let (fault, stop, moves) = failed(injected).await;
        assert!(matches!(fault, Fault::LostLink { .. }), "{injected:?}: {fault:?}");
        assert!(fault.to_string().contains("may finish"), "{fault}");
        assert_eq!(moves[3..5], ["StopMotion 2", "StopMotion 1"], "{injected:?}");
        if injected == InjectedFault::LostLink {
            assert_eq!(stop.confirmed_after_s, None);
            assert!(stop.sentence().contains("emergency stop"), "{}", stop.sentence());
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_interrupt_stops_the_arm_during_a_motion() {
    let mock = Mock::start(Setup::default()).await;
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let watchdog = Watchdog { pace: 1.0, ..PATIENT };
    let job = Job { command: &command, permission, live: true, observe, now_unix_s, watchdog };
    let folder = tempfile::tempdir().expect("a folder");
    let log_path = folder.path().join("strike.jsonl");
    let mut log = EventLog::new(&command, Some(&log_path), |_| ()).expect("an arm");
    let controller = std::sync::Arc::clone(&mock.controller);
    let interrupt = async move {
        while controller.count("MoveJointTraj") == 0 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    };
    let driver = Driver::Indy(mock.address.clone());
    let report = strike(&driver, &job, &mut log, interrupt).await.expect("the mock is there");
    let Ending::Stopped { fault, stop, .. } = report.ending else { panic!("{:?}", report.ending) };
    assert_eq!(fault, Fault::Interrupted);
    assert!(stop.at_rest_after_s.is_some(), "{stop:?}");
    assert_eq!(moves(&mock), ["MoveJointTraj", "StopMotion 2"]);
    log.finish().expect("a folder that can be written");
    let lines = std::fs::read_to_string(&log_path).expect("a log");
    let events: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("one JSON value a line")).collect();
    for kind in ["finding", "sent", "state", "trouble", "stopped", "ended"] {
        assert!(events.iter().any(|event| event["event"] == kind), "no `{kind}` in the log");
    }
    let recording = std::fs::read(log_path.with_extension("mcap")).expect("a recording");
    assert!(recording.starts_with(b"\x89MCAP"), "no MCAP file");
}

#[test]
fn a_panic_during_a_motion_stops_the_arm() {
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.expect("a runtime");
    let mock = runtime.block_on(Mock::start(Setup::default()));
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let watchdog = Watchdog { pace: 1.0, ..PATIENT };
    let job = Job { command: &command, permission, live: true, observe, now_unix_s, watchdog };
    let panics = |event: &Event| {
        assert!(!matches!(event, Event::State { moving: true, .. }), "a mistake of the program, on purpose");
    };
    let mut log = EventLog::new(&command, None, panics).expect("an arm");
    let driver = Driver::Indy(mock.address.clone());
    let run = || carry_out(&driver, &job, &mut log);
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).expect_err("it panics");
    assert_eq!(moves(&mock), ["MoveJointTraj", "StopMotion 2"]);
    let stopped_rad = mock.controller.true_rad();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(mock.controller.true_rad(), stopped_rad, "the arm still moves");
}

#[tokio::test]
async fn an_unreachable_robot_is_an_error_with_its_address() {
    let command = command(0.2);
    let permission = Permission::default();
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let job = Job { command: &command, permission, live: false, observe, now_unix_s, watchdog: PATIENT };
    let mut log = EventLog::new(&command, None, |_| ()).expect("an arm");
    let driver = Driver::Indy(breakshot_drivers::indy::Address::of_port("127.0.0.1", 1));
    let error = strike(&driver, &job, &mut log, std::future::pending()).await.expect_err("nobody listens");
    assert!(error.to_string().contains("127.0.0.1:1"), "{error}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_controller_that_plays_ten_times_too_fast_is_stopped() {
    let mock = Mock::start(accelerated(None)).await;
    let report = run(&mock, true, Watchdog { pace: 1.0, ..PATIENT }).await;
    let Ending::Stopped { fault, motion, .. } = report.ending else { panic!("{:?}", report.ending) };
    assert!(matches!(fault, Fault::Ahead { .. } | Fault::TooFast { .. }), "{fault:?}");
    assert_eq!(
        (motion.as_str(), moves(&mock)),
        ("approach", vec!["MoveJointTraj".into(), "StopMotion 2".into()])
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_controller_that_simulates_has_to_be_named_so() {
    let mut mock = Mock::start(accelerated(None)).await;
    mock.address.simulated = false;
    let report = run(&mock, true, PATIENT).await;
    let Ending::Refused { objections, .. } = &report.ending else { panic!("{:?}", report.ending) };
    assert!(objections.iter().any(|o| o.contains("indy-sim:HOST")), "{objections:?}");
    assert!(moves(&mock).is_empty(), "{:?}", moves(&mock));
}
