//! Any arm with ROS 2, through a rosbridge: JSON over a websocket, the action `FollowJointTrajectory`.
//!
//! A goal is a whole motion. A stop cancels the goal and publishes a trajectory that holds the current joint angles: not every
//! rosbridge processes a cancellation while its action runs (issue 909 of `rosbridge_suite`).

use crate::fault::Fault;
use crate::motion::Motion;
use crate::preflight::PreflightCheck;
use crate::robot::arm::ArmState;
use breakshot::robot::{Command, FollowJointTrajectory, JointTrajectory, RosDuration, TrajectoryPoint};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::net::TcpStream;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::task::JoinHandle;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{WebSocketStream, client_async};

/// The address of the rosbridge and the name of the arm's controller.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Host and port, such as `localhost:9090`.
    pub host: String,
    /// The controller's name.
    pub controller: String,
}

impl Address {
    /// The address with the usual controller name, `/joint_trajectory_controller`.
    pub fn of_host(host: impl Into<String>) -> Self {
        Self { host: host.into(), controller: "/joint_trajectory_controller".into() }
    }
}

/// Period of the pings.
const PING: Duration = Duration::from_millis(30);
/// Largest time without a message: two pings were not answered.
const SILENCE: Duration = Duration::from_millis(75);
/// Largest age of a joint state: the vendor's own driver publishes ten per second.
const OLD_STATE: Duration = Duration::from_millis(500);
/// Time limit of the connection, and of the first joint state.
const CONNECT: Duration = Duration::from_secs(3);
/// Time at which the holding trajectory reaches the current joint angles (s); zero would be a step for the servo loop.
const HOLD_S: f64 = 0.1;
const ACTION_TYPE: &str = "control_msgs/action/FollowJointTrajectory";

/// A connected rosbridge.
pub(crate) struct Rosbridge {
    address: Address,
    joints: Vec<String>,
    outgoing: UnboundedSender<Message>,
    shared: Arc<Mutex<Shared>>,
    pump: JoinHandle<()>,
}

/// The state received so far, shared with the task that pumps the messages.
struct Shared {
    last_message: Instant,
    /// The network's message when the link closed.
    closed: Option<String>,
    q_rad: Option<(Instant, Vec<f64>)>,
    /// The number of the latest goal; whether it runs, and its failure.
    goal: u32,
    running: bool,
    failure: Option<String>,
}

impl Rosbridge {
    pub(crate) async fn connect(address: &Address, joints: &[String]) -> Result<Self, Fault> {
        let open = async {
            let stream = TcpStream::connect(&address.host).await.map_err(|e| e.to_string())?;
            stream.set_nodelay(true).map_err(|e| e.to_string())?;
            let url = format!("ws://{}/", address.host);
            client_async(url, stream).await.map_err(|e| e.to_string())
        };
        let opened = timeout(CONNECT, open).await.unwrap_or_else(|_| Err("no answer".into()));
        let (socket, _) = opened.map_err(|e| Fault::unreachable(format!("ws://{}: {e}", address.host)))?;
        let (outgoing, queue) = unbounded_channel();
        let shared = Arc::new(Mutex::new(Shared {
            last_message: Instant::now(),
            closed: None,
            q_rad: None,
            goal: 0,
            running: false,
            failure: None,
        }));
        let pump = tokio::spawn(pump_messages(socket, queue, Arc::clone(&shared), joints.to_vec()));
        let bridge = Self { address: address.clone(), joints: joints.to_vec(), outgoing, shared, pump };
        bridge.send_json(&json!({
            "op": "subscribe", "id": "subscribe:/joint_states:1", "type": "sensor_msgs/msg/JointState",
            "topic": "/joint_states", "compression": "none", "throttle_rate": 0, "queue_length": 0,
        }))?;
        // A rosbridge accepts messages on advertised topics only.
        bridge.send_json(&json!({
            "op": "advertise", "id": "advertise:joint_trajectory:2", "type": "trajectory_msgs/msg/JointTrajectory",
            "topic": bridge.topic(), "latch": false, "queue_size": 1,
        }))?;
        Ok(bridge)
    }

