//! Slides on supports that are no round patch, against friction summed over the pressure points in small time steps.

use super::body::Body;
use super::limit_surface::{LimitSurface, Surface, friction_on_points};
use super::motion::{Motion, SpeedLaw, State};
use super::patch_friction::Spin;
use super::patch_friction::{PATCH_RADIUS_PER_ARM, patch_force_and_torque};
use super::pressure::pressure_points;
use super::slide_curve::SlideCurve;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Shape, Support};
use crate::physics::contact::compound_shape::CompoundShape;
use crate::physics::rotation::{Rotation, length};
use std::sync::Arc;

fn body(shape: &Shape, support: Option<&Support>, surface: Surface) -> Body {
    let patch_radius_m = PATCH_RADIUS_PER_ARM * shape.mean_arm_m();
    let gyration_m = shape.radius_of_gyration_m();
    Body {
        shape: Arc::new(CompoundShape::new(shape)),
        pose: Pose::default(),
        inverse_mass: 10.0,
        inverse_inertia: 10.0 / (gyration_m * gyration_m),
        friction_deceleration_m_s2: 0.3 * 9.81,
        patch_radius_m,
        curve: Arc::new(SlideCurve::new((gyration_m / patch_radius_m).powi(2))),
        limit_surface: LimitSurface::new(shape, support, surface, patch_radius_m).map(Arc::new),
        tilt_m_s2: Vec2::ZERO,
        kind: 1,
    }
}

/// The final pose of a launched body, by pieces of motion.
fn stop_by_pieces(body: &Body, launch: &State) -> Pose {
    let (mut time_s, mut state) = (0.0, *launch);
    loop {
        let motion = Motion::slide(&state, time_s, body, Spin::Coupled);
        let SpeedLaw::Piece { next_velocity } = motion.law else { return motion.end };
        time_s = motion.stop_s;
        state = State { velocity: next_velocity, ..motion.state(time_s, body) };
    }
}

/// The final poses of a launched body: by pieces of motion, and by friction summed over the points in steps of 50 us.
fn stops(shape: &Shape, support: Option<&Support>, surface: Surface, launch: &State) -> (Pose, Pose) {
    let body = body(shape, support, surface);
    let by_pieces = stop_by_pieces(&body, launch);
    let points = pressure_points(shape, support);
    let (step_s, mut now) = (5e-5, *launch);
    while length(now.velocity) + now.yaw_rate_rad_s.abs() * body.patch_radius_m > 2e-3 {
        let rotation = Rotation::new(now.yaw_rad);
        let velocity = rotation.apply_inverse(now.velocity);
        let [x, y, t] = friction_on_points(&points, velocity, now.yaw_rate_rad_s, body.patch_radius_m);
        let force = rotation.apply(Vec2::new(x, y));
        let grain = Vec2::from_heading(surface.grain_rad);
        let across = force - grain * force.dot(grain);
        let deceleration =
            body.friction_deceleration_m_s2 * (1.0 + surface.growth_s_m * length(now.velocity));
        now.velocity += (force + across * (surface.across - 1.0)) * (deceleration * step_s);
        now.yaw_rate_rad_s += t * body.patch_radius_m * body.inverse_inertia / 10.0 * deceleration * step_s;
        now.position += now.velocity * step_s;
        now.yaw_rad += now.yaw_rate_rad_s * step_s;
    }
    (by_pieces, Pose { position: now.position, yaw_rad: now.yaw_rad })
}

