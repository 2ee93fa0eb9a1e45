//! The fit of one clip: how many impacts it contains, and the motion of all its bodies with the least loss.

use super::initial_guess::{InitialGuess, OBSERVATIONS_NEEDED, fitted_partner, frame_s};
use super::least_squares::{COARSE, FINAL, INTERMEDIATE, Minimum, minimum};
use super::motion_model::{
    BodyPath, Cause, Event, EventIndices, Exposure, MotionLaw, MotionModel, MotionProblem, Observation,
    ParameterLayout,
};
use super::result::Measured;
use super::striker::path::StrikerPath;
use crate::estimate::closest_points::PlacedShape;
use crate::geometry::{Pose, Vec2};
use crate::object::kind;
use crate::physics::GRAVITY_M_S2;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The fitted motion of a clip's bodies.
#[derive(Clone, Debug)]
pub(crate) struct MotionFit {
    pub(crate) model: MotionModel,
    pub(crate) layout: ParameterLayout,
    pub(crate) minimum: Minimum,
    pub(crate) paths: Vec<BodyPath>,
    /// Squared residuals of the moving bodies over the variances that the tracks claim.
    pub(crate) noise: NoiseStatistics,
    /// Whether a body decelerates otherwise than by Coulomb friction: its velocity changes with nothing near it.
    pub(crate) non_coulomb: bool,
    /// Warnings for the user.
    pub(crate) remarks: Vec<String>,
}

/// Noise of positions and yaws compared with what the tracks claim.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct NoiseStatistics {
    #[serde(rename = "place")]
    pub(crate) position: VarianceRatio,
    pub(crate) yaw: VarianceRatio,
}

/// A sum of squared residuals over the claimed variances, and its degrees of freedom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 2]", into = "[f64; 2]")]
pub(crate) struct VarianceRatio {
    pub(crate) squares: f64,
    pub(crate) freedom: f64,
}

impl VarianceRatio {
    /// The sum of two independent ones.
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { squares: self.squares + other.squares, freedom: self.freedom + other.freedom }
    }
}

impl From<[f64; 2]> for VarianceRatio {
    fn from([squares, freedom]: [f64; 2]) -> Self {
        Self { squares, freedom }
    }
}

impl From<VarianceRatio> for [f64; 2] {
    fn from(ratio: VarianceRatio) -> Self {
        [ratio.squares, ratio.freedom]
    }
}

/// The residual of an observed position.
#[derive(Clone, Copy, Debug)]
pub(super) struct PositionRow {
    pub(super) row: usize,
    pub(super) time_s: f64,
    pub(super) std_m: f64,
}

/// An observation with a residual of more than this many standard deviations is an outlier and is excluded.
const OUTLIER_STDS: f64 = 8.0;
/// Clips with more impacts than this are not useful.
const MAX_EVENTS: usize = 12;
/// An impact that sets no body at rest in motion is accepted if it lowers the loss by this much (in variances), and
/// changes the velocity by this many of its standard deviations.
pub(super) const EVENT_GAIN: f64 = 40.0;
const EVENT_STDS: f64 = 5.0;
/// An impact of the striker where it is near again, and a position shows the motion from the one before, is accepted if it lowers the loss by this
/// much (in variances). Its four parameters do so by chance in 4 of 100 fits, whose values are then less certain; without it they would be biased.
pub(super) const STRIKE_GAIN: f64 = 10.0;
/// It must also change the velocity by this fraction: rocking after an impact changes it slightly.
const EVENT_JUMP: f64 = 0.04;
/// A body nearer to the striker than this may be hit by it again (m).
pub(super) const STRUCK_AGAIN_M: f64 = 0.003;
/// A body at rest moves again if two observations are further apart than this many of their standard deviations.
const MOVED_AGAIN_STDS: f64 = 8.0;
/// The initial friction of a body that starts to move by an added impact.
const USUAL_FRICTION: f64 = 0.2;
/// The gain that is required where no partner is near.
const LONE_EVENT_GAIN: f64 = 400.0;

