//! Terminal output: progress, warnings and notes on stderr, results on stdout.

use breakshot::Result;
use breakshot::properties::Assumption;
use breakshot::report::warning_lines;
use breakshot::warning::WarningGroup;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::fmt::Display;
use std::io::IsTerminal;
use std::path::Path;

/// A progress bar on stderr; hidden if stderr is not a terminal.
pub(crate) fn progress(length: usize, what: &'static str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{msg:<12} {wide_bar} {pos}/{len}  {eta}")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_style(style).with_message(what)
}

/// A sign on stderr that work of unknown length goes on; hidden if stderr is not a terminal.
pub(crate) fn activity(what: &'static str) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new_spinner().with_message(what);
    bar.enable_steady_tick(std::time::Duration::from_millis(120));
    bar
}

/// Prints warnings to stderr, one per line.
pub(crate) fn warn(warnings: &[impl Display]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// Prints the warnings that a file contains to stderr: of each cause the first ones ([`warning_lines`]).
pub(crate) fn warn_by_cause(warnings: &[String], causes: &[WarningGroup], file: &Path) {
    for line in warning_lines(warnings, causes, &file.display().to_string()) {
        eprintln!("{line}");
    }
}

/// Prints the assumed values of properties that no clip measured to stderr.
pub(crate) fn assumed(values: &[Assumption]) {
    if values.is_empty() {
        return;
    }
    let what = match values.len() {
        1 => "1 property was not measured and is assumed".to_owned(),
        count => format!("{count} properties were not measured and are assumed"),
    };
    eprintln!("warning: {what}:");
    for value in values {
        eprintln!("  {value}");
    }
}

/// Prints notes to stderr, one per line: information that is not a warning.
pub(crate) fn note(notes: &[String]) {
    for text in notes {
        eprintln!("note: {text}");
    }
}

/// Prints a hint to stderr if a person reads it: another command that may help.
pub(crate) fn hint(text: &str) {
    if std::io::stderr().is_terminal() {
        eprintln!("hint: {text}");
    }
}

/// Prints a result to stdout as indented JSON.
pub(crate) fn print_json<T: Serialize>(value: &T) -> Result<()> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| breakshot::Error::Write { path: "stdout".into(), source: std::io::Error::other(e) })?;
    println!("{text}");
    Ok(())
}
