use super::bundle::{Corner, Observations};
use super::*;
use crate::capture::camera::Camera;
use crate::cell::{Distortion, Tag, Transform};
use crate::synthetic::film::{Thing, View, film};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

const SIZE: [usize; 2] = [640, 480];

fn truth(model: DistortionModel) -> Lens {
    let distortion = match model {
        DistortionModel::PlumbBob => Distortion::PlumbBob([-0.18, 0.05, 0.0006, -0.0004, 0.0]),
        DistortionModel::RationalPolynomial => {
            Distortion::RationalPolynomial([0.12, 0.02, 0.0004, -0.0003, 0.0, 0.35, 0.03, 0.0])
        }
        DistortionModel::Equidistant => Distortion::Equidistant([0.03, -0.01, 0.004, -0.001]),
    };
    let focal_px = if model == DistortionModel::Equidistant { 330.0 } else { 560.0 };
    Lens::new([focal_px, focal_px * 1.001], [322.5, 237.0], distortion)
}

/// A camera that looks at a point near the middle of the board, from a side and a distance of its own.
fn camera(lens: &Lens, size_px: [usize; 2], random: &mut Pcg64Mcg, tilt_rad: f64) -> Camera {
    let mut draw = |largest: f64| random.random_range(-largest..largest);
    let rpy_rad = [draw(tilt_rad), draw(tilt_rad), draw(0.4)];
    let distance_m = lens.focal_px()[0] / size_px[0] as f64 * 0.36 * (1.0 + draw(0.35));
    // Straight below a camera with these angles: its axis meets the board near the origin.
    let aim = [draw(0.06), draw(0.04)];
    // A straight line through the principal point's pixel: where the optical axis meets the board from 1 m above.
    let above = Camera::new(size_px, lens.clone(), Transform { position_m: [0.0, 0.0, 1.0], rpy_rad });
    let [cx, cy] = lens.center_px();
    let met = above.table_from_pixel(Pixel::new(cx, cy), 0.0);
    let forward = nalgebra::Vector3::new(met.x, met.y, -1.0).normalize();
    let position_m =
        [aim[0] - forward.x * distance_m, aim[1] - forward.y * distance_m, -forward.z * distance_m];
    Camera::new(size_px, lens.clone(), Transform { position_m, rpy_rad })
}

fn board() -> Board {
    Board::grid([6, 5], 0.04, 0.05).expect("a board")
}

fn drawn(lens: &Lens, views: u32, tilt_rad: f64) -> Vec<crate::capture::Frame> {
    let mut random = Pcg64Mcg::seed_from_u64(5);
    let tags = board().tags;
    let frame = |k: u32| {
        let camera = camera(lens, SIZE, &mut random, tilt_rad);
        let view = View { noise: 2.0, seed: u64::from(k), ..View::new(camera) };
        let mut frames = film(&view, &[0.0], |_| tags.iter().map(Thing::tag).collect());
        crate::capture::Frame { time_s: f64::from(k), ..frames.swap_remove(0) }
    };
    (0..views).map(frame).collect()
}

fn calibrated(frames: &[crate::capture::Frame], model: DistortionModel) -> Result<LensCalibration> {
    lens_calibration(&|| Ok(Footage::from_frames("board", frames.to_vec())), &board(), model)
}

#[test]
fn a_drawn_film_of_a_board_gives_its_lens_for_each_model() {
    for model in [DistortionModel::PlumbBob, DistortionModel::Equidistant] {
        let lens = truth(model);
        let found = calibrated(&drawn(&lens, 20, 0.5), model).expect("calibrated");
        let summary = format!("{:?} {:?} {} px", found.parameters, found.warnings, found.reprojection_rms_px);
        assert!(found.reprojection_rms_px < 0.1 && found.frames >= 18, "{model:?}: {summary}");
        let wanted = bundle::parameters(&lens);
        for (parameter, wanted) in found.parameters.iter().zip(wanted) {
            let errors = (parameter.value - wanted) / parameter.standard_error;
            assert!(
                errors.abs() < 5.0,
                "{model:?} {}: {errors:.1} standard errors; {summary}",
                parameter.name
            );
        }
        let focal = found.lens().focal_px()[0] / lens.focal_px()[0] - 1.0;
        assert!(focal.abs() < 0.002, "{model:?}: the focal length is off by {focal:.5}; {summary}");
        // The file gives the same lens, to the bit.
        let path = std::path::Path::new("lens.yaml");
        let read = crate::cell::camera_info::parsed(path, found.camera_info(), None, None)
            .expect("a CameraInfo file");
        assert_eq!(Lens::new(read.focal_px, read.center_px, read.distortion), *found.lens());
        assert_eq!(read.image_size_px.map(|size| size as usize), SIZE);
        assert!(found.drawing().contains("px rms"));
    }
}

