//! Tests of the page as a whole: well-formed, complete, self-contained.

use super::{ClipMotion, FilmedStrike, Page, html};
use crate::capture::GreyImage;
use crate::cell::Cell;
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Marker, Object, Shape};
use crate::physics;
use crate::plan::{Iteration, Method, Outcome, Plan, Prediction};
use crate::properties::Properties;
use crate::scene::{Goal, KeepOut, Placed, Scene, Strike, Wall};
use crate::uncertain::Estimate;
use crate::verify::{Observed, Report, comparison};
use std::collections::BTreeMap;

fn object(name: &str, shape: Shape, mass_kg: Option<f64>) -> Object {
    let marker = Some(Marker::centred(Shape::Rectangle { size_m: [0.018, 0.009] }));
    Object { name: name.into(), shape, height_m: 0.03, marker, mass_kg, support: None }
}

fn objects() -> Vec<Object> {
    vec![
        object("a", Shape::Disc { radius_m: 0.04 }, Some(0.143)),
        object("b & <co>", Shape::Rectangle { size_m: [0.04, 0.05] }, Some(0.008)),
    ]
}

fn filmed_strike<'a>(
    scene: &'a Scene,
    strike: &'a Strike,
    tracks: &'a Tracks,
    report: &'a Report,
) -> FilmedStrike<'a> {
    FilmedStrike { scene, strike, tracks: Some(tracks), trajectory: None, report, frames: None }
}

fn scene() -> Scene {
    let cell = "[camera]\nscale_px_per_m = 1000.0\n[workspace]\nmin_m = [-0.3, -0.2]\nmax_m = [0.3, 0.2]\n\
                [table]\noutline_m = [[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]]\n\
                [striker]\nshape = { disc = { radius_m = 0.015 } }\nheight_m = 0.08\nspeed_range_m_s = [0.05, 1.0]";
    let cell: Cell = toml::from_str(cell).expect("a cell");
    let placed =
        |object: &str, x: f64| Placed { object: object.into(), position_m: Point::new(x, 0.0), yaw_rad: 0.3 };
    Scene {
        cell,
        objects: objects(),
        observed_unix_s: None,
        placed: vec![placed("a", -0.1), placed("b & <co>", -0.03), placed("a#2", 0.05)],
        walls: vec![Wall { from_m: Point::new(0.0, 0.2), to_m: Point::new(0.2, 0.2), restitution: 0.4 }],
        keep_out: vec![KeepOut {
            points_m: [[0.1, -0.2], [0.2, -0.2], [0.2, -0.1]].map(Point::from).to_vec(),
        }],
        goal: Goal::default(),
    }
}

fn strike() -> Strike {
    Strike {
        object: Some("a".into()),
        start_m: Point::new(-0.25, 0.0),
        heading_rad: 0.0,
        speed_m_s: 0.5,
        travel_m: 0.11,
    }
}

/// Tracks of objects that are at the poses of the scene in the first 10 frames and then displaced by `shift_m`.
fn tracks(scene: &Scene, shift_m: f64) -> Tracks {
    let sample = |placed: &Placed, k: usize| {
        let position = placed.position_m + Vec2::new(if k < 10 { 0.0 } else { shift_m }, 0.0);
        Sample {
            vx_m_s: (k > 0).then_some(if k == 10 { 0.4 } else { 0.0 }),
            vy_m_s: (k > 0).then_some(0.0),
            doubtful: k == 10,
            ..Sample::new(k as f64 / 60.0, position, Some(placed.yaw_rad), 2e-5)
        }
    };
    let track = |placed: &Placed| Track {
        object: placed.object.clone(),
        samples: (0..30).map(|k| sample(placed, k)).collect(),
    };
    Tracks {
        version: 1,
        video: "x <1>.mp4".into(),
        tracks: scene.placed.iter().map(track).collect(),
        ..Tracks::default()
    }
}

fn predicted(scene: &Scene, shift_m: f64) -> BTreeMap<String, Pose> {
    let moved = |p: &Placed| Pose::new(p.position_m.x + shift_m, p.position_m.y, p.yaw_rad + 0.1);
    scene.placed.iter().map(|p| (p.object.clone(), moved(p))).collect()
}

fn properties() -> Properties {
    let estimate = |values: &[f64]| Estimate::from_repeats(values, f64::NAN).expect("values");
    let one = |name: &str, values: &[f64]| [(name.to_owned(), estimate(values))].into_iter().collect();
    Properties {
        version: 1,
        reference: "a".into(),
        friction: one("a", &[0.2, 0.21, 0.22]),
        striker_restitution: one("b & <co>", &[0.6]),
        restitution: one("a/b & <co>", &[0.5, 0.55]),
        mass_ratio: [
            ("a".to_owned(), Estimate::exact(1.0)),
            ("b & <co>".to_owned(), estimate(&[0.05, 0.06])),
        ]
        .into(),
        pair_mass_ratio: one("a/b & <co>", &[18.0, 17.0]),
        warnings: vec!["`a/a` was never filmed".into()],
        ..Properties::default()
    }
}

