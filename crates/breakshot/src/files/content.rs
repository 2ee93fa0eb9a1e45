//! Do two files have the same content?

use std::fs::File;
use std::io::{BufReader, Read, Result};
use std::path::{Path, PathBuf};

/// A file or folder whose content is compared with others.
pub(super) struct Content {
    /// The path without links; `None` if it is no path of the disk.
    path: Option<PathBuf>,
    /// The length of a file (bytes).
    length: Option<u64>,
}

impl Content {
    pub(super) fn of(path: &Path) -> Self {
        let length = path.metadata().ok().filter(std::fs::Metadata::is_file).map(|metadata| metadata.len());
        Self { path: path.canonicalize().ok(), length }
    }

    /// Whether both are the same file or folder, or files of the same bytes.
    fn equals(&self, other: &Self) -> Result<bool> {
        let (Some(one), Some(two)) = (&self.path, &other.path) else { return Ok(false) };
        match (self.length, other.length) {
            _ if one == two => Ok(true),
            (Some(length), Some(of_other)) if length == of_other => same_bytes(one, two),
            _ => Ok(false),
        }
    }
}

/// The first of the contents before number `k` that is equal to it, of those that `comparable` admits.
pub(super) fn first_equal(
    contents: &[Content],
    k: usize,
    comparable: impl Fn(usize) -> bool,
) -> Result<Option<usize>> {
    for other in (0..k).filter(|other| comparable(*other)) {
        if contents[k].equals(&contents[other])? {
            return Ok(Some(other));
        }
    }
    Ok(None)
}

/// Whether two files have the same bytes.
fn same_bytes(one: &Path, two: &Path) -> Result<bool> {
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
