//! How do contacts that act at the same time separate bodies?
//!
//! The geometry is constant while every contact is a spring that loads with `F = k d^n` (n = 3/2: Hertz; n = 1: linear) and
//! unloads from its greatest compression along a steeper branch that returns e^2 of the work (Walton and Braun 1986), so that
//! one contact alone has exactly its restitution.  The leapfrog advances all contacts together: the result does not depend on
//! their order.

use crate::physics::impact::island::{Contact, Island, Member};
use crate::physics::impact::routh::{Impact, Impulse, RestitutionLaw};
use crate::physics::sliding::body::STRIKER;

/// Compliance of contacts that close at the same time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliance {
    /// Duration of the first contact if it were alone (s).
    pub contact_time_s: f64,
    /// Dependence of force on compression.
    pub force: ContactForce,
    /// Stiffness of the other contacts relative to the first.
    pub stiffness: Stiffness,
    /// Stiffness of contacts with the striker over that of contacts between objects.
    pub striker_stiffness_ratio: f64,
}

/// Dependence of force on compression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactForce {
    /// Power 3/2, as between elastic spheres (Hertz 1882).
    #[default]
    Hertz,
    /// Proportional.
    Linear,
}

/// Stiffness of contacts relative to each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stiffness {
    /// Equal for all contacts: the same material.
    #[default]
    Same,
    /// Proportional to the reduced mass, so that every contact alone has the same duration.
    SameContactTime,
}

impl Default for Compliance {
    /// Hard bodies of a few centimetres, with contacts of some ten microseconds.  The result for bodies that touch does not
    /// depend on the contact time, which only decides how small a gap must be for two contacts to act together.  The geometry is
    /// constant during the impact, which is exact for short contacts.
    fn default() -> Self {
        Self {
            contact_time_s: 3e-5,
            force: ContactForce::Hertz,
            stiffness: Stiffness::Same,
            striker_stiffness_ratio: 1.0,
        }
    }
}

/// Time steps in the shortest contact time; many more steps change final positions by a tenth of a millimetre.
const STEPS: f64 = 20.0;
/// An island whose contacts are still closed after this number of contact times is jammed: a body between two others a
/// hundred times as heavy bounces for ten.
const LONGEST_IN_CONTACT_TIMES: f64 = 60.0;
/// Contact time of a Hertzian impact at e = 1: 2.9432 times greatest compression over approach speed.
const HERTZ_TIME: f64 = 2.943_275;
/// The frequency of the leapfrog is too high by (omega h)^2 / 24.  Evaluating the force at a compression increased by
/// `h^2 a / 12`, a the present acceleration, removes this error (Takahashi and Imada, J. Phys. Soc. Jpn. 53 (1984) 3765); a is
/// extrapolated from the last two steps.
const LIFT: f64 = 1.0 / 12.0;
/// Least unloading stroke over maximum compression (e = 0.3): a steeper branch would need shorter steps, so for smaller e the
/// unloading force is reduced instead, which returns the same work.
const LEAST_UNLOADING: f64 = 0.09;

/// Greatest correction of the normal impulses that balances the energy, and that by which its effect is measured.
const MOST_CORRECTION: f64 = 0.1;
const TRIAL: f64 = 0.01;

/// How a compliant impact ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// All contacts have opened.
    Separated,
    /// Contacts stay closed for ever: a body of prescribed motion pushes members against a fixed body.
    Jammed,
}

/// Velocity x and y (m/s) and yaw rate (rad/s) of a member.
type Speeds = [f64; 3];

fn dot(a: &Speeds, b: &Speeds) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add(to: &mut Speeds, what: &Speeds, factor: f64) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += *what * factor;
    }
}

