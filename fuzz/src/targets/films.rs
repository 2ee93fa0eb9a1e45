//! Films and pictures, by the readers and decoders that are built in.

use super::{fixture, repository};
use crate::bag_writer::{BagWriter, Chunks, compressed, image, protobuf_video, video};
use crate::{Outcome, Scratch, Target};
use breakshot::capture::{Capture, Decoder, Footage, Frame, GreyImage, PngEffort};
use breakshot::files;
use std::path::Path;

/// No film of the seeds has more frames: more means that it does not end.
const MOST_FRAMES: usize = 1000;
/// Tags are searched in pictures of at most this size (px).
const MOST_SEARCHED_PX: usize = 1 << 16;
/// What the index of a film is made of.
const BOXES: &[&str] = &[
    "ftyp",
    "moov",
    "trak",
    "mdia",
    "minf",
    "stbl",
    "stsd",
    "avc1",
    "avcC",
    "stts",
    "ctts",
    "stsc",
    "stsz",
    "stz2",
    "stco",
    "co64",
    "stss",
    "elst",
    "edts",
    "mvhd",
    "tkhd",
    "mdhd",
    "hdlr",
    "moof",
    "traf",
    "trun",
    "tfhd",
    "tfdt",
    "mvex",
    "trex",
    "colr",
    "pasp",
    "YUV4MPEG2 ",
    "FRAME\n",
];

/// Films, opened: their index is read and their first frame decoded.
pub const FILM: Target = Target {
    name: "film",
    what: "MP4, MOV and Y4M: the index, and the first frame (H.264)",
    read: |bytes| read(bytes, false),
    seeds: films,
    pieces: &[BOXES],
    part: index,
    longest_s: 20.0,
    most_memory_mb: 200.0,
};

/// Films, played to their end.
pub const FILM_PLAYED: Target = Target {
    name: "film_played",
    what: "the same, played to the end",
    read: |bytes| read(bytes, true),
    ..FILM
};

/// PNG pictures, with the tags in them.
pub const PICTURE: Target = Target {
    name: "picture",
    what: "PNG, and the search for tags in the picture",
    read: picture,
    seeds: pictures,
    pieces: &[&[
        "IHDR",
        "IDAT",
        "IEND",
        "PLTE",
        "tRNS",
        "gAMA",
        "acTL",
        "fcTL",
        "fdAT",
        "iCCP",
        "eXIf",
        "\u{0}\u{0}\u{0}\u{1}",
    ]],
    part: |bytes| 0..bytes.len().min(64),
    longest_s: 20.0,
    most_memory_mb: 600.0,
};

/// The times of a folder of pictures.
pub const PICTURE_TIMES: Target = Target::of_text(
    "picture_times",
    "timing.toml beside pictures",
    |bytes| {
        let scratch = Scratch::folder();
        for name in ["frames/1.png", "frames/2.png", "frames/10.png"] {
            scratch.keep(name, &ramp().png(PngEffort::Fast).unwrap_or_default());
        }
        scratch.write("frames/timing.toml", bytes);
        play(&scratch.path("frames"), true)
    },
    || vec![b"frame_rate_hz = 60.0\n".to_vec(), b"times_s = [0.0, 0.0167, 0.0334]\n".to_vec()],
    &[&["frame_rate_hz", "times_s", "=", "[", "]", "inf", "nan", "1e308", "-1", "1e-320", "0", ","]],
);

