//! Who touched whom at each impact of a fitted clip: normal, point, and what the impact can tell.

use super::{impulse_ratio, restitution};
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::initial_guess::frame_s;
use crate::estimate::clip::motion_model::{Cause, Event, Path};
use crate::estimate::clip::result::{Impact, Measured};
use crate::estimate::clip::sliding::Motion;
use crate::estimate::clip::striker_path::StrikerRun;
use crate::estimate::closest_points::{Outline, Touch, touch_apart};
use crate::geometry::{Pose, Vec2};
use crate::object::Shape;

/// One side of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Party {
    Striker,
    Body(usize),
    Nobody,
}

/// An impact's geometry, frozen at the fitted motion.
#[allow(clippy::struct_excessive_bools)] // each answers a question of its own
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) a: Party,
    pub(crate) b: usize,
    /// Where its instant stands in the fit's parameters.
    pub(crate) time_slot: usize,
    pub(crate) striker_velocity: Vec2,
    pub(crate) touch: Touch,
    /// Whether the normal follows from the outlines, not from the impulse.
    pub(crate) normal_seen: bool,
    /// The direction in which b was pushed.
    pub(crate) impulse: Vec2,
    /// Whether it tells a restitution.
    pub(crate) restitution: bool,
    /// Whether flat sides met at both ends one after the other: then its restitution is a poor one.
    pub(crate) met_twice: bool,
    /// Whether it tells a mass ratio.
    pub(crate) mass_ratio: bool,
    pub(crate) remarks: Vec<String>,
}

/// The motions of a and b around an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    pub(crate) before: [Motion; 2],
    pub(crate) after: [Motion; 2],
}

/// Outlines at an impact are this near (m), or names and outlines do not fit the clip.
const TOUCHING_M: f64 = 0.003;
/// The striker squeezes a body if it is this near while the body hits another (m).
const SQUEEZED_M: f64 = 5e-4;

impl Around {
    /// How the velocity of each body's centroid changed.
    pub(crate) fn jump(&self, side: usize) -> Vec2 {
        self.after[side].velocity - self.before[side].velocity
    }

    /// The velocity of a's contact point against b's, before and after.
    ///
    /// The striker does not turn: its every point moves alike.
    pub(crate) fn relative_at(&self, contact: &Contact) -> [Vec2; 2] {
        let point = contact.touch.point;
        [&self.before, &self.after].map(|[a, b]| {
            let of_a = if contact.a == Party::Striker { a.velocity } else { a.velocity_at(point) };
            of_a - b.velocity_at(point)
        })
    }
}

/// All impacts of a fitted clip.
pub(crate) fn contacts(fitted: &Fitted, striker: Option<&StrikerRun>) -> Vec<Contact> {
    (fitted.model.events.iter().zip(&fitted.layout.events))
        .filter_map(|(event, slots)| contact(fitted, striker, event, slots.time))
        .collect()
}

fn contact(
    fitted: &Fitted,
    striker: Option<&StrikerRun>,
    event: &Event,
    time_slot: usize,
) -> Option<Contact> {
    match (event.cause, &event.members[..], striker) {
        (Cause::Striker, &[b], Some(run)) => with_striker(fitted, run, b, time_slot),
        (Cause::Contact, &[a, b], _) => between_objects(fitted, striker, [a, b], time_slot),
        (_, members, _) => nothing_to_tell(fitted, members, time_slot),
    }
}

fn outline(fitted: &Fitted, k: usize, pose: Pose) -> Outline<'_> {
    Outline { shape: &fitted.model.bodies[k].shape, pose }
}

/// Whether the outline's turn is known, or does not matter.
fn turn_known(fitted: &Fitted, k: usize) -> bool {
    let body = &fitted.model.bodies[k];
    body.sees_yaw || matches!(body.shape, Shape::Disc { .. })
}

fn jump(paths: &[Path], k: usize, time_s: f64) -> Vec2 {
    paths[k].motion(time_s).velocity - paths[k].motion_before(time_s).velocity
}

