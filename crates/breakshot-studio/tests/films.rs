//! The frames that the page shows are those of the decoder, byte for byte.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use breakshot::capture::{Footage, Frame};
use server::{Session, TestServer};
use std::path::{Path, PathBuf};

fn demo() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo")
}

/// A project with the campaign and the films of the demo.
fn project_with_films() -> TestServer {
    let server = TestServer::start();
    for entry in demo().read_dir().unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, server.folder().join(path.file_name().unwrap())).unwrap();
    }
    server
}

/// The time and the grey levels of a frame as the page gets them; none after the film's end.
fn shown(session: &Session, clip: usize, frame: usize) -> Option<(f64, Vec<u8>)> {
    shown_of(session, &format!("campaign=campaign.toml&clip={clip}"), frame)
}

/// As [`shown`], of the film that this query names.
fn shown_of(session: &Session, query: &str, frame: usize) -> Option<(f64, Vec<u8>)> {
    let answer = session.bytes(&format!("/api/frame?{query}&frame={frame}"));
    let at = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
    let head = String::from_utf8(answer[..at].to_vec()).unwrap();
    if head.starts_with("HTTP/1.1 404") {
        return None;
    }
    assert!(head.starts_with("HTTP/1.1 200"), "{query}, frame {frame}: {head}");
    let time_s = head.lines().find_map(|line| line.strip_prefix("Frame-Time: ")).unwrap().parse().unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&answer[at + 4..])).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Eight));
    Some((time_s, pixels))
}

fn clips(session: &Session) -> Vec<serde_json::Value> {
    let (status, body) = session.get("/api/clips?campaign=campaign.toml");
    assert_eq!(status, 200, "{body}");
    serde_json::from_str(&body).unwrap()
}

fn assert_same(shown: Option<(f64, Vec<u8>)>, frame: &Frame, what: &str) {
    let (time_s, pixels) = shown.unwrap();
    assert_eq!(time_s, frame.time_s, "{what}: its time");
    assert!(pixels == frame.image.pixels, "{what}: its pixels");
}

#[test]
fn every_frame_of_every_film_is_that_of_the_decoder() {
    let server = project_with_films();
    let session = server.session();
    let clips = clips(&session);
    assert_eq!(clips.len(), 12);
    for (k, clip) in clips.iter().enumerate() {
        let name = clip["name"].as_str().unwrap();
        let frames: Vec<Frame> = Footage::open(&demo().join(name)).unwrap().map(Result::unwrap).collect();
        for (number, frame) in frames.iter().enumerate() {
            assert_same(shown(&session, k, number), frame, &format!("{name}, frame {number}"));
        }
        assert!(frames.len() > 10 && shown(&session, k, frames.len()).is_none(), "{name}: its end");
    }
    // The other films of the fixtures, of no campaign.
    let listed: Vec<&str> = clips.iter().map(|clip| clip["name"].as_str().unwrap()).collect();
    let names = demo().read_dir().unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let others: Vec<String> =
        names.filter(|name| name.contains(".mp4") && !listed.contains(&name.as_str())).collect();
    assert_eq!(others, ["pile.mp4"]);
    for name in others {
        for (number, frame) in Footage::open(&demo().join(&name)).unwrap().map(Result::unwrap).enumerate() {
            assert_same(
                shown_of(&session, &format!("film={name}"), number),
                &frame,
                &format!("{name}, frame {number}"),
            );
        }
    }
}

