//! Piles to plan for, and how far each quantity's error moves what comes of them.

use super::prior::{Belief, Parameter};
use crate::cell::Cell;
use crate::conservative_advancement::{Step, advance};
use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::{self, Object, kind};
use crate::outline::Outline;
use crate::physics::{self, GRAVITY_M_S2, Simulator, World};
use crate::properties::Properties;
use crate::scene::{Goal, Placed, Scene, Strike};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;

/// A strike on a pile.
#[derive(Clone, Debug, PartialEq)]
pub struct StruckPile {
    /// What lies on the table.
    pub scene: Scene,
    /// What the robot does.
    pub strike: Strike,
}

/// How a pile's outcome follows small changes of the quantities, one object after the other.
pub(crate) struct Response {
    /// Which quantities matter.
    quantities: Vec<usize>,
    /// For every object and these quantities: by how much its final place moves per unit (m).
    slopes: Vec<Vec<Vec2>>,
}

/// As many objects as lie in the piles of the paper's experiments, if there are that many kinds.
const OBJECTS: usize = 4;
/// Gaps between neighbours (m): from nearly touching to a few centimetres.
const GAPS_M: [f64; 2] = [0.001, 0.03];
/// The striker starts this far from its target and goes on this far past the contact (m).
const RUN_UP_M: f64 = 0.03;
const FOLLOW_M: f64 = 0.01;
/// Trials to place an object or a strike before another pile is begun.
const TRIALS: usize = 60;

/// How fast the robot may strike an object so that it stays within a part of the workspace's shorter side (m/s).
pub(crate) fn fastest_m_s(belief: &Belief, cell: &Cell, object: &str) -> f64 {
    const PART: f64 = 0.5;
    let (low, high) = (cell.workspace.min_m, cell.workspace.max_m);
    let way_m = PART * (high.x - low.x).min(high.y - low.y);
    let friction = belief.properties.friction.get(kind(object)).map_or(0.0, |e| e.mean);
    let restitution = belief.properties.striker_restitution.get(kind(object)).map_or(0.0, |e| e.mean);
    let speed = (2.0 * friction * GRAVITY_M_S2 * way_m).sqrt() / (1.0 + restitution);
    let [least, most] = cell.striker.speed_range_m_s;
    speed.clamp(least, most)
}

/// Random strikes on random piles in the middle of the workspace, or on the scene's own pile if there is one.
pub(crate) fn sampled(
    belief: &Belief,
    (cell, objects): (&Cell, &[Object]),
    scene: Option<&Scene>,
    (count, seed): (usize, u64),
) -> Result<Vec<StruckPile>> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut piles = Vec::new();
    // A pile whose every object is walled in gives none; then others do.
    for _ in 0..count * TRIALS {
        if piles.len() == count {
            break;
        }
        let pile = match scene {
            Some(scene) => Some(scene.clone()),
            None => random_pile((cell, objects), &mut random),
        };
        let Some(scene) = pile else { continue };
        if let Some(strike) = random_strike(belief, &scene, &mut random)? {
            piles.push(StruckPile { scene, strike });
        }
    }
    Ok(piles)
}

fn random_pile((cell, objects): (&Cell, &[Object]), random: &mut Pcg64Mcg) -> Option<Scene> {
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
            let place = beside(&outlines, (&object.shape, yaw_rad), (centre, along), gap_m);
            let outline = Outline::new(&object.shape, Pose { position: place, yaw_rad });
            if outlines.iter().all(|o| o.gap_m(&outline) >= GAPS_M[0] / 2.0) {
                found = Some((Placed { object: object.name.clone(), position_m: place, yaw_rad }, outline));
                break;
            }
        }
        let (lies, outline) = found?;
        placed.push(lies);
        outlines.push(outline);
    }
    Some(Scene {
        cell: cell.clone(),
        objects: objects.to_vec(),
        observed_unix_s: None,
        placed,
        walls: Vec::new(),
        keep_out: Vec::new(),
        goal: Goal::default(),
    })
}

/// Where a shape comes to lie if it moves towards the centre until the nearest outline is `gap_m` away.
fn beside(
    outlines: &[Outline],
    (shape, yaw_rad): (&object::Shape, f64),
    (centre, along): (Point, Vec2),
    gap_m: f64,
) -> Point {
    const CLOSE_M: f64 = 1e-6;
    const FAR_M: f64 = 1.0;
    if outlines.is_empty() {
        return centre;
    }
    let placed = advance(FAR_M, 100, |distance_m| {
        let outline = Outline::new(shape, Pose { position: centre + along * distance_m, yaw_rad });
        let nearest_m = outlines.iter().map(|o| o.gap_m(&outline)).fold(f64::INFINITY, f64::min);
        let is_placed = nearest_m - gap_m < CLOSE_M || distance_m <= 0.0;
        if is_placed { Step::End(distance_m) } else { Step::To(distance_m - (nearest_m - gap_m)) }
    });
    centre + along * placed.unwrap_or_else(|reached_m| reached_m).max(0.0)
}

