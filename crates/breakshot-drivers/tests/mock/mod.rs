//! A controller that is none: serves what an Indy 7's controller serves, moves an arm of numbers in real time, and fails when
//! told to.

#![allow(dead_code, unreachable_pub, reason = "each test uses a part of it")]

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

/// The pose an Indy 7 waits in (deg).
pub const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];
/// A real controller's base is so much higher than its published frames (m).
const HIGHER_M: f64 = 0.0005;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    Violation,
    Collision,
    /// Somebody pressed the button: power is off.
    EmergencyStop,
    /// The cable is pulled: nothing is answered any more.
    LostLink,
    /// Every answer takes longer than a strike can wait.
    SlowReplies,
    /// The arm leaves its path.
    Drift,
    /// The motion is not accepted.
    Refusal,
    /// The motion never comes to its end.
    Stall,
}

/// How the controller is set up, and what will go wrong.
#[derive(Clone, Debug)]
pub struct Setup {
    pub model: String,
    /// How much faster than the clock the arm moves: tests need not wait.
    pub hurry: f64,
    /// What goes wrong, in the motion of this number (from 1), so long after its start (s).
    pub fault: Option<(Fault, usize, f64)>,
    pub speed_ratio: i32,
    pub detects_collisions: bool,
    pub tool_kg: f32,
    /// How far off its kinematics is along x (m).
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
            hurry: 1.0,
            fault: None,
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

/// A request that came in (s since the controller began).
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    pub at_s: f64,
    pub name: String,
}

/// Rows of joint angles (rad), evenly spaced in time.
struct Moving {
    rows: Vec<Vec<f64>>,
    period_s: f64,
    begun: Instant,
}

struct Inside {
    q_rad: Vec<f64>,
    moving: Option<Moving>,
    motions: usize,
    op_state: OpState,
    calls: Vec<Call>,
    /// When a client could first know of the fault (s).
    shown_s: Option<f64>,
    silent: bool,
    slow: bool,
}

/// The controller itself, shared by its services.
pub struct Controller {
    pub setup: Setup,
    pub arm: Arm,
    begun: Instant,
    inside: Mutex<Inside>,
}

/// Longer than anyone waits for an answer during a strike.
const SLOW: Duration = Duration::from_millis(600);

impl Controller {
    pub fn new(setup: Setup) -> Arc<Self> {
        let inside = Inside {
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
        Arc::new(Self { setup, arm, begun: Instant::now(), inside: Mutex::new(inside) })
    }

    fn inside(&self) -> std::sync::MutexGuard<'_, Inside> {
        self.inside.lock().expect("no test panics while it holds this")
    }

    /// All that came in, in order.
    pub fn calls(&self) -> Vec<Call> {
        self.inside().calls.clone()
    }

    /// How often that was asked for.
    pub fn count(&self, name: &str) -> usize {
        self.inside().calls.iter().filter(|call| call.name == name).count()
    }

    /// When a client could first know of the fault (s).
    pub fn shown_s(&self) -> Option<f64> {
        self.inside().shown_s
    }

    /// Where the arm is now (rad).
    pub fn q_rad(&self) -> Vec<f64> {
        self.advance();
        self.inside().q_rad.clone()
    }

    /// Takes note of a request, and keeps it waiting if that is what goes wrong.
    async fn asked(&self, name: &str) {
        self.advance();
        let (silent, slow) = {
            let mut inside = self.inside();
            inside.calls.push(Call { at_s: self.begun.elapsed().as_secs_f64(), name: name.into() });
            (inside.silent, inside.slow)
        };
        if silent {
            std::future::pending::<()>().await;
        }
        if slow {
            tokio::time::sleep(SLOW).await;
        }
    }

    /// Brings the arm and the trouble to the present.
    fn advance(&self) {
        let mut inside = self.inside();
        let Some(moving) = &inside.moving else { return };
        let since_s = moving.begun.elapsed().as_secs_f64() * self.setup.hurry;
        let fault = self
            .setup
            .fault
            .filter(|&(_, motion, after_s)| inside.motions == motion && since_s >= after_s)
            .map(|(fault, _, after_s)| (fault, after_s));
        let stopped_s = match fault {
            Some((Fault::Violation | Fault::Collision | Fault::EmergencyStop | Fault::Stall, after_s)) => {
                after_s
            }
            _ => since_s,
        };
        let row = (stopped_s / moving.period_s) as usize;
        let mut q_rad = moving.rows[row.min(moving.rows.len() - 1)].clone();
        let ended = row + 1 >= moving.rows.len();
        if let Some((Fault::Drift, after_s)) = fault {
            q_rad[2] += 0.5 * (since_s - after_s).min(1.0);
        }
        inside.q_rad = q_rad;
        match fault.map(|(fault, _)| fault) {
            Some(Fault::Violation) => inside.fail(OpState::OpViolate),
            Some(Fault::Collision) => inside.fail(OpState::OpCollision),
            Some(Fault::EmergencyStop) => inside.fail(OpState::OpStopAndOff),
            Some(Fault::LostLink) => inside.silent = true,
            Some(Fault::SlowReplies) => inside.slow = true,
            _ => {}
        }
        if fault.is_some() && inside.shown_s.is_none() {
            inside.shown_s = Some(self.begun.elapsed().as_secs_f64());
        }
        let stays = matches!(fault, Some((Fault::Drift | Fault::Stall, _)));
        if ended && !stays {
            inside.moving = None;
        }
    }

    /// Starts a motion; false if it is not accepted.
    fn begin(&self, rows: Vec<Vec<f64>>, period_s: f64) -> bool {
        let mut inside = self.inside();
        inside.motions += 1;
        let refuses = self
            .setup
            .fault
            .is_some_and(|(fault, motion, _)| fault == Fault::Refusal && motion == inside.motions);
        if refuses || inside.op_state != OpState::OpIdle || inside.moving.is_some() || rows.is_empty() {
            return false;
        }
        inside.moving = Some(Moving { rows, period_s, begun: Instant::now() });
        true
    }

    fn stop(&self) {
        let mut inside = self.inside();
        inside.moving = None;
    }

    /// Its tool's frame in its base, which is half a millimetre higher than the published one.
    pub fn tool(&self, q_rad: &[f64]) -> Frame {
        Translation3::new(self.setup.off_m, 0.0, HIGHER_M) * self.arm.flange_frame(q_rad)
    }

    fn pose(&self, q_rad: &[f64]) -> Vec<f32> {
        requests::pose_mm_deg(&self.tool(q_rad))
    }
}

impl Inside {
    fn fail(&mut self, op_state: OpState) {
        self.op_state = op_state;
        self.moving = None;
    }
}

/// A controller that listens.
pub struct Mock {
    pub controller: Arc<Controller>,
    pub address: Address,
    server: JoinHandle<()>,
}

impl Mock {
    /// On a free port of this computer.
    pub async fn start(setup: Setup) -> Self {
        let controller = Controller::new(setup);
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        let port = listener.local_addr().expect("it is bound").port();
        let server = tokio::spawn(serve(Arc::clone(&controller), listener));
        Self { controller, address: Address::of_port("127.0.0.1", port), server }
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
