//! The fit of one clip: how many impacts it shows, and the most likely motion of all its bodies.

use super::initial_guess::{Draft, SIGHTS_NEEDED, fitted_partner, frame_s};
use super::least_squares::{AT_REST, Minimum, NEAR, ROUGH, minimum};
use super::motion_model::{Cause, Event, Exposure, Law, Layout, Model, ModelFit, Path};
use super::striker_path::StrikerRun;
use crate::estimate::closest_points::{Outline, touch};
use crate::geometry::Vec2;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// The most likely motion of a clip's bodies.
#[derive(Clone, Debug)]
pub(crate) struct Fitted {
    pub(crate) model: Model,
    pub(crate) layout: Layout,
    pub(crate) minimum: Minimum,
    pub(crate) paths: Vec<Path>,
    /// How many times larger than claimed the noise of the moving bodies is, and how sure that is.
    pub(crate) noise: Noise,
    /// Whether a body changes its velocity with nothing near: then something else than Coulomb friction slows it.
    pub(crate) uneven: bool,
    /// What the user should know.
    pub(crate) remarks: Vec<String>,
}

/// Sums of squares over claimed variances, and the degrees of freedom that they stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Noise {
    pub(crate) place: [f64; 2],
    pub(crate) yaw: [f64; 2],
}

/// Which residual tells of a place, and what was seen.
#[derive(Clone, Copy, Debug)]
struct PlaceRow {
    row: usize,
    time_s: f64,
    std_m: f64,
}

/// A sight farther off than this many deviations is an outlier and is left out.
const OUTLIER_STDS: f64 = 8.0;
/// No strike makes more impacts than this in a clip that is still of use.
const MOST_EVENTS: usize = 12;
/// An impact that nobody was seen to start is believed if it lowers the loss by this much (in variances), and changes
/// the velocity by this many of its deviations.
const EVENT_GAIN: f64 = 40.0;
const EVENT_STDS: f64 = 5.0;
/// No impact changes the velocity by a smaller part: a body that rocks after an impact slides unevenly.
const EVENT_JUMP: f64 = 0.04;
/// The gain needed where no partner is near.
const LONE_EVENT_GAIN: f64 = 400.0;

impl Fitted {
    /// The most likely motion, from the sights of this clip alone.
    pub(crate) fn new(draft: Draft, striker: Option<&StrikerRun>) -> Self {
        let mut fitted = best_start(draft);
        while fitted.model.events.len() < MOST_EVENTS && !fitted.uneven {
            match fitted.with_one_more_event(striker) {
                Some(better) => fitted = better,
                None => break,
            }
        }
        if let Some(run) = striker {
            fitted = fitted.until_caught(run);
        }
        fitted.without_outliers()
    }

    /// The most likely motion with the draft's impacts and no others.
    pub(crate) fn of_draft(draft: Draft) -> Self {
        Self::run(draft.model, draft.parameters).without_outliers()
    }

    /// Fits again with what all clips together tell about noise and shutter.
    pub(crate) fn refined(&self, place_scale: f64, yaw_scale: f64, exposure: Exposure) -> Self {
        let Self { mut model, .. } = self.noisier(place_scale, yaw_scale);
        model.exposure = exposure;
        if model.law == Law::Free {
            return Self::run(model, self.minimum.parameters.clone());
        }
        let refined =
            Self { remarks: self.remarks.clone(), ..Self::run(model, self.minimum.parameters.clone()) };
        refined.without_idle_events()
    }

    /// The same fit of sights whose noise is otherwise than claimed.
    pub(crate) fn noisier(&self, place_scale: f64, yaw_scale: f64) -> Self {
        let mut fitted = self.clone();
        for sight in fitted.model.bodies.iter_mut().flat_map(|body| &mut body.sights) {
            sight.std_m *= place_scale;
        }
        fitted.model.yaw_std_rad *= yaw_scale;
        fitted
    }

