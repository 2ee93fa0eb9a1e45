//! A mock rosbridge: accepts goals, simulates an arm, publishes its joint states with their times.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

use super::mock::mishap::{Messages, Mishap};
use super::mock::simulated_arm::SimulatedArm;
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;
use tokio::time::{Instant, MissedTickBehavior};
use tokio_tungstenite::accept_async;
use tokio_tungstenite::tungstenite::Message;

/// The fault injected into the third goal, the strike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InjectedFault {
    /// The controller aborts: the path tolerance is violated.
    Abort,
    /// No message is sent or answered any more.
    Silence,
    /// The link is closed.
    Close,
    /// Joint states of the same instant are published again and again.
    FrozenStates,
    /// Joint states without numbers.
    NoNumbers,
    /// A result of another goal arrives: it failed, or it succeeded.
    ForeignFailure,
    ForeignSuccess,
}

/// What the bridge and its controller do.
#[derive(Clone, Debug)]
pub struct Setup {
    /// How much faster than real time the arm moves.
    pub speedup: f64,
    pub injected: Option<InjectedFault>,
    /// Whether a cancellation is processed only when the goal has ended.
    pub ignores_cancel: bool,
    pub publishes_every: Duration,
    pub has_velocities: bool,
    /// Whether the node `rosapi` runs.
    pub has_rosapi: bool,
    /// Delay of all joint states.
    pub states_late: Duration,
}

impl Default for Setup {
    fn default() -> Self {
        let publishes_every = Duration::from_millis(20);
        Self {
            speedup: 1.0,
            injected: None,
            ignores_cancel: false,
            publishes_every,
            has_velocities: true,
            has_rosapi: true,
            states_late: Duration::ZERO,
        }
    }
}

/// How much faster than real time the arm of the tests over the network moves.
pub const SPEEDUP: f64 = 10.0;

const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
/// Time in which the arm brakes.
const BRAKES: Duration = Duration::from_millis(100);
/// The robot's clock at the start (s): it differs from ours.
const ROBOTS_CLOCK_S: i64 = 1_700_000_000;
const GOAL_REQUEST: &str = "send_action_goal";

/// The bridge's state, shared with the test.
pub struct Shared {
    pub setup: Setup,
    begun: Instant,
    /// All messages received, in order, with their times.
    pub received: Vec<(Instant, Value)>,
    pub messages: Messages,
    pub arm: SimulatedArm,
    goal: Option<Value>,
    goals: usize,
    /// The instant of the latest joint states, where they are frozen.
    frozen: Option<(Duration, Vec<f64>)>,
    before_rad: Vec<f64>,
    fed_back: u32,
    /// Messages that are sent later.
    delayed: VecDeque<(Instant, bool, Value)>,
}

/// The bridge and its server.
pub struct Bridge {
    pub host: String,
    shared: Arc<Mutex<Shared>>,
    server: JoinHandle<()>,
}

impl Bridge {
    /// A bridge on a free port of this computer, with an arm of [`SPEEDUP`].
    pub async fn start(injected: Option<InjectedFault>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let host = listener.local_addr().expect("it is bound").to_string();
        let shared = Shared::new(Setup { speedup: SPEEDUP, injected, ..Setup::default() });
        let server = tokio::spawn(listen(listener, Arc::clone(&shared)));
        Self { host, shared, server }
    }

    /// A bridge at the other end of a stream.
    pub fn over<S>(stream: S, setup: Setup) -> Self
    where
        S: AsyncRead + AsyncWrite + Unpin + Send + 'static,
    {
        let shared = Shared::new(setup);
        let server = tokio::spawn(serve(stream, Arc::clone(&shared)));
        Self { host: "simulated".into(), shared, server }
    }

    /// All messages received, in order.
    pub fn messages(&self) -> Vec<Value> {
        self.shared().received.iter().map(|(_, message)| message.clone()).collect()
    }

    pub fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().expect("nobody panics")
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.server.abort();
    }
}

async fn listen(listener: TcpListener, shared: Arc<Mutex<Shared>>) {
    let (stream, _) = listener.accept().await.expect("a client");
    stream.set_nodelay(true).expect("a socket");
    serve::<TcpStream>(stream, shared).await;
}

