//! PNG images, folders of them, and uncompressed films.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use breakshot::capture::{Footage, Frame};
use std::fmt::Write;
use std::path::Path;

fn frames(path: &Path) -> Vec<Frame> {
    Footage::open(path).unwrap().map(Result::unwrap).collect()
}

fn error(path: &Path) -> String {
    match Footage::open(path) {
        Err(e) => e.to_string(),
        Ok(footage) => footage.filter_map(Result::err).map(|e| e.to_string()).collect(),
    }
}

fn write_png(path: &Path, size: [u32; 2], coding: (png::ColorType, png::BitDepth), samples: &[u8]) {
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), size[0], size[1]);
    encoder.set_color(coding.0);
    encoder.set_depth(coding.1);
    if coding.0 == png::ColorType::Indexed {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
    }
    encoder.write_header().unwrap().write_image_data(samples).unwrap();
}

#[test]
fn every_kind_of_png_becomes_luma() {
    use png::BitDepth::{Eight, One, Sixteen};
    use png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    for (coding, samples, luma) in [
        ((Grayscale, Eight), &[0, 100, 200, 255][..], [0, 100, 200, 255]),
        ((GrayscaleAlpha, Eight), &[0, 9, 100, 9, 200, 9, 255, 9], [0, 100, 200, 255]),
        ((Grayscale, Sixteen), &[0, 0, 0x80, 0x80, 0x80, 0xff, 0xff, 0xff], [0, 128, 128, 255]),
        // Red, green, blue and grey (BT.709: 0.2126, 0.7152, 0.0722).
        ((Rgb, Eight), &[255, 0, 0, 0, 255, 0, 0, 0, 255, 77, 77, 77], [54, 182, 18, 77]),
        ((Rgba, Eight), &[255, 0, 0, 1, 0, 255, 0, 1, 0, 0, 255, 1, 77, 77, 77, 1], [54, 182, 18, 77]),
        ((Indexed, One), &[0b0100_0000, 0b1000_0000], [0, 255, 255, 0]),
    ] {
        write_png(&path, [2, 2], coding, samples);
        let frame = &frames(&path)[0];
        assert_eq!(frame.image.pixels, luma, "luma of {coding:?}");
        assert_eq!((frame.time_s, frame.image.width, frame.image.height), (0.0, 2, 2));
    }
}

#[test]
fn a_truncated_or_huge_png_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    write_png(&path, [2, 2], (png::ColorType::Grayscale, png::BitDepth::Eight), &[1, 2, 3, 4]);
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() - 12 {
        std::fs::write(&path, &whole[..length]).unwrap();
        let message = error(&path);
        assert!(
            message.contains("picture.png") && message.contains("needed: "),
            "cut to {length} bytes, error: {message:?}"
        );
    }
    // A header of 20,000 x 20,000 with its checksum.
    let mut header = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\x4e\x20\0\0\x4e\x20\x08\0\0\0\0".to_vec();
    let check = header[12..].iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    });
    header.extend((!check).to_be_bytes());
    std::fs::write(&path, header).unwrap();
    assert!(error(&path).contains("20000 x 20000"), "error: {}", error(&path));
}

/// A folder of one-pixel images with these names and grey levels.
fn folder_of(pictures: &[(&str, u8)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, level) in pictures {
        let grey = (png::ColorType::Grayscale, png::BitDepth::Eight);
        write_png(&folder.path().join(name), [1, 1], grey, &[*level]);
    }
    folder
}

#[test]
fn a_folder_of_pictures_is_a_film_in_natural_order() {
    let folder = folder_of(&[("f10.png", 10), ("f9.png", 9), ("f1.PNG", 1)]);
    let timing = folder.path().join("timing.toml");
    std::fs::write(&timing, "frame_rate_hz = 50.0\n").unwrap();
    let film = |frames: Vec<Frame>| -> Vec<(f64, u8)> {
        frames.iter().map(|frame| (frame.time_s, frame.image.pixels[0])).collect()
    };
    assert_eq!(film(frames(folder.path())), [(0.0, 1), (0.02, 9), (0.04, 10)]);
    std::fs::write(&timing, "times_s = [2.0, 2.5, 4.0]\n").unwrap();
    assert_eq!(film(frames(folder.path())), [(0.0, 1), (0.5, 9), (2.0, 10)]);
}

