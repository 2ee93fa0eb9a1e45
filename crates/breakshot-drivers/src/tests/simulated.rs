//! Whole runs of the drivers against the mock controllers in simulated time: over streams of this process, with tokio's clock
//! paused, so that a run takes no time but the computation's and gives the same result on any machine.

#[path = "../../tests/bridge/mod.rs"]
pub(super) mod bridge;
#[path = "../../tests/mock/mod.rs"]
pub(super) mod mock;

use super::example::{command, just_after};
use crate::motion::largest_difference;
use crate::robot::driver::Robot;
use crate::robot::indy::Indy;
use crate::robot::rosbridge::{self, Rosbridge};
use crate::session::Session;
use crate::{Ending, EventLog, Fault, Job, Permission, Watchdog};
use breakshot::robot::Command;
use bridge::Bridge;
use hyper_util::rt::TokioIo;
use mock::Controller;
use mock::mishap::{Injection, Seen};
use mock::simulated_arm::Played;
use std::future::Future;
use std::pin::Pin;
use std::sync::{Arc, LazyLock};
use std::time::Duration;
use tokio::time::Instant;
use tonic::transport::{Channel, Endpoint};

/// Size of the streams' buffers (bytes).
const BUFFER: usize = 1 << 20;

/// The command of all runs.
pub(super) static COMMAND: LazyLock<Command> = LazyLock::new(|| command(0.2));

/// What happened in a run.
#[derive(Debug)]
pub(super) struct Run {
    pub(super) ending: Result<Ending, Fault>,
    /// The motions that the arm made.
    pub(super) played: Vec<Played>,
    /// The messages between driver and controller.
    pub(super) seen: Vec<Seen>,
    /// When the mishap happened.
    pub(super) happened: Option<Instant>,
    /// The largest difference of a reported joint angle from the true one, at each wrong report (rad).
    pub(super) misreported: Vec<(Instant, f64)>,
    pub(super) ended: Instant,
    /// How far a joint moved after the run had ended (rad).
    pub(super) moved_afterwards_rad: f64,
}

/// When the user interrupts a run: after so many motions have begun, and this time.
pub(super) type Interrupt = Option<(usize, Duration)>;

/// The controller of a run.
#[derive(Clone, Debug)]
pub(super) enum Peer {
    Indy(mock::Setup),
    Bridge(bridge::Setup),
}

/// A run in simulated time; `keep` keeps the bytes of all messages.
pub(super) fn run(peer: &Peer, injection: Option<Injection>, interrupt: Interrupt, keep: bool) -> Run {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    let runtime = runtime.expect("a runtime");
    runtime.block_on(async {
        match peer {
            Peer::Indy(setup) => over_indy(setup, injection, interrupt, keep).await,
            Peer::Bridge(setup) => over_bridge(setup, injection, interrupt, keep).await,
        }
    })
}

async fn over_indy(
    setup: &mock::Setup,
    injection: Option<Injection>,
    interrupt: Interrupt,
    keep: bool,
) -> Run {
    let controller = Controller::new(setup.clone());
    let (streams, received) = tokio::sync::mpsc::unbounded_channel();
    let server = tokio::spawn(mock::serve_streams(Arc::clone(&controller), received));
    let channel = async || -> Channel {
        let streams = streams.clone();
        let connector = tower::service_fn(move |_| {
            let (ours, theirs) = tokio::io::duplex(BUFFER);
            let sent = streams.send(theirs).map_err(std::io::Error::other);
            async move { sent.map(|()| TokioIo::new(ours)) }
        });
        Endpoint::from_static("http://simulated").connect_with_connector(connector).await.expect("a mock")
    };
    let control = [channel().await, channel().await];
    let indy = Indy::over(control, channel().await, channel().await, channel().await, true);
    {
        let mut messages = controller.messages();
        (messages.injection, messages.keep) = (injection, keep);
    }
    let motions = Arc::clone(&controller);
    let interrupted = interrupted(interrupt, move || motions.played().len());
    let ending = session(Robot::Indy(Box::new(indy)), interrupted).await;
    let (ended, rest_rad) = (Instant::now(), controller.true_rad());
    tokio::time::sleep(AFTERWARDS).await;
    server.abort();
    let moved_afterwards_rad = largest_difference(&rest_rad, &controller.true_rad()).1;
    let played = controller.played();
    let mut messages = controller.messages();
    Run {
        ending,
        played,
        seen: std::mem::take(&mut messages.seen),
        happened: messages.happened,
        misreported: std::mem::take(&mut messages.misreported),
        ended,
        moved_afterwards_rad,
    }
}

