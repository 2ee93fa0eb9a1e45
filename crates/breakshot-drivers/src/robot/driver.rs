//! The robots that a command can be sent to, behind one set of requests.

use crate::fault::Fault;
use crate::motion::Motion;
use crate::preflight::PreflightCheck;
use crate::robot::arm::{ArmState, Stop};
use crate::robot::indy::{self, Indy};
use crate::robot::rosbridge::{self, Rosbridge};
use crate::robot::sim::Sim;
use breakshot::properties::Properties;
use breakshot::robot::Command;

/// A robot and its address.
#[derive(Clone, Debug)]
pub enum Driver {
    /// An Indy 7 over `IndyDCP3` (gRPC).
    Indy(indy::Address),
    /// Any arm with ROS 2 behind a rosbridge (websocket, `FollowJointTrajectory`).
    Rosbridge(rosbridge::Address),
    /// No robot: the command drives a simulated arm, and the strike is simulated by [`breakshot::physics`].
    Sim(Box<Properties>),
}

impl std::fmt::Display for Driver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Indy(address) => write!(f, "indy:{}", address.host),
            Self::Rosbridge(address) => write!(f, "ros:{}", address.host),
            Self::Sim(_) => write!(f, "sim"),
        }
    }
}

/// A connected robot.
pub(crate) enum Robot {
    Indy(Box<Indy>),
    Rosbridge(Box<Rosbridge>),
    Sim(Box<Sim>),
}

impl Robot {
    pub(crate) async fn connect(driver: &Driver, command: &Command) -> Result<Self, Fault> {
        Ok(match driver {
            Driver::Indy(address) => Self::Indy(Box::new(Indy::connect(address).await?)),
            Driver::Rosbridge(address) => {
                Self::Rosbridge(Box::new(Rosbridge::connect(address, &command.joints).await?))
            }
            Driver::Sim(properties) => Self::Sim(Box::new(Sim::new(command, properties))),
        })
    }

    /// Checks of the robot that move nothing.
    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<PreflightCheck>, Fault> {
        match self {
            Self::Indy(indy) => indy.preflight(command).await,
            Self::Rosbridge(bridge) => bridge.preflight(command).await,
            Self::Sim(sim) => Ok(sim.preflight()),
        }
    }

    /// The arm's state; an error if the controller reports a fault.
    pub(crate) async fn state(&self) -> Result<ArmState, Fault> {
        match self {
            Self::Indy(indy) => indy.state().await,
            Self::Rosbridge(bridge) => bridge.state(),
            Self::Sim(sim) => sim.fault().map_or_else(|| Ok(sim.state()), Err),
        }
    }

    /// The joint angles (rad), also while the controller reports a fault.
    pub(crate) async fn joint_angles(&self) -> Result<Vec<f64>, Fault> {
        match self {
            Self::Indy(indy) => indy.joint_angles().await,
            Self::Rosbridge(bridge) => bridge.joint_angles(),
            Self::Sim(sim) => Ok(sim.state().q_rad),
        }
    }

    /// Sends a motion; on return the robot has accepted it, but may not have started it.
    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Fault> {
        match self {
            Self::Indy(indy) => indy.send(motion).await,
            Self::Rosbridge(bridge) => bridge.send(motion),
            Self::Sim(sim) => sim.send(motion),
        }
    }

    /// Stops the arm.
    pub(crate) async fn stop(&self, how: Stop) -> Result<(), Fault> {
        match self {
            Self::Indy(indy) => indy.stop(how).await,
            Self::Rosbridge(bridge) => bridge.stop(),
            Self::Sim(sim) => {
                sim.stop();
                Ok(())
            }
        }
    }

    /// The controller's explanation of a fault, if it gives one.
    pub(crate) async fn explanation(&self) -> Option<String> {
        match self {
            Self::Indy(indy) => indy.explanation().await,
            Self::Rosbridge(_) | Self::Sim(_) => None,
        }
    }
}
