//! What moves an arm: commands, and the messages of controllers; and requests to the studio.

use super::{JSON, edited, fixture_text, outcome};
use crate::{Outcome, Scratch, Target};
use breakshot::files;
use breakshot::geometry::{Point, Vec2};
use breakshot::robot::{self, Answer, Command};
use breakshot::scene::Strike;
use breakshot_drivers::{Permission, fuzzing, objections, wire};
use prost::Message;
use serde_json::Value;
use std::sync::OnceLock;

/// `command.json`: a whole file, or changes of one.
pub const COMMAND: Target = Target {
    longest_s: 10.0,
    most_memory_mb: 200.0,
    ..Target::of_text(
        "command",
        "command.json: checked, permitted, written for ROS, UR and Foxglove",
        |bytes| {
            let text = String::from_utf8_lossy(bytes);
            let written = if text.starts_with('/') {
                edited(example()?.1.clone(), &text).to_string()
            } else {
                text.into_owned()
            };
            let path = Scratch::folder().write("command.json", written.as_bytes());
            let read = files::read_json::<Command>(&path);
            // The checks of a whole path take fifty times as long as reading it.
            let is_used = bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)).is_multiple_of(USED);
            if let Ok(command) = &read
                && is_used
            {
                used(command)?;
            }
            let checked = read.and_then(|command| command.check().map(|()| command));
            outcome(checked, &["command", "arm", "joint"])
        },
        || {
            let changes = "/strike/speed_m_s 0.21\n/stroke/contact_time_s 1e3\n/warnings [\"a\"]\n";
            vec![changes.into(), b"/scene null\n".to_vec()]
        },
        &[COMMAND_PIECES],
    )
};

/// One command in this number is used after it was read.
const USED: u8 = 16;

const COMMAND_PIECES: &[&str] = &[
    "\n/",
    "/phases",
    "/0",
    "/1",
    "/3",
    "/5",
    "/q_rad",
    "/qd_rad_s",
    "/qdd_rad_s2",
    "/time_s",
    "/name",
    "/stroke",
    "/begin_m",
    "/x",
    "/contact_time_s",
    "/contact_after_m",
    "/strike",
    "/speed_m_s",
    "/start_m",
    "/heading_rad",
    "/scene",
    "/objects",
    "/shape",
    "/robot",
    "/arm",
    "/home_rad",
    "/urdf",
    "/joints",
    "/checks",
    "/version",
    "/striker",
    "/tool_offset_m",
    "/base_from_table",
    " []",
    " {}",
    " null",
    " 0",
    " -1",
    " 1e308",
    " 1e-320",
    " \"indy7\"",
    " [[]]",
    " {\"disc\":{\"radius_m\":1e-9}}",
];

/// The messages of a rosbridge during a strike, one a line.
pub const ROSBRIDGE: Target = Target::of_text(
    "rosbridge",
    "messages of a rosbridge during a strike",
    |bytes| fuzzing::rosbridge(&example()?.0, &String::from_utf8_lossy(bytes)).map(|()| Outcome::Read),
    || {
        let Ok((command, _)) = example() else { return Vec::new() };
        let joints = serde_json::to_string(&command.joints).unwrap_or_default();
        let state = |ns: u32, q: f64| {
            let positions: Vec<f64> = command.joints.iter().map(|_| q).collect();
            format!(
                "{{\"op\":\"publish\",\"topic\":\"/joint_states\",\"msg\":{{\"header\":{{\"stamp\":{{\"sec\":7,\"nanosec\":{ns}}}}},\"name\":{joints},\
                 \"position\":{positions:?},\"velocity\":[]}}}}\n"
            )
        };
        let states = [state(1, 0.1), state(20_000_000, 0.11), state(40_000_000, 0.12)].concat();
        let goal = format!(
            "{{\"op\":\"action_feedback\",\"id\":\"goal\",\"values\":{{}}}}\n{states}{{\"op\":\"action_result\",\"id\":\"goal\",\"status\":4,\"result\":true,\
             \"values\":{{\"error_code\":0}}}}\n{{\"op\":\"status\",\"level\":\"error\",\"msg\":\"no\"}}\n"
        );
        vec![states.into_bytes(), goal.into_bytes()]
    },
    &[JSON, ROSBRIDGE_WORDS],
);

