//! A studio that is killed while it estimates leaves whole files, and the next estimate continues from them.

#![cfg(unix)]
#![allow(clippy::unwrap_used, missing_docs)]

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// A running studio and the cookie of its session.
struct Studio {
    process: Child,
    host: String,
    cookie: String,
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Studio {
    fn start(folder: &Path) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
        command.args(["studio", "--no-open"]).arg(folder).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut process = command.spawn().unwrap();
        let mut lines = BufReader::new(process.stdout.take().unwrap()).lines();
        let link = lines.find_map(|line| line.unwrap().split("http://").nth(1).map(str::to_owned)).unwrap();
        let (host, token) = link.trim().split_once("/#").unwrap();
        let mut studio = Self { process, host: host.to_owned(), cookie: String::new() };
        let answer = studio.post("/session", &format!(r#"{{"token":"{token}"}}"#));
        let cookie = answer.lines().find_map(|line| line.strip_prefix("Set-Cookie: ")).unwrap();
        cookie.split(';').next().unwrap().clone_into(&mut studio.cookie);
        studio
    }

    fn exchange(&self, first: &str, lines: &str, body: &str) -> String {
        let mut stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_mins(2))).unwrap();
        let (host, cookie) = (&self.host, &self.cookie);
        let head = format!(
            "{first} HTTP/1.1\r\nHost: {host}\r\nCookie: {cookie}\r\n{lines}Connection: close\r\n\r\n{body}"
        );
        stream.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        let _ = stream.read_to_string(&mut answer);
        answer
    }

    fn post(&self, path: &str, body: &str) -> String {
        let lines = format!(
            "Origin: http://{}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n",
            self.host,
            body.len()
        );
        self.exchange(&format!("POST {path}"), &lines, body)
    }

    /// Starts the estimate and returns the path of its events.
    fn estimate(&self) -> String {
        let answer = self.post("/api/estimate", r#"{"campaign":"campaign.toml","output":"properties.json"}"#);
        let job = answer.split("\r\n\r\n").nth(1).unwrap().trim().to_owned();
        assert!(job.parse::<u64>().is_ok(), "{answer}");
        format!("/api/jobs/{job}/events")
    }
}

fn copy_of_demo(folder: &Path) {
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo");
    for entry in demo.read_dir().unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, folder.join(path.file_name().unwrap())).unwrap();
    }
}

/// All files below a folder with their times and sizes.
fn files(folder: &Path) -> BTreeMap<String, (SystemTime, u64)> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        if path.is_dir() {
            found.extend(files(&path).into_iter().map(|(inner, of)| (format!("{name}/{inner}"), of)));
        } else if let Ok(data) = entry.metadata() {
            // A file that is gone by now was one that had not got its name yet.
            found.insert(name, (data.modified().unwrap(), data.len()));
        }
    }
    found
}

/// The tracks that are there.
fn tracks(folder: &Path) -> BTreeMap<String, (SystemTime, u64)> {
    files(folder).into_iter().filter(|(name, _)| name.starts_with("tracks/") && !is_part(name)).collect()
}

/// Whether a file had not got its name yet when its program was killed: the next output in its folder removes it.
fn is_part(name: &str) -> bool {
    name.rsplit('/').next().is_some_and(|file| file.starts_with(".breakshot-"))
}

fn wait_for_tracks(folder: &Path, count: usize) {
    let since = Instant::now();
    while tracks(folder).len() < count {
        assert!(since.elapsed() < Duration::from_mins(5), "{count} tracks do not appear");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn assert_whole(folder: &Path, when: &str) {
    for name in files(folder).into_keys().filter(|name| !is_part(name)) {
        assert!(!name.split('/').any(|part| part.starts_with('.')), "{when}: {name} was left behind");
        if Path::new(&name).extension().is_some_and(|extension| extension == "json") {
            let text = fs::read_to_string(folder.join(&name)).unwrap();
            assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{when}: {name} is not whole");
        }
    }
}

#[test]
fn a_killed_estimate_leaves_whole_files_and_the_next_one_continues_from_them() {
    let [killed, whole] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let (killed, whole) = (killed.path(), whole.path());
    copy_of_demo(killed);
    copy_of_demo(whole);
    let inputs: Vec<String> = files(killed).into_keys().collect();

    // Killed before anything is written, after one file, in the middle, and shortly before and after the last one.
    for count in [0, 1, 5, 9, 11, 12] {
        let before = tracks(killed);
        let mut studio = Studio::start(killed);
        studio.estimate();
        wait_for_tracks(killed, count);
        studio.process.kill().unwrap();
        studio.process.wait().unwrap();
        let when = format!("killed after {count} files");
        assert_whole(killed, &when);
        let after = tracks(killed);
        assert!(after.len() >= count, "{when}");
        for (name, of) in &before {
            assert_eq!(after.get(name), Some(of), "{when}: the finished {name} was written again");
        }
    }
    let finished = tracks(killed);
    assert_eq!(finished.len(), 12);
    let studio = Studio::start(killed);
    let events = studio.estimate();
    let events = studio.exchange(&format!("GET {events}"), "", "");
    assert!(events.contains(r#""state":"done""#), "{events}");
    drop(studio);
    assert_eq!(tracks(killed), finished, "finished tracks were written again");
    assert_whole(killed, "in the end");
    let wanted = inputs.len() + finished.len() + 1;
    assert_eq!(files(killed).len(), wanted, "{:?}", files(killed).into_keys());

    // The command in another folder, never interrupted, writes the same bytes.
    let args = ["estimate", "campaign.toml", "--tracks", "tracks", "-o", "properties.json"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_breakshot"));
    let output = command.current_dir(whole).args(args).output().unwrap();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", String::from_utf8_lossy(&output.stderr));
    let same = |name: &str| fs::read(killed.join(name)).unwrap() == fs::read(whole.join(name)).unwrap();
    assert!(same("properties.json"), "the properties differ");
    for name in finished.keys() {
        assert!(same(name), "{name} differs");
    }
}
