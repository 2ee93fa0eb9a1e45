//! How well does the camera fit the tags, and what does the fit look like in the picture?

mod residuals;

pub use residuals::TagResidual;

use super::Capture;
use super::camera::Camera;
use super::image::GreyImage;
use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point, Vec2};
use serde::Serialize;
use std::fmt::Write;

/// A calibrated camera with the picture that it was calibrated from and its cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// The file format's version.
    pub version: u32,
    /// The film or picture.
    pub picture: String,
    /// The camera's position in the table frame (m); `None` for a homography or a scale alone.
    pub position_m: Option<[f64; 3]>,
    /// The angle between its optical axis and straight down (rad).
    pub tilt_rad: Option<f64>,
    /// The side of one pixel on the table, in the workspace's middle (m).
    pub pixel_size_m: f64,
    /// The camera, with the error of every tag.
    pub camera: Camera,
    #[serde(skip)]
    image: GreyImage,
    #[serde(skip)]
    cell: Cell,
}

/// The camera of a film or a picture with its residuals and the first frame.
///
/// # Errors
/// A film without frames, or one that ends early.
pub fn calibration(capture: Capture) -> Result<Calibration> {
    let Capture { mut footage, camera, cell } = capture;
    let image = footage.next().transpose()?.map(|frame| frame.image);
    let image =
        image.ok_or_else(|| Error::video(footage.name().as_ref(), "no picture", "at least one frame"))?;
    let middle = Point::ORIGIN + (cell.workspace.min_m.to_vec() + cell.workspace.max_m.to_vec()) / 2.0;
    Ok(Calibration {
        version: 1,
        picture: footage.name().into(),
        position_m: camera.position_m(),
        tilt_rad: camera.tilt_rad(),
        pixel_size_m: camera.scale_m_per_px(camera.pixel_from_table(middle, 0.0), 0.0),
        camera,
        image,
        cell,
    })
}

/// Spacing of the table's grid lines (m)...
const GRID_M: f64 = 0.05;
/// ... and their length beyond the workspace.
const GRID_MARGIN_M: f64 = 0.1;
/// Largest number of grid lines per axis, for workspaces with wrong units.
const MOST_LINES: usize = 400;
/// The axes' length in the drawing (m).
const AXIS_M: f64 = 0.1;
/// Segments per line, because the lens distorts straight lines.
const PIECES: u32 = 24;

