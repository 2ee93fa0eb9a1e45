//! The inputs of one run: the command, the user's permission, the scene source and the watchdog's times.

use crate::interlock::Permission;
use breakshot::robot::Command;
use breakshot::scene::Scene;
use std::time::Duration;

/// A command to execute, and what the user permits.
pub struct Job<'a> {
    /// The command.
    pub command: &'a Command,
    /// What the user permits.
    pub permission: Permission,
    /// Whether the arm moves; otherwise only requests that move nothing are sent.
    pub live: bool,
    /// Returns the latest observed scene; called before the arm moves and again before the strike. `None`: no new
    /// observation exists, and the command's own scene is used.
    pub observe: &'a (dyn Fn() -> Result<Option<Scene>, String> + Sync),
    /// The current time (s since 1970).
    pub now_unix_s: fn() -> f64,
    /// The watchdog's times.
    pub watchdog: Watchdog,
}

/// The times of the loop that monitors the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Watchdog {
    /// Time between two requests of the arm's state.
    pub period: Duration,
    /// The link counts as lost if no answer arrives within this time.
    pub silence: Duration,
    /// How much longer than planned a motion may take.
    pub grace: Duration,
    /// Speed of the controller's clock over ours: 1 for every real robot. A controller that simulates may be faster.
    pub pace: f64,
}

impl Default for Watchdog {
    /// 100 requests per second; the link is lost after 150 ms, so that a broken link is detected within 200 ms.
    fn default() -> Self {
        Self {
            period: Duration::from_millis(10),
            silence: Duration::from_millis(150),
            grace: Duration::from_secs(2),
            pace: 1.0,
        }
    }
}
