//! The striker's path on the table: how much distance do its run-up and its stop need, and is that distance free?

use super::profile::{Profile, ProfileLimits};
use crate::error::{Error, Result};
use crate::geometry::outline::Outline;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::scene::{RETRACT_PAST_START_M, Scene, Strike};

/// The striker's line; positions are distances along the heading from the strike's `start_m` (m).
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrikerPath {
    pub(crate) start: Point,
    pub(crate) direction: Vec2,
    /// Start of the run-up, at rest.
    pub(crate) begin_m: f64,
    /// End of the stop, at rest.
    pub(crate) end_m: f64,
    /// End of the draw-back.
    pub(crate) back_m: f64,
    /// Contact with the first object; `None` without one.
    pub(crate) contact_m: Option<f64>,
    /// Limits of the run-run_up.
    pub(crate) run_up: ProfileLimits,
    /// Limits of the stop.
    pub(crate) stop: ProfileLimits,
}

/// Accelerations of the run-up (m/s2), in the order tried: the gentlest one excites the arm least.
pub(crate) const RUN_UP_ACCELERATIONS_M_S2: [f64; 4] = [2.0, 4.0, 7.0, 12.0];
/// Accelerations of the stop (m/s2), in the order tried: a soft stop lets the striker follow the struck object.
pub(crate) const STOP_ACCELERATIONS_M_S2: [f64; 4] = [15.0, 10.0, 6.0, 3.0];
/// Time in which the run-up's acceleration builds up (s), longer than a period of an arm's first resonances (10 to 20 Hz).
const RUN_UP_JERK_TIME_S: f64 = 0.04;
/// Time in which the stop's acceleration builds up (s); vibration after the impact has no effect on the objects.
const STOP_JERK_TIME_S: f64 = 0.02;
/// Time at constant speed before the contact (s), in which the servo loop settles.
const SETTLING_S: f64 = 0.02;
/// Time at constant speed after the contact (s): an impact of hard bodies lasts about a millisecond.
const FOLLOW_THROUGH_S: f64 = 0.005;
/// Least distance from every obstacle on the path (m).
const CLEARANCE_M: f64 = 0.002;

/// The least distance of the striker from the contact to the end of its stop (m), at a speed (m/s).
pub(crate) fn least_follow_through_m(speed: f64) -> f64 {
    FOLLOW_THROUGH_S * speed + stop_limits(speed, STOP_ACCELERATIONS_M_S2[0]).ramp_length()
}

fn stop_limits(speed: f64, acceleration: f64) -> ProfileLimits {
    ProfileLimits { speed, acceleration, jerk: acceleration / STOP_JERK_TIME_S }
}

impl StrikerPath {
    /// The path of a strike for given accelerations (m/s2).
    pub(crate) fn new(strike: &Strike, contact_m: Option<f64>, run_up_m_s2: f64, stop_m_s2: f64) -> Self {
        let speed = strike.speed_m_s;
        let run_up =
            ProfileLimits { speed, acceleration: run_up_m_s2, jerk: run_up_m_s2 / RUN_UP_JERK_TIME_S };
        let stop = stop_limits(speed, stop_m_s2);
        let settled_m = contact_m.map_or(0.0, |contact_m| (contact_m - SETTLING_S * speed).max(0.0));
        let begin_m = (settled_m - run_up.ramp_length()).min(0.0);
        // The striker stops at `travel_m`, or later if constant speed after the contact requires it.
        let brake_m = match contact_m {
            Some(contact_m) => {
                (strike.travel_m - stop.ramp_length()).max(contact_m + FOLLOW_THROUGH_S * speed)
            }
            None => strike.travel_m,
        };
        Self {
            start: strike.start_m,
            direction: Vec2::from_heading(strike.heading_rad),
            begin_m,
            end_m: brake_m.max(begin_m + run_up.ramp_length()) + stop.ramp_length(),
            back_m: -RETRACT_PAST_START_M,
            contact_m,
            run_up,
            stop,
        }
    }

