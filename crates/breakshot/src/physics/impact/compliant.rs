//! How do contacts that act at the same time push bodies apart?
//!
//! The geometry stands still while every contact is a spring that loads with `F = k d^n` (n = 3/2: Hertz; n = 1: linear) and
//! unloads from its greatest compression along the steeper branch that gives back e^2 of the work (Walton and Braun), so
//! that one contact alone has exactly its restitution.  The leapfrog advances all of them side by side: the answer does not
//! depend on their order.

use crate::physics::impact::island::{Cluster, Compliance, Contact, ContactForce, Member, Stiffness};
use crate::physics::impact::routh::{Impact, Impulse, RestitutionLaw};
use crate::physics::world::STRIKER;

/// Steps in the shortest contact time; many more change final positions by a tenth of a millimetre.
const STEPS: f64 = 20.0;
/// A cluster that still presses after so many contact times is squeezed: a body between two others a hundred times as heavy
/// bounces for ten.
const LONGEST_IN_CONTACT_TIMES: f64 = 60.0;
/// Contact time of a Hertzian impact at e = 1: 2.9432 times greatest compression over approach speed.
const HERTZ_TIME: f64 = 2.943_275;
/// The leapfrog swings too fast by (omega h)^2 / 24.  With the force taken where the contact would be `h^2 a / 12` on, a its
/// present acceleration, it does not (Takahashi and Imada, J. Phys. Soc. Jpn. 53 (1984) 3765); a comes from the last two steps.
const LIFT: f64 = 1.0 / 12.0;
/// Least part of the compression over which a contact unloads (e = 0.3): a steeper branch would need shorter steps, so below
/// it the force drops instead, and the work given back is the same.
const LEAST_UNLOADING: f64 = 0.09;

/// How a compliant impact ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// All contacts have opened.
    Parted,
    /// They would press for ever: something of prescribed motion squeezes them against something fixed.
    Squeezed,
}

/// Velocity x, y and rate of turn of a member.
type Speeds = [f64; 3];

fn dot(a: &Speeds, b: &Speeds) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn add(to: &mut Speeds, what: &Speeds, factor: f64) {
    for (to, what) in to.iter_mut().zip(what) {
        *to += *what * factor;
    }
}

/// One contact as a spring.
#[derive(Clone, Copy, Debug, Default)]
struct Spring {
    members: [usize; 2],
    /// Closing speed and slip are these times the members' speeds.
    normal: [Speeds; 2],
    tangent: [Speeds; 2],
    /// What a unit impulse along normal and tangent does to the members' speeds.
    push: [Speeds; 2],
    rub: [Speeds; 2],
    stiffness: f64,
    /// Part of the compression over which it unloads, one over it, and the force there over that of loading.
    unloading: f64,
    per_unloading: f64,
    drop: f64,
    /// Compression now and at most (m); negative: still a gap.
    depth: f64,
    deepest: f64,
    /// Whether it was compressed in the last step as never before.
    virgin: bool,
    /// Closing speed, its change, slip and impulse of the last step.
    closing: f64,
    change: f64,
    slip: f64,
    kick: Impulse,
    impulse: Impulse,
    /// Contact friction, its coupling, and the part of the slip that it may stop in a step.
    friction: f64,
    k_nt: f64,
    per_k_tt: f64,
    /// Restitution, and the work of loading and of friction (J).
    restitution: f64,
    loading: f64,
    rubbing: f64,
}

/// The springs and speeds of a cluster; the memory is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct Springs {
    all: Vec<Spring>,
    speeds: Vec<Speeds>,
    changes: Vec<Speeds>,
    /// How many contacts each member has.
    holds: Vec<u32>,
}

