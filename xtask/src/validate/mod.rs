//! Measures the program against films with known truth: `cargo xtask validate LAB`.
//!
//! LAB is a folder with `campaign/` and `scatter/`, each holding films and a `truth.json`.  The program is built in
//! release mode and run as a user would run it; its files are compared with the truth.  The other modules measure single
//! stages: `cargo xtask validate physics`, `air-table`, `scatter LAB`.

pub(crate) mod air_table;
mod cells;
pub(crate) mod estimation;
mod films;
mod kills;
mod lens;
mod objects;
mod physics;
mod robot;
pub(crate) mod row;
mod scatter;
mod strikes;
mod study;
mod tracks;
mod truth;

use crate::process;
use estimation::{advise, altered, campaigns, properties, saved};
pub(crate) use films::{bags, cameras};
pub(crate) use kills::{KILLS, run as kills};
use row::{Row, require};
use std::path::{Path, PathBuf};
use std::process::Command;
pub(crate) use strikes::lab::LabCell;
pub(crate) use strikes::{Effort, LearnedFrom, run as strikes, run_arms as arms, run_missing as missing};
use truth::Truth;

/// The program under test, built in release mode.
pub(crate) struct Program {
    binary: PathBuf,
    /// Where its results go.
    pub(crate) output: PathBuf,
}

impl Program {
    pub(crate) fn build() -> Result<Self, String> {
        crate::check::cargo(&["build", "--release", "--package", "breakshot-cli"], &[])?;
        let target = crate::example::target();
        let output = target.join("validate");
        std::fs::create_dir_all(&output).map_err(|e| format!("{}: {e}", output.display()))?;
        Ok(Self { binary: target.join("release/breakshot"), output })
    }

    /// Runs one command; exit codes other than 0 and 3 are errors.
    pub(crate) fn run(&self, args: &[&str]) -> Result<process::Run, String> {
        let run = process::run(Command::new(&self.binary).args(args))?;
        if run.code == 0 || run.code == 3 {
            return Ok(run);
        }
        Err(format!("`breakshot {}` ended with {}", args.join(" "), run.code))
    }

    /// Estimates a campaign as a user would; writes the properties and the tracks.
    fn estimate(&self, campaign: &Path, properties: &Path, tracks: &Path) -> Result<process::Run, String> {
        let [campaign, properties, tracks] = [campaign, properties, tracks].map(Path::to_string_lossy);
        self.run(&["estimate", &campaign, "-o", &properties, "--tracks", &tracks])
    }
}

/// Default number of drawn campaigns.
pub(crate) const CAMPAIGNS: u64 = campaigns::COUNT;

/// Coverage of the intervals on drawn campaigns.
pub(crate) fn estimate(count: u64) -> Result<(), String> {
    require(campaigns::validate(count)?)
}

/// Everything that is measured against the films in `lab`.
pub(crate) fn lab(lab: &Path, details: bool) -> Result<(), String> {
    let program = Program::build()?;
    let properties = program.output.join("properties.json");
    let mut all_hold = campaign(&program, &lab.join("campaign"), &properties, details)?;
    all_hold &= scatter::films(&program, &lab.join("scatter"), &properties)?.holds;
    require(all_hold)
}

/// The gain in accuracy from advised clips over random ones, on this many synthetic cells.
pub(crate) fn advise(cells: Option<&str>) -> Result<(), String> {
    let cells = cells.map_or(Ok(advise::CELLS), |text| {
        text.parse().map_err(|_| format!("CELLS is `{text}`; needed: a whole number"))
    })?;
    require(advise::validate(cells)?)
}

/// Tracks and estimates of the drawn cells of these seeds, from at least this number of films each.
pub(crate) fn cells(lab: &Path, seeds: Option<&str>, clips: Option<u64>) -> Result<(), String> {
    let seeds = seeds.unwrap_or(cells::SEEDS);
    require(cells::validate(&Program::build()?, lab, seeds, clips.unwrap_or(cells::CLIPS))?)
}

/// Objects drafted from pictures of the drawn cells of these seeds.
pub(crate) fn objects(lab: &Path, seeds: Option<&str>) -> Result<(), String> {
    let seeds = seeds.unwrap_or(objects::SEEDS);
    require(objects::validate(&Program::build()?, lab, seeds)?)
}

/// Default number of drawn cells.
pub(crate) const CELLS: u64 = estimation::contact::CELLS;

