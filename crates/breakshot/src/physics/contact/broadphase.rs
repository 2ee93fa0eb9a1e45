//! Which bodies can a body meet?
//!
//! A circle holds the rest of each body's path, its outline included.  The circles lie side by side in memory, eight to a block,
//! and are tested eight at a time.  Bodies come in order of their place, so that a box around each block rules out most of
//! them: for a few hundred bodies that is quicker than a grid or a tree.

use crate::geometry::Point;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::Motion;

/// Circles in a block.
const TOGETHER: usize = 8;
/// Up to so many blocks their boxes cost more than they spare.
const FEW_BLOCKS: usize = 2;

/// The circles of all bodies, and who was found last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Neighbours {
    circles: Circles,
    found: Vec<u32>,
}

/// Where bodies are and where they are going.
#[derive(Clone, Debug, Default)]
pub(crate) struct Circles {
    /// Centres and radii (m) of the circles, filled up with circles too far away for any.
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    radius_m: Vec<f64>,
    /// The boxes around the blocks.
    boxes: Vec<Bounds>,
    bodies: usize,
}

/// Least x, least y, greatest x and greatest y (m).
type Bounds = [f64; 4];

/// A box that holds everything, and one that holds nothing.
const EVERYWHERE: Bounds = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
const NOWHERE: Bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];

/// A circle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Circle {
    /// Its centre.
    pub(crate) centre: Point,
    /// Its radius (m).
    pub(crate) radius_m: f64,
}

impl Circle {
    /// The circle that holds a body on the whole of its way.
    pub(crate) fn around(body: &Body, motion: &Motion) -> Self {
        Self { centre: motion.middle(), radius_m: body.plate.outer_radius_m + motion.half_way_m }
    }

    /// Whether its own box meets another.
    fn meets(&self, [x_low, y_low, x_high, y_high]: &Bounds) -> bool {
        let (Point { x, y }, r) = (self.centre, self.radius_m);
        x + r >= *x_low && x - r <= *x_high && y + r >= *y_low && y - r <= *y_high
    }

    /// Squared distances less squared sums of radii (m2): negative where circles overlap.
    fn beyond(
        &self,
        (x_m, y_m, radius_m): (&[f64; TOGETHER], &[f64; TOGETHER], &[f64; TOGETHER]),
    ) -> [f64; TOGETHER] {
        std::array::from_fn(|k| {
            let (dx, dy) = (x_m[k] - self.centre.x, y_m[k] - self.centre.y);
            let room = radius_m[k] + self.radius_m;
            dx * dx + dy * dy - room * room
        })
    }
}

impl Neighbours {
    /// Begins with these circles.
    pub(crate) fn start(&mut self, circles: &Circles) {
        self.circles.copy(circles);
    }

    /// A body goes another way.
    pub(crate) fn change(&mut self, index: usize, body: &Body, motion: &Motion) {
        self.circles.change(index, body, motion);
    }

    /// All bodies whose circles meet this one, in order; how many.
    pub(crate) fn around(&mut self, circle: Circle) -> usize {
        let Self { circles, found } = self;
        found.clear();
        circles.near(circle, |body| found.push(body as u32));
        found.len()
    }

    /// The k-th body that [`Neighbours::around`] found last.
    pub(crate) fn found(&self, k: usize) -> usize {
        self.found[k] as usize
    }
}

impl Circles {
    /// Enters all bodies.
    pub(crate) fn new(bodies: &[Body], motions: &[Motion]) -> Self {
        let room = bodies.len().next_multiple_of(TOGETHER);
        let blocks = room / TOGETHER;
        let mut circles = Self {
            x_m: vec![f64::INFINITY; room],
            y_m: vec![0.0; room],
            radius_m: vec![0.0; room],
            boxes: vec![EVERYWHERE; blocks],
            bodies: bodies.len(),
        };
        for (k, (body, motion)) in bodies.iter().zip(motions).enumerate() {
            circles.enter(k, Circle::around(body, motion));
        }
        if blocks > FEW_BLOCKS {
            (0..blocks).for_each(|block| circles.bound(block));
        }
        circles
    }

    /// The same circles as others, in memory that is used again.
    fn copy(&mut self, other: &Self) {
        self.x_m.clone_from(&other.x_m);
        self.y_m.clone_from(&other.y_m);
        self.radius_m.clone_from(&other.radius_m);
        self.boxes.clone_from(&other.boxes);
        self.bodies = other.bodies;
    }

    fn enter(&mut self, index: usize, Circle { centre, radius_m }: Circle) {
        (self.x_m[index], self.y_m[index], self.radius_m[index]) = (centre.x, centre.y, radius_m);
    }

    /// Draws the box around a block's circles.
    fn bound(&mut self, block: usize) {
        let mut bounds = NOWHERE;
        for k in block * TOGETHER..self.bodies.min((block + 1) * TOGETHER) {
            let (x, y, r) = (self.x_m[k], self.y_m[k], self.radius_m[k]);
            let circle = [x - r, y - r, x + r, y + r];
            bounds = std::array::from_fn(|side| {
                if side < 2 { bounds[side].min(circle[side]) } else { bounds[side].max(circle[side]) }
            });
        }
        self.boxes[block] = bounds;
    }

    fn change(&mut self, index: usize, body: &Body, motion: &Motion) {
        self.enter(index, Circle::around(body, motion));
        if self.boxes.len() > FEW_BLOCKS {
            self.bound(index / TOGETHER);
        }
    }

    /// Tells all bodies whose circles meet this one, in order.
    pub(crate) fn near(&self, circle: Circle, mut tell: impl FnMut(usize)) {
        let Self { x_m, y_m, radius_m, boxes, .. } = self;
        let blocks = x_m.as_chunks().0.iter().zip(y_m.as_chunks().0).zip(radius_m.as_chunks().0);
        for (block, (((x_m, y_m), radius_m), bounds)) in blocks.zip(boxes).enumerate() {
            if !circle.meets(bounds) {
                continue;
            }
            let beyond = circle.beyond((x_m, y_m, radius_m));
            // A negative number has the sign bit set: most blocks hold none.
            let signs = beyond.iter().fold(0, |bits, number| bits | number.to_bits());
            if signs.cast_signed() < 0 {
                (0..TOGETHER).filter(|&k| beyond[k] < 0.0).for_each(|k| tell(block * TOGETHER + k));
            }
        }
    }
}
