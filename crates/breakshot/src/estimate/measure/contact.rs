//! The geometry of each impact of a fitted clip: partners, contact normal and contact point.

use crate::estimate::clip::consistency::MAX_GAP_M;
use crate::estimate::clip::fit::MotionFit;
use crate::estimate::clip::motion_model::{BodyPath, Cause, Event};
use crate::estimate::clip::sliding::MotionState;
use crate::estimate::clip::striker::path::StrikerPath;
use crate::estimate::closest_points::{ClosestPoints, separated_closest_points};
use crate::geometry::Vec2;
use crate::object::Shape;

/// The accuracy of the distance of two outlines, by ruler and camera (m): a body nearer to a partner of an impact may have been touched by it,
/// and outlines that overlap by more at an impact met before it.
pub(crate) const OUTLINE_ACCURACY_M: f64 = 0.0015;

/// A partner of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Partner {
    Striker,
    /// The body of this index.
    Body(usize),
    /// Something that was neither filmed nor specified, or several bodies at once.
    Unknown,
}

/// An impact's geometry, held constant at the fitted motion while errors are propagated.
#[allow(clippy::struct_excessive_bools)] // each is a property of its own
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) a: Partner,
    /// The index of body b.
    pub(crate) b: usize,
    /// The index of its time among the parameters of the fit.
    pub(crate) time_index: usize,
    /// The striker's prescribed velocity if a is the striker.
    pub(crate) striker_velocity: Vec2,
    /// The striker's distance from its start (m) if this is its first impact and the given strike reaches the body.
    pub(crate) striker_distance_m: Option<f64>,
    pub(crate) closest: ClosestPoints,
    /// Whether the normal follows from the outlines; else it is the direction of the impulse.
    pub(crate) normal_from_outlines: bool,
    /// The direction of the impulse on b.
    pub(crate) impulse_direction: Vec2,
    /// Whether it measures a restitution.
    pub(crate) restitution: bool,
    /// Whether the bodies met more than once in it, as flat sides at one end and then at the other, which makes the restitution inaccurate.
    pub(crate) is_double: bool,
    /// Whether it measures a mass ratio.
    pub(crate) mass_ratio: bool,
    /// Warnings for the user.
    pub(crate) remarks: Vec<String>,
}

/// The motions of a and b just before and just after an impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionsAtImpact {
    pub(crate) before: [MotionState; 2],
    pub(crate) after: [MotionState; 2],
}

impl Contact {
    /// Measures neither restitution nor mass ratio, for this reason.
    pub(crate) fn exclude(&mut self, reason: String) {
        self.restitution = false;
        self.mass_ratio = false;
        self.remarks.push(reason);
    }

    /// The time of the impact in the fit (s).
    pub(crate) fn time_s(&self, fitted: &MotionFit) -> f64 {
        fitted.minimum.parameters[self.time_index]
    }

    /// The motions at the impact for these parameters of the fit.
    pub(crate) fn motions(&self, fitted: &MotionFit, parameters: &[f64]) -> MotionsAtImpact {
        let paths = fitted.model.paths(&fitted.layout, parameters);
        let time_s = parameters[self.time_index];
        let of = |partner: Partner, before: bool| match partner {
            Partner::Body(k) if before => paths[k].motion_before(time_s),
            Partner::Body(k) => paths[k].motion(time_s),
            Partner::Striker => MotionState { velocity: self.striker_velocity, ..MotionState::default() },
            Partner::Unknown => MotionState::default(),
        };
        let [a, b] = [self.a, Partner::Body(self.b)];
        MotionsAtImpact { before: [of(a, true), of(b, true)], after: [of(a, false), of(b, false)] }
    }

    /// The velocity of a's contact point relative to b's, before and after the impact.
    ///
    /// The striker does not rotate: all its points have the same velocity.
    pub(crate) fn relative_velocities(&self, motions: &MotionsAtImpact) -> [Vec2; 2] {
        let point = self.closest.point;
        [&motions.before, &motions.after].map(|[a, b]| {
            let of_a = if self.a == Partner::Striker { a.velocity } else { a.velocity_at(point) };
            of_a - b.velocity_at(point)
        })
    }
}

impl MotionsAtImpact {
    /// The change of the velocity of the centroid of a (0) or b (1).
    pub(crate) fn velocity_change(&self, side: usize) -> Vec2 {
        self.after[side].velocity - self.before[side].velocity
    }
}

/// The contacts of all impacts of a fitted clip, in order of time.
pub(crate) fn contacts(fitted: &MotionFit, striker: Option<&StrikerPath>) -> Vec<Contact> {
    (fitted.model.events.iter().zip(&fitted.layout.events))
        .filter_map(|(event, indices)| contact(fitted, striker, event, indices.time))
        .collect()
}

fn contact(
    fitted: &MotionFit,
    striker: Option<&StrikerPath>,
    event: &Event,
    time_index: usize,
) -> Option<Contact> {
    match (event.cause, &event.members[..], striker) {
        (Cause::Striker, &[b], Some(striker)) => with_striker(fitted, striker, b, time_index),
        (Cause::Contact, &[a, b], _) => between_objects(fitted, [a, b], time_index),
        (_, members, _) => without_pair(fitted, members, time_index),
    }
}

/// Whether the yaw of a body is observed, or its outline does not depend on it.
fn orientation_known(fitted: &MotionFit, k: usize) -> bool {
    let body = &fitted.model.bodies[k];
    body.yaw_observed || matches!(body.shape, Shape::Disc { .. })
}

