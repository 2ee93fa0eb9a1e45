//! Neuromeka's Indy 7 over `IndyDCP3`: gRPC without encryption, one port a service.

mod preflight;
pub mod requests;

use crate::fault::Fault;
use crate::motion::Motion;
use crate::robot::arm::{ArmState, Stop, StopAnswer};
use crate::wire::config_client::ConfigClient;
use crate::wire::control_client::ControlClient;
use crate::wire::device_client::DeviceClient;
use crate::wire::rt_data_exchange_client::RtDataExchangeClient;
use crate::wire::{ControlData, Empty, OpState, Response, StopCategory, ViolationData};
use std::time::Duration;
use tonic::Status;
use tonic::body::Body;
use tonic::client::GrpcService;
use tonic::transport::{Channel, Endpoint};

/// The addresses of the controller's services.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// The controller's host name or IP address.
    pub host: String,
    /// Port of `Control`.
    pub control: u16,
    /// Port of `Device`.
    pub device: u16,
    /// Port of `Config`.
    pub config: u16,
    /// Port of `RTDataExchange`.
    pub rtde: u16,
    /// Whether the controller simulates its robot; a controller that does otherwise is refused.
    pub simulated: bool,
}

impl Address {
    /// The ports of a controller in factory settings.
    pub fn of_host(host: impl Into<String>) -> Self {
        Self {
            host: host.into(),
            control: 20_001,
            device: 20_002,
            config: 20_003,
            rtde: 20_004,
            simulated: false,
        }
    }

    /// One port for all services.
    pub fn of_port(host: impl Into<String>, port: u16) -> Self {
        Self { host: host.into(), control: port, device: port, config: port, rtde: port, simulated: false }
    }
}

/// Time limit of a connection.
const CONNECT: Duration = Duration::from_secs(3);
/// Default size limit of a gRPC server's messages (bytes).
const LARGEST_MESSAGE: usize = 4 << 20;

/// A connected controller. `T` carries its requests: the network's channels, or answers without a network.
pub(crate) struct Indy<T = Channel> {
    control: ControlClient<T>,
    /// A connection for stops only, so that a stop never waits behind a large message.
    brake: ControlClient<T>,
    device: DeviceClient<T>,
    config: ConfigClient<T>,
    rtde: RtDataExchangeClient<T>,
    simulated: bool,
}

impl Indy {
    pub(crate) async fn connect(address: &Address) -> Result<Self, Fault> {
        let channel = async |port: u16| {
            let uri = format!("http://{}:{port}", address.host);
            let endpoint =
                Endpoint::from_shared(uri.clone()).map_err(|e| Fault::unreachable(format!("{uri}: {e}")))?;
            let endpoint = endpoint.connect_timeout(CONNECT).tcp_nodelay(true);
            endpoint.connect().await.map_err(|e| Fault::unreachable(format!("{uri}: {}", innermost(&e))))
        };
        let control = [channel(address.control).await?, channel(address.control).await?];
        let device = channel(address.device).await?;
        let config = channel(address.config).await?;
        Ok(Self::over(control, device, config, channel(address.rtde).await?, address.simulated))
    }
}

impl<T: GrpcService<Body, ResponseBody = Body> + Clone> Indy<T> {
    /// A controller at the other end of these channels; `Control` has a second one, for stops.
    pub(crate) fn over([control, brake]: [T; 2], device: T, config: T, rtde: T, simulated: bool) -> Self {
        Self {
            control: ControlClient::new(control),
            brake: ControlClient::new(brake),
            device: DeviceClient::new(device),
            config: ConfigClient::new(config),
            rtde: RtDataExchangeClient::new(rtde),
            simulated,
        }
    }

    /// The arm's state; an error if the controller is not idle or moving.
    pub(crate) async fn state(&self) -> Result<ArmState, Fault> {
        let data = self.control_data().await?;
        match data.op_state() {
            OpState::OpViolate => return Err(Fault::Violation),
            OpState::OpCollision => return Err(Fault::Collision),
            OpState::OpIdle | OpState::OpMoving | OpState::TrajMoving => {}
            other => return Err(Fault::NotReady { state: other.as_str_name().into() }),
        }
        if !data.is_robot_connected {
            return Err(Fault::NotReady { state: "the controller has no connection to its robot".into() });
        }
        Ok(arm_state(&data))
    }

    /// The joint angles, in any state of the controller.
    pub(crate) async fn reading(&self) -> Result<ArmState, Fault> {
        Ok(arm_state(&self.control_data().await?))
    }

    async fn control_data(&self) -> Result<ControlData, Fault> {
        Ok(self.rtde.clone().get_control_data(Empty {}).await.map_err(link)?.into_inner())
    }

    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Fault> {
        let request = requests::joint_trajectory(motion.phase.resampled(requests::PERIOD_S));
        let size = prost::Message::encoded_len(&request);
        if size > LARGEST_MESSAGE {
            let answer = format!("{size} bytes exceed the controller's limit of {LARGEST_MESSAGE} bytes");
            return Err(Fault::Refused { request: motion.name.into(), answer });
        }
        let answer = self.control.clone().move_joint_traj(request).await.map_err(link)?;
        accepted(motion.name, &answer.into_inner())
    }

    pub(crate) async fn stop(&self, how: Stop) -> Result<StopAnswer, Fault> {
        let category = match how {
            Stop::Smooth => StopCategory::SmoothOnly,
            Stop::Brake => StopCategory::SmoothBrake,
        };
        let answer = self.brake.clone().stop_motion(requests::stop(category)).await.map_err(link)?;
        accepted("the stop", &answer.into_inner())?;
        Ok(StopAnswer::Confirmed)
    }

    pub(crate) async fn explanation(&self) -> Option<String> {
        let violation = self.violation().await.ok()?;
        (violation.violation_code != 0).then(|| violation_text(&violation))
    }

    async fn violation(&self) -> Result<ViolationData, Fault> {
        Ok(self.rtde.clone().get_violation_data(Empty {}).await.map_err(link)?.into_inner())
    }
}

/// A violation's message with its code and joint.
fn violation_text(violation: &ViolationData) -> String {
    format!("{} (code {:#x}, joint {})", violation.violation_str, violation.violation_code, violation.j_index)
}

fn arm_state(data: &ControlData) -> ArmState {
    let moving = matches!(data.op_state(), OpState::OpMoving | OpState::TrajMoving);
    ArmState { q_rad: radians(&data.q), moving, age_s: 0.0 }
}

fn radians(degrees: &[f32]) -> Vec<f64> {
    degrees.iter().map(|&q| f64::from(q).to_radians()).collect()
}

/// An error if the controller's answer is not success.
fn accepted(request: &str, answer: &Response) -> Result<(), Fault> {
    if answer.code == 0 {
        return Ok(());
    }
    let answer = format!("{} (code {})", answer.msg, answer.code);
    Err(Fault::Refused { request: request.into(), answer })
}

/// A failed call as a lost link.
fn link(status: Status) -> Fault {
    Fault::link(format!("{}: {}", status.code().description(), status.message()))
}

/// The innermost cause of an error: outer ones only state that the transport failed.
fn innermost(error: &dyn std::error::Error) -> String {
    let mut error = error;
    while let Some(source) = error.source() {
        error = source;
    }
    error.to_string()
}
