//! The joint path of a strike: the arm's skeleton, the joints' speeds and their limits over time.

use crate::cell::fit::cell;
use crate::pile::request::Cache;
use crate::project::Project;
use breakshot::Result;
use breakshot::files::{self, Planned};
use breakshot::robot::{
    self, Answer, Command, LimitCheck, MountedArm, Options, Phase, PhaseName, Refusal, Stroke,
};
use breakshot::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};

/// A strike for the arm of a cell.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CommandRequest {
    cell: String,
    /// A plan, or a file with only the strike.
    strike: String,
    /// The scene, if it is not that of the plan.
    scene: Option<String>,
}

/// What `breakshot command` finds.
#[derive(Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub(crate) enum Found {
    /// The cell has no arm: what to add.
    Missing {
        needed: String,
    },
    /// The strike cannot be executed.
    Refused {
        refusal: Refusal,
    },
    Ready(Box<Path>),
}

/// The joint path with everything that its drawings need.
#[derive(Serialize)]
pub(crate) struct Path {
    hash: String,
    arm: String,
    strike: Strike,
    stroke: Stroke,
    duration_s: f64,
    phases: Vec<NamedPhase>,
    checks: Vec<Check>,
    warnings: Vec<String>,
    notes: Vec<String>,
    joints: Vec<JointPath>,
    /// Times (s since the command's start): every sample of the strike, and fewer of the other phases.
    time_s: Vec<f64>,
    /// The origins of base, joints, flange and tip at these times (m, table frame).
    skeleton_m: Vec<Vec<[f64; 3]>>,
    /// The tip's speed along the table (m/s).
    tip_speed_m_s: Vec<f64>,
    workspace: breakshot::cell::Workspace,
    scene: Option<Scene>,
}

#[derive(Serialize)]
struct NamedPhase {
    name: PhaseName,
    label: &'static str,
    span_s: [f64; 2],
}

/// A check of a limit, and its sentence.
#[derive(Serialize)]
struct Check {
    #[serde(flatten)]
    check: LimitCheck,
    sentence: String,
}

/// One joint over time.
#[derive(Serialize)]
struct JointPath {
    name: String,
    /// The largest speed of the path (rad/s): the share of the joint's own limit that is used.
    allowed_rad_s: f64,
    speed_rad_s: f64,
    /// The largest speed of all samples of the path (rad/s).
    most_rad_s: f64,
    range_rad: [f64; 2],
    q_rad: Vec<f64>,
    qd_rad_s: Vec<f64>,
}

/// Of the samples outside the strike, one of so many is shown: every 16 ms, as on a screen...
const STRIDE: usize = 8;
/// ... and at most about so many.
const MOST_SAMPLES: usize = 4000;

/// The joint path of a strike, as `breakshot command STRIKE --cell CELL` writes it.
///
/// # Errors
/// Files that are not of the project or not valid, an arm that cannot be read, a strike that starts inside an object.
pub(crate) fn found(project: &Project, cache: &Cache, request: &CommandRequest) -> Result<Found> {
    let cell = cell(project, &request.cell)?;
    if cell.robot.as_ref().is_none_or(|robot| robot.base_from_table.is_none()) {
        let file = &request.cell;
        let what = if cell.robot.is_some() { "`base_from_table` to `[robot]`" } else { "`[robot]`" };
        let needed = format!(
            "{file} has no arm at the table: add {what}, with `arm = \"indy7\"` or a URDF file and \
             `base_from_table = {{ position_m = [x, y, z], rpy_rad = [r, p, y] }}`, which `breakshot command --touch` measures."
        );
        return Ok(Found::Missing { needed });
    }
    let path = project.file(&request.strike)?;
    let Planned { strike, mut scene } = match &request.scene {
        Some(_) => Planned { strike: files::load_strike(&path)?, scene: None },
        None => files::load_planned(&path)?,
    };
    if let Some(name) = &request.scene {
        scene = Some(cache.scene_file(project, name)?.0.clone());
    }
    let options = Options::default();
    match robot::command(&cell, &strike, scene.as_ref(), &options)? {
        Answer::Refused(refusal) => Ok(Found::Refused { refusal }),
        Answer::Ready(command) => Ok(Found::Ready(Box::new(shown(*command, &options, &cell)?))),
    }
}

