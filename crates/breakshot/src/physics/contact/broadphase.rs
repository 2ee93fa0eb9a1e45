//! Which bodies can a body collide with?
//!
//! A circle contains the rest of each body's path, its outline included.  Circles are stored side by side in memory in blocks
//! of eight and tested eight at a time.  Bodies are sorted by position, so that a box around each block excludes most of them:
//! for a few hundred bodies this is faster than a grid or a tree.

use crate::geometry::Point;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::Motion;

/// Circles per block, tested side by side.
const LANES: usize = 8;
/// Up to this number of blocks, testing their boxes costs more than it saves.
const FEW_BLOCKS: usize = 2;

/// The circles of all bodies, and the results of the last query.
#[derive(Clone, Debug, Default)]
pub(crate) struct Broadphase {
    circles: CircleSet,
    results: Vec<u32>,
}

/// The circles around the paths of all bodies, in blocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct CircleSet {
    /// Centres and radii (m); the last block is filled up with circles at infinity.
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    radius_m: Vec<f64>,
    /// The boxes around the blocks.
    boxes: Vec<Bounds>,
    bodies: usize,
}

/// Least x, least y, greatest x and greatest y (m).
type Bounds = [f64; 4];

/// A box that contains everything, and one that contains nothing.
const EVERYTHING: Bounds = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
const NOTHING: Bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];

/// A circle in the table frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circle {
    /// Its centre.
    pub(crate) centre: Point,
    /// Its radius (m).
    pub(crate) radius_m: f64,
}

impl Circle {
    /// The circle that contains a body, outline included, on the rest of its path.
    pub(crate) fn around(body: &Body, motion: &Motion) -> Self {
        Self { centre: motion.middle(), radius_m: body.shape.outer_radius_m + motion.half_distance_m }
    }

    /// Whether the box around it overlaps another box.
    fn overlaps_box(&self, [x_low, y_low, x_high, y_high]: &Bounds) -> bool {
        let (Point { x, y }, r) = (self.centre, self.radius_m);
        x + r >= *x_low && x - r <= *x_high && y + r >= *y_low && y - r <= *y_high
    }

    /// Squared distances minus squared sums of radii (m2): negative where circles overlap.
    fn excess_m2(&self, x_m: &[f64; LANES], y_m: &[f64; LANES], radius_m: &[f64; LANES]) -> [f64; LANES] {
        std::array::from_fn(|k| {
            let (dx, dy) = (x_m[k] - self.centre.x, y_m[k] - self.centre.y);
            let radii_m = radius_m[k] + self.radius_m;
            dx * dx + dy * dy - radii_m * radii_m
        })
    }
}

impl Broadphase {
    /// Starts a rollout with these circles.
    pub(crate) fn reset(&mut self, circles: &CircleSet) {
        self.circles.copy_from(circles);
    }

    /// Updates the circle of a body with a new motion.
    pub(crate) fn update(&mut self, index: usize, body: &Body, motion: &Motion) {
        self.circles.update(index, body, motion);
    }

    /// Finds all bodies whose circles overlap this one, in increasing order; returns their number.
    pub(crate) fn query(&mut self, circle: Circle) -> usize {
        let Self { circles, results } = self;
        results.clear();
        circles.for_each_overlap(circle, |body| results.push(body as u32));
        results.len()
    }

    /// The k-th body found by the last [`Broadphase::query`].
    pub(crate) fn result(&self, k: usize) -> usize {
        self.results[k] as usize
    }
}

impl CircleSet {
    /// The circles of all bodies.
    pub(crate) fn new(bodies: &[Body], motions: &[Motion]) -> Self {
        let radii_m = bodies.len().next_multiple_of(LANES);
        let blocks = radii_m / LANES;
        let mut circles = Self {
            x_m: vec![f64::INFINITY; radii_m],
            y_m: vec![0.0; radii_m],
            radius_m: vec![0.0; radii_m],
            boxes: vec![EVERYTHING; blocks],
            bodies: bodies.len(),
        };
        for (k, (body, motion)) in bodies.iter().zip(motions).enumerate() {
            circles.set(k, Circle::around(body, motion));
        }
        if blocks > FEW_BLOCKS {
            (0..blocks).for_each(|block| circles.update_box(block));
        }
        circles
    }

    /// Copies the circles of another set without allocating.
    fn copy_from(&mut self, other: &Self) {
        self.x_m.clone_from(&other.x_m);
        self.y_m.clone_from(&other.y_m);
        self.radius_m.clone_from(&other.radius_m);
        self.boxes.clone_from(&other.boxes);
        self.bodies = other.bodies;
    }

    fn set(&mut self, index: usize, Circle { centre, radius_m }: Circle) {
        (self.x_m[index], self.y_m[index], self.radius_m[index]) = (centre.x, centre.y, radius_m);
    }

    /// Computes the box around the circles of a block.
    fn update_box(&mut self, block: usize) {
        let mut bounds = NOTHING;
        for k in block * LANES..self.bodies.min((block + 1) * LANES) {
            let (x, y, r) = (self.x_m[k], self.y_m[k], self.radius_m[k]);
            let circle = [x - r, y - r, x + r, y + r];
            bounds = std::array::from_fn(|side| {
                if side < 2 { bounds[side].min(circle[side]) } else { bounds[side].max(circle[side]) }
            });
        }
        self.boxes[block] = bounds;
    }

    fn update(&mut self, index: usize, body: &Body, motion: &Motion) {
        self.set(index, Circle::around(body, motion));
        if self.boxes.len() > FEW_BLOCKS {
            self.update_box(index / LANES);
        }
    }

    /// Visits all bodies whose circles overlap this one, in increasing order.
    pub(crate) fn for_each_overlap(&self, circle: Circle, mut visit: impl FnMut(usize)) {
        let Self { x_m, y_m, radius_m, boxes, .. } = self;
        let blocks = x_m.as_chunks().0.iter().zip(y_m.as_chunks().0).zip(radius_m.as_chunks().0);
        for (block, (((x_m, y_m), radius_m), bounds)) in blocks.zip(boxes).enumerate() {
            if !circle.overlaps_box(bounds) {
                continue;
            }
            let excess_m2 = circle.excess_m2(x_m, y_m, radius_m);
            // A negative number has the sign bit set: most blocks contain none.
            let signs = excess_m2.iter().fold(0, |bits, number| bits | number.to_bits());
            if signs.cast_signed() < 0 {
                (0..LANES).filter(|&k| excess_m2[k] < 0.0).for_each(|k| visit(block * LANES + k));
            }
        }
    }
}