    /// The point at a distance from the strike's start.
    pub(crate) fn point(&self, along_m: f64) -> Point {
        self.start + self.direction * along_m
    }

    /// The length at constant speed (m).
    pub(crate) fn cruise_m(&self) -> f64 {
        self.end_m - self.begin_m - self.run_up.ramp_length() - self.stop.ramp_length()
    }

    /// The distance from `begin_m` over time.
    pub(crate) fn profile(&self) -> Profile {
        Profile::stroke(&self.run_up, self.cruise_m(), &self.stop)
    }

    /// Time of the contact since the start of the run-up (s); without a contact, of the middle of the constant speed.
    pub(crate) fn contact_time_s(&self) -> f64 {
        let cruise_begin_m = self.begin_m + self.run_up.ramp_length();
        let contact_m = self.contact_m.unwrap_or(cruise_begin_m + self.cruise_m() / 2.0);
        self.run_up.ramp_time_s() + (contact_m - cruise_begin_m) / self.run_up.speed
    }

    /// The first obstacle: an object on the run-up, or a wall or keep-out area anywhere on the path; `None` if the path is
    /// free.
    ///
    /// # Errors
    /// An object of an unknown kind.
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
                return Ok(Some(format!("`{}` lies on the striker's run-up", placed.object)));
            }
        }
        let all = swept(self.begin_m.min(self.back_m), self.end_m);
        let walls = scene.walls.iter().map(|wall| ("a wall", Outline::segment(wall.from_m, wall.to_m)));
        let areas = scene.keep_out.iter().map(|area| ("a keep-out area", Outline::polygon(&area.points_m)));
        let hit = walls.chain(areas).find(|(_, outline)| all.gap_m(outline) < CLEARANCE_M);
        Ok(hit.map(|(what, _)| format!("{what} is in the striker's path")))
    }
}

/// The distance of the striker's centre from the start to its contact with the first object (m); `None` without a contact.
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
    // An advance by the gap never passes an object (conservative advancement, Mirtich 1996), so it ends at the first contact.
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

/// Largest gap of a contact (m).
const TOUCHING_M: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;

    fn strike(speed_m_s: f64) -> Strike {
        Strike { object: None, start_m: Point::new(0.1, 0.2), heading_rad: 0.5, speed_m_s, travel_m: 0.08 }
    }

    #[test]
    fn the_striker_has_its_full_speed_at_the_contact() {
        for speed_m_s in [0.05, 0.3, 0.6, 1.0] {
            for run_up in RUN_UP_ACCELERATIONS_M_S2 {
                let striker_path = StrikerPath::new(&strike(speed_m_s), Some(0.03), run_up, 15.0);
                let state = striker_path.profile().at(striker_path.contact_time_s());
                let along_m = striker_path.begin_m + state.position;
                assert!((along_m - 0.03).abs() < 1e-9, "touches after {along_m} m");
                assert!((state.speed - speed_m_s).abs() < 1e-9, "at {} m/s, not {speed_m_s}", state.speed);
            }
        }
    }

    #[test]
    fn a_slow_strike_starts_and_stops_at_the_planned_points() {
        let striker_path = StrikerPath::new(&strike(0.2), Some(0.03), 4.0, 15.0);
        assert_eq!(striker_path.begin_m, 0.0);
        assert!((striker_path.end_m - 0.08).abs() < 1e-12, "stops after {} m", striker_path.end_m);
    }

    #[test]
    fn a_fast_strike_starts_behind_its_planned_start() {
        let striker_path = StrikerPath::new(&strike(1.0), Some(0.03), 4.0, 15.0);
        assert!(striker_path.begin_m < -0.1, "begins {} m from its start", striker_path.begin_m);
        let braked_m = 0.03 + 0.005 + striker_path.stop.ramp_length();
        assert!(
            (striker_path.end_m - braked_m.max(0.08)).abs() < 1e-12,
            "stops after {} m",
            striker_path.end_m
        );
    }
}
