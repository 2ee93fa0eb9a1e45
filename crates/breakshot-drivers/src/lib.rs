//! Carries a [`Command`](breakshot::robot::Command) out on a robot over the network.
//!
//! [`strike`] looks at the robot without moving it, asks whether the command may be carried out ([`objections`]), brings the
//! arm to its run-up, looks at the table again, strikes once, and brings the arm home. A hundred times a second it looks
//! where the arm is; whatever goes wrong ends in a stop. Everything is written down in a [`Diary`].
//!
//! **A stop over the network is not a safety function.** Motion that has been sent may finish, whatever happens to the link.
//! Keep a hand on the emergency stop.
//!
//! The robots: Neuromeka's Indy 7 ([`indy`]), any arm with ROS 2 behind a rosbridge ([`rosbridge`]), and none, which
//! plays the command into our own physics.

mod arm;
mod event_log;
mod fault;
pub mod indy;
mod interlock;
mod job;
mod motion;
mod preflight;
mod report;
mod robot;
pub mod rosbridge;
mod session;
mod sim;
#[cfg(test)]
mod tests;

/// The controller's messages and clients, made from `proto/indy.proto`.
#[allow(missing_docs, clippy::pedantic, unreachable_pub, reason = "made by a program")]
pub mod wire {
    include!(concat!(env!("OUT_DIR"), "/client/nrmk.indy_framework.rs"));
}

pub use event_log::{Diary, Event};
pub use fault::Trouble;
pub use interlock::{FRESH_S, Permission, objections};
pub use job::{Errand, Watch};
pub use preflight::Finding;
pub use report::{Ending, Report, StopAccount};
pub use robot::Driver;
pub use session::{carry_out, strike};
pub use sim::Simulated;
