//! The simulator against an independent one, and against itself: `cargo xtask validate physics`.
//!
//! The independent simulator (`tests/stepper` of the library) takes many small steps and has no code in common with the first.

use super::air_table;
use super::row::{self, Row, median};
use crate::example::{Finals, Scenes, apart_mm};
use std::collections::BTreeSet;
use std::path::Path;
use stepper::{Contact, settled};

#[path = "../../../crates/breakshot/tests/stepper/mod.rs"]
mod stepper;

/// Everything that is measured with files of piles and with recorded collisions.
pub(crate) fn run(shared: &Path) -> Result<bool, String> {
    let scenes = shared.join("reference/scenes");
    let release = Scenes::build(true)?;
    let mut all_hold = independent(&release, &scenes)?;
    all_hold &= golden(&release, &Scenes::build(false)?, &scenes)?;
    all_hold &= air_table::run(&shared.join("real/air_table"))?;
    Ok(all_hold)
}

/// Steps of the independent simulator where bodies are close (s): halving them changes medians by less than 1 um.
const STEP_S: f64 = 2e-7;
const SPRING_STEP_S: f64 = 1e-7;
/// How long the first contact of a pile lasts alone (s): the simulator's own default.
const CONTACT_TIME_S: f64 = 3e-5;

/// File, law of the steps, flags of ours, what it shows, targets of median and worst (mm).
struct Case(&'static str, Contact, &'static [&'static str], &'static str, [f64; 2]);

/// No target: one more or one fewer grazing impact leads to a different result (mm).
const ANY_MM: f64 = f64::INFINITY;

fn independent(example: &Scenes, scenes: &Path) -> Result<bool, String> {
    let springs = |exponent: f64| Contact::Springs { contact_time_s: CONTACT_TIME_S, exponent };
    let mut rows = Vec::new();
    let one_by_one: &[&str] = &["--touching", "pairwise"];
    let cases = [
        Case("S4g", Contact::Rigid, &[], "as shipped, steps with rigid impacts", [0.01, 0.2]),
        Case("S4g", Contact::Rigid, one_by_one, "impacts one by one, in both", [0.01, 0.2]),
        Case("S4t", springs(1.5), &[], "touching, Hertz springs in both", [1.0, ANY_MM]),
        Case(
            "S4t",
            springs(1.0),
            &["--touching", "linear"],
            "touching, linear springs in both",
            [5.0, ANY_MM],
        ),
        Case("G4n", Contact::Rigid, &[], "polygons as shipped, steps with rigid impacts", [0.05, ANY_MM]),
        Case("G4n", Contact::Rigid, one_by_one, "polygons, impacts one by one, in both", [0.05, ANY_MM]),
    ];
    for Case(name, contact, flags, what, targets) in cases {
        let file = scenes.join(format!("{name}.txt"));
        let apart = apart_mm(&example.finals(&file, flags)?, &stepped(&file, contact)?);
        let worst = apart.iter().copied().fold(0.0, f64::max);
        let figures = [("median", median(apart)), ("worst", worst)];
        for ((kind, figure), target) in figures.into_iter().zip(targets) {
            let what = format!("{name}, {what}: {kind}");
            rows.push(if target < ANY_MM {
                Row::at_most(what, figure, target, "mm")
            } else {
                Row::plain(what, figure, "mm")
            });
        }
    }
    Ok(row::print_all(
        "Final positions against an independent simulator of small steps (worst object of each pile)",
        &rows,
    ))
}

/// The positions of rest that the independent simulator computes.
fn stepped(file: &Path, contact: Contact) -> Result<Finals, String> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let step_s = if contact == Contact::Rigid { STEP_S } else { SPRING_STEP_S };
    let piles = stepper::read::piles(&text).map_err(|e| format!("{}: {e}", file.display()))?;
    let positions = |pile: &stepper::Pile| {
        let poses = settled(pile, contact, step_s);
        (pile.name.clone(), poses.into_iter().map(|[x, y, _]| [x, y]).collect())
    };
    Ok(piles.iter().map(positions).collect())
}

/// The same bits in debug and release builds, with 1, 2 and 8 threads.
fn golden(release: &Scenes, debug: &Scenes, scenes: &Path) -> Result<bool, String> {
    let mut rows = Vec::new();
    for name in ["S4g", "S4t", "G4"] {
        let mut hashes = BTreeSet::new();
        for build in [release, debug] {
            for threads in [1, 2, 8] {
                let answer = build.run(&scenes.join(format!("{name}.txt")), &["--hash"], threads)?;
                hashes.insert(answer.hash.ok_or("the example printed no hash")?);
            }
        }
        let all: Vec<&str> = hashes.iter().map(String::as_str).collect();
        rows.push(Row::at_most(
            format!("{name}: different hashes of 6 ({})", all.join(" ")),
            all.len() as f64,
            1.0,
            "",
        ));
    }
    Ok(row::print_all("The same bits in debug and release builds with 1, 2 and 8 threads", &rows))
}
