//! Line charts with a common horizontal axis, one panel below the other (Fig. 6).

use super::axis::{Axis, Scale};
use super::labels::{Labels, width_px};
use super::svg::{Anchor, Svg, WIDTH_PX};

/// One curve.
pub(in crate::report) struct Series {
    /// The name in the legend; series of the same name share one entry.
    pub name: String,
    /// The class that sets its colour.
    pub class: String,
    /// The points (x, y); a value that is not finite interrupts the curve.
    pub points: Vec<[f64; 2]>,
    /// How the points are drawn.
    pub stroke: Stroke,
}

/// How the points of a curve are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Stroke {
    /// As a line.
    Line,
    /// As dots.
    Dots,
    /// As dots connected by a line.
    Both,
}

/// A horizontal line: a bound for the values.
pub(in crate::report) struct Bound {
    /// The bound, in the unit of the panel.
    pub value: f64,
    /// The text at the line.
    pub label: String,
}

/// A vertical line through all panels, such as the time of an impact.
pub(in crate::report) struct Mark {
    /// The position on the horizontal axis.
    pub x: f64,
    /// The text at the line.
    pub label: String,
}

/// The chart of one quantity.
pub(in crate::report) struct Panel {
    /// The quantity and its unit.
    pub label: String,
    /// The curves.
    pub series: Vec<Series>,
    /// The bounds.
    pub bounds: Vec<Bound>,
    /// The height (px).
    pub height_px: f64,
}

/// The height of a panel that shows detail (px).
pub(in crate::report) const PANEL_PX: f64 = 150.0;
/// The height of a panel that shows a trend (px).
pub(in crate::report) const LOW_PANEL_PX: f64 = 92.0;
const BETWEEN_PX: f64 = 16.0;
const LEFT_PX: f64 = 62.0;
const RIGHT_PX: f64 = 14.0;
const BELOW_PX: f64 = 40.0;
const LEGEND_LINE_PX: f64 = 20.0;
const MARK_LINE_PX: f64 = 15.0;
/// The radius of a dot (px).
const DOT_PX: f64 = 2.2;
/// The labels of close marks are stacked in at most this many lines; further marks are not drawn.
const MARK_LINES: usize = 4;

/// The panels below each other, with one horizontal axis, a legend at the top and the marks through all panels.
pub(in crate::report) fn line_chart(x_label: &str, panels: &[Panel], marks: &[Mark], label: &str) -> String {
    // Layout from top to bottom: legend, labels of the marks, panels, axis.
    let legend = legend_rows(panels);
    let all = |index: usize| {
        panels.iter().flat_map(|p| &p.series).flat_map(move |s| &s.points).map(move |p| p[index])
    };
    let x_axis = Axis::new(&all(0).collect::<Vec<_>>(), [LEFT_PX, WIDTH_PX - RIGHT_PX], 8, Scale::Linear);
    let placed = placed_marks(marks, &x_axis);
    let mark_lines = placed.iter().map(|placed| placed.line + 1).max().unwrap_or(0);
    let marks_top_px = legend.len() as f64 * LEGEND_LINE_PX + 4.0;
    let top_px = marks_top_px + mark_lines as f64 * MARK_LINE_PX + 6.0;
    let heights_px: f64 = panels.iter().map(|p| p.height_px + BETWEEN_PX).sum();
    let bottom_px = top_px + heights_px - BETWEEN_PX;

    // Drawing.
    let mut svg = Svg::new(WIDTH_PX, bottom_px + BELOW_PX);
    draw_legend(&mut svg, &legend);
    let mut panel_top_px = top_px;
    for panel in panels {
        draw_panel(&mut svg, panel, &x_axis, panel_top_px);
        panel_top_px += panel.height_px + BETWEEN_PX;
    }
    for PlacedMark { mark, line } in &placed {
        let x = x_axis.px(mark.x);
        let text_px = marks_top_px + (*line as f64 + 0.7) * MARK_LINE_PX;
        svg.line("mark", [x, text_px + 4.0], [x, bottom_px]);
        svg.text("small", [x + 4.0, text_px], Anchor::Start, &mark.label);
    }
    for &tick in &x_axis.ticks {
        svg.text("tick", [x_axis.px(tick), bottom_px + 16.0], Anchor::Middle, &x_axis.tick_text(tick));
    }
    let middle_px = f64::midpoint(LEFT_PX, WIDTH_PX - RIGHT_PX);
    svg.text("label", [middle_px, bottom_px + 34.0], Anchor::Middle, x_label);
    svg.finish(label)
}

