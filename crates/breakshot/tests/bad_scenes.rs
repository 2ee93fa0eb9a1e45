//! Impossible scenes are errors that name the object and the number.

mod piles;

use breakshot::geometry::{Point, Pose};
use breakshot::object::{Shape, Support};
use breakshot::physics::trajectory;
use breakshot::uncertain::Estimate;
use piles::{Pile, disc};

fn two_discs() -> Pile {
    let mut pile = Pile::new();
    pile.add(disc(0.05), (0.1, 0.25, 0.7), Pose::default());
    pile.add(disc(0.03), (0.05, 0.3, 0.6), Pose::new(0.1, 0.0, 0.0));
    pile
}

/// The message of the error that a changed pile gives.
fn message(change: impl Fn(&mut Pile)) -> String {
    let mut pile = two_discs();
    change(&mut pile);
    trajectory(&pile.scene, &pile.properties, &pile.strike, &pile.options)
        .expect_err("an impossible pile")
        .to_string()
}

fn assert_names(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is missing in: {message}");
    }
}

#[test]
fn a_possible_pile_is_no_error() {
    let pile = two_discs();
    assert!(trajectory(&pile.scene, &pile.properties, &pile.strike, &pile.options).is_ok());
}

#[test]
fn overlapping_objects_are_named_with_their_overlap() {
    let error = message(|p| p.scene.placed[1].position_m = Point::new(0.075, 0.0));
    assert_names(&error, &["o000", "o001", "5.000 mm"]);
}

#[test]
fn a_striker_that_starts_inside_an_object_is_an_error_with_the_depth() {
    let error = message(|p| p.strike.start_m = Point::new(-0.06, 0.0));
    assert_names(&error, &["strike", "o000", "5.000 mm"]);
}

#[test]
fn a_mass_must_be_positive() {
    for mass in [0.0, -0.1, f64::NAN] {
        let error =
            message(|p| *p.properties.mass_ratio.get_mut("o001").expect("known") = Estimate::exact(mass));
        assert_names(&error, &["o001", &mass.to_string()]);
    }
}

#[test]
fn restitution_is_between_0_and_1() {
    for e in [-0.1, 1.2, f64::NAN] {
        let error =
            message(|p| *p.properties.restitution.get_mut("o000/o001").expect("known") = Estimate::exact(e));
        assert_names(&error, &["o000/o001", &e.to_string()]);
        let error = message(|p| {
            *p.properties.striker_restitution.get_mut("o001").expect("known") = Estimate::exact(e);
        });
        assert_names(&error, &["o001", &e.to_string()]);
    }
}

#[test]
fn friction_is_not_negative() {
    for friction in [-0.2, f64::NAN] {
        let error =
            message(|p| *p.properties.friction.get_mut("o000").expect("known") = Estimate::exact(friction));
        assert_names(&error, &["o000", &friction.to_string()]);
        let error = message(|p| p.contact_friction(friction));
        assert_names(&error, &["contact_friction", &friction.to_string()]);
    }
}

#[test]
fn positions_and_strikes_are_numbers() {
    assert_names(&message(|p| p.scene.placed[1].position_m.x = f64::NAN), &["o001", "not a number"]);
    assert_names(&message(|p| p.scene.placed[0].yaw_rad = f64::INFINITY), &["o000", "not a number"]);
    assert_names(&message(|p| p.strike.speed_m_s = f64::NAN), &["strike", "speed_m_s", "NaN"]);
    assert_names(&message(|p| p.strike.travel_m = -0.1), &["strike", "travel_m", "-0.1"]);
}

#[test]
fn an_outline_needs_an_area() {
    let line = vec![Point::new(0.0, 0.0), Point::new(0.02, 0.0), Point::new(0.04, 0.0)];
    let error = message(|p| p.scene.objects[1].shape = Shape::Polygon { points_m: line.clone() });
    assert_names(&error, &["o001", "area"]);
}

#[test]
fn an_object_needs_three_feet() {
    let error = message(|p| {
        p.scene.objects[0].support = Some(Support::Feet(vec![Point::ORIGIN, Point::new(0.01, 0.0)]));
    });
    assert_names(&error, &["o000", "2 feet"]);
}
