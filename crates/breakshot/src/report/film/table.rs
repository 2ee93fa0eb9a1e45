//! The table from above: the pile, the strike, and where everything is at one instant.

use super::style::{BACKGROUND, MUTED, PANEL, TEXT, colour};
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::Trajectory;
use crate::report::figures::{CentrePath, DrawnObject, Layer, Palette, TopView, Viewport};
use crate::report::overlay::closed_outline;
use crate::report::raster::{Area, Canvas, Colour, FAINT, Lettering, Pen, STRONG, text_width_px};
use crate::scene::{Scene, Strike};
use std::collections::BTreeMap;

/// What is drawn of a strike.
pub(super) struct Drawn<'a> {
    pub scene: &'a Scene,
    pub strike: Option<&'a Strike>,
    /// The simulation, drawn at `time_s` with the paths up to then.
    pub trajectory: Option<&'a Trajectory>,
    pub time_s: f64,
    /// The expected final poses.
    pub final_poses: Option<&'a BTreeMap<String, Pose>>,
    /// Final poses in scenarios.
    pub possible: Option<&'a BTreeMap<String, Vec<Pose>>>,
    /// Poses that are compared with the final ones: light outlines.
    pub compared: Option<&'a BTreeMap<String, Pose>>,
}

/// The drawing shows the whole workspace if it is at most this many times as wide as the contents.
const WORKSPACE_FACTOR: f64 = 2.5;
/// Points of a path.
const PATH_POINTS: usize = 240;
/// Most possible final poses of an object that are drawn.
const MOST_POSSIBLE: usize = 60;
/// The length of the arrow head (px of the design).
const ARROW_PX: f64 = 14.0;

/// A table under construction.
struct Table<'a> {
    canvas: &'a mut Canvas,
    area: Area,
    top_left_m: [f64; 2],
    px_per_m: f64,
    /// One pixel of the design (px).
    unit_px: f64,
}

/// Draws the table into an area.
pub(super) fn drawn_table(canvas: &mut Canvas, area: Area, drawn: &Drawn, palette: &Palette, unit_px: f64) {
    canvas.fill(area, PANEL, STRONG);
    let view = viewport(drawn);
    let [width_m, height_m] = view.size_m();
    let px_per_m = (area.size[0] as f64 / width_m).min(area.size[1] as f64 / height_m);
    let [left_m, top_m] = view.top_left_m();
    // The contents lie in the middle.
    let spare_m =
        [(area.size[0] as f64 / px_per_m - width_m) / 2.0, (area.size[1] as f64 / px_per_m - height_m) / 2.0];
    let top_left_m = [left_m - spare_m[0], top_m + spare_m[1]];
    // What reaches beyond the area is drawn on a canvas of its own.
    let mut inner = Canvas::blank(area.size, PANEL);
    let mut table = Table { canvas: &mut inner, area, top_left_m, px_per_m, unit_px };
    table.surroundings(drawn.scene);
    table.poses(drawn, palette);
    if let Some(strike) = drawn.strike {
        table.strike(drawn, strike);
    }
    table.scale_bar();
    canvas.image(&inner.finish(), area);
}

/// The part of the table that contains everything that is drawn, at all times.
fn viewport(drawn: &Drawn) -> Viewport {
    let object = |(name, pose): (&String, Pose)| {
        let (name, shape) = drawn
            .scene
            .placed
            .iter()
            .map(|p| p.object.as_str())
            .find(|n| n == name)
            .and_then(|name| Some((name, &drawn.scene.object(name).ok()?.shape)))?;
        Some(DrawnObject { name, class: String::new(), shape, pose, layer: Layer::Current })
    };
    let before = drawn.scene.placed.iter().map(|p| (&p.object, p.pose()));
    let after =
        drawn.final_poses.into_iter().chain(drawn.compared).flatten().map(|(name, pose)| (name, *pose));
    let at_rest = drawn.trajectory.into_iter().flat_map(|t| &t.final_poses).map(|(name, pose)| (name, *pose));
    let paths = drawn.trajectory.map(|trajectory| {
        let names = trajectory.final_poses.keys();
        names.map(|name| CentrePath {
            class: String::new(),
            points: path(trajectory, name, trajectory.duration_s),
        })
    });
    let view = TopView {
        scene: drawn.scene,
        objects: before.chain(after).chain(at_rest).filter_map(object).collect(),
        paths: paths.into_iter().flatten().collect(),
        strike: drawn.strike,
        approaches: Vec::new(),
    };
    Viewport::of(&[&view], WORKSPACE_FACTOR)
}

