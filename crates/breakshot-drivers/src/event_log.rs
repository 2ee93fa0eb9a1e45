//! The log of a run: one JSON line per event, and a recording of the arm (MCAP).

use crate::fault::Fault;
use crate::preflight::PreflightCheck;
use crate::report::StopReport;
use breakshot::files;
use breakshot::robot::{Command, JointState, LogLevel, MountedArm, Recording};
use serde::Serialize;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::thread::JoinHandle;
use std::time::SystemTime;
use tokio::time::Instant;

/// An event of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// The run starts.
    Begun {
        /// The program's version.
        version: &'static str,
        /// The robot's address in the form of `--driver`.
        driver: String,
        /// The command's short hash.
        hash: String,
        /// The arm that the command was planned for.
        arm: String,
        /// Whether the arm moves, or the run is a dry run.
        live: bool,
    },
    /// A check of the robot before the arm moves.
    #[serde(rename = "finding")]
    PreflightCheck(PreflightCheck),
    /// A reason for which the command must not be executed.
    Objection {
        /// The reason.
        reason: String,
    },
    /// A motion was sent.
    Sent {
        /// Its name.
        motion: String,
        /// Its duration (s).
        duration_s: f64,
        /// Joint angles at its start (rad).
        from_rad: Vec<f64>,
        /// Joint angles at its end (rad).
        to_rad: Vec<f64>,
    },
    /// The arm's state.
    State {
        /// Joint angles (rad).
        q_rad: Vec<f64>,
        /// Whether the robot reports a motion under way.
        moving: bool,
    },
    /// A motion has reached its end.
    Arrived {
        /// Its name.
        motion: String,
    },
    /// A fault was detected.
    #[serde(rename = "trouble")]
    Fault {
        /// The fault.
        #[serde(rename = "trouble")]
        fault: Fault,
        /// Its message.
        message: String,
    },
    /// A stop was requested.
    Stopped(StopReport),
    /// The run ended.
    Ended {
        /// The ending's name.
        outcome: &'static str,
    },
}

/// The log of one run.
#[derive(Debug)]
pub struct EventLog {
    started: Instant,
    mounted: MountedArm,
    recording: Recording,
    file: Option<LogFile>,
    on_event: fn(&Event),
}

/// The log's file. A thread writes it, so that a slow disk does not delay the loop that monitors the arm.
#[derive(Debug)]
pub(crate) struct LogFile {
    lines: Sender<String>,
    writer: JoinHandle<std::io::Result<()>>,
    path: PathBuf,
}

impl LogFile {
    /// Creates the file; an existing one is never overwritten.
    fn create(path: &Path) -> breakshot::Result<Self> {
        let recording = path.with_extension("mcap");
        let exists = |path: &Path| {
            let needed = "a new name: the log of a strike is never overwritten";
            breakshot::Error::invalid(path.display().to_string(), "the log", "an existing file", needed)
        };
        if recording.exists() {
            return Err(exists(&recording));
        }
        let file = OpenOptions::new().write(true).create_new(true).open(path);
        let file = file.map_err(|source| match source.kind() {
            ErrorKind::AlreadyExists => exists(path),
            _ => breakshot::Error::Write { path: path.into(), source },
        })?;
        Ok(Self::over(path.into(), SyncedFile(file)))
    }

    /// A log that is written to `file`, each line as soon as it comes and at once: it is complete although the program is killed.
    pub(crate) fn over(path: PathBuf, mut file: impl Write + Send + 'static) -> Self {
        let (lines, received) = channel::<String>();
        let writer = std::thread::spawn(move || {
            let mut result = Ok(());
            // After an error, such as a full disk, the lines are still received: `finish` returns the first error.
            for line in received {
                result = result.and_then(|()| file.write_all((line + "\n").as_bytes()));
            }
            result.and_then(|()| file.flush())
        });
        Self { lines, writer, path }
    }

    /// Waits until all lines are on the disk.
    fn finish(self) -> breakshot::Result<()> {
        drop(self.lines);
        let result = self.writer.join().unwrap_or_else(|_| Err(std::io::Error::other("its writer panicked")));
        result.map_err(|source| breakshot::Error::Write { path: self.path, source })
    }
}

/// A file whose bytes are on the disk when it is flushed.
struct SyncedFile(File);

impl Write for SyncedFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.sync_all()
    }
}

/// A line of the log.
#[derive(Serialize)]
struct Line<'a> {
    time_unix_s: f64,
    since_start_s: f64,
    #[serde(flatten)]
    event: &'a Event,
}

impl EventLog {
    /// A log in `path` (JSON lines) and a recording beside it (`.mcap`); without a path nothing is written. `on_event` is
    /// called with every event as it happens.
    ///
    /// # Errors
    /// A file that exists already or cannot be created, or an arm model that cannot be built.
    pub fn new(command: &Command, path: Option<&Path>, on_event: fn(&Event)) -> breakshot::Result<Self> {
        Self::with(command, path.map(LogFile::create).transpose()?, on_event)
    }

    /// A log in a file that is open already.
    pub(crate) fn with(
        command: &Command,
        file: Option<LogFile>,
        on_event: fn(&Event),
    ) -> breakshot::Result<Self> {
        let mounted = command.mounted_arm()?;
        let mut recording = Recording::default();
        recording.add_arm(0.0, &mounted);
        if let Some(scene) = &command.scene {
            recording.add_scene(0.0, scene, |_| None)?;
        }
        Ok(Self { started: Instant::now(), mounted, recording, file, on_event })
    }

    /// Appends an event.
    pub(crate) fn note(&mut self, event: Event) {
        (self.on_event)(&event);
        let since_start_s = self.started.elapsed().as_secs_f64();
        let unix = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let line = Line { time_unix_s: unix.map_or(0.0, |t| t.as_secs_f64()), since_start_s, event: &event };
        let text = serde_json::to_string(&line).unwrap_or_default();
        if let Some(file) = &self.file {
            // Without its writer the log is incomplete, which must not end a monitored motion: `finish` returns the error.
            let _ = file.lines.send(text.clone());
        }
        let level = match &event {
            Event::State { q_rad, .. } => {
                let still = vec![0.0; q_rad.len()];
                let state = JointState { q_rad: q_rad.clone(), qd_rad_s: still.clone(), qdd_rad_s2: still };
                self.recording.add_state(since_start_s, &self.mounted, &state);
                return;
            }
            Event::Fault { .. } => LogLevel::Error,
            Event::Objection { .. } | Event::Stopped(_) => LogLevel::Warning,
            Event::PreflightCheck(check) if !check.holds => LogLevel::Warning,
            _ => LogLevel::Info,
        };
        self.recording.add_log(since_start_s, level, &text);
    }

    /// Writes the recording.
    ///
    /// # Errors
    /// The first event or the recording could not be written.
    pub fn finish(self) -> breakshot::Result<()> {
        let Some(file) = self.file else { return Ok(()) };
        let recording = file.path.with_extension("mcap");
        file.finish()?;
        files::write_whole(&recording, &self.recording.finished())
    }
}
