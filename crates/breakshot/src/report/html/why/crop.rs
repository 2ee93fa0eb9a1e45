//! One magnified part of a frame, with what was searched and what was found in it.

use super::super::super::figures::escaped;
use super::super::super::overlay::closed_outline;
use crate::capture::{Camera, GreyImage};
use crate::detect::{Outcome, Search, Sighting, Spot};
use crate::geometry::moments::principal_axes;
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{Object, Shape};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Side of the drawing, in its own units.
const SIDE: f64 = 320.0;
/// Points of a circle or an ellipse.
const ROUND_POINTS: u32 = 48;
/// A crop reaches this many outer radii of the object from its middle, ...
const USUAL_REACH: f64 = 1.7;
/// ... and at most this many to show the refused regions.
const LARGEST_REACH: f64 = 4.0;
/// A crop is embedded with at most this many of the film's pixels along a side; a larger one is reduced.
const MOST_PX: usize = 320;
/// The fraction of the darkest and of the lightest pixels that the contrast is not stretched to.
const CLIPPED: f64 = 0.01;
/// Levels between these are stretched at most to the whole range by this factor, so that noise stays faint.
const LARGEST_STRETCH: f64 = 4.0;
/// Width of the little map of the frame.
const MAP_WIDTH: f64 = 64.0;

/// One object in one frame: what its drawing needs beside the frame.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub object: &'a Object,
    /// Height at which its marker appears (m).
    pub height_m: f64,
    pub search: &'a Search,
    pub camera: &'a Camera,
}

/// A square part of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Square {
    /// Its left upper corner and its side (px).
    left: f64,
    top: f64,
    side: f64,
}

impl Square {
    /// From the film's pixels, whose centres are whole numbers, to the drawing.
    fn at(self, pixel: Pixel) -> Pixel {
        let scale = SIDE / self.side;
        Pixel::new((pixel.x + 0.5 - self.left) * scale, (pixel.y + 0.5 - self.top) * scale)
    }
}

impl Subject<'_> {
    /// Where the object was found, or expected.
    fn pose(&self) -> Pose {
        match &self.search.outcome {
            Outcome::Found(sighting) | Outcome::Doubtful(sighting, _) => sighting.pose,
            Outcome::Lost(_) => self.search.predicted,
        }
    }

    /// How far a crop should reach from its middle (px); `None` where the camera does not see the place.
    pub(super) fn reach_px(&self) -> Option<f64> {
        let middle = self.middle();
        let scale_m = self.camera.scale_m_per_px(middle, self.object.height_m);
        let radius_px = self.object.shape.outer_radius_m() / scale_m;
        let candidates = match &self.search.outcome {
            Outcome::Lost(candidates) => &candidates[..],
            _ => &[],
        };
        let of_candidate = |spot: &Spot| {
            let (long, ..) = principal_axes(spot.covariance_px2);
            spot.centroid.distance_px(middle) + 3.0 * long.max(0.0).sqrt()
        };
        let needed_px = candidates.iter().map(|c| of_candidate(&c.spot)).fold(0.0, f64::max);
        let reach_px = (USUAL_REACH * radius_px).max(needed_px).min(LARGEST_REACH * radius_px);
        (reach_px.is_finite() && middle.x.is_finite() && middle.y.is_finite()).then_some(reach_px)
    }

    fn middle(&self) -> Pixel {
        self.camera.pixel_from_table(self.pose().position, self.object.height_m)
    }

    /// The crop with this reach around the object; moved so that some of the picture is in it.
    pub(super) fn square(&self, reach_px: f64) -> Square {
        let [width, height] = self.camera.size_px.map(|px| px as f64);
        let Pixel { x, y } = self.middle();
        let inside = |at: f64, size: f64| at.clamp(0.0, size - 1.0);
        let (x, y) = (inside(x, width), inside(y, height));
        Square {
            left: (x - reach_px).floor(),
            top: (y - reach_px).floor(),
            side: (2.0 * reach_px).ceil().max(8.0),
        }
    }

    /// The drawing.
    pub(super) fn svg(&self, frame: &GreyImage, square: Square, label: &str) -> String {
        let label = escaped(label);
        let mut svg = format!("<svg viewBox=\"0 0 {SIDE} {SIDE}\" role=\"img\" aria-label=\"{label}\">");
        draw_picture(&mut svg, frame, square);
        let mut drawing = Drawing { svg, square, subject: self };
        let search = self.search;
        match &search.outcome {
            Outcome::Found(sighting) => drawing.sighting(sighting, "why-found"),
            Outcome::Doubtful(sighting, _) => {
                drawing.object(search.predicted, "why-expected");
                drawing.sighting(sighting, "why-doubtful");
            }
            Outcome::Lost(candidates) => {
                drawing.search_region();
                drawing.object(search.predicted, "why-expected");
                for (number, candidate) in candidates.iter().enumerate() {
                    drawing.spot(&candidate.spot, "why-refused");
                    drawing.number(number + 1, &candidate.spot);
                }
            }
        }
        drawing.map();
        drawing.svg + "</svg>"
    }
}