/// Properties with which the scene can be simulated.
fn simulated_properties() -> Properties {
    let exact = |names: &[&str], value: f64| {
        names.iter().map(|&name| (name.to_owned(), Estimate::exact(value))).collect::<BTreeMap<_, _>>()
    };
    Properties {
        version: 1,
        reference: "a".into(),
        friction: exact(&["a", "b & <co>"], 0.2),
        striker_restitution: exact(&["a", "b & <co>"], 0.5),
        restitution: exact(&["a/a", "a/b & <co>"], 0.5),
        mass_ratio: exact(&["a", "b & <co>"], 1.0),
        ..Properties::default()
    }
}

fn plan(scene: &Scene) -> Plan {
    let step = |k: u32| Iteration {
        strike: Strike { speed_m_s: 0.1 * f64::from(k), ..strike() },
        fulfilled: k == 3,
        ..Iteration::default()
    };
    Plan {
        version: 1,
        method: Method::Paper,
        outcome: Outcome::Found,
        reason: "because".into(),
        scene: scene.clone(),
        arm: None,
        strike: Some(strike()),
        prediction: Some(Prediction { final_poses: predicted(scene, 0.1), ..Prediction::default() }),
        iterations: (1..4).map(step).collect(),
        robustness: None,
        assumed: Vec::new(),
        remedies: Vec::new(),
        then: Vec::new(),
    }
}

/// The page without the contents of its script, which a parser of XML takes as text.
fn without_script(page: &str) -> String {
    let Some((before, rest)) = page.split_once("//<![CDATA[") else { return page.to_owned() };
    let (_, after) = rest.split_once("//]]>").expect("an end of the script");
    assert!(!after.contains("CDATA"), "one script");
    before.to_owned() + after
}

/// Asserts that the tags are closed in order and that the page has no stray `&` and no number that is not finite.
pub(super) fn assert_well_formed(page: &str) {
    let page = &without_script(page);
    let mut open: Vec<&str> = Vec::new();
    let body = page.strip_prefix("<!DOCTYPE html>\n").expect("a doctype");
    for (k, piece) in body.split('<').enumerate() {
        let Some((tag, text)) = piece.split_once('>') else {
            assert!(k == 0 && piece.is_empty(), "a `<` without `>`: {piece:.60}");
            continue;
        };
        for entity in text.split('&').skip(1) {
            let known = ["amp;", "lt;", "gt;", "quot;"].iter().any(|e| entity.starts_with(e));
            assert!(known, "a stray `&`: {entity:.40}");
        }
        assert_eq!(tag.matches('"').count() % 2, 0, "an open quote: {tag}");
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap_or_default();
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(closed), "closed out of order after {open:?}");
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "never closed: {open:?}");
    for word in ["NaN", "inf\"", "inf ", "-0\""] {
        assert!(!page.contains(word), "the page holds `{word}`");
    }
}

#[test]
fn a_page_of_all_results_is_well_formed_and_self_contained() {
    let scene = scene();
    let (tracks, predicted) = (tracks(&scene, 0.12), predicted(&scene, 0.1));
    let report = comparison(&scene, &predicted, &Observed::from_tracks(&tracks)).expect("a report");
    let (properties, plan, objects, strike) = (properties(), plan(&scene), objects(), strike());
    let frame = GreyImage { width: 8, height: 6, pixels: (0..48).collect() };
    let frames = Some([&frame, &frame]);
    let filmed = FilmedStrike { frames, ..filmed_strike(&scene, &strike, &tracks, &report) };
    let page = html(&Page {
        title: "A & B",
        objects: &objects,
        motion: Some(ClipMotion {
            tracks: &tracks,
            fit: None,
            cell: Some(&scene.cell),
            strike: Some(&strike),
        }),
        properties: Some(&properties),
        fits: &[],
        plan: Some(&plan),
        simulated: None,
        filmed: &[filmed],
        warnings: &["one <more>".to_owned()],
    });
    assert_well_formed(&page);
    for word in ["Filmed against simulated", "Table 1", "one &lt;more&gt;", "was never filmed", "The search"]
    {
        assert!(page.contains(word), "`{word}` is not in the page");
    }
    for outside in ["http://", "https://", "src=\"/", "src=\"h", "@import", "<script src", "<link"] {
        let page = page.replace("http://www.w3.org/", "");
        assert!(!page.contains(outside), "the page refers to another file: `{outside}`");
    }
    // A player for the clip and one for the filmed strike, one script, and its list of keys.
    for (part, count) in [
        ("<div class=\"player\"", 2),
        ("<script type=\"application/json\"", 2),
        ("<script type=\"module\">", 1),
        ("<script", 3),
        ("id=\"keys\"", 1),
    ] {
        assert_eq!(page.matches(part).count(), count, "`{part}` in the page");
    }
}

