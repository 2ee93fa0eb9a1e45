//! Terminal output: progress, warnings and notes on stderr, results on stdout.

use breakshot::Result;
use breakshot::properties::Assumption;
use breakshot::report::warning_kind;
use breakshot::warning::{WarningGroup, by_cause};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::collections::BTreeSet;
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

/// Prints the warnings that a file contains to stderr: one line for each cause, the first warnings of each below it, and how many more the
/// file has.
pub(crate) fn warn_by_cause(lines: &[String], causes: &[WarningGroup], file: &Path) {
    for line in cause_lines(lines, causes, file) {
        eprintln!("{line}");
    }
}

/// More warnings of one cause than this are counted.
const MOST_OF_A_CAUSE: usize = 4;

/// The lines for the terminal: each cause with its first warnings, preferably of different kinds.
fn cause_lines(lines: &[String], causes: &[WarningGroup], file: &Path) -> Vec<String> {
    let mut shown = Vec::new();
    for (group, own) in by_cause(lines, causes) {
        shown.push(format!("warning: {}", group.summary));
        let mut kinds = BTreeSet::new();
        let (first, further): (Vec<&String>, Vec<&String>) =
            own.iter().partition(|line| kinds.insert(warning_kind(line)));
        let all = first.into_iter().chain(further);
        let most = if own.len() > MOST_OF_A_CAUSE { MOST_OF_A_CAUSE - 1 } else { own.len() };
        shown.extend(all.take(most).map(|line| format!("  {line}")));
        if own.len() > most {
            shown.push(format!("  and {} more: {} lists all", own.len() - most, file.display()));
        }
    }
    shown
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
    use breakshot::warning::{Cause, GroupedWarnings, Warning};

    #[test]
    fn of_many_warnings_of_one_cause_some_of_each_kind_are_printed_and_the_others_counted() {
        let strikes = (1..=30).map(|k| {
            Warning::of_clip(
                Cause::GivenStrike,
                &format!("clip {k}.mp4"),
                format!("`a` leaves {k}.5 degrees to the left"),
            )
        });
        let mut warnings: Vec<Warning> = strikes.collect();
        warnings.push(Warning::of_clip(Cause::GivenStrike, "clip 7.mp4", "`a` does not move"));
        warnings
            .insert(0, Warning::new(Cause::NotMeasured, "friction of `b` is absent: no clip shows it slide"));
        let GroupedWarnings { lines, causes } = warnings.into();
        let shown = cause_lines(&lines, &causes, Path::new("out.json"));
        let expected = [
            "  clip 1.mp4: `a` leaves 1.5 degrees to the left",
            "  clip 7.mp4: `a` does not move",
            "  clip 2.mp4: `a` leaves 2.5 degrees to the left",
            "  and 28 more: out.json lists all",
        ];
        assert!(
            shown[0].starts_with("warning: the given strike does not fit the film in 30 clips: "),
            "{}",
            shown[0]
        );
        assert_eq!(shown[1..5], expected);
        assert_eq!(shown[6..], ["  friction of `b` is absent: no clip shows it slide"]);
    }
}
