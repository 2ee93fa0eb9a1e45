//! An answer, with the headers that keep the page closed.

use std::io::{Result, Write};
use std::sync::mpsc::Receiver;

/// What the browser may load and run: this server's own files, no script or style within a page, nothing from elsewhere.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What a request gets: one answer, or server-sent events until their sender is dropped.
pub(crate) enum Answer {
    Once(Response),
    Events(Receiver<String>),
}

impl From<Response> for Answer {
    fn from(response: Response) -> Self {
        Self::Once(response)
    }
}

/// An answer to a request.
#[derive(Debug)]
pub(crate) struct Response {
    pub(crate) status: u16,
    kind: &'static str,
    /// A header of its own: a cookie to be set, the time of a frame.
    extra: Option<(&'static str, String)>,
    pub(crate) body: Vec<u8>,
}

impl Response {
    pub(crate) fn new(kind: &'static str, body: Vec<u8>) -> Self {
        Self { status: 200, kind, extra: None, body }
    }

    /// A value as JSON.
    pub(crate) fn json(value: &impl serde::Serialize) -> Self {
        match serde_json::to_vec(value) {
            Ok(body) => Self::new("application/json", body),
            Err(error) => Self::refusal(500, &error.to_string()),
        }
    }

    /// A refusal, as JSON with the reason.
    pub(crate) fn refusal(status: u16, reason: &str) -> Self {
        let body = serde_json::json!({ "error": reason }).to_string().into_bytes();
        Self { status, ..Self::new("application/json", body) }
    }

    pub(crate) fn with(self, name: &'static str, value: String) -> Self {
        Self { extra: Some((name, value)), ..self }
    }

    /// Writes the answer; `is_last` announces the end of the connection.
    pub(crate) fn write(&self, to: &mut impl Write, is_last: bool) -> Result<()> {
        let mut bytes = head(self.status, self.kind).into_bytes();
        if let Some((name, value)) = &self.extra {
            write!(bytes, "{name}: {value}\r\n")?;
        }
        write!(bytes, "Content-Length: {}\r\n", self.body.len())?;
        bytes.extend_from_slice(if is_last { b"Connection: close\r\n\r\n" } else { b"\r\n" });
        bytes.extend_from_slice(&self.body);
        to.write_all(&bytes)
    }
}

/// The head of a stream of server-sent events, which ends with the connection.
pub(crate) fn event_stream_head() -> String {
    head(200, "text/event-stream") + "Connection: close\r\n\r\n"
}

fn head(status: u16, kind: &str) -> String {
    format!(
        "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Security-Policy: {POLICY}\r\nX-Content-Type-Options: nosniff\r\n\
         X-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Opener-Policy: same-origin\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\nCache-Control: no-store\r\n",
        phrase(status)
    )
}

fn phrase(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        401 => "Unauthorized",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        409 => "Conflict",
        411 => "Length Required",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        422 => "Unprocessable Content",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        505 => "HTTP Version Not Supported",
        _ => "Internal Server Error",
    }
}
