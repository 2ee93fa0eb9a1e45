//! Which bodies and contacts take energy in an impact together?
//!
//! An [`Island`] is a set of bodies connected by contacts that are closed, or whose gap closes during the contact time.  Fast
//! impacts are resolved by compliant contacts (`compliant`), slow ones by Moreau's law (`moreau`).  Related formulations: Liu,
//! Zhao and Brogliato, Proc. R. Soc. A 464 (2008) 3193; Uchida, Sherman and Delp, Proc. R. Soc. A 471 (2015) 20140859.

use crate::geometry::Vec2;
use crate::physics::impact::routh::{ContactPoint, Impact, Impulse};
use crate::physics::pair_coefficients::Coefficients;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{BodyState, State};

/// One contact of an island.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Indices of the two members.
    pub(crate) members: [usize; 2],
    pub(crate) point: ContactPoint,
    /// Penetration before the impact (m); negative: a gap that is still open.
    pub(crate) penetration_m: f64,
    /// Impulse on the second member so far.
    pub(crate) impulse: Impulse,
    /// Energy lost in the contact (J).
    pub(crate) loss_j: f64,
    pub(super) coefficients: Coefficients,
    /// Approach, slip and inverse mass at the start.
    pub(super) impact: Impact,
    /// Lever arms of normal and tangent about the centroids of both members (m).
    pub(super) arms: [[f64; 2]; 2],
    /// Separation speed that Moreau's law requires (m/s).
    pub(super) separation_speed: f64,
}

/// A body in an island.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// Index of the body in the world.
    pub(crate) body: usize,
    pub(crate) before: State,
    pub(crate) after: State,
    pub(super) inverse_mass: f64,
    pub(super) inverse_inertia: f64,
}

/// Bodies and contacts that act together; the memory is reused.
#[derive(Clone, Debug, Default)]
pub(crate) struct Island {
    pub(crate) members: Vec<Member>,
    pub(crate) contacts: Vec<Contact>,
}

/// Sweeps that separate penetrating bodies: they reduce the penetration of a body between two others a hundredfold.
const SEPARATION_SWEEPS: usize = 8;

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

    /// Kinetic energy of the change of velocity (J).
    pub(super) fn impulse_energy_j(&self) -> f64 {
        let change = self.after.velocity - self.before.velocity;
        let yaw_rate_change = self.after.yaw_rate_rad_s - self.before.yaw_rate_rad_s;
        let energy = |square: f64, inverse: f64| if inverse > 0.0 { 0.5 * square / inverse } else { 0.0 };
        energy(change.length_squared(), self.inverse_mass)
            + energy(yaw_rate_change * yaw_rate_change, self.inverse_inertia)
    }

    /// Applies an impulse and an angular impulse about the centroid.
    fn apply(&mut self, impulse: Vec2, angular: f64) {
        self.after.velocity += impulse * self.inverse_mass;
        self.after.yaw_rate_rad_s += angular * self.inverse_inertia;
    }
}

impl Contact {
    /// A contact of two members, given by their indices, at a point with a gap (m).
    pub(crate) fn new(
        members: [usize; 2],
        [a, b]: [BodyState; 2],
        point: ContactPoint,
        gap_m: f64,
        coefficients: Coefficients,
    ) -> Self {
        let (n, t) = (point.normal_ab, point.normal_ab.perpendicular());
        let (ra, rb) = (point.point - a.state.position, point.point - b.state.position);
        Self {
            members,
            point,
            penetration_m: -gap_m,
            impulse: Impulse::default(),
            loss_j: 0.0,
            coefficients,
            impact: Impact::new(a, b, &point),
            arms: [[ra.cross(n), ra.cross(t)], [rb.cross(n), rb.cross(t)]],
            separation_speed: 0.0,
        }
    }

    /// The impulse on the second body (N s).
    pub(crate) fn impulse_on_b(&self) -> Vec2 {
        let n = self.point.normal_ab;
        n * self.impulse.normal + n.perpendicular() * self.impulse.tangent
    }

