//! Bags of ROS 2 as films: the same pixels as the films they were made from, the times of their messages, and refusals by name.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use bag_writer::{BagWriter, Chunks, compressed, image, protobuf_video, video};
use breakshot::campaign::Campaign;
use breakshot::capture::{Footage, Frame, PngEffort, recorded_unix_s};
use breakshot::files;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

mod bag_writer;

const ALL_CHUNKS: [Chunks; 4] = [Chunks::Without, Chunks::Plain, Chunks::Zstd, Chunks::Lz4];
const RAW: &str = "sensor_msgs/msg/Image";
const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";
const VIDEO: &str = "foxglove_msgs/msg/CompressedVideo";
/// When the first image was taken (ns since 1970); the recorder wrote it 30 ms later.
const START_NS: u64 = 1_700_000_000_123_456_789;
const DELAY_NS: u64 = 30_000_000;

fn data(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/footage").join(file)
}

/// The frames of a film of 64 x 48 px and 60 frames a second.
fn original() -> Vec<Frame> {
    Footage::open(&data("baseline.mov")).unwrap().map(Result::unwrap).collect()
}

/// When frame `n` was taken.
fn taken_ns(n: usize) -> u64 {
    START_NS + (n as u64 * 1_000_000_000).div_ceil(60)
}

/// A bag with one topic, of messages that were recorded at irregular times.
fn bag(chunks: Chunks, schema: &str, encoding: &str, messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bag = BagWriter::new(chunks);
    let channel = bag.channel("/camera/image", schema, encoding);
    for (n, message) in messages.iter().enumerate() {
        bag.message(channel, taken_ns(n) + DELAY_NS + (n as u64 * 7919) % 5_000_000, message);
    }
    bag.finished()
}

struct Scratch(TempDir);

impl Scratch {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, bytes).unwrap();
        path
    }
}

fn frames(path: &Path) -> Vec<Frame> {
    Footage::open(path).unwrap().map(Result::unwrap).collect()
}

/// The message of the first error.
fn error(path: &Path) -> String {
    match Footage::open(path) {
        Err(e) => e.to_string(),
        Ok(footage) => footage.filter_map(Result::err).map(|e| e.to_string()).collect(),
    }
}

fn with_topic(path: &Path, topic: &str) -> PathBuf {
    format!("{}#{topic}", path.display()).into()
}

/// The pixels equal those of the original, the times those of the stamps.
fn assert_same(found: &[Frame], original: &[Frame], what: &str) {
    assert_eq!(found.len(), original.len(), "frames of {what}");
    for (n, (found, wanted)) in found.iter().zip(original).enumerate() {
        assert_eq!(found.image, wanted.image, "pixels of frame {n} of {what}");
        let wanted_s = (taken_ns(n) - START_NS) as f64 / 1e9;
        assert_eq!(found.time_s, wanted_s, "time of frame {n} of {what} (s)");
        assert!((found.time_s - wanted.time_s).abs() < 2e-9, "{} s, not {} s", found.time_s, wanted.time_s);
    }
}

/// Grey levels in an encoding of `sensor_msgs/msg/Image`, and the bytes of a row.
fn repacked(grey: &[u8], encoding: &str, width: usize) -> (usize, Vec<u8>) {
    let bytes: Vec<u8> = match encoding {
        "mono8" => grey.to_vec(),
        "mono16" => grey.iter().flat_map(|&g| [g, g]).collect(),
        "rgb8" | "bgr8" => grey.iter().flat_map(|&g| [g, g, g]).collect(),
        "rgba8" | "bgra8" => grey.iter().flat_map(|&g| [g, g, g, 255]).collect(),
        "yuv422" => grey.iter().flat_map(|&g| [128, g]).collect(),
        "yuv422_yuy2" => grey.iter().flat_map(|&g| [g, 128]).collect(),
        "nv12" => return (width, [grey, &vec![128; grey.len() / 2]].concat()),
        _ => panic!("{encoding}"),
    };
    (bytes.len() / (grey.len() / width), bytes)
}

