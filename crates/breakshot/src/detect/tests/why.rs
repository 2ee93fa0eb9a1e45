//! What the record of the searches says about lost and doubtful frames.

use super::*;
use crate::geometry::Pixel;

/// A film in which a plate moves over a sliding disc: its marker is covered, then the whole disc, then the marker.
fn covered_film(view: &View, object: &Object) -> Vec<Frame> {
    film(view, &times_s(32), |t| {
        let (pose, velocity, _) = slid(Pose::new(-0.1, 0.0, 0.0), Vec2::new(0.5, 0.0), 0.0, t);
        let mut things = Thing::object(object, pose).map(|thing| thing.moving(velocity, 0.0)).to_vec();
        let from_middle_s = (t - 0.22).abs();
        let beside_m = 0.35 * (from_middle_s - 0.1).max(0.0);
        let radius_m = if from_middle_s < 0.08 { 0.033 } else { 0.016 };
        let plate = Pose { position: pose.position + Vec2::new(0.0, beside_m), yaw_rad: 0.0 };
        things.push(Thing::flat(disc(radius_m), plate, 0.031, 165.0));
        things
    })
}

fn explained_film(view: &View, frames: Vec<Frame>, objects: &[Object]) -> Explained {
    let names: Vec<String> = objects.iter().map(|o| o.name.clone()).collect();
    explained_in(view, frames, (objects, &names), &Layout::Unknown).expect("tracks")
}

/// The searches that found nothing, with what was refused.
fn lost(searches: &ObjectSearches) -> Vec<(&Search, &[Candidate])> {
    let frames = searches.frames.iter();
    let lost = frames.filter_map(|search| match &search.outcome {
        Outcome::Lost(candidates) => Some((search, &candidates[..])),
        _ => None,
    });
    lost.collect()
}

#[test]
fn a_record_of_the_searches_changes_no_track() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let frames = covered_film(&view, &objects[0]);
    let names = ["a".to_string()];
    let clip = |is_recorded: bool| {
        let targets = targets(&objects, &names).expect("targets");
        let clip = Clip { name: "drawn".into(), camera: &view.camera, targets, given: None, is_recorded };
        let options = Options::default();
        clip.explained(&objects, &mut frames.clone().into_iter().map(Ok), &Layout::Unknown, &options)
    };
    let [with, without] = [true, false].map(|is_recorded| clip(is_recorded).expect("tracks"));
    assert_eq!(with.tracks, without.tracks);
    assert_eq!((with.searches.len(), without.searches.len()), (1, 0));
}

#[test]
fn every_frame_has_the_outcome_of_its_sample() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let found = explained_film(&view, covered_film(&view, &objects[0]), &objects);
    let searches = &found.searches[0];
    assert_eq!(searches.frames.len(), 32);
    let mut samples = found.tracks.tracks[0].samples.iter();
    let (mut doubtful, mut lost) = (0, 0);
    for (number, search) in searches.frames.iter().enumerate() {
        assert_eq!(search.frame, number);
        assert!(search.radius_m > 0.0 && search.predicted.position.is_finite());
        match &search.outcome {
            Outcome::Lost(candidates) => {
                assert!(candidates.len() <= MOST_CANDIDATES, "{candidates:?}");
                lost += 1;
            }
            Outcome::Found(sighting) | Outcome::Doubtful(sighting, _) => {
                let sample = samples.next().expect("a sample");
                assert_eq!(sighting.pose.position, sample.position());
                assert!((sighting.std_m - sample.std_m).abs() < 1e-15, "{sighting:?}");
                assert_eq!(sample.doubtful, !search.outcome.is_trusted());
                let at = view.camera.pixel_from_table(sample.position(), searches.height_m);
                assert!(at.distance_px(sighting.spot.centroid) < 1.0, "{at:?} {sighting:?}");
                doubtful += usize::from(sample.doubtful);
            }
        }
    }
    assert!(samples.next().is_none(), "a sample of a lost frame");
    assert!(lost >= 9 && doubtful >= 1, "{lost} lost, {doubtful} doubtful");
    let doubts = searches.frames.iter().filter_map(|search| match &search.outcome {
        Outcome::Doubtful(_, doubts) => Some(doubts),
        _ => None,
    });
    for doubts in doubts {
        let is_of_a_cover = |doubt: &Doubt| match doubt {
            Doubt::Size { deviation_px } => *deviation_px > 0.3,
            Doubt::PartOfMarker { std_px } => *std_px > 0.0,
            Doubt::MarkerCovered | Doubt::OutlineElsewhere | Doubt::UnevenLight { .. } => true,
            _ => false,
        };
        assert!(!doubts.is_empty() && doubts.iter().all(is_of_a_cover), "{doubts:?}");
    }
}

