//! A drawing of the table from above, to scale: objects, paths of their centres, striker, walls and keep-out areas.

use super::labels::{Labels, width_px};
use super::svg::{Anchor, Svg};
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::scene::{Scene, Strike};

/// Which pose of an object is drawn, and in which style.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Layer {
    /// The pose before the strike: a pale outline.
    Before,
    /// The pose that the drawing is about: filled.
    Current,
    /// The expected pose: a dashed outline.
    Expected,
    /// One of the possible final poses: a faint outline.
    Possible,
}

impl Layer {
    fn class(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::Current => "current",
            Self::Expected => "expected",
            Self::Possible => "possible",
        }
    }
}

/// One object in the drawing.
pub(in crate::report) struct DrawnObject<'a> {
    /// The name of the object.
    pub name: &'a str,
    /// The class that sets its colour.
    pub class: String,
    /// The outline.
    pub shape: &'a Shape,
    /// The pose.
    pub pose: Pose,
    /// The style.
    pub layer: Layer,
}

/// The contents of the drawing.
pub(in crate::report) struct TopView<'a> {
    /// The scene with table, workspace, walls, keep-out areas and striker.
    pub scene: &'a Scene,
    /// The objects, drawn in this order.
    pub objects: Vec<DrawnObject<'a>>,
    /// The paths of the centres.
    pub paths: Vec<CentrePath>,
    /// The strike.
    pub strike: Option<&'a Strike>,
    /// Evaluated strikes, drawn in this order.
    pub approaches: Vec<Approach>,
}

/// An evaluated strike: the last part of the striker's path to the first contact.
pub(in crate::report) struct Approach {
    /// The striker's centre at the first contact.
    pub contact: Point,
    /// The direction of the strike (rad).
    pub heading_rad: f64,
    /// The success probability, which sets the colour.
    pub success_probability: f64,
}

impl Approach {
    /// The length that is drawn (m).
    const LENGTH_M: f64 = 0.025;
    /// Classes of the colours, for equal intervals of the success probability.
    const CLASSES: [&str; 5] = ["p0", "p1", "p2", "p3", "p4"];

    fn start(&self) -> Point {
        self.contact - Vec2::from_heading(self.heading_rad) * Self::LENGTH_M
    }

    fn class(&self) -> String {
        let count = Self::CLASSES.len();
        let index = (self.success_probability.clamp(0.0, 1.0) * count as f64) as usize;
        format!("approach {}", Self::CLASSES[index.min(count - 1)])
    }
}

/// The path of an object's centre.
pub(in crate::report) struct CentrePath {
    /// The class that sets its colour.
    pub class: String,
    /// The points of the path.
    pub points: Vec<Point>,
}

/// The part of the table that is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct Viewport {
    min: Point,
    max: Point,
}

/// Margin around the contents (m).
const MARGIN_M: f64 = 0.02;
/// Least ratio of the width of a drawing to its height.
const LEAST_WIDTH_TO_HEIGHT: f64 = 1.2;
/// Least width of the viewport (m): objects of a few centimetres need no larger scale.
const LEAST_WIDTH_M: f64 = 0.3;

