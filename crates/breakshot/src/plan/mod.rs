//! Which strike singulates the pile?
//!
//! Section 5 of the paper (Fig. 11): strike the largest object centrally from an accessible direction, simulate, and
//! feed the distances back into the strike's speed until Eq. 35 and 36 hold.  What the paper leaves open is decided so:
//!
//! - *Largest* (rule iii) is the outline's area; of equals the first name in the alphabet.
//! - *Central* (rule iv): the line of action runs through the centroid; a polygon is struck on a side, square to it.
//! - *Accessible* (rule vi): the striker's way from its start, and 20 mm behind it, to the contact keeps 3 mm clear of all
//!   other objects; the whole way, 20 mm past the contact included, keeps as clear of walls and keep-out areas and stays on
//!   the table.  The striker starts 70 mm before the contact, less (down to 20 mm) where that is not free.
//! - *Greatest impulse* (rule vi): Eq. 8 with the arm's effective mass if one is given.  Without an arm the striker counts as
//!   infinitely heavy, all headings of an object are equal, and the one that points most towards the middle of the other
//!   objects comes first.  If no heading reaches the largest object, all objects compete by impulse.
//! - *Feedback on the speed* (rule v, Fig. 11): the law, its gain, its stop rule and what happens when the response is
//!   not monotonic stand in `feedback.rs`.  When no speed works, the next headings are tried in order of impulse, each at least
//!   15 degrees from those before, on the same object.
//! - *Follow-through*: the striker stops before the free object would be caught up, half way to `2 e v2 / (mu g)`
//!   (Eq. 24 to 28 corrected), but not before 5 mm or after 20 mm.  A strike so slow that 5 mm reach the catch-up is *pushing*
//!   (Eq. 27), every other one *scattering* (Eq. 28).
//!
//! A pile that fulfils the goal as it lies, and a single object, need no strike: found, with no strike and the poses as they
//! are.  The numbers of the strike are rounded (1 um, 1 urad, 0.1 mm/s, 10 um) before they are simulated, so that
//! simulating the strike as written gives the prediction to the last bit.

mod candidate;
#[cfg(test)]
mod candidate_tests;
mod explain;
mod feedback;
mod goal;
mod judge;
mod possible;
mod proposal;
mod robust;
#[cfg(test)]
mod robust_tests;
mod sequence;
#[cfg(test)]
mod sequence_tests;
mod survey;
#[cfg(test)]
mod tests;

use crate::error::Result;
use crate::geometry::{Point, Pose, wrapped_rad};
use crate::physics::{self, World};
use crate::properties::Properties;
use crate::scene::{Placed, Scene, Strike};
use crate::singulation::Singulation;
use candidate::{Blocked, Candidate};
pub use explain::{Doubt, Failure, RunnerUp};
use feedback::{Search, Trial};
pub use possible::{Scatter, Source};
pub use proposal::Aim;
pub use robust::Robustness;
pub use sequence::{Sequence, drawn, expected, sequence};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
pub use survey::{Surveyed, survey};

/// Which algorithm plans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The paper's feedback on the speed.
    #[default]
    Paper,
    /// The strike that works most probably, over all that is not known exactly.
    Robust,
}

/// The striker's effective mass (kg) in Eq. 8, by the touched point and the heading (rad); zero where the arm cannot strike.
pub type EffectiveMass<'a> = dyn Fn(Point, f64) -> f64 + Sync + 'a;

/// Strikes worth judging besides those from all around: what experience or a learned model proposes for a scene.
pub type Proposals<'a> = dyn Fn(&Scene) -> Vec<Aim> + Sync + 'a;

/// How to plan.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// Which algorithm.
    pub method: Method,
    /// The arm's impulse geometry; without it the striker counts as infinitely heavy.
    pub effective_mass_kg: Option<&'a EffectiveMass<'a>>,
    /// What else to judge; only `Robust` asks.
    pub proposals: Option<&'a Proposals<'a>>,
    /// How well the pile is seen and the strike carried out; only `Robust` asks.
    pub scatter: Scatter,
    /// The seed of all draws; only `Robust` draws.
    pub seed: u64,
}

