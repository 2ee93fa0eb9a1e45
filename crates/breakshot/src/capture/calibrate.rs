//! Is the camera where the cell says, and how would one see it?

use super::Capture;
use super::camera::Camera;
use super::image::GreyImage;
use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point, Vec2};
use serde::Serialize;
use std::fmt::Write;

/// A camera, the cell it belongs to and the picture it was found in.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// The file format's version.
    pub version: u32,
    /// The film or picture.
    pub picture: String,
    /// Where the camera stands on the table (m); unknown for one known by a homography or a scale alone.
    pub position_m: Option<[f64; 3]>,
    /// The angle between its axis and straight down (rad).
    pub tilt_rad: Option<f64>,
    /// The side of the square that a pixel shows in the workspace's middle, on the table (m).
    pub pixel_size_m: f64,
    /// The camera, with the error of every tag.
    pub camera: Camera,
    #[serde(skip)]
    image: GreyImage,
    #[serde(skip)]
    cell: Cell,
}

/// The camera of a film's first frames, or of a picture, and how well it fits.
///
/// # Errors
/// A film without frames, or that breaks off.
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

/// Lines of the table's grid are this far apart (m)...
const GRID_M: f64 = 0.05;
/// ... and drawn this far past the workspace.
const GRID_MARGIN_M: f64 = 0.1;
/// No more lines than this either way: a workspace of kilometres is a slip of the pen.
const MOST_LINES: usize = 400;
/// The axes' length in the drawing (m).
const AXIS_M: f64 = 0.1;
/// Pieces of a line, which the lens may bend.
const PIECES: u32 = 24;

impl Calibration {
    /// The picture with the table's grid (5 cm), its axes, the workspace, and every tag as the camera expects it and
    /// as it was seen: one SVG that holds all it needs.
    ///
    /// # Errors
    /// A picture without pixels.
    pub fn drawing(&self) -> Result<String> {
        let [width, height] = self.camera.size_px;
        let empty = || Error::invalid(&self.picture, "picture", "no pixels", "a picture");
        let picture = self.image.data_url().ok_or_else(empty)?;
        // Lines must stay visible whatever the picture's size.
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

    /// One line about the whole fit.
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
            let barb = |turn: f64| tip - axis.rotated(turn) * 0.15;
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
            let told = match fit {
                Some(fit) => format!("tag {}: {:.2} px, {:.2} mm", tag.id, fit.rms_px, fit.rms_m * 1e3),
                None => format!("tag {}: not seen", tag.id),
            };
            self.draw_text(svg, self.camera.pixel_from_table(d, 0.0), colour, &told);
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

    /// A line over the table through these places, broken where the camera does not see it.
    fn draw_line(&self, svg: &mut String, places: &[Point], stroke: &str) {
        let part = |k: u32| f64::from(k) / f64::from(PIECES);
        let pieces = places
            .windows(2)
            .flat_map(|ends| (0..=PIECES).map(move |k| ends[0] + (ends[1] - ends[0]) * part(k)));
        let pixels: Vec<Pixel> = pieces.map(|place| self.camera.pixel_from_table(place, 0.0)).collect();
        let [width, height] = self.camera.size_px.map(|size| size as f64);
        // A little past the border lines are cut by the picture's own frame; far past it they are left out.
        let near = |p: &Pixel| p.x > -width && p.x < 2.0 * width && p.y > -height && p.y < 2.0 * height;
        for run in pixels.split(|p| !near(p)).filter(|run| run.len() > 1) {
            let points: Vec<String> = run.iter().map(|p| format!("{:.2},{:.2}", p.x, p.y)).collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{stroke}\"/>",
                points.join(" ")
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