#[test]
fn a_film_that_does_not_determine_the_lens_is_refused_or_comes_with_what_to_film() {
    let lens = truth(DistortionModel::PlumbBob);
    let message = match calibrated(&drawn(&lens, 8, 0.01), DistortionModel::PlumbBob) {
        Err(error) => error.to_string(),
        Ok(found) => found.warnings.join("; "),
    };
    assert!(message.contains("tilt"), "parallel to the picture: {message}");
    let message =
        calibrated(&drawn(&lens, 3, 0.5), DistortionModel::PlumbBob).expect_err("three views").to_string();
    assert!(message.contains("the board in 3 frames") && message.contains("tilt"), "{message}");
    let other =
        Board { tags: (0..4).map(|id| Tag { id, ..board().tags[id as usize].clone() }).collect(), ..board() };
    let frames = drawn(&lens, 6, 0.5);
    let open = || Ok(Footage::from_frames("board", frames.clone()));
    let message =
        lens_calibration(&open, &other, DistortionModel::PlumbBob).expect_err("other tags").to_string();
    assert!(message.contains("the board in 0 frames"), "{message}");
}

/// Corners of the board in drawn poses, with normal noise and a few wrong ones.
fn measured(lens: &Lens, random: &mut Pcg64Mcg) -> Observations {
    let tags = board().tags;
    let mut views = Vec::new();
    for _ in 0..25 {
        let camera = camera(lens, SIZE, random, 0.6);
        // Some frames are blurred.
        let noise_px = if random.random::<f64>() < 0.3 { 0.25 } else { 0.08 };
        let mut corners = Vec::new();
        for point in tags.iter().flat_map(Tag::corners_m) {
            let pixel = camera.pixel_from_table(point, 0.0);
            if !camera.shows(pixel) {
                continue;
            }
            let far = if random.random::<f64>() < 0.01 { 8.0 } else { noise_px };
            let mut error = || far * Distribution::<f64>::sample(&StandardNormal, random);
            corners.push(Corner { point, pixel: Pixel::new(pixel.x + error(), pixel.y + error()) });
        }
        views.push(corners);
    }
    views
}

#[test]
fn intervals_of_the_parameters_contain_the_truth_as_often_as_they_promise() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let (mut inside, mut all) = (0, 0);
    for model in [DistortionModel::PlumbBob, DistortionModel::Equidistant] {
        let lens = truth(model);
        let wanted = bundle::parameters(&lens);
        for _ in 0..12 {
            let fit = bundle::fitted(&lens, measured(&lens, &mut random)).expect("fits");
            let covariance = covariance::of_the_lens(&fit).expect("determined");
            let quantile = crate::uncertain::student_t_95(covariance.freedom);
            for (k, (found, wanted)) in bundle::parameters(&fit.lens).iter().zip(&wanted).enumerate() {
                all += 1;
                inside += i32::from((found - wanted).abs() < quantile * covariance.matrix[(k, k)].sqrt());
            }
        }
    }
    let percent = 100.0 * f64::from(inside) / f64::from(all);
    assert!((88.0..=99.6).contains(&percent), "{inside} of {all} intervals hold ({percent:.1} %)");
}

#[test]
fn a_rational_lens_is_fitted_from_far_off() {
    let mut random = Pcg64Mcg::seed_from_u64(8);
    let lens = truth(DistortionModel::RationalPolynomial);
    let start = Lens::new([500.0; 2], [319.5, 239.5], Distortion::RationalPolynomial([0.0; 8]));
    let fit = bundle::fitted(&start, measured(&lens, &mut random)).expect("fits");
    // Its coefficients trade against each other; the map of the picture does not.
    for k in 0..100 {
        let pixel = Pixel::new(f64::from(k % 10) * 71.0, f64::from(k / 10) * 53.0);
        let (Some(a), Some(b)) = (lens.ray_from_pixel(pixel), fit.lens.ray_from_pixel(pixel)) else {
            panic!("no ray at {pixel:?}")
        };
        let off_px = (a[0] - b[0]).hypot(a[1] - b[1]) * 560.0;
        assert!(off_px < 3.0, "{off_px:.2} px at {pixel:?}");
    }
}

#[test]
fn a_printed_board_holds_its_tags_once_where_its_geometry_has_them() {
    let (svg, board) = crate::capture::board_sheet([6, 4], None).expect("fits A4");
    assert_eq!(board.tags.len(), 24);
    assert_eq!(svg.matches("fill-rule=\"evenodd\"").count(), 24);
    assert!(svg.contains("width=\"297mm\" height=\"210mm\""), "A4, landscape");
    roxmltree::Document::parse(&svg).expect("well-formed XML");
    // The first tag's black square begins where its position has it, the board being centred on the page.
    let side_mm = board.tags[0].size_m * 1e3;
    let left = 297.0 / 2.0 + board.tags[0].center_m.x * 1e3 - side_mm / 2.0;
    assert!(svg.contains(&format!("d=\"M{left:.4} ")), "{left} mm");
    let (large, _) = crate::capture::board_sheet([10, 10], Some(0.08)).expect("a larger page");
    assert!(large.contains("width=\"1020mm\""), "{}", &large[..200]);
    for (grid, size_m) in [([1, 4], None), ([30, 30], None), ([6, 4], Some(f64::NAN)), ([6, 4], Some(9.0))] {
        assert!(crate::capture::board_sheet(grid, size_m).is_err(), "{grid:?} {size_m:?}");
    }
}
