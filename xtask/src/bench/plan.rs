//! How long does a robust plan take?  `cargo xtask bench plan LAB PROPERTIES`.

use super::ROUNDS;
use crate::process;
use crate::validate::row::{self, Row, median};
use breakshot::files;
use breakshot::geometry::{Point, Pose};
use breakshot::physics::{self, Pressing, Simulator, World};
use breakshot::plan::{self, Method, Outcome, Robustness};
use breakshot::properties::Properties;
use breakshot::scene::{Goal, Placed, Scene};
use std::path::Path;
use std::time::Instant;

/// Objects of the large pile.
const MANY: usize = 20;
/// Strikes of the grid, and the scenarios in which each is evaluated.
const STRIKES: usize = 100;
const SAMPLES: usize = 100;

/// Times the plan for the filmed pile of four mixed shapes, and for twenty objects in rows.
pub(crate) fn bench(lab: &Path, properties: &Path) -> Result<(), String> {
    let mut properties = files::load_properties(properties).map_err(|e| e.to_string())?;
    let scene =
        files::load_scene(lab.join("scatter/four_shapes.scene.toml")).map_err(|e| e.to_string())?.value;
    let four = timed(&scene, &properties, ROUNDS)?;
    let many = many(&scene);
    let names: Vec<String> = many.placed.iter().map(|p| p.object.clone()).collect();
    // Nobody filmed an object hitting its own copy.
    properties.assume_restitution(&names, 0.6).map_err(|e| e.to_string())?;
    let many = timed(&many, &properties, 1)?;
    let grid = GridTimes::of(&scene, &properties)?;
    let rows = [
        Row::at_most("four mixed shapes: robust plan, wall time", four.wall_s, 0.5, "s"),
        Row::plain("the same, CPU time", four.cpu_s, "s"),
        Row::plain("the same, strikes evaluated", four.rollouts, ""),
        Row::plain("wall time of 10,000 strikes at that rate", four.wall_s / four.rollouts * 1e4, "s"),
        Row::at_most(
            format!("{} strikes of the grid evaluated in {SAMPLES} scenarios each, wall time", grid.strikes),
            grid.wall_s,
            0.4,
            "s",
        ),
        Row::plain("one of these simulated once: hits, on average", grid.hit_ms, "ms"),
        Row::plain("the same: slow pushes over 10 cm", grid.push_ms, "ms"),
        Row::plain("the same pushes as the search simulates them", grid.coarse_push_ms, "ms"),
        Row::plain("final positions of these, against exact pushes: median", grid.coarse_median_mm, "mm"),
        Row::plain("the same: nine of ten below", grid.coarse_p90_mm, "mm"),
        Row::at_most("twenty objects: robust plan, wall time", many.wall_s, 20.0, "s"),
        Row::plain("the same, CPU time", many.cpu_s, "s"),
        Row::plain("the same, strikes evaluated", many.rollouts, ""),
    ];
    let title = format!("Planning on all cores, medians of {ROUNDS}");
    if row::print_all(&title, &rows) { Ok(()) } else { Err("too slow".into()) }
}

struct Timed {
    wall_s: f64,
    cpu_s: f64,
    rollouts: f64,
}

fn timed(scene: &Scene, properties: &Properties, rounds: usize) -> Result<Timed, String> {
    let (mut wall_s, mut cpu_s, mut rollouts) = (Vec::new(), Vec::new(), 0.0);
    for seed in 0..rounds as u64 {
        let (start, before_s) = (Instant::now(), process::own_cpu_s()?);
        let options = plan::Options { method: Method::Robust, seed, ..plan::Options::default() };
        let plan = plan::plan(scene, properties, &options).map_err(|e| e.to_string())?;
        wall_s.push(start.elapsed().as_secs_f64());
        cpu_s.push(process::own_cpu_s()? - before_s);
        match plan.robustness {
            Some(Robustness { rollouts: count, .. }) if plan.outcome != Outcome::Unreachable => {
                rollouts = count as f64;
            }
            _ => return Err(format!("nothing was planned: {}", plan.reason)),
        }
    }
    Ok(Timed { wall_s: median(wall_s), cpu_s: median(cpu_s), rollouts })
}

