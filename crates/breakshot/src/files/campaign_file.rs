//! The list of clips, with the files that it names.

use super::content::{Content, first_equal};
use super::film_path::FilmPath;
use super::{
    Loaded, any_cell_of, beside, check_version, counts, label, load_objects, load_scene, one, parsed_toml,
    text as read_text,
};
use crate::campaign::{Campaign, Clip, ClipStart, Source};
use crate::columns::Columns;
use crate::error::{Error, Result};
use crate::scene::Strike;
use serde::Deserialize;
use std::path::{Path, PathBuf};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CampaignFile {
    #[serde(default = "one")]
    version: u32,
    cell: PathBuf,
    objects: PathBuf,
    /// The columns of all tracks that give none of their own.
    columns: Option<Columns>,
    #[serde(default)]
    clips: Vec<ClipEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClipEntry {
    video: Option<PathBuf>,
    tracks: Option<PathBuf>,
    columns: Option<Columns>,
    frame_rate_hz: Option<f64>,
    objects: Vec<String>,
    strike: Option<Strike>,
    scene: Option<PathBuf>,
    exclude: Option<Exclude>,
    #[serde(default)]
    starts: Vec<ClipStart>,
}

/// What of a clip is left out.
#[derive(Deserialize)]
#[serde(untagged, expecting = "`exclude`: needed: true, false, or a list of [from_s, until_s]")]
enum Exclude {
    Whole(bool),
    Stretches(Vec<[f64; 2]>),
}

/// `campaign.toml` with the cell, the objects and the scenes that it names.
///
/// # Errors
/// See [`super::read_toml`], [`Campaign::check`] and the loaders of the named files; also a film or tracks that do not exist, and
/// two clips of the same content.
pub fn load_campaign(path: impl AsRef<Path>) -> Result<Loaded<Campaign>> {
    let path = path.as_ref();
    campaign_of(path, &read_text(path)?)
}

/// The campaign of a text that is, or would be, the file at `path`.
///
/// # Errors
/// See [`load_campaign`].
pub fn campaign_of(path: impl AsRef<Path>, text: &str) -> Result<Loaded<Campaign>> {
    let path = path.as_ref();
    let file: CampaignFile = parsed_toml(path, text, "a campaign file")?;
    check_version(path, file.version)?;
    let cell_path = beside(path, &file.cell);
    let cell = any_cell_of(&cell_path, &read_text(&cell_path)?)?;
    let objects = load_objects(beside(path, &file.objects))?;
    let columns = file.columns;
    let is_whole = |entry: &ClipEntry| matches!(entry.exclude, Some(Exclude::Whole(true)));
    let excluded: Vec<bool> = file.clips.iter().map(is_whole).collect();
    let clips = file.clips.into_iter().map(|entry| load_clip(path, entry, columns.as_ref()));
    let mut all: Vec<Clip> = clips.collect::<Result<_>>()?;
    // Excluded clips count for the names, which stay when a clip is excluded.
    name_clips(&mut all);
    let mut campaign = Campaign { cell, objects: objects.value, clips: Vec::new(), excluded: Vec::new() };
    for (clip, is_excluded) in all.into_iter().zip(excluded) {
        if is_excluded { &mut campaign.excluded } else { &mut campaign.clips }.push(clip);
    }
    for clip in &campaign.clips {
        check_exists(path, clip)?;
    }
    check_contents_differ(path, &campaign.clips)?;
    campaign.check(&label(path))?;
    Ok(Loaded { value: campaign, notes: objects.notes })
}

fn check_exists(campaign: &Path, clip: &Clip) -> Result<()> {
    let file = clip.source.path();
    if FilmPath::of(file).file.exists() {
        return Ok(());
    }
    let name = format!("{}: clip `{}`", label(campaign), clip.name);
    let found = format!("missing ({})", file.display());
    Err(Error::invalid(name, clip.source.key(), found, "a file that exists"))
}

/// For each file the first one before it that has the same content.
///
/// # Errors
/// A file that cannot be read.
pub fn repeats(files: &[PathBuf]) -> Result<Vec<Option<usize>>> {
    let contents: Vec<Content> = files.iter().map(|file| Content::of(file)).collect();
    let earlier = |k: usize| {
        first_equal(&contents, k, |_| true).map_err(|source| Error::Read { path: files[k].clone(), source })
    };
    (0..files.len()).map(earlier).collect()
}

/// An error if two clips have the same content: twice the same evidence would make the intervals too narrow.
fn check_contents_differ(campaign: &Path, clips: &[Clip]) -> Result<()> {
    let contents: Vec<Content> = clips.iter().map(|clip| Content::of(clip.source.path())).collect();
    for (k, clip) in clips.iter().enumerate() {
        let read_alike = |other: usize| match (&clip.source, &clips[other].source) {
            (Source::Film(_), Source::Film(_)) => true,
            (Source::Tracks { columns, .. }, Source::Tracks { columns: others, .. }) => columns == others,
            _ => false,
        };
        let unreadable = |source| Error::Read { path: clip.source.path().into(), source };
        if let Some(other) = first_equal(&contents, k, read_alike).map_err(unreadable)? {
            let owner = format!("{}: clip `{}`", label(campaign), clip.name);
            let found = format!("that of clip `{}`", clips[other].name);
            return Err(Error::invalid(owner, "content", found, "every clip once"));
        }
    }
    Ok(())
}

/// Names every clip by its file, and files of one name also by as many of their folders as distinguish them.
fn name_clips(clips: &mut [Clip]) {
    let paths: Vec<FilmPath> = clips.iter().map(|clip| FilmPath::of(clip.source.path())).collect();
    let name = |path: &FilmPath, folders: usize| -> String {
        let parts: Vec<_> = path.file.iter().map(|part| part.to_string_lossy()).collect();
        parts[parts.len().saturating_sub(folders + 1)..].join("/")
    };
    let deepest = paths.iter().map(|path| path.file.iter().count()).max().unwrap_or(0);
    let mut chosen: Vec<Option<String>> = vec![None; clips.len()];
    for folders in 0..deepest {
        let names: Vec<String> = paths.iter().map(|path| name(path, folders)).collect();
        let counts = counts(&names);
        for (chosen, own) in chosen.iter_mut().zip(&names) {
            if chosen.is_none() && counts[own.as_str()] == 1 {
                *chosen = Some(own.clone());
            }
        }
        if chosen.iter().all(Option::is_some) {
            break;
        }
    }
    for ((clip, path), chosen) in clips.iter_mut().zip(&paths).zip(chosen) {
        // Topics of one bag are distinguished by their names.
        let topic = path.topic.as_ref().map_or(String::new(), |topic| format!("#{topic}"));
        clip.name = chosen.unwrap_or_else(|| name(path, 0) + &topic);
    }
}

fn load_clip(campaign: impl AsRef<Path>, entry: ClipEntry, columns: Option<&Columns>) -> Result<Clip> {
    let campaign = campaign.as_ref();
    let source = match (entry.video, entry.tracks) {
        (Some(film), None) => {
            if entry.columns.is_some() {
                let owner = format!("{}: clip `{}`", label(campaign), film.display());
                return Err(Error::invalid(
                    owner,
                    "columns",
                    "given for a film",
                    "`tracks` beside it, or no `columns`",
                ));
            }
            Source::Film(beside(campaign, &film))
        }
        (None, Some(tracks)) => Source::Tracks {
            columns: entry.columns.or_else(|| columns.cloned()).map(Box::new),
            path: beside(campaign, &tracks),
        },
        (film, tracks) => {
            let shown =
                film.zip(tracks).map(|(film, _)| format!(" `{}`", film.display())).unwrap_or_default();
            let found = if shown.is_empty() { "neither of them" } else { "both of them" };
            let owner = format!("{}: clip{shown}", label(campaign));
            return Err(Error::invalid(owner, "`video` or `tracks`", found, "one of them"));
        }
    };
    let placed = match &entry.scene {
        Some(scene) => Some(load_scene(beside(campaign, scene))?.value.placed),
        None => None,
    };
    Ok(Clip {
        name: String::new(),
        source,
        frame_rate_hz: entry.frame_rate_hz,
        objects: entry.objects,
        strike: entry.strike,
        placed,
        excluded_s: match entry.exclude {
            Some(Exclude::Stretches(stretches)) => stretches,
            _ => Vec::new(),
        },
        starts: entry.starts,
    })
}
