//! Clips that could be filmed next, and what each would tell: the clip fit's own sensitivity at the learned noise.

use super::experiment::Shot;
use super::prior::{Belief, Parameter};
use super::sensitivity::fastest_m_s;
use super::simulated_clip::Filming;
use crate::cell::Cell;
use crate::error::Result;
use crate::estimate::clip::ClipEstimate;
use crate::estimate::clip::exposure;
use crate::estimate::joint::random_effects::{Group, spread};
use crate::estimate::measure::measurements::{Measurements, grouped};
use crate::estimate::measure::quantity::{KINDS, Quantity};
use crate::estimate::measure::restitution::DOUBLE_CONTACT_STD;
use crate::estimate::measure::{self, ClipMeasurements};
use crate::object::{Object, kind};
use crate::statistics::median;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A shot and what its film tells: measurements are `rows` times the quantities, plus noise.
pub(crate) struct Candidate {
    pub(crate) shot: Shot,
    rows: DMatrix<f64>,
    noise: DMatrix<f64>,
}

/// What the earlier clips teach of a camera and of how much quantities vary from clip to clip.
pub(crate) struct Habits {
    pub(crate) filming: Filming,
    exposure_frames: Option<f64>,
    /// By kind of reading, relative.
    spreads: [f64; KINDS],
}

/// Parts of the speed at which the struck object stays in its half of the workspace.
const SPEED_PARTS: [f64; 2] = [0.6, 1.0];
/// Off-centre shots have this part of both outer radii as offset, at full speed.
const OFFSET_PART: f64 = 0.5;
/// From clip to clip quantities vary by this much where no repeats tell (relative).
const ASSUMED_SPREAD: f64 = 0.03;
/// A pair's mass ratio is off by about this part whatever its clips agree on (see `joint`).
const MASS_STD: f64 = 0.005;
/// Contact points surely slide if it would take this many times the friction to stop them.
const SURELY_SLID: f64 = 1.3;
/// Contact friction is only given from several impacts that agree: each by itself tells it no better.
const ONE_GRAZING_STD: f64 = 0.05;

impl Habits {
    pub(crate) fn new(records: &[ClipMeasurements]) -> Self {
        let seen = || records.iter().map(|r| &r.recording);
        let filming = Filming {
            frame_rate_hz: 1.0 / median(seen().map(|s| s.frame_s)).unwrap_or(0.0).max(1e-4),
            place_std_m: median(seen().map(|s| s.position_std_m)).unwrap_or(0.0).max(1e-7),
            yaw_std_rad: median(seen().map(|s| s.yaw_std_rad)).unwrap_or(0.0),
            seed: None,
        };
        let chi2_by_exposure: Vec<_> = records.iter().map(|r| r.chi2_by_exposure).collect();
        let measurements: Vec<Measurements> = records.iter().map(|r| r.measurements.clone()).collect();
        let mut spreads = [ASSUMED_SPREAD; KINDS];
        for (kind, relative) in spreads.iter_mut().enumerate() {
            let groups: Vec<Group> = grouped(&measurements)
                .iter()
                .filter(|(key, _)| key.kind() == kind)
                .map(|(key, places)| Group::of(&measurements, key, places))
                .collect();
            let found = spread(&groups);
            if found.freedom > 0.0 {
                *relative = found.relative;
            }
        }
        Self { filming, exposure_frames: exposure::best_frames(&chi2_by_exposure), spreads }
    }
}

/// All shots whose objects stay in the workspace: every object alone, and into every other one (and a copy of itself, for
/// kinds in `copies`), slow and fast, central and off centre.
pub(crate) fn shots(
    belief: &Belief,
    cell: &Cell,
    objects: &[Object],
    copies: &BTreeSet<String>,
) -> Vec<Shot> {
    let mut all = Vec::new();
    for object in objects {
        let fastest = fastest_m_s(belief, cell, &object.name);
        let shot = |into: Option<String>, part: f64, offset_m: f64| {
            // To a millimetre per second and a tenth of a millimetre: what a robot and a ruler can do.
            let speed_m_s = (fastest * part * 1e3).round() / 1e3;
            Shot { strike: object.name.clone(), into, speed_m_s, offset_m: (offset_m * 1e4).round() / 1e4 }
        };
        let others = objects.iter().filter(|o| o.name != object.name || copies.contains(&o.name));
        let names = others
            .map(|o| if o.name == object.name { (format!("{}#2", o.name), o) } else { (o.name.clone(), o) });
        all.extend(SPEED_PARTS.map(|part| shot(None, part, 0.0)));
        for (name, other) in names {
            all.extend(SPEED_PARTS.map(|part| shot(Some(name.clone()), part, 0.0)));
            let reach_m = object.shape.outer_radius_m() + other.shape.outer_radius_m();
            all.push(shot(Some(name), 1.0, OFFSET_PART * reach_m));
        }
    }
    all
}

