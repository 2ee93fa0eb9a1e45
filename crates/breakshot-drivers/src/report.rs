//! The result of a run: the preflight checks, the ending, and the times of a stop.

use crate::fault::Fault;
use crate::preflight::PreflightCheck;
use crate::robot::sim::SimulatedStrike;
use serde::Serialize;

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Ending {
    /// A dry run: nothing moved.
    Shown {
        /// The reasons for which a live run would be refused.
        objections: Vec<String>,
    },
    /// The strike was executed and the arm is back at its home pose.
    Struck {
        /// The simulated result, if the robot was the simulation.
        simulated: Option<SimulatedStrike>,
    },
    /// The run was refused before the strike.
    Refused {
        /// The reasons.
        objections: Vec<String>,
        /// The arm's position at the refusal.
        #[serde(rename = "stands")]
        arm_position: &'static str,
    },
    /// A fault occurred while the arm moved, and the arm was stopped.
    Stopped {
        /// The motion during which the fault occurred.
        motion: String,
        /// The fault.
        #[serde(rename = "trouble")]
        fault: Fault,
        /// Confirmation and times of the stop.
        stop: StopReport,
    },
}

/// Confirmation of a stop and its times, which count from the detection of the fault.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct StopReport {
    /// When the robot confirmed the stop (s); `None` without a confirmation.
    pub confirmed_after_s: Option<f64>,
    /// Whether the stop with brakes was requested.
    pub braked: bool,
    /// When the arm was measured at rest (s); `None` if it was not.
    #[serde(rename = "stands_after_s")]
    pub at_rest_after_s: Option<f64>,
    /// The controller's explanation of the fault, if it gives one.
    pub explanation: Option<String>,
}

/// The result of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// The checks of the robot before it moved.
    #[serde(rename = "findings")]
    pub checks: Vec<PreflightCheck>,
    /// How the run ended.
    pub ending: Ending,
}

impl StopReport {
    /// One sentence for the user.
    pub fn sentence(&self) -> String {
        let mut text = match self.confirmed_after_s {
            Some(s) => format!("the stop was confirmed {:.0} ms after the fault was detected", s * 1e3),
            None => "the stop was sent but never confirmed".into(),
        };
        text += match self.at_rest_after_s {
            Some(_) => "; the arm is at rest",
            None => {
                "; the arm was not measured at rest: motion already sent may finish, use the emergency stop"
            }
        };
        if let Some(explanation) = &self.explanation {
            text = format!("{text}; the controller reports: {explanation}");
        }
        text
    }
}
