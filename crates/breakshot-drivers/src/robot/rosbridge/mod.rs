//! Any arm with ROS 2, through a rosbridge: JSON over a websocket, the action `FollowJointTrajectory`.
//!
//! A goal is a whole motion. A stop cancels the goal and, where fresh joint states give the arm's position and velocity,
//! publishes a trajectory that brings it to rest on its path: not every rosbridge processes a cancellation while its action runs
//! (issue 909 of `rosbridge_suite`). Neither is answered: a stop is asked for, and joint states show whether the arm rests. How old
//! the joint states are follows from the robot's time, which the node `rosapi` gives.

#[cfg(feature = "fuzzing")]
pub(crate) mod fuzzing;
mod goal;
mod joint_states;

use crate::fault::Fault;
use crate::motion::{Motion, largest_difference};
use crate::preflight::PreflightCheck;
use crate::robot::arm::{ArmState, StopAnswer};
use breakshot::robot::{Command, FollowJointTrajectory, JointTrajectory, RosDuration, TrajectoryPoint};
use futures_util::{SinkExt, StreamExt};
use goal::{Goal, points};
use joint_states::{Hold, JointStates};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
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
/// Time limit of the connection, and of the first joint states.
const CONNECT: Duration = Duration::from_secs(3);
/// Largest time between two joint states (s): the vendor's own driver publishes ten per second.
const SLOWEST_S: f64 = 0.12;
/// Time between two looks at the messages received.
const POLL: Duration = Duration::from_millis(10);
/// Longest wait for joint states that show where the arm can be held.
const HOLD: Duration = Duration::from_millis(100);
/// Longest wait for the robot's time.
const CLOCK: Duration = Duration::from_millis(500);
/// A joint that has moved this far shows that the motion has begun (rad).
const BEGUN_RAD: f64 = 0.01;
const GET_TIME: &str = "/rosapi/get_time";
const GET_TIME_ID: &str = "call_service:/rosapi/get_time:3";
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
    joint_states: JointStates,
    /// When the robot's time was received, and the time (ns), if the answer holds one.
    robot_time: Option<(Instant, Option<i64>)>,
    /// The number of goals sent, and the latest one.
    goals: u32,
    goal: Option<Goal>,
}

impl Rosbridge {
    pub(crate) async fn connect(address: &Address, joints: &[String]) -> Result<Self, Fault> {
        let open = async {
            let stream = TcpStream::connect(&address.host).await.map_err(|e| e.to_string())?;
            stream.set_nodelay(true).map_err(|e| e.to_string())?;
            Ok(stream)
        };
        let opened = timeout(CONNECT, open).await.unwrap_or_else(|_| Err("no answer".into()));
        let stream = opened.map_err(|e: String| Fault::unreachable(format!("ws://{}: {e}", address.host)))?;
        Self::over(stream, address, joints).await
    }

