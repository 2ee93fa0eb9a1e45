//! Which central strikes can the striker execute? (rules iii, iv and vi of section 5)
//!
//! A strike is central if its line of action passes through the object's centroid.  A disc can be struck centrally from every heading,
//! a polygon on each side that contains the foot of the perpendicular from the centroid.  The lead-in has to be free of other objects,
//! walls and keep-out areas, see `plan/approach.rs`.

use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2, wrapped_rad};
use crate::object::Shape;
use crate::physics::GRAVITY_M_S2;
use crate::physics::mass_unit::MassUnit;
use crate::plan::approach::{ContactLine, Surroundings, TOUCH_M, rounded, rounded_strike};
use crate::plan::arm::{CellArm, OUT_OF_REACH};
use crate::properties::Properties;
use crate::robot::least_follow_through_m;
use crate::scene::{Placed, Scene, Strike};
use std::collections::BTreeSet;

/// Least follow-through (m): a shorter one would miss the object by an error of its pose.
const LEAST_FOLLOW_THROUGH_M: f64 = 0.005;
/// Greatest follow-through (m): the paper's strike ends at the impact.
pub(crate) const MOST_FOLLOW_THROUGH_M: f64 = 0.02;
/// Fraction of the catch-up distance after which the striker stops.
const CATCH_UP_FRACTION: f64 = 0.5;
/// Headings around a disc.
const HEADINGS: u32 = 72;

/// A central strike without its speed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CentralStrike {
    /// The object to be struck.
    pub object: String,
    /// The striker's centre at first contact, and the direction.
    pub line: ContactLine,
    /// Distance from the start to the contact (m).
    pub lead_in_m: f64,
    /// Impulse at unit speed (kg, Eq. 8 and 24); from assumed masses if no object was weighed.
    pub impulse: f64,
    /// The striker's effective mass (kg), infinite without an arm.
    pub effective_mass_kg: f64,
    /// Speeds of the striker, and within the arm's limits (m/s).
    pub speed_range_m_s: [f64; 2],
    /// Whether an arm of limited deceleration has to stop the striker.
    has_arm: bool,
    /// Cosine of the angle between the heading and the direction to the mean position of the other objects.
    pub towards_pile: f64,
    /// Restitution against the striker.
    restitution: f64,
    /// Deceleration by friction (m/s2).
    deceleration_m_s2: f64,
}

