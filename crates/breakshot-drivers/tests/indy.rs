//! The driver against a controller that moves an arm of numbers, and fails when told to.

mod mock;

use breakshot_drivers::{Diary, Driver, Ending, Errand, Permission, Report, Trouble, Watch, strike};
use mock::example::{command, just_after};
use mock::{Fault, Mock, Setup};
use std::time::Duration;

/// So patient that a busy machine is not taken for a broken link.
const PATIENT: Watch = Watch {
    period: Duration::from_millis(10),
    silence: Duration::from_secs(20),
    grace: Duration::from_mins(1),
};
/// Impatient with links and motions: what is tested is the order of things, not how fast they are.
const BRISK: Watch =
    Watch { silence: Duration::from_millis(300), grace: Duration::from_millis(1500), ..PATIENT };

/// Runs one strike at 0.2 m/s on a mock; `live` with the right hash.
async fn run(mock: &Mock, live: bool, watch: Watch) -> Report {
    let command = command(0.2);
    let hash = live.then(|| command.short_hash());
    let errand = Errand {
        command: &command,
        permission: Permission { hash, allow_fast: false },
        live,
        look: &|| Ok(None),
        now_unix_s: just_after,
        watch,
    };
    let mut diary = Diary::new(&command, None, |_| ()).expect("an arm");
    let driver = Driver::Indy(mock.address.clone());
    strike(&driver, &errand, &mut diary, std::future::pending()).await.expect("the mock is there")
}

fn hurried(fault: Option<(Fault, usize, f64)>) -> Setup {
    Setup { hurry: 10.0, fault, ..Setup::default() }
}

