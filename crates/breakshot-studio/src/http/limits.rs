//! The bounds of the server.

use std::time::Duration;

/// Longest request line and headers together (bytes).
pub(crate) const MOST_HEAD_BYTES: usize = 16 << 10;
/// Most headers of a request.
pub(crate) const MOST_HEADERS: usize = 64;
/// Longest body (bytes): a pile of a thousand objects has a tenth of it.
pub(crate) const MOST_BODY_BYTES: usize = 1 << 20;
/// Where films are received, ...
pub(crate) const UPLOAD_PATH: &str = "/api/upload";
/// ... and the largest one (bytes): it is written as it arrives.
pub(crate) const MOST_UPLOAD_BYTES: u64 = 4 << 30;
/// Time for the head of a request, from its first byte on.
pub(crate) const HEAD_TIME: Duration = Duration::from_secs(5);
/// Time for the body of a request; of a film, for its next piece.
pub(crate) const BODY_TIME: Duration = Duration::from_secs(10);
/// Time for a connection to wait for its next request.
pub(crate) const IDLE_TIME: Duration = Duration::from_secs(30);
/// Time for one write: a page that does not read its answer is disconnected.
pub(crate) const WRITE_TIME: Duration = Duration::from_secs(10);
/// Most connections at a time; the oldest that has shown no cookie makes room for the next one.
pub(crate) const MOST_CONNECTIONS: usize = 96;
/// Longest wait for what still arrives after a refusal.
pub(crate) const LINGER_TIME: Duration = Duration::from_millis(200);
/// Most reads of what still arrives after a refusal, of 8 KiB each.
pub(crate) const MOST_LINGERED_READS: usize = 32;
