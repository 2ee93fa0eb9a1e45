//! The project's own tasks.
//!
//! `cargo xtask test` is the one check, the same for people and CI.  `validate` measures against the films and
//! recordings in `../shared`, `bench` against other programs; both need more than a user has.

mod bench;
mod check;
mod dist;
mod example;
mod fuzz;
mod process;
mod python;
mod sbom;
mod scatterbench;
mod speed;
#[path = "../../crates/breakshot/tests/splitmix/mod.rs"]
mod splitmix;
mod studio;
mod validate;
mod venv;

use std::path::PathBuf;
use std::process::ExitCode;
use validate::{Effort, LabCell, LearnedFrom};

const USAGE: &str = "\
usage: cargo xtask TASK

  test             formatting, lints, docs and all tests, with the quick ones of the Python package and a way through the studio: what CI runs
  test --studio    a person's way through `breakshot studio` and `report.html` in headless Chromium with a release build: pictures of every
                   view, bounds of the latencies, and the CPU time that the studio adds to a fresh build
  validate LAB [--details]
                   accuracy, speed and memory on films with known truth (LAB holds campaign/ and scatter/)
  validate advise [CELLS]
                   ten advised clips against ten random ones on synthetic cells (use `cargo run --release -p xtask --`)
  validate scatter LAB [--python PYTHON]
                   which parameter or law explains how far predicted strikes on piles are from the filmed ones;
                   the exported models in MuJoCo
  validate physics [SHARED]
                   final positions against an independent simulator, the same bits in every build, recorded collisions
                   (SHARED holds reference/scenes and real/air_table; ../shared if not given)
  validate air-table [SHARED]
                   impacts against two pucks recorded on an air table alone
  validate estimate [COUNT]
                   coverage of 95 % intervals by kind of quantity on COUNT synthetic campaigns (default 200)
  validate contact LAB [CELLS]
                   contact friction: ten advised clips of the lab's cell are filmed, and its strikes on piles predicted before and
                   after; then the same for CELLS drawn cells (default 12) from their motions with noise, without films (needs
                   ffmpeg and libosmesa; about two minutes a cell, three more when a cell is drawn for the first time)
  validate cells [SEEDS] [--lab LAB] [--clips N]
                   tracks and estimates of drawn cells beside the truth; SEEDS are a list of 3, 3-easy, 3-hard or 3-9 (default
                   501-512, each easy and hard), each with at least N films (default 8). A film is made once and takes a minute of
                   CPU (needs ffmpeg and libosmesa)
  validate objects [SEEDS] [--lab LAB]
                   objects drafted from one picture of drawn cells beside the truth (default 101-110; needs libosmesa)
  validate tracks LAB TRACKS
                   bounds, thinned and spoilt campaigns on the films' saved tracks, without the films (TRACKS is what
                   `breakshot estimate --tracks` wrote)
  validate subsets LAB TRACKS [COUNT]
                   few clips: COUNT random halves and thirds of the campaign (default 500), from the films' saved tracks
  validate mistakes CAMPAIGN TRACKS
                   what users get wrong, one mistake at a time: is it named, and what does it change (CAMPAIGN is the folder of
                   a campaign.toml with its films, LAB/campaign or target/validate/cells/601-hard; TRACKS is what
                   `breakshot estimate --tracks` wrote; two minutes)
  validate robot [SHARED] [--part arms|impulse|paths|wire]
                   the arm beside pinocchio and MuJoCo, the drivers beside a mock controller, the vendor's client and roslibpy
                   (`cargo run --release -p xtask --`; paths takes the last learned properties)
  validate faults [EVERY]
                   every message between the drivers and their controllers lost, late, doubled, out of order and wrong in each field,
                   at every step of a strike, in simulated time; EVERY 9 makes every ninth run alone
  validate kills [COUNT]
                   the program killed at COUNT random moments (default 200): outputs are whole or absent, the next run is the same
  bench estimate [LAB TRACKS]
                   time of estimation in drawn campaigns of growing size, or from the films' tracks (TRACKS is what
                   `breakshot estimate --tracks` wrote)
  validate strikes LAB [PILES] [--repeat|--search] [--advised] [--cell FOLDER]
                   plans for random piles, carried out in the lab (60 piles if not given); --repeat makes each planned
                   strike ten times more, poses, speed and heading being off; --search also looks in the lab
                   itself for the piles that some strike singulates reliably (minutes a pile); --advised films ten advised
                   clips and learns from them as well; FOLDER is that of a cell that
                   `validate cells` filmed (target/validate/cells/601-hard), in place of the lab's own
  validate missing LAB [PILES]
                   the same piles (20 if not given) with every property that concerns them removed in turn, and with every object
                   as if it had never been filmed
  validate arms LAB [PILES]
                   the same piles (60 if not given) planned and struck without an arm, and with an Indy 7 at two places
  validate cameras LAB [--only NAME] [--python PYTHON]
                   tracks of one strike of the lab filmed at other rates, tilted, blurred, noisy, dim, in other codings
                   (NAME is a substring of a camera's name; use `cargo run --release -p xtask --`; needs ffmpeg and libosmesa)
  validate bags [CLIPS]
                   the first CLIPS films of the demo (all if not given) repacked as bags of ROS 2 in six codings and three compressions,
                   and by the commands that convert other bags; the largest difference of their tracks (needs ffmpeg with x264)
  validate lenses [COUNT] [--python PYTHON]
                   COUNT drawn lenses (default 100) of each model beside OpenCV, read from the files that it stores
  validate boards FILMS [--python PYTHON]
                   lenses calibrated from films of boards that the lab made (lab/board.py), beside OpenCV on the same corners
  validate corners LAB
                   the lab's own lens calibrated from films of boards: how far tracks and the corners of the picture are off on the table
                   (needs ffmpeg with x264; three minutes of filming the first time)
  validate decode CLIPS
                   decoded films against ffmpeg's, bit for bit; the same as `bench decode`
  fuzz [TARGET] [COUNT]
                   COUNT mutated files or messages for each reader (default 100,000): no panic, no hang, no waste of memory;
                   `fuzz list` names the readers
  fuzz text [COUNT]
                   COUNT mutated files in CSV, YAML and XML, shared by their three readers
  fuzz guided [TARGET] [--seconds N]
                   the same, guided by coverage, N seconds each (default 60), on the stable compiler (libFuzzer, needs a C++ compiler);
                   a table of executions and edges reached
  fuzz repeat TARGET FILE
                   one input again
  bench decode CLIPS
                   decoded films against ffmpeg's, and the CPU time of both on a folder of MP4 clips
  bench build [OTHER]
                   CPU time of a fresh `cargo build --release`, beside that of another checkout of this project
  bench detect [LAB] [--python PYTHON]
                   a 4K frame labelled beside OpenCV, a 4K film and films of the lab to tracks beside OpenCV and
                   ffmpeg, memory (use `cargo run --release -p xtask --`; without PYTHON a venv with OpenCV is made)
  bench plan LAB PROPERTIES
                   time of robust plans for four mixed shapes and for twenty objects (PROPERTIES as `estimate` wrote them;
                   `cargo run --release -p xtask --`)
  bench physics [--scenes DIR] [--python PYTHON]
                   piles simulated per CPU second beside rapier2d and MuJoCo; growth with the number of objects
                   (DIR is ../shared/reference/scenes if not given; without PYTHON a venv with MuJoCo is made)
  proto            the Rust code of the Indy's messages is generated again from crates/breakshot-drivers/proto/indy.proto
  python [--wheel FILE] [PYTHON..]
                   the Python package: its wheel is built (or the one given is taken), installed with NumPy alone and tested, its types
                   are checked, with each interpreter (python3 if none is given)
  python --quick   the part of it that is in `test`: most tests and the types, of the debug build
  scatterbench [PYTHON]
                   the benchmark beside the project: its tests, the tables of its adapters from nothing, and that the adapter which is
                   wrong on purpose fails
  deny             licences, sources and advisories of all dependencies (installs cargo-deny)
  dist             a static program as an archive with documents, man pages, completions and checksums; the program is tried with an
                   empty folder as its root
  dist --try ROOT  the same trial in a folder that holds another distribution (debootstrap, a container's file system)
  dist --publish   the crates that are published are packaged, and each is built from its package; nothing is uploaded
  sbom [FILE]      the bill of materials: all crates of the programs with versions, checksums and licences (CycloneDX, JSON)
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words.as_slice() {
        ["test"] => test(),
        ["test", "--studio"] => studio::test(),
        ["test", "--studio", "--debug"] => studio::walk(),
        ["proto"] => check::proto(check::Proto::Write),
        ["validate", "physics", rest @ ..] => validate::physics(&shared(rest)),
        ["validate", "scatter", lab] => validate::scatter(lab.as_ref(), None),
        ["validate", "scatter", lab, "--python", python] => validate::scatter(lab.as_ref(), Some(python)),
        ["validate", "robot", rest @ .., "--part", part] => validate::robot(&shared(rest), Some(part)),
        ["validate", "robot", rest @ ..] => validate::robot(&shared(rest), None),
        ["validate", "air-table", rest @ ..] => validate::recorded(&shared(rest)),
        ["validate", "faults", rest @ ..] => validate::faults(rest.first().unwrap_or(&"1")),
        ["validate", "kills", rest @ ..] => kills(rest),
        ["validate", "estimate", rest @ ..] => campaigns(rest),
        ["validate", "bags", rest @ ..] => bags(rest),
        ["validate", "cameras", lab] => validate::cameras(lab.as_ref(), None, None),
        ["validate", "cameras", lab, "--only", name] => validate::cameras(lab.as_ref(), Some(name), None),
        ["validate", "cameras", lab, "--python", python] => {
            validate::cameras(lab.as_ref(), None, Some(python))
        }
        ["validate", "cameras", lab, "--only", name, "--python", python] => {
            validate::cameras(lab.as_ref(), Some(name), Some(python))
        }
        ["fuzz", rest @ ..] => fuzz::run(rest),
        ["validate", "advise", rest @ ..] => validate::advise(rest.first().copied()),
        ["validate", "contact", lab, rest @ ..] => contact(lab, rest),
        ["validate", "cells", rest @ ..] => cells(rest),
        ["validate", "objects", rest @ ..] => objects(rest),
        ["validate", "tracks", lab, tracks] => validate::tracks(lab.as_ref(), tracks.as_ref()),
        ["validate", "mistakes", campaign, tracks] => validate::mistakes(campaign.as_ref(), tracks.as_ref()),
        ["validate", what @ ("lenses" | "boards"), rest @ ..] => lenses(what, rest),
        ["validate", "corners", lab] => validate::corners(lab.as_ref()),
        ["validate", "subsets", lab, tracks] => {
            validate::subsets(lab.as_ref(), tracks.as_ref(), validate::SUBSETS)
        }
        ["validate", "subsets", lab, tracks, count] => {
            number(count, "subsets").and_then(|count| validate::subsets(lab.as_ref(), tracks.as_ref(), count))
        }
        ["validate", "strikes", lab, rest @ ..] => strikes(lab, rest),
        ["validate", "arms", lab] => validate::arms(&LabCell::own(lab.as_ref()), 60),
        ["validate", "arms", lab, piles] => {
            number(piles, "piles").and_then(|piles| validate::arms(&LabCell::own(lab.as_ref()), piles))
        }
        ["validate", "missing", lab, rest @ ..] => missing(lab, rest),
        ["validate", lab] => validate::lab(lab.as_ref(), false),
        ["validate", lab, "--details"] => validate::lab(lab.as_ref(), true),
        ["bench", "estimate"] => speed::drawn(),
        ["bench", "estimate", lab, tracks] => speed::lab(lab.as_ref(), tracks.as_ref()),
        ["bench" | "validate", "decode", clips] => bench::decode::bench(clips.as_ref()),
        ["bench", "build", rest @ ..] => bench::build::bench(rest.first().map(|other| (*other).as_ref())),
        ["bench", "detect"] => bench::detect::bench(None, None),
        ["bench", "detect", "--python", python] => bench::detect::bench(None, Some(python)),
        ["bench", "detect", lab] => bench::detect::bench(Some(lab.as_ref()), None),
        ["bench", "detect", lab, "--python", python] => {
            bench::detect::bench(Some(lab.as_ref()), Some(python))
        }
        ["bench", "plan", lab, properties] => bench::plan::bench(lab.as_ref(), properties.as_ref()),
        ["bench", "physics", flags @ ..] => bench_physics(flags),
        ["python", "--quick"] => python::quick(),
        ["python", rest @ ..] => python::python(rest),
        ["scatterbench", rest @ ..] => scatterbench::scatterbench(rest.first().unwrap_or(&"python3")),
        ["deny"] => check::deny(),
        ["dist", rest @ ..] => dist::run(rest),
        ["sbom", rest @ ..] => sbom::run(rest),
        _ => {
            eprint!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}

/// What CI runs: the Rust code first, then what other programs drive, which is skipped where these cannot be had.
fn test() -> Result<(), String> {
    check::test()?;
    python::quick()?;
    studio::walk()
}

/// `validate contact LAB [CELLS]`.
fn contact(lab: &str, rest: &[&str]) -> Result<(), String> {
    let cells = rest.first().map_or(Ok(validate::CELLS), |cells| number(cells, "cells"))?;
    validate::contact(lab.as_ref(), cells)
}

/// `validate strikes LAB [PILES] [--repeat|--search] [--advised] [--cell FOLDER]`.
fn strikes(lab: &str, rest: &[&str]) -> Result<(), String> {
    let (cell, rest) = match rest {
        [rest @ .., "--cell", folder] => (Some(folder.as_ref()), rest),
        _ => (None, rest),
    };
    let cell = LabCell::of(lab.as_ref(), cell)?;
    let (flags, counts): (Vec<&str>, Vec<&str>) = rest.iter().partition(|word| word.starts_with("--"));
    let (advised, flags): (Vec<&str>, Vec<&str>) = flags.into_iter().partition(|flag| *flag == "--advised");
    let learned_from = if advised.is_empty() { LearnedFrom::OwnFilms } else { LearnedFrom::AdvisedFilms };
    let effort = match &flags[..] {
        [] => Effort::Once,
        ["--repeat"] => Effort::Repeat,
        ["--search"] => Effort::Search,
        other => return Err(format!("unknown flags: {}", other.join(" "))),
    };
    let piles = counts.first().map_or(Ok(60), |count| count.parse());
    validate::strikes(&cell, piles.map_err(|e| format!("number of piles: {e}"))?, learned_from, effort)
}

fn campaigns(rest: &[&str]) -> Result<(), String> {
    let count = rest.first().map_or(Ok(validate::CAMPAIGNS), |count| number(count, "campaigns"));
    validate::estimate(count?)
}

fn kills(rest: &[&str]) -> Result<(), String> {
    let count = rest.first().map_or(Ok(validate::KILLS), |count| number(count, "kills"));
    validate::kills(count?)
}

/// `validate cells` with its seeds and flags.
fn cells(rest: &[&str]) -> Result<(), String> {
    let (given, clips) = match rest {
        [given @ .., "--clips", clips] => (given, Some(number(clips, "clips")?)),
        given => (given, None),
    };
    let (lab, seeds) = lab_and_seeds("cells", given)?;
    validate::cells(&lab, seeds, clips)
}

/// `validate objects` with its seeds and flags.
fn objects(rest: &[&str]) -> Result<(), String> {
    let (lab, seeds) = lab_and_seeds("objects", rest)?;
    validate::objects(&lab, seeds)
}

/// The folder of the lab, and the seeds of drawn cells if they are given.
fn lab_and_seeds<'a>(what: &str, rest: &[&'a str]) -> Result<(PathBuf, Option<&'a str>), String> {
    match rest {
        [] => Ok(("../shared/lab".into(), None)),
        ["--lab", lab] => Ok((lab.into(), None)),
        [seeds] => Ok(("../shared/lab".into(), Some(seeds))),
        [seeds, "--lab", lab] => Ok((lab.into(), Some(seeds))),
        other => Err(format!("`validate {what}` has no {}", other.join(" "))),
    }
}

/// `validate lenses` and `validate boards` with their flags.
fn lenses(what: &str, rest: &[&str]) -> Result<(), String> {
    let (given, python) = match rest {
        [given @ .., "--python", python] => (given, Some(*python)),
        given => (given, None),
    };
    match (what, given) {
        ("lenses", []) => validate::lenses(100, python),
        ("lenses", [count]) => number(count, "lenses").and_then(|count| validate::lenses(count, python)),
        ("boards", [films]) => validate::boards(films.as_ref(), python),
        (_, other) => Err(format!("`validate {what}` has no {}", other.join(" "))),
    }
}

/// The folder of films, recordings and references: given, or beside the project.
fn shared(rest: &[&str]) -> PathBuf {
    rest.first().map_or_else(|| "../shared".into(), PathBuf::from)
}

fn bags(rest: &[&str]) -> Result<(), String> {
    validate::bags(rest.first().map(|clips| number(clips, "clips")).transpose()?)
}

fn missing(lab: &str, rest: &[&str]) -> Result<(), String> {
    validate::missing(
        &LabCell::own(lab.as_ref()),
        rest.first().map_or(Ok(20), |piles| number(piles, "piles"))?,
    )
}

fn bench_physics(flags: &[&str]) -> Result<(), String> {
    let (mut scenes, mut python) = ("../shared/reference/scenes", None);
    for flag in flags.chunks(2) {
        match flag {
            ["--scenes", folder] => scenes = folder,
            ["--python", program] => python = Some(*program),
            other => return Err(format!("`bench physics` has no {}", other.join(" "))),
        }
    }
    bench::physics::bench(scenes.as_ref(), python)
}

/// A number of things of this kind.
fn number<T: std::str::FromStr>(text: &str, things: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("`{text}` is no number of {things}"))
}
