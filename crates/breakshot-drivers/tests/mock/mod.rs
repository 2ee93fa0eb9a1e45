//! A mock of an Indy 7's controller: serves its services, simulates an arm in real time, and injects faults.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

pub mod example;
pub mod mishap;
mod services;
pub mod simulated_arm;
pub mod wire_fields;

use breakshot::robot::{Arm, Frame};
use breakshot_drivers::indy::{Address, requests};
use breakshot_drivers::wire::OpState;
use mishap::{Messages, Mishap};
use nalgebra::Translation3;
use prost::Message;
use simulated_arm::SimulatedArm;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
use tokio::time::Instant;
use tonic::Status;
use tonic::transport::server::TcpIncoming;

/// The home pose of an Indy 7 (deg).
pub const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
/// Height of a real controller's base above the published frames (m).
const BASE_OFFSET_M: f64 = 0.0005;

/// An injected fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InjectedFault {
    Violation,
    Collision,
    /// The emergency stop was pressed: power is off.
    EmergencyStop,
    /// The network cable is disconnected: no request is answered any more.
    LostLink,
    /// Every answer takes longer than the time limit during a strike.
    SlowReplies,
    /// The arm leaves its path.
    Drift,
    /// The motion is not accepted.
    Refusal,
    /// The arm stands still; its motion never ends.
    Stall,
    /// The arm arrives, but its motion never ends.
    Endless,
}

/// The controller's settings and the injected fault.
#[derive(Clone, Debug)]
pub struct Setup {
    pub model: String,
    /// Ratio of simulated to real time, so that tests take less time.
    pub speedup: f64,
    /// The fault, the number of its motion (from 1), and the time after the motion's start (s).
    pub injected: Option<(InjectedFault, usize, f64)>,
    pub speed_ratio: i32,
    pub detects_collisions: bool,
    pub tool_kg: f32,
    /// The tool's mass once the arm has moved (kg); none: it stays the same.
    pub tool_kg_later: Option<f32>,
    /// Error of its kinematics along x (m).
    pub off_m: f64,
    pub q_deg: [f64; 6],
    pub op_state: OpState,
    pub servos_on: bool,
    pub tip_limit_m_s: f32,
    /// Time in which the arm brakes when it is stopped.
    pub brakes: Duration,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            model: "Indy7".into(),
            speedup: 1.0,
            injected: None,
            speed_ratio: 100,
            detects_collisions: true,
            tool_kg: 0.3,
            tool_kg_later: None,
            off_m: 0.0,
            q_deg: HOME_DEG,
            op_state: OpState::OpIdle,
            servos_on: true,
            tip_limit_m_s: 1.0,
            brakes: Duration::from_millis(100),
        }
    }
}

/// A received request; its time counts from the controller's start (s).
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    pub at_s: f64,
    pub name: String,
}

struct MockState {
    arm: SimulatedArm,
    motions: usize,
    op_state: OpState,
    calls: Vec<Call>,
    /// When the fault first became visible to a client (s).
    shown_s: Option<f64>,
    silent: bool,
    slow: bool,
    /// The motion is reported as under way although the arm rests.
    endless: bool,
}

/// The controller itself, shared by its services.
pub struct Controller {
    pub setup: Setup,
    pub arm: Arm,
    begun: Instant,
    state: Mutex<MockState>,
    messages: Mutex<Messages>,
}

/// Longer than the time limit of an answer during a strike.
const SLOW: Duration = Duration::from_millis(600);

impl Controller {
    pub fn new(setup: Setup) -> Arc<Self> {
        let q_rad = setup.q_deg.map(f64::to_radians).to_vec();
        let state = MockState {
            arm: SimulatedArm::new(q_rad, setup.speedup, setup.brakes),
            motions: 0,
            op_state: setup.op_state,
            calls: Vec::new(),
            shown_s: None,
            silent: false,
            slow: false,
            endless: false,
        };
        let arm = Arm::built_in("indy7").expect("built in");
        let (state, messages) = (Mutex::new(state), Mutex::default());
        Arc::new(Self { setup, arm, begun: Instant::now(), state, messages })
    }

