//! Tables of other trackers become the tracks that they hold; what is wrong in them is named by line and column.

use super::*;
use crate::columns::{AngleUnit, LengthUnit, ObjectColumns, TimeUnit};

fn workspace() -> Workspace {
    Workspace::centred([0.8, 0.6])
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn read(text: &str, columns: Option<&Columns>, objects: &[&str]) -> Result<Tracks> {
    let recording = Recording { name: "run.csv", text, columns, frame_rate_hz: None };
    recorded_tracks(&recording, &names(objects), &workspace())
}

/// The samples of the first object: time, position and yaw.
fn samples(tracks: &Tracks) -> Vec<[f64; 4]> {
    tracks.tracks[0].samples.iter().map(|s| [s.time_s, s.x_m, s.y_m, s.yaw_rad.unwrap_or(f64::NAN)]).collect()
}

/// Equal to within the last digits of a clock in nanoseconds.
fn assert_near(found: &[[f64; 4]], expected: &[[f64; 4]]) {
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
        assert!((found - expected).abs() < 3e-7, "{found}, not {expected}");
    }
}

/// A slide of half a metre a second that turns by more than a revolution, seen at 10 Hz.
const SLIDE: [[f64; 4]; 4] =
    [[0.0, 0.1, -0.02, 3.0], [0.1, 0.15, -0.02, 3.5], [0.2, 0.2, -0.02, 4.0], [0.3, 0.25, -0.02, 4.5]];

#[test]
fn the_columns_of_detect_are_read_without_a_word_on_them() {
    let rows = SLIDE.map(|[t, x, y, yaw]| format!("c,{t},0,0,,9\na,{t},{x},{y},{yaw},7\n"));
    let text = format!("object,time_s,x_m,y_m,yaw_rad,vx_m_s\n{}", rows.concat());
    let tracks = read(&text, None, &["a", "c"]).expect("tracks");
    assert_near(&samples(&tracks), &SLIDE);
    // Derivatives are those of the positions, not those of the file.
    let speed_m_s = tracks.tracks[0].samples[1].vx_m_s.expect("a velocity");
    assert!((speed_m_s - 0.5).abs() < 1e-9, "{speed_m_s} m/s");
    assert_eq!(tracks.tracks.iter().map(|t| t.object.as_str()).collect::<Vec<_>>(), ["a", "c"]);
    assert_eq!(tracks.tracks[1].samples[0].yaw_rad, None);
}

#[test]
fn a_row_for_each_instant_in_other_units_is_the_same_track() {
    let wide = ObjectColumns { x: "px".into(), y: "py".into(), yaw: Some("angle".into()) };
    let columns = Columns {
        time: Some("t".into()),
        time_unit: TimeUnit::Ns,
        length_unit: LengthUnit::Mm,
        angle_unit: AngleUnit::Deg,
        objects: [("a".to_owned(), wide)].into(),
        std_m: Some(1e-4),
        ..Columns::default()
    };
    // The clock of a computer, and angles from -180 to 180 degrees
    let rows = SLIDE.map(|[t, x, y, yaw]| {
        let angle = (yaw.to_degrees() + 180.0).rem_euclid(360.0) - 180.0;
        format!("{:.0};{angle};{};{}\n", 1.7e18 + t * 1e9, x * 1e3, y * 1e3)
    });
    let tracks = read(&format!("t;angle;px;py\n{}", rows.concat()), Some(&columns), &["a"]).expect("tracks");
    assert_near(&samples(&tracks), &SLIDE);
    assert_eq!(tracks.tracks[0].samples[0].std_m, 1e-4);
}

#[test]
fn without_a_time_the_rows_follow_each_other_at_the_rate_of_the_clip() {
    let columns = Columns { time: None, ..Columns::of_detect() };
    let text = "object,x_m,y_m,yaw_rad,std_m\na,0.1,-0.02,3.0,1e-5\na,0.15,-0.02,3.5,1e-5\na,,,,\na,0.25,-0.02,4.5,1e-5\na,0.3,-0.02,5,1e-5\n";
    let recording = Recording { name: "run.csv", text, columns: Some(&columns), frame_rate_hz: Some(10.0) };
    let tracks = recorded_tracks(&recording, &names(&["a"]), &workspace()).expect("tracks");
    assert_near(&samples(&tracks), &[SLIDE[0], SLIDE[1], SLIDE[3], [0.4, 0.3, -0.02, 5.0]]);
    assert!(tracks.warnings[0].contains("1 samples of `a` are missing"), "{:?}", tracks.warnings);
    let error = read(text, Some(&columns), &["a"]).expect_err("no rate");
    assert!(error.to_string().contains("frame_rate_hz"), "{error}");
}

#[test]
fn names_in_the_file_may_be_others() {
    let columns =
        Columns { names: [("a".to_owned(), "rigid body 1".to_owned())].into(), ..Columns::of_detect() };
    let columns = Columns { yaw: None, std: None, ..columns };
    let text = "object,time_s,x_m,y_m\n\"rigid body 1\",0,0.1,0.2\n";
    assert_eq!(samples(&read(text, Some(&columns), &["a"]).expect("tracks"))[0][..3], [0.0, 0.1, 0.2]);
}