/// The pixels, magnified; the part of a crop outside the picture stays empty.
fn draw_picture(svg: &mut String, frame: &GreyImage, square: Square) {
    let range = |from: f64, size: usize| {
        let first = from.clamp(0.0, size as f64) as usize;
        let end = (from + square.side).clamp(0.0, size as f64) as usize;
        first..end
    };
    let (columns, rows) = (range(square.left, frame.width), range(square.top, frame.height));
    let pixels: Vec<u8> =
        rows.clone().flat_map(|row| &frame.pixels[row * frame.width..][columns.clone()]).copied().collect();
    let crop = GreyImage { width: columns.len(), height: rows.len(), pixels: stretched(pixels) };
    let factor = crop.width.max(crop.height).div_ceil(MOST_PX).max(1);
    let Some(url) = crop.shrunk(factor).data_url() else { return };
    let scale = SIDE / square.side;
    let (x, y) = ((columns.start as f64 - square.left) * scale, (rows.start as f64 - square.top) * scale);
    let (width, height) = (crop.width as f64 * scale, crop.height as f64 * scale);
    let _ = write!(
        svg,
        "<image class=\"why-crop\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" preserveAspectRatio=\"none\" href=\"{url}\"/>"
    );
}

/// Grey levels with their contrast stretched to most of the range.
fn stretched(pixels: Vec<u8>) -> Vec<u8> {
    let mut counts = [0_usize; 256];
    for &pixel in &pixels {
        counts[usize::from(pixel)] += 1;
    }
    let clipped = (pixels.len() as f64 * CLIPPED) as usize;
    let below = |level: usize| counts[..=level].iter().sum::<usize>();
    let low = (0..256).find(|&level| below(level) > clipped);
    let high = (0..256).rev().find(|&level| pixels.len() - below(level) + counts[level] > clipped);
    let (Some(low), Some(high)) = (low, high) else { return pixels };
    let factor = (255.0 / (high as f64 - low as f64).max(1.0)).clamp(1.0, LARGEST_STRETCH);
    let middle = f64::midpoint(low as f64, high as f64);
    // The middle moves only as far as the range of eight bits demands. Where the levels are stretched to all of that range, the two bounds are
    // equal but for rounding.
    let to = middle.max((middle - low as f64) * factor).min(255.0 - (high as f64 - middle) * factor);
    pixels
        .into_iter()
        .map(|p| (to + (f64::from(p) - middle) * factor).round().clamp(0.0, 255.0) as u8)
        .collect()
}

/// A drawing under construction.
struct Drawing<'a> {
    svg: String,
    square: Square,
    subject: &'a Subject<'a>,
}