impl Viewport {
    const EMPTY: Self = Self {
        min: Point::new(f64::INFINITY, f64::INFINITY),
        max: Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The area that contains all contents of these drawings, and the whole workspace if it is at most
    /// `workspace_factor` times as wide as they are.
    pub(in crate::report) fn of(drawings: &[&TopView], workspace_factor: f64) -> Self {
        let mut view = Self::EMPTY;
        for drawing in drawings {
            view.extend_to_objects(&drawing.objects);
            for point in drawing.paths.iter().flat_map(|path| &path.points) {
                view.extend_to(*point, 0.0);
            }
            for approach in &drawing.approaches {
                view.extend_to(approach.start(), 0.0);
            }
            if let Some(strike) = drawing.strike {
                let radius_m = drawing.scene.cell.striker.shape.outer_radius_m();
                view.extend_to(strike.start_m, radius_m);
                view.extend_to(end_of(strike), radius_m);
            }
        }
        if let Some(drawing) = drawings.first() {
            let workspace = drawing.scene.cell.workspace;
            let (width_m, whole_m) = (view.max.x - view.min.x, workspace.max_m.x - workspace.min_m.x);
            if width_m < 0.0 || whole_m <= workspace_factor * width_m {
                view.extend_to(workspace.min_m, 0.0);
                view.extend_to(workspace.max_m, 0.0);
            }
        }
        view.with_margin()
    }

    /// The left and the upper end (m).
    pub(in crate::report) fn top_left_m(self) -> [f64; 2] {
        [self.min.x, self.max.y]
    }

    /// The scale of a drawing of this width (px/m).
    pub(in crate::report) fn px_per_m(self, width_px: f64) -> f64 {
        width_px / (self.max.x - self.min.x)
    }

    /// The area that contains the objects only.
    pub(in crate::report) fn of_objects(drawing: &TopView) -> Self {
        let mut view = Self::EMPTY;
        view.extend_to_objects(&drawing.objects);
        view.with_margin()
    }

    fn extend_to_objects(&mut self, objects: &[DrawnObject]) {
        for object in objects {
            self.extend_to(object.pose.position, object.shape.outer_radius_m());
        }
    }

    fn extend_to(&mut self, point: Point, radius_m: f64) {
        if point.is_finite() {
            self.min = Point::new(self.min.x.min(point.x - radius_m), self.min.y.min(point.y - radius_m));
            self.max = Point::new(self.max.x.max(point.x + radius_m), self.max.y.max(point.y + radius_m));
        }
    }

    fn with_margin(mut self) -> Self {
        if self.min.x > self.max.x {
            (self.min, self.max) = (Point::ORIGIN, Point::ORIGIN);
        }
        let margin = Vec2::new(MARGIN_M, MARGIN_M);
        self.min = self.min - margin;
        self.max += margin;
        let size = self.max - self.min;
        let missing = (LEAST_WIDTH_TO_HEIGHT * size.y).max(LEAST_WIDTH_M).max(size.x) - size.x;
        self.min = self.min - Vec2::new(missing / 2.0, 0.0);
        self.max += Vec2::new(missing / 2.0, 0.0);
        self
    }
}

fn end_of(strike: &Strike) -> Point {
    strike.start_m + Vec2::from_heading(strike.heading_rad) * strike.travel_m
}

/// Height of the strip below the table for the scale bar (px).
const FOOT_PX: f64 = 26.0;

/// A drawing under construction, with the transformation from the table (m) to the SVG (px).
struct Canvas {
    svg: Svg,
    labels: Labels,
    view: Viewport,
    px_per_m: f64,
}

impl Canvas {
    fn px(&self, point: Point) -> [f64; 2] {
        [(point.x - self.view.min.x) * self.px_per_m, (self.view.max.y - point.y) * self.px_per_m]
    }

    fn outline(&mut self, class: &str, shape: &Shape, pose: Pose, hint: &str) {
        if let Shape::Disc { radius_m } = shape {
            let center = self.px(pose.position);
            self.svg.circle(class, center, radius_m * self.px_per_m, hint);
        } else {
            let corners: Vec<_> =
                shape.corners().into_iter().map(|c| self.px(pose.table_from_body(c))).collect();
            self.svg.path(class, &corners, true);
        }
    }

