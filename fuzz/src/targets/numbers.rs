//! Learned properties and tracks that something else measured.

use super::{JSON, edited, fixture, fixture_text, outcome};
use crate::{Outcome, Scratch, Target};
use breakshot::cell::Workspace;
use breakshot::columns::{AngleUnit, Columns, LengthUnit, ObjectColumns, TimeUnit};
use breakshot::detect::{Recording, Track, Tracks, recorded_tracks};
use breakshot::estimate::{self, ClipTracks};
use breakshot::properties::Properties;
use breakshot::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};
use breakshot::{files, physics, report};
use std::fmt::Write;
use std::sync::OnceLock;

/// `properties.json`: a whole file, or changes of one that holds the measurements of its clips.
pub const PROPERTIES: Target = Target {
    longest_s: 10.0,
    most_memory_mb: 200.0,
    ..Target::of_text(
        "properties",
        "properties.json with its evidence: a pile is simulated, and a clip is added",
        |bytes| {
            let text = String::from_utf8_lossy(bytes);
            let is_changes = text.starts_with('/');
            let written =
                if is_changes { edited(drawn()?.1.clone(), &text).to_string() } else { text.into_owned() };
            let path = Scratch::folder().write("properties.json", written.as_bytes());
            let properties = files::load_properties(path);
            if let Ok(properties) = &properties {
                used(properties, is_changes)?;
            }
            outcome(properties, &["properties.json"])
        },
        || {
            let changes = "/friction/a/mean 0.3\n/evidence/clips/0/measurements/name \"other\"\n/mass_ratio/b/std 0.01\n";
            vec![fixture("crates/breakshot-studio/tests/server/properties.json"), changes.into()]
        },
        &[JSON, PROPERTIES_KEYS],
    )
};

const PROPERTIES_KEYS: &[&str] = &[
    "[]",
    "{}",
    "/friction",
    "/mass_ratio",
    "/restitution",
    "/covariance",
    "/evidence",
    "/clips",
    "/0",
    "/1",
    "/measurements",
    "/a",
    "/b",
    "/mean",
    "/std",
    "/standard_error",
    "/interval_95",
    "/n",
    "\n/",
    "/values",
    "/keys",
    "/noise",
    "/chi2_by_exposure",
    "/striker_restitution",
    "/contact_friction",
    "/tangential_restitution",
    "/tangential_damping",
    "/probability",
    "/exponent",
    "/filmed_with",
    "/objects",
    "/shape",
];

/// Tables and JSON files of tracks; the first byte is that of the description of the columns.
pub const TRACKS: Target = Target {
    name: "tracks",
    what: "tables (CSV) and JSON of tracks, with several descriptions of their columns; their figure",
    read: |bytes| {
        let (which, bytes) = bytes.split_first().unwrap_or((&b'0', &[]));
        let readable = &descriptions()[usize::from(*which) % DESCRIPTIONS];
        tracks(&String::from_utf8_lossy(bytes), readable)
    },
    seeds: || {
        let described = descriptions().into_iter().enumerate();
        described
            .map(|(k, readable)| [b"0123456789"[k..=k].to_vec(), readable.text.into_bytes()].concat())
            .collect()
    },
    pieces: &[&[
        ",", ";", "\n", "\"", "\"\"", "-", "1e308", "nan", "1e-320", "a", "#", "\r\n", "inf", "0", "{", "\t",
        "time_s", "x_m",
    ]],
    longest_s: 2.0,
    ..Target::of_text("", "", |_| Ok(Outcome::Read), Vec::new, &[])
};

/// The properties of the demo.
pub(super) fn demo_properties() -> Result<&'static Properties, String> {
    static PROPERTIES: OnceLock<Result<Properties, String>> = OnceLock::new();
    let read = || {
        serde_json::from_str(&fixture_text("crates/breakshot-studio/tests/server/properties.json"))
            .map_err(|e| e.to_string())
    };
    PROPERTIES.get_or_init(read).as_ref().map_err(Clone::clone)
}

/// A drawn campaign of two objects, and the properties that are estimated from all of its clips but one.
fn drawn() -> Result<&'static (SyntheticCampaign, serde_json::Value), String> {
    static DRAWN: OnceLock<Result<(SyntheticCampaign, serde_json::Value), String>> = OnceLock::new();
    let draw = || {
        let drawn = campaign(&CampaignSpec { objects: 2, ..CampaignSpec::default() }, 1);
        let clips = &drawn.clips[1..drawn.clips.len().min(5)];
        let found = estimate::estimation(clips, &drawn.cell, &drawn.objects, &estimate::Options::default());
        let value =
            serde_json::to_value(found.map_err(|e| e.to_string())?.properties).map_err(|e| e.to_string())?;
        Ok((drawn, value))
    };
    DRAWN.get_or_init(draw).as_ref().map_err(Clone::clone)
}

