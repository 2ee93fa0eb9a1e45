//! What the fuzzers give bytes to: one target for each reader of files and messages of unknown origin.
//!
//! [`TARGETS`] is the one list. `cargo xtask fuzz` mutates the seeds of a target at random, `cargo xtask fuzz guided` keeps each mutation that
//! reaches code that none before it has reached (libFuzzer). Both run the same functions with the same bounds ([`Target::run`]): a reader ends
//! with a value or with an error in words, soon and in little memory.

#[path = "../../crates/breakshot/tests/bag_writer/mod.rs"]
mod bag_writer;
mod mutation;
mod scratch;
#[path = "../../crates/breakshot/tests/splitmix/mod.rs"]
mod splitmix;
pub mod targets;

pub use mutation::{Counts, mutate};
pub use scratch::Scratch;

use breakshot::capture::is_decoding;
use peak_alloc::PeakAlloc;
use std::ops::Range;
use std::panic::{set_hook, take_hook};
use std::time::{Duration, Instant};

/// Counts the memory that is in use.
#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A reader, and what is expected of it.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name in commands, and of its file in `fuzz_targets`.
    pub name: &'static str,
    /// What is read.
    pub what: &'static str,
    /// Reads bytes.
    ///
    /// # Errors
    /// In words, what no bytes may lead to.
    pub read: fn(&[u8]) -> Result<Outcome, String>,
    /// Inputs that are read without an error.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// What inputs are made of, to be inserted by mutations: lists of words.
    pub pieces: &'static [&'static [&'static str]],
    /// The part of an input that half of the mutations change.
    pub part: fn(&[u8]) -> Range<usize>,
    /// Largest time of an input on a busy machine (s).
    pub longest_s: f64,
    /// Largest memory of an input (MB).
    pub most_memory_mb: f64,
}

/// What a reader made of an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// A value.
    Read,
    /// An error in words.
    Refused(String),
}

/// What an input led to, and what that cost.
#[derive(Clone, Debug)]
pub struct Run {
    /// Whether it was read.
    pub outcome: Outcome,
    /// Its time.
    pub spent: Duration,
    /// The most memory in use at a time, beyond that in use before (MB).
    pub memory_mb: f64,
}

impl Target {
    /// The bounds of a reader of text.
    pub(crate) const fn of_text(
        name: &'static str,
        what: &'static str,
        read: fn(&[u8]) -> Result<Outcome, String>,
        seeds: fn() -> Vec<Vec<u8>>,
        pieces: &'static [&'static [&'static str]],
    ) -> Self {
        Self {
            name,
            what,
            read,
            seeds,
            pieces,
            part: |bytes| 0..bytes.len(),
            longest_s: 5.0,
            most_memory_mb: 64.0,
        }
    }

    /// The target of a name.
    pub fn named(name: &str) -> Option<&'static Self> {
        TARGETS.iter().find(|target| target.name == name)
    }

    /// Reads the first seed, so that what is computed once a process does not count as the cost of an input.
    pub fn prepare(&self) {
        if let Some(seed) = (self.seeds)().first() {
            // The run of the same seed is judged, this one is not.
            drop((self.read)(seed));
        }
    }

    /// Reads an input within the bounds.
    ///
    /// # Errors
    /// In words, what no input may lead to; a panic stays one.
    pub fn run(&self, bytes: &[u8]) -> Result<Run, String> {
        let before = MEMORY.current_usage();
        MEMORY.reset_peak_usage();
        let started = Instant::now();
        let outcome = (self.read)(bytes)?;
        let spent = started.elapsed();
        let memory_mb = MEMORY.peak_usage().saturating_sub(before) as f64 / f64::from(1 << 20);
        if spent.as_secs_f64() > self.longest_s {
            return Err(format!("took {:.1} s; allowed: {:.0} s", spent.as_secs_f64(), self.longest_s));
        }
        if memory_mb > self.most_memory_mb {
            return Err(format!("needed {memory_mb:.0} MB; allowed: {:.0} MB", self.most_memory_mb));
        }
        Ok(Run { outcome, spent, memory_mb })
    }
}

