//! Cameras calibrated from drawn pictures, compared with the cameras that drew them.

use super::{Camera, CameraMotion, Frame, GreyImage, Lens, camera};
use crate::cell::{CameraSpec, Cell, DistortionModel, ReferencePoint, Striker, Tag, Transform, Workspace};
use crate::geometry::{Pixel, Point, Pose};
use crate::object::Shape;
use crate::synthetic::film::{Thing, View, picture};
use std::f64::consts::{FRAC_PI_2, PI};

const SIZE: [usize; 2] = [1280, 720];

/// Root mean square error of the corners in a picture (px).
const CORNERS_PX: f64 = 0.05;
/// Error of a position at the workspace's corners, 5 cm above the table (m).
const POSITIONS_M: f64 = 5e-5;

/// A lens that displaces the picture's corners by ten pixels.
fn lens() -> Lens {
    Lens::new([1300.0, 1302.0], [644.2, 355.1], [-0.11, 0.02, 0.0006, -0.0004, 0.0])
}

/// A camera 1.2 m from the table's origin with this tilt and rotation about the vertical.
fn looking(tilt_rad: f64, yaw_rad: f64) -> Camera {
    let back_m = 1.2 * tilt_rad.sin();
    let position_m = [back_m * yaw_rad.sin(), -back_m * yaw_rad.cos(), 1.2 * tilt_rad.cos()];
    Camera::new(SIZE, lens(), Transform { position_m, rpy_rad: [tilt_rad, 0.0, yaw_rad] })
}

fn tag(id: u32, x: f64, y: f64, yaw_rad: f64) -> Tag {
    Tag { family: "36h11".into(), id, size_m: 0.05, center_m: Point::new(x, y), yaw_rad }
}

fn four_tags() -> Vec<Tag> {
    vec![
        tag(0, -0.3, -0.15, 0.0),
        tag(1, 0.3, -0.15, 0.4),
        tag(22, 0.3, 0.15, -1.0),
        tag(586, -0.3, 0.15, 3.0),
    ]
}

fn cell(tags: Vec<Tag>) -> Cell {
    let lens = lens();
    Cell {
        camera: CameraSpec {
            image_size_px: Some([1280, 720]),
            focal_px: Some(lens.focal_px()),
            center_px: Some(lens.center_px()),
            distortion: Some(lens.distortion().coefficients().to_vec()),
            ..CameraSpec::default()
        },
        tags,
        scale_px_per_m: None,
        ..Cell::from_above(1000.0, Workspace::centred([0.5, 0.24]), Striker::rod(0.01, [0.1, 1.0]))
    }
}

fn view(camera: &Camera) -> View {
    View { noise: 2.0, shading: [0.2, -0.1], ..View::new(camera.clone()) }
}

fn drawn(camera: &Camera, tags: &[Tag]) -> GreyImage {
    let things: Vec<Thing> = tags.iter().map(Thing::tag).collect();
    picture(&view(camera), &things)
}

fn found(image: &GreyImage, cell: &Cell) -> crate::Result<Camera> {
    camera("film.mp4", &[image], cell)
}

fn message(image: &GreyImage, cell: &Cell) -> String {
    found(image, cell).expect_err("must be refused").to_string()
}

/// The worst error of the workspace's corners, 5 cm above the table (m).
fn worst_position_m(truth: &Camera, found: &Camera, cell: &Cell) -> f64 {
    let Workspace { min_m, max_m } = cell.workspace;
    let corners = [min_m, max_m, Point::new(min_m.x, max_m.y), Point::new(max_m.x, min_m.y)];
    let off =
        |&point: &Point| found.table_from_pixel(truth.pixel_from_table(point, 0.05), 0.05).distance(point);
    corners.iter().map(off).fold(0.0, f64::max)
}

/// Root mean square distance of the measured corners from the drawn ones (px).
fn corner_rms_px(truth: &Camera, found: &Camera, tags: &[Tag]) -> f64 {
    let off = |tag: &Tag| {
        let fit = found.tags.iter().find(|fit| fit.id == tag.id).expect("the tag was found");
        let corners = tag.corners_m().map(|point| truth.pixel_from_table(point, 0.0));
        corners.iter().zip(fit.corners_px).map(|(a, b)| a.distance_px(b).powi(2)).sum::<f64>()
    };
    (tags.iter().map(off).sum::<f64>() / (4.0 * tags.len() as f64)).sqrt()
}

