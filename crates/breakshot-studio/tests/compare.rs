//! A comparison is that of `breakshot verify`, and the page shows its numbers and draws its poses.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::capture::{Capture, Footage};
use breakshot::detect::{self, Layout, Tracks};
use breakshot::geometry::Pose;
use breakshot::physics::{self, Trajectory};
use breakshot::scene::Scene;
use breakshot::verify::{self, Observed, Report};
use breakshot::{files, plan, report};
use serde_json::{Value, json};
use server::{Session, TestServer};
use std::path::{Path, PathBuf};

fn demo() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo")
}

/// The project of the demo's pile, with its film and its strike.
fn project() -> TestServer {
    let server = TestServer::start();
    for name in ["pile.mp4", "pile.strike.json"] {
        std::fs::copy(demo().join(name), server.folder().join(name)).unwrap();
    }
    server
}

fn question(film: &str, output: &str) -> Value {
    json!({ "film": film, "scene": "pile.scene.toml", "strike": "pile.strike.json", "properties": "properties.json", "output": output })
}

/// The last event of a comparison.
fn compared(session: &Session, question: &Value) -> String {
    let (status, job) = session.post("/api/compare", question);
    assert_eq!(status, 200, "{job}");
    session.get(&format!("/api/jobs/{job}/events")).1
}

fn shown(session: &Session, file: &str) -> Value {
    let (status, body) = session.get(&format!("/api/comparison?file={file}"));
    assert_eq!(status, 200, "{body}");
    serde_json::from_str(&body).unwrap()
}

/// What the library finds.
fn wanted(server: &TestServer) -> (Scene, Tracks, Trajectory, Report) {
    let file = |name: &str| server.folder().join(name);
    let scene = files::load_scene(file("pile.scene.toml")).unwrap().value;
    let properties = files::load_properties(file("properties.json")).unwrap();
    let properties = properties.completed_for(&scene).unwrap();
    let strike = files::load_strike(file("pile.strike.json")).unwrap();
    let laws = plan::laws(&scene).unwrap();
    let trajectory = physics::trajectory(&scene, &properties, &strike, &laws).unwrap();
    let film = Capture::of(Footage::open(&file("pile.mp4")).unwrap(), &scene.cell).unwrap();
    let names: Vec<String> = scene.placed.iter().map(|placed| placed.object.clone()).collect();
    let layout = Layout::Placed(scene.placed.clone());
    let tracks = detect::tracks(film, &scene.objects, &names, &layout, &detect::Options::default()).unwrap();
    let mut report =
        verify::comparison(&scene, &trajectory.final_poses, &Observed::from_tracks(&tracks)).unwrap();
    report.align(&tracks, &trajectory);
    (scene, tracks, trajectory, report)
}

