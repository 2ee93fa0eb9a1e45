//! How close was a hit to a miss, or a miss to a hit?
//!
//! Where two bodies narrowly miss or narrowly hit each other, small changes have a large effect on everything after it.  The
//! margin of a hit is the overlap of the two bodies across their relative velocity, that of a miss the smallest gap.

use crate::geometry::{Pose, Vec2};
use crate::physics::contact::distance::gap_m;
use crate::physics::event_loop::striker::AfterStrike;
use crate::physics::output::outcome::Outcome;
use crate::physics::rotation::{Rotation, length};
use crate::physics::sliding::body::{Body, STRIKER};
use crate::physics::sliding::motion::{Motion, State};
use crate::physics::world::World;
use serde::{Deserialize, Serialize};

/// The hit that was closest to a miss, or the miss that was closest to a hit.
#[non_exhaustive]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NearMiss {
    /// Time (s after the striker starts).
    pub time_s: f64,
    /// The two bodies.
    pub bodies: Vec<String>,
    /// Whether they hit each other.
    pub hit: bool,
    /// Overlap across the relative velocity of a hit, or smallest gap of a miss (m).
    pub margin_m: f64,
}

/// The margin of a hit or miss of two bodies, given by their indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PairMargin {
    time_s: f64,
    bodies: [usize; 2],
    hit: bool,
    margin_m: f64,
}

/// Relative speed (m/s) below which a contact is no hit but bodies that are pushed together.
const LEAST_IMPACT_M_S: f64 = 0.03;
/// Shortest time in which bodies can pass each other (s).
const SHORTEST_S: f64 = 1e-3;
/// Samples of the gap over the common time of two motions.
const SAMPLES: usize = 16;
/// Steps of the ternary search around the smallest sample.
const SECTIONS: usize = 30;
/// Gap (m) below which bodies are in contact.
const CONTACT_M: f64 = 2e-6;

impl PairMargin {
    /// The margin of a hit of two bodies with their states before it; none if they are pushed together slowly.
    pub(super) fn of_hit(
        world: &World,
        time_s: f64,
        bodies: [usize; 2],
        states: &[State; 2],
    ) -> Option<Self> {
        let relative_velocity = states[0].velocity - states[1].velocity;
        if bodies[1] > world.objects || length(relative_velocity) < LEAST_IMPACT_M_S {
            return None;
        }
        let across = relative_velocity.perpendicular() / length(relative_velocity);
        let [a, b] = [0, 1].map(|k| extent(world, bodies[k], &states[k], across));
        let margin_m = (a[1] - b[0]).min(b[1] - a[0]);
        Some(Self { time_s, bodies, hit: true, margin_m })
    }

    /// The smaller of two margins.
    pub(super) fn smaller(one: Option<Self>, other: Option<Self>) -> Option<Self> {
        match (one, other) {
            (Some(a), Some(b)) => Some(if b.margin_m < a.margin_m { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// The same with the names of the bodies.
    pub(super) fn named(&self, world: &World) -> NearMiss {
        let bodies = self.bodies.iter().map(|&b| world.name(b)).collect();
        NearMiss { time_s: self.time_s, bodies, hit: self.hit, margin_m: self.margin_m }
    }
}

/// The least and greatest extent of a body along a unit vector (m).
fn extent(world: &World, body: usize, state: &State, along: Vec2) -> [f64; 2] {
    let rotation = Rotation::new(state.yaw_rad);
    let centre = state.position.to_vec().dot(along);
    let mut found = [f64::INFINITY, f64::NEG_INFINITY];
    for part in &world.bodies[body].shape.parts {
        for corner in &part.corners {
            let at = centre + rotation.apply(*corner).dot(along);
            found = [found[0].min(at - part.radius_m), found[1].max(at + part.radius_m)];
        }
    }
    found
}

/// The smallest gap that stayed open, over all pairs of the striker and the objects.
pub(super) fn smallest_gap(world: &World, motions: &[Vec<Motion>], outcome: &Outcome) -> Option<PairMargin> {
    let mut closest: Option<PairMargin> = None;
    for a in 0..=world.objects {
        for b in a + 1..=world.objects {
            let until_s = on_table_until_s(world, motions, outcome, a)
                .min(on_table_until_s(world, motions, outcome, b));
            let (mut i, mut k) = (0, 0);
            loop {
                let next = |list: &[Motion], n: usize| list.get(n + 1).map_or(f64::INFINITY, |m| m.start_s);
                let (next_a, next_b) = (next(&motions[a], i), next(&motions[b], k));
                let both = [&motions[a][i], &motions[b][k]];
                let end_s = next_a.min(next_b);
                closest = PairMargin::smaller(closest, gap_between(world, [a, b], both, end_s.min(until_s)));
                if end_s >= until_s {
                    break;
                }
                (i, k) = (i + usize::from(next_a <= end_s), k + usize::from(next_b <= end_s));
            }
        }
    }
    closest
}

/// The time until which a body is on the table (s).
fn on_table_until_s(world: &World, motions: &[Vec<Motion>], outcome: &Outcome, body: usize) -> f64 {
    let last_s = motions[body].last().map_or(0.0, |m| m.start_s);
    let lifted = body == STRIKER && world.options.after_strike == AfterStrike::Lift;
    let fallen = world.body_of.iter().position(|&b| b == body).is_some_and(|k| outcome.fallen[k]);
    if lifted || fallen { last_s } else { f64::INFINITY }
}

/// The smallest gap during two motions, if it is inside their common time or where both come to rest.
fn gap_between(world: &World, bodies: [usize; 2], [a, b]: [&Motion; 2], end_s: f64) -> Option<PairMargin> {
    let from_s = a.start_s.max(b.start_s);
    let rest_s = a.stop_s.max(b.stop_s);
    let to_s = end_s.min(rest_s);
    if to_s - from_s < SHORTEST_S {
        return None;
    }
    let gap = |time_s: f64| {
        let [body_a, body_b] = bodies.map(|k| &world.bodies[k]);
        let pose = |motion: &Motion, body: &Body| {
            let state = motion.state(time_s, body);
            Pose { position: state.position, yaw_rad: state.yaw_rad }
        };
        gap_m(body_a, pose(a, body_a), body_b, pose(b, body_b))
    };
    let time = |k: usize| from_s + (to_s - from_s) * k as f64 / SAMPLES as f64;
    let gaps: Vec<f64> = (0..=SAMPLES).map(|k| gap(time(k))).collect();
    let least = (0..=SAMPLES).min_by(|&i, &k| gaps[i].total_cmp(&gaps[k]))?;
    let rests = least == SAMPLES && rest_s <= end_s && gaps[0] > gaps[SAMPLES] + CONTACT_M;
    if least == 0 || least == SAMPLES && !rests {
        return None;
    }
    let (mut low_s, mut high_s) = (time(least - 1), time((least + 1).min(SAMPLES)));
    for _ in 0..SECTIONS {
        let third = (high_s - low_s) / 3.0;
        if gap(low_s + third) < gap(high_s - third) {
            high_s -= third;
        } else {
            low_s += third;
        }
    }
    let (time_s, margin_m) = (0.5 * (low_s + high_s), gap(0.5 * (low_s + high_s)));
    (margin_m > CONTACT_M).then_some(PairMargin { time_s, bodies, hit: false, margin_m })
}