impl MotionFit {
    /// The fit of a guess, with further impacts where the observations demand them.
    pub(crate) fn new(guess: InitialGuess, striker: Option<&StrikerPath>) -> Self {
        let mut fitted = best_start(guess);
        if let Some(striker) = striker {
            fitted = fitted.with_further_strikes(striker);
        }
        while fitted.model.events.len() < MAX_EVENTS && !fitted.non_coulomb {
            match fitted.with_one_more_event(striker) {
                Some(better) => fitted = better,
                None => break,
            }
        }
        if let Some(striker) = striker {
            fitted = fitted.until_pushed(striker).with_one_restitution(striker);
        }
        fitted.without_outliers()
    }

    /// The fit with the impacts of a guess and no others.
    pub(crate) fn from_guess(guess: InitialGuess) -> Self {
        Self::run(guess.model, guess.parameters).without_outliers()
    }

    /// Fits again with the noise and the exposure that all clips together give.
    pub(crate) fn refitted(&self, position_scale: f64, yaw_scale: f64, exposure: Exposure) -> Self {
        let Self { mut model, .. } = self.with_noise_scaled(position_scale, yaw_scale);
        model.exposure = exposure;
        if model.law == MotionLaw::ConstantRates {
            return Self::run(model, self.minimum.parameters.clone());
        }
        let refitted =
            Self { remarks: self.remarks.clone(), ..Self::run(model, self.minimum.parameters.clone()) };
        refitted.without_negligible_events()
    }

    /// The fit with the frictions that other clips let expect of each object, by its name, as priors; `None` if no body has one.
    pub(crate) fn with_expected_frictions(&self, expected: &BTreeMap<String, Measured>) -> Option<Self> {
        let mut model = self.model.clone();
        for (body, indices) in model.bodies.iter_mut().zip(&self.layout.bodies) {
            body.expected_friction = indices.friction.and_then(|_| expected.get(kind(&body.object))).copied();
        }
        if model.bodies.iter().all(|body| body.expected_friction.is_none()) {
            return None;
        }
        Some(Self { remarks: self.remarks.clone(), ..Self::run(model, self.minimum.parameters.clone()) })
    }

    /// The same motion, with other standard deviations of the observations.
    pub(crate) fn with_noise_scaled(&self, position_scale: f64, yaw_scale: f64) -> Self {
        let mut fitted = self.clone();
        for observation in fitted.model.bodies.iter_mut().flat_map(|body| &mut body.observations) {
            observation.std_m *= position_scale;
        }
        fitted.model.yaw_std_rad *= yaw_scale;
        fitted
    }

    /// The fit without the impacts whose velocity change is negligible. A further impact of the striker stays if the positions demand it all the
    /// same: that it comes near is known, and the short motion from there to another impact leaves the velocity change uncertain.
    fn without_negligible_events(self) -> Self {
        let negligible = (0..self.model.events.len()).find(|&n| {
            let at_s = self.minimum.parameters[self.layout.events[n].time];
            self.model.events[n].members.iter().all(|&k| {
                let speed_m_s = self.paths[k].motion_before(at_s).velocity.length();
                let (_, jump_m_s, std_m_s) = self.jump(n, k).unwrap_or_default();
                speed_m_s > 0.0 && (jump_m_s < EVENT_STDS * std_m_s || jump_m_s < EVENT_JUMP * speed_m_s)
            })
        });
        let Some(n) = negligible else { return self };
        let mut model = self.model.clone();
        model.events.remove(n);
        let indices = &self.layout.events[n];
        let mut parameters = self.minimum.parameters.clone();
        parameters.drain(indices.time..indices.time + event_len(&self.layout, indices));
        let without = Self { remarks: self.remarks.clone(), ..Self::run(model, parameters) };
        let is_demanded = self.model.events[n].cause == Cause::Striker
            && without.position_loss() - self.position_loss() > STRIKE_GAIN * self.position_variance();
        if is_demanded { self } else { without.without_negligible_events() }
    }

