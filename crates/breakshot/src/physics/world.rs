//! What is on the table, ready to be simulated many times.
//!
//! A [`World`] holds everything that stays the same from strike to strike.  Bodies are kept in the order of their places
//! (x, then y), so that the answer does not depend, to the last bit, on the order in which objects are listed.

use super::contact::witness;
use super::rotation::Rotation;
use super::{GRAVITY_M_S2, Options};
use crate::error::{Error, Result};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{self, Shape, kind, polygon_area_m2};
use crate::physics::contact::broadphase::{Circle, Circles};
use crate::physics::contact::compound_shape::{Laid, Plate};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::limit_surface::{Hold, Pressure, Surface};
use crate::physics::sliding::motion::Motion;
use crate::physics::sliding::patch_friction::{PATCH_RADIUS_PER_ARM, mean_arm_m};
use crate::physics::sliding::slide_curve::SlideCurve;
use crate::properties::{ContactFriction, Properties};
use crate::scene::{Scene, Strike, Wall};
use std::sync::Arc;

/// How two kinds of bodies hit each other.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Coefficients {
    pub(crate) restitution: f64,
    pub(crate) friction: f64,
}

/// A pile, its properties and the table, checked and ready.
#[derive(Clone, Debug)]
pub struct World {
    pub(crate) names: Vec<String>,
    /// The body of each object, in the order in which the scene places them.
    pub(crate) body_of: Vec<usize>,
    /// The striker first, then the objects in order of place, then the walls, then the areas to keep out of.
    pub(crate) bodies: Vec<Body>,
    /// How many bodies are objects.
    pub(crate) objects: usize,
    /// Where the areas to keep out of begin among the bodies: they tell who enters and stop nobody.
    pub(crate) areas: usize,
    /// The table's edge, counter-clockwise; empty: the table has no end.
    pub(crate) edge: Vec<Point>,
    /// Whether any object's way can bend.
    pub(crate) bends: bool,
    /// How every strike begins.
    pub(crate) start: Start,
    pub(crate) coefficients: Vec<Coefficients>,
    pub(crate) kinds: usize,
    pub(crate) retract_speed_m_s: f64,
    pub(crate) options: Options,
    pub(crate) notes: Vec<String>,
    shapes: Shapes,
}

/// All bodies at rest where they lie; the striker's entry stands for its outline at the origin.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    pub(crate) motions: Vec<Motion>,
    pub(crate) circles: Circles,
}

impl Start {
    fn new(bodies: &[Body]) -> Self {
        let motions: Vec<Motion> = bodies.iter().map(|b| Motion::rest(b.pose, 0.0)).collect();
        let circles = Circles::new(bodies, &motions);
        Self { motions, circles }
    }
}

/// The striker's index among the bodies.
pub(crate) const STRIKER: usize = 0;

impl World {
    /// The world of a scene whose objects have these properties.
    ///
    /// Masses are mass ratios times the reference object's weighed mass, or times one where nobody weighed it.
    ///
    /// # Errors
    /// Scenes and properties that cannot be, objects that overlap, properties that were never measured.
    pub fn new(scene: &Scene, properties: &Properties, options: &Options) -> Result<Self> {
        Self::made_of(scene, properties, options, Shapes::default())
    }

    /// The world of another scene; what its objects share with this world's (outlines, slide curves) is used again.
    ///
    /// # Errors
    /// As [`World::new`].
    pub fn again(&self, scene: &Scene, properties: &Properties, options: &Options) -> Result<Self> {
        let shapes =
            if options.surface == self.options.surface { self.shapes.clone() } else { Shapes::default() };
        Self::made_of(scene, properties, options, shapes)
    }

