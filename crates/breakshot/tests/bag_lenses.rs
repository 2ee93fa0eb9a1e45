//! The lens of a film that is a bag: the calibration beside the images, and what becomes of it beside a lens in the cell.

#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use bag_writer::{BagWriter, Chunks, Info, camera_calibration, camera_info, image, protobuf_calibration};
use breakshot::capture::{Camera, Capture, Footage, GreyImage, Lens};
use breakshot::cell::{Cell, Distortion, Intrinsics, Striker, Tag, Transform, Workspace};
use breakshot::geometry::Point;
use breakshot::synthetic::film::{Thing, View, picture};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

mod bag_writer;

const SIZE: [usize; 2] = [640, 480];
const FOCAL: [f64; 2] = [640.0, 642.0];
const CENTER: [f64; 2] = [322.5, 236.0];
const D: [f64; 5] = [-0.11, 0.02, 0.0006, -0.0004, 0.0];
const IMAGE: &str = "sensor_msgs/msg/Image";
const INFO: &str = "sensor_msgs/msg/CameraInfo";
/// Largest difference between two poses from the same pixels through the same lens (m).
const SAME_M: f64 = 1e-12;

/// The calibration of the lens that took the film.
fn own() -> Info<'static> {
    Info::new([640, 480], FOCAL, CENTER, "plumb_bob", &D)
}

fn tags() -> Vec<Tag> {
    let at = [(-0.25, -0.15), (0.25, -0.15), (0.25, 0.15), (-0.25, 0.15)];
    let tag = |(id, (x, y))| Tag {
        family: "36h11".into(),
        id,
        size_m: 0.09,
        center_m: Point::new(x, y),
        yaw_rad: 0.0,
    };
    (0..).zip(at).map(tag).collect()
}

/// A picture of four tags by a camera that looks straight down, so that nothing but a calibration gives its focal length.
fn drawn() -> GreyImage {
    let lens = Lens::new(FOCAL, CENTER, D);
    let straight_down = Transform { position_m: [0.0, 0.0, 0.7], rpy_rad: [0.0; 3] };
    picture(
        &View::new(Camera::new(SIZE, lens, straight_down)),
        &tags().iter().map(Thing::tag).collect::<Vec<_>>(),
    )
}

/// A cell without a lens.
fn cell() -> Cell {
    let above = Cell::from_above(1000.0, Workspace::centred([0.4, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
    Cell { tags: tags(), scale_px_per_m: None, ..above }
}

fn with_lens(focal_px: [f64; 2], distortion: &[f64]) -> Cell {
    let mut cell = cell();
    cell.camera.focal_px = Some(focal_px);
    cell.camera.center_px = Some(CENTER);
    cell.camera.distortion = Some(distortion.to_vec());
    cell
}

/// A channel of calibrations: topic, schema, encoding, messages.
type Channel<'a> = (&'a str, &'a str, &'a str, Vec<Vec<u8>>);

struct Bag {
    folder: TempDir,
    picture: GreyImage,
}

impl Bag {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), picture: drawn() }
    }

    /// A bag of three images and these calibrations.
    fn of(&self, image_topic: &str, calibrations: &[Channel]) -> PathBuf {
        let mut bag = BagWriter::new(Chunks::Zstd);
        let images = bag.channel(image_topic, IMAGE, "cdr");
        let channels: Vec<u16> =
            calibrations.iter().map(|channel| bag.channel(channel.0, channel.1, channel.2)).collect();
        for n in 0..3 {
            let taken_ns = 1_700_000_000_000_000_000 + n as u64 * 20_000_000;
            for (&channel, (.., messages)) in channels.iter().zip(calibrations) {
                messages.get(n).into_iter().for_each(|message| bag.message(channel, taken_ns, message));
            }
            bag.message(images, taken_ns, &image(taken_ns, SIZE, "mono8", SIZE[0], &self.picture.pixels));
        }
        let path = self.folder.path().join("film.mcap");
        std::fs::write(&path, bag.finished()).unwrap();
        path
    }

    /// A bag whose images have this calibration three times.
    fn with(&self, info: &Info) -> PathBuf {
        self.of("/camera/image_raw", &[("/camera/camera_info", INFO, "cdr", vec![camera_info(1, info); 3])])
    }
}

fn captured(path: &Path, cell: &Cell) -> breakshot::Result<Capture> {
    Capture::of(Footage::open(path).unwrap(), cell)
}

fn message(path: &Path, cell: &Cell) -> String {
    captured(path, cell).err().expect("must be refused").to_string()
}

fn lens(path: &Path) -> Option<Intrinsics> {
    Footage::open(path).unwrap().intrinsics().map(|lens| *lens.unwrap())
}

