//! Outputs that another program writes, or that are folders: they get their name when they are complete.
//!
//! A file has no name until then, where the system has such files. Everything else has a temporary name and is locked by the program
//! that writes it: the next output in its folder removes what a program that was killed has left.

use super::temporary::{locked_file, remove_leftovers, temporary_name};
use super::whole::{NewFile, check_file_name};
use crate::error::{Error, Result};
use std::fs::File;
use std::io::Result as IoResult;
use std::path::{Path, PathBuf};
use tempfile::{NamedTempFile, TempDir};

/// A path by which this program and others reach a file without a name.
#[cfg(target_os = "linux")]
fn path_of(file: &File) -> Option<PathBuf> {
    use std::os::fd::AsRawFd;

    // The number of this process; `self` would be that of the program that opens the path.
    let process = std::fs::read_link("/proc/self").ok()?;
    let path = Path::new("/proc").join(process).join("fd").join(file.as_raw_fd().to_string());
    path.exists().then_some(path)
}

#[cfg(not(target_os = "linux"))]
fn path_of(_file: &File) -> Option<PathBuf> {
    None
}

/// An output that is being written; it is removed unless it is [finished](Unfinished::finish).
#[derive(Debug)]
pub struct Unfinished {
    target: PathBuf,
    form: Form,
}

#[derive(Debug)]
enum Form {
    /// A file without a name, where the system has such files.
    Nameless(PathBuf, NewFile, File),
    Named(NewFile, NamedTempFile),
    /// A folder, and its lock where folders have locks.
    Folder(TempDir, Option<File>),
    /// A device, which gets the bytes as they are.
    Device,
}

impl Unfinished {
    /// A new file, which replaces an existing one in the end.
    ///
    /// # Errors
    /// A name with control characters, a folder that is missing or not writable.
    pub fn file(path: &Path) -> Result<Self> {
        let begin = || -> IoResult<Form> {
            let Some(new) = NewFile::at(path) else { return Ok(Form::Device) };
            match new.nameless().and_then(|file| Some((path_of(&file)?, file))) {
                Some((path, file)) => Ok(Form::Nameless(path, new, file)),
                None => locked_file(&new.folder).map(|file| Form::Named(new, file)),
            }
        };
        Self::begun(path, begin)
    }

    /// A new folder; an existing one is not replaced.
    ///
    /// # Errors
    /// A name with control characters, a folder around it that is missing or not writable.
    pub fn folder(path: &Path) -> Result<Self> {
        let begin = || -> IoResult<Form> {
            let around = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            remove_leftovers(around);
            let mut builder = temporary_name();
            #[cfg(unix)]
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
            loop {
                let folder = builder.tempdir_in(around)?;
                let lock = File::open(folder.path()).ok().filter(|lock| lock.lock().is_ok());
                if folder.path().exists() {
                    return Ok(Form::Folder(folder, lock));
                }
            }
        };
        Self::begun(path, begin)
    }

    fn begun(path: &Path, begin: impl FnOnce() -> IoResult<Form>) -> Result<Self> {
        check_file_name(path)?;
        let form = begin().map_err(|source| Error::Write { path: path.into(), source })?;
        Ok(Self { target: path.into(), form })
    }

    /// Where to write it: a path for this program and for those that it starts.
    pub fn path(&self) -> PathBuf {
        match &self.form {
            Form::Nameless(path, ..) => path.clone(),
            Form::Named(_, file) => file.path().into(),
            Form::Folder(folder, _) => folder.path().into(),
            Form::Device => self.target.clone(),
        }
    }

    /// Gives the output its name; its bytes are on the disk then.
    ///
    /// # Errors
    /// A full disk; a folder of that name that is not empty.
    pub fn finish(self) -> Result<()> {
        let target = self.target;
        let finish = || match self.form {
            Form::Nameless(_, new, file) if new.named(&file)? => Ok(()),
            Form::Nameless(..) => Err(std::io::Error::other("the system cannot give it its name")),
            Form::Named(new, file) => new.renamed(file),
            Form::Folder(folder, lock) => {
                for entry in std::fs::read_dir(folder.path())? {
                    File::open(entry?.path())?.sync_all()?;
                }
                std::fs::rename(folder.path(), &target)?;
                // Nothing is left to be removed.
                let _ = folder.keep();
                drop(lock);
                Ok(())
            }
            Form::Device => Ok(()),
        };
        finish().map_err(|source| Error::Write { path: target.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::super::names;
    use super::*;
    use std::fs;

    #[test]
    fn an_output_has_its_name_when_it_is_finished_and_leaves_nothing_otherwise() {
        let folder = tempfile::tempdir().unwrap();
        let (film, images) = (folder.path().join("film.mp4"), folder.path().join("images"));
        for finishes in [false, true] {
            let file = Unfinished::file(&film).unwrap();
            fs::write(file.path(), b"film").unwrap();
            let pictures = Unfinished::folder(&images).unwrap();
            fs::write(pictures.path().join("0.png"), b"png").unwrap();
            assert!(!film.exists() && !images.exists());
            if finishes {
                file.finish().unwrap();
                pictures.finish().unwrap();
            }
        }
        assert_eq!(fs::read(&film).unwrap(), b"film");
        assert_eq!(names(&images), ["0.png"]);
        // A folder with content is not replaced.
        let again = Unfinished::folder(&images).unwrap();
        fs::write(again.path().join("1.png"), b"png").unwrap();
        again.finish().unwrap_err();
        assert_eq!(names(&images), ["0.png"]);
        assert_eq!(names(folder.path()), ["film.mp4", "images"]);
    }

    #[test]
    fn what_a_killed_program_left_is_removed_and_what_another_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let left =
            [".breakshot-left.part", ".breakshot-left_folder.part"].map(|name| folder.path().join(name));
        fs::write(&left[0], b"half").unwrap();
        fs::create_dir(&left[1]).unwrap();
        fs::write(left[1].join("0.png"), b"half").unwrap();
        fs::write(folder.path().join(".breakshot-settings"), b"the user's own").unwrap();
        let written = locked_file(folder.path()).unwrap();
        super::super::write_whole(&folder.path().join("out"), b"1").unwrap();
        let written_name = written.path().file_name().unwrap().to_str().unwrap().to_owned();
        let mut expected = vec![written_name, ".breakshot-settings".into(), "out".into()];
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }
}
