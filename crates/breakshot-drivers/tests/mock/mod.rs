//! A mock of an Indy 7's controller: serves its services, simulates an arm in real time, and injects faults.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

pub mod example;
mod services;

use breakshot::robot::{Arm, Frame};
use breakshot_drivers::indy::{Address, requests};
use breakshot_drivers::wire::OpState;
use nalgebra::Translation3;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::net::TcpListener;
use tokio::task::JoinHandle;
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
    /// The motion never ends.
    Stall,
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
    /// Error of its kinematics along x (m).
    pub off_m: f64,
    pub q_deg: [f64; 6],
    pub op_state: OpState,
    pub servos_on: bool,
    pub tip_limit_m_s: f32,
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
            off_m: 0.0,
            q_deg: HOME_DEG,
            op_state: OpState::OpIdle,
            servos_on: true,
            tip_limit_m_s: 1.0,
        }
    }
}

/// A received request; its time counts from the controller's start (s).
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    pub at_s: f64,
    pub name: String,
}

/// Rows of joint angles (rad), uniformly spaced in time.
struct Moving {
    rows: Vec<Vec<f64>>,
    period_s: f64,
    begun: Instant,
}

struct MockState {
    q_rad: Vec<f64>,
    moving: Option<Moving>,
    motions: usize,
    op_state: OpState,
    calls: Vec<Call>,
    /// When the fault first became visible to a client (s).
    shown_s: Option<f64>,
    silent: bool,
    slow: bool,
}

/// The controller itself, shared by its services.
pub struct Controller {
    pub setup: Setup,
    pub arm: Arm,
    begun: Instant,
    state: Mutex<MockState>,
}

/// Longer than the time limit of an answer during a strike.
const SLOW: Duration = Duration::from_millis(600);

impl Controller {
    pub fn new(setup: Setup) -> Arc<Self> {
        let state = MockState {
            q_rad: setup.q_deg.map(f64::to_radians).to_vec(),
            moving: None,
            motions: 0,
            op_state: setup.op_state,
            calls: Vec::new(),
            shown_s: None,
            silent: false,
            slow: false,
        };
        let arm = Arm::built_in("indy7").expect("built in");
        Arc::new(Self { setup, arm, begun: Instant::now(), state: Mutex::new(state) })
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
        self.state().q_rad.clone()
    }

    /// Records a request; delays the answer if that fault is injected.
    async fn record(&self, name: &str) {
        self.advance();
        let (silent, slow) = {
            let mut state = self.state();
            state.calls.push(Call { at_s: self.begun.elapsed().as_secs_f64(), name: name.into() });
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
        let Some(moving) = &state.moving else { return };
        let since_s = moving.begun.elapsed().as_secs_f64() * self.setup.speedup;
        let injected = self
            .setup
            .injected
            .filter(|&(_, motion, after_s)| state.motions == motion && since_s >= after_s)
            .map(|(injected, _, after_s)| (injected, after_s));
        let stopped_s = match injected {
            Some((
                InjectedFault::Violation
                | InjectedFault::Collision
                | InjectedFault::EmergencyStop
                | InjectedFault::Stall,
                after_s,
            )) => after_s,
            _ => since_s,
        };
        let row = (stopped_s / moving.period_s) as usize;
        let mut q_rad = moving.rows[row.min(moving.rows.len() - 1)].clone();
        let ended = row + 1 >= moving.rows.len();
        if let Some((InjectedFault::Drift, after_s)) = injected {
            q_rad[2] += 0.5 * (since_s - after_s).min(1.0);
        }
        state.q_rad = q_rad;
        match injected.map(|(injected, _)| injected) {
            Some(InjectedFault::Violation) => state.fail(OpState::OpViolate),
            Some(InjectedFault::Collision) => state.fail(OpState::OpCollision),
            Some(InjectedFault::EmergencyStop) => state.fail(OpState::OpStopAndOff),
            Some(InjectedFault::LostLink) => state.silent = true,
            Some(InjectedFault::SlowReplies) => state.slow = true,
            _ => {}
        }
        if injected.is_some() && state.shown_s.is_none() {
            state.shown_s = Some(self.begun.elapsed().as_secs_f64());
        }
        let stays = matches!(injected, Some((InjectedFault::Drift | InjectedFault::Stall, _)));
        if ended && !stays {
            state.moving = None;
        }
    }

    /// Starts a motion; `false` if it is refused.
    fn begin(&self, rows: Vec<Vec<f64>>, period_s: f64) -> bool {
        let mut state = self.state();
        state.motions += 1;
        let refuses = self.setup.injected.is_some_and(|(injected, motion, _)| {
            injected == InjectedFault::Refusal && motion == state.motions
        });
        if refuses || state.op_state != OpState::OpIdle || state.moving.is_some() || rows.is_empty() {
            return false;
        }
        state.moving = Some(Moving { rows, period_s, begun: Instant::now() });
        true
    }

    fn stop(&self) {
        let mut state = self.state();
        state.moving = None;
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
        self.moving = None;
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

/// Serves all services on one port.
pub async fn serve(controller: Arc<Controller>, listener: TcpListener) {
    let incoming = TcpIncoming::from(listener).with_nodelay(Some(true));
    services::router(&controller).serve_with_incoming(incoming).await.expect("the server ends with the test");
}
