//! Outputs that are not complete: their names, their locks, and what killed programs have left of them.

use std::fs::File;
use std::io::Result as IoResult;
use std::path::Path;
use tempfile::{Builder, NamedTempFile};

/// How the names of outputs that are not complete begin and end.
const BEGIN: &str = ".breakshot-";
const END: &str = ".part";

/// The form of the names of outputs that are not complete.
pub(super) fn temporary_name() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(BEGIN).suffix(END);
    builder
}

/// A file with a temporary name that no other program removes.
pub(super) fn locked_file(folder: &Path) -> IoResult<NamedTempFile> {
    let mut builder = temporary_name();
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        let file = builder.tempfile_in(folder)?;
        // A file system without locks has no leftovers that are removed.
        let _ = file.as_file().lock();
        // Another program may have removed it before it was locked.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes temporary files and folders that nobody has locked: those of programs that were killed.
pub(super) fn remove_leftovers(folder: &Path) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_ours = name.to_str().is_some_and(|name| name.starts_with(BEGIN) && name.ends_with(END));
        let Ok(kind) = entry.file_type() else { continue };
        if !is_ours || kind.is_symlink() {
            continue;
        }
        let path = entry.path();
        let is_left = File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        // An error leaves the file for the next output.
        let _ = match kind.is_dir() {
            _ if !is_left => Ok(()),
            true => std::fs::remove_dir_all(&path),
            false => std::fs::remove_file(&path),
        };
    }
}
