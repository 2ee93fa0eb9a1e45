//! The pairwise distances, the final positions and the goal: predicted values compared with observed ones.

use super::observed::{Observed, ObservedPose};
use super::report::{
    DistanceErrors, GoalCheck, GoalChecks, ObjectDifference, PairDifference, Report, Summary,
};
use crate::error::{Error, Result};
use crate::geometry::{Pose, nearest_equivalent_rad};
use crate::object::Shape;
use crate::ordered_map::map_of;
use crate::scene::Scene;
use crate::scene::singulation::Singulation;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// A larger difference between the scene file and the first frames of the film causes a warning (m): an initial pose
/// error of 1 mm changes the final positions of a pile by 8 mm in the median.
const PLACEMENT_TOLERANCE_M: f64 = 1e-3;

pub(super) fn report(
    scene: &Scene,
    predicted: &BTreeMap<String, Pose>,
    observed: &Observed,
) -> Result<Report> {
    // Every object of the scene needs an observed and a predicted pose.
    let mut names: Vec<&str> = scene.placed.iter().map(|p| p.object.as_str()).collect();
    names.sort_unstable();
    for name in &names {
        if !observed.after.contains_key(*name) {
            let found: Vec<_> = observed.after.keys().map(String::as_str).collect();
            let found = format!("not among the tracks ({})", found.join(", "));
            return Err(Error::Markers {
                clip: observed.video.clone(),
                found: format!("`{name}` is {found}"),
                needed: "a track for every object of the scene".into(),
            });
        }
        if !predicted.contains_key(*name) {
            return Err(Error::invalid(*name, "predicted pose", "none", "one for every object of the scene"));
        }
    }

    // Only the objects of the scene are compared; a film may show more.
    let of_scene = |(name, pose): (&String, &ObservedPose)| {
        names.contains(&name.as_str()).then(|| (name.clone(), *pose))
    };
    let before = map_of(observed.before.iter().filter_map(of_scene));
    let after = map_of(observed.after.iter().filter_map(of_scene));
    let compared = predicted.iter().filter(|(name, _)| names.contains(&name.as_str()));
    let predicted = map_of(compared.map(|(name, pose)| (name.clone(), *pose)));

    // The same measures of both outcomes.
    let filmed = after.iter().map(|(name, pose)| (name.as_str(), pose.position, pose.yaw_rad));
    let real = Singulation::of_poses(scene, filmed)?;
    let expected = Singulation::of(scene, &predicted)?;
    let pairs = pair_differences(scene, &real, &expected)?;
    let objects = object_differences(scene, &before, &after, &predicted)?;
    let mut warnings = observed.warnings.clone();
    warnings.extend(placement_warnings(&objects));
    Ok(Report {
        version: 1,
        video: observed.video.clone(),
        summary: summary(&pairs, &objects),
        goal: GoalChecks { observed: goal_check(&real), predicted: goal_check(&expected) },
        before,
        observed: after,
        predicted,
        pairs,
        objects,
        warnings,
        alignment: None,
    })
}

fn pair_differences(
    scene: &Scene,
    real: &Singulation,
    expected: &Singulation,
) -> Result<Vec<PairDifference>> {
    let is_disc = |name: &str| scene.object(name).map(|o| matches!(o.shape, Shape::Disc { .. }));
    let both = real.pairs.iter().zip(&expected.pairs);
    both.map(|(real, expected)| {
        Ok(PairDifference {
            a: real.a.clone(),
            b: real.b.clone(),
            observed_m: real.distance_m,
            predicted_m: expected.distance_m,
            difference_m: expected.distance_m - real.distance_m,
            discs: is_disc(&real.a)? && is_disc(&real.b)?,
        })
    })
    .collect()
}