#[test]
fn a_cell_without_a_lens_takes_the_calibration_beside_the_images() {
    let bag = Bag::new();
    let path = bag.with(&own());
    let wanted = Intrinsics {
        image_size_px: [640, 480],
        focal_px: FOCAL,
        center_px: CENTER,
        distortion: Distortion::PlumbBob(D),
    };
    assert_eq!(lens(&path), Some(wanted));
    let capture = captured(&path, &cell()).unwrap();
    assert_eq!(capture.camera.warnings, <[String; 0]>::default(), "no warning");
    assert_eq!(capture.cell.camera.focal_px, Some(FOCAL));
    let given = captured(&path, &with_lens(FOCAL, &D)).unwrap();
    assert_eq!(given.camera.warnings, <[String; 0]>::default(), "the same lens");
    let positions = [capture, given].map(|capture| capture.camera.position_m().unwrap());
    for (axis, wanted_m) in [0.0, 0.0, 0.7].into_iter().enumerate() {
        let [of_bag_m, of_cell_m] = positions.map(|position_m| position_m[axis]);
        assert!((of_bag_m - of_cell_m).abs() < SAME_M, "{of_bag_m} m, not {of_cell_m} m");
        assert!((of_bag_m - wanted_m).abs() < 1e-3, "{of_bag_m} m, not {wanted_m} m");
    }
    // The same film without the calibration has no focal length.
    let message = message(&bag.of("/camera/image_raw", &[]), &cell());
    assert!(message.contains("no focal_px"), "{message}");
}

#[test]
fn calibrations_of_foxglove_are_the_same_lens() {
    let bag = Bag::new();
    let wanted = lens(&bag.with(&own()));
    for (schema, encoding, message) in [
        ("foxglove_msgs/msg/CameraCalibration", "cdr", camera_calibration(1, &own())),
        ("foxglove.CameraCalibration", "protobuf", protobuf_calibration(1, &own())),
    ] {
        // By its place, whatever its name.
        let path = bag.of("/camera/video", &[("/camera/calibration", schema, encoding, vec![message])]);
        assert_eq!(lens(&path), wanted, "{schema}");
    }
}

#[test]
fn region_and_binning_are_applied_as_in_files() {
    let bag = Bag::new();
    let path = bag.with(&Info { binning: [2, 4], roi: [100, 40, 300, 402], ..own() });
    let lens = lens(&path).unwrap();
    assert_eq!((lens.image_size_px, lens.focal_px), ([150, 100], [320.0, 160.5]));
    assert_eq!(lens.center_px, [(322.5 - 100.5) / 2.0, (236.0 - 41.5) / 4.0]);
    let message = message(&path, &cell());
    for part in ["640 x 480 px", "150 x 100", "`/camera/camera_info`"] {
        assert!(message.contains(part), "{part} in: {message}");
    }
}

#[test]
fn a_camera_without_a_calibration_and_one_of_another_image_give_no_lens() {
    let bag = Bag::new();
    let uncalibrated = Info { k: [0.0; 9], p: [0.0; 12], model: "", d: &[], ..own() };
    assert_eq!(lens(&bag.with(&uncalibrated)), None);
    assert!(message(&bag.with(&uncalibrated), &cell()).contains("no focal_px"));
    let infos = vec![camera_info(1, &own())];
    for (image_topic, topic) in [("/left/image", "/right/camera_info"), ("/left/image", "/camera_info")] {
        assert_eq!(lens(&bag.of(image_topic, &[(topic, INFO, "cdr", infos.clone())])), None, "{topic}");
    }
    let path = bag.of("/camera/image_raw", &[("/camera/camera_info", INFO, "cdr", vec![])]);
    assert_eq!(lens(&path), None, "a topic without a message");
    let image_topic = "/camera/image_raw/compressed";
    let path = bag.of(image_topic, &[("/camera/camera_info", INFO, "cdr", infos)]);
    assert!(lens(&path).is_some(), "the compressed images of the same camera");
}