    /// The fit without the events that, seen closely, change no velocity.
    fn without_idle_events(self) -> Self {
        let idle = (0..self.model.events.len()).find(|&n| {
            let at_s = self.minimum.parameters[self.layout.events[n].time];
            self.model.events[n].members.iter().all(|&k| {
                let speed_m_s = self.paths[k].motion_before(at_s).velocity.length();
                let (_, jump_m_s, std_m_s) = self.jump_near(k, at_s).unwrap_or_default();
                speed_m_s > 0.0 && (jump_m_s < EVENT_STDS * std_m_s || jump_m_s < EVENT_JUMP * speed_m_s)
            })
        });
        let Some(n) = idle else { return self };
        let mut model = self.model.clone();
        model.events.remove(n);
        let slots = &self.layout.events[n];
        let mut parameters = self.minimum.parameters.clone();
        parameters.drain(slots.time..slots.time + layout_len(&self.layout, slots));
        Self { remarks: self.remarks.clone(), ..Self::run(model, parameters) }.without_idle_events()
    }

    /// The least loss from these parameters.
    fn run(model: Model, parameters: Vec<f64>) -> Self {
        // The weights depend on the motion, which the first fit finds.
        let first = Self::weighed(model, parameters, NEAR);
        Self::weighed(first.model, first.minimum.parameters, AT_REST)
    }

    /// The least loss with the weights that these parameters give.
    fn weighed(mut model: Model, parameters: Vec<f64>, close_enough: f64) -> Self {
        let layout = model.layout();
        model.weigh(&layout, &parameters);
        let minimum = minimum(parameters, &layout.steps, close_enough, &ModelFit::new(&model, &layout));
        let paths = model.paths(&layout, &minimum.parameters);
        let noise = noise(&model, &minimum, &paths);
        Self { model, layout, minimum, paths, noise, uneven: false, remarks: Vec::new() }
    }

    /// The factor by which this clip's noise exceeds the claimed one, squared.
    pub(crate) fn place_variance(&self) -> f64 {
        let [squares, freedom] = self.noise.place;
        // A clip that fits better than claimed by luck does not become surer by it.
        if freedom > 2.0 { (squares / freedom).max(SMALLEST_VARIANCE) } else { 1.0 }
    }

    /// The same fit with one more impact, if the sights demand one; one with nothing near is none.
    fn with_one_more_event(&self, striker: Option<&StrikerRun>) -> Option<Self> {
        let variance = self.place_variance();
        let (gain, body, time_s, jump) = self.best_kink()?;
        // The score is a lower bound of the gain: far from the instant it is a poor one.
        if gain < EVENT_GAIN / 4.0 * variance {
            return None;
        }
        let partner = fitted_partner(&self.model.bodies, &self.paths, body, time_s);
        let struck_again =
            striker.is_some_and(|run| self.striker_gap_m(run, body, time_s).is_some_and(|g| g < 0.003));
        let event = match partner {
            Some(other) => Event { cause: Cause::Contact, members: vec![other, body] },
            None if struck_again => Event { cause: Cause::Striker, members: vec![body] },
            None => Event { cause: Cause::Unknown, members: vec![body] },
        };
        let (model, parameters) = self.inserted(event.clone(), time_s, body, jump);
        // Most trials gain too little, as a first fit shows already.
        let first = Self::weighed(model, parameters, NEAR);
        if self.place_loss() - first.place_loss() < EVENT_GAIN / 4.0 * first.place_variance() {
            return None;
        }
        let trial = Self::weighed(first.model, first.minimum.parameters, AT_REST);
        let trial = Self { remarks: self.remarks.clone(), ..trial };
        // A spin that does not decay as told is no impact: only the places count.
        let gained = self.place_loss() - trial.place_loss();
        let (at_s, jump_m_s, std_m_s) = trial.jump_near(body, time_s)?;
        // The instant has moved in the fit: the partner must still be near.
        let alone = match event.cause {
            Cause::Contact => fitted_partner(&trial.model.bodies, &trial.paths, body, at_s) != partner,
            cause => cause == Cause::Unknown,
        };
        let needed = if alone { LONE_EVENT_GAIN } else { EVENT_GAIN };
        let speed_m_s = trial.paths[body].motion_before(at_s).velocity.length();
        let believed = gained > needed * trial.place_variance()
            && jump_m_s > EVENT_STDS * std_m_s * trial.place_variance().sqrt()
            && jump_m_s > EVENT_JUMP * speed_m_s;
        believed.then(|| if alone { Self { uneven: true, ..self.clone() } } else { trial })
    }