    /// The fit that starts from these parameters.
    pub(super) fn run(model: MotionModel, parameters: Vec<f64>) -> Self {
        // The weights depend on the motion: the second fit uses those of the first.
        let first = Self::weighted(model, parameters, INTERMEDIATE);
        Self::weighted(first.model, first.minimum.parameters, FINAL)
    }

    /// The fit with weights for the motion of these parameters.
    fn weighted(mut model: MotionModel, parameters: Vec<f64>, tolerance: f64) -> Self {
        let layout = model.layout();
        model.set_weights(&layout, &parameters);
        let minimum = minimum(parameters, &layout.steps, tolerance, &MotionProblem::new(&model, &layout));
        let paths = model.paths(&layout, &minimum.parameters);
        let noise = noise(&model, &minimum, &paths);
        Self { model, layout, minimum, paths, noise, non_coulomb: false, remarks: Vec::new() }
    }

    /// The variance of this clip's positions over the one that the tracks claim.
    pub(crate) fn position_variance(&self) -> f64 {
        let VarianceRatio { squares, freedom } = self.noise.position;
        // Bounded below: few residuals may be small by chance.
        if freedom > 2.0 { (squares / freedom).max(MIN_VARIANCE) } else { 1.0 }
    }

    /// The fit with one more impact, if the observations demand one.
    ///
    /// If they demand one with no partner near it, the same fit, marked as not Coulomb's.
    fn with_one_more_event(&self, striker: Option<&StrikerPath>) -> Option<Self> {
        let again = self.moved_again().and_then(|candidate| self.with_event_at(candidate, striker));
        let demanded = || {
            let (_, body, time_s, jump) = self.demanded_jump()?;
            self.with_event_at((body, time_s, jump), striker)
        };
        again.filter(|fitted| !fitted.non_coulomb).or_else(demanded)
    }

    /// The fit with an impact of a body about a time at which its velocity jumps (body, time (s), jump (m/s)), if the observations demand it.
    fn with_event_at(
        &self,
        (body, time_s, jump): (usize, f64, Vec2),
        striker: Option<&StrikerPath>,
    ) -> Option<Self> {
        // Its partner
        let partner = fitted_partner(&self.model.bodies, &self.paths, body, time_s);
        let struck_again =
            striker.is_some_and(|s| self.striker_gap_m(s, body, time_s).is_some_and(|g| g < STRUCK_AGAIN_M));
        let event = match partner {
            Some(other) => Event { cause: Cause::Contact, members: vec![other, body] },
            None if struck_again => Event { cause: Cause::Striker, members: vec![body] },
            None => Event { cause: Cause::Unknown, members: vec![body] },
        };
        let (model, parameters, added) = self.inserted(event.clone(), time_s, body, jump);

        // The fit with the impact; for most candidates a first fit already shows too little gain

        let first = Self::weighted(model, parameters, INTERMEDIATE);
        if self.position_loss() - first.position_loss() < EVENT_GAIN / 4.0 * first.position_variance() {
            return None;
        }
        let trial = Self::weighted(first.model, first.minimum.parameters, FINAL);
        let (trial, added) = self.at_contact(trial, added, &event, body);
        let trial = Self { remarks: self.remarks.clone(), ..trial };

        let (at_s, ..) = trial.jump(added, body)?;
        // The fit has changed the instant: the partner must still be near.
        let alone = match event.cause {
            Cause::Contact => fitted_partner(&trial.model.bodies, &trial.paths, body, at_s) != partner,
            cause => cause == Cause::Unknown,
        };
        // Between two impacts of the same bodies in one frame no velocity is observed.
        if trial.repeats_an_impact(&event, at_s) {
            return None;
        }
        let needed = if alone { LONE_EVENT_GAIN } else { EVENT_GAIN };
        let accepted = self.is_improved_by(&trial, (added, body), needed);
        accepted.then(|| if alone { Self { non_coulomb: true, ..self.clone() } } else { trial })
    }

