//! A second simulator that shares nothing with the first: no events, no roots, no clusters, only many small steps.
//!
//! Bodies are advanced in steps that get shorter the nearer two of them come, down to a least one.  Contacts have no
//! friction.  An overlap is either bounced off at once ([`Contact::Rigid`]) or pressed apart by springs that
//! are followed through the whole contact ([`Contact::Springs`]).  It is slow, and simple enough to be believed.

#![allow(dead_code)] // Each program that uses it uses its part.

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
    /// Restitution of a pair is the product of both bodies' bounces.
    pub(crate) bounce: f64,
    /// Mean distance of the support from the centroid (m).
    pub(crate) mean_arm_m: f64,
    pub(crate) outline: Outline,
    /// x, y (m), yaw (rad).
    pub(crate) pose: [f64; 3],
    /// Their rates of change.
    pub(crate) speed: [f64; 3],
}

/// A disc that runs along x and then is lifted.
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

/// What happens when bodies overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Contact {
    /// Their approach is turned round at once.
    Rigid,
    /// A spring presses them apart; it gives back the square of the restitution of its work.
    Springs {
        /// How long the first contact would last alone (s).
        contact_time_s: f64,
        /// Force over compression: 1 or 3/2 (Hertz).
        exponent: f64,
    },
}

/// The longest step (s): a free slide is followed this coarsely.
const LONGEST_STEP_S: f64 = 1e-4;
/// Nothing lasts longer (s).
const LONGEST_RUN_S: f64 = 10.0;
/// Impacts slower than this do not set the springs' stiffness (m/s): bodies that touch at rest.
const SLOWEST_FIRST_IMPACT_M_S: f64 = 1e-3;

/// Where everything comes to rest, followed in steps of `step_s` wherever bodies are close.
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

/// The bodies on their way; the striker is the first.
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

    /// How long nothing can come to touch: half of every gap over the greatest speed at which it can close.
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

    /// Half of the friction, half of the way, contacts, half of the way, half of the friction.
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
            for (place, speed) in body.pose.iter_mut().zip(body.speed) {
                *place += step_s * speed;
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

    /// The speed at which a pair closes along the normal, and what a unit impulse changes of it.
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

    /// An impulse on a body along the normal.
    fn push(&mut self, body: usize, impulse: f64, witness: &Witness) {
        let body = &mut self.bodies[body];
        let arm = witness.arm_m(body.pose);
        body.speed[0] += impulse * witness.normal[0] / body.mass_kg;
        body.speed[1] += impulse * witness.normal[1] / body.mass_kg;
        body.speed[2] += impulse * arm / body.inertia_kg_m2;
    }
}

/// The compression that counts: all of it while loading; while unloading, what is left over the part that stays, stretched
/// so that the work given back is the square of the restitution.
fn regained_m(depth_m: f64, deepest_m: f64, restitution: f64) -> f64 {
    if depth_m >= deepest_m {
        return depth_m;
    }
    let square = restitution * restitution;
    ((depth_m - deepest_m * (1.0 - square)) / square).max(0.0)
}

/// The stiffness at which a mass with a speed is stopped and thrown back in a time, without loss.
fn first_stiffness(mass_kg: f64, speed: f64, time_s: f64, exponent: f64) -> f64 {
    // The way of m x'' = -k x^n to its turning point takes half the time: x_max times the integral of 1 / sqrt(1 - s^(n+1)).
    let steps = 200_000;
    let part = |k: i32| {
        // s = 1 - q^2 takes away the root's pole at the end.
        let q = (f64::from(k) + 0.5) / f64::from(steps);
        2.0 * q / (1.0 - (1.0 - q * q).powf(exponent + 1.0)).sqrt() / f64::from(steps)
    };
    let integral: f64 = (0..steps).map(part).sum();
    let deepest_m = 0.5 * time_s * speed / integral;
    0.5 * (exponent + 1.0) * mass_kg * speed * speed / deepest_m.powf(exponent + 1.0)
}
