//! Does the struck object of a clip leave as the strike given for it makes it leave?
//!
//! The film shows the direction and the speed of the struck object after the striker's impact. The simulation of the given strike with
//! the learned properties predicts both. They are compared at equal displacements of the object, so that film and strike need no
//! common clock. A clip that differs from its prediction more than the other clips do has a wrong strike.

use super::observed::{Observed, ObservedPose};
use super::spread::{LEAST_TURN_RAD, STDS, Spread, degrees};
use super::striker::Findings;
use crate::cell::Cell;
use crate::detect::Sample;
use crate::estimate::{BodyFit, ClipFit, ClipTracks};
use crate::geometry::{Point, Vec2, wrapped_rad};
use crate::object::{self, Object};
use crate::physics::{self, Trajectory, World};
use crate::properties::{ContactFriction, Properties};
use crate::scene::{Placed, Scene, Strike};
use crate::statistics::median;
use crate::warning::{Cause, Warning};

/// Displacements of the struck object between which its speed is compared (m): from clear of the striker...
const FROM_M: f64 = 0.003;
/// ... to not yet slowed down much, unless it meets another object before.
const TO_M: f64 = 0.06;
/// The part of its whole displacement that an object slides at more than 70 % of its first speed: there friction matters little.
const FASTER_HALF: f64 = 0.5;
/// A shorter displacement gives no direction (m).
const SHORTEST_DISPLACEMENT_M: f64 = 0.01;
/// Fewest positions that give a speed: of two, one may be wrong, and no other shows it.
const LEAST_POSITIONS: usize = 3;
/// Displacement of another object from which the struck one may have met it (m).
const MET_M: f64 = 1e-3;
/// Step of time in which the simulated motion is searched for a displacement (s).
const STEP_S: f64 = 1e-3;
/// Differences of the speed below this fraction are not reported; if the striker is seen to move as given, restitutions scatter that much.
const LEAST_SPEED_ERROR: f64 = 0.05;
const LEAST_OBJECT_ERROR: f64 = 0.1;
/// Step of the search for another start (m), and the largest change of the struck object's direction from one step to the next: beyond
/// it the striker meets another side.
const ASIDE_STEP_M: f64 = 1e-3;
const LARGEST_TURN_OF_A_STEP_RAD: f64 = 0.3;

/// A strike sends an object about where the film shows it go up to this difference of the directions (rad).
const LARGEST_FITTING_TURN_RAD: f64 = 0.2;

/// The part of a fitted displacement that the positions show if it is right: friction slows the object down.
const SHOWN_MOTION: f64 = 0.5;

/// What the film and the strike given for it say about the struck object.
enum Comparison {
    /// It leaves.
    Departure {
        /// Direction of its displacement in the film less the predicted one (rad, counter-clockwise).
        turn_rad: f64,
        /// Standard deviation of that direction by the noise of the positions (rad).
        turn_std_rad: f64,
        /// Its speed in the film over the predicted one, if it moves far enough.
        speed_ratio: Option<f64>,
    },
    /// The given strike does not move it, or not so far.
    Missed,
    /// The given strike cannot be simulated, for this reason.
    Impossible(String),
}

/// The cell, its objects and what is known of them.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub cell: &'a Cell,
    pub objects: &'a [Object],
    pub properties: &'a Properties,
}

/// A clip whose film shows the struck object leave, beside the simulation of the strike given for it.
pub(super) struct Departing<'a> {
    pub clip: &'a ClipTracks,
    pub strike: &'a Strike,
    comparison: Comparison,
}

/// The clips whose films show the struck object leave.
pub(super) fn departing<'a>(clips: &'a [ClipTracks], known: Known) -> Vec<Departing<'a>> {
    let mut scene = known.free_table();
    let compared = |clip: &'a ClipTracks| {
        let strike = clip.strike.as_ref()?;
        let comparison = comparison(clip, strike, &mut scene, known.properties)?;
        Some(Departing { clip, strike, comparison })
    };
    clips.iter().filter_map(compared).collect()
}