    /// Whether a fit with one more event, of this index, lowers the loss by `needed` variances, and changes the velocity of the body
    /// noticeably.
    pub(super) fn is_improved_by(&self, trial: &Self, (event, body): (usize, usize), needed: f64) -> bool {
        let Some((_, jump_m_s, std_m_s)) = trial.jump(event, body) else { return false };
        let least_m_s = EVENT_STDS * std_m_s * trial.position_variance().sqrt();
        jump_m_s > least_m_s && self.is_explained_by(trial, (event, body), needed)
    }

    /// The same, however uncertain the change of the velocity is.
    pub(super) fn is_explained_by(&self, trial: &Self, (event, body): (usize, usize), needed: f64) -> bool {
        let Some((at_s, jump_m_s, _)) = trial.jump(event, body) else { return false };
        // Positions alone decide: a spin that decays otherwise than modelled does not show an impact.
        let gained = self.position_loss() - trial.position_loss();
        let speed_m_s = trial.paths[body].motion_before(at_s).velocity.length();
        gained > needed * trial.position_variance() && jump_m_s > EVENT_JUMP * speed_m_s
    }

    /// The fit with an impact, of this index, or that with the impact when its bodies touch, if they are apart in the first and the second one
    /// fits the positions about as well; and the index of the impact.
    fn at_contact(&self, trial: Self, added: usize, event: &Event, body: usize) -> (Self, usize) {
        let nearer = trial.jump(added, body).and_then(|(at_s, ..)| trial.nearer_approach_s(event, at_s));
        let Some(contact_s) = nearer else { return (trial, added) };
        let (model, parameters, at) = self.inserted(event.clone(), contact_s, body, Vec2::ZERO);
        let touching = Self::run(model, parameters);
        let allowed = trial.position_loss() + EVENT_GAIN * trial.position_variance();
        if touching.position_loss() < allowed { (touching, at) } else { (trial, added) }
    }

    /// The number of its events before a time (s).
    pub(super) fn events_before(&self, time_s: f64) -> usize {
        self.timed_events().take_while(|(_, at_s)| *at_s < time_s).count()
    }

    /// Whether all bodies of an event at this time take part in another event less than a frame away.
    fn repeats_an_impact(&self, event: &Event, time_s: f64) -> bool {
        let frame_s = frame_s(&self.model.bodies);
        let same = |other: &Event| event.members.iter().all(|m| other.members.contains(m));
        let near = self.timed_events().filter(|(other, at_s)| same(other) && (at_s - time_s).abs() < frame_s);
        // One of them is the event itself.
        near.count() > 1
    }

    /// The loss of the positions alone.
    fn position_loss(&self) -> f64 {
        let mut row = 0;
        let rows =
            (0..self.model.bodies.len()).flat_map(|k| self.position_rows(k, &mut row)).collect::<Vec<_>>();
        rows.iter().map(|r| self.minimum.residuals[r.row].loss()).sum()
    }