async fn serve<S: AsyncRead + AsyncWrite + Unpin>(stream: S, shared: Arc<Mutex<Shared>>) {
    let Ok(mut socket) = accept_async(stream).await else { return };
    let lock = || shared.lock().expect("nobody panics");
    let mut ticks = tokio::time::interval(lock().setup.publishes_every);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut fine = tokio::time::interval(Duration::from_millis(2));
    fine.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let outgoing = tokio::select! {
            biased;
            incoming = socket.next() => {
                let Some(Ok(message)) = incoming else { return };
                let Message::Text(text) = message else { continue };
                let value: Value = serde_json::from_str(&text).expect("JSON");
                let mut shared = lock();
                shared.received.push((Instant::now(), value.clone()));
                let kind = format!("{} request", value["op"].as_str().unwrap_or_default());
                let messages = shared.passed(&kind, value);
                messages.into_iter().flat_map(|message| shared.receive(&message)).collect()
            }
            _ = ticks.tick() => {
                let mut shared = lock();
                if shared.is_due(InjectedFault::Close) {
                    return;
                }
                shared.tick()
            }
            _ = fine.tick() => lock().due(),
        };
        if lock().is_due(InjectedFault::Silence) || lock().is_dead() {
            std::future::pending::<()>().await;
        }
        for text in outgoing {
            if socket.send(Message::text(text)).await.is_err() {
                return;
            }
        }
    }
}

impl Shared {
    fn new(setup: Setup) -> Arc<Mutex<Self>> {
        let home: Vec<f64> = HOME_DEG.iter().map(|q| q.to_radians()).collect();
        Arc::new(Mutex::new(Self {
            arm: SimulatedArm::new(home.clone(), setup.speedup, BRAKES),
            setup,
            begun: Instant::now(),
            received: Vec::new(),
            messages: Messages::default(),
            goal: None,
            goals: 0,
            frozen: None,
            before_rad: home,
            fed_back: 0,
            delayed: VecDeque::new(),
        }))
    }

    fn is_due(&self, fault: InjectedFault) -> bool {
        self.setup.injected == Some(fault) && self.goals == 3 && self.goal.is_some()
    }

    /// Whether every message is lost from now on, the answers to pings as well.
    fn is_dead(&self) -> bool {
        let all = |injection: &super::mock::mishap::Injection| {
            injection.kind == "*" && injection.mishap == Mishap::Lost && injection.lasting
        };
        self.messages.happened.is_some() && self.messages.injection.as_ref().is_some_and(all)
    }

    /// A message after what happens to it on its way.
    fn passed(&mut self, kind: &str, message: Value) -> Vec<Value> {
        let text = message.to_string();
        let (_, moves) = self.arm.now();
        let motions = self.arm.played.len();
        match self.messages.pass(kind, text.as_bytes(), (motions, moves)) {
            None => vec![message],
            Some(Mishap::Lost) => Vec::new(),
            Some(Mishap::Late(by)) => {
                self.delayed.push_back((Instant::now() + by, kind.ends_with("request"), message));
                Vec::new()
            }
            Some(Mishap::Doubled) => vec![message.clone(), message],
            Some(Mishap::OutOfOrder(count)) => {
                let earlier = self.messages.earlier(kind, count);
                vec![earlier.map_or(message, |text| serde_json::from_slice(&text).expect("JSON"))]
            }
            Some(Mishap::Wrong(k)) => {
                let changed = changes_of(&message).swap_remove(k);
                let angles = |message: &Value| -> Option<Vec<f64>> {
                    message["msg"]["position"].as_array()?.iter().map(Value::as_f64).collect()
                };
                if let (Some(true_rad), Some(reported_rad)) = (angles(&message), angles(&changed)) {
                    self.messages.report(&true_rad, &reported_rad);
                }
                vec![changed]
            }
        }
    }

    /// Messages to the client after what happens to them, as text.
    fn sent(&mut self, kind: &str, message: Value) -> Vec<String> {
        self.passed(&format!("{kind} answer"), message).iter().map(Value::to_string).collect()
    }

    /// The delayed messages whose time has come.
    fn due(&mut self) -> Vec<String> {
        let now = Instant::now();
        let (due, later) = self.delayed.drain(..).partition::<Vec<_>, _>(|(at, ..)| *at <= now);
        self.delayed = later.into();
        let each = due.into_iter().flat_map(|(_, is_request, message)| {
            if is_request { self.receive(&message) } else { vec![message.to_string()] }
        });
        each.collect()
    }

