//! Drafts of drawn pictures.

use super::regions::SearchPlanes;
use super::*;
use crate::capture::{Footage, Frame, Lens};
use crate::cell::Cell;
use crate::cell::{Striker, Transform, Workspace};
use crate::detect::label::Window;
use crate::geometry::Point;
use crate::geometry::outline::Outline;
use crate::object::{Dot, Marker};
use crate::synthetic::film::{Thing, View, picture};

fn camera() -> Camera {
    let at = Transform { position_m: [0.01, -0.1, 0.7], rpy_rad: [0.15, 0.02, 0.05] };
    Camera::new([1000, 640], Lens::pinhole([1000, 640], 1100.0), at)
}

fn object(shape: Shape, marker: Option<Marker>) -> Object {
    Object { name: "drawn".into(), shape, height_m: 0.03, marker, mass_kg: None, support: None }
}

fn drafted(drawn: &[(Object, Pose)], heights: &Heights) -> Result<Draft> {
    let view = View { shading: [0.3, -0.2], noise: 3.0, ..View::new(camera()) };
    let things = drawn.iter().flat_map(|(object, pose)| {
        let [body, marker] = Thing::object(object, *pose);
        let marker = object.marker.is_some().then_some(marker);
        [Some(body), marker, Thing::dot(object, *pose)].into_iter().flatten()
    });
    let image = picture(&view, &things.collect::<Vec<_>>());
    let cell = Cell::from_above(1000.0, Workspace::centred([0.5, 0.3]), Striker::rod(0.01, [0.1, 1.0]));
    let footage = Footage::from_frames("drawn", vec![Frame { time_s: 0.0, image }]);
    draft(Capture { footage, camera: view.camera, cell }, Vec::new(), heights)
}

fn heights() -> Heights {
    Heights { default_m: 0.03, ..Heights::default() }
}

/// The root mean square distance of a drafted outline from the drawn one (m).
fn outline_rms_m(drafted: &Drafted, (object, pose): &(Object, Pose)) -> f64 {
    let truth = Outline::new(&object.shape, *pose);
    let points = drafted.object.shape.outline_points();
    let off_m = points.iter().map(|&p| truth.border_distance_m(drafted.pose.table_from_body(p)));
    (off_m.map(|off_m| off_m * off_m).sum::<f64>() / points.len() as f64).sqrt()
}

fn drawn() -> Vec<(Object, Pose)> {
    let dotted = Marker {
        shape: Shape::Disc { radius_m: 0.008 },
        at_m: Point::new(-0.006, 0.0),
        dot: Some(Dot { radius_m: 0.004, at_m: Point::new(0.012, 0.0) }),
        thickness_m: 0.0,
    };
    let bar = Marker {
        at_m: Point::new(0.004, 0.002),
        ..Marker::centred(Shape::Rectangle { size_m: [0.02, 0.009] })
    };
    let mut wedge = Shape::Polygon {
        points_m: [(0.0, 0.0), (0.06, 0.0), (0.02, 0.05)].map(|(x, y)| Point::new(x, y)).to_vec(),
    };
    wedge.check_and_centre("a wedge").expect("a polygon");
    vec![
        (object(Shape::Disc { radius_m: 0.03 }, Some(dotted)), Pose::new(-0.15, 0.05, 0.4)),
        (object(Shape::Rectangle { size_m: [0.06, 0.04] }, Some(bar)), Pose::new(-0.02, -0.03, 0.3)),
        (object(wedge, None), Pose::new(0.12, 0.04, 1.0)),
    ]
}

#[test]
fn a_disc_a_rectangle_and_a_triangle_are_drafted_from_one_picture() {
    let drawn = drawn();
    let draft = drafted(&drawn, &heights()).expect("a draft");
    assert_eq!(draft.objects.len(), 3, "{:?} {:?}", draft.objects, draft.warnings);
    for (number, (drafted, truth)) in draft.objects.iter().zip(&drawn).enumerate() {
        let rms_m = outline_rms_m(drafted, truth);
        println!("{}: {:.3} mm, {:?}", drafted.object.name, 1e3 * rms_m, drafted.object);
        assert_eq!(drafted.object.name, format!("object_{}", number + 1));
        assert!(std::mem::discriminant(&drafted.object.shape) == std::mem::discriminant(&truth.0.shape));
        assert!(rms_m < 0.3e-3, "{} is {} mm off", drafted.object.name, 1e3 * rms_m);
        let (Some(found), Some(given)) = (&drafted.object.marker, &truth.0.marker) else {
            assert!(drafted.object.marker.is_none() == truth.0.marker.is_none(), "{:?}", drafted.object);
            continue;
        };
        let pairs = [Some((found.at_m, given.at_m)), found.dot.zip(given.dot).map(|(a, b)| (a.at_m, b.at_m))];
        for (found_m, given_m) in pairs.into_iter().flatten() {
            let off_m = drafted.pose.table_from_body(found_m).distance(truth.1.table_from_body(given_m));
            assert!(off_m < 0.2e-3, "the marker of {} is {} mm off", drafted.object.name, 1e3 * off_m);
        }
        assert_eq!(found.dot.is_some(), given.dot.is_some());
    }
}

