//! How is a long motion written with a bounded number of segments?
//!
//! A pushed body makes thousands of small hops, each with segments of its own. Beyond the bound, neighbours are replaced by one
//! straight, uniform segment where that moves the body least.

use crate::geometry::Pose;
use crate::physics::output::trajectory::Segment;

/// The first tolerance of a replacement (m, and 10 rad per m): far below what a film resolves.
const FIRST_TOLERANCE_M: f64 = 1e-6;
/// The yaw (rad) that counts as much as a metre of distance: the circumference of an object of 0.1 m radius.
const YAW_RAD_PER_M: f64 = 10.0;

/// The segments of one body, at most `most` of them after each [`Thinned::extend`].
#[derive(Clone, Debug)]
pub(crate) struct Thinned {
    most: usize,
    tolerance_m: f64,
    pub(crate) segments: Vec<Segment>,
    /// Bound of the distance between the written and the exact motion (m); zero while nothing was replaced.
    pub(crate) deviation_m: f64,
}

impl Thinned {
    pub(crate) fn new(most: usize) -> Self {
        Self { most: most.max(2), tolerance_m: FIRST_TOLERANCE_M, segments: Vec::new(), deviation_m: 0.0 }
    }

    /// Adds the next segments in the order of time.
    pub(crate) fn extend(&mut self, segments: impl IntoIterator<Item = Segment>) {
        self.segments.extend(segments);
        if self.segments.len() <= self.most {
            return;
        }
        // Down to half the bound, so that there is a pass for many segments and not for a few.
        while self.segments.len() > self.most / 2 {
            let before = self.segments.len();
            self.merge_neighbours();
            if self.segments.len() > before / 2 + before / 4 {
                self.tolerance_m *= 2.0;
            }
        }
    }

    /// One pass: replaces pairs of neighbours by one segment where the tolerance allows.
    fn merge_neighbours(&mut self) {
        let mut merged: Vec<Segment> = Vec::with_capacity(self.segments.len());
        let mut largest_m = 0.0f64;
        let mut rest = std::mem::take(&mut self.segments).into_iter();
        while let Some(first) = rest.next() {
            let Some(second) = rest.next() else {
                merged.push(first);
                break;
            };
            let (chord, deviation_m) = chord(&first, &second);
            // A deviation that is not a number counts as none: the loop must end.
            if deviation_m > self.tolerance_m {
                merged.extend([first, second]);
            } else {
                largest_m = largest_m.max(deviation_m);
                merged.push(chord);
            }
        }
        self.deviation_m += largest_m;
        self.segments = merged;
    }
}

/// The straight, uniform segment from the start of one segment to the end of the next, and its largest deviation from them (m).
fn chord(first: &Segment, second: &Segment) -> (Segment, f64) {
    let (start_s, end_s) = (first.start_s, second.end_s);
    let duration_s = end_s - start_s;
    let (from, to) = (first.pose(start_s), second.pose(end_s));
    let rate = |difference: f64| if duration_s > 0.0 { difference / duration_s } else { 0.0 };
    let across = to.position - from.position;
    let chord = Segment {
        start_s,
        end_s,
        x_m: vec![from.position.x, rate(across.x)],
        y_m: vec![from.position.y, rate(across.y)],
        yaw_rad: vec![from.yaw_rad, rate(to.yaw_rad - from.yaw_rad)],
    };
    let middle = |segment: &Segment| 0.5 * (segment.start_s + segment.end_s);
    let exact = [
        (middle(first), first.pose(middle(first))),
        (first.end_s, first.pose(first.end_s)),
        (second.start_s, second.pose(second.start_s)),
        (middle(second), second.pose(middle(second))),
    ];
    let apart_m = |(time_s, pose): (f64, Pose)| {
        let on_chord = chord.pose(time_s);
        let turned_m = (on_chord.yaw_rad - pose.yaw_rad).abs() / YAW_RAD_PER_M;
        on_chord.position.distance(pose.position).max(turned_m)
    };
    let deviation_m = exact.map(apart_m).into_iter().fold(0.0, f64::max);
    (chord, deviation_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hops of 2 ms and 1 micrometre on the way along x at 0.1 m/s.
    fn hops(count: usize) -> Vec<Segment> {
        let hop = |k: usize| {
            let start_s = 0.002 * k as f64;
            let x_m = vec![0.1 * start_s, 0.1 + 0.001, -0.5];
            Segment { start_s, end_s: start_s + 0.002, x_m, y_m: vec![0.0], yaw_rad: vec![0.0] }
        };
        (0..count).map(hop).collect()
    }

    #[test]
    fn few_segments_stay_as_they_are() {
        let mut thinned = Thinned::new(100);
        thinned.extend(hops(100));
        assert_eq!((thinned.segments, thinned.deviation_m), (hops(100), 0.0));
    }

    #[test]
    fn many_small_hops_become_few_segments_near_the_same_path() {
        let (mut thinned, all) = (Thinned::new(50), hops(4000));
        for part in all.chunks(7) {
            thinned.extend(part.to_vec());
        }
        assert!(thinned.segments.len() <= 50, "{} segments", thinned.segments.len());
        assert!(thinned.deviation_m < 1e-4, "{} m", thinned.deviation_m);
        for segment in &thinned.segments {
            let (time_s, x_m) = (segment.start_s, segment.pose(segment.start_s).position.x);
            assert!((x_m - 0.1 * time_s).abs() <= thinned.deviation_m + 2e-6, "{x_m} m at {time_s} s");
        }
        let last = thinned.segments.last().expect("segments");
        assert!((last.pose(8.0).position.x - 0.8).abs() < 1e-9, "the end is exact");
    }
}