    /// Processes a message of the client; returns the answers.
    fn receive(&mut self, message: &Value) -> Vec<String> {
        let ours = |shared: &Self| shared.goal.as_ref().is_some_and(|goal| goal["id"] == message["id"]);
        match message["op"].as_str() {
            Some(GOAL_REQUEST) => {
                let Some((times_s, rows)) = trajectory(&message["args"]["trajectory"]) else {
                    let (goal, values) =
                        (message.clone(), json!({ "error_code": -1, "error_string": "invalid" }));
                    return self.sent("action_result", result(&goal, values, 6));
                };
                self.goals += 1;
                self.fed_back = 0;
                let near = |a: &f64, b: &f64| (a - b).abs() < 0.05;
                if !self.arm.now().0.iter().zip(&rows[0]).all(|(a, b)| near(a, b)) {
                    let values = json!({ "error_code": -4, "error_string": "path tolerance" });
                    return self.sent("action_result", result(message, values, 6));
                }
                self.arm.begin(times_s, rows);
                self.goal = Some(message.clone());
                Vec::new()
            }
            Some("call_service") => self.service_response(message),
            Some("cancel_action_goal") if ours(self) && !self.setup.ignores_cancel => {
                self.arm.stop();
                self.ended(5, 0)
            }
            Some("publish") => {
                let Some((mut times_s, mut rows)) = trajectory(&message["msg"]) else { return Vec::new() };
                let (now_rad, _) = self.arm.now();
                times_s.insert(0, 0.0);
                rows.insert(0, now_rad);
                self.arm.begin(times_s, rows);
                self.ended(6, 0)
            }
            _ => Vec::new(),
        }
    }

    fn service_response(&mut self, request: &Value) -> Vec<String> {
        let is_known = self.setup.has_rosapi && request["service"] == "/rosapi/get_time";
        let values =
            if is_known { json!({ "time": stamp(self.begun.elapsed()) }) } else { json!("no such service") };
        let response = json!({
            "op": "service_response", "id": request["id"], "service": request["service"], "values": values,
            "result": is_known,
        });
        self.sent("service_response", response)
    }

    /// The goal ends.
    fn ended(&mut self, status: i64, code: i64) -> Vec<String> {
        let Some(goal) = self.goal.take() else { return Vec::new() };
        let values = json!({ "error_code": code, "error_string": "" });
        self.sent("action_result", result(&goal, values, status))
    }

    /// Publishes the joint states; ends the goal when its time has come.
    fn tick(&mut self) -> Vec<String> {
        let (q_rad, moves) = self.arm.now();
        let mut texts = self.joint_states(q_rad);
        if let Some(goal) = self.goal.clone() {
            self.fed_back += 1;
            if self.fed_back % 3 == 1 {
                let feedback = json!({
                    "op": "action_feedback", "id": goal["id"], "action": goal["action"], "values": { "joint_names": [] },
                });
                texts.extend(self.sent("action_feedback", feedback));
            }
            for (fault, status) in [(InjectedFault::ForeignFailure, 6), (InjectedFault::ForeignSuccess, 4)] {
                if self.is_due(fault) {
                    let mut foreign = goal.clone();
                    foreign["id"] = json!("send_action_goal:/another:1");
                    let values =
                        json!({ "error_code": if status == 4 { 0 } else { -4 }, "error_string": "" });
                    texts.push(result(&foreign, values, status).to_string());
                }
            }
            if self.is_due(InjectedFault::Abort) {
                self.arm.halt();
                texts.extend(self.ended(6, -4));
            } else if !moves {
                texts.extend(self.ended(4, 0));
            }
        }
        texts
    }