    fn polygon(&mut self, class: &str, points: &[Point], closed: bool) {
        let points: Vec<_> = points.iter().map(|&p| self.px(p)).collect();
        self.svg.path(class, &points, closed);
    }
}

/// The table from above as an SVG of this width.
pub(in crate::report) fn top_view(drawing: &TopView, view: Viewport, width_px: f64, label: &str) -> String {
    let px_per_m = view.px_per_m(width_px);
    let height_px = (view.max.y - view.min.y) * px_per_m;
    let svg = Svg::new(width_px, height_px + FOOT_PX);
    let mut canvas = Canvas { svg, labels: Labels::default(), view, px_per_m };
    canvas.labels.keep_free([f64::NEG_INFINITY, height_px, f64::INFINITY, f64::INFINITY]);
    canvas.svg.begin_window(width_px, height_px);
    draw_table(&mut canvas, drawing.scene);
    for object in &drawing.objects {
        let hint = format!(
            "{} at ({:.1}, {:.1}) mm",
            object.name,
            object.pose.position.x * 1e3,
            object.pose.position.y * 1e3
        );
        let class = format!("{} {}", object.layer.class(), object.class);
        canvas.outline(&class, object.shape, object.pose, &hint);
    }
    for CentrePath { class, points } in &drawing.paths {
        canvas.polygon(&format!("path {class}"), points, false);
    }
    for approach in &drawing.approaches {
        let (from, to) = (canvas.px(approach.start()), canvas.px(approach.contact));
        canvas.svg.line(&approach.class(), from, to);
    }
    if let Some(strike) = drawing.strike {
        draw_strike(&mut canvas, drawing.scene, strike);
    }
    draw_names(&mut canvas, &drawing.objects);
    canvas.svg.end_window();
    draw_scale_bar(&mut canvas, height_px);
    if !drawing.approaches.is_empty() {
        draw_probabilities(&mut canvas, [width_px, height_px]);
    }
    canvas.svg.finish(label)
}

fn draw_table(canvas: &mut Canvas, scene: &Scene) {
    if let Some(table) = &scene.cell.table {
        canvas.polygon("table", &table.outline_m, true);
    }
    let workspace = scene.cell.workspace;
    let (low, high) = (workspace.min_m, workspace.max_m);
    let corners = [low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)];
    canvas.polygon("workspace", &corners, true);
    let [x, y] = canvas.px(Point::new(low.x, high.y));
    let text = "workspace";
    let center = [x + 6.0 + width_px(text) / 2.0, y + 12.0];
    if x >= 0.0
        && y >= 0.0
        && let Some([x, y]) = canvas.labels.place(text, &[center])
    {
        canvas.svg.text("small muted", [x, y + 3.0], Anchor::Middle, text);
    }
    for area in &scene.keep_out {
        canvas.polygon("keep-out", &area.points_m, true);
        let middle =
            area.points_m.iter().fold(Vec2::ZERO, |sum, p| sum + p.to_vec()) / area.points_m.len() as f64;
        let center = canvas.px(Point::ORIGIN + middle);
        if let Some([x, y]) = canvas.labels.place("keep out", &[center]) {
            canvas.svg.text("small", [x, y + 4.0], Anchor::Middle, "keep out");
        }
    }
    for wall in &scene.walls {
        canvas.polygon("wall", &[wall.from_m, wall.to_m], false);
    }
}

/// The striker at its start and at its end, and an arrow from one to the other.
fn draw_strike(canvas: &mut Canvas, scene: &Scene, strike: &Strike) {
    let shape = &scene.cell.striker.shape;
    let at = |position| Pose { position, yaw_rad: strike.heading_rad };
    canvas.outline("striker-end", shape, at(end_of(strike)), "");
    canvas.outline("striker", shape, at(strike.start_m), "striker at its start");
    let (from, to) = (canvas.px(strike.start_m), canvas.px(end_of(strike)));
    canvas.svg.line("strike", from, to);
    let along = Vec2::new(to[0] - from[0], to[1] - from[1]).direction().unwrap_or(Vec2::ZERO);
    let tip = Vec2::new(to[0], to[1]);
    let wing = |side: f64| tip - along * ARROW_PX + along.perpendicular() * (side * 0.45 * ARROW_PX);
    let head = [tip, wing(1.0), wing(-1.0)].map(|v| [v.x, v.y]);
    canvas.svg.path("strike-head", &head, true);
    let radius_px = shape.outer_radius_m() * canvas.px_per_m;
    let middle = [f64::midpoint(from[0], to[0]), f64::midpoint(from[1], to[1])];
    for ([x, y], half) in [(from, radius_px), (middle, 6.0), (to, 6.0)] {
        canvas.labels.keep_free([x - half, y - half, x + half, y + half]);
    }
    let text = format!("{:.2} m/s", strike.speed_m_s);
    let reach_px = radius_px + 10.0;
    let half_px = width_px(&text) / 2.0 + 4.0;
    let [x, y] = from;
    let centres = [
        [x - along.x * reach_px * 1.4, y - along.y * reach_px * 1.4],
        [x, y + reach_px],
        [x, y - reach_px],
        [x - reach_px - half_px, y],
        [x + reach_px + half_px, y],
    ];
    let inside = |c: &[f64; 2]| {
        c[0] > half_px
            && c[1] > 8.0
            && c[0] + half_px < (canvas.view.max.x - canvas.view.min.x) * canvas.px_per_m
    };
    let centres: Vec<_> = centres.into_iter().filter(inside).collect();
    if let Some([x, y]) = canvas.labels.place(&text, &centres) {
        canvas.svg.text("label halo", [x, y + 4.0], Anchor::Middle, &text);
    }
}