/// Simulates the demo's pile with these properties, and adds a clip to their evidence; both may be refused.
fn used(properties: &Properties, has_evidence: bool) -> Result<(), String> {
    let scene =
        files::load_scene(super::repository("fixtures/demo/pile.scene.toml")).map_err(|e| e.to_string())?;
    let strike =
        files::load_strike(super::repository("fixtures/demo/pile.strike.json")).map_err(|e| e.to_string())?;
    let options = physics::Options::default();
    drop(physics::trajectory(&scene.value, properties, &strike, &options));
    drop(physics::mjcf(&scene.value, properties, &strike, &options));
    if !has_evidence {
        return Ok(());
    }
    let (drawn, _) = drawn()?;
    let clips: &[ClipTracks] = &drawn.clips[..1];
    let options = estimate::Options::default();
    if let Ok(updated) = estimate::updated(properties, clips, &drawn.cell, &drawn.objects, &options) {
        let text = serde_json::to_string(&updated.properties).map_err(|e| e.to_string())?;
        let again = files::json_of::<Properties>("updated.json".as_ref(), &text);
        let checked = again.and_then(|again| again.check("updated.json"));
        return checked.map_err(|e| format!("what was estimated cannot be read again: {e}"));
    }
    Ok(())
}

/// A readable file, and what its columns hold.
struct Readable {
    text: String,
    columns: Option<Columns>,
    frame_rate_hz: Option<f64>,
}

const DESCRIPTIONS: usize = 6;

/// Reads a file of tracks; errors must name it.
fn tracks(text: &str, readable: &Readable) -> Result<Outcome, String> {
    let Readable { columns, frame_rate_hz, .. } = readable;
    let recording =
        Recording { name: "run.csv", text, columns: columns.as_ref(), frame_rate_hz: *frame_rate_hz };
    let names = ["a".to_owned(), "a#2".to_owned()];
    let read = recorded_tracks(&recording, &names, &Workspace::centred([1.0, 1.0]));
    if let Ok(tracks) = &read {
        if !tracks.tracks.iter().all(is_sound) {
            return Err("tracks with numbers that are none, or times that do not grow".into());
        }
        // Tracks without a common time have no figure.
        drop(report::motion_figure(tracks));
    }
    outcome(read, &["run.csv"])
}

fn is_sound(track: &Track) -> bool {
    let numbers = track.samples.iter().all(|s| {
        [s.time_s, s.x_m, s.y_m, s.yaw_rad.unwrap_or(0.0)].iter().all(|n| n.is_finite()) && s.std_m > 0.0
    });
    numbers
        && !track.samples.is_empty()
        && track.samples.windows(2).all(|pair| pair[0].time_s < pair[1].time_s)
}

/// Positions of two objects that slide, every tenth of a second.
fn descriptions() -> [Readable; DESCRIPTIONS] {
    let (mut long, mut wide) =
        (String::from("object,time_s,x_m,y_m,yaw_rad,std_m\n"), String::from("t;\"x, one\";y1;w;x2;y2\n"));
    for k in 0..8_u32 {
        let t = 0.1 * f64::from(k);
        let (x, y) = (0.3 * t, 0.1 * t);
        let _ = writeln!(long, "a,{t:.2},{x:.4},0.1,{:.2},1e-5\na#2,{t:.2},0.2,{y:.4},,2e-5", 2.0 * t);
        let ms = 1_700_000_000_000_u64 + 100 * u64::from(k);
        let _ = writeln!(wide, "{ms};{};100;{};{};5,5", 30.0 * t, 40.0 * t, 7.0 * t);
    }
    let name = |name: &str| Some(name.to_owned());
    let own = |x: &str, y: &str, yaw| ObjectColumns { x: x.into(), y: y.into(), yaw };
    let columns = Columns {
        time: name("t"),
        time_unit: TimeUnit::Ms,
        length_unit: LengthUnit::Mm,
        angle_unit: AngleUnit::Deg,
        objects: [("a".into(), own("x, one", "y1", name("w"))), ("a#2".into(), own("x2", "y2", None))].into(),
        ..Columns::default()
    };
    let untimed = Columns { time: None, ..columns.clone() };
    let recording = Recording { name: "run.csv", text: &long, columns: None, frame_rate_hz: None };
    let names = ["a".to_owned(), "a#2".to_owned()];
    let tracks: Tracks =
        recorded_tracks(&recording, &names, &Workspace::centred([1.0, 1.0])).unwrap_or_default();
    let json = serde_json::to_string(&tracks).unwrap_or_default();
    let readable =
        |text: &str, columns, frame_rate_hz| Readable { text: text.into(), columns, frame_rate_hz };
    [
        readable(&long, None, None),
        readable(&long, None, Some(240.0)),
        readable(&wide, Some(columns), None),
        readable(&wide, Some(untimed), Some(500.0)),
        readable(&json, None, None),
        readable(&json, None, Some(1e-3)),
    ]
}
