//! Requests that do not come from the page: each is refused, and the server lives on.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod server;

use server::{Session, TestServer};
use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// The status of the answer to these bytes; 0 where the connection ends without one.
fn status(server: &TestServer, bytes: &[u8]) -> u16 {
    let mut stream = server.connect();
    let _ = stream.write_all(bytes);
    let _ = stream.shutdown(Shutdown::Write);
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let text = String::from_utf8_lossy(&answer);
    text.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0)
}

/// A head with these lines after the first; `HOST` is the name of the server, `COOKIE` that of an open session.
fn request(session: &Session, first: &str, lines: &[&str]) -> Vec<u8> {
    let named = |line: &&str| line.replace("HOST", &session.host()).replace("COOKIE", &session.cookie);
    let lines: Vec<String> =
        std::iter::once(format!("{first} HTTP/1.1")).chain(lines.iter().map(named)).collect();
    (lines.join("\r\n") + "\r\n\r\n").into_bytes()
}

const NAMED: [&str; 2] = ["Host: HOST", "Cookie: COOKIE"];

#[test]
fn only_the_page_of_this_server_may_ask() {
    let server = TestServer::start();
    let session = server.session();
    let project = "GET /api/project";
    assert_eq!(status(&server, &request(&session, project, &NAMED)), 200, "the page itself");
    let own = ["Host: HOST", "Cookie: COOKIE", "Origin: http://HOST"];
    assert_eq!(status(&server, &request(&session, project, &own)), 200, "the page itself, with its origin");
    let cases: [(&str, &[&str], u16); 16] = [
        ("no host", &["Cookie: COOKIE"], 403),
        ("a foreign host", &["Host: example.org", "Cookie: COOKIE"], 403),
        ("a name that resolves to this machine", &["Host: evil.example:80", "Cookie: COOKIE"], 403),
        ("another port", &["Host: 127.0.0.1:1", "Cookie: COOKIE"], 403),
        ("no port", &["Host: 127.0.0.1", "Cookie: COOKIE"], 403),
        ("two hosts", &["Host: HOST", "Host: example.org", "Cookie: COOKIE"], 400),
        ("a foreign origin", &["Host: HOST", "Cookie: COOKIE", "Origin: http://example.org"], 403),
        ("the origin of a file", &["Host: HOST", "Cookie: COOKIE", "Origin: null"], 403),
        ("the origin of the other name", &["Host: HOST", "Cookie: COOKIE", "Origin: https://HOST"], 403),
        ("another site", &["Host: HOST", "Cookie: COOKIE", "Sec-Fetch-Site: cross-site"], 403),
        ("another port of this machine", &["Host: HOST", "Cookie: COOKIE", "Sec-Fetch-Site: same-site"], 403),
        (
            "a link to what is not the page",
            &["Host: HOST", "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate"],
            403,
        ),
        ("no cookie", &["Host: HOST"], 401),
        ("an empty cookie", &["Host: HOST", "Cookie: "], 401),
        ("another cookie", &["Host: HOST", "Cookie: breakshot=1; a=b"], 401),
        ("a cookie that is cut", &["Host: HOST", "Cookie: CUT"], 401),
    ];
    for (what, lines, wanted) in cases {
        let cut = session.cookie[..session.cookie.len() - 1].to_owned();
        let lines: Vec<String> = lines.iter().map(|line| line.replace("CUT", &cut)).collect();
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        assert_eq!(status(&server, &request(&session, project, &lines)), wanted, "{what}");
    }
    assert_eq!(session.get("/api/project").0, 200);
}

