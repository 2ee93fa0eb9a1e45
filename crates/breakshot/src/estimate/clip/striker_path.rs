//! Where the striker is: it was told its motion, only the moment of its start is unknown.

use crate::cell::Striker;
use crate::estimate::closest_points::{Outline, touch};
use crate::geometry::{Pose, Vec2};
use crate::object::Shape;
use crate::scene::Strike;

/// The striker's prescribed run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrikerRun {
    pub(crate) shape: Shape,
    strike: Strike,
    retract_speed_m_s: f64,
}

/// Past its start the striker draws back by this much.
const BEHIND_START_M: f64 = 0.02;

impl StrikerRun {
    pub(crate) fn new(striker: &Striker, strike: &Strike) -> Self {
        let (shape, retract_speed_m_s) = (striker.shape.clone(), striker.retract_speed_m_s);
        Self { shape, strike: strike.clone(), retract_speed_m_s }
    }

    /// Its velocity on the way to the first impact.
    pub(crate) fn velocity(&self) -> Vec2 {
        self.along() * self.strike.speed_m_s
    }

    fn along(&self) -> Vec2 {
        Vec2::from_heading(self.strike.heading_rad)
    }

    /// Where it is after so much of its way.
    pub(crate) fn pose_after(&self, way_m: f64) -> Pose {
        Pose { position: self.strike.start_m + self.along() * way_m, yaw_rad: self.strike.heading_rad }
    }

    /// Its outline there.
    pub(crate) fn outline_after(&self, way_m: f64) -> Outline<'_> {
        Outline { shape: &self.shape, pose: self.pose_after(way_m) }
    }

    /// How far it runs until it touches an outline at rest; `None` if it passes by or stops short (m).
    pub(crate) fn way_to_m(&self, outline: Outline) -> Option<f64> {
        const CLOSE_M: f64 = 1e-6;
        const STEPS: usize = 200;
        // A struck object lies on the way; the ruler may have been wrong by a little.
        let longest_m = self.strike.travel_m + 0.005;
        let mut way_m = 0.0;
        for _ in 0..STEPS {
            let gap_m = touch(self.outline_after(way_m), outline).map_or(0.0, |t| t.gap_m);
            if gap_m < CLOSE_M {
                return (way_m > 0.0).then_some(way_m);
            }
            // Nothing can be nearer than the gap: advancing by it never passes through.
            way_m += gap_m;
            if way_m > longest_m {
                return None;
            }
        }
        Some(way_m)
    }

    /// How much of its way it has behind it, `since_s` after it was `way_m` on its way out.
    pub(crate) fn way_at_m(&self, way_m: f64, since_s: f64) -> f64 {
        let turn_s = (self.strike.travel_m - way_m) / self.strike.speed_m_s;
        if since_s <= turn_s {
            (way_m + self.strike.speed_m_s * since_s).max(0.0)
        } else {
            (self.strike.travel_m - self.retract_speed_m_s * (since_s - turn_s)).max(-BEHIND_START_M)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn run() -> StrikerRun {
        let shape = Shape::Disc { radius_m: 0.01 };
        let strike = Strike {
            object: None,
            start_m: Point::new(-0.1, 0.0),
            heading_rad: 0.0,
            speed_m_s: 0.5,
            travel_m: 0.08,
        };
        let striker = Striker { shape, height_m: 0.1, speed_range_m_s: [0.1, 1.0], retract_speed_m_s: 0.1 };
        StrikerRun::new(&striker, &strike)
    }

    #[test]
    fn the_striker_runs_until_the_outlines_touch() {
        let object = Shape::Disc { radius_m: 0.03 };
        let way_m = run().way_to_m(Outline { shape: &object, pose: Pose::new(0.0, 0.0, 0.0) });
        assert!((way_m.expect("on the way") - 0.06).abs() < 2e-6, "{way_m:?} m");
        assert_eq!(run().way_to_m(Outline { shape: &object, pose: Pose::new(0.0, 0.05, 0.0) }), None);
        assert_eq!(run().way_to_m(Outline { shape: &object, pose: Pose::new(0.2, 0.0, 0.0) }), None);
    }

    #[test]
    fn the_striker_turns_at_the_end_of_its_travel() {
        // 20 mm are left at 0.5 m/s: it turns after 40 ms.
        for (since_s, way_m) in [(0.02, 0.07), (0.04, 0.08), (0.14, 0.07), (9.0, -0.02)] {
            assert!((run().way_at_m(0.06, since_s) - way_m).abs() < 1e-12, "after {since_s} s");
        }
    }
}
