//! What `breakshot check` finds in a campaign before anything is estimated.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{assert_refused, breakshot, demo};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Films of the example, four of one object and two of a pair.
const FILMS: [&str; 6] = [
    "single_a_3.mp4",
    "single_a_5.mp4",
    "single_c_3.mp4",
    "single_c_5.mp4",
    "pair_a_c_1.mp4",
    "pair_a_c_3.mp4",
];

/// A folder with the films and their campaign, of which `change` gets each clip with its film's name.
fn folder(change: impl Fn(&str, String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml"].iter().chain(&FILMS) {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    let text = fs::read_to_string(demo("campaign.toml")).unwrap();
    let mut campaign = "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n".to_owned();
    for clip in text.split("[[clips]]").skip(1) {
        if let Some(film) = FILMS.iter().find(|film| clip.contains(*film)) {
            writeln!(campaign, "[[clips]]{}", change(film, clip.to_owned())).unwrap();
        }
    }
    fs::write(folder.path().join("campaign.toml"), campaign).unwrap();
    folder
}

/// The warnings, and the page.
fn checked(folder: &Path) -> (Vec<String>, String) {
    let output = breakshot(folder, &["check", "campaign.toml", "-o", "check.html", "--json"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{said}");
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let warnings: Vec<String> = serde_json::from_value(printed["warnings"].clone()).unwrap();
    assert_eq!(output.status.code() == Some(3), !warnings.is_empty());
    (warnings, fs::read_to_string(folder.join("check.html")).unwrap())
}

/// The warnings that compare the striker in the films with the given strikes.
fn of_seen_strikers(warnings: &[String]) -> Vec<&String> {
    let lines = ["the striker is seen", "the striker moves", "the striker starts", "the striker takes"];
    warnings.iter().filter(|warning| lines.iter().any(|line| warning.contains(line))).collect()
}

/// The clip with the number of this key changed.
fn changed(clip: &str, key: &str, change: impl Fn(f64) -> f64) -> String {
    let (before, rest) = clip.split_once(&format!("{key} = ")).unwrap();
    let end = rest.find([',', ' ', '}']).unwrap();
    let value: f64 = rest[..end].parse().unwrap();
    format!("{before}{key} = {}{}", change(value), &rest[end..])
}

#[test]
fn the_page_shows_every_film_of_a_right_campaign() {
    let folder = folder(|_, clip| clip);
    let (warnings, page) = checked(folder.path());
    let of_a_clip: Vec<&String> = warnings.iter().filter(|warning| warning.contains(".mp4")).collect();
    assert!(of_a_clip.is_empty(), "{of_a_clip:?}");
    for film in FILMS {
        assert!(page.contains(&format!("<h3>{film}</h3>")), "{film} is not on the page");
    }
    assert_eq!(page.matches("data:image/png;base64,").count(), FILMS.len());
    assert_eq!(of_seen_strikers(&warnings), Vec::<&String>::new());
    assert_eq!(page.matches("class=\"seen\"").count(), 3 * FILMS.len(), "the striker that is seen is drawn");
    assert!(!page.contains("<script") && !page.contains("http://127"), "the page is complete in itself");
}

#[test]
fn a_wrong_speed_and_a_wrong_heading_are_named_with_their_clips() {
    let folder = folder(|film, clip| match film {
        "single_a_5.mp4" => changed(&clip, "speed_m_s", |speed| 1.2 * speed),
        "single_c_3.mp4" => changed(&clip, "heading_rad", |heading| heading + 0.3),
        _ => clip,
    });
    let (warnings, page) = checked(folder.path());
    let named = |film: &str, key: &str| warnings.iter().any(|w| w.starts_with(film) && w.contains(key));
    assert!(
        named("single_a_5.mp4: ", "strike.speed_m_s") || named("single_a_5.mp4: ", "restitution"),
        "{warnings:?}"
    );
    assert!(named("single_c_3.mp4: ", "heading_rad"), "{warnings:?}");
    assert!(page.contains("strike.heading_rad"), "the page says what does not fit");
}

#[test]
fn a_speed_that_is_wrong_in_all_clips_is_named_once() {
    let folder = folder(|_, clip| changed(&clip, "speed_m_s", |speed| 1.1 * speed));
    let (warnings, _) = checked(folder.path());
    let lines = of_seen_strikers(&warnings);
    assert!(lines.len() == 1, "{warnings:?}");
    assert!(lines[0].contains("in 6 clips") && lines[0].contains("0.91 times as fast"), "{lines:?}");
    assert!(lines[0].contains("probably strike.speed_m_s is 10 % too high"), "{lines:?}");
}

#[test]
fn films_said_to_have_another_frame_rate_are_named_once() {
    let folder = folder(|_, clip| format!("{clip}\nframe_rate_hz = 50.0\n"));
    let (warnings, _) = checked(folder.path());
    let lines: Vec<&String> = warnings.iter().filter(|warning| warning.contains("frame_rate_hz")).collect();
    assert!(lines.len() == 1, "{warnings:?}");
    let likely = "probably the films were taken at 60 frames/s where their files say 50";
    assert!(lines[0].contains(likely), "{lines:?}");
}

#[test]
fn a_film_without_its_objects_is_shown_with_the_reason() {
    let folder = folder(|film, clip| match film {
        "single_a_3.mp4" => clip.replace("objects = [\"a\"]", "objects = [\"a\", \"c\"]"),
        _ => clip,
    });
    let (warnings, page) = checked(folder.path());
    let reason = warnings.iter().find(|warning| warning.starts_with("single_a_3.mp4: "));
    assert!(reason.is_some_and(|reason| reason.contains("markers")), "{warnings:?}");
    assert_eq!(page.matches("data:image/png;base64,").count(), FILMS.len(), "its first frame is shown too");
}

#[test]
fn a_missing_film_is_an_error_and_nothing_is_written() {
    let folder = folder(|_, clip| clip);
    fs::remove_file(folder.path().join(FILMS[0])).unwrap();
    assert_refused(folder.path(), &["check", "campaign.toml", "-o", "check.html"], &[FILMS[0]]);
    assert!(!folder.path().join("check.html").exists());
}
