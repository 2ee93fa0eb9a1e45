//! Damaged films: whatever is broken in them, reading ends with frames or with an error, soon and in little memory.
//!
//! `cargo xtask fuzz [COUNT]` opens COUNT mutated films (a million by default) and plays every seventh to its end;
//! arithmetic is checked in this build, so that a wrapped number is a panic too.

mod tables;

use crate::splitmix::Draw;
use breakshot::capture::{Decoder, Footage, is_decoding};
use std::collections::BTreeMap;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Files that are read.
const COUNT: usize = 1_000_000;
/// One film in this number is decoded to its end.
const PLAYED: usize = 7;
/// No film of the corpus has more frames: more means that it does not end.
const MOST_FRAMES: usize = 1000;
/// Nothing takes longer than this, on a busy machine either.
const LONGEST: Duration = Duration::from_secs(20);
/// Nothing needs more memory than this (MB).
const MOST_MEMORY_MB: f64 = 500.0;
/// Number of films between two lines of progress.
const REPORT: usize = 50_000;

/// What became of the films.
#[derive(Default)]
struct Outcomes {
    opened: usize,
    played: usize,
    /// Refusals by their words, numbers left out.
    refused: BTreeMap<String, usize>,
    longest: Duration,
}

/// `cargo xtask fuzz` with the given words: of films, or of tables; a million of them or as many as asked.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let parsed = |count: &[&str]| match count {
        [] => Ok(COUNT),
        [count] => count.parse().map_err(|_| format!("`{count}` is no number of files")),
        _ => Err("needed: fuzz [tables] [COUNT]".into()),
    };
    match words {
        ["tables", count @ ..] => tables::fuzz(parsed(count)?),
        count => films(parsed(count)?),
    }
}

/// Opens mutated films; every one that panics, hangs or allocates too much memory is kept and reported.
fn films(count: usize) -> Result<(), String> {
    let corpus = corpus()?;
    // The panics of the decoder become errors and are no finds.
    let previous = take_hook();
    set_hook(Box::new(move |panic| {
        if !is_decoding() {
            previous(panic);
        }
    }));
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let path = folder.path().join("film");
    let mut draw = Draw::new(1);
    let mut outcomes = Outcomes::default();
    let mut bad = Vec::new();
    for number in 0..count {
        let bytes = mutated(&corpus, &mut draw);
        overwrite(&path, &bytes).map_err(|e| format!("{}: {e}", path.display()))?;
        let started = Instant::now();
        let play = number.is_multiple_of(PLAYED);
        let done = catch_unwind(AssertUnwindSafe(|| read(&path, play, &mut outcomes)));
        let spent = started.elapsed();
        outcomes.longest = outcomes.longest.max(spent);
        let wrong = match done {
            Err(_) => Some("panicked".to_string()),
            Ok(Err(wrong)) => Some(wrong),
            Ok(Ok(())) if spent > LONGEST => Some(format!("took {:.1} s", spent.as_secs_f64())),
            Ok(Ok(())) => None,
        };
        if let Some(wrong) = wrong {
            bad.push(format!("{} {wrong}", kept(number, &bytes)?.display()));
        }
        if (number + 1).is_multiple_of(REPORT) {
            println!(
                "{} films: {} opened, {} played, {} bad",
                number + 1,
                outcomes.opened,
                outcomes.played,
                bad.len()
            );
        }
    }
    print_result(count, &outcomes, &bad)
}

/// Prints the outcomes; an error if a film was handled wrongly or too much memory was used.
fn print_result(count: usize, outcomes: &Outcomes, bad: &[String]) -> Result<(), String> {
    println!("\n{count} mutated films: {} opened, {} played to their end", outcomes.opened, outcomes.played);
    let mut refused: Vec<_> = outcomes.refused.iter().collect();
    refused.sort_by_key(|(words, count)| (std::cmp::Reverse(**count), words.as_str()));
    for (words, count) in refused {
        println!("{count:>9}  {words}");
    }
    println!("longest: {:.2} s", outcomes.longest.as_secs_f64());
    let memory_mb = crate::process::peak_memory_mb().unwrap_or(f64::NAN);
    println!("peak memory: {memory_mb:.0} MB");
    for line in bad {
        println!("BAD: {line}");
    }
    if !bad.is_empty() {
        return Err(format!("{} of {count} films went wrong", bad.len()));
    }
    if memory_mb > MOST_MEMORY_MB {
        return Err(format!("{memory_mb:.0} MB of memory; at most {MOST_MEMORY_MB:.0} are wanted"));
    }
    Ok(())
}

