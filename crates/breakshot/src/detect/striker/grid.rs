//! A grid of points around the path of a strike in planes above the table, and the grey levels there in each frame.
//!
//! The grid's axes lie along the given strike and across it, so that an outline that moves along the path keeps its shape on the grid.
//! The nodes of all planes lie above each other: an outline of the striker's top has the same place on the grid as that of its foot.

use crate::capture::{Camera, GreyImage};
use crate::geometry::{Pixel, Point, Pose};

/// Largest number of nodes: more would cost more time than they improve.
const MOST_NODES: f64 = 120_000.0;
/// Nodes whose pixels are computed from the camera; those between are interpolated, because over so few pixels a lens is nearly linear.
const EXACT_EVERY: usize = 8;
/// Smallest part of the nodes that must be in the picture.
const LEAST_IN_VIEW: f64 = 0.5;

/// Grey levels at the nodes of a grid, or differences of grey levels, plane by plane.
pub(super) type Greys = Vec<Vec<f32>>;

/// The part of the picture that holds the grid.
#[derive(Clone, Copy)]
struct Window {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

/// Where a node is in the window: the index of the pixel to its upper left, and the fractions of a pixel beyond it.
#[derive(Clone, Copy)]
struct Node {
    index: u32,
    right: f32,
    down: f32,
}

/// See the [module](self).
pub(super) struct Grid {
    /// The strike frame: origin at the given start, x along the given heading.
    pub strike: Pose,
    /// Distance of neighbouring nodes (m).
    pub step_m: f64,
    /// The first node, in the strike frame.
    from: Point,
    /// Number of nodes along and across the strike; those across follow each other.
    along: usize,
    across: usize,
    window: Window,
    /// The nodes of each plane.
    planes: Vec<Vec<Node>>,
}

impl Grid {
    /// The grid between two corners in the strike frame, of about one node a pixel, in planes of these heights above the table (m); `None`
    /// where the camera sees too little of the first one.
    pub(super) fn new(camera: &Camera, strike: Pose, corners: [Point; 2], heights_m: &[f64]) -> Option<Self> {
        let [from, to] = corners;
        let size_m = [to.x - from.x, to.y - from.y];
        let middle = Point::new(f64::midpoint(from.x, to.x), f64::midpoint(from.y, to.y));
        let height_m = *heights_m.first()?;
        let middle_px = camera.pixel_from_table(strike.table_from_body(middle), height_m);
        let pixel_m = camera.scale_m_per_px(middle_px, height_m);
        let step_m = pixel_m.max((size_m[0] * size_m[1] / MOST_NODES).sqrt());
        if !(step_m.is_finite() && step_m > 0.0 && size_m.iter().all(|s| *s > step_m)) {
            return None;
        }
        let [along, across] = size_m.map(|size| (size / step_m).ceil() as usize + 1);
        let plane = |height_m: &f64| {
            pixels(along, across, |i, j| {
                let at = Point::new(from.x + i as f64 * step_m, from.y + j as f64 * step_m);
                camera.pixel_from_table(strike.table_from_body(at), *height_m)
            })
        };
        let planes: Vec<Vec<Pixel>> = heights_m.iter().map(plane).collect();
        let shown = planes[0].iter().filter(|pixel| camera.shows(**pixel)).count();
        if (shown as f64) < LEAST_IN_VIEW * planes[0].len() as f64 {
            return None;
        }
        let window = Window::around(planes.iter().flatten(), camera.size_px)?;
        let nodes = |pixels: &Vec<Pixel>| pixels.iter().map(|pixel| window.node(*pixel)).collect();
        let planes = planes.iter().map(nodes).collect();
        Some(Self { strike, step_m, from, along, across, window, planes })
    }

    /// Number of pixels of the window.
    pub(super) fn window_px(&self) -> usize {
        self.window.width * self.window.height
    }

    /// The window's width (px).
    pub(super) fn window_width(&self) -> usize {
        self.window.width
    }

    /// The window's part of a picture, row by row.
    pub(super) fn crop(&self, image: &GreyImage) -> Vec<u8> {
        let Window { left, top, width, height } = self.window;
        let mut crop = Vec::with_capacity(width * height);
        for row in image.pixels.chunks_exact(image.width).skip(top).take(height) {
            crop.extend_from_slice(&row[left..left + width]);
        }
        crop
    }

    /// The grey levels at the nodes of a crop less those of another crop.
    pub(super) fn difference(&self, crop: &[u8], other: &[u8]) -> Greys {
        let width = self.window.width;
        let value = |node: &Node| {
            let at = |offset: usize| {
                let k = node.index as usize + offset;
                f32::from(crop[k]) - f32::from(other[k])
            };
            let upper = at(0) + (at(1) - at(0)) * node.right;
            let lower = at(width) + (at(width + 1) - at(width)) * node.right;
            upper + (lower - upper) * node.down
        };
        self.planes.iter().map(|nodes| nodes.iter().map(value).collect()).collect()
    }

    /// The node nearest to a point of the strike frame, as fractions of nodes.
    fn node_at(&self, at: Point) -> (f64, f64) {
        ((at.x - self.from.x) / self.step_m, (at.y - self.from.y) / self.step_m)
    }