impl Calibration {
    /// The picture with the table's grid (5 cm), its axes, the workspace, and every tag as predicted and as measured: a
    /// self-contained SVG.
    ///
    /// # Errors
    /// A picture without pixels.
    pub fn drawing(&self) -> Result<String> {
        let [width, height] = self.camera.size_px;
        let empty = || Error::invalid(&self.picture, "picture", "no pixels", "a picture");
        let picture = self.image.data_url().ok_or_else(empty)?;
        // Line width relative to the picture's size
        let line = width.max(height) as f64 / 1000.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"-0.5 -0.5 {width} {height}\" font-family=\"sans-serif\" font-size=\"{:.1}\">\n\
             <image x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" \
             href=\"{picture}\"/>\n",
            12.0 * line
        );
        self.draw_grid(&mut svg, line);
        self.draw_tags(&mut svg, line);
        self.draw_points(&mut svg, line);
        self.draw_text(
            &mut svg,
            Pixel::new(10.0 * line, height as f64 - 26.0 * line),
            "#222",
            &self.summary(),
        );
        svg += "</svg>\n";
        Ok(svg)
    }

    /// One line of text about the whole fit.
    fn summary(&self) -> String {
        let tilt = self.tilt_rad.map_or(String::new(), |tilt| {
            format!("; looks down {:.1} deg off the vertical", tilt.to_degrees())
        });
        let (rms_px, rms_mm) = (self.camera.reprojection_rms_px, self.camera.reprojection_rms_m * 1e3);
        format!("{}: error {rms_px:.2} px, {rms_mm:.2} mm{tilt}; grid 50 mm", self.picture)
    }

    fn draw_grid(&self, svg: &mut String, line: f64) {
        let (min, max) = (self.cell.workspace.min_m, self.cell.workspace.max_m);
        let steps = |from: f64, to: f64| {
            let first = ((from - GRID_MARGIN_M) / GRID_M).ceil() as i64;
            let last = ((to + GRID_MARGIN_M) / GRID_M).floor() as i64;
            (first..=last).take(MOST_LINES).map(|k| k as f64 * GRID_M)
        };
        let (low, high) = (min.to_vec() - MARGIN, max.to_vec() + MARGIN);
        for x in steps(min.x, max.x) {
            let ends = [Point::new(x, low.y), Point::new(x, high.y)];
            self.draw_line(
                svg,
                &ends,
                &format!("#2a7fff\" stroke-opacity=\"0.45\" stroke-width=\"{:.2}", 0.7 * line),
            );
        }
        for y in steps(min.y, max.y) {
            let ends = [Point::new(low.x, y), Point::new(high.x, y)];
            self.draw_line(
                svg,
                &ends,
                &format!("#2a7fff\" stroke-opacity=\"0.45\" stroke-width=\"{:.2}", 0.7 * line),
            );
        }
        let workspace = [min, Point::new(max.x, min.y), max, Point::new(min.x, max.y), min];
        self.draw_line(svg, &workspace, &format!("#2a7fff\" stroke-width=\"{:.2}", 1.5 * line));
        for (axis, name, colour) in
            [(Vec2::new(AXIS_M, 0.0), "x", "#e03030"), (Vec2::new(0.0, AXIS_M), "y", "#20a040")]
        {
            let tip = Point::ORIGIN + axis;
            let barb = |angle_rad: f64| tip - axis.rotated(angle_rad) * 0.15;
            let arrow = [Point::ORIGIN, tip, barb(0.5), tip, barb(-0.5)];
            self.draw_line(svg, &arrow, &format!("{colour}\" stroke-width=\"{:.2}", 2.0 * line));
            self.draw_text(svg, self.camera.pixel_from_table(tip + axis * 0.3, 0.0), colour, name);
        }
    }

    fn draw_tags(&self, svg: &mut String, line: f64) {
        for tag in &self.cell.tags {
            let fit = self.camera.tags.iter().find(|fit| fit.id == tag.id);
            let colour = match fit {
                Some(fit) if fit.used => "#20c040",
                Some(_) => "#e03030",
                None => "#ff9900",
            };
            let [a, b, c, d] = tag.corners_m();
            self.draw_line(svg, &[a, b, c, d, a], &format!("{colour}\" stroke-width=\"{line:.2}"));
            let text = match fit {
                Some(fit) => format!("tag {}: {:.2} px, {:.2} mm", tag.id, fit.rms_px, fit.rms_m * 1e3),
                None => format!("tag {}: not detected", tag.id),
            };
            self.draw_text(svg, self.camera.pixel_from_table(d, 0.0), colour, &text);
            for corner in fit.iter().flat_map(|fit| fit.corners_px) {
                draw_cross(svg, corner, line);
            }
        }
    }

    fn draw_points(&self, svg: &mut String, line: f64) {
        for point in self.cell.points.iter().filter(|_| self.cell.tags.is_empty()) {
            let expected = self.camera.pixel_from_table(point.table_m, 0.0);
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"{:.2}\" fill=\"none\" stroke=\"#20c040\" stroke-width=\"{line:.2}\"/>",
                expected.x,
                expected.y,
                6.0 * line
            );
            draw_cross(svg, point.image_px, line);
        }
    }

    /// A line on the table through these points, interrupted where it is out of view.
    fn draw_line(&self, svg: &mut String, points: &[Point], stroke: &str) {
        let fraction = |k: u32| f64::from(k) / f64::from(PIECES);
        let segments = points
            .windows(2)
            .flat_map(|ends| (0..=PIECES).map(move |k| ends[0] + (ends[1] - ends[0]) * fraction(k)));
        let pixels: Vec<Pixel> = segments.map(|point| self.camera.pixel_from_table(point, 0.0)).collect();
        let [width, height] = self.camera.size_px.map(|size| size as f64);
        // The SVG clips lines just outside the picture; points far outside are left out.
        let near = |p: &Pixel| p.x > -width && p.x < 2.0 * width && p.y > -height && p.y < 2.0 * height;
        for run in pixels.split(|p| !near(p)).filter(|run| run.len() > 1) {
            let coordinates: Vec<String> = run.iter().map(|p| format!("{:.2},{:.2}", p.x, p.y)).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{stroke}\"/>",
                coordinates.join(" ")
            );
        }
    }

    fn draw_text(&self, svg: &mut String, at: Pixel, colour: &str, text: &str) {
        if self.camera.shows(at) {
            let (x, y) = (at.x, at.y);
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" dy=\"1.1em\" fill=\"{colour}\" stroke=\"#fff\" stroke-width=\"0.3em\" \
                 paint-order=\"stroke\">{text}</text>"
            );
        }
    }
}

const MARGIN: Vec2 = Vec2::new(GRID_MARGIN_M, GRID_MARGIN_M);

fn draw_cross(svg: &mut String, at: Pixel, line: f64) {
    let (x, y, arm) = (at.x, at.y, 5.0 * line);
    let _ = writeln!(
        svg,
        "<path d=\"M{:.2} {y:.2}H{:.2}M{x:.2} {:.2}V{:.2}\" stroke=\"#ff00c0\" stroke-width=\"{:.2}\"/>",
        x - arm,
        x + arm,
        y - arm,
        y + arm,
        0.5 * line
    );
}
