//! Which clips to film next, as a job.

use crate::jobs::Job;
use crate::project::Project;
use breakshot::campaign::Campaign;
use breakshot::estimate::{self, AdviceOptions};
use breakshot::{Error, Result, files};
use serde::Deserialize;

/// Clips that are proposed, and the seed of the piles: those of `breakshot estimate --advise 5`.
const CLIPS: usize = 5;
const SEED: u64 = 1;

/// The properties that are to become better.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AdviceRequest {
    pub(crate) campaign: String,
    properties: String,
}

/// What `breakshot estimate --advise 5 --json` prints as `advice`.
///
/// # Errors
/// Properties without the evidence of a clip, a cell without striker, a job that was ended.
pub(crate) fn advised(
    project: &Project,
    campaign: &Campaign,
    request: &AdviceRequest,
    job: &Job,
) -> Result<serde_json::Value> {
    let properties = files::load_properties(project.file(&request.properties)?)?;
    if !job.goes_on(0.0) {
        return Err(Error::Stopped);
    }
    let options = AdviceOptions { clips: CLIPS, seed: SEED, scene: None };
    let advice = estimate::advice(&properties, &campaign.cell, &campaign.objects, &options)?;
    if !job.goes_on(1.0) {
        return Err(Error::Stopped);
    }
    Ok(serde_json::json!({ "advice": advice }))
}
