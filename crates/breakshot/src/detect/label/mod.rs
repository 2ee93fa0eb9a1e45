//! Which pixels belong together?
//!
//! 8-connected components of the binary image (section 4 of the paper) in one pass: a row becomes bits, bits become
//! runs, runs that touch are united, and areas, boxes and moments grow with them.  No binary image and no label image
//! is ever written.

mod component;
mod row_bits;
mod union_find;
mod window;

pub use super::threshold::Level;
pub use component::Component;
pub use window::Window;

use crate::capture::GreyImage;
use row_bits::{BLOCK, Bits, Run, in_company, runs};
use std::ops::RangeInclusive;
use union_find::Parts;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pixel;
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