impl Departing<'_> {
    /// Whether the given strike sends the struck object about where the film shows it go.
    pub(super) fn is_as_sent(&self) -> bool {
        self.comparison.is_as_sent()
    }

    /// Whether another strike does so.
    pub(super) fn would_be_sent_by(
        &self,
        strike: &Strike,
        scene: &mut Scene,
        properties: &Properties,
    ) -> bool {
        comparison(self.clip, strike, scene, properties).is_some_and(|comparison| comparison.is_as_sent())
    }

    /// Whether the object leaves in another direction than in the other clips and contact frictions of the striker within their standard error
    /// explain it: contact friction turns objects that are struck off the centre.
    fn is_turned_by_contact_friction(
        &self,
        turns: &Spread,
        scene: &mut Scene,
        properties: &Properties,
    ) -> bool {
        let Comparison::Departure { turn_rad, turn_std_rad, .. } = self.comparison else { return false };
        let tolerance_rad = turn_tolerance_rad(turns, turn_std_rad);
        if (turn_rad - turns.median).abs() <= tolerance_rad {
            return false;
        }
        let turns_rad = turns_of_contact_frictions(self.clip, self.strike, scene, properties);
        let least_rad = turns_rad.iter().copied().fold(turn_rad, f64::min);
        let largest_rad = turns_rad.iter().copied().fold(turn_rad, f64::max);
        (turns.median.clamp(least_rad, largest_rad) - turns.median).abs() < tolerance_rad
    }
}

impl Known<'_> {
    /// The cell and its objects, none of them on the table.
    pub(super) fn free_table(&self) -> Scene {
        Scene::on_free_table(self.cell.clone(), self.objects.to_vec(), Vec::new())
    }
}

/// A warning for each clip whose struck object leaves otherwise than the given strike makes it leave, unless the striker itself was seen
/// to move otherwise (`striker`).
pub(super) fn warnings(compared: &[Departing], known: Known, striker: &Findings) -> Vec<Warning> {
    let mut scene = known.free_table();
    let turns = Spread::of(compared.iter().filter_map(|departing| match &departing.comparison {
        Comparison::Departure { turn_rad, .. } => Some(*turn_rad),
        _ => None,
    }));
    let speeds = Spread::of(compared.iter().filter_map(|departing| match &departing.comparison {
        Comparison::Departure { speed_ratio, .. } => speed_ratio.map(f64::ln),
        _ => None,
    }));
    let mut warnings = Vec::new();
    if turns.n > 1 && turns.median.abs() > LEAST_TURN_RAD && !striker.turned {
        let text = format!(
            "in {} clips the struck objects leave {} of where the given strikes send them (median): strike.heading_rad or the robot's \
             table frame is rotated",
            turns.n,
            degrees(turns.median)
        );
        warnings.push(Warning::new(Cause::GivenStrike, text));
    }
    let unnamed = compared.iter().filter(|departing| !striker.clips.contains(&departing.clip.name));
    for departing @ Departing { clip, strike, comparison } in unnamed {
        let others =
            Others { turns: &turns, speeds: &speeds, is_as_given: striker.as_given.contains(&clip.name) };
        if others.is_as_given && departing.is_turned_by_contact_friction(&turns, &mut scene, known.properties)
        {
            continue;
        }
        let Some(mut finding) = comparison.finding(strike, &clip.objects[0], &others) else { continue };
        let start = (finding.start_m_is_doubtful)
            .then(|| fitting_start(clip, strike, &mut scene, known.properties, turns.median))
            .flatten();
        if let Some(start) = start {
            finding.text += &offer(strike, start);
        }
        warnings.push(Warning::of_clip(finding.cause, &clip.name, finding.text));
    }
    warnings
}

/// A warning for each clip with a strike in which an object moves from its first position on: the film shows neither the strike nor where the object
/// lay before it.
pub(super) fn cut_films(clips: &[ClipTracks], fits: &[ClipFit]) -> Vec<Warning> {
    let cut = |(clip, fit): (&ClipTracks, &ClipFit)| {
        clip.strike.as_ref()?;
        let object = &fit.bodies.iter().find(|body| moves_from_the_start(clip, body))?.object;
        let text =
            format!("`{object}` moves from its first position on: what set it in motion is not in the film");
        Some(Warning::of_clip(Cause::Cut, &clip.name, text))
    };
    clips.iter().zip(fits).filter_map(cut).collect()
}

/// Whether a body is fitted to move from its first position on, and its next positions show that: the first one alone may be wrong.
fn moves_from_the_start(clip: &ClipTracks, body: &BodyFit) -> bool {
    let track = clip.tracks.tracks.iter().find(|track| track.object == body.object);
    let Some([_, second, _, fourth, ..]) = track.map(|track| track.samples.as_slice()) else { return false };
    let speed_m_s = body.path.motion_before(f64::NEG_INFINITY).velocity.length();
    let fitted_m = speed_m_s * (fourth.time_s - second.time_s);
    fitted_m > 0.0 && second.position().distance(fourth.position()) > SHOWN_MOTION * fitted_m
}

