//! A page: its size, its areas, and its caption.

use super::style::{BACKGROUND, MUTED, PANEL, TEXT, colour};
use crate::error::{Error, Result};
use crate::geometry::Pixel;
use crate::report::figures::Palette;
use crate::report::raster::{Area, Canvas, Colour, Lettering, STRONG, text_width_px, wrapped};

/// The height for which lengths are given (px): those of another page are in proportion.
const DESIGN_HEIGHT_PX: f64 = 720.0;
/// The height of the caption (px of the design).
const CAPTION_PX: f64 = 88.0;
/// The margin (px of the design).
pub(super) const MARGIN_PX: f64 = 24.0;

/// What stands above a page.
#[derive(Clone, Copy, Debug, Default)]
pub struct Caption<'a> {
    /// What is shown.
    pub heading: &'a str,
    /// More about it.
    pub line: &'a str,
    /// The time and the speed of what moves, at the right.
    pub clock: &'a str,
}

/// Draws the pages of a film, all of one size and with one colour for each kind of object.
#[derive(Clone, Debug)]
pub struct FilmPages {
    pub(super) size_px: [usize; 2],
    pub(super) palette: Palette,
}

impl FilmPages {
    /// The widths and heights that a page can have (px).
    pub const SIZES_PX: std::ops::RangeInclusive<usize> = 240..=4096;

    /// Pages of this width and height (px) for objects of these names.
    ///
    /// # Errors
    /// A size that is odd, which H.264 with 4:2:0 chroma cannot have, or not one of [`Self::SIZES_PX`].
    pub fn new<'a>(size_px: [usize; 2], names: impl IntoIterator<Item = &'a str>) -> Result<Self> {
        if size_px.iter().any(|px| px % 2 == 1 || !Self::SIZES_PX.contains(px)) {
            let (low, high) = (Self::SIZES_PX.start(), Self::SIZES_PX.end());
            let needed = format!("even numbers from {low} to {high}");
            let [width, height] = size_px;
            return Err(Error::invalid("the film", "size", format!("{width}x{height} px"), needed));
        }
        Ok(Self { size_px, palette: Palette::new(names) })
    }

    /// The width and height (px).
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// A length of the design on this page (px).
    pub(super) fn px(&self, design_px: f64) -> f64 {
        design_px * (self.size_px[1] as f64 / DESIGN_HEIGHT_PX).min(self.size_px[0] as f64 / 960.0)
    }

    /// The area below the caption.
    pub(super) fn content(&self) -> Area {
        let (margin, top) = (self.px(MARGIN_PX) as usize, self.px(CAPTION_PX) as usize);
        let [width, height] = self.size_px;
        Area { corner: [margin, top], size: [width - 2 * margin, height - top - margin] }
    }

    /// Two areas side by side, of which the left one has this part of the width.
    pub(super) fn halves(&self, part: f64) -> [Area; 2] {
        let all = self.content();
        let gap = self.px(MARGIN_PX) as usize;
        let left = (part * (all.size[0] - gap) as f64) as usize;
        let right = all.size[0] - gap - left;
        let area = |x, width| Area { corner: [x, all.corner[1]], size: [width, all.size[1]] };
        [area(all.corner[0], left), area(all.corner[0] + left + gap, right)]
    }

    /// A page with its caption.
    pub(super) fn captioned(&self, caption: &Caption) -> Canvas {
        let mut canvas = Canvas::blank(self.size_px, BACKGROUND);
        let margin = self.px(MARGIN_PX);
        let width = self.size_px[0] as f64 - 2.0 * margin;
        let clock = Lettering { height_px: self.px(17.0), colour: MUTED };
        let clock_px = text_width_px(caption.clock, clock.height_px);
        let fitted = |text: &str, height_px: f64, width: f64| {
            height_px.min(width / text_width_px(text, 1.0).max(1e-9)).max(1.0)
        };
        let heading = fitted(caption.heading, self.px(24.0), width - clock_px - margin);
        let line = fitted(caption.line, self.px(16.0), width);
        let left = |y: f64| Pixel::new(margin, self.px(y));
        canvas.text(caption.heading, left(42.0), Lettering { height_px: heading, colour: TEXT });
        canvas.text(caption.line, left(72.0), Lettering { height_px: line, colour: MUTED });
        let right = Pixel::new(margin + width - clock_px, self.px(42.0));
        canvas.text(caption.clock, right, clock);
        canvas
    }

    /// Paragraphs from the top of an area, as far as there is room; the first of each pair stands before the second.
    pub(super) fn paragraphs(&self, canvas: &mut Canvas, area: Area, paragraphs: &[(String, String)]) {
        canvas.fill(area, PANEL, STRONG);
        let (small, line_px) = (self.px(16.0), self.px(28.0));
        let margin = self.px(20.0);
        let left = area.corner[0] as f64 + margin;
        let width = area.size[0] as f64 - 2.0 * margin;
        let bottom = (area.corner[1] + area.size[1]) as f64 - margin;
        let mut y = area.corner[1] as f64 + margin;
        for (title, words) in paragraphs {
            let titles = wrapped(title, small, width).into_iter().map(|line| (line, MUTED));
            let lines = titles.chain(wrapped(words, small, width).into_iter().map(|line| (line, TEXT)));
            for (line, colour) in lines {
                y += line_px;
                if y > bottom {
                    return;
                }
                canvas.text(&line, Pixel::new(left, y), Lettering { height_px: small, colour });
            }
            y += 0.45 * line_px;
        }
    }

    /// The colour of an object; that of a pair is that of its first object.
    pub(super) fn colour(&self, name: &str) -> Colour {
        colour(&self.palette, name.split('/').next().unwrap_or(name))
    }
}
