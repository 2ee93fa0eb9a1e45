//! What does one impact do to two bodies?
//!
//! Routh's method in the plane: the normal impulse p grows from zero, the contact slips (friction on its cone) until it
//! sticks or slips back, the normal speed falls through zero (end of compression), and a law says when the impact ends.
//! Stronge ("Unraveling paradoxical theories", J. Appl. Mech. 58 (1991) 1049): the work regained is e^2 times the work
//! of compression, so energy is never made; Poisson: the impulse regained is e times the one of compression; Newton: the
//! normal speed after is e times the one before, which can make energy where slip reverses.  Wang and Mason, J. Appl.
//! Mech. 59 (1992) 635, list the cases.

use crate::geometry::{Point, Vec2};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::State;
use serde::{Deserialize, Serialize};

/// When an impact ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpactLaw {
    /// Work regained = e^2 times work of compression.
    #[default]
    Stronge,
    /// Impulse regained = e times impulse of compression.
    Poisson,
    /// Normal speed after = e times before.
    Newton,
    /// Eq. 17 to 23 of the paper as printed, for comparison: they can make energy and leave bodies approaching.
    Paper,
}

/// How restitution depends on the normal approach speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RestitutionLaw {
    /// Not at all.
    #[default]
    Constant,
    /// `e (v / v_ref)^-exponent`: 1/4 for plastic impacts at high speed.
    Power {
        /// The speed at which e was measured (m/s).
        reference_speed_m_s: f64,
        /// The exponent.
        exponent: f64,
    },
    /// `1 - (1 - e) (v / v_ref)^(1/5)`, the first term for viscoelastic spheres (Ramirez et al., 1999).
    Viscoelastic {
        /// The speed at which e was measured (m/s).
        reference_speed_m_s: f64,
    },
}

impl RestitutionLaw {
    /// Restitution at a normal approach speed (m/s), between 0 and 1.
    pub fn restitution(self, measured: f64, speed_m_s: f64) -> f64 {
        match self {
            Self::Constant => measured,
            Self::Power { reference_speed_m_s, exponent } => {
                (measured * (speed_m_s / reference_speed_m_s).powf(-exponent)).clamp(0.0, 1.0)
            }
            Self::Viscoelastic { reference_speed_m_s } => {
                (1.0 - (1.0 - measured) * (speed_m_s / reference_speed_m_s).powf(0.2)).clamp(0.0, 1.0)
            }
        }
    }
}

/// Where and in which direction two bodies touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// The place.
    pub(crate) point: Point,
    /// Unit vector from a to b.
    pub(crate) normal_ab: Vec2,
}

/// The two bodies at a contact: their relative velocity, and how an impulse changes it.
///
/// Relative means a minus b; the impulse (p along the normal, q along the tangent, the normal turned left) acts on b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Impact {
    /// Approach speed along the normal and slip along the tangent (m/s).
    pub(crate) approach: f64,
    pub(crate) slip: f64,
    /// Inverse inertia felt at the contact: normal, coupling, tangent (1/kg).
    pub(crate) k_nn: f64,
    pub(crate) k_nt: f64,
    pub(crate) k_tt: f64,
}

/// How little a body resists an impulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Inertia {
    /// One over the mass.
    pub(crate) inverse_mass: f64,
    /// One over the moment of inertia about the centroid.
    pub(crate) inverse_inertia: f64,
}

impl Inertia {
    pub(crate) fn of(body: &Body) -> Self {
        Self { inverse_mass: body.inverse_mass, inverse_inertia: body.inverse_inertia }
    }
}

/// An impulse at a contact: along the normal and along the tangent (N s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Impulse {
    pub(crate) normal: f64,
    pub(crate) tangent: f64,
}

/// The velocity of a body's point.
pub(crate) fn velocity_at(state: &State, point: Point) -> Vec2 {
    state.velocity + (point - state.position).perpendicular() * state.yaw_rate_rad_s
}

impl Impact {
    /// Two bodies with their states as they touch.
    pub(crate) fn new(a: (&Body, &State), b: (&Body, &State), touch: &Touch) -> Self {
        Self::between((Inertia::of(a.0), a.1), (Inertia::of(b.0), b.1), touch)
    }

    /// Two inertias with their states as they touch.
    pub(crate) fn between(a: (Inertia, &State), b: (Inertia, &State), touch: &Touch) -> Self {
        let (n, t) = (touch.normal_ab, touch.normal_ab.perpendicular());
        let relative = velocity_at(a.1, touch.point) - velocity_at(b.1, touch.point);
        let (ra, rb) = (touch.point - a.1.position, touch.point - b.1.position);
        let arms = |r: Vec2| (r.cross(n), r.cross(t));
        let ((an, at), (bn, bt)) = (arms(ra), arms(rb));
        let (ia, ib) = (a.0.inverse_inertia, b.0.inverse_inertia);
        let mass = a.0.inverse_mass + b.0.inverse_mass;
        Self {
            approach: relative.dot(n),
            slip: relative.dot(t),
            k_nn: mass + (an * an * ia + bn * bn * ib),
            k_nt: an * at * ia + bn * bt * ib,
            k_tt: mass + (at * at * ia + bt * bt * ib),
        }
    }

