//! Which runs belong to one component?

use super::component::Component;
use super::row_bits::Run;
use std::ops::RangeInclusive;

/// The components that still grow: a union-find forest whose labels are used again once a component is complete, so
/// that it stays in the fastest memory however noisy the picture is.
#[derive(Debug, Default)]
pub(super) struct Parts {
    parent: Vec<u32>,
    last_row: Vec<u32>,
    grown: Vec<Component>,
    free: Vec<u32>,
    merged: Vec<u32>,
}

/// The `last_row` of a component that was handed over.
const COMPLETE: u32 = u32::MAX;

impl Parts {
    pub(super) fn clear(&mut self) {
        self.parent.clear();
        self.last_row.clear();
        self.grown.clear();
        self.free.clear();
        self.merged.clear();
    }

    fn root(&mut self, mut label: u32) -> u32 {
        while self.parent[label as usize] != label {
            let above = self.parent[label as usize];
            self.parent[label as usize] = self.parent[above as usize];
            label = above;
        }
        label
    }

    fn united(&mut self, one: u32, other: u32) -> u32 {
        if one != other {
            let part = self.grown[other as usize];
            self.grown[one as usize].absorb(&part);
            self.parent[other as usize] = one;
            self.merged.push(other);
        }
        one
    }

    fn fresh(&mut self, y: u32, x: u32) -> u32 {
        let empty = Component { x: [u32::MAX, 0], y: [y, y], seed: [x, y], ..Component::default() };
        if let Some(label) = self.free.pop() {
            self.parent[label as usize] = label;
            self.grown[label as usize] = empty;
            return label;
        }
        let label = self.parent.len() as u32;
        self.parent.push(label);
        self.last_row.push(y);
        self.grown.push(empty);
        label
    }

    /// Gives every run of row `y` the label of what it touches above, or a new one.
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
                label = Some(label.map_or(root, |label| self.united(label, root)));
                k += 1;
            }
            // The last one above may reach the next run too.
            first = first.max(k.saturating_sub(1));
            run.label = label.unwrap_or_else(|| self.fresh(y, run.start));
            self.grown[run.label as usize].add_run(y, run);
            self.last_row[run.label as usize] = y;
        }
    }

    /// Hands over the components of the row above that row `y` does not continue.
    pub(super) fn close(
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
            if areas_px.contains(&self.grown[root].area_px) {
                found.push(self.grown[root]);
            }
        }
    }

    /// Leaves only roots as labels of the row, so that merged labels can be used again.
    pub(super) fn settle(&mut self, row: &mut [Run]) {
        if self.merged.is_empty() {
            return;
        }
        for run in row {
            run.label = self.root(run.label);
        }
        self.free.append(&mut self.merged);
    }
}