    /// A body that moves from one observation to the next after its fitted stop: the body, the time between (s) and the velocity with which it
    /// slides so far (m/s). The residuals do not show it to first order, because the fit ends at the last position of rest.
    fn moved_again(&self) -> Option<(usize, f64, Vec2)> {
        let frame_s = frame_s(&self.model.bodies);
        (0..self.model.bodies.len()).find_map(|k| {
            let (body, path, friction) =
                (&self.model.bodies[k], &self.paths[k], self.layout.bodies[k].friction?);
            let stopped_s = path.stop_s() - frame_s;
            let trusted = body.observations.iter().filter(|o| !o.excluded && !o.doubtful);
            let rest: Vec<_> = trusted.filter(|o| o.time_s > stopped_s).collect();
            let moves = rest.windows(2).map(|pair| (pair, self.unexplained_m(k, pair)));
            let (pair, distance) = moves.max_by(|p, q| p.1.length().total_cmp(&q.1.length()))?;
            if distance.length() < MOVED_AGAIN_STDS * pair[0].std_m.hypot(pair[1].std_m) {
                return None;
            }
            let deceleration_m_s2 = self.minimum.parameters[friction] * GRAVITY_M_S2;
            let speed_m_s = (2.0 * deceleration_m_s2 * distance.length()).sqrt();
            Some((k, f64::midpoint(pair[0].time_s, pair[1].time_s), distance.direction()? * speed_m_s))
        })
    }

    /// By how much body `k` moves further between two observations than in the fit (m).
    fn unexplained_m(&self, k: usize, pair: &[&Observation]) -> Vec2 {
        let [from, to] =
            [pair[0], pair[1]].map(|o| o.position - self.paths[k].motion(o.time_s).pose.position);
        to - from
    }

    /// The jump with the largest gain to first order, if the residuals may demand a further event.
    pub(super) fn demanded_jump(&self) -> Option<(f64, usize, f64, Vec2)> {
        // The score is a lower bound of the gain, and a weak one far from the true instant.
        self.best_jump().filter(|(gain, ..)| *gain >= EVENT_GAIN / 4.0 * self.position_variance())
    }

