//! Which strikes are evaluated?  A grid over objects, lines and speeds, and the strikes that a user proposes.
//!
//! A strike is described by the line of the striker's centre (heading, and offset from the object's centroid), the speed, and the
//! follow-through.  The strikes of rules iii to vi of the paper's section 5 are points of the grid.

use crate::error::{Error, Result};
use crate::geometry::conservative_advancement::{Step, advance};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2, wrapped_rad};
use crate::plan::approach::{ContactLine, Surroundings, rounded_strike};
use crate::plan::arm::{CellArm, OUT_OF_REACH};
use crate::plan::options::{Aim, Options};
use crate::robot::least_follow_through_m;
use crate::scene::{Placed, Scene, Strike};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Number of headings around every object.
const HEADINGS: u32 = 24;
/// Offsets, as fractions of the greatest offset at which striker and object still meet.
const OFFSETS: [f64; 5] = [-0.5, -0.25, 0.0, 0.25, 0.5];
/// Speeds, as fractions of the striker's greatest speed, with follow-throughs (m): hits, and slow pushes.
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
/// The steps between neighbouring strikes: of the offset's fraction, and of the logarithms of speed and follow-through.
const OFFSET_STEP: f64 = 0.25;
const SPEED_STEP: f64 = 0.25;
const FOLLOW_THROUGH_STEP: f64 = 0.8;
/// Greatest follow-through (m).
pub(crate) const MOST_FOLLOW_THROUGH_M: f64 = 0.15;
/// Least follow-through (m): a shorter one would miss the object by an error of its pose.
pub(crate) const LEAST_FOLLOW_THROUGH_M: f64 = 0.005;
/// Gaps up to this are contacts (m).
const CONTACT_GAP_M: f64 = 1e-7;
/// Greatest number of steps to the contact; a line that is nearly tangent to the object converges slowly.
const MOST_STEPS: usize = 200;

/// Strikes on one object with headings closer than this are variants of each other (rad).
const ALIKE_RAD: f64 = 0.2;

/// A feasible strike, and its score so far.
#[derive(Clone, Debug)]
pub(crate) struct StrikeCandidate {
    pub aim: Aim,
    pub strike: Strike,
    /// Sum of its scores in the scenarios evaluated so far.
    pub score: f64,
}

impl StrikeCandidate {
    /// Whether two strikes are variants of one: on one object with nearly the same heading.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        let (one, other) = (&self.aim, &other.aim);
        one.object == other.object && wrapped_rad(one.heading_rad - other.heading_rad).abs() < ALIKE_RAD
    }

    /// The striker's centre when it first touches the object (m).
    fn contact_m(&self) -> Point {
        let Strike { start_m, heading_rad, travel_m, .. } = self.strike;
        start_m + Vec2::from_heading(heading_rad) * (travel_m - self.aim.follow_through_m)
    }
}

/// The strikes of a line that are within the arm's reach and speed; `None` if there are none.
fn within_reach(line: &[StrikeCandidate], arm: Option<&CellArm>) -> Option<Vec<StrikeCandidate>> {
    let (Some(arm), Some(first)) = (arm, line.first()) else { return Some(line.to_vec()) };
    let wanted_m_s = line.iter().map(|c| c.strike.speed_m_s).fold(0.0, f64::max);
    let fastest_m_s = arm.speed_m_s(first.contact_m(), first.strike.heading_rad, wanted_m_s);
    let reached: Vec<_> = line.iter().filter(|c| c.strike.speed_m_s <= fastest_m_s).cloned().collect();
    (!reached.is_empty()).then_some(reached)
}

/// How the strikes of a grid are spaced.
#[derive(Clone, Copy, Debug)]
pub(crate) enum GridSpacing {
    /// Uniformly.
    Regular,
    /// One strike at random within each step (stratified sampling).
    Random { seed: u64 },
}

/// The feasible strikes on a scene, and the obstacles of the others.
pub(crate) struct Feasible {
    pub strikes: Vec<StrikeCandidate>,
    pub obstacles: BTreeSet<String>,
}

/// The strikes that the striker can make on the objects of a scene.
pub(crate) struct StrikeGrid<'a> {
    scene: &'a Scene,
    arm: Option<&'a CellArm<'a>>,
    surroundings: Vec<Surroundings<'a>>,
    pub slowest_m_s: f64,
    pub fastest_m_s: f64,
}

