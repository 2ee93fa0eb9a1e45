//! The clips of a campaign, and the tracks that a command wrote of them.

use crate::jobs::Job;
use crate::project::Project;
use breakshot::campaign::{Campaign, Clip, ClipStart, Source};
use breakshot::capture::Decoder;
use breakshot::detect::Tracks;
use breakshot::estimate::ClipTracks;
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

/// The folder of the project into which tracks are written (`breakshot estimate --tracks tracks`).
pub(crate) const TRACKS_FOLDER: &str = "tracks";

/// The last campaign that was read, until its file changes.
#[derive(Default)]
pub(crate) struct Campaigns(Mutex<Option<Known>>);

struct Known {
    path: PathBuf,
    changed: Option<SystemTime>,
    campaign: Arc<Campaign>,
}

/// A clip as it is listed.
#[derive(Serialize)]
pub(crate) struct Listed {
    name: String,
    objects: Vec<String>,
    /// Whether it is a film; otherwise its tracks were measured elsewhere.
    is_film: bool,
    /// Whether it has been tracked.
    is_tracked: bool,
    /// Whether it is left out.
    is_excluded: bool,
    /// The stretches of it that are left out (s).
    excluded_s: Vec<[f64; 2]>,
    /// Where a person has seen objects in its first frame.
    starts: Vec<ClipStart>,
}

impl Campaigns {
    /// The campaign of a file.
    ///
    /// # Errors
    /// A file that is not of the project, or that names one that is not; a campaign that is not valid.
    pub(crate) fn open(&self, project: &Project, name: &str) -> Result<Arc<Campaign>> {
        let path = project.file(name)?;
        let changed = path.metadata().and_then(|file| file.modified()).ok();
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*known
            && known.path == path
            && known.changed == changed
        {
            return Ok(known.campaign.clone());
        }
        check_files(project, &path)?;
        let campaign = Arc::new(files::load_campaign(&path)?.value);
        *known = Some(Known { path, changed, campaign: campaign.clone() });
        Ok(campaign)
    }
}

impl Campaigns {
    /// Forgets the campaign, when a file that it names was written: it is read anew for the next question.
    pub(crate) fn forget(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// Checks that a campaign names files of the project alone.
fn check_files(project: &Project, campaign: &Path) -> Result<()> {
    let table: toml::Table = files::read_toml(campaign)?;
    let clips = table.get("clips").and_then(toml::Value::as_array).into_iter().flatten();
    let of_clips = clips.flat_map(|clip| ["video", "tracks", "scene"].map(|key| clip.get(key)));
    let named = ["cell", "objects"].map(|key| table.get(key)).into_iter().chain(of_clips);
    for name in named.flatten().filter_map(toml::Value::as_str) {
        project.named_in(campaign, Path::new(name))?;
    }
    if let Some(cell) = table.get("cell").and_then(toml::Value::as_str) {
        let cell = project.named_in(campaign, Path::new(cell))?;
        project.check_cell(&cell)?;
    }
    Ok(())
}

/// The clip of this number.
///
/// # Errors
/// There is none.
pub(crate) fn clip<'a>(campaign: &'a Campaign, number: &str) -> Result<&'a Clip> {
    let all = || campaign.clips.iter().chain(&campaign.excluded);
    let found = number.parse().ok().and_then(|k: usize| all().nth(k));
    let needed = format!("a number from 0 to {}", all().count().saturating_sub(1));
    found.ok_or_else(|| Error::invalid("the campaign", "clip", number.escape_debug(), needed))
}

/// The clips of a campaign, those that are left out last.
pub(crate) fn listed(project: &Project, campaign: &Campaign) -> Vec<Listed> {
    let list = |(clip, file): (&Clip, Option<PathBuf>)| Listed {
        name: clip.name.clone(),
        objects: clip.objects.clone(),
        is_film: matches!(clip.source, Source::Film(_)),
        is_tracked: file.is_some_and(|file| file.is_file()),
        is_excluded: false,
        excluded_s: clip.excluded_s.clone(),
        starts: clip.starts.clone(),
    };
    let mut all: Vec<Listed> = campaign.clips.iter().zip(tracks_files(project, campaign)).map(list).collect();
    all.extend(campaign.excluded.iter().map(|clip| Listed { is_excluded: true, ..list((clip, None)) }));
    all
}

/// The files of the clips' tracks, as `breakshot estimate --tracks` names them; none for a name that is not that of a file.
fn tracks_files(project: &Project, campaign: &Campaign) -> Vec<Option<PathBuf>> {
    let names: Vec<&str> = campaign.clips.iter().map(|clip| clip.name.as_str()).collect();
    let files = files::track_file_names(&names).into_iter();
    files.map(|name| project.new_file(&format!("{TRACKS_FOLDER}/{name}")).ok()).collect()
}

/// The file of a clip's tracks.
pub(crate) fn tracks_file(project: &Project, campaign: &Campaign, clip: &str) -> Option<PathBuf> {
    let number = campaign.clips.iter().position(|other| other.name == clip)?;
    tracks_files(project, campaign).swap_remove(number)
}

/// The tracks that were written of a clip; none if it has not been tracked.
///
/// # Errors
/// A file that does not hold tracks.
pub(crate) fn tracks(project: &Project, campaign: &Campaign, clip: &Clip) -> Result<Option<Tracks>> {
    match tracks_file(project, campaign, &clip.name).filter(|file| file.is_file()) {
        Some(file) => files::read_json(&file).map(Some),
        None => Ok(None),
    }
}

/// The tracks of a clip: those in its file, if they were made of the same content by the same version; otherwise new ones, which are
/// written as `breakshot estimate --tracks` writes them. `on_frame` is called before each frame.
///
/// # Errors
/// A clip that cannot be tracked, a job that was ended, a folder that cannot be written.
pub(crate) fn finished_tracks(
    project: &Project,
    campaign: &Campaign,
    clip: &Clip,
    (job, on_frame): (&Job, impl Fn(&Job) + Send + 'static),
) -> Result<ClipTracks> {
    let file = tracks_file(project, campaign, &clip.name);
    let input = files::clip_input(campaign, clip)?;
    if let Some(tracks) = file.as_deref().and_then(|file| files::read_finished::<Tracks>(file, &input)) {
        let (objects, strike) = (clip.objects.clone(), clip.strike.clone());
        return Ok(ClipTracks { name: clip.name.clone(), objects, strike, tracks });
    }
    let ended = job.clone();
    let until = move || {
        on_frame(&ended);
        ended.is_cancelled()
    };
    let tracked = breakshot::clip_tracks_until(campaign, clip, Decoder::Auto, until)?;
    if let Some(file) = file {
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
        }
        files::write_finished(&file, &tracked.tracks, &input)?;
    }
    Ok(tracked)
}