    /// The velocity jump of one body that would lower the loss most: gain, body, time (s), jump (m/s).
    fn best_jump(&self) -> Option<(f64, usize, f64, Vec2)> {
        let mut best: Option<(f64, usize, f64, Vec2)> = None;
        let mut row = 0;
        for (k, body) in self.model.bodies.iter().enumerate() {
            let rows = self.position_rows(k, &mut row);
            let (onset_s, stop_s) = (self.paths[k].onset_s(), self.paths[k].stop_s());
            let moving: Vec<f64> = (body.observations.windows(2))
                .map(|w| f64::midpoint(w[0].time_s, w[1].time_s))
                .filter(|t| *t > onset_s && *t < stop_s)
                .collect();
            let stride = moving.len().div_ceil(MAX_CANDIDATES).max(1);
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

    /// The residuals of a body's positions; `row` is advanced to the next body.
    pub(super) fn position_rows(&self, k: usize, row: &mut usize) -> Vec<PositionRow> {
        let body = &self.model.bodies[k];
        let mut rows = Vec::new();
        for (observation, &std_m) in
            body.observations.iter().zip(&self.model.stds_m[k]).filter(|(o, _)| !o.excluded)
        {
            rows.push(PositionRow { row: *row, time_s: observation.time_s, std_m });
            *row += if body.yaw_observed && observation.yaw_rad.is_some() { 2 } else { 1 };
        }
        rows
    }

    /// The time of the first event of a body after a time (s).
    pub(super) fn next_event_s(&self, k: usize, after_s: f64) -> f64 {
        self.timed_events()
            .filter(|(event, time_s)| event.members.contains(&k) && *time_s > after_s)
            .map(|(_, time_s)| time_s)
            .fold(f64::INFINITY, f64::min)
    }

    /// Its events, each with its fitted time (s).
    pub(crate) fn timed_events(&self) -> impl Iterator<Item = (&Event, f64)> {
        let times_s = self.layout.events.iter().map(|indices| self.minimum.parameters[indices.time]);
        self.model.events.iter().zip(times_s)
    }

    /// The outline of a body at a pose.
    pub(crate) fn placed(&self, body: usize, pose: Pose) -> PlacedShape<'_> {
        PlacedShape { shape: &self.model.bodies[body].shape, pose }
    }

    /// Model and parameters with an event added at a time, at which `body` jumps by `jump`, and the index of the event.
    fn inserted(&self, event: Event, time_s: f64, body: usize, jump: Vec2) -> (MotionModel, Vec<f64>, usize) {
        let at = self.events_before(time_s);
        let mut model = self.model.clone();
        model.events.insert(at, event);
        let layout = model.layout();
        let mut parameters = vec![0.0; layout.steps.len()];
        let old = &self.minimum.parameters;
        for (new, from) in layout.bodies.iter().zip(&self.layout.bodies) {
            let size = new.len().min(from.len());
            parameters[new.position..][..size].copy_from_slice(&old[from.position..][..size]);
            if let (Some(index), None) = (new.friction, from.friction) {
                parameters[index] = USUAL_FRICTION;
            }
        }
        // The parameters of the other events
        let kept = layout.events.iter().enumerate().filter(|(n, _)| *n != at).map(|(_, indices)| indices);
        for (new, from) in kept.zip(&self.layout.events) {
            let size = event_len(&layout, new);
            parameters[new.time..][..size].copy_from_slice(&old[from.time..][..size]);
        }
        // Those of the new one
        let indices = &layout.events[at];
        parameters[indices.time] = time_s;
        for (&member, &index) in model.events[at].members.iter().zip(&indices.velocities) {
            let motion = self.paths[member].motion(time_s);
            let velocity = motion.velocity + if member == body { jump } else { Vec2::ZERO };
            parameters[index] = velocity.x;
            parameters[index + 1] = velocity.y;
            if model.bodies[member].yaw_observed {
                parameters[index + 2] = motion.spin_rad_s;
            }
        }
        (model, parameters, at)
    }

    /// An event of a body: its time (s), the velocity jump of the body, and the standard deviation of a component of the jump (m/s).
    fn jump(&self, event: usize, body: usize) -> Option<(f64, f64, f64)> {
        let (members, indices) = (&self.model.events[event].members, &self.layout.events[event]);
        let index = indices.velocities[members.iter().position(|&m| m == body)?];
        let at_s = self.minimum.parameters[indices.time];
        let jump = self.paths[body].motion(at_s).velocity - self.paths[body].motion_before(at_s).velocity;
        let covariance = &self.minimum.covariance;
        let variance = f64::midpoint(covariance[(index, index)], covariance[(index + 1, index + 1)]);
        Some((at_s, jump.length(), variance.sqrt()))
    }

    /// The fit without outliers among the observed positions.
    fn without_outliers(self) -> Self {
        let scale = self.position_variance().sqrt();
        let mut model = self.model.clone();
        let mut row = 0;
        let mut excluded = 0;
        for (k, body) in model.bodies.iter_mut().enumerate() {
            let rows = self.position_rows(k, &mut row);
            let observations = body.observations.iter_mut().filter(|o| !o.excluded);
            for (observation, position) in observations.zip(rows) {
                let [x, y] = self.minimum.residuals[position.row].value;
                if x.hypot(y) > OUTLIER_STDS * scale {
                    observation.excluded = true;
                    excluded += 1;
                }
            }
        }
        if excluded == 0 {
            return self;
        }
        let (non_coulomb, remarks) = (self.non_coulomb, self.remarks);
        Self { non_coulomb, remarks, ..Self::run(model, self.minimum.parameters) }
    }

    /// The root mean square distance between the observations of moving bodies and the fit (m), without doubtful ones.
    pub(crate) fn residual_rms_m(&self) -> f64 {
        root_mean_square((0..self.model.bodies.len()).flat_map(|k| self.distances_m(k)))
    }

    /// The root mean square residual of one moving body along one axis (m), without doubtful observations.
    pub(crate) fn residual_rms_of_m(&self, k: usize) -> f64 {
        root_mean_square(self.distances_m(k)) / std::f64::consts::SQRT_2
    }

    /// The distance between each observation of a body, doubtful ones left out, and the fit while it moves (m).
    fn distances_m(&self, k: usize) -> impl Iterator<Item = f64> + '_ {
        let (body, path) = (&self.model.bodies[k], &self.paths[k]);
        let moving = path.onset_s()..path.stop_s();
        let observations = body
            .observations
            .iter()
            .filter(move |o| !o.excluded && !o.doubtful && moving.contains(&o.time_s));
        observations.map(|s| s.position.distance(path.motion(s.time_s).pose.position))
    }

