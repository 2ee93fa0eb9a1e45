//! What is on the table, checked once and ready to be simulated many times?
//!
//! A [`World`] holds everything that is the same for all strikes.  Bodies are sorted by position (x, then y), so that the
//! result does not depend, to the last bit, on the order in which objects are listed.

use crate::error::bounds::positive;
use crate::error::{Error, Result};
use crate::geometry::{Point, Pose, Vec2};
use crate::ordered_map::map_of;
use crate::physics::bodies::{
    CurveCache, Material, ShapeCache, area_body, counter_clockwise, even_patch_radius_m, inverse_inertia,
    wall_body,
};
use crate::physics::contact::broadphase::{Circle, CircleSet};
use crate::physics::contact::distance::gap_m;
use crate::physics::mass_unit::{ASSUMED_DENSITY_KG_M3, MassUnit};
use crate::physics::options::{MultipleImpact, Options};
use crate::physics::pair_coefficients::{Coefficients, Kinds};
use crate::physics::sliding::body::{Body, STRIKER};
use crate::physics::sliding::motion::Motion;
use crate::physics::sliding::patch_friction::{GRAVITY_M_S2, PATCH_RADIUS_PER_ARM};
use crate::physics::sliding::slide_curve::SlideCurve;
use crate::properties::{Assumption, Properties};
use crate::scene::{Scene, Strike};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A pile, its properties and the table, validated.
///
/// The example strikes one disc and compares where it stops with the closed form `((1 + e) v)^2 / (2 mu g)`.
///
/// ```
/// use breakshot::cell::{Cell, Striker, Workspace};
/// use breakshot::geometry::Point;
/// use breakshot::physics::{GRAVITY_M_S2, Options, Simulator, World};
/// # use breakshot::object::{Marker, Object, Shape};
/// # use breakshot::properties::{ContactFriction, Properties};
/// # use breakshot::scene::{Goal, Placed, Scene, Strike};
/// # use breakshot::uncertain::Estimate;
/// # let (e, friction, radius_m) = (0.5, 0.3, 0.05);
/// # let shape = Shape::Disc { radius_m };
/// # let disc: Object = toml::from_str("name = 'a'\nheight_m = 0.03\nshape = { disc = { radius_m = 0.05 } }").unwrap();
/// # let cell = Cell::from_above(1000.0, Workspace::centred([2.0, 2.0]), Striker::rod(0.015, [0.01, 2.0]));
/// # let placed = vec![Placed { object: "a".into(), position_m: Point::ORIGIN, yaw_rad: 0.0 }];
/// # let scene = Scene { cell, objects: vec![disc], observed_unix_s: None, placed, walls: vec![], keep_out: vec![], goal: Goal::default() };
/// # let none = Some(Estimate::exact(0.0));
/// # let mut properties = Properties { version: 1, reference: "a".into(), contact_friction: ContactFriction { objects: none, striker: none }, ..Properties::default() };
/// # properties.friction.insert("a".into(), Estimate::exact(friction));
/// # properties.mass_ratio.insert("a".into(), Estimate::exact(1.0));
/// # properties.striker_restitution.insert("a".into(), Estimate::exact(e));
/// # let strike = Strike { start_m: Point::new(-0.2, 0.0), speed_m_s: 0.6, travel_m: 0.136, ..Strike::default() };
/// let world = World::new(&scene, &properties, &Options::default())?;
/// let outcome = Simulator::new().run(&world, &strike)?;
///
/// let launch_m_s = (1.0 + e) * strike.speed_m_s;
/// let stop_m = launch_m_s.powi(2) / (2.0 * friction * GRAVITY_M_S2);
/// assert!((outcome.poses[0].position.x - stop_m).abs() < 1e-9, "metres");
/// # Ok::<(), breakshot::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct World {
    /// Names of the objects, in the order of the scene's placed objects.
    pub(crate) names: Vec<String>,
    /// Body index of each object, in the same order.
    pub(crate) body_of: Vec<usize>,
    /// The striker first, then the objects sorted by position, then the walls, then the keep-out areas.
    pub(crate) bodies: Vec<Body>,
    /// Number of bodies that are objects.
    pub(crate) objects: usize,
    /// Index of the first keep-out area among the bodies; areas report who enters and stop nothing.
    pub(crate) areas: usize,
    /// The table's edge, counter-clockwise; empty for a table without edges.
    pub(crate) edge: Vec<Point>,
    /// Whether any object can slide along a curved path.
    pub(crate) has_curved_paths: bool,
    /// Gravity's component along the table over gravity; zero for a level table.
    pub(crate) slope: Vec2,
    /// The state at the start of every strike.
    pub(crate) start: Start,
    pub(crate) retract_speed_m_s: f64,
    pub(crate) options: Options,
    /// Assumptions that a user should know about.
    pub(crate) notes: Vec<String>,
    /// Values that no clip measured.
    pub(crate) assumed: Arc<[Assumption]>,
    kinds: Kinds,
    /// Coefficients of all pairs of kinds, row by row.
    coefficients: Vec<Coefficients>,
    /// Mass of the reference object (kg), or 1 if no mass is known in kg.
    mass_unit_kg: f64,
    /// Mass of the reference object over the striker's; zero if the striker's restitutions are not apparent ones.
    reference_per_striker_mass: f64,
    /// Radius of gyration of each object (m), in the order of the names.
    gyrations_m: Vec<f64>,
    /// Patch radius of each object if its weight is spread uniformly (m), in the order of the names; none where its support is given.
    even_patch_radii_m: Vec<Option<f64>>,
    /// Slide curves of other support ratios, shared with the worlds made from this one.
    curves: Arc<CurveCache>,
}