fn velocity_change(paths: &[BodyPath], k: usize, time_s: f64) -> Vec2 {
    paths[k].motion(time_s).velocity - paths[k].motion_before(time_s).velocity
}

fn with_striker(fitted: &MotionFit, striker: &StrikerPath, b: usize, time_index: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_index];
    let pose = fitted.paths[b].motion_before(time_s).pose;
    let away = velocity_change(&fitted.paths, b, time_s).direction()?;
    let distance_m = striker.distance_to_contact_m(fitted.placed(b, pose));
    let from_outlines = match distance_m {
        Some(distance_m) if orientation_known(fitted, b) => {
            separated_closest_points(striker.outline_at(distance_m), fitted.placed(b, pose), away)
        }
        _ => None,
    };
    let assumed = ClosestPoints { gap_m: 0.0, normal_ab: away, point: pose.position, facing_sides: None };
    let first = fitted.layout.events.first().is_some_and(|e| e.time == time_index);
    let mut contact = Contact {
        a: Partner::Striker,
        b,
        time_index,
        striker_velocity: striker.velocity(),
        striker_distance_m: distance_m.filter(|_| first),
        closest: from_outlines.unwrap_or(assumed),
        normal_from_outlines: from_outlines.is_some(),
        impulse_direction: away,
        restitution: first,
        is_double: false,
        mass_ratio: false,
        remarks: Vec::new(),
    };
    let object = &fitted.model.bodies[b].object;
    if !first {
        // The striker's position, and so its velocity, is not known accurately by then.
        contact.remarks.push(format!("the striker hits `{object}` again: this impact gives no restitution"));
    } else if distance_m.is_none() {
        contact.exclude(format!("the specified strike passes `{object}` or stops short of it"));
    } else if from_outlines.is_none() {
        contact
            .remarks
            .push(format!("the yaw of `{object}` is not observed: the normal is taken along its motion"));
    }
    Some(contact)
}

fn between_objects(fitted: &MotionFit, [a, b]: [usize; 2], time_index: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_index];
    let pose = |k: usize| fitted.paths[k].motion_before(time_s).pose;
    // The difference of both velocity changes: its relative error is smaller than that of either.
    let impulse_direction = (velocity_change(&fitted.paths, b, time_s)
        - velocity_change(&fitted.paths, a, time_s))
    .direction()?;
    let between = pose(b).position - pose(a).position;
    let away = between.direction().unwrap_or(impulse_direction);
    let known = orientation_known(fitted, a) && orientation_known(fitted, b);
    let [shape_a, shape_b] = [a, b].map(|k| fitted.placed(k, pose(k)));
    let from_outlines = if known { separated_closest_points(shape_a, shape_b, away) } else { None };
    let middle = pose(a).position + between / 2.0;
    let assumed =
        ClosestPoints { gap_m: 0.0, normal_ab: impulse_direction, point: middle, facing_sides: None };
    let mut contact = Contact {
        a: Partner::Body(a),
        b,
        time_index,
        striker_velocity: Vec2::ZERO,
        striker_distance_m: None,
        closest: from_outlines.unwrap_or(assumed),
        normal_from_outlines: from_outlines.is_some(),
        impulse_direction,
        restitution: true,
        is_double: false,
        mass_ratio: true,
        remarks: Vec::new(),
    };
    match from_outlines {
        None => contact
            .remarks
            .push("the yaws of the outlines are not observed: the normal is taken along the impulse".into()),
        Some(closest) if closest.gap_m.abs() > MAX_GAP_M => {
            contact.exclude(format!("the outlines are {:.1} mm apart at the impact", closest.gap_m * 1e3));
        }
        Some(closest) if closest.gap_m < -OUTLINE_ACCURACY_M => {
            // Impacts within a few frames look like a later one, at which the first body would be inside the second.
            contact.is_double = true;
            contact.remarks.push(format!(
                "the outlines overlap by {:.1} mm at the impact: the bodies hit each other several times in a row, or are smaller: no single \
                 restitution",
                -1e3 * closest.gap_m
            ));
        }
        Some(_) => {}
    }
    Some(contact)
}

/// An impact with an unknown partner, or of more than two bodies at once: it is reported but measures nothing.
fn without_pair(fitted: &MotionFit, members: &[usize], time_index: usize) -> Option<Contact> {
    let time_s = fitted.minimum.parameters[time_index];
    let &b = members.last()?;
    let impulse_direction =
        velocity_change(&fitted.paths, b, time_s).direction().unwrap_or(Vec2::new(1.0, 0.0));
    let point = fitted.paths[b].motion(time_s).pose.position;
    let names: Vec<String> =
        members.iter().map(|&k| format!("`{}`", fitted.model.bodies[k].object)).collect();
    let remark = match names.as_slice() {
        [only] => {
            format!("at {time_s:.3} s {only} is hit by something that is neither in the film nor specified")
        }
        _ => format!("{} are hit at once: their impulses cannot be separated", names.join(" and ")),
    };
    Some(Contact {
        a: Partner::Unknown,
        b,
        time_index,
        striker_velocity: Vec2::ZERO,
        striker_distance_m: None,
        closest: ClosestPoints { gap_m: 0.0, normal_ab: impulse_direction, point, facing_sides: None },
        normal_from_outlines: false,
        impulse_direction,
        restitution: false,
        is_double: false,
        mass_ratio: false,
        remarks: vec![remark],
    })
}
