//! When, in the time of the film, does the simulated striker start, and where do the objects leave their simulated motion?
//!
//! The film has no clock in common with the simulation.  Both are set to the same time where the object that is struck first has moved by
//! as much in the one as in the other: in the first frame that shows it displaced.

use super::observed::{ObservedPose, REST_SIGMAS};
use super::report::{Alignment, Divergence, Report, SimulatedImpact};
use crate::detect::{Sample, Track, Tracks};
use crate::physics::{Event, EventKind, Trajectory};
use std::collections::BTreeMap;

/// The struck object counts as displaced from this distance on (m), and from [`REST_SIGMAS`] standard deviations of its noise on.
const DISPLACED_M: f64 = 1e-3;
/// Step of the search for the time of a displacement (s), and the number of steps: a struck object moves 1 mm within ten seconds.
const STEP_S: f64 = 1e-3;
const MOST_STEPS: usize = 10_000;
/// Bisections of a step: they end far below a microsecond.
const BISECTIONS: usize = 16;

impl Report {
    /// Sets the film and the simulation that predicted the final poses to one time axis.
    ///
    /// `tracks` are those of the film that the report compares, `trajectory` is the simulation of its strike.
    pub fn align(&mut self, tracks: &Tracks, trajectory: &Trajectory) {
        self.alignment = alignment(&self.before, tracks, trajectory);
    }
}

/// The alignment of a film and a simulation of the same strike; `None` if the struck object moves in only one of them, or in none.
fn alignment(
    before: &BTreeMap<String, ObservedPose>,
    tracks: &Tracks,
    trajectory: &Trajectory,
) -> Option<Alignment> {
    let impact = trajectory.events.iter().find(|event| event.kind == EventKind::Impact)?;
    let object = impact.bodies.iter().find(|body| before.contains_key(*body))?;
    let track = tracks.tracks.iter().find(|track| track.object == *object)?;
    let rest = before.get(object)?.position;
    let displaced = |sample: &Sample| {
        !sample.doubtful
            && sample.position().distance(rest) > DISPLACED_M.max(REST_SIGMAS * sample.noise_std_m())
    };
    let sample = track.samples.iter().find(|sample| displaced(sample))?;
    let displacement_m = sample.position().distance(rest);
    let simulated_s = time_of_displacement_s(trajectory, object, displacement_m, impact.time_s)?;
    let start_s = sample.time_s - simulated_s;
    let mut divergences: Vec<Divergence> =
        tracks.tracks.iter().filter_map(|track| divergence(track, trajectory, start_s)).collect();
    divergences.sort_by(|one, other| {
        one.time_s.total_cmp(&other.time_s).then_with(|| one.object.cmp(&other.object))
    });
    Some(Alignment { object: object.clone(), start_s, divergences })
}

/// The earliest time after `from_s` at which an object is this far from where it starts (s).
fn time_of_displacement_s(
    trajectory: &Trajectory,
    object: &str,
    distance_m: f64,
    from_s: f64,
) -> Option<f64> {
    let rest = trajectory.pose(object, 0.0)?.position;
    let is_there = |time_s: f64| {
        trajectory.pose(object, time_s).is_some_and(|p| p.position.distance(rest) >= distance_m)
    };
    let steps = ((trajectory.duration_s - from_s).max(0.0) / STEP_S).ceil() as usize;
    let step = (0..=steps.min(MOST_STEPS)).find(|k| is_there(from_s + *k as f64 * STEP_S))?;
    let mut until_s = from_s + step as f64 * STEP_S;
    let mut after_s = (until_s - STEP_S).max(from_s);
    for _ in 0..BISECTIONS {
        let middle_s = f64::midpoint(after_s, until_s);
        *if is_there(middle_s) { &mut until_s } else { &mut after_s } = middle_s;
    }
    Some(until_s)
}

