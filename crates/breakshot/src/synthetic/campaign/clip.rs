//! One synthetic clip: the layout of the objects, the strike, the motion, and the tracks of it.

use super::body::Body;
use super::impact::Variation;
use super::observation::{self, CLIP_S};
use super::spec::CampaignSpec;
use super::support::half_width_m;
use super::truth::{TrueModel, normal};
use super::world::{STRIKER_RADIUS_M, World};
use crate::detect::Tracks;
use crate::estimate::ClipTracks;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Object, Shape};
use crate::scene::Strike;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::PI;

/// Distance of the striker from the struck object at the start (m).
const RUN_UP_M: f64 = 0.03;
/// Travel of the striker past the first contact (m).
const FOLLOW_M: f64 = 0.005;

/// The objects of a campaign, their true properties, and how they are filmed.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub(super) objects: &'a [Object],
    pub(super) model: &'a TrueModel,
    pub(super) spec: &'a CampaignSpec,
}

/// The layout of one clip.
struct Layout {
    bodies: Vec<Body>,
    strike: Strike,
}

impl Subject<'_> {
    /// A random clip of the objects with these indices; the first one is struck.
    pub(super) fn clip(&self, name: String, case: &[usize], random: &mut Pcg64Mcg) -> ClipTracks {
        let Layout { bodies, strike } = self.layout(case, random);
        let strike_start_s = random.random_range(0.1..0.16);
        let mut world = World { bodies, strike: strike.clone(), strike_start_s };
        let histories = world.run(self.model, CLIP_S + 2.0 * self.spec.frame_s, || Variation {
            restitution: 1.0 + self.spec.restitution_std * normal(random),
            rocking: random.random_range(0.0..2.0),
        });
        let tracks = histories.iter().map(|h| observation::track(h, self.spec, random)).collect();
        ClipTracks {
            name,
            objects: histories.iter().map(|h| h.object.clone()).collect(),
            strike: Some(strike),
            tracks: Tracks { version: 1, tracks, ..Tracks::default() },
        }
    }

    fn half_width_m(&self, k: usize) -> f64 {
        half_width_m(&self.objects[k].shape)
    }

    /// A random layout: the struck object at the origin, the other one where the struck one will hit it.
    fn layout(&self, case: &[usize], random: &mut Pcg64Mcg) -> Layout {
        let objects = self.objects;
        let heading_rad = random.random_range(-0.4..0.4);
        let along = Vec2::from_heading(heading_rad);
        let mut offset_m = |reach_m: f64| self.spec.max_offset * reach_m * random.random_range(-1.0..1.0);
        let strike_offset_m = offset_m(self.half_width_m(case[0]) + STRIKER_RADIUS_M);
        let impact_offset_m = offset_m(case.iter().map(|&k| self.half_width_m(k)).sum::<f64>());
        let friction_scale = 1.0 + self.spec.friction_std * normal(random);

        // The objects.
        let struck = &objects[case[0]].shape;
        let mut bodies = Vec::new();
        let mut position = Point::ORIGIN;
        for (n, &k) in case.iter().enumerate() {
            if n > 0 {
                // A disc that is hit off its centre moves along the line of centres.
                let direction = departure(struck, along, strike_offset_m);
                let gap_m = random.random_range(0.012..0.03);
                position =
                    Point::ORIGIN + direction * (self.half_width_m(case[0]) + self.half_width_m(k) + gap_m);
                position += direction.perpendicular() * impact_offset_m;
            }
            let is_copy = n > 0 && case[0] == k;
            let name = if is_copy { format!("{}#2", objects[k].name) } else { objects[k].name.clone() };
            let yaw_rad = match objects[k].shape {
                Shape::Disc { .. } => random.random_range(-PI..PI),
                // The striker meets a face: the impact direction at a corner is random.
                _ => heading_rad + random.random_range(-0.05..0.05),
            };
            bodies.push(Body::new(name, &objects[k], self.model, Pose { position, yaw_rad }, friction_scale));
        }

        // The strike.
        let start_m = Point::ORIGIN - along * (self.half_width_m(case[0]) + STRIKER_RADIUS_M + RUN_UP_M)
            + along.perpendicular() * strike_offset_m;
        let strike = Strike {
            object: None,
            start_m,
            heading_rad,
            speed_m_s: random.random_range(0.3..0.6),
            travel_m: RUN_UP_M + FOLLOW_M + contact_delay_m(struck, strike_offset_m),
        };
        Layout { bodies, strike }
    }
}

/// Additional travel before a striker touches a disc that it hits at an offset from the centre (m).
fn contact_delay_m(shape: &Shape, offset_m: f64) -> f64 {
    match shape {
        Shape::Disc { radius_m } => {
            let sum_m = radius_m + STRIKER_RADIUS_M;
            sum_m - (sum_m * sum_m - offset_m * offset_m).max(0.0).sqrt()
        }
        _ => 0.0,
    }
}

/// The direction in which a body leaves a striker that hits it at an offset from the centre, without contact friction.
fn departure(shape: &Shape, along: Vec2, offset_m: f64) -> Vec2 {
    match shape {
        Shape::Disc { radius_m } => {
            let sin = -offset_m / (radius_m + STRIKER_RADIUS_M);
            along * (1.0 - sin * sin).max(0.0).sqrt() + along.perpendicular() * sin
        }
        _ => along,
    }
}