const ROSBRIDGE_WORDS: &[&str] = &[
    "\n",
    "\"op\":\"publish\"",
    "\"topic\":\"/joint_states\"",
    "\"msg\":",
    "\"header\":",
    "\"stamp\":",
    "\"sec\":",
    "\"nanosec\":",
    "\"position\":",
    "\"velocity\":",
    "\"name\":",
    "9223372036854775807",
    "\"op\":\"action_result\"",
    "\"status\":",
];

/// The answers of an Indy's controller to all requests of a strike: for each its length (two bytes, little-endian) and its bytes.
pub const INDY: Target = Target {
    pieces: &[&["\u{0}\u{0}", "\u{1}\u{0}", "\u{a}", "\u{12}", "\u{3a}", "\u{52}", "Indy7"]],
    ..Target::of_text(
        "indy",
        "answers of an Indy's controller to preflight, state and stop",
        |bytes| fuzzing::indy(&example()?.0, bytes).map(|()| Outcome::Read),
        || vec![answers(&good_answers()), answers(&vec![Vec::new(); 16])],
        &[],
    )
};

/// The head of a request to the studio.
pub const STUDIO: Target = Target::of_text(
    "studio",
    "heads of HTTP requests to the studio",
    |bytes| match breakshot_studio::fuzzing::request(bytes) {
        None => Ok(Outcome::Read),
        Some(status) if (400..600).contains(&status) => {
            Ok(Outcome::Refused(format!("studio: status {status}")))
        }
        Some(status) => Err(format!("refused with status {status}")),
    },
    || {
        vec![
            b"GET /api/frame?clip=a%20b.mp4&k=3 HTTP/1.1\r\nHost: localhost\r\nX-A: 1\r\nCookie: a=b\r\n\r\n".to_vec(),
            b"POST /api/plan HTTP/1.1\r\nHost: 127.0.0.1:80\r\nOrigin: http://127.0.0.1\r\nContent-Length: 2\r\n\r\n".to_vec(),
        ]
    },
    &[&[
        "GET ",
        "POST ",
        "HTTP/1.1",
        "\r\n",
        "Host: ",
        "Content-Length: ",
        "Transfer-Encoding: ",
        "Expect: ",
        "Cookie: ",
        "%2e",
        "%00",
        "..",
        "/",
        "?",
        "&",
        "=",
        "#",
        "\\",
        "18446744073709551616",
    ]],
);

/// A short strike of an Indy 7, and its command as JSON.
fn example() -> Result<&'static (Command, Value), String> {
    static EXAMPLE: OnceLock<Result<(Command, Value), String>> = OnceLock::new();
    let plan = || {
        let cell_text = fixture_text("crates/breakshot/tests/data/arms/indy7_cell.toml");
        let scratch = Scratch::folder();
        scratch.write("arm/cell.toml", cell_text.as_bytes());
        scratch.write(
            "arm/objects.toml",
            b"[[objects]]\nname = \"a\"\nshape = { disc = { radius_m = 0.03 } }\nheight_m = 0.04\n",
        );
        let scene = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\nobserved_unix_s = 1790000000.0\n[[placed]]\nobject = \"a\"\nposition_m = [0, 0]\nyaw_rad = 0\n";
        let scene = files::load_scene(scratch.write("arm/scene.toml", scene.as_bytes()))
            .map_err(|e| e.to_string())?
            .value;
        let heading_rad = 0.3;
        let start_m = Point::ORIGIN - Vec2::from_heading(heading_rad) * 0.1;
        let strike =
            Strike { object: Some("a".into()), start_m, heading_rad, speed_m_s: 0.2, travel_m: 0.06 };
        match robot::command(&scene.cell, &strike, Some(&scene), &robot::Options::default()) {
            Ok(Answer::Ready(command)) => {
                let value = serde_json::to_value(&*command).map_err(|e| e.to_string())?;
                Ok((*command, value))
            }
            other => Err(format!("no command: {other:?}")),
        }
    };
    EXAMPLE.get_or_init(plan).as_ref().map_err(Clone::clone)
}

