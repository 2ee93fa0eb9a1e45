//! What might the true state be?  Samples of everything that is uncertain.
//!
//! Each scenario draws the errors of observation, execution and identification: object poses, speed and heading of the executed strike,
//! friction, restitution and masses from their covariance, their variation from strike to strike, and the law of simultaneous impacts,
//! which is not identified.  All strikes are evaluated in the same scenarios (common random numbers), and fixing one source of
//! uncertainty leaves the draws of the others unchanged.

use crate::error::Result;
use crate::geometry::outline::Outline;
use crate::geometry::{Pose, Vec2};
use crate::ordered_map::map_of;
use crate::physics::{
    self, Compliance, ContactForce, MultipleImpact, Perturbation, Pressing, Stiffness, World,
};
use crate::plan::options::ExecutionNoise;
use crate::plan::result::Source;
use crate::properties::support::possible as possible_support;
use crate::properties::{ContactFriction, Properties, PropertyGroup, SlipDamping, TangentialRestitution};
use crate::scene::{Placed, Scene, Strike};
use crate::uncertain::Estimate;
use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A sampled world, and the error with which the arm executes a strike in it.
pub struct Scenario {
    /// The world.
    pub world: World,
    speed_factor: f64,
    heading_error_rad: f64,
}

impl Scenario {
    /// The scenario with coarse pushes, which are quicker to simulate ([`Pressing::Coarse`]).
    pub(crate) fn with_coarse_pushes(mut self) -> Self {
        self.world.options.pressing = Pressing::Coarse;
        self
    }

    /// The strike as executed where this one is commanded.
    pub fn executed(&self, strike: &Strike) -> Strike {
        Strike {
            heading_rad: strike.heading_rad + self.heading_error_rad,
            speed_m_s: strike.speed_m_s * self.speed_factor,
            ..strike.clone()
        }
    }
}

/// What the scenarios vary: the observed scene, the estimated properties, and the errors of both and of the execution.
pub(crate) struct Nominal<'a> {
    pub scene: Cow<'a, Scene>,
    /// With assumed values where no clip measured one.
    pub properties: Cow<'a, Properties>,
    pub noise: ExecutionNoise,
    /// The scene with the properties at their means.
    pub world: World,
}

/// Which random numbers are drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Draws {
    pub seed: u64,
    /// Number of scenarios.
    pub count: usize,
    /// A source of uncertainty to leave out: its quantities are fixed at their means.
    pub fixed: Option<Source>,
}

impl<'a> Nominal<'a> {
    /// # Errors
    /// A scene that cannot be simulated.
    pub(crate) fn new(
        scene: &'a Scene,
        properties: &'a Properties,
        noise: ExecutionNoise,
        laws: &physics::Options,
    ) -> Result<Self> {
        let properties = properties.completed_for(scene)?;
        let world = World::new(scene, &properties, laws)?;
        Ok(Self { scene: Cow::Borrowed(scene), properties, noise, world })
    }

    /// Samples of the uncertain state, the same ones for the same seed.
    ///
    /// # Errors
    /// A drawn scene that cannot be simulated.
    pub(crate) fn scenarios(&self, draws: Draws) -> Result<Vec<Scenario>> {
        let distribution = Distribution::of(&self.properties);
        let draw = |k: usize| self.scenario(&distribution, Sampler::new(draws.seed, k as u64, draws.fixed));
        (0..draws.count).into_par_iter().map(draw).collect()
    }

