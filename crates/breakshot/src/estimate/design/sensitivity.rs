//! How do the final positions of struck piles depend on the parameters?
//!
//! Random piles and strikes, and the Jacobian of their outcome by finite differences of rollouts.

use super::experiment::Setup;
use super::prior::{Parameter, Prior};
use crate::cell::Cell;
use crate::error::Result;
use crate::geometry::conservative_advancement::{Step, advance};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{Object, Shape, kind};
use crate::physics::{self, GRAVITY_M_S2, Simulator, World};
use crate::properties::Properties;
use crate::scene::{Placed, Scene, Strike};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A strike on a pile.
#[derive(Clone, Debug, PartialEq)]
pub struct StruckPile {
    /// The initial scene.
    pub scene: Scene,
    /// The strike.
    pub strike: Strike,
}

/// A number of random samples and the seed of their generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draws {
    /// Number of samples.
    pub count: usize,
    /// Seed; equal seeds give equal samples.
    pub seed: u64,
}

/// The Jacobian of the final positions of one struck pile with respect to the parameters.
pub(crate) struct OutcomeJacobian {
    /// Indices of the parameters on which the outcome depends.
    parameters: Vec<usize>,
    /// For every object the derivatives of its final position with respect to these parameters (m per unit).
    slopes: Vec<Vec<Vec2>>,
}

/// Number of objects of a random pile, as in the experiments of the paper; fewer if there are fewer kinds.
const OBJECTS: usize = 4;
/// Smallest and largest gap between neighbours (m).
const GAPS_M: [f64; 2] = [0.001, 0.03];
/// Gap between the striker and its target at the start, and travel past the contact (m).
const RUN_UP_M: f64 = 0.03;
const FOLLOW_M: f64 = 0.01;
/// Number of trials to place an object or a strike before another pile is drawn.
const TRIALS: usize = 60;

/// The striker speed at which an object slides over half of the shorter side of the workspace, within the speed range (m/s).
pub(crate) fn fastest_m_s(prior: &Prior, cell: &Cell, object: &str) -> f64 {
    const FRACTION: f64 = 0.5;
    let (low, high) = (cell.workspace.min_m, cell.workspace.max_m);
    let distance_m = FRACTION * (high.x - low.x).min(high.y - low.y);
    let friction = prior.properties.friction.get(kind(object)).map_or(0.0, |e| e.mean);
    let restitution = prior.properties.striker_restitution.get(kind(object)).map_or(0.0, |e| e.mean);
    let speed = (2.0 * friction * GRAVITY_M_S2 * distance_m).sqrt() / (1.0 + restitution);
    let [least, most] = cell.striker.speed_range_m_s;
    speed.clamp(least, most)
}

/// Random strikes on random piles in the middle of the workspace, or on the pile of `scene` if there is one.
pub(crate) fn random_struck_piles(
    prior: &Prior,
    setup: Setup,
    scene: Option<&Scene>,
    draws: Draws,
) -> Result<Vec<StruckPile>> {
    let mut random = Pcg64Mcg::seed_from_u64(draws.seed);
    let mut piles = Vec::new();
    // A pile in which the striker reaches no object gives no strike, and another one is drawn.
    for _ in 0..draws.count * TRIALS {
        if piles.len() == draws.count {
            break;
        }
        let pile = match scene {
            Some(scene) => Some(scene.clone()),
            None => random_pile(setup, &mut random),
        };
        let Some(scene) = pile else { continue };
        if let Some(strike) = random_strike(prior, &scene, &mut random)? {
            piles.push(StruckPile { scene, strike });
        }
    }
    Ok(piles)
}