    /// The value between nodes at a point of the strike frame; 0 outside of the grid.
    pub(super) fn value(&self, greys: &[f32], at: Point) -> f64 {
        let (i, j) = self.node_at(at);
        if !(i >= 0.0 && j >= 0.0 && i < (self.along - 1) as f64 && j < (self.across - 1) as f64) {
            return 0.0;
        }
        let (u, v) = (i.fract(), j.fract());
        let k = i as usize * self.across + j as usize;
        let get = |k: usize| f64::from(greys[k]);
        let near = get(k) * (1.0 - v) + get(k + 1) * v;
        let far = get(k + self.across) * (1.0 - v) + get(k + self.across + 1) * v;
        near * (1.0 - u) + far * u
    }

    /// The points of the strike frame on every `every`-th node for which a point up to `reach_m` away is on the grid too.
    pub(super) fn inner(&self, reach_m: f64, every: usize) -> Inner {
        let border = (reach_m / self.step_m).ceil() as usize + 1;
        let count = |n: usize| (n.saturating_sub(2 * border)).div_ceil(every);
        Inner { border, every, along: count(self.along), across: count(self.across) }
    }

    /// The point of the strike frame at an inner node.
    pub(super) fn inner_point(&self, inner: &Inner, i: usize, j: usize) -> Point {
        let at = |from: f64, k: usize| from + (inner.border + k * inner.every) as f64 * self.step_m;
        Point::new(at(self.from.x, i), at(self.from.y, j))
    }

    /// Adds to each inner node the value of the node that is away by this vector (m), times a weight.
    pub(super) fn add_shifted(
        &self,
        inner: &Inner,
        (greys, shift): (&[f32], [f64; 2]),
        weight: f32,
        sums: &mut [f32],
    ) {
        // A shift is shorter than the border.
        let [di, dj] = shift.map(|m| (inner.border as f64 + (m / self.step_m).round()) as usize);
        for (i, sums) in sums.chunks_exact_mut(inner.across).enumerate() {
            let first = (di + i * inner.every) * self.across + dj;
            let values = greys[first..].iter().step_by(inner.every);
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
    }
}

/// Every so many nodes of a grid, without its border.
#[derive(Clone, Copy)]
pub(super) struct Inner {
    border: usize,
    every: usize,
    pub along: usize,
    pub across: usize,
}

/// The pixels of all nodes, computed at some of them and interpolated between.
fn pixels(along: usize, across: usize, exact: impl Fn(usize, usize) -> Pixel) -> Vec<Pixel> {
    let coarse = |n: usize| (n - 1).div_ceil(EXACT_EVERY) + 1;
    let (rows, columns) = (coarse(along), coarse(across));
    let known: Vec<Pixel> =
        (0..rows * columns).map(|k| exact(k / columns * EXACT_EVERY, k % columns * EXACT_EVERY)).collect();
    let between = |a: Pixel, b: Pixel, t: f64| Pixel::new(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t);
    let fraction = |k: usize| (k % EXACT_EVERY) as f64 / EXACT_EVERY as f64;
    let mut pixels = Vec::with_capacity(along * across);
    for i in 0..along {
        for j in 0..across {
            let (row, column) = (i / EXACT_EVERY, j / EXACT_EVERY);
            let at = |di: usize, dj: usize| {
                known[(row + di).min(rows - 1) * columns + (column + dj).min(columns - 1)]
            };
            let near = between(at(0, 0), at(0, 1), fraction(j));
            let far = between(at(1, 0), at(1, 1), fraction(j));
            pixels.push(between(near, far, fraction(i)));
        }
    }
    pixels
}

impl Window {
    /// The smallest window with these pixels, within the picture.
    fn around<'a>(pixels: impl Iterator<Item = &'a Pixel> + Clone, size_px: [usize; 2]) -> Option<Self> {
        let bounds = |value: fn(&Pixel) -> f64, size: usize| {
            let values = || pixels.clone().map(value).filter(|v| v.is_finite());
            let low = values().fold(f64::INFINITY, f64::min).floor().clamp(0.0, size as f64);
            let high = (values().fold(f64::NEG_INFINITY, f64::max).ceil() + 2.0).clamp(0.0, size as f64);
            (low as usize, high as usize)
        };
        let ((left, right), (top, bottom)) = (bounds(|p| p.x, size_px[0]), bounds(|p| p.y, size_px[1]));
        // Interpolation needs two pixels each way.
        let is_wide = right >= left + 2 && bottom >= top + 2;
        is_wide.then(|| Self { left, top, width: right - left, height: bottom - top })
    }

    /// A node at this pixel, or at the nearest one of the window.
    fn node(&self, pixel: Pixel) -> Node {
        let within = |v: f64, from: usize, size: usize| {
            let v = if v.is_finite() { v } else { 0.0 };
            let v = (v - from as f64).clamp(0.0, (size - 1) as f64);
            let whole = (v as usize).min(size - 2);
            (whole, (v - whole as f64) as f32)
        };
        let (x, right) = within(pixel.x, self.left, self.width);
        let (y, down) = within(pixel.y, self.top, self.height);
        Node { index: (y * self.width + x) as u32, right, down }
    }
}
