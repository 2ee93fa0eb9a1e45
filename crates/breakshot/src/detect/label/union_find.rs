//! Which runs belong to the same component?

use super::component::Component;
use super::row_bits::Run;
use std::ops::RangeInclusive;

/// A union-find forest over the components that may still grow.
///
/// Labels of completed components are used again, so that the forest stays in the fastest cache even for noisy
/// images.
#[derive(Debug, Default)]
pub(super) struct Forest {
    parent: Vec<u32>,
    /// The last row that added to a root's component, or [`COMPLETE`].
    last_row: Vec<u32>,
    components: Vec<Component>,
    /// Labels to use again.
    free: Vec<u32>,
    /// Labels merged in the current row; they become free once the row refers to roots only.
    merged: Vec<u32>,
}

/// The `last_row` of a component that was completed.
const COMPLETE: u32 = u32::MAX;

impl Forest {
    pub(super) fn clear(&mut self) {
        self.parent.clear();
        self.last_row.clear();
        self.components.clear();
        self.free.clear();
        self.merged.clear();
    }

    /// The root of a label's tree, with path halving.
    fn root(&mut self, mut label: u32) -> u32 {
        while self.parent[label as usize] != label {
            let above = self.parent[label as usize];
            self.parent[label as usize] = self.parent[above as usize];
            label = above;
        }
        label
    }

    /// Merges the component of root `other` into that of root `one`, and gives `one`.
    fn merge(&mut self, one: u32, other: u32) -> u32 {
        if one != other {
            let part = self.components[other as usize];
            self.components[one as usize].absorb(&part);
            self.parent[other as usize] = one;
            self.merged.push(other);
        }
        one
    }

    /// The label of a new, empty component that starts in row `y` and column `x`.
    fn new_label(&mut self, y: u32, x: u32) -> u32 {
        let empty = Component { x: [u32::MAX, 0], y: [y, y], seed: [x, y], ..Component::default() };
        if let Some(label) = self.free.pop() {
            self.parent[label as usize] = label;
            self.components[label as usize] = empty;
            return label;
        }
        let label = self.parent.len() as u32;
        self.parent.push(label);
        self.last_row.push(y);
        self.components.push(empty);
        label
    }

    /// Gives every run of row `y` the label of the runs it touches in the row above, or a new one.
    pub(super) fn join(&mut self, y: u32, above: &[Run], row: &mut [Run]) {
        let mut first = 0;
        for run in row {
            while first < above.len() && above[first].end < run.start {
                first += 1;
            }
            let mut label = None;
            let mut k = first;
            while k < above.len() && above[k].start <= run.end {
                let root = self.root(above[k].label);
                label = Some(label.map_or(root, |label| self.merge(label, root)));
                k += 1;
            }
            // The last of the runs above may touch the next run as well.
            first = first.max(k.saturating_sub(1));
            run.label = label.unwrap_or_else(|| self.new_label(y, run.start));
            self.components[run.label as usize].add_run(y, run);
            self.last_row[run.label as usize] = y;
        }
    }

    /// Moves the components of the row above that row `y` does not continue into `found`, if their area is in range.
    pub(super) fn complete(
        &mut self,
        y: u32,
        above: &[Run],
        areas_px: &RangeInclusive<u64>,
        found: &mut Vec<Component>,
    ) {
        for run in above {
            let root = self.root(run.label) as usize;
            if self.last_row[root] == y || self.last_row[root] == COMPLETE {
                continue;
            }
            self.last_row[root] = COMPLETE;
            self.free.push(root as u32);
            if areas_px.contains(&self.components[root].area_px) {
                found.push(self.components[root]);
            }
        }
    }

    /// Replaces the labels of the row by their roots and frees the labels that were merged.
    pub(super) fn relabel(&mut self, row: &mut [Run]) {
        if self.merged.is_empty() {
            return;
        }
        for run in row {
            run.label = self.root(run.label);
        }
        self.free.append(&mut self.merged);
    }
}