    fn joint_states(&mut self, q_rad: Vec<f64>) -> Vec<String> {
        let since = self.begun.elapsed();
        let (since, q_rad) = if self.is_due(InjectedFault::FrozenStates) {
            self.frozen.get_or_insert((since, q_rad)).clone()
        } else {
            (since, q_rad)
        };
        let period_s = self.setup.publishes_every.as_secs_f64();
        let mut velocity: Vec<f64> =
            q_rad.iter().zip(&self.before_rad).map(|(q, before)| (q - before) / period_s).collect();
        self.before_rad.clone_from(&q_rad);
        // In an order other than the command's, as ROS permits.
        let mut name: Vec<String> = (0..q_rad.len()).map(|k| format!("joint{k}")).collect();
        let mut position: Vec<Option<f64>> = q_rad.into_iter().map(Some).collect();
        name.reverse();
        position.reverse();
        velocity.reverse();
        if self.is_due(InjectedFault::NoNumbers) {
            position[2] = None;
        }
        if !self.setup.has_velocities {
            velocity.clear();
        }
        let state = json!({
            "op": "publish", "topic": "/joint_states",
            "msg": { "header": { "stamp": stamp(since), "frame_id": "" }, "name": name, "position": position, "velocity": velocity, "effort": [] },
        });
        if self.setup.states_late > Duration::ZERO {
            self.delayed.push_back((Instant::now() + self.setup.states_late, false, state));
            return Vec::new();
        }
        self.sent("joint_states", state)
    }
}

/// A time of the robot's clock, this long after it was started.
fn stamp(since: Duration) -> Value {
    json!({ "sec": ROBOTS_CLOCK_S + since.as_secs().cast_signed(), "nanosec": since.subsec_nanos() })
}

fn result(goal: &Value, values: Value, status: i64) -> Value {
    json!({
        "op": "action_result", "id": goal["id"], "action": goal["action"], "values": values, "status": status,
        "result": status == 4,
    })
}

/// The times (s) and joint angles (rad) of a trajectory; `None` if it is not whole.
fn trajectory(message: &Value) -> Option<(Vec<f64>, Vec<Vec<f64>>)> {
    let points = message["points"].as_array().filter(|points| !points.is_empty())?;
    if message["joint_names"].as_array()?.len() != 6 {
        return None;
    }
    let seconds = |point: &Value| {
        let time = &point["time_from_start"];
        Some(time["sec"].as_f64()? + 1e-9 * time["nanosec"].as_f64()?)
    };
    let row = |point: &Value| -> Option<Vec<f64>> {
        let row: Option<Vec<f64>> = point["positions"].as_array()?.iter().map(Value::as_f64).collect();
        row.filter(|row| row.len() == 6)
    };
    let times_s: Option<Vec<f64>> = points.iter().map(seconds).collect();
    let times_s = times_s.filter(|times_s| times_s.is_sorted() && times_s[0] >= 0.0)?;
    Some((times_s, points.iter().map(row).collect::<Option<_>>()?))
}

/// All changes of one value of a message: removed, null, other values; of a list the first and the last are changed.
pub fn changes_of(message: &Value) -> Vec<Value> {
    let mut paths = Vec::new();
    collect_paths(message, &mut Vec::new(), &mut paths);
    let mut changes = Vec::new();
    for path in paths {
        let at = message.pointer(&path).expect("a value");
        let others: Vec<Value> = match at {
            Value::Number(number) => {
                let others = match (number.as_i64(), number.as_f64().unwrap_or(0.0)) {
                    (Some(whole), _) => [json!(whole + 1), json!(-whole)],
                    (None, number) => [json!(number + 1.0), json!(-number)],
                };
                [&others[..], &[json!(null), json!(1e300), json!("1")]].concat()
            }
            Value::Bool(value) => vec![json!(null), json!(!value)],
            Value::String(_) => vec![json!(null), json!(""), json!(1)],
            Value::Array(items) => {
                vec![json!(null), json!([]), Value::Array(items.iter().skip(1).cloned().collect())]
            }
            _ => vec![json!(null), json!([])],
        };
        for other in others {
            let mut changed = message.clone();
            *changed.pointer_mut(&path).expect("a value") = other;
            changes.push(changed);
        }
    }
    changes
}

fn collect_paths(value: &Value, path: &mut Vec<String>, paths: &mut Vec<String>) {
    if !path.is_empty() {
        paths.push(format!("/{}", path.join("/")));
    }
    let mut visit = |key: String, value: &Value, paths: &mut Vec<String>| {
        path.push(key);
        collect_paths(value, path, paths);
        path.pop();
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| visit(key.clone(), value, paths)),
        Value::Array(items) => {
            for k in [0, items.len().saturating_sub(1)].into_iter().take(items.len()) {
                visit(k.to_string(), &items[k], paths);
            }
        }
        _ => {}
    }
}