    /// The part of the loss that the places are to blame for.
    fn place_loss(&self) -> f64 {
        let mut row = 0;
        let rows =
            (0..self.model.bodies.len()).flat_map(|k| self.place_rows(k, &mut row)).collect::<Vec<_>>();
        rows.iter().map(|r| self.minimum.residuals[r.row].loss()).sum()
    }

    /// The instant at which a jump of one body's velocity would lower the loss most: gain, body, time, jump.
    fn best_kink(&self) -> Option<(f64, usize, f64, Vec2)> {
        let mut best: Option<(f64, usize, f64, Vec2)> = None;
        let mut row = 0;
        for (k, body) in self.model.bodies.iter().enumerate() {
            let rows = self.place_rows(k, &mut row);
            let (onset_s, stop_s) = (self.paths[k].onset_s(), self.paths[k].stop_s());
            let moving: Vec<f64> = (body.sights.windows(2))
                .map(|w| f64::midpoint(w[0].time_s, w[1].time_s))
                .filter(|t| *t > onset_s && *t < stop_s)
                .collect();
            let stride = moving.len().div_ceil(CANDIDATES).max(1);
            for &time_s in moving.iter().step_by(stride) {
                let end_s = self.next_event_s(k, time_s).min(stop_s);
                let lever = |t: f64| (t.min(end_s) - time_s).max(0.0);
                let (gain, jump) = self.score(&rows, lever);
                if best.is_none_or(|(most, ..)| gain > most) {
                    best = Some((gain, k, time_s, jump));
                }
            }
        }
        best
    }

    /// The residuals of a body's places; moves `row` on to the next body.
    fn place_rows(&self, k: usize, row: &mut usize) -> Vec<PlaceRow> {
        let body = &self.model.bodies[k];
        let mut rows = Vec::new();
        for (sight, &std_m) in body.sights.iter().zip(&self.model.stds_m[k]).filter(|(s, _)| !s.ignored) {
            rows.push(PlaceRow { row: *row, time_s: sight.time_s, std_m });
            *row += if body.sees_yaw && sight.yaw_rad.is_some() { 2 } else { 1 };
        }
        rows
    }

    fn next_event_s(&self, k: usize, after_s: f64) -> f64 {
        (self.model.events.iter().zip(&self.layout.events))
            .filter(|(event, _)| event.members.contains(&k))
            .map(|(_, slots)| self.minimum.parameters[slots.time])
            .filter(|t| *t > after_s)
            .fold(f64::INFINITY, f64::min)
    }