/// An object that no central strike reaches.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Blocked {
    /// The object.
    pub object: String,
    /// The obstacles: names of objects, `a wall`, and so on.
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
/// A property of the object that was not measured.
pub(crate) fn central_strikes(
    scene: &Scene,
    properties: &Properties,
    arm: Option<&CellArm>,
    target: &Placed,
) -> Result<std::result::Result<Vec<CentralStrike>, Blocked>> {
    let shape = &scene.object(&target.object)?.shape;
    let restitution = properties.striker_restitution(&target.object)?.mean;
    let deceleration_m_s2 = properties.friction(&target.object)?.mean * GRAVITY_M_S2;
    let mass_kg = properties.mass_ratio(&target.object)?.mean * MassUnit::of(scene, properties).kg();
    let [slowest_m_s, fastest_m_s] = scene.cell.striker.speed_range_m_s;
    let pile = middle_of_others(scene, target).and_then(|middle| (middle - target.position_m).direction());
    let surroundings = Surroundings::new(scene, target)?;
    let mut found = Vec::new();
    let mut by = BTreeSet::new();
    for (heading_rad, touch) in central_contacts(shape, target.pose(), pile) {
        let contact_m = striker_center(&scene.cell.striker.shape, touch, heading_rad);
        let line = ContactLine { contact_m, heading_rad };
        let (fastest_m_s, effective_mass_kg) = match arm {
            None => (fastest_m_s, f64::INFINITY),
            Some(arm) => match arm.capability(contact_m, heading_rad) {
                Some(tip) if tip.speed_m_s >= slowest_m_s => {
                    (fastest_m_s.min(tip.speed_m_s), tip.effective_mass_kg)
                }
                _ => {
                    by.insert(OUT_OF_REACH.to_owned());
                    continue;
                }
            },
        };
        match surroundings.free_lead_in_m(line, MOST_FOLLOW_THROUGH_M) {
            Ok(lead_in_m) => found.push(CentralStrike {
                object: target.object.clone(),
                line,
                lead_in_m,
                impulse: impulse(restitution, mass_kg, effective_mass_kg),
                effective_mass_kg,
                speed_range_m_s: [slowest_m_s, fastest_m_s],
                has_arm: arm.is_some(),
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
    found.sort_unstable_by(CentralStrike::better_first);
    Ok(Ok(found))
}

impl CentralStrike {
    /// Sorts the better strike first.
    pub(crate) fn better_first(one: &Self, other: &Self) -> std::cmp::Ordering {
        other
            .impulse
            .total_cmp(&one.impulse)
            .then(other.effective_mass_kg.total_cmp(&one.effective_mass_kg))
            .then(rounded(other.towards_pile, 1e-9).total_cmp(&rounded(one.towards_pile, 1e-9)))
            .then(one.object.cmp(&other.object))
            .then(one.line.heading_rad.total_cmp(&other.line.heading_rad))
    }

    /// The distance (m) after which a striker that does not stop catches up with the sliding object.
    ///
    /// The object leaves at (1 + e) v, and both meet again at t = 2 e v / (mu g) (Eq. 27 and 28 with Eq. 25 corrected).
    pub(crate) fn catch_up_m(&self, speed_m_s: f64) -> f64 {
        2.0 * self.restitution * speed_m_s * speed_m_s / self.deceleration_m_s2
    }

    /// The distance from contact to stop (m).
    pub(crate) fn follow_through_m(&self, speed_m_s: f64) -> f64 {
        let follow_through_m = (CATCH_UP_FRACTION * self.catch_up_m(speed_m_s))
            .clamp(LEAST_FOLLOW_THROUGH_M, MOST_FOLLOW_THROUGH_M);
        let least_m = if self.has_arm { least_follow_through_m(speed_m_s) } else { 0.0 };
        follow_through_m.max(least_m)
    }

    /// The speed at which the object would slide this far if it met no other (m/s, Eq. 25 and 30).
    pub(crate) fn speed_for_slide_m_s(&self, distance_m: f64) -> f64 {
        (2.0 * self.deceleration_m_s2 * distance_m).sqrt() / (1.0 + self.restitution)
    }

    /// The strike at that speed.
    pub(crate) fn strike(&self, speed_m_s: f64) -> Strike {
        rounded_strike(Strike {
            object: Some(self.object.clone()),
            start_m: self.line.start_m(self.lead_in_m),
            heading_rad: self.line.heading_rad,
            speed_m_s,
            travel_m: self.lead_in_m + self.follow_through_m(speed_m_s),
        })
    }
}

/// Impulse at unit speed on a free object at rest (kg): (1 + e) / (1/m + 1/M) (Eq. 8); for infinite M (1 + e) m (Eq. 24).
fn impulse(restitution: f64, mass_kg: f64, effective_mass_kg: f64) -> f64 {
    (1.0 + restitution) / (1.0 / mass_kg + 1.0 / effective_mass_kg)
}

/// Mean position of the other objects; none for a single object.
fn middle_of_others(scene: &Scene, target: &Placed) -> Option<Point> {
    let others: Vec<_> = scene.placed.iter().filter(|p| p.object != target.object).collect();
    let sum = others.iter().fold(Vec2::ZERO, |sum, p| sum + p.position_m.to_vec());
    (!others.is_empty()).then(|| Point::ORIGIN + sum / others.len() as f64)
}

/// Headings (rad) and touched points of all central strikes on a shape.
///
/// Around a disc the headings start at the direction to the pile, so that rotating the table rotates them all.
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
            // A side with the centroid on its outer side could only be struck from within the object.
            (on_side && foot.dot(inward) < 0.0).then(|| {
                let touch = pose.table_from_body(Point::ORIGIN + foot);
                (wrapped_rad(inward.heading_rad() + pose.yaw_rad), touch)
            })
        })
        .collect()
}

/// The striker's centre when its front touches a point.
fn striker_center(striker: &Shape, touch: Point, heading_rad: f64) -> Point {
    let reach_m = striker.reach_m(Vec2::new(1.0, 0.0));
    let front = striker.corners().into_iter().filter(|c| c.x > reach_m - TOUCH_M).map(|c| c.y);
    let (low, high) = front.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    // The point of the front that is nearest to the striker's centre line.
    let aside_m = if low > high { 0.0 } else { 0f64.clamp(low, high) };
    touch - Vec2::new(reach_m, aside_m).rotated(heading_rad)
}
