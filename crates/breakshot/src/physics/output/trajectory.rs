//! What happened: events, exact states in between, energies.

use crate::geometry::{Point, Pose, Vec2};
use crate::physics::impact::island::Cluster;
use crate::physics::impact::routh::Touch;
use crate::physics::output::near_miss::{Close, Graze, closest_miss};
use crate::physics::output::outcome::Outcome;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{Law, Motion, State};
use crate::physics::world::{STRIKER, World};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What happens: events, and the exact state at any time between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Trajectory {
    /// The file format's version.
    pub version: u32,
    /// Where every object comes to rest.
    #[serde(rename = "final")]
    pub final_poses: BTreeMap<String, Pose>,
    /// When everything is at rest (s after the striker starts).
    pub duration_s: f64,
    /// The impacts, in order of time.
    pub events: Vec<Event>,
    /// Where the energy came from and went.
    pub energy: Energy,
    /// How each object moved, and the striker under the name `striker`: segment after segment.
    pub motions: BTreeMap<String, Vec<Segment>>,
    /// Where a little more or less would have changed most: the closest miss or the barest hit.
    #[serde(default)]
    pub closest_graze: Option<Graze>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What happened at one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// When (s after the striker starts).
    pub time_s: f64,
    /// What.
    pub kind: EventKind,
    /// The bodies: objects, `striker` or `walls[k]`.
    pub bodies: Vec<String>,
    /// Where.
    pub point_m: Point,
    /// Unit vector from the first body to the second.
    pub normal: Vec2,
    /// Impulse on the second body (N s; per reference mass where that was not weighed).
    pub impulse_n_s: Vec2,
    /// Their velocities before and after (m/s).
    pub velocities_before_m_s: Vec<Vec2>,
    /// Their velocities after (m/s).
    pub velocities_after_m_s: Vec<Vec2>,
    /// Their rates of turn before (rad/s).
    pub yaw_rates_before_rad_s: Vec<f64>,
    /// Their rates of turn after (rad/s).
    pub yaw_rates_after_rad_s: Vec<f64>,
    /// Energy lost in the contact (J; per reference mass where that was not weighed).
    pub loss_j: f64,
}

/// Kinds of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EventKind {
    /// Two bodies hit each other.
    Impact,
    /// An object's centre passed the table's edge.
    Fallen,
    /// A body entered an area to keep out of; nothing stops it.
    Entered,
}

/// The energies of a run (J; per reference mass where that was not weighed): they add up to zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Work of the striker on the objects.
    pub striker_work_j: f64,
    /// Lost in impacts.
    pub impact_loss_j: f64,
    /// Lost to friction on the table.
    pub friction_loss_j: f64,
    /// Kinetic energy of what fell off the table.
    #[serde(default)]
    pub fallen_j: f64,
}

/// A piece of motion: positions and yaw are polynomials of the time since its start, the constant first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// From when (s).
    pub start_s: f64,
    /// Until when (s).
    pub end_s: f64,
    /// Coefficients of x (m, m/s, ...).
    pub x_m: Vec<f64>,
    /// Coefficients of y.
    pub y_m: Vec<f64>,
    /// Coefficients of the yaw (rad, rad/s, ...).
    pub yaw_rad: Vec<f64>,
}

impl Segment {
    fn pose(&self, time_s: f64) -> Pose {
        let time = time_s.clamp(self.start_s, self.end_s) - self.start_s;
        let at = |c: &[f64]| c.iter().rev().fold(0.0, |sum, &c| sum * time + c);
        Pose::new(at(&self.x_m), at(&self.y_m), at(&self.yaw_rad))
    }
}

impl Trajectory {
    /// Where an object (or `striker`) is `time_s` after the striker starts; its final pose once it rests; `None` for an
    /// unknown name.
    pub fn pose(&self, object: &str, time_s: f64) -> Option<Pose> {
        let segments = self.motions.get(object)?;
        let next = segments.partition_point(|s| s.start_s <= time_s);
        match segments.get(next.saturating_sub(1)) {
            Some(segment) if time_s <= segment.end_s || next < segments.len() => Some(segment.pose(time_s)),
            last => self.final_poses.get(object).copied().or(last.map(|s| s.pose(time_s))),
        }
    }
}

/// What the simulator writes down as it goes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Log {
    /// Every motion of every body, in order.
    motions: Vec<Vec<Motion>>,
    events: Vec<Event>,
    energy: Energy,
    /// The barest hit so far.
    barest: Option<Close>,
}

impl Log {
    pub(crate) fn start(&mut self, motions: &[Motion]) {
        self.motions = motions.iter().map(|m| vec![*m]).collect();
    }

    pub(crate) fn motion(&mut self, body: usize, motion: &Motion) {
        self.motions[body].push(*motion);
    }

