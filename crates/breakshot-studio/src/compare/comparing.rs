//! The comparison of a filmed strike with its simulation, as a job.

use crate::jobs::Job;
use crate::pile::request::Cache;
use crate::project::{Project, REPORT, TRACKS, TRAJECTORY};
use breakshot::capture::{Capture, Decoder, Footage};
use breakshot::detect::{self, Layout, Recording, Tracks};
use breakshot::scene::Scene;
use breakshot::verify::{self, Observed};
use breakshot::{Error, Result, files, physics, plan};
use serde::Deserialize;
use std::path::Path;

/// The table of the distances, for other programs.
const DISTANCES: &str = "distances.csv";
/// Part of the work that is done when the film is tracked.
const TRACKED: f64 = 0.98;

/// A filmed strike and what it is compared with.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompareRequest {
    /// The film, or its tracks (CSV or JSON).
    film: String,
    scene: String,
    /// A plan, or a file with only the strike.
    strike: String,
    properties: String,
    /// The folder to write.
    output: String,
}

/// Tracks the film, simulates the strike, and writes what `breakshot verify SCENE FILM --properties .. --strike .. -o OUTPUT` writes, without
/// its page.
///
/// # Errors
/// Files that are not of the project or not valid, a film that cannot be tracked, a job that was ended, a folder that cannot be written.
pub(crate) fn compared(
    project: &Project,
    cache: &Cache,
    request: &CompareRequest,
    job: &Job,
) -> Result<serde_json::Value> {
    let output = |name: &str| project.new_file(&format!("{}/{name}", request.output));
    let (report_file, folder) = (output(REPORT)?, project.new_file(&request.output)?);
    let scene = &cache.scene_file(project, &request.scene)?.0;
    let properties = cache.properties(project, &request.properties, scene)?;
    let strike = files::load_strike(project.file(&request.strike)?)?;
    let trajectory = physics::trajectory(scene, &properties, &strike, &plan::laws(scene)?)?;
    let tracks = tracks(project, scene, &request.film, job)?;
    let mut report = verify::comparison(scene, &trajectory.final_poses, &Observed::from_tracks(&tracks))?;
    report.align(&tracks, &trajectory);
    if !job.goes_on(1.0) {
        return Err(Error::Stopped);
    }
    std::fs::create_dir_all(&folder).map_err(|source| Error::Write { path: folder, source })?;
    files::write_json(&output(TRACKS)?, &tracks)?;
    files::write_json(&output(TRAJECTORY)?, &trajectory)?;
    files::write_whole(&output(DISTANCES)?, report.csv().as_bytes())?;
    // The report comes last: with it the folder is a comparison.
    files::write_json(&report_file, &report)?;
    Ok(serde_json::json!({ "file": project.name(&report_file) }))
}

/// Whether a file holds tracks and not pictures.
fn holds_tracks(name: &str) -> bool {
    let extension = Path::new(name).extension().unwrap_or_default();
    ["csv", "json"].iter().any(|tracks| extension.eq_ignore_ascii_case(tracks))
}

/// The tracks of the film, or those that the file holds.
fn tracks(project: &Project, scene: &Scene, film: &str, job: &Job) -> Result<Tracks> {
    let path = project.file(film)?;
    let names: Vec<String> = scene.placed.iter().map(|placed| placed.object.clone()).collect();
    if holds_tracks(film) {
        let text = files::tracks_text(&path)?;
        let recording = Recording { name: film, text: &text, columns: None, frame_rate_hz: None };
        return detect::recorded_tracks(&recording, &names, &scene.cell.workspace);
    }
    let footage = Footage::open_with(&path, Decoder::Auto)?.at_frame_rate(scene.cell.camera.frame_rate_hz);
    let count = footage.frame_count().unwrap_or(0);
    let (observing, stopping) = (job.clone(), job.clone());
    let mut read = 0;
    let footage = footage.until(move || stopping.is_cancelled()).observed(move |_| {
        read += 1;
        observing.goes_on(TRACKED * f64::from(read) / count.max(read as usize) as f64);
    });
    let layout = Layout::Placed(scene.placed.clone());
    let options = detect::Options::default();
    detect::tracks(Capture::of(footage, &scene.cell)?, &scene.objects, &names, &layout, &options)
}
