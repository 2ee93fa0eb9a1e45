//! A pile from a picture, and the picture beneath it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::capture::{Capture, Footage};
use breakshot::files::{self, SceneFile};
use server::TestServer;
use std::path::{Path, PathBuf};

fn demo(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo").join(file)
}

/// A project with the film of a pile.
fn project() -> TestServer {
    let server = TestServer::start();
    std::fs::copy(demo("pile.mp4"), server.folder().join("pile.mp4")).unwrap();
    server
}

fn question(output: &str) -> serde_json::Value {
    serde_json::json!({ "cell": "cell.toml", "objects": "objects.toml", "picture": "pile.mp4", "names": ["a", "c", "e"], "output": output })
}

#[test]
fn a_pile_from_a_picture_is_that_of_the_library_and_the_picture_shows_it() {
    let server = project();
    let session = server.session();
    let (status, answer) = session.post("/api/picture", &question("taken.scene.toml"));
    assert_eq!(status, 200, "{answer}");
    let cell = files::load_cell(demo("cell.toml")).unwrap();
    let objects = files::load_objects(demo("objects.toml")).unwrap().value;
    let capture = Capture::of(Footage::open(&demo("pile.mp4")).unwrap(), &cell).unwrap();
    let names = ["a", "c", "e"].map(String::from);
    let (placed, _) =
        breakshot::detect::placed(capture, &objects, &names, &breakshot::detect::Options::default()).unwrap();
    let wanted = SceneFile::of_picture("cell.toml".into(), "objects.toml".into(), placed, None);
    let written: SceneFile = files::read_toml(&server.folder().join("taken.scene.toml")).unwrap();
    assert_eq!(written.placed, wanted.placed);
    // The picture beneath: in the middle of every object is its dark marker, around it its light top.
    let answer = session.bytes("/api/beneath?scene=taken.scene.toml&picture=pile.mp4");
    let at = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
    assert!(answer.starts_with(b"HTTP/1.1 200"), "{}", String::from_utf8_lossy(&answer[..at]));
    let mut reader = png::Decoder::new(std::io::Cursor::new(&answer[at + 4..])).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let workspace = cell.workspace;
    let per_m = f64::from(info.width) / (workspace.max_m.x - workspace.min_m.x);
    let grey = |x_m: f64, y_m: f64| {
        let (column, row) = ((x_m - workspace.min_m.x) * per_m, (workspace.max_m.y - y_m) * per_m);
        i32::from(pixels[row as usize * info.width as usize + column as usize])
    };
    for placed in &written.placed {
        let (x, y) = (placed.position_m.x, placed.position_m.y);
        for (dx, dy) in [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)] {
            let (inside, outside) =
                (grey(x + 0.010 * dx, y + 0.010 * dy), grey(x + 0.015 * dx, y + 0.015 * dy));
            assert!(
                outside - inside > 40,
                "`{}`: {inside} in its marker, {outside} beside it",
                placed.object
            );
        }
    }
}

#[test]
fn pictures_that_are_none_and_names_that_are_taken_are_refused() {
    let server = project();
    let session = server.session();
    std::fs::write(server.outside().join("out.png"), b"x").unwrap();
    let change = |key: &str, value: serde_json::Value| {
        let mut question = question("new.scene.toml");
        question[key] = value;
        session.post("/api/picture", &question).0
    };
    for (key, value) in [
        ("output", serde_json::json!("pile.scene.toml")),
        ("output", serde_json::json!("../new.scene.toml")),
        ("output", serde_json::json!("new.json")),
        ("picture", serde_json::json!("../out.png")),
        ("picture", serde_json::json!("cell.toml")),
        ("picture", serde_json::json!("none.png")),
        ("names", serde_json::json!([])),
        ("names", serde_json::json!(["nobody"])),
        ("names", serde_json::json!(["a", "c", "e", "e#2"])),
        ("cell", serde_json::json!("objects.toml")),
    ] {
        assert_eq!(change(key, value.clone()), 422, "{key} {value}");
        assert!(!server.folder().join("new.scene.toml").exists(), "{key} {value}");
    }
    for query in [
        "scene=pile.scene.toml&picture=cell.toml",
        "scene=../x.toml&picture=pile.mp4",
        "scene=pile.scene.toml",
        "",
    ] {
        assert_eq!(session.get(&format!("/api/beneath?{query}")).0, 422, "{query}");
    }
    assert_eq!(session.get("/api/picture").0, 404, "a GET writes nothing");
}

#[test]
fn an_empty_folder_becomes_a_project_and_what_others_write_shows_up() {
    let server = project();
    let session = server.session();
    let stamp = || session.get("/api/stamp").1;
    let first = stamp();
    assert_eq!(first, stamp(), "nothing was changed");
    assert_eq!(session.post("/api/init", &serde_json::json!({})), (200, r#"["template.toml"]"#.into()));
    assert_eq!(session.post("/api/init", &serde_json::json!({})).0, 422, "a file is not replaced");
    assert_ne!(stamp(), first);
    let second = stamp();
    std::fs::write(server.folder().join("template.toml"), "# Another one.\n").unwrap();
    assert_ne!(stamp(), second);
}