/// How the search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The strike fulfils the goal in simulation, or the pile does without one.
    Found,
    /// The best strike there is does not; the reason says what is missing.
    BestEffort,
    /// No strike is possible.
    Unreachable,
}

/// How the striker meets a free object (Eq. 27 and 28).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Contact {
    /// The object leaves the striker and is not caught up within its stroke.
    #[default]
    Scattering,
    /// The striker catches the object up and pushes it.
    Pushing,
}

/// The strike, what it is expected to do, and why it was chosen (`plan.json`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// The file format's version.
    pub version: u32,
    /// Which algorithm planned.
    pub method: Method,
    /// How the search ended.
    pub outcome: Outcome,
    /// Why, in words.
    pub reason: String,
    /// What it was planned for.
    pub scene: Scene,
    /// What the robot shall do; none if unreachable, and if nothing needs to be done.
    pub strike: Option<Strike>,
    /// What is expected then; none if unreachable.
    pub prediction: Option<Prediction>,
    /// The search, step by step.
    pub iterations: Vec<Iteration>,
    /// How sure the plan is, and why; only `Robust` tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robustness: Option<Robustness>,
    /// The strikes that would follow if each did exactly what is expected of it; only where more than one was asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub then: Vec<Strike>,
}

/// What a strike is expected to do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Where every object comes to rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// Least distance between two centres (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// How likely it fulfils the goal, where the method can tell.
    pub success_probability: Option<f64>,
}

/// One step of the search.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// The strike tried.
    pub strike: Strike,
    /// How the striker meets the object.
    pub contact: Contact,
    /// Least distance between two centres after it (m); none for a single object.
    pub min_distance_m: Option<f64>,
    /// Mean distance over all pairs after it (m); none for a single object.
    pub mean_distance_m: Option<f64>,
    /// Whether it fulfils the goal.
    pub fulfilled: bool,
}

/// Plans the strike that singulates the pile.
///
/// # Errors
/// A scene that cannot be simulated; that no strike works is an answer, not an error.
pub fn plan(scene: &Scene, properties: &Properties, options: &Options) -> Result<Plan> {
    let mut plan = Plan {
        version: 1,
        method: options.method,
        outcome: Outcome::Unreachable,
        reason: String::new(),
        scene: scene.clone(),
        strike: None,
        prediction: None,
        iterations: Vec::new(),
        robustness: None,
        then: Vec::new(),
    };
    if scene.placed.is_empty() {
        plan.reason = "nothing lies on the table".into();
        return Ok(plan);
    }
    let poses: BTreeMap<_, _> = scene.placed.iter().map(|p| (p.object.clone(), p.pose())).collect();
    let lying = Singulation::of(scene, &poses)?;
    if lying.violations(&scene.goal).is_empty() {
        plan.outcome = Outcome::Found;
        plan.reason = match &scene.placed[..] {
            [alone] => format!("only {} lies on the table: there is nothing to singulate", alone.object),
            _ => "the objects already lie as wanted: no strike is needed".into(),
        };
        plan.prediction = Some(prediction(poses, &lying));
        return Ok(plan);
    }
    if let Some(reason) = goal::impossible(scene) {
        plan.reason = reason;
        return Ok(plan);
    }
    match options.method {
        Method::Paper => paper(plan, properties, options),
        Method::Robust => robust::robust(plan, properties, options, &robust::Effort::FULL),
    }
}

fn prediction(final_poses: BTreeMap<String, Pose>, singulation: &Singulation) -> Prediction {
    Prediction {
        final_poses,
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        success_probability: None,
    }
}

