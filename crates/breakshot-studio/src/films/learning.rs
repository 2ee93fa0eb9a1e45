//! The properties of all objects from the clips of a campaign, as a job.

use super::clips::tracks_file;
use crate::jobs::Job;
use crate::project::Project;
use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::Decoder;
use breakshot::estimate::{self, ClipTracks};
use breakshot::{Error, Result, files};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Part of the work that is done when all clips are tracked.
const TRACKED: f64 = 0.95;

/// Tracks every clip and estimates the properties; writes what `breakshot estimate CAMPAIGN -o OUTPUT --tracks tracks` writes.
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
    let part = || TRACKED * done.load(Ordering::Relaxed) as f64 / campaign.clips.len().max(1) as f64;
    let tracked = |clip: &Clip| {
        if !job.goes_on(part()) {
            return Err(Error::Stopped);
        }
        let tracks = breakshot::clip_tracks(campaign, clip, Decoder::Auto);
        done.fetch_add(1, Ordering::Relaxed);
        job.goes_on(part());
        tracks
    };
    let (clips, unreadable) = breakshot::campaign_tracks(campaign, tracked)?;
    let options = estimate::Options::default();
    let properties = breakshot::campaign_properties(campaign, None, &clips, unreadable, &options)?;
    if !job.goes_on(1.0) {
        return Err(Error::Stopped);
    }
    write_tracks(project, campaign, &clips)?;
    files::write_json(&file, &properties)?;
    Ok(serde_json::json!({ "file": output }))
}

fn write_tracks(project: &Project, campaign: &Campaign, clips: &[ClipTracks]) -> Result<()> {
    for tracked in clips {
        let Some(file) = tracks_file(project, campaign, &tracked.name) else { continue };
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
        }
        files::write_json(&file, &tracked.tracks)?;
    }
    Ok(())
}
