//! Strikes worth judging: which object, along which line, how fast, how far past the contact.
//!
//! A strike is told by what matters about it: the line along which the striker's centre moves (a heading, and how far the line
//! passes the object's centroid), the speed, and the follow-through.  A proposal is a function from a scene to such aims;
//! [`everywhere`] is the one that knows nothing.  Rules iii to vi of the paper's section 5 are four of its points, not limits.

use crate::conservative_advancement::{Step, advance};
use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2, wrapped_rad};
use crate::outline::Outline;
use crate::plan::approach::{Surroundings, rounded_strike};
use crate::plan::options::{Aim, Options};
use crate::scene::{Placed, Scene, Strike};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Headings around every object.
const HEADINGS: u32 = 24;
/// Offsets, as parts of the greatest at which striker and object still meet.
const OFFSETS: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];
/// Speeds, as parts of the striker's fastest, and follow-throughs (m): hits, and slow pushes.
const PACES: [(f64, f64); 10] = [
    (0.25, 0.01),
    (0.4, 0.01),
    (0.55, 0.01),
    (0.7, 0.01),
    (0.85, 0.01),
    (1.0, 0.01),
    (0.35, 0.05),
    (0.55, 0.05),
    (0.8, 0.05),
    (0.2, 0.1),
];
/// No strike runs on farther than this (m).
pub(crate) const MOST_FOLLOW_THROUGH_M: f64 = 0.15;
/// A shorter follow-through would make an error of the pose a miss (m).
pub(crate) const LEAST_FOLLOW_THROUGH_M: f64 = 0.005;

/// Every object from all around, centrally and not, at many speeds: lines first, each with all paces.
pub(crate) fn everywhere(scene: &Scene, range: &Range) -> Vec<Vec<Aim>> {
    let mut order: Vec<usize> = (0..scene.placed.len()).collect();
    order.sort_by(|&i, &k| scene.placed[i].object.cmp(&scene.placed[k].object));
    let mut lines = Vec::new();
    for object in order {
        let first_rad = heading_to_others(scene, object);
        for k in 0..HEADINGS {
            let heading_rad = wrapped_rad(first_rad + TAU * f64::from(k) / f64::from(HEADINGS));
            for part in OFFSETS {
                let offset_m = part * range.reach_m(object, heading_rad, part);
                let paced = PACES.iter().map(|&(speed, follow_through_m)| Aim {
                    object,
                    heading_rad,
                    offset_m,
                    speed_m_s: (speed * range.fastest_m_s).max(range.slowest_m_s),
                    follow_through_m,
                });
                lines.push(paced.collect());
            }
        }
    }
    lines
}

fn heading_to_others(scene: &Scene, object: usize) -> f64 {
    let others = scene.placed.iter().enumerate().filter(|(k, _)| *k != object);
    let way = others.fold(Vec2::ZERO, |sum, (_, p)| sum + (p.position_m - scene.placed[object].position_m));
    way.direction().map_or(0.0, Vec2::heading_rad)
}

/// What the striker can do to the objects of a scene.
pub(crate) struct Range<'a> {
    scene: &'a Scene,
    surroundings: Vec<Surroundings<'a>>,
    pub slowest_m_s: f64,
    pub fastest_m_s: f64,
}

impl<'a> Range<'a> {
    pub(crate) fn new(scene: &'a Scene) -> Result<Self> {
        let [slowest_m_s, fastest_m_s] = scene.cell.striker.speed_range_m_s;
        let surroundings =
            scene.placed.iter().map(|placed| Surroundings::new(scene, placed)).collect::<Result<_>>()?;
        Ok(Self { scene, surroundings, slowest_m_s, fastest_m_s })
    }

    /// The greatest offset to one side (the sign of `side`) at which striker and object still meet (m).
    pub(crate) fn reach_m(&self, object: usize, heading_rad: f64, side: f64) -> f64 {
        let placed = &self.scene.placed[object];
        let left = Vec2::from_heading(heading_rad).perpendicular() * if side < 0.0 { -1.0 } else { 1.0 };
        let shape = self.scene.object(&placed.object).map(|o| &o.shape);
        let own_m = shape.map_or(0.0, |shape| shape.reach_m(left.rotated(-placed.yaw_rad)));
        let striker = &self.scene.cell.striker.shape;
        own_m + striker.reach_m(-(left.rotated(-heading_rad)))
    }

