//! What happens when several contacts close at once?
//!
//! A short compliant impact with the geometry frozen: every contact is a spring that loads with `F = k d^n` (n = 3/2: Hertz;
//! n = 1: linear) and unloads from its greatest compression along the steeper branch that gives back e^2 of the work
//! (Walton and Braun), so that one contact alone has exactly its restitution.  Neighbours whose gap closes during the
//! contact time take part, with their gap.  All contacts are advanced together: the answer does not depend on their
//! order.  The same idea in other variables: Liu, Zhao and Brogliato, Proc. R. Soc. A 464 (2008) 3193; Uchida, Sherman and
//! Delp, Proc. R. Soc. A 471 (2015) 20140859.

use super::body::Body;
use super::evolve::State;
use super::resolve::{Impact, Impulse, RestitutionLaw, Touch};
use super::world::{Coefficients, STRIKER};
use crate::geometry::Vec2;

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
    /// Hard plastic or wood of a few centimetres: contacts of a tenth of a millisecond.
    fn default() -> Self {
        Self {
            contact_time_s: 1e-4,
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
    arms: [[f64; 2]; 2],
    /// The speed at which it opens again if it must (m/s).
    pub(super) parting: f64,
    stiffness: f64,
    /// Compression now and at most (m); negative: still a gap.
    depth: f64,
    deepest: f64,
    /// The part of the slip that it may stop in a step, where several contacts hold one body.
    share: f64,
    /// Closing speed, slip and impulse of the present step, and whether it compressed as never before.
    speeds: [f64; 2],
    kick: Impulse,
    virgin: bool,
    /// Work of loading, and work of friction (J).
    loading: f64,
    rubbing: f64,
}

/// A body in a cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Member {
    /// Which body of the world.
    pub(crate) body: usize,
    pub(crate) before: State,
    pub(crate) after: State,
    inverse_mass: f64,
    inverse_inertia: f64,
}

/// Bodies whose contacts act together; its memory is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cluster {
    pub(crate) members: Vec<Member>,
    pub(crate) contacts: Vec<Contact>,
}

/// How a compliant impact ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// All contacts have opened.
    Parted,
    /// They would press for ever: something of prescribed motion squeezes them against something fixed.
    Squeezed,
}

