//! The stages as functions: files and values in, values out.

use crate::arguments::{Arg, warn};
use crate::error::{invalid, raised};
use crate::held::Held;
use crate::values::{
    Cell, Command, Object, Plan, Properties, Refusal, Report, Scene, Strike, Survey, Tracks, Trajectory,
    strike_of,
};
use crate::work::{Stop, run};
use breakshot::capture::{Capture, Decoder, Footage};
use breakshot::detect::Layout;
use breakshot::error::bounds;
use breakshot::plan::{Aim, ExecutionNoise, GridSize, Method, Options};
use breakshot::robot::Answer;
use breakshot::verify::Observed;
use breakshot::{
    Result, cell, detect, estimate as estimation, files, object, physics, properties, robot, scene,
};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// The cell of a `cell.toml`, with the files that it names: camera, tags, workspace, table, striker and arm.
///
/// Lengths are in metres in the table frame; its origin is where the tags put it.
#[pyfunction]
pub(crate) fn load_cell(path: PathBuf) -> PyResult<Cell> {
    files::load_cell(path).map(Cell::from).map_err(raised)
}

/// The kinds of objects of an `objects.toml`: outlines (m), heights (m), markers, masses (kg) if they were weighed.
#[pyfunction]
pub(crate) fn load_objects(py: Python, path: PathBuf) -> PyResult<Vec<Object>> {
    let loaded = files::load_objects(path).map_err(raised)?;
    warn(py, &loaded.notes)?;
    Ok(loaded.value.into_iter().map(Object::from).collect())
}

/// The scene of a `scene.toml`, with the cell and the objects that it names.
///
/// `placed` has the centroid (m) and the yaw (rad, counter-clockwise) of each object in the table frame, `goal` what counts as singulated.
#[pyfunction]
pub(crate) fn load_scene(py: Python, path: PathBuf) -> PyResult<Scene> {
    let loaded = files::load_scene(path).map_err(raised)?;
    warn(py, &loaded.notes)?;
    Ok(loaded.value.into())
}

/// The properties of a `properties.json`: means, standard deviations and 95 % intervals, without units; masses over that of `reference`.
#[pyfunction]
pub(crate) fn load_properties(path: PathBuf) -> PyResult<Properties> {
    files::load_properties(path).map(Properties::from).map_err(raised)
}

/// The strike of a `strike.json` or a `plan.json`: start (m), heading (rad), speed (m/s) and travel (m) in the table frame.
#[pyfunction]
pub(crate) fn load_strike(path: PathBuf) -> PyResult<Strike> {
    files::load_strike(path).map(Strike::from).map_err(raised)
}

/// The tracks of the objects `names` in a film: their centroids (m) and yaws (rad) over time (s) in the table frame.
///
/// `objects` are the kinds, `names` those in the film, such as `["a", "c", "c#2"]`.  Where markers look alike, `scene` says where the
/// objects lay, or `strike_heading_rad` in which order they lie along the strike.  `frame_rate_hz` is the rate at which a film was taken
/// whose file says another.  `Tracks.to_numpy` gives arrays.
#[pyfunction]
#[pyo3(signature = (film, cell, objects, names, *, scene = None, strike_heading_rad = None, frame_rate_hz = None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn track(
    py: Python,
    film: PathBuf,
    cell: Arg<cell::Cell>,
    objects: Vec<Arg<object::Object>>,
    names: Vec<String>,
    scene: Option<Arg<scene::Scene>>,
    strike_heading_rad: Option<f64>,
    frame_rate_hz: Option<f64>,
) -> PyResult<Tracks> {
    if let Some(rate_hz) = frame_rate_hz {
        bounds::frame_rate("track", "frame_rate_hz", rate_hz).map_err(raised)?;
    }
    if let Some(heading_rad) = strike_heading_rad {
        bounds::angle("track", "strike_heading_rad", heading_rad).map_err(raised)?;
    }
    let layout = match (scene, strike_heading_rad) {
        (Some(scene), _) => Layout::Placed(scene.0.placed.clone()),
        (None, Some(heading_rad)) => Layout::AlongStrike { heading_rad, start_m: None },
        (None, None) => Layout::Unknown,
    };
    let objects: Vec<object::Object> = objects.iter().map(|object| (*object.0).clone()).collect();
    let tracked = run(py, move |stop| {
        let stop = stop.clone();
        let footage = Footage::open_with(&film, Decoder::Auto)?.until(move || stop.is_set());
        let film = Capture::of(footage.at_frame_rate(frame_rate_hz), &cell.0)?;
        detect::tracks(film, &objects, &names, &layout, &detect::Options::default())
    })?;
    tracked.map(Tracks::from).map_err(raised)
}