    /// By how much the loss would fall if the places moved by `lever` times a velocity, the other parameters
    /// following (a score test), and that velocity.
    fn score(&self, rows: &[PlaceRow], lever: impl Fn(f64) -> f64) -> (f64, Vec2) {
        let mut gain = 0.0;
        let mut jump = [0.0; 2];
        for (axis, jump) in [Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0)].into_iter().zip(&mut jump) {
            if let Some((value, variance)) = self.pulled(rows, |t| axis * lever(t)) {
                gain += value * value / variance;
                *jump = value;
            }
        }
        (gain, jump.into())
    }

    /// What a further parameter would be that moves body `k` by `moved` per unit, the others following, and its
    /// deviation.
    pub(crate) fn response(&self, k: usize, moved: impl Fn(f64) -> Vec2) -> Option<(f64, f64)> {
        let mut row = 0;
        let rows = (0..=k).map(|j| self.place_rows(j, &mut row)).last()?;
        let (value, variance) = self.pulled(&rows, moved)?;
        Some((value, variance.sqrt()))
    }

    /// The value of a parameter that moves the places of `rows` by `moved` per unit, and its variance.
    fn pulled(&self, rows: &[PlaceRow], moved: impl Fn(f64) -> Vec2) -> Option<(f64, f64)> {
        /// Less than this part of the pull left by the other parameters is rounding.
        const ROUNDING: f64 = 1e-9;
        let minimum = &self.minimum;
        let mut cross = DVector::zeros(minimum.parameters.len());
        let (mut own, mut against) = (0.0, 0.0);
        for &PlaceRow { row, time_s, std_m } in rows {
            let pull: [f64; 2] = (moved(time_s) / -std_m).into();
            let weight = minimum.weights[row];
            for (part, pull) in pull.into_iter().enumerate() {
                own += weight * pull * pull;
                against += weight * pull * minimum.residuals[row].value[part];
                for (column, sum) in cross.iter_mut().enumerate() {
                    *sum += weight * pull * minimum.jacobian[(2 * row + part, column)];
                }
            }
        }
        let free = own - (cross.transpose() * &minimum.covariance * &cross)[(0, 0)];
        (free > ROUNDING * own && free > 0.0).then(|| (-against / free, 1.0 / free))
    }

    /// Model and parameters with an event added at a time, at which `body` jumps by `jump`.
    fn inserted(&self, event: Event, time_s: f64, body: usize, jump: Vec2) -> (Model, Vec<f64>) {
        let times: Vec<f64> =
            self.layout.events.iter().map(|slots| self.minimum.parameters[slots.time]).collect();
        let at = times.partition_point(|t| *t < time_s);
        let mut model = self.model.clone();
        model.events.insert(at, event);
        let layout = model.layout();
        let mut parameters = vec![0.0; layout.steps.len()];
        let old = &self.minimum.parameters;
        for (new, from) in layout.bodies.iter().zip(&self.layout.bodies) {
            let size = new.len().min(from.len());
            parameters[new.position..][..size].copy_from_slice(&old[from.position..][..size]);
            if let (Some(slot), None) = (new.friction, from.friction) {
                parameters[slot] = 0.2;
            }
        }
        let kept = layout.events.iter().enumerate().filter(|(n, _)| *n != at).map(|(_, slots)| slots);
        for (new, from) in kept.zip(&self.layout.events) {
            let size = layout_len(&layout, new);
            parameters[new.time..][..size].copy_from_slice(&old[from.time..][..size]);
        }
        let slots = &layout.events[at];
        parameters[slots.time] = time_s;
        for (&member, &slot) in model.events[at].members.iter().zip(&slots.velocities) {
            let motion = self.paths[member].motion(time_s);
            let velocity = motion.velocity + if member == body { jump } else { Vec2::ZERO };
            parameters[slot] = velocity.x;
            parameters[slot + 1] = velocity.y;
            if model.bodies[member].sees_yaw {
                parameters[slot + 2] = motion.spin_rad_s;
            }
        }
        (model, parameters)
    }

    /// A body's event next to a time: when, its jump of velocity, and the jump's deviation (m/s).
    fn jump_near(&self, body: usize, time_s: f64) -> Option<(f64, f64, f64)> {
        let (event, slots) = (self.model.events.iter().zip(&self.layout.events))
            .filter(|(event, _)| event.members.contains(&body))
            .min_by(|p, q| {
                let off = |slots: &super::motion_model::EventSlots| {
                    (self.minimum.parameters[slots.time] - time_s).abs()
                };
                off(p.1).total_cmp(&off(q.1))
            })?;
        let at_s = self.minimum.parameters[slots.time];
        let jump = self.paths[body].motion(at_s).velocity - self.paths[body].motion_before(at_s).velocity;
        let slot = slots.velocities[event.members.iter().position(|&m| m == body)?];
        let covariance = &self.minimum.covariance;
        Some((
            at_s,
            jump.length(),
            f64::midpoint(covariance[(slot, slot)], covariance[(slot + 1, slot + 1)]).sqrt(),
        ))
    }

    /// The gap between the striker and a body (m), if the clip begins with the striker's impact.
    pub(crate) fn striker_gap_m(&self, run: &StrikerRun, body: usize, time_s: f64) -> Option<f64> {
        let (event, slots) = (self.model.events.iter().zip(&self.layout.events)).next()?;
        if event.cause != Cause::Striker {
            return None;
        }
        let struck = event.members[0];
        let impact_s = self.minimum.parameters[slots.time];
        let outline = |k: usize, pose| Outline { shape: &self.model.bodies[k].shape, pose };
        let way_m = run.way_to_m(outline(struck, self.paths[struck].motion_before(impact_s).pose))?;
        let striker = run.outline_after(run.way_at_m(way_m, time_s - impact_s));
        let there = outline(body, self.paths[body].motion(time_s).pose);
        Some(touch(striker, there).map_or(0.0, |t| t.gap_m))
    }

    /// The fit up to the moment in which the striker catches up with the struck body and pushes it.
    fn until_caught(self, run: &StrikerRun) -> Self {
        // A grazing pass is no push: the outlines would have to overlap for this long.
        const PUSH_FRAMES: f64 = 1.0;
        let Some((event, slots)) = self.model.events.iter().zip(&self.layout.events).next() else {
            return self;
        };
        if event.cause != Cause::Striker {
            return self;
        }
        let (struck, impact_s) = (event.members[0], self.minimum.parameters[slots.time]);
        let frame_s = frame_s(&self.model.bodies);
        let touches = |t: f64| self.striker_gap_m(run, struck, t).is_some_and(|gap_m| gap_m <= 0.0);
        let caught = (self.model.bodies[struck].sights.iter())
            .map(|s| s.time_s)
            .filter(|t| *t > impact_s + frame_s)
            .find(|t| touches(*t) && touches(*t + PUSH_FRAMES * frame_s));
        let Some(caught_s) = caught else { return self };
        let uneven = self.uneven;
        let caught_s = caught_s - frame_s;
        let mut model = self.model.clone();
        for sight in model.bodies[struck].sights.iter_mut().filter(|s| s.time_s > caught_s) {
            sight.ignored = true;
        }
        let object = model.bodies[struck].object.clone();
        let mut times = Vec::new();
        let mut events = Vec::new();
        for (event, slots) in model.events.iter().zip(&self.layout.events) {
            let time_s = self.minimum.parameters[slots.time];
            let mut event = event.clone();
            if time_s > caught_s {
                event.members.retain(|m| *m != struck);
                event.cause = Cause::Unknown;
            }
            if !event.members.is_empty() {
                events.push(event);
                times.push(time_s);
            }
        }
        model.events = events;
        let mut fitted = Self { uneven, ..best_start(Draft::from_times(model, &times)) };
        fitted.remarks.push(format!(
            "the striker catches up with `{object}` at {caught_s:.3} s and pushes it: what it does then is left out"
        ));
        fitted
    }

    /// The fit without the sights that are farther off than noise can be.
    fn without_outliers(self) -> Self {
        let scale = self.place_variance().sqrt();
        let mut model = self.model.clone();
        let mut row = 0;
        let mut left_out = 0;
        for (k, body) in model.bodies.iter_mut().enumerate() {
            let rows = self.place_rows(k, &mut row);
            let sights = body.sights.iter_mut().filter(|s| !s.ignored);
            for (sight, place) in sights.zip(rows) {
                let [x, y] = self.minimum.residuals[place.row].value;
                if x.hypot(y) > OUTLIER_STDS * scale {
                    sight.ignored = true;
                    left_out += 1;
                }
            }
        }
        if left_out == 0 {
            return self;
        }
        let (uneven, remarks) = (self.uneven, self.remarks);
        Self { uneven, remarks, ..Self::run(model, self.minimum.parameters) }
    }

    /// How far the sights of moving bodies lie from the fit (m, root mean square, both axes together).
    pub(crate) fn residual_rms_m(&self) -> f64 {
        root_mean_square((0..self.model.bodies.len()).flat_map(|k| self.distances_m(k)))
    }

    /// The same for one body, and along one axis.
    pub(crate) fn residual_rms_of(&self, k: usize) -> f64 {
        root_mean_square(self.distances_m(k)) / std::f64::consts::SQRT_2
    }

    /// How far each sight of a body lies from the fit while it moves.
    fn distances_m(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        let (body, path) = (&self.model.bodies[k], &self.paths[k]);
        let moving = path.onset_s()..path.stop_s();
        let sights = body.sights.iter().filter(move |s| !s.ignored && moving.contains(&s.time_s));
        sights.map(|s| s.position.distance(path.motion(s.time_s).pose.position))
    }

    /// The covariance of functions of the parameters, and their values.
    pub(crate) fn propagated(&self, functions: impl Fn(&[f64]) -> Vec<f64>) -> (Vec<f64>, DMatrix<f64>) {
        let parameters = &self.minimum.parameters;
        let values = functions(parameters);
        let mut slopes = DMatrix::zeros(values.len(), parameters.len());
        let mut moved = parameters.clone();
        for (column, step) in self.layout.steps.iter().enumerate() {
            moved[column] = parameters[column] + step;
            let ahead = functions(&moved);
            moved[column] = parameters[column] - step;
            let behind = functions(&moved);
            moved[column] = parameters[column];
            for (row, (plus, minus)) in ahead.iter().zip(&behind).enumerate() {
                slopes[(row, column)] = (plus - minus) / (2.0 * step);
            }
        }
        let covariance = &slopes * &self.minimum.covariance * slopes.transpose();
        (values, covariance)
    }
}

