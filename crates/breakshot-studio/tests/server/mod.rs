//! The real server on a free port, for a project of its own, and a session with it.

#![allow(dead_code, reason = "each test file uses its own part of it")]

use breakshot_studio::Server;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A server and its project; both end with the test.
pub(crate) struct TestServer {
    folder: tempfile::TempDir,
    address: SocketAddr,
    token: String,
}

/// The pile of the demo, and properties like those that its films give.
const FILES: [(&str, &str); 4] = [
    ("cell.toml", include_str!("../../../../fixtures/demo/cell.toml")),
    ("objects.toml", include_str!("../../../../fixtures/demo/objects.toml")),
    ("pile.scene.toml", include_str!("../../../../fixtures/demo/pile.scene.toml")),
    ("properties.json", include_str!("properties.json")),
];

/// The strike of the demo.
pub(crate) fn strike() -> serde_json::Value {
    serde_json::from_str(include_str!("../../../../fixtures/demo/pile.strike.json")).unwrap()
}

impl TestServer {
    pub(crate) fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let project = folder.path().join("project");
        std::fs::create_dir(&project).unwrap();
        for (name, text) in FILES {
            std::fs::write(project.join(name), text).unwrap();
        }
        let server = Server::bind(&project, 0, &[("template.toml", "# A template.\n")]).unwrap();
        let (address, link) = (server.address(), server.link());
        std::thread::spawn(move || server.serve());
        let token = link.split_once('#').unwrap().1.to_owned();
        Self { folder, address, token }
    }

    /// The project's folder.
    pub(crate) fn folder(&self) -> PathBuf {
        self.outside().join("project")
    }

    /// The folder around it.
    pub(crate) fn outside(&self) -> &Path {
        self.folder.path()
    }

    pub(crate) fn token(&self) -> &str {
        &self.token
    }

    pub(crate) fn host(&self) -> String {
        self.address.to_string()
    }

    pub(crate) fn try_connect(&self) -> Option<TcpStream> {
        let stream = TcpStream::connect(self.address).ok()?;
        stream.set_read_timeout(Some(Duration::from_secs(30))).ok()?;
        Some(stream)
    }

    pub(crate) fn connect(&self) -> TcpStream {
        self.try_connect().unwrap()
    }

    /// Opens the session of the link.
    pub(crate) fn session(&self) -> Session {
        let body = format!(r#"{{"token":"{}"}}"#, self.token);
        let closed = Session { address: self.address, cookie: String::new(), set_cookie: String::new() };
        let answer = closed.exchange(&closed.post_head("/session", body.len()), body.as_bytes());
        let line = answer.lines().find_map(|line| line.strip_prefix("Set-Cookie: ")).unwrap();
        let cookie = line.split(';').next().unwrap().to_owned();
        Session { cookie, set_cookie: line.to_owned(), ..closed }
    }
}

/// What a page has: the cookie.
pub(crate) struct Session {
    address: SocketAddr,
    pub(crate) cookie: String,
    pub(crate) set_cookie: String,
}

impl Session {
    pub(crate) fn host(&self) -> String {
        self.address.to_string()
    }

    fn post_head(&self, path: &str, length: usize) -> String {
        let host = self.host();
        format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nCookie: {}\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\nConnection: close\r\n\r\n",
            self.cookie
        )
    }

    fn exchange(&self, head: &str, body: &[u8]) -> String {
        String::from_utf8_lossy(&self.exchange_bytes(head, body)).into_owned()
    }

    fn exchange_bytes(&self, head: &str, body: &[u8]) -> Vec<u8> {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_mins(1))).unwrap();
        stream.write_all(&[head.as_bytes(), body].concat()).unwrap();
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        answer
    }

    /// The answer to a GET, as it came.
    pub(crate) fn bytes(&self, path: &str) -> Vec<u8> {
        let (host, cookie) = (self.host(), &self.cookie);
        let head =
            format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\nConnection: close\r\n\r\n");
        self.exchange_bytes(&head, b"")
    }

    /// Head and body of the answer to a GET.
    pub(crate) fn whole_answer(&self, path: &str) -> String {
        String::from_utf8_lossy(&self.bytes(path)).into_owned()
    }

    /// Status and body of the answer to a GET.
    pub(crate) fn get(&self, path: &str) -> (u16, String) {
        parted(&self.whole_answer(path))
    }

    /// Status and body of the answer to a question.
    pub(crate) fn post(&self, path: &str, question: &serde_json::Value) -> (u16, String) {
        let body = question.to_string();
        parted(&self.exchange(&self.post_head(path, body.len()), body.as_bytes()))
    }
}

fn parted(answer: &str) -> (u16, String) {
    let (head, body) = answer.split_once("\r\n\r\n").unwrap_or((answer, ""));
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    (status, body.to_owned())
}