/// All targets.
pub static TARGETS: [Target; 23] = [
    targets::films::FILM,
    targets::films::FILM_PLAYED,
    targets::films::PICTURE,
    targets::films::PICTURE_TIMES,
    targets::films::BAG,
    targets::films::BAG_METADATA,
    targets::cells::CELL,
    targets::cells::CAMERA_INFO,
    targets::cells::BOARD,
    targets::cells::URDF,
    targets::cells::TOUCHES,
    targets::scenes::OBJECTS,
    targets::scenes::CAMPAIGN,
    targets::scenes::SCENE,
    targets::scenes::STRIKE,
    targets::scenes::PLAN,
    targets::scenes::PROPOSALS,
    targets::numbers::PROPERTIES,
    targets::numbers::TRACKS,
    targets::robots::COMMAND,
    targets::robots::ROSBRIDGE,
    targets::robots::INDY,
    targets::robots::STUDIO,
];

/// The readers of tables (CSV) and of files in YAML and XML.
pub static TEXT: [Target; 3] =
    [targets::numbers::TRACKS, targets::cells::CAMERA_INFO, targets::films::BAG_METADATA];

/// Reports panics, except those of the built-in decoder, which become errors of the film; then does `after`.
pub fn report_panics(after: fn()) {
    let previous = take_hook();
    set_hook(Box::new(move |panic| {
        if !is_decoding() {
            previous(panic);
            after();
        }
    }));
}

/// What the coverage-guided programs do with an input: anything wrong ends the program, and the longest time and most memory
/// are kept in the file that the variable `BREAKSHOT_FUZZ_COSTS` names.
///
/// # Panics
/// Something is wrong: libFuzzer keeps the input.
pub fn guided_run(target: &Target, bytes: &[u8]) {
    use std::sync::Mutex;
    static LARGEST: Mutex<(f64, f64)> = Mutex::new((0.0, 0.0));
    match target.run(bytes) {
        Err(wrong) => panic!("{}: {wrong}", target.name),
        Ok(run) => {
            let Ok(mut largest) = LARGEST.lock() else { return };
            let spent_s = run.spent.as_secs_f64();
            if spent_s > largest.0 || run.memory_mb > largest.1 {
                *largest = (largest.0.max(spent_s), largest.1.max(run.memory_mb));
                if let Some(file) = std::env::var_os("BREAKSHOT_FUZZ_COSTS") {
                    // A number that is missing in the table is no reason to end.
                    let _ = std::fs::write(file, format!("{} {}\n", largest.0, largest.1));
                }
            }
        }
    }
}

/// The coverage-guided program of a target.
#[cfg(feature = "guided")]
#[macro_export]
macro_rules! guided {
    ($target:path) => {
        libfuzzer_sys::fuzz_target!(
            init: {
                // In place of the hook of libFuzzer, which ends the program at the decoder's panics too.
                drop(std::panic::take_hook());
                $crate::report_panics(|| std::process::abort());
                $target.prepare();
            },
            |bytes: &[u8]| $crate::guided_run(&$target, bytes)
        );
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seed_is_read() {
        let _only_one = scratch::exclusive();
        for target in &TARGETS {
            for (k, seed) in (target.seeds)().iter().enumerate() {
                match target.run(seed) {
                    Ok(Run { outcome: Outcome::Read, .. }) => {}
                    other => panic!("seed {k} of {}: {other:?}", target.name),
                }
            }
        }
    }

    #[test]
    fn every_target_has_a_name_of_its_own_and_a_program() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).expect("the manifest");
        for (k, target) in TARGETS.iter().enumerate() {
            assert!(TARGETS[..k].iter().all(|other| other.name != target.name), "{} twice", target.name);
            let path = format!("fuzz_targets/{}.rs", target.name);
            assert!(manifest.contains(&format!("path = \"{path}\"")), "{path} is not in the manifest");
            let program = std::fs::read_to_string(folder.join(&path)).expect("a program");
            assert!(program.contains(&format!("::{});", target.name.to_uppercase())), "{path}: {program}");
        }
        assert_eq!(manifest.matches("[[bin]]").count(), TARGETS.len() + 1, "programs");
    }
}