#[test]
fn raw_images_have_the_pixels_of_the_film_in_every_encoding_and_compression() {
    let (original, scratch) = (original(), Scratch::new());
    for encoding in ["mono8", "mono16", "rgb8", "bgr8", "rgba8", "bgra8", "yuv422", "yuv422_yuy2", "nv12"] {
        let messages: Vec<Vec<u8>> = (0..original.len())
            .map(|n| {
                let (step, bytes) = repacked(&original[n].image.pixels, encoding, 64);
                image(taken_ns(n), [64, 48], encoding, step, &bytes)
            })
            .collect();
        for chunks in ALL_CHUNKS {
            let path = scratch.write("film.mcap", &bag(chunks, RAW, "cdr", &messages));
            let footage = Footage::open(&path).unwrap();
            assert_eq!((footage.size_px(), footage.frame_count()), ([64, 48], Some(original.len())));
            assert_eq!(footage.warnings(), <[String; 0]>::default(), "warnings");
            assert_same(&frames(&path), &original, &format!("{encoding} in chunks {chunks:?}"));
        }
    }
}

#[test]
fn png_images_and_h264_have_the_pixels_of_the_film() {
    let (original, scratch) = (original(), Scratch::new());
    let png = |n: usize| original[n].image.png(PngEffort::Fast).unwrap();
    let pictures: Vec<_> =
        (0..original.len()).map(|n| compressed(taken_ns(n), "mono8; png compressed ", &png(n))).collect();
    let path = scratch.write("png.mcap", &bag(Chunks::Zstd, COMPRESSED, "cdr", &pictures));
    assert_same(&frames(&path), &original, "PNG");
    let units = access_units();
    let numbered = || units.iter().enumerate();
    let cdr: Vec<_> = numbered().map(|(n, unit)| video(taken_ns(n), "h264", unit)).collect();
    let path = scratch.write("video.mcap", &bag(Chunks::Lz4, VIDEO, "cdr", &cdr));
    assert_same(&frames(&path), &original, "H.264");
    let protobuf: Vec<_> = numbered().map(|(n, unit)| protobuf_video(taken_ns(n), "h264", unit)).collect();
    let bytes = bag(Chunks::Plain, "foxglove.CompressedVideo", "protobuf", &protobuf);
    assert_same(&frames(&scratch.write("protobuf.mcap", &bytes)), &original, "H.264 in Protocol Buffers");
}

/// The coded pictures of the film with start codes, each from its access unit delimiter on.
fn access_units() -> Vec<Vec<u8>> {
    let stream = std::fs::read(data("baseline.h264")).unwrap();
    let is_start = |at: &usize| stream[*at..].starts_with(&[0, 0, 0, 1, 9]);
    let starts: Vec<usize> = (0..stream.len()).filter(is_start).collect();
    let ends = starts.iter().skip(1).copied().chain([stream.len()]);
    starts.iter().zip(ends).map(|(&start, end)| stream[start..end].to_vec()).collect()
}

#[test]
fn a_video_starts_with_its_first_key_frame() {
    let (original, scratch, units) = (original(), Scratch::new(), access_units());
    let mut bytes = BagWriter::new(Chunks::Plain);
    let channel = bytes.channel("/video", VIDEO, "cdr");
    for k in [5, 6] {
        let taken_ns = START_NS - 50_000_000 + k * 1_000_000;
        bytes.message(channel, taken_ns, &video(taken_ns, "h264", &units[k as usize]));
    }
    for (n, unit) in units.iter().enumerate() {
        bytes.message(channel, taken_ns(n), &video(taken_ns(n), "h264", unit));
    }
    let path = scratch.write("late.mcap", &bytes.finished());
    let footage = Footage::open(&path).unwrap();
    assert!(footage.warnings()[0].starts_with("its first 2 frames refer to"), "{:?}", footage.warnings());
    assert_same(&frames(&path), &original, "a video that was recorded late");
    let late: Vec<_> = (1..9).map(|n| video(taken_ns(n), "h264", &units[n])).collect();
    let message = error(&scratch.write("keyless.mcap", &bag(Chunks::Plain, VIDEO, "cdr", &late)));
    assert!(message.contains("without a key frame"), "{message}");
    let message =
        error(&scratch.write("x.mcap", &bag(Chunks::Plain, VIDEO, "cdr", &[video(START_NS, "h265", b"x")])));
    assert!(message.contains("`h265`") && message.contains("`h264`"), "{message}");
}

