//! Neuromeka's Indy 7 over `IndyDCP3`: gRPC without encryption, one port a service.

mod preflight;
pub mod requests;

use crate::arm::{ArmState, Stop};
use crate::fault::Trouble;
use crate::motion::Motion;
use crate::wire::config_client::ConfigClient;
use crate::wire::control_client::ControlClient;
use crate::wire::device_client::DeviceClient;
use crate::wire::rt_data_exchange_client::RtDataExchangeClient;
use crate::wire::{Empty, OpState, Response, StopCategory, ViolationData};
use std::time::Duration;
use tonic::Status;
use tonic::transport::{Channel, Endpoint};

/// Where the controller's services listen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// The controller.
    pub host: String,
    /// Port of `Control`.
    pub control: u16,
    /// Port of `Device`.
    pub device: u16,
    /// Port of `Config`.
    pub config: u16,
    /// Port of `RTDataExchange`.
    pub rtde: u16,
}

impl Address {
    /// A controller as it is delivered.
    pub fn of_host(host: impl Into<String>) -> Self {
        Self { host: host.into(), control: 20_001, device: 20_002, config: 20_003, rtde: 20_004 }
    }

    /// All services behind one port.
    pub fn of_port(host: impl Into<String>, port: u16) -> Self {
        Self { host: host.into(), control: port, device: port, config: port, rtde: port }
    }
}

/// Connections that are not made by then will not be.
const CONNECT: Duration = Duration::from_secs(3);
/// gRPC servers refuse larger messages unless told otherwise (bytes).
const LARGEST_MESSAGE: usize = 4 << 20;

/// A controller that is connected.
pub(crate) struct Indy {
    control: ControlClient<Channel>,
    /// A connection of its own, so that no large message stands before a stop.
    brake: ControlClient<Channel>,
    device: DeviceClient<Channel>,
    config: ConfigClient<Channel>,
    rtde: RtDataExchangeClient<Channel>,
}

impl Indy {
    pub(crate) async fn connect(address: &Address) -> Result<Self, Trouble> {
        let channel = async |port: u16| {
            let uri = format!("http://{}:{port}", address.host);
            let endpoint = Endpoint::from_shared(uri.clone())
                .map_err(|e| Trouble::unreachable(format!("{uri}: {e}")))?;
            let endpoint = endpoint.connect_timeout(CONNECT).tcp_nodelay(true);
            endpoint.connect().await.map_err(|e| Trouble::unreachable(format!("{uri}: {}", innermost(&e))))
        };
        Ok(Self {
            control: ControlClient::new(channel(address.control).await?),
            brake: ControlClient::new(channel(address.control).await?),
            device: DeviceClient::new(channel(address.device).await?),
            config: ConfigClient::new(channel(address.config).await?),
            rtde: RtDataExchangeClient::new(channel(address.rtde).await?),
        })
    }

    pub(crate) async fn state(&self) -> Result<ArmState, Trouble> {
        let data = self.rtde.clone().get_control_data(Empty {}).await.map_err(link)?.into_inner();
        let op_state = data.op_state();
        let moving = match op_state {
            OpState::OpIdle => false,
            OpState::OpMoving | OpState::TrajMoving => true,
            OpState::OpViolate => return Err(Trouble::Violation),
            OpState::OpCollision => return Err(Trouble::Collision),
            other => return Err(Trouble::NotReady { state: other.as_str_name().into() }),
        };
        if !data.is_robot_connected {
            return Err(Trouble::NotReady { state: "the controller has lost its robot".into() });
        }
        Ok(ArmState { q_rad: radians(&data.q), moving })
    }

    pub(crate) async fn place(&self) -> Result<Vec<f64>, Trouble> {
        let data = self.rtde.clone().get_control_data(Empty {}).await.map_err(link)?.into_inner();
        Ok(radians(&data.q))
    }

    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Trouble> {
        let request = requests::joint_trajectory(motion.phase.resampled(requests::PERIOD_S));
        let size = prost::Message::encoded_len(&request);
        if size > LARGEST_MESSAGE {
            let answer = format!("{size} bytes are more than the {LARGEST_MESSAGE} that a controller takes");
            return Err(Trouble::Refused { request: motion.name.into(), answer });
        }
        let answer = self.control.clone().move_joint_traj(request).await.map_err(link)?;
        accepted(motion.name, &answer.into_inner())
    }

    pub(crate) async fn stop(&self, how: Stop) -> Result<(), Trouble> {
        let category = match how {
            Stop::Smooth => StopCategory::SmoothOnly,
            Stop::Brake => StopCategory::SmoothBrake,
        };
        let answer = self.brake.clone().stop_motion(requests::stop(category)).await.map_err(link)?;
        accepted("the stop", &answer.into_inner())
    }

    pub(crate) async fn explanation(&self) -> Option<String> {
        let violation = self.violation().await.ok()?;
        (violation.violation_code != 0).then(|| violation_text(&violation))
    }

    async fn violation(&self) -> Result<ViolationData, Trouble> {
        Ok(self.rtde.clone().get_violation_data(Empty {}).await.map_err(link)?.into_inner())
    }
}

/// A violation in words, with its code.
fn violation_text(violation: &ViolationData) -> String {
    format!("{} (code {:#x}, joint {})", violation.violation_str, violation.violation_code, violation.j_index)
}

fn radians(degrees: &[f32]) -> Vec<f64> {
    degrees.iter().map(|&q| f64::from(q).to_radians()).collect()
}

/// An answer that is not yes.
fn accepted(request: &str, answer: &Response) -> Result<(), Trouble> {
    if answer.code == 0 {
        return Ok(());
    }
    let answer = format!("{} (code {})", answer.msg, answer.code);
    Err(Trouble::Refused { request: request.into(), answer })
}

/// A call that failed, as the network tells it.
fn link(status: Status) -> Trouble {
    Trouble::link(format!("{}: {}", status.code().description(), status.message()))
}

/// The cause at the bottom: what is above says only that something failed.
fn innermost(error: &dyn std::error::Error) -> String {
    let mut error = error;
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}