fn draw_panel(svg: &mut Svg, panel: &Panel, x_axis: &Axis, top_px: f64) {
    let mut values: Vec<f64> = panel.series.iter().flat_map(|s| &s.points).map(|p| p[1]).collect();
    values.extend(panel.bounds.iter().map(|b| b.value));
    let panel_bottom_px = top_px + panel.height_px;
    let count = if panel.height_px < PANEL_PX { 3 } else { 4 };
    let y_axis = Axis::new(&values, [panel_bottom_px, top_px], count, Scale::Linear);
    let right_px = WIDTH_PX - RIGHT_PX;
    for &tick in &x_axis.ticks {
        let x = x_axis.px(tick);
        svg.line("grid", [x, top_px], [x, panel_bottom_px]);
    }
    for &tick in &y_axis.ticks {
        let y = y_axis.px(tick);
        svg.line(if tick == 0.0 { "zero" } else { "grid" }, [LEFT_PX, y], [right_px, y]);
        svg.text("tick", [LEFT_PX - 6.0, y + 4.0], Anchor::End, &y_axis.tick_text(tick));
    }
    svg.text_upwards("label", [14.0, top_px + panel.height_px / 2.0], &panel.label);
    for bound in &panel.bounds {
        let y = y_axis.px(bound.value);
        svg.line("bound", [LEFT_PX, y], [right_px, y]);
        svg.text("small halo", [right_px - 4.0, y - 4.0], Anchor::End, &bound.label);
    }
    for series in &panel.series {
        let px = |p: &[f64; 2]| [x_axis.px(p[0]), y_axis.px(p[1])];
        for run in series.points.split(|p| !(p[0].is_finite() && p[1].is_finite())) {
            let run: Vec<_> = run.iter().map(px).collect();
            if series.stroke != Stroke::Dots && run.len() > 1 {
                svg.path(&format!("curve {}", series.class), &run, false);
            }
            if series.stroke != Stroke::Line || run.len() == 1 {
                for &point in &run {
                    svg.circle(&format!("dot {}", series.class), point, DOT_PX, "");
                }
            }
        }
    }
}

/// One series in the legend.
struct LegendEntry<'a> {
    left_px: f64,
    name: &'a str,
    class: &'a str,
}

/// The entries of the legend in rows, as many in each row as fit.
fn legend_rows(panels: &[Panel]) -> Vec<Vec<LegendEntry<'_>>> {
    let mut listed: Vec<&str> = Vec::new();
    let mut rows: Vec<Vec<LegendEntry>> = Vec::new();
    let mut x_px = f64::INFINITY;
    for series in panels.iter().flat_map(|p| &p.series) {
        if series.name.is_empty() || listed.contains(&series.name.as_str()) {
            continue;
        }
        listed.push(&series.name);
        let wide_px = 26.0 + width_px(&series.name) + 18.0;
        if x_px + wide_px > WIDTH_PX {
            rows.push(Vec::new());
            x_px = LEFT_PX;
        }
        if let Some(row) = rows.last_mut() {
            row.push(LegendEntry { left_px: x_px, name: &series.name, class: &series.class });
        }
        x_px += wide_px;
    }
    rows
}

fn draw_legend(svg: &mut Svg, rows: &[Vec<LegendEntry>]) {
    for (k, row) in rows.iter().enumerate() {
        let y = (k as f64 + 0.6) * LEGEND_LINE_PX;
        for LegendEntry { left_px, name, class } in row {
            svg.line(&format!("curve {class}"), [*left_px, y - 4.0], [left_px + 18.0, y - 4.0]);
            svg.text("label", [left_px + 24.0, y], Anchor::Start, name);
        }
    }
}

/// A mark and the line of its label, counted from the top.
struct PlacedMark<'a> {
    mark: &'a Mark,
    line: usize,
}

/// The marks inside the axis whose labels fit without overlap.
fn placed_marks<'a>(marks: &'a [Mark], x_axis: &Axis) -> Vec<PlacedMark<'a>> {
    let mut labels = Labels::default();
    let inside = |m: &&Mark| m.x.is_finite() && (LEFT_PX..=WIDTH_PX - RIGHT_PX).contains(&x_axis.px(m.x));
    let mut placed = Vec::new();
    for mark in marks.iter().filter(inside) {
        let x = x_axis.px(mark.x) + 4.0 + width_px(&mark.label) / 2.0;
        let centres: Vec<_> = (0..MARK_LINES).map(|line| [x, line as f64 * MARK_LINE_PX]).collect();
        if let Some([_, y]) = labels.place(&mark.label, &centres) {
            placed.push(PlacedMark { mark, line: (y / MARK_LINE_PX).round() as usize });
        }
    }
    placed
}