/// Candidate instants of an impact that are tried for each body.
const CANDIDATES: usize = 80;
/// Noise is not believed to be smaller than this part of what the track claims (variance).
const SMALLEST_VARIANCE: f64 = 0.04;

/// Zero of nothing.
fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (squares, count) = values.fold((0.0, 0.0), |(squares, count), v| (squares + v * v, count + 1.0));
    if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 }
}

fn layout_len(layout: &Layout, slots: &super::motion_model::EventSlots) -> usize {
    let next = layout.events.iter().map(|e| e.time).filter(|t| *t > slots.time).min();
    next.unwrap_or(layout.steps.len()) - slots.time
}

/// The best of several first guesses of friction.
fn best_start(mut draft: Draft) -> Fitted {
    draft.model.weigh(&draft.layout, &draft.parameters);
    let starts = [1.0, 0.5, 2.0].map(|factor| {
        let mut parameters = draft.parameters.clone();
        for slots in &draft.layout.bodies {
            if let Some(slot) = slots.friction {
                parameters[slot] *= factor;
            }
        }
        minimum(parameters, &draft.layout.steps, ROUGH, &ModelFit::new(&draft.model, &draft.layout))
    });
    let best = starts.into_iter().min_by(|p, q| p.loss.total_cmp(&q.loss));
    Fitted::run(draft.model, best.map_or(draft.parameters, |b| b.parameters))
}