/// The first frame from which on an object stays far from its simulated motion; `None` if it ends near.
fn divergence(track: &Track, trajectory: &Trajectory, start_s: f64) -> Option<Divergence> {
    let distance_m = |sample: &&Sample| {
        let simulated = trajectory.pose(&track.object, sample.time_s - start_s)?;
        Some(sample.position().distance(simulated.position))
    };
    let clear: Vec<&Sample> = track.samples.iter().filter(|sample| !sample.doubtful).collect();
    let is_near = |sample: &&Sample| {
        distance_m(sample).is_some_and(|m| m <= Divergence::LEAST_M.max(REST_SIGMAS * sample.noise_std_m()))
    };
    let first = clear.iter().rposition(is_near).map_or(0, |last| last + 1);
    let sample = clear.get(first)?;
    let time_s = sample.time_s - start_s;
    let concerns = |event: &&Event| {
        event.kind == EventKind::Impact && event.time_s <= time_s && event.bodies.contains(&track.object)
    };
    let impact = trajectory.events.iter().rfind(concerns);
    Some(Divergence {
        object: track.object.clone(),
        time_s,
        distance_m: distance_m(sample)?,
        last_impact: impact.map(|e| SimulatedImpact { time_s: e.time_s, bodies: e.bodies.clone() }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Pose, Vec2};
    use crate::ordered_map::map_of;
    use crate::physics::Segment;

    /// When the striker starts in the film (s), and when it hits (s after that): between two frames.
    const START_S: f64 = 0.1234;
    const IMPACT_S: f64 = 0.0507;
    const SPEED_M_S: f64 = 0.5;

    fn segment(start_s: f64, end_s: f64, x_m: Vec<f64>) -> Segment {
        Segment { start_s, end_s, x_m, y_m: vec![0.0], yaw_rad: vec![0.0] }
    }

    /// `a` rests, is hit, and moves on at constant speed; `b` rests.
    fn trajectory() -> Trajectory {
        let json = r#"{"version": 1, "final": {}, "duration_s": 1.0, "events": [], "motions": {}, "notes": [],
            "energy": {"striker_work_j": 0.0, "impact_loss_j": 0.0, "friction_loss_j": 0.0}}"#;
        let mut trajectory: Trajectory = serde_json::from_str(json).expect("a trajectory");
        let moves = [segment(0.0, IMPACT_S, vec![0.0]), segment(IMPACT_S, 1.0, vec![0.0, SPEED_M_S])];
        let rests = [segment(0.0, 1.0, vec![0.3])];
        trajectory.motions = map_of([("a".to_owned(), moves.to_vec()), ("b".to_owned(), rests.to_vec())]);
        trajectory.final_poses = map_of([
            ("a".to_owned(), Pose::new(SPEED_M_S * (1.0 - IMPACT_S), 0.0, 0.0)),
            ("b".to_owned(), Pose::new(0.3, 0.0, 0.0)),
        ]);
        trajectory.events.push(Event {
            time_s: IMPACT_S,
            kind: EventKind::Impact,
            bodies: vec!["striker".into(), "a".into()],
            point_m: Point::ORIGIN,
            normal: Vec2::new(1.0, 0.0),
            impulse_n_s: Vec2::ZERO,
            velocities_before_m_s: Vec::new(),
            velocities_after_m_s: Vec::new(),
            yaw_rates_before_rad_s: Vec::new(),
            yaw_rates_after_rad_s: Vec::new(),
            loss_j: 0.0,
        });
        trajectory
    }

    /// A film of that motion at 60 frames per second, of which the object `b` is displaced by `b_m` from 0.5 s on.
    fn tracks(trajectory: &Trajectory, b_m: f64) -> Tracks {
        let track = |name: &str| {
            let sample = |k: usize| {
                let time_s = k as f64 / 60.0;
                let pose = trajectory.pose(name, time_s - START_S).expect("a pose");
                let extra_m = if name == "b" && time_s > 0.5 { b_m } else { 0.0 };
                let noise_m = if k.is_multiple_of(2) { 2e-5 } else { -2e-5 };
                Sample::new(time_s, pose.position + Vec2::new(extra_m, noise_m), None, 2e-5)
            };
            Track { object: name.into(), samples: (0..60).map(sample).collect() }
        };
        Tracks { tracks: vec![track("a"), track("b")], ..Tracks::default() }
    }

    fn before() -> BTreeMap<String, ObservedPose> {
        let at = |name: &str, x_m: f64| {
            (name.to_owned(), ObservedPose { position: Point::new(x_m, 0.0), yaw_rad: None })
        };
        map_of([at("a", 0.0), at("b", 0.3)])
    }

    #[test]
    fn the_start_of_the_striker_is_found_to_a_fraction_of_a_frame() {
        let trajectory = trajectory();
        let found = alignment(&before(), &tracks(&trajectory, 0.0), &trajectory).expect("an alignment");
        assert_eq!(found.object, "a");
        assert!((found.start_s - START_S).abs() < 1e-4, "{} s, not {START_S} s", found.start_s);
        assert_eq!(found.divergences, Vec::new());
    }

    #[test]
    fn an_object_that_leaves_its_simulated_motion_is_named_with_its_last_impact() {
        let mut trajectory = trajectory();
        let film = tracks(&trajectory, 0.004);
        // The simulated `a` brakes from 0.3 s on, the filmed one does not.
        let segments = trajectory.motions.get_mut("a").expect("its motion");
        segments[1].end_s = 0.3;
        segments.push(segment(0.3, 1.0, vec![SPEED_M_S * (0.3 - IMPACT_S), SPEED_M_S, -0.2]));
        let found = alignment(&before(), &film, &trajectory).expect("an alignment").divergences;
        let [b, a] = &found[..] else { panic!("{found:?}") };
        // 2 mm with 0.2 m/s2 after 0.1 s; b in the first frame after 0.5 s of the film.
        assert_eq!((b.object.as_str(), a.object.as_str()), ("b", "a"), "in the order of time");
        assert!((a.time_s - 0.4).abs() < 1.0 / 60.0, "a diverges at {} s", a.time_s);
        assert_eq!(a.last_impact.as_ref().map(|i| i.bodies.join(" ")), Some("striker a".into()));
        assert!((b.time_s - (31.0 / 60.0 - START_S)).abs() < 1e-3, "b diverges at {} s", b.time_s);
        assert!((b.distance_m - 0.004).abs() < 1e-4, "{} m", b.distance_m);
        assert_eq!(b.last_impact, None);
    }

    #[test]
    fn a_film_in_which_nothing_moves_has_no_common_time() {
        let trajectory = trajectory();
        let mut film = tracks(&trajectory, 0.0);
        for track in &mut film.tracks {
            track.samples.truncate(8);
        }
        assert_eq!(alignment(&before(), &film, &trajectory), None);
        let mut still = trajectory.clone();
        still.events.clear();
        assert_eq!(alignment(&before(), &tracks(&trajectory, 0.0), &still), None);
    }
}