fn shown(command: Command, options: &Options, cell: &breakshot::cell::Cell) -> Result<Path> {
    let mounted = command.mounted_arm()?;
    let samples = samples(&command.phases);
    let joints = joints(&command, &mounted, options, &samples);
    let states = samples.iter().map(|&(phase, k)| phase_state(&command.phases[phase], k));
    let (mut skeleton_m, mut tip_speed_m_s) = (Vec::new(), Vec::new());
    for state in states {
        skeleton_m.push(mounted.skeleton_on_table(&state.q_rad));
        tip_speed_m_s.push(mounted.tip_velocity_on_table(&state).length());
    }
    let phase =
        |phase: &Phase| NamedPhase { name: phase.name, label: phase.name.label(), span_s: phase.span_s() };
    let check = |check: &LimitCheck| Check { check: check.clone(), sentence: check.sentence() };
    Ok(Path {
        hash: command.short_hash(),
        duration_s: command.duration_s(),
        phases: command.phases.iter().map(phase).collect(),
        checks: command.checks.iter().map(check).collect(),
        notes: command.safety_notes()?,
        time_s: samples.iter().map(|&(phase, k)| command.phases[phase].time_s[k]).collect(),
        joints,
        skeleton_m,
        tip_speed_m_s,
        workspace: cell.workspace,
        arm: command.arm,
        strike: command.strike,
        stroke: command.stroke,
        warnings: command.warnings,
        scene: command.scene,
    })
}

fn phase_state(phase: &Phase, k: usize) -> robot::JointState {
    robot::JointState {
        q_rad: phase.q_rad[k].clone(),
        qd_rad_s: phase.qd_rad_s[k].clone(),
        qdd_rad_s2: phase.qdd_rad_s2[k].clone(),
    }
}

/// Phase and number of the samples that are shown: all of the strike, one of so many of the others, and the last of each phase.
fn samples(phases: &[Phase]) -> Vec<(usize, usize)> {
    let count: usize = phases.iter().map(|phase| phase.time_s.len()).sum();
    let coarse = count.div_ceil(MOST_SAMPLES).max(STRIDE);
    let mut samples = Vec::new();
    for (number, phase) in phases.iter().enumerate() {
        let stride = if phase.name == PhaseName::Strike { 1 } else { coarse };
        let last = phase.time_s.len().saturating_sub(1);
        let of_phase = (0..phase.time_s.len()).filter(|k| k % stride == 0 || *k == last);
        samples.extend(of_phase.map(|k| (number, k)));
    }
    samples
}

fn joints(
    command: &Command,
    mounted: &MountedArm,
    options: &Options,
    samples: &[(usize, usize)],
) -> Vec<JointPath> {
    let links = mounted.arm().links.iter().enumerate();
    let most = |joint: usize| {
        let speeds = command.phases.iter().flat_map(|phase| &phase.qd_rad_s).map(|qd| qd[joint].abs());
        speeds.fold(0.0, f64::max)
    };
    let joint = |(joint, link): (usize, &robot::Link)| JointPath {
        name: link.joint.name.clone(),
        allowed_rad_s: options.limits.speed_fraction * link.joint.speed_rad_s,
        speed_rad_s: link.joint.speed_rad_s,
        most_rad_s: most(joint),
        range_rad: link.joint.range_rad,
        q_rad: samples.iter().map(|&(phase, k)| command.phases[phase].q_rad[k][joint]).collect(),
        qd_rad_s: samples.iter().map(|&(phase, k)| command.phases[phase].qd_rad_s[k][joint]).collect(),
    };
    links.map(joint).collect()
}
