//! Which pixels belong together?
//!
//! 8-connected components of the binary image (section 4 of the paper) in one pass: a row becomes bits, bits become
//! runs, runs that touch are united, and areas, boxes and moments grow with them.  No binary image and no label image
//! is ever written.

use super::bits::{BLOCK, Bits, Run, in_company, runs};
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use std::ops::RangeInclusive;

/// Which grey levels are foreground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All below this one.
    Below(u8),
    /// All above this one.
    Above(u8),
}

impl Level {
    /// Whether this grey level is foreground.
    #[must_use]
    pub const fn holds(self, grey: u8) -> bool {
        match self {
            Self::Below(threshold) => grey < threshold,
            Self::Above(threshold) => grey > threshold,
        }
    }
}

/// A part of a picture, its last column and row excluded (px).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub x: [usize; 2],
    /// Rows.
    pub y: [usize; 2],
}

impl Window {
    /// The whole picture.
    pub fn whole(image: &GreyImage) -> Self {
        Self { x: [0, image.width], y: [0, image.height] }
    }

    /// All pixels whose centres are at most `reach_px` to the left, right, above or below of `centre`.
    pub fn around(centre: Pixel, reach_px: f64, image: &GreyImage) -> Self {
        let span = |at: f64, size: usize| {
            let clamp = |v: f64| v.clamp(0.0, size as f64) as usize;
            let first = clamp((at - reach_px).ceil());
            [first, clamp((at + reach_px).floor() + 1.0).max(first)]
        };
        Self { x: span(centre.x, image.width), y: span(centre.y, image.height) }
    }
}

/// Pixels that touch each other at a side or a corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Component {
    /// How many pixels.
    pub area_px: u64,
    /// First and last column.
    pub x: [u32; 2],
    /// First and last row.
    pub y: [u32; 2],
    /// One of its pixels (column, row).
    pub seed: [u32; 2],
    /// Sums over the pixels of x and y.
    first: [u64; 2],
    /// Sums over the pixels of x x, x y and y y.
    second: [u64; 3],
}

impl Component {
    /// The mean place of its pixels.
    pub fn centroid(&self) -> Pixel {
        let n = self.area_px as f64;
        Pixel::new(self.first[0] as f64 / n, self.first[1] as f64 / n)
    }

    /// Central second moments over the area, xx, xy and yy, pixels taken as points (px2).
    pub fn covariance_px2(&self) -> [f64; 3] {
        let n = self.area_px as f64;
        let Pixel { x, y } = self.centroid();
        let [xx, xy, yy] = self.second.map(|sum| sum as f64 / n);
        [xx - x * x, xy - x * y, yy - y * y]
    }

