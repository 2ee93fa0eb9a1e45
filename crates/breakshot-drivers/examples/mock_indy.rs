//! The mock controller as a program: for the vendor's client, and to measure the driver.
//!
//!     mock_indy serve PORT...     serves on these ports of this computer until it is ended
//!     mock_indy messages          prints what the driver sends, message by message (JSON, hexadecimal)
//!     mock_indy rosbridge         prints what the driver sends to a rosbridge (JSON)
//!     mock_indy failures          lets a strike fail in every way; prints how fast the driver was (JSON lines)

#![allow(clippy::print_stdout, reason = "a program")]

#[path = "../tests/bridge/mod.rs"]
#[allow(dead_code)]
mod bridge;
#[path = "../tests/mock/mod.rs"]
mod mock;

use breakshot_drivers::indy::requests;
use breakshot_drivers::wire::{Empty, StopCategory};
use breakshot_drivers::{Diary, Driver, Ending, Errand, Permission, Trouble, Watch, rosbridge, strike};
use mock::example::{command, just_after};
use mock::{Controller, Fault, Mock, Setup};
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

/// One of each message that the driver sends, made by its own functions.
fn messages() -> BTreeMap<String, String> {
    let command = command(0.2);
    let phase = &command.phases[2];
    let hex = |bytes: Vec<u8>| {
        bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
    };
    let station = command.station().expect("an arm");
    let [from, to] = [&phase.q_rad[0], &phase.q_rad[phase.q_rad.len() - 1]];
    let [from, to] = [from, to].map(|q_rad| station.arm().flange_frame(q_rad));
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

/// A strike that the controller gives up, through a rosbridge: goals, the cancel, the hold.
async fn rosbridge_messages() -> Value {
    let bridge = bridge::Bridge::start(Some(bridge::Fault::Abort)).await;
    let driver = Driver::Rosbridge(rosbridge::Address::of_host(bridge.host.clone()));
    run(&driver, Watch::default()).await;
    Value::Array(bridge.messages())
}

async fn run(driver: &Driver, watch: Watch) -> Ending {
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (look, now_unix_s) = (&|| Ok(None), just_after);
    let errand = Errand { command: &command, permission, live: true, look, now_unix_s, watch };
    let mut diary = Diary::new(&command, None, |_| ()).expect("an arm");
    strike(driver, &errand, &mut diary, std::future::pending()).await.expect("somebody listens").ending
}

/// Every way to fail, half a second into the strike, in real time.
async fn failures() {
    use Fault::{Collision, Drift, EmergencyStop, LostLink, Refusal, SlowReplies, Stall, Violation};
    for fault in [Violation, Collision, EmergencyStop, LostLink, SlowReplies, Drift, Stall, Refusal] {
        let mock = Mock::start(Setup { fault: Some((fault, 3, 0.3)), ..Setup::default() }).await;
        let ending = run(&Driver::Indy(mock.address.clone()), Watch::default()).await;
        let calls = mock.controller.calls();
        let stop = calls.iter().position(|call| call.name.starts_with("StopMotion"));
        let after = stop.map_or(0, |k| {
            calls[k..].iter().filter(|call| call.name.starts_with("Move") || call.name == "Recover").count()
        });
        let stop_s = stop.map(|k| calls[k].at_s);
        let Ending::Stopped { trouble, stop, .. } = ending else { panic!("{fault:?}: {ending:?}") };
        let silent_s = if let Trouble::LostLink { silent_s, .. } = trouble { Some(silent_s) } else { None };
        let line = json!({
            "fault": format!("{fault:?}"),
            "stop_after_shown_s": stop_s.zip(mock.controller.shown_s()).map(|(stop, shown)| stop - shown),
            "silent_s": silent_s,
            "confirmed_after_s": stop.confirmed_after_s,
            "stands_after_s": stop.stands_after_s,
            "moves_after_stop": after,
            "message": trouble.to_string(),
        });
        println!("{line}");
    }
    let bridge = bridge::Bridge::start(Some(bridge::Fault::Silence)).await;
    let driver = Driver::Rosbridge(rosbridge::Address::of_host(bridge.host.clone()));
    let ending = run(&driver, Watch::default()).await;
    let Ending::Stopped { trouble, .. } = ending else { panic!("a silent rosbridge: {ending:?}") };
    let silent_s = if let Trouble::LostLink { silent_s, .. } = trouble { Some(silent_s) } else { None };
    let message = trouble.to_string();
    println!(
        "{}",
        json!({ "fault": "RosbridgeSilence", "silent_s": silent_s, "moves_after_stop": 0, "message": message })
    );
}