fn object_differences(
    scene: &Scene,
    before: &BTreeMap<String, ObservedPose>,
    after: &BTreeMap<String, ObservedPose>,
    predicted: &BTreeMap<String, Pose>,
) -> Result<Vec<ObjectDifference>> {
    let mut placed: Vec<_> = scene.placed.iter().collect();
    placed.sort_unstable_by(|one, other| one.object.cmp(&other.object));
    placed
        .into_iter()
        .map(|placed| {
            let name = &placed.object;
            let (before, after, predicted) = (before[name], after[name], predicted[name]);
            // The film shows the yaw only modulo the rotation symmetry of the marker.
            let marker = scene.object(name)?.feature().shape.rotation_symmetry_rad();
            let yaw_error_rad = match (after.yaw_rad, marker.unwrap_or(TAU)) {
                (Some(yaw_rad), period) if period > 0.0 => {
                    Some(nearest_equivalent_rad(predicted.yaw_rad - yaw_rad, 0.0, period))
                }
                _ => None,
            };
            Ok(ObjectDifference {
                object: name.clone(),
                placement_error_m: placed.position_m.distance(before.position),
                observed_displacement_m: before.position.distance(after.position),
                predicted_displacement_m: placed.position_m.distance(predicted.position),
                position_error_m: predicted.position.distance(after.position),
                yaw_error_rad,
            })
        })
        .collect()
}

fn summary(pairs: &[PairDifference], objects: &[ObjectDifference]) -> Summary {
    let errors: Vec<f64> = objects.iter().map(|o| o.position_error_m).collect();
    Summary {
        all: distance_errors(pairs.iter()),
        discs: distance_errors(pairs.iter().filter(|p| p.discs)),
        general: distance_errors(pairs.iter().filter(|p| !p.discs)),
        mean_position_error_m: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
        worst_position_error_m: errors.iter().copied().fold(0.0, f64::max),
    }
}

/// The errors of these pairs; none without a pair.
fn distance_errors<'a>(pairs: impl Iterator<Item = &'a PairDifference>) -> Option<DistanceErrors> {
    let (errors, observed): (Vec<f64>, Vec<f64>) =
        pairs.map(|p| (p.difference_m.abs(), p.observed_m)).unzip();
    let count = errors.len();
    (count > 0).then(|| {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count as f64;
        let mean_m = mean(&errors);
        let worst_m = errors.iter().copied().fold(0.0, f64::max);
        DistanceErrors { pairs: count, mean_m, worst_m, relative: mean_m / mean(&observed) }
    })
}

fn goal_check(singulation: &Singulation) -> GoalCheck {
    let violations: Vec<_> = singulation.violations().iter().map(ToString::to_string).collect();
    GoalCheck {
        fulfilled: violations.is_empty(),
        min_distance_m: singulation.min_distance_m(),
        mean_distance_m: singulation.mean_distance_m(),
        violations,
    }
}