    fn add_run(&mut self, y: u32, run: &Run) {
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

    fn absorb(&mut self, other: &Self) {
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

/// Finds components; keeps its memory from picture to picture.
#[derive(Debug, Default)]
pub struct Labeller {
    bits: [Bits; 3],
    company: Vec<u64>,
    filled: Vec<u32>,
    above: Vec<Run>,
    row: Vec<Run>,
    parts: Parts,
    found: Vec<Component>,
}

impl Labeller {
    /// The components of a window whose area lies within `areas_px`, in the order in which their last rows come.
    pub fn components(
        &mut self,
        image: &GreyImage,
        window: Window,
        level: Level,
        areas_px: &RangeInclusive<u64>,
    ) -> &[Component] {
        self.found.clear();
        self.above.clear();
        self.parts.clear();
        let [y0, y1] = window.y;
        let words = (window.x[1] - window.x[0]).div_ceil(BLOCK);
        if words == 0 || y0 == y1 {
            return &self.found;
        }
        self.bits.iter_mut().for_each(|bits| bits.clear(words));
        let pixels = |y: usize| &image.pixels[y * image.width..][window.x[0]..window.x[1]];
        let lone_pixels_count = *areas_px.start() < 2;
        let [previous, current, next] = &mut self.bits;
        next.read(pixels(y0), level, true);
        for y in y0..y1 {
            std::mem::swap(previous, current);
            std::mem::swap(current, next);
            if y + 1 < y1 {
                next.read(pixels(y + 1), level, current.is_empty());
            } else {
                next.empty();
            }
            self.row.clear();
            if !current.is_empty() {
                let (words, which) = if lone_pixels_count {
                    current.words()
                } else {
                    in_company([previous, current, next], &mut self.company)
                };
                let first_x = window.x[0] + which.start * BLOCK;
                runs(words, first_x as u32, &mut self.filled, &mut self.row);
            }
            if !self.row.is_empty() || !self.above.is_empty() {
                self.parts.join(y as u32, &self.above, &mut self.row);
                self.parts.close(y as u32, &self.above, areas_px, &mut self.found);
                self.parts.settle(&mut self.row);
                std::mem::swap(&mut self.above, &mut self.row);
            }
        }
        self.parts.close(y1 as u32, &self.above, areas_px, &mut self.found);
        &self.found
    }
}

/// The components that still grow: a union-find forest whose labels are used again once a component is complete, so
/// that it stays in the fastest memory however noisy the picture is.
#[derive(Debug, Default)]
struct Parts {
    parent: Vec<u32>,
    last_row: Vec<u32>,
    grown: Vec<Component>,
    free: Vec<u32>,
    merged: Vec<u32>,
}

/// The `last_row` of a component that was handed over.
const COMPLETE: u32 = u32::MAX;

impl Parts {
    fn clear(&mut self) {
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
    fn join(&mut self, y: u32, above: &[Run], row: &mut [Run]) {
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
    fn close(&mut self, y: u32, above: &[Run], areas_px: &RangeInclusive<u64>, found: &mut Vec<Component>) {
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
    fn settle(&mut self, row: &mut [Run]) {
        if self.merged.is_empty() {
            return;
        }
        for run in row {
            run.label = self.root(run.label);
        }
        self.free.append(&mut self.merged);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// The readable law: flood from each pixel not yet seen, over all eight neighbours.
    fn flooded(
        image: &GreyImage,
        window: Window,
        level: Level,
        areas_px: &RangeInclusive<u64>,
    ) -> Vec<Component> {
        let foreground = |x: usize, y: usize| level.holds(image.pixels[y * image.width + x]);
        let inside = |x: usize, y: usize| {
            (window.x[0]..window.x[1]).contains(&x) && (window.y[0]..window.y[1]).contains(&y)
        };
        let mut seen = vec![false; image.pixels.len()];
        let mut found = Vec::new();
        for y in window.y[0]..window.y[1] {
            for x in window.x[0]..window.x[1] {
                let mut part = Component { x: [u32::MAX, 0], y: [u32::MAX, 0], ..Component::default() };
                let mut open = vec![(x, y)];
                while let Some((x, y)) = open.pop() {
                    if !inside(x, y) || seen[y * image.width + x] || !foreground(x, y) {
                        continue;
                    }
                    seen[y * image.width + x] = true;
                    let (column, row) = (x as u32, y as u32);
                    part.area_px += 1;
                    part.x = [part.x[0].min(column), part.x[1].max(column)];
                    part.y = [part.y[0].min(row), part.y[1].max(row)];
                    let (x, y) = (x as u64, y as u64);
                    part.first = [part.first[0] + x, part.first[1] + y];
                    part.second = [part.second[0] + x * x, part.second[1] + x * y, part.second[2] + y * y];
                    for (dx, dy) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
                        if column + dx > 0 && row + dy > 0 {
                            open.push(((column + dx) as usize - 1, (row + dy) as usize - 1));
                        }
                    }
                }
                if part.area_px > 0 && areas_px.contains(&part.area_px) {
                    found.push(part);
                }
            }
        }
        found
    }

    fn sorted(mut components: Vec<Component>) -> Vec<Component> {
        // Any of its pixels may stand for a component.
        for c in &mut components {
            c.seed = [0, 0];
        }
        components.sort_by_key(|c| (c.y, c.x, c.first, c.second));
        components
    }

    fn random_image(width: usize, height: usize, darkness: f64, grain: usize, seed: u64) -> GreyImage {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let coarse: Vec<u8> = (0..width.div_ceil(grain) * height.div_ceil(grain))
            .map(|_| {
                if rng.random_bool(darkness) { rng.random_range(0..100) } else { rng.random_range(100..=255) }
            })
            .collect();
        let at = |x: usize, y: usize| coarse[y / grain * width.div_ceil(grain) + x / grain];
        let pixels = (0..width * height).map(|k| at(k % width, k / width)).collect();
        GreyImage { width, height, pixels }
    }

    #[test]
    fn runs_find_the_same_components_as_flooding() {
        let mut labeller = Labeller::default();
        for seed in 0..120 {
            let (width, height) =
                ([1, 63, 64, 65, 130, 200, 1100][seed as usize % 7], 1 + seed as usize % 41);
            let darkness = [0.001, 0.02, 0.1, 0.3, 0.41, 0.5, 0.7, 0.97][seed as usize % 8];
            let image = random_image(width, height, darkness, 1 + seed as usize % 3, seed);
            let whole = Window::whole(&image);
            let part = Window { x: [width / 5, width - width / 7], y: [height / 4, height] };
            for window in [whole, part] {
                for level in [
                    Level::Below(100),
                    Level::Above(100),
                    Level::Below(1),
                    Level::Above(254),
                    Level::Above(0),
                ] {
                    for areas_px in [1..=u64::MAX, 2..=u64::MAX, 3..=9] {
                        let found = sorted(labeller.components(&image, window, level, &areas_px).to_vec());
                        let law = sorted(flooded(&image, window, level, &areas_px));
                        assert_eq!(
                            found, law,
                            "{width} x {height} px, {level:?}, areas {areas_px:?}, seed {seed}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn a_filled_rectangle_has_the_moments_of_its_pixels() {
        let (width, height) = (300, 50);
        let inside = |x: usize, y: usize| (60..200).contains(&x) && (10..30).contains(&y);
        let pixels =
            (0..width * height).map(|k| if inside(k % width, k / width) { 20 } else { 200 }).collect();
        let image = GreyImage { width, height, pixels };
        let mut labeller = Labeller::default();
        let found = labeller.components(&image, Window::whole(&image), Level::Below(110), &(1..=u64::MAX));
        assert_eq!(found.len(), 1);
        let [xx, xy, yy] = found[0].covariance_px2();
        assert_eq!(found[0].area_px, 140 * 20);
        assert_eq!(found[0].centroid(), Pixel::new(129.5, 19.5));
        assert!((xx - (140.0 * 140.0 - 1.0) / 12.0).abs() < 1e-9, "{xx} px2");
        assert!((yy - (20.0 * 20.0 - 1.0) / 12.0).abs() < 1e-9 && xy.abs() < 1e-9, "{yy} px2, {xy} px2");
    }
}
