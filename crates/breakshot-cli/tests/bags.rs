//! Bags of ROS 2 in commands: as films from end to end, and those that are refused with the command that converts them.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod bag_writer;
mod common;

use bag_writer::{BagWriter, Chunks, Info, camera_info, image};
use breakshot::capture::{Footage, Frame};
use breakshot::files;
use common::{assert_refused, breakshot, demo};
use std::fs;
use std::path::Path;

const IMAGE: &str = "sensor_msgs/msg/Image";
const INFO: &str = "sensor_msgs/msg/CameraInfo";
const TOPIC: &str = "/camera/image_raw";
/// When the first image was taken (ns since 1970).
const START_NS: u64 = 1_700_000_000_000_000_000;
/// Time stamps of a bag are whole nanoseconds, which may change the last of six decimals that a table has.
const LAST_DIGIT: f64 = 1.5e-6;
const CONVERT: &str = "rosbags-convert --src BAG --dst NEW --dst-storage mcap";

/// A folder with the cell, the objects and one film of the example.
fn workbench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for file in ["cell.toml", "objects.toml", "single_a_3.mp4"] {
        fs::copy(demo(file), folder.path().join(file)).unwrap();
    }
    folder
}

/// The first frames of the film.
fn frames(count: usize) -> Vec<Frame> {
    let film = Footage::open(&demo("single_a_3.mp4")).unwrap();
    film.take(count).map(Result::unwrap).collect()
}

/// The message of a frame.
fn message(frame: &Frame) -> (u64, Vec<u8>) {
    let taken_ns = START_NS + (1e9 * frame.time_s).round() as u64;
    let size = [frame.image.width, frame.image.height];
    (taken_ns, image(taken_ns, size, "mono8", size[0], &frame.image.pixels))
}

/// A bag of these frames in one topic.
fn bag(chunks: Chunks, frames: &[Frame]) -> Vec<u8> {
    let mut bag = BagWriter::new(chunks);
    let channel = bag.channel(TOPIC, IMAGE, "cdr");
    for (taken_ns, message) in frames.iter().map(message) {
        bag.message(channel, taken_ns, &message);
    }
    bag.finished()
}

fn detect<'a>(film: &'a str, output: &'a str) -> Vec<&'a str> {
    let files = ["detect", "cell.toml", "objects.toml", film, "--objects", "a"];
    [&files[..], &["--strike-heading-rad", "0", "-o", output]].concat()
}

fn look<'a>(film: &'a str, output: &'a str) -> Vec<&'a str> {
    vec!["look", "cell.toml", "objects.toml", film, "--objects", "a", "-o", output]
}

/// Runs a command that ends without a warning.
fn run(folder: &Path, args: &[&str]) {
    let output = breakshot(folder, args);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {message}");
}

#[test]
fn a_bag_gives_the_tracks_of_the_film_that_it_was_made_from() {
    let folder = workbench();
    fs::write(folder.path().join("film.mcap"), bag(Chunks::Without, &frames(usize::MAX))).unwrap();
    run(folder.path(), &detect("single_a_3.mp4", "film.csv"));
    run(folder.path(), &detect("film.mcap", "bag.csv"));
    let numbers = |file: &str| -> Vec<f64> {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        text.lines().skip(1).flat_map(|line| line.split(',')).filter_map(|word| word.parse().ok()).collect()
    };
    let (film, bag) = (numbers("film.csv"), numbers("bag.csv"));
    assert!(film.len() > 45, "{} numbers of 45 frames", film.len());
    assert_eq!(film.len(), bag.len());
    for (of_film, of_bag) in film.iter().zip(&bag) {
        assert!((of_film - of_bag).abs() < LAST_DIGIT, "{of_bag}, not {of_film}");
    }
}

#[test]
fn the_lens_in_a_bag_replaces_that_of_the_cell_and_another_one_is_a_warning() {
    let folder = workbench();
    let frames = frames(3);
    let with_focal = |file: &str, focal_px: f64| {
        let info = Info::new(
            [1920, 1080],
            [focal_px; 2],
            [959.5, 539.5],
            "plumb_bob",
            &[-0.045, 0.012, 0.0, 0.0, 0.0],
        );
        let mut bag = BagWriter::new(Chunks::Lz4);
        let [images, lenses] = [(TOPIC, IMAGE), ("/camera/camera_info", INFO)]
            .map(|(topic, schema)| bag.channel(topic, schema, "cdr"));
        for (taken_ns, message) in frames.iter().map(message) {
            bag.message(lenses, taken_ns, &camera_info(taken_ns, &info));
            bag.message(images, taken_ns, &message);
        }
        fs::write(folder.path().join(file), bag.finished()).unwrap();
    };
    with_focal("lens.mcap", 2540.5003);
    with_focal("zoomed.mcap", 3000.0);
    fs::write(folder.path().join("none.mcap"), bag(Chunks::Plain, &frames)).unwrap();
    run(folder.path(), &look("single_a_3.mp4", "film.toml"));
    run(folder.path(), &look("lens.mcap", "both.toml"));
    let output = breakshot(folder.path(), &look("zoomed.mcap", "zoomed.toml"));
    let warning = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{warning}");
    for part in ["focal_px [2540.5, 2540.5]", "focal_px [3000.0, 3000.0]", "`/camera/camera_info`"] {
        assert!(warning.contains(part), "{part} in: {warning}");
    }
    // The same cell without its lens
    let cell = fs::read_to_string(demo("cell.toml")).unwrap();
    let is_lens = |line: &str| {
        ["image_size_px", "focal_px", "center_px", "distortion"].iter().any(|key| line.starts_with(key))
    };
    let cell: Vec<&str> = cell.lines().filter(|line| !is_lens(line)).collect();
    fs::write(folder.path().join("cell.toml"), cell.join("\n")).unwrap();
    run(folder.path(), &look("lens.mcap", "bag.toml"));
    let pose = |file: &str| files::load_scene(folder.path().join(file)).unwrap().value.placed;
    for file in ["both.toml", "zoomed.toml", "bag.toml"] {
        assert_eq!(pose(file), pose("film.toml"), "{file}");
    }
    assert_refused(folder.path(), &look("none.mcap", "out.json"), &["none.mcap", "no focal_px"]);
}

