//! Which bodies can a body meet?
//!
//! A few bodies: all of them.  Many: a grid of square cells, each body entered in all cells that the box around the rest
//! of its path covers.  Two bodies whose paths come close share a cell; whatever lies outside the grid counts as its rim.

use super::body::Body;
use super::evolve::Motion;
use crate::geometry::Point;

/// Up to so many bodies a grid costs more than it spares.
const FEW: usize = 16;
/// Cells along one side at most.
const MOST_CELLS: f64 = 64.0;

/// The cells from the first to the last along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Span {
    low: [u16; 2],
    high: [u16; 2],
}

/// One body in one cell.
#[derive(Clone, Copy, Debug)]
struct Entry {
    body: u32,
    next: u32,
}

/// The end of a cell's list.
const NONE: u32 = u32::MAX;

/// Where bodies are and where they are going.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    bodies: usize,
    gridded: bool,
    origin: Point,
    per_cell: f64,
    size: [u16; 2],
    /// The first entry of each cell.
    cells: Vec<u32>,
    entries: Vec<Entry>,
    free: u32,
    spans: Vec<Span>,
    /// When each body was last found.
    marks: Vec<u32>,
    mark: u32,
    found: Vec<u32>,
}

impl Neighbours {
    /// Enters all bodies.
    pub(crate) fn start(&mut self, bodies: &[Body], motions: &[Motion]) {
        self.bodies = bodies.len();
        self.gridded = bodies.len() > FEW;
        if !self.gridded {
            return;
        }
        let centres = || bodies[1..].iter().map(|b| b.pose.position);
        let low = centres().fold([f64::INFINITY; 2], |l, p| [l[0].min(p.x), l[1].min(p.y)]);
        let high = centres().fold([f64::NEG_INFINITY; 2], |h, p| [h[0].max(p.x), h[1].max(p.y)]);
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let mean_radius = bodies.iter().map(|b| b.plate.outer_radius_m).sum::<f64>() / bodies.len() as f64;
        // Cells a little larger than a body, with two rows around for what is driven out.
        let cell_m = (2.5 * mean_radius).max(extent / (MOST_CELLS - 5.0));
        self.per_cell = 1.0 / cell_m;
        self.origin = Point::new(low[0] - 2.0 * cell_m, low[1] - 2.0 * cell_m);
        self.size = [0, 1].map(|k| ((high[k] - low[k]) * self.per_cell) as u16 + 5);
        self.cells.clear();
        self.cells.resize(usize::from(self.size[0]) * usize::from(self.size[1]), NONE);
        self.entries.clear();
        self.free = NONE;
        self.marks.clear();
        self.marks.resize(bodies.len(), 0);
        self.mark = 0;
        self.spans.clear();
        self.spans.resize(bodies.len(), Span::default());
        for (k, (body, motion)) in bodies.iter().zip(motions).enumerate() {
            self.enter(k, self.span(body, motion.start.position, motion.end.position));
        }
    }

    /// A body goes another way.
    pub(crate) fn change(&mut self, index: usize, body: &Body, motion: &Motion) {
        if self.gridded {
            let span = self.span(body, motion.start.position, motion.end.position);
            if span != self.spans[index] {
                self.leave(index);
                self.enter(index, span);
            }
        }
    }

    /// All bodies that one can meet on a way between two points, itself included, in order.
    pub(crate) fn around(&mut self, body: &Body, from: Point, to: Point) -> &[u32] {
        self.found.clear();
        if !self.gridded {
            self.found.extend(0..self.bodies as u32);
            return &self.found;
        }
        self.mark += 1;
        let span = self.span(body, from, to);
        for y in span.low[1]..=span.high[1] {
            for x in span.low[0]..=span.high[0] {
                let mut entry = self.cells[self.cell(x, y)];
                while entry != NONE {
                    let Entry { body, next } = self.entries[entry as usize];
                    if self.marks[body as usize] != self.mark {
                        self.marks[body as usize] = self.mark;
                        self.found.push(body);
                    }
                    entry = next;
                }
            }
        }
        self.found.sort_unstable();
        &self.found
    }

    /// The k-th body that [`Neighbours::around`] found last.
    pub(crate) fn found(&self, k: usize) -> usize {
        self.found[k] as usize
    }

    fn cell(&self, x: u16, y: u16) -> usize {
        usize::from(y) * usize::from(self.size[0]) + usize::from(x)
    }

    /// The cells of the box around a body on its way; what is outside the grid belongs to its rim.
    fn span(&self, body: &Body, from: Point, to: Point) -> Span {
        let reach = body.plate.outer_radius_m + REACH_M;
        let index = |value: f64, origin: f64, size: u16| {
            (((value - origin) * self.per_cell).max(0.0) as u16).min(size - 1)
        };
        let ends = |a: f64, b: f64, origin: f64, size: u16| {
            [index(a.min(b) - reach, origin, size), index(a.max(b) + reach, origin, size)]
        };
        let x = ends(from.x, to.x, self.origin.x, self.size[0]);
        let y = ends(from.y, to.y, self.origin.y, self.size[1]);
        Span { low: [x[0], y[0]], high: [x[1], y[1]] }
    }

    fn enter(&mut self, body: usize, span: Span) {
        self.spans[body] = span;
        for y in span.low[1]..=span.high[1] {
            for x in span.low[0]..=span.high[0] {
                let cell = self.cell(x, y);
                let entry = Entry { body: body as u32, next: self.cells[cell] };
                self.cells[cell] = if self.free == NONE {
                    self.entries.push(entry);
                    self.entries.len() as u32 - 1
                } else {
                    let slot = self.free;
                    self.free = self.entries[slot as usize].next;
                    self.entries[slot as usize] = entry;
                    slot
                };
            }
        }
    }

    fn leave(&mut self, body: usize) {
        let span = self.spans[body];
        for y in span.low[1]..=span.high[1] {
            for x in span.low[0]..=span.high[0] {
                let cell = self.cell(x, y);
                let mut last = NONE;
                let mut slot = self.cells[cell];
                while self.entries[slot as usize].body != body as u32 {
                    last = slot;
                    slot = self.entries[slot as usize].next;
                }
                let next = self.entries[slot as usize].next;
                if last == NONE {
                    self.cells[cell] = next;
                } else {
                    self.entries[last as usize].next = next;
                }
                self.entries[slot as usize].next = self.free;
                self.free = slot;
            }
        }
    }
}

/// Bodies this close count as neighbours (m): more than any contact reaches.
const REACH_M: f64 = 2e-3;
