//! The user's wish to end a recording.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Becomes true on Ctrl-C, and where the system has them on SIGTERM and SIGHUP.
pub(super) fn interrupted() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    std::thread::spawn(move || {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_io().build() else { return };
        runtime.block_on(signal());
        raised.store(true, Ordering::Relaxed);
    });
    flag
}

async fn signal() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let kinds = [SignalKind::terminate(), SignalKind::hangup()];
        if let [Ok(mut end), Ok(mut hangup)] = kinds.map(signal) {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = end.recv() => {}
                _ = hangup.recv() => {}
            }
            return;
        }
    }
    // Without a handler the signal ends the program; the recording is then absent, not half.
    if tokio::signal::ctrl_c().await.is_err() {
        std::future::pending::<()>().await;
    }
}
