//! Mutations at random, without knowledge of what they reach.

use crate::splitmix::Draw;
use crate::{Outcome, Run, Target};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Number of inputs between two lines of progress.
const REPORT: usize = 50_000;

/// What became of the inputs.
#[derive(Default)]
struct Outcomes {
    read: usize,
    /// Refusals by their words, numbers left out.
    refused: BTreeMap<String, usize>,
    longest: Duration,
    memory_mb: f64,
}

/// How many inputs were tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All of them.
    pub inputs: usize,
    /// Those that were read; the others were refused.
    pub read: usize,
}

/// Gives a target so many mutated seeds; every one that panics, takes too long or needs too much memory is kept in a folder.
///
/// # Errors
/// The number of inputs that went wrong; a folder that cannot be written.
pub fn mutate(target: &Target, count: usize, folder: &Path) -> Result<Counts, String> {
    let seeds = (target.seeds)();
    target.prepare();
    let mut draw = Draw::new(1);
    let mut outcomes = Outcomes::default();
    let mut bad = Vec::new();
    for number in 0..count {
        let bytes = mutated(target, &seeds, &mut draw);
        let wrong = match catch_unwind(AssertUnwindSafe(|| target.run(&bytes))) {
            Err(_) => Some("panicked".to_string()),
            Ok(Err(wrong)) => Some(wrong),
            Ok(Ok(run)) => {
                outcomes.add(&run);
                None
            }
        };
        if let Some(wrong) = wrong {
            bad.push(format!("{}: {wrong}", kept(folder, target, number, &bytes)?.display()));
        }
        if (number + 1).is_multiple_of(REPORT) {
            println!("{}: {} inputs, {} read, {} bad", target.name, number + 1, outcomes.read, bad.len());
        }
    }
    outcomes.print(target, count);
    for line in &bad {
        println!("BAD: {line}");
    }
    if bad.is_empty() {
        Ok(Counts { inputs: count, read: outcomes.read })
    } else {
        Err(format!("{}: {} of {count} inputs went wrong", target.name, bad.len()))
    }
}

impl Outcomes {
    fn add(&mut self, run: &Run) {
        self.longest = self.longest.max(run.spent);
        self.memory_mb = self.memory_mb.max(run.memory_mb);
        match &run.outcome {
            Outcome::Read => self.read += 1,
            Outcome::Refused(said) => *self.refused.entry(words(said)).or_insert(0) += 1,
        }
    }

    fn print(&self, target: &Target, count: usize) {
        /// Kinds of refusals that are printed.
        const SHOWN: usize = 12;
        println!(
            "{}: {count} mutated inputs, {} read, longest {:.3} s, most memory {:.1} MB",
            target.name,
            self.read,
            self.longest.as_secs_f64(),
            self.memory_mb
        );
        let mut refused: Vec<_> = self.refused.iter().collect();
        refused.sort_by_key(|(words, count)| (std::cmp::Reverse(**count), words.as_str()));
        for (words, count) in refused.iter().take(SHOWN) {
            println!("{count:>9}  {words}");
        }
        if refused.len() > SHOWN {
            println!(
                "{:>9}  {} other kinds",
                refused[SHOWN..].iter().map(|(_, count)| **count).sum::<usize>(),
                refused.len() - SHOWN
            );
        }
    }
}

/// What was found, without the file's name and without numbers, so that alike ones count together.
fn words(said: &str) -> String {
    let found = said.split_once(": ").map_or(said, |(_, rest)| rest);
    let found = found.split("; needed").next().unwrap_or(found);
    let mut words: String = found.chars().map(|c| if c.is_ascii_digit() { '#' } else { c }).collect();
    while words.contains("##") {
        words = words.replace("##", "#");
    }
    words.chars().take(90).collect()
}

/// Keeps an input that went wrong.
fn kept(folder: &Path, target: &Target, number: usize, bytes: &[u8]) -> Result<PathBuf, String> {
    let path = folder.join(format!("{}_{number}", target.name));
    let written = std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&path, bytes));
    written.map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}

/// A seed with some bytes changed, lost, doubled, taken from another seed, or replaced by a piece of the format; half of the changes
/// strike the part of it that the reader depends on.
fn mutated(target: &Target, seeds: &[Vec<u8>], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = seeds[draw.below(seeds.len())].clone();
    for _ in 0..=draw.below(6) {
        if bytes.is_empty() {
            break;
        }
        let part = (target.part)(&bytes);
        let at =
            if draw.below(2) == 0 { part.start + draw.below(part.len()) } else { draw.below(bytes.len()) };
        let rest = bytes.len() - at;
        match draw.below(16) {
            0..=3 => bytes[at] ^= 1 << draw.below(8),
            4..=5 => bytes[at] = draw.below(256) as u8,
            6 => bytes[at] = bytes[at].wrapping_add(1),
            7 => bytes[at..at + rest.min(4)].fill(0xff),
            8 => bytes[at..at + rest.min(4)].fill(0),
            9 => drop(bytes.drain(at..at + 1 + draw.below(rest.min(12)))),
            10 => bytes.insert(at, draw.below(256) as u8),
            11 => {
                let part = bytes[at..at + rest.min(1 + draw.below(40))].to_vec();
                bytes.splice(at..at, part);
            }
            12 => {
                let other = &seeds[draw.below(seeds.len())];
                let from = draw.below(other.len());
                let part = &other[from..(from + 1 + draw.below(64)).min(other.len())];
                let end = (at + part.len()).min(bytes.len());
                bytes[at..end].copy_from_slice(&part[..end - at]);
            }
            13 if draw.below(4) == 0 => bytes.truncate(at),
            _ if target.pieces.is_empty() => bytes[at] = 0,
            _ => {
                let words = target.pieces[draw.below(target.pieces.len())];
                let piece = words[draw.below(words.len())];
                bytes.splice(at..at + rest.min(draw.below(8)), piece.bytes());
            }
        }
    }
    bytes
}