impl Spring {
    fn new(contact: &Contact, members: &[Member], stiffness: f64, held: u32) -> Self {
        let [a, b] = contact.members.map(|i| &members[i]);
        let (n, t) = (contact.touch.normal_ab, contact.touch.normal_ab.perpendicular());
        let [arm_a, arm_b] = contact.arms;
        // A point at r moves at omega x r: along the normal that is omega times the arm, (r x n).
        let normal = [[n.x, n.y, arm_a[0]], [-n.x, -n.y, -arm_b[0]]];
        let tangent = [[t.x, t.y, arm_a[1]], [-t.x, -t.y, -arm_b[1]]];
        let taken = |row: Speeds, m: &Member| {
            [-row[0] * m.inverse_mass, -row[1] * m.inverse_mass, -row[2] * m.inverse_inertia]
        };
        let impact = &contact.impact;
        let mut spring = Self {
            members: contact.members,
            normal,
            tangent,
            push: [taken(normal[0], a), taken(normal[1], b)],
            rub: [taken(tangent[0], a), taken(tangent[1], b)],
            stiffness,
            depth: contact.sunk_m.min(0.0),
            friction: contact.coefficients.friction,
            k_nt: impact.k_nt,
            per_k_tt: 1.0 / (impact.k_tt * f64::from(held)),
            ..Self::default()
        };
        spring.closing = contact.impact.approach;
        spring.set_restitution(contact.coefficients.restitution);
        spring
    }

    fn set_restitution(&mut self, restitution: f64) {
        let regained = restitution * restitution;
        self.restitution = restitution;
        self.unloading = regained.max(LEAST_UNLOADING);
        self.per_unloading = 1.0 / self.unloading;
        self.drop = regained * self.per_unloading;
    }

    /// Books the normal work of the last kick, with the mean of the speeds before and after it: exact for an impulse.
    fn load(&mut self, now: f64, step_s: f64) {
        let before = self.closing;
        if now < 0.0 {
            // Loading ended where the closing speed passed through zero; between two steps it was deeper still.
            self.loading += 0.5 * self.kick.normal * before * before / (before - now);
            let mean = 0.5 * (before + now);
            self.deepest += 0.5 * step_s * mean * mean / (before - now);
        } else {
            self.loading += 0.5 * self.kick.normal * (before + now);
        }
    }

    /// The force at the present compression, looking ahead by `lift` (N).
    fn force(&mut self, force: ContactForce, lift: f64) -> f64 {
        self.virgin = self.depth > self.deepest;
        let (depth, stiffness) = if self.virgin {
            self.deepest = self.depth;
            (self.depth + lift, self.stiffness)
        } else {
            let open = self.depth + lift - self.deepest * (1.0 - self.unloading);
            (open * self.per_unloading, self.stiffness * self.drop)
        };
        if depth <= 0.0 {
            return 0.0;
        }
        stiffness
            * match force {
                ContactForce::Hertz => depth * depth.sqrt(),
                ContactForce::Linear => depth,
            }
    }
}

impl Springs {
    fn clear(&mut self) {
        self.all.clear();
        self.speeds.clear();
        self.changes.clear();
        self.holds.clear();
    }

