//! What is to be done, what is allowed, and how closely the arm is watched.

use crate::interlock::Permission;
use breakshot::robot::Command;
use breakshot::scene::Scene;
use std::time::Duration;

/// What is to be done, and what is allowed.
pub struct Errand<'a> {
    /// The command.
    pub command: &'a Command,
    /// What the user allows.
    pub permission: Permission,
    /// Whether the arm is to move; without it nothing is sent that moves anything.
    pub live: bool,
    /// What lies on the table, asked for before the arm moves and again before it strikes; `None`: nobody looks again.
    pub look: &'a (dyn Fn() -> Result<Option<Scene>, String> + Sync),
    /// The time (s since 1970).
    pub now_unix_s: fn() -> f64,
    /// How closely to watch.
    pub watch: Watch,
}

/// How closely the arm is watched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watch {
    /// Time between two looks.
    pub period: Duration,
    /// A robot that is silent for longer is lost.
    pub silence: Duration,
    /// How much longer than planned a motion may take.
    pub grace: Duration,
}

impl Default for Watch {
    /// A hundred looks a second; lost after 150 ms, so that a broken link is known within 200 ms.
    fn default() -> Self {
        Self {
            period: Duration::from_millis(10),
            silence: Duration::from_millis(150),
            grace: Duration::from_secs(2),
        }
    }
}
