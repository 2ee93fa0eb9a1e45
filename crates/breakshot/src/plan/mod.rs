//! Which strike singulates the pile?
//!
//! Two planners answer.  [`Method::Paper`] is section 5 of the paper: it strikes the largest object centrally and corrects the speed by
//! feedback from the simulated distances, with the properties at their means.  [`Method::Robust`] samples everything that is uncertain
//! and searches for the strike with the largest success probability.
//!
//! A cell with an arm of known base pose gets a strike that [`robot::command()`](crate::robot::command()) accepts, unless
//! [`Options::any_arm`] leaves the arm out.
//!
//! A pile that fulfils the goal as it is, and a single object, need no strike: the outcome is found, without a strike.  The numbers of a
//! strike are rounded (1 um, 1 urad, 0.1 mm/s, 10 um) before it is simulated, so that simulating the strike as written reproduces the
//! prediction bit for bit.

mod approach;
mod arm;
mod drawn_scenarios;
mod feasibility;
mod options;
mod outlook;
mod paper;
mod remedies;
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
use crate::scene::singulation::Singulation;
pub use arm::laws;
pub use drawn_scenarios::{Scenarios, drawn_properties};
pub use options::{Aim, ExecutionNoise, Method, Options, Progress, Proposals, Stopped};
pub use outlook::{Outlook, Possibilities, aimed};
pub use result::{
    Contact, Failure, Iteration, Outcome, Plan, Prediction, Remedy, Robustness, RunnerUp, Sensitivity, Source,
};
pub use robust::scenarios::Scenario;
pub use sequence::{Sequence, drawn, expected, sequence};
use std::collections::BTreeMap;
pub use survey::{EvaluatedStrike, GridSize, Survey, evaluate_grid, survey};

/// Plans the strike that singulates the pile.
///
/// That no strike fulfils the goal is an answer, not an error: see [`Outcome`].  Properties that no clip measured are assumed
/// ([`Properties::completed_for`]) and listed in the plan: [`Method::Paper`] takes their means, [`Method::Robust`] draws them.
///
/// # Errors
/// A scene that cannot be simulated, such as overlapping objects.
///
/// # Examples
/// ```
/// use breakshot::cell::{Cell, Striker, Workspace};
/// use breakshot::geometry::Point;
/// use breakshot::object::{Object, Shape};
/// use breakshot::plan::{Options, Outcome, plan};
/// use breakshot::properties::Properties;
/// use breakshot::scene::{Placed, Scene};
/// use breakshot::uncertain::Estimate;
///
/// let disc = |name: &str, radius_m| {
///     let shape = Shape::Disc { radius_m };
///     Object { name: name.into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None }
/// };
/// let placed = |object: &str, x_m| {
///     Placed { object: object.into(), position_m: Point::new(x_m, 0.0), yaw_rad: 0.0 }
/// };
/// let cell = Cell::from_above(1000.0, Workspace::centred([1.0, 0.8]), Striker::rod(0.015, [0.05, 1.0]));
/// let scene = Scene::new(cell, vec![disc("a", 0.04), disc("b", 0.035)], vec![placed("a", 0.0), placed("b", 0.076)])?;
///
/// let each = |a, b| [("a".to_owned(), Estimate::exact(a)), ("b".to_owned(), Estimate::exact(b))].into();
/// let properties = Properties {
///     reference: "a".into(),
///     friction: each(0.3, 0.25),
///     striker_restitution: each(0.6, 0.6),
///     restitution: [("a/b".to_owned(), Estimate::exact(0.5))].into(),
///     mass_ratio: each(1.0, 0.7),
///     ..Properties::default()
/// };
///
/// let plan = plan(&scene, &properties, &Options::default())?;
/// assert_eq!(plan.outcome, Outcome::Found);
/// assert!(plan.prediction.unwrap().min_distance_m.unwrap() >= 0.09); // m, Eq. 36
/// # Ok::<(), breakshot::Error>(())
/// ```
pub fn plan(scene: &Scene, properties: &Properties, options: &Options) -> Result<Plan> {
    options.noise.check()?;
    let mut plan = Plan::unreachable(scene, options.method);
    if scene.placed.is_empty() {
        plan.reason = "nothing lies on the table".into();
        return Ok(plan);
    }
    let poses = scene.poses();
    let singulation = Singulation::of(scene, &poses)?;
    if singulation.violations().is_empty() {
        plan.outcome = Outcome::Found;
        plan.reason = match &scene.placed[..] {
            [single] => format!("only {} lies on the table: there is nothing to singulate", single.object),
            _ => "the pile already fulfils the goal: no strike is needed".into(),
        };
        plan.prediction = Some(unchanged(poses, &singulation));
        return Ok(plan);
    }
    let properties = &*properties.completed_for(scene)?;
    let mut plan = if let Some(reason) = feasibility::impossible(scene) {
        Plan { reason, ..plan }
    } else {
        plan.assumed = properties.assumed_for(scene);
        match options.method {
            Method::Paper => paper::paper(plan, properties, options)?,
            Method::Robust => robust::robust(plan, properties, options, &robust::budget::Budget::FULL)?,
        }
    };
    if options.remedies && plan.outcome != Outcome::Found {
        plan.remedies = remedies::remedies(&plan, properties, options)?;
    }
    Ok(plan)
}

/// The prediction for a pile that is not struck.
fn unchanged(final_poses: BTreeMap<String, Pose>, singulation: &Singulation) -> Prediction {
    Prediction {
        final_poses,
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        success_probability: None,
    }
}
