//! The pages of a film of a whole procedure: strike films with their tracks, what was learned, the plan, its simulation, and the
//! executed strike beside it.

mod table;
mod text;
mod values;

use super::figures::Palette;
use super::raster::{Area, COLOURS, Canvas, Colour, Lettering, RgbImage, STRONG, text_width_px, wrapped};
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Pose};
use crate::ordered_map::map_of;
use crate::physics::Trajectory;
use crate::plan::Plan;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::verify::{ObservedPose, Report};
use table::{Drawn, drawn_table};

/// The colours of a page.
const BACKGROUND: Colour = [18, 21, 26];
const PANEL: Colour = [30, 35, 43];
const TEXT: Colour = [236, 239, 244];
const MUTED: Colour = [160, 169, 182];

/// The height for which lengths are given (px): those of another page are in proportion.
const DESIGN_HEIGHT_PX: f64 = 720.0;
/// The height of the caption (px of the design).
const CAPTION_PX: f64 = 88.0;
/// The margin (px of the design).
const MARGIN_PX: f64 = 24.0;

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

/// A film of a strike beside its simulation, at one instant.
#[derive(Clone, Copy, Debug)]
pub struct Beside<'a> {
    /// The frame, with its tracks drawn on it.
    pub frame: &'a RgbImage,
    /// The pile.
    pub scene: &'a Scene,
    /// The strike.
    pub strike: &'a Strike,
    /// The simulation.
    pub trajectory: &'a Trajectory,
    /// The time of the simulation (s after the striker starts).
    pub time_s: f64,
}

/// Draws the pages of a film, all of one size and with one colour for each kind of object.
#[derive(Clone, Debug)]
pub struct FilmPages {
    size_px: [usize; 2],
    palette: Palette,
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

    /// A title and lines below it, in the middle.
    pub fn title(&self, title: &str, lines: &[String]) -> RgbImage {
        let mut canvas = Canvas::blank(self.size_px, BACKGROUND);
        let [width, height] = self.size_px.map(|px| px as f64);
        let (large, small) = (self.px(40.0), self.px(18.0));
        let line_px = 2.0 * small;
        let mut y = (height - line_px * lines.len() as f64) / 2.0 - self.px(10.0);
        let mut middle = |text: &str, y: f64, style: Lettering| {
            let left = (width - text_width_px(text, style.height_px)) / 2.0;
            canvas.text(text, Pixel::new(left, y), style);
        };
        let fitting = (width - 2.0 * self.px(MARGIN_PX)) / text_width_px(title, 1.0).max(1.0);
        middle(title, y, Lettering { height_px: large.min(fitting), colour: TEXT });
        y += self.px(30.0);
        for line in lines {
            y += line_px;
            middle(line, y, Lettering { height_px: small, colour: MUTED });
        }
        canvas.finish()
    }

    /// A frame of a film, below its caption.
    pub fn filmed(&self, caption: &Caption, frame: &RgbImage) -> RgbImage {
        let mut canvas = self.captioned(caption);
        canvas.image(frame, self.content());
        canvas.finish()
    }

    /// Friction, restitution, mass ratios and contact friction with their 95 % intervals, on as many pages as they need.
    pub fn properties(&self, properties: &Properties) -> Vec<RgbImage> {
        values::pages(self, properties)
    }

    /// The pile with the planned strike and the final poses that it may lead to, beside its numbers.
    pub fn plan(&self, caption: &Caption, plan: &Plan) -> RgbImage {
        let mut canvas = self.captioned(caption);
        let [left, right] = self.halves(0.62);
        let drawn = Drawn {
            scene: &plan.scene,
            strike: plan.strike.as_ref(),
            trajectory: None,
            time_s: 0.0,
            final_poses: plan.prediction.as_ref().map(|prediction| &prediction.final_poses),
            possible: plan.robustness.as_ref().map(|robustness| &robustness.final_poses),
            compared: None,
        };
        drawn_table(&mut canvas, left, &drawn, &self.palette, self.px(1.0));
        self.paragraphs(&mut canvas, right, &text::of_plan(plan));
        canvas.finish()
    }

