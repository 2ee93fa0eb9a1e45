//! What does one impact do to two bodies?
//!
//! Routh's method in the plane (Routh 1905): the normal impulse p grows from zero, the contact slips (friction on its cone)
//! until it sticks or slips in reverse, the approach speed decreases through zero (end of compression), and a law of restitution
//! decides when the impact ends.  Stronge ("Unraveling paradoxical theories", J. Appl. Mech. 58 (1991) 1049): the work
//! regained is e^2 times the work of compression, so no energy is gained.  Poisson: the impulse regained is e times the
//! impulse of compression.  Newton: the separation speed is e times the approach speed, which can gain energy where slip
//! reverses.  Wang and Mason, J. Appl. Mech. 59 (1992) 635, list the cases.

use crate::geometry::{Point, Vec2};
use crate::physics::pair_coefficients::Coefficients;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{BodyState, State};
use serde::{Deserialize, Serialize};

/// Condition at which an impact ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImpactLaw {
    /// Work regained = e^2 times work of compression.
    #[default]
    Stronge,
    /// Impulse regained = e times impulse of compression.
    Poisson,
    /// Separation speed = e times approach speed.
    Newton,
    /// Eq. 17 to 23 of the paper as printed, for comparison: they can gain energy and leave bodies approaching.
    Paper,
}

/// Dependence of restitution on the normal approach speed v.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RestitutionLaw {
    /// None: e is constant.
    #[default]
    Constant,
    /// `e (v / v_ref)^-exponent`, at most 1; the exponent is 1/4 for plastic impacts at high speed (Johnson 1985).
    Power {
        /// Speed at which e was measured (m/s).
        reference_speed_m_s: f64,
        /// Exponent, 0 to 1.
        exponent: f64,
    },
    /// `1 - (1 - e) (v / v_ref)^(1/5)`, the first-order law of viscoelastic spheres (Ramirez et al. 1999).
    Viscoelastic {
        /// Speed at which e was measured (m/s).
        reference_speed_m_s: f64,
    },
}

impl RestitutionLaw {
    /// Restitution at a normal approach speed (m/s), from 0 to 1; `measured` is e at the reference speed.
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

/// Point and direction of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactPoint {
    /// Position in the table frame.
    pub(crate) point: Point,
    /// Unit vector from a to b.
    pub(crate) normal_ab: Vec2,
}

/// Relative velocity of two bodies at a contact, and its change by an impulse.
///
/// Relative means a minus b.  The impulse acts on b: p along the normal, q along the tangent, which is the normal rotated by
/// 90 degrees counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Impact {
    /// Approach speed along the normal and slip along the tangent (m/s).
    pub(crate) approach: f64,
    pub(crate) slip: f64,
    /// Inverse mass matrix at the contact: normal, coupling, tangent (1/kg).
    pub(crate) k_nn: f64,
    pub(crate) k_nt: f64,
    pub(crate) k_tt: f64,
}

/// Inverse mass and inertia of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct InverseInertia {
    /// 1 / mass.
    pub(crate) inverse_mass: f64,
    /// 1 / moment of inertia about the centroid.
    pub(crate) inverse_inertia: f64,
}

impl InverseInertia {
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

/// The velocity of a point of a body.
pub(crate) fn point_velocity(state: &State, point: Point) -> Vec2 {
    state.velocity + (point - state.position).perpendicular() * state.yaw_rate_rad_s
}

impl Impact {
    /// Two bodies with their states as they contact.
    pub(crate) fn new(a: BodyState, b: BodyState, contact: &ContactPoint) -> Self {
        Self::between((InverseInertia::of(a.body), a.state), (InverseInertia::of(b.body), b.state), contact)
    }

