//! Films of all kinds: luma and times equal those of ffmpeg, and a film that cannot be read is an error that names it.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use breakshot::capture::{Decoder, Footage, Frame, Pictures};
use splitmix::Draw;
use std::io::Write;
use std::path::{Path, PathBuf};

mod splitmix;

fn data(film: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/footage").join(film)
}

/// FNV-1a.
fn code(pixels: &[u8]) -> u64 {
    pixels.iter().fold(0xcbf2_9ce4_8422_2325, |code, &p| (code ^ u64::from(p)).wrapping_mul(0x0100_0000_01b3))
}

/// The number of frames, or the first error.
fn played(path: &Path) -> Result<usize, String> {
    let mut count = 0;
    for frame in Footage::open_with(path, Decoder::Builtin).map_err(|e| e.to_string())? {
        frame.map_err(|e| e.to_string())?;
        count += 1;
    }
    Ok(count)
}

/// Overwrites a file without truncating it first, which would make some file systems wait for the disk.
fn overwrite(path: &Path, bytes: &[u8]) {
    let mut file = std::fs::OpenOptions::new().write(true).create(true).truncate(false).open(path).unwrap();
    file.write_all(bytes).unwrap();
    file.set_len(bytes.len() as u64).unwrap();
}

/// Writes a file into a fresh folder and plays it.
fn played_bytes(name: &str, bytes: &[u8]) -> Result<usize, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    played(&path)
}

#[test]
fn luma_and_times_are_what_ffmpeg_decodes() {
    let listing = std::fs::read_to_string(data("luma.txt")).unwrap();
    let mut wanted = listing.lines().filter(|line| !line.starts_with('#')).peekable();
    while let Some(title) = wanted.next() {
        let (film, size) = title.split_once(' ').unwrap();
        let footage = Footage::open(&data(film)).unwrap();
        let [width, height] = footage.size_px();
        assert_eq!(format!("{width}x{height}"), size, "size of {film}");
        let count = footage.frame_count().unwrap();
        let frames: Vec<Frame> = footage.map(Result::unwrap).collect();
        assert_eq!(frames.len(), count, "frames of {film}");
        for (n, frame) in frames.iter().enumerate() {
            let line = wanted.next().unwrap_or_else(|| panic!("{film}: frame {n} is one too many"));
            let found = format!("{:.6} {:016x}", frame.time_s, code(&frame.image.pixels));
            assert_eq!(found, line, "{film}: time (s) and luma of frame {n}");
        }
        assert!(wanted.peek().is_none_or(|line| line.contains('x')), "{film}: only {count} frames came");
    }
}

#[test]
fn the_frames_that_others_refer_to_are_the_same_frames_and_fewer() {
    let mut skipped = 0;
    for film in ["b_frames.mp4", "edit_list.mp4", "gaps.mp4", "retimed.mp4", "turned_90.mp4", "baseline.mov"]
    {
        let all: Vec<Frame> =
            Footage::open_with(&data(film), Decoder::Builtin).unwrap().map(Result::unwrap).collect();
        let references = Footage::open_pictures(&data(film), Decoder::Auto, Pictures::References).unwrap();
        let references: Vec<Frame> = references.map(Result::unwrap).collect();
        let mut rest = all.iter();
        for frame in &references {
            let same = rest.find(|other| other.time_s.total_cmp(&frame.time_s).is_eq());
            assert!(same.is_some_and(|same| same.image == frame.image), "{film} at {} s", frame.time_s);
        }
        assert!(film != "baseline.mov" || references.len() == all.len(), "it holds references alone");
        assert!(film != "b_frames.mp4" || references.len() < all.len(), "no frame was skipped");
        skipped += all.len() - references.len();
    }
    assert!(skipped >= 8, "{skipped} frames were skipped");
}

