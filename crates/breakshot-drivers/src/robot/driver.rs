//! The robots that a command can be sent to, behind one set of requests.

use crate::fault::Fault;
use crate::motion::Motion;
use crate::preflight::PreflightCheck;
use crate::robot::arm::{ArmState, Stop, StopAnswer};
#[cfg(feature = "network")]
use crate::robot::indy::{self, Indy};
#[cfg(feature = "network")]
use crate::robot::rosbridge::{self, Rosbridge};
use crate::robot::sim::{Sim, SimulatedStrike};
use breakshot::Error;
use breakshot::properties::Properties;
use breakshot::robot::Command;

/// A robot and its address.
#[derive(Clone, Debug)]
pub enum Driver {
    /// An Indy 7 over `IndyDCP3` (gRPC).
    #[cfg(feature = "network")]
    Indy(indy::Address),
    /// Any arm with ROS 2 behind a rosbridge (websocket, `FollowJointTrajectory`).
    #[cfg(feature = "network")]
    Rosbridge(rosbridge::Address),
    /// No robot: the command drives a simulated arm, and the strike is simulated by [`breakshot::physics`].
    Sim(Box<Properties>),
}

impl Driver {
    /// The robot on the network that `name` denotes: `indy:HOST`, `indy:HOST:PORT` or `ros:HOST:PORT`.
    /// `controller` is the name of the ROS controller.
    ///
    /// # Errors
    /// Any other name; every name if this crate was built without the feature `network`.
    pub fn on_network(name: &str, controller: &str) -> breakshot::Result<Self> {
        let error = |needed| Error::invalid("--driver", "robot", format!("`{name}`"), needed);
        let wrong = || error("`indy:HOST`, `indy:HOST:PORT`, `indy-sim:HOST`, `ros:HOST:PORT` or `sim`");
        let (kind, host) = name.split_once(':').ok_or_else(wrong)?;
        if cfg!(not(feature = "network")) && ["indy", "indy-sim", "ros"].contains(&kind) {
            let needed = "a program with the drivers for robots on the network: \
                          `cargo install --path crates/breakshot-cli --features network`";
            return Err(error(needed));
        }
        Self::at(kind, host, controller).ok_or_else(wrong)
    }

    #[cfg(feature = "network")]
    fn at(kind: &str, host: &str, controller: &str) -> Option<Self> {
        match (kind, host.split_once(':')) {
            ("indy" | "indy-sim", name) => {
                let (host, port) = name.map_or((host, None), |(host, port)| (host, Some(port)));
                let address = match port {
                    None => indy::Address::of_host(host),
                    Some(port) => indy::Address::of_port(host, port.parse().ok()?),
                };
                let simulated = kind == "indy-sim";
                (!host.is_empty()).then_some(Self::Indy(indy::Address { simulated, ..address }))
            }
            ("ros", Some(_)) => Some(Self::Rosbridge(rosbridge::Address {
                controller: controller.into(),
                ..rosbridge::Address::of_host(host)
            })),
            _ => None,
        }
    }

    #[cfg(not(feature = "network"))]
    fn at(_kind: &str, _host: &str, _controller: &str) -> Option<Self> {
        None
    }
}

impl std::fmt::Display for Driver {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(address) if address.simulated => write!(f, "indy-sim:{}", address.host),
            #[cfg(feature = "network")]
            Self::Indy(address) => write!(f, "indy:{}", address.host),
            #[cfg(feature = "network")]
            Self::Rosbridge(address) => write!(f, "ros:{}", address.host),
            Self::Sim(_) => write!(f, "sim"),
        }
    }
}

/// A connected robot.
pub(crate) enum Robot {
    #[cfg(feature = "network")]
    Indy(Box<Indy>),
    #[cfg(feature = "network")]
    Rosbridge(Box<Rosbridge>),
    Sim(Box<Sim>),
}

#[cfg_attr(
    not(feature = "network"),
    allow(
        unused_variables,
        clippy::unused_async,
        reason = "the simulated arm needs no answer from a network"
    )
)]
impl Robot {
    pub(crate) async fn connect(driver: &Driver, command: &Command) -> Result<Self, Fault> {
        Ok(match driver {
            #[cfg(feature = "network")]
            Driver::Indy(address) => Self::Indy(Box::new(Indy::connect(address).await?)),
            #[cfg(feature = "network")]
            Driver::Rosbridge(address) => {
                Self::Rosbridge(Box::new(Rosbridge::connect(address, &command.joints).await?))
            }
            Driver::Sim(properties) => Self::Sim(Box::new(Sim::new(command, properties))),
        })
    }

    /// Checks of the robot that move nothing.
    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<PreflightCheck>, Fault> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.preflight(command).await,
            #[cfg(feature = "network")]
            Self::Rosbridge(bridge) => bridge.preflight(command).await,
            Self::Sim(sim) => Ok(sim.preflight()),
        }
    }

    /// The arm's state; an error if the controller reports a fault.
    pub(crate) async fn state(&self) -> Result<ArmState, Fault> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.state().await,
            #[cfg(feature = "network")]
            Self::Rosbridge(bridge) => bridge.state(),
            Self::Sim(sim) => sim.fault().map_or_else(|| Ok(sim.state()), Err),
        }
    }

    /// The joint angles, also while the controller reports a fault.
    pub(crate) async fn reading(&self) -> Result<ArmState, Fault> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.reading().await,
            #[cfg(feature = "network")]
            Self::Rosbridge(bridge) => bridge.reading(),
            Self::Sim(sim) => Ok(sim.state()),
        }
    }

    /// Sends a motion; on return the robot has accepted it, but may not have started it.
    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Fault> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.send(motion).await,
            #[cfg(feature = "network")]
            Self::Rosbridge(bridge) => bridge.send(motion).await,
            Self::Sim(sim) => sim.send(motion),
        }
    }

    /// Stops the arm.
    pub(crate) async fn stop(&self, how: Stop) -> Result<StopAnswer, Fault> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.stop(how).await,
            #[cfg(feature = "network")]
            Self::Rosbridge(bridge) => bridge.stop().await,
            Self::Sim(sim) => {
                sim.stop();
                Ok(StopAnswer::Confirmed)
            }
        }
    }

    /// The controller's explanation of a fault, if it gives one.
    pub(crate) async fn explanation(&self) -> Option<String> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(indy) => indy.explanation().await,
            #[cfg(feature = "network")]
            Self::Rosbridge(_) => None,
            Self::Sim(_) => None,
        }
    }

    /// The simulated strike, once the simulated arm has struck.
    pub(crate) fn simulated(&self) -> Option<SimulatedStrike> {
        match self {
            #[cfg(feature = "network")]
            Self::Indy(_) | Self::Rosbridge(_) => None,
            Self::Sim(sim) => sim.has_struck().then(|| sim.simulated().ok()).flatten(),
        }
    }
}
