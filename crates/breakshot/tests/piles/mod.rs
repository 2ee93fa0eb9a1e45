//! Random piles, and the overlap of bodies, computed by code that is independent of the simulator.

#![allow(dead_code)] // Each test binary uses some of the functions.

use breakshot::cell::{Cell, Striker, Workspace};
use breakshot::geometry::{Point, Pose, Vec2};
use breakshot::object::{Marker, Object, Shape, pair_key};
use breakshot::physics::{AfterStrike, Options, Trajectory, trajectory};
use breakshot::properties::{ContactFriction, Properties};
use breakshot::scene::{Goal, Placed, Scene, Strike, Wall};
use breakshot::uncertain::Estimate;
use splitmix::Draw;

#[path = "../splitmix/mod.rs"]
pub(crate) mod splitmix;

/// The input of one simulation.
#[derive(Clone)]
pub(crate) struct Pile {
    pub(crate) scene: Scene,
    pub(crate) properties: Properties,
    pub(crate) strike: Strike,
    pub(crate) options: Options,
}

/// A random stream for a seed, different from the streams of other programs.
pub(crate) fn draw(seed: u64) -> Draw {
    Draw::new(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF0)
}

impl Pile {
    /// An empty table and a striker disc of 15 mm that is lifted after the strike.
    pub(crate) fn new() -> Self {
        let cell = Cell::from_above(1000.0, Workspace::centred([4.0, 4.0]), Striker::rod(0.015, [0.01, 5.0]));
        let (objects, placed, walls, keep_out) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let goal = Goal::default();
        let mut pile = Self {
            scene: Scene { cell, objects, observed_unix_s: None, placed, walls, keep_out, goal },
            properties: Properties { version: 1, ..Properties::default() },
            strike: Strike {
                object: None,
                start_m: Point::new(-0.2, 0.0),
                heading_rad: 0.0,
                speed_m_s: 0.6,
                travel_m: 0.2,
            },
            options: Options { after_strike: AfterStrike::Lift, ..Options::default() },
        };
        pile.contact_friction(0.0);
        pile
    }

    /// One more object: mass, friction, restitution (of a pair: the product; with the striker: its own).
    pub(crate) fn add(&mut self, shape: Shape, (mass, friction, restitution): (f64, f64, f64), pose: Pose) {
        let name = format!("o{:03}", self.scene.placed.len());
        let p = &mut self.properties;
        if p.reference.is_empty() {
            p.reference.clone_from(&name);
        }
        p.friction.insert(name.clone(), Estimate::exact(friction));
        p.mass_ratio.insert(name.clone(), Estimate::exact(mass));
        for other in self.scene.placed.iter().map(|p| p.object.clone()) {
            let e = restitution * p.striker_restitution[&other].mean;
            p.restitution.insert(pair_key(&name, &other), Estimate::exact(e));
        }
        p.striker_restitution.insert(name.clone(), Estimate::exact(restitution));
        let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.001 }));
        let (position_m, yaw_rad) = (pose.position, pose.yaw_rad);
        self.scene.placed.push(Placed { object: name.clone(), position_m, yaw_rad });
        self.scene.objects.push(Object { name, shape, height_m: 0.03, marker, mass_kg: None, support: None });
    }

    pub(crate) fn contact_friction(&mut self, friction: f64) {
        let both = Some(Estimate::exact(friction));
        self.properties.contact_friction = ContactFriction { objects: both, striker: both };
    }

    pub(crate) fn run(&self) -> Trajectory {
        trajectory(&self.scene, &self.properties, &self.strike, &self.options).expect("a possible pile")
    }

    /// The name, shape and friction of every object.
    pub(crate) fn bodies(&self) -> Vec<(String, Shape)> {
        self.scene
            .placed
            .iter()
            .map(|p| (p.object.clone(), self.scene.object(&p.object).expect("known").shape.clone()))
            .collect()
    }
}

pub(crate) fn disc(radius_m: f64) -> Shape {
    Shape::Disc { radius_m }
}

/// A regular polygon of n corners on a circle.
pub(crate) fn regular(n: usize, radius_m: f64) -> Shape {
    let corner =
        |k: usize| Point::ORIGIN + Vec2::from_heading(k as f64 * std::f64::consts::TAU / n as f64) * radius_m;
    Shape::Polygon { points_m: (0..n).map(corner).collect() }
}

/// Four discs of the paper's masses, each 1 to 5 mm from one before it, the striker 20 mm before the first.
pub(crate) fn four_discs(seed: u64) -> Pile {
    let mut draw = draw(seed);
    let mut pile = Pile::new();
    let kinds = [
        (0.143, 0.25, 0.9, 0.05),
        (0.112, 0.3, 0.8, 0.045),
        (0.061, 0.35, 0.7, 0.038),
        (0.016, 0.4, 0.65, 0.03),
    ];
    for (k, (mass, friction, restitution, radius_m)) in kinds.into_iter().enumerate() {
        let position = position_beside(
            &pile,
            &disc(radius_m),
            &mut draw,
            if k == 0 { None } else { Some((0.001, 0.005)) },
        );
        pile.add(disc(radius_m), (mass, friction, restitution), Pose { position, yaw_rad: 0.0 });
    }
    aim(&mut pile, &mut draw);
    pile
}

