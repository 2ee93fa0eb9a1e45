//! Quantities over time or over steps, one panel below the other (Fig. 6).

use super::WIDTH_PX;
use super::axis::{Axis, Scale};
use super::labels::{Labels, width_px};
use super::svg::{Anchor, Svg};

/// One curve.
pub(in crate::report) struct Series {
    /// Its name in the legend; series of the same name share one entry.
    pub name: String,
    /// The class that sets its colour.
    pub class: String,
    /// Where it runs; a value that is no number interrupts it.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub stroke: Stroke,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Stroke {
    /// A line.
    Line,
    /// A dot for every point.
    Dots,
    /// Dots joined by a line.
    Both,
}

/// A level that a curve should reach or stay below.
pub(in crate::report) struct Bound {
    /// The level.
    pub value: f64,
    /// What it is.
    pub label: String,
}

/// An instant that all panels share, such as an impact.
pub(in crate::report) struct Mark {
    /// When.
    pub x: f64,
    /// What happened.
    pub label: String,
}

/// One quantity.
pub(in crate::report) struct Panel {
    /// The quantity and its unit.
    pub label: String,
    /// Its curves.
    pub series: Vec<Series>,
    /// Its levels.
    pub bounds: Vec<Bound>,
    /// Its height (px).
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
/// Marks closer together than their labels are wide stack up to so many lines; what is left goes unlabelled.
const MARK_LINES: usize = 4;

/// The panels below each other, with one horizontal axis, a legend on top and the marks through all of them.
pub(in crate::report) fn lines(x_label: &str, panels: &[Panel], marks: &[Mark], label: &str) -> String {
    let legend = legend_rows(panels);
    let all = |index: usize| {
        panels.iter().flat_map(|p| &p.series).flat_map(move |s| &s.points).map(move |p| p[index])
    };
    let x_axis = Axis::new(&all(0).collect::<Vec<_>>(), [LEFT_PX, WIDTH_PX - RIGHT_PX], 8, Scale::Linear);
    let placed = placed_marks(marks, &x_axis);
    let mark_lines = placed.iter().map(|m| m.1 + 1).max().unwrap_or(0);
    let marks_top_px = legend.len() as f64 * LEGEND_LINE_PX + 4.0;
    let top_px = marks_top_px + mark_lines as f64 * MARK_LINE_PX + 6.0;
    let heights_px: f64 = panels.iter().map(|p| p.height_px + BETWEEN_PX).sum();
    let bottom_px = top_px + heights_px - BETWEEN_PX;
    let mut svg = Svg::new(WIDTH_PX, bottom_px + BELOW_PX);
    draw_legend(&mut svg, &legend);
    let mut panel_top_px = top_px;
    for panel in panels {
        draw_panel(&mut svg, panel, &x_axis, panel_top_px);
        panel_top_px += panel.height_px + BETWEEN_PX;
    }
    for (mark, line) in &placed {
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

/// Entries of the legend, as many a row as fit: where each starts (px), its name and class.
fn legend_rows(panels: &[Panel]) -> Vec<Vec<(f64, String, String)>> {
    let mut seen: Vec<&str> = Vec::new();
    let mut rows: Vec<Vec<(f64, String, String)>> = Vec::new();
    let mut x_px = f64::INFINITY;
    for series in panels.iter().flat_map(|p| &p.series) {
        if series.name.is_empty() || seen.contains(&series.name.as_str()) {
            continue;
        }
        seen.push(&series.name);
        let wide_px = 26.0 + width_px(&series.name) + 18.0;
        if x_px + wide_px > WIDTH_PX {
            rows.push(Vec::new());
            x_px = LEFT_PX;
        }
        if let Some(row) = rows.last_mut() {
            row.push((x_px, series.name.clone(), series.class.clone()));
        }
        x_px += wide_px;
    }
    rows
}

fn draw_legend(svg: &mut Svg, rows: &[Vec<(f64, String, String)>]) {
    for (k, row) in rows.iter().enumerate() {
        let y = (k as f64 + 0.6) * LEGEND_LINE_PX;
        for (x, name, class) in row {
            svg.line(&format!("curve {class}"), [*x, y - 4.0], [x + 18.0, y - 4.0]);
            svg.text("label", [x + 24.0, y], Anchor::Start, name);
        }
    }
}

/// Each mark with the line that its label stands on.
fn placed_marks<'a>(marks: &'a [Mark], x_axis: &Axis) -> Vec<(&'a Mark, usize)> {
    let mut labels = Labels::default();
    let inside = |m: &&Mark| m.x.is_finite() && (LEFT_PX..=WIDTH_PX - RIGHT_PX).contains(&x_axis.px(m.x));
    let mut placed = Vec::new();
    for mark in marks.iter().filter(inside) {
        let x = x_axis.px(mark.x) + 4.0 + width_px(&mark.label) / 2.0;
        let centres: Vec<_> = (0..MARK_LINES).map(|line| [x, line as f64 * MARK_LINE_PX]).collect();
        if let Some([_, y]) = labels.place(&mark.label, &centres) {
            placed.push((mark, (y / MARK_LINE_PX).round() as usize));
        }
    }
    placed
}