#[test]
fn of_several_topics_with_images_one_is_chosen_by_its_name() {
    let folder = workbench();
    let frames = frames(3);
    let mut bag = BagWriter::new(Chunks::Zstd);
    let [left, right] = ["/left/image", "/right/image"].map(|topic| bag.channel(topic, IMAGE, "cdr"));
    for frame in &frames {
        let (taken_ns, seen) = message(frame);
        bag.message(left, taken_ns, &seen);
        bag.message(right, taken_ns, &image(taken_ns, [64, 48], "mono8", 64, &[90; 64 * 48]));
    }
    fs::write(folder.path().join("two.mcap"), bag.finished()).unwrap();
    let listed =
        ["`/left/image` (sensor_msgs/msg/Image, 3 messages)", "`/right/image`", "BAG#/camera/image_raw"];
    assert_refused(folder.path(), &look("two.mcap", "out.json"), &listed);
    assert_refused(
        folder.path(),
        &look("two.mcap#/middle", "out.json"),
        &["no topic `/middle`", "`/left/image`"],
    );
    assert_refused(folder.path(), &look("two.mcap#/right/image", "out.json"), &["two.mcap", "64 x 48 px"]);
    run(folder.path(), &look("two.mcap#/left/image", "left.toml"));
    run(folder.path(), &look("single_a_3.mp4", "film.toml"));
    let poses = ["left.toml", "film.toml"]
        .map(|file| files::load_scene(folder.path().join(file)).unwrap().value.placed);
    assert_eq!(poses[0], poses[1]);
}

#[test]
fn bags_that_are_not_read_are_refused_with_the_command_that_converts_them() {
    let folder = workbench();
    let write = |file: &str, bytes: &[u8]| {
        let path = folder.path().join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    };
    let metadata = |storage: &str, format: &str, mode: &str| {
        format!(
            "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {storage}\n  relative_file_paths:\n    - bag_0\n  \
             compression_format: \"{format}\"\n  compression_mode: \"{mode}\"\n"
        )
    };
    let sqlite = b"SQLite format 3\0 and tables";
    write("bare.db3", sqlite);
    write("only_db3/bag_0.db3", sqlite);
    write("sqlite/bag_0", sqlite);
    write("sqlite/metadata.yaml", metadata("sqlite3", "", "").as_bytes());
    write("ros1.bag", b"#ROSBAG V2.0\nand records");
    write("files/metadata.yaml", metadata("mcap", "zstd", "FILE").as_bytes());
    write("messages/metadata.yaml", metadata("mcap", "zstd", "MESSAGE").as_bytes());
    write("file.mcap.zstd", b"\x28\xb5\x2f\xfd and a frame");
    let mut compressed = BagWriter::new(Chunks::Plain);
    let channel = compressed.channel(TOPIC, IMAGE, "cdr");
    compressed.message(channel, START_NS, b"\x28\xb5\x2f\xfd and a frame");
    write("message.mcap", &compressed.finished());
    for (film, found) in [
        ("bare.db3", "a bag in an SQLite database"),
        ("only_db3", "a bag in an SQLite database"),
        ("sqlite", "a bag in an SQLite database"),
        ("sqlite#/camera/image_raw", "a bag in an SQLite database"),
        ("ros1.bag", "a ROS 1 bag"),
        ("files", "a bag whose files are compressed"),
        ("messages", "a bag whose messages are compressed"),
        ("file.mcap.zstd", "a file compressed by zstd"),
        ("message.mcap", "a bag whose messages are compressed"),
    ] {
        assert_refused(folder.path(), &detect(film, "out.csv"), &[film, found, "needed", CONVERT]);
        assert_refused(folder.path(), &look(film, "out.json"), &[film, found, "needed", CONVERT]);
    }
}
