//! Output files: whole or not at all, whatever ends the program.
//!
//! The bytes are written to a file without a name where the system has such files, and get their name when they are on the disk:
//! a program that is killed leaves nothing behind, or what the next one removes. An existing file is replaced in one step and keeps its permissions.

use super::temporary::{locked_file, remove_leftovers, temporary_name};
use crate::error::{Error, Result};
use std::fs::{File, OpenOptions, Permissions};
use std::io::{Result as IoResult, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes a file whole or not at all. A device or a pipe gets the bytes as they are.
///
/// # Errors
/// A name with control characters, a folder that is missing or not writable, a full disk.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    check_file_name(path)?;
    write(path, bytes).map_err(|source| Error::Write { path: path.into(), source })
}

/// Checks that a path can be shown on one line.
///
/// # Errors
/// A path with control characters.
pub fn check_file_name(path: &Path) -> Result<()> {
    let name = path.to_string_lossy();
    if name.contains(char::is_control) {
        return Err(Error::invalid(
            "a file",
            "name",
            format!("{name:?}"),
            "a name without control characters",
        ));
    }
    Ok(())
}

fn write(path: &Path, bytes: &[u8]) -> IoResult<()> {
    let Some(new) = NewFile::at(path) else {
        return OpenOptions::new().write(true).open(path)?.write_all(bytes);
    };
    match new.nameless() {
        Some(mut file) => {
            file.write_all(bytes)?;
            if new.named(&file)? { Ok(()) } else { new.write_temporary(bytes) }
        }
        None => new.write_temporary(bytes),
    }
}

/// A file that is about to be written.
#[derive(Debug)]
pub(super) struct NewFile {
    target: PathBuf,
    pub(super) folder: PathBuf,
    /// The permissions of the file that is replaced.
    permissions: Option<Permissions>,
}

impl NewFile {
    /// A file at a path, or in the place of the one there; `None` for a device or a pipe. What killed programs have left beside it
    /// is removed.
    pub(super) fn at(path: &Path) -> Option<Self> {
        // A link stays a link: the file that it names is replaced.
        let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.into());
        let existing = std::fs::metadata(&target).ok();
        if existing.as_ref().is_some_and(|file| !file.is_file() && !file.is_dir()) {
            return None;
        }
        let folder =
            target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_path_buf();
        remove_leftovers(&folder);
        Some(Self { permissions: existing.map(|file| file.permissions()), folder, target })
    }

    /// A file without a name; `None` where the system has no such files.
    #[cfg(target_os = "linux")]
    pub(super) fn nameless(&self) -> Option<File> {
        use rustix::fs::{Mode, OFlags, open};

        let flags = OFlags::WRONLY | OFlags::TMPFILE | OFlags::CLOEXEC;
        // The system removes what the user's mask forbids.
        let file = File::from(open(&self.folder, flags, Mode::from_raw_mode(0o666)).ok()?);
        // Before it has a temporary name: another program removes files that nobody has locked.
        file.lock().is_ok().then_some(file)
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn nameless(&self) -> Option<File> {
        None
    }

    /// Gives a file without a name its name; false where the system cannot do that.
    #[cfg(target_os = "linux")]
    pub(super) fn named(&self, file: &File) -> IoResult<bool> {
        use rustix::fs::{AtFlags, CWD, linkat};
        use std::os::fd::AsRawFd;

        self.complete(file)?;
        // A name of its own first: a link cannot replace the target.
        let nameless = format!("/proc/self/fd/{}", file.as_raw_fd());
        let link = |name: &Path| Ok(linkat(CWD, nameless.as_str(), CWD, name, AtFlags::SYMLINK_FOLLOW)?);
        let Ok(named) = temporary_name().make_in(&self.folder, link) else { return Ok(false) };
        named.persist(&self.target).map_err(|e| e.error)?;
        self.sync_folder();
        Ok(true)
    }

    #[cfg(not(target_os = "linux"))]
    pub(super) fn named(&self, _file: &File) -> IoResult<bool> {
        Ok(false)
    }

    /// Gives a file with a temporary name its name.
    pub(super) fn renamed(&self, file: NamedTempFile) -> IoResult<()> {
        self.complete(file.as_file())?;
        file.persist(&self.target).map_err(|e| e.error)?;
        self.sync_folder();
        Ok(())
    }

    /// Writes a temporary file beside the target and renames it.
    fn write_temporary(&self, bytes: &[u8]) -> IoResult<()> {
        let mut file = locked_file(&self.folder)?;
        file.write_all(bytes)?;
        self.renamed(file)
    }

    /// Sets the permissions of a file whose bytes are written, and waits until they are on the disk.
    fn complete(&self, file: &File) -> IoResult<()> {
        if let Some(permissions) = &self.permissions {
            file.set_permissions(permissions.clone())?;
        }
        file.sync_all()
    }

    /// The name is on the disk when its folder is; a system that cannot do that has written the file nevertheless.
    fn sync_folder(&self) {
        let _ = File::open(&self.folder).and_then(|folder| folder.sync_all());
    }
}

#[cfg(test)]
mod tests {
    use super::super::names;
    use super::*;
    use std::fs;

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_permissions_and_its_link() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("out.json"), folder.path().join("link.json"));
        write_whole(&file, b"old").unwrap();
        fs::set_permissions(&file, Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("out.json", &link).unwrap();
        write_whole(&link, b"new").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o640);
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(names(folder.path()), ["link.json", "out.json"]);
    }

    #[test]
    fn the_temporary_file_of_systems_without_nameless_files_is_removed_too() {
        let folder = tempfile::tempdir().unwrap();
        let new = |name: &str| NewFile {
            target: folder.path().join(name),
            folder: folder.path().into(),
            permissions: None,
        };
        new("a").write_temporary(b"1").unwrap();
        fs::create_dir(folder.path().join("b")).unwrap();
        new("b").write_temporary(b"1").unwrap_err();
        assert_eq!(names(folder.path()), ["a", "b"]);
    }

    #[test]
    fn writers_of_one_file_leave_one_whole_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("out");
        std::thread::scope(|scope| {
            for byte in 0..8u8 {
                let file = &file;
                scope.spawn(move || (0..20).for_each(|_| write_whole(file, &vec![byte; 100_000]).unwrap()));
            }
        });
        let bytes = fs::read(&file).unwrap();
        assert!(bytes.len() == 100_000 && bytes.iter().all(|b| *b == bytes[0]), "a mixture");
        assert_eq!(names(folder.path()), ["out"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_device_gets_the_bytes_and_stays_a_device() {
        use std::os::unix::fs::FileTypeExt;
        write_whole(Path::new("/dev/null"), b"1").unwrap();
        let message = write_whole(Path::new("/dev/full"), b"1").unwrap_err().to_string();
        assert!(message.contains("/dev/full") && message.contains("No space left"), "{message}");
        assert!(fs::metadata("/dev/full").unwrap().file_type().is_char_device());
    }

    #[test]
    fn a_name_with_control_characters_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = write_whole(&folder.path().join("a\nb"), b"1").unwrap_err().to_string();
        assert!(message.contains("a\\nb") && !message.contains('\n'), "{message}");
        assert!(names(folder.path()).is_empty());
    }
}