/// The path of an object's centre up to a time.
fn path(trajectory: &Trajectory, name: &str, until_s: f64) -> Vec<Point> {
    let end_s = until_s.clamp(0.0, trajectory.duration_s.max(0.0));
    let time = |k: usize| end_s * k as f64 / (PATH_POINTS - 1) as f64;
    (0..PATH_POINTS).filter_map(|k| Some(trajectory.pose(name, time(k))?.position)).collect()
}

impl Table<'_> {
    fn px(&self, point: Point) -> Pixel {
        let [left_m, top_m] = self.top_left_m;
        Pixel::new((point.x - left_m) * self.px_per_m, (top_m - point.y) * self.px_per_m)
    }

    fn pen(&self, colour: Colour, width: f64, opacity: f64) -> Pen {
        Pen { colour, width_px: width * self.unit_px, opacity }
    }

    fn closed(&mut self, corners: &[Point], pen: Pen) {
        let points: Vec<Pixel> = corners.iter().chain(corners.first()).map(|p| self.px(*p)).collect();
        self.canvas.polyline(&points, pen);
    }

    fn surroundings(&mut self, scene: &Scene) {
        if let Some(table) = &scene.cell.table {
            self.closed(&table.outline_m, self.pen(TEXT, 2.0, FAINT));
        }
        let (low, high) = (scene.cell.workspace.min_m, scene.cell.workspace.max_m);
        let corners = [low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)];
        self.closed(&corners, self.pen(MUTED, 1.2, FAINT));
        for area in &scene.keep_out {
            let corners: Vec<Pixel> = area.points_m.iter().map(|p| self.px(*p)).collect();
            self.canvas.polygon(&corners, [200, 70, 70], 0.3);
            self.closed(&area.points_m, self.pen([230, 110, 110], 1.6, STRONG));
        }
        for wall in &scene.walls {
            let ends = [wall.from_m, wall.to_m].map(|p| self.px(p));
            self.canvas.polyline(&ends, self.pen(TEXT, 4.0, STRONG));
        }
    }

    fn outline(&mut self, shape: &Shape, pose: Pose, pen: Pen, fill: f64) {
        let outline = closed_outline(shape).into_iter().map(|p| pose.table_from_body(p));
        let points: Vec<Pixel> = outline.map(|p| self.px(p)).collect();
        if fill > 0.0 {
            self.canvas.polygon(&points, pen.colour, fill);
        }
        self.canvas.polyline(&points, pen);
    }

    /// The objects: faint where they may end, dim where they were, filled where they are.
    fn poses(&mut self, drawn: &Drawn, palette: &Palette) {
        let shape = |name: &str| drawn.scene.object(name).ok().map(|object| object.shape.clone());
        for (name, poses) in drawn.possible.into_iter().flatten() {
            let Some(shape) = shape(name) else { continue };
            for pose in poses.iter().take(MOST_POSSIBLE) {
                self.outline(&shape, *pose, self.pen(colour(palette, name), 1.0, 0.18), 0.0);
            }
        }
        for placed in &drawn.scene.placed {
            let Some(shape) = shape(&placed.object) else { continue };
            let colour = colour(palette, &placed.object);
            let moved = drawn.trajectory.map(|t| t.pose(&placed.object, drawn.time_s));
            if moved.is_some() || drawn.final_poses.is_some() {
                self.outline(&shape, placed.pose(), self.pen(colour, 1.4, FAINT), 0.0);
            }
            if let Some(trajectory) = drawn.trajectory {
                let points = path(trajectory, &placed.object, drawn.time_s);
                let points: Vec<Pixel> = points.into_iter().map(|p| self.px(p)).collect();
                self.canvas.polyline(&points, self.pen(colour, 2.0, FAINT));
            }
            let expected = drawn.final_poses.and_then(|poses| poses.get(&placed.object)).copied();
            let pose = moved.flatten().or(expected).unwrap_or(placed.pose());
            self.outline(&shape, pose, self.pen(colour, 2.4, STRONG), 0.35);
            if let Some(pose) = drawn.compared.and_then(|poses| poses.get(&placed.object)) {
                self.outline(&shape, *pose, self.pen(TEXT, 1.6, STRONG), 0.0);
            }
            self.name(&placed.object, pose.position);
        }
    }

    fn name(&mut self, name: &str, at: Point) {
        let height_px = 15.0 * self.unit_px;
        let center = self.px(at);
        let left = Pixel::new(center.x - text_width_px(name, height_px) / 2.0, center.y + height_px / 2.0);
        for (x, y) in [(-1.5, 0.0), (1.5, 0.0), (0.0, -1.5), (0.0, 1.5)] {
            let rim = Pixel::new(left.x + x * self.unit_px, left.y + y * self.unit_px);
            self.canvas.text(name, rim, Lettering { height_px, colour: BACKGROUND });
        }
        self.canvas.text(name, left, Lettering { height_px, colour: TEXT });
    }

    /// The striker where it is, and the arrow of its displacement.
    fn strike(&mut self, drawn: &Drawn, strike: &Strike) {
        let along = Vec2::from_heading(strike.heading_rad);
        let end = strike.start_m + along * strike.travel_m;
        let shape = &drawn.scene.cell.striker.shape;
        let at = |position| Pose { position, yaw_rad: strike.heading_rad };
        let pen = self.pen(TEXT, 1.6, STRONG);
        let faint = Pen { opacity: FAINT, ..pen };
        self.outline(shape, at(strike.start_m), faint, 0.0);
        let now = drawn.trajectory.and_then(|t| t.pose("striker", drawn.time_s));
        match now {
            Some(pose) => self.outline(shape, pose, pen, 0.4),
            None => self.outline(shape, at(strike.start_m), pen, 0.4),
        }
        let [from, to] = [strike.start_m, end].map(|p| self.px(p));
        self.canvas.polyline(&[from, to], pen);
        let along = Vec2::new(along.x, -along.y);
        let barb = |side: f64| {
            let back = along * (-ARROW_PX * self.unit_px)
                + along.perpendicular() * (side * 0.45 * ARROW_PX * self.unit_px);
            Pixel::new(to.x + back.x, to.y + back.y)
        };
        let head = [to, barb(1.0), barb(-1.0)];
        self.canvas.polygon(&head, TEXT, STRONG);
    }

    /// The largest round length that is not longer than a sixth of the drawing.
    fn scale_bar(&mut self) {
        let lengths_mm = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];
        let most_px = self.area.size[0] as f64 / 6.0;
        let fits = |mm: &f64| mm * self.px_per_m / 1e3 <= most_px;
        let length_mm = lengths_mm.into_iter().rfind(fits).unwrap_or(1.0);
        let (left, y) = (16.0 * self.unit_px, self.area.size[1] as f64 - 18.0 * self.unit_px);
        let end = left + length_mm * self.px_per_m / 1e3;
        let pen = self.pen(MUTED, 2.0, STRONG);
        self.canvas.polyline(&[Pixel::new(left, y), Pixel::new(end, y)], pen);
        let text = Pixel::new(end + 10.0 * self.unit_px, y + 6.0 * self.unit_px);
        let style = Lettering { height_px: 12.0 * self.unit_px, colour: MUTED };
        self.canvas.text(&format!("{length_mm} mm"), text, style);
    }
}
