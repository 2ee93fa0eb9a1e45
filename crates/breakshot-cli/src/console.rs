//! Terminal output: progress, warnings and notes on stderr, results on stdout.

use breakshot::Result;
use breakshot::properties::Assumption;
use breakshot::report::warning_kind;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
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
pub(crate) fn warn(warnings: &[String]) {
    for warning in warnings {
        eprintln!("warning: {warning}");
    }
}

/// Prints the warnings that a file contains to stderr: of many of one kind the first ones, and how many more the file has.
pub(crate) fn warn_by_kind(warnings: &[String], file: &Path) {
    for line in by_kind(warnings, file) {
        eprintln!("warning: {line}");
    }
}

/// More warnings of one kind than this are counted.
const MOST_OF_A_KIND: usize = 3;

/// The warnings by kind, in the order in which the kinds occur first.
fn by_kind(warnings: &[String], file: &Path) -> Vec<String> {
    let mut kinds: Vec<(String, Vec<&String>)> = Vec::new();
    for warning in warnings {
        let kind = warning_kind(warning);
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, same)) => same.push(warning),
            None => kinds.push((kind, vec![warning])),
        }
    }
    let mut lines = Vec::new();
    for (_, same) in kinds {
        let is_many = same.len() > MOST_OF_A_KIND;
        let shown = if is_many { MOST_OF_A_KIND - 1 } else { same.len() };
        lines.extend(same[..shown].iter().map(|warning| (*warning).clone()));
        if is_many {
            let more = same.len() - shown;
            lines.push(format!("{more} more like the last one; {} contains all", file.display()));
        }
    }
    lines
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_warnings_of_one_kind_the_first_are_printed_and_the_others_counted() {
        let jumps = (1..=30).map(|k| format!("clip_{k}.mp4: `a` jumps by {}.5 mm at {k} s", k * 2));
        let mut warnings: Vec<String> = jumps.collect();
        warnings.insert(1, "friction of `b` is absent: no clip shows it slide".into());
        let lines = by_kind(&warnings, Path::new("out.json"));
        let expected = [
            "clip_1.mp4: `a` jumps by 2.5 mm at 1 s",
            "clip_2.mp4: `a` jumps by 4.5 mm at 2 s",
            "28 more like the last one; out.json contains all",
            "friction of `b` is absent: no clip shows it slide",
        ];
        assert_eq!(lines, expected);
        let few = &warnings[..4];
        assert_eq!(by_kind(few, Path::new("out.json")).len(), few.len());
    }
}
