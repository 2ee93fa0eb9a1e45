//! What the robot is told: joint angles over time, phase by phase (`command.json`).

use super::arm::joint_state::JointState;
use super::arm::mounted_arm::Station;
use super::path::limits::Check;
use super::phase::{Phase, PhaseName};
use crate::cell::RobotSpec;
use crate::error::Result;
use crate::geometry::Point;
use crate::object::Shape;
use crate::scene::{Scene, Strike};
use serde::{Deserialize, Serialize};

/// A strike as the arm carries it out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// The file format's version.
    pub version: u32,
    /// The arm's name.
    pub arm: String,
    /// Its joints' names, from the base on.
    pub joints: Vec<String>,
    /// The arm's place, tool and limits, as planned with.
    pub robot: RobotSpec,
    /// The striker's outline.
    pub striker: Shape,
    /// What was planned.
    pub strike: Strike,
    /// What lay where; none if only the strike was known.
    pub scene: Option<Scene>,
    /// The straight part, in the table's frame.
    pub stroke: Stroke,
    /// Joint angles over time; every phase starts and ends at rest.
    pub phases: Vec<Phase>,
    /// How near the path comes to each limit.
    pub checks: Vec<Check>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Whether the arm can carry out the strike.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// It can: this is how.
    Ready(Box<Command>),
    /// It cannot: this is why.
    Refused(Refusal),
}

/// Why the arm cannot carry out a strike.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refusal {
    /// The limit that the best attempt breaks, what was found and what is allowed.
    pub reason: String,
    /// The joint or part of the arm that is to blame, if one is.
    pub part: Option<String>,
    /// The fastest strike on this line that no joint is too slow for (m/s), if the line can be reached.
    pub fastest_m_s: Option<f64>,
}

/// How the tip runs along the strike's line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stroke {
    /// Where the tip starts from rest; behind the strike's `start_m` if it needs more way to gain its speed.
    pub begin_m: Point,
    /// Where it comes to rest.
    pub end_m: Point,
    /// How far it moves before it has its speed (m).
    pub run_up_m: f64,
    /// How far it moves while it stops (m).
    pub stop_m: f64,
    /// Its largest acceleration (m/s2).
    pub acceleration_m_s2: f64,
    /// How fast it draws back (m/s).
    pub draw_back_m_s: f64,
    /// How far the striker's centre has to go from `start_m` to touch the first object (m), if one is in its way.
    pub contact_after_m: Option<f64>,
    /// When that is (s), or when the striker passes the middle of its even part.
    pub contact_time_s: f64,
    /// The tip's speed then, from the joint angles and speeds (m/s).
    pub contact_speed_m_s: f64,
    /// What the tip feels like to what it hits (kg, Eq. 8); rotors count only if the cell tells them.
    pub effective_mass_kg: f64,
    /// The energy of that mass at that speed (J).
    pub energy_j: f64,
    /// How the tool is turned about the vertical (rad, table).
    pub tool_yaw_rad: f64,
}

impl Command {
    /// The phase of that name.
    pub fn phase(&self, name: PhaseName) -> Option<&Phase> {
        self.phases.iter().find(|phase| phase.name == name)
    }

    /// The arm in its place, as the command was made for it.
    ///
    /// # Errors
    /// An arm that cannot be read again.
    pub fn station(&self) -> Result<Station> {
        Station::new(&self.robot, self.striker.clone())
    }

    /// How long it takes in all (s).
    pub fn duration_s(&self) -> f64 {
        self.phases.last().map_or(0.0, |phase| phase.span_s()[1])
    }

    /// The arm at a time since the command's start; `None` for a command without phases.
    pub fn at(&self, time_s: f64) -> Option<JointState> {
        let phase = self.phases.iter().find(|phase| time_s <= phase.span_s()[1]).or(self.phases.last())?;
        Some(phase.at(time_s))
    }

    /// Eight hexadecimal digits that change with anything the robot would do: what a user repeats to let it move.
    pub fn short_hash(&self) -> String {
        let mut hash = FNV_OFFSET;
        let mut feed =
            |bytes: &[u8]| bytes.iter().for_each(|&b| hash = (hash ^ u64::from(b)).wrapping_mul(FNV_PRIME));
        for phase in &self.phases {
            for (k, &time_s) in phase.time_s.iter().enumerate() {
                feed(&time_s.to_bits().to_le_bytes());
                phase.q_rad[k].iter().for_each(|q| feed(&q.to_bits().to_le_bytes()));
            }
        }
        for placed in self.scene.iter().flat_map(|scene| &scene.placed) {
            feed(placed.object.as_bytes());
            for value in [placed.position_m.x, placed.position_m.y, placed.yaw_rad] {
                feed(&value.to_bits().to_le_bytes());
            }
        }
        format!("{:08x}", (hash >> 32) ^ (hash & 0xffff_ffff))
    }
}

/// The constants of the 64 bit FNV-1a hash.
const FNV_OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;
