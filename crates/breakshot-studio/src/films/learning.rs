//! The properties of all objects from the clips of a campaign, as a job.

use super::clips::finished_tracks;
use crate::jobs::Job;
use crate::project::Project;
use breakshot::campaign::{Campaign, Clip};
use breakshot::estimate;
use breakshot::{Error, Result, files};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Part of the work that is done when all clips are tracked.
const TRACKED: f64 = 0.95;

/// Tracks every clip that has no finished tracks and estimates the properties; writes what `breakshot estimate CAMPAIGN -o OUTPUT --tracks tracks` writes.
///
/// # Errors
/// A campaign without a readable clip, a job that was ended, files that cannot be written.
pub(crate) fn learned(
    project: &Project,
    campaign: &Campaign,
    output: &str,
    job: &Job,
) -> Result<serde_json::Value> {
    let file = project.new_file(output)?;
    if file.extension().is_none_or(|extension| extension != "json") {
        return Err(Error::invalid(output, "the name", "not one of JSON", "a name that ends with .json"));
    }
    let done = AtomicUsize::new(0);
    let unwritable = Mutex::new(None);
    let part = || TRACKED * done.load(Ordering::Relaxed) as f64 / campaign.clips.len().max(1) as f64;
    let tracked = |clip: &Clip| {
        if !job.goes_on(part()) {
            return Err(Error::Stopped);
        }
        let tracks = finished_tracks(project, campaign, clip, (job, |_: &Job| ()));
        if let Err(error @ Error::Write { .. }) = tracks {
            // Not a reason to leave the clip out.
            *unwritable.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            return Err(Error::Stopped);
        }
        done.fetch_add(1, Ordering::Relaxed);
        job.goes_on(part());
        tracks
    };
    let tracked = breakshot::campaign_tracks(campaign, tracked);
    if let Some(error) = unwritable.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let (clips, unreadable) = tracked?;
    let options = estimate::Options::default();
    let properties = breakshot::campaign_properties(campaign, None, &clips, unreadable, &options)?;
    if !job.goes_on(1.0) {
        return Err(Error::Stopped);
    }
    files::write_json(&file, &properties)?;
    Ok(serde_json::json!({ "file": output }))
}