#[test]
fn the_error_for_a_folder_names_what_is_missing() {
    let folder = folder_of(&[("a.png", 1), ("b.png", 2)]);
    assert!(error(folder.path()).contains("needed: a file timing.toml"), "error: {}", error(folder.path()));
    let timing = folder.path().join("timing.toml");
    for (text, named) in [
        ("times_s = [0.0]", "1 times for 2 pictures"),
        ("times_s = [1.0, 0.5]", "go back"),
        ("times_s = [0.0, nan]", "go back"),
        ("times_s = [nan, 0.0]", "go back"),
        ("frame_rate_hz = 0.0", "frame_rate_hz = 0"),
        ("frame_rate_hz = nan", "frame_rate_hz = NaN"),
        ("frame_rate = 60.0", "frame_rate_hz"),
        ("", "not just one"),
    ] {
        std::fs::write(&timing, text).unwrap();
        let message = error(folder.path());
        assert!(message.contains("timing.toml") && message.contains(named), "`{text}`: {message}");
    }
    std::fs::write(&timing, "frame_rate_hz = 60.0").unwrap();
    write_png(
        &folder.path().join("c.png"),
        [2, 1],
        (png::ColorType::Grayscale, png::BitDepth::Eight),
        &[1, 2],
    );
    assert!(error(folder.path()).contains("c.png: 2 x 1 px"), "error: {}", error(folder.path()));
    std::fs::write(folder.path().join("c.png"), "no picture").unwrap();
    assert!(error(folder.path()).contains("c.png: a file that is no PNG"), "error: {}", error(folder.path()));
    let empty = tempfile::tempdir().unwrap();
    assert!(error(empty.path()).contains("0 PNG pictures"), "error: {}", error(empty.path()));
}

/// An uncompressed film of 3 x 2 px whose frame `n` has the grey level `n`.
fn y4m(fields: &str, colour_bytes: usize, frame_count: usize) -> Vec<u8> {
    let mut film = format!("YUV4MPEG2 W3 H2 {fields}\n").into_bytes();
    for n in 0..frame_count {
        film.extend(b"FRAME\n");
        film.extend([n as u8; 6]);
        film.extend(vec![0x80; colour_bytes]);
    }
    film
}

#[test]
fn y4m_of_every_8_bit_colour_space_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.y4m");
    for (colours, bytes) in [
        ("420jpeg", 4),
        ("420mpeg2", 4),
        ("420", 4),
        ("411", 4),
        ("422", 8),
        ("444", 12),
        ("444alpha", 18),
        ("mono", 0),
    ] {
        std::fs::write(&path, y4m(&format!("F30000:1001 Ip A1:1 C{colours}"), bytes, 3)).unwrap();
        let film = frames(&path);
        assert_eq!(film.len(), 3, "frames of C{colours}");
        for (n, frame) in film.iter().enumerate() {
            assert_eq!(frame.image.pixels, [n as u8; 6], "luma of frame {n} of C{colours}");
            let time_s = n as f64 * 1001.0 / 30_000.0;
            assert!((frame.time_s - time_s).abs() < 1e-12, "frame {n} at {} s, not {time_s} s", frame.time_s);
        }
    }
}

#[test]
fn the_error_for_a_damaged_y4m_names_the_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.y4m");
    let whole = y4m("F60:1 C420", 4, 2);
    let mut cases: Vec<(Vec<u8>, &str)> = vec![
        (y4m("F60:1 C420", 4, 0), "0 frames"),
        (y4m("C420", 4, 1), "no frame rate"),
        (y4m("F0:1 C420", 4, 1), "no frame rate"),
        (y4m("F60:1 It C420", 4, 1), "interlaced"),
        (y4m("F60:1 C420p10", 8, 1), "colour space 420p10"),
        (y4m("W20000 H20000 F60:1 C420", 4, 1), "20000 x 20000"),
        (y4m("W18446744073709551615 H2 F60:1", 4, 1), "18446744073709551615 x 2"),
        ([&whole[..], b"FRAMES\n"].concat(), "no frame where frame 3 should begin"),
        (whole[..whole.len() - 1].to_vec(), "breaks off: frame 2 has 9 of 10 bytes"),
        (whole[..whole.len() - 13].to_vec(), "a header line that does not end"),
    ];
    let mut endless = String::from("YUV4MPEG2 ");
    write!(endless, "{}", "X".repeat(5000)).unwrap();
    cases.push((endless.into_bytes(), "a header line that does not end"));
    for (bytes, named) in cases {
        std::fs::write(&path, bytes).unwrap();
        let message = error(&path);
        assert!(
            message.contains("film.y4m") && message.contains(named),
            "wanted `{named}`, error: {message}"
        );
    }
}