/// Steps in the shortest contact time; twice as many change final positions by micrometres.
const STEPS: f64 = 48.0;
/// Sweeps to set apart what sank in: a body between two others comes free to a hundredth in as many.
const SETTING_SWEEPS: usize = 8;
/// A cluster that still presses after so many contact times is squeezed.
const LONGEST_IN_CONTACT_TIMES: f64 = 60.0;
/// Contact time of a Hertzian impact at e = 1: 2.9432 times greatest compression over approach speed.
const HERTZ_TIME: f64 = 2.943_275;

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
            stiffness: 0.0,
            share: 1.0,
            depth: -gap_m.max(0.0),
            deepest: 0.0,
            speeds: [0.0; 2],
            kick: Impulse::default(),
            virgin: false,
            loading: 0.0,
            rubbing: 0.0,
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

    /// Books the work of the last kick, with the mean of the speeds before and after it: exact for an impulse.
    fn account(&mut self, now: [f64; 2]) {
        let [closing, slip] = self.speeds;
        let Impulse { normal, tangent } = self.kick;
        if self.virgin {
            // Loading ends where the closing speed passes through zero.
            let part = if now[0] < 0.0 { closing * closing / (closing - now[0]) } else { closing + now[0] };
            self.loading += 0.5 * normal * part;
        }
        self.rubbing += 0.5 * tangent * (slip + now[1]);
    }

    /// The force at the present compression (N).
    fn force(&mut self, force: ContactForce) -> f64 {
        self.virgin = self.depth > self.deepest;
        let depth = if self.virgin {
            self.deepest = self.depth;
            self.depth
        } else {
            // The branch from the greatest compression back to what stays gives back e^2 of the work.
            let regained = self.coefficients.restitution * self.coefficients.restitution;
            let open = self.depth - self.deepest * (1.0 - regained);
            if open <= 0.0 {
                return 0.0;
            }
            open / regained
        };
        self.stiffness
            * match force {
                ContactForce::Hertz => depth * depth.sqrt(),
                ContactForce::Linear => depth,
            }
    }

    /// The step's impulse: the force's, and the friction that it allows against slip.
    fn press(&mut self, step_s: f64, force: ContactForce) {
        self.kick = Impulse::default();
        if self.depth <= 0.0 {
            self.virgin = false;
            return;
        }
        let normal = self.force(force) * step_s;
        let limit = self.coefficients.friction * normal;
        let sticking = self.share * (self.speeds[1] - self.impact.k_nt * normal) / self.impact.k_tt;
        self.kick = Impulse { normal, tangent: sticking.clamp(-limit, limit) };
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

    /// Resolves all contacts together; the first one is where the impact began.
    pub(crate) fn resolve(&mut self, first: &Impact, compliance: &Compliance, law: RestitutionLaw) -> End {
        let step_s = self.prepare(first, compliance);
        let longest = (LONGEST_IN_CONTACT_TIMES * compliance.contact_time_s / step_s) as usize;
        let mut end = End::Squeezed;
        for _ in 0..longest {
            if !self.step(step_s, compliance.force, law) {
                end = End::Parted;
                break;
            }
        }
        self.balance();
        end
    }

    /// Sets the stiffnesses; gives the time step (s).
    fn prepare(&mut self, first: &Impact, compliance: &Compliance) -> f64 {
        let (mass, speed) = (1.0 / first.k_nn, first.approach);
        let time_s = compliance.contact_time_s;
        let stiffness = match compliance.force {
            ContactForce::Hertz => {
                let depth = speed * time_s / HERTZ_TIME;
                1.25 * mass * speed * speed / (depth * depth * depth.sqrt())
            }
            ContactForce::Linear => mass * (std::f64::consts::PI / time_s).powi(2),
        };
        let members = &self.members;
        let ratio = |c: &Contact| {
            let with_striker = c.members.iter().any(|&i| members[i].body == STRIKER);
            if with_striker { compliance.striker_stiffness_ratio } else { 1.0 }
        };
        let holds = |i: usize| self.contacts.iter().filter(|c| c.members.contains(&i)).count();
        let holds: Vec<usize> = (0..members.len()).map(holds).collect();
        let first_ratio = ratio(&self.contacts[0]);
        let mut shortest: f64 = 1.0;
        for contact in &mut self.contacts {
            let lighter = mass * contact.impact.k_nn;
            let mut relative = ratio(contact) / first_ratio;
            if compliance.stiffness == Stiffness::SameContactTime {
                relative /= lighter;
            }
            contact.share = 1.0 / contact.members.into_iter().map(|i| holds[i]).fold(1, usize::max) as f64;
            contact.stiffness = stiffness * relative;
            shortest = shortest.max(relative * lighter);
        }
        // A contact's time goes with the square root (Hertz: the power 0.4) of mass over stiffness.
        time_s / STEPS / shortest.sqrt()
    }

    /// One step of the leapfrog, all contacts side by side; whether anything still presses.
    fn step(&mut self, step_s: f64, force: ContactForce, law: RestitutionLaw) -> bool {
        let mut pressing = false;
        for contact in &mut self.contacts {
            let now = contact.present_speeds(&self.members);
            contact.account(now);
            contact.speeds = now;
            let was_open = contact.depth <= 0.0 && contact.deepest == 0.0;
            contact.depth += now[0] * step_s;
            if was_open && contact.depth > 0.0 {
                let c = &mut contact.coefficients;
                c.restitution = law.restitution(c.restitution, now[0]);
            }
            contact.press(step_s, force);
            pressing |= contact.kick.normal > 0.0;
        }
        for k in 0..self.contacts.len() {
            self.kick(k, self.contacts[k].kick);
        }
        pressing
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

    /// Scales all impulses, by a part in a thousand, so that the energy lost is exactly what the contacts' laws say.
    ///
    /// With impulses s P the energy falls by `L s - B s^2`, which must be the losses D (or the most it can be), never
    /// less than nothing.
    fn balance(&mut self) {
        let (mut l, mut losses) = (0.0, 0.0);
        for c in &mut self.contacts {
            let kept = c.coefficients.restitution * c.coefficients.restitution;
            c.loss_j = (1.0 - kept) * c.loading + c.rubbing;
            losses += c.loss_j;
            l += c.impulse.normal * c.impact.approach + c.impulse.tangent * c.impact.slip;
        }
        let b: f64 = self.members.iter().map(Member::impulse_energy_j).sum();
        if b == 0.0 {
            return;
        }
        let exact = (l + (l * l - 4.0 * b * losses).max(0.0).sqrt()) / (2.0 * b);
        let scale = exact.clamp(0.9, 1.1).min(l / b);
        let lost = scale * (l - b * scale);
        self.scale(scale);
        for c in &mut self.contacts {
            c.loss_j *= if losses > 0.0 { lost / losses } else { 0.0 };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::object::Shape;
    use crate::physics::curve::SlideCurve;
    use crate::physics::shape::Plate;
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
