//! Do planned strikes work?  Random piles, plans by both methods, carried out in the lab.
//!
//! The planner has the properties that `estimate` measured in the campaign's films; the lab is another physics engine with
//! friction that varies from strike to strike.  A strike succeeds if the goal holds where the objects come to rest and none
//! has tipped.  For some piles no strike is reliable: a search in the lab itself decides for each pile whether any strike
//! succeeds repeatedly.

mod arms;
mod figure;
pub(crate) mod lab;
mod missing;
mod solvable;
mod table;

use super::Program;
use super::estimation::advised_films;
use crate::splitmix::Draw;
use breakshot::geometry::outline::Outline;
use breakshot::geometry::{Point, Pose, Vec2};
use breakshot::plan::{self, Method};
use breakshot::properties::Properties;
use breakshot::scene::singulation::Singulation;
use breakshot::scene::{Goal, Placed, Scene, Strike};
use breakshot::{Result as Planned, files};
use lab::{Lab, LabCell, Pile, Rest, Variation};
use table::Trial;

/// Strikes after which a pile has to be singulated.
const MOST_STRIKES: usize = 3;
/// Tilt above which an object counts as tipped (degrees).
const MOST_TILT_DEG: f64 = 10.0;

/// Effort of the search for reliable strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Every strike is made once.
    Once,
    /// The planned strike is repeated with disturbances.
    Repeat,
    /// Where it is not reliable other strikes are tried.
    Search,
}

/// The films that the properties are learned from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LearnedFrom {
    /// Those of the cell.
    OwnFilms,
    /// Also ten that are advised.
    AdvisedFilms,
}

/// Plans and strikes `count` random piles of 2 to 6 objects, and looks for reliable strikes.
pub(crate) fn run(
    cell: &LabCell,
    count: usize,
    learned_from: LearnedFrom,
    effort: Effort,
) -> Result<(), String> {
    let program = Program::build()?;
    let study = Study::new(&program, cell, learned_from, effort)?;
    let piles = Lab::start(cell)?.piles(count, 1)?;
    let trials = on_all_cores(cell, &piles, |lab, pile, seed| {
        let trial = trial(lab, &study, pile, seed).map_err(|e| format!("{}: {e}", pile.name))?;
        println!("{trial}");
        Ok(trial)
    })?;
    table::print(&trials);
    let figure = program.output.join("reliability.svg");
    std::fs::write(&figure, figure::reliability(&trials))
        .map_err(|e| format!("{}: {e}", figure.display()))?;
    println!("Wrote {}", figure.display());
    Ok(())
}

/// Plans and strikes `count` random piles with all properties, and without each of them in turn.
pub(crate) fn run_missing(cell: &LabCell, count: usize) -> Result<(), String> {
    let program = Program::build()?;
    let study = Study::new(&program, cell, LearnedFrom::OwnFilms, Effort::Once)?;
    let piles = Lab::start(cell)?.piles(count, 1)?;
    missing::run(cell, &study, &piles)
}

/// Plans and strikes `count` random piles without an arm and with one.
pub(crate) fn run_arms(cell: &LabCell, count: usize) -> Result<(), String> {
    let program = Program::build()?;
    let study = Study::new(&program, cell, LearnedFrom::OwnFilms, Effort::Once)?;
    let piles = Lab::start(cell)?.piles(count, 1)?;
    arms::run(cell, &study, &piles)
}

