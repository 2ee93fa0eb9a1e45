//! The plan of a pile, as a job.

use super::forecast::SEED;
use super::request::{Cache, PileRequest};
use crate::jobs::Job;
use crate::project::Project;
use breakshot::plan::{self, EvaluatedStrike, GridSize, Options};
use breakshot::{Result, files};
use serde::Deserialize;

/// A plan that is asked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PlanRequest {
    pile: PileRequest,
    properties: String,
    /// The file to write.
    output: String,
    #[serde(default)]
    seed: Option<u64>,
}

/// Plans, and writes what `breakshot plan` writes.
///
/// # Errors
/// A pile that cannot be simulated, a plan that was ended, a file that cannot be written.
pub(crate) fn planned(
    project: &Project,
    cache: &Cache,
    request: &PlanRequest,
    job: &Job,
) -> Result<serde_json::Value> {
    let output = project.new_file(&request.output)?;
    let scene = cache.pile(project, &request.pile)?;
    let properties = cache.properties(project, &request.properties, &scene)?;
    let progress = |done: f64| {
        job.goes_on(done);
    };
    let stopped = || job.is_cancelled();
    let options = Options {
        seed: request.seed.unwrap_or(SEED),
        progress: Some(&progress),
        stopped: Some(&stopped),
        remedies: true,
        ..Options::default()
    };
    let plan = plan::plan(&scene, &properties, &options)?;
    if !job.goes_on(1.0) {
        return Err(breakshot::Error::Stopped);
    }
    files::write_json(&output, &plan)?;
    Ok(serde_json::json!({ "plan": plan, "file": request.output }))
}

/// Strikes from all sides that are evaluated, and in how many scenarios: a second on two cores.
const MAP: GridSize = GridSize { strikes: 1000, samples: 40 };

/// The map that is asked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MapRequest {
    pile: PileRequest,
    properties: String,
}

/// The success probability of strikes on every object from all sides, as `breakshot plan --map` draws them.
///
/// # Errors
/// A pile that cannot be simulated.
pub(crate) fn map(
    project: &Project,
    cache: &Cache,
    request: &MapRequest,
    job: &Job,
) -> Result<serde_json::Value> {
    let scene = cache.pile(project, &request.pile)?;
    let properties = cache.properties(project, &request.properties, &scene)?;
    if !job.goes_on(0.0) {
        return Err(breakshot::Error::Stopped);
    }
    let options = Options { seed: SEED, ..Options::default() };
    let strikes: Vec<EvaluatedStrike> = plan::evaluate_grid(&scene, &properties, &options, MAP)?;
    if !job.goes_on(1.0) {
        return Err(breakshot::Error::Stopped);
    }
    Ok(serde_json::json!({ "strikes": strikes, "samples": MAP.samples }))
}