fn placement_warnings(objects: &[ObjectDifference]) -> impl Iterator<Item = String> + '_ {
    objects.iter().filter(|o| o.placement_error_m > PLACEMENT_TOLERANCE_M).map(|o| {
        format!(
            "{} was {:.1} mm from its position in the scene file, from which the prediction starts",
            o.object,
            o.placement_error_m * 1e3
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::verify::comparison;
    use std::f64::consts::PI;

    fn scene() -> Scene {
        let text = r#"{
            "cell": {"camera": {"scale_px_per_m": 1000.0}, "workspace": {"min_m": [-0.3, -0.3], "max_m": [0.3, 0.3]},
                "striker": {"shape": {"disc": {"radius_m": 0.015}}, "height_m": 0.08, "speed_range_m_s": [0.05, 1.0]}},
            "objects": [
                {"name": "a", "shape": {"disc": {"radius_m": 0.03}}, "height_m": 0.03,
                 "marker": {"shape": {"disc": {"radius_m": 0.01}}}},
                {"name": "b", "shape": {"disc": {"radius_m": 0.03}}, "height_m": 0.03,
                 "marker": {"shape": {"disc": {"radius_m": 0.01}}}},
                {"name": "d", "shape": {"rectangle": {"size_m": [0.04, 0.04]}}, "height_m": 0.03,
                 "marker": {"shape": {"rectangle": {"size_m": [0.018, 0.009]}}}}],
            "observed_unix_s": null,
            "placed": [{"object": "d", "position_m": [0.07, 0.0], "yaw_rad": 0.1},
                {"object": "a", "position_m": [0.0, 0.0]}, {"object": "b", "position_m": [0.0, 0.07]}],
            "walls": [], "keep_out": [], "goal": {}
        }"#;
        serde_json::from_str(text).expect("a scene")
    }

    fn observed(after: &[(&str, f64, f64, Option<f64>)]) -> Observed {
        let pose = |x, y, yaw_rad| ObservedPose { position: Point::new(x, y), yaw_rad };
        let before = [("a", 0.0, 0.0), ("b", 0.0, 0.07), ("d", 0.072, 0.0)];
        Observed {
            video: "film.mp4".into(),
            before: before.iter().map(|&(n, x, y)| (n.to_owned(), pose(x, y, None))).collect(),
            after: after.iter().map(|&(n, x, y, yaw)| (n.to_owned(), pose(x, y, yaw))).collect(),
            warnings: Vec::new(),
        }
    }

    fn predicted() -> BTreeMap<String, Pose> {
        let poses = [("a", 0.1, 0.0, 0.0), ("b", 0.0, 0.2, 0.0), ("d", 0.2, 0.0, 0.3)];
        poses.iter().map(|&(n, x, y, yaw)| (n.to_owned(), Pose::new(x, y, yaw))).collect()
    }

    #[test]
    fn differences_are_predicted_minus_observed() {
        let after = [("a", 0.1, 0.0, None), ("b", 0.0, 0.2, None), ("d", 0.19, 0.0, Some(0.2 + PI))];
        let report = comparison(&scene(), &predicted(), &observed(&after)).expect("a report");
        let [ab, ad, bd] = &report.pairs[..] else { panic!("{} pairs", report.pairs.len()) };
        assert_eq!((ab.a.as_str(), ab.b.as_str(), ab.discs), ("a", "b", true));
        assert!(ab.difference_m.abs() < 1e-15 && (ad.difference_m - 0.01).abs() < 1e-15, "{ad:?}");
        assert!((bd.observed_m - 0.19f64.hypot(0.2)).abs() < 1e-15 && !bd.discs);
        let (all, discs) =
            (report.summary.all.expect("pairs"), report.summary.discs.expect("a pair of discs"));
        assert!((all.worst_m - 0.01).abs() < 1e-12 && discs.worst_m < 1e-15, "{all:?} {discs:?}");
        assert!((report.summary.worst_position_error_m - 0.01).abs() < 1e-12);
        // A bar marker looks the same after a rotation by pi: 0.3 rad predicted, 0.2 rad observed.
        let yaw_rad = report.objects[2].yaw_error_rad.expect("a marker with a direction");
        assert!((yaw_rad - 0.1).abs() < 1e-12, "{yaw_rad} rad");
        assert_eq!(report.objects[0].yaw_error_rad, None);
    }

    #[test]
    fn the_goal_is_checked_on_the_observed_and_on_the_predicted_poses() {
        let after = [("a", 0.1, 0.0, None), ("b", 0.0, 0.2, None), ("d", 0.16, 0.0, Some(0.3))];
        let report = comparison(&scene(), &predicted(), &observed(&after)).expect("a report");
        assert!(report.goal.predicted.fulfilled && !report.goal.observed.fulfilled);
        assert_eq!(
            report.goal.observed.violations,
            ["the centres of a and d are 60.0 mm apart, 90.0 mm wanted"]
        );
        let mean_m = report.goal.observed.mean_distance_m.expect("pairs");
        let by_hand_m = (0.06 + 0.05f64.sqrt() + 0.16f64.hypot(0.2)) / 3.0;
        assert!((mean_m - by_hand_m).abs() < 1e-12, "{mean_m} m, by hand {by_hand_m} m");
    }

    #[test]
    fn a_scene_that_differs_from_the_film_causes_a_warning() {
        let after = [("a", 0.1, 0.0, None), ("b", 0.0, 0.2, None), ("d", 0.2, 0.0, None)];
        let report = comparison(&scene(), &predicted(), &observed(&after)).expect("a report");
        let warning = "d was 2.0 mm from its position in the scene file, from which the prediction starts";
        assert_eq!(report.warnings, [warning]);
    }

    #[test]
    fn an_object_without_a_track_is_an_error_that_names_it() {
        let error = comparison(&scene(), &predicted(), &observed(&[("a", 0.1, 0.0, None)]))
            .expect_err("b is missing");
        assert!(error.to_string().contains("film.mp4") && error.to_string().contains("`b`"), "{error}");
    }

    #[test]
    fn the_csv_has_one_line_for_each_pair() {
        let after = [("a", 0.1, 0.0, None), ("b", 0.0, 0.2, None), ("d", 0.19, 0.0, None)];
        let csv = comparison(&scene(), &predicted(), &observed(&after)).expect("a report").csv();
        assert_eq!(csv.lines().nth(2), Some("a,d,0.090000,0.100000,0.010000,general"));
        assert_eq!(csv.lines().count(), 4);
    }
}
