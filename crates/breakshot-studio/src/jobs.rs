//! Work that takes longer: its progress as events, and its end on request.

use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// What happens to a job.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case", tag = "state")]
pub(crate) enum Event {
    /// The part that is done (0 to 1).
    Running { done: f64 },
    /// The result.
    Done { result: serde_json::Value },
    /// It was ended.
    Cancelled,
    /// Why it failed.
    Failed { error: String },
}

impl Event {
    fn is_end(&self) -> bool {
        !matches!(self, Self::Running { .. })
    }
}

/// The latest event of a job, and who gets the next ones.
#[derive(Default)]
struct Channel {
    latest: Option<Event>,
    listeners: Vec<Sender<String>>,
}

/// One job, as its work sees it.
#[derive(Clone, Default)]
pub(crate) struct Job {
    channel: Arc<Mutex<Channel>>,
    is_cancelled: Arc<AtomicBool>,
}

impl Job {
    /// Reports the part that is done; false if the job is to end.
    pub(crate) fn goes_on(&self, done: f64) -> bool {
        self.report(Event::Running { done });
        !self.is_cancelled()
    }

    /// Whether the job is to end.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    fn report(&self, event: Event) {
        let mut channel = self.channel.lock().unwrap_or_else(PoisonError::into_inner);
        let text = serde_json::to_string(&event).unwrap_or_default();
        channel.listeners.retain(|listener| listener.send(text.clone()).is_ok());
        if event.is_end() {
            channel.listeners.clear();
        }
        channel.latest = Some(event);
    }

    fn has_ended(&self) -> bool {
        let channel = self.channel.lock().unwrap_or_else(PoisonError::into_inner);
        channel.latest.as_ref().is_some_and(Event::is_end)
    }

    /// The latest event and all that follow.
    fn events(&self) -> Receiver<String> {
        let (sender, receiver) = channel();
        let mut channel = self.channel.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(latest) = &channel.latest {
            let _ = sender.send(serde_json::to_string(latest).unwrap_or_default());
        }
        if !channel.latest.as_ref().is_some_and(Event::is_end) {
            channel.listeners.push(sender);
        }
        receiver
    }
}

/// The jobs of the program's life, by number.
#[derive(Default)]
pub(crate) struct Jobs(Mutex<BTreeMap<u64, Job>>);

/// Most jobs at a time: each uses all cores.
const MOST_RUNNING: usize = 2;
/// Most jobs that are remembered.
const MOST_REMEMBERED: usize = 50;

impl Jobs {
    fn with<T>(&self, act: impl FnOnce(&mut BTreeMap<u64, Job>) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Starts work in a thread of its own and returns the job's number; none if too many are running.
    pub(crate) fn start(
        &self,
        work: impl FnOnce(&Job) -> breakshot::Result<serde_json::Value> + Send + 'static,
    ) -> Option<u64> {
        let job = Job::default();
        let own = job.clone();
        let number = self.with(|jobs| {
            if jobs.values().filter(|job| !job.has_ended()).count() >= MOST_RUNNING {
                return None;
            }
            let number = jobs.last_key_value().map_or(1, |(last, _)| last + 1);
            jobs.insert(number, job);
            if jobs.len() > MOST_REMEMBERED {
                jobs.pop_first();
            }
            Some(number)
        })?;
        std::thread::spawn(move || {
            // A panic is a failure of ours; the page shows it, and the program goes on.
            let ended = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&own)));
            own.report(match ended {
                Ok(Ok(result)) => Event::Done { result },
                Ok(Err(breakshot::Error::Stopped)) => Event::Cancelled,
                Ok(Err(error)) => Event::Failed { error: error.to_string() },
                Err(_) => Event::Failed { error: "the program failed; its terminal says more".into() },
            });
        });
        Some(number)
    }

    /// The events of a job.
    pub(crate) fn events(&self, number: u64) -> Option<Receiver<String>> {
        self.with(|jobs| jobs.get(&number).map(Job::events))
    }

    /// Asks a job to end; false for an unknown one.
    pub(crate) fn cancel(&self, number: u64) -> bool {
        self.with(|jobs| {
            jobs.get(&number).map(|job| job.is_cancelled.store(true, Ordering::Relaxed)).is_some()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_reports_its_progress_its_result_and_that_it_was_ended() {
        let jobs = Jobs::default();
        let (wait, go) = channel::<()>();
        let number = jobs.start(move |job| {
            let _ = go.recv();
            if job.goes_on(0.5) { Ok(7.into()) } else { Err(breakshot::Error::Stopped) }
        });
        let events = jobs.events(number.unwrap()).unwrap();
        wait.send(()).unwrap();
        let reported: Vec<String> = events.iter().collect();
        assert_eq!(reported, [r#"{"state":"running","done":0.5}"#, r#"{"state":"done","result":7}"#]);
        // Whoever comes later hears the end.
        let late: Vec<String> = jobs.events(number.unwrap()).unwrap().iter().collect();
        assert_eq!(late, reported[1..]);

        let (wait, go) = channel::<()>();
        let number = jobs.start(move |job| {
            let _ = go.recv();
            if job.goes_on(0.5) { Ok(7.into()) } else { Err(breakshot::Error::Stopped) }
        });
        let events = jobs.events(number.unwrap()).unwrap();
        assert!(jobs.cancel(number.unwrap()) && !jobs.cancel(99));
        wait.send(()).unwrap();
        assert_eq!(events.iter().last().unwrap(), r#"{"state":"cancelled"}"#);
    }
}