    /// A rosbridge at the other end of a stream.
    pub(crate) async fn over<S>(stream: S, address: &Address, joints: &[String]) -> Result<Self, Fault>
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let url = format!("ws://{}/", address.host);
        let open = async { client_async(&url, stream).await.map_err(|e| e.to_string()) };
        let opened = timeout(CONNECT, open).await.unwrap_or_else(|_| Err("no answer".into()));
        let (socket, _) = opened.map_err(|e| Fault::unreachable(format!("{url}: {e}")))?;
        let (outgoing, queue) = unbounded_channel();
        let shared = Arc::new(Mutex::new(Shared::new(joints)));
        let pump = tokio::spawn(pump_messages(socket, queue, Arc::clone(&shared)));
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
        let period_s = loop {
            self.linked()?;
            let period_s = self.shared().joint_states.period_s();
            if period_s.is_some() || begun.elapsed() > CONNECT {
                break period_s;
            }
            sleep(POLL).await;
        };
        let found = period_s.map_or("none, or without increasing time stamps".into(), |period_s| {
            format!("{:.0} ms apart", period_s * 1e3)
        });
        let needed =
            format!("at most {:.0} ms apart, stamped, with {}", SLOWEST_S * 1e3, command.joints.join(", "));
        let holds = period_s.is_some_and(|period_s| period_s <= SLOWEST_S);
        Ok(vec![
            PreflightCheck::new("joint states", found, needed, holds),
            self.age_note().await?,
            PreflightCheck::note("controller", self.action()),
            PreflightCheck::note(
                "not available through a rosbridge",
                "collision detection, violations, the model: check them at the controller",
            ),
        ])
    }

    /// The age of the joint states by the robot's clock, which the readings count from then on; states that are too old are refused
    /// as those of a lost link.
    async fn age_note(&self) -> Result<PreflightCheck, Fault> {
        let what = "age of the joint states";
        let requested = Instant::now();
        self.shared().robot_time = None;
        self.send_json(&json!({ "op": "call_service", "id": GET_TIME_ID, "service": GET_TIME, "args": {} }))?;
        while requested.elapsed() < CLOCK {
            self.linked()?;
            if let Some(found) = self.shared().age_since(requested) {
                return Ok(PreflightCheck::note(what, found));
            }
            sleep(POLL).await;
        }
        Ok(PreflightCheck::note(what, format!("not known: {GET_TIME} does not answer")))
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

    /// The latest joint angles, also while the goal has failed.
    pub(crate) fn reading(&self) -> Result<ArmState, Fault> {
        self.linked()?;
        let shared = self.shared();
        let latest = shared.joint_states.latest();
        let latest = latest.map_err(|found| Fault::NoPose { found, needed: self.joints.len() })?;
        let (q_rad, age_s) = latest.ok_or_else(|| Fault::link("no joint states"))?;
        let moving = shared.goal.as_ref().is_some_and(|goal| goal.accepted && goal.result.is_none());
        Ok(ArmState { q_rad, moving, age_s })
    }

    pub(crate) fn state(&self) -> Result<ArmState, Fault> {
        let state = self.reading()?;
        self.goal_failure().map_or(Ok(state), Err)
    }

    /// The controller's reason against the latest goal.
    fn goal_failure(&self) -> Option<Fault> {
        let shared = self.shared();
        let answer = shared.goal.as_ref()?.result.as_ref()?.as_ref().err()?.clone();
        Some(Fault::Refused { request: "the goal".into(), answer })
    }

    /// Sends a motion; returns when the controller has begun it.
    pub(crate) async fn send(&self, motion: &Motion) -> Result<(), Fault> {
        let id = {
            let mut shared = self.shared();
            shared.goals += 1;
            let id = format!("send_action_goal:{}:{}", self.action(), shared.goals);
            shared.goal = Some(Goal::new(id.clone(), motion));
            id
        };
        let goal = FollowJointTrajectory::new(self.joints.clone(), points(motion));
        self.send_json(&json!({
            "op": "send_action_goal", "id": id, "action": self.action(), "action_type": ACTION_TYPE,
            "args": goal, "feedback": true,
        }))?;
        loop {
            if let Some(failure) = self.goal_failure() {
                return Err(failure);
            }
            // Not every controller gives feedback: the arm's motion shows as well that the goal was accepted.
            let begun = |shared: &Shared| {
                let latest = shared.joint_states.latest().ok().flatten();
                latest.is_some_and(|(q_rad, _)| largest_difference(&q_rad, motion.start()).1 > BEGUN_RAD)
            };
            {
                let mut shared = self.shared();
                let begun = begun(&shared);
                if let Some(goal) = shared.goal.as_mut().filter(|goal| goal.accepted || begun) {
                    goal.accepted = true;
                    return Ok(());
                }
            }
            sleep(POLL).await;
        }
    }

    /// Cancels the goal and brings the arm to rest on its path as soon as its position and velocity are known; if they stay
    /// unknown, or the goal ends before, the goal is only cancelled.
    pub(crate) async fn stop(&self) -> Result<StopAnswer, Fault> {
        let goal = self.shared().goal.as_ref().map(|goal| (goal.id.clone(), goal.motion.clone()));
        let Some((id, motion)) = goal else { return self.linked().map(|()| StopAnswer::Asked) };
        self.send_json(&json!({ "op": "cancel_action_goal", "id": id, "action": self.action() }))?;
        let asked = Instant::now();
        loop {
            let (hold, has_ended) = {
                let shared = self.shared();
                let has_ended = shared.goal.as_ref().is_some_and(|goal| goal.result.is_some());
                (shared.joint_states.hold(&motion), has_ended)
            };
            if let Some(hold) = hold {
                self.hold(hold)?;
                break;
            }
            if asked.elapsed() >= HOLD || (has_ended && asked.elapsed() >= POLL) {
                break;
            }
            sleep(POLL).await;
        }
        self.linked()?;
        Ok(StopAnswer::Asked)
    }

    /// Publishes a trajectory that ends at rest.
    fn hold(&self, Hold { q_rad, after_s }: Hold) -> Result<(), Fault> {
        let zeros = vec![0.0; q_rad.len()];
        let point = TrajectoryPoint {
            positions: q_rad,
            velocities: zeros.clone(),
            accelerations: zeros,
            time_from_start: RosDuration::from_seconds(after_s),
        };
        let hold = JointTrajectory { joint_names: self.joints.clone(), points: vec![point] };
        let id = format!("publish:{}:4", self.topic());
        self.send_json(
            &json!({ "op": "publish", "id": id, "topic": self.topic(), "msg": hold, "latch": false }),
        )
    }
}

