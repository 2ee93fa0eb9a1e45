//! What comes next?
//!
//! Few bodies: a table with one prediction a pair, searched from end to end.  Many: a heap of predictions, the earliest
//! first.  A prediction is void as soon as one of its bodies has changed its motion: the table forgets it, and in the heap each
//! body counts its motions and a prediction remembers the counts.

use crate::physics::contact::Feature;
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

/// Up to so many bodies a search through all pairs is quicker than a heap.
const FEW: usize = 10;

/// All predictions of a rollout.
#[derive(Clone, Debug, Default)]
pub(crate) struct Agenda {
    counts: Vec<u32>,
    heap: BinaryHeap<Prediction>,
    /// When something is predicted for each pair, in order of the pairs; infinite: nothing.
    times: Vec<f64>,
    /// What is predicted for each pair.
    table: Vec<Prediction>,
}

impl Agenda {
    /// Forgets everything; there are so many bodies.
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
                let (counts, touch, hint) = ([0; 2], false, None);
                self.table.push(Prediction { time_s: f64::INFINITY, bodies: [a, b], counts, touch, hint });
            }
        }
    }

    /// Voids all predictions about a body.
    pub(crate) fn void(&mut self, body: usize) {
        if self.table.is_empty() {
            self.counts[body] += 1;
            return;
        }
        for other in (0..self.counts.len()).filter(|&k| k != body) {
            let slot = self.slot([body.min(other), body.max(other)]);
            self.times[slot] = f64::INFINITY;
        }
    }

    /// The place of a pair in the table.
    fn slot(&self, [a, b]: [usize; 2]) -> usize {
        a * self.counts.len() - a * (a + 1) / 2 + b - a - 1
    }

    pub(crate) fn add(&mut self, time_s: f64, pair: [usize; 2], touch: bool, hint: Option<Feature>) {
        if self.table.is_empty() {
            let (bodies, counts) = (pair.map(|b| b as u32), pair.map(|b| self.counts[b]));
            self.heap.push(Prediction { time_s, bodies, counts, touch, hint });
            return;
        }
        let slot = self.slot(pair);
        self.times[slot] = time_s;
        let entry = &mut self.table[slot];
        (entry.time_s, entry.touch) = (time_s, touch);
        // What kept them apart before may do so again.
        entry.hint = hint.or(entry.hint);
    }

    /// Takes the earliest prediction that holds away, unless it comes after `until_s`; with the time of the next one (s),
    /// which may be void.
    pub(crate) fn take(&mut self, until_s: f64) -> Option<(Prediction, f64)> {
        if !self.table.is_empty() {
            return self.take_from_table(until_s);
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

    fn take_from_table(&mut self, until_s: f64) -> Option<(Prediction, f64)> {
        let (mut first, mut next_s, mut slot) = (f64::INFINITY, f64::INFINITY, 0);
        for (k, &time_s) in self.times.iter().enumerate() {
            if time_s < first {
                (first, next_s, slot) = (time_s, first, k);
            } else if time_s < next_s {
                next_s = time_s;
            }
        }
        if first > until_s || first == f64::INFINITY {
            return None;
        }
        self.times[slot] = f64::INFINITY;
        Some((self.table[slot], next_s))
    }
}
