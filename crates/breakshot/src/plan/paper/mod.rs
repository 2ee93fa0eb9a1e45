//! Which central strike on the largest object singulates the pile?  The planner of the paper.
//!
//! Section 5 of the paper (Fig. 11): strike the largest object centrally from an accessible direction, simulate, and correct the
//! strike's speed by feedback until Eq. 35 and 36 hold.  What the paper leaves open is decided as follows:
//!
//! - *Largest* (rule iii): by the area of the outline, then by name.
//! - *Central* (rule iv): the line of action passes through the centroid; a polygon is struck perpendicularly on a side.
//! - *Accessible* (rule vi): from 20 mm behind the start to the contact the striker keeps a clearance of 3 mm to all other objects; to
//!   walls and keep-out areas it keeps it until 20 mm past the contact, and it stays on the table.  The lead-in is 70 mm, or less (down
//!   to 20 mm) where that is not free.
//! - *Greatest impulse* (rule vi): Eq. 8 with the effective mass of the cell's arm.  Without an arm the striker counts as infinitely
//!   heavy, all headings on an object have equal impulse, and the heading that points most towards the mean position of the other
//!   objects comes first.  If no heading reaches the largest object, all others compete by impulse.
//! - *Feedback on the speed* (rule v, Fig. 11): see `plan/paper/feedback.rs`.  Where no speed works, further headings on the same object
//!   are tried in order of impulse, each at least 15 degrees from the earlier ones.
//! - *Follow-through*: the striker stops at half the distance at which it would catch up with the free object, `2 e v2 / (mu g)` (Eq. 24 to 28
//!   corrected), within 5 and 20 mm, or where the cell's arm can stop it first.  If 5 mm already reach that point the strike is *pushing* (Eq. 27), else *scattering* (Eq. 28).

mod central_strikes;
mod feedback;

use super::arm::{CellArm, laws_with};
use super::options::Options;
use super::result::{Contact, Iteration, Outcome, Plan, Prediction};
use crate::error::Result;
use crate::geometry::wrapped_rad;
use crate::physics::World;
use crate::properties::Properties;
use crate::scene::{Placed, Scene};
pub(crate) use central_strikes::{Blocked, CentralStrike, central_strikes};
use feedback::{Search, Trial};

/// Rules iii to vii of section 5 for a pile that does not fulfil the goal.
pub(crate) fn paper(mut plan: Plan, properties: &Properties, options: &Options) -> Result<Plan> {
    let scene = plan.scene.clone();
    let arm = CellArm::of(&scene, options)?;
    let world = World::new(&scene, properties, &laws_with(arm.as_ref()))?;
    plan.arm = arm.as_ref().map(CellArm::name);
    let Targets { strikes, blocked } = targets(&scene, properties, arm.as_ref())?;
    if strikes.is_empty() {
        let each: Vec<_> = blocked.iter().map(Blocked::to_string).collect();
        plan.reason = format!("no central strike reaches any object: {}", each.join("; "));
        return Ok(plan);
    }
    let mut search = Search::new(&scene, &world);
    let headings = distinct(strikes);
    let mut refusal = None;
    let mut executable = |trial: &Trial| {
        let refused = arm.as_ref().and_then(|arm| arm.refusal(&trial.iteration.strike));
        refusal = refusal.take().or(refused.clone());
        refused.is_none()
    };
    let (mut found, mut nearest) = (None, Vec::new());
    for strike in &headings {
        found = search.run(strike)?.filter(&mut executable);
        if found.is_some() {
            break;
        }
        nearest.extend(search.best.take());
    }
    plan.outcome = if found.is_some() { Outcome::Found } else { Outcome::BestEffort };
    let best = found.or_else(|| {
        while let Some(k) = (0..nearest.len()).min_by(|&i, &k| Trial::better_first(&nearest[i], &nearest[k]))
        {
            let trial = nearest.remove(k);
            if executable(&trial) {
                return Some(trial);
            }
        }
        None
    });
    plan.iterations = search.iterations;
    let Some(trial) = best else {
        plan.outcome = Outcome::Unreachable;
        plan.reason = format!("the arm can execute no central strike: {}", refusal.unwrap_or_default());
        return Ok(plan);
    };
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
    Ok(plan)
}

/// The strikes to try, the best first, and the objects that no central strike reaches.
struct Targets {
    strikes: Vec<CentralStrike>,
    blocked: Vec<Blocked>,
}

/// The strikes on the largest object; if there are none, those on all others.
fn targets(scene: &Scene, properties: &Properties, arm: Option<&CellArm>) -> Result<Targets> {
    let mut sized: Vec<(f64, &Placed)> = scene
        .placed
        .iter()
        .map(|p| Ok((scene.object(&p.object)?.shape.area_m2(), p)))
        .collect::<Result<_>>()?;
    sized.sort_unstable_by(|one, other| other.0.total_cmp(&one.0).then(one.1.object.cmp(&other.1.object)));
    let (mut strikes, mut blocked) = (Vec::new(), Vec::new());
    for (rank, (_, target)) in sized.into_iter().enumerate() {
        match central_strikes(scene, properties, arm, target)? {
            Ok(strikes) if rank == 0 => return Ok(Targets { strikes, blocked }),
            Ok(found) => strikes.extend(found),
            Err(by) => blocked.push(by),
        }
    }
    strikes.sort_unstable_by(CentralStrike::better_first);
    Ok(Targets { strikes, blocked })
}

/// Headings of one object that differ by less are variants of one strike (rad).
const LEAST_DIFFERENCE_RAD: f64 = 15.0 / 180.0 * std::f64::consts::PI;
/// Rounding error of headings that are a whole number of steps apart (rad).
const ROUNDING_RAD: f64 = 1e-9;

/// The best strikes without variants of better ones.
fn distinct(strikes: Vec<CentralStrike>) -> Vec<CentralStrike> {
    let mut kept: Vec<CentralStrike> = Vec::new();
    for strike in strikes {
        let repeats = |k: &CentralStrike| {
            k.object == strike.object
                && wrapped_rad(k.line.heading_rad - strike.line.heading_rad).abs()
                    < LEAST_DIFFERENCE_RAD - ROUNDING_RAD
        };
        if !kept.iter().any(repeats) {
            kept.push(strike);
        }
    }
    kept
}

/// The outcome in a sentence.
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
        return format!("{what}: {target} is singulated");
    }
    let (Some(least_m), Some(mean_m)) = (trial.iteration.min_distance_m, trial.iteration.mean_distance_m)
    else {
        return format!("{what}: the object ends inside the permitted areas");
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
