//! The striker's position over time: its motion is prescribed, only the instant of its start is unknown.

use crate::cell::Striker;
use crate::estimate::closest_points::{PlacedShape, closest_points};
use crate::geometry::conservative_advancement::{Step, advance};
use crate::geometry::{Pose, Vec2};
use crate::object::Shape;
use crate::scene::{RETRACT_PAST_START_M, Strike};

/// The striker's prescribed motion: straight out by the travel of the strike, then back.
///
/// Distances are measured along the heading from the start of the strike.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrikerPath {
    shape: Shape,
    strike: Strike,
    retract_speed_m_s: f64,
}

impl StrikerPath {
    pub(crate) fn new(striker: &Striker, strike: &Strike) -> Self {
        let (shape, retract_speed_m_s) = (striker.shape.clone(), striker.retract_speed_m_s);
        Self { shape, strike: strike.clone(), retract_speed_m_s }
    }

    /// Its velocity before it retracts.
    pub(crate) fn velocity(&self) -> Vec2 {
        self.along() * self.strike.speed_m_s
    }

    fn along(&self) -> Vec2 {
        Vec2::from_heading(self.strike.heading_rad)
    }

    /// Its outline at a distance from the start.
    pub(crate) fn outline_at(&self, distance_m: f64) -> PlacedShape<'_> {
        let position = self.strike.start_m + self.along() * distance_m;
        PlacedShape { shape: &self.shape, pose: Pose { position, yaw_rad: self.strike.heading_rad } }
    }

    /// The distance (m) at which it touches an outline at rest; `None` if it passes the outline or stops short of it.
    ///
    /// Conservative advancement (Mirtich 1996): no step is longer than the gap, so none passes through the outline.
    pub(crate) fn distance_to_contact_m(&self, outline: PlacedShape) -> Option<f64> {
        const CONTACT_M: f64 = 1e-6;
        const STEPS: usize = 200;
        // Measured positions and outlines may be wrong by a few millimetres.
        let longest_m = self.strike.travel_m + 0.005;
        let look = |distance_m: f64| {
            let gap_m = closest_points(self.outline_at(distance_m), outline).map_or(0.0, |c| c.gap_m);
            if gap_m < CONTACT_M {
                return Step::End((distance_m > 0.0).then_some(distance_m));
            }
            let next_m = distance_m + gap_m;
            if next_m > longest_m { Step::End(None) } else { Step::To(next_m) }
        };
        advance(0.0, STEPS, look).unwrap_or_else(Some)
    }

    /// The time from `distance_m` to the end of its travel (s).
    pub(crate) fn turns_after_s(&self, distance_m: f64) -> f64 {
        (self.strike.travel_m - distance_m) / self.strike.speed_m_s
    }

    /// Its distance from the start, `since_s` after it passed `distance_m` before retracting (m).
    pub(crate) fn distance_at_m(&self, distance_m: f64, since_s: f64) -> f64 {
        let turning_s = self.turns_after_s(distance_m);
        if since_s <= turning_s {
            (distance_m + self.strike.speed_m_s * since_s).max(0.0)
        } else {
            (self.strike.travel_m - self.retract_speed_m_s * (since_s - turning_s)).max(-RETRACT_PAST_START_M)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn path() -> StrikerPath {
        let shape = Shape::Disc { radius_m: 0.01 };
        let strike = Strike {
            object: None,
            start_m: Point::new(-0.1, 0.0),
            heading_rad: 0.0,
            speed_m_s: 0.5,
            travel_m: 0.08,
        };
        let striker = Striker { shape, height_m: 0.1, speed_range_m_s: [0.1, 1.0], retract_speed_m_s: 0.1 };
        StrikerPath::new(&striker, &strike)
    }

    #[test]
    fn the_distance_to_contact_ends_where_the_outlines_touch() {
        let shape = Shape::Disc { radius_m: 0.03 };
        let distance_m = |x: f64, y: f64| {
            path().distance_to_contact_m(PlacedShape { shape: &shape, pose: Pose::new(x, y, 0.0) })
        };
        let found_m = distance_m(0.0, 0.0);
        assert!((found_m.expect("a contact") - 0.06).abs() < 2e-6, "{found_m:?} m");
        assert_eq!((distance_m(0.0, 0.05), distance_m(0.2, 0.0)), (None, None));
    }

    #[test]
    fn the_striker_retracts_after_its_travel_to_behind_its_start() {
        // 20 mm remain at 0.5 m/s: the retraction begins after 40 ms.
        for (since_s, expected_m) in [(0.02, 0.07), (0.04, 0.08), (0.14, 0.07), (9.0, -0.02)] {
            let found_m = path().distance_at_m(0.06, since_s);
            assert!((found_m - expected_m).abs() < 1e-12, "after {since_s} s: {found_m} m");
        }
    }
}
