//! How a run ended.

use crate::fault::Trouble;
use crate::preflight::Finding;
use crate::sim::Simulated;
use serde::Serialize;

/// How it ended.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Ending {
    /// Nothing was to move, and nothing did; these objections would have kept it from moving.
    Shown {
        /// Why it may not move.
        objections: Vec<String>,
    },
    /// The strike was carried out and the arm is back home.
    Struck {
        /// What it did in our own physics, if the robot was a simulation.
        simulated: Option<Simulated>,
    },
    /// It was refused; nothing was struck.
    Refused {
        /// Why.
        objections: Vec<String>,
        /// Where the arm stands now.
        stands: &'static str,
    },
    /// Something went wrong while the arm moved, and it was stopped.
    Stopped {
        /// During which motion.
        motion: String,
        /// What went wrong.
        trouble: Trouble,
        /// How it was stopped.
        stop: StopAccount,
    },
}

/// How a stop went; times count from the moment in which the trouble was known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StopAccount {
    /// When the robot confirmed it (s); none if it never did.
    pub confirmed_after_s: Option<f64>,
    /// Whether the brakes had to be asked for.
    pub braked: bool,
    /// When the arm was seen standing (s); none if it was not.
    pub stands_after_s: Option<f64>,
    /// What the controller has to say.
    pub explanation: Option<String>,
}

/// A run from beginning to end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was found on the robot before it moved.
    pub findings: Vec<Finding>,
    /// How it ended.
    pub ending: Ending,
}

impl StopAccount {
    /// What a person needs to know, in a sentence.
    pub fn sentence(&self) -> String {
        let mut text = match self.confirmed_after_s {
            Some(s) => format!("the stop was confirmed {:.0} ms after the trouble was known", s * 1e3),
            None => "the stop was sent but never confirmed".into(),
        };
        text += match self.stands_after_s {
            Some(_) => "; the arm stands",
            None => "; nobody saw the arm stand: motion already sent may finish, use the emergency stop",
        };
        if let Some(explanation) = &self.explanation {
            text = format!("{text}; the controller says: {explanation}");
        }
        text
    }
}