/// How large the residuals of moving bodies are against what the track claims.
fn noise(model: &Model, minimum: &Minimum, paths: &[Path]) -> Noise {
    let mut noise = Noise::default();
    let leverage = &minimum.jacobian * &minimum.covariance;
    let mut row = 0;
    for (body, path) in model.bodies.iter().zip(paths) {
        for sight in body.sights.iter().filter(|s| !s.ignored) {
            let moving = sight.time_s > path.onset_s() && sight.time_s < path.stop_s();
            let add = |row: usize, parts: usize, sum: &mut [f64; 2]| {
                let weight = minimum.weights[row];
                for part in 0..parts {
                    let r = 2 * row + part;
                    let used = leverage.row(r).dot(&minimum.jacobian.row(r)) * weight;
                    sum[0] += weight * minimum.residuals[row].value[part].powi(2);
                    sum[1] += (1.0 - used).max(0.0);
                }
            };
            let with_yaw = body.sees_yaw && sight.yaw_rad.is_some();
            if moving && body.sights.len() >= SIGHTS_NEEDED {
                add(row, 2, &mut noise.place);
                if with_yaw {
                    add(row + 1, 1, &mut noise.yaw);
                }
            }
            row += if with_yaw { 2 } else { 1 };
        }
    }
    noise
}