    /// One sample.
    ///
    /// # Errors
    /// A drawn scene that cannot be simulated.
    pub(crate) fn scenario(&self, distribution: &Distribution, mut sampler: Sampler) -> Result<Scenario> {
        let properties = sampler.properties(distribution);
        let scene = sampler.scene(&self.scene, &self.noise);
        let (speed, heading) = (sampler.normal(Source::Strike), sampler.normal(Source::Strike));
        let poses: Vec<Pose> = scene.placed.iter().map(Placed::pose).collect();
        let multiple_impact = sampler.multiple_impact();
        let sample = Perturbation { poses: &poses, properties: &properties, multiple_impact };
        Ok(Scenario {
            world: self.world.perturbed(&sample)?,
            speed_factor: (1.0 + self.noise.speed * speed).max(LEAST_SPEED_FACTOR),
            heading_error_rad: self.noise.heading_rad * heading,
        })
    }
}

/// Least executed speed over the commanded one: the arm always moves forward.
const LEAST_SPEED_FACTOR: f64 = 0.1;
/// Range of the contact time of hard objects of some centimetres (s).
const CONTACT_TIMES_S: [f64; 2] = [5e-5, 2e-3];
/// Least friction over its mean.
const LEAST_FRICTION_FACTOR: f64 = 0.2;

/// Relative step of drawn support ratios, small against their errors: worlds of equal ratios share their slide curves.
const SUPPORT_STEP: f64 = 0.04;

/// Largest standard deviation of the logarithm of an exponent of damped slip.
const MOST_EXPONENT_STD: f64 = 2.0;

/// Largest drawn slope of the table over the least friction: beyond it objects would not stop where they could have been placed.
const MOST_SLOPE_PER_FRICTION: f64 = 0.9;

/// Random numbers of one sample.
pub(crate) struct Sampler {
    rng: Pcg64Mcg,
    /// What the table does to single objects has numbers of its own: without it the others stay the same.
    table: Pcg64Mcg,
    /// The source whose quantities are not varied.
    fixed: Option<Source>,
}

impl Sampler {
    /// The random numbers of sample number `k` of a seed.
    pub(crate) fn new(seed: u64, k: u64, fixed: Option<Source>) -> Self {
        let number = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(k);
        let (rng, table) = (Pcg64Mcg::seed_from_u64(number), Pcg64Mcg::seed_from_u64(!number));
        Self { rng, table, fixed }
    }

    /// A standard normal number, zero for the fixed source; the stream advances in either case.
    fn normal(&mut self, source: Source) -> f64 {
        let drawn: f64 = self.rng.sample(StandardNormal);
        if self.fixed == Some(source) { 0.0 } else { drawn }
    }

    /// A uniform number from 0 to 1, the mean for the fixed source; the stream advances in either case.
    fn uniform(&mut self, source: Source) -> f64 {
        let drawn: f64 = self.rng.random();
        if self.fixed == Some(source) { 0.5 } else { drawn }
    }

    /// The scene with perturbed poses; objects that overlap then are separated.
    fn scene(&mut self, scene: &Scene, noise: &ExecutionNoise) -> Scene {
        let mut drawn = scene.clone();
        // In the order of names, so that the order of the list does not matter.
        let mut order: Vec<usize> = (0..drawn.placed.len()).collect();
        order.sort_unstable_by(|&i, &k| scene.placed[i].object.cmp(&scene.placed[k].object));
        for k in order {
            let placed = &mut drawn.placed[k];
            let shift = Vec2::new(self.normal(Source::Poses), self.normal(Source::Poses));
            placed.position_m += shift * noise.position_m;
            placed.yaw_rad += noise.yaw_rad * self.normal(Source::Poses);
        }
        if separated(&mut drawn) { drawn } else { scene.clone() }
    }

