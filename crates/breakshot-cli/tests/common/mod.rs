//! Runs the program as a user would.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A file of the example.
pub(crate) fn demo(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo").join(file)
}

pub(crate) fn breakshot(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_breakshot")).current_dir(folder).args(args).output().unwrap()
}

/// Asserts that the command fails with exit code 2 and one error line that contains all `words`, and that it writes no `out.json`
/// and no `out.csv`.
pub(crate) fn assert_refused(folder: &Path, args: &[&str], words: &[&str]) {
    let output = breakshot(folder, args);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    let errors: Vec<&str> = message.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(errors.len(), 1, "expected one error line: {message}");
    assert!(!message.contains("panicked"), "{message}");
    for word in words {
        assert!(errors[0].contains(word), "`{word}` is not in: {}", errors[0]);
    }
    assert!(
        !folder.join("out.csv").exists() && !folder.join("out.json").exists(),
        "an incomplete result was written"
    );
}
