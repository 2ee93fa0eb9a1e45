//! Executes a [`Command`](breakshot::robot::Command) on a robot over the network.
//!
//! [`strike`] checks the robot without moving it and the command against the interlock ([`objections`]), moves the arm to its
//! run-up, requests the latest observation of the table, strikes once, and moves the arm home. It reads the arm's state a
//! hundred times per second; every fault ends in a stop. All events are written to an [`EventLog`].
//!
//! **A stop over the network is not a safety function.** Motion that has been sent may finish, whatever happens to the link.
//! Keep a hand on the emergency stop.
//!
//! The robots: Neuromeka's Indy 7 (`indy`), any arm with ROS 2 behind a rosbridge (`rosbridge`), and a simulated arm whose
//! strike is simulated by [`breakshot::physics`]. The first two need the feature `network`, which is a default of this crate but
//! not of the command line.

#![cfg_attr(
    not(feature = "network"),
    allow(dead_code, reason = "a part is used by the robots on the network only")
)]

// The mocks of the integration tests name this crate.
#[cfg(test)]
extern crate self as breakshot_drivers;

mod event_log;
mod fault;
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub mod fuzzing;
mod interlock;
mod job;
mod motion;
mod preflight;
mod progress;
mod report;
mod robot;
mod session;
mod stop_on_drop;
#[cfg(test)]
mod tests;

/// The controller's messages and clients, generated from `proto/indy.proto` (`cargo xtask proto`).
#[cfg(feature = "network")]
#[allow(missing_docs, clippy::pedantic, unreachable_pub, reason = "generated code")]
pub mod wire {
    include!("../proto/generated/messages.rs");
    include!("../proto/generated/rt_data_exchange_client.rs");
    include!("../proto/generated/control_client.rs");
    include!("../proto/generated/config_client.rs");
    include!("../proto/generated/device_client.rs");
}

pub use event_log::{Event, EventLog};
pub use fault::Fault;
pub use interlock::{FRESH_S, Permission, objections};
pub use job::{Job, Watchdog};
pub use preflight::PreflightCheck;
pub use report::{Ending, Report, StopReport};
pub use robot::driver::Driver;
pub use robot::sim::SimulatedStrike;
#[cfg(feature = "network")]
pub use robot::{indy, rosbridge};
pub use session::{carry_out, strike};