    /// The messages between the client and the controller.
    pub fn messages(&self) -> std::sync::MutexGuard<'_, Messages> {
        self.messages.lock().expect("no test panics while it holds this")
    }

    /// A message after what happens to it on its way: none if it is lost, several if it is repeated.
    async fn passed<T: Message + Default>(&self, kind: &str, message: T) -> Result<Option<Vec<T>>, Status> {
        let motions = {
            let mut state = self.state();
            let (_, moves) = state.arm.now();
            (state.arm.played.len(), moves)
        };
        let bytes = message.encode_to_vec();
        let mishap = self.messages().pass(kind, &bytes, motions);
        let decoded = |bytes: Vec<u8>| {
            let message = T::decode(&bytes[..]);
            message.map(|message| Some(vec![message])).map_err(|e| Status::internal(e.to_string()))
        };
        match mishap {
            None => Ok(Some(vec![message])),
            Some(Mishap::Lost) => Ok(None),
            Some(Mishap::Late(by)) => {
                tokio::time::sleep(by).await;
                Ok(Some(vec![message]))
            }
            Some(Mishap::Doubled) => Ok(Some(vec![message, T::decode(&bytes[..]).expect("a message")])),
            Some(Mishap::OutOfOrder(count)) => {
                let earlier = self.messages().earlier(kind, count);
                earlier.map_or_else(|| Ok(Some(vec![message])), decoded)
            }
            Some(Mishap::Wrong(k)) => decoded(wire_fields::changes(&bytes).swap_remove(k)),
        }
    }

    /// Where the arm is (rad).
    pub fn true_rad(&self) -> Vec<f64> {
        self.state().arm.now().0
    }

    /// All motions of the arm.
    pub fn played(&self) -> Vec<simulated_arm::Played> {
        self.advance();
        self.state().arm.played.clone()
    }

    fn state(&self) -> std::sync::MutexGuard<'_, MockState> {
        self.state.lock().expect("no test panics while it holds this")
    }

    /// All requests received, in order.
    pub fn calls(&self) -> Vec<Call> {
        self.state().calls.clone()
    }

    /// The number of requests of that name.
    pub fn count(&self, name: &str) -> usize {
        self.state().calls.iter().filter(|call| call.name == name).count()
    }

    /// When the fault first became visible to a client (s).
    pub fn shown_s(&self) -> Option<f64> {
        self.state().shown_s
    }

    /// The current joint angles (rad).
    pub fn q_rad(&self) -> Vec<f64> {
        self.advance();
        self.reported().0
    }

    /// The joint angles that the controller reports (rad), and whether a motion is under way.
    fn reported(&self) -> (Vec<f64>, bool) {
        let mut state = self.state();
        let (mut q_rad, moves) = state.arm.now();
        if let Some((InjectedFault::Drift, _, after_s)) = self.setup.injected
            && state.motions >= self.setup.injected.map_or(0, |(_, motion, _)| motion)
        {
            let since_s = state.arm.played.last().map_or(0.0, |played| played.begun.elapsed().as_secs_f64());
            q_rad[2] += 0.5 * (since_s * self.setup.speedup - after_s).clamp(0.0, 1.0);
        }
        (q_rad, moves || state.endless)
    }

    /// Records a request; delays the answer if that fault is injected.
    async fn record(&self, name: &str) {
        self.advance();
        let (silent, slow) = {
            let mut state = self.state();
            // A stop records itself, before the answer.
            if name != "StopMotion" {
                state.calls.push(Call { at_s: self.begun.elapsed().as_secs_f64(), name: name.into() });
            }
            (state.silent, state.slow)
        };
        if silent {
            std::future::pending::<()>().await;
        }
        if slow {
            tokio::time::sleep(SLOW).await;
        }
    }

    /// Advances the arm and the injected fault to the current time.
    fn advance(&self) {
        let mut state = self.state();
        let (_, moves) = state.arm.now();
        let Some((injected, motion, after_s)) = self.setup.injected else { return };
        let Some(played) = state.arm.played.last() else { return };
        let is_due = played.begun.elapsed().as_secs_f64() * self.setup.speedup >= after_s;
        if state.motions != motion || !is_due || (!moves && injected != InjectedFault::Endless) {
            return;
        }
        match injected {
            InjectedFault::Violation => state.fail(OpState::OpViolate),
            InjectedFault::Collision => state.fail(OpState::OpCollision),
            InjectedFault::EmergencyStop => state.fail(OpState::OpStopAndOff),
            InjectedFault::LostLink => state.silent = true,
            InjectedFault::SlowReplies => state.slow = true,
            InjectedFault::Endless => {
                state.endless = !state.calls.iter().any(|call| call.name.starts_with("StopMotion"));
            }
            InjectedFault::Stall => {
                state.arm.halt();
                state.endless = true;
            }
            InjectedFault::Drift | InjectedFault::Refusal => {}
        }
        if state.shown_s.is_none() {
            state.shown_s = Some(self.begun.elapsed().as_secs_f64());
        }
    }

    /// Starts a motion; `false` if it is refused.
    fn begin(&self, rows: Vec<Vec<f64>>, period_s: f64) -> bool {
        let mut state = self.state();
        state.motions += 1;
        let refuses = self.setup.injected.is_some_and(|(injected, motion, _)| {
            injected == InjectedFault::Refusal && motion == state.motions
        });
        let (_, moves) = state.arm.now();
        if refuses || state.op_state != OpState::OpIdle || moves || rows.is_empty() {
            return false;
        }
        let times_s = (0..rows.len()).map(|k| period_s * k as f64).collect();
        state.arm.begin(times_s, rows);
        true
    }

    /// Brakes, unless the link is lost.
    fn stop(&self, category: i32) {
        self.advance();
        let mut state = self.state();
        let at_s = self.begun.elapsed().as_secs_f64();
        state.calls.push(Call { at_s, name: format!("StopMotion {category}") });
        if self.setup.injected.is_none_or(|(injected, ..)| injected != InjectedFault::LostLink) {
            state.arm.stop();
            state.endless = false;
        }
    }

    /// The tool frame in the base frame, 0.5 mm higher than by the published frames.
    pub fn tool(&self, q_rad: &[f64]) -> Frame {
        Translation3::new(self.setup.off_m, 0.0, BASE_OFFSET_M) * self.arm.flange_frame(q_rad)
    }

    fn pose(&self, q_rad: &[f64]) -> Vec<f32> {
        requests::pose_mm_deg(&self.tool(q_rad))
    }
}

