//! Where the striker runs on the table: how much way it needs to gain its speed and to stop, and whether that way is free.

use super::profile::{Limits, Profile};
use crate::error::{Error, Result};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::outline::Outline;
use crate::scene::{Scene, Strike};

/// The striker's line, in metres along the heading from the strike's `start_m`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Course {
    pub(crate) start: Point,
    pub(crate) direction: Vec2,
    /// Where it starts from rest.
    pub(crate) begin_m: f64,
    /// Where it comes to rest.
    pub(crate) end_m: f64,
    /// Where it ends up when it has drawn back.
    pub(crate) back_m: f64,
    /// Where it touches the first object, if it does.
    pub(crate) contact_m: Option<f64>,
    /// Gaining its speed.
    pub(crate) up: Limits,
    /// Stopping.
    pub(crate) down: Limits,
}

/// Accelerations to gain speed with (m/s2): the gentlest that finds room shakes the arm least.
pub(crate) const RUN_UPS_M_S2: [f64; 4] = [2.0, 4.0, 7.0, 12.0];
/// Accelerations to stop with (m/s2): the hardest that the arm can do, or the striker runs after what it has hit.
pub(crate) const STOPS_M_S2: [f64; 4] = [15.0, 10.0, 6.0, 3.0];
/// How long an acceleration takes to build up (s): slower than the first resonances of an arm, near 10 to 20 Hz.
const RUN_UP_JERK_TIME_S: f64 = 0.04;
/// The same for the stop; how the arm shakes after the impact moves nothing.
const STOP_JERK_TIME_S: f64 = 0.02;
/// Even speed before the contact (s): time for a servo loop to settle.
const SETTLING_S: f64 = 0.02;
/// Even speed after the contact (s): an impact of hard bodies lasts about a millisecond.
const FOLLOW_THROUGH_S: f64 = 0.005;
/// How far past its start the striker draws back (m), as every strike is defined.
const PAST_START_M: f64 = 0.02;
/// Free space to everything on the way (m).
const CLEARANCE_M: f64 = 0.002;

impl Course {
    /// The course of a strike with given accelerations (m/s2).
    pub(crate) fn new(strike: &Strike, contact_m: Option<f64>, run_up: f64, stop: f64) -> Self {
        let speed = strike.speed_m_s;
        let up = Limits { speed, acceleration: run_up, jerk: run_up / RUN_UP_JERK_TIME_S };
        let down = Limits { speed, acceleration: stop, jerk: stop / STOP_JERK_TIME_S };
        let settled_m = contact_m.map_or(0.0, |contact_m| (contact_m - SETTLING_S * speed).max(0.0));
        let begin_m = (settled_m - up.ramp_length()).min(0.0);
        // It is to stand still after `travel_m`, unless that cuts the stroke short.
        let brake_m = match contact_m {
            Some(contact_m) => {
                (strike.travel_m - down.ramp_length()).max(contact_m + FOLLOW_THROUGH_S * speed)
            }
            None => strike.travel_m,
        };
        Self {
            start: strike.start_m,
            direction: Vec2::from_heading(strike.heading_rad),
            begin_m,
            end_m: brake_m.max(begin_m + up.ramp_length()) + down.ramp_length(),
            back_m: -PAST_START_M,
            contact_m,
            up,
            down,
        }
    }

    /// The place `along_m` from the strike's start.
    pub(crate) fn point(&self, along_m: f64) -> Point {
        self.start + self.direction * along_m
    }

    /// How much of it is run at full speed (m).
    pub(crate) fn even_m(&self) -> f64 {
        self.end_m - self.begin_m - self.up.ramp_length() - self.down.ramp_length()
    }

    /// How it moves along itself, from `begin_m` on.
    pub(crate) fn profile(&self) -> Profile {
        Profile::stroke(&self.up, self.even_m(), &self.down)
    }

    /// When it touches the first object, or is in the middle of its even part (s after it begins).
    pub(crate) fn contact_time_s(&self) -> f64 {
        let even_from_m = self.begin_m + self.up.ramp_length();
        let contact_m = self.contact_m.unwrap_or(even_from_m + self.even_m() / 2.0);
        self.up.ramp_time_s() + (contact_m - even_from_m) / self.up.speed
    }

