//! One impact by itself: what the simulator makes of two bodies that meet with known velocities.

use crate::error::{Error, Result};
use crate::geometry::{Point, Vec2};
use crate::object::positive;
use crate::physics::impact::routh::{Impact, ImpactLaw, Impulse, Inertia, Touch};
use crate::physics::sliding::motion::State;

/// A body as an impact meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mover {
    /// Its mass (kg, or over any unit that both bodies share).
    pub mass_kg: f64,
    /// Its radius of gyration about the centroid (m); see [`Shape::radius_of_gyration_m`](crate::object::Shape::radius_of_gyration_m).
    pub gyration_m: f64,
    /// Its centroid.
    pub position: Point,
    /// Velocity of the centroid.
    pub velocity: Vec2,
    /// Rate of turn (rad/s).
    pub yaw_rate_rad_s: f64,
}

/// Where and how two bodies meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encounter {
    /// Where they touch.
    pub point: Point,
    /// Unit vector from the first body to the second.
    pub normal_ab: Vec2,
    /// Restitution, 0 to 1.
    pub restitution: f64,
    /// Contact friction.
    pub friction: f64,
    /// When the impact ends.
    pub law: ImpactLaw,
}

impl Encounter {
    /// Both bodies after the impact; unchanged if they already part.
    ///
    /// # Errors
    /// Masses or radii that are not positive, a restitution outside 0..1, negative friction, a normal that is no unit vector.
    pub fn after(&self, [a, b]: [Mover; 2]) -> Result<[Mover; 2]> {
        self.check(&[a, b])?;
        let touch = Touch { point: self.point, normal_ab: self.normal_ab };
        let impact = Impact::between((a.inertia(), &a.state()), (b.inertia(), &b.state()), &touch);
        if impact.approach <= 0.0 {
            return Ok([a, b]);
        }
        let Impulse { normal, tangent } = impact.impulse(self.restitution, self.friction, self.law);
        let on_b = self.normal_ab * normal + self.normal_ab.perpendicular() * tangent;
        Ok([a.struck(self.point, -on_b), b.struck(self.point, on_b)])
    }

    fn check(&self, movers: &[Mover; 2]) -> Result<()> {
        let owner = "encounter";
        for mover in movers {
            positive(owner, "mass_kg", mover.mass_kg)?;
            positive(owner, "gyration_m", mover.gyration_m)?;
            if !(mover.position.is_finite() && mover.velocity.is_finite() && mover.yaw_rate_rad_s.is_finite())
            {
                return Err(Error::invalid(owner, "a body's motion", "not a number", "numbers"));
            }
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(Error::invalid(owner, "restitution", self.restitution, "a number from 0 to 1"));
        }
        if !(self.friction >= 0.0 && self.friction.is_finite()) {
            return Err(Error::invalid(owner, "friction", self.friction, "zero or more"));
        }
        let length = self.normal_ab.length();
        if !((length - 1.0).abs() < UNIT_TOLERANCE && self.point.is_finite()) {
            return Err(Error::invalid(owner, "length of the normal", length, "1"));
        }
        Ok(())
    }
}

/// A unit vector made by a division is this good.
const UNIT_TOLERANCE: f64 = 1e-9;

impl Mover {
    fn inertia(&self) -> Inertia {
        let inverse_mass = 1.0 / self.mass_kg;
        Inertia { inverse_mass, inverse_inertia: inverse_mass / (self.gyration_m * self.gyration_m) }
    }

    fn state(&self) -> State {
        State {
            position: self.position,
            velocity: self.velocity,
            yaw_rad: 0.0,
            yaw_rate_rad_s: self.yaw_rate_rad_s,
        }
    }

    fn struck(self, point: Point, impulse: Vec2) -> Self {
        let Inertia { inverse_mass, inverse_inertia } = self.inertia();
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

    fn disc(x: f64, speed: f64) -> Mover {
        Mover {
            mass_kg: 0.03,
            gyration_m: 0.025 / 2f64.sqrt(),
            position: Point::new(x, 0.0),
            velocity: Vec2::new(speed, 0.4),
            yaw_rate_rad_s: 0.0,
        }
    }

    fn head_on(restitution: f64, friction: f64) -> Encounter {
        let (point, normal_ab) = (Point::new(0.025, 0.0), Vec2::new(1.0, 0.0));
        Encounter { point, normal_ab, restitution, friction, law: ImpactLaw::Stronge }
    }

    #[test]
    fn equal_discs_exchange_their_speeds_along_the_normal() {
        let (a, mut b) = (disc(0.0, 0.5), disc(0.05, 0.0));
        b.velocity = Vec2::ZERO;
        let [a, b] = head_on(1.0, 0.0).after([a, b]).expect("possible");
        assert!((a.velocity - Vec2::new(0.0, 0.4)).length() < 1e-15, "{a:?}");
        assert!((b.velocity - Vec2::new(0.5, 0.0)).length() < 1e-15, "{b:?}");
    }

    #[test]
    fn discs_that_stick_roll_off_each_other() {
        let (a, mut b) = (disc(0.0, 0.5), disc(0.05, 0.0));
        b.velocity = Vec2::ZERO;
        let [a, b] = head_on(0.7, 2.0).after([a, b]).expect("possible");
        let slip = a.velocity.y + 0.025 * a.yaw_rate_rad_s - (b.velocity.y - 0.025 * b.yaw_rate_rad_s);
        assert!(slip.abs() < 1e-14, "{slip} m/s");
        // A third of the slip, shared by equal discs: 3/m + 3/m.
        assert!((b.velocity.y - 0.4 / 6.0).abs() < 1e-14, "{} m/s", b.velocity.y);
    }

    #[test]
    fn what_cannot_be_is_named() {
        let parting = [disc(0.0, -0.5), disc(0.05, 0.0)];
        assert_eq!(head_on(0.7, 0.2).after(parting).expect("possible"), parting);
        for (encounter, word) in [
            (head_on(1.5, 0.2), "restitution"),
            (head_on(0.5, -0.2), "friction"),
            (Encounter { normal_ab: Vec2::ZERO, ..head_on(0.5, 0.2) }, "normal"),
        ] {
            let error = encounter.after(parting).expect_err("impossible").to_string();
            assert!(error.contains(word), "{error}");
        }
        let weightless = Mover { mass_kg: 0.0, ..disc(0.0, 0.5) };
        let error = head_on(0.5, 0.2).after([weightless, parting[1]]).expect_err("impossible").to_string();
        assert!(error.contains("mass_kg"), "{error}");
    }
}
