//! Runs the fuzzers, which are a crate of their own (`fuzz/`): only they need the drivers and the studio.

/// `cargo xtask fuzz` with these words; nothing else is printed, so that a table can be kept.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let program = ["run", "--quiet", "--package", "breakshot-fuzz", "--"];
    crate::check::cargo(&[&program[..], words].concat(), &[])
}
