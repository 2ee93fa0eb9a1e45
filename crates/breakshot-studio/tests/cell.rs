//! The fit of the camera is that of `breakshot calibrate`, also with tags that were moved, and a saved cell keeps its comments.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::capture::{self, Calibration};
use breakshot::files;
use serde_json::{Value, json};
use server::{Session, TestServer};
use std::path::{Path, PathBuf};

fn film() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo/pile.mp4")
}

fn project() -> TestServer {
    let server = TestServer::start();
    std::fs::copy(film(), server.folder().join("pile.mp4")).unwrap();
    server
}

fn question(tags: &Value) -> Value {
    json!({ "cell": "cell.toml", "film": "pile.mp4", "scene": "pile.scene.toml", "tags": tags })
}

fn fit(session: &Session, tags: &Value) -> Value {
    let (status, body) = session.post("/api/fit", &question(tags));
    assert_eq!(status, 200, "{body}");
    serde_json::from_str(&body).unwrap()
}

/// The calibration with the cell of this text.
fn wanted(server: &TestServer, text: String) -> Calibration {
    let cell = files::cell_of(server.folder().join("cell.toml"), text).unwrap();
    capture::calibration(capture::capture(&server.folder().join("pile.mp4"), &cell).unwrap()).unwrap()
}

fn moved() -> Value {
    json!([{ "id": 1, "center_m": [0.4013, -0.2108], "yaw_rad": 0.004 }])
}

#[test]
fn the_fit_is_that_of_the_command_before_and_after_a_tag_is_moved() {
    let server = project();
    let session = server.session();
    let text = std::fs::read_to_string(server.folder().join("cell.toml")).unwrap();
    let as_given = wanted(&server, text.clone());
    // Asked twice: the second answer is that of the frames that are kept.
    for _ in 0..2 {
        assert_eq!(fit(&session, &json!([]))["calibration"], serde_json::to_value(&as_given).unwrap());
    }
    let other = text.replace("[0.4, -0.21]\nyaw_rad = 0.0", "[0.4013, -0.2108]\nyaw_rad = 0.004");
    assert_ne!(other, text);
    let fitted = fit(&session, &moved());
    assert_eq!(fitted["calibration"], serde_json::to_value(wanted(&server, other)).unwrap());
    assert_ne!(
        fitted["calibration"]["camera"]["reprojection_rms_px"],
        json!(as_given.camera.reprojection_rms_px)
    );
    // Nothing was written.
    assert_eq!(std::fs::read_to_string(server.folder().join("cell.toml")).unwrap(), text);
}

#[test]
fn residuals_and_heights_are_those_of_the_camera() {
    let server = project();
    let session = server.session();
    let text = std::fs::read_to_string(server.folder().join("cell.toml")).unwrap();
    let calibration = wanted(&server, text);
    let shown = fit(&session, &json!([]));
    let residuals: Vec<Value> =
        shown["tags"].as_array().unwrap().iter().map(|t| t["residual"].clone()).collect();
    assert_eq!(json!(residuals), serde_json::to_value(calibration.tag_residuals()).unwrap());
    let scene = files::load_scene(server.folder().join("pile.scene.toml")).unwrap().value;
    for (placed, drawn) in scene.placed.iter().zip(shown["objects"].as_array().unwrap()) {
        let height_m = drawn["height_m"].as_f64().unwrap();
        for (k, height_m) in [(0, 0.0), (1, height_m)] {
            let pixel = calibration.camera.pixel_from_table(placed.position_m, height_m);
            let px: [f64; 2] = serde_json::from_value(drawn["center_px"][k].clone()).unwrap();
            let off_px = (px[0] - pixel.x).hypot(px[1] - pixel.y);
            assert!(off_px < 0.01, "{} at {height_m} m: {px:?} px, not {pixel:?}", placed.object);
        }
    }
}

#[test]
fn saved_positions_change_their_numbers_alone() {
    let server = project();
    let session = server.session();
    let file = server.folder().join("cell.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let (status, body) = session.post("/api/save-tags", &json!({ "cell": "cell.toml", "tags": moved() }));
    assert_eq!((status, body.as_str()), (200, "\"cell.toml\""));
    let other = text.replace("[0.4, -0.21]\nyaw_rad = 0.0", "[0.4013, -0.2108]\nyaw_rad = 0.004");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), other);
    assert!(other.contains("# k1 k2 p1 p2 k3, OpenCV order"));
}