#[test]
fn rectified_images_have_the_projection_matrix_and_no_distortion() {
    let mut info = own();
    info.p = [600.0, 0.0, 320.0, -55.0, 0.0, 601.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let bag = Bag::new();
    let path =
        bag.of("/camera/image_rect", &[("/camera/camera_info", INFO, "cdr", vec![camera_info(1, &info)])]);
    let lens = lens(&path).unwrap();
    assert_eq!(
        (lens.focal_px, lens.center_px, lens.distortion),
        ([600.0, 601.0], [320.0, 240.0], Distortion::default())
    );
}

#[test]
fn the_cells_own_lens_is_used_and_another_one_in_the_bag_is_a_warning_that_names_both() {
    let bag = Bag::new();
    let warnings = |info: &Info, cell: &Cell| captured(&bag.with(info), cell).unwrap().camera.warnings;
    let close = [FOCAL[0] * 1.009, FOCAL[1] * 1.009];
    let [far, wide] = [1.011, 2.0].map(|factor| FOCAL.map(|focal_px| focal_px * factor));
    assert_eq!(
        warnings(&Info::new([640, 480], close, CENTER, "plumb_bob", &D), &with_lens(FOCAL, &D)).len(),
        0
    );
    for (info, cell, parts) in [
        (
            Info::new([640, 480], far, CENTER, "plumb_bob", &D),
            with_lens(FOCAL, &D),
            ["focal_px [640.0, 642.0]", "focal_px [647.0, 649.1]"],
        ),
        (Info::new([640, 480], wide, CENTER, "plumb_bob", &D), with_lens(FOCAL, &D), ["640.0", "1280.0"]),
        (
            Info::new([640, 480], FOCAL, CENTER, "equidistant", &[0.01]),
            with_lens(FOCAL, &D),
            ["plumb_bob", "equidistant"],
        ),
        (
            Info::new([640, 480], FOCAL, [340.0, 236.0], "plumb_bob", &D),
            with_lens(FOCAL, &D),
            ["[322.5, 236.0]", "[340.0, 236.0]"],
        ),
        (
            Info::new([640, 480], FOCAL, CENTER, "fov", &[0.9]),
            with_lens(FOCAL, &D),
            ["cannot be compared", "`fov`"],
        ),
        (
            Info { size_px: [1280, 960], ..own() },
            with_lens(FOCAL, &D),
            ["640.0", "of pictures of 1280 x 960 px"],
        ),
    ] {
        let found = warnings(&info, &cell);
        assert_eq!(found.len(), 1, "{found:?}");
        for part in parts.into_iter().chain(["`/camera/camera_info`", "that of the cell is used"]) {
            assert!(found[0].contains(part), "{part} in: {}", found[0]);
        }
    }
    let path = bag.with(&Info::new([640, 480], wide, CENTER, "plumb_bob", &D));
    let position_m = captured(&path, &with_lens(FOCAL, &D)).unwrap().camera.position_m().unwrap();
    assert!((position_m[2] - 0.7).abs() < 1e-3, "the cell's lens was not used: {} m", position_m[2]);
    let mut centred = cell();
    centred.camera.center_px = Some(CENTER);
    assert!(message(&path, &centred).contains("no focal_px"), "a part of the lens belongs to the cell");
}

#[test]
fn a_calibration_that_is_needed_and_cannot_be_used_is_an_error_by_name() {
    let bag = Bag::new();
    let cut = camera_info(1, &own())[..200].to_vec();
    let many = camera_info(1, &Info { d: &[0.0; 65], ..own() });
    let sound = camera_info(1, &own());
    for (schema, encoding, bytes, found) in [
        (
            INFO,
            "cdr",
            camera_info(1, &Info { model: "fov", d: &[0.9], ..own() }),
            "`fov` with 1 coefficients",
        ),
        (INFO, "cdr", camera_info(1, &Info { d: &[-2.0], ..own() }), "folds the picture"),
        (INFO, "cdr", camera_info(1, &Info { d: &[f64::NAN], ..own() }), "finite numbers"),
        (INFO, "cdr", camera_info(1, &Info { roi: [600, 0, 100, 0], ..own() }), "roi.width"),
        (INFO, "cdr", camera_info(1, &Info { binning: [65, 1], ..own() }), "binning_x"),
        (INFO, "cdr", cut, "a message that ends early"),
        (INFO, "cdr", many, "a list of 65 numbers"),
        (INFO, "cdr", vec![0; 1 << 17], "a calibration of 131072 bytes"),
        (INFO, "json", sound, "serialised as `json`"),
        ("foxglove.CameraCalibration", "protobuf", vec![0x33, 1, 2], "Protocol Buffers"),
        ("foxglove.CameraCalibration", "protobuf", vec![0x32, 3, 1, 2, 3], "numbers of another type"),
    ] {
        let path = bag.of("/camera/image_raw", &[("/camera/camera_info", schema, encoding, vec![bytes])]);
        let message = message(&path, &cell());
        for part in [found, "film.mcap", "`/camera/camera_info`", "needed"] {
            assert!(message.contains(part), "{part} in: {message}");
        }
        // Who gives a lens is not stopped by it.
        assert_eq!(captured(&path, &with_lens(FOCAL, &D)).unwrap().camera.warnings.len(), 1, "{found}");
    }
}

#[test]
fn a_calibration_that_changes_in_the_recording_is_a_warning() {
    let bag = Bag::new();
    let zoomed = Info::new([640, 480], [700.0; 2], CENTER, "plumb_bob", &D);
    let topic = |messages| bag.of("/camera/image_raw", &[("/camera/camera_info", INFO, "cdr", messages)]);
    let path = topic(vec![camera_info(1, &own()), camera_info(2, &own()), camera_info(3, &zoomed)]);
    let camera = captured(&path, &cell()).unwrap().camera;
    assert_eq!(camera.warnings.len(), 1, "{:?}", camera.warnings);
    assert!(
        camera.warnings[0].contains("`/camera/camera_info`) is that of the first message: message 3"),
        "{}",
        camera.warnings[0]
    );
    assert_eq!(camera.position_m().map(|position_m| (position_m[2] * 1e2).round()), Some(70.0), "(cm)");
    let same = vec![camera_info(1, &own()), camera_info(2, &own()), camera_info(3, &own())];
    assert_eq!(captured(&topic(same), &cell()).unwrap().camera.warnings.len(), 0, "only the times differ");
}
