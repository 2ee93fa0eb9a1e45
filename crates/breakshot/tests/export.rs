//! The model for MuJoCo holds what the scene holds.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod piles;

use breakshot::geometry::{Point, Pose};
use breakshot::object::Shape;
use breakshot::physics::mjcf;
use breakshot::scene::{KeepOut, Wall};
use piles::{Pile, disc, four_shapes};
use roxmltree::{Document, Node};

fn named<'a>(model: &'a Document, tag: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    model.descendants().filter(move |node| node.has_tag_name(tag))
}

fn numbers(node: Node, attribute: &str) -> Vec<f64> {
    node.attribute(attribute).unwrap().split_whitespace().map(|n| n.parse().unwrap()).collect()
}

/// Four convex shapes, an angle of two parts, a disc, and a wall.
fn pile() -> Pile {
    let mut pile = four_shapes(3);
    let angle = [[0.0, 0.0], [0.06, 0.0], [0.06, 0.02], [0.02, 0.02], [0.02, 0.06], [0.0, 0.06]];
    let mut angle = Shape::Polygon { points_m: angle.iter().map(|p| Point::new(p[0], p[1])).collect() };
    angle.check_and_centre("angle").unwrap();
    pile.add(angle, (0.2, 0.3, 0.7), Pose::new(0.5, 0.5, 0.4));
    pile.add(disc(0.03), (0.1, 0.2, 0.6), Pose::new(-0.5, 0.5, 0.0));
    pile.contact_friction(0.1);
    pile.scene.walls.push(Wall {
        from_m: Point::new(1.0, -0.5),
        to_m: Point::new(1.0, 0.5),
        restitution: 0.4,
    });
    pile
}

#[test]
fn the_model_holds_every_body_pair_and_speed() {
    let pile = pile();
    let text = mjcf(&pile.scene, &pile.properties, &pile.strike, &pile.options).unwrap().text;
    let model = Document::parse(&text).unwrap();
    let bodies: Vec<Node> = named(&model, "body").collect();
    assert_eq!(bodies.len(), 7, "striker and six objects");
    for (body, placed) in bodies[1..].iter().zip(&pile.scene.placed) {
        assert_eq!(body.attribute("name"), Some(placed.object.as_str()));
        assert_eq!(numbers(*body, "pos"), [placed.position_m.x, placed.position_m.y, 0.0]);
        assert_eq!(numbers(*body, "euler")[2], placed.yaw_rad);
        let inertial = body.children().find(|n| n.has_tag_name("inertial")).unwrap();
        let mass = numbers(inertial, "mass")[0];
        let ratio = pile.properties.mass_ratio[&placed.object].mean;
        assert!((mass / ratio - 1.0).abs() < 1e-12, "{mass} kg, not {ratio}");
        let foot = body.children().find(|n| n.attribute("priority").is_some()).unwrap();
        let friction = pile.properties.friction[&placed.object].mean;
        assert!((numbers(foot, "friction")[0] / friction - 1.0).abs() < 1e-12);
    }
    // Seven convex bodies and a wall; the angle has two parts: one more for each other body.
    // Pairs: 6 objects with the striker, 15 of objects, 6 with the wall, and the angle's second part with 7 others.
    assert_eq!(named(&model, "pair").count(), 6 + 15 + 6 + 7);
    let key = named(&model, "key").next().unwrap();
    let speeds = numbers(key, "qvel");
    assert_eq!(speeds.len(), 1 + 4 * 6, "one joint of the striker, four of each object");
    assert_eq!(speeds[0], pile.strike.speed_m_s);
    assert!(speeds[1..].iter().all(|v| *v == 0.0));
    for pair in named(&model, "pair") {
        let spring = numbers(pair, "solref");
        assert!(spring.iter().all(|v| *v < 0.0 && v.is_finite()), "{spring:?}");
    }
}

#[test]
fn what_is_left_out_is_said_in_the_model() {
    let mut pile = pile();
    let corner = |x: f64, y: f64| Point::new(x, y);
    let area = KeepOut { points_m: vec![corner(0.0, 1.0), corner(0.1, 1.0), corner(0.1, 1.1)] };
    pile.scene.keep_out.push(area);
    let model = mjcf(&pile.scene, &pile.properties, &pile.strike, &pile.options).unwrap();
    assert!(model.notes.iter().any(|note| note.contains("keep-out")), "{:?}", model.notes);
    for note in &model.notes {
        assert!(model.text.contains(note.as_str()), "{note}");
    }
}

#[test]
fn what_cannot_be_simulated_is_not_exported() {
    let refused = |pile: &Pile, words: &[&str]| {
        let error = mjcf(&pile.scene, &pile.properties, &pile.strike, &pile.options).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` is not in: {error}");
        }
    };
    let mut overlapping = pile();
    overlapping.scene.placed[5].position_m = overlapping.scene.placed[4].position_m;
    refused(&overlapping, &["overlap", "o004", "o005"]);
    let mut inside = pile();
    inside.strike.start_m = inside.scene.placed[0].position_m;
    refused(&inside, &["start_m", "o000"]);
}

#[test]
fn what_was_not_measured_is_assumed_with_a_note() {
    let mut unknown = pile();
    unknown.properties.friction.remove("o002");
    let model = mjcf(&unknown.scene, &unknown.properties, &unknown.strike, &unknown.options);
    let notes = model.expect("a model").notes;
    assert!(notes.iter().any(|n| n.contains("o002") && n.contains("friction")), "{notes:?}");
}