impl<'a> StrikeGrid<'a> {
    pub(crate) fn new(scene: &'a Scene, arm: Option<&'a CellArm<'a>>) -> Result<Self> {
        let [slowest_m_s, fastest_m_s] = scene.cell.striker.speed_range_m_s;
        let surroundings =
            scene.placed.iter().map(|placed| Surroundings::new(scene, placed)).collect::<Result<_>>()?;
        Ok(Self { scene, arm, surroundings, slowest_m_s, fastest_m_s })
    }

    /// The feasible strikes of the proposals and of the grid within the arm's reach and speed, uniformly thinned to `most_lines` lines.
    ///
    /// # Errors
    /// A proposal for an object that is not placed.
    pub(crate) fn feasible(
        &self,
        options: &Options,
        most_lines: usize,
        spacing: GridSpacing,
    ) -> Result<Feasible> {
        let mut lines = self.proposed(options)?;
        lines.extend(self.lines(spacing));
        let tried: Vec<std::result::Result<Vec<StrikeCandidate>, String>> = lines
            .into_par_iter()
            .map(|aims| {
                let all: Vec<_> = aims.into_iter().map(|aim| self.candidate(aim)).collect();
                let free: Vec<_> = all.iter().filter_map(|c| c.as_ref().ok().cloned()).collect();
                if let Some(obstacle) = all.into_iter().find_map(std::result::Result::err)
                    && free.is_empty()
                {
                    return Err(obstacle);
                }
                Ok(free)
            })
            .collect();
        let mut obstacles: BTreeSet<String> =
            tried.iter().filter_map(|t| t.as_ref().err().cloned()).collect();
        let free: Vec<Vec<StrikeCandidate>> = tried.into_iter().filter_map(std::result::Result::ok).collect();
        // Of each group of neighbouring lines the first that the arm reaches
        let groups = free.par_chunks(free.len().div_ceil(most_lines).max(1));
        let reached = groups.filter_map(|group| group.iter().find_map(|line| within_reach(line, self.arm)));
        let strikes: Vec<StrikeCandidate> = reached.collect::<Vec<_>>().concat();
        if strikes.is_empty() && !free.is_empty() {
            obstacles.insert(OUT_OF_REACH.to_owned());
        }
        Ok(Feasible { strikes, obstacles })
    }

    /// Each proposal as a line of its own.
    fn proposed(&self, options: &Options) -> Result<Vec<Vec<Aim>>> {
        let aims = options.proposals.map_or_else(Vec::new, |proposed| proposed(self.scene));
        if let Some(aim) = aims.iter().find(|aim| self.index(&aim.object).is_none()) {
            let placed: Vec<_> = self.scene.placed.iter().map(|p| p.object.as_str()).collect();
            let needed = format!("one of the placed objects: {}", placed.join(", "));
            return Err(Error::invalid("proposals", "object", &aim.object, needed));
        }
        Ok(aims.into_iter().map(|aim| vec![aim]).collect())
    }

    /// The grid: lines around every object, central and with offsets, each at all paces.
    fn lines(&self, spacing: GridSpacing) -> Vec<Vec<Aim>> {
        let mut order: Vec<&Placed> = self.scene.placed.iter().collect();
        order.sort_unstable_by(|one, other| one.object.cmp(&other.object));
        let mut random = match spacing {
            GridSpacing::Regular => None,
            GridSpacing::Random { seed } => Some(Pcg64Mcg::seed_from_u64(seed)),
        };
        // A displacement within a step of the grid, from -0.5 to 0.5 steps
        let mut displacement = || random.as_mut().map_or(0.0, |rng| rng.random::<f64>() - 0.5);
        let mut lines = Vec::new();
        for placed in order {
            let first_rad = heading_to_others(self.scene, placed);
            for k in 0..HEADINGS {
                let heading_rad =
                    wrapped_rad(first_rad + TAU * (f64::from(k) + displacement()) / f64::from(HEADINGS));
                for fraction in OFFSETS {
                    let fraction = fraction + OFFSET_STEP * displacement();
                    let offset_m = fraction * self.greatest_offset_m(&placed.object, heading_rad, fraction);
                    let mut aim = |&(speed, follow_through_m): &(f64, f64)| {
                        let speed_m_s = speed * (SPEED_STEP * displacement()).exp() * self.fastest_m_s;
                        Aim {
                            object: placed.object.clone(),
                            heading_rad,
                            offset_m,
                            speed_m_s: speed_m_s.max(self.slowest_m_s).min(self.fastest_m_s),
                            follow_through_m: follow_through_m * (FOLLOW_THROUGH_STEP * displacement()).exp(),
                        }
                    };
                    lines.push(PACES.iter().map(&mut aim).collect());
                }
            }
        }
        lines
    }