/// All bodies at rest at their poses, and the circles around them; the striker's entry is its outline at the origin.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    pub(crate) motions: Vec<Motion>,
    pub(crate) circles: CircleSet,
}

impl Start {
    fn new(bodies: &[Body]) -> Self {
        let motions: Vec<Motion> = bodies.iter().map(|b| Motion::rest(b.pose, 0.0)).collect();
        let circles = CircleSet::new(bodies, &motions);
        Self { motions, circles }
    }
}

/// One sample of what is uncertain about a world: the same objects at other poses, with other properties.
#[derive(Clone, Copy, Debug)]
pub struct Perturbation<'a> {
    /// Pose of each object, in the order of [`World::names`].
    pub poses: &'a [Pose],
    /// Properties of the same objects and pairs; every value must be physically possible, it is not checked again.
    pub properties: &'a Properties,
    /// Resolution of contacts that close at the same time.
    pub multiple_impact: MultipleImpact,
}

impl World {
    /// The world of a scene and the properties of its objects; what was not measured has its assumed mean
    /// ([`Properties::completed_for`]).
    ///
    /// Masses are mass ratios times the reference object's mass, which follows from the weighed objects.  If none was weighed it is 1,
    /// or, beside a striker whose mass is given, assumed from the objects' volumes.
    ///
    /// # Errors
    /// Impossible scenes, properties or options, overlapping objects.
    pub fn new(scene: &Scene, properties: &Properties, options: &Options) -> Result<Self> {
        scene.check("scene")?;
        properties.check("properties")?;
        options.check()?;
        let properties = &*properties.completed_for(scene)?;
        let mut notes = support_notes(scene, properties);
        let mass_unit_kg = mass_unit_kg(scene, properties, options, &mut notes);
        let reference_per_striker_mass = match options.striker_mass_kg {
            Some(mass_kg) if options.apparent_striker_restitution => mass_unit_kg / mass_kg,
            _ => 0.0,
        };

        let slope = properties.slope();
        // The striker
        let mut shapes = ShapeCache::new(options.surface);
        scene.cell.striker.shape.clone().check_and_centre("striker")?;
        let mut bodies = vec![shapes.striker(&scene.cell.striker.shape)];
        if let Some(mass_kg) = options.striker_mass_kg {
            bodies[STRIKER].inverse_mass = 1.0 / mass_kg;
        }

        // Objects, sorted by position
        let kinds = Kinds::of(scene);
        let poses: Vec<Pose> = scene.placed.iter().map(crate::scene::Placed::pose).collect();
        let mut body_of = vec![0; poses.len()];
        let mut gyrations_m = vec![0.0; poses.len()];
        let mut even_patch_radii_m = vec![None; poses.len()];
        for i in sorted_by_position(&poses) {
            let name = &scene.placed[i].object;
            body_of[i] = bodies.len();
            let object = scene.object(name)?;
            let owner = format!("object `{name}`");
            object.shape.clone().check_and_centre(&owner)?;
            if let Some(support) = &object.support {
                support.clone().check(&owner, Vec2::ZERO)?;
            }
            gyrations_m[i] = object.shape.radius_of_gyration_m();
            even_patch_radii_m[i] = object.support.is_none().then(|| even_patch_radius_m(&object.shape));
            let material = Material {
                shape: &object.shape,
                support: object.support.as_ref(),
                mass: properties.mass_ratio(name)?.mean * mass_unit_kg,
                friction: properties.friction(name)?.mean,
                support_ratio: properties.support(name).filter(|_| object.support.is_none()).map(|e| e.mean),
            };
            let mut body = shapes.body(material, poses[i], kinds.row_of_object(name));
            tilt_body(&mut body, slope);
            check_rests(name, material.friction, slope)?;
            bodies.push(body);
        }

        let areas = add_walls_and_areas(scene, &kinds, &mut bodies);
        let world = Self {
            names: scene.placed.iter().map(|p| p.object.clone()).collect(),
            objects: body_of.len(),
            areas,
            has_curved_paths: bodies.iter().any(Body::has_curved_paths),
            slope,
            edge: scene.cell.table.as_ref().map_or_else(Vec::new, |t| counter_clockwise(&t.outline_m)),
            body_of,
            start: Start::new(&bodies),
            bodies,
            coefficients: kinds.table(properties, reference_per_striker_mass, &mut notes)?,
            kinds,
            retract_speed_m_s: scene.cell.striker.retract_speed_m_s,
            options: options.clone(),
            notes,
            assumed: properties.assumed_for(scene).into(),
            mass_unit_kg,
            reference_per_striker_mass,
            gyrations_m,
            even_patch_radii_m,
            curves: Arc::default(),
        };
        world.check_overlaps()?;
        Ok(world)
    }

