//! A robot, whichever way it is reached.

use crate::arm::{ArmState, Stop};
use crate::fault::Trouble;
use crate::indy::{self, Indy};
use crate::motion::Motion;
use crate::preflight::Finding;
use crate::rosbridge::{self, Rosbridge};
use crate::sim::Sim;
use breakshot::properties::Properties;
use breakshot::robot::Command;

/// Which robot, and how to reach it.
#[derive(Clone, Debug)]
pub enum Driver {
    /// An Indy 7 over `IndyDCP3` (gRPC).
    Indy(indy::Address),
    /// Any arm with ROS 2 behind a rosbridge (websocket, `FollowJointTrajectory`).
    Rosbridge(rosbridge::Address),
    /// None: the command is played into our own physics.
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

/// A robot that is connected.
pub(crate) enum Robot {
    Indy(Box<Indy>),
    Rosbridge(Box<Rosbridge>),
    Sim(Box<Sim>),
}

impl Robot {
    pub(crate) async fn connect(driver: &Driver, command: &Command) -> Result<Self, Trouble> {
        Ok(match driver {
            Driver::Indy(address) => Self::Indy(Box::new(Indy::connect(address).await?)),
            Driver::Rosbridge(address) => {
                Self::Rosbridge(Box::new(Rosbridge::connect(address, &command.joints).await?))
            }
            Driver::Sim(properties) => Self::Sim(Box::new(Sim::new(command, properties))),
        })
    }

    /// What can be learned without moving anything.
    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<Finding>, Trouble> {
        match self {
            Self::Indy(indy) => indy.preflight(command).await,
            Self::Rosbridge(bridge) => bridge.preflight(command).await,
            Self::Sim(sim) => Ok(sim.preflight()),
        }
    }

    /// The arm now; an error if it is not well.
    pub(crate) async fn state(&self) -> Result<ArmState, Trouble> {
        match self {
            Self::Indy(indy) => indy.state().await,
            Self::Rosbridge(bridge) => bridge.state(),
            Self::Sim(sim) => sim.trouble().map_or_else(|| Ok(sim.state()), Err),
        }
    }

    /// The joint angles now, however the arm is (rad).
    pub(crate) async fn place(&self) -> Result<Vec<f64>, Trouble> {
        match self {
            Self::Indy(indy) => indy.place().await,
            Self::Rosbridge(bridge) => bridge.place(),
            Self::Sim(sim) => Ok(sim.state().q_rad),
        }
    }

    /// Hands a motion over; it has been accepted when this returns, and may not have begun.
    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Trouble> {
        match self {
            Self::Indy(indy) => indy.send(motion).await,
            Self::Rosbridge(bridge) => bridge.send(motion),
            Self::Sim(sim) => sim.send(motion),
        }
    }

    pub(crate) async fn stop(&self, how: Stop) -> Result<(), Trouble> {
        match self {
            Self::Indy(indy) => indy.stop(how).await,
            Self::Rosbridge(bridge) => bridge.stop(),
            Self::Sim(sim) => {
                sim.stop();
                Ok(())
            }
        }
    }

    /// What the controller has to say about a trouble, if anything.
    pub(crate) async fn explanation(&self) -> Option<String> {
        match self {
            Self::Indy(indy) => indy.explanation().await,
            Self::Rosbridge(_) | Self::Sim(_) => None,
        }
    }
}