/// One contact as a spring with dry friction.
#[derive(Clone, Copy, Debug, Default)]
struct Spring {
    members: [usize; 2],
    /// Rows of the contact Jacobian: times the speeds of the members they give approach speed and slip.
    normal: [Speeds; 2],
    tangent: [Speeds; 2],
    /// Change of the members' speeds by a unit impulse along normal and tangent.
    normal_response: [Speeds; 2],
    tangent_response: [Speeds; 2],
    stiffness: f64,
    /// Unloading stroke / maximum compression.
    unloading_stroke: f64,
    /// Its inverse.
    inverse_unloading_stroke: f64,
    /// Unloading force / loading force at maximum compression.
    unloading_force_ratio: f64,
    /// Present compression (m); negative: a gap that is still open.
    compression: f64,
    /// Maximum compression so far (m).
    greatest_compression: f64,
    /// Whether the last step was on the loading branch (virgin loading).
    virgin: bool,
    /// Approach speed, its change, slip, slip at the first touch, and impulse of the last step.
    approach: f64,
    approach_change: f64,
    slip: f64,
    first_slip: f64,
    step_impulse: Impulse,
    impulse: Impulse,
    /// Contact friction, coupling of normal impulse and slip, and tangential impulse per slip that it may stop in one step.
    friction: f64,
    k_nt: f64,
    inverse_k_tt: f64,
    tangential_restitution: f64,
    /// Restitution, and the work of loading and of friction (J).
    restitution: f64,
    loading_work_j: f64,
    friction_work_j: f64,
}

/// Working memory of [`resolve`]: springs and speeds of an island, reused from impact to impact.
#[derive(Clone, Debug, Default)]
pub(crate) struct Springs {
    all: Vec<Spring>,
    speeds: Vec<Speeds>,
    changes: Vec<Speeds>,
    /// Number of contacts of each member.
    contact_counts: Vec<u32>,
}

impl Spring {
    fn new(contact: &Contact, members: &[Member], stiffness: f64, sharing_contacts: u32) -> Self {
        let [a, b] = contact.members.map(|i| &members[i]);
        let (n, t) = (contact.point.normal_ab, contact.point.normal_ab.perpendicular());
        let [arm_a, arm_b] = contact.arms;
        // The velocity omega x r of a point at r has the normal component omega (r x n), omega times the lever arm.
        let normal = [[n.x, n.y, arm_a[0]], [-n.x, -n.y, -arm_b[0]]];
        let tangent = [[t.x, t.y, arm_a[1]], [-t.x, -t.y, -arm_b[1]]];
        let response = |row: Speeds, m: &Member| {
            [-row[0] * m.inverse_mass, -row[1] * m.inverse_mass, -row[2] * m.inverse_inertia]
        };
        let impact = &contact.impact;
        let mut spring = Self {
            members: contact.members,
            normal,
            tangent,
            normal_response: [response(normal[0], a), response(normal[1], b)],
            tangent_response: [response(tangent[0], a), response(tangent[1], b)],
            stiffness,
            compression: contact.penetration_m.min(0.0),
            friction: contact.coefficients.friction,
            k_nt: impact.k_nt,
            tangential_restitution: contact.coefficients.tangential_restitution,
            inverse_k_tt: 1.0 / (impact.k_tt * f64::from(sharing_contacts)),
            ..Self::default()
        };
        spring.approach = contact.impact.approach;
        spring.set_restitution(contact.coefficients.restitution);
        spring
    }

    fn set_restitution(&mut self, restitution: f64) {
        let regained = restitution * restitution;
        self.restitution = restitution;
        self.unloading_stroke = regained.max(LEAST_UNLOADING);
        self.inverse_unloading_stroke = 1.0 / self.unloading_stroke;
        self.unloading_force_ratio = regained * self.inverse_unloading_stroke;
    }

    /// Adds the normal work of the last impulse, at the mean of the approach speeds before and after it: exact for an impulse.
    fn load(&mut self, now: f64, step_s: f64) {
        let before = self.approach;
        if now < 0.0 {
            // Loading ended where the approach speed was zero, between two steps, at a greater compression than at both.
            self.loading_work_j += 0.5 * self.step_impulse.normal * before * before / (before - now);
            let mean_approach = 0.5 * (before + now);
            self.greatest_compression += 0.5 * step_s * mean_approach * mean_approach / (before - now);
        } else {
            self.loading_work_j += 0.5 * self.step_impulse.normal * (before + now);
        }
    }