/// Rules iii to vii of section 5 for a goal that does not hold yet.
fn paper(mut plan: Plan, properties: &Properties, options: &Options) -> Result<Plan> {
    let scene = plan.scene.clone();
    let world = World::new(&scene, properties, &physics::Options::default())?;
    let (candidates, blocked) = target_candidates(&scene, properties, options)?;
    if candidates.is_empty() {
        let each: Vec<_> = blocked.iter().map(Blocked::to_string).collect();
        plan.reason = format!("no central strike reaches any object: {}", each.join("; "));
        return Ok(plan);
    }
    let mut search = Search::new(&scene, &world);
    let headings = spread_out(candidates);
    let mut found = None;
    for candidate in &headings {
        found = search.run(candidate)?;
        if found.is_some() {
            break;
        }
    }
    plan.outcome = if found.is_some() { Outcome::Found } else { Outcome::BestEffort };
    let Search { iterations, best, .. } = search;
    plan.iterations = iterations;
    if let Some(trial) = found.or(best) {
        let unreached = blocked.first().map(|b| format!("; the largest object cannot be struck: {b}"));
        plan.reason = reason(&trial, &plan, headings.len()) + &unreached.unwrap_or_default();
        let Trial { iteration, final_poses, .. } = trial;
        plan.prediction = Some(Prediction {
            final_poses,
            min_distance_m: iteration.min_distance_m,
            mean_distance_m: iteration.mean_distance_m,
            success_probability: None,
        });
        plan.strike = Some(iteration.strike);
    }
    Ok(plan)
}

/// The strikes on the largest object; if none reaches it, those on all others, and who is blocked by what.
fn target_candidates(
    scene: &Scene,
    properties: &Properties,
    options: &Options,
) -> Result<(Vec<Candidate>, Vec<Blocked>)> {
    let mut sized: Vec<(f64, &Placed)> = scene
        .placed
        .iter()
        .map(|p| Ok((scene.object(&p.object)?.shape.area_m2(), p)))
        .collect::<Result<_>>()?;
    sized.sort_by(|one, other| other.0.total_cmp(&one.0).then(one.1.object.cmp(&other.1.object)));
    let mut all = Vec::new();
    let mut blocked = Vec::new();
    for (rank, (_, target)) in sized.into_iter().enumerate() {
        match candidate::candidates(scene, properties, options, target)? {
            Ok(found) if rank == 0 => return Ok((found, Vec::new())),
            Ok(found) => all.extend(found),
            Err(by) => blocked.push(by),
        }
    }
    all.sort_by(Candidate::better_first);
    Ok((all, blocked))
}

/// Headings of one object closer together than this do nearly the same (rad).
const LEAST_TURN_RAD: f64 = 15.0 / 180.0 * std::f64::consts::PI;

/// The best candidates, without those that nearly repeat a better one.
fn spread_out(candidates: Vec<Candidate>) -> Vec<Candidate> {
    let mut kept: Vec<Candidate> = Vec::new();
    for candidate in candidates {
        let repeats = |k: &Candidate| {
            k.object == candidate.object
                && wrapped_rad(k.heading_rad - candidate.heading_rad).abs() < LEAST_TURN_RAD - ROUNDING_RAD
        };
        if !kept.iter().any(repeats) {
            kept.push(candidate);
        }
    }
    kept
}

/// Headings a whole number of steps apart differ from that by rounding alone (rad).
const ROUNDING_RAD: f64 = 1e-9;

fn reason(trial: &Trial, plan: &Plan, headings: usize) -> String {
    let goal = &plan.scene.goal;
    let Iteration { strike, contact, .. } = &trial.iteration;
    let contact = match contact {
        Contact::Scattering => "scattering",
        Contact::Pushing => "pushing",
    };
    let object = strike.object.as_deref().unwrap_or_default();
    let what = format!("striking {object} at {:.3} m/s ({contact})", strike.speed_m_s);
    if let Some(worst) = trial.violations.first() {
        return format!(
            "none of {} simulated strikes along {headings} headings fulfils the goal; the nearest is {what}: {worst}",
            plan.iterations.len()
        );
    }
    if let Some(target) = &goal.target {
        return format!("{what}: {target} lies by itself then");
    }
    let (Some(least_m), Some(mean_m)) = (trial.iteration.min_distance_m, trial.iteration.mean_distance_m)
    else {
        return format!("{what}: it ends where it is wanted");
    };
    format!(
        "{what}: the least distance becomes {:.1} mm ({:.1} mm wanted), the mean {:.1} mm ({:.1} to {:.1} mm wanted)",
        least_m * 1e3,
        goal.min_distance_m * 1e3,
        mean_m * 1e3,
        goal.mean_distance_m[0] * 1e3,
        goal.mean_distance_m[1] * 1e3
    )
}
