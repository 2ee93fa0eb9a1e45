//! Reads one request from a connection, within the bounds.

use super::limits::{
    BODY_TIME, HEAD_TIME, IDLE_TIME, MOST_BODY_BYTES, MOST_HEAD_BYTES, MOST_HEADERS, MOST_UPLOAD_BYTES,
    UPLOAD_PATH,
};
use super::response::Response;
use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The methods that the page uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Method {
    Get,
    Post,
}

/// A request, complete and within the bounds.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) method: Method,
    /// The path, not decoded: no path of the page needs an escape.
    pub(crate) path: String,
    /// The fields after `?`, decoded.
    pub(crate) query: Vec<(String, String)>,
    headers: Vec<(String, String)>,
    pub(crate) body: Vec<u8>,
    /// The length of a film, whose bytes are still to be read (bytes); none for other requests.
    pub(crate) film_bytes: Option<u64>,
}

impl Request {
    /// The header of this name, in lower case.
    pub(crate) fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// The field of the query.
    pub(crate) fn field(&self, name: &str) -> Option<&str> {
        self.query.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Whether the connection ends after this request.
    pub(crate) fn is_last(&self) -> bool {
        self.header("connection").is_some_and(|value| value.eq_ignore_ascii_case("close"))
    }
}

/// Why there is no request.
pub(crate) enum NoRequest {
    /// The connection has ended, or nothing came in time.
    Ended,
    /// It is refused.
    Refused(Response),
}

/// Why bytes were not copied.
pub(crate) enum NotCopied {
    /// They did not come.
    Unread(NoRequest),
    /// They cannot be written.
    Unwritten(std::io::Error),
}

impl From<NoRequest> for NotCopied {
    fn from(reason: NoRequest) -> Self {
        Self::Unread(reason)
    }
}

fn refused(status: u16, reason: &str) -> NoRequest {
    NoRequest::Refused(Response::refusal(status, reason))
}

/// Reads requests from one connection; bytes after a request belong to the next one.
pub(crate) struct Reader {
    stream: TcpStream,
    buffer: Vec<u8>,
}

impl Reader {
    pub(crate) fn new(stream: TcpStream) -> Self {
        Self { stream, buffer: Vec::new() }
    }

    /// The next request.
    pub(crate) fn next(&mut self) -> Result<Request, NoRequest> {
        let idle = self.buffer.is_empty();
        if idle && self.fill(Instant::now() + IDLE_TIME).is_err() {
            return Err(NoRequest::Ended);
        }
        let until = Instant::now() + HEAD_TIME;
        loop {
            if let Some(length) = head_length(&self.buffer) {
                let (mut request, body_bytes) = parsed(&self.buffer[..length])?;
                self.buffer.drain(..length);
                match request.film_bytes {
                    Some(_) => {}
                    None => request.body = self.body(body_bytes)?,
                }
                return Ok(request);
            }
            if self.buffer.len() > MOST_HEAD_BYTES {
                return Err(refused(431, "the headers are too long"));
            }
            self.fill(until)?;
        }
    }

    /// Writes the next bytes of the connection as they arrive.
    pub(crate) fn copy(&mut self, length: u64, to: &mut dyn Write) -> Result<(), NotCopied> {
        let mut left = length;
        while left > 0 {
            if self.buffer.is_empty() {
                self.fill(Instant::now() + BODY_TIME)?;
            }
            let count = self.buffer.len().min(usize::try_from(left).unwrap_or(usize::MAX));
            to.write_all(&self.buffer[..count]).map_err(NotCopied::Unwritten)?;
            self.buffer.drain(..count);
            left -= count as u64;
        }
        Ok(())
    }

    fn body(&mut self, length: usize) -> Result<Vec<u8>, NoRequest> {
        let until = Instant::now() + BODY_TIME;
        while self.buffer.len() < length {
            self.fill(until)?;
        }
        let rest = self.buffer.split_off(length);
        Ok(std::mem::replace(&mut self.buffer, rest))
    }