    fn topic(&self) -> String {
        format!("{}/joint_trajectory", self.address.controller)
    }

    fn action(&self) -> String {
        format!("{}/follow_joint_trajectory", self.address.controller)
    }

    fn shared(&self) -> std::sync::MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn send_json(&self, message: &Value) -> Result<(), Fault> {
        let message = Message::text(message.to_string());
        self.outgoing.send(message).map_err(|_| Fault::link("the websocket is closed"))
    }

    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<PreflightCheck>, Fault> {
        let begun = Instant::now();
        while self.shared().q_rad.is_none() && begun.elapsed() < CONNECT {
            self.linked()?;
            sleep(PING).await;
        }
        let found = self.shared().q_rad.is_some();
        let needed = format!("/joint_states with {}", command.joints.join(", "));
        Ok(vec![
            PreflightCheck::new("joint states", if found { "published" } else { "none" }, needed, found),
            PreflightCheck::note("controller", self.action()),
            PreflightCheck::note(
                "not available through a rosbridge",
                "collision detection, violations, the model: check them at the controller",
            ),
        ])
    }

    /// An error if the link is broken or silent.
    fn linked(&self) -> Result<(), Fault> {
        let shared = self.shared();
        let silent = shared.last_message.elapsed();
        if let Some(cause) = &shared.closed {
            return Err(Fault::LostLink { silent_s: silent.as_secs_f64(), cause: cause.clone() });
        }
        if silent > SILENCE {
            return Err(Fault::LostLink {
                silent_s: silent.as_secs_f64(),
                cause: "pings are not answered".into(),
            });
        }
        Ok(())
    }

    pub(crate) fn joint_angles(&self) -> Result<Vec<f64>, Fault> {
        self.dated_joint_angles().map(|(_, q_rad)| q_rad)
    }

    /// The latest joint angles (rad), and when they arrived.
    fn dated_joint_angles(&self) -> Result<(Instant, Vec<f64>), Fault> {
        self.linked()?;
        let (at, q_rad) = self.shared().q_rad.clone().ok_or_else(|| Fault::link("no joint states"))?;
        if at.elapsed() > OLD_STATE {
            return Err(Fault::LostLink {
                silent_s: at.elapsed().as_secs_f64(),
                cause: "joint states are not published any more".into(),
            });
        }
        Ok((at, q_rad))
    }

    pub(crate) fn state(&self) -> Result<ArmState, Fault> {
        let (at, q_rad) = self.dated_joint_angles()?;
        let shared = self.shared();
        if let Some(answer) = &shared.failure {
            return Err(Fault::Refused { request: "the goal".into(), answer: answer.clone() });
        }
        Ok(ArmState { q_rad, moving: shared.running, age_s: at.elapsed().as_secs_f64() })
    }

    pub(crate) fn send(&self, motion: &Motion) -> Result<(), Fault> {
        let goal = {
            let mut shared = self.shared();
            shared.goal += 1;
            shared.running = true;
            shared.goal
        };
        let trajectory = JointTrajectory { joint_names: self.joints.clone(), points: points(motion) };
        self.send_json(&json!({
            "op": "send_action_goal", "id": self.id(goal), "action": self.action(), "action_type": ACTION_TYPE,
            "args": FollowJointTrajectory { trajectory }, "feedback": true,
        }))
    }

    fn id(&self, goal: u32) -> String {
        format!("send_action_goal:{}:{goal}", self.action())
    }