/// The properties of the objects of a `campaign.toml`, from its films and tracks.
///
/// `reference` is the object whose mass is the unit, by default the alphabetically first one.  `update` are earlier properties, to which
/// the clips of the campaign are added.  What no clip supports is absent and listed in `warnings`, as is a film that cannot be read.
#[pyfunction]
#[pyo3(signature = (campaign, *, reference = None, update = None))]
pub(crate) fn estimate(
    py: Python,
    campaign: PathBuf,
    reference: Option<String>,
    update: Option<Arg<properties::Properties>>,
) -> PyResult<Properties> {
    let options = estimation::Options { reference };
    let work = move |stop: &Stop| estimated(&campaign, update.map(|update| update.0), &options, stop);
    let (properties, notes) = run(py, work)?.map_err(raised)?;
    warn(py, &notes)?;
    Ok(properties.into())
}

/// The properties, and the notes of loading the campaign.
fn estimated(
    campaign: &PathBuf,
    old: Option<Arc<properties::Properties>>,
    options: &estimation::Options,
    stop: &Stop,
) -> Result<(properties::Properties, Vec<String>)> {
    let files::Loaded { value: campaign, notes } = files::load_campaign(campaign)?;
    let (cell, objects) = (&campaign.cell, &campaign.objects);
    if let Some(old) = &old {
        let names: Vec<&str> = campaign.clips.iter().map(|clip| clip.name.as_str()).collect();
        estimation::check_update(old, &names, cell, objects, options)?;
    }
    let (clips, unreadable) = breakshot::campaign_tracks(&campaign, |clip| {
        let stop = stop.clone();
        breakshot::clip_tracks_until(&campaign, clip, Decoder::Auto, move || stop.is_set())
    })?;
    let properties = breakshot::campaign_properties(&campaign, old.as_deref(), &clips, unreadable, options)?;
    Ok((properties, notes))
}

/// What a strike does to a pile, with the properties at their means: final poses `(x_m, y_m, yaw_rad)` in the table frame, events,
/// motions as polynomials of time (s), and energies (J, or per mass of the reference object if no object was weighed).
///
/// `strike` may be a plan.  Many strikes are simulated faster by `Simulator.rollout`.
#[pyfunction]
pub(crate) fn simulate(
    py: Python,
    scene: Arg<scene::Scene>,
    properties: Arg<properties::Properties>,
    strike: &Bound<'_, PyAny>,
) -> PyResult<Trajectory> {
    let strike = strike_of(strike)?;
    let simulated = run(py, move |_| {
        let laws = breakshot::plan::laws(&scene.0)?;
        physics::trajectory(&scene.0, &*properties.0.completed_for(&scene.0)?, &strike, &laws)
    })?;
    simulated.map(Trajectory::from).map_err(raised)
}

/// The noise of these standard deviations; the default ones where none is given.
pub(crate) fn noise(
    position_std_m: Option<f64>,
    yaw_std_rad: Option<f64>,
    speed_std: Option<f64>,
    heading_std_rad: Option<f64>,
) -> ExecutionNoise {
    let default = ExecutionNoise::default();
    ExecutionNoise {
        position_m: position_std_m.unwrap_or(default.position_m),
        yaw_rad: yaw_std_rad.unwrap_or(default.yaw_rad),
        speed: speed_std.unwrap_or(default.speed),
        heading_rad: heading_std_rad.unwrap_or(default.heading_rad),
    }
}

/// The strike that singulates a pile, by the goal of the scene.
///
/// `method="robust"` finds the strike with the largest success probability over all that is uncertain, `"paper"` that of the paper with
/// the properties at their means.  `any_arm` plans also what the arm of the cell cannot execute.  `proposals` are strikes that are
/// evaluated as well: mappings with `object`, `heading_rad`, `offset_m`, `speed_m_s` and `follow_through_m`.  The noise of observed
/// positions (m) and yaws (rad), and of the executed speed (a fraction) and heading (rad), are standard deviations.
///
/// That no strike works is an answer: `outcome` is `"found"`, `"best_effort"` or `"unreachable"`, `reason` says why, and `remedies` lists
/// what would help; `remedies=False` does not search for it, which takes about as long as the plan.
#[pyfunction]
#[pyo3(signature = (scene, properties, *, method = "robust", seed = 1, any_arm = false, remedies = true, proposals = Vec::new(),
    position_std_m = None, yaw_std_rad = None, speed_std = None, heading_std_rad = None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn plan(
    py: Python,
    scene: Arg<scene::Scene>,
    properties: Arg<properties::Properties>,
    method: &str,
    seed: u64,
    any_arm: bool,
    remedies: bool,
    proposals: Vec<Arg<Aim>>,
    position_std_m: Option<f64>,
    yaw_std_rad: Option<f64>,
    speed_std: Option<f64>,
    heading_std_rad: Option<f64>,
) -> PyResult<Plan> {
    let method = match method {
        "paper" => Method::Paper,
        "robust" => Method::Robust,
        other => return Err(invalid("plan", "method", format!("`{other}`"), "`paper` or `robust`")),
    };
    let noise = noise(position_std_m, yaw_std_rad, speed_std, heading_std_rad);
    let aims: Vec<Aim> = proposals.iter().map(|aim| (*aim.0).clone()).collect();
    let planned = run(py, move |stop| {
        let (stopped, proposals) = (|| stop.is_set(), |_: &scene::Scene| aims.clone());
        let options = Options {
            method,
            any_arm,
            remedies,
            proposals: Some(&proposals),
            noise,
            seed,
            stopped: Some(&stopped),
            progress: None,
        };
        breakshot::plan::plan(&scene.0, &*properties.0.completed_for(&scene.0)?, &options)
    })?;
    planned.map(Plan::from).map_err(raised)
}

