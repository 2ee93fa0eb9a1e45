use super::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

#[test]
fn a_pixel_taken_to_its_ray_and_back_is_the_same_pixel() {
    for distortion in [
        [0.0; 5],
        [-0.045, 0.012, 0.0, 0.0, 0.0],
        [-0.32, 0.11, 0.002, -0.003, -0.01],
        [0.25, -0.1, -0.004, 0.001, 0.05],
    ] {
        let lens = Lens::new([900.0, 905.0], [631.2, 358.7], distortion);
        lens.check("lens", [1280, 720]).expect("a lens that holds to the corners");
        for k in 0..200 {
            let pixel = Pixel::new(f64::from(k * 37 % 1280), f64::from(k * 53 % 720));
            let ray = lens.ray_from_pixel(pixel).expect("inside the picture");
            let back = lens.pixel_from_ray(ray).expect("its own ray");
            assert!(back.distance_px(pixel) < 1e-9, "{pixel:?} came back as {back:?}");
        }
    }
}

#[test]
fn a_lens_that_folds_the_picture_is_an_error() {
    let folded = Distortion::RationalPolynomial([-0.9, 0.0, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0]);
    for distortion in [
        Distortion::PlumbBob([-0.9, 0.0, 0.0, 0.0, 0.0]),
        folded,
        Distortion::Equidistant([-1.3, 0.0, 0.0, 0.0]),
    ] {
        let lens = Lens::new([900.0; 2], [639.5, 359.5], distortion);
        let message = lens.check("cell.toml", [1280, 720]).expect_err("not one to one").to_string();
        assert!(message.contains("cell.toml") && message.contains("folds"), "{message}");
    }
}

/// A lens of the model, from weak to strong, with its picture's size.
fn drawn(model: DistortionModel, random: &mut Pcg64) -> Lens {
    let mut draw = |largest: f64| random.random_range(-largest..largest);
    let focal = 900.0 * (1.0 + draw(0.5));
    let distortion = match model {
        DistortionModel::PlumbBob => {
            Distortion::PlumbBob([draw(0.4), draw(0.2), draw(0.003), draw(0.003), draw(0.05)])
        }
        DistortionModel::RationalPolynomial => {
            let (k4, k5, k6) = (draw(0.6), draw(0.3), draw(0.1));
            let near = [k4 + draw(0.3), k5 + draw(0.15), k6 + draw(0.05)];
            Distortion::RationalPolynomial([near[0], near[1], draw(0.003), draw(0.003), near[2], k4, k5, k6])
        }
        DistortionModel::Equidistant => {
            Distortion::Equidistant([draw(0.15), draw(0.06), draw(0.02), draw(0.005)])
        }
    };
    Lens::new([focal, focal * (1.0 + draw(0.01))], [639.5 + draw(20.0), 359.5 + draw(20.0)], distortion)
}

#[test]
fn a_thousand_drawn_lenses_of_each_model_are_inverted_wherever_they_are_one_to_one() {
    let mut random = Pcg64::seed_from_u64(11);
    for model in DistortionModel::ALL {
        let (mut worst_px, mut inside, mut folded): (f64, u32, u32) = (0.0, 0, 0);
        for _ in 0..1000 {
            let lens = drawn(model, &mut random);
            let longest = lens.max_ray_squared.sqrt();
            for _ in 0..40 {
                // A ray that the lens represents comes back where the map does not fold; tangential terms fold earlier.
                let (length, angle): (f64, f64) =
                    (0.98 * longest.min(2.5) * random.random::<f64>(), random.random_range(0.0..6.3));
                let ray = [length * angle.cos(), length * angle.sin()];
                if jacobian_determinant(&lens, ray) < 0.02 {
                    continue;
                }
                let pixel = lens.pixel_from_ray(ray).expect("shorter than the longest");
                let back = lens
                    .ray_from_pixel(pixel)
                    .unwrap_or_else(|| panic!("{lens:?} has no ray at {pixel:?} of {ray:?}"));
                let again = lens.pixel_from_ray(back).expect("its own ray");
                worst_px = worst_px.max(again.distance_px(pixel));
                let error = (back[0] - ray[0]).hypot(back[1] - ray[1]);
                assert!(error < 1e-9, "{lens:?}: {ray:?} came back as {back:?}");
                inside += 1;
                // A pixel far outside has a ray that maps to it, or none.
                let far = Pixel::new(
                    pixel.x + random.random_range(-2e4..2e4),
                    pixel.y + random.random_range(-2e4..2e4),
                );
                match lens.ray_from_pixel(far) {
                    Some(ray) => {
                        let error = lens.pixel_from_ray(ray).map(|back| back.distance_px(far));
                        assert!(
                            error.is_some_and(|px| px < 1e-6),
                            "{lens:?}: {far:?} came back {error:?} px off"
                        );
                    }
                    None => folded += 1,
                }
            }
        }
        assert!(worst_px < 1e-9, "{model:?}: {worst_px} px over {inside} rays");
        assert!(inside > 30_000 && folded > 1000, "{model:?}: {inside} rays, {folded} pixels without one");
    }
}

/// The determinant of the derivative of the distorted ray by the ray, from differences.
fn jacobian_determinant(lens: &Lens, [x, y]: [f64; 2]) -> f64 {
    let h = 1e-6;
    let at = |x: f64, y: f64| model::distorted(&lens.distortion, [x, y]);
    let (right, left, down, up) = (at(x + h, y), at(x - h, y), at(x, y + h), at(x, y - h));
    let (xx, yx) = ((right[0] - left[0]) / (2.0 * h), (right[1] - left[1]) / (2.0 * h));
    let (xy, yy) = ((down[0] - up[0]) / (2.0 * h), (down[1] - up[1]) / (2.0 * h));
    xx * yy - xy * yx
}

#[test]
fn a_lens_is_written_with_its_model_unless_that_is_plumb_bob() {
    let plumb_bob = Lens::new([900.0, 905.0], [631.0, 358.0], [0.1, 0.2, 0.3, 0.4, 0.5]);
    let text = serde_json::to_string(&plumb_bob).expect("writes");
    assert_eq!(
        text,
        r#"{"focal_px":[900.0,905.0],"center_px":[631.0,358.0],"distortion":[0.1,0.2,0.3,0.4,0.5]}"#
    );
    let fisheye = Lens::new([900.0, 905.0], [631.0, 358.0], Distortion::Equidistant([0.01, 0.0, 0.0, 0.0]));
    for lens in [plumb_bob, fisheye] {
        let text = serde_json::to_string(&lens).expect("writes");
        assert_eq!(serde_json::from_str::<Lens>(&text).expect("reads"), lens, "{text}");
    }
    let wrong = r#"{"focal_px":[900.0,905.0],"center_px":[631.0,358.0],"distortion":[1,2,3,4,5],"distortion_model":"equidistant"}"#;
    assert!(
        serde_json::from_str::<Lens>(wrong).expect_err("five numbers").to_string().contains("k1 k2 k3 k4")
    );
}