    /// Cancels the goal and publishes a trajectory that holds the current joint angles.
    pub(crate) fn stop(&self) -> Result<(), Fault> {
        let (goal, angles_rad) = {
            let shared = self.shared();
            (shared.goal, shared.q_rad.clone().map(|(_, q_rad)| q_rad))
        };
        self.send_json(&json!({ "op": "cancel_action_goal", "id": self.id(goal), "action": self.action() }))?;
        if let Some(q_rad) = angles_rad {
            let zeros = vec![0.0; q_rad.len()];
            let point = TrajectoryPoint {
                positions: q_rad,
                velocities: zeros.clone(),
                accelerations: zeros,
                time_from_start: RosDuration::from_seconds(HOLD_S),
            };
            let hold = JointTrajectory { joint_names: self.joints.clone(), points: vec![point] };
            let id = format!("publish:{}:3", self.topic());
            self.send_json(
                &json!({ "op": "publish", "id": id, "topic": self.topic(), "msg": hold, "latch": false }),
            )?;
        }
        self.linked()
    }
}

impl Drop for Rosbridge {
    fn drop(&mut self) {
        self.pump.abort();
    }
}

/// The samples of a motion; times count from its start.
fn points(motion: &Motion) -> Vec<TrajectoryPoint> {
    let phase = &motion.phase;
    let start_s = phase.span_s()[0];
    let point = |k: usize| TrajectoryPoint {
        positions: phase.q_rad[k].clone(),
        velocities: phase.qd_rad_s[k].clone(),
        accelerations: phase.qdd_rad_s2[k].clone(),
        time_from_start: RosDuration::from_seconds(phase.time_s[k] - start_s),
    };
    (0..phase.time_s.len()).map(point).collect()
}

/// Moves messages between the websocket and the driver until one of them closes.
async fn pump_messages(
    socket: WebSocketStream<TcpStream>,
    mut queue: UnboundedReceiver<Message>,
    shared: Arc<Mutex<Shared>>,
    joints: Vec<String>,
) {
    let (mut sink, mut source) = socket.split();
    let mut pings = interval(PING);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let cause = loop {
        tokio::select! {
            outgoing = queue.recv() => match outgoing {
                Some(message) => if let Err(error) = sink.send(message).await { break error.to_string() },
                None => return,
            },
            _ = pings.tick() => {
                if let Err(error) = sink.send(Message::Ping(Vec::new().into())).await { break error.to_string() }
            }
            incoming = source.next() => match incoming {
                Some(Ok(message)) => {
                    let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
                    shared.last_message = Instant::now();
                    if let Message::Text(text) = &message
                        && let Ok(value) = serde_json::from_str::<Value>(text)
                    {
                        shared.update(&value, &joints);
                    }
                }
                Some(Err(error)) => break error.to_string(),
                None => break "the rosbridge closed the link".to_owned(),
            },
        }
    };
    shared.lock().unwrap_or_else(PoisonError::into_inner).closed = Some(cause);
}

impl Shared {
    /// Updates the state from a message.
    fn update(&mut self, message: &Value, joints: &[String]) {
        match message["op"].as_str() {
            Some("publish") if message["topic"] == "/joint_states" => {
                if let Some(q_rad) = angles(&message["msg"], joints) {
                    self.q_rad = Some((Instant::now(), q_rad));
                }
            }
            Some("action_result") => {
                self.running = false;
                let values = &message["values"];
                let code = values["error_code"].as_i64().or(values["result"]["error_code"].as_i64());
                if message["result"] == false || code.is_some_and(|code| code != 0) {
                    self.failure = Some(values.to_string());
                }
            }
            Some("status") if message["level"] == "error" => {
                self.failure = Some(message["msg"].to_string());
            }
            _ => {}
        }
    }
}

/// The angles of these joints from a `JointState` message in any order (rad); `None` if one is missing.
fn angles(message: &Value, joints: &[String]) -> Option<Vec<f64>> {
    let names = message["name"].as_array()?;
    let index = |joint: &String| names.iter().position(|name| name == joint);
    joints.iter().map(|joint| message["position"][index(joint)?].as_f64()).collect()
}