/// The requests that move or stop the arm, in order.
fn moves(mock: &Mock) -> Vec<String> {
    let moving = |name: &String| name.starts_with("Move") || name.starts_with("Stop") || name == "Recover";
    mock.controller.calls().into_iter().map(|call| call.name).filter(moving).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_live_nothing_is_sent_that_moves_the_arm() {
    let mock = Mock::start(hurried(None)).await;
    let report = run(&mock, false, PATIENT).await;
    assert_eq!(report.ending, Ending::Shown { objections: Vec::new() });
    assert!(report.findings.iter().all(|finding| finding.holds), "{:?}", report.findings);
    assert!(moves(&mock).is_empty(), "{:?}", moves(&mock));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_strike_is_five_motions_and_ends_at_home() {
    let mock = Mock::start(hurried(None)).await;
    let report = run(&mock, true, PATIENT).await;
    assert_eq!(report.ending, Ending::Struck { simulated: None });
    assert_eq!(moves(&mock), ["MoveJointTraj"; 5]);
    let home = mock::HOME_DEG.map(f64::to_radians);
    for (q, home) in mock.controller.q_rad().iter().zip(home) {
        assert!((q - home).abs() < 1e-6, "{q} rad, not {home}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_controllers_own_planner_is_asked_for_the_stroke() {
    let mock = Mock::start(hurried(None)).await;
    let report = run(&mock, false, PATIENT).await;
    let preview = report.findings.iter().find(|finding| finding.what.contains("planner")).expect("a preview");
    let speed_m_s: f64 = preview.found.split(' ').next().expect("a number").parse().expect("a number");
    assert!((speed_m_s - 0.2).abs() < 0.002, "{}", preview.found);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn whatever_is_wrong_with_the_robot_keeps_it_from_moving() {
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

/// Lets the third motion, the strike, fail, and gives how it ended and what was sent.
async fn failed(fault: Fault) -> (Trouble, breakshot_drivers::StopAccount, Vec<String>) {
    let mock = Mock::start(hurried(Some((fault, 3, 0.5)))).await;
    let report = run(&mock, true, BRISK).await;
    let Ending::Stopped { trouble, stop, .. } = report.ending else {
        panic!("{fault:?}: {:?}", report.ending)
    };
    (trouble, stop, moves(&mock))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_failure_ends_in_a_stop_and_in_nothing_after_it() {
    use Fault::{Collision, Drift, EmergencyStop, Refusal, Stall, Violation};
    for fault in [Violation, Collision, EmergencyStop, Drift, Stall, Refusal] {
        let (trouble, stop, moves) = failed(fault).await;
        let fits = match fault {
            Violation => trouble == Trouble::Violation,
            Collision => trouble == Trouble::Collision,
            EmergencyStop => matches!(trouble, Trouble::NotReady { .. }),
            Drift => matches!(trouble, Trouble::OffPath { .. }),
            Stall => matches!(trouble, Trouble::Overdue { .. }),
            _ => matches!(trouble, Trouble::Refused { .. }),
        };
        assert!(fits, "{fault:?}: {trouble:?}");
        assert!(stop.confirmed_after_s.is_some() && stop.stands_after_s.is_some(), "{fault:?}: {stop:?}");
        assert_eq!(moves[..3], ["MoveJointTraj"; 3], "{fault:?}");
        assert!(!moves[3..].is_empty(), "{fault:?}: no stop");
        assert!(moves[3..].iter().all(|name| name.starts_with("StopMotion")), "{fault:?}: {moves:?}");
        assert_eq!(moves[3], "StopMotion 2", "{fault:?}");
        if fault == Violation {
            assert!(stop.sentence().contains("Velocity Exceeded"), "{}", stop.sentence());
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_robot_that_does_not_answer_is_told_to_stop_all_the_same() {
    for fault in [Fault::LostLink, Fault::SlowReplies] {
        let (trouble, stop, moves) = failed(fault).await;
        assert!(matches!(trouble, Trouble::LostLink { .. }), "{fault:?}: {trouble:?}");
        assert!(trouble.to_string().contains("may finish"), "{trouble}");
        assert_eq!(moves[3..5], ["StopMotion 2", "StopMotion 1"], "{fault:?}");
        if fault == Fault::LostLink {
            assert_eq!(stop.confirmed_after_s, None);
            assert!(stop.sentence().contains("emergency stop"), "{}", stop.sentence());
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_user_stops_the_arm_midway() {
    let mock = Mock::start(Setup::default()).await;
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (look, now_unix_s) = (&|| Ok(None), just_after);
    let errand = Errand { command: &command, permission, live: true, look, now_unix_s, watch: PATIENT };
    let folder = tempfile::tempdir().expect("a folder");
    let log = folder.path().join("strike.jsonl");
    let mut diary = Diary::new(&command, Some(&log), |_| ()).expect("an arm");
    let controller = std::sync::Arc::clone(&mock.controller);
    let interrupt = async move {
        while controller.count("MoveJointTraj") == 0 {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
    };
    let driver = Driver::Indy(mock.address.clone());
    let report = strike(&driver, &errand, &mut diary, interrupt).await.expect("the mock is there");
    let Ending::Stopped { trouble, stop, .. } = report.ending else { panic!("{:?}", report.ending) };
    assert_eq!(trouble, Trouble::Interrupted);
    assert!(stop.stands_after_s.is_some(), "{stop:?}");
    assert_eq!(moves(&mock), ["MoveJointTraj", "StopMotion 2"]);
    diary.finish().expect("a folder that can be written");
    let lines = std::fs::read_to_string(&log).expect("a log");
    let events: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).expect("one JSON value a line")).collect();
    for kind in ["finding", "sent", "state", "trouble", "stopped", "ended"] {
        assert!(events.iter().any(|event| event["event"] == kind), "no `{kind}` in the log");
    }
    let recording = std::fs::read(log.with_extension("mcap")).expect("a recording");
    assert!(recording.starts_with(b"\x89MCAP"), "no MCAP file");
}

#[tokio::test]
async fn a_robot_that_is_not_there_is_an_error_that_names_it() {
    let command = command(0.2);
    let permission = Permission::default();
    let (look, now_unix_s) = (&|| Ok(None), just_after);
    let errand = Errand { command: &command, permission, live: false, look, now_unix_s, watch: PATIENT };
    let mut diary = Diary::new(&command, None, |_| ()).expect("an arm");
    let driver = Driver::Indy(breakshot_drivers::indy::Address::of_port("127.0.0.1", 1));
    let error =
        strike(&driver, &errand, &mut diary, std::future::pending()).await.expect_err("nobody listens");
    assert!(error.to_string().contains("127.0.0.1:1"), "{error}");
}
