//! Do two files have the same content, and is it the one of an earlier run?

use crate::campaign::{Campaign, Clip, Source};
use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::files::film_path::FilmPath;
use crate::fingerprint::Fingerprint;
use crate::object::kind;
use std::fs::File;
use std::io::{BufReader, Read, Result as IoResult};
use std::path::{Path, PathBuf};

/// A file or folder whose content is compared with others.
pub(super) struct Content {
    /// The path without links; `None` if it is no path of the disk.
    path: Option<PathBuf>,
    /// The length of a file (bytes).
    length: Option<u64>,
    /// The topic of a bag, if it is given.
    topic: Option<String>,
}

impl Content {
    pub(super) fn of(path: &Path) -> Self {
        let FilmPath { file, topic } = FilmPath::of(path);
        let length = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|metadata| metadata.len());
        Self { path: file.canonicalize().ok(), length, topic }
    }

    /// Whether both are the same file or folder, or files of the same bytes.
    fn equals(&self, other: &Self) -> IoResult<bool> {
        // A bag without a given topic has only one that is read.
        let are_of_two_topics = self.topic.as_ref().zip(other.topic.as_ref()).is_some_and(|(a, b)| a != b);
        // Lengths first: among very many films most pairs differ in them.
        if self.length != other.length || are_of_two_topics {
            return Ok(false);
        }
        let (Some(one), Some(two)) = (&self.path, &other.path) else { return Ok(false) };
        Ok(one == two || (self.length.is_some() && same_bytes(one, two)?))
    }
}

/// The first of the contents before number `k` that is equal to it, of those that `comparable` admits.
pub(super) fn first_equal(
    contents: &[Content],
    k: usize,
    comparable: impl Fn(usize) -> bool,
) -> IoResult<Option<usize>> {
    for other in (0..k).filter(|other| comparable(*other)) {
        if contents[k].equals(&contents[other])? {
            return Ok(Some(other));
        }
    }
    Ok(None)
}

/// Whether two files have the same bytes.
fn same_bytes(one: &Path, two: &Path) -> IoResult<bool> {
    /// Bytes that are compared at a time.
    const BLOCK: u64 = 1 << 16;
    let (mut one, mut two) = (BufReader::new(File::open(one)?), BufReader::new(File::open(two)?));
    let (mut block, mut of_two) = (Vec::new(), Vec::new());
    loop {
        block.clear();
        of_two.clear();
        one.by_ref().take(BLOCK).read_to_end(&mut block)?;
        two.by_ref().take(BLOCK).read_to_end(&mut of_two)?;
        if block != of_two {
            return Ok(false);
        }
        if block.is_empty() {
            return Ok(true);
        }
    }
}

/// A hash (32 hexadecimal digits) of all that the tracks of a clip depend on: the bytes of its film or table, its entry in the campaign,
/// the kinds of its objects, the cell without the robot, and the version of this library. Where the files lie does not matter.
///
/// # Errors
/// A film that cannot be read; a cell whose camera contradicts itself.
pub fn clip_input(campaign: &Campaign, clip: &Clip) -> Result<String> {
    let cell =
        Cell { robot: None, camera: campaign.cell.camera.resolved("the cell")?, ..campaign.cell.clone() };
    let kinds = campaign.objects.iter().filter(|o| clip.objects.iter().any(|name| kind(name) == o.name));
    let columns = match &clip.source {
        Source::Film(_) => None,
        Source::Tracks { columns, .. } => columns.as_ref(),
    };
    let description = (
        env!("CARGO_PKG_VERSION"),
        cell,
        kinds.collect::<Vec<_>>(),
        (&clip.objects, &clip.strike, &clip.placed, &clip.excluded_s, &clip.starts),
        (clip.source.key(), clip.frame_rate_hz, columns),
    );
    let hash = Fingerprint::default().with(format!("{description:?}").as_bytes());
    let path = clip.source.path();
    let FilmPath { file, topic } = FilmPath::of(path);
    let hash = topic.map_or(hash, |topic| hash.with(topic.as_bytes()));
    hash_of_file(hash, &file)
        .map(|hash| hash.to_string())
        .map_err(|source| Error::Read { path: path.into(), source })
}

/// A hash continued by the bytes of a file, or by names and bytes of all files in a folder; lengths keep them apart.
fn hash_of_file(hash: Fingerprint, path: &Path) -> IoResult<Fingerprint> {
    /// Bytes that are read at a time.
    const BLOCK: usize = 1 << 16;
    if path.is_dir() {
        let entries = std::fs::read_dir(path)?.map(|entry| Ok(entry?.path()));
        let mut files = entries
            .filter(|file| !matches!(file, Ok(file) if !file.is_file()))
            .collect::<IoResult<Vec<_>>>()?;
        files.sort();
        return files.iter().try_fold(hash, |hash, file| {
            let name = file.file_name().unwrap_or_default().as_encoded_bytes();
            hash_of_file(hash.with(&(name.len() as u64).to_le_bytes()).with(name), file)
        });
    }
    let mut reader = BufReader::with_capacity(BLOCK, File::open(path)?);
    let (mut hash, mut length) = (hash, 0_u64);
    loop {
        let block = std::io::BufRead::fill_buf(&mut reader)?;
        if block.is_empty() {
            return Ok(hash.with(&length.to_le_bytes()));
        }
        let read = block.len();
        hash = hash.with(block);
        length += read as u64;
        std::io::BufRead::consume(&mut reader, read);
    }
}
