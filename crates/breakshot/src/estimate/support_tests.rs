//! The spin after an impact is found although the contact patch of the body is unknown.

use super::clip::fit::MotionFit;
use super::clip::initial_guess::InitialGuess;
use super::clip::motion_model::{Body, Cause, Event, Exposure, MotionModel, Observation};
use super::clip::sliding::{MotionState, Slide, SlideParameters, patch_radius_m};
use crate::geometry::{Pose, Vec2};
use crate::object::Shape;

const STRUCK_S: f64 = 0.105;
const FRICTION: f64 = 0.22;

/// The state just after a square is set in motion, drawn and fitted, if the table decelerates its spin `factor` times as
/// strongly as on its whole area.
fn drawn_and_fitted(factor: f64) -> (MotionState, MotionState) {
    let shape = Shape::Rectangle { size_m: [0.05, 0.05] };
    let patch_radius_m = patch_radius_m(&shape);
    let gyration_m = shape.radius_of_gyration_m();
    let friction =
        SlideParameters { friction: FRICTION, patch_radius_m: factor * patch_radius_m, gyration_m };
    let rest = MotionState { pose: Pose::new(0.1, 0.2, 0.3), ..MotionState::default() };
    let struck = MotionState { velocity: Vec2::new(0.3, 0.05), spin_rad_s: 8.0, ..rest };
    let slide = Slide::new(STRUCK_S, struck, &friction);
    let observations = (0..30).map(|k| {
        let time_s = f64::from(k) / 60.0;
        let pose = if time_s < STRUCK_S { rest.pose } else { slide.motion(time_s).pose };
        Observation {
            time_s,
            position: pose.position,
            yaw_rad: Some(pose.yaw_rad),
            std_m: 5e-5,
            doubtful: false,
            excluded: false,
        }
    });
    let body = Body {
        object: "block".into(),
        observations: observations.collect(),
        shape,
        patch_radius_m,
        gyration_m,
        height_m: 0.03,
        yaw_observed: true,
        moves_at_start: false,
        expected_friction: None,
    };
    let mut model = MotionModel::new(vec![body], Exposure::Known(0.0));
    model.events.push(Event { cause: Cause::Unknown, members: vec![0] });
    let fitted = MotionFit::from_guess(InitialGuess::from_times(model, &[STRUCK_S - 0.004]));
    (struck, fitted.paths[0].motion(fitted.paths[0].onset_s()))
}

#[test]
fn the_spin_of_a_body_on_its_corners_or_on_feet_is_fitted_correctly() {
    for factor in [0.6, 1.0, 1.8] {
        let (drawn, found) = drawn_and_fitted(factor);
        let ratio = found.spin_rad_s / drawn.spin_rad_s;
        assert!(
            (ratio - 1.0).abs() < 0.02,
            "spin decelerated {factor} times as strongly: {ratio} of the spin"
        );
        let error_m_s = (found.velocity - drawn.velocity).length();
        assert!(error_m_s < 0.002, "spin decelerated {factor} times as strongly: error {error_m_s} m/s");
    }
}
