//! What are the area, the bounding box and the moments of a component?

use super::row_bits::Run;
use crate::geometry::Pixel;

/// An 8-connected component of the foreground: pixels that touch each other at a side or a corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Component {
    /// Number of pixels.
    pub area_px: u64,
    /// First and last column.
    pub x: [u32; 2],
    /// First and last row.
    pub y: [u32; 2],
    /// Column and row of one of its pixels.
    pub seed: [u32; 2],
    /// Sums of x and y over the pixels.
    pub(super) first: [u64; 2],
    /// Sums of x x, x y and y y over the pixels.
    pub(super) second: [u64; 3],
}

impl Component {
    /// Mean position of its pixels.
    pub fn centroid(&self) -> Pixel {
        let n = self.area_px as f64;
        Pixel::new(self.first[0] as f64 / n, self.first[1] as f64 / n)
    }

    /// Central second moments over the area, xx, xy and yy, with pixels as points (px2).
    pub fn covariance_px2(&self) -> [f64; 3] {
        let n = self.area_px as f64;
        let Pixel { x, y } = self.centroid();
        let [xx, xy, yy] = self.second.map(|sum| sum as f64 / n);
        [xx - x * x, xy - x * y, yy - y * y]
    }

    /// Adds a run of row `y`; rows must come in increasing order.
    pub(super) fn add_run(&mut self, y: u32, run: &Run) {
        let (start, end, row) = (u64::from(run.start), u64::from(run.end), u64::from(y));
        let n = end - start;
        let sum_x = n * (start + end - 1) / 2;
        let squares = |k: u64| k * (k + 1) * (2 * k + 1) / 6;
        let sum_xx = squares(end - 1) - if start > 0 { squares(start - 1) } else { 0 };
        self.x = [self.x[0].min(run.start), self.x[1].max(run.end - 1)];
        self.y[1] = y;
        self.area_px += n;
        self.first[0] += sum_x;
        self.first[1] += n * row;
        self.second[0] += sum_xx;
        self.second[1] += sum_x * row;
        self.second[2] += n * row * row;
    }

    /// Adds all pixels of another component.
    pub(super) fn absorb(&mut self, other: &Self) {
        self.area_px += other.area_px;
        self.x = [self.x[0].min(other.x[0]), self.x[1].max(other.x[1])];
        self.y = [self.y[0].min(other.y[0]), self.y[1].max(other.y[1])];
        for (sum, more) in self.first.iter_mut().zip(other.first) {
            *sum += more;
        }
        for (sum, more) in self.second.iter_mut().zip(other.second) {
            *sum += more;
        }
    }
}