    fn made_of(
        scene: &Scene,
        properties: &Properties,
        options: &Options,
        mut shapes: Shapes,
    ) -> Result<Self> {
        scene.check("scene")?;
        properties.check("properties")?;
        options.check()?;
        let mut notes = Vec::new();
        let unit_kg = mass_unit_kg(scene, properties, &mut notes);
        shapes.surface = options.surface;
        shapes.pressure = Pressure::default();
        scene.cell.striker.shape.clone().check_and_centre("striker")?;
        let mut bodies = vec![fixed_body(&mut shapes, &scene.cell.striker.shape, Pose::default(), 0)];
        if let Some(mass_kg) = options.striker_mass_kg {
            bodies[STRIKER].inverse_mass = 1.0 / mass_kg;
        }
        let kinds = kinds_of(scene);
        let mut order: Vec<usize> = (0..scene.placed.len()).collect();
        order.sort_by(|&i, &k| by_place(&scene.placed[i].pose(), &scene.placed[k].pose()));
        let mut body_of = vec![0; order.len()];
        for &i in &order {
            let placed = &scene.placed[i];
            body_of[i] = bodies.len();
            let mass = properties.mass_ratio(&placed.object)?.mean * unit_kg;
            let friction = properties.friction(&placed.object)?.mean;
            let kind = 1 + kinds.iter().position(|k| *k == kind(&placed.object)).unwrap_or(0);
            let shape = &scene.object(&placed.object)?.shape;
            shape.clone().check_and_centre(&format!("object `{}`", placed.object))?;
            shapes.pressure = options.pressure.get(object::kind(&placed.object)).cloned().unwrap_or_default();
            bodies.push(shapes.body(shape, placed.pose(), (mass, friction), kind));
        }
        for (k, wall) in scene.walls.iter().enumerate() {
            bodies.push(wall_body(wall, 1 + kinds.len() + k, &bodies[STRIKER]));
        }
        let areas = bodies.len();
        bodies.extend(
            scene.keep_out.iter().map(|k| area_body(&k.points_m, &bodies[STRIKER])).collect::<Vec<_>>(),
        );
        let coefficients = coefficients(scene, properties, &kinds, &mut notes)?;
        let world = Self {
            names: scene.placed.iter().map(|p| p.object.clone()).collect(),
            objects: order.len(),
            areas,
            bends: bodies.iter().any(|b| b.hold.is_some()),
            edge: scene.cell.table.as_ref().map_or_else(Vec::new, |t| counter_clockwise(&t.outline_m)),
            body_of,
            start: Start::new(&bodies),
            bodies,
            kinds: 1 + kinds.len() + scene.walls.len(),
            coefficients,
            retract_speed_m_s: scene.cell.striker.retract_speed_m_s,
            options: options.clone(),
            notes,
            shapes,
        };
        world.check_overlaps()?;
        Ok(world)
    }

    /// The same world with other properties: outlines and slide curves are used again.  `scene` is the one that it was
    /// made of.
    ///
    /// # Errors
    /// Properties that cannot be or were never measured.
    pub fn with_properties(&self, scene: &Scene, properties: &Properties) -> Result<Self> {
        properties.check("properties")?;
        let mut world = self.clone();
        world.notes.clear();
        let unit_kg = mass_unit_kg(scene, properties, &mut world.notes);
        for (placed, &body) in scene.placed.iter().zip(&self.body_of) {
            let body = &mut world.bodies[body];
            let inverse_mass = 1.0 / (properties.mass_ratio(&placed.object)?.mean * unit_kg);
            body.inverse_inertia *= inverse_mass / body.inverse_mass;
            body.inverse_mass = inverse_mass;
            body.grip_m_s2 = properties.friction(&placed.object)?.mean * GRAVITY_M_S2;
        }
        world.coefficients = coefficients(scene, properties, &kinds_of(scene), &mut world.notes)?;
        Ok(world)
    }

    /// The objects' names, in the order in which the scene places them.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Changes the contact friction of two kinds of objects, given as indices into [`World::names`].
    pub fn set_contact_friction(&mut self, one: usize, other: usize, friction: f64) {
        self.change(self.body_of[one], self.body_of[other], |c| c.friction = friction);
    }

    /// Changes the contact friction of a kind of object with the striker.
    pub fn set_striker_contact_friction(&mut self, object: usize, friction: f64) {
        self.change(self.body_of[object], STRIKER, |c| c.friction = friction);
    }

    /// Changes how an object stands on the table: the mean distance of its support from the centroid (m), for supports that
    /// are not the whole outline, such as feet or a rim.
    ///
    /// # Errors
    /// A distance that is not a positive number.
    pub fn set_support_arm(&mut self, object: usize, mean_arm_m: f64) -> Result<()> {
        crate::object::positive(&self.names[object], "mean_arm_m", mean_arm_m)?;
        let body = &mut self.bodies[self.body_of[object]];
        body.patch_radius_m = PATCH_RADIUS_PER_ARM * mean_arm_m;
        let gyration_m2 = body.inverse_mass / body.inverse_inertia;
        body.curve = Arc::new(SlideCurve::new(gyration_m2 / body.patch_radius_m.powi(2)));
        Ok(())
    }

    fn change(&mut self, a: usize, b: usize, change: impl Fn(&mut Coefficients)) {
        let (a, b) = (self.bodies[a].kind, self.bodies[b].kind);
        change(&mut self.coefficients[a * self.kinds + b]);
        if a != b {
            change(&mut self.coefficients[b * self.kinds + a]);
        }
    }

    pub(crate) fn coefficients(&self, a: usize, b: usize) -> Coefficients {
        self.coefficients[self.bodies[a].kind * self.kinds + self.bodies[b].kind]
    }

