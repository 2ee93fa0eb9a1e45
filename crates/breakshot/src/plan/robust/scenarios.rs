//! How might the table be, for all we know?  Samples of the uncertain world.
//!
//! Each sample draws what a camera, an arm and a campaign of strike videos leave open: where the objects lie, how fast and
//! in which direction the arm really strikes, friction, restitution and masses from their covariance, their scatter from
//! strike to strike, and how objects that touch share an impact, which nobody measured.  All candidates are judged on
//! the same samples (common random numbers), and leaving one source out keeps the draws of all others.

use crate::error::Result;
use crate::geometry::{Pose, Vec2};
use crate::outline::Outline;
use crate::physics::{Compliance, ContactForce, MultipleImpact, Perturbation, Stiffness, World};
use crate::plan::options::{Options, Scatter};
use crate::plan::result::Source;
use crate::properties::{ContactFriction, Properties};
use crate::scene::{Placed, Scene, Strike};
use crate::uncertain::Estimate;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// One world that may be, and how the arm strikes in it.
pub(crate) struct Possible {
    pub world: World,
    speed_factor: f64,
    turn_rad: f64,
}

impl Possible {
    /// What the arm does when it is told this strike.
    pub(crate) fn executed(&self, strike: &Strike) -> Strike {
        Strike {
            heading_rad: strike.heading_rad + self.turn_rad,
            speed_m_s: strike.speed_m_s * self.speed_factor,
            ..strike.clone()
        }
    }
}

/// Draws worlds around the mean one, always the same ones for the same seed; `known` is taken to be exactly as estimated.
pub(crate) fn possible_worlds(
    (scene, properties, mean): (&Scene, &Properties, &World),
    options: &Options,
    (seed, count): (u64, usize),
    known: Option<Source>,
) -> Result<Vec<Possible>> {
    let (factor, values) = (Factor::of(properties), properties.values());
    let draw = |k: usize| {
        let rng = Pcg64Mcg::seed_from_u64(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(k as u64));
        let mut dice = Dice { rng, known };
        let properties = dice.properties(&values, &factor);
        let scene = dice.scene(scene, &options.scatter);
        let (speed, heading) = (dice.normal(Source::Strike), dice.normal(Source::Strike));
        let poses: Vec<Pose> = scene.placed.iter().map(Placed::pose).collect();
        let multiple_impact = dice.multiple_impact();
        let sample = Perturbation { poses: &poses, properties: &properties, multiple_impact };
        Ok(Possible {
            world: mean.perturbed(&sample)?,
            speed_factor: (1.0 + options.scatter.speed * speed).max(LEAST_SPEED_FACTOR),
            turn_rad: options.scatter.heading_rad * heading,
        })
    };
    (0..count).into_par_iter().map(draw).collect()
}

/// However badly the speed is known, the arm moves forward.
const LEAST_SPEED_FACTOR: f64 = 0.1;
/// Contacts of hard objects of some centimetres last between these times (s).
const CONTACT_TIMES_S: [f64; 2] = [5e-5, 2e-3];
/// Friction does not fall below this part of its mean.
const LEAST_FRICTION_PART: f64 = 0.2;

/// Random numbers of one sample.
struct Dice {
    rng: Pcg64Mcg,
    known: Option<Source>,
}

impl Dice {
    /// A standard normal number; zero for what is taken to be known.  The stream runs on in either case.
    fn normal(&mut self, source: Source) -> f64 {
        let drawn: f64 = self.rng.sample(StandardNormal);
        if self.known == Some(source) { 0.0 } else { drawn }
    }

    /// A number from 0 to 1; the middle for what is taken to be known.
    fn uniform(&mut self, source: Source) -> f64 {
        let drawn: f64 = self.rng.random();
        if self.known == Some(source) { 0.5 } else { drawn }
    }

    fn scene(&mut self, scene: &Scene, scatter: &Scatter) -> Scene {
        let mut drawn = scene.clone();
        // By name, so that the order in which objects are listed changes nothing.
        let mut order: Vec<usize> = (0..drawn.placed.len()).collect();
        order.sort_by(|&i, &k| scene.placed[i].object.cmp(&scene.placed[k].object));
        for k in order {
            let placed = &mut drawn.placed[k];
            let shift = Vec2::new(self.normal(Source::Poses), self.normal(Source::Poses));
            placed.position_m += shift * scatter.position_m;
            placed.yaw_rad += scatter.yaw_rad * self.normal(Source::Poses);
        }
        if set_apart(&mut drawn) { drawn } else { scene.clone() }
    }

    fn properties(&mut self, properties: &Properties, factor: &Factor) -> Properties {
        let z: Vec<f64> = (0..factor.names.len()).map(|_| self.rng.sample(StandardNormal)).collect();
        let shifts = factor.shifts(&z);
        let mut drawn = properties.clone();
        for (name, estimate) in &mut drawn.friction {
            let value =
                self.drawn(Source::Friction, estimate, shifts.get(format!("friction/{name}").as_str()));
            estimate.mean = value.max(LEAST_FRICTION_PART * estimate.mean);
        }
        for (group, values) in
            [("striker_restitution", &mut drawn.striker_restitution), ("restitution", &mut drawn.restitution)]
        {
            for (name, estimate) in values {
                let shift = shifts.get(format!("{group}/{name}").as_str());
                estimate.mean = self.drawn(Source::Restitution, estimate, shift).clamp(0.0, 1.0);
            }
        }
        for (name, estimate) in &mut drawn.mass_ratio {
            let alone = self.normal(Source::Masses) * estimate.standard_error / estimate.mean;
            let shift = shifts.get(format!("log_mass_ratio/{name}").as_str()).copied().unwrap_or(alone);
            let known = self.known == Some(Source::Masses);
            estimate.mean *= if known { 1.0 } else { shift.exp() };
        }
        let friction = &mut drawn.contact_friction;
        friction.objects = Some(self.contact_friction(friction.objects));
        friction.striker = Some(self.contact_friction(friction.striker));
        drawn
    }