    /// One impact of two bodies.
    pub(crate) fn impact(
        &mut self,
        world: &World,
        (time_s, bodies): (f64, [usize; 2]),
        (touch, impulse): (&Touch, Vec2),
        (before, after): (&[State; 2], &[State; 2]),
    ) {
        let work_j = striker_work_j(bodies, impulse, before);
        let mut loss_j = work_j;
        for (&index, (before, after)) in bodies.iter().zip(before.iter().zip(after)) {
            if index != STRIKER {
                let body = &world.bodies[index];
                loss_j += kinetic_energy_j(body, before) - kinetic_energy_j(body, after);
            }
        }
        self.energy.striker_work_j += work_j;
        self.energy.impact_loss_j += loss_j;
        self.barest = Close::closer(self.barest, Close::hit(world, time_s, bodies, before));
        self.events.push(event(world, (time_s, bodies), (touch, impulse), (before, after), loss_j));
    }

    /// Something else that happened to bodies on their way: the first one fell, or entered the second one.
    pub(crate) fn note(
        &mut self,
        world: &World,
        time_s: f64,
        (kind, bodies): (EventKind, &[usize]),
        state: &State,
    ) {
        if kind == EventKind::Fallen {
            self.energy.fallen_j += kinetic_energy_j(&world.bodies[bodies[0]], state);
        }
        self.events.push(Event {
            time_s,
            kind,
            bodies: bodies.iter().map(|&b| world.name(b)).collect(),
            point_m: state.position,
            normal: Vec2::ZERO,
            impulse_n_s: Vec2::ZERO,
            velocities_before_m_s: vec![state.velocity],
            velocities_after_m_s: vec![state.velocity],
            yaw_rates_before_rad_s: vec![state.yaw_rate_rad_s],
            yaw_rates_after_rad_s: vec![state.yaw_rate_rad_s],
            loss_j: 0.0,
        });
    }

    /// The contacts of a cluster, each as an impact of its own; velocities are those before and after all of them.
    pub(crate) fn cluster(&mut self, world: &World, time_s: f64, cluster: &Cluster) {
        for contact in &cluster.contacts {
            if contact.impulse.normal <= 0.0 {
                continue;
            }
            let members = contact.members.map(|i| &cluster.members[i]);
            let (bodies, before, after) =
                (members.map(|m| m.body), members.map(|m| m.before), members.map(|m| m.after));
            let n = contact.touch.normal_ab;
            let impulse = n * contact.impulse.normal + n.perpendicular() * contact.impulse.tangent;
            self.energy.striker_work_j += striker_work_j(bodies, impulse, &before);
            self.energy.impact_loss_j += contact.loss_j;
            self.barest = Close::closer(self.barest, Close::hit(world, time_s, bodies, &before));
            let (what, states) = ((&contact.touch, impulse), (&before, &after));
            self.events.push(event(world, (time_s, bodies), what, states, contact.loss_j));
        }
    }

    pub(crate) fn trajectory(mut self, world: &World, outcome: &Outcome) -> Trajectory {
        let closest = Close::closer(self.barest, closest_miss(world, &self.motions, outcome));
        let mut motions = BTreeMap::new();
        for body in 0..=world.objects {
            let list = &self.motions[body];
            let mut segments = Vec::new();
            for (k, motion) in list.iter().enumerate() {
                let until_s = list.get(k + 1).map_or(f64::INFINITY, |next| next.start_s);
                segments.extend(
                    motion.segments(until_s.min(outcome.duration_s.max(motion.start_s)), &world.bodies[body]),
                );
                let state = motion.state(until_s.min(motion.stop_s), &world.bodies[body]);
                let start = motion.state(motion.start_s, &world.bodies[body]);
                if body != STRIKER {
                    self.energy.friction_loss_j += kinetic_energy_j(&world.bodies[body], &start)
                        - kinetic_energy_j(&world.bodies[body], &state);
                }
            }
            motions.insert(world.name(body), segments);
        }
        let mut notes = world.notes.clone();
        for (name, _) in world.names.iter().zip(&outcome.fallen).filter(|(_, fallen)| **fallen) {
            notes.push(format!("`{name}` fell off the table"));
        }
        if !outcome.complete {
            notes.push(format!("given up after {:.3} s: too many impacts", outcome.duration_s));
        }
        Trajectory {
            version: 1,
            final_poses: world.names.iter().cloned().zip(outcome.poses.iter().copied()).collect(),
            duration_s: outcome.duration_s,
            events: self.events,
            energy: self.energy,
            motions,
            closest_graze: closest.map(|c| c.named(world)),
            notes,
        }
    }
}

fn event(
    world: &World,
    (time_s, bodies): (f64, [usize; 2]),
    (touch, impulse): (&Touch, Vec2),
    (before, after): (&[State; 2], &[State; 2]),
    loss_j: f64,
) -> Event {
    Event {
        time_s,
        kind: EventKind::Impact,
        bodies: bodies.iter().map(|&b| world.name(b)).collect(),
        point_m: touch.point,
        normal: touch.normal_ab,
        impulse_n_s: impulse,
        velocities_before_m_s: before.iter().map(|s| s.velocity).collect(),
        velocities_after_m_s: after.iter().map(|s| s.velocity).collect(),
        yaw_rates_before_rad_s: before.iter().map(|s| s.yaw_rate_rad_s).collect(),
        yaw_rates_after_rad_s: after.iter().map(|s| s.yaw_rate_rad_s).collect(),
        loss_j,
    }
}

