//! A colour image to draw lines and text on.

use super::rgb_image::RgbImage;
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use std::collections::BTreeMap;

/// Red, green and blue levels.
pub(super) type Colour = [u8; 3];

const WHITE: Colour = [255, 255, 255];
const BLACK: Colour = [0, 0, 0];
/// The opacity of main lines and of text.
pub(super) const STRONG: f64 = 0.95;
/// The opacity of paths and of the background of text.
pub(super) const FAINT: f64 = 0.6;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pen {
    /// The colour.
    pub colour: Colour,
    /// The width of the line (px).
    pub width_px: f64,
    /// The opacity, 0 to 1.
    pub opacity: f64,
}

/// An image under construction.
pub(super) struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    /// A canvas with a grey image as background.
    pub(super) fn of(image: &GreyImage) -> Self {
        let rgb = image.pixels.iter().flat_map(|&grey| [grey; 3]).collect();
        Self { width: image.width, height: image.height, rgb }
    }

    /// The finished image.
    pub(super) fn finish(self) -> RgbImage {
        RgbImage { width: self.width, height: self.height, rgb: self.rgb }
    }

    fn blend(&mut self, x: usize, y: usize, colour: Colour, opacity: f64) {
        let pixel = &mut self.rgb[3 * (y * self.width + x)..][..3];
        for (level, new) in pixel.iter_mut().zip(colour) {
            *level = (f64::from(*level) + (f64::from(new) - f64::from(*level)) * opacity).round() as u8;
        }
    }

    /// A polyline with soft edges.  Every pixel is blended once, with the coverage of the nearest segment.
    pub(super) fn polyline(&mut self, points: &[Pixel], pen: Pen) {
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

    /// White text on a black background; each dot of a character is `size` pixels wide.
    pub(super) fn write(&mut self, text: &str, [left, top]: [usize; 2], size: usize) {
        let width = text.len() * (LETTER[0] + 1) * size + size;
        self.fill([left, top], [width, (LETTER[1] + 2) * size], BLACK, FAINT);
        for (k, letter) in text.chars().enumerate() {
            for (row, bits) in dots(letter).into_iter().enumerate() {
                for column in (0..LETTER[0]).filter(|column| bits >> (LETTER[0] - 1 - column) & 1 == 1) {
                    let corner = [left + (k * (LETTER[0] + 1) + column + 1) * size, top + (row + 1) * size];
                    self.fill(corner, [size, size], WHITE, STRONG);
                }
            }
        }
    }

    fn fill(&mut self, [left, top]: [usize; 2], [width, height]: [usize; 2], colour: Colour, opacity: f64) {
        for y in top..(top + height).min(self.height) {
            for x in left..(left + width).min(self.width) {
                self.blend(x, y, colour, opacity);
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

/// The columns and rows of a character.
const LETTER: [usize; 2] = [5, 7];

/// The dots of a character of a time, row by row; empty for other characters.
fn dots(letter: char) -> [u8; LETTER[1]] {
    match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b01100, 0b01100],
        's' => [0, 0, 0b01110, 0b10000, 0b01110, 0b00001, 0b11110],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        _ => [0; LETTER[1]],
    }
}