#[test]
fn a_jpeg_has_the_luma_that_ffmpeg_decodes() {
    let film = std::fs::read(data("motion_jpeg.mov")).unwrap();
    let start = film.windows(3).position(|bytes| bytes == [0xff, 0xd8, 0xff]).unwrap();
    let length = film[start..].windows(2).position(|bytes| bytes == [0xff, 0xd9]).unwrap() + 2;
    let jpeg = &film[start..start + length];
    let scratch = Scratch::new();
    let read = |format: &str, jpeg: &[u8]| {
        let bytes = bag(Chunks::Without, COMPRESSED, "cdr", &[compressed(START_NS, format, jpeg)]);
        scratch.write("jpeg.mcap", &bytes)
    };
    for format in ["jpeg", "bgr8; jpeg compressed bgr8"] {
        let frames = frames(&read(format, jpeg));
        let wanted = std::fs::read(data("motion_jpeg.gray")).unwrap();
        let differences = frames[0].image.pixels.iter().zip(&wanted).map(|(a, b)| a.abs_diff(*b));
        // Two decoders round the inverse cosine transform differently.
        assert!(differences.max().unwrap() <= 2, "{format}");
        assert_eq!(frames[0].image.pixels.len(), wanted.len(), "pixels");
    }
    let message = error(&read("jpeg", &jpeg[..length / 2]));
    assert!(message.contains("a JPEG that cannot be decoded"), "{message}");
    let message = error(&read("jpeg", b"GIF89a"));
    assert!(
        message.contains("compressed images of format `jpeg`") && message.contains("JPEG or PNG"),
        "{message}"
    );
}

/// Messages of small grey images, taken at these numbers of the frame clock.
fn small(taken: impl Iterator<Item = usize>) -> Vec<Vec<u8>> {
    taken.map(|n| image(taken_ns(n), [4, 2], "mono8", 4, &[n as u8; 8])).collect()
}

#[test]
fn times_are_those_of_the_stamps_and_missing_frames_are_counted() {
    let scratch = Scratch::new();
    let taken: Vec<usize> = (0..40).filter(|n| ![10, 20, 21].contains(n)).collect();
    let path = scratch.write("gaps.mcap", &bag(Chunks::Zstd, RAW, "cdr", &small(taken.iter().copied())));
    let footage = Footage::open(&path).unwrap();
    let warnings = footage.warnings().join("\n");
    assert!(warnings.contains("3 frames are missing in 2 gaps"), "{warnings}");
    let frames: Vec<Frame> = footage.map(Result::unwrap).collect();
    assert_eq!(frames.len(), taken.len(), "no frame is interpolated");
    for (frame, n) in frames.iter().zip(taken) {
        assert_eq!(frame.time_s, (taken_ns(n) - START_NS) as f64 / 1e9, "time of frame {n} (s)");
    }
    let recorded_s = recorded_unix_s(&path).unwrap();
    assert!((recorded_s - START_NS as f64 * 1e-9).abs() < 1e-6, "recorded at {recorded_s} s");
}

#[test]
fn images_are_in_the_order_of_their_recording_and_stamps_that_go_back_are_refused() {
    let scratch = Scratch::new();
    let messages = small(0..6);
    let mut bytes = BagWriter::new(Chunks::Zstd);
    let channel = bytes.channel("/c", RAW, "cdr");
    for n in [3, 1, 5, 0, 4, 2] {
        bytes.message(channel, taken_ns(n), &messages[n]);
    }
    let path = scratch.write("shuffled.mcap", &bytes.finished());
    let levels: Vec<u8> = frames(&path).iter().map(|frame| frame.image.pixels[0]).collect();
    assert_eq!(levels, [0, 1, 2, 3, 4, 5]);
    for taken in [[0, 1, 2, 1], [0, 1, 1, 2]] {
        let bytes = bag(Chunks::Plain, RAW, "cdr", &small(taken.into_iter()));
        let message = error(&scratch.write("back.mcap", &bytes));
        assert!(message.contains("go back") && message.contains("header.stamp"), "{message}");
    }
}