/// Four discs that touch: three each other, the fourth the last two.
pub(crate) fn touching_discs(seed: u64) -> Pile {
    let mut draw = draw(seed ^ 0x7075);
    let mut pile = Pile::new();
    let radii_m: [f64; 4] = [0.05, 0.045, 0.038, 0.03].map(|r| r * draw.between(0.9, 1.0));
    // Where a disc touches two others, on the side where y or x is greater.
    let touching = |p: Point, q: Point, r: f64, s: f64| {
        let (offset, distance) = (q - p, p.distance(q));
        let along = (r * r - s * s + distance * distance) / (2.0 * distance);
        let aside = (r * r - along * along).sqrt();
        p + offset * (along / distance) - offset.perpendicular() * (aside / distance)
    };
    let tilt = Vec2::from_heading(draw.between(0.2, 1.0));
    let a = Point::ORIGIN;
    let b = a + tilt * (radii_m[0] + radii_m[1]);
    let c = touching(a, b, radii_m[0] + radii_m[2], radii_m[1] + radii_m[2]);
    let d = touching(c, b, radii_m[2] + radii_m[3], radii_m[1] + radii_m[3]);
    let kinds = [(0.143, 0.25, 0.9), (0.112, 0.3, 0.8), (0.061, 0.35, 0.7), (0.016, 0.4, 0.65)];
    for ((kind, position), radius_m) in kinds.into_iter().zip([a, b, c, d]).zip(radii_m) {
        pile.add(disc(radius_m), kind, Pose { position, yaw_rad: 0.0 });
    }
    aim(&mut pile, &mut draw);
    pile
}

/// Two squares, a triangle and a hexagon, each 1 to 5 mm from one before it (by their circles or nearer).
pub(crate) fn four_shapes(seed: u64) -> Pile {
    let mut draw = draw(seed ^ 0xF00D);
    let mut pile = Pile::new();
    let square = |a: f64| Shape::Rectangle { size_m: [a, a] };
    let kinds = [
        (0.143, 0.25, 0.9, square(0.08)),
        (0.112, 0.3, 0.8, square(0.06)),
        (0.061, 0.35, 0.7, regular(3, 0.046_188)),
        (0.016, 0.4, 0.65, regular(6, 0.03)),
    ];
    for (mass, friction, restitution, shape) in kinds {
        add_beside(&mut pile, shape, (mass, friction, restitution), &mut draw, (0.001, 0.005));
    }
    aim(&mut pile, &mut draw);
    pile
}

/// Two to seven objects of all shapes, touching or not, with random friction, restitution, walls and striker.
pub(crate) fn anything(seed: u64) -> Pile {
    let mut draw = draw(seed ^ 0xABCD);
    let mut pile = Pile::new();
    let count = 2 + draw.below(6);
    for _ in 0..count {
        let size = draw.between(0.012, 0.05);
        let shape = match draw.below(6) {
            0 | 1 => disc(size),
            2 => Shape::Rectangle { size_m: [1.6 * size, 1.6 * size] },
            3 => Shape::Rectangle { size_m: [2.0 * size, draw.between(0.4, 1.0) * size] },
            4 => regular(3, size),
            _ => regular(4 + draw.below(5), size),
        };
        let properties = (draw.between(0.008, 0.3), draw.between(0.1, 0.6), draw.between(0.0, 1.0));
        let gaps = if draw.below(3) == 0 { (0.0, 0.0) } else { (0.0, 0.006) };
        add_beside(&mut pile, shape, properties, &mut draw, gaps);
    }
    pile.contact_friction(if draw.below(3) == 0 { 0.0 } else { draw.between(0.0, 0.5) });
    if draw.below(3) == 0 {
        pile.scene.cell.striker.shape = Shape::Rectangle { size_m: [0.02, draw.between(0.01, 0.08)] };
    }
    aim(&mut pile, &mut draw);
    pile.strike.speed_m_s = draw.between(0.1, 1.0);
    pile.strike.travel_m += draw.between(0.0, 0.1);
    if draw.below(2) == 0 {
        pile.options.after_strike = AfterStrike::Retract;
    }
    if draw.below(3) == 0 {
        let reach = |(p, o): (&Placed, &Object)| p.position_m.x + o.shape.outer_radius_m();
        let right = pile.scene.placed.iter().zip(&pile.scene.objects).map(reach).fold(0.0, f64::max);
        let x = right + draw.between(0.005, 0.1);
        let restitution = draw.between(0.0, 1.0);
        pile.scene.walls.push(Wall {
            from_m: Point::new(x, -0.5),
            to_m: Point::new(x + 0.05, 0.5),
            restitution,
        });
    }
    pile
}