fn with_striker(fitted: &Fitted, run: &StrikerRun, b: usize, time_slot: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_slot];
    let pose = fitted.paths[b].motion_before(time_s).pose;
    let away = jump(&fitted.paths, b, time_s).direction()?;
    let way_m = run.way_to_m(outline(fitted, b, pose));
    let seen = match way_m {
        Some(way_m) if turn_known(fitted, b) => {
            touch_apart(run.outline_after(way_m), outline(fitted, b, pose), away)
        }
        _ => None,
    };
    let assumed = Touch { gap_m: 0.0, normal_ab: away, point: pose.position, face: None };
    let first = fitted.layout.events.first().is_some_and(|e| e.time == time_slot);
    let mut found = Contact {
        a: Party::Striker,
        b,
        time_slot,
        striker_velocity: run.velocity(),
        touch: seen.unwrap_or(assumed),
        normal_seen: seen.is_some(),
        impulse: away,
        restitution: first,
        met_twice: false,
        mass_ratio: false,
        remarks: Vec::new(),
    };
    let object = &fitted.model.bodies[b].object;
    match way_m {
        // Where it stands by then is not known well enough to tell its velocity.
        _ if !first => {
            found.remarks.push(format!("the striker hits `{object}` again: it tells no restitution"));
        }
        None => found.leave_out(format!("the strike as told passes `{object}` by or stops short of it")),
        Some(_) if seen.is_none() => {
            found
                .remarks
                .push(format!("how `{object}` is turned is not seen: the normal is taken along its motion"));
        }
        Some(_) => restitution::check_faces(fitted, &mut found),
    }
    Some(found)
}

fn between_objects(
    fitted: &Fitted,
    striker: Option<&StrikerRun>,
    [a, b]: [usize; 2],
    time_slot: usize,
) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_slot];
    let pose = |k: usize| fitted.paths[k].motion_before(time_s).pose;
    // The longer jump tells the direction better.
    let impulse = (jump(&fitted.paths, b, time_s) - jump(&fitted.paths, a, time_s)).direction()?;
    let between = pose(b).position - pose(a).position;
    let known = turn_known(fitted, a) && turn_known(fitted, b);
    let away = between.direction().unwrap_or(impulse);
    let [own, other] = [a, b].map(|k| outline(fitted, k, pose(k)));
    let seen = if known { touch_apart(own, other, away) } else { None };
    let middle = pose(a).position + between / 2.0;
    let assumed = Touch { gap_m: 0.0, normal_ab: impulse, point: middle, face: None };
    let mut found = Contact {
        a: Party::Body(a),
        b,
        time_slot,
        striker_velocity: Vec2::ZERO,
        touch: seen.unwrap_or(assumed),
        normal_seen: seen.is_some(),
        impulse,
        restitution: true,
        met_twice: false,
        mass_ratio: true,
        remarks: Vec::new(),
    };
    match seen {
        None => found
            .remarks
            .push("how the outlines are turned is not seen: the normal is taken along the impulse".into()),
        Some(touch) if touch.gap_m.abs() > TOUCHING_M => {
            found.leave_out(format!("the outlines are {:.1} mm apart at the impact", touch.gap_m * 1e3));
        }
        Some(_) => restitution::check_faces(fitted, &mut found),
    }
    impulse_ratio::check_momentum(fitted, &mut found, a);
    if let Some(run) = striker {
        check_squeeze(fitted, run, &mut found, time_s);
    }
    Some(found)
}

/// An impact with something unknown, or of more than two at once: it is only shown.
fn nothing_to_tell(fitted: &Fitted, members: &[usize], time_slot: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_slot];
    let &b = members.last()?;
    let impulse = jump(&fitted.paths, b, time_s).direction().unwrap_or(Vec2::new(1.0, 0.0));
    let point = fitted.paths[b].motion(time_s).pose.position;
    let names: Vec<String> =
        members.iter().map(|&k| format!("`{}`", fitted.model.bodies[k].object)).collect();
    let remark = match names.as_slice() {
        [only] => format!("at {time_s:.3} s {only} is hit by nothing that was filmed or told"),
        _ => format!("{} are hit at once: their impulses cannot be told apart", names.join(" and ")),
    };
    Some(Contact {
        a: Party::Nobody,
        b,
        time_slot,
        striker_velocity: Vec2::ZERO,
        touch: Touch { gap_m: 0.0, normal_ab: impulse, point, face: None },
        normal_seen: false,
        impulse,
        restitution: false,
        met_twice: false,
        mass_ratio: false,
        remarks: vec![remark],
    })
}

