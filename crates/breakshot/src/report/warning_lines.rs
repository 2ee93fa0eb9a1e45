//! Warnings for a terminal: few lines, the cause to mend first in front.

use crate::warning::{WarningGroup, by_cause};
use std::collections::BTreeSet;

/// Warnings that are shown of the first cause, and of each further one.
const MOST_OF_THE_FIRST: usize = 3;
const MOST_OF_A_FURTHER_ONE: usize = 1;

/// The lines that a terminal shows of the warnings in `file`.
///
/// Each cause is a line with what to do, and below it are its first warnings, of different kinds where there are several. The warnings that an
/// earlier cause may explain are one line together.
pub fn warning_lines(warnings: &[String], causes: &[WarningGroup], file: &str) -> Vec<String> {
    let is_mistake = |group: &WarningGroup| !group.cause.is_consequence();
    let any_mistake = causes.iter().any(is_mistake);
    let (mut shown, mut left_out, mut explained) = (Vec::new(), 0, Vec::new());
    for (number, (group, own)) in by_cause(warnings, causes).enumerate() {
        if any_mistake && !is_mistake(group) {
            explained.push(group);
            left_out += own.len();
            continue;
        }
        shown.push(format!("warning: {}", group.summary));
        let is_further = any_mistake && number > 0;
        let most = if is_further { MOST_OF_A_FURTHER_ONE } else { MOST_OF_THE_FIRST };
        let more = own.len().saturating_sub(most);
        shown.extend(of_different_kinds(own).take(most).map(|line| format!("  {line}")));
        if let Some(last) = shown.pop() {
            shown.push(if more > 0 { format!("{last} (and {more} more)") } else { last });
        }
        left_out += more;
    }
    if !explained.is_empty() {
        let count: usize = explained.iter().map(|group| group.warnings).sum();
        let what: Vec<&str> =
            explained.iter().map(|group| group.summary.split(": ").next().unwrap_or_default()).collect();
        let further =
            if count == 1 { "1 further warning".to_owned() } else { format!("{count} further warnings") };
        shown.push(format!("warning: {further} may follow from these: {}", what.join("; ")));
    }
    if left_out > 0 {
        shown.push(format!("note: {file} lists all warnings"));
    }
    shown
}

/// One line of each kind, and then the others.
fn of_different_kinds(lines: &[String]) -> impl Iterator<Item = &String> {
    let mut kinds = BTreeSet::new();
    let (first, others): (Vec<&String>, Vec<&String>) =
        lines.iter().partition(|line| kinds.insert(kind(line)));
    first.into_iter().chain(others)
}

/// What warnings about different clips, objects and values have in common: the text without the name of the clip, quoted names and
/// numbers.
fn kind(warning: &str) -> String {
    let clip = warning.split_once(": ").filter(|(name, _)| !name.contains(' '));
    let text = clip.map_or(warning, |(_, text)| text);
    // Every second part is between quotation marks.
    let unquoted = text.split('`').step_by(2);
    unquoted.flat_map(str::chars).filter(|c| !c.is_ascii_digit() && !"+-.".contains(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warning::{Cause, GroupedWarnings, Warning};

    #[test]
    fn the_first_cause_has_some_lines_of_each_kind_and_what_it_may_explain_has_one() {
        let strike = |k: usize| {
            let text = format!("`a` leaves {k}.5 degrees to the left");
            Warning::of_clip(Cause::GivenStrike, &format!("{k}.mp4"), text)
        };
        let mut warnings: Vec<Warning> = (1..=30).map(strike).collect();
        warnings.push(Warning::of_clip(Cause::GivenStrike, "7.mp4", "`a` does not move"));
        warnings.push(Warning::of_clip(Cause::CameraMotion, "8.mp4", "the camera moved by 2 px"));
        warnings.push(Warning::of_clip(Cause::CameraMotion, "9.mp4", "the camera moved by 1 px"));
        warnings
            .insert(0, Warning::new(Cause::NotMeasured, "friction of `b` is absent: no clip shows it slide"));
        let GroupedWarnings { lines, causes } = warnings.into();
        let shown = warning_lines(&lines, &causes, "out.json");
        let expected = [
            "warning: the given strike does not fit the film in 30 clips",
            "  1.mp4: `a` leaves 1.5 degrees to the left",
            "  7.mp4: `a` does not move",
            "  2.mp4: `a` leaves 2.5 degrees to the left (and 28 more)",
            "warning: the camera moved in 2 clips",
            "  8.mp4: the camera moved by 2 px (and 1 more)",
            "warning: 1 further warning may follow from these: values are not measured by any clip, and are assumed in plans",
            "note: out.json lists all warnings",
        ];
        assert_eq!(shown.len(), expected.len(), "{shown:#?}");
        assert!(shown.iter().zip(expected).all(|(line, start)| line.starts_with(start)), "{shown:#?}");
    }

    #[test]
    fn without_an_earlier_cause_each_one_is_shown() {
        let warnings = vec![
            Warning::new(Cause::NotMeasured, "friction of `b` is absent: no clip shows it slide"),
            Warning::of_clip(Cause::Contradiction, "1.mp4", "left out"),
        ];
        let GroupedWarnings { lines, causes } = warnings.into();
        let shown = warning_lines(&lines, &causes, "out.json");
        assert_eq!((shown[1].as_str(), shown.len()), ("  1.mp4: left out", 4), "{shown:#?}");
        assert!(warning_lines(&[], &[], "out.json").is_empty());
    }
}
