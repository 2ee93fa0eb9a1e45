//! Central strikes that the striker can carry out: which object, from where (rules iii, iv and vi of section 5).
//!
//! A strike is central if its line of action runs through the object's centroid.  A disc is struck so from every
//! heading; a polygon on each side whose perpendicular through the centroid meets that side.  The way is free if the
//! striker's swept area, from behind its start to the contact, keeps clear of every other object, and as far as it
//! runs on keeps clear of walls and keep-out areas.  What happens to other objects after the impact is physics.

use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2, wrapped_rad};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;
use crate::plan::approach::{Surroundings, TOUCH_M, rounded, rounded_strike};
use crate::plan::options::Options;
use crate::properties::Properties;
use crate::scene::{Placed, Scene, Strike};
use std::collections::BTreeSet;

/// After the contact the striker runs on at least so far, or an error of the pose would make it miss.
const LEAST_FOLLOW_THROUGH_M: f64 = 0.005;
/// And at most so far: the paper's strike ends at the impact.
pub(crate) const MOST_FOLLOW_THROUGH_M: f64 = 0.02;
/// The part of the stroke to the catch-up that the striker runs on: before it meets the object again, with a margin.
const CATCH_UP_PART: f64 = 0.5;
/// Headings around a disc.
const HEADINGS: u32 = 72;
/// One central strike, apart from its speed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Candidate {
    /// The object it is meant for.
    pub object: String,
    /// Its direction (rad).
    pub heading_rad: f64,
    /// Where the striker's centre is when it touches the object.
    pub contact_m: Point,
    /// How far it runs before that (m).
    pub lead_in_m: f64,
    /// The impulse at unit speed (Eq. 8 and 24; kg if masses are known in kg, else reference masses).
    pub impulse: f64,
    /// The striker's effective mass (kg), infinite without an arm.
    pub effective_mass_kg: f64,
    /// The cosine of the angle between heading and way to the other objects' middle.
    pub towards_pile: f64,
    /// Restitution against the striker.
    restitution: f64,
    /// Deceleration by friction (m/s2).
    deceleration_m_s2: f64,
}

/// An object that no heading reaches, and what is in the way.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blocked {
    /// The object.
    pub object: String,
    /// Names of objects, `a wall`, and so on.
    pub by: BTreeSet<String>,
}

impl std::fmt::Display for Blocked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let by: Vec<_> = self.by.iter().map(String::as_str).collect();
        match by[..] {
            [] => write!(f, "{} has no side that can be struck centrally", self.object),
            _ => write!(f, "{} is blocked by {}", self.object, by.join(", ")),
        }
    }
}

/// Every accessible central strike on an object, the best first: greatest impulse, then most towards the other objects,
/// then the smaller heading.
///
/// # Errors
/// A property of the object that was never measured.
pub(crate) fn candidates(
    scene: &Scene,
    properties: &Properties,
    options: &Options,
    target: &Placed,
) -> Result<std::result::Result<Vec<Candidate>, Blocked>> {
    let shape = &scene.object(&target.object)?.shape;
    let restitution = properties.striker_restitution(&target.object)?.mean;
    let deceleration_m_s2 = properties.friction(&target.object)?.mean * GRAVITY_M_S2;
    let mass_ratio = properties.mass_ratio(&target.object)?.mean;
    let kg_per_ratio = kilograms_per_ratio(scene, properties);
    let pile = middle_of_others(scene, target).and_then(|middle| (middle - target.position_m).direction());
    let surroundings = Surroundings::new(scene, target)?;
    let mut found = Vec::new();
    let mut by = BTreeSet::new();
    for (heading_rad, touch) in central_contacts(shape, target.pose(), pile) {
        let contact_m = striker_center(&scene.cell.striker.shape, touch, heading_rad);
        let effective_mass_kg =
            options.effective_mass_kg.map_or(f64::INFINITY, |mass| mass(touch, heading_rad));
        // An arm that cannot strike there has no mass there.
        if effective_mass_kg.is_nan() || effective_mass_kg <= 0.0 {
            by.insert("the arm's reach".to_owned());
            continue;
        }
        match surroundings.free_lead_in_m((contact_m, heading_rad), MOST_FOLLOW_THROUGH_M) {
            Ok(lead_in_m) => found.push(Candidate {
                object: target.object.clone(),
                heading_rad,
                contact_m,
                lead_in_m,
                impulse: impulse(restitution, mass_ratio, kg_per_ratio, effective_mass_kg),
                effective_mass_kg,
                towards_pile: pile.map_or(0.0, |pile| pile.dot(Vec2::from_heading(heading_rad))),
                restitution,
                deceleration_m_s2,
            }),
            Err(obstacle) => {
                by.insert(obstacle);
            }
        }
    }
    if found.is_empty() {
        return Ok(Err(Blocked { object: target.object.clone(), by }));
    }
    found.sort_by(Candidate::better_first);
    Ok(Ok(found))
}