    /// Two inertias with their states as they contact.
    pub(crate) fn between(
        a: (InverseInertia, &State),
        b: (InverseInertia, &State),
        contact: &ContactPoint,
    ) -> Self {
        let (n, t) = (contact.normal_ab, contact.normal_ab.perpendicular());
        let relative = point_velocity(a.1, contact.point) - point_velocity(b.1, contact.point);
        let (ra, rb) = (contact.point - a.1.position, contact.point - b.1.position);
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
    pub(crate) fn impulse(&self, coefficients: &Coefficients, law: ImpactLaw) -> Impulse {
        let &Coefficients { restitution, friction, tangential_restitution } = coefficients;
        if law == ImpactLaw::Paper {
            return self.impulse_of_the_paper(restitution, friction);
        }
        if friction == 0.0 {
            // Without friction the three laws are equal (Eq. 17).
            return Impulse { normal: (1.0 + restitution) * self.approach / self.k_nn, tangent: 0.0 };
        }
        let rigid = self.routh(restitution, friction, law);
        if tangential_restitution == 0.0 { rigid } else { self.sprung(rigid, coefficients) }
    }

    /// The impulse with tangential restitution: the slip after the impact is minus it times the slip before (Walton and Braun 1986), as the
    /// separation speed is e times the approach speed, within the cone of friction.
    ///
    /// Both impulses grow in proportion, so that the laws of restitution agree. With slip s, approach speed v and
    /// `g = (1 + e_t) s / ((1 + e) v)` their ratio is `(g k_nn - k_nt) / (k_tt - g k_nt)`. The rigid impulse is returned where the bodies would gain
    /// energy or still approach.
    fn sprung(&self, rigid: Impulse, coefficients: &Coefficients) -> Impulse {
        let &Coefficients { restitution, friction, tangential_restitution } = coefficients;
        let slip_per_approach =
            (1.0 + tangential_restitution) * self.slip / ((1.0 + restitution) * self.approach);
        let sticking =
            (slip_per_approach * self.k_nn - self.k_nt) / (self.k_tt - slip_per_approach * self.k_nt);
        let ratio = sticking.clamp(-friction, friction);
        let normal = (1.0 + restitution) * self.approach / (self.k_nn + self.k_nt * ratio);
        let sprung = Impulse { normal, tangent: ratio * normal };
        // A slip that friction cannot stop goes on.
        let is_opposed = ratio == sticking || ratio * self.slip >= 0.0;
        if is_opposed && normal > 0.0 && normal.is_finite() && self.work(sprung) <= 0.0 {
            sprung
        } else {
            rigid
        }
    }

    /// The energy that an impulse adds to both bodies (J).
    fn work(&self, impulse: Impulse) -> f64 {
        let Impulse { normal: p, tangent: q } = impulse;
        0.5 * (self.k_nn * p * p + self.k_tt * q * q) + self.k_nt * p * q - self.approach * p - self.slip * q
    }

    /// The normal impulse at which the first slip ends, and tangential over normal impulse before and after it.
    fn friction_path(&self, friction: f64) -> (f64, f64, f64) {
        let sign = if self.slip < 0.0 { -1.0 } else { 1.0 };
        let slip_reduction = friction * self.k_tt + sign * self.k_nt;
        let sticking = -self.k_nt / self.k_tt;
        // The contact sticks if the friction cone allows it, and slips in reverse otherwise.
        let after = sticking.clamp(-friction, friction);
        if self.slip == 0.0 {
            return (0.0, after, after);
        }
        let end = if slip_reduction > 0.0 { self.slip.abs() / slip_reduction } else { f64::INFINITY };
        (end, sign * friction, after)
    }

    fn routh(&self, restitution: f64, friction: f64, law: ImpactLaw) -> Impulse {
        let (slip_end, before, after) = self.friction_path(friction);
        let path = ImpulsePath {
            approach: self.approach,
            slip_end,
            slopes: [self.k_nn + self.k_nt * before, self.k_nn + self.k_nt * after],
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
        let frictionless = (1.0 + restitution) * self.approach / self.k_nn;
        let speed = self.approach.hypot(self.slip);
        let normal = frictionless * self.approach / speed;
        let limit = friction * normal;
        Impulse { normal, tangent: (frictionless * self.slip / speed).clamp(-limit, limit) }
    }
}

/// The approach speed as a function of the normal impulse: two lines that join where the first slip ends.
struct ImpulsePath {
    approach: f64,
    slip_end: f64,
    slopes: [f64; 2],
}

impl ImpulsePath {
    /// The normal impulse at the end of compression.
    fn compression(&self) -> f64 {
        let at_slip_end = self.approach - self.slopes[0] * self.slip_end;
        if at_slip_end < 0.0 || self.slip_end == f64::INFINITY {
            return self.approach / self.slopes[0];
        }
        self.slip_end + at_slip_end / self.slopes[1]
    }

    /// The work of compression (J).
    fn work(&self, compression: f64) -> f64 {
        if compression <= self.slip_end {
            return 0.5 * self.approach * compression;
        }
        let at_slip_end = self.approach - self.slopes[0] * self.slip_end;
        0.5 * (self.approach + at_slip_end) * self.slip_end
            + 0.5 * at_slip_end * (compression - self.slip_end)
    }

    /// The normal impulse at which a work has been regained.
    fn end_by_work(&self, compression: f64, work: f64) -> f64 {
        if compression >= self.slip_end {
            return compression + (2.0 * work / self.slopes[1]).sqrt();
        }
        let slipping = self.slip_end - compression;
        let regained = 0.5 * self.slopes[0] * slipping * slipping;
        if work <= regained {
            return compression + (2.0 * work / self.slopes[0]).sqrt();
        }
        let speed = self.slopes[0] * slipping;
        let remaining_work = work - regained;
        self.slip_end
            + 2.0 * remaining_work / (speed + (speed * speed + 2.0 * self.slopes[1] * remaining_work).sqrt())
    }

    /// The normal impulse at which the bodies separate with a speed.
    fn end_by_speed(&self, compression: f64, speed: f64) -> f64 {
        if compression >= self.slip_end {
            return compression + speed / self.slopes[1];
        }
        let at_slip_end = self.slopes[0] * (self.slip_end - compression);
        if speed <= at_slip_end {
            return compression + speed / self.slopes[0];
        }
        self.slip_end + (speed - at_slip_end) / self.slopes[1]
    }
}

/// The state of a body after an impulse on it at a point.
pub(crate) fn state_after_impulse(body: &Body, state: &State, point: Point, impulse: Vec2) -> State {
    let arm = point - state.position;
    State {
        velocity: state.velocity + impulse * body.inverse_mass,
        yaw_rate_rad_s: state.yaw_rate_rad_s + arm.cross(impulse) * body.inverse_inertia,
        ..*state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_restitutions_are_ratios_of_velocities_where_the_normal_impulse_causes_slip() {
        let impact = Impact { approach: 1.0, slip: 0.3, k_nn: 2.0, k_nt: 0.5, k_tt: 3.0 };
        for law in [ImpactLaw::Stronge, ImpactLaw::Poisson, ImpactLaw::Newton] {
            let coefficients = Coefficients { restitution: 0.6, friction: 2.0, tangential_restitution: -0.4 };
            let Impulse { normal, tangent } = impact.impulse(&coefficients, law);
            let approach = impact.approach - impact.k_nn * normal - impact.k_nt * tangent;
            let slip = impact.slip - impact.k_nt * normal - impact.k_tt * tangent;
            assert!(
                (approach + 0.6).abs() < 1e-12 && (slip - 0.4 * 0.3).abs() < 1e-12,
                "{approach}, {slip} m/s"
            );
        }
    }

    #[test]
    fn friction_bounds_the_impulse_of_contacts_that_spring_back() {
        let impact = Impact { approach: 1.0, slip: 0.9, k_nn: 2.0, k_nt: -0.4, k_tt: 3.0 };
        let coefficients = Coefficients { restitution: 0.6, friction: 0.1, tangential_restitution: 0.3 };
        let Impulse { normal, tangent } = impact.impulse(&coefficients, ImpactLaw::Stronge);
        assert!((tangent - 0.1 * normal).abs() < 1e-12, "{tangent} and {normal} N s");
        assert!(impact.work(Impulse { normal, tangent }) <= 0.0);
    }
}
