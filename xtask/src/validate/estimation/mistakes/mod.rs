//! What a user gets wrong, one mistake at a time: is it named, and what does it change?
//!
//! A mistake in a campaign's file is made on the films' saved tracks; one that changes what a camera sees is made on a part of the films.

mod of_films;
mod of_tracks;
mod striker;

use super::saved::Saved;
use crate::validate::row::{self, Row};
use breakshot::Result;
use breakshot::campaign::Campaign;
use breakshot::estimate::{ClipTracks, Options};
use breakshot::properties::Properties;
use breakshot::report::warning_lines;
use breakshot::uncertain::Estimate;
use breakshot::warning::Warning;
use std::collections::BTreeMap;

/// Most characters of a warning in the table.
const SHOWN: usize = 110;

/// A mistake, and words of which a warning that names it contains one.
struct Mistake {
    kind: &'static str,
    size: String,
    named_by: Vec<String>,
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.trim_end_matches(".mp4").to_owned()).collect()
}

/// What `breakshot estimate` answers: properties with warnings, or an error.
type Answer = Result<Properties>;

/// The answer for these clips, with all that `breakshot check` compares.
fn answer(campaign: &Campaign, clips: &[ClipTracks], unreadable: Vec<Warning>) -> Answer {
    breakshot::campaign_properties(campaign, None, clips, unreadable, &Options::default())
}

/// Makes every mistake and prints the table; whether every mistake is named or harmless.
pub(crate) fn validate(saved: &Saved) -> std::result::Result<bool, String> {
    println!(
        "\n| mistake | size | named | largest change (half intervals) | lost | lines | what is said first |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut tally = Tally::default();
    of_tracks::run(saved, &mut tally)?;
    of_films::run(saved, &mut tally)?;
    let rows = [
        Row::plain("mistakes", tally.mistakes as f64, ""),
        Row::at_most(
            "not named, and a result changes by more than its interval",
            tally.silent as f64,
            0.0,
            "",
        ),
        Row::at_most("largest number of lines of warnings on a terminal", tally.most_lines as f64, 10.0, ""),
    ];
    let are_named = row::print_all("Mistakes of a user, one at a time", &rows);
    Ok(row::print_all("The striker in the films of the right campaign", &striker::rows(saved)?) && are_named)
}

/// What all mistakes together came to.
#[derive(Default)]
struct Tally {
    mistakes: usize,
    silent: usize,
    most_lines: usize,
}

impl Tally {
    /// Compares the answer with the right one and prints a line of the table.
    fn add(&mut self, mistake: &Mistake, right: &Properties, wrong: &Answer) {
        self.mistakes += 1;
        let names = |text: &str| mistake.named_by.iter().any(|word| text.contains(word.as_str()));
        let Mistake { kind, size, .. } = mistake;
        let properties = match wrong {
            Ok(properties) => properties,
            Err(error) => {
                let text = error.to_string();
                let named = if names(&text) { "yes" } else { "refused" };
                println!("| {kind} | {size} | {named} | - | all | 1 | {} |", shown(&text));
                return;
            }
        };
        let new: Vec<&String> = properties.warnings.iter().filter(|w| !right.warnings.contains(w)).collect();
        let naming = new.iter().find(|warning| names(warning));
        let (change, lost) = change(right, properties);
        let lines = warning_lines(&properties.warnings, &properties.causes, "properties.json").len();
        self.most_lines = self.most_lines.max(lines);
        let is_silent = naming.is_none() && change > 1.0;
        self.silent += usize::from(is_silent);
        let named = match (naming, is_silent) {
            (Some(_), _) => "yes",
            (None, true) => "NO",
            (None, false) => "no",
        };
        let first = naming.or(new.first()).map_or("-".to_owned(), |warning| shown(warning));
        println!("| {kind} | {size} | {named} | {change:.2} | {lost} | {lines} | {first} |");
    }
}

/// The beginning of a text, fit for a table.
fn shown(text: &str) -> String {
    let line: String = text.replace('|', "/").chars().take(SHOWN).collect();
    if text.chars().count() > SHOWN { line + " .." } else { line }
}

/// The largest change of a mean over half the width of the right interval, and how many values are lost.
fn change(right: &Properties, wrong: &Properties) -> (f64, usize) {
    let groups = |p: &Properties| -> [BTreeMap<String, Estimate>; 4] {
        [p.friction.clone(), p.striker_restitution.clone(), p.restitution.clone(), p.mass_ratio.clone()]
    };
    let (mut largest, mut lost) = (0.0_f64, 0);
    for (right, wrong) in groups(right).iter().zip(&groups(wrong)) {
        for (name, value) in right {
            let [low, high] = value.interval_95;
            match wrong.get(name) {
                // A wider interval that says so is no wrong answer.
                Some(other) => {
                    let half = ((high - low) / 2.0).max((other.interval_95[1] - other.interval_95[0]) / 2.0);
                    if half > 0.0 {
                        largest = largest.max((other.mean - value.mean).abs() / half);
                    }
                }
                None => lost += 1,
            }
        }
    }
    (largest, lost)
}