/// Everything that is done with a command that was read, before and after its check.
fn used(command: &Command) -> Result<(), String> {
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: true };
    drop(objections(command, &permission, command.scene.as_ref(), 1_790_000_010.0));
    if command.check().is_err() {
        return Ok(());
    }
    let checks = command.checked_again().map_err(|e| e.to_string());
    let speeds = command.tip_speeds_m_s().map_err(|e| e.to_string());
    if let (Ok(checks), Ok(speeds)) = (checks, speeds)
        && !(speeds.iter().all(|speed| speed.is_finite())
            && checks.iter().all(|check| check.found.is_finite()))
    {
        return Err(format!("numbers that are none: {speeds:?}, {checks:?}"));
    }
    drop(command.safety_notes());
    drop(command.urscript());
    drop(command.follow_joint_trajectory().yaml());
    drop(command.recording(None).map(|recording| recording.finished()));
    Ok(())
}

/// Answers in the order of the requests, each after its length.
fn answers(answers: &[Vec<u8>]) -> Vec<u8> {
    let framed = answers
        .iter()
        .map(|answer| [&u16::try_from(answer.len()).unwrap_or(0).to_le_bytes()[..], answer].concat());
    framed.collect::<Vec<_>>().concat()
}

/// What a controller that is ready answers.
fn good_answers() -> Vec<Vec<u8>> {
    let q = vec![0.0, -20.0, -90.0, 0.0, -70.0, 10.0];
    let pose = vec![350.0, -186.0, 520.0, 180.0, 0.0, 90.0];
    let frame = vec![0.0; 6];
    let control = wire::ControlData {
        op_state: wire::OpState::OpIdle.into(),
        is_robot_connected: true,
        q: q.clone(),
        p: pose.clone(),
        ref_frame: frame.clone(),
        tool_frame: frame,
        ..wire::ControlData::default()
    };
    let kinematics = wire::ForwardKinematicsRes { tpos: pose, ..wire::ForwardKinematicsRes::default() };
    let row = |x: f64| wire::Vector { values: vec![x; 6] };
    let motion = wire::GetMotionRes {
        timestamp: vec![0.0, 0.1],
        q_list: vec![row(0.0), row(0.1)],
        qdot_list: vec![row(0.0), row(0.2)],
    };
    let violation = wire::ViolationData { violation_str: "none".into(), ..wire::ViolationData::default() };
    let servo = wire::ServoData {
        servo_actives: vec![true; 6],
        brake_actives: vec![false; 6],
        ..wire::ServoData::default()
    };
    vec![
        control.encode_to_vec(),
        violation.encode_to_vec(),
        servo.encode_to_vec(),
        wire::MotionData { speed_ratio: 100, ..wire::MotionData::default() }.encode_to_vec(),
        wire::ControlInfo { robot_model: "Indy7".into(), ..wire::ControlInfo::default() }.encode_to_vec(),
        wire::DeviceInfo { num_joints: 6, ..wire::DeviceInfo::default() }.encode_to_vec(),
        wire::CollisionPolicy { policy: 1 }.encode_to_vec(),
        wire::CollisionSensLevel { level: 3 }.encode_to_vec(),
        wire::SafetyLimits { tcp_speed_limit: 1.0 }.encode_to_vec(),
        wire::ToolProperties { mass: 0.3, ..wire::ToolProperties::default() }.encode_to_vec(),
        kinematics.encode_to_vec(),
        kinematics.encode_to_vec(),
        motion.encode_to_vec(),
        control.encode_to_vec(),
        control.encode_to_vec(),
        violation.encode_to_vec(),
        Vec::new(),
    ]
}
