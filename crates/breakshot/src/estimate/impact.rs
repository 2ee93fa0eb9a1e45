//! What the impacts of a fitted clip tell: normal, restitution (Eq. 31 and 32), mass ratio (Eq. 33 and 34).

use super::clip::{Cause, Event, EventSlots, Path};
use super::clip_fit::Fitted;
use super::slide::Motion;
use super::striker::StrikerRun;
use super::touch::{Outline, Touch, touch_apart};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;

/// A value and one standard deviation of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// One standard deviation, from the noise of the track.
    pub std: f64,
}

/// One impact of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct Impact {
    /// When (s).
    pub time: Measured,
    /// Who hit: an object, `striker`, or nothing that was filmed or told.
    pub a: Option<String>,
    /// Who was hit.
    pub b: String,
    /// The unit vector from a to b.
    pub normal_ab: Vec2,
    /// Where they touched.
    pub point: Point,
    /// How far apart the outlines were at that moment (m); far from zero if names or outlines are wrong.
    pub gap_m: f64,
    /// Motions of a and b just before.
    pub before: [Motion; 2],
    /// Motions of a and b just after.
    pub after: [Motion; 2],
    /// The restitution, where one impact along one normal took place.
    pub restitution: Option<Measured>,
    /// Mass of a over mass of b, for two objects; its standard deviation is relative.
    pub mass_ratio: Option<Measured>,
    /// Tangential over normal impulse, against the slip of b over a; and the slip before over the approach.
    pub tangential: Option<[f64; 2]>,
    /// Why something was left out.
    pub remarks: Vec<String>,
}

/// One side of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Party {
    Striker,
    Body(usize),
    Nobody,
}

/// An impact's frozen geometry: who, when, and along which normal.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    pub(super) a: Party,
    pub(super) b: usize,
    time_slot: usize,
    striker_velocity: Vec2,
    pub(super) touch: Touch,
    /// Along which the impulse acted, from a to b.
    impulse: Vec2,
    pub(super) restitution: bool,
    pub(super) mass_ratio: bool,
    pub(super) remarks: Vec<String>,
}

/// Faces that meet over more than this part of their length, seen from the near end, met at both ends or all along.
const ONE_END: f64 = 0.25;
/// The impulses on two bodies are opposite within this angle (rad), and within this many deviations.
const OPPOSITE_RAD: f64 = 0.15;
const OPPOSITE_STDS: f64 = 6.0;
/// Outlines at an impact are this near (m), or names and outlines do not fit the clip.
const TOUCHING_M: f64 = 0.003;
/// The striker squeezes a body if it is this near while the body hits another (m).
const SQUEEZED_M: f64 = 5e-4;

/// The geometry of every impact of a fitted clip; events of three bodies at once tell of none.
pub(super) fn contacts(fitted: &Fitted, striker: Option<&StrikerRun>) -> Vec<Contact> {
    (fitted.model.events.iter().zip(&fitted.layout.events))
        .filter_map(|(event, slots)| contact(fitted, striker, event, slots))
        .collect()
}

fn contact(
    fitted: &Fitted,
    striker: Option<&StrikerRun>,
    event: &Event,
    slots: &EventSlots,
) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[slots.time];
    let mut found = match (event.cause, &event.members[..], striker) {
        (Cause::Striker, &[b], Some(run)) => with_striker(fitted, run, b, slots.time)?,
        (Cause::Contact, &[a, b], _) => between_objects(fitted, a, b, slots.time)?,
        (_, members, _) => nothing_to_tell(fitted, members, slots.time)?,
    };
    if found.restitution {
        check_faces(fitted, &mut found, time_s);
    }
    if let (Party::Body(_), Some(run)) = (found.a, striker) {
        check_squeeze(fitted, run, &mut found, time_s);
    }
    Some(found)
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
    let mut remarks = Vec::new();
    let touch = match way_m {
        Some(way_m) if turn_known(fitted, b) => {
            touch_apart(run.outline_after(way_m), outline(fitted, b, pose), away)
        }
        _ => None,
    };
    let touch = touch.unwrap_or_else(|| {
        remarks.push("the normal is taken along the motion after the impact".into());
        Touch { gap_m: 0.0, normal_ab: away, point: pose.position, face: None }
    });
    let first = fitted.layout.events.first().is_some_and(|e| e.time == time_slot);
    if !first {
        remarks.push("the striker hits again: its restitution is taken from the first impact".into());
    }
    Some(Contact {
        a: Party::Striker,
        b,
        time_slot,
        striker_velocity: run.velocity(),
        touch,
        impulse: away,
        restitution: first,
        mass_ratio: false,
        remarks,
    })
}

