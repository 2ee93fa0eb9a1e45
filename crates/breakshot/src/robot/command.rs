//! The stage's output: joint angles over time, phase by phase (`command.json`), or the reason for a refusal.

use super::arm::joint_state::JointState;
use super::arm::mounted_arm::MountedArm;
use super::path::limits::LimitCheck;
use super::phase::{Phase, PhaseName};
use crate::cell::RobotSpec;
use crate::error::Result;
use crate::geometry::{Point, Vec2};
use crate::object::Shape;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};

/// The joint path of a strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Command {
    /// The file format's version.
    pub version: u32,
    /// The arm's name.
    pub arm: String,
    /// The joints' names in order from the base.
    pub joints: Vec<String>,
    /// The arm, its base pose and its tool, as used in planning.
    pub robot: RobotSpec,
    /// The text of the arm's URDF; `None` for a built-in arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// The striker's outline.
    pub striker: Shape,
    /// The planned strike.
    pub strike: Strike,
    /// The scene of the plan; `None` if only the strike was given.
    pub scene: Option<Scene>,
    /// The straight motion of the tip in the strike, in the table frame.
    pub stroke: Stroke,
    /// The phases in order; each starts and ends at rest.
    pub phases: Vec<Phase>,
    /// The value nearest to the limit, for each checked quantity.
    pub checks: Vec<LimitCheck>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Whether the arm can execute the strike.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The arm can: the joint path.
    Ready(Box<Command>),
    /// The arm cannot: the reason.
    Refused(Refusal),
}

/// Why the arm cannot execute a strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Refusal {
    /// The limit broken by the best attempt, with the value found and the value allowed.
    pub reason: String,
    /// The joint or part of the arm concerned, if there is one.
    pub part: Option<String>,
    /// The largest speed on this line within the joints' speed limits (m/s); `None` if the line is out of reach.
    pub fastest_m_s: Option<f64>,
}

/// The motion of the tip along the strike's line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Stroke {
    /// Start of the run-up, at rest; behind the strike's `start_m` if the run-up needs more distance.
    pub begin_m: Point,
    /// End of the stop, at rest.
    pub end_m: Point,
    /// Length of the run-up (m).
    pub run_up_m: f64,
    /// Length of the stop (m).
    pub stop_m: f64,
    /// Largest acceleration (m/s2).
    pub acceleration_m_s2: f64,
    /// Speed of the draw-back (m/s).
    pub draw_back_m_s: f64,
    /// Distance of the striker's centre from `start_m` to the contact with the first object (m); `None` without a contact.
    pub contact_after_m: Option<f64>,
    /// Time of the contact since the command's start (s); without a contact, of the middle of the constant speed.
    pub contact_time_s: f64,
    /// The tip's speed at that time, from the joint angles and velocities (m/s).
    pub contact_speed_m_s: f64,
    /// The effective mass of the tip along the heading (kg, Eq. 8); a lower bound if the cell gives no rotor inertias.
    pub effective_mass_kg: f64,
    /// The kinetic energy of that mass at that speed (J).
    pub energy_j: f64,
    /// Rotation of the tool about the vertical (rad, table frame).
    pub tool_yaw_rad: f64,
}

/// Largest distance by which the striker may overshoot the planned end (m).
const OVERSHOOT_M: f64 = 0.001;

impl Command {
    /// The distance by which the arm stops past the strike's planned end (m); `None` within [`OVERSHOOT_M`].
    pub(crate) fn overshoot_m(&self) -> Option<f64> {
        let Strike { start_m, heading_rad, travel_m, .. } = self.strike;
        let beyond_m = (self.stroke.end_m - start_m).dot(Vec2::from_heading(heading_rad)) - travel_m;
        (beyond_m > OVERSHOOT_M).then_some(beyond_m)
    }

    /// The phase of a name.
    pub fn phase(&self, name: PhaseName) -> Option<&Phase> {
        self.phases.iter().find(|phase| phase.name == name)
    }

    /// The arm for which the command was planned.
    ///
    /// # Errors
    /// An arm model that cannot be built.
    pub fn mounted_arm(&self) -> Result<MountedArm> {
        let robot = RobotSpec { urdf: self.urdf.clone(), ..self.robot.clone() };
        MountedArm::new(&robot, self.striker.clone())
    }

    /// The total duration (s).
    pub fn duration_s(&self) -> f64 {
        self.phases.last().map_or(0.0, |phase| phase.span_s()[1])
    }

    /// The joint state at a time since the command's start (s); `None` for a command without phases.
    pub fn at(&self, time_s: f64) -> Option<JointState> {
        let phase = self.phases.iter().find(|phase| time_s <= phase.span_s()[1]).or(self.phases.last())?;
        Some(phase.at(time_s))
    }

    /// A hash of everything that the robot would do and of what it was planned for (eight hexadecimal digits), which the user
    /// repeats to permit the motion: all of the command but its warnings.
    pub fn short_hash(&self) -> String {
        let hashed = Self { warnings: Vec::new(), ..self.clone() };
        // A command without a text has numbers that are none; nothing is permitted by the hash of an empty text.
        let text = serde_json::to_vec(&hashed).unwrap_or_default();
        let hash = text.iter().fold(FNV_OFFSET, |hash, &b| (hash ^ u64::from(b)).wrapping_mul(FNV_PRIME));
        format!("{:08x}", (hash >> 32) ^ (hash & 0xffff_ffff))
    }
}

/// The constants of the 64 bit FNV-1a hash.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;
