//! Which event happens to a body without another one: it falls off the table, or a piece of its curved path ends.

use crate::geometry::{Point, Vec2};
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::Motion;

/// An event of a single body, valid until the body changes its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ScheduledEvent {
    /// Time (s).
    pub(crate) time_s: f64,
    /// Index of the body.
    pub(crate) body: usize,
    /// What happens.
    pub(crate) event: BodyEvent,
}

/// Kinds of events of a single body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BodyEvent {
    /// Its centre passes the edge of the table.
    Fall,
    /// The next piece of its curved path begins.
    NextPiece,
}

/// The next event of a body with a new motion on a table with this edge (counter-clockwise; empty: none).
pub(crate) fn next_event(
    edge: &[Point],
    index: usize,
    body: &Body,
    motion: &Motion,
) -> Option<ScheduledEvent> {
    let length_m = (motion.end.position - motion.start.position).length();
    let fall_s = distance_to_edge_m(edge, motion.start.position, motion.direction)
        .filter(|&m| m <= length_m)
        .and_then(|m| motion.time_at_distance_s(m, motion.start_s, body));
    let scheduled = |time_s, event| ScheduledEvent { time_s, body: index, event };
    let next_piece = motion.is_piece().then(|| scheduled(motion.stop_s, BodyEvent::NextPiece));
    fall_s.map(|time_s| scheduled(time_s, BodyEvent::Fall)).or(next_piece)
}

/// The distance along a unit vector to where it leaves a counter-clockwise outline (m); none if it does not.
fn distance_to_edge_m(outline: &[Point], from: Point, along: Vec2) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    for (k, &corner) in outline.iter().enumerate() {
        let side = outline[(k + 1) % outline.len()] - corner;
        let (outwards, to_corner) = (along.cross(side), corner - from);
        let (distance_m, fraction) = (to_corner.cross(side) / outwards, to_corner.cross(along) / outwards);
        if outwards > 0.0
            && distance_m >= 0.0
            && (0.0..=1.0).contains(&fraction)
            && nearest.is_none_or(|n| distance_m < n)
        {
            nearest = Some(distance_m);
        }
    }
    nearest
}