    /// What a body is called.
    pub(crate) fn name(&self, body: usize) -> String {
        match self.body_of.iter().position(|&k| k == body) {
            Some(k) => self.names[k].clone(),
            None if body == STRIKER => "striker".into(),
            None if body < self.areas => format!("walls[{}]", body - 1 - self.objects),
            None => format!("keep_out[{}]", body - self.areas),
        }
    }

    /// Overlaps of more than [`OVERLAP_TOLERANCE_M`] are errors that name both objects.
    fn check_overlaps(&self) -> Result<()> {
        for a in 1..=self.objects {
            for b in a + 1..self.areas {
                let gap_m =
                    gap_m((&self.bodies[a], self.bodies[a].pose), (&self.bodies[b], self.bodies[b].pose));
                if gap_m < -OVERLAP_TOLERANCE_M {
                    let found = format!("{:.3} mm", -gap_m * 1e3);
                    let what = format!("overlap with `{}`", self.name(b));
                    let needed = "objects that lie beside each other";
                    return Err(Error::invalid(format!("object `{}`", self.name(a)), what, found, needed));
                }
            }
        }
        Ok(())
    }

    /// An error unless the striker starts clear of everything.
    pub(crate) fn check_strike(&self, strike: &Strike) -> Result<()> {
        strike.check("strike")?;
        let pose = Pose { position: strike.start_m, yaw_rad: strike.heading_rad };
        let striker = &self.bodies[STRIKER];
        let circle = Circle { centre: pose.position, radius_m: striker.plate.outer_radius_m };
        let mut inside = None;
        self.start.circles.near(circle, |b| {
            if inside.is_none() && (1..self.areas).contains(&b) {
                let gap_m = gap_m((striker, pose), (&self.bodies[b], self.bodies[b].pose));
                inside = (gap_m < -OVERLAP_TOLERANCE_M).then_some((b, gap_m));
            }
        });
        let Some((b, gap_m)) = inside else { return Ok(()) };
        let found = format!("{:.3} mm inside `{}`", -gap_m * 1e3, self.name(b));
        Err(Error::invalid("strike", "start_m", found, "a start clear of everything"))
    }
}

/// What a camera cannot see (m): placed objects may overlap by this much.
const OVERLAP_TOLERANCE_M: f64 = 1e-3;

/// How far apart two plates are (m), negative if they overlap.
pub(crate) fn gap_m(a: (&Body, Pose), b: (&Body, Pose)) -> f64 {
    let reach = a.0.plate.outer_radius_m + b.0.plate.outer_radius_m;
    let circles_m = (a.1.position - b.1.position).length() - reach;
    if circles_m > 0.0 && !a.0.plate.parts.is_empty() && circles_m > reach {
        return circles_m;
    }
    let mut least = f64::INFINITY;
    for part_a in &a.0.plate.parts {
        let laid_a = Laid { part: part_a, origin: a.1.position, rotation: Rotation::new(a.1.yaw_rad) };
        for part_b in &b.0.plate.parts {
            let laid_b = Laid { part: part_b, origin: b.1.position, rotation: Rotation::new(b.1.yaw_rad) };
            least = least.min(witness(&laid_a, &laid_b).gap_m);
        }
    }
    least
}

fn by_place(a: &Pose, b: &Pose) -> std::cmp::Ordering {
    let key = |p: &Pose| [p.position.x, p.position.y, p.yaw_rad];
    key(a)
        .into_iter()
        .zip(key(b))
        .map(|(x, y)| x.total_cmp(&y))
        .find(|o| o.is_ne())
        .unwrap_or(std::cmp::Ordering::Equal)
}

fn kinds_of(scene: &Scene) -> Vec<&str> {
    let mut kinds: Vec<&str> = scene.placed.iter().map(|p| kind(&p.object)).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}

/// The reference object's weighed mass; one where nobody weighed it.
fn mass_unit_kg(scene: &Scene, properties: &Properties, notes: &mut Vec<String>) -> f64 {
    let weighed = scene.objects.iter().find(|o| o.name == properties.reference).and_then(|o| o.mass_kg);
    weighed.unwrap_or_else(|| {
        notes.push(format!(
            "`{}` has no mass_kg: masses are ratios to it, impulses and energies are per its mass",
            properties.reference
        ));
        1.0
    })
}

fn fixed_body(shapes: &mut Shapes, shape: &Shape, pose: Pose, kind: usize) -> Body {
    Body { inverse_mass: 0.0, inverse_inertia: 0.0, ..shapes.body(shape, pose, (1.0, 1.0), kind) }
}

/// A wall is a body about its middle that nothing moves.
fn wall_body(wall: &Wall, kind: usize, like: &Body) -> Body {
    let half = (wall.to_m - wall.from_m) * 0.5;
    let pose = Pose { position: wall.from_m + half, yaw_rad: 0.0 };
    let plate = Arc::new(Plate::segment(Point::ORIGIN - half, Point::ORIGIN + half));
    Body { plate, pose, inverse_mass: 0.0, inverse_inertia: 0.0, kind, ..like.clone() }
}

