//! The mock controller as a program, for tests with the vendor's client and for measurements of the driver.
//!
//!     mock_indy serve PORT...     serves on these ports of this computer until it is terminated
//!     mock_indy messages          prints what the driver sends, message by message (JSON, hexadecimal)
//!     mock_indy rosbridge         prints what the driver sends to a rosbridge (JSON)
//!     mock_indy failures          injects every fault into a strike; prints the driver's reaction times (JSON lines)

#![allow(clippy::print_stdout, reason = "a program")]

#[path = "../tests/bridge/mod.rs"]
mod bridge;
#[path = "../tests/mock/mod.rs"]
mod mock;

use breakshot_drivers::indy::requests;
use breakshot_drivers::wire::{Empty, StopCategory};
use breakshot_drivers::{Driver, Ending, EventLog, Fault, Job, Permission, Watchdog, rosbridge, strike};
use mock::example::{command, just_after};
use mock::{Controller, InjectedFault, Mock, Setup};
use prost::Message;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt::Write;
use tokio::net::TcpListener;

#[tokio::main(worker_threads = 2)]
async fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.first().map(String::as_str) {
        Some("serve") => serve(&arguments[1..]).await,
        Some("messages") => println!("{}", json!(messages())),
        Some("rosbridge") => println!("{}", rosbridge_messages().await),
        Some("failures") => failures().await,
        _ => eprintln!("usage: mock_indy serve PORT... | messages | rosbridge | failures"),
    }
}

async fn serve(ports: &[String]) {
    let controller = Controller::new(Setup::default());
    for port in ports {
        let listener = TcpListener::bind(format!("127.0.0.1:{port}")).await.expect("a free port");
        tokio::spawn(mock::serve(controller.clone(), listener));
    }
    println!("ready");
    std::future::pending::<()>().await;
}

/// One message of each kind that the driver sends, made by the driver's own functions.
fn messages() -> BTreeMap<String, String> {
    let command = command(0.2);
    let phase = &command.phases[2];
    let hex = |bytes: Vec<u8>| {
        bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
    };
    let mounted = command.mounted_arm().expect("an arm");
    let [from, to] = [&phase.q_rad[0], &phase.q_rad[phase.q_rad.len() - 1]];
    let [from, to] = [from, to].map(|q_rad| mounted.arm().flange_frame(q_rad));
    let trajectory = requests::joint_trajectory(phase.resampled(requests::PERIOD_S));
    let mut all = vec![
        ("MoveJointTrajReq", trajectory.encode_to_vec()),
        ("ForwardKinematicsReq", requests::forward_kinematics(&phase.q_rad[100]).encode_to_vec()),
        ("GetMotionLReq", requests::line_preview(&from, &to, 0.2, 15.0).encode_to_vec()),
        ("Empty", Empty {}.encode_to_vec()),
    ];
    for category in [StopCategory::SmoothBrake, StopCategory::SmoothOnly] {
        all.push(("StopCat", requests::stop(category).encode_to_vec()));
    }
    all.into_iter().enumerate().map(|(k, (name, bytes))| (format!("{name} {k}"), hex(bytes))).collect()
}

/// The messages of a strike that the controller aborts, through a rosbridge: goals, cancellation, hold.
async fn rosbridge_messages() -> Value {
    let bridge = bridge::Bridge::start(Some(bridge::InjectedFault::Abort)).await;
    let driver = Driver::Rosbridge(rosbridge::Address::of_host(bridge.host.clone()));
    run(&driver, Watchdog { pace: bridge::SPEEDUP, ..Watchdog::default() }).await;
    Value::Array(bridge.messages())
}

async fn run(driver: &Driver, watchdog: Watchdog) -> Ending {
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let job = Job { command: &command, permission, live: true, observe, now_unix_s, watchdog };
    let mut log = EventLog::new(&command, None, |_| ()).expect("an arm");
    strike(driver, &job, &mut log, std::future::pending()).await.expect("a listening server").ending
}

/// Every injected fault, 0.3 s after the start of the strike, in real time.
async fn failures() {
    use InjectedFault::{
        Collision, Drift, EmergencyStop, Endless, LostLink, Refusal, SlowReplies, Stall, Violation,
    };
    for injected in
        [Violation, Collision, EmergencyStop, LostLink, SlowReplies, Drift, Stall, Endless, Refusal]
    {
        let mock = Mock::start(Setup { injected: Some((injected, 3, 0.3)), ..Setup::default() }).await;
        let ending = run(&Driver::Indy(mock.address.clone()), Watchdog::default()).await;
        let calls = mock.controller.calls();
        let stop = calls.iter().position(|call| call.name.starts_with("StopMotion"));
        let after = stop.map_or(0, |k| {
            calls[k..].iter().filter(|call| call.name.starts_with("Move") || call.name == "Recover").count()
        });
        let stop_s = stop.map(|k| calls[k].at_s);
        let Ending::Stopped { fault, stop, .. } = ending else { panic!("{injected:?}: {ending:?}") };
        let silent_s = if let Fault::LostLink { silent_s, .. } = fault { Some(silent_s) } else { None };
        let line = json!({
            "fault": format!("{injected:?}"),
            "stop_after_shown_s": stop_s.zip(mock.controller.shown_s()).map(|(stop, shown)| stop - shown),
            "silent_s": silent_s,
            "confirmed_after_s": stop.confirmed_after_s,
            "stands_after_s": stop.at_rest_after_s,
            "moves_after_stop": after,
            "message": fault.to_string(),
        });
        println!("{line}");
    }
    let bridge = bridge::Bridge::start(Some(bridge::InjectedFault::Silence)).await;
    let driver = Driver::Rosbridge(rosbridge::Address::of_host(bridge.host.clone()));
    let ending = run(&driver, Watchdog { pace: bridge::SPEEDUP, ..Watchdog::default() }).await;
    let Ending::Stopped { fault, .. } = ending else { panic!("a silent rosbridge: {ending:?}") };
    let silent_s = if let Fault::LostLink { silent_s, .. } = fault { Some(silent_s) } else { None };
    let message = fault.to_string();
    println!(
        "{}",
        json!({ "fault": "RosbridgeSilence", "silent_s": silent_s, "moves_after_stop": 0, "message": message })
    );
}