    /// The values of functions of the parameters, and their covariance by linear propagation.
    pub(crate) fn propagated(&self, functions: impl Fn(&[f64]) -> Vec<f64>) -> (Vec<f64>, DMatrix<f64>) {
        let (values, slopes) = self.slopes(functions);
        let covariance = &slopes * &self.minimum.covariance * slopes.transpose();
        (values, covariance)
    }

    /// The values of functions of the parameters, and their derivatives by the parameters (central differences).
    pub(crate) fn slopes(&self, functions: impl Fn(&[f64]) -> Vec<f64>) -> (Vec<f64>, DMatrix<f64>) {
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
        (values, slopes)
    }
}

/// At most this many instants of a further impact are tried for each body.
const MAX_CANDIDATES: usize = 80;
/// The smallest accepted variance of the noise over the one that the track claims.
const MIN_VARIANCE: f64 = 0.04;

/// The root mean square; 0 without values.
fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (squares, count) = values.fold((0.0, 0.0), |(squares, count), v| (squares + v * v, count + 1.0));
    if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 }
}

/// The number of parameters of an event.
fn event_len(layout: &ParameterLayout, indices: &EventIndices) -> usize {
    let next = layout.events.iter().map(|e| e.time).filter(|t| *t > indices.time).min();
    next.unwrap_or(layout.steps.len()) - indices.time
}

/// The fit from the best of three initial frictions.
pub(super) fn best_start(mut guess: InitialGuess) -> MotionFit {
    guess.model.set_weights(&guess.layout, &guess.parameters);
    let starts = [1.0, 0.5, 2.0].map(|factor| {
        let mut parameters = guess.parameters.clone();
        for indices in &guess.layout.bodies {
            if let Some(index) = indices.friction {
                parameters[index] *= factor;
            }
        }
        minimum(parameters, &guess.layout.steps, COARSE, &MotionProblem::new(&guess.model, &guess.layout))
    });
    let best = starts.into_iter().min_by(|p, q| p.loss.total_cmp(&q.loss));
    MotionFit::run(guess.model, best.map_or(guess.parameters, |b| b.parameters))
}

/// Squared residuals of the moving bodies over the variances that the tracks claim.
fn noise(model: &MotionModel, minimum: &Minimum, paths: &[BodyPath]) -> NoiseStatistics {
    let mut noise = NoiseStatistics::default();
    let leverage = &minimum.jacobian * &minimum.covariance;
    let mut row = 0;
    for (body, path) in model.bodies.iter().zip(paths) {
        for observation in body.observations.iter().filter(|o| !o.excluded) {
            let moving = observation.time_s > path.onset_s() && observation.time_s < path.stop_s();
            let add = |row: usize, axes: usize, sum: &mut VarianceRatio| {
                let weight = minimum.weights[row];
                for axis in 0..axes {
                    let r = 2 * row + axis;
                    let used = leverage.row(r).dot(&minimum.jacobian.row(r)) * weight;
                    sum.squares += weight * minimum.residuals[row].value[axis].powi(2);
                    sum.freedom += (1.0 - used).max(0.0);
                }
            };
            let with_yaw = body.yaw_observed && observation.yaw_rad.is_some();
            if moving && body.observations.len() >= OBSERVATIONS_NEEDED {
                add(row, 2, &mut noise.position);
                if with_yaw {
                    add(row + 1, 1, &mut noise.yaw);
                }
            }
            row += if with_yaw { 2 } else { 1 };
        }
    }
    noise
}
