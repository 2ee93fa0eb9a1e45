//! How do the striker, objects, walls and keep-out areas of a scene become bodies?

use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Shape, Support, polygon_area_m2};
use crate::physics::contact::compound_shape::CompoundShape;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::limit_surface::{LimitSurface, Surface};
use crate::physics::sliding::patch_friction::{GRAVITY_M_S2, PATCH_RADIUS_PER_ARM};
use crate::physics::sliding::slide_curve::SlideCurve;
use crate::scene::Wall;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// What a body is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Material<'a> {
    pub(crate) shape: &'a Shape,
    /// Where it presses on the table; none: uniformly under its outline.
    pub(crate) support: Option<&'a Support>,
    /// Mass (kg, or over the reference object's mass).
    pub(crate) mass: f64,
    /// Friction coefficient against the table.
    pub(crate) friction: f64,
    /// The measured support ratio; none: the weight is spread as `support` says.
    pub(crate) support_ratio: Option<f64>,
}

/// Outlines and friction tables that copies of an object share.
#[derive(Clone, Debug, Default)]
pub(crate) struct ShapeCache {
    entries: Vec<CachedShape>,
    surface: Surface,
}

#[derive(Clone, Debug)]
struct CachedShape {
    outline: Shape,
    support: Option<Support>,
    support_ratio: Option<f64>,
    /// Whether the table carries it, as it does everything except the striker.
    is_carried_by_table: bool,
    shape: Arc<CompoundShape>,
    curve: Arc<SlideCurve>,
    limit_surface: Option<Arc<LimitSurface>>,
}

impl ShapeCache {
    /// An empty cache for a table's surface.
    pub(crate) fn new(surface: Surface) -> Self {
        Self { entries: Vec::new(), surface }
    }

    /// A body at a pose; kind 0 is the striker, which the arm carries.
    pub(crate) fn body(&mut self, material: Material, pose: Pose, kind: usize) -> Body {
        let Material { shape: outline, support, mass, friction, support_ratio } = material;
        let gyration_m = outline.radius_of_gyration_m();
        let even_radius_m = even_patch_radius_m(outline);
        let patch_radius_m = support_ratio.map_or(even_radius_m, |ratio| even_radius_m * ratio);
        let is_carried_by_table = kind > 0;
        let same = |c: &&CachedShape| {
            c.outline == *outline
                && c.support.as_ref() == support
                && c.support_ratio == support_ratio
                && c.is_carried_by_table == is_carried_by_table
        };
        let known = self.entries.iter().find(same).cloned();
        let CachedShape { shape, curve, limit_surface, .. } = known.unwrap_or_else(|| {
            let entry = CachedShape {
                outline: outline.clone(),
                support: support.cloned(),
                support_ratio,
                is_carried_by_table,
                shape: Arc::new(CompoundShape::new(outline)),
                curve: slide_curve(gyration_m, patch_radius_m),
                // A support that is scaled about the centroid has the same limit surface per patch radius.
                limit_surface: is_carried_by_table
                    .then(|| LimitSurface::new(outline, support, self.surface, even_radius_m).map(Arc::new))
                    .flatten(),
            };
            self.entries.push(entry.clone());
            entry
        });
        Body {
            shape,
            pose,
            inverse_mass: 1.0 / mass,
            inverse_inertia: inverse_inertia(mass, gyration_m),
            friction_deceleration_m_s2: friction * GRAVITY_M_S2,
            patch_radius_m,
            curve,
            limit_surface,
            tilt_m_s2: Vec2::ZERO,
            kind,
        }
    }

    /// The striker's body at the origin, of infinite mass.
    pub(crate) fn striker(&mut self, shape: &Shape) -> Body {
        let material = Material { shape, support: None, mass: 1.0, friction: 1.0, support_ratio: None };
        Body { inverse_mass: 0.0, inverse_inertia: 0.0, ..self.body(material, Pose::default(), 0) }
    }
}

/// Radius of the round patch of an outline whose weight is spread uniformly (m).
pub(crate) fn even_patch_radius_m(outline: &Shape) -> f64 {
    PATCH_RADIUS_PER_ARM * outline.mean_arm_m()
}

/// The slides of bodies of this radius of gyration on a round patch.
fn slide_curve(gyration_m: f64, patch_radius_m: f64) -> Arc<SlideCurve> {
    Arc::new(SlideCurve::new((gyration_m / patch_radius_m).powi(2)))
}

/// Slide curves that perturbed worlds share: each takes as long as hundreds of rollouts.
#[derive(Debug, Default)]
pub(crate) struct CurveCache(Mutex<BTreeMap<[u64; 2], Arc<SlideCurve>>>);

/// Curves that are kept, of some 50 kB each; further ones are computed again.
const MOST_CURVES: usize = 400;

impl CurveCache {
    /// The slides of bodies of this radius of gyration on a round patch.
    pub(crate) fn curve(&self, gyration_m: f64, patch_radius_m: f64) -> Arc<SlideCurve> {
        let key = [gyration_m, patch_radius_m].map(f64::to_bits);
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(curve) = known().get(&key) {
            return curve.clone();
        }
        // Computed without the lock: two threads may do the same, with the same result.
        let curve = slide_curve(gyration_m, patch_radius_m);
        let mut known = known();
        if known.len() < MOST_CURVES {
            known.insert(key, curve.clone());
        }
        curve
    }
}

/// 1 / moment of inertia about the centroid.
pub(crate) fn inverse_inertia(mass: f64, gyration_m: f64) -> f64 {
    1.0 / (mass * gyration_m * gyration_m)
}

/// A wall: a fixed body about its middle; the striker supplies the fields that have no meaning for a wall.
pub(crate) fn wall_body(wall: &Wall, kind: usize, striker: &Body) -> Body {
    let half = (wall.to_m - wall.from_m) * 0.5;
    let pose = Pose { position: wall.from_m + half, yaw_rad: 0.0 };
    let shape = Arc::new(CompoundShape::segment(Point::ORIGIN - half, Point::ORIGIN + half));
    Body { shape, pose, inverse_mass: 0.0, inverse_inertia: 0.0, kind, ..striker.clone() }
}

/// A keep-out area: a fixed body about the mean of its corners, with the striker's fields like a wall.
pub(crate) fn area_body(corners: &[Point], striker: &Body) -> Body {
    let sum = corners.iter().fold(Vec2::ZERO, |sum, c| sum + c.to_vec());
    let middle = Point::ORIGIN + sum / corners.len() as f64;
    let about: Vec<Point> = corners.iter().map(|c| Point::ORIGIN + (*c - middle)).collect();
    let shape = Arc::new(CompoundShape::polygon(&counter_clockwise(&about)));
    let pose = Pose { position: middle, yaw_rad: 0.0 };
    Body { shape, pose, inverse_mass: 0.0, inverse_inertia: 0.0, ..striker.clone() }
}

/// The corners in counter-clockwise order.
pub(crate) fn counter_clockwise(corners: &[Point]) -> Vec<Point> {
    let mut corners = corners.to_vec();
    if polygon_area_m2(&corners) < 0.0 {
        corners.reverse();
    }
    corners
}