#[test]
fn an_outline_is_measured_in_the_plane_of_the_given_height() {
    let drawn = drawn();
    let radius_m = |heights: &Heights| {
        let draft = drafted(&drawn, heights).expect("a draft");
        match draft.objects[0].object.shape {
            Shape::Disc { radius_m } => radius_m,
            _ => f64::NAN,
        }
    };
    let named = Heights { named_m: BTreeMap::from([("object_1".into(), 0.03)]), default_m: 0.1 };
    let (right, wrong) = (radius_m(&named), radius_m(&Heights { default_m: 0.1, ..Heights::default() }));
    assert!((right - 0.03).abs() < 0.2e-3, "{right} m");
    // The camera is 0.7 m above the table.
    assert!((wrong / right - 0.6 / 0.67).abs() < 0.01, "{wrong} m against {right} m");
}

#[test]
fn an_empty_table_and_a_height_of_nothing_are_errors_that_name_what_is_needed() {
    let error = drafted(&[], &heights()).expect_err("nothing there").to_string();
    assert!(error.contains("stands out"), "{error}");
    let named = Heights { named_m: BTreeMap::from([("object_7".into(), 0.03)]), ..heights() };
    let error = drafted(&drawn(), &named).expect_err("no such object").to_string();
    assert!(error.contains("object_7") && error.contains("object_3"), "{error}");
}

#[test]
fn strips_are_no_objects_without_markers() {
    let is_wide = |x_m, y_m| super::candidates::is_wide(&Shape::Rectangle { size_m: [x_m, y_m] });
    assert!(is_wide(0.03, 0.013) && is_wide(0.07, 0.02));
    assert!(!is_wide(0.03, 0.01) && !is_wide(0.13, 0.014));
}

/// A round picture: its grey level by the distance from the centre (px).
fn round(grey: impl Fn(f64) -> f64) -> GreyImage {
    const SIDE: usize = 120;
    let distance_px = |k: usize| ((k % SIDE) as f64 - 60.0).hypot((k / SIDE) as f64 - 60.0);
    let pixels = (0..SIDE * SIDE).map(|k| grey(distance_px(k)).round() as u8).collect();
    GreyImage { width: SIDE, height: SIDE, pixels }
}

/// Whether a region of a picture is a top that carries another one.
fn carries(image: &GreyImage) -> bool {
    let window = Window::whole(image);
    let regions = SearchPlanes::new(std::slice::from_ref(image)).regions(0, window, &(100..=8000));
    assert!(!regions.is_empty());
    regions.iter().any(|top| regions.iter().any(|marker| candidates::can_carry(top, marker)))
}

#[test]
fn a_blurred_edge_is_not_that_of_a_top_and_of_a_marker_on_it() {
    // The edge from 230 to 20 is four pixels wide.
    let edge = |distance_px: f64, radius_px: f64| ((distance_px - radius_px) / 4.0 + 0.5).clamp(0.0, 1.0);
    assert!(!carries(&round(|at| 230.0 - 210.0 * edge(at, 14.0))));
    assert!(carries(&round(|at| 230.0 - 210.0 * edge(at, 14.0) + 100.0 * edge(at, 40.0))));
}

#[test]
fn a_dot_of_seven_pixels_belongs_to_its_marker() {
    let mut drawn = drawn();
    let small = Marker {
        shape: Shape::Disc { radius_m: 0.006 },
        at_m: Point::new(-0.006, 0.0),
        dot: Some(Dot { radius_m: 0.0021, at_m: Point::new(0.006, 0.0) }),
        thickness_m: 0.0,
    };
    drawn[0].0.marker = Some(small);
    let draft = drafted(&drawn, &heights()).expect("a draft");
    let found = draft.objects[0].object.marker.as_ref().expect("a marker");
    let dot = found.dot.expect("a dot");
    let at = |off_m: Point| draft.objects[0].pose.table_from_body(off_m);
    let off_m = at(dot.at_m).distance(drawn[0].1.table_from_body(Point::new(0.006, 0.0)));
    assert!(off_m < 0.2e-3 && (dot.radius_m - 0.0021).abs() < 0.3e-3, "{off_m} m off: {found:?}");
}