impl MockState {
    fn fail(&mut self, op_state: OpState) {
        self.op_state = op_state;
        self.arm.halt();
    }
}

/// A mock controller with its server.
pub struct Mock {
    pub controller: Arc<Controller>,
    pub address: Address,
    server: JoinHandle<()>,
}

impl Mock {
    /// Starts the server on a free port of this computer.
    pub async fn start(setup: Setup) -> Self {
        let controller = Controller::new(setup);
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let port = listener.local_addr().expect("it is bound").port();
        let server = tokio::spawn(serve(Arc::clone(&controller), listener));
        let address = Address { simulated: true, ..Address::of_port("127.0.0.1", port) };
        Self { controller, address, server }
    }
}

impl Drop for Mock {
    fn drop(&mut self) {
        self.server.abort();
    }
}

/// Serves all services over streams of this process.
pub async fn serve_streams(
    controller: Arc<Controller>,
    streams: tokio::sync::mpsc::UnboundedReceiver<tokio::io::DuplexStream>,
) {
    let incoming = futures_util::stream::unfold(streams, async |mut streams| {
        let stream = streams.recv().await?;
        Some((Ok::<_, std::io::Error>(stream), streams))
    });
    services::router(&controller)
        .serve_with_incoming(Box::pin(incoming))
        .await
        .expect("the server ends with the test");
}

/// Serves all services on one port.
pub async fn serve(controller: Arc<Controller>, listener: TcpListener) {
    let incoming = TcpIncoming::from(listener).with_nodelay(Some(true));
    services::router(&controller).serve_with_incoming(incoming).await.expect("the server ends with the test");
}