    /// A value of one strike: the mean is not known exactly, and from strike to strike it varies.
    fn drawn(&mut self, source: Source, estimate: &Estimate, shift: Option<&f64>) -> f64 {
        let (own, spread) = (self.normal(source), self.normal(source));
        let shift = match shift {
            Some(_) if self.known == Some(source) => 0.0,
            Some(shift) => *shift,
            None => estimate.standard_error * own,
        };
        estimate.mean + shift + estimate.std.unwrap_or(0.0) * spread
    }

    fn contact_friction(&mut self, measured: Option<Estimate>) -> Estimate {
        let (normal, uniform) = (self.normal(Source::Contacts), self.uniform(Source::Contacts));
        Estimate::exact(match measured {
            Some(estimate) => {
                let std = estimate.standard_error.hypot(estimate.std.unwrap_or(0.0));
                (estimate.mean + std * normal).max(0.0)
            }
            None => ContactFriction::MOST_ASSUMED * uniform,
        })
    }

    /// A law of touching: nobody measured it, so any of those in use.
    fn multiple_impact(&mut self) -> MultipleImpact {
        let (hertz, alike) = (self.rng.random_bool(0.5), self.rng.random_bool(0.5));
        let part = self.uniform(Source::Contacts);
        let standard = Compliance::default();
        if self.known == Some(Source::Contacts) {
            return MultipleImpact::Compliant(standard);
        }
        let [least_s, most_s] = CONTACT_TIMES_S;
        MultipleImpact::Compliant(Compliance {
            contact_time_s: least_s * (most_s / least_s).powf(part),
            force: if hertz { ContactForce::Hertz } else { ContactForce::Linear },
            stiffness: if alike { Stiffness::Same } else { Stiffness::SameContactTime },
            ..standard
        })
    }
}

/// A square root of the properties' covariance: standard normal numbers times it have that covariance.
struct Factor<'a> {
    names: &'a [String],
    root: DMatrix<f64>,
}

impl<'a> Factor<'a> {
    fn of(properties: &'a Properties) -> Self {
        let covariance = &properties.covariance;
        let n = covariance.names.len();
        let matrix = DMatrix::from_fn(n, n, |i, k| {
            let value = |i: usize, k: usize| covariance.matrix.get(i).and_then(|row| row.get(k)).copied();
            f64::midpoint(value(i, k).unwrap_or(0.0), value(k, i).unwrap_or(0.0))
        });
        // An empty matrix has no decomposition.
        let root = if n == 0 {
            matrix
        } else {
            let eigen = matrix.symmetric_eigen();
            // Rounding may leave eigenvalues just below zero.
            let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
            eigen.eigenvectors * DMatrix::from_diagonal(&roots)
        };
        Self { names: &covariance.names, root }
    }

    fn shifts(&self, z: &[f64]) -> BTreeMap<&'a str, f64> {
        let shift = |row: usize| (0..z.len()).map(|k| self.root[(row, k)] * z[k]).sum();
        self.names.iter().enumerate().map(|(row, name)| (name.as_str(), shift(row))).collect()
    }
}

/// Objects cannot overlap: moves those that do apart along their centres, in small steps; whether that worked.
fn set_apart(scene: &mut Scene) -> bool {
    let shapes: Vec<_> =
        scene.placed.iter().filter_map(|p| scene.object(&p.object).ok().map(|o| o.shape.clone())).collect();
    for _ in 0..MOST_STEPS_APART {
        let outlines: Vec<_> =
            shapes.iter().zip(&scene.placed).map(|(shape, p)| Outline::new(shape, p.pose())).collect();
        let mut apart = true;
        for a in 0..outlines.len() {
            for b in a + 1..outlines.len() {
                let reach_m = shapes[a].outer_radius_m() + shapes[b].outer_radius_m();
                let (from, to) = (scene.placed[a].position_m, scene.placed[b].position_m);
                if from.distance(to) < reach_m && outlines[a].gap_m(&outlines[b]) < 0.0 {
                    let step = (to - from).direction().unwrap_or(Vec2::new(1.0, 0.0)) * (0.5 * STEP_APART_M);
                    scene.placed[a].position_m = from - step;
                    scene.placed[b].position_m = to + step;
                    apart = false;
                }
            }
        }
        if apart {
            return true;
        }
    }
    false
}

/// Fine against what a camera sees (m).
const STEP_APART_M: f64 = 1e-4;
/// Enough for ten millimetres.
const MOST_STEPS_APART: usize = 100;

/// The poses in which the objects lie, by name.
pub(crate) fn by_name(world: &World, poses: &[Pose]) -> BTreeMap<String, Pose> {
    world.names().iter().cloned().zip(poses.iter().copied()).collect()
}
