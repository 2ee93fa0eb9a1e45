//! Adding clips to an estimate gives the estimate of all clips at once.

use crate::cell::{CameraSpec, Cell, Striker, Workspace};
use crate::estimate::{ClipTracks, Experiment, Options, Setup, SimulatedCamera, estimation, updated};
use crate::object::{Marker, Object, Shape, pair_key};
use crate::properties::Properties;
use crate::uncertain::Estimate;

pub(crate) fn object(name: &str, shape: Shape) -> Object {
    // The rotation of a disc is invisible; a bar on a block shows its yaw.
    let marker = match shape {
        Shape::Disc { .. } => Shape::Disc { radius_m: 0.01 },
        _ => Shape::Rectangle { size_m: [0.018, 0.009] },
    };
    let marker = Some(Marker::centred(marker));
    Object { name: name.into(), shape, height_m: 0.04, marker, mass_kg: None, support: None }
}

pub(crate) fn objects() -> Vec<Object> {
    vec![
        object("a", Shape::Disc { radius_m: 0.035 }),
        object("b", Shape::Disc { radius_m: 0.03 }),
        object("c", Shape::Rectangle { size_m: [0.04, 0.05] }),
    ]
}

pub(crate) fn cell() -> Cell {
    let striker = Striker { retract_speed_m_s: 0.1, ..Striker::rod(0.015, [0.1, 0.8]) };
    let camera = CameraSpec { exposure_s: Some(1e-4), ..CameraSpec::default() };
    Cell { camera, ..Cell::from_above(1000.0, Workspace::centred([1.2, 0.8]), striker) }
}

/// The true properties of a clip: friction and restitution vary by up to 2 % from clip to clip.
pub(crate) fn truth(clip: usize) -> Properties {
    let vary = |k: usize| 1.0 + 0.02 * ((clip * 7 + k * 3) as f64).sin();
    let mut properties = Properties { version: 1, reference: "a".into(), ..Properties::default() };
    for (k, (name, mass)) in [("a", 1.0), ("b", 0.6), ("c", 0.8)].into_iter().enumerate() {
        let value = |v: f64| Estimate::exact(v);
        properties.friction.insert(name.into(), value((0.2 + 0.04 * k as f64) * vary(k)));
        properties.striker_restitution.insert(name.into(), value(0.6 * vary(k + 5)));
        properties.mass_ratio.insert(name.into(), value(mass));
        for other in ["a", "b", "c"] {
            properties.restitution.insert(pair_key(name, other), value(0.5 * vary(9)));
        }
    }
    properties
}

fn clip(number: usize, strike: &str, into: Option<&str>) -> ClipTracks {
    let camera = SimulatedCamera {
        frame_rate_hz: 60.0,
        position_std_m: 5e-5,
        yaw_std_rad: 0.004,
        seed: Some(number as u64),
    };
    let experiment =
        Experiment { strike: strike.into(), into: into.map(Into::into), speed_m_s: 0.45, offset_m: 0.0 };
    experiment
        .simulated_clip(
            &format!("{number}.mp4"),
            Setup { cell: &cell(), objects: &objects() },
            &truth(number),
            &camera,
        )
        .expect("a clip")
}

fn clips(numbers: std::ops::Range<usize>) -> Vec<ClipTracks> {
    let cases = [("a", Some("b")), ("a", None), ("b", Some("c")), ("c", None), ("a", Some("c")), ("b", None)];
    numbers.map(|n| clip(n, cases[n % cases.len()].0, cases[n % cases.len()].1)).collect()
}

pub(crate) fn estimated(clips: &[ClipTracks]) -> Properties {
    estimation(clips, &cell(), &objects(), &Options::default()).expect("an estimation").properties
}

/// All means with their standard errors.
fn all(properties: &Properties) -> Vec<(String, f64, f64)> {
    let groups = [
        &properties.friction,
        &properties.striker_restitution,
        &properties.restitution,
        &properties.mass_ratio,
        &properties.pair_mass_ratio,
        &properties.support,
    ];
    let entries = groups.into_iter().flatten();
    let slope = properties.tilt.iter().flat_map(|tilt| [("slope x", tilt.x), ("slope y", tilt.y)]);
    let slope = slope.map(|(name, e)| (name.to_owned(), e.mean, e.standard_error));
    entries.map(|(name, e)| (name.clone(), e.mean, e.standard_error)).chain(slope).collect()
}

