//! A process that is ended if it keeps the program waiting: for its output, or for its end.

use std::io::Result;
use std::process::{Child, ExitStatus};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time between two looks at a process that is about to end.
const LOOK: Duration = Duration::from_millis(1);

/// A process and the thread that ends it if a wait takes longer than the patience, at most twice as long.
pub(super) struct Watched(Arc<Shared>);

struct Shared {
    child: Mutex<Child>,
    wait: Mutex<Wait>,
    changed: Condvar,
}

/// What the program waits for.
#[derive(Default)]
struct Wait {
    /// The number of the last wait.
    number: u64,
    is_waiting: bool,
    has_expired: bool,
    is_dropped: bool,
}

impl Watched {
    pub(super) fn new(child: Child, patience: Duration) -> Self {
        let (child, wait, changed) = (Mutex::new(child), Mutex::default(), Condvar::new());
        let shared = Arc::new(Shared { child, wait, changed });
        let watching = Arc::clone(&shared);
        std::thread::spawn(move || watching.watch(patience));
        Self(shared)
    }

    /// From now on the program waits for the process.
    pub(super) fn begin(&self) {
        let mut wait = locked(&self.0.wait);
        wait.number += 1;
        wait.is_waiting = true;
    }

    /// The program does not wait any more; whether it has waited too long.
    pub(super) fn end(&self) -> bool {
        let mut wait = locked(&self.0.wait);
        wait.is_waiting = false;
        wait.has_expired
    }

    /// Waits for the end of the process.
    pub(super) fn ended(&self) -> Result<ExitStatus> {
        loop {
            // Not `wait`, which would keep the lock that ending the process needs.
            if let Some(status) = locked(&self.0.child).try_wait()? {
                return Ok(status);
            }
            std::thread::sleep(LOOK);
        }
    }
}

impl Shared {
    /// Looks once in each interval of the patience whether the same wait goes on.
    fn watch(&self, patience: Duration) {
        let mut wait = locked(&self.wait);
        while !wait.is_dropped {
            let before = (wait.is_waiting, wait.number);
            let (now, timeout) =
                self.changed.wait_timeout(wait, patience).unwrap_or_else(PoisonError::into_inner);
            wait = now;
            if timeout.timed_out() && before == (true, wait.number) && wait.is_waiting {
                wait.has_expired = true;
                // An error means that the process has already ended.
                let _ = locked(&self.child).kill();
            }
        }
    }
}

impl Drop for Watched {
    /// Ends the process when its output is no longer read.
    fn drop(&mut self) {
        locked(&self.0.wait).is_dropped = true;
        self.0.changed.notify_all();
        let mut child = locked(&self.0.child);
        // Errors mean that the process has already ended.
        let _ = child.kill();
        let _ = child.wait();
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::Read;
    use std::process::{Command, Stdio};

    /// A process that writes a byte and then nothing.
    fn silent() -> Child {
        let mut command = Command::new("sh");
        command.args(["-c", "printf x; exec sleep 1000"]).stdout(Stdio::piped()).spawn().expect("a shell")
    }

    #[test]
    fn a_process_that_stops_within_a_frame_is_ended() {
        let mut child = silent();
        let mut output = child.stdout.take().unwrap();
        let watched = Watched::new(child, Duration::from_millis(50));
        watched.begin();
        let mut bytes = Vec::new();
        // It would last a thousand seconds.
        output.read_to_end(&mut bytes).unwrap();
        assert!(watched.end() && bytes == b"x");
        assert!(!watched.ended().unwrap().success());
    }

    #[test]
    fn a_process_that_does_not_end_is_ended() {
        let watched = Watched::new(silent(), Duration::from_millis(50));
        watched.begin();
        assert!(!watched.ended().unwrap().success());
        assert!(watched.end());
    }

    #[test]
    fn a_process_is_not_ended_while_nobody_waits_for_it() {
        let watched = Watched::new(silent(), Duration::from_millis(20));
        watched.begin();
        assert!(!watched.end());
        std::thread::sleep(Duration::from_millis(200));
        assert!(locked(&watched.0.child).try_wait().unwrap().is_none(), "it was ended");
        assert!(!watched.end());
    }
}