/// Starts the striker to the left of all objects, at most 10 mm off the line through the first one, to end 60 mm past its circle.
fn aim(pile: &mut Pile, draw: &mut Draw) {
    let reach = pile.scene.objects[0].shape.outer_radius_m();
    let own = pile.scene.cell.striker.shape.outer_radius_m();
    let leftmost = pile
        .scene
        .placed
        .iter()
        .zip(&pile.scene.objects)
        .map(|(p, o)| p.position_m.x - o.shape.outer_radius_m());
    let x = leftmost.fold(-reach, f64::min) - own - 0.002;
    pile.strike.start_m = Point::new(x, draw.between(-0.01, 0.01));
    pile.strike.travel_m = (-reach - own - x) + 0.06;
}

fn position_beside(pile: &Pile, shape: &Shape, draw: &mut Draw, gaps: Option<(f64, f64)>) -> Point {
    let Some((low, high)) = gaps else { return Point::ORIGIN };
    for _ in 0..10_000 {
        let k = draw.below(pile.scene.placed.len());
        let reach =
            pile.scene.objects[k].shape.outer_radius_m() + shape.outer_radius_m() + draw.between(low, high);
        let heading = draw.between(-1.6, 1.6);
        let position = pile.scene.placed[k].position_m + Vec2::from_heading(heading) * reach;
        let clear = pile.scene.placed.iter().zip(&pile.scene.objects).all(|(p, o)| {
            p.position_m.distance(position) >= o.shape.outer_radius_m() + shape.outer_radius_m() + low - 1e-15
        });
        if clear {
            return position;
        }
    }
    panic!("no room for one more object");
}

/// Adds an object at a random angle, moved towards another one until their gap is the drawn one.
fn add_beside(pile: &mut Pile, shape: Shape, properties: (f64, f64, f64), draw: &mut Draw, gaps: (f64, f64)) {
    if pile.scene.placed.is_empty() {
        pile.add(shape, properties, Pose::new(0.0, 0.0, draw.between(0.0, 1.5)));
        return;
    }
    loop {
        let yaw_rad = draw.between(0.0, std::f64::consts::TAU);
        let k = draw.below(pile.scene.placed.len());
        let along = Vec2::from_heading(draw.between(-1.5, 1.5));
        let gap = draw.between(gaps.0, gaps.1);
        let others: Vec<(Shape, Pose)> = pile
            .scene
            .placed
            .iter()
            .zip(&pile.scene.objects)
            .map(|(p, o)| (o.shape.clone(), p.pose()))
            .collect();
        let pose = |distance_m: f64| Pose { position: others[k].1.position + along * distance_m, yaw_rad };
        let clear =
            |distance_m: f64| others.iter().all(|(s, p)| depth_m((s, *p), (&shape, pose(distance_m))) < -gap);
        let (mut near, mut far) = (0.0, 0.3);
        if !clear(far) {
            continue;
        }
        // Bisection for the nearest position without overlap.
        while far - near > 1e-13 {
            let middle = 0.5 * (near + far);
            if clear(middle) { far = middle } else { near = middle }
        }
        if clear(far) {
            let position = pose(far);
            pile.add(shape, properties, position);
            return;
        }
    }
}

/// Overlap of two convex shapes (m); negative: their gap, a lower bound for two sharp corners.
pub(crate) fn depth_m(a: (&Shape, Pose), b: (&Shape, Pose)) -> f64 {
    let corners = |(shape, pose): (&Shape, Pose)| -> (Vec<Point>, f64) {
        match shape {
            Shape::Disc { radius_m } => (vec![pose.position], *radius_m),
            _ => (shape.corners().into_iter().map(|c| pose.table_from_body(c)).collect(), 0.0),
        }
    };
    let ((p, r), (q, s)) = (corners(a), corners(b));
    let mut directions = Vec::new();
    for list in [&p, &q] {
        let n = list.len();
        if n > 1 {
            directions.extend((0..n).map(|k| -(list[(k + 1) % n] - list[k]).perpendicular()));
        }
    }
    let flip = directions.len() - if q.len() > 1 { q.len() } else { 0 };
    let mut gap = f64::NEG_INFINITY;
    for (k, d) in directions.iter().enumerate() {
        let n = *d / d.length();
        let n = if k < flip { n } else { -n };
        gap = gap.max(along(&q, n, false) - along(&p, n, true));
    }
    if r > 0.0 || s > 0.0 {
        // A disc may be nearest to a corner.
        for corner in if p.len() > 1 { &p } else { &q } {
            let offset = if p.len() > 1 { q[0] - *corner } else { *corner - p[0] };
            if let Some(n) = offset.direction() {
                gap = gap.max(along(&q, n, false) - along(&p, n, true));
            }
        }
    }
    r + s - gap
}

/// The least or greatest extent of points along a direction.
fn along(points: &[Point], n: Vec2, greatest: bool) -> f64 {
    let values = points.iter().map(|p| p.to_vec().dot(n));
    if greatest { values.fold(f64::NEG_INFINITY, f64::max) } else { values.fold(f64::INFINITY, f64::min) }
}