    /// The same objects at other poses and with other properties; outlines, friction tables, walls and names are shared.
    ///
    /// Equal to [`World::new`] with the changed scene to the last bit, but scene and property values are not validated
    /// again, and the notes are those of this world.
    ///
    /// # Errors
    /// Objects that overlap, a number of poses that is not that of the objects, properties that were never measured.
    pub fn perturbed(&self, sample: &Perturbation) -> Result<Self> {
        let Perturbation { poses, properties, multiple_impact } = *sample;
        if poses.len() != self.objects {
            let needed = format!("{} poses, one for each object", self.objects);
            return Err(Error::invalid("perturbation", "poses", poses.len(), needed));
        }
        let slope = properties.slope();
        let mut bodies = Vec::with_capacity(self.bodies.len());
        bodies.push(self.bodies[STRIKER].clone());
        let mut body_of = vec![0; poses.len()];
        for i in sorted_by_position(poses) {
            body_of[i] = bodies.len();
            let mass = properties.mass_ratio(&self.names[i])?.mean * self.mass_unit_kg;
            let mut body = Body {
                pose: poses[i],
                inverse_mass: 1.0 / mass,
                inverse_inertia: inverse_inertia(mass, self.gyrations_m[i]),
                friction_deceleration_m_s2: properties.friction(&self.names[i])?.mean * GRAVITY_M_S2,
                ..self.bodies[self.body_of[i]].clone()
            };
            self.set_support(i, &mut body, properties);
            tilt_body(&mut body, slope);
            bodies.push(body);
        }
        bodies.extend_from_slice(&self.bodies[1 + self.objects..]);
        let world = Self {
            names: self.names.clone(),
            body_of,
            slope,
            has_curved_paths: bodies.iter().any(Body::has_curved_paths),
            start: Start::new(&bodies),
            bodies,
            edge: self.edge.clone(),
            options: Options { multiple_impact, ..self.options.clone() },
            notes: self.notes.clone(),
            assumed: self.assumed.clone(),
            kinds: self.kinds.clone(),
            coefficients: self.kinds.table(properties, self.reference_per_striker_mass, &mut Vec::new())?,
            gyrations_m: self.gyrations_m.clone(),
            even_patch_radii_m: self.even_patch_radii_m.clone(),
            curves: self.curves.clone(),
            ..*self
        };
        world.check_overlaps()?;
        Ok(world)
    }

    /// The same objects at the same poses with other properties.
    ///
    /// # Errors
    /// Properties that are impossible or were never measured.
    pub fn with_properties(&self, properties: &Properties) -> Result<Self> {
        properties.check("properties")?;
        let mut world = Self { slope: properties.slope(), ..self.clone() };
        for (i, (name, &body)) in self.names.iter().zip(&self.body_of).enumerate() {
            let body = &mut world.bodies[body];
            let inverse_mass = 1.0 / (properties.mass_ratio(name)?.mean * self.mass_unit_kg);
            body.inverse_inertia *= inverse_mass / body.inverse_mass;
            body.inverse_mass = inverse_mass;
            body.friction_deceleration_m_s2 = properties.friction(name)?.mean * GRAVITY_M_S2;
            self.set_support(i, body, properties);
            tilt_body(body, world.slope);
        }
        world.has_curved_paths = world.bodies.iter().any(Body::has_curved_paths);
        world.coefficients =
            self.kinds.table(properties, self.reference_per_striker_mass, &mut Vec::new())?;
        Ok(world)
    }