impl Drawing<'_> {
    /// A line with a dark one below it, so that it shows on any grey.
    fn line(&mut self, pixels: impl Iterator<Item = Pixel>, class: &str) {
        let shown = pixels.map(|p| self.square.at(p)).filter(|p| p.x.is_finite() && p.y.is_finite());
        let points: Vec<String> = shown.map(|p| format!("{:.1},{:.1}", p.x, p.y)).collect();
        let points = points.join(" ");
        let _ = write!(
            self.svg,
            "<polyline points=\"{points}\" class=\"why-rim\"/><polyline points=\"{points}\" class=\"{class}\"/>"
        );
    }

    /// The outline of the object, of its marker and of the dot beside that.
    fn object(&mut self, pose: Pose, class: &str) {
        let Subject { object, height_m, camera, .. } = *self.subject;
        let mut outlines = vec![(object.shape.clone(), Point::ORIGIN, object.height_m)];
        if let Some(marker) = &object.marker {
            outlines.push((marker.shape.clone(), marker.at_m, height_m));
            let dot = marker.dot.map(|dot| (Shape::Disc { radius_m: dot.radius_m }, dot.at_m, height_m));
            outlines.extend(dot);
        }
        for (shape, at_m, height_m) in outlines {
            let points = closed_outline(&shape).into_iter().map(|p| pose.table_from_body(p + at_m.to_vec()));
            self.line(points.map(|p| camera.pixel_from_table(p, height_m)), class);
        }
    }

    fn sighting(&mut self, sighting: &Sighting, class: &str) {
        self.object(sighting.pose, class);
        if self.subject.object.marker.is_some() {
            self.spot(&sighting.spot, "why-measured");
        }
    }

    /// The ellipse with the moments of a region.
    fn spot(&mut self, spot: &Spot, class: &str) {
        self.line(ellipse(spot), class);
    }

    /// The number of a refused region, at its upper right end.
    fn number(&mut self, number: usize, spot: &Spot) {
        let ends = ellipse(spot).map(|p| self.square.at(p));
        let Some(at) = ends.max_by(|p, q| (p.x - p.y).total_cmp(&(q.x - q.y))) else { return };
        let (x, y) = ((at.x + 2.0).clamp(4.0, SIDE - 14.0), (at.y - 1.0).clamp(16.0, SIDE - 4.0));
        let _ = write!(self.svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" class=\"why-number\">{number}</text>");
    }

    /// The circle on the table in which the object was searched.
    fn search_region(&mut self) {
        let Subject { object, height_m, search, camera } = *self.subject;
        let middle = search.predicted.table_from_body(object.feature().at_m);
        let points = (0..=ROUND_POINTS).map(|k| {
            let heading_rad = TAU * f64::from(k) / f64::from(ROUND_POINTS);
            camera.pixel_from_table(middle + Vec2::from_heading(heading_rad) * search.radius_m, height_m)
        });
        self.line(points, "why-region");
    }

    /// Where the crop is in the picture.
    fn map(&mut self) {
        let [width, height] = self.subject.camera.size_px.map(|px| px as f64);
        let scale = MAP_WIDTH / width;
        let (x, y, high) = (SIDE - MAP_WIDTH - 6.0, 6.0, height * scale);
        let Square { left, top, side } = self.square;
        let ([left, right], [top, bottom]) = (
            [left, left + side].map(|at| at.clamp(0.0, width) * scale),
            [top, top + side].map(|at| at.clamp(0.0, height) * scale),
        );
        let _ = write!(
            self.svg,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{MAP_WIDTH:.1}\" height=\"{high:.1}\" class=\"why-map\"/>\
             <rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" class=\"why-here\"/>",
            x + left,
            y + top,
            right - left,
            bottom - top
        );
    }
}

/// The ellipse with the moments of a region.
fn ellipse(spot: &Spot) -> impl Iterator<Item = Pixel> {
    let (long, short, axis_rad) = principal_axes(spot.covariance_px2);
    let [a, b] = [long, short].map(|variance| 2.0 * variance.max(0.0).sqrt());
    let (sin, cos) = axis_rad.sin_cos();
    let Pixel { x, y } = spot.centroid;
    (0..=ROUND_POINTS).map(move |k| {
        let (s, c) = (TAU * f64::from(k) / f64::from(ROUND_POINTS)).sin_cos();
        let (u, v) = (a * c, b * s);
        Pixel::new(x + u * cos - v * sin, y + u * sin + v * cos)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_two_grey_levels_are_stretched_apart_and_stay_in_order() {
        for low in 0..=255_u8 {
            for high in low..=255 {
                let stretched = stretched([[low; 50], [high; 50]].concat());
                let factor =
                    (255.0 / (f64::from(high) - f64::from(low)).max(1.0)).clamp(1.0, LARGEST_STRETCH);
                let wanted = factor * (f64::from(high) - f64::from(low));
                let apart = f64::from(stretched[99]) - f64::from(stretched[0]);
                assert!((apart - wanted).abs() <= 1.0, "{low} and {high} are {apart} apart, {wanted} wanted");
            }
        }
    }
}