/// Strikes of the grid, evaluated in [`SAMPLES`] scenarios each.
struct GridTimes {
    strikes: usize,
    /// Includes drawing the scenarios.
    wall_s: f64,
    /// Mean wall time of simulating a strike once, on one thread: of hits, and of slow pushes (ms).
    hit_ms: f64,
    push_ms: f64,
    /// The same for coarse pushes, and the largest difference of an object's final position from that of the exact push: median, and 90th
    /// percentile (mm).
    coarse_push_ms: f64,
    coarse_median_mm: f64,
    coarse_p90_mm: f64,
}

impl GridTimes {
    fn of(scene: &Scene, properties: &Properties) -> Result<Self, String> {
        let (mut wall_s, mut all) = (Vec::new(), Vec::new());
        for seed in 0..ROUNDS as u64 {
            let start = Instant::now();
            let options = plan::Options { seed, ..plan::Options::default() };
            let size = plan::GridSize { strikes: STRIKES, samples: SAMPLES };
            all = plan::evaluate_grid(scene, properties, &options, size).map_err(|e| e.to_string())?;
            wall_s.push(start.elapsed().as_secs_f64());
        }
        let [exact, coarse] = [Pressing::Fine, Pressing::Coarse]
            .map(|pressing| physics::Options { pressing, ..physics::Options::default() })
            .map(|options| World::new(scene, properties, &options).map_err(|e| e.to_string()));
        let (exact, coarse) = (exact?, coarse?);
        let mut simulator = Simulator::new();
        let mut timed = |world: &World, pushes: bool| {
            let chosen = all.iter().filter(|s| (s.aim.follow_through_m > PUSH_M) == pushes);
            let start = Instant::now();
            // A strike that cannot start costs nothing.
            let ends: Vec<_> =
                chosen.map(|evaluated| simulator.run(world, &evaluated.strike).map(|o| o.poses)).collect();
            (1e3 * start.elapsed().as_secs_f64() / ends.len() as f64, ends)
        };
        let (hit_ms, _) = timed(&exact, false);
        let (push_ms, exact_ends) = timed(&exact, true);
        let (coarse_push_ms, coarse_ends) = timed(&coarse, true);
        let both = exact_ends.into_iter().zip(coarse_ends).filter_map(|(a, b)| Some((a.ok()?, b.ok()?)));
        let difference_mm = |(a, b): (Vec<Pose>, Vec<Pose>)| {
            let apart_m = a.iter().zip(&b).map(|(a, b)| a.position.distance(b.position));
            1e3 * apart_m.fold(0.0, f64::max)
        };
        let mut differences_mm: Vec<f64> = both.map(difference_mm).collect();
        differences_mm.sort_unstable_by(f64::total_cmp);
        let coarse_p90_mm = differences_mm.get(differences_mm.len() * 9 / 10).copied().unwrap_or(f64::NAN);
        Ok(Self {
            strikes: all.len(),
            wall_s: median(wall_s),
            hit_ms,
            push_ms,
            coarse_push_ms,
            coarse_median_mm: median(differences_mm),
            coarse_p90_mm,
        })
    }
}

/// Strikes that run on farther than this after the contact push (m).
const PUSH_M: f64 = 0.07;

/// Copies of the scene's objects in rows, closer to each other than the goal requires.
fn many(scene: &Scene) -> Scene {
    let kinds = scene.placed.len();
    let placed = (0..MANY).map(|k| {
        let kind = &scene.placed[k % kinds].object;
        let object = if k < kinds { kind.clone() } else { format!("{kind}#{}", 1 + k / kinds) };
        let (column, row) = ((k % 5) as f64 - 2.0, (k / 5) as f64 - 1.5);
        Placed { object, position_m: Point::new(PITCH_M * column, PITCH_M * row), yaw_rad: 0.0 }
    });
    let goal = Goal { min_distance_m: 1.1 * PITCH_M, ..scene.goal.clone() };
    Scene { placed: placed.collect(), goal, ..scene.clone() }
}

/// From row to row (m).
const PITCH_M: f64 = 0.105;