/// A random pile without contacts; `None` if an object finds no position.
fn random_pile(setup: Setup, random: &mut Pcg64Mcg) -> Option<Scene> {
    let Setup { cell, objects } = setup;
    let mut left: Vec<&Object> = objects.iter().collect();
    let middle = |low: f64, high: f64| f64::midpoint(low, high);
    let (low, high) = (cell.workspace.min_m, cell.workspace.max_m);
    let centre = Point::new(middle(low.x, high.x), middle(low.y, high.y));
    let mut placed: Vec<Placed> = Vec::new();
    let mut outlines: Vec<Outline> = Vec::new();
    for _ in 0..OBJECTS.min(objects.len()) {
        let object = left.swap_remove(random.random_range(0..left.len()));
        let mut found = None;
        for _ in 0..TRIALS {
            let yaw_rad = random.random_range(0.0..TAU);
            let along = Vec2::from_heading(random.random_range(0.0..TAU));
            let gap_m = random.random_range(GAPS_M[0]..GAPS_M[1]);
            let ray = Ray { start: centre, along };
            let position = position_at_gap(&outlines, &object.shape, yaw_rad, ray, gap_m);
            let outline = Outline::new(&object.shape, Pose { position, yaw_rad });
            if outlines.iter().all(|o| o.gap_m(&outline) >= GAPS_M[0] / 2.0) {
                found =
                    Some((Placed { object: object.name.clone(), position_m: position, yaw_rad }, outline));
                break;
            }
        }
        let (object, outline) = found?;
        placed.push(object);
        outlines.push(outline);
    }
    Some(Scene::on_free_table(cell.clone(), objects.to_vec(), placed))
}

/// A half line: its start and a unit vector.
#[derive(Clone, Copy)]
struct Ray {
    start: Point,
    along: Vec2,
}

/// The position at which a shape of this yaw that moves along a ray towards the start has a gap to the nearest outline.
fn position_at_gap(outlines: &[Outline], shape: &Shape, yaw_rad: f64, ray: Ray, gap_m: f64) -> Point {
    const TOLERANCE_M: f64 = 1e-6;
    const FAR_M: f64 = 1.0;
    if outlines.is_empty() {
        return ray.start;
    }
    let placed = advance(FAR_M, 100, |distance_m| {
        let outline = Outline::new(shape, Pose { position: ray.start + ray.along * distance_m, yaw_rad });
        let nearest_m = outlines.iter().map(|o| o.gap_m(&outline)).fold(f64::INFINITY, f64::min);
        let is_placed = nearest_m - gap_m < TOLERANCE_M || distance_m <= 0.0;
        if is_placed { Step::End(distance_m) } else { Step::To(distance_m - (nearest_m - gap_m)) }
    });
    ray.start + ray.along * placed.unwrap_or_else(|reached_m| reached_m).max(0.0)
}

/// A central strike on a random object that the striker reaches without touching another one; `None` if no trial succeeds.
fn random_strike(prior: &Prior, scene: &Scene, random: &mut Pcg64Mcg) -> Result<Option<Strike>> {
    let striker = &scene.cell.striker.shape;
    let outlines: Vec<Outline> = (scene.placed.iter())
        .map(|p| Ok(Outline::new(&scene.object(&p.object)?.shape, p.pose())))
        .collect::<Result<_>>()?;
    for _ in 0..TRIALS {
        if outlines.is_empty() {
            break;
        }
        let target = random.random_range(0..outlines.len());
        let heading_rad = random.random_range(0.0..TAU);
        let fraction: f64 = random.random_range(0.5..1.0);
        let (placed, along) = (&scene.placed[target], Vec2::from_heading(heading_rad));
        let own = &outlines[target..=target];
        let ray = Ray { start: placed.position_m, along: along * -1.0 };
        let contact = position_at_gap(own, striker, heading_rad, ray, 0.0);
        let start_m = contact - along * RUN_UP_M;
        let from = Pose { position: start_m, yaw_rad: heading_rad };
        let swept = Outline::swept(striker, from, along * (RUN_UP_M + FOLLOW_M));
        let others = outlines.iter().enumerate().filter(|(k, _)| *k != target);
        if others.map(|(_, o)| o.gap_m(&swept)).any(|gap_m| gap_m <= GAPS_M[0] / 2.0) {
            continue;
        }
        return Ok(Some(Strike {
            object: Some(placed.object.clone()),
            start_m,
            heading_rad,
            speed_m_s: fraction * fastest_m_s(prior, &scene.cell, &placed.object),
            travel_m: RUN_UP_M + FOLLOW_M,
        }));
    }
    Ok(None)
}

