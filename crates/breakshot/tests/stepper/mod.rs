//! A second simulator that has no code in common with the first: no events, no roots, no islands, only small time steps.
//!
//! The steps become shorter as two bodies come closer, down to a least step.  Contacts have no friction.  An overlap is resolved
//! in one step ([`Contact::Rigid`]) or by springs that are integrated through the whole contact ([`Contact::Springs`]).  The
//! simulator is slow and simple, so that it can be verified by reading.

#![allow(dead_code)] // Each program uses some of the functions.

pub(crate) mod outline;
pub(crate) mod patch;
pub(crate) mod read;

use outline::{Outline, Witness};
use patch::Patch;

pub(crate) const GRAVITY_M_S2: f64 = 9.81;

/// A body that slides on the table.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub(crate) mass_kg: f64,
    pub(crate) inertia_kg_m2: f64,
    /// Friction against the table.
    pub(crate) friction: f64,
    /// Factor of restitution: that of a pair is the product of both.
    pub(crate) bounce: f64,
    /// Mean distance of the support from the centroid (m).
    pub(crate) mean_arm_m: f64,
    pub(crate) outline: Outline,
    /// x, y (m), yaw (rad).
    pub(crate) pose: [f64; 3],
    /// Rates of change of the pose.
    pub(crate) speed: [f64; 3],
}

/// A disc that moves along x and is then lifted.
#[derive(Clone, Debug)]
pub(crate) struct Striker {
    pub(crate) radius_m: f64,
    pub(crate) start_m: [f64; 2],
    pub(crate) speed_m_s: f64,
    pub(crate) travel_m: f64,
    pub(crate) bounce: f64,
}

/// A pile and a strike.
#[derive(Clone, Debug)]
pub(crate) struct Pile {
    pub(crate) name: String,
    pub(crate) striker: Striker,
    pub(crate) bodies: Vec<Body>,
}

/// How an overlap is resolved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Contact {
    /// The approach speed is reversed in one step.
    Rigid,
    /// A spring separates the bodies; it returns e^2 of its work.
    Springs {
        /// Duration of the first contact if it were alone (s).
        contact_time_s: f64,
        /// Exponent of the force over compression: 1 or 3/2 (Hertz).
        exponent: f64,
    },
}

/// Longest time step, for free slides (s).
const LONGEST_STEP_S: f64 = 1e-4;
/// Longest simulated time (s).
const LONGEST_RUN_S: f64 = 10.0;
/// Least speed of the first impact (m/s), which defines the stiffness of the springs.
const SLOWEST_FIRST_IMPACT_M_S: f64 = 1e-3;

/// Final poses of all bodies, in steps of `step_s` where bodies are close.
pub(crate) fn settled(pile: &Pile, contact: Contact, step_s: f64) -> Vec<[f64; 3]> {
    let mut run = Run::new(pile, contact);
    let mut time_s = 0.0;
    while time_s < LONGEST_RUN_S && !run.at_rest() {
        let mut step = run.safe_step_s().clamp(step_s, LONGEST_STEP_S);
        if run.striking {
            step = step.min((run.lift_s - time_s).max(1e-12));
        }
        run.step(step);
        time_s += step;
        if run.striking && time_s >= run.lift_s - 1e-12 {
            run.striking = false;
        }
    }
    run.bodies.iter().skip(1).map(|b| b.pose).collect()
}

/// The state of a simulation; the striker is the first body.
struct Run {
    bodies: Vec<Body>,
    patches: Patch,
    contact: Contact,
    /// Whether the striker is still on the table, and until when.
    striking: bool,
    lift_s: f64,
    /// The greatest compression so far of each pair (m).
    deepest_m: Vec<f64>,
    stiffness: Option<f64>,
}

impl Run {
    fn new(pile: &Pile, contact: Contact) -> Self {
        let striker = Body {
            mass_kg: f64::INFINITY,
            inertia_kg_m2: f64::INFINITY,
            friction: 0.0,
            bounce: pile.striker.bounce,
            mean_arm_m: 1.0,
            outline: Outline::Disc(pile.striker.radius_m),
            pose: [pile.striker.start_m[0], pile.striker.start_m[1], 0.0],
            speed: [pile.striker.speed_m_s, 0.0, 0.0],
        };
        let bodies: Vec<Body> = std::iter::once(striker).chain(pile.bodies.iter().cloned()).collect();
        Self {
            deepest_m: vec![0.0; bodies.len() * bodies.len()],
            bodies,
            patches: Patch::new(),
            contact,
            striking: true,
            lift_s: pile.striker.travel_m / pile.striker.speed_m_s,
            stiffness: None,
        }
    }