#[test]
fn a_bag_with_several_topics_needs_a_choice() {
    let scratch = Scratch::new();
    let mut bytes = BagWriter::new(Chunks::Lz4);
    let [left, right] = ["/left/image", "/right/image"].map(|topic| bytes.channel(topic, RAW, "cdr"));
    let other = bytes.channel("/imu", "sensor_msgs/msg/Imu", "cdr");
    for n in 0..5 {
        let level = |add: u8| image(taken_ns(n), [4, 2], "mono8", 4, &[n as u8 + add; 8]);
        bytes.message(left, taken_ns(n), &level(0));
        bytes.message(other, taken_ns(n), b"anything");
        bytes.message(right, taken_ns(n), &level(100));
    }
    let path = scratch.write("two.mcap", &bytes.finished());
    let message = error(&path);
    for part in ["`/left/image` (sensor_msgs/msg/Image, 5 messages)", "`/right/image`", "BAG#"] {
        assert!(message.contains(part), "{part} in: {message}");
    }
    let levels: Vec<u8> =
        frames(&with_topic(&path, "/right/image")).iter().map(|frame| frame.image.pixels[0]).collect();
    assert_eq!(levels, [100, 101, 102, 103, 104]);
    let message = error(&with_topic(&path, "/imu"));
    assert!(message.contains("sensor_msgs/msg/Imu") && message.contains("`/left/image`"), "{message}");
    let message = error(&with_topic(&path, "/none"));
    assert!(message.contains("no topic `/none`"), "{message}");
    let message = error(&with_topic(&data("baseline.mov"), "/left/image"));
    assert!(message.contains("no bag"), "{message}");
}

const METADATA: &str = "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: STORAGE\n  \
    duration:\n    nanoseconds: 1\n  relative_file_paths:\n    - film_0.mcap\n    - film_1.mcap\n  \
    compression_format: \"FORMAT\"\n  compression_mode: \"MODE\"\n";

#[test]
fn a_folder_is_a_bag_whose_files_follow_each_other() {
    let (original, scratch) = (original(), Scratch::new());
    let message = |n: usize| image(taken_ns(n), [64, 48], "mono8", 64, &original[n].image.pixels);
    for (file, part) in [("film_0", 0..5), ("film_1", 5..original.len())] {
        let mut bytes = BagWriter::new(Chunks::Zstd);
        let channel = bytes.channel("/c", RAW, "cdr");
        part.for_each(|n| bytes.message(channel, taken_ns(n), &message(n)));
        scratch.write(&format!("bag/{file}.mcap"), &bytes.finished());
    }
    let metadata = |storage: &str, format: &str, mode: &str| {
        let text = METADATA.replace("STORAGE", storage).replace("FORMAT", format).replace("MODE", mode);
        scratch.write("bag/metadata.yaml", text.as_bytes());
    };
    let folder = scratch.0.path().join("bag");
    assert!(error(&folder).contains("ros2 bag reindex"), "{}", error(&folder));
    metadata("mcap", "", "");
    assert_same(&frames(&folder), &original, "a folder");
    assert_same(&frames(&with_topic(&folder, "/c")), &original, "a folder with its topic");
    for (storage, format, mode, found) in [
        ("sqlite3", "", "", "SQLite database (.db3)"),
        ("mcap", "zstd", "FILE", "files are compressed"),
        ("mcap", "zstd", "MESSAGE", "messages are compressed"),
    ] {
        metadata(storage, format, mode);
        let message = error(&folder);
        assert!(message.contains(found) && message.contains("rosbags-convert --src"), "{message}");
    }
    metadata("mcap", "", "");
    std::fs::remove_file(folder.join("film_1.mcap")).unwrap();
    assert!(error(&folder).contains("without the file `film_1.mcap`"), "{}", error(&folder));
    scratch.write("bag/metadata.yaml", b"rosbag2_bagfile_information: [");
    assert!(error(&folder).contains("metadata.yaml that cannot be read"), "{}", error(&folder));
}

