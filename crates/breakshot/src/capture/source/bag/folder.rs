//! The files of a bag that is a folder: `metadata.yaml` of rosbag2 and the files that it lists.

use crate::capture::source::error::SourceError;
use crate::capture::source::image_files::TIMING;
use crate::cell::yaml;
use serde::Deserialize;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

type Result<T> = std::result::Result<T, SourceError>;

const METADATA: &str = "metadata.yaml";
/// Largest such file (bytes): a line a topic and a few lines a file.
const MAX_METADATA_BYTES: u64 = 4 << 20;
/// Most files of a bag.
const MAX_FILES: usize = 10_000;

#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

/// What is used of the file.
#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    storage_identifier: String,
    relative_file_paths: Vec<PathBuf>,
    #[serde(default)]
    compression_format: Option<String>,
    #[serde(default)]
    compression_mode: Option<String>,
}

/// Whether a folder is a bag, and not one of pictures.
pub(in crate::capture::source) fn is_bag(folder: &Path) -> bool {
    if folder.join(TIMING).is_file() {
        return false;
    }
    folder.join(METADATA).is_file()
        || files_named(folder, &["mcap", "db3"]).is_ok_and(|files| !files.is_empty())
}

/// The MCAP files of a bag that is a folder, in their order.
///
/// # Errors
/// A bag of another storage, one whose files or messages are compressed, several files without `metadata.yaml`.
pub(super) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let file = folder.join(METADATA);
    if !file.is_file() {
        return files_without_metadata(folder);
    }
    let damaged =
        |problem: String| SourceError::damaged(format!("a {METADATA} that cannot be read ({problem})"));
    let mut text = String::new();
    let read = File::open(&file).and_then(|file| file.take(MAX_METADATA_BYTES).read_to_string(&mut text));
    read.map_err(|e| damaged(e.to_string()))?;
    let value = yaml::value(&text).map_err(damaged)?;
    let metadata: Metadata = serde_json::from_value(value).map_err(|e| damaged(e.to_string()))?;
    let Information { storage_identifier, relative_file_paths, compression_format, compression_mode } =
        metadata.rosbag2_bagfile_information;
    let mode = compression_mode.unwrap_or_default().to_lowercase();
    if matches!(mode.as_str(), "file" | "message")
        && compression_format.is_some_and(|format| !format.is_empty())
    {
        return Err(SourceError::of_compressed_bag(&format!("a bag whose {mode}s are compressed")));
    }
    match storage_identifier.as_str() {
        "mcap" => {}
        "sqlite3" => return Err(SourceError::of_sqlite()),
        other => {
            let found = format!("a bag of storage `{}`", other.escape_debug());
            return Err(SourceError::unsuitable(found, "storage `mcap`"));
        }
    }
    if relative_file_paths.is_empty() || relative_file_paths.len() > MAX_FILES {
        let found = format!("a bag of {} files", relative_file_paths.len());
        return Err(SourceError::unsuitable(found, format!("1 to {MAX_FILES} files")));
    }
    relative_file_paths.iter().map(|path| inside(folder, path)).collect()
}

/// The path of a file inside the folder.
fn inside(folder: &Path, path: &Path) -> Result<PathBuf> {
    if !path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
        let found = format!("a {METADATA} that names `{}`", path.display());
        return Err(SourceError::unsuitable(found, "files in the folder of the bag"));
    }
    let file = folder.join(path);
    if file.is_file() {
        return Ok(file);
    }
    Err(SourceError::damaged(format!(
        "a bag without the file `{}` that its {METADATA} names",
        path.display()
    )))
}

fn files_without_metadata(folder: &Path) -> Result<Vec<PathBuf>> {
    let unreadable = |e: std::io::Error| SourceError::damaged(format!("unreadable ({e})"));
    let files = files_named(folder, &["mcap"]).map_err(unreadable)?;
    match files.len() {
        0 => Err(SourceError::of_sqlite()),
        1 => Ok(files),
        count => Err(SourceError::unsuitable(
            format!("a folder with {count} MCAP files and no {METADATA}"),
            format!("the {METADATA} of the bag (`ros2 bag reindex FOLDER`), or one of the files"),
        )),
    }
}

/// The files in a folder with one of these extensions.
fn files_named(folder: &Path, extensions: &[&str]) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().unwrap_or_default();
        if extensions.iter().any(|wanted| extension.eq_ignore_ascii_case(wanted)) && path.is_file() {
            files.push(path);
        }
    }
    Ok(files)
}
