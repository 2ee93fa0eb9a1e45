//! Without losses (restitution 1, no friction) a reversed simulation returns to its start.

use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Marker, Object, Shape, pair_key};
use crate::physics::event_loop::rollout::{Memory, Rollout};
use crate::physics::sliding::motion::State;
use crate::physics::world::World;
use crate::physics::{AfterStrike, Options, Spin};
use crate::properties::Properties;
use crate::scene::{Goal, Placed, Scene, Strike};
use crate::uncertain::Estimate;

/// Friction so small that the speed it removes in a second is far below the tolerance.
const FRICTION: f64 = 1e-15;

fn disc(radius_m: f64) -> Shape {
    Shape::Disc { radius_m }
}

/// Objects of these shapes and different masses, in two rows of three.
fn scene(shapes: [Shape; 6]) -> Scene {
    let marker: Marker = toml::from_str("shape = { disc = { radius_m = 0.005 } }").expect("a marker");
    let objects: Vec<Object> = (0..)
        .zip(shapes)
        .map(|(k, shape)| Object {
            name: format!("o{k}"),
            shape,
            height_m: 0.03,
            marker: Some(marker.clone()),
            mass_kg: None,
            support: None,
        })
        .collect();
    let placed = (0..)
        .zip(&objects)
        .map(|(k, object)| Placed {
            object: object.name.clone(),
            position_m: Point::new(
                0.12 * f64::from(k % 3) + 0.015 * f64::from(k / 3),
                0.2 * f64::from(k / 3),
            ),
            yaw_rad: 0.4 * f64::from(k),
        })
        .collect();
    let cell = toml::from_str(
        "camera = { scale_px_per_m = 1000.0 }\n\
         workspace = { min_m = [-9.0, -9.0], max_m = [9.0, 9.0] }\n\
         striker = { shape = { disc = { radius_m = 0.01 } }, height_m = 0.1, speed_range_m_s = [0.1, 1.0] }",
    )
    .expect("a cell");
    let (walls, keep_out, goal) = (Vec::new(), Vec::new(), Goal::default());
    Scene { cell, objects, observed_unix_s: None, placed, walls, keep_out, goal }
}

fn properties(scene: &Scene) -> Properties {
    let mut properties = Properties { version: 1, reference: "o0".into(), ..Properties::default() };
    properties.contact_friction.objects = Some(Estimate::exact(0.0));
    properties.contact_friction.striker = Some(Estimate::exact(0.0));
    for (k, one) in (0..).zip(&scene.objects) {
        properties.friction.insert(one.name.clone(), Estimate::exact(FRICTION));
        properties.striker_restitution.insert(one.name.clone(), Estimate::exact(1.0));
        properties.mass_ratio.insert(one.name.clone(), Estimate::exact(1.0 + 0.3 * f64::from(k)));
        for other in &scene.objects {
            properties.restitution.insert(pair_key(&one.name, &other.name), Estimate::exact(1.0));
        }
    }
    properties
}

/// The number of impacts after releasing all objects with these states, in the order of bodies.
fn impacts(world: &World, states: &[State], memory: &mut Memory) -> usize {
    let start_m = Point::new(8.0, 8.0);
    let far = Strike { object: None, start_m, heading_rad: 0.0, speed_m_s: 1.0, travel_m: 0.01 };
    let mut rollout = Rollout::new(world, &far, memory, None);
    rollout.memory.changed.clear();
    rollout.memory.changed.extend((1..).zip(states.iter().copied()));
    rollout.release(0.0);
    rollout.outcome().impacts
}

/// The states of all objects at a time (s) after the last impact.
fn states(world: &World, memory: &Memory, time_s: f64) -> Vec<State> {
    let bodies = 1..=world.objects;
    bodies.map(|body| memory.motions[body].state(time_s, &world.bodies[body])).collect()
}

fn reversed(states: &[State]) -> Vec<State> {
    let negated = |s: &State| State { velocity: -s.velocity, yaw_rate_rad_s: -s.yaw_rate_rad_s, ..*s };
    states.iter().map(negated).collect()
}

/// Greatest differences in position (m), yaw (rad) and velocity (m/s) between the start and the end of a simulation that is
/// reversed in the middle.
fn return_error(shapes: [Shape; 6]) -> [f64; 3] {
    let scene = scene(shapes);
    let options = Options { after_strike: AfterStrike::Lift, spin: Spin::Decoupled, ..Options::default() };
    let world = World::new(&scene, &properties(&scene), &options).expect("a world");
    let begin: Vec<State> = world.bodies[1..].iter().map(|body| converging(body.pose)).collect();
    let mut memory = Memory::default();
    let forth = impacts(&world, &begin, &mut memory);
    assert!(forth >= 3, "{forth} impacts");
    let last_s = memory.motions[1..].iter().map(|m| m.start_s).fold(0.0, f64::max);
    let while_s = last_s + 0.1;
    let end = states(&world, &memory, while_s);
    assert_eq!(forth, impacts(&world, &reversed(&end), &mut memory), "impacts forth and back");
    let back = reversed(&states(&world, &memory, while_s));
    let apart = begin.iter().zip(&back).map(|(was, is)| {
        let apart_m = (is.position - was.position).length();
        let turned_rad = (is.yaw_rad - was.yaw_rad).abs();
        [apart_m, turned_rad, (is.velocity - was.velocity).length()]
    });
    apart.fold([0.0; 3], |most, one| std::array::from_fn(|k| f64::max(most[k], one[k])))
}

/// A state with a velocity towards the other row.
fn converging(pose: Pose) -> State {
    let Point { x, y } = pose.position;
    let velocity = Vec2::new(0.3 * (0.12 - x), if y > 0.1 { -0.8 } else { 0.3 });
    State { position: pose.position, velocity, yaw_rad: pose.yaw_rad, yaw_rate_rad_s: 0.5 }
}

#[test]
fn discs_without_losses_return_to_their_start() {
    let apart = return_error([0.03, 0.04, 0.035, 0.02, 0.045, 0.025].map(disc));
    assert!(apart.iter().all(|apart| *apart < 1e-9), "{apart:?} m, rad, m/s");
}

/// Polygons touch at a gap of less than a micrometre, forwards and backwards.
#[test]
fn polygons_without_losses_return_to_their_start() {
    let rectangle = |a, b| Shape::Rectangle { size_m: [a, b] };
    let corners = [[0.04, 0.0], [-0.02, 0.035], [-0.02, -0.035]];
    let triangle = Shape::Polygon { points_m: corners.map(|[x, y]| Point::new(x, y)).to_vec() };
    let apart = return_error([
        disc(0.03),
        rectangle(0.05, 0.08),
        triangle,
        disc(0.02),
        rectangle(0.06, 0.03),
        disc(0.025),
    ]);
    assert!(apart[0] < 2e-6 && apart[1] < 1e-4 && apart[2] < 1e-4, "{apart:?} m, rad, m/s");
}