    /// One step of the leapfrog, all springs side by side; whether anything still presses.
    fn step(&mut self, step_s: f64, force: ContactForce, law: RestitutionLaw) -> bool {
        let Self { all, speeds, changes, .. } = self;
        let mut pressing = false;
        for spring in all {
            let [a, b] = spring.members;
            let now = dot(&spring.normal[0], &speeds[a]) + dot(&spring.normal[1], &speeds[b]);
            if spring.virgin {
                spring.load(now, step_s);
            }
            let change = now - spring.closing;
            let lift = (2.0 * change - spring.change) * step_s * LIFT;
            spring.change = change;
            spring.closing = now;
            spring.depth += now * step_s;
            if spring.friction > 0.0 {
                let slip = dot(&spring.tangent[0], &speeds[a]) + dot(&spring.tangent[1], &speeds[b]);
                spring.rubbing += 0.5 * spring.kick.tangent * (spring.slip + slip);
                spring.slip = slip;
                spring.kick.tangent = 0.0;
            }
            if spring.depth <= 0.0 {
                spring.virgin = false;
                continue;
            }
            if spring.deepest == 0.0 && law != RestitutionLaw::Constant {
                spring.set_restitution(law.restitution(spring.restitution, now));
            }
            let normal = spring.force(force, lift) * step_s;
            if normal <= 0.0 {
                continue;
            }
            pressing = true;
            spring.kick.normal = normal;
            spring.impulse.normal += normal;
            add(&mut changes[a], &spring.push[0], normal);
            add(&mut changes[b], &spring.push[1], normal);
            if spring.friction > 0.0 {
                let limit = spring.friction * normal;
                let sticking = (spring.slip - spring.k_nt * normal) * spring.per_k_tt;
                spring.kick.tangent = sticking.min(limit).max(-limit);
                spring.impulse.tangent += spring.kick.tangent;
                add(&mut changes[a], &spring.rub[0], spring.kick.tangent);
                add(&mut changes[b], &spring.rub[1], spring.kick.tangent);
            }
        }
        for (speeds, change) in speeds.iter_mut().zip(changes) {
            for (speed, change) in speeds.iter_mut().zip(change) {
                *speed += *change;
                *change = 0.0;
            }
        }
        pressing
    }
}

impl Cluster {
    /// Resolves all contacts together; the first one is where the impact began.  What is squeezed is left as it was.
    pub(crate) fn resolve(&mut self, first: &Impact, compliance: &Compliance, law: RestitutionLaw) -> End {
        let step_s = self.prepare(first, compliance);
        let longest = (LONGEST_IN_CONTACT_TIMES * compliance.contact_time_s / step_s) as usize;
        let parted = (0..longest).any(|_| !self.springs.step(step_s, compliance.force, law));
        if !parted {
            return End::Squeezed;
        }
        for (member, speeds) in self.members.iter_mut().zip(&self.springs.speeds) {
            (member.after.velocity.x, member.after.velocity.y) = (speeds[0], speeds[1]);
            member.after.yaw_rate_rad_s = speeds[2];
        }
        for (contact, spring) in self.contacts.iter_mut().zip(&self.springs.all) {
            contact.impulse = spring.impulse;
            let kept = spring.restitution * spring.restitution;
            contact.loss_j = ((1.0 - kept) * spring.loading + spring.rubbing).max(0.0);
        }
        self.balance();
        End::Parted
    }

    /// Makes the springs; gives the time step (s).
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
        let Self { members, contacts, springs } = self;
        springs.clear();
        springs.holds.resize(members.len(), 0);
        for index in contacts.iter().flat_map(|c| c.members) {
            springs.holds[index] += 1;
        }
        for member in members.iter() {
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
        for contact in contacts.iter() {
            let lighter = mass * contact.impact.k_nn;
            let mut relative = ratio(contact) / first_ratio;
            if compliance.stiffness == Stiffness::SameContactTime {
                relative /= lighter;
            }
            let held = contact.members.into_iter().map(|i| springs.holds[i]).fold(1, u32::max);
            springs.all.push(Spring::new(contact, members, stiffness * relative, held));
            stiffest = stiffest.max(relative * lighter);
        }
        // A contact's time goes with the square root of mass over stiffness; Hertz: to the power 0.4, bounded by 3/8.
        let root = stiffest.sqrt();
        let times =
            if compliance.force == ContactForce::Hertz { root.sqrt() * root.sqrt().sqrt() } else { root };
        time_s / STEPS / times
    }

    /// Scales all impulses, by a part in a thousand, so that the energy lost is exactly what the contacts' laws say.
    ///
    /// With impulses s P the energy falls by `L s - B s^2`, which must be the losses D (or the most it can be), never
    /// less than nothing.
    fn balance(&mut self) {
        let losses: f64 = self.contacts.iter().map(|c| c.loss_j).sum();
        let l: f64 = self
            .contacts
            .iter()
            .map(|c| c.impulse.normal * c.impact.approach + c.impulse.tangent * c.impact.slip)
            .sum();
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
