//! What happens when several contacts close at once?
//!
//! A [`Cluster`] is the bodies and contacts that act together: those that touch, and neighbours whose gap closes during the
//! contact time, with their gap.  Fast, they are springs in a geometry that stands still (`springs`); slow, they press
//! (`press`).  The idea in other variables: Liu, Zhao and Brogliato, Proc. R. Soc. A 464 (2008) 3193; Uchida, Sherman and
//! Delp, Proc. R. Soc. A 471 (2015) 20140859.

use crate::geometry::Vec2;
use crate::physics::impact::compliant::Springs;
use crate::physics::impact::routh::{Impact, Impulse, Touch};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::State;
use crate::physics::world::Coefficients;

/// How contacts yield.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliance {
    /// How long the first contact would last alone (s).
    pub contact_time_s: f64,
    /// How force grows with compression.
    pub force: ContactForce,
    /// How stiff the other contacts are against the first.
    pub stiffness: Stiffness,
    /// Stiffness of contacts with the striker over that between objects.
    pub striker_stiffness_ratio: f64,
}

/// How force grows with compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactForce {
    /// To the power of 3/2, as between elastic balls.
    #[default]
    Hertz,
    /// In proportion.
    Linear,
}

/// How stiff contacts are against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stiffness {
    /// All alike: the same material.
    #[default]
    Same,
    /// In proportion to the mass that meets, so that every contact alone would last equally long.
    SameContactTime,
}

impl Default for Compliance {
    /// Hard bodies of a few centimetres: contacts of some ten microseconds.  Those that touch part alike whatever the contact
    /// time; it only says how small a gap must be to act together, and as the geometry stands still meanwhile, short is exact.
    fn default() -> Self {
        Self {
            contact_time_s: 3e-5,
            force: ContactForce::Hertz,
            stiffness: Stiffness::Same,
            striker_stiffness_ratio: 1.0,
        }
    }
}

/// One contact of a cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Indices into the cluster's members.
    pub(crate) members: [usize; 2],
    pub(crate) touch: Touch,
    /// How deep the bodies had sunk in before (m); negative: still a gap.
    pub(crate) sunk_m: f64,
    /// The impulse on the second member so far.
    pub(crate) impulse: Impulse,
    /// Energy lost in it (J).
    pub(crate) loss_j: f64,
    pub(super) coefficients: Coefficients,
    /// Approach, slip and inverse inertia at the start.
    pub(super) impact: Impact,
    /// Arms of normal and tangent about the members' centroids (m).
    pub(super) arms: [[f64; 2]; 2],
    /// The speed at which it opens again if it must (m/s).
    pub(super) parting: f64,
}

/// A body in a cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// Which body of the world.
    pub(crate) body: usize,
    pub(crate) before: State,
    pub(crate) after: State,
    pub(super) inverse_mass: f64,
    pub(super) inverse_inertia: f64,
}

/// Bodies whose contacts act together; its memory is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cluster {
    pub(crate) members: Vec<Member>,
    pub(crate) contacts: Vec<Contact>,
    pub(super) springs: Springs,
}

/// Sweeps to set apart what sank in: a body between two others comes free to a hundredth in as many.
const SETTING_SWEEPS: usize = 8;
impl Member {
    pub(crate) fn new(index: usize, body: &Body, state: &State) -> Self {
        Self {
            body: index,
            before: *state,
            after: *state,
            inverse_mass: body.inverse_mass,
            inverse_inertia: body.inverse_inertia,
        }
    }

    /// The energy that its impulses alone would give it (J).
    pub(super) fn impulse_energy_j(&self) -> f64 {
        let change = self.after.velocity - self.before.velocity;
        let turn = self.after.yaw_rate_rad_s - self.before.yaw_rate_rad_s;
        let part = |square: f64, inverse: f64| if inverse > 0.0 { 0.5 * square / inverse } else { 0.0 };
        part(change.length_squared(), self.inverse_mass) + part(turn * turn, self.inverse_inertia)
    }

    /// Takes an impulse along unit vectors with arms about the centroid.
    fn take(&mut self, impulse: Vec2, angular: f64) {
        self.after.velocity += impulse * self.inverse_mass;
        self.after.yaw_rate_rad_s += angular * self.inverse_inertia;
    }
}