#[test]
fn four_tags_determine_the_pose_for_any_tilt_and_rotation() {
    for (tilt_rad, yaw_rad) in [(0.0, 0.0), (0.2, 1.0), (0.45, -2.0), (0.6, 3.0)] {
        let truth = looking(tilt_rad, yaw_rad);
        let mut tags = four_tags();
        for tag in &mut tags {
            // Rotated with the camera, so that all of them stay in view.
            tag.center_m = Point::ORIGIN + tag.center_m.to_vec().rotated(yaw_rad);
        }
        let cell = cell(tags.clone());
        let camera = found(&drawn(&truth, &tags), &cell).expect("four tags in view");
        assert_eq!(camera.tags_found, [0, 1, 22, 586]);
        let corners_px = corner_rms_px(&truth, &camera, &tags);
        assert!(corners_px < CORNERS_PX, "tilt {tilt_rad} rad: corners {corners_px} px off");
        let off_m = worst_position_m(&truth, &camera, &cell);
        assert!(off_m < POSITIONS_M, "tilt {tilt_rad} rad: {} mm off", off_m * 1e3);
        assert!(camera.warnings.is_empty(), "{:?}", camera.warnings);
    }
}

#[test]
fn the_width_of_the_tags_shows_that_their_centres_are_too_far_apart_in_the_cell() {
    let truth = looking(0.3, 0.0);
    let image = drawn(&truth, &four_tags());
    for factor in [1.0, 1.01, 0.98] {
        let mut spread = four_tags();
        for tag in &mut spread {
            tag.center_m = Point::ORIGIN + tag.center_m.to_vec() * factor;
        }
        let camera = found(&image, &cell(spread)).expect("four tags in view");
        let ratio = camera.tag_width_ratio.expect("four tags that are alike");
        assert!((ratio - factor).abs() < 1e-3, "{ratio}, centres {factor} times as far apart");
    }
    let three = four_tags()[..3].to_vec();
    assert_eq!(found(&image, &cell(three)).expect("three tags").tag_width_ratio, None);
}

#[test]
fn heights_are_measured_from_the_table_under_thick_tags() {
    let truth = looking(0.4, 0.0);
    let image = drawn(&truth, &four_tags());
    let mut cell = cell(four_tags());
    let seen = found(&image, &cell).expect("four tags in view");
    cell.camera.tag_thickness_m = Some(0.002);
    let raised = found(&image, &cell).expect("four tags in view");
    let pixel = Pixel::new(500.0, 300.0);
    for height_m in [0.0, 0.03] {
        let off_m =
            raised.table_from_pixel(pixel, height_m + 0.002).distance(seen.table_from_pixel(pixel, height_m));
        assert!(off_m < 1e-12, "{off_m} m off at {height_m} m");
    }
    let above_m = |camera: &Camera| camera.position_m().expect("a camera in space")[2];
    assert!((above_m(&raised) - above_m(&seen) - 0.002).abs() < 1e-12);
}

#[test]
fn tags_determine_the_pose_of_an_upside_down_camera() {
    let truth = looking(0.1, PI);
    let camera =
        found(&drawn(&truth, &four_tags()), &cell(four_tags())).expect("tags are decoded at any rotation");
    let right = camera.pixel_from_table(Point::new(0.1, 0.0), 0.0);
    assert!(right.x < 640.0, "x points to the picture's left: {right:?}");
    assert!(worst_position_m(&truth, &camera, &cell(four_tags())) < POSITIONS_M);
}

#[test]
fn light_noise_and_blur_hardly_move_the_corners() {
    let truth = looking(0.3, 0.0);
    let tags = four_tags();
    // Name, blur (px), noise, white, black, and how far the corners may lie off (px).
    for (name, blur_px, noise, white, black, limit_px) in [
        ("sharp", 0.4, 0.0, 235.0, 20.0, 0.02),
        ("blurred", 2.0, 2.0, 235.0, 20.0, 0.15),
        ("noisy", 0.7, 8.0, 235.0, 20.0, 0.06),
        ("dim", 0.7, 2.0, 50.0, 15.0, 0.08),
        ("overexposed", 0.7, 2.0, 300.0, 60.0, 0.08),
    ] {
        let seen = View { blur_px, noise, table_grey: 0.6 * white, ..view(&truth) };
        let thing = |tag: &Tag| Thing { grey: black, side_grey: white, ..Thing::tag(tag) };
        let things: Vec<Thing> = tags.iter().map(thing).collect();
        let camera = found(&picture(&seen, &things), &cell(tags.clone())).expect(name);
        let corners_px = corner_rms_px(&truth, &camera, &tags);
        assert!(corners_px < limit_px, "{name}: corners {corners_px} px off");
    }
}

