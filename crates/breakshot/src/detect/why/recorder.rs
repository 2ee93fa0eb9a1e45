//! The record of all searches, kept beside a tracker.

use super::super::label::Labeller;
use super::super::motion_blur::FrameView;
use super::super::track::Tracker;
use super::super::track_state::{TrackPoint, TrackState};
use super::super::tracks::{Sample, Track};
use super::candidates::{Seen, candidates};
use super::reason::Doubt;
use super::{Candidate, ObjectSearches, Outcome, Search, Sighting, Spot};
use crate::capture::{Camera, Frame};
use crate::geometry::Pose;

/// Where objects were expected, frame by frame, and what was refused where they were lost.
pub(in crate::detect) struct Recorder {
    cameras: Vec<Camera>,
    /// For each object.
    records: Vec<Vec<Record>>,
    labeller: Labeller,
}

/// One object in one frame.
struct Record {
    time_s: f64,
    camera: usize,
    predicted: Pose,
    radius_m: f64,
    /// Empty for an object that was found.
    candidates: Vec<Candidate>,
}

impl Recorder {
    pub(in crate::detect) fn new(camera: &Camera, objects: usize) -> Self {
        let records = (0..objects).map(|_| Vec::new()).collect();
        Self { cameras: vec![camera.clone()], records, labeller: Labeller::default() }
    }

    /// Tracks the next frame, as [`Tracker::track`], and records how.
    pub(in crate::detect) fn track(&mut self, tracker: &mut Tracker, frame: &Frame, camera: &Camera) {
        let number = self.number_of(camera);
        let view = tracker.view(frame, camera);
        for (object, records) in self.records.iter_mut().enumerate() {
            let prediction = tracker.prediction(object, frame.time_s);
            records.push(Record {
                time_s: frame.time_s,
                camera: number,
                predicted: prediction.pose,
                radius_m: prediction.reach_m(&view),
                candidates: Vec::new(),
            });
        }
        tracker.track(frame, camera);
        self.add_candidates(tracker, &view);
    }

    /// The index of a camera among those so far, which it joins if it is new.
    fn number_of(&mut self, camera: &Camera) -> usize {
        let last = self.cameras.len() - 1;
        let known = [0, last].into_iter().find(|&k| self.cameras[k] == *camera);
        known.unwrap_or_else(|| {
            self.cameras.push(camera.clone());
            last + 1
        })
    }

    /// Adds what was refused to the records of the objects that were lost in the last frame.
    fn add_candidates(&mut self, tracker: &Tracker, view: &FrameView) {
        let frame = tracker.times_s().len() - 1;
        let point = |state: &TrackState| state.points.last().filter(|p| p.frame == frame).copied();
        let base = &self.cameras[0];
        let seen = |state: &TrackState| {
            let (TrackPoint { pose, blob, .. }, height_m) = (point(state)?, state.target.height_m());
            let marker_m = if state.target.is_markerless() {
                pose.position
            } else {
                base.table_from_pixel(blob.centroid, height_m)
            };
            let reach_m = state.target.feature.shape.area_m2().sqrt() / 2.0;
            Some(Seen { name: state.target.name.to_owned(), marker_m, reach_m })
        };
        let all: Vec<Seen> = tracker.states.iter().filter_map(seen).collect();
        for (object, records) in self.records.iter_mut().enumerate() {
            // A lost object has no new point: its prediction is the one that was searched.
            if point(&tracker.states[object]).is_none()
                && let Some(record) = records.last_mut()
            {
                let prediction = tracker.prediction(object, view.frame.time_s);
                record.candidates = candidates(&prediction, view, &mut self.labeller, &all);
            }
        }
    }

    /// Reverses the order of the frames so far, whose times are negative.
    pub(in crate::detect) fn mirror(&mut self) {
        for records in &mut self.records {
            records.reverse();
            for record in records {
                record.time_s = -record.time_s;
            }
        }
    }

    /// The searches with what the finished tracks say about each.
    pub(in crate::detect) fn finished(
        self,
        states: &[TrackState],
        tracks: &[Track],
        doubts: &[Vec<Vec<Doubt>>],
    ) -> (Vec<Camera>, Vec<ObjectSearches>) {
        let Self { cameras, records, .. } = self;
        let mut searches = Vec::new();
        for (object, (state, records)) in states.iter().zip(records).enumerate() {
            let height_m = state.target.height_m();
            let mut found = state.points.iter().zip(&tracks[object].samples).zip(&doubts[object]).peekable();
            let mut frames = Vec::with_capacity(records.len());
            for (number, record) in records.into_iter().enumerate() {
                let outcome = match found.next_if(|((point, _), _)| point.frame == number) {
                    None => Outcome::Lost(record.candidates),
                    Some(((point, sample), doubts)) => {
                        let both = [&cameras[0], &cameras[record.camera]];
                        let sighting = sighting(point, sample, both, height_m);
                        match &doubts[..] {
                            [] => Outcome::Found(sighting),
                            doubts => Outcome::Doubtful(sighting, doubts.to_vec()),
                        }
                    }
                };
                let Record { time_s, camera, predicted, radius_m, .. } = record;
                frames.push(Search { frame: number, time_s, camera, predicted, radius_m, outcome });
            }
            searches.push(ObjectSearches { object: state.target.name.to_owned(), height_m, frames });
        }
        (cameras, searches)
    }
}

/// What was found, in the picture of the frame's own camera; markers are recorded as the first camera would have seen them.
fn sighting(point: &TrackPoint, sample: &Sample, [first, own]: [&Camera; 2], height_m: f64) -> Sighting {
    let at_m = first.table_from_pixel(point.blob.centroid, height_m);
    let centroid = if first == own { point.blob.centroid } else { own.pixel_from_table(at_m, height_m) };
    Sighting {
        pose: Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(point.pose.yaw_rad) },
        std_m: sample.std_m,
        spot: Spot { centroid, covariance_px2: point.blob.covariance_px2 },
    }
}
