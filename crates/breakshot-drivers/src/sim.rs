//! No robot: an arm that follows its path exactly, and our own physics for what it strikes.

use crate::arm::ArmState;
use crate::fault::Trouble;
use crate::motion::Motion;
use crate::preflight::Finding;
use breakshot::geometry::{Pose, Vec2};
use breakshot::physics;
use breakshot::properties::Properties;
use breakshot::robot::{Command, PhaseName};
use breakshot::scene::Strike;
use breakshot::singulation::Singulation;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use tokio::time::Instant;

/// What the strike did in our own physics.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Simulated {
    /// The tip's speed along the strike's line at the contact, from the joints' motion (m/s).
    pub speed_m_s: f64,
    /// Where everything came to rest: x, y (m), yaw (rad).
    pub places: BTreeMap<String, [f64; 3]>,
    /// What of the goal is not met, in words.
    pub violations: Vec<String>,
}

pub(crate) struct Sim {
    command: Command,
    properties: Properties,
    now: Mutex<Now>,
    #[cfg(test)]
    pub(crate) fault: Option<Fault>,
}

/// What a test lets go wrong, in a motion of that name so long after its start.
#[cfg(test)]
pub(crate) struct Fault {
    pub(crate) motion: &'static str,
    pub(crate) after_s: f64,
    pub(crate) trouble: Trouble,
}

#[derive(Default)]
struct Now {
    q_rad: Vec<f64>,
    motion: Option<(Motion, Instant)>,
    /// Names of what was sent, in order, and `stop`.
    told: Vec<&'static str>,
}

impl Sim {
    /// The arm stands where the command starts.
    pub(crate) fn new(command: &Command, properties: &Properties) -> Self {
        let q_rad = command.at(0.0).map(|state| state.q_rad).unwrap_or_default();
        Self {
            command: command.clone(),
            properties: properties.clone(),
            now: Mutex::new(Now { q_rad, ..Now::default() }),
            #[cfg(test)]
            fault: None,
        }
    }

    fn now(&self) -> std::sync::MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The arm now.
    pub(crate) fn state(&self) -> ArmState {
        let mut now = self.now();
        let Some((motion, begun)) = &now.motion else {
            return ArmState { q_rad: now.q_rad.clone(), moving: false };
        };
        let since_s = begun.elapsed().as_secs_f64();
        let (q_rad, moving) = (motion.at(since_s).q_rad, since_s < motion.duration_s());
        if !moving {
            now.motion = None;
            now.q_rad.clone_from(&q_rad);
        }
        ArmState { q_rad, moving }
    }

    /// The trouble that a test wants now.
    #[cfg(test)]
    pub(crate) fn trouble(&self) -> Option<Trouble> {
        let (now, fault) = (self.now(), self.fault.as_ref()?);
        let (motion, begun) = now.motion.as_ref()?;
        let is_due = fault.motion == motion.name && begun.elapsed().as_secs_f64() >= fault.after_s;
        is_due.then(|| fault.trouble.clone())
    }

    /// The trouble that a test wants now: none, for this is no test.
    #[cfg(not(test))]
    pub(crate) fn trouble(&self) -> Option<Trouble> {
        let _ = self;
        None
    }

    pub(crate) fn send(&self, motion: &Motion) -> Result<(), Trouble> {
        let mut now = self.now();
        if now.motion.is_some() {
            return Err(Trouble::Refused { request: "a motion".into(), answer: "the arm is moving".into() });
        }
        now.told.push(motion.name);
        now.motion = Some((motion.clone(), Instant::now()));
        Ok(())
    }

    pub(crate) fn stop(&self) {
        let mut now = self.now();
        now.told.push("stop");
        if let Some((motion, begun)) = now.motion.take() {
            now.q_rad = motion.at(begun.elapsed().as_secs_f64()).q_rad;
        }
    }

    /// What was sent, in order.
    #[cfg(test)]
    pub(crate) fn told(&self) -> Vec<&'static str> {
        self.now().told.clone()
    }

    /// Whether the strike was sent.
    pub(crate) fn has_struck(&self) -> bool {
        self.now().told.contains(&PhaseName::Strike.text())
    }

    /// What the strike does in our own physics, at the speed that the joints give the tip.
    ///
    /// # Errors
    /// Why the pile cannot be simulated.
    pub(crate) fn simulated(&self) -> Result<Simulated, String> {
        let command = &self.command;
        let scene = command.scene.as_ref().ok_or("the command does not say where the objects lie")?;
        let state = command.at(command.stroke.contact_time_s).ok_or("the command has no phases")?;
        let station = command.station().map_err(|e| e.to_string())?;
        let along = Vec2::from_heading(command.strike.heading_rad);
        let speed_m_s = station.tip_velocity_on_table(&state).dot(along);
        let strike = Strike { speed_m_s, ..command.strike.clone() };
        let options = physics::Options::default();
        let trajectory = physics::trajectory(scene, &self.properties, &strike, &options);
        let poses = trajectory.map_err(|e| e.to_string())?.final_poses;
        let singulation = Singulation::of(scene, &poses).map_err(|e| e.to_string())?;
        let violations = singulation.violations(&scene.goal).iter().map(ToString::to_string).collect();
        let place = |pose: &Pose| [pose.position.x, pose.position.y, pose.yaw_rad];
        let places = poses.iter().map(|(name, pose)| (name.clone(), place(pose))).collect();
        Ok(Simulated { speed_m_s, places, violations })
    }

    /// Whether the strike can be simulated.
    pub(crate) fn preflight(&self) -> Vec<Finding> {
        let found = self.simulated().map_or_else(|reason| reason, |_| "can be simulated".into());
        let holds = found == "can be simulated";
        vec![Finding::new("strike on the pile", found, "can be simulated", holds)]
    }
}