    /// What stands where the striker must pass before it strikes, or where nothing may ever be; nothing if all is free.
    ///
    /// # Errors
    /// An object of a kind that the scene does not know.
    pub(crate) fn obstacle(&self, striker: &Shape, scene: &Scene) -> Result<Option<String>> {
        let swept = |from_m: f64, to_m: f64| {
            let position = self.point(from_m);
            let from = Pose { position, yaw_rad: self.direction.heading_rad() };
            Outline::swept(striker, from, self.point(to_m) - position)
        };
        let behind = swept(self.begin_m.min(self.back_m), 0.0);
        for placed in &scene.placed {
            let object = Outline::new(&scene.object(&placed.object)?.shape, placed.pose());
            if behind.gap_m(&object) < CLEARANCE_M {
                return Ok(Some(format!("`{}` lies where the striker gains its speed", placed.object)));
            }
        }
        let all = swept(self.begin_m.min(self.back_m), self.end_m);
        let walls = scene.walls.iter().map(|wall| ("a wall", Outline::segment(wall.from_m, wall.to_m)));
        let areas = scene.keep_out.iter().map(|area| ("a keep-out area", Outline::polygon(&area.points_m)));
        let hit = walls.chain(areas).find(|(_, outline)| all.gap_m(outline) < CLEARANCE_M);
        Ok(hit.map(|(what, _)| format!("{what} is in the striker's way")))
    }
}

/// How far the striker's centre goes from the start until it touches the first object (m); `None` if it touches none.
///
/// # Errors
/// An object of an unknown kind; a striker that starts inside an object.
pub(crate) fn contact_after_m(strike: &Strike, striker: &Shape, scene: &Scene) -> Result<Option<f64>> {
    let objects = scene.placed.iter().map(|placed| {
        let outline = Outline::new(&scene.object(&placed.object)?.shape, placed.pose());
        Ok((placed.object.as_str(), outline))
    });
    let objects = objects.collect::<Result<Vec<_>>>()?;
    let direction = Vec2::from_heading(strike.heading_rad);
    let nearest = |along_m: f64| {
        let pose = Pose { position: strike.start_m + direction * along_m, yaw_rad: strike.heading_rad };
        let outline = Outline::new(striker, pose);
        let gaps = objects.iter().map(|(name, object)| (*name, outline.gap_m(object)));
        gaps.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    if let Some((name, gap_m)) = nearest(0.0)
        && gap_m < 0.0
    {
        let found = format!("inside `{name}`");
        return Err(Error::invalid("strike", "start_m", found, "a start clear of every object"));
    }
    // Moving by the gap can never pass an object, so the sum of the gaps ends at the first contact.
    let mut along_m = 0.0;
    while let Some((_, gap_m)) = nearest(along_m) {
        if gap_m < TOUCHING_M {
            return Ok(Some(along_m));
        }
        along_m += gap_m;
        if along_m > strike.travel_m {
            break;
        }
    }
    Ok(None)
}

/// Gaps below are contacts (m).
const TOUCHING_M: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn strike(speed_m_s: f64) -> Strike {
        Strike { object: None, start_m: Point::new(0.1, 0.2), heading_rad: 0.5, speed_m_s, travel_m: 0.08 }
    }

    #[test]
    fn the_striker_has_its_full_speed_when_it_touches() {
        for speed_m_s in [0.05, 0.3, 0.6, 1.0] {
            for run_up in RUN_UPS_M_S2 {
                let course = Course::new(&strike(speed_m_s), Some(0.03), run_up, 15.0);
                let state = course.profile().at(course.contact_time_s());
                let along_m = course.begin_m + state.position;
                assert!((along_m - 0.03).abs() < 1e-9, "touches after {along_m} m");
                assert!((state.speed - speed_m_s).abs() < 1e-9, "at {} m/s, not {speed_m_s}", state.speed);
            }
        }
    }

    #[test]
    fn a_slow_strike_starts_where_it_was_planned_to_and_stops_where_it_was_planned_to() {
        let course = Course::new(&strike(0.2), Some(0.03), 4.0, 15.0);
        assert_eq!(course.begin_m, 0.0);
        assert!((course.end_m - 0.08).abs() < 1e-12, "stops after {} m", course.end_m);
    }

    #[test]
    fn a_fast_strike_starts_farther_back() {
        let course = Course::new(&strike(1.0), Some(0.03), 4.0, 15.0);
        assert!(course.begin_m < -0.1, "begins {} m from its start", course.begin_m);
        let braked_m = 0.03 + 0.005 + course.down.ramp_length();
        assert!((course.end_m - braked_m.max(0.08)).abs() < 1e-12, "stops after {} m", course.end_m);
    }
}