    /// Approach speed and slip at the present velocities of the members (m/s).
    pub(super) fn present_speeds(&self, members: &[Member]) -> [f64; 2] {
        let [a, b] = self.members.map(|i| &members[i].after);
        let relative = a.velocity - b.velocity;
        let n = self.point.normal_ab;
        let [arm_a, arm_b] = self.arms;
        // The velocity omega x r of a point at r has the normal component omega (r x n), omega times the lever arm.
        [
            relative.dot(n) + (a.yaw_rate_rad_s * arm_a[0] - b.yaw_rate_rad_s * arm_b[0]),
            relative.dot(n.perpendicular()) + (a.yaw_rate_rad_s * arm_a[1] - b.yaw_rate_rad_s * arm_b[1]),
        ]
    }
}

impl Island {
    pub(crate) fn clear(&mut self) {
        self.members.clear();
        self.contacts.clear();
    }

    /// Separates members that penetrate each other by more than `more_than_m`, each in proportion to its inverse mass; returns
    /// the remaining penetration (m), which is not zero where bodies are jammed.
    pub(crate) fn separate(&mut self, more_than_m: f64) -> f64 {
        if self.contacts.iter().all(|c| c.penetration_m <= more_than_m) {
            return 0.0;
        }
        let mut deepest_m: f64 = 0.0;
        // Separating one pair may push a member into another one: several sweeps over all pairs.
        for _ in 0..SEPARATION_SWEEPS {
            deepest_m = 0.0;
            for contact in &self.contacts {
                let [a, b] = contact.members.map(|i| &self.members[i]);
                let shift = |m: &Member| m.after.position - m.before.position;
                let depth_m = contact.penetration_m + contact.point.normal_ab.dot(shift(a) - shift(b));
                deepest_m = deepest_m.max(depth_m);
                let inverse = a.inverse_mass + b.inverse_mass;
                if depth_m > 0.0 && inverse > 0.0 {
                    let correction = contact.point.normal_ab * (depth_m / inverse);
                    for (member, sign) in contact.members.into_iter().zip([-1.0, 1.0]) {
                        let member = &mut self.members[member];
                        member.after.position += correction * (sign * member.inverse_mass);
                    }
                }
            }
        }
        deepest_m
    }

    /// Adds an impulse at a contact.
    pub(super) fn apply_impulse(&mut self, k: usize, Impulse { normal, tangent }: Impulse) {
        let contact = &mut self.contacts[k];
        contact.impulse.normal += normal;
        contact.impulse.tangent += tangent;
        let n = contact.point.normal_ab;
        let on_b = n * normal + n.perpendicular() * tangent;
        let [arm_a, arm_b] = contact.arms;
        let [a, b] = contact.members;
        self.members[a].apply(-on_b, -(arm_a[0] * normal + arm_a[1] * tangent));
        self.members[b].apply(on_b, arm_b[0] * normal + arm_b[1] * tangent);
    }

    /// The energy that impulses scaled by s take from the members is `L s - B s^2` (J): L, impulses times the speeds before.
    fn given_energy_j(&self) -> f64 {
        self.contacts
            .iter()
            .map(|c| c.impulse.normal * c.impact.approach + c.impulse.tangent * c.impact.slip)
            .sum()
    }

    /// The same: B, the kinetic energy of the changes of velocity (J).
    fn impulse_energy_j(&self) -> f64 {
        self.members.iter().map(Member::impulse_energy_j).sum()
    }

    /// The energy that the impulses take from the members (J).
    pub(super) fn lost_energy_j(&self) -> f64 {
        self.given_energy_j() - self.impulse_energy_j()
    }

    /// The greatest factor of all impulses with which no energy is gained; infinite without impulses.
    pub(super) fn greatest_scale(&self) -> f64 {
        match self.impulse_energy_j() {
            0.0 => f64::INFINITY,
            taken => self.given_energy_j() / taken,
        }
    }

    /// Makes all contacts rigid along their tangents; whether any was not.
    pub(super) fn remove_tangential_restitution(&mut self) -> bool {
        let had = self.contacts.iter().any(|c| c.coefficients.tangential_restitution != 0.0);
        for contact in &mut self.contacts {
            contact.coefficients.tangential_restitution = 0.0;
        }
        had
    }

    /// Multiplies all normal impulses by a factor.
    pub(super) fn scale_normal(&mut self, factor: f64) {
        for k in 0..self.contacts.len() {
            let normal = (factor - 1.0) * self.contacts[k].impulse.normal;
            self.apply_impulse(k, Impulse { normal, tangent: 0.0 });
        }
    }

    /// Multiplies all impulses by a factor.
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