#[test]
fn tracks_at_another_rate_have_the_times_of_that_rate() {
    let rows = SLIDE.map(|[t, x, y, yaw]| format!("a,{t},{x},{y},{yaw}\n"));
    let text = format!("object,time_s,x_m,y_m,yaw_rad\n{}", rows.concat());
    let recording = Recording { name: "run.csv", text: &text, columns: None, frame_rate_hz: Some(40.0) };
    let tracks = recorded_tracks(&recording, &names(&["a"]), &workspace()).expect("tracks");
    assert_eq!(tracks.tracks[0].samples[3].time_s, 3.0 / 40.0);
    let speed_m_s = tracks.tracks[0].samples[1].vx_m_s.expect("a velocity");
    assert!((speed_m_s - 2.0).abs() < 1e-9, "{speed_m_s} m/s");
}

#[test]
fn scatter_beyond_the_stated_noise_raises_it() {
    let noise_m = |k: usize| 1e-3 * ((k * k * 31 % 53) as f64 / 26.0 - 1.0);
    let rows = (0..100).map(|k| format!("a,{},{},0\n", 0.01 * k as f64, 0.005 * k as f64 - 0.2 + noise_m(k)));
    let text = format!("object,time_s,x_m,y_m\n{}", rows.collect::<String>());
    let std_m = read(&text, None, &["a"]).expect("tracks").tracks[0].samples[0].std_m;
    assert!((2e-4..1e-3).contains(&std_m), "{std_m} m, drawn with 0.6 mm along x and none along y");
}

#[test]
fn strikes_and_stops_between_few_samples_are_no_noise() {
    // Struck at 0.31 s, a stop 0.2 s later, at 30 samples per second
    let x_m = |t: f64| 0.8 * (t - 0.31).clamp(0.0, 0.2) - 2.0 * (t - 0.31).clamp(0.0, 0.2).powi(2);
    let noise_m = |k: usize| 2e-5 * (if k.is_multiple_of(2) { 1.0 } else { -1.0 });
    let row = |k: usize| {
        format!("a,{},{},{},2e-5\n", k as f64 / 30.0, x_m(k as f64 / 30.0) + noise_m(k), noise_m(k / 2))
    };
    let text = format!("object,time_s,x_m,y_m,std_m\n{}", (0..30).map(row).collect::<String>());
    let std_m = read(&text, None, &["a"]).expect("tracks").tracks[0].samples[0].std_m;
    assert!((1.9e-5..6e-5).contains(&std_m), "{std_m} m, given 0.02 mm");
}

#[test]
fn every_error_names_the_file_and_where_it_is() {
    let head = "object,time_s,x_m,y_m\n";
    for (text, words) in [
        ("", vec!["run.csv", "column names"]),
        ("object,time_s,x_m\na,0,0\n", vec!["run.csv", "line 1", "`y_m`", "`x_m`"]),
        ("a,0,1,2\na,1,1,1\n", vec!["run.csv", "line 1", "`time_s`"]),
        (
            &format!("{head}a,0,0,0\na,1,zero,0\n"),
            vec!["run.csv", "line 3, column 3 (`x_m`)", "`zero`", "a number"],
        ),
        (&format!("{head}a,0,0,inf\n"), vec!["line 2, column 4 (`y_m`)", "`inf`"]),
        (&format!("{head}a,0,0,0\na,0,0,0\n"), vec!["line 3, column 2 (`time_s`)", "times that grow"]),
        (&format!("{head}a,,0,0\n"), vec!["line 2, column 2 (`time_s`)"]),
        (&format!("{head}# from here on\n\na,0,0\n"), vec!["line 4", "3 fields", "4"]),
        (&format!("{head}\"a,0,0,0\n"), vec!["line 2, column 1", "quotation"]),
        (&format!("{head}c,0,0,0\n"), vec!["`a`", "others are `c`"]),
        (&format!("{head}a,0,1e9,0\n"), vec!["line 2, column 3 (`x_m`)", "length_unit"]),
        (&format!("{head}a,0,0,0\na,1,50,0\na,2,100,0\n"), vec!["run.csv", "100 m wide", "length_unit"]),
        ("object,time_s,x_m,y_m,x_m\n", vec!["line 1", "`x_m` is given twice"]),
        ("{\"tracks\": [", vec!["run.csv", "line 1 column"]),
        (
            "{\"version\":1,\"video\":\"\",\"reprojection_rms_px\":0,\"tracks\":[]}",
            vec!["run.csv", "no position of `a`"],
        ),
        (
            r#"{"version":1,"video":"","reprojection_rms_px":0,"tracks":[{"object":"a","samples":[{"time_s":0,"x_m":0,"y_m":0,"yaw_rad":null,
                "vx_m_s":null,"vy_m_s":null,"yaw_rate_rad_s":null,"ax_m_s2":null,"ay_m_s2":null,"std_m":1e-5,"pose_std_m":1e-4}]}]}"#,
            vec!["run.csv", "`a`, sample 1", "pose_std_m is 0.0001", "std_m"],
        ),
    ] {
        let error = read(text, None, &["a"]).expect_err(text).to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` is not in: {error}");
        }
    }
}