impl Contact {
    /// A contact of members i and k with a gap (m).
    pub(crate) fn new(
        (i, k): (usize, usize),
        (a, b): ((&Body, &State), (&Body, &State)),
        (touch, gap_m): (Touch, f64),
        coefficients: Coefficients,
    ) -> Self {
        let (n, t) = (touch.normal_ab, touch.normal_ab.perpendicular());
        let (ra, rb) = (touch.point - a.1.position, touch.point - b.1.position);
        Self {
            members: [i, k],
            touch,
            sunk_m: -gap_m,
            impulse: Impulse::default(),
            loss_j: 0.0,
            coefficients,
            impact: Impact::new(a, b, &touch),
            arms: [[ra.cross(n), ra.cross(t)], [rb.cross(n), rb.cross(t)]],
            parting: 0.0,
        }
    }

    /// Closing speed and slip from the members' present speeds (m/s).
    pub(super) fn present_speeds(&self, members: &[Member]) -> [f64; 2] {
        let [a, b] = self.members.map(|i| &members[i].after);
        let relative = a.velocity - b.velocity;
        let n = self.touch.normal_ab;
        let [arm_a, arm_b] = self.arms;
        // A point at r moves at omega x r: along the normal that is omega times the arm, (r x n).
        [
            relative.dot(n) + (a.yaw_rate_rad_s * arm_a[0] - b.yaw_rate_rad_s * arm_b[0]),
            relative.dot(n.perpendicular()) + (a.yaw_rate_rad_s * arm_a[1] - b.yaw_rate_rad_s * arm_b[1]),
        ]
    }
}

impl Cluster {
    pub(crate) fn clear(&mut self) {
        self.members.clear();
        self.contacts.clear();
    }

    /// Sets members apart that had sunk into each other by more than this (m), each by its share of the inverse mass;
    /// how deep they are still sunk in (m), where there is no room.
    pub(crate) fn set_apart(&mut self, more_than_m: f64) -> f64 {
        if self.contacts.iter().all(|c| c.sunk_m <= more_than_m) {
            return 0.0;
        }
        let mut deepest_m: f64 = 0.0;
        // Setting one pair apart may push into another: a few sweeps over all of them.
        for _ in 0..SETTING_SWEEPS {
            deepest_m = 0.0;
            for contact in &self.contacts {
                let [a, b] = contact.members.map(|i| &self.members[i]);
                let shift = |m: &Member| m.after.position - m.before.position;
                let depth_m = contact.sunk_m + contact.touch.normal_ab.dot(shift(a) - shift(b));
                deepest_m = deepest_m.max(depth_m);
                let inverse = a.inverse_mass + b.inverse_mass;
                if depth_m > 0.0 && inverse > 0.0 {
                    let way = contact.touch.normal_ab * (depth_m / inverse);
                    for (member, sign) in contact.members.into_iter().zip([-1.0, 1.0]) {
                        let member = &mut self.members[member];
                        member.after.position += way * (sign * member.inverse_mass);
                    }
                }
            }
        }
        deepest_m
    }

    /// Adds an impulse at a contact.
    pub(super) fn kick(&mut self, k: usize, Impulse { normal, tangent }: Impulse) {
        let contact = &mut self.contacts[k];
        contact.impulse.normal += normal;
        contact.impulse.tangent += tangent;
        let n = contact.touch.normal_ab;
        let on_b = n * normal + n.perpendicular() * tangent;
        let [arm_a, arm_b] = contact.arms;
        let [a, b] = contact.members;
        self.members[a].take(-on_b, -(arm_a[0] * normal + arm_a[1] * tangent));
        self.members[b].take(on_b, arm_b[0] * normal + arm_b[1] * tangent);
    }