    fn at_rest(&self) -> bool {
        !self.striking && self.bodies.iter().skip(1).all(|b| b.speed == [0.0; 3])
    }

    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (first, n) = (usize::from(!self.striking), self.bodies.len());
        (first..n).flat_map(move |i| (i + 1..n).map(move |k| (i, k)))
    }

    /// A time in which no bodies touch (s): half of each gap over the greatest speed at which it can close.
    fn safe_step_s(&self) -> f64 {
        let mut safe_s = f64::INFINITY;
        for (i, k) in self.pairs() {
            let (a, b) = (&self.bodies[i], &self.bodies[k]);
            let apart_m = (b.pose[0] - a.pose[0]).hypot(b.pose[1] - a.pose[1]);
            let mut gap_m = apart_m - a.outline.reach_m() - b.outline.reach_m();
            if gap_m <= 0.0 {
                gap_m = outline::witness((&a.outline, a.pose), (&b.outline, b.pose)).gap_m;
            }
            let closing = (a.speed[0] - b.speed[0]).hypot(a.speed[1] - b.speed[1])
                + a.speed[2].abs() * a.outline.reach_m()
                + b.speed[2].abs() * b.outline.reach_m();
            if closing > 0.0 {
                safe_s = safe_s.min(0.5 * gap_m.max(0.0) / closing);
            }
        }
        safe_s
    }

    /// One step: half of the friction, half of the motion, contacts, half of the motion, half of the friction.
    fn step(&mut self, step_s: f64) {
        self.rub(0.5 * step_s);
        self.drift(0.5 * step_s);
        for (i, k) in self.pairs() {
            let (a, b) = (&self.bodies[i], &self.bodies[k]);
            let reach_m = a.outline.reach_m() + b.outline.reach_m();
            if (b.pose[0] - a.pose[0]).hypot(b.pose[1] - a.pose[1]) > reach_m {
                self.deepest_m[i * self.bodies.len() + k] = 0.0;
                continue;
            }
            let witness = outline::witness((&a.outline, a.pose), (&b.outline, b.pose));
            self.touch((i, k), &witness, step_s);
        }
        self.drift(0.5 * step_s);
        self.rub(0.5 * step_s);
    }

    fn drift(&mut self, step_s: f64) {
        for body in self.bodies.iter_mut().skip(usize::from(!self.striking)) {
            for (coordinate, speed) in body.pose.iter_mut().zip(body.speed) {
                *coordinate += step_s * speed;
            }
        }
    }

    fn rub(&mut self, step_s: f64) {
        for body in self.bodies.iter_mut().skip(1) {
            self.patches.rub(body, step_s);
        }
    }

    fn touch(&mut self, (i, k): (usize, usize), witness: &Witness, step_s: f64) {
        let pair = i * self.bodies.len() + k;
        if witness.gap_m > 0.0 {
            self.deepest_m[pair] = 0.0;
            return;
        }
        let restitution = self.bodies[i].bounce * self.bodies[k].bounce;
        let (closing, softness) = self.closing(i, k, witness);
        let impulse = match self.contact {
            Contact::Rigid if closing > 0.0 => (1.0 + restitution) * closing / softness,
            Contact::Rigid => 0.0,
            Contact::Springs { contact_time_s, exponent } => {
                let stiffness = match self.stiffness {
                    None if closing > SLOWEST_FIRST_IMPACT_M_S => {
                        first_stiffness(1.0 / softness, closing, contact_time_s, exponent)
                    }
                    known => known.unwrap_or(0.0),
                };
                if stiffness > 0.0 {
                    self.stiffness = Some(stiffness);
                }
                let depth_m = -witness.gap_m;
                self.deepest_m[pair] = self.deepest_m[pair].max(depth_m);
                step_s * stiffness * regained_m(depth_m, self.deepest_m[pair], restitution).powf(exponent)
            }
        };
        self.push(i, -impulse, witness);
        self.push(k, impulse, witness);
    }

    /// Approach speed of a pair along the normal, and its change by a unit impulse.
    fn closing(&self, i: usize, k: usize, witness: &Witness) -> (f64, f64) {
        let n = witness.normal;
        let along = |body: &Body| {
            let arm = witness.arm_m(body.pose);
            let speed = body.speed[0] * n[0] + body.speed[1] * n[1] + body.speed[2] * arm;
            (speed, 1.0 / body.mass_kg + arm * arm / body.inertia_kg_m2)
        };
        let ((of_a, soft_a), (of_b, soft_b)) = (along(&self.bodies[i]), along(&self.bodies[k]));
        (of_a - of_b, soft_a + soft_b)
    }

    /// Applies an impulse along the normal to a body.
    fn push(&mut self, body: usize, impulse: f64, witness: &Witness) {
        let body = &mut self.bodies[body];
        let arm = witness.arm_m(body.pose);
        body.speed[0] += impulse * witness.normal[0] / body.mass_kg;
        body.speed[1] += impulse * witness.normal[1] / body.mass_kg;
        body.speed[2] += impulse * arm / body.inertia_kg_m2;
    }
}

/// Effective compression (m): the whole one while loading; while unloading, reduced and scaled so that e^2 of the work is
/// returned.
fn regained_m(depth_m: f64, deepest_m: f64, restitution: f64) -> f64 {
    if depth_m >= deepest_m {
        return depth_m;
    }
    let square = restitution * restitution;
    ((depth_m - deepest_m * (1.0 - square)) / square).max(0.0)
}

/// The stiffness at which an elastic impact of a mass with a speed has a given duration.
fn first_stiffness(mass_kg: f64, speed: f64, time_s: f64, exponent: f64) -> f64 {
    // The motion m x'' = -k x^n reaches x_max in half the time: x_max / speed times the integral of 1 / sqrt(1 - s^(n+1)).
    let steps = 200_000;
    let term = |k: i32| {
        // The substitution s = 1 - q^2 removes the pole of the integrand at the end.
        let q = (f64::from(k) + 0.5) / f64::from(steps);
        2.0 * q / (1.0 - (1.0 - q * q).powf(exponent + 1.0)).sqrt() / f64::from(steps)
    };
    let integral: f64 = (0..steps).map(term).sum();
    let deepest_m = 0.5 * time_s * speed / integral;
    0.5 * (exponent + 1.0) * mass_kg * speed * speed / deepest_m.powf(exponent + 1.0)
}