/// A central strike on some object that the striker reaches without touching another one.
fn random_strike(belief: &Belief, scene: &Scene, random: &mut Pcg64Mcg) -> Result<Option<Strike>> {
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
        let part: f64 = random.random_range(0.5..1.0);
        let (placed, along) = (&scene.placed[target], Vec2::from_heading(heading_rad));
        let own = &outlines[target..=target];
        let contact = beside(own, (striker, heading_rad), (placed.position_m, along * -1.0), 0.0);
        let start_m = contact - along * RUN_UP_M;
        let from = Pose { position: start_m, yaw_rad: heading_rad };
        let way = Outline::swept(striker, from, along * (RUN_UP_M + FOLLOW_M));
        let others = outlines.iter().enumerate().filter(|(k, _)| *k != target);
        if others.map(|(_, o)| o.gap_m(&way)).any(|gap_m| gap_m <= GAPS_M[0] / 2.0) {
            continue;
        }
        return Ok(Some(Strike {
            object: Some(placed.object.clone()),
            start_m,
            heading_rad,
            speed_m_s: part * fastest_m_s(belief, &scene.cell, &placed.object),
            travel_m: RUN_UP_M + FOLLOW_M,
        }));
    }
    Ok(None)
}

/// A pile ready for rollouts with many properties.
pub(crate) struct Rolled<'a> {
    pile: &'a StruckPile,
    world: World,
}

impl<'a> Rolled<'a> {
    /// `None` if it cannot be simulated.
    pub(crate) fn new(pile: &'a StruckPile, properties: &Properties) -> Option<Self> {
        let world = World::new(&pile.scene, properties, &physics::Options::default()).ok()?;
        Some(Self { pile, world })
    }

    /// Where everything comes to rest; `None` where it cannot be followed to the end.
    pub(crate) fn finals(&self, properties: &Properties, simulator: &mut Simulator) -> Option<Vec<Point>> {
        let world = self.world.with_properties(properties).ok()?;
        let outcome = simulator.run(&world, &self.pile.strike).ok()?;
        outcome.complete.then(|| outcome.poses.iter().map(|p| p.position).collect())
    }
}

/// The responses of all piles that can be simulated.
pub(crate) fn responses(belief: &Belief, piles: &[StruckPile]) -> Vec<Response> {
    piles.par_iter().filter_map(|pile| Response::new(belief, pile)).collect()
}

impl Response {
    /// Differences over one standard deviation to either side: impacts that come about or fail to within it count too.
    fn new(belief: &Belief, pile: &StruckPile) -> Option<Self> {
        let lies = |name: &str| pile.scene.placed.iter().any(|p| kind(&p.object) == name);
        let struck = pile.strike.object.as_deref().map(kind);
        let matters = |quantity: &Parameter| match quantity {
            // The striker stops behind its target, and rarely meets another one.
            Parameter::StrikerRestitution(a) => Some(a.as_str()) == struck,
            Parameter::Restitution(a, b) if a == b => {
                pile.scene.placed.iter().filter(|p| kind(&p.object) == a).count() > 1
            }
            other => other.objects().into_iter().all(lies),
        };
        let quantities: Vec<usize> =
            (0..belief.quantities.len()).filter(|&k| matters(&belief.quantities[k])).collect();
        let rolled = Rolled::new(pile, &belief.properties)?;
        let mut simulator = Simulator::new();
        rolled.finals(&belief.properties, &mut simulator)?;
        let mut slopes = vec![Vec::with_capacity(quantities.len()); pile.scene.placed.len()];
        for &k in &quantities {
            let [ahead, behind] = [1.0, -1.0].map(|sign| {
                let (properties, done) = belief.moved(&[(k, sign * belief.std(k))]);
                rolled.finals(&properties, &mut simulator).map(|places| (places, done[0]))
            });
            let slope = ahead.zip(behind).filter(|((_, up), (_, down))| up > down);
            for (object, slopes) in slopes.iter_mut().enumerate() {
                slopes.push(slope.as_ref().map_or(Vec2::ZERO, |((ahead, up), (behind, down))| {
                    (ahead[object] - behind[object]) / (up - down)
                }));
            }
        }
        Some(Self { quantities, slopes })
    }

    /// One standard deviation of each object's final place (m), root of the sum of both axes' variances.
    pub(crate) fn spreads_m(&self, covariance: &nalgebra::DMatrix<f64>) -> impl Iterator<Item = f64> + '_ {
        let own = covariance.select_rows(&self.quantities).select_columns(&self.quantities);
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