/// The trials of all piles in their order, made with one lab on each core.
fn on_all_cores<T: Send>(
    cell: &LabCell,
    piles: &[Pile],
    trial: impl Fn(&mut Lab, &Pile, u64) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let labs = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let trial = &trial;
    let struck = |first: usize| -> Result<Vec<(usize, T)>, String> {
        let mut lab = Lab::start(cell)?;
        let own = piles.iter().enumerate().skip(first).step_by(labs);
        own.map(|(k, pile)| Ok((k, trial(&mut lab, pile, k as u64)?))).collect()
    };
    let struck = &struck;
    let mut trials = std::thread::scope(|scope| {
        let running: Vec<_> = (0..labs).map(|first| scope.spawn(move || struck(first))).collect();
        let joined = running.into_iter().map(|lab| lab.join().unwrap_or_else(|_| Err("a lab ended".into())));
        joined.collect::<Result<Vec<_>, _>>()
    })?
    .into_iter()
    .flatten()
    .collect::<Vec<_>>();
    trials.sort_by_key(|&(k, _)| k);
    Ok(trials.into_iter().map(|(_, trial)| trial).collect())
}

/// The properties estimated from the campaign's films.
fn learned(program: &Program, cell: &LabCell) -> Result<Properties, String> {
    let properties = program.output.join("properties.json");
    let campaign = cell.campaign.join("campaign.toml");
    program.run(&["estimate", &campaign.to_string_lossy(), "-o", &properties.to_string_lossy()])?;
    files::load_properties(&properties).map_err(|e| e.to_string())
}

/// What all trials have in common.
struct Study {
    /// The cell and its objects, none of them placed.
    scene: Scene,
    properties: Properties,
    effort: Effort,
}

impl Study {
    fn new(
        program: &Program,
        cell: &LabCell,
        learned_from: LearnedFrom,
        effort: Effort,
    ) -> Result<Self, String> {
        let properties = match learned_from {
            LearnedFrom::OwnFilms => learned(program, cell)?,
            LearnedFrom::AdvisedFilms => {
                let [_, after] = advised_films::learned(program, cell)?;
                files::load_properties(&after).map_err(|e| e.to_string())?
            }
        };
        let campaign = &cell.campaign;
        let scene = Scene {
            cell: files::load_cell(campaign.join("cell.toml")).map_err(|e| e.to_string())?,
            objects: files::load_objects(campaign.join("objects.toml")).map_err(|e| e.to_string())?.value,
            observed_unix_s: None,
            placed: Vec::new(),
            walls: Vec::new(),
            keep_out: Vec::new(),
            goal: Goal::default(),
        };
        Ok(Self { scene, properties, effort })
    }
}

/// Plans and strikes one pile.
fn trial(lab: &mut Lab, study: &Study, pile: &Pile, seed: u64) -> Result<Trial, String> {
    let Study { scene, properties, effort } = study;
    let mut scene = scene.clone();
    scene.placed = placed(&pile.poses);
    let friction_scale = friction_scale(seed);
    let plan = |scene: &Scene, method| planned(scene, properties, method, seed).map_err(|e| e.to_string());
    let robust = plan(&scene, Method::Robust)?;
    let stated = robust.prediction.as_ref().and_then(|p| p.success_probability).unwrap_or(0.0);
    let mut trial = Trial { pile: pile.name.clone(), size: pile.poses.len(), stated, ..Trial::default() };
    let paper = plan(&scene, Method::Paper)?;
    let once = Variation { friction_scale, seed: None };
    trial.paper = works(lab, &scene, paper.strike.as_ref(), once)?.0;
    trial.random = works(lab, &scene, random_strike(&scene, seed).as_ref(), once)?.0;
    trial.reliable = solvable::reliable(lab, &scene, &robust, seed, *effort)?;
    let mut strike = robust.strike;
    for n in 1..=MOST_STRIKES {
        let (succeeded, rest) = works(lab, &scene, strike.as_ref(), once)?;
        if succeeded {
            trial.strikes = Some(n);
            break;
        }
        let Some(rest) = rest else {
            trial.ended = "no strike";
            break;
        };
        if rest.tilt_deg >= MOST_TILT_DEG {
            trial.ended = "tipped";
            break;
        }
        trial.ended = "not yet";
        scene.placed = placed(&rest.poses);
        // The outlines of tilted objects that rest on each other can overlap in the view from above.
        let Ok(next) = plan(&scene, Method::Robust) else {
            trial.ended = "no plan";
            break;
        };
        strike = next.strike;
    }
    Ok(trial)
}