/// A struck pile prepared for rollouts with different properties.
pub(crate) struct PileSimulation<'a> {
    pile: &'a StruckPile,
    world: World,
}

impl<'a> PileSimulation<'a> {
    /// The prepared pile; `None` if it cannot be simulated.
    pub(crate) fn new(pile: &'a StruckPile, properties: &Properties) -> Option<Self> {
        let world = World::new(&pile.scene, properties, &physics::Options::default()).ok()?;
        Some(Self { pile, world })
    }

    /// The final positions of all objects; `None` if the rollout fails or does not come to rest.
    pub(crate) fn final_positions(
        &self,
        properties: &Properties,
        simulator: &mut Simulator,
    ) -> Option<Vec<Point>> {
        let world = self.world.with_properties(properties).ok()?;
        let outcome = simulator.run(&world, &self.pile.strike).ok()?;
        outcome.complete.then(|| outcome.poses.iter().map(|p| p.position).collect())
    }
}

/// The Jacobians of all piles that can be simulated.
pub(crate) fn jacobians(prior: &Prior, piles: &[StruckPile]) -> Vec<OutcomeJacobian> {
    piles.par_iter().filter_map(|pile| OutcomeJacobian::new(prior, pile)).collect()
}

impl OutcomeJacobian {
    /// Central differences over one standard deviation to either side, so that impacts that occur only within it have an effect.
    fn new(prior: &Prior, pile: &StruckPile) -> Option<Self> {
        let present = |name: &str| pile.scene.placed.iter().any(|p| kind(&p.object) == name);
        let struck = pile.strike.object.as_deref().map(kind);
        let matters = |parameter: &Parameter| match parameter {
            // The striker stops soon after the contact with its target and rarely touches another object.
            Parameter::StrikerRestitution(a) => Some(a.as_str()) == struck,
            Parameter::Restitution(a, b) if a == b => {
                pile.scene.placed.iter().filter(|p| kind(&p.object) == a).count() > 1
            }
            other => other.objects().into_iter().all(present),
        };
        let parameters: Vec<usize> =
            (0..prior.parameters.len()).filter(|&k| matters(&prior.parameters[k])).collect();
        let simulation = PileSimulation::new(pile, &prior.properties)?;
        let mut simulator = Simulator::new();
        simulation.final_positions(&prior.properties, &mut simulator)?;
        let mut slopes = vec![Vec::with_capacity(parameters.len()); pile.scene.placed.len()];
        for &k in &parameters {
            let [ahead, behind] = [1.0, -1.0].map(|sign| {
                let (properties, made) = prior.changed(&[(k, sign * prior.std(k))]);
                simulation.final_positions(&properties, &mut simulator).map(|positions| (positions, made[0]))
            });
            let slope = ahead.zip(behind).filter(|((_, up), (_, down))| up > down);
            for (object, slopes) in slopes.iter_mut().enumerate() {
                slopes.push(slope.as_ref().map_or(Vec2::ZERO, |((ahead, up), (behind, down))| {
                    (ahead[object] - behind[object]) / (up - down)
                }));
            }
        }
        Some(Self { parameters, slopes })
    }

    /// Standard deviation of each object's final position (m, root of the sum over both axes), for a covariance of the
    /// parameters.
    pub(crate) fn position_stds_m(
        &self,
        covariance: &nalgebra::DMatrix<f64>,
    ) -> impl Iterator<Item = f64> + '_ {
        let own = covariance.select_rows(&self.parameters).select_columns(&self.parameters);
        self.slopes.iter().map(move |slopes| {
            let mut variance = 0.0;
            for (r, slope) in slopes.iter().enumerate() {
                for (c, other) in slopes.iter().enumerate() {
                    variance += own[(r, c)] * slope.dot(*other);
                }
            }
            variance.max(0.0).sqrt()
        })
    }
}