    /// The impulse on b of an impact with restitution e and contact friction mu.
    pub(crate) fn impulse(&self, restitution: f64, friction: f64, law: ImpactLaw) -> Impulse {
        if law == ImpactLaw::Paper {
            return self.impulse_of_the_paper(restitution, friction);
        }
        if friction == 0.0 {
            // Without friction the three laws agree (Eq. 17).
            return Impulse { normal: (1.0 + restitution) * self.approach / self.k_nn, tangent: 0.0 };
        }
        self.routh(restitution, friction, law)
    }

    /// The normal impulse at which the first slip ends, and friction over normal impulse before and after it.
    fn friction_path(&self, friction: f64) -> (f64, f64, f64) {
        let sign = if self.slip < 0.0 { -1.0 } else { 1.0 };
        let braking = friction * self.k_tt + sign * self.k_nt;
        let sticking = -self.k_nt / self.k_tt;
        // The contact sticks if friction can hold it, else it slips back.
        let after = sticking.clamp(-friction, friction);
        if self.slip == 0.0 {
            return (0.0, after, after);
        }
        let end = if braking > 0.0 { self.slip.abs() / braking } else { f64::INFINITY };
        (end, sign * friction, after)
    }

    fn routh(&self, restitution: f64, friction: f64, law: ImpactLaw) -> Impulse {
        let (slip_end, before, after) = self.friction_path(friction);
        let path = Path {
            start: self.approach,
            corner: slip_end,
            fall: [self.k_nn + self.k_nt * before, self.k_nn + self.k_nt * after],
        };
        let compression = path.compression();
        let end = match law {
            ImpactLaw::Stronge => {
                path.end_by_work(compression, restitution * restitution * path.work(compression))
            }
            ImpactLaw::Poisson => (1.0 + restitution) * compression,
            ImpactLaw::Newton | ImpactLaw::Paper => {
                path.end_by_speed(compression, restitution * self.approach)
            }
        };
        let slipping = end.min(slip_end);
        Impulse { normal: end, tangent: before * slipping + after * (end - slipping) }
    }

    /// Eq. 17 to 23 as printed: the frictionless impulse F, `F_n = F cos(alpha)`, `F_t = F sin(alpha)`, alpha between the
    /// relative velocity and the normal.
    fn impulse_of_the_paper(&self, restitution: f64, friction: f64) -> Impulse {
        let whole = (1.0 + restitution) * self.approach / self.k_nn;
        let speed = self.approach.hypot(self.slip);
        let normal = whole * self.approach / speed;
        let limit = friction * normal;
        Impulse { normal, tangent: (whole * self.slip / speed).clamp(-limit, limit) }
    }
}

/// The normal approach speed over the normal impulse: it falls evenly, with a corner where the first slip ends.
struct Path {
    start: f64,
    corner: f64,
    fall: [f64; 2],
}

impl Path {
    /// The impulse at which the approach ends.
    fn compression(&self) -> f64 {
        let at_corner = self.start - self.fall[0] * self.corner;
        if at_corner < 0.0 || self.corner == f64::INFINITY {
            return self.start / self.fall[0];
        }
        self.corner + at_corner / self.fall[1]
    }

    /// The work of compression (J).
    fn work(&self, compression: f64) -> f64 {
        if compression <= self.corner {
            return 0.5 * self.start * compression;
        }
        let at_corner = self.start - self.fall[0] * self.corner;
        0.5 * (self.start + at_corner) * self.corner + 0.5 * at_corner * (compression - self.corner)
    }

    /// The impulse at which a work has been regained.
    fn end_by_work(&self, compression: f64, work: f64) -> f64 {
        if compression >= self.corner {
            return compression + (2.0 * work / self.fall[1]).sqrt();
        }
        let slipping = self.corner - compression;
        let regained = 0.5 * self.fall[0] * slipping * slipping;
        if work <= regained {
            return compression + (2.0 * work / self.fall[0]).sqrt();
        }
        let speed = self.fall[0] * slipping;
        let missing = work - regained;
        self.corner + 2.0 * missing / (speed + (speed * speed + 2.0 * self.fall[1] * missing).sqrt())
    }

    /// The impulse at which the bodies part with a speed.
    fn end_by_speed(&self, compression: f64, speed: f64) -> f64 {
        if compression >= self.corner {
            return compression + speed / self.fall[1];
        }
        let at_corner = self.fall[0] * (self.corner - compression);
        if speed <= at_corner {
            return compression + speed / self.fall[0];
        }
        self.corner + (speed - at_corner) / self.fall[1]
    }
}

/// A body's state after an impulse on it at a point.
pub(crate) fn struck(body: &Body, state: &State, point: Point, impulse: Vec2) -> State {
    let arm = point - state.position;
    State {
        velocity: state.velocity + impulse * body.inverse_mass,
        yaw_rate_rad_s: state.yaw_rate_rad_s + arm.cross(impulse) * body.inverse_inertia,
        ..*state
    }
}
