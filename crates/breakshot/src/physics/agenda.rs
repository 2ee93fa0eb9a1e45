//! What comes next?
//!
//! A heap of predictions, the earliest first.  A prediction is void as soon as one of its bodies has changed its motion:
//! each body counts its motions, and a prediction remembers the counts.

use super::contact::Feature;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A prediction about two bodies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prediction {
    /// When (s).
    pub(crate) time_s: f64,
    /// The two bodies, the smaller index first.
    pub(crate) bodies: [u32; 2],
    /// Which motion of each it is about.
    pub(crate) counts: [u32; 2],
    /// Whether they touch then, or must only be looked at again.
    pub(crate) touch: bool,
    /// What kept them apart when last looked at.
    pub(crate) hint: Option<Feature>,
}

impl Eq for Prediction {}

impl Ord for Prediction {
    /// The earliest is the greatest; ties go to the bodies that come first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.time_s.total_cmp(&self.time_s).then_with(|| other.bodies.cmp(&self.bodies))
    }
}

impl PartialOrd for Prediction {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// All predictions of a rollout.
#[derive(Clone, Debug, Default)]
pub(crate) struct Agenda {
    heap: BinaryHeap<Prediction>,
    counts: Vec<u32>,
}

impl Agenda {
    /// Forgets everything; there are so many bodies.
    pub(crate) fn clear(&mut self, bodies: usize) {
        self.heap.clear();
        self.counts.clear();
        self.counts.resize(bodies, 0);
    }

    /// Voids all predictions about a body.
    pub(crate) fn void(&mut self, body: usize) {
        self.counts[body] += 1;
    }

    pub(crate) fn add(&mut self, time_s: f64, [a, b]: [usize; 2], touch: bool, hint: Option<Feature>) {
        let (bodies, counts) = ([a as u32, b as u32], [self.counts[a], self.counts[b]]);
        self.heap.push(Prediction { time_s, bodies, counts, touch, hint });
    }

    /// The earliest prediction that holds.
    pub(crate) fn first(&mut self) -> Option<Prediction> {
        while let Some(prediction) = self.heap.peek() {
            let current = prediction.bodies.map(|b| self.counts[b as usize]);
            if current == prediction.counts {
                return Some(*prediction);
            }
            self.heap.pop();
        }
        None
    }

    /// Takes the earliest prediction away; the time of the next one, which may be void (s).
    pub(crate) fn take(&mut self) -> f64 {
        self.heap.pop();
        self.heap.peek().map_or(f64::INFINITY, |p| p.time_s)
    }
}