#[test]
fn a_token_opens_one_session_and_none_from_a_query() {
    let server = TestServer::start();
    let token = server.token();
    let host = server.host();
    let try_with = |path: &str, origin: &str, body: &str| {
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: {host}\r\nOrigin: {origin}\r\nContent-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        );
        status(&server, head.as_bytes())
    };
    let (own, body) = (format!("http://{host}"), format!(r#"{{"token":"{token}"}}"#));
    assert_eq!(try_with(&format!("/session?token={token}"), &own, "{}"), 403, "a token in the query");
    assert_eq!(try_with("/session", "http://example.org", &body), 403, "from another page");
    assert_eq!(try_with("/session", &own, r#"{"token":""}"#), 403, "an empty token");
    assert_eq!(try_with("/session", &own, &body.to_uppercase()), 403, "another token");
    let get = format!("GET /session?token={token} HTTP/1.1\r\nHost: {host}\r\n\r\n");
    assert_eq!(status(&server, get.as_bytes()), 401, "a GET changes nothing");
    assert_eq!(try_with("/session", &own, &body), 200, "the page");
    assert_eq!(try_with("/session", &own, &body), 403, "the token a second time");
}

#[test]
fn a_post_needs_an_origin_and_json() {
    let server = TestServer::start();
    let session = server.session();
    let post = |lines: &[&str]| {
        let all = [&["Host: HOST", "Cookie: COOKIE", "Content-Length: 0"][..], lines].concat();
        status(&server, &request(&session, "POST /api/save", &all))
    };
    assert_eq!(post(&["Content-Type: application/json"]), 403, "no origin");
    assert_eq!(post(&["Origin: http://HOST"]), 415, "no media type");
    assert_eq!(post(&["Origin: http://HOST", "Content-Type: text/plain"]), 415, "that of a form");
    assert_eq!(post(&["Origin: http://HOST", "Content-Type: application/json"]), 400, "an empty question");
    // What changes something has no answer to a GET.
    for path in ["/api/save", "/api/motion", "/api/jobs/1/cancel", "/session"] {
        assert_eq!(session.get(path).0, 404, "{path}");
    }
}

#[test]
fn no_path_leads_out_of_the_folder() {
    let server = TestServer::start();
    let session = server.session();
    std::fs::write(server.outside().join("secret.toml"), "cell = 'a'").unwrap();
    #[cfg(unix)]
    {
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(server.outside().join(to), server.folder().join(name)).unwrap();
        };
        link("secret.toml", "link.toml");
        link("", "up");
    }
    for path in [
        "/../secret.toml",
        "/..%2fsecret.toml",
        "/%2e%2e/secret.toml",
        "/a/../../x",
        "//etc/passwd",
        "/\\..\\x",
        "/%00",
    ] {
        let found = status(&server, &request(&session, &format!("GET {path}"), &NAMED));
        assert!((400..=404).contains(&found), "{path}: {found}");
    }
    let names = [
        "../secret.toml",
        "..%2fsecret.toml",
        "%2e%2e%2fsecret.toml",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "link.toml",
        "up/secret.toml",
        ".hidden",
        "a%00.toml",
        "pile.scene.toml%00.png",
        "sub/../../secret.toml",
        "C:%5Csecret",
        "%c0%ae%c0%ae/secret.toml",
        "",
    ];
    for route in ["scene", "plan", "strike"] {
        for name in names {
            let (found, answer) = session.get(&format!("/api/{route}?file={name}"));
            assert!((400..=422).contains(&found), "{route} {name}: {found} {answer}");
        }
    }
    for output in
        ["../out.json", "/tmp/out.json", "up/out.json", "link.json/../../x.json", ".x.json", "a\u{0}.json"]
    {
        let question = serde_json::json!({ "strike": server::strike(), "output": output });
        let (found, answer) = session.post("/api/strike", &question);
        assert!((400..=422).contains(&found), "{output}: {found} {answer}");
    }
    // A scene of the project that names files elsewhere is not read.
    for cell in ["../cell.toml", "/etc/passwd", "up/cell.toml", "link.toml"] {
        let scene = format!("cell = \"{cell}\"\nobjects = \"objects.toml\"\n");
        std::fs::write(server.folder().join("bad.scene.toml"), scene).unwrap();
        let (found, answer) = session.get("/api/scene?file=bad.scene.toml");
        assert!(found == 422 && !answer.contains("root:"), "{cell}: {found} {answer}");
    }
    let written: Vec<_> = server.outside().read_dir().unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(written.len(), 2, "{written:?}");
    assert_eq!(session.get("/api/scene?file=pile.scene.toml").0, 200);
}

#[test]
fn lying_lengths_and_giant_bodies_are_refused() {
    let server = TestServer::start();
    let session = server.session();
    let post = |lines: &[&str], body: &[u8]| {
        let named = ["Host: HOST", "Cookie: COOKIE", "Origin: http://HOST", "Content-Type: application/json"];
        let mut bytes = request(&session, "POST /api/motion", &[&named[..], lines].concat());
        bytes.extend_from_slice(body);
        status(&server, &bytes)
    };
    assert_eq!(post(&["Content-Length: 2147483648"], b"{}"), 413, "two gigabytes");
    assert_eq!(post(&["Content-Length: 18446744073709551616"], b"{}"), 413, "more than a number holds");
    assert_eq!(post(&["Content-Length: -2"], b"{}"), 400, "a negative length");
    assert_eq!(post(&["Content-Length: 2", "Content-Length: 4"], b"{}"), 400, "two lengths");
    assert_eq!(post(&["Content-Length: 0x2"], b"{}"), 400, "a length in hexadecimal");
    assert_eq!(post(&["Transfer-Encoding: chunked"], b"2\r\n{}\r\n0\r\n\r\n"), 411, "chunks");
    assert_eq!(post(&["Expect: 100-continue", "Content-Length: 2"], b"{}"), 411, "an expectation");
    assert_eq!(post(&["Content-Length: 100"], b"{}"), 0, "less than was said");
    assert_eq!(post(&["Content-Length: 1"], b"{}"), 400, "more than was said");
    assert_eq!(post(&["Content-Length: 1000000"], &vec![b'['; 1_000_000]), 400, "a million brackets");
    let long = format!("X: {}", "x".repeat(20_000));
    assert_eq!(status(&server, &request(&session, "GET /", &["Host: HOST", &long])), 431, "a long header");
    let many: Vec<String> = (0..200).map(|k| format!("X{k}: 1")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    assert_eq!(status(&server, &request(&session, "GET /", &many)), 431, "many headers");
    for bytes in [
        &b"\0\0\0\0\r\n\r\n"[..],
        b"\x16\x03\x01\x02\0\x01\0\x01\xfc",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\n",
    ] {
        let found = status(&server, bytes);
        assert!(found == 0 || (400..=505).contains(&found), "{bytes:?}: {found}");
    }
    assert_eq!(session.get("/api/project").0, 200);
}

#[test]
fn questions_that_are_wrong_are_refused_and_none_stops_the_server() {
    let server = TestServer::start();
    let session = server.session();
    let pile = serde_json::json!({ "scene": "pile.scene.toml" });
    let strike = server::strike();
    let ask = |path: &str, question: serde_json::Value| session.post(path, &question);
    let motion = |strike: &serde_json::Value| {
        let pile = pile.clone();
        ask(
            "/api/motion",
            serde_json::json!({ "pile": pile, "properties": "properties.json", "strike": strike }),
        )
    };
    assert_eq!(motion(&strike).0, 200);
    for (key, value) in [
        ("speed_m_s", serde_json::json!(1e300)),
        ("speed_m_s", serde_json::json!(-1)),
        ("travel_m", serde_json::json!(0)),
        ("start_m", serde_json::json!([null, 0])),
        ("heading_rad", serde_json::json!("east")),
        ("unknown", serde_json::json!(1)),
    ] {
        let mut bad = strike.clone();
        bad[key] = value.clone();
        let (found, answer) = motion(&bad);
        assert!(found == 422 || found == 400, "{key} {value}: {found} {answer}");
    }
    let many: Vec<_> =
        (0..2000).map(|k| serde_json::json!({ "object": format!("a#{k}"), "position_m": [0, 0] })).collect();
    let crowded = serde_json::json!({ "scene": "pile.scene.toml", "placed": many });
    assert_eq!(
        ask("/api/settle", serde_json::json!({ "pile": crowded, "object": "a", "to": [0, 0, 0] })).0,
        422
    );
    let cloud = |worlds: u64| serde_json::json!({ "pile": pile, "properties": "properties.json", "strike": strike, "worlds": worlds });
    assert_eq!(ask("/api/cloud", cloud(1_000_000_000)).0, 422, "more worlds than a plan has");
    assert_eq!(ask("/api/cloud", cloud(60)).0, 200);
    assert_eq!(ask("/api/jobs/77/cancel", serde_json::json!({})).0, 404);
    assert_eq!(ask("/api/jobs/x/cancel", serde_json::json!({})).0, 404);
    assert_eq!(session.get("/api/jobs/18446744073709551616/events").0, 404);
}

#[test]
fn slow_and_very_many_connections_do_not_keep_the_page_out() {
    let server = TestServer::start();
    let session = server.session();
    // Two hundred connections of which each sends half a head.
    let mut slow: Vec<TcpStream> = (0..200).filter_map(|_| server.try_connect()).collect();
    for stream in &mut slow {
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nHost:");
    }
    let asked = Instant::now();
    assert_eq!(session.get("/api/project").0, 200);
    assert!(asked.elapsed() < Duration::from_secs(2), "{:?}", asked.elapsed());
    // A thousand at once.
    let answered: usize = std::thread::scope(|scope| {
        let ask = || {
            (0..50)
                .filter(|_| status(&server, b"GET /api/project HTTP/1.1\r\nHost: a\r\n\r\n") == 403)
                .count()
        };
        let threads: Vec<_> = (0..20).map(|_| scope.spawn(ask)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).sum()
    });
    assert!(answered > 0, "none of a thousand was answered");
    assert_eq!(session.get("/api/project").0, 200);
    // A head that takes too long is ended.
    let mut last = server.connect();
    last.write_all(b"GET / HTTP/1.1\r\n").unwrap();
    let mut answer = String::new();
    let started = Instant::now();
    let _ = last.read_to_string(&mut answer);
    assert!(answer.starts_with("HTTP/1.1 408") && started.elapsed() < Duration::from_secs(9), "{answer}");
    drop(slow);
    assert_eq!(session.get("/api/project").0, 200);
    #[cfg(target_os = "linux")]
    {
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let peak = status.lines().find(|line| line.starts_with("VmHWM")).unwrap();
        let kib: u64 = peak.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(kib < 300 << 10, "{peak}");
    }
}

#[test]
fn every_answer_forbids_what_the_page_does_not_need() {
    let server = TestServer::start();
    let session = server.session();
    for path in ["/", "/app.js", "/api/project", "/none"] {
        let answer = session.whole_answer(path).to_ascii_lowercase();
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
            "cross-origin-resource-policy: same-origin",
            "cache-control: no-store",
        ] {
            assert!(answer.contains(line), "{path}: no {line}");
        }
        assert!(!answer.contains("unsafe") && !answer.contains("access-control-allow"), "{path}");
    }
    assert!(session.set_cookie.contains("HttpOnly; SameSite=Strict; Path=/"), "{}", session.set_cookie);
    let page = session.get("/").1;
    assert!(
        !page.contains("<script>")
            && !page.contains("style=")
            && !page.contains("http://")
            && !page.contains("https://")
    );
}