#[test]
fn a_start_is_shown_where_it_is_seen_and_the_tracking_begins_there() {
    let server = project_with_films();
    let session = server.session();
    let clip = clips(&session).iter().position(|clip| clip["name"] == "pair_a_c_3.mp4").unwrap();
    let starts = || -> Vec<serde_json::Value> {
        serde_json::from_str(&session.get(&format!("/api/starts?campaign=campaign.toml&clip={clip}")).1)
            .unwrap()
    };
    let before = starts();
    assert!(before.iter().all(|start| start["is_given"] == false && start["turns"] == false), "{before:?}");
    let seen = |object: &str, place: (&str, &serde_json::Value)| {
        let mut question = serde_json::json!({ "campaign": "campaign.toml", "clip": clip.to_string(), "object": object, "yaw_rad": 0.0 });
        question[place.0] = place.1.clone();
        session.post("/api/start", &question)
    };
    // The pixel of a place leads back to the place.
    let place = serde_json::json!([-0.1, 0.05]);
    let (status, answer) = seen("a", ("position_m", &place));
    assert_eq!(status, 200, "{answer}");
    let there: serde_json::Value = serde_json::from_str(&answer).unwrap();
    let back: serde_json::Value = serde_json::from_str(&seen("a", ("pixel", &there["center_px"])).1).unwrap();
    for k in 0..2 {
        let off_m = back["position_m"][k].as_f64().unwrap() - place[k].as_f64().unwrap();
        assert!(off_m.abs() < 1e-6, "{off_m} m");
    }
    for (object, place) in [
        ("nobody", ("position_m", &place)),
        ("a", ("at", &place)),
        ("a", ("pixel", &serde_json::json!([null, 1]))),
    ] {
        assert!([400, 422].contains(&seen(object, place).0), "{object} {place:?}");
    }
    // Each object at the place of the other: the tracking believes the person.
    let campaign = breakshot::files::load_campaign(demo().join("campaign.toml")).unwrap().value;
    let found = breakshot::clip_tracks(&campaign, &campaign.clips[clip], breakshot::capture::Decoder::Auto)
        .unwrap()
        .tracks;
    let first = |k: usize| found.tracks[k].samples[0].position();
    let text = std::fs::read_to_string(server.folder().join("campaign.toml")).unwrap();
    let change = serde_json::json!({ "campaign": "campaign.toml", "clip": "pair_a_c_3.mp4", "starts": [{ "object": "a", "position_m": first(1) }] });
    assert_eq!(session.post("/api/clip", &change), (200, "1".into()));
    let written = std::fs::read_to_string(server.folder().join("campaign.toml")).unwrap();
    assert!(
        written.contains("starts = [{ object = \"a\", position_m = [")
            && written.starts_with("# Two strikes"),
        "{written}"
    );
    assert_eq!(starts()[0]["is_given"], true);
    let (_, job) = session
        .post("/api/track", &serde_json::json!({ "campaign": "campaign.toml", "clip": clip.to_string() }));
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.contains(r#""state":"done""#), "{events}");
    let tracked: breakshot::detect::Tracks =
        breakshot::files::read_json(&server.folder().join("tracks/pair_a_c_3.json")).unwrap();
    let off_m = tracked.tracks[0].samples[0].position().distance(first(1));
    assert!(off_m < 0.01, "`a` begins {off_m} m from where it was seen");
    for wrong in [
        serde_json::json!([{ "object": "e", "position_m": [0, 0] }]),
        serde_json::json!([{ "object": "a", "position_m": [0, 1e9] }]),
        serde_json::json!([{ "object": "a" }]),
    ] {
        let change =
            serde_json::json!({ "campaign": "campaign.toml", "clip": "pair_a_c_3.mp4", "starts": wrong });
        assert!([400, 422].contains(&session.post("/api/clip", &change).0), "{wrong}");
    }
    let undo = session.post("/api/undo", &serde_json::json!({ "campaign": "campaign.toml" }));
    assert_eq!(undo, (200, "0".into()));
    assert_eq!(std::fs::read_to_string(server.folder().join("campaign.toml")).unwrap(), text);
}

#[test]
fn steps_forth_and_back_and_leaps_come_to_the_same_frames() {
    let server = project_with_films();
    let session = server.session();
    let frames: Vec<Frame> =
        Footage::open(&demo().join("single_a_3.mp4")).unwrap().map(Result::unwrap).collect();
    let last = frames.len() - 1;
    for number in [last, 0, last, last - 1, last / 2, last / 2 + 1, last / 2, 3, 2, 1, 0, last] {
        assert_same(shown(&session, 0, number), &frames[number], &format!("frame {number}"));
        // Another film in between.
        if number == 3 {
            assert!(shown(&session, 5, 0).is_some());
        }
    }
    assert!(shown(&session, 0, usize::MAX - 1).is_none());
}

#[test]
fn a_clip_that_is_tracked_shows_outlines_on_the_objects_and_its_impacts() {
    let server = project_with_films();
    let session = server.session();
    let clip = clips(&session).iter().position(|clip| clip["name"] == "pair_a_c_3.mp4").unwrap();
    let path = format!("/api/clip?campaign=campaign.toml&clip={clip}");
    assert_eq!(session.get(&path), (200, "null".into()), "before it is tracked");
    let question = serde_json::json!({ "campaign": "campaign.toml", "clip": clip.to_string() });
    let (_, job) = session.post("/api/track", &question);
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.contains(r#""state":"done""#) && events.contains("tracks/pair_a_c_3.json"), "{events}");
    let motion: serde_json::Value = serde_json::from_str(&session.get(&path).1).unwrap();
    let sample = &motion["objects"][0]["samples"][0];
    let disc = breakshot::object::Shape::Disc { radius_m: 0.03 };
    assert_eq!(sample["outline_px"].as_array().unwrap().len(), disc.outline_points().len());
    let names: Vec<_> = motion["objects"].as_array().unwrap().iter().map(|o| o["name"].clone()).collect();
    assert_eq!(names, ["a", "c"]);
    let impacts = motion["impacts"].as_array().unwrap();
    assert!(impacts.iter().any(|i| i["a"] == "a" && i["b"] == "c"), "{impacts:?}");
    assert!(impacts.iter().any(|i| i["a"] == "striker" && i["b"] == "a"), "{impacts:?}");
    // The tracks are those of the command.
    let campaign = breakshot::files::load_campaign(demo().join("campaign.toml")).unwrap().value;
    let tracked =
        breakshot::clip_tracks(&campaign, &campaign.clips[clip], breakshot::capture::Decoder::Auto).unwrap();
    let written: breakshot::detect::Tracks =
        breakshot::files::read_json(&server.folder().join("tracks/pair_a_c_3.json")).unwrap();
    assert_eq!(written, tracked.tracks);
}

#[test]
fn an_estimate_is_the_file_of_the_command_and_its_tracks() {
    let server = project_with_films();
    let session = server.session();
    let ask = |output: &str| {
        session.post("/api/estimate", &serde_json::json!({ "campaign": "campaign.toml", "output": output }))
    };
    let (_, job) = ask("learned.json");
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.contains(r#""state":"done""#), "{events}");
    let campaign = breakshot::files::load_campaign(demo().join("campaign.toml")).unwrap().value;
    let tracked = |clip| breakshot::clip_tracks(&campaign, clip, breakshot::capture::Decoder::Auto).unwrap();
    let clips: Vec<_> = campaign.clips.iter().map(tracked).collect();
    let options = breakshot::estimate::Options::default();
    let wanted = breakshot::estimate::estimation(&clips, &campaign.cell, &campaign.objects, &options)
        .unwrap()
        .properties;
    assert_eq!(breakshot::files::load_properties(server.folder().join("learned.json")).unwrap(), wanted);
    assert_eq!(server.folder().join("tracks").read_dir().unwrap().count(), 12);
    // Ended before it is done it writes nothing.
    let (_, job) = ask("none.json");
    assert_eq!(session.post(&format!("/api/jobs/{job}/cancel"), &serde_json::json!({})).0, 200);
    let events = session.get(&format!("/api/jobs/{job}/events")).1;
    assert!(events.ends_with("data: {\"state\":\"cancelled\"}\n\n"), "{events}");
    assert!(!server.folder().join("none.json").exists());
}

#[test]
fn a_campaign_that_names_a_film_elsewhere_is_not_read() {
    let server = project_with_films();
    let session = server.session();
    std::fs::copy(demo().join("pile.mp4"), server.outside().join("pile.mp4")).unwrap();
    let text = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[clips]]\nvideo = \"../pile.mp4\"\nobjects = [\"a\"]\n";
    std::fs::write(server.folder().join("other.toml"), text).unwrap();
    let (status, body) = session.get("/api/clips?campaign=other.toml");
    assert!(status == 422 && body.contains("project"), "{status} {body}");
    for (clip, frame) in
        [("99", "0"), ("-1", "0"), ("0", "-1"), ("0", "x"), ("x", "0"), ("0", "99999999999999999999999")]
    {
        let (status, _) =
            session.get(&format!("/api/frame?campaign=campaign.toml&clip={clip}&frame={frame}"));
        assert!(status == 422 || status == 404, "{clip} {frame}: {status}");
    }
}
