//! What are the velocities of two bodies after one impact?

use crate::error::bounds::positive;
use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::physics::impact::routh::{ContactPoint, Impact, ImpactLaw, Impulse, InverseInertia};
use crate::physics::pair_coefficients::Coefficients;
use crate::physics::sliding::motion::State;

/// A rigid body at the instant of an impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactBody {
    /// Mass (kg, or in any unit common to both bodies).
    pub mass_kg: f64,
    /// Radius of gyration about the centroid (m); see [`Shape::radius_of_gyration_m`](crate::object::Shape::radius_of_gyration_m).
    pub gyration_m: f64,
    /// Position of the centroid.
    pub position: Point,
    /// Velocity of the centroid.
    pub velocity: Vec2,
    /// Yaw rate (rad/s).
    pub yaw_rate_rad_s: f64,
}

/// Point, normal and coefficients of an impact of two bodies.
///
/// ```
/// use breakshot::geometry::{Point, Vec2};
/// use breakshot::physics::{ImpactBody, ImpactLaw, PairImpact};
///
/// let (position, normal_ab) = (Point::ORIGIN, Vec2::new(1.0, 0.0));
/// let a = ImpactBody {
///     mass_kg: 0.1,
///     gyration_m: 0.02,
///     position,
///     velocity: Vec2::new(0.8, 0.0),
///     yaw_rate_rad_s: 0.0,
/// };
/// let b = ImpactBody { position: Point::new(0.06, 0.0), velocity: Vec2::ZERO, ..a };
/// let point = Point::new(0.03, 0.0);
/// let impact = PairImpact { point, normal_ab, restitution: 0.5, friction: 0.2, tangential_restitution: 0.0, law: ImpactLaw::Stronge };
/// let [a, b] = impact.after([a, b])?;
/// assert!((b.velocity.x - a.velocity.x - 0.5 * 0.8).abs() < 1e-12, "separation speed in m/s");
/// # Ok::<(), breakshot::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairImpact {
    /// Point of contact.
    pub point: Point,
    /// Unit vector from the first body to the second.
    pub normal_ab: Vec2,
    /// Restitution, 0 to 1.
    pub restitution: f64,
    /// Contact friction.
    pub friction: f64,
    /// Tangential restitution, -1 to 1: the part of the slip that springs back where the contact sticks; 0 for rigid bodies.
    pub tangential_restitution: f64,
    /// Condition at which the impact ends.
    pub law: ImpactLaw,
}

impl PairImpact {
    /// Both bodies after the impact; unchanged if they do not approach each other.
    ///
    /// # Errors
    /// Masses or radii that are not positive, a restitution outside 0..1, negative friction, a normal that is no unit vector.
    pub fn after(&self, [a, b]: [ImpactBody; 2]) -> Result<[ImpactBody; 2]> {
        self.check(&[a, b])?;
        let point = ContactPoint { point: self.point, normal_ab: self.normal_ab };
        let impact = Impact::between((a.inertia(), &a.state()), (b.inertia(), &b.state()), &point);
        if impact.approach <= 0.0 {
            return Ok([a, b]);
        }
        let coefficients = Coefficients {
            restitution: self.restitution,
            friction: self.friction,
            tangential_restitution: self.tangential_restitution,
        };
        let Impulse { normal, tangent } = impact.impulse(&coefficients, self.law);
        let on_b = self.normal_ab * normal + self.normal_ab.perpendicular() * tangent;
        Ok([a.state_after_impulse(self.point, -on_b), b.state_after_impulse(self.point, on_b)])
    }

    fn check(&self, bodies: &[ImpactBody; 2]) -> Result<()> {
        let owner = "impact";
        for body in bodies {
            positive(owner, "mass_kg", body.mass_kg)?;
            positive(owner, "gyration_m", body.gyration_m)?;
            if !(body.position.is_finite() && body.velocity.is_finite() && body.yaw_rate_rad_s.is_finite()) {
                return Err(Error::invalid(owner, "a body's motion", "not a number", "numbers"));
            }
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(Error::invalid(owner, "restitution", self.restitution, "a number from 0 to 1"));
        }
        if !(self.friction >= 0.0 && self.friction.is_finite()) {
            return Err(Error::invalid(owner, "friction", self.friction, "zero or more"));
        }
        if !(-1.0..=1.0).contains(&self.tangential_restitution) {
            let found = self.tangential_restitution;
            return Err(Error::invalid(owner, "tangential_restitution", found, "a number from -1 to 1"));
        }
        let length = self.normal_ab.length();
        if !((length - 1.0).abs() < UNIT_TOLERANCE && self.point.is_finite()) {
            return Err(Error::invalid(owner, "length of the normal", length, "1"));
        }
        Ok(())
    }
}

/// Error of the length of a unit vector.
const UNIT_TOLERANCE: f64 = 1e-9;