#[test]
fn films_are_seen_through_the_saved_cell_from_then_on() {
    let server = project();
    let session = server.session();
    let clips = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[clips]]\nvideo = \"pile.mp4\"\nobjects = [\"a\"]\n";
    std::fs::write(server.folder().join("campaign.toml"), clips).unwrap();
    std::fs::create_dir(server.folder().join("tracks")).unwrap();
    let tracks = r#"{"version": 1, "video": "pile.mp4", "reprojection_rms_px": 0.1, "tracks": [{"object": "a", "samples": [
        {"time_s": 0.0, "x_m": 0.0, "y_m": 0.0, "yaw_rad": null, "vx_m_s": null, "vy_m_s": null, "yaw_rate_rad_s": null,
         "ax_m_s2": null, "ay_m_s2": null, "std_m": 2e-5}]}]}"#;
    std::fs::write(server.folder().join("tracks/pile.json"), tracks).unwrap();
    let center_px = || -> [f64; 2] {
        let (status, body) = session.get("/api/clip?campaign=campaign.toml&clip=0");
        assert_eq!(status, 200, "{body}");
        let shown: Value = serde_json::from_str(&body).unwrap();
        serde_json::from_value(shown["objects"][0]["samples"][0]["center_px"].clone()).unwrap()
    };
    let before = center_px();
    // All tags are 10 mm further to the right than the file has them: the origin is seen further to the left.
    let corners = [(0, -0.39, -0.21), (1, 0.41, -0.21), (2, 0.41, 0.21), (3, -0.39, 0.21)];
    let tags: Vec<Value> =
        corners.iter().map(|(id, x, y)| json!({ "id": id, "center_m": [x, y], "yaw_rad": 0.0 })).collect();
    let (status, body) = session.post("/api/save-tags", &json!({ "cell": "cell.toml", "tags": tags }));
    assert_eq!(status, 200, "{body}");
    let moved_px = center_px()[0] - before[0];
    let wanted_px = -0.01 / 0.000_531;
    assert!((moved_px - wanted_px).abs() < 1.0, "the origin moved by {moved_px} px, not {wanted_px} px");
}

#[test]
fn a_cell_that_would_not_load_is_not_written_and_no_name_leads_out_of_the_folder() {
    let server = project();
    let session = server.session();
    let file = server.folder().join("cell.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    for tags in [
        json!([{ "id": 9, "center_m": [0.0, 0.0], "yaw_rad": 0.0 }]),
        json!([{ "id": 1, "center_m": [1e9, 0.0], "yaw_rad": 0.0 }]),
        json!([{ "id": 1, "center_m": [0.0, 0.0], "yaw_rad": 1e300 }]),
    ] {
        let (status, body) = session.post("/api/save-tags", &json!({ "cell": "cell.toml", "tags": tags }));
        assert_eq!(status, 422, "{tags}: {body}");
        assert_eq!(session.post("/api/fit", &question(&tags)).0, 422, "{tags}");
    }
    assert_eq!(std::fs::read_to_string(&file).unwrap(), text);
    std::fs::copy(&file, server.outside().join("cell.toml")).unwrap();
    for name in ["../cell.toml", "/etc/hostname", "sub/../../cell.toml"] {
        let (status, body) = session.post("/api/save-tags", &json!({ "cell": name, "tags": moved() }));
        assert_eq!(status, 422, "{name}: {body}");
        let mut question = question(&json!([]));
        question["film"] = json!(name);
        assert_eq!(session.post("/api/fit", &question).0, 422, "{name}");
    }
    assert_eq!(std::fs::read_to_string(server.outside().join("cell.toml")).unwrap(), text);
    // A lens outside of the folder is not read.
    let with_lens = text.replace("[camera]\n", "[camera]\ncamera_info = \"../lens.yaml\"\n");
    std::fs::write(&file, with_lens).unwrap();
    let (status, body) = session.post("/api/fit", &question(&json!([])));
    assert!(status == 422 && body.contains("project"), "{status} {body}");
}
