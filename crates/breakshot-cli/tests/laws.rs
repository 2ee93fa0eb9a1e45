//! The flags of `simulate` that choose a physical law, and `support` in `objects.toml`, against closed forms.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use breakshot::properties::{ContactFriction, Properties};
use breakshot::uncertain::Estimate;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const G_M_S2: f64 = 9.81;
const FRICTION: f64 = 0.3;
const RESTITUTION: f64 = 0.6;
const STRIKE_M_S: f64 = 0.6;

/// Writes a cell, one disc of 50 mm radius at the origin with these further keys, its properties and a strike.
fn write_inputs(folder: &Path, keys: &str, offset_m: f64, contact_friction: f64) {
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write(
        "cell.toml",
        "scale_px_per_m = 1000.0\n\
         [camera]\nimage_size_px = [640, 480]\n\
         [workspace]\nmin_m = [-1.0, -1.0]\nmax_m = [1.0, 1.0]\n\
         [striker]\nshape = { disc = { radius_m = 0.015 } }\nheight_m = 0.1\nspeed_range_m_s = [0.1, 1.0]\n",
    );
    write(
        "objects.toml",
        &format!(
            "[[objects]]\nname = \"a\"\nheight_m = 0.03\nmass_kg = 0.1\nshape = {{ disc = {{ radius_m = 0.05 }} }}\n{keys}\n"
        ),
    );
    write(
        "scene.toml",
        "cell = \"cell.toml\"\nobjects = \"objects.toml\"\n[[placed]]\nobject = \"a\"\nposition_m = [0.0, 0.0]\n",
    );
    write(
        "strike.json",
        &format!(
            "{{\"start_m\": [-0.2, {offset_m}], \"heading_rad\": 0.0, \"speed_m_s\": {STRIKE_M_S}, \"travel_m\": 0.14}}"
        ),
    );
    let friction = Some(Estimate::exact(contact_friction));
    let contact_friction = ContactFriction { objects: friction, striker: friction };
    let mut properties =
        Properties { version: 1, reference: "a".into(), contact_friction, ..Properties::default() };
    properties.friction.insert("a".into(), Estimate::exact(FRICTION));
    properties.mass_ratio.insert("a".into(), Estimate::exact(1.0));
    properties.striker_restitution.insert("a".into(), Estimate::exact(RESTITUTION));
    breakshot::files::write_json(&folder.join("properties.json"), &properties).unwrap();
}

fn simulate(folder: &Path, flags: &[&str]) -> Output {
    let inputs = ["simulate", "scene.toml", "--properties", "properties.json", "--strike", "strike.json"];
    Command::new(env!("CARGO_BIN_EXE_breakshot"))
        .current_dir(folder)
        .args(inputs)
        .args(["-o", "trajectory.json"])
        .args(flags)
        .output()
        .unwrap()
}

/// Final x (m), y (m) and yaw (rad) of the disc.
fn final_pose(folder: &Path, flags: &[&str]) -> [f64; 3] {
    let output = simulate(folder, flags);
    assert!(output.status.success(), "{flags:?}: {}", String::from_utf8_lossy(&output.stderr));
    let text = fs::read_to_string(folder.join("trajectory.json")).unwrap();
    let trajectory: serde_json::Value = serde_json::from_str(&text).unwrap();
    let pose = trajectory["final"]["a"].clone();
    serde_json::from_value(pose).unwrap()
}

/// The distance of a slide that begins with the launch speed of a restitution (m).
fn distance_m(restitution: f64, strike_m_s: f64) -> f64 {
    ((1.0 + restitution) * strike_m_s).powi(2) / (2.0 * FRICTION * G_M_S2)
}

#[test]
fn restitution_depends_on_the_impact_speed_as_the_flags_say() {
    let folder = tempfile::tempdir().unwrap();
    write_inputs(folder.path(), "", 0.0, 0.0);
    // Twice the speed at which the restitution was measured.
    let measured_at = ["--reference-speed-m-s", "0.3"];
    let cases: [(&[&str], f64); 3] = [
        (&[], RESTITUTION),
        (&["--restitution-law", "power", "--restitution-exponent", "0.25"], RESTITUTION * 2f64.powf(-0.25)),
        (&["--restitution-law", "viscoelastic"], 1.0 - (1.0 - RESTITUTION) * 2f64.powf(0.2)),
    ];
    for (law, restitution) in cases {
        let flags = [law, &measured_at].concat();
        let x_m = final_pose(folder.path(), &flags)[0];
        let expected_m = distance_m(restitution, STRIKE_M_S);
        assert!((x_m - expected_m).abs() < 1e-7, "{law:?}: {x_m} m, not {expected_m} m");
    }
    let output = simulate(folder.path(), &["--restitution-law", "power"]);
    assert_eq!(output.status.code(), Some(2), "a law without its reference speed");
}

#[test]
fn a_striker_of_finite_mass_transfers_less_momentum() {
    let folder = tempfile::tempdir().unwrap();
    write_inputs(folder.path(), "", 0.0, 0.0);
    let x_m = final_pose(folder.path(), &["--striker-mass-kg", "0.3"])[0];
    // 0.3 kg against 0.1 kg: three quarters of the launch speed.
    let expected_m = distance_m(RESTITUTION, STRIKE_M_S) * 0.75f64.powi(2);
    assert!((x_m - expected_m).abs() < 1e-7, "{x_m} m, not {expected_m} m");
}

#[test]
fn friction_across_the_grain_shortens_a_slide_across_it() {
    let folder = tempfile::tempdir().unwrap();
    write_inputs(folder.path(), "", 0.0, 0.0);
    let across = ["--friction-across-grain", "2.0", "--grain-rad", "1.5707963267948966"];
    let x_m = final_pose(folder.path(), &across)[0];
    let expected_m = distance_m(RESTITUTION, STRIKE_M_S) / 2.0;
    assert!((x_m - expected_m).abs() < 1e-4 * expected_m + 1e-5, "{x_m} m, not {expected_m} m");
}

#[test]
fn feet_on_the_rim_slow_a_rotation_down_more_than_a_uniform_support() {
    let folder = tempfile::tempdir().unwrap();
    let yaw_rad = |keys: &str| {
        write_inputs(folder.path(), keys, 0.02, 0.4);
        final_pose(folder.path(), &[])[2].abs()
    };
    let feet = "support = { feet_m = [[0.05, 0.0], [-0.025, 0.0433], [-0.025, -0.0433]] }";
    let (uniform, on_feet) = (yaw_rad(""), yaw_rad(feet));
    assert!(on_feet < 0.9 * uniform, "{on_feet} rad on feet, {uniform} rad on the whole disc");

    write_inputs(folder.path(), "support = { feet_m = [[0.05, 0.0], [-0.025, 0.0433]] }", 0.0, 0.0);
    let output = simulate(folder.path(), &[]);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("object `a`") && message.contains("2 feet"), "{message}");
}
