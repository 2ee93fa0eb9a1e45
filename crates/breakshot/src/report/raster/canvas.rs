//! A colour image to draw lines and text on.

use super::rgb_image::RgbImage;
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use std::collections::BTreeMap;

/// Red, green and blue levels.
pub(in crate::report) type Colour = [u8; 3];

/// The opacity of main lines and of text.
pub(in crate::report) const STRONG: f64 = 0.95;
/// The opacity of paths and of the background of text.
pub(in crate::report) const FAINT: f64 = 0.6;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(in crate::report) struct Pen {
    /// The colour.
    pub colour: Colour,
    /// The width of the line (px).
    pub width_px: f64,
    /// The opacity, 0 to 1.
    pub opacity: f64,
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug)]
pub(in crate::report) struct Area {
    /// Its left and upper end (px).
    pub corner: [usize; 2],
    /// Its width and height (px).
    pub size: [usize; 2],
}

/// An image under construction.
pub(in crate::report) struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A canvas with a grey image as background.
    pub(in crate::report) fn of(image: &GreyImage) -> Self {
        let rgb = image.pixels.iter().flat_map(|&grey| [grey; 3]).collect();
        Self { width: image.width, height: image.height, rgb }
    }

    /// A canvas of one colour.
    pub(in crate::report) fn blank([width, height]: [usize; 2], colour: Colour) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// The finished image.
    pub(in crate::report) fn finish(self) -> RgbImage {
        RgbImage { width: self.width, height: self.height, rgb: self.rgb }
    }

    fn blend(&mut self, x: usize, y: usize, colour: Colour, opacity: f64) {
        let pixel = &mut self.rgb[3 * (y * self.width + x)..][..3];
        for (level, new) in pixel.iter_mut().zip(colour) {
            *level = (f64::from(*level) + (f64::from(new) - f64::from(*level)) * opacity).round() as u8;
        }
    }

    /// A polyline with soft edges.  Every pixel is blended once, with the coverage of the nearest segment.
    pub(in crate::report) fn polyline(&mut self, points: &[Pixel], pen: Pen) {
        let reach_px = 0.5 * pen.width_px + 1.0;
        let mut covers = BTreeMap::new();
        for pair in points.windows(2) {
            let [p, q] = [pair[0], pair[1]];
            if ![p.x, p.y, q.x, q.y].iter().all(|v| v.is_finite()) {
                continue;
            }
            let span = |a: f64, b: f64, size: usize| {
                let first = (a.min(b) - reach_px).clamp(0.0, size as f64) as usize;
                first..(a.max(b) + reach_px + 1.0).clamp(0.0, size as f64) as usize
            };
            for y in span(p.y, q.y, self.height) {
                for x in span(p.x, q.x, self.width) {
                    let cover =
                        (reach_px - 0.5 - distance_px(Pixel::new(x as f64, y as f64), p, q)).clamp(0.0, 1.0);
                    if cover > 0.0 {
                        let most: &mut f64 = covers.entry((x, y)).or_insert(0.0);
                        *most = most.max(cover);
                    }
                }
            }
        }
        for ((x, y), cover) in covers {
            self.blend(x, y, pen.colour, pen.opacity * cover);
        }
    }

    /// An area in one colour.
    pub(in crate::report) fn fill(&mut self, area: Area, colour: Colour, opacity: f64) {
        let Area { corner: [left, top], size: [width, height] } = area;
        for y in top.min(self.height)..(top + height).min(self.height) {
            for x in left.min(self.width)..(left + width).min(self.width) {
                self.blend(x, y, colour, opacity);
            }
        }
    }

    /// A polygon in one colour, with soft edges.
    pub(in crate::report) fn polygon(&mut self, corners: &[Pixel], colour: Colour, opacity: f64) {
        if corners.len() < 3 || corners.iter().any(|p| !(p.x.is_finite() && p.y.is_finite())) {
            return;
        }
        let span = |values: &dyn Fn(&Pixel) -> f64, size: usize| {
            let (low, high) = corners
                .iter()
                .map(values)
                .fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
            (low - 1.0).clamp(0.0, size as f64) as usize..(high + 2.0).clamp(0.0, size as f64) as usize
        };
        let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
        for y in span(&|p| p.y, self.height) {
            for x in span(&|p| p.x, self.width) {
                let point = Pixel::new(x as f64, y as f64);
                let crossings = edges().filter(|(p, q)| {
                    (p.y > point.y) != (q.y > point.y)
                        && point.x < p.x + (point.y - p.y) / (q.y - p.y) * (q.x - p.x)
                });
                let is_inside = crossings.count() % 2 == 1;
                let edge_px = edges().map(|(p, q)| distance_px(point, *p, *q)).fold(f64::MAX, f64::min);
                let cover = (0.5 + if is_inside { edge_px } else { -edge_px }).clamp(0.0, 1.0);
                if cover > 0.0 {
                    self.blend(x, y, colour, opacity * cover);
                }
            }
        }
    }

    /// An image as large as the area allows, in its middle; each pixel is the mean of those of the image that it covers.
    pub(in crate::report) fn image(&mut self, image: &RgbImage, area: Area) {
        let scale = (area.size[0] as f64 / image.width as f64).min(area.size[1] as f64 / image.height as f64);
        if !(scale.is_finite() && scale > 0.0) {
            return;
        }
        let size = [image.width, image.height].map(|px| (px as f64 * scale) as usize);
        let corner = [0, 1].map(|k| area.corner[k] + (area.size[k] - size[k]) / 2);
        let sources = |k: usize, all: usize| -> Vec<[usize; 2]> {
            let range = |at: usize| {
                let first = ((at as f64 / scale) as usize).min(all - 1);
                [first, (((at + 1) as f64 / scale) as usize).clamp(first + 1, all)]
            };
            (0..size[k]).map(range).collect()
        };
        let (columns, rows) = (sources(0, image.width), sources(1, image.height));
        for (y, [top, bottom]) in rows.into_iter().enumerate().take(self.height.saturating_sub(corner[1])) {
            let width = self.width.saturating_sub(corner[0]);
            for (x, [left, right]) in columns.iter().copied().enumerate().take(width) {
                let mut sums = [0_usize; 3];
                for row in top..bottom {
                    for pixel in
                        image.rgb[3 * (row * image.width + left)..3 * (row * image.width + right)].chunks(3)
                    {
                        sums = [0, 1, 2].map(|k| sums[k] + usize::from(pixel[k]));
                    }
                }
                let count = (bottom - top) * (right - left);
                let at = 3 * ((corner[1] + y) * self.width + corner[0] + x);
                self.rgb[at..at + 3].copy_from_slice(&sums.map(|sum| ((sum + count / 2) / count) as u8));
            }
        }
    }
}