/// What a clip is compared with: the other clips, and its striker.
struct Others<'a> {
    turns: &'a Spread,
    speeds: &'a Spread,
    /// Whether the striker is seen to move as given.
    is_as_given: bool,
}

/// What is wrong with a given strike.
struct Finding {
    text: String,
    cause: Cause,
    /// Whether another start may explain it.
    start_m_is_doubtful: bool,
}

impl Comparison {
    /// Whether the object leaves about where the strike sends it.
    fn is_as_sent(&self) -> bool {
        match self {
            Self::Departure { turn_rad, .. } => turn_rad.abs() < LARGEST_FITTING_TURN_RAD,
            Self::Missed | Self::Impossible(_) => false,
        }
    }

    fn finding(&self, strike: &Strike, object: &str, others: &Others) -> Option<Finding> {
        let Others { turns, speeds, is_as_given } = *others;
        let of_start =
            |text| Some(Finding { text, cause: Cause::GivenStrike, start_m_is_doubtful: !is_as_given });
        match self {
            Self::Departure { turn_rad, turn_std_rad, speed_ratio } => {
                let turn_off_rad = turn_rad - turns.median;
                if turn_off_rad.abs() > turn_tolerance_rad(turns, *turn_std_rad) {
                    // The speed of an object that was hit elsewhere differs too, and is not reported.
                    let aside = degrees(turn_off_rad);
                    return of_start(format!(
                        "`{object}` leaves {aside} of where the given strike sends it: check strike.start_m and strike.heading_rad"
                    ));
                }
                let speed_off = (*speed_ratio)?.ln() - speeds.median;
                let least = if is_as_given { LEAST_OBJECT_ERROR } else { LEAST_SPEED_ERROR };
                (speed_off.abs() > speeds.tolerance(least)).then(|| {
                    let (ratio, given) = (speed_off.exp(), strike.speed_m_s);
                    let fits = ratio * given;
                    let (cause, remedy) = if is_as_given {
                        let remedy =
                            ", although the striker is seen to move as given: check the clip's objects";
                        (Cause::Contradiction, remedy.to_owned())
                    } else {
                        (
                            Cause::GivenStrike,
                            format!(": strike.speed_m_s is {given:.3}, and {fits:.3} would fit"),
                        )
                    };
                    let text = format!(
                        "`{object}` leaves {ratio:.2} times as fast as the given strike makes it{remedy}"
                    );
                    Finding { text, cause, start_m_is_doubtful: false }
                })
            }
            Self::Missed => of_start(format!(
                "`{object}` moves, but the given strike does not move it so far: check strike.start_m, heading_rad and travel_m"
            )),
            Self::Impossible(reason) => of_start(format!("the given strike cannot happen: {reason}")),
        }
    }
}

/// By how much a direction with this standard deviation may differ from the median of all (rad).
fn turn_tolerance_rad(turns: &Spread, turn_std_rad: f64) -> f64 {
    turns.tolerance(LEAST_TURN_RAD).max(STDS * turn_std_rad)
}

/// The comparison of a clip; `None` if the film does not show its struck object leave.
fn comparison(
    clip: &ClipTracks,
    strike: &Strike,
    scene: &mut Scene,
    properties: &Properties,
) -> Option<Comparison> {
    let seen = departure(clip)?;
    scene.placed.clone_from(&seen.placed);
    // A pile that cannot be simulated says nothing about the strike.
    let world = World::new(scene, properties, &physics::Options::default()).ok()?;
    let trajectory = match world.trajectory(strike) {
        Ok(trajectory) => trajectory,
        Err(error) => return Some(Comparison::Impossible(error.to_string())),
    };
    let Some(reached) = seen.reached_in(&trajectory, &scene.placed[0]) else {
        return Some(Comparison::Missed);
    };
    // Single wrong positions do not change the medians.
    let pairs = (0..reached.len()).flat_map(|k| (0..k).map(move |j| (j, k)));
    let ratios = pairs.filter_map(|(j, k)| reached[j].speed_ratio(&reached[k]));
    let turn_rad = median(reached.iter().map(|r| r.turn_rad))?;
    let furthest_m = seen.steps.iter().map(|step| step.displacement_m).fold(0.0, f64::max);
    Some(Comparison::Departure {
        turn_rad,
        turn_std_rad: median(seen.steps.iter().map(|step| step.std_m))? / furthest_m,
        speed_ratio: (reached.len() >= LEAST_POSITIONS).then(|| median(ratios)).flatten(),
    })
}

