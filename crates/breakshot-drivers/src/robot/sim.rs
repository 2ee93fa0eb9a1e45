//! The simulated robot: an arm that follows its path exactly, and a simulation of the struck pile.

use crate::fault::Fault;
use crate::motion::Motion;
use crate::preflight::PreflightCheck;
use crate::robot::arm::ArmState;
use breakshot::geometry::{Pose, Vec2};
use breakshot::physics;
use breakshot::properties::Properties;
use breakshot::robot::{Command, PhaseName};
use breakshot::scene::Strike;
use breakshot::scene::singulation::Singulation;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use tokio::time::Instant;

/// The result of a simulated strike.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SimulatedStrike {
    /// The tip's speed along the heading at the contact, computed from the joint angles and velocities (m/s).
    pub speed_m_s: f64,
    /// The final pose of each object: x, y (m), yaw (rad).
    #[serde(rename = "places")]
    pub final_poses: BTreeMap<String, [f64; 3]>,
    /// The unmet conditions of the goal, one sentence each.
    pub violations: Vec<String>,
}

pub(crate) struct Sim {
    command: Command,
    properties: Properties,
    now: Mutex<Now>,
    #[cfg(test)]
    pub(crate) injected: Option<InjectedFault>,
    /// How much faster than planned the arm moves.
    #[cfg(test)]
    pub(crate) speedup: f64,
}

/// A fault that a test injects into a motion, at a time after the motion's start.
#[cfg(test)]
pub(crate) struct InjectedFault {
    pub(crate) motion: &'static str,
    pub(crate) after_s: f64,
    pub(crate) fault: Fault,
}

#[derive(Default)]
struct Now {
    q_rad: Vec<f64>,
    motion: Option<(Motion, Instant)>,
    /// The names of the requests received, in order: motions, and `stop`.
    received: Vec<&'static str>,
}

impl Sim {
    /// An arm at rest at the command's first pose.
    pub(crate) fn new(command: &Command, properties: &Properties) -> Self {
        let q_rad = command.at(0.0).map(|state| state.q_rad).unwrap_or_default();
        Self {
            command: command.clone(),
            properties: properties.clone(),
            now: Mutex::new(Now { q_rad, ..Now::default() }),
            #[cfg(test)]
            injected: None,
            #[cfg(test)]
            speedup: 1.0,
        }
    }

    fn now(&self) -> std::sync::MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The arm's state.
    pub(crate) fn state(&self) -> ArmState {
        let mut now = self.now();
        let Some((motion, begun)) = &now.motion else {
            return ArmState { q_rad: now.q_rad.clone(), moving: false, age_s: 0.0 };
        };
        let since_s = begun.elapsed().as_secs_f64() * self.speedup();
        let (q_rad, moving) = (motion.at(since_s).q_rad, since_s < motion.duration_s());
        if !moving {
            now.motion = None;
            now.q_rad.clone_from(&q_rad);
        }
        ArmState { q_rad, moving, age_s: 0.0 }
    }

    #[cfg(test)]
    fn speedup(&self) -> f64 {
        self.speedup
    }

    #[cfg(not(test))]
    fn speedup(&self) -> f64 {
        let _ = self;
        1.0
    }

    /// The injected fault, if it is due.
    #[cfg(test)]
    pub(crate) fn fault(&self) -> Option<Fault> {
        let (now, injected) = (self.now(), self.injected.as_ref()?);
        let (motion, begun) = now.motion.as_ref()?;
        let is_due = injected.motion == motion.name && begun.elapsed().as_secs_f64() >= injected.after_s;
        is_due.then(|| injected.fault.clone())
    }

    /// The injected fault: `None` outside tests.
    #[cfg(not(test))]
    pub(crate) fn fault(&self) -> Option<Fault> {
        let _ = self;
        None
    }

    pub(crate) fn send(&self, motion: &Motion) -> Result<(), Fault> {
        let mut now = self.now();
        if now.motion.is_some() {
            return Err(Fault::Refused { request: "a motion".into(), answer: "the arm is moving".into() });
        }
        now.received.push(motion.name);
        now.motion = Some((motion.clone(), Instant::now()));
        Ok(())
    }

    pub(crate) fn stop(&self) {
        let mut now = self.now();
        now.received.push("stop");
        if let Some((motion, begun)) = now.motion.take() {
            now.q_rad = motion.at(begun.elapsed().as_secs_f64()).q_rad;
        }
    }

    /// The names of the requests received, in order.
    #[cfg(test)]
    pub(crate) fn received(&self) -> Vec<&'static str> {
        self.now().received.clone()
    }

    /// Whether the strike was received.
    pub(crate) fn has_struck(&self) -> bool {
        self.now().received.contains(&PhaseName::Strike.label())
    }

    /// Simulates the strike on the command's scene, at the tip's speed computed from the joint path.
    ///
    /// # Errors
    /// The reason for which the pile cannot be simulated.
    pub(crate) fn simulated(&self) -> Result<SimulatedStrike, String> {
        let command = &self.command;
        let scene =
            command.scene.as_ref().ok_or("the command has no scene: the objects' positions are not known")?;
        let state = command.at(command.stroke.contact_time_s).ok_or("the command has no phases")?;
        let mounted = command.mounted_arm().map_err(|e| e.to_string())?;
        let along = Vec2::from_heading(command.strike.heading_rad);
        let speed_m_s = mounted.tip_velocity_on_table(&state).dot(along);
        let strike = Strike { speed_m_s, ..command.strike.clone() };
        let options = physics::Options::default();
        let trajectory =
            physics::trajectory(scene, &self.properties, &strike, &options).map_err(|e| e.to_string())?;
        if !trajectory.complete {
            return Err(format!("the simulation does not come to rest: {}", trajectory.notes.join("; ")));
        }
        let poses = trajectory.final_poses;
        let singulation = Singulation::of(scene, &poses).map_err(|e| e.to_string())?;
        let violations = singulation.violations().iter().map(ToString::to_string).collect();
        let row = |pose: &Pose| [pose.position.x, pose.position.y, pose.yaw_rad];
        let final_poses = poses.iter().map(|(name, pose)| (name.clone(), row(pose))).collect();
        Ok(SimulatedStrike { speed_m_s, final_poses, violations })
    }

    /// Checks that the strike can be simulated.
    pub(crate) fn preflight(&self) -> Vec<PreflightCheck> {
        let found = self.simulated().map_or_else(|reason| reason, |_| "can be simulated".into());
        let holds = found == "can be simulated";
        vec![PreflightCheck::new("strike on the pile", found, "can be simulated", holds)]
    }
}