/// Bags of ROS 2, played to their end.
pub const BAG: Target = Target {
    name: "bag",
    what: "MCAP: records, chunks (zstd, LZ4), CDR, Protocol Buffers, raw images, JPEG, PNG, H.264",
    read: |bytes| play(&Scratch::folder().write("film.mcap", bytes), true),
    seeds: bags,
    pieces: &[&[
        "cdr",
        "protobuf",
        "ros1",
        "zstd",
        "lz4",
        "sensor_msgs/msg/Image",
        "sensor_msgs/msg/CompressedImage",
        "foxglove_msgs/msg/CompressedVideo",
        "foxglove.CompressedVideo",
        "mono8",
        "mono16",
        "bgra8",
        "bayer_rggb8",
        "nv12",
        "yuv422_yuy2",
        "bayer_rggb8; jpeg compressed ",
        "16UC1; compressedDepth png",
        "h264",
        "\u{0}\u{0}\u{0}\u{1}",
        "\u{0}\u{0}\u{1}g",
    ]],
    part: |bytes| 0..bytes.len(),
    longest_s: 20.0,
    most_memory_mb: 600.0,
};

fn read(bytes: &[u8], to_the_end: bool) -> Result<Outcome, String> {
    play(&Scratch::folder().write("film", bytes), to_the_end)
}

/// Opens a film, and plays it if asked; a film that is refused must end with an error of the reader.
fn play(path: &Path, to_the_end: bool) -> Result<Outcome, String> {
    let refused = |said: String| {
        if said.contains("decoding thread died") {
            return Err("panicked in its own thread".to_string());
        }
        Ok(Outcome::Refused(said))
    };
    let footage = match Footage::open_with(path, Decoder::Builtin) {
        Err(said) => return refused(said.to_string()),
        Ok(footage) => footage,
    };
    if !to_the_end {
        return Ok(Outcome::Read);
    }
    let (mut frames, mut latest_s) = (0, f64::NEG_INFINITY);
    for frame in footage.take(MOST_FRAMES) {
        frames += 1;
        match frame {
            Err(said) => return refused(said.to_string()),
            Ok(frame) if !frame.time_s.is_finite() || frame.time_s <= latest_s => {
                return Err(format!("a frame at {} s after one at {latest_s} s", frame.time_s));
            }
            Ok(frame) => latest_s = frame.time_s,
        }
    }
    if frames < MOST_FRAMES { Ok(Outcome::Read) } else { Err("does not end".into()) }
}

fn picture(bytes: &[u8]) -> Result<Outcome, String> {
    let path = Scratch::folder().write("picture.png", bytes);
    let frames = Footage::open_with(&path, Decoder::Builtin)
        .and_then(Iterator::collect::<breakshot::Result<Vec<Frame>>>);
    let frames = match frames {
        Err(said) => return Ok(Outcome::Refused(said.to_string())),
        Ok(frames) => frames,
    };
    let pixels = frames.iter().map(|frame| frame.image.pixels.len()).max().unwrap_or(0);
    if pixels <= MOST_SEARCHED_PX {
        let cell = files::load_cell(repository("fixtures/demo/cell.toml")).map_err(|e| e.to_string())?;
        // Too few tags are an error; whether they are seen is not in question here.
        drop(Capture::of(Footage::from_frames("picture", frames), &cell));
    }
    Ok(Outcome::Read)
}

/// The small films of the library's tests that the built-in decoder reads, and two Y4M.
fn films() -> Vec<Vec<u8>> {
    let folder = "crates/breakshot/tests/data/footage";
    let entries = std::fs::read_dir(repository(folder)).unwrap_or_else(|e| panic!("{folder}: {e}"));
    let mut names: Vec<String> =
        entries.filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned())).collect();
    names.retain(|name| Path::new(name).extension().is_some_and(|e| e == "mp4" || e == "mov"));
    names.sort();
    let bytes = names.iter().map(|name| fixture(&format!("{folder}/{name}")));
    let mut films: Vec<Vec<u8>> =
        bytes.filter(|bytes| matches!(read(bytes, true), Ok(Outcome::Read))).collect();
    for (header, size) in [("W16 H12 F60:1 C420", 16 * 12 * 3 / 2), ("W8 H6 F30000:1001 Cmono", 48)] {
        let frame = [&b"FRAME\n"[..], &vec![90; size]].concat();
        films.push([format!("YUV4MPEG2 {header}\n").into_bytes(), frame.repeat(3)].concat());
    }
    films
}