/// The struck object's direction in the film less that of the strike with the least and the largest contact friction of the striker within its
/// standard error (rad), as far as the strike moves the object.
fn turns_of_contact_frictions(
    clip: &ClipTracks,
    strike: &Strike,
    scene: &mut Scene,
    properties: &Properties,
) -> Vec<f64> {
    let Some(seen) = departure(clip) else { return Vec::new() };
    scene.placed.clone_from(&seen.placed);
    let Ok(mut world) = World::new(scene, properties, &physics::Options::default()) else {
        return Vec::new();
    };
    let object = &scene.placed[0];
    let friction = properties.contact_friction.striker.unwrap_or_else(ContactFriction::assumed);
    let turn_with = |sign: f64| {
        let friction = (friction.mean + sign * friction.standard_error).max(0.0);
        world.set_striker_contact_friction(&object.object, friction).ok()?;
        let reached = seen.reached_in(&world.trajectory(strike).ok()?, object)?;
        median(reached.iter().map(|r| r.turn_rad))
    };
    [-1.0, 1.0].into_iter().filter_map(turn_with).collect()
}

/// The start beside the given one from which the strike sends the struck object where the film shows it go; the nearest one if there are
/// several. `turn_rad` is by how much the film's directions differ from the simulated ones in all clips.
fn fitting_start(
    clip: &ClipTracks,
    strike: &Strike,
    scene: &mut Scene,
    properties: &Properties,
    turn_rad: f64,
) -> Option<Point> {
    let seen = departure(clip)?;
    scene.placed.clone_from(&seen.placed);
    let world = World::new(scene, properties, &physics::Options::default()).ok()?;
    let struck = &scene.placed[0];
    let shape = &object::find(&scene.objects, &struck.object, "departure").ok()?.shape;
    let reach_m = shape.outer_radius_m() + scene.cell.striker.shape.outer_radius_m();
    let left = Vec2::from_heading(strike.heading_rad).perpendicular();
    let centre_m = (struck.position_m - strike.start_m).dot(left);

    // Where the simulated direction changes from one side of the film's to the other
    let turn_at = |aside_m: f64| {
        let beside = Strike { start_m: strike.start_m + left * aside_m, ..strike.clone() };
        let reached = seen.reached_in(&world.trajectory(&beside).ok()?, struck)?;
        Some(median(reached.iter().map(|r| r.turn_rad))? - turn_rad)
    };
    let steps = (2.0 * reach_m / ASIDE_STEP_M).ceil() as usize;
    let aside_m = |k: usize| centre_m - reach_m + k as f64 * ASIDE_STEP_M;
    let turns: Vec<Option<f64>> = (0..=steps).map(|k| turn_at(aside_m(k))).collect();
    let crossing_m = |k: usize| {
        let (before, after) = (turns[k]?, turns[k + 1]?);
        let is_crossing = before * after <= 0.0 && (after - before).abs() < LARGEST_TURN_OF_A_STEP_RAD;
        is_crossing.then(|| aside_m(k) + ASIDE_STEP_M * before / (before - after))
    };
    let crossings_m = (0..steps).filter_map(crossing_m).filter(|aside_m| aside_m.is_finite());
    let nearest_m = crossings_m.min_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    Some(strike.start_m + left * nearest_m)
}

/// The words that offer a start.
fn offer(strike: &Strike, start: Point) -> String {
    let aside_m = (start - strike.start_m).dot(Vec2::from_heading(strike.heading_rad).perpendicular());
    let (mm, side) = (1e3 * aside_m.abs(), if aside_m > 0.0 { "left" } else { "right" });
    format!("; start_m = [{:.4}, {:.4}], {mm:.1} mm further to the {side}, would fit", start.x, start.y)
}

/// A position of the film that the simulated object reaches too.
struct Reached {
    displacement_m: f64,
    film_s: f64,
    simulated_s: f64,
    /// Direction of the displacement in the film less the simulated one (rad).
    turn_rad: f64,
}

impl Reached {
    /// The speed in the film over the simulated one between two positions, if they are far enough apart.
    fn speed_ratio(&self, later: &Self) -> Option<f64> {
        let (film_s, simulated_s) = (later.film_s - self.film_s, later.simulated_s - self.simulated_s);
        let is_far = later.displacement_m - self.displacement_m > SHORTEST_DISPLACEMENT_M / 2.0;
        (is_far && film_s > 0.0 && simulated_s > 0.0).then_some(simulated_s / film_s)
    }
}