    /// The names of the objects, in the order of the scene's placed objects.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The poses of the objects, which are in the order of [`World::names`], by name.
    pub(crate) fn by_name(&self, poses: &[Pose]) -> BTreeMap<String, Pose> {
        map_of(self.names.iter().cloned().zip(poses.iter().copied()))
    }

    /// Sets the contact friction between the kinds of two objects.
    ///
    /// # Errors
    /// A name that is not in the scene, a friction that is negative or not a number.
    pub fn set_contact_friction(&mut self, one: &str, other: &str, friction: f64) -> Result<()> {
        let bodies = [self.body(one)?, self.body(other)?];
        self.set_pair_friction(bodies, friction)
    }

    /// Sets the contact friction between the striker and a kind of object.
    ///
    /// # Errors
    /// A name that is not in the scene, a friction that is negative or not a number.
    pub fn set_striker_contact_friction(&mut self, object: &str, friction: f64) -> Result<()> {
        let bodies = [self.body(object)?, STRIKER];
        self.set_pair_friction(bodies, friction)
    }

    /// Sets the mean distance of an object's support from its centroid (m), which gives its greatest friction torque.
    ///
    /// # Errors
    /// A name that is not in the scene, a distance that is not a positive number.
    pub fn set_support_arm(&mut self, object: &str, mean_arm_m: f64) -> Result<()> {
        positive(object, "mean_arm_m", mean_arm_m)?;
        let index = self.body(object)?;
        let body = &mut self.bodies[index];
        body.patch_radius_m = PATCH_RADIUS_PER_ARM * mean_arm_m;
        let gyration_m2 = body.inverse_mass / body.inverse_inertia;
        body.curve = Arc::new(SlideCurve::new(gyration_m2 / body.patch_radius_m.powi(2)));
        Ok(())
    }

    /// Gives the body of object `i` the measured support ratio of its kind, unless its support is given.
    fn set_support(&self, i: usize, body: &mut Body, properties: &Properties) {
        let Some(even_radius_m) = self.even_patch_radii_m[i] else { return };
        let ratio = properties.support(&self.names[i]).map(|e| e.mean);
        let patch_radius_m = ratio.map_or(even_radius_m, |ratio| even_radius_m * ratio);
        if patch_radius_m != body.patch_radius_m {
            body.patch_radius_m = patch_radius_m;
            body.curve = self.curves.curve(self.gyrations_m[i], patch_radius_m);
        }
    }

    /// The body of a placed object.
    fn body(&self, object: &str) -> Result<usize> {
        let index = self.names.iter().position(|name| name == object);
        index.map(|k| self.body_of[k]).ok_or_else(|| {
            let needed = format!("one of {}", self.names.join(", "));
            Error::invalid("scene", "object", format!("`{object}`"), needed)
        })
    }

    fn set_pair_friction(&mut self, bodies: [usize; 2], friction: f64) -> Result<()> {
        crate::error::bounds::zero_or_more("world", "contact friction", friction, "")?;
        let [a, b] = bodies.map(|body| self.bodies[body].kind);
        let count = self.kinds.count();
        for index in [a * count + b, b * count + a] {
            self.coefficients[index].friction = friction;
        }
        Ok(())
    }

    /// Restitution and contact friction of two bodies.
    pub(crate) fn coefficients(&self, a: usize, b: usize) -> Coefficients {
        self.coefficients[self.bodies[a].kind * self.kinds.count() + self.bodies[b].kind]
    }

    /// The name of a body: an object, `striker`, `walls[k]` or `keep_out[k]`.
    pub(crate) fn name(&self, body: usize) -> String {
        match self.body_of.iter().position(|&k| k == body) {
            Some(k) => self.names[k].clone(),
            None if body == STRIKER => "striker".into(),
            None if body < self.areas => format!("walls[{}]", body - 1 - self.objects),
            None => format!("keep_out[{}]", body - self.areas),
        }
    }