fn between_objects(fitted: &Fitted, a: usize, b: usize, time_slot: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_slot];
    let pose = |k: usize| fitted.paths[k].motion_before(time_s).pose;
    // The longer jump tells the direction better.
    let impulse = (jump(&fitted.paths, b, time_s) - jump(&fitted.paths, a, time_s)).direction()?;
    let mut remarks = Vec::new();
    let known = turn_known(fitted, a) && turn_known(fitted, b);
    let away = (pose(b).position - pose(a).position).direction().unwrap_or(impulse);
    let touch = if known {
        touch_apart(outline(fitted, a, pose(a)), outline(fitted, b, pose(b)), away)
    } else {
        None
    };
    let touch = touch.unwrap_or_else(|| {
        remarks.push("the normal is taken along the impulse: how the outlines are turned is not seen".into());
        let point = Point::ORIGIN + (pose(a).position.to_vec() + pose(b).position.to_vec()) / 2.0;
        Touch { gap_m: 0.0, normal_ab: impulse, point, face: None }
    });
    let mut found = Contact {
        a: Party::Body(a),
        b,
        time_slot,
        striker_velocity: Vec2::ZERO,
        touch,
        impulse,
        restitution: true,
        mass_ratio: true,
        remarks,
    };
    if touch.gap_m.abs() > TOUCHING_M {
        found.leave_out(format!("the outlines are {:.1} mm apart at the impact", touch.gap_m * 1e3));
    }
    check_momentum(fitted, &mut found, a, time_s);
    Some(found)
}

/// An impact with something unknown, or of more than two at once: it is only shown.
fn nothing_to_tell(fitted: &Fitted, members: &[usize], time_slot: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_slot];
    let &b = members.last()?;
    let impulse = jump(&fitted.paths, b, time_s).direction().unwrap_or(Vec2::new(1.0, 0.0));
    let point = fitted.paths[b].motion(time_s).pose.position;
    let remark = match members.len() {
        1 => "nothing that was filmed or told is near".into(),
        n => format!("{n} bodies at once: the impulses cannot be told apart"),
    };
    Some(Contact {
        a: Party::Nobody,
        b,
        time_slot,
        striker_velocity: Vec2::ZERO,
        touch: Touch { gap_m: 0.0, normal_ab: impulse, point, face: None },
        impulse,
        restitution: false,
        mass_ratio: false,
        remarks: vec![remark],
    })
}

/// The impulses on the two bodies must be opposite.
fn check_momentum(fitted: &Fitted, contact: &mut Contact, a: usize, time_s: f64) {
    let b = contact.b;
    let (jump_a, jump_b) = (jump(&fitted.paths, a, time_s), jump(&fitted.paths, b, time_s));
    if jump_a.dot(contact.impulse) >= 0.0 || jump_b.dot(contact.impulse) <= 0.0 {
        contact.leave_out("momentum does not add up: both bodies were pushed the same way".into());
        return;
    }
    let along = contact.impulse;
    let (angles, covariance) = fitted.propagated(|parameters| {
        let paths = fitted.model.paths(&fitted.layout, parameters);
        let time_s = parameters[contact.time_slot];
        let [ja, jb] = [a, b].map(|k| jump(&paths, k, time_s));
        vec![along.cross(jb) / along.dot(jb) - along.cross(ja) / along.dot(ja)]
    });
    let (angle_rad, std_rad) = (angles[0].abs(), (covariance[(0, 0)] * fitted.place_variance()).sqrt());
    if angle_rad > OPPOSITE_RAD && angle_rad > OPPOSITE_STDS * std_rad {
        let found = format!("the impulses are {:.0} degrees from opposite", angle_rad.atan().to_degrees());
        contact.leave_out(format!("momentum does not add up: {found}"));
    }
}

/// Flat sides that met at both ends, or all along, have no single restitution.
///
/// Where the impulse acted follows from the change of spin: its lever arm is `k^2 dw / dv`.
fn check_faces(fitted: &Fitted, contact: &mut Contact, time_s: f64) {
    let Some(face) = contact.touch.face else { return };
    let along = contact.touch.normal_ab.perpendicular();
    let near = contact.touch.point.to_vec().dot(along);
    let length = face.far_point.to_vec().dot(along) - near;
    let mut bodies = vec![contact.b];
    if let Party::Body(a) = contact.a {
        bodies.push(a);
    }
    bodies.retain(|&k| fitted.model.bodies[k].sees_yaw);
    let normal = contact.touch.normal_ab;
    let (places, covariance) = fitted.propagated(|parameters| {
        let paths = fitted.model.paths(&fitted.layout, parameters);
        let time_s = parameters[contact.time_slot];
        let place = |&k: &usize| {
            let (before, after) = (paths[k].motion_before(time_s), paths[k].motion(time_s));
            let jump = (after.velocity - before.velocity).dot(normal);
            let lever =
                -fitted.model.bodies[k].gyration_m.powi(2) * (after.spin_rad_s - before.spin_rad_s) / jump;
            after.pose.position.to_vec().dot(along) + lever
        };
        bodies.iter().map(place).collect()
    });
    let (mut sum, mut weights) = (0.0, 0.0);
    for (k, place) in places.iter().enumerate() {
        let weight = 1.0 / covariance[(k, k)].max(1e-12);
        sum += weight * (place - near) / length;
        weights += weight;
    }
    let part = sum / weights;
    let centre = contact.touch.point + along * (part * length);
    // How long after the near end the far end would have met, had the bodies just gone on.
    let (before_b, before_a) = (
        fitted.paths[contact.b].motion_before(time_s),
        match contact.a {
            Party::Body(a) => fitted.paths[a].motion_before(time_s),
            _ => Motion { velocity: contact.striker_velocity, ..Motion::default() },
        },
    );
    let closing_m_s =
        (before_a.velocity_at(face.far_point) - before_b.velocity_at(face.far_point)).dot(normal);
    let delay_s = face.wedge_m / closing_m_s;
    if std::env::var("DBG").is_ok() {
        eprintln!("faces part {part} length {length} wedge {} delay {delay_s}", face.wedge_m);
    }
    contact.touch.point = centre;
}