/// Contact friction learned from the motions of drawn cells.
pub(crate) fn contact(lab: &Path, cells: u64) -> Result<(), String> {
    let mut all_hold = estimation::contact::advised_films(&Program::build()?, lab)?;
    all_hold &= estimation::contact::validate(lab, cells)?;
    require(all_hold)
}

/// Mishaps of every message of the drivers: the tests of the drivers make the runs and print the table.
pub(crate) fn faults(every: &str) -> Result<(), String> {
    let test = ["test", "-p", "breakshot-drivers", "--lib", "tests::faults::all_mishaps"];
    let words = [&test[..], &["--", "--ignored", "--nocapture"]].concat();
    crate::check::cargo(&words, &[("BREAKSHOT_FAULTS_EVERY", every)])
}

/// The simulator against an independent one, itself and recorded collisions.
pub(crate) fn physics(shared: &Path) -> Result<(), String> {
    require(physics::run(shared)?)
}

/// The arm and its drivers against other programs; one part of it, or all.
pub(crate) fn robot(shared: &Path, part: Option<&str>) -> Result<(), String> {
    require(robot::run(shared, part)?)
}

/// What explains the difference between predicted and filmed strikes on piles.
pub(crate) fn scatter(lab: &Path, python: Option<&str>) -> Result<(), String> {
    study::run(lab, python)
}

/// What is measured on the films' saved tracks, without the films.
pub(crate) fn tracks(lab: &Path, tracks: &Path) -> Result<(), String> {
    let folder = lab.join("campaign");
    let (saved, truth) = (saved::Saved::read(&folder, tracks)?, Truth::read(&folder)?);
    let learned = altered::learned(&saved, &saved.clips)?.properties;
    let mut all_hold = row::print_all("Properties", &properties::rows(&truth, &learned, false));
    all_hold &= altered::validate(&saved, &truth)?;
    require(all_hold)
}

/// Distortion models and calibration files beside OpenCV.
pub(crate) fn lenses(count: u64, python: Option<&str>) -> Result<(), String> {
    require(lens::models(count, python)?)
}

/// Lenses calibrated from films of boards.
pub(crate) fn boards(films: &Path, python: Option<&str>) -> Result<(), String> {
    require(lens::boards(films, python)?)
}

/// What the lab's own lens, calibrated from films of boards, costs on the table.
pub(crate) fn corners(lab: &Path) -> Result<(), String> {
    require(lens::corners(lab)?)
}

/// Default number of random subsets of the lab's campaign.
pub(crate) const SUBSETS: u64 = estimation::subsets::COUNT;

/// Few clips: random subsets of the films' saved tracks.
pub(crate) fn subsets(lab: &Path, tracks: &Path, count: u64) -> Result<(), String> {
    let folder = lab.join("campaign");
    require(estimation::subsets::validate(
        &saved::Saved::read(&folder, tracks)?,
        &Truth::read(&folder)?,
        count,
    )?)
}

/// What users get wrong, one mistake at a time.
pub(crate) fn mistakes(campaign: &Path, tracks: &Path) -> Result<(), String> {
    require(estimation::mistakes::validate(&saved::Saved::read(campaign, tracks)?)?)
}

/// What is measured against recorded collisions.
pub(crate) fn recorded(shared: &Path) -> Result<(), String> {
    let all_hold = air_table::run(&shared.join("real/air_table"))?;
    require(all_hold)
}

fn campaign(program: &Program, folder: &Path, properties: &Path, details: bool) -> Result<bool, String> {
    let truth = Truth::read(folder)?;
    let tracks = program.output.join("tracks");
    let campaign = folder.join("campaign.toml");
    let run = program.estimate(&campaign, properties, &tracks)?;
    let mut holds = row::print_all(
        "Estimating the whole campaign",
        &[
            Row::plain("clips", truth.clips.len() as f64, ""),
            Row::at_most("wall time", run.wall_s, 90.0, "s"),
            Row::plain("CPU time", run.cpu_s.unwrap_or(f64::NAN), "s"),
            Row::at_most("peak memory", run.peak_memory_mb.unwrap_or(f64::NAN), 1000.0, "MB"),
        ],
    );
    holds &= row::print_all("Tracks", &tracks::rows(&truth, &tracks)?);
    let learned = breakshot::files::load_properties(properties).map_err(|e| e.to_string())?;
    holds &= row::print_all("Properties", &properties::rows(&truth, &learned, details));
    holds &= altered::validate(&saved::Saved::read(folder, &tracks)?, &truth)?;
    Ok(holds)
}