/// Bags of three images each: raw, compressed and video, in chunks of all kinds.
fn bags() -> Vec<Vec<u8>> {
    const FRAME_NS: u64 = 16_666_667;
    let folder = "crates/breakshot/tests/data/footage";
    let bag = |chunks, schema: &str, encoding: &str, message: &dyn Fn(u64, usize) -> Vec<u8>| {
        let mut bag = BagWriter::new(chunks).without_checksums();
        let channel = bag.channel("/image", schema, encoding);
        for n in 0..3 {
            let taken_ns = n as u64 * FRAME_NS;
            bag.message(channel, taken_ns, &message(taken_ns, n));
        }
        bag.finished()
    };
    let raw = |chunks, encoding: &str, bytes: usize| {
        let message = |t, n| image(t, [12, 8], encoding, 12 * bytes, &vec![n as u8; 12 * 12 * bytes]);
        bag(chunks, "sensor_msgs/msg/Image", "cdr", &message)
    };
    let mut bags = vec![
        raw(Chunks::Without, "mono8", 1),
        raw(Chunks::Plain, "bgr8", 3),
        raw(Chunks::Zstd, "bayer_rggb8", 1),
        raw(Chunks::Lz4, "yuv422", 2),
        raw(Chunks::Without, "mono16", 2),
    ];
    let film = fixture(&format!("{folder}/motion_jpeg.mov"));
    let start = film.windows(3).position(|bytes| bytes == [0xff, 0xd8, 0xff]).unwrap_or(0);
    let length = film[start..].windows(2).position(|bytes| bytes == [0xff, 0xd9]).unwrap_or(0) + 2;
    let (jpeg, png) = (&film[start..start + length], ramp().png(PngEffort::Small).unwrap_or_default());
    for (chunks, format, picture) in
        [(Chunks::Plain, "jpeg", jpeg), (Chunks::Lz4, "mono8; png compressed ", &png)]
    {
        let message = |t, _| compressed(t, format, picture);
        bags.push(bag(chunks, "sensor_msgs/msg/CompressedImage", "cdr", &message));
    }
    let stream = fixture(&format!("{folder}/baseline.h264"));
    let is_start = |at: &usize| stream[*at..].starts_with(&[0, 0, 0, 1, 9]);
    let starts: Vec<usize> = (0..stream.len()).filter(is_start).take(4).collect();
    let unit = |n: usize| &stream[starts[n]..starts[n + 1]];
    let in_cdr = |t, n| video(t, "h264", unit(n));
    bags.push(bag(Chunks::Without, "foxglove_msgs/msg/CompressedVideo", "cdr", &in_cdr));
    let in_protobuf = |t, n| protobuf_video(t, "h264", unit(n));
    bags.push(bag(Chunks::Zstd, "foxglove.CompressedVideo", "protobuf", &in_protobuf));
    bags
}

/// The index of a film: the box `moov`.
fn index(bytes: &[u8]) -> std::ops::Range<usize> {
    let start = bytes.windows(4).position(|window| window == b"moov").unwrap_or(0);
    start..bytes.len().min(start + 1200)
}

/// A picture of 24 x 18 px that becomes lighter to the right.
fn ramp() -> GreyImage {
    let (width, height) = (24, 18);
    GreyImage { width, height, pixels: (0..width * height).map(|k| (10 * (k % width)) as u8).collect() }
}

/// Grey pictures, small and less small, compressed in two ways.
fn pictures() -> Vec<Vec<u8>> {
    let small = ramp();
    let noisy =
        GreyImage { width: 96, height: 64, pixels: (0..96_u32 * 64).map(|k| (k * k % 251) as u8).collect() };
    let effort = [PngEffort::Small, PngEffort::Fast];
    [small, noisy]
        .iter()
        .flat_map(|image| effort.map(|effort| image.png(effort).unwrap_or_default()))
        .collect()
}