    /// Properties drawn from their covariance, with the variation from strike to strike.
    pub(crate) fn properties(&mut self, Distribution { values, root }: &Distribution) -> Properties {
        let z: Vec<f64> = (0..root.names.len()).map(|_| self.rng.sample(StandardNormal)).collect();
        let shifts = root.shifts(&z);
        let mut drawn = values.clone();
        for (name, estimate) in &mut drawn.friction {
            let shift = shifts.get(PropertyGroup::Friction.covariance_name(name).as_str());
            let value = self.drawn(Source::Friction, estimate, shift);
            estimate.mean = value.max(LEAST_FRICTION_FACTOR * estimate.mean);
        }
        for (group, values) in [
            (PropertyGroup::StrikerRestitution, &mut drawn.striker_restitution),
            (PropertyGroup::Restitution, &mut drawn.restitution),
        ] {
            for (name, estimate) in values {
                let shift = shifts.get(group.covariance_name(name).as_str());
                estimate.mean = self.drawn(Source::Restitution, estimate, shift).clamp(0.0, 1.0);
            }
        }
        for (name, estimate) in &mut drawn.mass_ratio {
            let independent = self.normal(Source::Masses) * estimate.standard_error / estimate.mean;
            let shift = shifts.get(PropertyGroup::MassRatio.covariance_name(name).as_str());
            let shift = shift.copied().unwrap_or(independent);
            let fixed = self.fixed == Some(Source::Masses);
            estimate.mean *= if fixed { 1.0 } else { shift.exp() };
        }
        let friction = &mut drawn.contact_friction;
        friction.objects = Some(self.contact_friction(friction.objects));
        friction.striker = Some(self.contact_friction(friction.striker));
        let (restitution, damping) = (&mut drawn.tangential_restitution, &mut drawn.tangential_damping);
        self.tangential_law(&mut restitution.objects, &mut damping.objects);
        self.tangential_law(&mut restitution.striker, &mut damping.striker);
        for ratio in drawn.support.values_mut() {
            ratio.mean = self.support(ratio);
        }
        self.tilt(&mut drawn);
        drawn
    }

    /// Draws the slope of a tilted table, on which every object can still rest.
    fn tilt(&mut self, drawn: &mut Properties) {
        let Some(tilt) = drawn.tilt.as_mut().filter(|tilt| !tilt.level) else { return };
        let normals = [(); 2].map(|()| self.table.sample(StandardNormal));
        let drawn_slope =
            if self.fixed == Some(Source::Friction) { tilt.slope() } else { tilt.drawn(normals) };
        let least = drawn.friction.values().map(|friction| friction.mean).fold(f64::INFINITY, f64::min);
        let factor = (MOST_SLOPE_PER_FRICTION * least / drawn_slope.length()).min(1.0);
        (tilt.x.mean, tilt.y.mean) = (drawn_slope.x * factor, drawn_slope.y * factor);
    }

    /// A support ratio at one strike, in steps.
    fn support(&mut self, ratio: &Estimate) -> f64 {
        let normal: f64 = self.table.sample(StandardNormal);
        if self.fixed == Some(Source::Friction) || ratio.standard_error == 0.0 {
            return ratio.mean;
        }
        let std = ratio.standard_error.hypot(ratio.std.unwrap_or(0.0)) / ratio.mean;
        let steps = (std * normal / SUPPORT_STEP).round();
        possible_support(ratio.mean * (SUPPORT_STEP * steps).exp())
    }

    /// The value at one strike: the mean has an error (`shift` if it is part of the covariance), and the value varies about it.
    fn drawn(&mut self, source: Source, estimate: &Estimate, shift: Option<&f64>) -> f64 {
        let (own, spread) = (self.normal(source), self.normal(source));
        let shift = match shift {
            Some(_) if self.fixed == Some(source) => 0.0,
            Some(shift) => *shift,
            None => estimate.standard_error * own,
        };
        estimate.mean + shift + estimate.std.unwrap_or(0.0) * spread
    }

    /// Contact friction, uniform over the assumed range where it was not measured.
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

