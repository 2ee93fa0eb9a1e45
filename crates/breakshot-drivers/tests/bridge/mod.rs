//! A mock rosbridge: accepts goals, simulates an arm at ten times the speed, publishes its joint states.

use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::JoinHandle;
use tokio_tungstenite::accept_async;
use tokio_tungstenite::tungstenite::Message;

/// The fault injected into the third goal, the strike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum InjectedFault {
    /// The controller aborts: the path tolerance is violated.
    Abort,
    /// No message is sent or answered any more.
    Silence,
}

pub(crate) struct Bridge {
    pub(crate) host: String,
    messages: Arc<Mutex<Vec<Value>>>,
    server: JoinHandle<()>,
}

const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
/// How much faster than real time the arm moves.
pub(crate) const SPEEDUP: f64 = 10.0;

struct Goal {
    message: Value,
    begun: Instant,
}

impl Bridge {
    pub(crate) async fn start(injected: Option<InjectedFault>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let host = listener.local_addr().expect("it is bound").to_string();
        let messages = Arc::new(Mutex::new(Vec::new()));
        let server = tokio::spawn(serve(listener, injected, Arc::clone(&messages)));
        Self { host, messages, server }
    }

    /// All messages received, in order.
    pub(crate) fn messages(&self) -> Vec<Value> {
        self.messages.lock().expect("nobody panics").clone()
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        self.server.abort();
    }
}

async fn serve(listener: TcpListener, injected: Option<InjectedFault>, messages: Arc<Mutex<Vec<Value>>>) {
    let (stream, _) = listener.accept().await.expect("a client");
    stream.set_nodelay(true).expect("a socket");
    let mut socket = accept_async::<TcpStream>(stream).await.expect("a websocket");
    let mut ticks = tokio::time::interval(Duration::from_millis(20));
    let mut joints: Vec<f64> = HOME_DEG.iter().map(|q| q.to_radians()).collect();
    let (mut goal, mut goals): (Option<Goal>, u32) = (None, 0);
    let names: Vec<String> = (0..6).map(|k| format!("joint{k}")).collect();
    loop {
        tokio::select! {
            incoming = socket.next() => {
                let Some(Ok(message)) = incoming else { return };
                let Message::Text(text) = message else { continue };
                let value: Value = serde_json::from_str(&text).expect("JSON");
                if value["op"] == "send_action_goal" {
                    goals += 1;
                    goal = Some(Goal { message: value.clone(), begun: Instant::now() });
                }
                messages.lock().expect("nobody panics").push(value);
            }
            _ = ticks.tick() => {
                let mut result = None;
                if let Some(running) = &goal {
                    if goals == 3 && injected == Some(InjectedFault::Silence) {
                        std::future::pending::<()>().await;
                    }
                    let (now, ended) = running.joints();
                    joints = now;
                    let aborted = goals == 3 && injected == Some(InjectedFault::Abort);
                    if ended || aborted {
                        let code = if aborted { -4 } else { 0 };
                        result = Some(json!({
                            "op": "action_result", "id": running.message["id"], "action": running.message["action"],
                            "values": { "error_code": code, "error_string": "" }, "status": if aborted { 6 } else { 4 },
                            "result": !aborted,
                        }));
                        goal = None;
                    }
                }
                // In an order other than the command's, as ROS permits.
                let (mut name, mut position) = (names.clone(), joints.clone());
                name.reverse();
                position.reverse();
                let state = json!({ "op": "publish", "topic": "/joint_states", "msg": { "name": name, "position": position } });
                for message in std::iter::once(state).chain(result) {
                    if socket.send(Message::text(message.to_string())).await.is_err() {
                        return;
                    }
                }
            }
        }
    }
}

impl Goal {
    /// The current joint angles (rad), and whether the goal has ended.
    fn joints(&self) -> (Vec<f64>, bool) {
        let since_s = self.begun.elapsed().as_secs_f64() * SPEEDUP;
        let points = self.message["args"]["trajectory"]["points"].as_array().expect("points");
        let seconds = |point: &Value| {
            let time = &point["time_from_start"];
            time["sec"].as_f64().expect("seconds") + 1e-9 * time["nanosec"].as_f64().expect("nanoseconds")
        };
        let k = points.iter().position(|point| seconds(point) >= since_s).unwrap_or(points.len() - 1);
        let positions = points[k]["positions"].as_array().expect("positions");
        (positions.iter().map(|q| q.as_f64().expect("a number")).collect(), k + 1 == points.len())
    }
}