/// An area to keep out of, about the middle of its corners.
fn area_body(corners: &[Point], like: &Body) -> Body {
    let sum = corners.iter().fold(Vec2::ZERO, |sum, c| sum + c.to_vec());
    let middle = Point::ORIGIN + sum / corners.len() as f64;
    let about: Vec<Point> = corners.iter().map(|c| Point::ORIGIN + (*c - middle)).collect();
    let plate = Arc::new(Plate::polygon(&counter_clockwise(&about)));
    let pose = Pose { position: middle, yaw_rad: 0.0 };
    Body { plate, pose, inverse_mass: 0.0, inverse_inertia: 0.0, ..like.clone() }
}

fn counter_clockwise(corners: &[Point]) -> Vec<Point> {
    let mut corners = corners.to_vec();
    if polygon_area_m2(&corners) < 0.0 {
        corners.reverse();
    }
    corners
}

/// Outlines and slide curves already made: copies of an object share them.
#[derive(Clone, Debug, Default)]
struct Shapes {
    made: Vec<Made>,
    surface: Surface,
    /// Where the next body presses.
    pressure: Pressure,
}

/// What copies of an object share.
#[derive(Clone, Debug)]
struct Made {
    shape: Shape,
    pressure: Pressure,
    /// Whether it stands on the table, as everything but the striker does.
    stands: bool,
    plate: Arc<Plate>,
    curve: Arc<SlideCurve>,
    hold: Option<Arc<Hold>>,
}

impl Shapes {
    fn body(&mut self, shape: &Shape, pose: Pose, (mass, friction): (f64, f64), kind: usize) -> Body {
        let gyration_m = shape.radius_of_gyration_m();
        let patch_radius_m = PATCH_RADIUS_PER_ARM * mean_arm_m(shape);
        let same = |m: &&Made| m.shape == *shape && m.pressure == self.pressure && m.stands == (kind > 0);
        let known = self.made.iter().find(same).cloned();
        let Made { plate, curve, hold, .. } = known.unwrap_or_else(|| {
            let made = Made {
                shape: shape.clone(),
                pressure: self.pressure.clone(),
                stands: kind > 0,
                plate: Arc::new(Plate::new(shape)),
                curve: Arc::new(SlideCurve::new((gyration_m / patch_radius_m).powi(2))),
                // The striker hangs on the arm.
                hold: (kind > 0)
                    .then(|| Hold::new(shape, &self.pressure, self.surface, patch_radius_m).map(Arc::new))
                    .flatten(),
            };
            self.made.push(made.clone());
            made
        });
        Body {
            plate,
            pose,
            inverse_mass: 1.0 / mass,
            inverse_inertia: 1.0 / (mass * gyration_m * gyration_m),
            grip_m_s2: friction * GRAVITY_M_S2,
            patch_radius_m,
            curve,
            hold,
            kind,
        }
    }
}

/// The table of pair coefficients: striker, kinds of objects, walls.
fn coefficients(
    scene: &Scene,
    properties: &Properties,
    kinds: &[&str],
    notes: &mut Vec<String>,
) -> Result<Vec<Coefficients>> {
    let count = 1 + kinds.len() + scene.walls.len();
    let mut table = vec![Coefficients::default(); count * count];
    let mut put = |i: usize, k: usize, restitution: f64, friction: f64| {
        table[i * count + k] = Coefficients { restitution, friction };
        table[k * count + i] = Coefficients { restitution, friction };
    };
    let mut measured = |estimate: Option<crate::uncertain::Estimate>, between: &str| {
        estimate.map_or_else(
            || {
                let assumed = ContactFriction::ASSUMED;
                notes.push(format!("contact friction {between} was never measured: taken as {assumed}"));
                assumed
            },
            |e| e.mean,
        )
    };
    let friction = measured(properties.contact_friction.objects, "between objects");
    let striker_friction = measured(properties.contact_friction.striker, "with the striker");
    let copies = |name: &str| scene.placed.iter().filter(|p| kind(&p.object) == name).count();
    for (i, one) in kinds.iter().enumerate() {
        put(0, 1 + i, properties.striker_restitution(one)?.mean, striker_friction);
        for (k, other) in kinds.iter().enumerate().skip(i) {
            if i != k || copies(one) > 1 {
                put(1 + i, 1 + k, properties.restitution(one, other)?.mean, friction);
            }
        }
        for (w, wall) in scene.walls.iter().enumerate() {
            put(1 + i, 1 + kinds.len() + w, wall.restitution, friction);
        }
    }
    if !scene.walls.is_empty() {
        notes.push("walls are taken to have the contact friction of objects".into());
    }
    Ok(table)
}