#[test]
fn a_comparison_is_written_as_by_the_command_and_shown_with_its_reasons_and_outlines() {
    let server = project();
    let session = server.session();
    let events = compared(&session, &question("pile.mp4", "verified"));
    assert!(events.contains(r#""state":"done""#) && events.contains("verified/report.json"), "{events}");
    let (scene, tracks, trajectory, report) = wanted(&server);
    let folder = server.folder().join("verified");
    assert_eq!(files::read_json::<Report>(&folder.join("report.json")).unwrap(), report);
    assert_eq!(files::read_json::<Tracks>(&folder.join("tracks.json")).unwrap(), tracks);
    assert_eq!(files::read_json::<Trajectory>(&folder.join("trajectory.json")).unwrap(), trajectory);
    assert_eq!(std::fs::read_to_string(folder.join("distances.csv")).unwrap(), report.csv());

    let shown = shown(&session, "verified/report.json");
    assert_eq!(shown["report"], serde_json::to_value(&report).unwrap());
    let reasons = report::difference_reasons(&report, Some(&trajectory));
    assert_eq!(shown["reasons"], serde_json::to_value(&reasons).unwrap());
    assert!(reasons.iter().any(|reason| reason.time_s.is_some()), "{reasons:?}");
    assert_eq!(
        (&shown["scene_file"], &shown["film"]["name"]),
        (&json!("pile.scene.toml"), &json!("pile.mp4"))
    );

    // The outlines of a frame in motion are those of the filmed and of the simulated pose at the same time.
    let start_s = report.alignment.as_ref().unwrap().start_s;
    let camera = Capture::of(Footage::open(&demo().join("pile.mp4")).unwrap(), &scene.cell).unwrap().camera;
    let frame = 30;
    for (track, drawn) in tracks.tracks.iter().zip(shown["objects"].as_array().unwrap()) {
        let (sample, shot) = (&track.samples[frame], &drawn["samples"][frame]);
        assert_eq!(shot["time_s"], json!(sample.time_s - start_s), "{}", track.object);
        let object = breakshot::object::find(&scene.objects, &track.object, "the scene").unwrap();
        let filmed = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
        let simulated = trajectory.pose(&track.object, sample.time_s - start_s).unwrap();
        for (key, pose) in [("outline_px", filmed), ("simulated_px", simulated)] {
            let first = pose.table_from_body(object.shape.outline_points()[0]);
            let pixel = camera.pixel_from_table(first, object.height_m);
            let px: [f64; 2] = serde_json::from_value(shot[key][0].clone()).unwrap();
            let off_px = (px[0] - pixel.x).hypot(px[1] - pixel.y);
            assert!(off_px < 0.01, "{} {key}: {px:?} px, not {pixel:?}", track.object);
        }
    }
    let moved = &shown["objects"][0]["samples"][frame];
    assert_ne!(moved["outline_px"], moved["simulated_px"], "film and simulation differ");
}

#[test]
fn tracks_are_compared_without_their_film_and_a_cancelled_comparison_writes_nothing() {
    let server = project();
    let session = server.session();
    let (.., tracks, _, report) = {
        let (scene, tracks, trajectory, report) = wanted(&server);
        (scene, tracks, trajectory, report)
    };
    files::write_json(&server.folder().join("pile.tracks.json"), &tracks).unwrap();
    let events = compared(&session, &question("pile.tracks.json", "of-tracks"));
    assert!(events.contains(r#""state":"done""#), "{events}");
    let found: Report = files::read_json(&server.folder().join("of-tracks/report.json")).unwrap();
    assert_eq!(found.pairs, report.pairs);

    let (_, job) = session.post("/api/compare", &question("pile.mp4", "none"));
    assert_eq!(session.post(&format!("/api/jobs/{job}/cancel"), &json!({})).0, 200);
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.ends_with("data: {\"state\":\"cancelled\"}\n\n"), "{events}");
    assert!(!server.folder().join("none").exists());
}

#[test]
fn a_comparison_whose_scene_was_changed_is_not_drawn_on_another() {
    let server = project();
    let session = server.session();
    compared(&session, &question("pile.mp4", "verified"));
    let scene = server.folder().join("pile.scene.toml");
    let text = std::fs::read_to_string(&scene).unwrap();
    std::fs::write(&scene, text.replace("[-0.16855, 0.03851]", "[-0.17855, 0.03851]")).unwrap();
    let (status, body) = session.get("/api/comparison?file=verified/report.json");
    assert!(status == 422 && body.contains("compare anew"), "{status} {body}");
}

#[test]
fn no_name_of_a_comparison_leads_out_of_the_folder() {
    let server = project();
    let session = server.session();
    for name in ["../x", "/etc", "a/../../x", ".hidden", ""] {
        let events = compared(&session, &question("pile.mp4", name));
        assert!(events.contains(r#""state":"failed""#), "{name}: {events}");
        let events = compared(&session, &question(name, "verified"));
        assert!(events.contains(r#""state":"failed""#), "{name}: {events}");
        assert_eq!(session.get(&format!("/api/comparison?file={name}/report.json")).0, 422, "{name}");
        let status = session.get(&format!("/api/frame?film={name}&frame=0")).0;
        assert_eq!(status, 422, "a frame of {name}");
    }
    assert_eq!(session.get("/api/frame?film=pile.mp4&frame=99999").0, 404);
}
