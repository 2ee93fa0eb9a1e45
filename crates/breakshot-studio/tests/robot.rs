//! The joint path is that of `breakshot command`; nothing in the studio can move an arm.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::files;
use breakshot::robot::{self, Answer, Command, Options};
use serde_json::{Value, json};
use server::{Session, TestServer, strike};

/// An arm beside the demo's table, which it reaches.
const ROBOT: &str = "\n[robot]\narm = \"indy7\"\nbase_from_table = { position_m = [0.55, 0.0, 0.0], rpy_rad = [0.0, 0.0, -1.5708] }\n\
    tool_offset_m = [0.0, 0.0, 0.12]\ntool_mass_kg = 0.3\n";

/// A project with a strike and, beside the demo's cell, one with this section.
fn project(section: &str) -> TestServer {
    let server = TestServer::start();
    let text = std::fs::read_to_string(server.folder().join("cell.toml")).unwrap();
    std::fs::write(server.folder().join("robot.cell.toml"), text + section).unwrap();
    files::write_json(&server.folder().join("pile.strike.json"), &strike()).unwrap();
    server
}

fn found(session: &Session, cell: &str) -> Value {
    let question = json!({ "cell": cell, "strike": "pile.strike.json", "scene": "pile.scene.toml" });
    let (status, body) = session.post("/api/command", &question);
    assert_eq!(status, 200, "{body}");
    serde_json::from_str(&body).unwrap()
}

/// The command of the library.
fn wanted(server: &TestServer) -> Command {
    let cell = files::load_cell(server.folder().join("robot.cell.toml")).unwrap();
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    let strike = files::load_strike(server.folder().join("pile.strike.json")).unwrap();
    match robot::command(&cell, &strike, Some(&scene), &Options::default()).unwrap() {
        Answer::Ready(command) => *command,
        Answer::Refused(refusal) => panic!("{}", refusal.reason),
    }
}

#[test]
fn the_path_is_that_of_the_command() {
    let server = project(ROBOT);
    let shown = found(&server.session(), "robot.cell.toml");
    let command = wanted(&server);
    assert_eq!((&shown["outcome"], &shown["hash"]), (&json!("ready"), &json!(command.short_hash())));
    assert_eq!(shown["stroke"], serde_json::to_value(&command.stroke).unwrap());
    let sentences: Vec<String> = command.checks.iter().map(robot::LimitCheck::sentence).collect();
    let shown_sentences: Vec<&str> =
        shown["checks"].as_array().unwrap().iter().map(|check| check["sentence"].as_str().unwrap()).collect();
    assert_eq!(shown_sentences, sentences);

    // Every sample of the strike is shown, at its time, with the tip where the arm's kinematics put it.
    let times: Vec<f64> = serde_json::from_value(shown["time_s"].clone()).unwrap();
    assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "times in order");
    let mounted = command.mounted_arm().unwrap();
    let stroke = command.phase(robot::PhaseName::Strike).unwrap();
    for (time_s, angles) in stroke.time_s.iter().zip(&stroke.q_rad) {
        let k = times.iter().rposition(|shown_s| shown_s == time_s).unwrap();
        let (on_table, height_m) = mounted.tip_on_table(angles);
        let tip: [f64; 3] =
            serde_json::from_value(shown["skeleton_m"][k].as_array().unwrap().last().unwrap().clone())
                .unwrap();
        let off_m = (tip[0] - on_table.x).hypot(tip[1] - on_table.y).hypot(tip[2] - height_m);
        assert!(off_m < 1e-9, "{time_s} s: the tip is drawn {off_m} m beside its position");
    }
    for (joint, drawn) in shown["joints"].as_array().unwrap().iter().enumerate() {
        let speeds = command.phases.iter().flat_map(|phase| &phase.qd_rad_s).map(|qd| qd[joint].abs());
        let most = speeds.fold(0.0, f64::max);
        assert_eq!(drawn["most_rad_s"], json!(most), "joint {joint}");
        assert!(most <= drawn["allowed_rad_s"].as_f64().unwrap(), "joint {joint}: {most} rad/s");
    }
}

#[test]
fn a_cell_without_an_arm_and_a_strike_out_of_reach_get_a_sentence() {
    let server = project(&ROBOT.replace("0.55", "3.0"));
    let session = server.session();
    let missing = found(&session, "cell.toml");
    assert_eq!(missing["outcome"], "missing");
    assert!(missing["needed"].as_str().unwrap().contains("add `[robot]`"), "{missing}");
    let refused = found(&session, "robot.cell.toml");
    assert_eq!(refused["outcome"], "refused", "{refused}");
    let server = project("\n[robot]\narm = \"indy7\"\n");
    let missing = found(&server.session(), "robot.cell.toml");
    assert!(missing["needed"].as_str().unwrap().contains("add `base_from_table` to `[robot]`"), "{missing}");
}

#[test]
fn an_arm_outside_of_the_folder_is_not_read() {
    let server = project(&ROBOT.replace("\"indy7\"", "\"../arm.urdf\""));
    let question = json!({ "cell": "robot.cell.toml", "strike": "pile.strike.json", "scene": null });
    let (status, body) = server.session().post("/api/command", &question);
    assert!(status == 422 && body.contains("project"), "{status} {body}");
}

#[test]
fn the_studio_links_no_driver() {
    let manifest = include_str!("../Cargo.toml").parse::<toml::Table>().unwrap();
    let dependencies = manifest["dependencies"].as_table().unwrap();
    assert!(dependencies.contains_key("breakshot"));
    assert!(!dependencies.contains_key("breakshot-drivers"), "{dependencies:?}");
    let lock = include_str!("../../../Cargo.lock").parse::<toml::Table>().unwrap();
    let packages = lock["package"].as_array().unwrap();
    let needs = |name: &str| -> Vec<String> {
        let package = packages.iter().find(|package| package["name"].as_str() == Some(name)).unwrap();
        let needed = package.get("dependencies").and_then(toml::Value::as_array).into_iter().flatten();
        needed.filter_map(toml::Value::as_str).map(str::to_owned).collect()
    };
    assert!(needs("breakshot-cli").iter().any(|name| name == "breakshot-drivers"), "the name is still right");
    for package in ["breakshot-studio", "breakshot"] {
        assert!(!needs(package).iter().any(|name| name == "breakshot-drivers"), "{package}");
    }
}