/// Median distance (m) between the two final positions over launches of many directions and spins.
fn median_error_m(shape: &Shape, support: Option<&Support>) -> f64 {
    let mut errors: Vec<f64> = (0..15)
        .map(|k| {
            let (k, rim) = (f64::from(k), [0.1, 0.3, 0.6, 0.9, 0.2][k as usize % 5]);
            let launch = State {
                velocity: Vec2::from_heading(0.42 * k) * (0.2 + 0.05 * k),
                yaw_rate_rad_s: rim / 0.04 * (0.42 * k).cos().signum(),
                ..State::default()
            };
            let (one, two) = stops(shape, support, Surface::default(), &launch);
            one.position.distance(two.position)
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    errors[errors.len() / 2]
}

#[test]
fn a_curved_path_ends_where_summed_friction_leads() {
    let rectangle = |x: f64, y: f64| Shape::Rectangle { size_m: [x, y] };
    let feet = |angle: f64| Point::ORIGIN + Vec2::from_heading(angle) * 0.03;
    for (shape, support) in [
        (rectangle(0.1, 0.04), None),
        (rectangle(0.12, 0.015), None),
        (Shape::Disc { radius_m: 0.04 }, Some(Support::Feet(vec![feet(0.0), feet(2.0944), feet(4.1888)]))),
        (rectangle(0.08, 0.08), Some(Support::Gradient(Vec2::new(15.0, 0.0)))),
    ] {
        let error_m = median_error_m(&shape, support.as_ref());
        assert!(error_m < 8e-4, "{shape:?} {support:?}: {} mm", error_m * 1e3);
    }
}

#[test]
fn friction_across_the_grain_deflects_a_slide_along_the_grain() {
    let surface = Surface { grain_rad: 0.0, across: 1.5, growth_s_m: 0.2 };
    let launch = State { velocity: Vec2::from_heading(0.8) * 0.6, ..State::default() };
    let shape = Shape::Disc { radius_m: 0.04 };
    let (one, two) = stops(&shape, None, surface, &launch);
    assert!(one.position.distance(two.position) < 3e-4, "{one:?}, not {two:?}");
    assert!(one.position.to_vec().direction().expect("a distance").y < 0.8f64.sin() - 0.02, "{one:?}");
}

#[test]
fn a_square_needs_no_limit_surface() {
    let square = Shape::Rectangle { size_m: [0.08, 0.08] };
    assert!(body(&square, None, Surface::default()).limit_surface.is_none());
}

/// The final pose of a launched disc on a tilted table: by pieces of motion, and by the law of the round patch in steps of 20 us.
fn stops_on_a_slope(slope: Vec2, launch: &State) -> (Pose, Pose) {
    let mut body = body(&Shape::Disc { radius_m: 0.04 }, None, Surface::default());
    body.tilt_m_s2 = slope * 9.81;
    let by_pieces = stop_by_pieces(&body, launch);
    let (step_s, mut now, radius_m) = (2e-5, *launch, body.patch_radius_m);
    let kappa = 1.0 / (body.inverse_inertia / body.inverse_mass * radius_m * radius_m);
    while length(now.velocity) + now.yaw_rate_rad_s.abs() * radius_m > 1e-3 {
        let (speed, rim) = (length(now.velocity), now.yaw_rate_rad_s.abs() * radius_m);
        let [force, torque] = patch_force_and_torque(speed / rim.max(1e-12));
        let braking = body.friction_deceleration_m_s2;
        now.velocity +=
            now.velocity * (-force * braking / speed.max(1e-12) * step_s) + slope * (9.81 * step_s);
        now.yaw_rate_rad_s -= (torque * braking / (kappa * radius_m) * step_s).copysign(now.yaw_rate_rad_s);
        now.position += now.velocity * step_s;
        now.yaw_rad += now.yaw_rate_rad_s * step_s;
    }
    (by_pieces, Pose { position: now.position, yaw_rad: now.yaw_rad })
}

#[test]
fn a_body_on_a_tilted_table_ends_where_small_steps_lead() {
    for (slope_deg, rim_m_s) in [(0.2, 0.0), (0.2, 0.4), (2.0, 0.0), (2.0, 0.3), (5.0, -0.6)] {
        let slope = Vec2::from_heading(1.1) * f64::to_radians(slope_deg).sin();
        for heading_rad in [0.0, 1.1, 2.0, 4.2] {
            let velocity = Vec2::from_heading(heading_rad) * 0.5;
            let launch = State { velocity, yaw_rate_rad_s: rim_m_s / 0.04, ..State::default() };
            let (one, two) = stops_on_a_slope(slope, &launch);
            // A thousandth of the path, as on curved paths of the level table.
            let error_m = one.position.distance(two.position);
            assert!(
                error_m < 3e-4,
                "{slope_deg} degrees, rim {rim_m_s}, heading {heading_rad}: {} mm",
                error_m * 1e3
            );
            assert!((one.yaw_rad - two.yaw_rad).abs() < 0.02, "{one:?}, not {two:?}");
        }
    }
}

#[test]
fn a_slide_across_a_gentle_slope_is_deflected_by_a_quarter_of_g_times_slope_times_time_squared() {
    let slope = Vec2::new(0.0, 0.002);
    let launch = State { velocity: Vec2::new(0.6, 0.0), ..State::default() };
    let (end, _) = stops_on_a_slope(slope, &launch);
    let time_s = 0.6 / (0.3 * 9.81);
    let expected_m = 9.81 * slope.y * time_s * time_s / 4.0;
    assert!((end.position.y / expected_m - 1.0).abs() < 0.03, "{} m, not {expected_m}", end.position.y);
}
