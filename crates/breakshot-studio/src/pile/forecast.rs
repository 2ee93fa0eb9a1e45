//! The nominal motion of a strike, and where everything may come to rest.

use super::request::{Cache, PileRequest};
use crate::project::Project;
use breakshot::physics::{self, Trajectory};
use breakshot::plan::{self, Aim, Options, Outlook, Possibilities};
use breakshot::properties::Properties;
use breakshot::scene::singulation::Singulation;
use breakshot::scene::{Scene, Strike};
use breakshot::{Error, Result};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};

/// The seed of a plan, if none is given; that of `breakshot plan`.
pub(crate) const SEED: u64 = 1;

/// A strike on a pile.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct StrikeRequest {
    pub(crate) pile: PileRequest,
    pub(crate) properties: String,
    pub(crate) strike: Strike,
    /// The number of worlds of the cloud.
    #[serde(default)]
    worlds: usize,
}

/// What `breakshot simulate` writes, and what the goal says of it.
#[derive(Serialize)]
pub(crate) struct Motion {
    trajectory: Trajectory,
    min_distance_m: Option<f64>,
    mean_distance_m: Option<f64>,
    /// The conditions of the goal that do not hold, in words.
    violations: Vec<String>,
}

/// The motion with all properties at their means.
///
/// # Errors
/// A pile or a strike that cannot be simulated.
pub(crate) fn motion(project: &Project, cache: &Cache, request: &StrikeRequest) -> Result<Motion> {
    let scene = cache.pile(project, &request.pile)?;
    let properties = cache.properties(project, &request.properties, &scene)?;
    request.strike.check("the strike")?;
    let trajectory = physics::trajectory(&scene, &properties, &request.strike, &plan::laws(&scene)?)?;
    let singulation = Singulation::of(&scene, &trajectory.final_poses)?;
    Ok(Motion {
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        violations: singulation.violations().iter().map(ToString::to_string).collect(),
        trajectory,
    })
}

/// Scenarios that were drawn, and what for.
struct Drawn {
    scene: Scene,
    properties: Properties,
    count: usize,
    possibilities: Arc<Possibilities>,
}

/// The last scenarios that were drawn: they stay the same while the strike is dragged.
#[derive(Default)]
pub(crate) struct Clouds([Mutex<Option<Drawn>>; 2]);

impl Clouds {
    /// The outcome of the strike in the scenarios of a plan, or in the first of them.
    ///
    /// # Errors
    /// A pile or a strike that cannot be simulated.
    pub(crate) fn outlook(
        &self,
        project: &Project,
        cache: &Cache,
        request: &StrikeRequest,
    ) -> Result<Outlook> {
        let count = request.worlds;
        if !(1..=Possibilities::OF_A_PLAN).contains(&count) {
            let needed = format!("from 1 to {}", Possibilities::OF_A_PLAN);
            return Err(Error::invalid("the cloud", "worlds", count, needed));
        }
        let scene = cache.pile(project, &request.pile)?;
        let properties = cache.properties(project, &request.properties, &scene)?;
        let possibilities = self.drawn(scene, properties, count)?;
        possibilities.outlook(&request.strike)
    }

    fn drawn(&self, scene: Scene, properties: Properties, count: usize) -> Result<Arc<Possibilities>> {
        // Few worlds while dragging and many at rest alternate: each keeps its own.
        let slot = &self.0[usize::from(count > Possibilities::SHOWN)];
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(drawn) = &*slot
            && drawn.count == count
            && drawn.scene == scene
            && drawn.properties == properties
        {
            return Ok(drawn.possibilities.clone());
        }
        let options = Options { seed: SEED, ..Options::default() };
        let possibilities = Arc::new(Possibilities::new(&scene, &properties, &options, count)?);
        *slot = Some(Drawn { scene, properties, count, possibilities: possibilities.clone() });
        Ok(possibilities)
    }
}

/// A line and a pace on an object of a pile.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AimRequest {
    pile: PileRequest,
    aim: Aim,
}

/// The strike of an aim, or what is in its way.
///
/// # Errors
/// A pile that is not valid.
pub(crate) fn aimed(project: &Project, cache: &Cache, request: &AimRequest) -> Result<serde_json::Value> {
    let scene = cache.pile(project, &request.pile)?;
    let aimed = plan::aimed(&scene, &request.aim)?;
    Ok(match aimed {
        Ok(strike) => serde_json::json!({ "strike": strike }),
        Err(obstacle) => serde_json::json!({ "obstacle": obstacle }),
    })
}