#[test]
fn a_region_that_is_not_the_marker_is_recorded_where_it_is_with_the_reason() {
    let view = view();
    let objects = [object("a", bar(0.04, 0.03), bar(0.024, 0.012))];
    let pose = Pose::new(-0.06, 0.0, 0.2);
    let covered = |t: f64| (0.19..0.26).contains(&t);
    // Darker than the table, longer than the marker.
    let strip = Thing::flat(bar(0.05, 0.0105), Pose::new(-0.06, 0.048, 0.3), 0.0, 75.0);
    let frames = film(&view, &times_s(20), |t| {
        let mut things = vec![strip.clone()];
        things.extend(Thing::object(&objects[0], pose));
        if covered(t) {
            things.push(Thing::flat(bar(0.05, 0.04), pose, 0.031, 165.0));
        }
        things
    });
    let found = explained_film(&view, frames, &objects);
    let lost = lost(&found.searches[0]);
    assert_eq!(lost.len(), 4);
    let strip_px = view.camera.pixel_from_table(Point::new(-0.06, 0.048), 0.0);
    for (search, candidates) in lost {
        assert!(covered(search.time_s), "{search:?}");
        let strip = candidates.iter().find(|c| c.spot.centroid.distance_px(strip_px) < 4.0);
        let reason = strip.map(|candidate| &candidate.reason);
        assert!(matches!(reason, Some(Rejection::Shape { ratio }) if *ratio > 1.28), "{candidates:?}");
        let by_distance = candidates.windows(2).all(|pair| pair[0].distance_m <= pair[1].distance_m + 0.003);
        assert!(by_distance, "{candidates:?}");
    }
}

#[test]
fn the_marker_of_another_object_is_recorded_as_that() {
    let view = view();
    let objects = [object("a", disc(0.03), disc(0.011)), object("b", disc(0.025), disc(0.011))];
    let poses = [Pose::new(-0.03, 0.0, 0.0), Pose::new(0.03, 0.01, 0.0)];
    let frames = film(&view, &times_s(14), |t| {
        let mut things: Vec<Thing> = (0..2).flat_map(|k| Thing::object(&objects[k], poses[k])).collect();
        if t > 0.12 {
            things.push(Thing::flat(disc(0.032), poses[0], 0.031, 165.0));
        }
        things
    });
    let found = explained_film(&view, frames, &objects);
    let lost = lost(&found.searches[0]);
    assert!(lost.len() >= 5, "{} lost", lost.len());
    let (_, candidates) = lost.last().expect("a lost frame");
    let of_b = Rejection::Taken { by: "b".into() };
    assert!(candidates.iter().any(|candidate| candidate.reason == of_b), "{candidates:?}");
    assert!(found.searches[1].frames.iter().all(|search| search.outcome.is_trusted()));
}

#[test]
fn a_covered_outline_is_recorded_with_what_can_be_seen_of_it() {
    let view = view();
    let object = Object { marker: None, ..object("a", disc(0.03), disc(0.011)) };
    let pose = Pose::new(0.02, 0.01, 0.0);
    let frames = film(&view, &times_s(12), |t| {
        let mut things = Thing::object(&object, pose)[..1].to_vec();
        if t > 0.1 {
            things.push(Thing::flat(bar(0.2, 0.2), pose, 0.031, 165.0));
        }
        things
    });
    let found = explained_film(&view, frames, &[object]);
    let lost = lost(&found.searches[0]);
    assert!(lost.len() >= 4, "{} lost", lost.len());
    for (_, candidates) in lost {
        for Candidate { reason, .. } in candidates {
            assert!(
                matches!(reason, Rejection::Outline { visible, needed } if visible < needed),
                "{reason:?}"
            );
        }
    }
}

#[test]
fn after_a_camera_moved_regions_are_recorded_where_its_frames_show_them() {
    let view = view();
    let cell = tagged_cell();
    let objects = [object("a", disc(0.03), disc(0.011))];
    let things = |_: f64| beside_tags(&cell, &objects[0]);
    let mut shifted = view.clone();
    let position = Transform { position_m: [0.03, -0.1, 0.7], rpy_rad: [0.15, 0.02, 0.05] };
    shifted.camera = Camera::new([640, 400], Lens::pinhole([640, 400], 700.0), position);
    let mut frames = film(&view, &times_s(6), things);
    frames.extend(film(&shifted, &times_s(12), things).into_iter().skip(6));
    let capture = Capture::of(Footage::from_frames("drawn", frames), &cell).expect("tags");
    let found = explained(capture, &objects, &["a".into()], &Layout::Unknown, &Options::default());
    let found = found.expect("tracks");
    let last = found.searches[0].frames.last().expect("a search");
    assert!(found.cameras.len() > 1 && last.camera > 0);
    let Outcome::Found(sighting) = &last.outcome else { panic!("{:?}", last.outcome) };
    let at: Pixel = shifted.camera.pixel_from_table(Point::ORIGIN, found.searches[0].height_m);
    assert!(sighting.spot.centroid.distance_px(at) < 0.5, "{sighting:?}, drawn at {at:?}");
}
