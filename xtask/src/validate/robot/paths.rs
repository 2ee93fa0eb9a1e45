//! Strike paths for the plans of the filmed piles, and the same strikes driven by torques alone in MuJoCo.

use super::{indy7, lines, temporary};
use crate::bench::physics::mujoco;
use crate::example::target;
use crate::validate::row::{self, Row};
use breakshot::files;
use breakshot::geometry::Vec2;
use breakshot::plan::{self, Method};
use breakshot::robot::{self, Answer, Command, PhaseName};
use breakshot::scene::Scene;
use serde::Deserialize;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

const PILES: [&str; 5] = ["two_discs", "three_discs", "three_shapes", "four_discs", "four_shapes"];
/// MuJoCo's step (s): halving it changes speeds by less than a millionth.
const STEP_S: f64 = 0.000_25;

/// Plans by both methods for every pile, the arm's path for each, and the path's torques in MuJoCo.
pub(super) fn run(folder: &Path) -> Result<bool, String> {
    let path = target().join("validate/properties.json");
    let properties = files::load_properties(&path)
        .map_err(|e| format!("{e}; `cargo xtask validate LAB` learns them from the films"))?;
    let python = mujoco(None)?;
    let mut rows = Vec::new();
    let (mut paths, mut refusals) = (0, 0);
    for pile in PILES {
        let file = folder.join(pile).with_extension("scene.toml");
        let mut scene = files::load_scene(&file).map_err(|e| e.to_string())?.value;
        scene.cell.robot = Some(indy7([0.5, -FRAC_PI_2]));
        for method in [Method::Paper, Method::Robust] {
            let options = plan::Options { method, ..plan::Options::default() };
            let plan = plan::plan(&scene, &properties, &options).map_err(|e| format!("{pile}: {e}"))?;
            let Some(strike) = &plan.strike else {
                println!("{pile}, {method:?}: no plan ({})", plan.reason);
                continue;
            };
            let answer = robot::command(&scene.cell, strike, Some(&scene), &robot::Options::default());
            match answer.map_err(|e| format!("{pile}: {e}"))? {
                Answer::Ready(command) => {
                    paths += 1;
                    rows.extend(carried_out(&format!("{pile}, {method:?}"), &python, &scene, &command)?);
                }
                Answer::Refused(refusal) => {
                    refusals += 1;
                    println!("{pile}, {method:?}: refused: {}", refusal.reason);
                }
            }
        }
    }
    rows.push(Row::at_least("paths found or refused with the reason", f64::from(paths + refusals), 10.0, ""));
    rows.push(Row::plain("of these refused", f64::from(refusals), ""));
    Ok(row::print_all("Strike paths for the filmed piles, and the same by torques alone in MuJoCo", &rows))
}

/// MuJoCo's result.
#[derive(Deserialize)]
struct Moved {
    velocity: [f64; 3],
    q: Vec<f64>,
}

/// The tip's speed at the contact by our kinematics, and of MuJoCo's arm driven by our torques.
fn carried_out(name: &str, python: &Path, scene: &Scene, command: &Command) -> Result<Vec<Row>, String> {
    let mounted = command.mounted_arm().map_err(|e| e.to_string())?;
    let arm = mounted.arm();
    let strike = command.phase(PhaseName::Strike).ok_or("no strike")?;
    let [begins_s, _] = strike.span_s();
    // An integer number of steps to the contact.
    let steps = ((command.stroke.contact_time_s - begins_s) / STEP_S).floor().max(1.0);
    let step_s = (command.stroke.contact_time_s - begins_s) / steps;
    let torques: Vec<Vec<f64>> = (0..steps as usize)
        .map(|k| {
            let state = strike.at(begins_s + (k as f64 + 0.5) * step_s);
            arm.torques(&state.q_rad, &state.qd_rad_s, &state.qdd_rad_s2).as_slice().to_vec()
        })
        .collect();
    let task = serde_json::json!({
        "joints": arm.joint_names(), "start": strike.q_rad[0], "step_s": step_s, "torques": torques,
        "gravity": arm.gravity_m_s2.as_slice(),
    });
    let (urdf, task) = (temporary(&arm.urdf(), ".urdf")?, temporary(&task.to_string(), ".json")?);
    let moved: Vec<Moved> = lines(python, "mujoco_arm.py", &[urdf.path(), task.path()])?;
    let moved = moved.first().ok_or("MuJoCo printed nothing")?;
    let spec = scene.cell.robot.as_ref().and_then(|robot| robot.base_from_table).unwrap_or_default();
    let along = Vec2::from_heading(command.strike.heading_rad).rotated(spec.rpy_rad[2]);
    let simulated_m_s = along.x * moved.velocity[0] + along.y * moved.velocity[1];
    let state = command.at(command.stroke.contact_time_s).ok_or("no phases")?;
    let apart_rad = moved.q.iter().zip(&state.q_rad).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let off = |speed_m_s: f64| 100.0 * (speed_m_s / command.strike.speed_m_s - 1.0).abs();
    let asked = command.strike.speed_m_s;
    Ok(vec![
        Row::at_most(
            format!("{name}: tip at the contact off {asked:.3} m/s"),
            off(command.stroke.contact_speed_m_s),
            1.0,
            "%",
        ),
        Row::at_most(format!("{name}: in MuJoCo, by torques alone"), off(simulated_m_s), 1.0, "%"),
        Row::plain(format!("{name}: joints there, worst"), apart_rad * 1e3, "mrad"),
    ])
}
