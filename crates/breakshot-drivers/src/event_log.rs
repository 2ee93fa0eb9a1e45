//! Everything that happens, written down: one JSON line an event, and a recording of the arm (MCAP).

use crate::fault::Trouble;
use crate::preflight::Finding;
use crate::report::StopAccount;
use breakshot::files;
use breakshot::robot::{Command, JointState, Level, Recording, Station};
use serde::Serialize;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use tokio::time::Instant;

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The run begins.
    Begun {
        /// The program's version.
        version: &'static str,
        /// The robot, as the user named it.
        driver: String,
        /// The command's short hash.
        hash: String,
        /// The arm it was planned for.
        arm: String,
        /// Whether the arm may move.
        live: bool,
    },
    /// Something was looked at before the arm moved.
    Finding(Finding),
    /// The command may not be carried out.
    Objection {
        /// Why.
        reason: String,
    },
    /// A motion was sent.
    Sent {
        /// What it is for.
        motion: String,
        /// How long it takes (s).
        duration_s: f64,
        /// Where it starts and ends.
        from_rad: Vec<f64>,
        /// Where it ends.
        to_rad: Vec<f64>,
    },
    /// Where the arm is.
    State {
        /// Joint angles.
        q_rad: Vec<f64>,
        /// Whether the robot says that it is moving.
        moving: bool,
    },
    /// A motion has ended where it should.
    Arrived {
        /// What it was for.
        motion: String,
    },
    /// Something went wrong.
    Trouble {
        /// What.
        trouble: Trouble,
        /// In words.
        message: String,
    },
    /// The arm was told to stop.
    Stopped(StopAccount),
    /// The run is over.
    Ended {
        /// How.
        outcome: &'static str,
    },
}

/// The log of one run.
#[derive(Debug)]
pub struct Diary {
    started: Instant,
    station: Station,
    recording: Recording,
    files: Option<(File, PathBuf)>,
    /// The first thing that could not be written.
    failure: Option<std::io::Error>,
    tell: fn(&Event),
}

/// A line of the log.
#[derive(Serialize)]
struct Line<'a> {
    time_unix_s: f64,
    since_start_s: f64,
    #[serde(flatten)]
    event: &'a Event,
}

impl Diary {
    /// A log in `path` (JSON lines) and beside it a recording (`.mcap`); without a path nothing is written. `tell` hears of
    /// every event as it happens.
    ///
    /// # Errors
    /// A file that cannot be made, an arm that cannot be read again.
    pub fn new(command: &Command, path: Option<&Path>, tell: fn(&Event)) -> breakshot::Result<Self> {
        let station = command.station()?;
        let open = |path: &Path| {
            let file = File::create(path)
                .map_err(|source| breakshot::Error::Write { path: path.to_path_buf(), source })?;
            Ok((file, path.with_extension("mcap")))
        };
        let files = path.map(open).transpose()?;
        let mut recording = Recording::default();
        recording.add_arm(0.0, &station);
        if let Some(scene) = &command.scene {
            recording.add_scene(0.0, scene, |_| None)?;
        }
        Ok(Self { started: Instant::now(), station, recording, files, failure: None, tell })
    }

    /// Writes an event down at once.
    pub(crate) fn note(&mut self, event: Event) {
        (self.tell)(&event);
        let since_start_s = self.started.elapsed().as_secs_f64();
        let unix = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let line = Line { time_unix_s: unix.map_or(0.0, |t| t.as_secs_f64()), since_start_s, event: &event };
        let text = serde_json::to_string(&line).unwrap_or_default();
        if let Some((file, _)) = &mut self.files {
            // A full disk must not end a motion that is watched: it is told at the end.
            if let Err(error) = writeln!(file, "{text}") {
                self.failure.get_or_insert(error);
            }
        }
        let level = match &event {
            Event::State { q_rad, .. } => {
                let still = vec![0.0; q_rad.len()];
                let state = JointState { q_rad: q_rad.clone(), qd_rad_s: still.clone(), qdd_rad_s2: still };
                self.recording.add_state(since_start_s, &self.station, &state);
                return;
            }
            Event::Trouble { .. } => Level::Error,
            Event::Objection { .. } | Event::Stopped(_) => Level::Warning,
            Event::Finding(finding) if !finding.holds => Level::Warning,
            _ => Level::Info,
        };
        self.recording.add_log(since_start_s, level, &text);
    }

    /// Writes the recording.
    ///
    /// # Errors
    /// The recording, or an earlier line, that could not be written.
    pub fn finish(mut self) -> breakshot::Result<()> {
        let Some((_, path)) = &self.files else { return Ok(()) };
        if let Some(source) = self.failure.take() {
            return Err(breakshot::Error::Write { path: path.with_extension("jsonl"), source });
        }
        files::write_whole(path, &self.recording.finished())
    }
}