/// The data elements of a page, parsed.
fn data(page: &str) -> Vec<serde_json::Value> {
    let parts = page.split("class=\"data\">").skip(1);
    let text = parts.map(|part| part.split('<').next().expect("an end of the data"));
    text.map(|text| serde_json::from_str(text).expect("JSON")).collect()
}

/// Running sums of differences, as the script takes them.
fn sums(differences: &serde_json::Value) -> Vec<i64> {
    let differences = differences.as_array().expect("a list").iter().map(|d| d.as_i64().expect("a number"));
    differences
        .scan(0, |sum, difference| {
            *sum += difference;
            Some(*sum)
        })
        .collect()
}

#[test]
fn the_data_of_a_player_are_the_tracks_to_a_twentieth_of_a_millimetre() {
    let scene = scene();
    let mut tracks = tracks(&scene, 0.123_456);
    tracks.tracks[1].samples.remove(5);
    let (predicted, strike) = (predicted(&scene, 0.1), strike());
    let mut report = comparison(&scene, &predicted, &Observed::from_tracks(&tracks)).expect("a report");
    report.alignment = serde_json::from_str(r#"{"object": "a", "start_s": 0.1, "divergences": []}"#).ok();
    let filmed = filmed_strike(&scene, &strike, &tracks, &report);
    let page = html(&Page { filmed: &[filmed], ..Page::default() });
    assert_well_formed(&page);
    let [data] = &data(&page)[..] else { panic!("one player") };
    assert_eq!(data["film_start_s"], 0.1);
    let motion = &data["motions"][0];
    for (track, drawn) in tracks.tracks.iter().zip(motion["tracks"].as_array().expect("tracks")) {
        let body = &data["bodies"][drawn["body"].as_u64().expect("a number") as usize];
        assert_eq!(body["name"], track.object.as_str(), "names are whole in the data");
        let times = sums(&motion["clocks"][drawn["clock"].as_u64().expect("a number") as usize]);
        let (x, y, yaw) = (sums(&drawn["x"]), sums(&drawn["y"]), sums(&drawn["yaw"]));
        assert_eq!([times.len(), x.len(), y.len(), yaw.len()], [track.samples.len(); 4]);
        for (k, sample) in track.samples.iter().enumerate() {
            let close =
                |found: i64, unit: f64, wanted: f64| (found as f64 * unit - wanted).abs() < 0.51 * unit;
            assert!(close(times[k], 1e-6, sample.time_s - 0.1), "{} at {k}: {} us", track.object, times[k]);
            assert!(close(x[k], 1e-4, sample.x_m), "{} at {k}: x = {} tenths of a mm", track.object, x[k]);
            assert!(close(y[k], 1e-4, sample.y_m), "{} at {k}: y = {} tenths of a mm", track.object, y[k]);
            assert!(
                close(yaw[k], 1e-3, sample.yaw_rad.expect("a yaw")),
                "{} at {k}: {} mrad",
                track.object,
                yaw[k]
            );
        }
        assert_eq!(drawn["doubtful"].as_array().map(Vec::len), Some(1), "the frame that is doubtful");
    }
}

#[test]
fn no_name_ends_the_data_of_a_player() {
    let hostile = "</script><script>alert(1)</script><!-- & \u{2028}]]>";
    let mut scene = scene();
    scene.objects[0].name = hostile.into();
    scene.placed[0].object = hostile.into();
    scene.placed.pop();
    let (tracks, predicted, strike) = (tracks(&scene, 0.1), predicted(&scene, 0.1), strike());
    let report = comparison(&scene, &predicted, &Observed::from_tracks(&tracks)).expect("a report");
    let filmed = filmed_strike(&scene, &strike, &tracks, &report);
    let page = html(&Page { filmed: &[filmed], ..Page::default() });
    assert_well_formed(&page);
    assert_eq!(page.matches("<script").count(), 2, "the data and the script of the page alone");
    assert_eq!(data(&page)[0]["bodies"][0]["name"], hostile);
}

#[test]
fn a_long_film_is_thinned_and_says_so() {
    let scene = scene();
    let mut tracks = tracks(&scene, 0.1);
    for track in &mut tracks.tracks {
        let last = *track.samples.last().expect("a sample");
        track.samples.extend((30..1000).map(|k| Sample { time_s: f64::from(k) / 60.0, ..last }));
    }
    let cell = Some(&scene.cell);
    let objects = objects();
    let motion = Some(ClipMotion { tracks: &tracks, fit: None, cell, strike: None });
    let page = html(&Page { objects: &objects, motion, ..Page::default() });
    assert!(page.contains("One of 3 frames is shown."), "1000 frames, of which at most 400 are shown");
    let data = &data(&page)[0];
    for track in data["motions"][0]["tracks"].as_array().expect("tracks") {
        let count = track["x"].as_array().map_or(0, Vec::len);
        assert!((300..=400).contains(&count), "{count} frames");
    }
}

/// The simulation of the strike, and a film of that motion (120 frames per second, two seconds) with the noise of a track.
fn filmed_simulation(scene: &Scene) -> (physics::Trajectory, Tracks) {
    let options = physics::Options::default();
    let trajectory = physics::trajectory(scene, &simulated_properties(), &strike(), &options);
    let trajectory = trajectory.expect("a simulation");
    let mut tracks = tracks(scene, 0.0);
    for track in &mut tracks.tracks {
        let name = track.object.clone();
        let sample = |k: u32| {
            let time_s = f64::from(k) / 120.0;
            let pose = trajectory.pose(&name, time_s).expect("a pose");
            let noise_m = 3e-5 * (f64::from((k * 7919) % 13) / 6.0 - 1.0);
            let position = pose.position + Vec2::new(noise_m, -noise_m);
            Sample::new(time_s, position, Some(pose.yaw_rad + noise_m / 0.02), 2e-5)
        };
        track.samples = (0..240).map(sample).collect();
    }
    (trajectory, tracks)
}

/// The page of a film beside its simulation, so many times.
fn page_of_films(scene: &Scene, trajectory: &physics::Trajectory, tracks: &Tracks, count: usize) -> String {
    let observed = Observed::from_tracks(tracks);
    let mut report = comparison(scene, &trajectory.final_poses, &observed).expect("a report");
    report.align(tracks, trajectory);
    assert!(report.alignment.is_some(), "film and simulation have a common time");
    let strike = strike();
    let filmed =
        FilmedStrike { trajectory: Some(trajectory), ..filmed_strike(scene, &strike, tracks, &report) };
    html(&Page { filmed: &vec![filmed; count], ..Page::default() })
}

#[test]
fn the_players_of_115_filmed_strikes_take_less_than_four_megabytes() {
    let scene = scene();
    let (trajectory, tracks) = filmed_simulation(&scene);
    let page = page_of_films(&scene, &trajectory, &tracks, 115);
    let players = || page.split("<div class=\"player\"").skip(1);
    assert_eq!(players().count(), 115);
    let bytes: usize = players().map(|player| player.find("</script>").expect("its data")).sum();
    let [players_mb, page_mb] = [bytes, page.len()].map(|bytes| bytes as f64 / 1e6);
    println!("the players of 115 filmed strikes of three objects: {players_mb:.2} MB of {page_mb:.2} MB");
    assert!(bytes < 4_000_000, "{bytes} bytes");
}

#[test]
fn the_report_names_the_object_that_leaves_its_simulated_motion() {
    let scene = scene();
    let (trajectory, mut tracks) = filmed_simulation(&scene);
    let page = page_of_films(&scene, &trajectory, &tracks, 1);
    assert!(page.contains("No object leaves its simulated motion."), "film and simulation are the same");
    for sample in &mut tracks.tracks[2].samples[200..] {
        sample.y_m += 0.005;
    }
    let page = page_of_films(&scene, &trajectory, &tracks, 1);
    assert_eq!(page.matches("leaves its simulated motion at").count(), 1, "one object leaves it");
    let at = page.find("<li>a#2 leaves its simulated motion at 1.66").map(|at| &page[at..at + 80]);
    assert!(at.is_some_and(|text| text.contains("(5.0 mm)")), "{at:?}: after frame 200 of 120 per second");
}

#[test]
fn every_chapter_is_optional() {
    assert_well_formed(&html(&Page::default()));
    let properties = Properties::default();
    assert_well_formed(&html(&Page { properties: Some(&properties), ..Page::default() }));
    let mut unreachable = plan(&scene());
    (unreachable.strike, unreachable.prediction, unreachable.iterations) = (None, None, Vec::new());
    unreachable.scene.placed.clear();
    assert_well_formed(&html(&Page { plan: Some(&unreachable), ..Page::default() }));
    let empty = Tracks::default();
    assert_well_formed(&html(&Page {
        motion: Some(ClipMotion { tracks: &empty, fit: None, cell: None, strike: None }),
        ..Page::default()
    }));
}

#[test]
fn the_same_results_give_the_same_bytes() {
    let plan = plan(&scene());
    let page = Page { plan: Some(&plan), ..Page::default() };
    assert_eq!(html(&page), html(&page));
}
