//! Films that the page adds to the folder: received in pieces, whole or absent, and listed in the campaign.

use super::edit::Edits;
use crate::http::request::{NoRequest, Request};
use crate::project::Project;
use breakshot::campaign::{FILM_EXTENSIONS, named_objects};
use breakshot::capture::Footage;
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::fs::{File, OpenOptions};
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

/// The file that a film of this name gets beside the campaign.
///
/// # Errors
/// A name that is not that of a film in this folder alone, or that is taken; a campaign that is not of the project.
fn target(project: &Project, request: &Request) -> Result<(PathBuf, PathBuf, String)> {
    let field = |name: &str| request.field(name).unwrap_or_default().to_owned();
    let (campaign, name) = (field("campaign"), field("name"));
    let campaign_file = project.file(&campaign)?;
    let refused = |found: &str, needed: &str| {
        Err(Error::invalid(name.escape_debug().to_string(), "the name", found.to_owned(), needed))
    };
    if name.contains(['/', '\\', '#']) || name.starts_with('.') {
        return refused("with parts of a path", "the name of a file, without folders");
    }
    let extension = Path::new(&name).extension().map(|e| e.to_string_lossy().to_lowercase());
    if !extension.is_some_and(|extension| FILM_EXTENSIONS.contains(&extension.as_str())) {
        return refused("not that of a film", "a name that ends in .mp4, .mov, .mkv ..");
    }
    let folder = campaign.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
    let path = project.new_file(&format!("{folder}{name}"))?;
    if path.symlink_metadata().is_ok() {
        return refused("taken", "the name of a new file");
    }
    Ok((campaign_file, path, name))
}

/// What a film of this name would become; nothing is written.
///
/// # Errors
/// As those of a film that is added, apart from its content.
pub(crate) fn drafted(project: &Project, request: &Request) -> Result<Drafted> {
    let (campaign, _, name) = target(project, request)?;
    let objects = files::load_campaign(&campaign)?.value.objects;
    let names: Vec<String> = objects.into_iter().map(|object| object.name).collect();
    let stem = Path::new(&name).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Drafted { objects: named_objects(&stem, &names), name })
}

/// Receives a film and lists it in the campaign.
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
    let (campaign, path, name) = target(project, request)?;
    let given = request.field("objects").unwrap_or_default().split(',').map(str::trim);
    let objects: Vec<String> = given.filter(|object| !object.is_empty()).map(str::to_owned).collect();
    if objects.is_empty() {
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
    let mut footage = Footage::open(&output.path()).map_err(is_film)?;
    footage.next().transpose().map_err(is_film)?;
    drop(footage);
    output.finish()?;
    let undo = edits.append(&campaign, &name, &objects).inspect_err(|_| {
        // The film is of no use without its entry.
        let _ = std::fs::remove_file(&path);
    })?;
    Ok(Added { name, undo })
}
