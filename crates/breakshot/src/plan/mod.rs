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

mod approach;
mod feasibility;
mod options;
mod paper;
mod result;
mod robust;
mod sequence;
mod survey;
#[cfg(test)]
mod tests;

use crate::error::Result;
use crate::geometry::Pose;
use crate::properties::Properties;
use crate::scene::Scene;
use crate::singulation::Singulation;
pub use options::{Aim, EffectiveMass, Method, Options, Proposals, Scatter};
pub use result::{
    Contact, Doubt, Failure, Iteration, Outcome, Plan, Prediction, Robustness, RunnerUp, Source,
};
pub use sequence::{Sequence, drawn, expected, sequence};
use std::collections::BTreeMap;
pub use survey::{Surveyed, survey};

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
    if let Some(reason) = feasibility::impossible(scene) {
        plan.reason = reason;
        return Ok(plan);
    }
    match options.method {
        Method::Paper => paper::paper(plan, properties, options),
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