impl Candidate {
    /// Orders the better strike before the other.
    pub(crate) fn better_first(one: &Self, other: &Self) -> std::cmp::Ordering {
        other
            .impulse
            .total_cmp(&one.impulse)
            .then(other.effective_mass_kg.total_cmp(&one.effective_mass_kg))
            .then(rounded(other.towards_pile, 1e-9).total_cmp(&rounded(one.towards_pile, 1e-9)))
            .then(one.object.cmp(&other.object))
            .then(one.heading_rad.total_cmp(&other.heading_rad))
    }

    /// How far the striker, had it no end, would run from the impact until it meets the sliding object again (m).
    ///
    /// The object leaves at (1 + e) v and is caught up at t = 2 e v / (mu g) (Eq. 27 and 28 with 25 corrected).
    pub(crate) fn catch_up_m(&self, speed_m_s: f64) -> f64 {
        2.0 * self.restitution * speed_m_s * speed_m_s / self.deceleration_m_s2
    }

    /// How far the striker runs on after the contact (m).
    pub(crate) fn follow_through_m(&self, speed_m_s: f64) -> f64 {
        (CATCH_UP_PART * self.catch_up_m(speed_m_s)).clamp(LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M)
    }

    /// The speed at which the object, were it alone, would slide so far (m/s, Eq. 25 and 30).
    pub(crate) fn speed_for_slide_m_s(&self, distance_m: f64) -> f64 {
        (2.0 * self.deceleration_m_s2 * distance_m).sqrt() / (1.0 + self.restitution)
    }

    /// The strike at that speed.
    pub(crate) fn strike(&self, speed_m_s: f64) -> Strike {
        let start_m = self.contact_m - Vec2::from_heading(self.heading_rad) * self.lead_in_m;
        rounded_strike(Strike {
            object: Some(self.object.clone()),
            start_m,
            heading_rad: self.heading_rad,
            speed_m_s,
            travel_m: self.lead_in_m + self.follow_through_m(speed_m_s),
        })
    }
}

/// Eq. 8 with the object at rest and free: (1 + e) / (1/m + 1/M) at unit speed; with an infinite M Eq. 24.
fn impulse(restitution: f64, mass_ratio: f64, kg_per_ratio: Option<f64>, effective_mass_kg: f64) -> f64 {
    match kg_per_ratio {
        Some(kg) => (1.0 + restitution) / (1.0 / (mass_ratio * kg) + 1.0 / effective_mass_kg),
        None => (1.0 + restitution) * mass_ratio,
    }
}

/// The reference object's mass (kg), from the objects that someone weighed; none if nobody did.
fn kilograms_per_ratio(scene: &Scene, properties: &Properties) -> Option<f64> {
    let weighed = |object: &crate::object::Object| {
        Some(object.mass_kg? / properties.mass_ratio(&object.name).ok()?.mean)
    };
    let all: Vec<f64> = scene.objects.iter().filter_map(weighed).collect();
    (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
}

fn middle_of_others(scene: &Scene, target: &Placed) -> Option<Point> {
    let others: Vec<_> = scene.placed.iter().filter(|p| p.object != target.object).collect();
    let sum = others.iter().fold(Vec2::ZERO, |sum, p| sum + p.position_m.to_vec());
    (!others.is_empty()).then(|| Point::ORIGIN + sum / others.len() as f64)
}

/// Headings and touched points of all central strikes on a shape.
///
/// Around a disc the headings are counted from the way to the pile, so that turning the table turns them all.
fn central_contacts(shape: &Shape, pose: Pose, pile: Option<Vec2>) -> Vec<(f64, Point)> {
    if let Shape::Disc { radius_m } = shape {
        let first_rad = pile.map_or(0.0, Vec2::heading_rad);
        let step_rad = std::f64::consts::TAU / f64::from(HEADINGS);
        return (0..HEADINGS)
            .map(|k| {
                let heading_rad = wrapped_rad(first_rad + f64::from(k) * step_rad);
                (heading_rad, pose.position - Vec2::from_heading(heading_rad) * *radius_m)
            })
            .collect();
    }
    let corners = shape.corners();
    let n = corners.len();
    (0..n)
        .filter_map(|k| {
            let (from, to) = (corners[k].to_vec(), corners[(k + 1) % n].to_vec());
            let along = (to - from).direction()?;
            // Corners run counter-clockwise: the inside lies to the left.
            let inward = along.perpendicular();
            let foot = from - along * from.dot(along);
            let on_side = from.dot(along) < 0.0 && to.dot(along) > 0.0;
            // A side that faces its own centroid's far side is struck from within.
            (on_side && foot.dot(inward) < 0.0).then(|| {
                let touch = pose.table_from_body(Point::ORIGIN + foot);
                (wrapped_rad(inward.heading_rad() + pose.yaw_rad), touch)
            })
        })
        .collect()
}

/// Where the striker's centre is when its front touches a point.
fn striker_center(striker: &Shape, touch: Point, heading_rad: f64) -> Point {
    let reach_m = striker.reach_m(Vec2::new(1.0, 0.0));
    let front = striker.corners().into_iter().filter(|c| c.x > reach_m - TOUCH_M).map(|c| c.y);
    let (low, high) = front.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    // The point of its front that is nearest to its middle line.
    let aside_m = if low > high { 0.0 } else { 0f64.clamp(low, high) };
    touch - Vec2::new(reach_m, aside_m).rotated(heading_rad)
}
