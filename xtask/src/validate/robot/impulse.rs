//! Fig. 10 for the Indy 7, and its effective masses compared with recorded ones.

use crate::example::target;
use crate::validate::row::{self, Row};
use breakshot::cell::{RobotSpec, Transform};
use breakshot::object::Shape;
use breakshot::robot::{self, ImpulseConditions, MountedArm};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest relative difference of a number recorded with eight digits.
const SAME: f64 = 1e-6;

/// The entries of `reference.json` and `fig10_reference.json` that are compared.
#[derive(Deserialize)]
struct Masses {
    q_rad: Vec<f64>,
    eff_mass_xyz: [f64; 3],
}

#[derive(Deserialize)]
struct Planar {
    #[serde(rename = "m_max_planar")]
    heaviest_kg: f64,
    #[serde(rename = "m_min_planar")]
    lightest_kg: f64,
    #[serde(rename = "mo=0.143")]
    heavy: Impulses,
}

#[derive(Deserialize)]
struct Impulses {
    #[serde(rename = "F_unit_max")]
    most: f64,
    #[serde(rename = "F_unit_min")]
    least: f64,
}

/// The paper's heaviest object, without restitution, as in the reference.
const HIT: ImpulseConditions =
    ImpulseConditions { object_mass_kg: 0.143, restitution: 0.0, speed_cap_m_s: 1.0 };

/// Compares the masses, draws the figure and prints the table.
pub(super) fn run(reference: &Path) -> Result<bool, String> {
    let read = |name: &str| reference.join(name);
    let masses: BTreeMap<String, serde_json::Value> =
        breakshot::files::read_json(&read("reference.json")).map_err(|e| e.to_string())?;
    let planar: BTreeMap<String, Planar> =
        breakshot::files::read_json(&read("fig10_reference.json")).map_err(|e| e.to_string())?;
    let mut worst = [0.0_f64; 3];
    let mut drawn = Vec::new();
    println!("\n| pose | m_x m_y m_z (kg) | recorded | heaviest, lightest along the table (kg) | recorded |");
    for (name, planar) in &planar {
        let Some((model, pose)) = name.split_once("/corrected/") else { continue };
        let masses: Masses = masses
            .get(name)
            .and_then(|value| serde_json::from_value(value.clone()).ok())
            .ok_or_else(|| format!("reference.json has no whole `{name}`"))?;
        let geometry = mounted(model)?
            .impulse_geometry_of(&masses.q_rad, &HIT)
            .ok_or_else(|| format!("{name}: no real arm"))?;
        let ours: [f64; 3] = std::array::from_fn(|k| 1.0 / geometry.mobility_per_kg[k][k]);
        let [heavy, light] = geometry.along_table;
        let apart = |one: &[f64], other: &[f64]| {
            one.iter().zip(other).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
        };
        let found = [
            apart(&ours, &masses.eff_mass_xyz),
            apart(
                &[heavy.effective_mass_kg, light.effective_mass_kg],
                &[planar.heaviest_kg, planar.lightest_kg],
            ),
            apart(
                &[heavy.impulse_per_speed_kg, light.impulse_per_speed_kg],
                &[planar.heavy.most, planar.heavy.least],
            ),
        ];
        worst.iter_mut().zip(found).for_each(|(worst, found)| *worst = worst.max(found));
        let three = |m: &[f64; 3]| format!("{:.4} {:.4} {:.4}", m[0], m[1], m[2]);
        println!(
            "| {model} {pose} | {} | {} | {:.4} {:.4} | {:.4} {:.4} |",
            three(&ours),
            three(&masses.eff_mass_xyz),
            heavy.effective_mass_kg,
            light.effective_mass_kg,
            planar.heaviest_kg,
            planar.lightest_kg
        );
        if model == "indy7" && pose != "neuromeka_default" {
            drawn.push(geometry);
        }
    }
    let folder = target().join("validate");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let figure = folder.join("fig10.svg");
    breakshot::files::write_whole(&figure, robot::impulse_figure(&drawn).as_bytes())
        .map_err(|e| e.to_string())?;
    println!("Wrote {} ({} poses)", figure.display(), drawn.len());
    let what = [
        "effective masses along x, y, z",
        "heaviest and lightest along the table",
        "largest and smallest impulse on 143 g (recorded at whole degrees)",
    ];
    // The recorded extremes were searched in steps of one degree.
    let targets = [SAME, SAME, 1e-4];
    let rows: Vec<Row> = what
        .iter()
        .zip(worst.iter().zip(targets))
        .map(|(what, (worst, target))| {
            Row::at_most(format!("{what}: worst"), worst * 1e6, target * 1e6, "ppm")
        })
        .collect();
    Ok(row::print_all(
        "Effective masses compared with pinocchio's, both generations, all recorded poses",
        &rows,
    ))
}

/// An arm without a tool; the table frame is its base frame.
fn mounted(model: &str) -> Result<MountedArm, String> {
    let robot =
        RobotSpec { arm: model.into(), base_from_table: Some(Transform::default()), ..RobotSpec::default() };
    MountedArm::new(&robot, Shape::Disc { radius_m: 0.01 }).map_err(|e| e.to_string())
}
