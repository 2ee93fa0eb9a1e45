//! The pages of a film of a whole procedure: strike films with their tracks, what was learned, the plan, its simulation, and the
//! executed strike beside it.

mod page;
mod style;
mod table;
mod text;
mod values;

pub use page::{Caption, FilmPages};

use super::raster::{Area, Canvas, Lettering, RgbImage, text_width_px};
use crate::geometry::{Pixel, Pose};
use crate::ordered_map::map_of;
use crate::physics::Trajectory;
use crate::plan::Plan;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::verify::{ObservedPose, Report};
use page::MARGIN_PX;
use style::{BACKGROUND, MUTED, TEXT};
use table::{Drawn, drawn_table};

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

impl FilmPages {
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
}

#[cfg(test)]
mod tests;
