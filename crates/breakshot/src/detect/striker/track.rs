//! The striker's own motion as a film shows it: the output of this part of the stage.

use crate::error::{Error, Result, bounds};
use crate::geometry::{Point, Vec2};
use crate::uncertain::Measured;
use serde::{Deserialize, Serialize};

/// The striker's centre in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrikerSample {
    /// Time of the exposure (s), corrected for the rolling shutter.
    pub time_s: f64,
    /// x in the table frame (m).
    pub x_m: f64,
    /// y in the table frame (m).
    pub y_m: f64,
}

/// Where the striker was while it moved uniformly towards the struck object, and where it rested before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrikerTrack {
    /// Its centre in the frames in which it moves, two at least, in the order of time.
    pub samples: Vec<StrikerSample>,
    /// Where its centre was at rest before (m); `None` if the film does not show it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_m: Option<Point>,
    /// Standard deviation of the noise of each position, along each axis (m).
    pub std_m: f64,
    /// Standard deviation of an offset that all positions have in common (m): the outline's size, shade along it.
    pub offset_std_m: f64,
    /// Standard deviation of a factor that all displacements have in common (1): the height of the edge that is seen.
    pub scale_std: f64,
}

impl StrikerSample {
    /// The position in the table frame.
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }
}

impl StrikerTrack {
    /// Checks that a track which was read from a file is possible; errors name `owner`.
    ///
    /// # Errors
    /// Fewer than two samples, times that do not grow, positions and deviations that are not numbers or of the wrong sign.
    pub(crate) fn check(&self, owner: &str) -> Result<()> {
        let grows = self.samples.windows(2).all(|pair| pair[0].time_s < pair[1].time_s);
        if self.samples.len() < 2 || !grows {
            let found = format!("{} samples", self.samples.len());
            return Err(Error::invalid(
                owner,
                "striker.samples",
                found,
                "at least two, with times that grow",
            ));
        }
        let finite = |sample: &StrikerSample| sample.time_s.is_finite() && sample.position().is_finite();
        if !self.samples.iter().all(finite) || self.start_m.is_some_and(|start| !start.is_finite()) {
            return Err(Error::invalid(owner, "striker", "not a number", "times and positions"));
        }
        for (what, std) in
            [("std_m", self.std_m), ("offset_std_m", self.offset_std_m), ("scale_std", self.scale_std)]
        {
            bounds::positive(owner, &format!("striker.{what}"), std)?;
        }
        Ok(())
    }

    /// Its speed (m/s).
    pub fn speed_m_s(&self) -> Measured {
        let line = self.line();
        let value = line.velocity.length();
        Measured { value, std: line.velocity_std_m_s.hypot(self.scale_std * value) }
    }

    /// The direction of its motion (rad, counter-clockwise from the x axis).
    pub fn heading_rad(&self) -> Measured {
        let line = self.line();
        let noise_rad = line.velocity_std_m_s / line.velocity.length();
        // An error of scale that differs between the axes turns a direction by up to as much.
        Measured { value: line.velocity.heading_rad(), std: noise_rad.hypot(self.scale_std / 2.0) }
    }

    /// The mean of its positions (m), and the standard deviation along each axis.
    pub fn middle(&self) -> (Point, f64) {
        let n = self.samples.len() as f64;
        (self.line().middle, self.offset_std_m.hypot(self.std_m / n.sqrt()))
    }

    /// Where its centre is at a time near those of the positions, if it moves uniformly (m).
    pub fn position_at(&self, time_s: f64) -> Point {
        let Line { time_s: middle_s, middle, velocity, .. } = self.line();
        middle + velocity * (time_s - middle_s)
    }

    /// The straight line of uniform motion through the positions (least squares).
    fn line(&self) -> Line {
        let n = self.samples.len().max(1) as f64;
        let time_s = self.samples.iter().map(|s| s.time_s).sum::<f64>() / n;
        let sum = |value: fn(&StrikerSample) -> f64| self.samples.iter().map(value).sum::<f64>() / n;
        let middle = Point::new(sum(|s| s.x_m), sum(|s| s.y_m));
        let (mut squares_s2, mut product) = (0.0, Vec2::ZERO);
        for sample in &self.samples {
            let since_s = sample.time_s - time_s;
            squares_s2 += since_s * since_s;
            product += (sample.position() - middle) * since_s;
        }
        Line {
            time_s,
            middle,
            velocity: product / squares_s2,
            velocity_std_m_s: self.std_m / squares_s2.sqrt(),
        }
    }
}

struct Line {
    /// The mean time (s), at which the striker is at the middle.
    time_s: f64,
    middle: Point,
    velocity: Vec2,
    velocity_std_m_s: f64,
}
