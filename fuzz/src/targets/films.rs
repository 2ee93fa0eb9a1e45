//! Films and pictures, by the readers and decoders that are built in.

use super::{fixture, repository};
use crate::bag_writer::{
    BagWriter, Chunks, Info, camera_calibration, camera_info, compressed, image, protobuf_calibration,
    protobuf_video, video,
};
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
    what: "MCAP: records, chunks (zstd, LZ4), CDR, Protocol Buffers, raw images, JPEG, PNG, H.264, lenses",
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
        "sensor_msgs/msg/CameraInfo",
        "foxglove.CameraCalibration",
        "/camera_info",
        "/image_rect",
        "plumb_bob",
        "rational_polynomial",
        "equidistant",
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

/// The list of the files of a bag that is a folder.
pub const BAG_METADATA: Target = Target::of_text(
    "bag_metadata",
    "metadata.yaml of a bag that is a folder; the files that it names are played",
    |bytes| {
        let scratch = Scratch::folder();
        for file in ["bag/film_0.mcap", "bag/film_1.mcap"] {
            scratch.keep(file, &raw(Chunks::Plain, "mono8", 1));
        }
        scratch.write("bag/metadata.yaml", bytes);
        play(&scratch.path("bag"), true)
    },
    bag_metadata,
    &[&[
        "rosbag2_bagfile_information",
        "version: ",
        "storage_identifier: ",
        "mcap",
        "sqlite3",
        "relative_file_paths:",
        "film_0.mcap",
        "film_1.mcap",
        "../film_0.mcap",
        "/etc",
        "compression_format: ",
        "compression_mode: ",
        "zstd",
        "FILE",
        "MESSAGE",
        "---\n",
        "...\n",
        "- ",
        "? ",
        ": ",
        "&a ",
        "*a",
        "!!",
        "|\n",
        ">\n",
        "[",
        "]",
        "{",
        "}",
        "'",
        "\"",
        "#",
        "\t",
        "  ",
        ".inf",
        ".nan",
        "1e308",
        "~",
        "<<: ",
        "\u{0}",
    ]],
);

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
    if let Some(Ok(lens)) = footage.intrinsics()
        && ![lens.focal_px, lens.center_px].iter().flatten().all(|number| number.is_finite())
    {
        return Err(format!("a lens without numbers: {lens:?}"));
    }
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

/// Time from an image to the next (ns).
const FRAME_NS: u64 = 16_666_667;

/// A bag of three messages with images.
fn bag(chunks: Chunks, schema: &str, encoding: &str, message: &dyn Fn(u64, usize) -> Vec<u8>) -> Vec<u8> {
    let mut bag = BagWriter::new(chunks).without_checksums();
    let channel = bag.channel("/image", schema, encoding);
    for n in 0..3 {
        let taken_ns = n as u64 * FRAME_NS;
        bag.message(channel, taken_ns, &message(taken_ns, n));
    }
    bag.finished()
}

/// A bag of three raw images.
fn raw(chunks: Chunks, encoding: &str, bytes: usize) -> Vec<u8> {
    let message = |t, n| image(t, [12, 8], encoding, 12 * bytes, &vec![n as u8; 12 * 12 * bytes]);
    bag(chunks, "sensor_msgs/msg/Image", "cdr", &message)
}

/// Bags of two images, each with the lens in one kind of messages.
fn bags_with_lenses() -> Vec<Vec<u8>> {
    let distortion = [-0.1, 0.02, 1e-3, -1e-3, 0.0, 0.1, 0.0, 0.0];
    let whole = Info::new([12, 8], [15.0, 15.5], [5.5, 3.5], "rational_polynomial", &distortion);
    let part = Info { size_px: [48, 32], binning: [2, 2], roi: [4, 2, 24, 16], ..whole };
    let messages = [
        ("sensor_msgs/msg/CameraInfo", "cdr", camera_info(0, &part)),
        ("foxglove_msgs/msg/CameraCalibration", "cdr", camera_calibration(0, &whole)),
        ("foxglove.CameraCalibration", "protobuf", protobuf_calibration(0, &whole)),
    ];
    let with = |(schema, encoding, message): (&str, &str, Vec<u8>)| {
        let mut bag = BagWriter::new(Chunks::Plain).without_checksums();
        let images = bag.channel("/image_raw", "sensor_msgs/msg/Image", "cdr");
        let lenses = bag.channel("/camera_info", schema, encoding);
        for n in 0..2 {
            bag.message(lenses, n * FRAME_NS, &message);
            bag.message(images, n * FRAME_NS, &image(n * FRAME_NS, [12, 8], "mono8", 12, &[n as u8; 96]));
        }
        bag.finished()
    };
    messages.map(with).to_vec()
}

/// As `ros2 bag record` of two releases writes the file.
fn bag_metadata() -> Vec<Vec<u8>> {
    let old = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  duration:\n    nanoseconds: 50000000\n  \
               starting_time:\n    nanoseconds_since_epoch: 1700000000000000000\n  message_count: 3\n  topics_with_message_count:\n    \
               - topic_metadata:\n        name: /image\n        type: sensor_msgs/msg/Image\n        serialization_format: cdr\n        \
               offered_qos_profiles: \"- history: 3\\n  depth: 0\"\n      message_count: 3\n  compression_format: \"\"\n  compression_mode: \
               \"\"\n  relative_file_paths:\n    - film_0.mcap\n";
    let new = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  relative_file_paths: [film_1.mcap]\n  files:\n    \
               - path: film_1.mcap\n      starting_time: {nanoseconds_since_epoch: 0}\n      duration: {nanoseconds: 33333334}\n      \
               message_count: 3\n  custom_data: ~\n  ros_distro: jazzy\n";
    vec![old.into(), new.into()]
}

/// Bags of three images each: raw, compressed and video, in chunks of all kinds; and bags with lenses.
fn bags() -> Vec<Vec<u8>> {
    let folder = "crates/breakshot/tests/data/footage";
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
    bags.extend(bags_with_lenses());
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