async fn over_bridge(
    setup: &bridge::Setup,
    injection: Option<Injection>,
    interrupt: Interrupt,
    keep: bool,
) -> Run {
    let (ours, theirs) = tokio::io::duplex(BUFFER);
    let bridge = Arc::new(Bridge::over(theirs, setup.clone()));
    {
        let messages = &mut bridge.shared().messages;
        (messages.injection, messages.keep) = (injection, keep);
    }
    let address = rosbridge::Address::of_host("simulated");
    let connection = Rosbridge::over(ours, &address, &COMMAND.joints).await;
    let motions = Arc::clone(&bridge);
    let interrupted = interrupted(interrupt, move || motions.shared().arm.played.len());
    let ending = match connection {
        Ok(robot) => session(Robot::Rosbridge(Box::new(robot)), interrupted).await,
        Err(fault) => Err(fault),
    };
    let (ended, rest_rad) = (Instant::now(), bridge.shared().arm.now().0);
    tokio::time::sleep(AFTERWARDS).await;
    let mut shared = bridge.shared();
    let moved_afterwards_rad = largest_difference(&rest_rad, &shared.arm.now().0).1;
    let (played, happened) = (shared.arm.played.clone(), shared.messages.happened);
    Run {
        ending,
        played,
        seen: std::mem::take(&mut shared.messages.seen),
        happened,
        misreported: std::mem::take(&mut shared.messages.misreported),
        ended,
        moved_afterwards_rad,
    }
}

/// What a rosbridge receives of a run that is dropped in the middle of the approach: the kinds of its messages.
pub(super) fn dropped_over_bridge() -> Vec<String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.expect("a runtime").block_on(async {
        let (ours, theirs) = tokio::io::duplex(BUFFER);
        let bridge = Bridge::over(theirs, bridge::Setup::default());
        let address = rosbridge::Address::of_host("simulated");
        let robot = Rosbridge::over(ours, &address, &COMMAND.joints).await.expect("a mock");
        let run = session(Robot::Rosbridge(Box::new(robot)), std::future::pending());
        assert!(tokio::time::timeout(Duration::from_millis(700), run).await.is_err(), "it has ended");
        tokio::time::sleep(AFTERWARDS).await;
        let kind = |message: serde_json::Value| message["op"].as_str().unwrap_or_default().to_owned();
        bridge.messages().into_iter().map(kind).collect()
    })
}

/// The time for which the arm is watched after a run.
const AFTERWARDS: Duration = Duration::from_secs(10);

async fn interrupted(interrupt: Interrupt, motions: impl Fn() -> usize) {
    let Some((count, after)) = interrupt else { return std::future::pending().await };
    while motions() < count {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    tokio::time::sleep(after).await;
}

async fn session(robot: Robot, interrupt: impl Future<Output = ()>) -> Result<Ending, Fault> {
    let permission = Permission { hash: Some(COMMAND.short_hash()), allow_fast: false };
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let watchdog = Watchdog::default();
    let job = Job { command: &COMMAND, permission, live: true, observe, now_unix_s, watchdog };
    let mut log = EventLog::new(&COMMAND, None, |_| ()).expect("an arm");
    let interrupt: Pin<Box<_>> = Box::pin(interrupt);
    let report = Session::new(Arc::new(robot), &job, &mut log, interrupt).run().await;
    report.map(|report| report.ending)
}
