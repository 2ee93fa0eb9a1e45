//! Which pixels form the components of the binary image?
//!
//! 8-connected components (section 4 of the paper) in one pass over the image: each row becomes bits, the bits become
//! runs, and touching runs of neighbouring rows are united, which accumulates areas, bounding boxes and moments.
//! Neither a binary image nor a label image is stored.

mod component;
mod row_bits;
mod union_find;
mod window;

pub use super::threshold::Level;
pub use component::Component;
pub use window::Window;

use crate::capture::GreyImage;
use row_bits::{RowBits, Run, WORD_PX, runs, with_neighbours};
use std::ops::RangeInclusive;
use union_find::Forest;

/// Finds components; keeps its buffers from image to image.
#[derive(Debug, Default)]
pub struct Labeller {
    rows: [RowBits; 3],
    kept: Vec<u64>,
    nonzero: Vec<u32>,
    runs_above: Vec<Run>,
    runs: Vec<Run>,
    forest: Forest,
    found: Vec<Component>,
}

impl Labeller {
    /// The components of a window whose area is in the range `areas_px`, in the order of their last rows.
    pub fn components(
        &mut self,
        image: &GreyImage,
        window: Window,
        level: Level,
        areas_px: &RangeInclusive<u64>,
    ) -> &[Component] {
        self.found.clear();
        self.runs_above.clear();
        self.forest.clear();
        let [y0, y1] = window.y;
        let words = (window.x[1] - window.x[0]).div_ceil(WORD_PX);
        if words == 0 || y0 == y1 {
            return &self.found;
        }
        self.rows.iter_mut().for_each(|row| row.resize(words));
        let pixels = |y: usize| &image.pixels[y * image.width..][window.x[0]..window.x[1]];
        let single_pixels_count = *areas_px.start() < 2;
        let [previous, current, next] = &mut self.rows;
        next.read(pixels(y0), level, true);
        for y in y0..y1 {
            // The foreground of this row and of its two neighbours
            std::mem::swap(previous, current);
            std::mem::swap(current, next);
            if y + 1 < y1 {
                next.read(pixels(y + 1), level, current.is_empty());
            } else {
                next.clear();
            }
            // Its runs
            self.runs.clear();
            if !current.is_empty() {
                let (words, range) = if single_pixels_count {
                    current.words()
                } else {
                    with_neighbours([previous, current, next], &mut self.kept)
                };
                let first_x = window.x[0] + range.start * WORD_PX;
                runs(words, first_x as u32, &mut self.nonzero, &mut self.runs);
            }
            // Their components
            if !self.runs.is_empty() || !self.runs_above.is_empty() {
                self.forest.join(y as u32, &self.runs_above, &mut self.runs);
                self.forest.complete(y as u32, &self.runs_above, areas_px, &mut self.found);
                self.forest.relabel(&mut self.runs);
                std::mem::swap(&mut self.runs_above, &mut self.runs);
            }
        }
        self.forest.complete(y1 as u32, &self.runs_above, areas_px, &mut self.found);
        &self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pixel;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// Reference implementation: flood fill from each unvisited pixel over its eight neighbours.
    fn flooded(
        image: &GreyImage,
        window: Window,
        level: Level,
        areas_px: &RangeInclusive<u64>,
    ) -> Vec<Component> {
        let foreground = |x: usize, y: usize| level.is_foreground(image.pixels[y * image.width + x]);
        let inside = |x: usize, y: usize| {
            (window.x[0]..window.x[1]).contains(&x) && (window.y[0]..window.y[1]).contains(&y)
        };
        let mut visited = vec![false; image.pixels.len()];
        let mut found = Vec::new();
        for y in window.y[0]..window.y[1] {
            for x in window.x[0]..window.x[1] {
                let mut component = Component { x: [u32::MAX, 0], y: [u32::MAX, 0], ..Component::default() };
                let mut open = vec![(x, y)];
                while let Some((x, y)) = open.pop() {
                    if !inside(x, y) || visited[y * image.width + x] || !foreground(x, y) {
                        continue;
                    }
                    visited[y * image.width + x] = true;
                    let (column, row) = (x as u32, y as u32);
                    component.area_px += 1;
                    component.x = [component.x[0].min(column), component.x[1].max(column)];
                    component.y = [component.y[0].min(row), component.y[1].max(row)];
                    let (x, y) = (x as u64, y as u64);
                    component.first = [component.first[0] + x, component.first[1] + y];
                    component.second = [
                        component.second[0] + x * x,
                        component.second[1] + x * y,
                        component.second[2] + y * y,
                    ];
                    for (dx, dy) in [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)] {
                        if column + dx > 0 && row + dy > 0 {
                            open.push(((column + dx) as usize - 1, (row + dy) as usize - 1));
                        }
                    }
                }
                if component.area_px > 0 && areas_px.contains(&component.area_px) {
                    found.push(component);
                }
            }
        }
        found
    }

    fn sorted(mut components: Vec<Component>) -> Vec<Component> {
        // Any pixel of a component may be its seed.
        for c in &mut components {
            c.seed = [0, 0];
        }
        components.sort_unstable_by_key(|c| (c.y, c.x, c.first, c.second));
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
            let inner = Window { x: [width / 5, width - width / 7], y: [height / 4, height] };
            for window in [whole, inner] {
                for level in [
                    Level::Below(100),
                    Level::Above(100),
                    Level::Below(1),
                    Level::Above(254),
                    Level::Above(0),
                ] {
                    for areas_px in [1..=u64::MAX, 2..=u64::MAX, 3..=9] {
                        let found = sorted(labeller.components(&image, window, level, &areas_px).to_vec());
                        let expected = sorted(flooded(&image, window, level, &areas_px));
                        assert_eq!(
                            found, expected,
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
