//! Films and pictures that the page adds to the folder: received in pieces, whole or absent; films are listed in the campaign.

use super::edit::Edits;
use crate::http::request::{NoRequest, Request};
use crate::project::{PICTURE_EXTENSION, Project};
use breakshot::campaign::{FILM_EXTENSIONS, named_objects};
use breakshot::capture::Footage;
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::fs::{File, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// One film is received at a time.
#[derive(Debug, Default)]
pub(crate) struct Uploads(Mutex<()>);

/// What a film would become.
#[derive(Debug, Serialize)]
pub(crate) struct Drafted {
    /// The name of the clip's file, relative to the campaign.
    name: String,
    /// The objects in the name of the film.
    objects: Vec<String>,
}

/// A film that was added.
#[derive(Debug, Serialize)]
pub(crate) struct Added {
    name: String,
    /// Changes that can be taken back.
    undo: usize,
}

/// Why a film was not added.
pub(crate) enum NotAdded {
    /// The connection ended, or was too slow.
    Cut(NoRequest),
    Refused(Error),
}

impl From<Error> for NotAdded {
    fn from(error: Error) -> Self {
        Self::Refused(error)
    }
}

/// Where a file goes that the page adds.
struct Target {
    /// The campaign that lists it; none for a picture or film that is only added.
    campaign: Option<PathBuf>,
    /// The first lines of a campaign that does not exist yet.
    first: Option<String>,
    path: PathBuf,
    name: String,
}

/// The first lines of a campaign that does not exist yet, of the cell and the objects that are given with its first film; none if neither is
/// given, or the campaign exists.
///
/// # Errors
/// A cell or objects that are not files of the project beside the campaign; a campaign that is not a file of TOML there.
fn first_lines(project: &Project, request: &Request) -> Result<Option<String>> {
    let fields = ["campaign", "cell_file", "objects_file"].map(|name| request.field(name));
    let [Some(campaign), Some(cell), Some(objects)] = fields else { return Ok(None) };
    if project.new_file(campaign)?.symlink_metadata().is_ok() {
        return Ok(None);
    }
    if campaign.contains('/') || !campaign.to_ascii_lowercase().ends_with(".toml") {
        let needed = "a name that ends with .toml, without a folder";
        return Err(Error::invalid(
            campaign.escape_debug().to_string(),
            "the name",
            "not such a name",
            needed,
        ));
    }
    project.check_cell(&project.file(cell)?)?;
    project.file(objects)?;
    let [cell, objects] = [cell, objects].map(toml::Value::from);
    Ok(Some(format!("cell = {cell}\nobjects = {objects}\n")))
}

/// The file that a film of this name gets beside the campaign; without a campaign, also a picture in the project's folder.
///
/// # Errors
/// A name that is not that of a film in this folder alone, or that is taken; a campaign that is not of the project.
fn target(project: &Project, request: &Request) -> Result<Target> {
    let name = request.field("name").unwrap_or_default().to_owned();
    let campaign = request.field("campaign");
    let first = first_lines(project, request)?;
    let campaign_file = match (campaign, &first) {
        (Some(campaign), Some(_)) => Some(project.new_file(campaign)?),
        (Some(campaign), None) => Some(project.file(campaign)?),
        (None, _) => None,
    };
    let refused = |found: &str, needed: &str| {
        Err(Error::invalid(name.escape_debug().to_string(), "the name", found.to_owned(), needed))
    };
    if name.contains(['/', '\\', '#']) || name.starts_with('.') {
        return refused("with parts of a path", "the name of a file, without folders");
    }
    let extension = Path::new(&name).extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_picture = |extension: &str| campaign.is_none() && extension == PICTURE_EXTENSION;
    let is_known = |extension: &str| FILM_EXTENSIONS.contains(&extension) || is_picture(extension);
    if !extension.is_some_and(|extension| is_known(&extension)) {
        let needed = if campaign.is_none() {
            "a name that ends in .png, .mp4, .mov, .mkv .."
        } else {
            "a name that ends in .mp4, .mov, .mkv .."
        };
        return refused("not that of a film", needed);
    }
    let folder = campaign.and_then(|campaign| campaign.rsplit_once('/'));
    let folder = folder.map_or(String::new(), |(folder, _)| format!("{folder}/"));
    let path = project.new_file(&format!("{folder}{name}"))?;
    if path.symlink_metadata().is_ok() {
        return refused("taken", "the name of a new file");
    }
    Ok(Target { campaign: campaign_file, first, path, name })
}

/// What a film of this name would become; nothing is written.
///
/// # Errors
/// As those of a film that is added, apart from its content.
pub(crate) fn drafted(project: &Project, request: &Request) -> Result<Drafted> {
    let Target { campaign, first, name, .. } = target(project, request)?;
    let objects = if first.is_some() {
        files::load_objects(project.file(request.field("objects_file").unwrap_or_default())?)?.value
    } else {
        let campaign = campaign.map_or_else(|| project.file(""), Ok)?;
        files::load_campaign(&campaign)?.value.objects
    };
    let names: Vec<String> = objects.into_iter().map(|object| object.name).collect();
    let stem = Path::new(&name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Drafted { objects: named_objects(&stem, &names), name })
}

/// The first bytes of every PNG.
const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// # Errors
/// A file that is not what its name says: a film that is called a picture.
fn check_signature(path: &Path, name: &str) -> Result<()> {
    let mut begins = [0; SIGNATURE.len()];
    let read = File::open(path).and_then(|mut file| file.read_exact(&mut begins));
    if read.is_ok() && begins == SIGNATURE {
        return Ok(());
    }
    Err(Error::video(Path::new(name), "not a PNG", "the picture that the name says"))
}

/// Receives a film and lists it in the campaign, if there is one.
///
/// # Errors
/// A name that is refused, another upload at the same time, a connection that ends early, something that is not a film, a campaign that
/// is not valid with it; nothing is left behind then.
pub(crate) fn added(
    (project, edits, uploads): (&Project, &Edits, &Uploads),
    request: &Request,
    receive: &mut dyn FnMut(&mut File) -> std::result::Result<(), NotAdded>,
) -> std::result::Result<Added, NotAdded> {
    let Ok(_one) = uploads.0.try_lock() else {
        return Err(Error::invalid(
            "the film",
            "an upload",
            "another one at the same time",
            "one film after the other",
        )
        .into());
    };
    let Target { campaign, first, path, name } = target(project, request)?;
    let given = request.field("objects").unwrap_or_default().split(',').map(str::trim);
    let objects: Vec<String> = given.filter(|object| !object.is_empty()).map(str::to_owned).collect();
    if campaign.is_some() && objects.is_empty() {
        return Err(Error::invalid(&name, "objects", "none", "the struck object, then the others").into());
    }
    let output = files::Unfinished::file(&path)?;
    let unwritable = |source| Error::Write { path: PathBuf::from(&name), source };
    let mut file = OpenOptions::new().write(true).open(output.path()).map_err(unwritable)?;
    receive(&mut file)?;
    drop(file);
    let is_film = |error: Error| match error {
        Error::Video { found, needed, .. } => Error::video(Path::new(&name), found, needed),
        other => other,
    };
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(PICTURE_EXTENSION)) {
        check_signature(&output.path(), &name)?;
    }
    let mut footage = Footage::open(&output.path()).map_err(is_film)?;
    footage.next().transpose().map_err(is_film)?;
    drop(footage);
    output.finish()?;
    let Some(campaign) = campaign else { return Ok(Added { name, undo: 0 }) };
    let undo = edits.append(&campaign, first.as_deref(), (&name, &objects)).inspect_err(|_| {
        // The film is of no use without its entry.
        let _ = std::fs::remove_file(&path);
    })?;
    Ok(Added { name, undo })
}