#[test]
fn other_bags_and_images_without_light_are_refused_by_name() {
    let scratch = Scratch::new();
    for (name, bytes, found) in [
        ("a.bag", &b"#ROSBAG V2.0\n..."[..], "a ROS 1 bag"),
        ("a.db3", b"SQLite format 3\0...", "SQLite database (.db3)"),
        ("a.mcap.zstd", b"\x28\xb5\x2f\xfd....", "compressed by zstd"),
        ("b.mcap", &bag(Chunks::Plain, "sensor_msgs/Image", "ros1", &[vec![0; 40]]), "messages of ROS 1"),
        (
            "c.mcap",
            &bag(Chunks::Plain, RAW, "cdr", &[b"\x28\xb5\x2f\xfd............".to_vec()]),
            "messages are compressed",
        ),
    ] {
        let message = error(&scratch.write(name, bytes));
        assert!(message.contains(found) && message.contains("rosbags-convert --src"), "{message}");
    }
    let depth = |format: &str| compressed(START_NS, format, b"\x89PNG\r\n\x1a\n....");
    for (schema, message, found) in [
        (COMPRESSED, depth("16UC1; compressedDepth png"), "compressed depth images"),
        (COMPRESSED, depth("16UC1; png compressed "), "encoding `16UC1`"),
        (RAW, image(START_NS, [2, 2], "32FC1", 8, &[0; 16]), "encoding `32FC1`"),
        ("foxglove.RawImage", vec![0; 20], "messages of type foxglove.RawImage"),
        ("std_msgs/msg/String", vec![0; 20], "std_msgs/msg/String"),
    ] {
        let message = error(&scratch.write("d.mcap", &bag(Chunks::Plain, schema, "cdr", &[message])));
        assert!(message.contains(found) && message.contains("needed"), "{message}");
    }
}

#[test]
fn a_bag_that_breaks_off_or_is_damaged_is_refused() {
    let scratch = Scratch::new();
    for chunks in ALL_CHUNKS {
        let whole = bag(chunks, RAW, "cdr", &small(0..7));
        for length in 0..whole.len() {
            let path = scratch.write("cut.mcap", &whole[..length]);
            assert!(!error(&path).is_empty(), "{length} of {} bytes, {chunks:?}", whole.len());
        }
        // With its checksum a chunk gives its own pixels or none.
        let sound = frames(&scratch.write("whole.mcap", &whole));
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x10;
            let footage = Footage::open(&scratch.write("flipped.mcap", &bytes));
            let frames: Vec<_> =
                footage.map(|footage| footage.map_while(Result::ok).collect()).unwrap_or_default();
            for (frame, sound) in frames.iter().zip(&sound).filter(|_| chunks != Chunks::Without) {
                assert_eq!(frame.image, sound.image, "byte {at} of {chunks:?}");
            }
        }
    }
}

#[test]
fn a_campaign_takes_bags_and_calls_topics_of_one_bag_by_their_names() {
    let scratch = Scratch::new();
    scratch.write("a.mcap", &bag(Chunks::Plain, RAW, "cdr", &small(0..3)));
    scratch.write("b/metadata.yaml", b"");
    scratch.write("b/b_0.mcap", &bag(Chunks::Plain, RAW, "cdr", &small(0..4)));
    let demo = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo");
    let campaign = |videos: &[&str]| {
        let clip = |video: &&str| format!("[[clips]]\nvideo = \"{video}\"\nobjects = [\"a\"]\n");
        let clips: String = videos.iter().map(clip).collect();
        let files =
            ["cell", "objects"].map(|name| format!("{name} = {:?}\n", demo.join(format!("{name}.toml"))));
        let path = scratch.write("campaign.toml", (files.concat() + &clips).as_bytes());
        files::load_campaign(path).map(|loaded| loaded.value)
    };
    let names = |videos: &[&str]| -> Vec<String> {
        campaign(videos).unwrap().clips.into_iter().map(|clip| clip.name).collect()
    };
    assert_eq!(names(&["a.mcap", "b/"]), ["a.mcap", "b"]);
    assert_eq!(names(&["a.mcap#/camera/image"]), ["a.mcap"]);
    assert_eq!(names(&["a.mcap#/left", "a.mcap#/right"]), ["a.mcap#/left", "a.mcap#/right"]);
    for videos in [["a.mcap#/left", "a.mcap#/left"], ["a.mcap", "a.mcap#/left"]] {
        assert!(campaign(&videos).unwrap_err().to_string().contains("content"), "{videos:?}");
    }
    assert!(campaign(&["none.mcap#/left"]).unwrap_err().to_string().contains("missing"));
    let [left, right] = ["left", "right"].map(|topic| campaign(&[&format!("a.mcap#/{topic}")]).unwrap());
    let input = |campaign: &Campaign| files::clip_input(campaign, &campaign.clips[0]).unwrap();
    assert_ne!(input(&left), input(&right), "the topic belongs to what the tracks depend on");
}