fn reached(trajectory: &Trajectory, object: &Placed, step: &Step) -> Option<Reached> {
    let simulated_s = time_at(trajectory, object, step.displacement_m)?;
    let displacement = trajectory.pose(&object.object, simulated_s)?.position - object.position_m;
    Some(Reached {
        displacement_m: step.displacement_m,
        film_s: step.time_s,
        simulated_s,
        turn_rad: wrapped_rad(step.heading_rad - displacement.heading_rad()),
    })
}

/// How the film shows the struck object leave.
struct SeenDeparture {
    /// The poses of all objects before the strike, the struck one's first.
    placed: Vec<Placed>,
    /// The struck object's first positions clear of the striker.
    steps: Vec<Step>,
}

/// A displacement of the struck object from where it lay.
struct Step {
    time_s: f64,
    displacement_m: f64,
    heading_rad: f64,
    /// Standard deviation of the position (m).
    std_m: f64,
}

fn departure(clip: &ClipTracks) -> Option<SeenDeparture> {
    let before = Observed::from_tracks(&clip.tracks).before;
    let placed = clip.objects.iter().map(|name| {
        let ObservedPose { position, yaw_rad } = *before.get(name)?;
        Some(Placed { object: name.clone(), position_m: position, yaw_rad: yaw_rad.unwrap_or(0.0) })
    });
    let placed: Vec<Placed> = placed.collect::<Option<_>>()?;
    let steps = |from: &Placed| -> Option<Vec<Step>> {
        let track = clip.tracks.tracks.iter().find(|track| track.object == from.object)?;
        let clear = track.samples.iter().filter(|sample| !sample.doubtful);
        Some(clear.map(|sample| Step::new(sample, from)).collect())
    };

    // Until another object moves
    let mut met_s = f64::INFINITY;
    for other in &placed[1..] {
        let first = steps(other)?.into_iter().find(|step| step.displacement_m > MET_M);
        met_s = met_s.min(first.map_or(f64::INFINITY, |step| step.time_s));
    }
    let mut moving = steps(&placed[0])?;
    let whole_m = moving.iter().map(|step| step.displacement_m).fold(0.0, f64::max);
    let to_m = TO_M.min(FASTER_HALF * whole_m);
    let end = moving
        .iter()
        .position(|step| step.displacement_m > to_m || step.time_s >= met_s)
        .unwrap_or(moving.len());
    moving.truncate(end);
    moving.retain(|step| step.displacement_m > FROM_M);
    let furthest_m = moving.iter().map(|step| step.displacement_m).fold(0.0, f64::max);
    (furthest_m > SHORTEST_DISPLACEMENT_M).then_some(SeenDeparture { placed, steps: moving })
}

impl SeenDeparture {
    /// The positions that the simulated struck object reaches too; `None` if it misses more than half of them.
    fn reached_in(&self, trajectory: &Trajectory, struck: &Placed) -> Option<Vec<Reached>> {
        let reached: Vec<Reached> =
            self.steps.iter().filter_map(|step| reached(trajectory, struck, step)).collect();
        (2 * reached.len() >= self.steps.len()).then_some(reached)
    }
}

impl Step {
    fn new(sample: &Sample, from: &Placed) -> Self {
        let displacement = sample.position() - from.position_m;
        Self {
            time_s: sample.time_s,
            displacement_m: displacement.length(),
            heading_rad: displacement.heading_rad(),
            std_m: sample.noise_std_m(),
        }
    }
}

/// When the simulated object is displaced so far (s after the striker starts).
fn time_at(trajectory: &Trajectory, object: &Placed, displacement_m: f64) -> Option<f64> {
    let displacement_at = |time_s: f64| {
        let pose = trajectory.pose(&object.object, time_s)?;
        Some((pose.position - object.position_m).length())
    };
    let steps = (trajectory.duration_s / STEP_S).ceil() as usize;
    let mut before_m = 0.0;
    for k in 1..=steps {
        let time_s = k as f64 * STEP_S;
        let now_m = displacement_at(time_s)?;
        if now_m >= displacement_m {
            let fraction = (displacement_m - before_m) / (now_m - before_m);
            return Some(time_s - STEP_S + fraction * STEP_S);
        }
        before_m = now_m;
    }
    None
}