    fn index(&self, object: &str) -> Option<usize> {
        self.scene.placed.iter().position(|p| p.object == object)
    }

    /// The greatest offset (m) to one side (the sign of `side`) at which striker and object still meet.
    pub(crate) fn greatest_offset_m(&self, object: &str, heading_rad: f64, side: f64) -> f64 {
        let yaw_rad = self.index(object).map_or(0.0, |k| self.scene.placed[k].yaw_rad);
        let left = Vec2::from_heading(heading_rad).perpendicular() * if side < 0.0 { -1.0 } else { 1.0 };
        let shape = self.scene.object(object).map(|o| &o.shape);
        let own_m = shape.map_or(0.0, |shape| shape.reach_m(left.rotated(-yaw_rad)));
        let striker = &self.scene.cell.striker.shape;
        own_m + striker.reach_m(-(left.rotated(-heading_rad)))
    }

    /// The strike of an aim; its follow-through is at least the one in which the arm can stop.
    ///
    /// # Errors
    /// The obstacle.
    pub(crate) fn candidate(&self, aim: Aim) -> std::result::Result<StrikeCandidate, String> {
        let least_m = self.arm.map_or(0.0, |_| least_follow_through_m(aim.speed_m_s));
        let aim = Aim { follow_through_m: aim.follow_through_m.max(least_m), ..aim };
        let strike = self.strike(&aim)?;
        Ok(StrikeCandidate { aim, strike, score: 0.0 })
    }

    /// The strike of an aim, with the longest lead-in that is free.
    ///
    /// # Errors
    /// The obstacle.
    pub(crate) fn strike(&self, aim: &Aim) -> std::result::Result<Strike, String> {
        let k = self.index(&aim.object).ok_or("the object is not placed")?;
        let contact_m = self.contact_m(&self.scene.placed[k], aim).ok_or("the line passes the object")?;
        let line = ContactLine { contact_m, heading_rad: aim.heading_rad };
        let lead_in_m = self.surroundings[k].free_lead_in_m(line, aim.follow_through_m)?;
        Ok(rounded_strike(Strike {
            object: Some(aim.object.clone()),
            start_m: line.start_m(lead_in_m),
            heading_rad: aim.heading_rad,
            speed_m_s: aim.speed_m_s.clamp(self.slowest_m_s, self.fastest_m_s),
            travel_m: lead_in_m + aim.follow_through_m,
        }))
    }

    /// The striker's centre when it first touches the object (conservative advancement along the line); none if it passes.
    fn contact_m(&self, placed: &Placed, aim: &Aim) -> Option<Point> {
        let shape = &self.scene.object(&placed.object).ok()?.shape;
        let striker = &self.scene.cell.striker.shape;
        let target = Outline::new(shape, placed.pose());
        let along = Vec2::from_heading(aim.heading_rad);
        let far_m = shape.outer_radius_m() + striker.outer_radius_m() + CONTACT_GAP_M;
        let middle = placed.position_m + along.perpendicular() * aim.offset_m;
        // The gap is a lower bound of the remaining distance, so that the striker never steps over the contact.
        let contact = advance(-far_m, MOST_STEPS, |distance_m| {
            let position = middle + along * distance_m;
            let gap_m = Outline::new(striker, Pose { position, yaw_rad: aim.heading_rad }).gap_m(&target);
            if gap_m < CONTACT_GAP_M {
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

/// Heading from an object to the sum of the directions to the others (rad).
fn heading_to_others(scene: &Scene, object: &Placed) -> f64 {
    let others = scene.placed.iter().filter(|p| p.object != object.object);
    let sum = others.fold(Vec2::ZERO, |sum, p| sum + (p.position_m - object.position_m));
    sum.direction().map_or(0.0, Vec2::heading_rad)
}