/// The distance of a point from the segment between `p` and `q` (px).
fn distance_px(point: Pixel, p: Pixel, q: Pixel) -> f64 {
    let (dx, dy) = (q.x - p.x, q.y - p.y);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 { ((point.x - p.x) * dx + (point.y - p.y) * dy) / length2 } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    point.distance_px(Pixel::new(p.x + along * dx, p.y + along * dy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_covers_its_area() {
        let mut canvas = Canvas::blank([40, 40], [0; 3]);
        let corners = [[5.2, 4.7], [30.4, 8.1], [12.6, 33.3]].map(|[x, y]| Pixel::new(x, y));
        canvas.polygon(&corners, [255; 3], 1.0);
        let image = canvas.finish();
        let covered: f64 = image.rgb.chunks(3).map(|pixel| f64::from(pixel[0]) / 255.0).sum();
        let doubled: f64 =
            (0..3).map(|k| (corners[k], corners[(k + 1) % 3])).map(|(p, q)| p.x * q.y - q.x * p.y).sum();
        let area = 0.5 * doubled.abs();
        assert!((covered - area).abs() < 0.02 * area, "{covered} pixels are covered, the area is {area}");
    }

    #[test]
    fn a_smaller_image_keeps_the_mean_and_lies_in_the_middle() {
        let image = RgbImage { width: 4, height: 2, rgb: (0..24).map(|k| k * 10).collect() };
        let mut canvas = Canvas::blank([10, 9], [7; 3]);
        canvas.image(&image, Area { corner: [4, 4], size: [2, 3] });
        let drawn = canvas.finish();
        let at = |x: usize, y: usize| &drawn.rgb[3 * (y * 10 + x)..][..3];
        // The means of two by two pixels.
        assert_eq!(at(4, 5), [75, 85, 95]);
        assert_eq!(at(5, 5), [135, 145, 155]);
        let changed = (0..90).filter(|k| drawn.rgb[3 * k..3 * k + 3] != [7; 3]).count();
        assert_eq!(changed, 2, "pixels beside the image were changed");
    }
}