/// What each shot would tell; shots that leave the workspace or tell nothing are left out.
pub(crate) fn candidates(
    belief: &Belief,
    (cell, objects): (&Cell, &[Object]),
    habits: &Habits,
    shots: Vec<Shot>,
) -> Vec<Candidate> {
    let candidate = |shot: Shot| Candidate::new(belief, (cell, objects), habits, shot).ok().flatten();
    shots.into_par_iter().filter_map(candidate).collect()
}

impl Candidate {
    fn new(
        belief: &Belief,
        (cell, objects): (&Cell, &[Object]),
        habits: &Habits,
        shot: Shot,
    ) -> Result<Option<Self>> {
        let clip = shot.staged("advice", (cell, objects), &belief.properties, &habits.filming)?;
        let rests = clip.tracks.tracks.iter().filter_map(|t| t.samples.last());
        if !rests.into_iter().all(|s| cell.workspace.contains(s.position())) {
            return Ok(None);
        }
        let story = ClipEstimate::new(&clip, cell, objects)?;
        let yaw_scale = habits.filming.yaw_std_rad / story.yaw_std_rad();
        let scale = if yaw_scale > 0.0 { yaw_scale } else { 1.0 };
        let record = measure::measured(&story.refitted(1.0, scale, habits.exposure_frames), &clip).1;
        Ok(Self::from_record(belief, habits, shot, &record))
    }

    fn from_record(belief: &Belief, habits: &Habits, shot: Shot, record: &ClipMeasurements) -> Option<Self> {
        let measurements = &record.measurements;
        let told: Vec<(usize, Vec<(usize, f64)>)> = (measurements.quantities.iter().enumerate())
            .map(|(k, key)| (k, belief.row(key)))
            .filter(|(_, row)| !row.is_empty())
            .collect();
        let oblique_impacts = record.oblique_impacts.iter().filter_map(|g| {
            let quantity =
                if g.with_striker { Parameter::StrikerContactFriction } else { Parameter::ContactFriction };
            let contact = &belief.properties.contact_friction;
            let friction = if g.with_striker { contact.striker } else { contact.objects }?.mean;
            let slides = g.sticking_ratio > SURELY_SLID * friction;
            let place = belief.quantities.iter().position(|q| *q == quantity)?;
            slides.then_some((place, g.impulse_ratio.std))
        });
        let oblique_impacts: Vec<(usize, f64)> = oblique_impacts.collect();
        let size = told.len() + oblique_impacts.len();
        let mut rows = DMatrix::zeros(size, belief.quantities.len());
        let mut noise = DMatrix::zeros(size, size);
        for (r, (k, row)) in told.iter().enumerate() {
            for &(column, factor) in row {
                rows[(r, column)] += factor;
            }
            for (c, (l, _)) in told.iter().enumerate() {
                noise[(r, c)] = measurements.covariance[(*k, *l)];
            }
            noise[(r, r)] += habits.variance(&measurements.quantities[*k], measurements.values[*k]);
            if measurements.double_contact[*k] {
                noise[(r, r)] += DOUBLE_CONTACT_STD.powi(2);
            }
        }
        for (n, (place, std)) in oblique_impacts.iter().enumerate() {
            rows[(told.len() + n, *place)] = 1.0;
            noise[(told.len() + n, told.len() + n)] = std * std + ONE_GRAZING_STD.powi(2);
        }
        (size > 0).then_some(Self { shot, rows, noise })
    }

    /// The covariance after this clip was filmed too (the update of a Kalman filter).
    pub(crate) fn after(&self, covariance: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let cross = &self.rows * covariance;
        let factor = (&cross * self.rows.transpose() + &self.noise).cholesky()?;
        let less = cross.tr_mul(&factor.solve(&cross));
        let after = covariance - less;
        Some((&after + after.transpose()) * 0.5)
    }
}

impl Habits {
    /// How much one clip's quantity differs from the mean of all clips, beyond the noise of its track (variance).
    fn variance(&self, key: &Quantity, value: f64) -> f64 {
        let relative = self.spreads[key.kind()];
        match key {
            Quantity::MassRatio(..) => relative.powi(2) + MASS_STD.powi(2),
            _ => (relative * value).powi(2),
        }
    }
}

/// Kinds of which a second copy was filmed or lies in a scene.
pub(crate) fn copies<'a>(names: impl Iterator<Item = &'a str>) -> BTreeSet<String> {
    names.filter(|name| name.contains('#')).map(|name| kind(name).to_owned()).collect()
}