/// Opens a film, and plays it if asked; a film that is refused must end with an error of the reader.
fn read(path: &Path, play: bool, outcomes: &mut Outcomes) -> Result<(), String> {
    let mut refuse = |said: String| {
        if said.contains("decoding thread died") {
            return Err("panicked in its own thread".to_string());
        }
        *outcomes.refused.entry(words(&said)).or_insert(0) += 1;
        Ok(())
    };
    match Footage::open_with(path, Decoder::Builtin) {
        Err(said) => refuse(said.to_string()),
        Ok(footage) if play => {
            outcomes.played += 1;
            let mut frames = 0;
            for frame in footage.take(MOST_FRAMES) {
                frames += 1;
                if let Err(said) = frame {
                    refuse(said.to_string())?;
                }
            }
            if frames < MOST_FRAMES { Ok(()) } else { Err("does not end".into()) }
        }
        Ok(_) => {
            outcomes.opened += 1;
            Ok(())
        }
    }
}

/// What was found, without the film's name and without numbers, so that alike ones count together.
fn words(said: &str) -> String {
    let found = said.split_once(": ").map_or(said, |(_, rest)| rest);
    let found = found.split("; needed").next().unwrap_or(found);
    let letters: String = found.chars().map(|c| if c.is_ascii_digit() { '#' } else { c }).collect();
    let mut words = letters.replace("##", "#");
    while words.contains("##") {
        words = words.replace("##", "#");
    }
    words.chars().take(90).collect()
}

/// The small films of the library's tests that the built-in decoder reads, and a Y4M.
fn corpus() -> Result<Vec<Vec<u8>>, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/breakshot/tests/data/footage");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut films: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    films.retain(|film| film.extension().is_some_and(|e| e == "mp4" || e == "mov"));
    films.sort();
    let mut corpus: Vec<Vec<u8>> = Vec::new();
    for film in films {
        corpus.push(std::fs::read(&film).map_err(|e| format!("{}: {e}", film.display()))?);
    }
    let frame = [&b"FRAME\n"[..], &[90; 16 * 12 * 3 / 2]].concat();
    corpus.push([b"YUV4MPEG2 W16 H12 F60:1 C420\n".to_vec(), frame.repeat(5)].concat());
    Ok(corpus)
}

/// Keeps a film that went wrong.
fn kept(number: usize, bytes: &[u8]) -> Result<PathBuf, String> {
    let folder = crate::example::target().join("fuzz");
    let path = folder.join(format!("film_{number}"));
    let written = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&path, bytes));
    written.map_err(|e| format!("{}: {e}", path.display()))?;
    Ok(path)
}

/// Writes a file in place: emptying it first makes some file systems wait for the disk.
fn overwrite(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut file = std::fs::OpenOptions::new().write(true).create(true).truncate(false).open(path)?;
    file.write_all(bytes)?;
    file.set_len(bytes.len() as u64)
}

/// A film of the corpus with some bytes changed, lost, doubled, or taken from another film; half of the changes
/// strike the boxes, whose contents the reader depends on.
fn mutated(corpus: &[Vec<u8>], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = corpus[draw.below(corpus.len())].clone();
    for _ in 0..=draw.below(6) {
        let at = position(&bytes, draw);
        let rest = bytes.len() - at;
        match draw.below(14) {
            0..=3 => bytes[at] ^= 1 << draw.below(8),
            4..=5 => bytes[at] = draw.below(256) as u8,
            6 => bytes[at] = 0,
            7 => bytes[at..at + rest.min(4)].fill(0xff),
            8 => bytes[at..at + rest.min(4)].fill(0),
            9 => bytes[at] = bytes[at].wrapping_add(1),
            10 => drop(bytes.drain(at..at + 1 + draw.below(rest.min(9)))),
            11 => bytes.insert(at, draw.below(256) as u8),
            12 => {
                let other = &corpus[draw.below(corpus.len())];
                let from = draw.below(other.len());
                let part = &other[from..(from + 1 + draw.below(64)).min(other.len())];
                let end = (at + part.len()).min(bytes.len());
                bytes[at..end].copy_from_slice(&part[..end - at]);
            }
            _ => bytes.truncate(at.max(1)),
        }
        if bytes.len() < 16 {
            break;
        }
    }
    bytes
}

/// The position of a change: in half of the cases in the index of the film (the box `moov`).
fn position(bytes: &[u8], draw: &mut Draw) -> usize {
    let index = bytes.windows(4).position(|window| window == b"moov").unwrap_or(0);
    let index_length = (bytes.len() - index).min(1200);
    if draw.below(2) == 0 { index + draw.below(index_length) } else { draw.below(bytes.len()) }
}