pub(crate) fn planned(
    scene: &Scene,
    properties: &Properties,
    method: Method,
    seed: u64,
) -> Planned<plan::Plan> {
    plan::plan(scene, properties, &plan::Options { method, seed, ..plan::Options::default() })
}

pub(crate) fn placed(poses: &[(String, Pose)]) -> Vec<Placed> {
    poses
        .iter()
        .map(|(name, pose)| Placed { object: name.clone(), position_m: pose.position, yaw_rad: pose.yaw_rad })
        .collect()
}

/// Carries a strike out; whether it singulates the pile, and where everything comes to rest.
fn works(
    lab: &mut Lab,
    scene: &Scene,
    strike: Option<&Strike>,
    variation: Variation,
) -> Result<(bool, Option<Rest>), String> {
    let Some(strike) = strike else { return Ok((false, None)) };
    let Some(rest) = lab.strike(&scene.placed, strike, variation)? else { return Ok((false, None)) };
    let poses = rest.poses.iter().cloned().collect();
    let singulation = Singulation::of(scene, &poses).map_err(|e| e.to_string())?;
    let fulfilled = singulation.violations().is_empty() && rest.tilt_deg < MOST_TILT_DEG;
    Ok((fulfilled, Some(rest)))
}

/// As in the films of the campaign: about 3 % from strike to strike.
fn friction_scale(seed: u64) -> f64 {
    // A sum of twelve uniform numbers is nearly normal.
    let mut draw = Draw::new(seed ^ 0xF51C);
    let sum: f64 = (0..12).map(|_| draw.fraction()).sum();
    (1.0 + 0.03 * (sum - 6.0)).clamp(0.92, 1.08)
}

/// A random strike without any model: of any object, from any free start position, at any permitted speed.
fn random_strike(scene: &Scene, seed: u64) -> Option<Strike> {
    let mut draw = Draw::new(seed);
    let striker = &scene.cell.striker.shape;
    for _ in 0..1000 {
        let target = &scene.placed[draw.below(scene.placed.len())];
        let (heading_rad, speed_m_s) = (draw.between(0.0, std::f64::consts::TAU), draw.between(0.3, 1.0));
        let along = Vec2::from_heading(heading_rad);
        let outline = |p: &Placed| Some(Outline::new(&scene.object(&p.object).ok()?.shape, p.pose()));
        let gap_m = |position: Point, outline: &Outline| {
            Outline::new(striker, Pose { position, yaw_rad: heading_rad }).gap_m(outline)
        };
        let own = outline(target)?;
        let mut contact_m = target.position_m - along * 0.2;
        while gap_m(contact_m, &own) > 1e-4 {
            contact_m += along * (0.9 * gap_m(contact_m, &own));
        }
        let (object, start_m) = (Some(target.object.clone()), contact_m - along * LEAD_IN_M);
        let strike = Strike { object, start_m, heading_rad, speed_m_s, travel_m: LEAD_IN_M + 0.015 };
        if is_free(scene, &strike, LEAD_IN_M) {
            return Some(strike);
        }
    }
    None
}

/// How far before the contact random strikes start (m).
const LEAD_IN_M: f64 = 0.07;

/// Whether the striker's path keeps clear of all objects but the one to strike.
fn is_free(scene: &Scene, strike: &Strike, distance_m: f64) -> bool {
    let start = Pose { position: strike.start_m, yaw_rad: strike.heading_rad };
    let along = Vec2::from_heading(strike.heading_rad);
    let path = Outline::swept(&scene.cell.striker.shape, start, along * distance_m);
    let mut others = scene.placed.iter().filter(|p| Some(&p.object) != strike.object.as_ref());
    others
        .all(|p| scene.object(&p.object).is_ok_and(|o| path.gap_m(&Outline::new(&o.shape, p.pose())) > 3e-3))
}