#[test]
fn tags_of_twenty_pixels_are_decoded() {
    let truth = looking(0.1, 0.0);
    let mut tags = four_tags();
    for tag in &mut tags {
        tag.size_m = 0.0195;
    }
    let camera = found(&drawn(&truth, &tags), &cell(tags.clone())).expect("tags of 21 px");
    assert_eq!(camera.tags_found.len(), 4);
    let corners_px = corner_rms_px(&truth, &camera, &tags);
    assert!(corners_px < 0.1, "corners {corners_px} px off");
}

#[test]
fn one_tag_is_enough_and_its_uncertainty_is_a_warning() {
    let truth = looking(0.3, 0.0);
    let tags = vec![tag(3, 0.05, 0.02, 0.5)];
    let camera = found(&drawn(&truth, &tags), &cell(tags.clone())).expect("one tag");
    let std_m = camera.position_std_m.expect("known");
    assert!(std_m > 1e-4, "one small tag cannot give {std_m} m");
    assert!(camera.warnings.iter().any(|w| w.contains("one tag")), "{:?}", camera.warnings);
    let off_m = worst_position_m(&truth, &camera, &cell(tags));
    assert!(off_m < 6.0 * std_m, "{off_m} m off, {std_m} m promised");
}

#[test]
fn a_moved_tag_is_left_out_with_a_warning_that_names_it() {
    let truth = looking(0.3, 0.0);
    let mut moved = four_tags();
    moved[2].center_m = Point::new(0.28, 0.14);
    let cell = cell(four_tags());
    let camera = found(&drawn(&truth, &moved), &cell).expect("three tags agree");
    assert_eq!(camera.tags_found, [0, 1, 586]);
    assert!(camera.warnings.iter().any(|w| w.contains("tag 22")), "{:?}", camera.warnings);
    assert!(worst_position_m(&truth, &camera, &cell) < 2.0 * POSITIONS_M);
}

#[test]
fn tags_that_contradict_each_other_are_an_error_that_names_them() {
    let mut moved = four_tags();
    moved.truncate(2);
    moved[1].yaw_rad += 0.3;
    let error = message(&drawn(&looking(0.3, 0.0), &moved), &cell(four_tags()[..2].to_vec()));
    assert!(
        error.contains("film.mp4") && error.contains("tag 1 by") && error.contains("cell.toml"),
        "{error}"
    );
}

#[test]
fn a_common_mistake_about_all_tags_or_the_lens_is_named() {
    let truth = looking(0.3, 0.0);
    let image = drawn(&truth, &four_tags());
    let mut with_margin = four_tags();
    for tag in &mut with_margin {
        tag.size_m *= 1.25;
    }
    let error = message(&image, &cell(with_margin));
    assert!(error.contains("0.800 times as wide as size_m"), "{error}");
    let mut other_lens = cell(four_tags());
    other_lens.camera.focal_px = Some([400.0; 2]);
    other_lens.camera.distortion = None;
    let error = message(&image, &other_lens);
    assert!(error.contains("not through this lens") && error.contains("focal_px"), "{error}");
}

#[test]
fn a_film_with_dark_first_frames_is_calibrated_from_the_first_bright_one() {
    let truth = looking(0.3, 0.0);
    let dark = GreyImage { width: SIZE[0], height: SIZE[1], pixels: vec![3; SIZE[0] * SIZE[1]] };
    let lit = drawn(&truth, &four_tags());
    let cell = cell(four_tags());
    let camera = camera("film.mp4", &[&dark, &lit, &lit], &cell).expect("the second picture shows them");
    assert!(worst_position_m(&truth, &camera, &cell) < POSITIONS_M);
}

#[test]
fn tags_all_rotated_by_180_degrees_are_used_with_a_warning() {
    let truth = looking(0.3, 0.0);
    let mut rotated = four_tags();
    for tag in &mut rotated {
        tag.yaw_rad += PI;
    }
    let cell = cell(four_tags());
    let camera = found(&drawn(&truth, &rotated), &cell).expect("four tags agree on the rotation");
    assert!(camera.warnings.iter().any(|w| w.contains("180 degrees")), "{:?}", camera.warnings);
    assert!(worst_position_m(&truth, &camera, &cell) < POSITIONS_M);
}