    /// One of the two laws of tangential restitution with its parameter; the assumed ones where they were not measured.
    fn tangential_law(&mut self, restitution: &mut Option<Estimate>, damping: &mut Option<SlipDamping>) {
        let normals = [(); 2].map(|()| self.normal(Source::Contacts));
        let uniform = self.uniform(Source::Contacts);
        let SlipDamping { probability, exponent } = damping.unwrap_or(SlipDamping::assumed());
        if self.fixed == Some(Source::Contacts) {
            *damping = Some(SlipDamping { probability, exponent });
            return;
        }
        let (mean, std) = restitution.map_or((0.0, TangentialRestitution::ASSUMED_STD), |e| {
            (e.mean, e.standard_error.hypot(e.std.unwrap_or(0.0)))
        });
        let [least, most] = TangentialRestitution::RANGE;
        *restitution = Some(Estimate::exact((mean + std * normals[0]).clamp(least, most)));

        let std = (exponent.standard_error / exponent.mean).min(MOST_EXPONENT_STD);
        *damping = Some(SlipDamping {
            probability: if uniform < probability { 1.0 } else { 0.0 },
            exponent: Estimate::exact(exponent.mean * (std * normals[1]).exp()),
        });
    }

    /// A law of simultaneous impacts: linear or Hertzian, with equal stiffness or equal contact times.  It is not identified.
    fn multiple_impact(&mut self) -> MultipleImpact {
        let (hertz, same) = (self.rng.random_bool(0.5), self.rng.random_bool(0.5));
        let fraction = self.uniform(Source::Contacts);
        let standard = Compliance::default();
        if self.fixed == Some(Source::Contacts) {
            return MultipleImpact::Compliant(standard);
        }
        let [least_s, most_s] = CONTACT_TIMES_S;
        MultipleImpact::Compliant(Compliance {
            contact_time_s: least_s * (most_s / least_s).powf(fraction),
            force: if hertz { ContactForce::Hertz } else { ContactForce::Linear },
            stiffness: if same { Stiffness::Same } else { Stiffness::SameContactTime },
            ..standard
        })
    }
}

/// The distribution of the properties: their means and uncertainties, prepared for many draws.
pub(crate) struct Distribution {
    values: Properties,
    root: CovarianceRoot,
}

impl Distribution {
    pub(crate) fn of(properties: &Properties) -> Self {
        Self { values: properties.values(), root: CovarianceRoot::of(properties) }
    }
}

/// A square root of the properties' covariance: it maps standard normal numbers to errors with that covariance.
struct CovarianceRoot {
    names: Vec<String>,
    root: DMatrix<f64>,
}

impl CovarianceRoot {
    fn of(properties: &Properties) -> Self {
        let covariance = &properties.covariance;
        let n = covariance.names.len();
        let matrix = DMatrix::from_fn(n, n, |i, k| {
            let value = |i: usize, k: usize| covariance.matrix.get(i).and_then(|row| row.get(k)).copied();
            f64::midpoint(value(i, k).unwrap_or(0.0), value(k, i).unwrap_or(0.0))
        });
        // `symmetric_eigen` panics on an empty matrix.
        let root = if n == 0 {
            matrix
        } else {
            let eigen = matrix.symmetric_eigen();
            // Rounding can make eigenvalues slightly negative.
            let roots = eigen.eigenvalues.map(|value| value.max(0.0).sqrt());
            eigen.eigenvectors * DMatrix::from_diagonal(&roots)
        };
        Self { names: covariance.names.clone(), root }
    }

    /// The error of each quantity, by name.
    fn shifts(&self, z: &[f64]) -> BTreeMap<&str, f64> {
        let shift = |row: usize| (0..z.len()).map(|k| self.root[(row, k)] * z[k]).sum();
        map_of(self.names.iter().enumerate().map(|(row, name)| (name.as_str(), shift(row))))
    }
}

/// Moves overlapping objects apart along the line of their centres in small steps; false if some still overlap.
fn separated(scene: &mut Scene) -> bool {
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

/// Step of the separation, small against the error of an observed pose (m).
const STEP_APART_M: f64 = 1e-4;
/// Enough steps for ten millimetres.
const MOST_STEPS_APART: usize = 100;