/// The work that a striker of prescribed velocity does with an impulse on the second body (J).
fn striker_work_j(bodies: [usize; 2], impulse: Vec2, before: &[State; 2]) -> f64 {
    let mut work_j = 0.0;
    for ((body, state), sign) in bodies.iter().zip(before).zip([1.0, -1.0]) {
        if *body == STRIKER {
            work_j += sign * impulse.dot(state.velocity);
        }
    }
    work_j
}

/// Kinetic energy of a body that moves freely (J).
fn kinetic_energy_j(body: &Body, state: &State) -> f64 {
    if body.is_fixed() {
        return 0.0;
    }
    0.5 * (state.velocity.length_squared() / body.inverse_mass
        + state.yaw_rate_rad_s * state.yaw_rate_rad_s / body.inverse_inertia)
}

impl Motion {
    /// The motion until a time as segments of polynomials.
    fn segments(&self, until_s: f64, body: &Body) -> Vec<Segment> {
        let end_s = until_s.min(self.stop_s);
        let mut segments = match self.law {
            Law::Rest => Vec::new(),
            Law::Even | Law::Bent { .. } => self.even_segments(end_s),
            Law::Curved { branch, scale_s } => self.curved_segments(end_s, branch, scale_s, body),
        };
        if until_s > end_s || segments.is_empty() {
            let Pose { position, yaw_rad } = self.end;
            let (x_m, y_m, yaw_rad) = (vec![position.x], vec![position.y], vec![yaw_rad]);
            segments.push(Segment { start_s: end_s, end_s: until_s, x_m, y_m, yaw_rad });
        }
        segments
    }

    /// One segment for each span of the slide curve.
    fn curved_segments(&self, end_s: f64, branch: u8, scale_s: f64, body: &Body) -> Vec<Segment> {
        let remaining = |time_s: f64| (self.stop_s - time_s) / scale_s;
        let unit_m = body.grip_m_s2 * scale_s * scale_s;
        let unit_rad = unit_m.copysign(self.yaw_rate_rad_s) / body.patch_radius_m;
        let stretches = body.curve.stretches(branch, remaining(self.start_s), remaining(end_s));
        let segment = |s: &crate::physics::sliding::slide_curve::Stretch| {
            // In seconds, and from the end backwards.
            let polynomial = |end: f64, unit: f64, c: &[f64; 6]| {
                let mut per_power = -unit;
                let mut c = c.map(|c| {
                    let scaled = c * per_power;
                    per_power /= scale_s;
                    scaled
                });
                c[0] += end;
                c.to_vec()
            };
            Segment {
                start_s: self.stop_s - s.remaining[0] * scale_s,
                end_s: self.stop_s - s.remaining[1] * scale_s,
                x_m: polynomial(self.end.position.x, unit_m * self.direction.x, &s.way),
                y_m: polynomial(self.end.position.y, unit_m * self.direction.y, &s.way),
                yaw_rad: polynomial(self.end.yaw_rad, unit_rad, &s.turn),
            }
        };
        stretches.iter().map(segment).collect()
    }

    /// Sliding and spinning may stop at different times: then there are two segments.
    fn even_segments(&self, end_s: f64) -> Vec<Segment> {
        let (deceleration, yaw_deceleration) = (self.deceleration_m_s2[0], self.yaw_deceleration_rad_s2);
        let stop = |speed: f64, lost: f64| if lost > 0.0 { self.start_s + speed / lost } else { self.stop_s };
        let slide_stop_s = stop(self.speed_m_s, deceleration);
        let spin_stop_s = stop(self.yaw_rate_rad_s.abs(), yaw_deceleration);
        let sign = 1.0f64.copysign(self.yaw_rate_rad_s);
        let mut segments = Vec::new();
        let mut from_s = self.start_s;
        for to_s in [slide_stop_s.min(spin_stop_s).min(end_s), end_s] {
            if to_s <= from_s {
                continue;
            }
            let (time, middle_s) = (from_s - self.start_s, 0.5 * (from_s + to_s));
            let part = |speed: f64, lost: f64, stop_s: f64| {
                if middle_s < stop_s {
                    [time * (speed - 0.5 * lost * time), speed - lost * time, -0.5 * lost]
                } else {
                    [if lost > 0.0 { 0.5 * speed * speed / lost } else { 0.0 }, 0.0, 0.0]
                }
            };
            let way = part(self.speed_m_s, deceleration, slide_stop_s);
            let turn = part(self.yaw_rate_rad_s.abs(), yaw_deceleration, spin_stop_s);
            let coordinate =
                |start: f64, along: f64, c: [f64; 3]| vec![start + along * c[0], along * c[1], along * c[2]];
            segments.push(Segment {
                start_s: from_s,
                end_s: to_s,
                x_m: coordinate(self.start.position.x, self.direction.x, way),
                y_m: coordinate(self.start.position.y, self.direction.y, way),
                yaw_rad: coordinate(self.start.yaw_rad, sign, turn),
            });
            from_s = to_s;
        }
        segments
    }
}