impl Held for Aim {
    const NAME: &'static str = "Aim";

    fn held_by(_: &Bound<'_, PyAny>) -> Option<Arc<Self>> {
        None
    }
}

/// Strikes on every object from all directions with their success probabilities: a map of the pile, and data to learn from.
///
/// At most `strikes` strikes of the planner's grid are each simulated in the same `samples` scenarios; the noise is that of `plan`.
#[pyfunction]
#[pyo3(signature = (scene, properties, *, strikes = 1000, samples = 100, seed = 1, any_arm = false,
    position_std_m = None, yaw_std_rad = None, speed_std = None, heading_std_rad = None))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub(crate) fn survey(
    py: Python,
    scene: Arg<scene::Scene>,
    properties: Arg<properties::Properties>,
    strikes: usize,
    samples: usize,
    seed: u64,
    any_arm: bool,
    position_std_m: Option<f64>,
    yaw_std_rad: Option<f64>,
    speed_std: Option<f64>,
    heading_std_rad: Option<f64>,
) -> PyResult<Survey> {
    /// As the program's flags.
    const MOST: usize = 100_000;
    for (what, count) in [("strikes", strikes), ("samples", samples)] {
        if !(1..=MOST).contains(&count) {
            return Err(invalid("survey", what, count, &format!("from 1 to {MOST}")));
        }
    }
    let noise = noise(position_std_m, yaw_std_rad, speed_std, heading_std_rad);
    let surveyed = run(py, move |stop| {
        let stopped = || stop.is_set();
        let options = Options { any_arm, noise, seed, stopped: Some(&stopped), ..Options::default() };
        let properties = properties.0.completed_for(&scene.0)?;
        breakshot::plan::survey(&scene.0, &properties, &options, GridSize { strikes, samples })
    })?;
    surveyed.map(Survey::from).map_err(raised)
}

/// A filmed strike beside its simulation: poses, distances of all pairs (m), errors, and whether the goal was reached.
///
/// `tracks` are those of a film that starts with the objects where the scene has them, and ends with them at rest.
#[pyfunction]
pub(crate) fn verify(
    py: Python,
    scene: Arg<scene::Scene>,
    properties: Arg<properties::Properties>,
    strike: &Bound<'_, PyAny>,
    tracks: Arg<detect::Tracks>,
) -> PyResult<Report> {
    let strike = strike_of(strike)?;
    let compared = run(py, move |_| {
        let properties = properties.0.completed_for(&scene.0)?;
        let simulated =
            physics::trajectory(&scene.0, &properties, &strike, &breakshot::plan::laws(&scene.0)?)?;
        let observed = Observed::from_tracks(&tracks.0);
        let mut report = breakshot::verify::comparison(&scene.0, &simulated.final_poses, &observed)?;
        report.align(&tracks.0, &simulated);
        Ok(report)
    })?;
    compared.map(Report::from).map_err(raised)
}

/// The joint path of a strike (rad, rad/s over time in s), or the reason why the arm of the cell cannot carry it out.
///
/// A plan brings its scene; with a scene the run-up avoids the objects.  Nothing moves: `breakshot strike` executes a command.
#[pyfunction]
#[pyo3(signature = (cell, strike, scene = None))]
pub(crate) fn command(
    py: Python,
    cell: Arg<cell::Cell>,
    strike: &Bound<'_, PyAny>,
    scene: Option<Arg<scene::Scene>>,
) -> PyResult<Py<PyAny>> {
    let planned = breakshot::plan::Plan::held_by(strike).map(|plan| Arc::new(plan.scene.clone()));
    let scene = scene.map(|scene| scene.0).or(planned);
    let strike = strike_of(strike)?;
    let answer =
        run(py, move |_| robot::command(&cell.0, &strike, scene.as_deref(), &robot::Options::default()))?;
    Ok(match answer.map_err(raised)? {
        Answer::Ready(command) => Py::new(py, Command::from(*command))?.into_any(),
        Answer::Refused(refusal) => Py::new(py, Refusal::from(refusal))?.into_any(),
    })
}
