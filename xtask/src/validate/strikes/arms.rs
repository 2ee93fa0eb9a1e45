//! Do plans for a cell with an arm suit the arm, and do they work as often as plans without one?
//!
//! Each pile is planned without an arm and with an Indy 7 at two places beside the table.  `robot::command` has to accept the plans
//! as they are, and the lab carries out every strike.

use super::lab::{Lab, LabCell, Pile, Variation};
use super::{Study, friction_scale, on_all_cores, placed, planned, works};
use crate::validate::robot::indy7;
use crate::validate::row::{self, Row};
use breakshot::plan::Method;
use breakshot::robot::{self, Answer};
use breakshot::scene::Scene;
use std::f64::consts::FRAC_PI_2;

/// The places of the base: half a metre behind the middle of the long side, and of the short side.
const BASES: [(&str, Option<[f64; 2]>); 3] = [
    ("no arm", None),
    ("behind the long side", Some([0.5, -FRAC_PI_2])),
    ("behind the short side", Some([0.55, 0.0])),
];

/// Most percent of the piles by which plans with an arm may work less often.
const MOST_LOST_PERCENT: f64 = 3.0;

/// What came of one plan.
#[derive(Clone, Copy, Debug, Default)]
struct Planned {
    has_strike: bool,
    accepted: bool,
    stated: f64,
    worked: bool,
    seconds: f64,
}

/// Plans and strikes every pile without an arm and with it at both places; prints the table.
pub(super) fn run(cell: &LabCell, study: &Study, piles: &[Pile]) -> Result<(), String> {
    let trials = on_all_cores(cell, piles, |lab, pile, seed| {
        let of = |base: &(&str, Option<[f64; 2]>)| trial(lab, study, pile, seed, base.1);
        let [none, long, short]: [_; 3] =
            BASES.iter().map(of).collect::<Result<Vec<_>, _>>()?.try_into().map_err(|_| "three bases")?;
        let word = |trial: &Planned| match (trial.has_strike, trial.accepted, trial.worked) {
            (false, ..) => "no strike",
            (true, false, _) => "refused",
            (true, true, true) => "works",
            (true, true, false) => "fails",
        };
        let each = [&none, &long, &short].map(|t| format!("{} (stated {:.2})", word(t), t.stated));
        println!("{} {} objects: {}", pile.name, pile.poses.len(), each.join(", "));
        Ok([none, long, short])
    })?;
    let mut rows = Vec::new();
    let count = trials.len() as f64;
    let percent = |place: usize, holds: fn(&Planned) -> bool| {
        100.0 * trials.iter().filter(|t| holds(&t[place])).count() as f64 / count
    };
    let without = percent(0, |t| t.worked);
    for (place, (name, base)) in BASES.iter().enumerate() {
        let worked = percent(place, |t| t.worked);
        if base.is_some() {
            let accepted = percent(place, |t| t.accepted);
            rows.push(Row::at_least(format!("{name}: accepted by `command`"), accepted, 95.0, "%"));
        }
        rows.push(Row::plain(format!("{name}: first strike works"), worked, "%"));
        let mean_s = trials.iter().map(|t| t[place].seconds).sum::<f64>() / count;
        let stated = 100.0 * trials.iter().map(|t| t[place].stated).sum::<f64>() / count;
        rows.push(Row::plain(format!("{name}: stated"), stated, "%"));
        rows.push(Row::plain(format!("{name}: time of a plan, mean"), mean_s, "s"));
    }
    let with_arm = f64::midpoint(percent(1, |t| t.worked), percent(2, |t| t.worked));
    let least = without - MOST_LOST_PERCENT;
    rows.push(Row::at_least("both places together: first strike works", with_arm, least, "%"));
    let title = format!("Plans for an Indy 7 on {} piles", trials.len());
    row::require(row::print_all(&title, &rows))
}

fn trial(
    lab: &mut Lab,
    study: &Study,
    pile: &Pile,
    seed: u64,
    base: Option<[f64; 2]>,
) -> Result<Planned, String> {
    let mut scene = Scene { placed: placed(&pile.poses), ..study.scene.clone() };
    scene.cell.robot = base.map(indy7);
    let begun = std::time::Instant::now();
    let plan = planned(&scene, &study.properties, Method::Robust, seed).map_err(|e| e.to_string())?;
    let seconds = begun.elapsed().as_secs_f64();
    let Some(strike) = &plan.strike else { return Ok(Planned { seconds, ..Planned::default() }) };
    let accepted = if base.is_some() {
        let answer = robot::command(&scene.cell, strike, Some(&scene), &robot::Options::default());
        matches!(answer.map_err(|e| e.to_string())?, Answer::Ready(_))
    } else {
        true
    };
    let once = Variation { friction_scale: friction_scale(seed), seed: None };
    let (worked, _) = works(lab, &scene, Some(strike), once)?;
    let stated = plan.prediction.as_ref().and_then(|p| p.success_probability).unwrap_or(0.0);
    Ok(Planned { has_strike: true, accepted, stated, worked: worked && accepted, seconds })
}