#[test]
fn of_a_tag_detected_twice_the_one_at_its_position_is_used() {
    let truth = looking(0.2, 0.0);
    let mut tags = four_tags();
    tags.push(tag(1, 0.0, 0.0, 0.0));
    let camera = found(&drawn(&truth, &tags), &cell(four_tags())).expect("three others");
    assert_eq!(camera.tags_found, [0, 1, 22, 586]);
    assert!(worst_position_m(&truth, &camera, &cell(four_tags())) < POSITIONS_M);
    assert!(camera.warnings.iter().any(|w| w.contains("tag 1 is detected twice")), "{:?}", camera.warnings);
    let error = message(&drawn(&truth, &tags), &cell(vec![tag(1, 0.3, -0.15, 0.4)]));
    assert!(error.contains("tag 1 detected twice"), "{error}");
}

#[test]
fn the_error_for_a_picture_without_the_cells_tags_names_wanted_and_found_tags() {
    let truth = looking(0.2, 0.0);
    let none = message(&drawn(&truth, &[]), &cell(four_tags()));
    assert!(
        none.contains("film.mp4") && none.contains("0, 1, 22, 586") && none.contains("no AprilTag"),
        "{none}"
    );
    let others =
        message(&drawn(&truth, &[tag(7, 0.1, 0.0, 0.0), tag(9, -0.1, 0.0, 0.0)]), &cell(four_tags()));
    assert!(others.contains("tag 7, 9") && others.contains("0, 1, 22, 586"), "{others}");
    let mirrored = message(&drawn(&truth, &four_tags()).mirrored(), &cell(four_tags()));
    assert!(mirrored.contains("mirror"), "{mirrored}");
}

#[test]
fn pictures_without_tags_are_an_error() {
    for (width, height) in [(0, 0), (1, 1), (7, 1000), (9, 9), (63, 70), (1280, 720)] {
        let even = [0, 128, 255].map(|grey| vec![grey; width * height]);
        // Noise without a pattern, as of a camera with its cap on.
        let noise = (0..width * height)
            .map(|k| ((k * k) as u32).wrapping_mul(2_654_435_761).to_le_bytes()[3])
            .collect();
        for pixels in even.into_iter().chain([noise]) {
            let image = GreyImage { width, height, pixels };
            let mut cell = cell(four_tags());
            cell.camera = CameraSpec { focal_px: Some([1300.0; 2]), ..CameraSpec::default() };
            assert!(message(&image, &cell).contains("no AprilTag"));
        }
    }
}

#[test]
fn a_tag_in_a_hard_shadow_is_found_at_its_predicted_position() {
    let truth = looking(0.2, 0.0);
    let mut image = drawn(&truth, &four_tags());
    // A shadow's edge runs through the lower right tag.
    let edge = truth.pixel_from_table(Point::new(0.3, -0.15), 0.0);
    for (k, grey) in image.pixels.iter_mut().enumerate() {
        if (k % SIZE[0]) as f64 > edge.x {
            *grey = (f64::from(*grey) * 0.35) as u8;
        }
    }
    let camera = found(&image, &cell(four_tags())).expect("the others lead there");
    assert_eq!(camera.tags_found, [0, 1, 22, 586]);
    let off_m = worst_position_m(&truth, &camera, &cell(four_tags()));
    assert!(off_m < 2.0 * POSITIONS_M, "{off_m} m off: {:#?}", camera.tags);
}

#[test]
fn the_error_for_a_film_of_another_size_holds_both_sizes_and_the_numbers_for_a_scaled_one() {
    let mut cell = cell(four_tags());
    cell.camera.image_size_px = Some([2560, 1440]);
    let error = message(&drawn(&looking(0.2, 0.0), &four_tags()), &cell);
    assert!(error.contains("1280 x 720") && error.contains("2560 x 1440"), "{error}");
    assert!(error.contains("focal_px = [650.0000, 651.0000], center_px = [321.8500, 177.3000]"), "{error}");
    cell.camera.image_size_px = Some([640, 480]);
    let error = message(&drawn(&looking(0.2, 0.0), &four_tags()), &cell);
    assert!(error.contains("640 x 480") && !error.contains("focal_px"), "{error}");
}

