//! The impulse that the arm can transfer along each heading, over the whole workspace, as an SVG figure (after Fig. 10).

use crate::cell::Cell;
use crate::geometry::{Point, Vec2};
use crate::robot::arm::impulse_geometry::{ImpulseConditions, ImpulseGeometry};
use crate::robot::arm::mounted_arm::MountedArm;
use rayon::prelude::*;
use std::fmt::Write;

/// Width of the drawn workspace, and the space around it (px).
const WIDTH: f64 = 860.0;
const MARGIN: f64 = 70.0;
/// Number of positions along the longer side of the workspace.
const COLUMNS: f64 = 10.0;
/// The largest radius of a polar curve over half the distance of two positions.
const FILLED: f64 = 0.94;

/// The workspace from above; at each position a polar curve of the largest impulse along the table by heading, a cross out of reach.
pub fn impulse_map(mounted: &MountedArm, cell: &Cell, conditions: &ImpulseConditions) -> String {
    let (min, max) = (cell.workspace.min_m, cell.workspace.max_m);
    let size = max - min;
    let spacing_m = size.x.max(size.y) / COLUMNS;
    let (columns, rows) = ((size.x / spacing_m).round().max(1.0), (size.y / spacing_m).round().max(1.0));
    let positions: Vec<Point> = (0..columns as u32)
        .flat_map(|i| (0..rows as u32).map(move |k| (f64::from(i) + 0.5, f64::from(k) + 0.5)))
        .map(|(i, k)| min + Vec2::new(i / columns * size.x, k / rows * size.y))
        .collect();
    let geometries: Vec<Option<ImpulseGeometry>> =
        positions.par_iter().map(|&position| mounted.impulse_geometry(position, conditions)).collect();
    let headings = geometries.iter().flatten().flat_map(|geometry| &geometry.headings);
    let most_n_s = headings.map(|heading| heading.impulse_n_s).fold(0.0, f64::max);

    let view = View { min, max, px_per_m: WIDTH / size.x.max(size.y) };
    let [width, height] = [size.x, size.y].map(|side_m| side_m * view.px_per_m + 2.0 * MARGIN);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{:.0}\" font-family=\"sans-serif\" font-size=\"13\" \
         fill=\"none\" stroke-linejoin=\"round\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        height + MARGIN / 2.0
    );
    let (corner, opposite) = (view.px(Point::new(min.x, max.y)), view.px(Point::new(max.x, min.y)));
    let _ = writeln!(
        svg,
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" stroke=\"#888\"/>",
        corner.0,
        corner.1,
        opposite.0 - corner.0,
        opposite.1 - corner.1
    );
    let radius_px = FILLED * spacing_m / 2.0 * view.px_per_m;
    for (position, geometry) in positions.iter().zip(&geometries) {
        let at = view.px(*position);
        match geometry {
            Some(geometry) if most_n_s > 0.0 => polar_curve(&mut svg, at, radius_px / most_n_s, geometry),
            _ => cross(&mut svg, at),
        }
    }
    base(&mut svg, &view, mounted);
    caption(&mut svg, (MARGIN, height), radius_px, most_n_s, conditions);
    svg.push_str("</svg>\n");
    svg
}

/// The workspace from above, y upwards.
struct View {
    min: Point,
    max: Point,
    px_per_m: f64,
}

impl View {
    fn px(&self, point: Point) -> (f64, f64) {
        (MARGIN + (point.x - self.min.x) * self.px_per_m, MARGIN + (self.max.y - point.y) * self.px_per_m)
    }
}

/// The impulse over heading, and a line along the heading of the largest one.
fn polar_curve(svg: &mut String, at: (f64, f64), px_per_n_s: f64, geometry: &ImpulseGeometry) {
    let point = |heading_rad: f64, impulse_n_s: f64| {
        let radius = px_per_n_s * impulse_n_s;
        (at.0 + radius * heading_rad.cos(), at.1 - radius * heading_rad.sin())
    };
    let points: Vec<String> = geometry
        .headings
        .iter()
        .map(|heading| point(heading.heading_rad, heading.impulse_n_s))
        .map(|(x, y)| format!("{x:.1},{y:.1}"))
        .collect();
    let _ = writeln!(
        svg,
        "<polygon points=\"{}\" stroke=\"#4878a8\" fill=\"#4878a8\" fill-opacity=\"0.18\"/>",
        points.join(" ")
    );
    if let Some(strongest) = geometry.strongest() {
        let (x, y) = point(strongest.heading_rad, strongest.impulse_n_s);
        let _ = writeln!(
            svg,
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{x:.1}\" y2=\"{y:.1}\" stroke=\"#c03028\" stroke-width=\"1.6\"/>",
            at.0, at.1
        );
    }
}

fn cross(svg: &mut String, (x, y): (f64, f64)) {
    let _ = writeln!(svg, "<path d=\"M{:.1} {:.1} l8 8 m0 -8 l-8 8\" stroke=\"#999\"/>", x - 4.0, y - 4.0);
}

/// The direction of the arm's base: an arrow from the workspace's edge.
fn base(svg: &mut String, view: &View, mounted: &MountedArm) {
    let base = mounted.base_on_table();
    let middle = view.min + (view.max - view.min) / 2.0;
    let nearest = Point::new(base.x.clamp(view.min.x, view.max.x), base.y.clamp(view.min.y, view.max.y));
    let (x, y) = view.px(nearest);
    let Some(outwards) = (base - middle).direction() else { return };
    let tip = (x + 30.0 * outwards.x, y - 30.0 * outwards.y);
    let _ = writeln!(
        svg,
        "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"#333\" stroke-width=\"2\"/>\
         <circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"#333\"/>",
        tip.0, tip.1, tip.0, tip.1
    );
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"#333\">base, {:.0} mm from here</text>",
        tip.0 + 10.0,
        tip.1 + 4.0,
        (base - nearest).length() * 1e3
    );
}

/// What is drawn, and the scale of the curves.
fn caption(
    svg: &mut String,
    (left, top): (f64, f64),
    radius_px: f64,
    most_n_s: f64,
    conditions: &ImpulseConditions,
) {
    let _ = writeln!(
        svg,
        "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius_px:.1}\" stroke=\"#4878a8\" stroke-dasharray=\"3 3\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#222\">{:.0} mN s: the largest impulse on an object of {:.0} g by heading, at {:.1} m/s at most; \
         red: the best heading; cross: out of reach</text>",
        left + radius_px,
        top - MARGIN / 4.0,
        left + 2.0 * radius_px + 14.0,
        top - MARGIN / 4.0 + 4.0,
        most_n_s * 1e3,
        conditions.object_mass_kg * 1e3,
        conditions.speed_cap_m_s
    );
}
