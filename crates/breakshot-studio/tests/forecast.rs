//! What the page shows of a strike is what the library gives the commands, to the last digit.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::{files, physics, plan};
use serde_json::{Value, json};
use server::TestServer;

fn question(strike: &Value) -> Value {
    json!({ "pile": { "scene": "pile.scene.toml" }, "properties": "properties.json", "strike": strike })
}

fn value(body: &str) -> Value {
    serde_json::from_str(body).unwrap()
}

#[test]
fn a_plan_is_the_file_of_the_command_and_its_cloud_is_shown_to_the_last_digit() {
    let server = TestServer::start();
    let session = server.session();
    let request = json!({ "pile": { "scene": "pile.scene.toml" }, "properties": "properties.json", "output": "plan.json" });
    let (status, job) = session.post("/api/plan", &request);
    assert_eq!(status, 200, "{job}");
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.contains(r#""state":"running""#) && events.contains(r#""state":"done""#), "{events}");
    // The file: that of `breakshot plan` with its default flags.
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    let properties = files::load_properties(server.folder().join("properties.json")).unwrap();
    let properties = properties.completed_for(&scene).unwrap().into_owned();
    let planned =
        plan::plan(&scene, &properties, &plan::Options { seed: 1, ..plan::Options::default() }).unwrap();
    files::write_json(&server.outside().join("wanted.json"), &planned).unwrap();
    let read = |path: std::path::PathBuf| std::fs::read(path).unwrap();
    assert!(read(server.folder().join("plan.json")) == read(server.outside().join("wanted.json")));
    // The cloud of its strike, and the probability, are those in the file.
    let plan = value(&String::from_utf8(read(server.folder().join("plan.json"))).unwrap());
    let mut all = question(&plan["strike"]);
    all["worlds"] = json!(400);
    let outlook = value(&session.post("/api/cloud", &all).1);
    for key in
        ["success_probability", "standard_error", "expected_singulated", "cloud", "failures", "samples"]
    {
        assert_eq!(outlook[key], plan["robustness"][key], "{key}");
    }
    all["worlds"] = json!(60);
    assert_eq!(value(&session.post("/api/cloud", &all).1)["cloud"], plan["robustness"]["cloud"]);
    let motion = value(&session.post("/api/motion", &question(&plan["strike"])).1);
    assert_eq!(motion["trajectory"]["final"], plan["prediction"]["final"]);
}

#[test]
fn a_motion_is_the_trajectory_of_the_command() {
    let server = TestServer::start();
    let session = server.session();
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    let properties = files::load_properties(server.folder().join("properties.json")).unwrap();
    let strike: breakshot::scene::Strike = serde_json::from_value(server::strike()).unwrap();
    let trajectory = physics::trajectory(&scene, &properties, &strike, &plan::laws(&scene).unwrap()).unwrap();
    let (status, body) = session.post("/api/motion", &question(&server::strike()));
    assert_eq!(status, 200, "{body}");
    assert_eq!(value(&body)["trajectory"], serde_json::to_value(&trajectory).unwrap());
    // The bytes too: numbers are written alike.
    assert!(body.contains(&serde_json::to_string(&trajectory).unwrap()));
}

#[test]
fn an_exported_model_is_that_of_the_command_and_replaces_no_other_kind_of_file() {
    let server = TestServer::start();
    let session = server.session();
    let mut request = question(&server::strike());
    request["output"] = json!("pile.xml");
    let (status, answer) = session.post("/api/export", &request);
    assert_eq!(status, 200, "{answer}");
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    let properties = files::load_properties(server.folder().join("properties.json")).unwrap();
    let properties = properties.completed_for(&scene).unwrap().into_owned();
    let strike: breakshot::scene::Strike = serde_json::from_value(server::strike()).unwrap();
    let model = physics::mjcf(&scene, &properties, &strike, &physics::Options::default()).unwrap();
    assert_eq!(std::fs::read_to_string(server.folder().join("pile.xml")).unwrap(), model.text);
    assert_eq!(value(&answer), json!({ "file": "pile.xml", "notes": model.notes }));
    for output in ["pile.scene.toml", "../pile.xml", "pile.xml.json", ""] {
        request["output"] = json!(output);
        assert_eq!(session.post("/api/export", &request).0, 422, "{output}");
    }
}

#[test]
fn a_new_scene_replaces_no_file_and_names_files_of_the_project() {
    let server = TestServer::start();
    let session = server.session();
    let new = |cell: &str, output: &str| {
        session.post("/api/new", &json!({ "cell": cell, "objects": "objects.toml", "output": output })).0
    };
    assert_eq!(new("cell.toml", "new.scene.toml"), 200);
    assert_eq!(session.get("/api/scene?file=new.scene.toml").0, 200);
    for (cell, output) in [
        ("cell.toml", "new.scene.toml"),
        ("cell.toml", "new.json"),
        ("cell.toml", "../new.toml"),
        ("cell.toml", "folder/new.toml"),
        ("../cell.toml", "b.toml"),
        ("objects.toml", "b.toml"),
        ("none.toml", "b.toml"),
    ] {
        assert_eq!(new(cell, output), 422, "{cell} {output}");
    }
    assert!(!server.folder().join("b.toml").exists() && !server.outside().join("new.toml").exists());
}

#[test]
fn a_map_shows_the_strikes_of_the_grid() {
    let server = TestServer::start();
    let session = server.session();
    let request = json!({ "pile": { "scene": "pile.scene.toml" }, "properties": "properties.json" });
    let (_, job) = session.post("/api/map", &request);
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    let last = events.lines().rfind(|line| line.starts_with("data: ")).unwrap();
    let map = value(&last["data: ".len()..])["result"].clone();
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    let properties = files::load_properties(server.folder().join("properties.json")).unwrap();
    let (options, size) = (
        plan::Options { seed: 1, ..plan::Options::default() },
        plan::GridSize { strikes: 1000, samples: 40 },
    );
    let wanted = plan::evaluate_grid(&scene, &properties, &options, size).unwrap();
    assert_eq!(map["strikes"], serde_json::to_value(&wanted).unwrap());
}

#[test]
fn a_plan_that_is_cancelled_writes_nothing() {
    let server = TestServer::start();
    let session = server.session();
    let request = json!({ "pile": { "scene": "pile.scene.toml" }, "properties": "properties.json", "output": "plan.json" });
    let (_, job) = session.post("/api/plan", &request);
    assert_eq!(session.post(&format!("/api/jobs/{job}/cancel"), &json!({})).0, 200);
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.ends_with("data: {\"state\":\"cancelled\"}\n\n"), "{events}");
    assert!(!server.folder().join("plan.json").exists());
}

#[test]
fn a_pile_that_is_dragged_saved_and_opened_again_is_the_same() {
    let server = TestServer::start();
    let session = server.session();
    let scene = value(&session.get("/api/scene?file=pile.scene.toml").1)["scene"].clone();
    let ask = json!({ "pile": { "scene": "pile.scene.toml" }, "object": "e", "to": [-0.12, -0.02, 1.0] });
    let settled = value(&session.post("/api/settle", &ask).1);
    let mut placed = scene["placed"].clone();
    placed[2]["position_m"] = json!([settled["pose"][0], settled["pose"][1]]);
    placed[2]["yaw_rad"] = settled["pose"][2].clone();
    let pile = json!({ "scene": "pile.scene.toml", "placed": placed });
    assert_eq!(session.post("/api/save", &json!({ "pile": pile })).0, 200);
    let text = std::fs::read_to_string(server.folder().join("pile.scene.toml")).unwrap();
    assert!(text.starts_with("# The pile before the strike."), "{text}");
    let again = value(&session.get("/api/scene?file=pile.scene.toml").1)["scene"].clone();
    assert_eq!(again["placed"], placed);
    // It touches what it was dragged onto.
    assert!(!settled["touches"].as_array().unwrap().is_empty(), "{settled}");
}