#[test]
fn without_intrinsics_a_tilted_view_determines_the_focal_length_and_a_perpendicular_one_is_an_error() {
    let mut cell = cell(four_tags());
    cell.camera = CameraSpec::default();
    let plain = |tilt_rad: f64| {
        let mut truth = looking(tilt_rad, 0.0);
        let back_m = 1.2 * tilt_rad.sin();
        let at =
            Transform { position_m: [0.0, -back_m, 1.2 * tilt_rad.cos()], rpy_rad: [tilt_rad, 0.0, 0.0] };
        truth = Camera::new(truth.size_px, Lens::pinhole(SIZE, 1300.0), at);
        truth
    };
    let truth = plain(0.6);
    let camera = found(&drawn(&truth, &four_tags()), &cell).expect("a strong perspective");
    let focal_px = camera.lens().expect("found").focal_px()[0];
    assert!((focal_px / 1300.0 - 1.0).abs() < 0.01, "{focal_px} px");
    assert!(worst_position_m(&truth, &camera, &cell) < 10.0 * POSITIONS_M);
    let error = message(&drawn(&plain(0.0), &four_tags()), &cell);
    assert!(error.contains("focal_px"), "{error}");
}

fn clicked(truth: &Camera, off_px: f64) -> Vec<ReferencePoint> {
    let positions = [(-0.3, -0.15), (0.3, -0.15), (0.3, 0.15), (-0.3, 0.15), (0.0, 0.0)];
    let click = |(k, (x, y)): (usize, (f64, f64))| {
        let table_m = Point::new(x, y);
        let p = truth.pixel_from_table(table_m, 0.0);
        let image_px = Pixel::new(p.x + off_px * (k as f64).sin(), p.y + off_px * (k as f64).cos());
        ReferencePoint { image_px, table_m }
    };
    positions.into_iter().enumerate().map(click).collect()
}

#[test]
fn points_picked_by_hand_determine_the_pose() {
    let truth = looking(0.4, 0.3);
    let mut cell = cell(Vec::new());
    cell.points = clicked(&truth, 0.0);
    let blank = drawn(&truth, &[]);
    let camera = found(&blank, &cell).expect("five points and a lens");
    assert!(camera.knows_heights() && worst_position_m(&truth, &camera, &cell) < 1e-6);
    let std_m = camera.position_std_m.expect("known");
    assert!(std_m > 1e-4, "points picked to half a pixel cannot give {std_m} m");

    // Without a lens the map of the table is still determined, and a warning says that heights are not corrected.
    let straight = Camera::new(
        SIZE,
        Lens::pinhole(SIZE, 1300.0),
        Transform { position_m: [0.0, 0.0, 1.2], rpy_rad: [0.02, -0.01, 0.3] },
    );
    cell.camera = CameraSpec::default();
    cell.points = clicked(&straight, 0.3);
    let camera = found(&blank, &cell).expect("five points");
    assert!(!camera.knows_heights());
    assert!(camera.warnings.iter().any(|w| w.contains("heights")), "{:?}", camera.warnings);
    let point = Point::new(0.1, -0.1);
    let off_m = camera.table_from_pixel(straight.pixel_from_table(point, 0.0), 0.0).distance(point);
    assert!(off_m < 5e-4, "{off_m} m off");

    for point in &mut cell.points {
        point.table_m.y = 0.0;
    }
    assert!(message(&blank, &cell).contains("span"));
    cell.points[2].image_px.x = 5000.0;
    assert!(message(&blank, &cell).contains("points[2]"));
}

#[test]
fn a_scale_is_a_camera_straight_above_and_with_a_focal_length_it_has_heights() {
    let mut cell = cell(Vec::new());
    cell.camera = CameraSpec::default();
    cell.scale_px_per_m = Some(1000.0);
    let blank = GreyImage { width: 640, height: 480, pixels: vec![128; 640 * 480] };
    let camera = found(&blank, &cell).expect("a scale");
    assert!(camera.table_from_pixel(Pixel::new(419.5, 139.5), 0.0).distance(Point::new(0.1, 0.1)) < 1e-12);
    assert!(camera.warnings.iter().any(|w| w.contains("heights")));
    cell.camera.focal_px = Some([1500.0; 2]);
    cell.camera.center_px = Some([319.5, 239.5]);
    let camera = found(&blank, &cell).expect("a scale and a lens");
    assert_eq!(camera.position_m().map(|p| p[2]), Some(1.5));
    assert!(camera.warnings.is_empty(), "{:?}", camera.warnings);
    cell.camera.focal_px = None;
    cell.camera.distortion = Some(vec![-0.1]);
    assert!(message(&blank, &cell).contains("focal_px"));
    // A fisheye without coefficients is no pinhole.
    (cell.camera.distortion, cell.camera.distortion_model) =
        (Some(vec![0.0]), Some(DistortionModel::Equidistant));
    assert!(message(&blank, &cell).contains("focal_px"));
}