    /// The force at the present compression plus `lift` (N).
    fn force(&mut self, force: ContactForce, lift: f64) -> f64 {
        self.virgin = self.compression > self.greatest_compression;
        let (compression, stiffness) = if self.virgin {
            self.greatest_compression = self.compression;
            (self.compression + lift, self.stiffness)
        } else {
            let unloaded =
                self.compression + lift - self.greatest_compression * (1.0 - self.unloading_stroke);
            (unloaded * self.inverse_unloading_stroke, self.stiffness * self.unloading_force_ratio)
        };
        if compression <= 0.0 {
            return 0.0;
        }
        stiffness
            * match force {
                ContactForce::Hertz => compression * compression.sqrt(),
                ContactForce::Linear => compression,
            }
    }
}

impl Springs {
    fn clear(&mut self) {
        self.all.clear();
        self.speeds.clear();
        self.changes.clear();
        self.contact_counts.clear();
    }

    /// One step of the leapfrog for all springs together; whether any contact is still loaded.
    fn step(&mut self, step_s: f64, force: ContactForce, law: RestitutionLaw) -> bool {
        let Self { all, speeds, changes, .. } = self;
        let mut is_loaded = false;
        for spring in all {
            let [a, b] = spring.members;
            let now = dot(&spring.normal[0], &speeds[a]) + dot(&spring.normal[1], &speeds[b]);
            if spring.virgin {
                spring.load(now, step_s);
            }
            let approach_change = now - spring.approach;
            let lift = (2.0 * approach_change - spring.approach_change) * step_s * LIFT;
            spring.approach_change = approach_change;
            spring.approach = now;
            spring.compression += now * step_s;
            if spring.friction > 0.0 {
                let slip = dot(&spring.tangent[0], &speeds[a]) + dot(&spring.tangent[1], &speeds[b]);
                spring.friction_work_j += 0.5 * spring.step_impulse.tangent * (spring.slip + slip);
                spring.slip = slip;
                spring.step_impulse.tangent = 0.0;
            }
            if spring.compression <= 0.0 {
                spring.virgin = false;
                continue;
            }
            if spring.greatest_compression == 0.0 && law != RestitutionLaw::Constant {
                spring.set_restitution(law.restitution(spring.restitution, now));
            }
            let normal = spring.force(force, lift) * step_s;
            if normal <= 0.0 {
                continue;
            }
            is_loaded = true;
            if spring.impulse.normal == 0.0 {
                spring.first_slip = spring.slip;
            }
            spring.step_impulse.normal = normal;
            spring.impulse.normal += normal;
            add(&mut changes[a], &spring.normal_response[0], normal);
            add(&mut changes[b], &spring.normal_response[1], normal);
            if spring.friction > 0.0 {
                let limit = spring.friction * normal;
                // The given part of the slip at the first touch springs back.
                let excess = spring.slip + spring.tangential_restitution * spring.first_slip;
                let sticking = (excess - spring.k_nt * normal) * spring.inverse_k_tt;
                spring.step_impulse.tangent = sticking.min(limit).max(-limit);
                spring.impulse.tangent += spring.step_impulse.tangent;
                add(&mut changes[a], &spring.tangent_response[0], spring.step_impulse.tangent);
                add(&mut changes[b], &spring.tangent_response[1], spring.step_impulse.tangent);
            }
        }
        for (speeds, change) in speeds.iter_mut().zip(changes) {
            for (speed, change) in speeds.iter_mut().zip(change) {
                *speed += *change;
                *change = 0.0;
            }
        }
        is_loaded
    }
}