impl ImpactBody {
    fn inertia(&self) -> InverseInertia {
        let inverse_mass = 1.0 / self.mass_kg;
        InverseInertia { inverse_mass, inverse_inertia: inverse_mass / (self.gyration_m * self.gyration_m) }
    }

    fn state(&self) -> State {
        State {
            position: self.position,
            velocity: self.velocity,
            yaw_rad: 0.0,
            yaw_rate_rad_s: self.yaw_rate_rad_s,
        }
    }

    fn state_after_impulse(self, point: Point, impulse: Vec2) -> Self {
        let InverseInertia { inverse_mass, inverse_inertia } = self.inertia();
        Self {
            velocity: self.velocity + impulse * inverse_mass,
            yaw_rate_rad_s: self.yaw_rate_rad_s + (point - self.position).cross(impulse) * inverse_inertia,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(x: f64, speed: f64) -> ImpactBody {
        ImpactBody {
            mass_kg: 0.03,
            gyration_m: 0.025 / 2f64.sqrt(),
            position: Point::new(x, 0.0),
            velocity: Vec2::new(speed, 0.4),
            yaw_rate_rad_s: 0.0,
        }
    }

    fn head_on(restitution: f64, friction: f64) -> PairImpact {
        let (point, normal_ab) = (Point::new(0.025, 0.0), Vec2::new(1.0, 0.0));
        PairImpact {
            point,
            normal_ab,
            restitution,
            friction,
            tangential_restitution: 0.0,
            law: ImpactLaw::Stronge,
        }
    }

    #[test]
    fn equal_discs_exchange_their_normal_speeds() {
        let (a, mut b) = (disc(0.0, 0.5), disc(0.05, 0.0));
        b.velocity = Vec2::ZERO;
        let [a, b] = head_on(1.0, 0.0).after([a, b]).expect("possible");
        assert!((a.velocity - Vec2::new(0.0, 0.4)).length() < 1e-15, "{a:?}");
        assert!((b.velocity - Vec2::new(0.5, 0.0)).length() < 1e-15, "{b:?}");
    }

    #[test]
    fn discs_that_stick_have_no_slip_after_the_impact() {
        let (a, mut b) = (disc(0.0, 0.5), disc(0.05, 0.0));
        b.velocity = Vec2::ZERO;
        let [a, b] = head_on(0.7, 2.0).after([a, b]).expect("possible");
        let slip = a.velocity.y + 0.025 * a.yaw_rate_rad_s - (b.velocity.y - 0.025 * b.yaw_rate_rad_s);
        assert!(slip.abs() < 1e-14, "{slip} m/s");
        // Sticking removes the slip with an inverse tangential mass of 3/m + 3/m.
        assert!((b.velocity.y - 0.4 / 6.0).abs() < 1e-14, "{} m/s", b.velocity.y);
    }

    #[test]
    fn a_part_of_the_slip_springs_back_or_remains() {
        let (a, mut b) = (disc(0.0, 0.5), disc(0.05, 0.0));
        b.velocity = Vec2::ZERO;
        for tangential_restitution in [-0.4, 0.3] {
            let sprung = PairImpact { tangential_restitution, ..head_on(0.7, 2.0) };
            let [a, b] = sprung.after([a, b]).expect("possible");
            let slip = a.velocity.y + 0.025 * a.yaw_rate_rad_s - (b.velocity.y - 0.025 * b.yaw_rate_rad_s);
            // The slip before is 0.4 m/s.
            assert!((slip + tangential_restitution * 0.4).abs() < 1e-14, "{slip} m/s");
        }
        // Contact points that slide to the end are not affected.
        let sliding = PairImpact { tangential_restitution: 0.3, ..head_on(0.7, 0.01) };
        let rigid = head_on(0.7, 0.01).after([a, b]).expect("possible");
        assert_eq!(sliding.after([a, b]).expect("possible"), rigid);
    }

    #[test]
    fn impossible_input_is_an_error_that_names_it() {
        let parting = [disc(0.0, -0.5), disc(0.05, 0.0)];
        assert_eq!(head_on(0.7, 0.2).after(parting).expect("possible"), parting);
        for (impact, word) in [
            (head_on(1.5, 0.2), "restitution"),
            (head_on(0.5, -0.2), "friction"),
            (PairImpact { tangential_restitution: 1.5, ..head_on(0.5, 0.2) }, "tangential_restitution"),
            (PairImpact { normal_ab: Vec2::ZERO, ..head_on(0.5, 0.2) }, "normal"),
        ] {
            let error = impact.after(parting).expect_err("impossible").to_string();
            assert!(error.contains(word), "{error}");
        }
        let massless = ImpactBody { mass_kg: 0.0, ..disc(0.0, 0.5) };
        let error = head_on(0.5, 0.2).after([massless, parting[1]]).expect_err("impossible").to_string();
        assert!(error.contains("mass_kg"), "{error}");
    }
}
