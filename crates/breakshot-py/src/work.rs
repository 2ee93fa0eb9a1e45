//! Long work: without the interpreter's lock, in threads of this module, until Ctrl-C.
//!
//! The library's threads are those of the pool in which it is called.  Rayon's global pool does not survive a fork, so the module has
//! one of its own and makes a new one where the process has changed.

use crate::error::internal;
use pyo3::{PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// How often a caller that waits looks for Ctrl-C: on a busy machine the look itself and the end of the work each wait for a core, and a stop has 0.3 s.
pub(crate) const SIGNAL_PERIOD: Duration = Duration::from_millis(15);
/// The most threads that a caller may ask for.
pub(crate) const MOST_THREADS: usize = 1024;

/// A request to end work early, shared by the caller and the work.
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Whether the caller wants no answer any more.
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// The threads of this module in one process.
struct Threads {
    process: u32,
    /// The number that was asked for; `None`: one for each core, or `RAYON_NUM_THREADS`.
    asked: Option<usize>,
    pool: Arc<ThreadPool>,
}

/// Only touched with the interpreter's lock held and never while waiting, so that a fork leaves it unlocked.
static THREADS: Mutex<Option<Threads>> = Mutex::new(None);

/// The pool of so many threads in this process.
pub(crate) fn pool(_: Python, asked: Option<usize>) -> PyResult<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = &*threads
        && (known.process, known.asked) == (process, asked)
    {
        return Ok(known.pool.clone());
    }
    let pool = ThreadPoolBuilder::new().num_threads(asked.unwrap_or(0)).build().map_err(internal)?;
    let pool = Arc::new(pool);
    let replaced = threads.replace(Threads { process, asked, pool: pool.clone() });
    // The threads of a pool from before a fork do not exist here, and its locks may be taken for ever.
    if let Some(replaced) = replaced.filter(|replaced| replaced.process != process) {
        std::mem::forget(replaced);
    }
    Ok(pool)
}

/// Leaves the present pool to the work that it still has.
fn abandon(_: Python) {
    *THREADS.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

/// Runs the signal handlers of Python from a thread that does not hold the interpreter's lock.
///
/// # Errors
/// What a handler raises: `KeyboardInterrupt`.
#[allow(clippy::redundant_closure_for_method_calls, reason = "the method is for one lifetime only")]
pub(crate) fn check_signals() -> PyResult<()> {
    Python::attach(|py| py.check_signals())
}

/// The result of `work`, which runs in the module's threads while other Python threads go on.
///
/// # Errors
/// Those of a signal handler: `KeyboardInterrupt`.  The work is asked to stop, and not waited for.
pub(crate) fn run<T: Send + 'static>(
    py: Python,
    work: impl FnOnce(&Stop) -> T + Send + 'static,
) -> PyResult<T> {
    let pool = pool(py, None)?;
    let stop = Stop::default();
    let (sender, mut answer) = channel();
    let stop_of_work = stop.clone();
    pool.spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&stop_of_work)));
        // The caller may be gone.
        let _ = sender.send(done);
    });
    loop {
        let waited = py.detach(move || {
            let next = answer.recv_timeout(SIGNAL_PERIOD);
            (answer, next)
        });
        answer = waited.0;
        match waited.1 {
            Ok(Ok(result)) => return Ok(result),
            Ok(Err(panic)) => resume_unwind(panic),
            Err(RecvTimeoutError::Disconnected) => return Err(internal("the work ended without an answer")),
            Err(RecvTimeoutError::Timeout) => py.check_signals().inspect_err(|_| {
                stop.set();
                abandon(py);
            })?,
        }
    }
}