/// Resolves all contacts of an island together; `first` is the impact that started it.  The velocities of a jammed island have no meaning.
///
/// Without tangential restitution where the bodies would gain energy by it, as in an impact of two bodies.
pub(crate) fn resolve(
    island: &mut Island,
    springs: &mut Springs,
    first: &Impact,
    compliance: &Compliance,
    law: RestitutionLaw,
) -> Ending {
    let step_s = springs.prepare(island, first, compliance);
    let longest = (LONGEST_IN_CONTACT_TIMES * compliance.contact_time_s / step_s) as usize;
    let is_separated = (0..longest).any(|_| !springs.step(step_s, compliance.force, law));
    if !is_separated {
        return Ending::Jammed;
    }
    for (member, speeds) in island.members.iter_mut().zip(&springs.speeds) {
        (member.after.velocity.x, member.after.velocity.y) = (speeds[0], speeds[1]);
        member.after.yaw_rate_rad_s = speeds[2];
    }
    for (contact, spring) in island.contacts.iter_mut().zip(&springs.all) {
        contact.impulse = spring.impulse;
        let returned = spring.restitution * spring.restitution;
        contact.loss_j = ((1.0 - returned) * spring.loading_work_j + spring.friction_work_j).max(0.0);
    }
    let lost_j = island.lost_energy_j();
    let gains_energy = lost_j < 0.0 && island.greatest_scale() < 1.0 - MOST_CORRECTION;
    if gains_energy && island.remove_tangential_restitution() {
        return resolve(island, springs, first, compliance, law);
    }
    balance_energy(island, lost_j);
    Ending::Separated
}

impl Springs {
    /// Makes a spring of each contact; returns the time step (s).
    fn prepare(&mut self, island: &Island, first: &Impact, compliance: &Compliance) -> f64 {
        let (mass, speed) = (1.0 / first.k_nn, first.approach);
        let time_s = compliance.contact_time_s;
        let stiffness = match compliance.force {
            ContactForce::Hertz => {
                let compression = speed * time_s / HERTZ_TIME;
                1.25 * mass * speed * speed / (compression * compression * compression.sqrt())
            }
            ContactForce::Linear => mass * (std::f64::consts::PI / time_s).powi(2),
        };
        let (springs, Island { members, contacts }) = (self, island);
        springs.clear();
        springs.contact_counts.resize(members.len(), 0);
        for index in contacts.iter().flat_map(|c| c.members) {
            springs.contact_counts[index] += 1;
        }
        for member in members {
            let state = &member.before;
            springs.speeds.push([state.velocity.x, state.velocity.y, state.yaw_rate_rad_s]);
            springs.changes.push([0.0; 3]);
        }
        let ratio = |c: &Contact| {
            let with_striker = c.members.iter().any(|&i| members[i].body == STRIKER);
            if with_striker { compliance.striker_stiffness_ratio } else { 1.0 }
        };
        let first_ratio = ratio(&contacts[0]);
        let mut stiffest: f64 = 1.0;
        for contact in contacts {
            let relative_inverse_mass = mass * contact.impact.k_nn;
            let mut relative = ratio(contact) / first_ratio;
            if compliance.stiffness == Stiffness::SameContactTime {
                relative /= relative_inverse_mass;
            }
            let sharing_contacts =
                contact.members.into_iter().map(|i| springs.contact_counts[i]).fold(1, u32::max);
            springs.all.push(Spring::new(contact, members, stiffness * relative, sharing_contacts));
            stiffest = stiffest.max(relative * relative_inverse_mass);
        }
        // The contact time is proportional to (mass / stiffness)^(1/2); Hertz: to the power 0.4, for which 3/8 is a bound.
        let root = stiffest.sqrt();
        let times =
            if compliance.force == ContactForce::Hertz { root.sqrt() * root.sqrt().sqrt() } else { root };
        time_s / STEPS / times
    }
}

