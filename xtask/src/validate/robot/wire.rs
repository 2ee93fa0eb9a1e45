//! The driver against the mock controller, the mock against the vendor's client, our messages against other libraries'.

use super::{lines, temporary};
use crate::check::cargo;
use crate::example::target;
use crate::process;
use crate::validate::row::{self, Row};
use crate::venv;
use serde::Deserialize;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

/// The vendor's ports of Control, Device, Config and `RTDataExchange`.
const PORTS: [&str; 4] = ["20001", "20002", "20003", "20004"];
const VENDOR: &str = "neuromeka==3.5.0.11";
const ROSLIBPY: &str = "roslibpy==2.1.0";
/// Largest time from the detection of a fault, or from the first unanswered request, to the stop (s).
const REACTION_S: f64 = 0.2;

/// Checks of all network messages.
pub(super) fn run() -> Result<bool, String> {
    cargo(&["build", "--package", "breakshot-drivers", "--example", "mock_indy"], &[])?;
    let mock = target().join("debug/examples/mock_indy");
    let mut all_hold = failures(&mock)?;
    all_hold &= vendor(&mock)?;
    all_hold &= rosbridge(&mock)?;
    Ok(all_hold)
}

/// The mock's output for one injected fault.
#[derive(Deserialize)]
struct Failure {
    fault: String,
    stop_after_shown_s: Option<f64>,
    silent_s: Option<f64>,
    confirmed_after_s: Option<f64>,
    moves_after_stop: u32,
    message: String,
}

fn printed(mock: &PathBuf, what: &str) -> Result<String, String> {
    let run = process::run(Command::new(mock).arg(what))?;
    if run.code == 0 { Ok(run.stdout) } else { Err(format!("mock_indy {what} ended with {}", run.code)) }
}

fn failures(mock: &PathBuf) -> Result<bool, String> {
    let text = printed(mock, "failures")?;
    let mut rows = Vec::new();
    for line in text.lines() {
        let failure: Failure = serde_json::from_str(line).map_err(|e| format!("mock_indy failures: {e}"))?;
        let name = &failure.fault;
        println!("{name}: {}", failure.message);
        let ms = |s: Option<f64>| s.map_or(f64::INFINITY, |s| s * 1e3);
        if let Some(silent_s) = failure.silent_s {
            rows.push(Row::at_most(
                format!("{name}: loss of the link detected after"),
                silent_s * 1e3,
                REACTION_S * 1e3,
                "ms",
            ));
        } else {
            let what = format!("{name}: stop confirmed after the detection");
            rows.push(Row::at_most(what, ms(failure.confirmed_after_s), REACTION_S * 1e3, "ms"));
        }
        if matches!(name.as_str(), "Violation" | "Collision" | "EmergencyStop" | "LostLink" | "SlowReplies") {
            let what = format!("{name}: stop at the controller after it began");
            let most_s = if failure.silent_s.is_some() { 2.0 * REACTION_S } else { REACTION_S };
            rows.push(Row::at_most(what, ms(failure.stop_after_shown_s), most_s * 1e3, "ms"));
        }
        rows.push(Row::at_most(
            format!("{name}: motions or recoveries sent after the stop"),
            f64::from(failure.moves_after_stop),
            0.0,
            "",
        ));
    }
    Ok(row::print_all(
        "Failures of the mock controller in the strike (loopback, its clock and the driver's)",
        &rows,
    ))
}

/// Terminates the mock when dropped.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The results of the vendor's client.
#[derive(Deserialize)]
struct Found {
    messages: usize,
    unlike: Vec<String>,
    op_state: u32,
    p: Vec<f64>,
    forward: Vec<f64>,
    movej_off_deg: f64,
    movel_off_mm: f64,
    traj_off_rad: f64,
    stopped: bool,
}

fn vendor(mock: &PathBuf) -> Result<bool, String> {
    let python = venv::python("neuromeka", &[VENDOR])?;
    let messages = temporary(&printed(mock, "messages")?, ".json")?;
    let mut server = Command::new(mock);
    let child = server.arg("serve").args(PORTS).stdout(Stdio::piped()).spawn();
    let mut server = Server(child.map_err(|e| format!("mock_indy cannot be started ({e})"))?);
    let mut ready = String::new();
    if let Some(output) = server.0.stdout.take() {
        BufReader::new(output).read_line(&mut ready).map_err(|e| e.to_string())?;
    }
    if ready.trim() != "ready" {
        return Err(format!("mock_indy cannot serve on the ports {}", PORTS.join(", ")));
    }
    let found: Vec<Found> = lines(&python, "indy_client.py", &[messages.path()])?;
    let found = found.first().ok_or("the vendor's client printed nothing")?;
    found.unlike.iter().for_each(|name| println!("not as the vendor's class: {name}"));
    let apart = found.p.iter().zip(&found.forward).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let rows = [
        Row::plain("messages that the driver sends", found.messages as f64, ""),
        Row::at_most(
            "of these, bytes that the vendor's classes read or write otherwise",
            found.unlike.len() as f64,
            0.0,
            "",
        ),
        Row::at_most(
            "operating state that its client reads (5 is idle), off by",
            f64::from(found.op_state.abs_diff(5)),
            0.0,
            "",
        ),
        Row::at_most(
            "difference of the position it reads from the forward kinematics it requests",
            apart,
            0.01,
            "mm",
        ),
        Row::at_most("its movej ends off by", found.movej_off_deg, 0.001, "deg"),
        Row::at_most("its movel ends off by", found.movel_off_mm, 0.01, "mm"),
        Row::at_most("its move_joint_traj ends off by", found.traj_off_rad * 1e3, 0.01, "mrad"),
        Row::at_least("its stop_motion stops", f64::from(u8::from(found.stopped)), 1.0, ""),
    ];
    Ok(row::print_all(&format!("The vendor's client ({VENDOR}) on the mock"), &rows))
}

/// The differences between our rosbridge messages and roslibpy's.
#[derive(Deserialize)]
struct Layout {
    kinds: Vec<String>,
    differences: Vec<String>,
}

fn rosbridge(mock: &PathBuf) -> Result<bool, String> {
    let python = venv::python("roslibpy", &[ROSLIBPY])?;
    let messages = temporary(&printed(mock, "rosbridge")?, ".json")?;
    let layout: Vec<Layout> = lines(&python, "rosbridge_layout.py", &[messages.path()])?;
    let layout = layout.first().ok_or("roslibpy printed nothing")?;
    layout.differences.iter().for_each(|difference| println!("not as roslibpy: {difference}"));
    let rows = [
        Row::at_least("kinds of messages compared", layout.kinds.len() as f64, 5.0, ""),
        Row::at_most("keys or values that differ", layout.differences.len() as f64, 0.0, ""),
    ];
    Ok(row::print_all(&format!("Messages to a rosbridge compared with those of {ROSLIBPY}"), &rows))
}
