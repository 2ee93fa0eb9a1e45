//! Which predicted event comes next?
//!
//! Few bodies: a table with one prediction per pair, searched from end to end.  Many bodies: a heap of predictions.  A
//! prediction is invalid as soon as one of its bodies has changed its motion: the table deletes it; in the heap each prediction
//! stores the number of motions that its bodies had, and is dropped when they have more.

use crate::physics::contact::separating_axis::Feature;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A predicted contact of two bodies, or a lower bound of its time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Prediction {
    /// Time (s).
    pub(crate) time_s: f64,
    /// The two bodies, the smaller index first.
    pub(crate) bodies: [u32; 2],
    /// Number of motions that each had at the time of the prediction.
    pub(crate) counts: [u32; 2],
    /// Whether they touch at this time; if not, it is a lower bound to be refined.
    pub(crate) is_contact: bool,
    /// The features that separated them in the last search.
    pub(crate) hint: Option<Feature>,
}

impl Eq for Prediction {}

impl Ord for Prediction {
    /// The earliest is the greatest; on ties, the one of the lower body indices.
    fn cmp(&self, other: &Self) -> Ordering {
        other.time_s.total_cmp(&self.time_s).then_with(|| other.bodies.cmp(&self.bodies))
    }
}

impl PartialOrd for Prediction {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Up to this number of bodies a search through all pairs is faster than a heap.
const FEW: usize = 10;

/// All predictions of a rollout.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventQueue {
    counts: Vec<u32>,
    heap: BinaryHeap<Prediction>,
    /// Time of the prediction of each pair, in the order of pairs (s); infinite: none.
    times: Vec<f64>,
    /// Prediction of each pair.
    table: Vec<Prediction>,
}

impl EventQueue {
    /// Removes all predictions and sets the number of bodies.
    pub(crate) fn clear(&mut self, bodies: usize) {
        self.heap.clear();
        self.counts.clear();
        self.counts.resize(bodies, 0);
        self.times.clear();
        self.table.clear();
        if bodies > FEW {
            return;
        }
        self.times.resize(bodies * (bodies - 1) / 2, f64::INFINITY);
        for a in 0..bodies as u32 {
            for b in a + 1..bodies as u32 {
                let (counts, is_contact, hint) = ([0; 2], false, None);
                self.table.push(Prediction {
                    time_s: f64::INFINITY,
                    bodies: [a, b],
                    counts,
                    is_contact,
                    hint,
                });
            }
        }
    }

    /// Invalidates all predictions about a body.
    pub(crate) fn invalidate(&mut self, body: usize) {
        if self.table.is_empty() {
            self.counts[body] += 1;
            return;
        }
        for other in (0..self.counts.len()).filter(|&k| k != body) {
            let index = self.index([body.min(other), body.max(other)]);
            self.times[index] = f64::INFINITY;
        }
    }

    /// The index of a pair in the table.
    fn index(&self, [a, b]: [usize; 2]) -> usize {
        a * self.counts.len() - a * (a + 1) / 2 + b - a - 1
    }

    /// Adds a prediction of a pair; in the table it replaces the one before.
    pub(crate) fn push(&mut self, time_s: f64, pair: [usize; 2], is_contact: bool, hint: Option<Feature>) {
        if self.table.is_empty() {
            let (bodies, counts) = (pair.map(|b| b as u32), pair.map(|b| self.counts[b]));
            self.heap.push(Prediction { time_s, bodies, counts, is_contact, hint });
            return;
        }
        let index = self.index(pair);
        self.times[index] = time_s;
        let entry = &mut self.table[index];
        (entry.time_s, entry.is_contact) = (time_s, is_contact);
        // The features that separated them before probably do so again.
        entry.hint = hint.or(entry.hint);
    }

    /// Takes the earliest prediction that holds away, unless it comes after `until_s`; with the time of the next one (s),
    /// which may be invalidate.
    pub(crate) fn pop(&mut self, until_s: f64) -> Option<(Prediction, f64)> {
        if !self.table.is_empty() {
            return self.pop_from_table(until_s);
        }
        loop {
            let prediction = *self.heap.peek()?;
            if prediction.time_s > until_s {
                return None;
            }
            self.heap.pop();
            if prediction.bodies.map(|b| self.counts[b as usize]) == prediction.counts {
                return Some((prediction, self.heap.peek().map_or(f64::INFINITY, |p| p.time_s)));
            }
        }
    }

    fn pop_from_table(&mut self, until_s: f64) -> Option<(Prediction, f64)> {
        let (mut first, mut next_s, mut index) = (f64::INFINITY, f64::INFINITY, 0);
        for (k, &time_s) in self.times.iter().enumerate() {
            if time_s < first {
                (first, next_s, index) = (time_s, first, k);
            } else if time_s < next_s {
                next_s = time_s;
            }
        }
        if first > until_s || first == f64::INFINITY {
            return None;
        }
        self.times[index] = f64::INFINITY;
        Some((self.table[index], next_s))
    }
}