    /// The strike that an aim asks for, its start the farthest from which the way is free.
    ///
    /// # Errors
    /// What is in the way.
    pub(crate) fn strike(&self, aim: &Aim) -> std::result::Result<Strike, String> {
        let placed = &self.scene.placed[aim.object];
        let contact_m = self.contact_m(placed, aim).ok_or("the line passes the object")?;
        let line = (contact_m, aim.heading_rad);
        let lead_in_m = self.surroundings[aim.object].free_lead_in_m(line, aim.follow_through_m)?;
        Ok(rounded_strike(Strike {
            object: Some(placed.object.clone()),
            start_m: contact_m - Vec2::from_heading(aim.heading_rad) * lead_in_m,
            heading_rad: aim.heading_rad,
            speed_m_s: aim.speed_m_s.clamp(self.slowest_m_s, self.fastest_m_s),
            travel_m: lead_in_m + aim.follow_through_m,
        }))
    }

    /// Where the striker's centre is when it first touches the object; none if it passes.
    fn contact_m(&self, placed: &Placed, aim: &Aim) -> Option<Point> {
        let shape = &self.scene.object(&placed.object).ok()?.shape;
        let striker = &self.scene.cell.striker.shape;
        let target = Outline::new(shape, placed.pose());
        let along = Vec2::from_heading(aim.heading_rad);
        let far_m = shape.outer_radius_m() + striker.outer_radius_m() + CLOSE_M;
        let middle = placed.position_m + along.perpendicular() * aim.offset_m;
        // The gap is a lower bound of the remaining distance.
        let contact = advance(-far_m, MOST_STEPS, |distance_m| {
            let position = middle + along * distance_m;
            let gap_m = Outline::new(striker, Pose { position, yaw_rad: aim.heading_rad }).gap_m(&target);
            if gap_m < CLOSE_M {
                Step::End(Some(position))
            } else if distance_m + gap_m > far_m {
                Step::End(None)
            } else {
                Step::To(distance_m + gap_m)
            }
        });
        contact.ok().flatten()
    }
}

/// Closer than this is a contact (m).
const CLOSE_M: f64 = 1e-7;
/// A line that only just meets the object converges slowly.
const MOST_STEPS: usize = 200;

/// An aim and the strike it asks for.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub aim: Aim,
    pub strike: Strike,
    /// What it is worth in the worlds it was judged in so far, added up.
    pub worth: f64,
}

/// All strikes that an aim leads to, thinned evenly to so many lines, and what is in the way of the others.
pub(crate) fn reachable(
    scene: &Scene,
    range: &Range,
    (options, most_lines): (&Options, usize),
) -> (Vec<Candidate>, BTreeSet<String>) {
    let mut lines = options.proposals.map_or_else(Vec::new, |proposed| {
        proposed(scene)
            .into_iter()
            .filter(|aim| aim.object < scene.placed.len())
            .map(|aim| vec![aim])
            .collect()
    });
    lines.extend(everywhere(scene, range));
    let tried: Vec<std::result::Result<Vec<Candidate>, String>> = lines
        .into_par_iter()
        .map(|paces| {
            let candidate = |aim: Aim| range.strike(&aim).map(|strike| Candidate { aim, strike, worth: 0.0 });
            let slow: Vec<_> = paces.into_iter().map(candidate).collect();
            let free: Vec<_> = slow.iter().filter_map(|c| c.as_ref().ok().cloned()).collect();
            match slow.into_iter().find_map(std::result::Result::err) {
                Some(obstacle) if free.is_empty() => Err(obstacle),
                _ => Ok(free),
            }
        })
        .collect();
    let blocked = tried.iter().filter_map(|t| t.as_ref().err().cloned()).collect();
    let mut free: Vec<Vec<Candidate>> = tried.into_iter().filter_map(std::result::Result::ok).collect();
    free.retain(|line| line.iter().any(|c| reached_by_arm(c, options)));
    let step = free.len().div_ceil(most_lines).max(1);
    (free.into_iter().step_by(step).flatten().collect(), blocked)
}

/// Whether the arm has any mass there; without an arm, always.
fn reached_by_arm(candidate: &Candidate, options: &Options) -> bool {
    let end = |strike: &Strike| {
        let along = crate::geometry::Vec2::from_heading(strike.heading_rad);
        strike.start_m + along * (strike.travel_m - candidate.aim.follow_through_m)
    };
    options
        .effective_mass_kg
        .is_none_or(|mass| mass(end(&candidate.strike), candidate.strike.heading_rad) > 0.0)
}
