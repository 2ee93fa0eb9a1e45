//! Which way, and by how much, is the table tilted?

use super::Domain;
use crate::error::{Error, Result};
use crate::geometry::Vec2;
use crate::uncertain::Estimate;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The slope of the table: gravity's component along it over gravity, along x and y of the table frame.  Objects are drawn towards
/// positive values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tilt {
    /// Along x.
    pub x: Estimate,
    /// Along y.
    pub y: Estimate,
    /// Covariance of the errors of both.
    pub covariance: f64,
    /// Whether the table counts as level: a level table is within the interval, or the slope changes no slide noticeably.
    pub level: bool,
}

/// Slopes of tables on which objects can rest: 45 degrees is steeper than any.
const SLOPE: Domain =
    Domain { contains: |v| (-0.7..=0.7).contains(&v), description: "a slope from -0.7 to 0.7" };
/// Relative error of covariances that were rounded when they were written.
const ROUNDING: f64 = 1e-6;

impl Tilt {
    /// The slope's mean.
    pub fn slope(&self) -> Vec2 {
        Vec2::new(self.x.mean, self.y.mean)
    }

    /// The angle of the mean slope (rad).
    pub fn angle_rad(&self) -> f64 {
        self.slope().length().min(1.0).asin()
    }

    /// The same slope without uncertainty.
    pub(crate) fn exact(self) -> Self {
        let [x, y] = [self.x, self.y].map(|e| Estimate::exact(e.mean));
        Self { x, y, covariance: 0.0, ..self }
    }

    /// The slope with errors made of two standard normal numbers.
    pub(crate) fn drawn(&self, normals: [f64; 2]) -> Vec2 {
        let (x_std, y_variance) = (self.x.standard_error, self.y.standard_error.powi(2));
        let shared = if x_std > 0.0 { self.covariance / x_std } else { 0.0 };
        let own = (y_variance - shared * shared).max(0.0).sqrt();
        self.slope() + Vec2::new(x_std * normals[0], shared * normals[0] + own * normals[1])
    }

    pub(super) fn check(&self, file: &str) -> Result<()> {
        SLOPE.check(&format!("{file}: tilt along x"), &self.x)?;
        SLOPE.check(&format!("{file}: tilt along y"), &self.y)?;
        let most = self.x.standard_error * self.y.standard_error * (1.0 + ROUNDING);
        if self.covariance.abs() <= most {
            return Ok(());
        }
        let needed = format!("at most the product of the standard errors, {most:.3e}");
        Err(Error::invalid(format!("{file}: tilt"), "covariance", self.covariance, needed))
    }
}

impl fmt::Display for Tilt {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let degrees = |v: f64| v.clamp(-1.0, 1.0).asin().to_degrees();
        let interval = |e: &Estimate| {
            let [low, high] = e.interval_95.map(degrees);
            format!("{:.3} degrees ({low:.3} to {high:.3})", degrees(e.mean))
        };
        let kind = if self.level { "level" } else { "tilted" };
        write!(
            f,
            "the table is {kind}: it falls by {} along x and {} along y",
            interval(&self.x),
            interval(&self.y)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64Mcg;

    #[test]
    fn drawn_slopes_have_the_covariance_of_the_estimate() {
        let slope = |mean: f64, error: f64| Estimate {
            mean,
            std: None,
            standard_error: error,
            interval_95: [mean - 2.0 * error, mean + 2.0 * error],
            n: 9,
        };
        let tilt = Tilt { x: slope(0.01, 0.002), y: slope(-0.02, 0.004), covariance: -6e-6, level: false };
        tilt.check("a file").expect("a covariance");
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut normal = || rng.sample(StandardNormal);
        let (mut sum, n) = ([0.0; 3], 4000.0);
        for _ in 0..4000 {
            let error = tilt.drawn([normal(), normal()]) - tilt.slope();
            for (sum, product) in
                sum.iter_mut().zip([error.x * error.x, error.x * error.y, error.y * error.y])
            {
                *sum += product / n;
            }
        }
        for (found, expected) in sum.into_iter().zip([4e-6, -6e-6, 16e-6]) {
            assert!((found / expected - 1.0).abs() < 0.1, "{sum:?}");
        }
        assert!(Tilt { covariance: 9e-6, ..tilt }.check("a file").is_err());
    }
}