    /// Makes all impulses so many times as large.
    pub(super) fn scale(&mut self, factor: f64) {
        for c in &mut self.contacts {
            c.impulse.normal *= factor;
            c.impulse.tangent *= factor;
        }
        for m in &mut self.members {
            let (before, after) = (m.before, m.after);
            m.after.velocity = before.velocity + (after.velocity - before.velocity) * factor;
            m.after.yaw_rate_rad_s =
                before.yaw_rate_rad_s + (after.yaw_rate_rad_s - before.yaw_rate_rad_s) * factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::object::Shape;
    use crate::physics::contact::compound_shape::Plate;
    use crate::physics::impact::compliant::End;
    use crate::physics::impact::routh::RestitutionLaw;
    use crate::physics::sliding::slide_curve::SlideCurve;
    use std::sync::Arc;

    const RADIUS_M: f64 = 0.03;

    fn disc(mass: f64) -> Body {
        Body {
            plate: Arc::new(Plate::new(&Shape::Disc { radius_m: RADIUS_M })),
            pose: Pose::default(),
            inverse_mass: 1.0 / mass,
            inverse_inertia: 2.0 / (mass * RADIUS_M * RADIUS_M),
            grip_m_s2: 1.0,
            patch_radius_m: RADIUS_M,
            curve: Arc::new(SlideCurve::new(0.5)),
            hold: None,
            kind: 1,
        }
    }

    /// Touching discs at places given in radii, the first one moving along x at 1 m/s; their velocities after.
    fn after(discs: &[(f64, f64, f64)], restitution: f64, compliance: &Compliance) -> Vec<Vec2> {
        let bodies: Vec<Body> = discs.iter().map(|d| disc(d.0)).collect();
        let states: Vec<State> = discs
            .iter()
            .enumerate()
            .map(|(k, d)| State {
                position: Point::new(d.1 * RADIUS_M, d.2 * RADIUS_M),
                velocity: if k == 0 { Vec2::new(1.0, 0.0) } else { Vec2::ZERO },
                ..State::default()
            })
            .collect();
        let mut cluster = Cluster::default();
        cluster.members.extend((0..discs.len()).map(|k| Member::new(k + 1, &bodies[k], &states[k])));
        for i in 0..discs.len() {
            for k in i + 1..discs.len() {
                let way = states[k].position - states[i].position;
                if way.length() < 2.0 * RADIUS_M + 1e-9 {
                    let normal_ab = way / way.length();
                    let touch = Touch { point: states[i].position + normal_ab * RADIUS_M, normal_ab };
                    let pair = ((&bodies[i], &states[i]), (&bodies[k], &states[k]));
                    let coefficients = Coefficients { restitution, friction: 0.0 };
                    cluster.contacts.push(Contact::new((i, k), pair, (touch, 0.0), coefficients));
                }
            }
        }
        let first = cluster.contacts[0].impact;
        assert_eq!(cluster.resolve(&first, compliance, RestitutionLaw::Constant), End::Parted);
        cluster.members.iter().map(|m| m.after.velocity).collect()
    }

    fn row(masses: &[f64]) -> Vec<(f64, f64, f64)> {
        masses.iter().enumerate().map(|(k, &m)| (m, 2.0 * k as f64, 0.0)).collect()
    }

    fn linear() -> Compliance {
        Compliance { force: ContactForce::Linear, ..Compliance::default() }
    }

    #[test]
    fn one_contact_alone_has_exactly_its_restitution() {
        for compliance in [Compliance::default(), linear()] {
            for (mass, e) in [(0.008, 0.7), (0.143, 0.455), (1.0, 1.0), (0.5, 0.05), (0.3, 0.0)] {
                let v = after(&row(&[mass, 0.1]), e, &compliance);
                let parting = v[1].x - v[0].x;
                assert!((parting - e).abs() < 1e-6, "{mass} kg, e = {e}: {parting}");
            }
        }
    }

    #[test]
    fn newtons_cradles_swing_as_springs_do() {
        // The same springs integrated in ten thousand small steps by a general solver.
        let hertz = Compliance::default();
        for (masses, compliance, expected) in [
            (vec![1.0; 5], hertz, vec![-0.07109, -0.03027, -0.01446, 0.12704, 0.98878]),
            (vec![1.0; 5], linear(), vec![-0.13228, -0.07533, -0.03101, 0.29622, 0.94240]),
            (vec![1.0, 3.0, 1.0], hertz, vec![-0.51522, 0.26313, 0.72584]),
            (vec![1.0, 3.0, 1.0], linear(), vec![-0.53819, 0.28503, 0.68310]),
        ] {
            let v = after(&row(&masses), 1.0, &compliance);
            for (found, expected) in v.iter().zip(&expected) {
                assert!((found.x - expected).abs() < 6e-4, "{masses:?}: {v:?}, not {expected:?}");
            }
        }
    }

    #[test]
    fn a_wedge_parts_symmetrically() {
        let third = 3f64.sqrt();
        let v = after(&[(1.0, 0.0, 0.0), (1.0, third, 1.0), (1.0, third, -1.0)], 1.0, &Compliance::default());
        assert!((v[1].x - 0.6).abs() < 1e-3 && (v[1] - Vec2::new(v[2].x, -v[2].y)).length() < 1e-15, "{v:?}");
    }
}
