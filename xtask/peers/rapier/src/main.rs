//! Runs files of piles with rapier2d, tuned for accuracy, and prints how fast.
//!
//! `rapier-scenes FILE [--dt S] [--repeat N] [--final OUT.csv]`: the format and the output of the example `scenes`.
//!
//! What is tuned: a length unit of 2 cm, restitution and contact friction as products of both bodies' values, no sleeping,
//! exact masses and inertias.  The table's friction (sliding and spinning apart from each other) is applied half before and
//! half after every step, so that a free slide is an exact parabola.  Making the world counts, as for the event-driven
//! simulator making the rollout does.

use rapier2d::prelude::*;
use std::fmt::Write;

const GRAVITY_M_S2: f32 = 9.81;

struct Body {
    mass: f32,
    inertia: f32,
    friction: f32,
    bounce: f32,
    roughness: f32,
    pose: [f32; 3],
    mean_arm: f32,
    shape: SharedShape,
}

#[derive(Default)]
struct Pile {
    number: String,
    /// Radius, x, y, speed, travel, bounce, roughness.
    striker: [f64; 7],
    bodies: Vec<Body>,
}

fn piles(text: &str) -> Vec<Pile> {
    let mut piles: Vec<Pile> = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = |from: usize| -> Vec<f64> {
            words[from..].iter().map(|w| w.parse().expect("a number")).collect()
        };
        match words.first().copied() {
            Some("scene") => piles.push(Pile { number: words[2].into(), ..Pile::default() }),
            Some("striker") => {
                piles.last_mut().expect("a scene").striker = numbers(1).try_into().expect("7 numbers");
            }
            Some(what @ ("disc" | "poly")) => {
                let n = numbers(1);
                let (shape, mean_arm, inertia) = if what == "disc" {
                    (SharedShape::ball(n[7] as f32), n[8], 0.5 * n[0] * n[7] * n[7])
                } else {
                    let corners: Vec<Vector> =
                        n[10..].chunks(2).map(|c| Vector::new(c[0] as f32, c[1] as f32)).collect();
                    (SharedShape::convex_hull(&corners).expect("convex"), n[7], n[8])
                };
                piles.last_mut().expect("a scene").bodies.push(Body {
                    mass: n[0] as f32,
                    inertia: inertia as f32,
                    friction: n[1] as f32,
                    bounce: n[2] as f32,
                    roughness: n[3] as f32,
                    pose: [n[4] as f32, n[5] as f32, n[6] as f32],
                    mean_arm: mean_arm as f32,
                    shape,
                });
            }
            _ => {}
        }
    }
    piles
}

fn collider(shape: SharedShape, bounce: f32, roughness: f32) -> ColliderBuilder {
    ColliderBuilder::new(shape)
        .restitution(bounce)
        .friction(roughness)
        .restitution_combine_rule(CoefficientCombineRule::Multiply)
        .friction_combine_rule(CoefficientCombineRule::Multiply)
}

/// Where everything comes to rest.
fn settled(pile: &Pile, dt: f32, offset_m: f64) -> Vec<[f32; 3]> {
    let mut world = PhysicsWorld { gravity: Vector::ZERO, ..PhysicsWorld::default() };
    world.integration_parameters.dt = dt;
    world.integration_parameters.length_unit = 0.02;
    let [radius, x, y, speed, travel, bounce, roughness] = pile.striker;
    let (striker, _) = world.insert(
        RigidBodyBuilder::kinematic_velocity_based()
            .translation(Vector::new(x as f32, (y + offset_m) as f32))
            .linvel(Vector::new(speed as f32, 0.0)),
        collider(SharedShape::ball(radius as f32), bounce as f32, roughness as f32),
    );
    let handles: Vec<RigidBodyHandle> = pile
        .bodies
        .iter()
        .map(|b| {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(b.pose[0], b.pose[1]))
                .rotation(b.pose[2])
                .can_sleep(false);
            let mass = MassProperties::new(Vector::ZERO, b.mass, b.inertia);
            world.insert(body, collider(b.shape.clone(), b.bounce, b.roughness).mass_properties(mass)).0
        })
        .collect();
    let lift_after = (travel / speed / f64::from(dt)).round() as usize;
    for step in 0..(5.0 / dt) as usize {
        if step == lift_after {
            world.remove_body(striker);
        }
        let moving = rub(&mut world, &handles, &pile.bodies, 0.5 * dt);
        if step > lift_after && !moving {
            break;
        }
        world.step();
        rub(&mut world, &handles, &pile.bodies, 0.5 * dt);
    }
    let pose = |h: &RigidBodyHandle| {
        let body = &world.bodies[*h];
        [body.translation().x, body.translation().y, body.rotation().angle()]
    };
    handles.iter().map(pose).collect()
}

/// The table slows every body down; whether anything still moves.
fn rub(world: &mut PhysicsWorld, handles: &[RigidBodyHandle], bodies: &[Body], time: f32) -> bool {
    let mut moving = false;
    for (handle, b) in handles.iter().zip(bodies) {
        let body = &mut world.bodies[*handle];
        let (v, w) = (body.linvel(), body.angvel());
        let speed = v.length();
        if speed == 0.0 && w == 0.0 {
            continue;
        }
        let lost = b.friction * GRAVITY_M_S2 * time;
        let left = if speed > lost { 1.0 - lost / speed } else { 0.0 };
        let spin_lost = lost * b.mass * b.mean_arm / b.inertia;
        let spin = if w.abs() > spin_lost { w - spin_lost.copysign(w) } else { 0.0 };
        moving |= left > 0.0 || spin != 0.0;
        body.set_linvel(v * left, false);
        body.set_angvel(spin, false);
    }
    moving
}

/// Time this thread has run (s).
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").expect("Linux");
    text.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).expect("a number") * 1e-9
}

fn main() {
    let mut words = std::env::args().skip(1);
    let (mut file, mut dt, mut repeat, mut csv) = (String::new(), 1e-3f32, 1usize, None);
    while let Some(word) = words.next() {
        let mut value = || words.next().expect("a value");
        match word.as_str() {
            "--dt" => dt = value().parse().expect("seconds"),
            "--repeat" => repeat = value().parse().expect("a count"),
            "--final" => csv = Some(value()),
            _ => file = word,
        }
    }
    let piles = piles(&std::fs::read_to_string(&file).expect("a scene file"));
    if let Some(csv) = csv {
        let mut text = String::from("scene,object,x_m,y_m,yaw_rad\n");
        for pile in &piles {
            for (k, [x, y, yaw]) in settled(pile, dt, 0.0).iter().enumerate() {
                writeln!(text, "{},{k},{x},{y},{yaw}", pile.number).expect("memory");
            }
        }
        std::fs::write(csv, text).expect("a file to write");
    }
    let start = cpu_s();
    for k in 0..repeat {
        for pile in &piles {
            let offset = 1e-6 * (2.0 * (k as f64 * 0.618_033_988_749_894_9).fract() - 1.0);
            std::hint::black_box(settled(pile, dt, offset));
        }
    }
    let rate = (repeat * piles.len()) as f64 / (cpu_s() - start);
    println!("scenes={} rollouts_per_cpu_s={rate:.2}", piles.len());
}