/// A frame of the four tags as this camera sees them, with other noise than the calibration's.
fn later_frame(camera: &Camera, seed: u64, time_s: f64) -> Frame {
    let things: Vec<Thing> = four_tags().iter().map(Thing::tag).collect();
    Frame { time_s, image: picture(&View { seed, ..view(camera) }, &things) }
}

/// Largest distance between where two cameras see points of the table and above it (px).
fn distance_px(one: &Camera, other: &Camera) -> f64 {
    let points = (0..9).map(|k| Point::new(f64::from(k % 3 - 1) * 0.15, f64::from(k / 3 - 1) * 0.1));
    let pixel = |camera: &Camera, point, height_m| camera.pixel_from_table(point, height_m);
    let distances =
        points.flat_map(|p| [0.0, 0.05].map(|h_m| pixel(one, p, h_m).distance_px(pixel(other, p, h_m))));
    distances.fold(0.0, f64::max)
}

#[test]
fn a_moving_camera_is_followed_and_a_fixed_one_stays_as_it_was_calibrated() {
    let truth = looking(0.2, 0.0);
    let calibrated = found(&drawn(&truth, &four_tags()), &cell(four_tags())).expect("four tags");
    let mut motion = CameraMotion::new(&calibrated);
    for k in 0..4_u32 {
        assert_eq!(motion.follow(&later_frame(&truth, 10 + u64::from(k), f64::from(k) * 0.01)), &calibrated);
    }
    assert_eq!(motion.warning(), None);
    // A bump of 1 px, one of 35 px, and back again
    for (k, (turned_px, name)) in [(1.0, "1 px"), (35.0, "35 px"), (0.0, "back")].into_iter().enumerate() {
        let [x, y, z] = truth.position_m().expect("a pose");
        let rpy_rad = [0.2 + turned_px / 1300.0, 0.0, 0.0];
        let bumped = Camera::new(SIZE, lens(), Transform { position_m: [x, y, z], rpy_rad });
        for again in 0..2 {
            let time_s = 0.1 * (k + 1) as f64;
            let camera = motion.follow(&later_frame(&bumped, 20 + 2 * k as u64 + again, time_s));
            let off_px = distance_px(camera, &bumped);
            assert!(off_px < 0.25, "{name}: {off_px} px off");
        }
    }
    let back = motion.follow(&later_frame(&truth, 40, 0.5));
    assert_eq!(back, &calibrated, "the camera is back where it was calibrated");
    let warning = motion.warning().expect("a motion");
    assert!(warning.contains("from 0.100 s on") && warning.contains("removed"), "{warning}");
}

#[test]
fn tags_that_are_covered_are_no_motion_of_the_camera() {
    let truth = looking(0.2, 0.0);
    let calibrated = found(&drawn(&truth, &four_tags()), &cell(four_tags())).expect("four tags");
    let mut motion = CameraMotion::new(&calibrated);
    motion.follow(&later_frame(&truth, 10, 0.0));
    // An arm over more and more of the table
    for (k, width_m) in [0.2, 0.4, 0.6, 1.2].into_iter().enumerate() {
        let mut things: Vec<Thing> = four_tags().iter().map(Thing::tag).collect();
        let shape = Shape::Rectangle { size_m: [width_m, 1.0] };
        things.push(Thing::flat(shape, Pose::new(-0.5, 0.0, 0.0), 0.02, 60.0));
        let image = picture(&View { seed: 30 + k as u64, ..view(&truth) }, &things);
        assert_eq!(motion.follow(&Frame { time_s: 0.1, image }), &calibrated, "{width_m} m covered");
    }
    assert_eq!(motion.warning(), None);
}

#[test]
fn a_dark_square_on_white_paper_is_not_a_tag() {
    let truth = looking(0.2, 0.0);
    let square = Shape::Rectangle { size_m: [0.05, 0.05] };
    let paper = Thing::flat(Shape::Rectangle { size_m: [0.07, 0.07] }, Pose::default(), 0.0, 235.0);
    let dark = Thing::flat(square, Pose::new(0.0, 0.0, FRAC_PI_2 / 3.0), 0.0, 20.0);
    let error = message(&picture(&view(&truth), &[paper, dark]), &cell(four_tags()));
    assert!(error.contains("no AprilTag"), "{error}");
}
