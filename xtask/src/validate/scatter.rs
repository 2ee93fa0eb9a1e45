//! The filmed strikes on piles: real against virtual, and the paper's planner on the same piles.

use super::Program;
use super::row::{self, Row, mean_and_worst};
use super::truth::Truth;
use breakshot::files;
use breakshot::plan::Plan;
use breakshot::verify::Report;
use std::path::Path;

/// Pair distances of the filmed strikes on piles, predicted against filmed.
pub(crate) struct Predicted {
    pub(crate) mean_mm: f64,
    pub(crate) worst_mm: f64,
    /// Whether every target holds.
    pub(crate) holds: bool,
}

/// Simulates every filmed strike with the estimated properties, prints the distances, plans for the same piles.
pub(crate) fn films(program: &Program, folder: &Path, properties: &Path) -> Result<Predicted, String> {
    let truth = Truth::read(folder)?;
    let properties = properties.to_string_lossy().into_owned();
    let mut errors_mm = Vec::new();
    let mut promises = Vec::new();
    for video in truth.clips.keys() {
        let name = video.trim_end_matches(".mp4");
        let file = |ending: &str| folder.join(format!("{name}{ending}")).to_string_lossy().into_owned();
        let output = program.output.join(format!("verify-{name}"));
        let (scene, strike) = (file(".scene.toml"), file(".strike.json"));
        let run = program.run(&[
            "verify",
            &scene,
            &file(".mp4"),
            "--properties",
            &properties,
            "--strike",
            &strike,
            "-o",
            &output.to_string_lossy(),
        ])?;
        println!("\n{name}\n{}", run.stdout.trim_end());
        let report: Report = files::read_json(&output.join("report.json")).map_err(|e| e.to_string())?;
        errors_mm.extend(report.pairs.iter().map(|p| 1e3 * (p.predicted_m - p.observed_m)));
        promises.push(promise(program, name, &scene, &properties)?);
    }
    let (mean_mm, worst_mm) = mean_and_worst(&errors_mm);
    let holds = row::print_all(
        "Strikes on piles",
        &[
            Row::plain(
                format!("pairwise distance, predicted against filmed: mean of {}", errors_mm.len()),
                mean_mm,
                "mm",
            ),
            Row::plain("pairwise distance, predicted against filmed: worst", worst_mm, "mm"),
            Row::at_most(
                "simulated plan against what the plan promised, worst",
                promises.iter().copied().fold(0.0, f64::max) * 1e3,
                1e-6,
                "mm",
            ),
        ],
    );
    Ok(Predicted { mean_mm, worst_mm, holds })
}

/// Plans with the paper's method and simulates the plan; gives how far the simulation is from the promise (m).
fn promise(program: &Program, name: &str, scene: &str, properties: &str) -> Result<f64, String> {
    let path = program.output.join(format!("plan-{name}.json"));
    let (plan_file, trajectory) =
        (path.to_string_lossy(), program.output.join(format!("trajectory-{name}.json")));
    program.run(&["plan", scene, "--properties", properties, "--method", "paper", "-o", &plan_file])?;
    let plan: Plan = files::read_json(&path).map_err(|e| e.to_string())?;
    println!("plan: {:?}: {}", plan.outcome, plan.reason);
    let Some(prediction) = plan.prediction else { return Ok(0.0) };
    program.run(&[
        "simulate",
        scene,
        "--properties",
        properties,
        "--strike",
        &plan_file,
        "-o",
        &trajectory.to_string_lossy(),
    ])?;
    let simulated: breakshot::physics::Trajectory =
        files::read_json(&trajectory).map_err(|e| e.to_string())?;
    let apart = prediction.final_poses.iter().map(|(object, pose)| {
        simulated.final_poses.get(object).map_or(f64::INFINITY, |p| p.position.distance(pose.position))
    });
    Ok(apart.fold(0.0, f64::max))
}