    /// The simulated pile at one instant.
    pub fn simulated(
        &self,
        caption: &Caption,
        (scene, strike): (&Scene, &Strike),
        trajectory: &Trajectory,
        time_s: f64,
    ) -> RgbImage {
        let mut canvas = self.captioned(caption);
        let drawn = Drawn {
            scene,
            strike: Some(strike),
            trajectory: Some(trajectory),
            time_s,
            final_poses: None,
            possible: None,
            compared: None,
        };
        drawn_table(&mut canvas, self.content(), &drawn, &self.palette, self.px(1.0));
        canvas.finish()
    }

    /// A film of a strike (left) beside its simulation (right).
    pub fn beside(&self, caption: &Caption, beside: &Beside) -> RgbImage {
        let mut canvas = self.captioned(caption);
        let halves = self.halves(0.5);
        for (area, title) in halves.into_iter().zip(["Filmed", "Simulated"]) {
            let [x, y] = area.corner.map(|px| px as f64);
            let style = Lettering { height_px: self.px(18.0), colour: TEXT };
            canvas.text(title, Pixel::new(x, y + self.px(22.0)), style);
        }
        let below = |area: Area| {
            let title_px = self.px(40.0) as usize;
            let [x, y] = area.corner;
            Area { corner: [x, y + title_px], size: [area.size[0], area.size[1].saturating_sub(title_px)] }
        };
        let [left, right] = halves.map(below);
        canvas.image(beside.frame, left);
        let drawn = Drawn {
            scene: beside.scene,
            strike: Some(beside.strike),
            trajectory: Some(beside.trajectory),
            time_s: beside.time_s,
            final_poses: None,
            possible: None,
            compared: None,
        };
        drawn_table(&mut canvas, right, &drawn, &self.palette, self.px(1.0));
        canvas.finish()
    }

    /// The final poses in a film (filled) and in its simulation (light outlines), beside what their comparison found.
    pub fn comparison(&self, caption: &Caption, scene: &Scene, report: &Report) -> RgbImage {
        let mut canvas = self.captioned(caption);
        let [left, right] = self.halves(0.6);
        let pose = |observed: &ObservedPose| Pose {
            position: observed.position,
            yaw_rad: observed.yaw_rad.unwrap_or(0.0),
        };
        let observed = map_of(report.observed.iter().map(|(name, observed)| (name.clone(), pose(observed))));
        let drawn = Drawn {
            scene,
            strike: None,
            trajectory: None,
            time_s: 0.0,
            final_poses: Some(&observed),
            possible: None,
            compared: Some(&report.predicted),
        };
        drawn_table(&mut canvas, left, &drawn, &self.palette, self.px(1.0));
        self.paragraphs(&mut canvas, right, &text::of_report(report));
        canvas.finish()
    }

    /// A length of the design on this page (px).
    fn px(&self, design_px: f64) -> f64 {
        design_px * (self.size_px[1] as f64 / DESIGN_HEIGHT_PX).min(self.size_px[0] as f64 / 960.0)
    }

    /// The area below the caption.
    fn content(&self) -> Area {
        let (margin, top) = (self.px(MARGIN_PX) as usize, self.px(CAPTION_PX) as usize);
        let [width, height] = self.size_px;
        Area { corner: [margin, top], size: [width - 2 * margin, height - top - margin] }
    }

    /// Two areas side by side, of which the left one has this part of the width.
    fn halves(&self, part: f64) -> [Area; 2] {
        let all = self.content();
        let gap = self.px(MARGIN_PX) as usize;
        let left = (part * (all.size[0] - gap) as f64) as usize;
        let right = all.size[0] - gap - left;
        let area = |x, width| Area { corner: [x, all.corner[1]], size: [width, all.size[1]] };
        [area(all.corner[0], left), area(all.corner[0] + left + gap, right)]
    }

    /// A page with its caption.
    fn captioned(&self, caption: &Caption) -> Canvas {
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
    fn paragraphs(&self, canvas: &mut Canvas, area: Area, paragraphs: &[(String, String)]) {
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
    fn colour(&self, name: &str) -> Colour {
        colour(&self.palette, name.split('/').next().unwrap_or(name))
    }
}

fn colour(palette: &Palette, name: &str) -> Colour {
    palette.number(name).map_or(MUTED, |number| COLOURS[number % COLOURS.len()])
}

#[cfg(test)]
mod tests;