impl Drop for Rosbridge {
    fn drop(&mut self) {
        self.pump.abort();
    }
}

/// Moves messages between the websocket and the driver until one of them closes.
async fn pump_messages<S: AsyncRead + AsyncWrite + Unpin>(
    socket: WebSocketStream<S>,
    mut queue: UnboundedReceiver<Message>,
    shared: Arc<Mutex<Shared>>,
) {
    let (mut sink, mut source) = socket.split();
    let mut pings = interval(PING);
    pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let cause = loop {
        tokio::select! {
            biased;
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
                    if let Message::Text(text) = &message {
                        shared.receive(text);
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
    fn new(joints: &[String]) -> Self {
        Self {
            last_message: Instant::now(),
            closed: None,
            joint_states: JointStates::new(joints),
            robot_time: None,
            goals: 0,
            goal: None,
        }
    }

    /// Updates the state from the text of a message; one that is not JSON is ignored.
    fn receive(&mut self, text: &str) {
        if let Ok(value) = serde_json::from_str::<Value>(text) {
            self.update(&value);
        }
    }

    /// The age of the fastest joint states by the robot's time, which was requested at this instant; `None` before the answer.
    fn age_since(&mut self, requested: Instant) -> Option<String> {
        let (received, time_ns) = self.robot_time?;
        let delay_s = time_ns.and_then(|ns| self.joint_states.synchronize(ns, [requested, received]));
        let unknown = || format!("not known: they are not stamped by the clock of {GET_TIME}");
        Some(delay_s.map_or_else(unknown, |delay_s| format!("{:.0} ms", delay_s * 1e3)))
    }

    /// Updates the state from a message.
    fn update(&mut self, message: &Value) {
        if message["op"] == "publish" && message["topic"] == "/joint_states" {
            self.joint_states.receive(&message["msg"]);
        } else if message["op"] == "service_response" && message["id"] == GET_TIME_ID {
            self.robot_time = Some((Instant::now(), joint_states::time_ns(&message["values"]["time"])));
        } else if let Some(goal) = &mut self.goal {
            goal.receive(message);
        }
    }
}