#[test]
fn a_film_that_cannot_be_read_is_an_error_that_names_it() {
    for (film, named) in [
        ("h265.mp4", "H.265 (HEVC)"),
        ("ten_bit.mp4", "bit depth > 8"),
        ("full_colour.mp4", "non-4:2:0"),
        ("lossless.mp4", "lossless"),
        ("interlaced.mp4", "interlace"),
        ("motion_jpeg.mov", "Motion JPEG"),
        ("sound.mp4", "only sound"),
        ("make.sh", "a text file"),
        ("missing.mp4", "cannot be read"),
    ] {
        let message = Footage::open_with(&data(film), Decoder::Builtin).err().unwrap().to_string();
        assert!(
            message.contains(film) && message.contains(named) && message.contains("needed: "),
            "{film}: {message}"
        );
    }
    for (name, bytes, named) in [
        ("film.mp4", &b""[..], "an empty file"),
        ("film.mp4", b"this is a text\n", "a text file"),
        ("film.mp4", b"PK\x03\x04 and so on", "a ZIP archive"),
        ("film.png", b"\x1a\x45\xdf\xa3\xa3\x42\x86\x81", "a Matroska"),
    ] {
        let message = played_bytes(name, bytes).unwrap_err();
        assert!(message.contains(name) && message.contains(named), "{message}");
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn ffmpeg_decodes_the_codings_that_the_built_in_decoder_does_not() {
    for (film, count) in [
        ("h265.mp4", 3),
        ("ten_bit.mp4", 3),
        ("full_colour.mp4", 3),
        ("lossless.mp4", 3),
        ("motion_jpeg.mov", 3),
        // Each field is a frame.
        ("interlaced.mp4", 6),
    ] {
        let mut footage = Footage::open(&data(film)).unwrap();
        let frames: Vec<Frame> = footage.by_ref().map(Result::unwrap).collect();
        assert_eq!(frames.len(), count, "frames of {film}");
        for (n, frame) in frames.iter().enumerate() {
            let time_s = n as f64 / (20.0 * count as f64);
            assert!(
                (frame.time_s - time_s).abs() < 1e-6,
                "{film}: frame {n} at {} s, not {time_s}",
                frame.time_s
            );
            assert_eq!(frame.image.pixels.len(), frame.image.width * frame.image.height, "{film}");
            let (least, most) = (frame.image.pixels.iter().min(), frame.image.pixels.iter().max());
            assert!(least < Some(&80) && most > Some(&160), "{film}: grey levels {least:?} to {most:?}");
        }
        let interlaced = footage.warnings().iter().any(|w| w.contains("interlaced"));
        assert_eq!(interlaced, film.starts_with("interlaced"), "{film}: {:?}", footage.warnings());
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn ffmpeg_and_the_built_in_decoder_give_the_same_frames() {
    let listing = std::fs::read_to_string(data("luma.txt")).unwrap();
    // A name that `ffmpeg` writes into its log is no message about damage.
    let folder = tempfile::tempdir().unwrap();
    let concealing = folder.path().join("concealing x [error] ");
    std::fs::create_dir(&concealing).unwrap();
    // Only a title has an `x`, between width and height.
    let titles = listing.lines().filter(|line| !line.starts_with('#') && line.contains('x'));
    for film in titles.filter_map(|line| line.split(' ').next()) {
        let own: Vec<Frame> =
            Footage::open_with(&data(film), Decoder::Builtin).unwrap().map(Result::unwrap).collect();
        let copy = concealing.join(film);
        std::fs::copy(data(film), &copy).unwrap();
        let footage = Footage::open_with(&copy, Decoder::Ffmpeg).unwrap();
        let theirs: Vec<Frame> = footage.map(Result::unwrap).collect();
        assert_eq!(own.len(), theirs.len(), "{film}");
        for (own, their) in own.iter().zip(&theirs) {
            let (own_s, their_s) = (own.time_s, their.time_s);
            assert!((own_s - their_s).abs() < 1e-6, "{film}: {own_s} and {their_s} s");
            assert!(own.image == their.image, "{film}: other luma at {own_s} s");
        }
    }
}

#[test]
#[ignore = "needs ffmpeg"]
fn a_damaged_film_that_only_ffmpeg_decodes_is_an_error() {
    let mut bytes = std::fs::read(data("motion_jpeg.mov")).unwrap();
    let at = bytes.windows(4).position(|window| window == b"mdat").unwrap();
    bytes[at + 4..at + 300].fill(0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.mov");
    std::fs::write(&path, bytes).unwrap();
    let message =
        Footage::open(&path).map(|footage| footage.map(|frame| frame.map(|f| f.time_s)).collect::<Vec<_>>());
    let refused = match &message {
        Err(e) => e.to_string(),
        Ok(frames) => frames.iter().find_map(|f| f.as_ref().err()).map_or(String::new(), ToString::to_string),
    };
    assert!(refused.contains("film.mov") && refused.contains("ffmpeg"), "error: {message:?}");
}

#[test]
fn gaps_and_repeated_frames_are_warnings() {
    let warnings = |film: &str| {
        let mut footage = Footage::open(&data(film)).unwrap();
        footage.by_ref().for_each(|frame| drop(frame.unwrap()));
        footage.warnings().join("; ")
    };
    assert!(
        warnings("gaps.mp4").contains("3 frames are missing in 3 gaps"),
        "warnings: {}",
        warnings("gaps.mp4")
    );
    let retimed = warnings("retimed.mp4");
    assert!(
        retimed.contains("every second frame") && retimed.contains("from about 30 to 60"),
        "message: {retimed}"
    );
    assert_eq!(warnings("b_frames.mp4"), "");
    assert_eq!(warnings("ntsc.mp4"), "");
}

/// The film with the last `from` in it (the index is at its end) overwritten, patch by patch.
fn patched(film: &str, patches: &[(&[u8], &[u8])]) -> Vec<u8> {
    let mut bytes = std::fs::read(data(film)).unwrap();
    for (from, to) in patches {
        let at = bytes.windows(from.len()).rposition(|window| window == *from).unwrap();
        bytes[at..at + to.len()].copy_from_slice(to);
    }
    bytes
}

#[test]
fn a_damaged_index_is_an_error_that_names_the_damage() {
    let size = |width: u16, height: u16| [width.to_be_bytes(), height.to_be_bytes()].concat();
    for (patches, named) in [
        (&[(&b"moov"[..], &b"free"[..])][..], "no `moov` box"),
        (&[(b"stsz", b"free")], "`stbl` box has no `stsz`"),
        (&[(b"vide", b"soun")], "only sound"),
        (&[(b"ctts", b"free")], "time stamps that go back"),
        (&[(b"stsz\0\0\0\0\0\0\0\0\0\0\0\x0c", b"stsz\0\0\0\0\0\0\0\0\0\0\0\0")], "0 frames"),
        (
            &[(b"stsz\0\0\0\0\0\0\0\0\0\0\0\x0c", b"stsz\0\0\0\0\0\0\0\x01\xff\xff\xff\xff")],
            "4294967295 frames",
        ),
        (&[(b"stsz\0\0\0\0\0\0\0\0\0\0\0\x0c", b"stsz\0\0\0\0\0\0\0\0\xff\xff\xff\xff")], "holds fewer"),
        (&[(&size(64, 48), &size(20_000, 20_000))], "20000 x 20000"),
        (&[(b"avc1", b"av01")], "AV1"),
    ] {
        let message = played_bytes("film.mp4", &patched("b_frames.mp4", patches)).unwrap_err();
        assert!(message.contains(named), "wanted `{named}`; error: {message}");
    }
}

#[test]
fn a_film_cut_off_anywhere_is_an_error_and_not_a_shorter_film() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mp4");
    for film in ["b_frames.mp4", "negative_delays.mp4"] {
        let whole = std::fs::read(data(film)).unwrap();
        for length in 0..whole.len() {
            overwrite(&path, &whole[..length]);
            let message = played(&path);
            assert!(message.is_err(), "{film} cut to {length} of {} bytes: {message:?}", whole.len());
        }
    }
}

#[test]
fn a_fragmented_film_cut_between_fragments_has_a_warning() {
    let whole = std::fs::read(data("fragmented.mp4")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.mp4");
    let mut between = 0;
    for length in 0..whole.len() {
        overwrite(&path, &whole[..length]);
        if let Ok(footage) = Footage::open(&path) {
            let message = footage.warnings().join("; ");
            assert!(message.contains("may have been cut off"), "cut to {length} bytes; error: {message:?}");
            between += 1;
        }
    }
    assert!((1..=3).contains(&between), "{between} cuts between three fragments");
}

#[test]
fn a_damaged_frame_is_an_error_that_names_it() {
    let whole = std::fs::read(data("b_frames.mp4")).unwrap();
    let at = whole.windows(4).position(|window| window == b"mdat").unwrap();
    // The length of the first coded picture's second part reaches past its end.
    let mut bytes = whole.clone();
    bytes[at + 4] = 0xff;
    let message = played_bytes("film.mp4", &bytes).unwrap_err();
    assert!(message.contains("longer than its frame"), "error: {message}");
    let mut bytes = whole;
    bytes[at + 900..at + 1100].fill(0xff);
    let message = played_bytes("film.mp4", &bytes).unwrap_err();
    assert!(message.contains("frame ") && message.contains("shown at "), "error: {message}");
}

/// A film with some bytes changed, lost or added.
fn mutated(whole: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=draw.below(6) {
        let at = draw.below(bytes.len() - 4);
        match draw.below(12) {
            0..=3 => bytes[at] ^= 1 << draw.below(8),
            4..=6 => bytes[at] = draw.below(256) as u8,
            7 => bytes[at] = 0,
            8 => bytes[at..at + 4].fill(0xff),
            9 => bytes[at] = bytes[at].wrapping_add(1),
            10 => drop(bytes.drain(at..=at)),
            _ => bytes.insert(at, draw.below(256) as u8),
        }
    }
    bytes
}

#[test]
fn damaged_bytes_never_panic_and_never_hang() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film");
    let films =
        ["b_frames.mp4", "baseline.mov", "faded.mp4", "fragmented.mp4", "edit_list.mp4", "cropped.mp4"];
    let wholes: Vec<Vec<u8>> = films.iter().map(|film| std::fs::read(data(film)).unwrap()).collect();
    let mut draw = Draw::new(1);
    for round in 0..4000 {
        let whole = &wholes[draw.below(wholes.len())];
        overwrite(&path, &mutated(whole, &mut draw));
        let Ok(footage) = Footage::open(&path) else { continue };
        // Decoding takes most of the time: only every fourth film is decoded.
        if round % 4 == 0 {
            assert!(footage.take(1000).count() < 1000, "a film of 12 frames that does not end");
        }
    }
}
