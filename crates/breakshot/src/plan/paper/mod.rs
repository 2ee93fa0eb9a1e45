//! The paper's search: the largest object, struck centrally, at the speed that the feedback finds.

mod central_strikes;
mod feedback;

use super::options::Options;
use super::result::{Contact, Iteration, Outcome, Plan, Prediction};
use crate::error::Result;
use crate::geometry::wrapped_rad;
use crate::physics::{self, World};
use crate::properties::Properties;
use crate::scene::{Placed, Scene};
pub(crate) use central_strikes::{Blocked, Candidate, candidates};
use feedback::{Search, Trial};

/// Rules iii to vii of section 5 for a goal that does not hold yet.
pub(crate) fn paper(mut plan: Plan, properties: &Properties, options: &Options) -> Result<Plan> {
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
        match candidates(scene, properties, options, target)? {
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
