//! `cargo xtask fuzz`: runs the fuzz targets.

mod guided;

use breakshot_fuzz::{Counts, Scratch, TARGETS, TEXT, Target, mutate, report_panics};
use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask fuzz [TARGET] [COUNT]                  mutations of the seeds at random (100,000 if not given)
       cargo xtask fuzz text [COUNT]                      as many of CSV, YAML and XML together: tracks, camera_info, bag_metadata
       cargo xtask fuzz guided [TARGET] [--seconds N]     mutations that reach new code are kept (60 s each if not given)
       cargo xtask fuzz repeat TARGET FILE                one input again
       cargo xtask fuzz list                              the targets";

/// Mutated seeds of a target.
const COUNT: usize = 100_000;
/// Time of a target under coverage (s).
const SECONDS: u64 = 60;
/// Where inputs that went wrong are kept.
const FOUND: &str = "target/fuzz/found";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match run(&words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("fuzz: {message}");
            ExitCode::FAILURE
        }
    }
}

fn run(words: &[&str]) -> Result<(), String> {
    match words {
        ["list"] => {
            for target in &TARGETS {
                println!("{:<14} {}", target.name, target.what);
            }
            Ok(())
        }
        ["repeat", name, file] => {
            let bytes = std::fs::read(file).map_err(|e| format!("{file}: {e}"))?;
            let run = named(name)?.run(&bytes);
            remove_scratch();
            println!("{:?}", run?);
            Ok(())
        }
        ["guided"] => guided::run(&TARGETS, SECONDS),
        ["guided", "--seconds", seconds] => guided::run(&TARGETS, number(seconds)?),
        ["guided", name] => guided::run(&[*named(name)?], SECONDS),
        ["guided", name, "--seconds", seconds] => guided::run(&[*named(name)?], number(seconds)?),
        ["guided", ..] => Err(USAGE.into()),
        ["text"] => text_mutations(COUNT),
        ["text", count] => text_mutations(number(count)?),
        [] => mutations(&TARGETS, COUNT),
        [count] if count.bytes().all(|byte| byte.is_ascii_digit()) => mutations(&TARGETS, number(count)?),
        [name] => mutations(&[*named(name)?], COUNT),
        [name, count] => mutations(&[*named(name)?], number(count)?),
        _ => Err(USAGE.into()),
    }
}

/// Mutations at random of these targets, so many of each; all are run, whatever the others found.
fn mutations(targets: &[Target], count: usize) -> Result<(), String> {
    shared_mutations(targets, &vec![count; targets.len()])
}

/// So many mutations at random of files of text, shared by their readers.
fn text_mutations(count: usize) -> Result<(), String> {
    let share = |k: usize| (count + k) / TEXT.len();
    shared_mutations(&TEXT, &[0, 1, 2].map(share))
}

/// As many mutations at random of each target as the count beside it.
fn shared_mutations(targets: &[Target], counts: &[usize]) -> Result<(), String> {
    report_panics(|| {});
    let mut all = Counts::default();
    let mut wrong = Vec::new();
    for (target, count) in targets.iter().zip(counts) {
        match mutate(target, *count, Path::new(FOUND)) {
            Ok(Counts { inputs, read }) => {
                all = Counts { inputs: all.inputs + inputs, read: all.read + read }
            }
            Err(message) => wrong.push(message),
        }
    }
    remove_scratch();
    if !wrong.is_empty() {
        return Err(wrong.join("; "));
    }
    println!("{} mutated inputs of {} targets, {} read, none bad", all.inputs, targets.len(), all.read);
    Ok(())
}

/// Removes the files of the inputs.
fn remove_scratch() {
    // Files that stay in memory are no reason to fail.
    let _ = std::fs::remove_dir_all(Scratch::folder().path(""));
}

fn named(name: &str) -> Result<&'static Target, String> {
    Target::named(name).ok_or_else(|| {
        format!("`{name}` is no target: {}\n{USAGE}", TARGETS.map(|target| target.name).join(", "))
    })
}

fn number<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("`{text}` is no number\n{USAGE}"))
}