/// Scales the normal impulses, by about 1e-3, so that the energy lost, `lost_j` so far, is the sum of the losses of all contacts.
///
/// The work of friction is exact in the discrete steps, that of unloading is not. With normal impulses `(1 + s) P` the energy lost is
/// `E + G s - B s^2`, G the sum of the impulses times the approach speeds after the impact. It must equal the losses, or its maximum if they are
/// larger, and must not be negative.
fn balance_energy(island: &mut Island, lost_j: f64) {
    let losses_j: f64 = island.contacts.iter().map(|c| c.loss_j).sum();
    let slope: f64 =
        island.contacts.iter().map(|c| c.impulse.normal * c.present_speeds(&island.members)[0]).sum();
    island.scale_normal(1.0 + TRIAL);
    let curvature = (lost_j + slope * TRIAL - island.lost_energy_j()) / (TRIAL * TRIAL);
    if curvature <= 0.0 {
        return;
    }
    let root = (slope * slope - 4.0 * curvature * (losses_j - lost_j)).max(0.0).sqrt().copysign(-slope);
    let exact = ((slope + root) / (2.0 * curvature)).clamp(-MOST_CORRECTION, MOST_CORRECTION);
    island.scale_normal((1.0 + exact) / (1.0 + TRIAL));
    let balanced_j = island.lost_energy_j();
    if balanced_j < 0.0 {
        island.scale(island.greatest_scale());
    }
    for c in &mut island.contacts {
        c.loss_j *= if losses_j > 0.0 { balanced_j.max(0.0) / losses_j } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Pose, Vec2};
    use crate::object::Shape;
    use crate::physics::contact::compound_shape::CompoundShape;
    use crate::physics::impact::routh::{ContactPoint, ImpactLaw};
    use crate::physics::pair_coefficients::Coefficients;
    use crate::physics::sliding::body::Body;
    use crate::physics::sliding::motion::{BodyState, State};
    use crate::physics::sliding::slide_curve::SlideCurve;
    use std::sync::Arc;

    const RADIUS_M: f64 = 0.03;

    fn disc(mass: f64) -> Body {
        Body {
            shape: Arc::new(CompoundShape::new(&Shape::Disc { radius_m: RADIUS_M })),
            pose: Pose::default(),
            inverse_mass: 1.0 / mass,
            inverse_inertia: 2.0 / (mass * RADIUS_M * RADIUS_M),
            friction_deceleration_m_s2: 1.0,
            patch_radius_m: RADIUS_M,
            curve: Arc::new(SlideCurve::new(0.5)),
            limit_surface: None,
            tilt_m_s2: Vec2::ZERO,
            kind: 1,
        }
    }

    /// Velocities after the impact of touching discs (mass, x and y in radii), of which the first moves along x at 1 m/s.
    fn after(discs: &[(f64, f64, f64)], restitution: f64, compliance: &Compliance) -> Vec<Vec2> {
        let coefficients = Coefficients { restitution, ..Coefficients::default() };
        let members = after_impact(discs, coefficients, compliance).members;
        members.iter().map(|m| m.after.velocity).collect()
    }

    fn after_impact(
        discs: &[(f64, f64, f64)],
        coefficients: Coefficients,
        compliance: &Compliance,
    ) -> Island {
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
        let mut island = Island::default();
        island.members.extend((0..discs.len()).map(|k| Member::new(k + 1, &bodies[k], &states[k])));
        for i in 0..discs.len() {
            for k in i + 1..discs.len() {
                let offset = states[k].position - states[i].position;
                if offset.length() < 2.0 * RADIUS_M + 1e-9 {
                    let normal_ab = offset / offset.length();
                    let point = ContactPoint { point: states[i].position + normal_ab * RADIUS_M, normal_ab };
                    let pair = [i, k].map(|n| BodyState { body: &bodies[n], state: &states[n] });
                    island.contacts.push(Contact::new([i, k], pair, point, 0.0, coefficients));
                }
            }
        }
        let first = island.contacts[0].impact;
        let ending =
            resolve(&mut island, &mut Springs::default(), &first, compliance, RestitutionLaw::Constant);
        assert_eq!(ending, Ending::Separated);
        island
    }

    fn row(masses: &[f64]) -> Vec<(f64, f64, f64)> {
        masses.iter().enumerate().map(|(k, &m)| (m, 2.0 * k as f64, 0.0)).collect()
    }

    fn linear() -> Compliance {
        Compliance { force: ContactForce::Linear, ..Compliance::default() }
    }

    #[test]
    fn slip_that_sticks_springs_back_as_in_an_impact_of_two_bodies() {
        for tangential_restitution in [-0.5, 0.0, 0.3] {
            let coefficients = Coefficients { restitution: 0.7, friction: 2.0, tangential_restitution };
            let island =
                after_impact(&[(0.1, 0.0, 0.0), (0.2, 1.6, 1.2)], coefficients, &Compliance::default());
            let contact = &island.contacts[0];
            let alone = contact.impact.impulse(&coefficients, ImpactLaw::Stronge);
            let off = (contact.impulse.tangent / alone.tangent - 1.0).abs();
            assert!(
                off < 0.01,
                "{tangential_restitution}: {} and {} N s",
                contact.impulse.tangent,
                alone.tangent
            );
        }
    }

    /// The island of a disc that hits a disc of 1 kg with a slip (m/s) at a point at which the normal impulse changes the slip as well.
    fn oblique_impact(slip: f64, coefficients: Coefficients) -> Island {
        let bodies = [1.0, 0.064].map(disc);
        let velocity = Vec2::new(-0.246, -slip);
        let states =
            [State::default(), State { velocity, position: Point::new(0.05, 0.02), ..State::default() }];
        let mut island = Island::default();
        island.members.extend((0..2).map(|k| Member::new(k + 1, &bodies[k], &states[k])));
        let point = ContactPoint { point: Point::new(0.02, 0.0), normal_ab: Vec2::new(1.0, 0.0) };
        let pair = [0, 1].map(|n| BodyState { body: &bodies[n], state: &states[n] });
        island.contacts.push(Contact::new([0, 1], pair, point, 0.0, coefficients));
        island
    }

    #[test]
    fn one_contact_alone_has_the_impulse_of_two_bodies_at_any_slip() {
        // At the second value the bodies would gain energy by a slip that the impact leaves: both impulses are the rigid ones.
        for (tangential_restitution, slips) in [(0.0, -15..=15), (-0.95, -15..=-11)] {
            for slip in slips.map(|k| 0.1 * f64::from(k)) {
                let coefficients = Coefficients { restitution: 0.79, friction: 0.31, tangential_restitution };
                let mut island = oblique_impact(slip, coefficients);
                let first = island.contacts[0].impact;
                let alone = first.impulse(&coefficients, ImpactLaw::Stronge);
                let law = RestitutionLaw::Constant;
                resolve(&mut island, &mut Springs::default(), &first, &Compliance::default(), law);
                let found = island.contacts[0].impulse;
                let off = (found.normal - alone.normal).abs().max((found.tangent - alone.tangent).abs())
                    / alone.normal;
                assert!(off < 0.01, "slip {slip} m/s: {found:?} and {alone:?}");
                assert!(island.lost_energy_j() > 0.0);
            }
        }
    }

    #[test]
    fn one_contact_alone_has_exactly_its_restitution() {
        for compliance in [Compliance::default(), linear()] {
            for (mass, e) in [(0.008, 0.7), (0.143, 0.455), (1.0, 1.0), (0.5, 0.05), (0.3, 0.0)] {
                let v = after(&row(&[mass, 0.1]), e, &compliance);
                let separation_speed = v[1].x - v[0].x;
                assert!((separation_speed - e).abs() < 1e-6, "{mass} kg, e = {e}: {separation_speed}");
            }
        }
    }

    #[test]
    fn newtons_cradles_of_springs_give_the_speeds_of_a_general_solver() {
        // Expected: the same springs integrated in ten thousand steps by a general solver.
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
    fn a_disc_hitting_two_touching_ones_separates_them_symmetrically() {
        let third = 3f64.sqrt();
        let v = after(&[(1.0, 0.0, 0.0), (1.0, third, 1.0), (1.0, third, -1.0)], 1.0, &Compliance::default());
        assert!((v[1].x - 0.6).abs() < 1e-3 && (v[1] - Vec2::new(v[2].x, -v[2].y)).length() < 1e-15, "{v:?}");
    }
}