    /// An error that names both objects where two overlap by more than [`OVERLAP_TOLERANCE_M`].
    fn check_overlaps(&self) -> Result<()> {
        for a in 1..=self.objects {
            for b in a + 1..self.areas {
                let gap_m = gap_m(&self.bodies[a], self.bodies[a].pose, &self.bodies[b], self.bodies[b].pose);
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

    /// An error unless the striker starts clear of all objects and walls.
    pub(crate) fn check_strike(&self, strike: &Strike) -> Result<()> {
        strike.check("strike")?;
        let pose = Pose { position: strike.start_m, yaw_rad: strike.heading_rad };
        let striker = &self.bodies[STRIKER];
        let circle = Circle { centre: pose.position, radius_m: striker.shape.outer_radius_m };
        let mut inside = None;
        self.start.circles.for_each_overlap(circle, |b| {
            if inside.is_none() && (1..self.areas).contains(&b) {
                let gap_m = gap_m(striker, pose, &self.bodies[b], self.bodies[b].pose);
                inside = (gap_m < -OVERLAP_TOLERANCE_M).then_some((b, gap_m));
            }
        });
        let Some((b, gap_m)) = inside else { return Ok(()) };
        let found = format!("{:.3} mm inside `{}`", -gap_m * 1e3, self.name(b));
        Err(Error::invalid("strike", "start_m", found, "a start clear of everything"))
    }
}

/// Overlap of placed objects that is accepted (m): the precision of poses seen by a camera.
const OVERLAP_TOLERANCE_M: f64 = 1e-3;

/// The indices of poses in the order of x, then y, then yaw.
fn sorted_by_position(poses: &[Pose]) -> Vec<usize> {
    let key = |i: usize| [poses[i].position.x, poses[i].position.y, poses[i].yaw_rad];
    let mut order: Vec<usize> = (0..poses.len()).collect();
    order.sort_unstable_by(|&i, &k| {
        let differences = key(i).into_iter().zip(key(k)).map(|(x, y)| x.total_cmp(&y));
        differences.into_iter().find(|o| o.is_ne()).unwrap_or(i.cmp(&k))
    });
    order
}

/// Puts a body with the friction of a level table on a tilted one.
fn tilt_body(body: &mut Body, slope: Vec2) {
    body.tilt_m_s2 = slope * GRAVITY_M_S2;
    if slope != Vec2::ZERO {
        // The weight presses on the table with its cosine.
        body.friction_deceleration_m_s2 *= (1.0 - slope.length_squared()).max(0.0).sqrt();
    }
}

/// An error if an object of this friction slides on its own.
fn check_rests(object: &str, friction: f64, slope: Vec2) -> Result<()> {
    if slope.length() < friction {
        return Ok(());
    }
    let tilt_deg = slope.length().min(1.0).asin().to_degrees();
    let found = format!(
        "friction {friction:.3} on a table tilted by {tilt_deg:.1} degrees, on which it slides on its own"
    );
    let needed = format!("a friction above the slope of {:.3}, or a level table", slope.length());
    Err(Error::invalid(format!("object `{object}`"), "friction", found, needed))
}

/// Adds the walls and the keep-out areas; gives the index of the first area.
fn add_walls_and_areas(scene: &Scene, kinds: &Kinds, bodies: &mut Vec<Body>) -> usize {
    for (k, wall) in scene.walls.iter().enumerate() {
        bodies.push(wall_body(wall, kinds.row_of_wall(k), &bodies[STRIKER]));
    }
    let areas = bodies.len();
    for area in &scene.keep_out {
        bodies.push(area_body(&area.points_m, &bodies[STRIKER]));
    }
    areas
}

/// A note for each kind of placed object whose support no film shows but those of other objects suggest.
fn support_notes(scene: &Scene, properties: &Properties) -> Vec<String> {
    let kinds = scene.kinds();
    let inferred = kinds.iter().filter_map(|(name, _)| {
        let ratio = properties.support(name).filter(|ratio| ratio.n == 0 && ratio.standard_error > 0.0)?;
        let [low, high] = ratio.interval_95;
        Some(format!(
            "no film shows how the table brakes the spin of `{name}`: from the other objects its weight is taken to act {:.2} times ({low:.2} to {high:.2}) \
             as far from its centroid as an even one",
            ratio.mean
        ))
    });
    inferred.collect()
}

/// The reference object's mass (kg) from the weighed objects.  Without one: by volume beside a striker of given mass, else 1; with a note.
fn mass_unit_kg(scene: &Scene, properties: &Properties, options: &Options, notes: &mut Vec<String>) -> f64 {
    match MassUnit::of(scene, properties) {
        MassUnit::Weighed(kg) => kg,
        MassUnit::Assumed(kg) if options.striker_mass_kg.is_some() => {
            notes.push(format!(
                "no object has a mass_kg: `{}` is taken as {kg:.3} kg beside the striker's mass, by volume at {ASSUMED_DENSITY_KG_M3} kg/m3",
                properties.reference
            ));
            kg
        }
        MassUnit::Assumed(_) => {
            notes.push(format!(
                "no object has a mass_kg: masses are ratios to `{}`, impulses and energies are per its mass",
                properties.reference
            ));
            1.0
        }
    }
}
