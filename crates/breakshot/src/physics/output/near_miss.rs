//! How fragile is an answer?
//!
//! Wherever two bodies barely miss or barely hit each other, a little more or less changes everything after it.  The margin of
//! a hit is how far aside one body would have to lie for the two to pass each other; that of a miss is the gap that stays open.

use crate::geometry::{Pose, Vec2};
use crate::physics::AfterStrike;
use crate::physics::output::outcome::Outcome;
use crate::physics::rotation::Rotation;
use crate::physics::sliding::motion::{Motion, State, length};
use crate::physics::world::{STRIKER, World, gap_m};
use serde::{Deserialize, Serialize};

/// The collision that was most nearly missed, or the miss that was most nearly a collision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Graze {
    /// When (s after the striker starts).
    pub time_s: f64,
    /// The two bodies.
    pub bodies: Vec<String>,
    /// Whether they did hit each other.
    pub hit: bool,
    /// By how much (m).
    pub margin_m: f64,
}

/// A graze by the bodies' indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Close {
    time_s: f64,
    bodies: [usize; 2],
    hit: bool,
    margin_m: f64,
}

/// Slower meetings (m/s) are bodies that lean on each other.
const MEETING_M_S: f64 = 0.03;
/// Nothing passes anything in a shorter time (s).
const SHORTEST_S: f64 = 1e-3;
/// Looks at the gap over a stretch of two motions.
const LOOKS: usize = 16;
/// Halvings of the time around the smallest gap.
const HALVINGS: usize = 30;
/// Smaller gaps (m) are contacts.
const CONTACT_M: f64 = 2e-6;

impl Close {
    /// A hit of two bodies with their states before it; none if they only lean on each other.
    pub(super) fn hit(world: &World, time_s: f64, bodies: [usize; 2], states: &[State; 2]) -> Option<Self> {
        let way = states[0].velocity - states[1].velocity;
        if bodies[1] > world.objects || length(way) < MEETING_M_S {
            return None;
        }
        let across = way.perpendicular() / length(way);
        let [a, b] = [0, 1].map(|k| extent(world, bodies[k], &states[k], across));
        let margin_m = (a[1] - b[0]).min(b[1] - a[0]);
        Some(Self { time_s, bodies, hit: true, margin_m })
    }

    pub(super) fn closer(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(a), Some(b)) => Some(if b.margin_m < a.margin_m { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    pub(super) fn named(&self, world: &World) -> Graze {
        let bodies = self.bodies.iter().map(|&b| world.name(b)).collect();
        Graze { time_s: self.time_s, bodies, hit: self.hit, margin_m: self.margin_m }
    }
}

/// The least and greatest extent of a body along a unit vector (m).
fn extent(world: &World, body: usize, state: &State, along: Vec2) -> [f64; 2] {
    let turn = Rotation::new(state.yaw_rad);
    let centre = state.position.to_vec().dot(along);
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    for part in &world.bodies[body].plate.parts {
        for corner in &part.corners {
            let at = centre + turn.turned(*corner).dot(along);
            found = [found[0].min(at - part.radius_m), found[1].max(at + part.radius_m)];
        }
    }
    found
}

/// The closest miss of all pairs of bodies.
pub(super) fn closest_miss(world: &World, motions: &[Vec<Motion>], outcome: &Outcome) -> Option<Close> {
    let mut closest: Option<Close> = None;
    for a in 0..=world.objects {
        for b in a + 1..=world.objects {
            let until_s =
                there_until_s(world, motions, outcome, a).min(there_until_s(world, motions, outcome, b));
            let (mut i, mut k) = (0, 0);
            loop {
                let next = |list: &[Motion], n: usize| list.get(n + 1).map_or(f64::INFINITY, |m| m.start_s);
                let (next_a, next_b) = (next(&motions[a], i), next(&motions[b], k));
                let both = (&motions[a][i], &motions[b][k]);
                let end_s = next_a.min(next_b);
                closest = Close::closer(closest, miss(world, [a, b], both, end_s.min(until_s)));
                if end_s >= until_s {
                    break;
                }
                (i, k) = (i + usize::from(next_a <= end_s), k + usize::from(next_b <= end_s));
            }
        }
    }
    closest
}

/// Until when a body is on the table (s).
fn there_until_s(world: &World, motions: &[Vec<Motion>], outcome: &Outcome, body: usize) -> f64 {
    let last_s = motions[body].last().map_or(0.0, |m| m.start_s);
    let lifted = body == STRIKER && world.options.after_strike == AfterStrike::Lift;
    let fallen = world.body_of.iter().position(|&b| b == body).is_some_and(|k| outcome.fallen[k]);
    if lifted || fallen { last_s } else { f64::INFINITY }
}

/// The smallest gap on a stretch of two motions, if it lies inside or where both come to rest.
fn miss(world: &World, bodies: [usize; 2], (a, b): (&Motion, &Motion), end_s: f64) -> Option<Close> {
    let from_s = a.start_s.max(b.start_s);
    let rest_s = a.stop_s.max(b.stop_s);
    let to_s = end_s.min(rest_s);
    if to_s - from_s < SHORTEST_S {
        return None;
    }
    let gap = |time_s: f64| {
        let at = |k: usize, m: &Motion| {
            let body = &world.bodies[bodies[k]];
            let state = m.state(time_s, body);
            (body, Pose { position: state.position, yaw_rad: state.yaw_rad })
        };
        gap_m(at(0, a), at(1, b))
    };
    let time = |k: usize| from_s + (to_s - from_s) * k as f64 / LOOKS as f64;
    let gaps: Vec<f64> = (0..=LOOKS).map(|k| gap(time(k))).collect();
    let least = (0..=LOOKS).min_by(|&i, &k| gaps[i].total_cmp(&gaps[k]))?;
    let rests = least == LOOKS && rest_s <= end_s && gaps[0] > gaps[LOOKS] + CONTACT_M;
    if least == 0 || least == LOOKS && !rests {
        return None;
    }
    let (mut low_s, mut high_s) = (time(least - 1), time((least + 1).min(LOOKS)));
    for _ in 0..HALVINGS {
        let third = (high_s - low_s) / 3.0;
        if gap(low_s + third) < gap(high_s - third) {
            high_s -= third;
        } else {
            low_s += third;
        }
    }
    let (time_s, margin_m) = (0.5 * (low_s + high_s), gap(0.5 * (low_s + high_s)));
    (margin_m > CONTACT_M).then_some(Close { time_s, bodies, hit: false, margin_m })
}