/// The length of the arrow head (px).
const ARROW_PX: f64 = 11.0;

/// The names of the objects, at most once in each layer and only where they overlap no other label; the current poses
/// come first.
fn draw_names(canvas: &mut Canvas, objects: &[DrawnObject]) {
    for layer in [Layer::Current, Layer::Expected, Layer::Before] {
        for object in objects.iter().filter(|object| object.layer == layer) {
            let named = objects.iter().any(|o| o.layer == Layer::Current && o.name == object.name);
            if layer == Layer::Expected && named {
                continue;
            }
            let [x, y] = canvas.px(object.pose.position);
            let beside = object.shape.outer_radius_m() * canvas.px_per_m + 8.0;
            let half = width_px(object.name) / 2.0;
            let fits = 2.0 * half <= 2.0 * (beside - 8.0);
            let around = [[x, y - beside], [x, y + beside], [x + beside + half, y], [x - beside - half, y]];
            let centres: Vec<_> = fits.then_some([x, y]).into_iter().chain(around).collect();
            // A pose before the strike is named only if its centre is free; others have room beside them too.
            let centres = if layer == Layer::Before { &centres[..1] } else { &centres[..] };
            if let Some([x, y]) = canvas.labels.place(object.name, centres) {
                let class = if layer == Layer::Before { "name muted" } else { "name halo" };
                canvas.svg.text(class, [x, y + 4.5], Anchor::Middle, object.name);
            }
        }
    }
}

fn draw_scale_bar(canvas: &mut Canvas, height_px: f64) {
    let lengths_mm = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0];
    let px_per_mm = canvas.px_per_m / 1e3;
    let length_mm = lengths_mm.into_iter().rfind(|l| l * px_per_mm <= SCALE_BAR_PX).unwrap_or(1.0);
    let (y, end) = (height_px + 14.0, 2.0 + length_mm * px_per_mm);
    canvas.svg.line("scale", [2.0, y], [end, y]);
    canvas.svg.line("scale", [2.0, y - 4.0], [2.0, y + 4.0]);
    canvas.svg.line("scale", [end, y - 4.0], [end, y + 4.0]);
    canvas.svg.text("small", [end + 6.0, y + 4.0], Anchor::Start, &format!("{length_mm} mm"));
}

/// The key of the colours of evaluated strikes, right-aligned below the table.
fn draw_probabilities(canvas: &mut Canvas, [width_px, height_px]: [f64; 2]) {
    /// Distance from one colour to the next, and length of its line (px).
    const STEP_PX: f64 = 74.0;
    const LINE_PX: f64 = 16.0;
    let y = height_px + 14.0;
    let count = Approach::CLASSES.len();
    let left = width_px - STEP_PX * count as f64;
    canvas.svg.text("small", [left - 8.0, y + 4.0], Anchor::End, "success probability");
    for (k, class) in Approach::CLASSES.iter().enumerate() {
        let x = left + STEP_PX * k as f64;
        canvas.svg.line(&format!("approach {class}"), [x, y], [x + LINE_PX, y]);
        let text = format!("{} to {} %", 100 * k / count, 100 * (k + 1) / count);
        canvas.svg.text("small", [x + LINE_PX + 5.0, y + 4.0], Anchor::Start, &text);
    }
}

/// The scale bar has the largest round length that is not longer than this (px).
const SCALE_BAR_PX: f64 = 160.0;
