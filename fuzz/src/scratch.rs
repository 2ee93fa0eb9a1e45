//! A folder in memory for the files of one input, the same for all inputs of a process.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The folder of this process.
#[derive(Clone, Copy, Debug)]
pub struct Scratch(&'static Path);

impl Scratch {
    /// The folder that the variable `BREAKSHOT_FUZZ_FOLDER` names, or a new one, in memory where the system has such files.
    ///
    /// # Panics
    /// No folder can be made: nothing can be tried then.
    pub fn folder() -> Self {
        static FOLDER: OnceLock<PathBuf> = OnceLock::new();
        let made = || {
            let given = std::env::var_os("BREAKSHOT_FUZZ_FOLDER").map(PathBuf::from);
            given.unwrap_or_else(|| {
                let memory = Path::new("/dev/shm");
                let parent = if memory.is_dir() { memory.to_path_buf() } else { std::env::temp_dir() };
                let made = tempfile::Builder::new().prefix("breakshot-fuzz-").tempdir_in(parent);
                made.map(tempfile::TempDir::keep).expect("a folder for the files of the inputs")
            })
        };
        Self(FOLDER.get_or_init(made))
    }

    /// The path of a file in it.
    pub fn path(self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Writes a file in place, and gives its path: emptying it first makes some file systems wait for the disk.
    ///
    /// # Panics
    /// It cannot be written: nothing can be tried then.
    pub fn write(self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        let written = (|| {
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder)?;
            }
            let mut file = OpenOptions::new().write(true).create(true).truncate(false).open(&path)?;
            file.write_all(bytes)?;
            file.set_len(bytes.len() as u64)
        })();
        written.unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        path
    }

    /// As [`Scratch::write`], once a process: a file that no input changes.
    pub fn keep(self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path(name);
        if path.exists() { path } else { self.write(name, bytes) }
    }
}

/// Tests share the folder: one at a time.
#[cfg(test)]
pub(crate) fn exclusive() -> std::sync::MutexGuard<'static, ()> {
    static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());
    ONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