/// While the striker still touches a body that hits another, its impulse is in the balance.
fn check_squeeze(fitted: &Fitted, run: &StrikerRun, contact: &mut Contact, time_s: f64) {
    /// A second hit so soon that no sight lies between would be taken for part of the impact.
    const UNSEEN_FRAMES: f64 = 1.0;
    let frame_s = frame_s(&fitted.model.bodies);
    for party in [contact.a, Party::Body(contact.b)] {
        let Party::Body(k) = party else { continue };
        let nearest = (0..=4)
            .filter_map(|n| {
                let later_s = UNSEEN_FRAMES * frame_s * f64::from(n) / 4.0;
                fitted.striker_gap_m(run, k, time_s + later_s)
            })
            .fold(f64::INFINITY, f64::min);
        if nearest < SQUEEZED_M {
            let object = &fitted.model.bodies[k].object;
            contact.leave_out(format!("the striker touches `{object}` at the impact"));
        }
    }
}

impl Contact {
    /// It tells neither restitution nor mass ratio, for this reason.
    pub(crate) fn leave_out(&mut self, why: String) {
        self.restitution = false;
        self.mass_ratio = false;
        self.remarks.push(why);
    }

    /// The motions around the impact for these parameters.
    pub(crate) fn around(&self, fitted: &Fitted, parameters: &[f64]) -> Around {
        let paths = fitted.model.paths(&fitted.layout, parameters);
        let time_s = parameters[self.time_slot];
        let of = |party: Party, before: bool| match party {
            Party::Body(k) if before => paths[k].motion_before(time_s),
            Party::Body(k) => paths[k].motion(time_s),
            Party::Striker => Motion { velocity: self.striker_velocity, ..Motion::default() },
            Party::Nobody => Motion::default(),
        };
        let [a, b] = [self.a, Party::Body(self.b)];
        Around { before: [of(a, true), of(b, true)], after: [of(a, false), of(b, false)] }
    }

    /// Time, restitution, and the logarithm of the mass ratio.
    pub(crate) fn values(&self, fitted: &Fitted, parameters: &[f64]) -> [f64; 3] {
        let around = self.around(fitted, parameters);
        let log_ratio = if self.mass_ratio { impulse_ratio::log_ratio(self, &around) } else { 0.0 };
        [parameters[self.time_slot], restitution::restitution(self, &around), log_ratio]
    }

    /// What is told about this impact; the deviations are those of [`Contact::values`].
    pub(crate) fn impact(&self, fitted: &Fitted, stds: [f64; 3]) -> Impact {
        let parameters = &fitted.minimum.parameters;
        let [time_s, restitution, log_ratio] = self.values(fitted, parameters);
        let Around { before, after } = self.around(fitted, parameters);
        let name = |k: usize| fitted.model.bodies[k].object.clone();
        Impact {
            time: Measured { value: time_s, std: stds[0] },
            a: match self.a {
                Party::Striker => Some("striker".into()),
                Party::Body(k) => Some(name(k)),
                Party::Nobody => None,
            },
            b: name(self.b),
            normal_ab: self.touch.normal_ab,
            point: self.touch.point,
            gap_m: self.touch.gap_m,
            before,
            after,
            restitution: self.restitution.then_some(Measured { value: restitution, std: stds[1] }),
            mass_ratio: self.mass_ratio.then(|| Measured { value: log_ratio.exp(), std: stds[2] }),
            remarks: self.remarks.clone(),
        }
    }
}