    /// Waits for more bytes until a point in time.
    fn fill(&mut self, until: Instant) -> Result<(), NoRequest> {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(refused(408, "the request takes too long"));
        }
        // A timeout of zero would wait forever.
        let _ = self.stream.set_read_timeout(Some(left.max(Duration::from_millis(1))));
        let mut bytes = [0; 8192];
        match self.stream.read(&mut bytes) {
            Ok(0) => Err(NoRequest::Ended),
            Ok(count) => {
                self.buffer.extend_from_slice(&bytes[..count]);
                Ok(())
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => Ok(()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                Err(refused(408, "the request takes too long"))
            }
            Err(_) => Err(NoRequest::Ended),
        }
    }
}

/// The length of the head, with the empty line that ends it; none before that has arrived.
fn head_length(bytes: &[u8]) -> Option<usize> {
    let searched = &bytes[..bytes.len().min(MOST_HEAD_BYTES)];
    searched.windows(4).position(|four| four == b"\r\n\r\n").map(|at| at + 4)
}

/// A head as a request without a body, and the length of its body.
fn parsed(head: &[u8]) -> Result<(Request, usize), NoRequest> {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut raw = httparse::Request::new(&mut headers);
    match raw.parse(head) {
        Ok(httparse::Status::Complete(_)) => {}
        Err(httparse::Error::TooManyHeaders) => return Err(refused(431, "too many headers")),
        _ => return Err(refused(400, "not a request of HTTP/1.1")),
    }
    if raw.version != Some(1) {
        return Err(refused(505, "only HTTP/1.1 is spoken here"));
    }
    let method = match raw.method {
        Some("GET") => Method::Get,
        Some("POST") => Method::Post,
        _ => return Err(refused(405, "only GET and POST are known here")),
    };
    let mut known = Vec::new();
    for header in raw.headers.iter() {
        let value = std::str::from_utf8(header.value).map_err(|_| refused(400, "a header is not text"))?;
        let name = header.name.to_ascii_lowercase();
        let is_single =
            ["host", "origin", "content-length", "content-type", "cookie"].contains(&name.as_str());
        if is_single && known.iter().any(|(given, _)| *given == name) {
            return Err(refused(400, "a header is given twice"));
        }
        known.push((name, value.trim().to_owned()));
    }
    let target = raw.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    if !path.starts_with('/') || path.contains(['%', '\\', '#']) || path.split('/').any(|part| part == "..") {
        return Err(refused(400, "no such path"));
    }
    let query = fields(query).ok_or_else(|| refused(400, "the query is not text"))?;
    let mut request =
        Request { method, path: path.to_owned(), query, headers: known, body: Vec::new(), film_bytes: None };
    if method == Method::Post && path == UPLOAD_PATH {
        request.film_bytes = Some(body_length(&request, MOST_UPLOAD_BYTES)?);
        return Ok((request, 0));
    }
    let length = body_length(&request, MOST_BODY_BYTES as u64)?;
    // At most `MOST_BODY_BYTES`, which a `usize` holds.
    Ok((request, usize::try_from(length).unwrap_or(MOST_BODY_BYTES)))
}

/// The status with which a head is refused; `None` if it is accepted.
#[cfg(feature = "fuzzing")]
pub(crate) fn refusal(head: &[u8]) -> Option<u16> {
    match parsed(head) {
        Ok(_) => None,
        Err(NoRequest::Refused(response)) => Some(response.status),
        Err(NoRequest::Ended) => Some(0),
    }
}

/// The length of a body of at most so many bytes.
fn body_length(request: &Request, most_bytes: u64) -> Result<u64, NoRequest> {
    if request.header("transfer-encoding").is_some() || request.header("expect").is_some() {
        return Err(refused(411, "a body needs its length"));
    }
    let Some(length) = request.header("content-length") else { return Ok(0) };
    let is_number = !length.is_empty() && length.bytes().all(|b| b.is_ascii_digit());
    match length.parse::<u64>() {
        Ok(length) if is_number && length <= most_bytes => Ok(length),
        _ if is_number => Err(refused(413, "the body is too long")),
        _ => Err(refused(400, "the length is no number")),
    }
}

/// The fields of a query, decoded; none if it is not text.
fn fields(query: &str) -> Option<Vec<(String, String)>> {
    let field = |field: &str| {
        let (name, value) = field.split_once('=').unwrap_or((field, ""));
        Some((decoded(name)?, decoded(value)?))
    };
    query.split('&').filter(|field| !field.is_empty()).map(field).collect()
}

/// Text with its escapes (`%2F`, `+`) resolved; none for a damaged escape, for control characters and for what is not UTF-8.
fn decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digit = |byte: Option<u8>| char::from(byte?).to_digit(16);
                let (high, low) = (digit(rest.next())?, digit(rest.next())?);
                u8::try_from(16 * high + low).ok()?
            }
            b'+' => b' ',
            byte => byte,
        });
    }
    String::from_utf8(bytes).ok().filter(|text| !text.contains(char::is_control))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(head: &str) -> u16 {
        match parsed(head.as_bytes()) {
            Ok(_) => 200,
            Err(NoRequest::Refused(response)) => response.status,
            Err(NoRequest::Ended) => 0,
        }
    }

    #[test]
    fn a_request_is_read_with_its_fields() {
        let head = "GET /api/frame?clip=a%20b.mp4&k=3 HTTP/1.1\r\nHost: localhost\r\nX-A: 1\r\n\r\n";
        let Ok((request, 0)) = parsed(head.as_bytes()) else { panic!("refused") };
        assert_eq!((request.method, request.path.as_str()), (Method::Get, "/api/frame"));
        assert_eq!((request.field("clip"), request.field("k")), (Some("a b.mp4"), Some("3")));
        assert_eq!((request.header("x-a"), request.header("cookie")), (Some("1"), None));
    }

    #[test]
    fn what_the_page_never_sends_is_refused() {
        for (head, wanted) in [
            ("GET / HTTP/1.1\r\n\r\n", 200),
            ("GET / HTTP/1.0\r\n\r\n", 505),
            ("PUT / HTTP/1.1\r\n\r\n", 405),
            ("GET http://127.0.0.1/ HTTP/1.1\r\n\r\n", 400),
            ("GET /../etc/passwd HTTP/1.1\r\n\r\n", 400),
            ("GET /..%2fetc HTTP/1.1\r\n\r\n", 400),
            ("GET /a?b=%00 HTTP/1.1\r\n\r\n", 400),
            ("GET /a?b=%zz HTTP/1.1\r\n\r\n", 400),
            ("GET /\0 HTTP/1.1\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: +1\r\n\r\n", 400),
            ("POST / HTTP/1.1\r\nContent-Length: 2147483648\r\n\r\n", 413),
            ("POST / HTTP/1.1\r\nContent-Length: 99999999999999999999999999\r\n\r\n", 413),
            ("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 411),
            ("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n", 400),
        ] {
            assert_eq!(status(head), wanted, "{head:?}");
        }
    }
}
