//! Damaged tables of tracks: whatever is broken in them, reading ends with tracks or with an error that names the file.
//!
//! `cargo xtask fuzz tables [COUNT]` reads COUNT mutated tables and JSON files in turn with several descriptions of their columns.

use crate::splitmix::Draw;
use breakshot::cell::Workspace;
use breakshot::columns::{AngleUnit, Columns, LengthUnit, ObjectColumns, TimeUnit};
use breakshot::detect::{Recording, Track, Tracks, recorded_tracks};
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

/// Nothing takes longer than this, on a busy machine either.
const LONGEST: Duration = Duration::from_secs(2);
/// Nothing needs more memory than this (MB).
const MOST_MEMORY_MB: f64 = 300.0;

/// A readable file, and what its columns hold.
struct Readable {
    text: String,
    columns: Option<Columns>,
    frame_rate_hz: Option<f64>,
}

/// Reads mutated files; every one that panics or hangs, or whose error does not name it, is printed.
pub(crate) fn fuzz(count: usize) -> Result<(), String> {
    let corpus = corpus();
    for readable in &corpus {
        read(&readable.text, readable)?.map_err(|error| format!("the corpus is refused: {error}"))?;
    }
    let (mut draw, mut done, mut wrong) = (Draw::new(2), 0, Vec::new());
    let mut longest = Duration::ZERO;
    for _ in 0..count {
        let readable = &corpus[draw.below(corpus.len())];
        let bytes = mutated(readable.text.as_bytes(), &mut draw);
        let text = String::from_utf8_lossy(&bytes);
        let started = Instant::now();
        let found = catch_unwind(AssertUnwindSafe(|| read(&text, readable)));
        longest = longest.max(started.elapsed());
        match found {
            Err(_) => wrong.push(format!("panicked: {text:?}")),
            Ok(Err(problem)) => wrong.push(format!("{problem}: {text:?}")),
            Ok(Ok(Ok(()))) => done += 1,
            Ok(Ok(Err(_))) => {}
        }
    }
    let memory_mb = crate::process::peak_memory_mb().unwrap_or(f64::NAN);
    println!(
        "{count} mutated tables: {done} read, longest {:.3} s, {memory_mb:.0} MB",
        longest.as_secs_f64()
    );
    for line in &wrong {
        println!("BAD: {line}");
    }
    if !wrong.is_empty() || longest > LONGEST || memory_mb > MOST_MEMORY_MB {
        return Err(format!("{} of {count} tables went wrong", wrong.len()));
    }
    Ok(())
}

/// Reads a file: tracks, or an error in words; or what is wrong with either.
fn read(text: &str, readable: &Readable) -> Result<Result<(), String>, String> {
    let Readable { columns, frame_rate_hz, .. } = readable;
    let recording =
        Recording { name: "run.csv", text, columns: columns.as_ref(), frame_rate_hz: *frame_rate_hz };
    let names = ["a".to_owned(), "a#2".to_owned()];
    match recorded_tracks(&recording, &names, &Workspace::centred([1.0, 1.0])) {
        Err(error) if error.to_string().contains("run.csv") => Ok(Err(error.to_string())),
        Err(error) => Err(format!("the error `{error}` does not name the file")),
        Ok(tracks) if tracks.tracks.iter().all(is_sound) => Ok(Ok(())),
        Ok(_) => Err("tracks with numbers that are none, or times that do not grow".into()),
    }
}

fn is_sound(track: &Track) -> bool {
    let numbers = track.samples.iter().all(|s| {
        [s.time_s, s.x_m, s.y_m, s.yaw_rad.unwrap_or(0.0)].iter().all(|n| n.is_finite()) && s.std_m > 0.0
    });
    numbers
        && !track.samples.is_empty()
        && track.samples.windows(2).all(|pair| pair[0].time_s < pair[1].time_s)
}

/// Positions of two objects that slide, every tenth of a second.
fn corpus() -> Vec<Readable> {
    let (mut long, mut wide) =
        (String::from("object,time_s,x_m,y_m,yaw_rad,std_m\n"), String::from("t;\"x, one\";y1;w;x2;y2\n"));
    for k in 0..8 {
        let t = 0.1 * f64::from(k);
        let _ = writeln!(
            long,
            "a,{t:.2},{:.4},0.1,{:.2},1e-5\na#2,{t:.2},0.2,{:.4},,2e-5",
            0.3 * t,
            2.0 * t,
            0.1 * t
        );
        let _ = writeln!(
            wide,
            "{};{};100;{};{};5,5",
            1_700_000_000_000_u64 + 100 * k as u64,
            30.0 * t,
            40.0 * t,
            7.0 * t
        );
    }
    let name = |name: &str| Some(name.to_owned());
    let own = |x: &str, y: &str, yaw| ObjectColumns { x: x.into(), y: y.into(), yaw };
    let columns = Columns {
        time: name("t"),
        time_unit: TimeUnit::Ms,
        length_unit: LengthUnit::Mm,
        angle_unit: AngleUnit::Deg,
        objects: [("a".into(), own("x, one", "y1", name("w"))), ("a#2".into(), own("x2", "y2", None))].into(),
        ..Columns::default()
    };
    let untimed = Columns { time: None, ..columns.clone() };
    let recording = Recording { name: "run.csv", text: &long, columns: None, frame_rate_hz: None };
    let names = ["a".to_owned(), "a#2".to_owned()];
    let tracks = recorded_tracks(&recording, &names, &Workspace::centred([1.0, 1.0]))
        .unwrap_or_else(|_| Tracks::default());
    let json = serde_json::to_string(&tracks).unwrap_or_default();
    let readable =
        |text: &str, columns, frame_rate_hz| Readable { text: text.into(), columns, frame_rate_hz };
    vec![
        readable(&long, None, None),
        readable(&long, None, Some(240.0)),
        readable(&wide, Some(columns), None),
        readable(&wide, Some(untimed), Some(500.0)),
        readable(&json, None, None),
        readable(&json, None, Some(1e-3)),
    ]
}

/// The bytes with some changed, lost, doubled, or replaced by pieces that tables are made of.
fn mutated(bytes: &[u8], draw: &mut Draw) -> Vec<u8> {
    const PIECES: [&[u8]; 16] = [
        b",", b";", b"\n", b"\"", b"\"\"", b"-", b"1e308", b"nan", b"1e-320", b"a", b"#", b"\r\n", b"\xff",
        b"inf", b"0", b"{",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..=draw.below(3) {
        if bytes.is_empty() {
            break;
        }
        let at = draw.below(bytes.len());
        match draw.below(6) {
            0 => bytes[at] ^= 1 << draw.below(8),
            1 => drop(bytes.drain(at..(at + 1 + draw.below(12)).min(bytes.len()))),
            2 => {
                let part = bytes[at..(at + 1 + draw.below(40)).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            3 => bytes.truncate(at),
            _ => {
                let end = (at + draw.below(8)).min(bytes.len());
                bytes.splice(at..end, PIECES[draw.below(PIECES.len())].iter().copied());
            }
        }
    }
    bytes
}