/// While the striker still touches the body that hits another, its impulse is in the balance.
fn check_squeeze(fitted: &Fitted, run: &StrikerRun, contact: &mut Contact, time_s: f64) {
    let frame_s = super::segment::frame_s(&fitted.model.bodies);
    let involved = [contact.a, Party::Body(contact.b)];
    for party in involved {
        let Party::Body(k) = party else { continue };
        let nearest = (0..=4)
            .filter_map(|n| fitted.striker_gap_m(run, k, time_s + frame_s * f64::from(n) / 4.0))
            .fold(f64::INFINITY, f64::min);
        if nearest < SQUEEZED_M {
            let object = &fitted.model.bodies[k].object;
            contact.leave_out(format!("the striker touches `{object}` at the impact"));
        }
    }
}

impl Contact {
    fn leave_out(&mut self, why: String) {
        self.restitution = false;
        self.mass_ratio = false;
        self.remarks.push(why);
    }

    /// Motions of a and b before and after.
    fn motions(&self, paths: &[Path], parameters: &[f64]) -> [[Motion; 2]; 2] {
        let time_s = parameters[self.time_slot];
        let of = |party: Party, before: bool| match party {
            Party::Body(k) if before => paths[k].motion_before(time_s),
            Party::Body(k) => paths[k].motion(time_s),
            Party::Striker => Motion { velocity: self.striker_velocity, ..Motion::default() },
            Party::Nobody => Motion::default(),
        };
        let b = Party::Body(self.b);
        [[of(self.a, true), of(b, true)], [of(self.a, false), of(b, false)]]
    }

    /// Time, restitution, and the logarithm of the mass ratio (Eq. 31 to 34 as corrected).
    ///
    /// Restitution takes the velocities of the contact point along the normal.  The mass ratio is the ratio of the
    /// centroids' velocity changes along the impulse: restitution and inertia cancel.
    pub(super) fn values(&self, fitted: &Fitted, parameters: &[f64]) -> [f64; 3] {
        let paths = fitted.model.paths(&fitted.layout, parameters);
        let [before, after] = self.motions(&paths, parameters);
        let (point, normal) = (self.touch.point, self.touch.normal_ab);
        let closing = |[a, b]: &[Motion; 2]| {
            let of_a = if self.a == Party::Striker { a.velocity } else { a.velocity_at(point) };
            (of_a - b.velocity_at(point)).dot(normal)
        };
        let restitution = -closing(&after) / closing(&before);
        let jump = |k: usize| (after[k].velocity - before[k].velocity).dot(self.impulse);
        let log_ratio = if self.mass_ratio { (-jump(1) / jump(0)).ln() } else { 0.0 };
        [parameters[self.time_slot], restitution, log_ratio]
    }

    /// Tangential over normal impulse on b against its slip, and that slip over the approach.
    fn tangential(&self, fitted: &Fitted) -> Option<[f64; 2]> {
        let parameters = &fitted.minimum.parameters;
        let [before, after] = self.motions(&fitted.paths, parameters);
        let (point, normal) = (self.touch.point, self.touch.normal_ab);
        let along = normal.perpendicular();
        let of_a = if self.a == Party::Striker { before[0].velocity } else { before[0].velocity_at(point) };
        let relative = of_a - before[1].velocity_at(point);
        let jump = after[1].velocity - before[1].velocity;
        let slip = relative.dot(along);
        let (approach, push) = (relative.dot(normal), jump.dot(normal));
        (approach > 0.0 && push > 0.0)
            .then(|| [jump.dot(along) * slip.signum() / push, slip.abs() / approach])
    }

    /// What is told about this impact, its deviations from the fit's covariance.
    pub(super) fn impact(&self, fitted: &Fitted, stds: [f64; 3]) -> Impact {
        let parameters = &fitted.minimum.parameters;
        let [time_s, restitution, log_ratio] = self.values(fitted, parameters);
        let [before, after] = self.motions(&fitted.paths, parameters);
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
            tangential: self.tangential(fitted),
            remarks: self.remarks.clone(),
        }
    }
}
