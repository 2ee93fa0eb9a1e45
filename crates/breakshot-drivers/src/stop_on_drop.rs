//! A run that is dropped or panics while the arm moves stops the arm.

use crate::robot::arm::Stop;
use crate::robot::driver::Robot;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{sleep, timeout};

/// Time limit of a stop whose run has gone.
pub(crate) const LAST_STOP: Duration = Duration::from_secs(1);

/// Stops the arm when it is dropped, unless it was released before.
pub(crate) struct StopOnDrop(Option<Arc<Robot>>);

impl StopOnDrop {
    pub(crate) fn new(robot: &Arc<Robot>) -> Self {
        Self(Some(Arc::clone(robot)))
    }

    /// The run goes on and stops the arm itself if it must.
    pub(crate) fn release(mut self) {
        self.0 = None;
    }
}

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        if let Some(robot) = self.0.take()
            && let Ok(runtime) = tokio::runtime::Handle::try_current()
        {
            runtime.spawn(async move {
                // Nothing is left that could handle an error.
                let _ = timeout(LAST_STOP / 2, robot.stop(Stop::Smooth)).await;
                // The connection is kept until its messages have left.
                sleep(LAST_STOP / 4).await;
            });
        }
    }
}