#[test]
fn an_update_equals_the_joint_estimate() {
    /// Largest difference of means over their standard error, and relative difference of standard errors.  It comes from
    /// the noise level, which the old clips estimated without the new ones.
    const TOLERANCE: f64 = 0.05;
    let first = estimated(&clips(0..18));
    // Through the file and back.
    let text = serde_json::to_string(&first).expect("JSON");
    let first: Properties = serde_json::from_str(&text).expect("properties");
    let options = Options::default();
    let both = updated(&first, &clips(18..30), &cell(), &objects(), &options).expect("an update").properties;
    let joint = estimated(&clips(0..30));
    let (both_all, joint_all) = (all(&both), all(&joint));
    assert_eq!(both_all.len(), joint_all.len());
    for ((name, mean, error), (_, expected, expected_error)) in both_all.into_iter().zip(joint_all) {
        let off = (mean - expected).abs();
        assert!(off <= TOLERANCE * expected_error, "{name}: {mean}, jointly {expected} +- {expected_error}");
        assert!(
            (error - expected_error).abs() <= TOLERANCE * expected_error,
            "{name}: {error} {expected_error}"
        );
    }
    assert_eq!(both.warnings, joint.warnings);
    let names = |p: &Properties| {
        p.evidence.as_ref().expect("evidence").clips.iter().map(|c| c.clip.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&both), names(&joint));
}

#[test]
fn two_updates_equal_one_update_with_all_clips() {
    let options = Options::default();
    let update = |old: &Properties, numbers| {
        updated(old, &clips(numbers), &cell(), &objects(), &options).expect("an update").properties
    };
    let first = estimated(&clips(0..12));
    let (once, twice) = (update(&first, 12..18), update(&update(&first, 12..15), 15..18));
    for ((name, mean, error), (_, expected, _)) in all(&twice).into_iter().zip(all(&once)) {
        assert!((mean - expected).abs() <= 0.05 * error, "{name}: {mean}, at once {expected} +- {error}");
    }
}

fn refusal(clips: &[ClipTracks], cell: &Cell, objects: &[Object], options: &Options) -> String {
    let old = estimated(&self::clips(0..3));
    updated(&old, clips, cell, objects, options).expect_err("a refusal").to_string()
}

#[test]
fn a_difference_from_the_old_clips_is_reported() {
    let (new, options) = (clips(3..4), Options::default());
    let mut taller = objects();
    taller[1].height_m = 40.0;
    let message = refusal(&new, &cell(), &taller, &options);
    assert!(message.contains("`b`") && message.contains("height_m") && message.contains("40"), "{message}");

    let mut wider = cell();
    wider.striker.shape = Shape::Disc { radius_m: 0.02 };
    let message = refusal(&new, &wider, &objects(), &options);
    assert!(message.contains("striker") && message.contains("0.02"), "{message}");

    let message = refusal(&new, &cell(), &objects(), &Options { reference: Some("b".into()) });
    assert!(message.contains("reference") && message.contains("`b`") && message.contains("`a`"), "{message}");

    let mut stranger = new.clone();
    stranger[0].tracks.tracks[0].object = "zebra".into();
    let message = refusal(&stranger, &cell(), &objects(), &options);
    assert!(message.contains("zebra"), "{message}");
}

#[test]
fn a_repeated_clip_is_detected_by_name_and_by_content() {
    let options = Options::default();
    let message = refusal(&clips(2..4), &cell(), &objects(), &options);
    assert!(message.contains("2.mp4"), "{message}");
    let mut renamed = clips(2..3);
    renamed[0].name = "new.mp4".into();
    let message = refusal(&renamed, &cell(), &objects(), &options);
    assert!(message.contains("new.mp4") && message.contains("2.mp4"), "{message}");
    let mut other = clips(5..6);
    other[0].name = "0.mp4".into();
    let message = refusal(&other, &cell(), &objects(), &options);
    assert!(message.contains("0.mp4") && message.contains("name"), "{message}");
}

#[test]
fn damaged_evidence_is_an_error_without_a_panic() {
    let whole = estimated(&clips(0..3));
    let options = Options::default();
    let damaged = [
        ("values", serde_json::json!([1.0])),
        ("covariance", serde_json::json!([[1.0], [2.0, 3.0]])),
        ("keys", serde_json::json!(["weight/a"])),
    ];
    for (key, value) in damaged {
        let mut old = whole.clone();
        old.evidence.as_mut().expect("evidence").clips[1].measurements["readings"][key] = value;
        let message =
            updated(&old, &clips(3..4), &cell(), &objects(), &options).expect_err("a refusal").to_string();
        assert!(message.contains("1.mp4"), "{key}: {message}");
    }
    let mut old = whole.clone();
    let readings = &mut old.evidence.as_mut().expect("evidence").clips[1].measurements["readings"];
    readings["covariance"][0][0] = serde_json::json!(-1.0);
    let message =
        updated(&old, &clips(3..4), &cell(), &objects(), &options).expect_err("a refusal").to_string();
    assert!(message.contains("1.mp4") && message.contains("variance of `0: friction/"), "{message}");
    let without = Properties { evidence: None, ..whole };
    let message =
        updated(&without, &clips(3..4), &cell(), &objects(), &options).expect_err("a refusal").to_string();
    assert!(message.contains("evidence"), "{message}");
}
