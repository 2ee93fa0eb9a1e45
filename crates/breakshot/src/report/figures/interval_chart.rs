//! A chart of estimates with their 95 % intervals, one row each, and the values of the single clips as small dots
//! (Figs. 7 to 9).

use super::axis::{Axis, Scale};
use super::labels::width_px;
use super::svg::{Anchor, Svg, WIDTH_PX};
use crate::uncertain::Estimate;

/// One estimate with the measurements behind it.
pub(in crate::report) struct IntervalRow {
    /// The object or the pair.
    pub name: String,
    /// The class that sets its colour.
    pub class: String,
    /// The estimate.
    pub estimate: Estimate,
    /// The values of the single clips.
    pub clips: Vec<ClipDot>,
    /// A value from another measurement, such as weighing.
    pub known: Option<f64>,
}

/// The value of one clip.
pub(in crate::report) struct ClipDot {
    /// The name of the clip.
    pub clip: String,
    /// The value.
    pub value: f64,
}

/// The axis and the legend of the chart.
pub(in crate::report) struct IntervalChart<'a> {
    /// The quantity and its unit.
    pub label: &'a str,
    /// The scale of the axis.
    pub scale: Scale,
    /// The text for the known values in the legend, such as `weighed`.
    pub known: &'a str,
    /// Whether the standard deviation between clips is drawn too.
    pub spread: bool,
}

const ROW_PX: f64 = 26.0;
const TOP_PX: f64 = 26.0;
const BELOW_PX: f64 = 42.0;
const VALUE_PX: f64 = 158.0;
/// The height of the bar that shows the standard deviation (px).
const SPREAD_PX: f64 = 12.0;

/// One row for each estimate: interval, mean, the values of the clips, and the numbers at the right.
pub(in crate::report) fn interval_chart(rows: &[IntervalRow], chart: &IntervalChart, label: &str) -> String {
    let names_px = rows.iter().map(|row| width_px(&row.name)).fold(24.0, f64::max);
    let (left_px, right_px) = (names_px + 14.0, WIDTH_PX - VALUE_PX);
    let bottom_px = TOP_PX + rows.len() as f64 * ROW_PX;
    let axis = Axis::new(&extent(rows), [left_px + 8.0, right_px - 8.0], 6, chart.scale);
    let mut svg = Svg::new(WIDTH_PX, bottom_px + BELOW_PX);
    draw_legend(&mut svg, rows, chart, left_px);
    svg.text("small", [WIDTH_PX - 4.0, 14.0], Anchor::End, "mean \u{b1} 95 % (clips)");
    for &tick in &axis.ticks {
        let x = axis.px(tick);
        svg.line("grid", [x, TOP_PX], [x, bottom_px]);
        svg.text("tick", [x, bottom_px + 16.0], Anchor::Middle, &axis.tick_text(tick));
    }
    svg.text("label", [f64::midpoint(left_px, right_px), bottom_px + 35.0], Anchor::Middle, chart.label);
    for (k, row) in rows.iter().enumerate() {
        let y = TOP_PX + (k as f64 + 0.5) * ROW_PX;
        svg.text("label", [left_px - 6.0, y + 4.0], Anchor::End, &row.name);
        draw_row(&mut svg, row, chart, y, |value| axis.px(value).clamp(left_px, right_px));
        svg.text("number", [WIDTH_PX - 4.0, y + 4.0], Anchor::End, &numbers(&row.estimate));
    }
    svg.finish(label)
}

fn draw_row(svg: &mut Svg, row: &IntervalRow, chart: &IntervalChart, y: f64, px: impl Fn(f64) -> f64) {
    let class = &row.class;
    // The dots of repeats are drawn in several lanes so that they do not overlap.
    let lanes = [0.0, -4.5, 4.5, -9.0, 9.0];
    for (k, ClipDot { clip, value }) in row.clips.iter().enumerate() {
        let hint = format!("{clip}: {value:.4}");
        svg.circle(&format!("clip {class}"), [px(*value), y + lanes[k % lanes.len()]], 2.2, &hint);
    }
    if let Some(std) = row.estimate.std.filter(|std| chart.spread && *std > 0.0) {
        let [low, high] = [row.estimate.mean - std, row.estimate.mean + std];
        let low = if chart.scale == Scale::Logarithmic { low.max(f64::MIN_POSITIVE) } else { low };
        let (from, to) = (px(low), px(high));
        svg.rect(&format!("spread {class}"), [from, y - SPREAD_PX / 2.0], [to - from, SPREAD_PX]);
    }
    let [low, high] = row.estimate.interval_95;
    if low.is_finite() && high.is_finite() && high > low {
        let low = if chart.scale == Scale::Logarithmic { low.max(f64::MIN_POSITIVE) } else { low };
        svg.line(&format!("interval {class}"), [px(low), y], [px(high), y]);
    }
    svg.circle(&format!("mean {class}"), [px(row.estimate.mean), y], 4.5, &numbers(&row.estimate));
    if let Some(known) = row.known {
        let x = px(known);
        svg.line("known", [x, y - 9.0], [x, y + 9.0]);
    }
}

fn draw_legend(svg: &mut Svg, rows: &[IntervalRow], chart: &IntervalChart, left_px: f64) {
    let mut x = left_px + 8.0;
    let mut entry = |svg: &mut Svg, text: &str, draw: &dyn Fn(&mut Svg, f64)| {
        draw(svg, x);
        svg.text("small", [x + 22.0, 14.0], Anchor::Start, text);
        x += 22.0 + width_px(text) + 16.0;
    };
    entry(svg, "mean and 95 % interval", &|svg, x| {
        svg.line("interval grey", [x, 10.0], [x + 16.0, 10.0]);
        svg.circle("mean grey", [x + 8.0, 10.0], 4.5, "");
    });
    if chart.spread && rows.iter().any(|row| row.estimate.std.is_some_and(|std| std > 0.0)) {
        entry(svg, "\u{b1} standard deviation", &|svg, x| {
            svg.rect("spread grey", [x, 10.0 - SPREAD_PX / 2.0], [16.0, SPREAD_PX]);
        });
    }
    if rows.iter().any(|row| !row.clips.is_empty()) {
        entry(svg, "single clips", &|svg, x| svg.circle("clip grey", [x + 8.0, 10.0], 2.2, ""));
    }
    if rows.iter().any(|row| row.known.is_some()) {
        entry(svg, chart.known, &|svg, x| svg.line("known", [x + 8.0, 2.0], [x + 8.0, 18.0]));
    }
}

/// All values that the axis has to cover; an interval far wider than the range of the values is cut off.
fn extent(rows: &[IntervalRow]) -> Vec<f64> {
    let values: Vec<f64> = rows
        .iter()
        .flat_map(|row| row.clips.iter().map(|dot| dot.value).chain([row.estimate.mean]).chain(row.known))
        .filter(|v| v.is_finite())
        .collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let margin = MOST_MARGIN * (high - low);
    let mut extent = values;
    for row in rows {
        let [from, to] = row.estimate.interval_95;
        extent.extend([from.max(low - margin), to.min(high + margin)].into_iter().filter(|v| v.is_finite()));
    }
    extent
}

/// The axis extends beyond the range of the values by at most this fraction of it on either side: the 95 % interval from
/// two clips is 13 standard errors long on either side and would compress all others.
const MOST_MARGIN: f64 = 0.35;

/// The mean, half the interval with two significant digits, and the number of clips if known.
fn numbers(estimate: &Estimate) -> String {
    let half = (estimate.interval_95[1] - estimate.interval_95[0]) / 2.0;
    if estimate.n == 0 && half == 0.0 {
        return format!("{} (unit)", estimate.mean);
    }
    let clips = if estimate.n > 0 { format!(" ({})", estimate.n) } else { String::new() };
    if !half.is_finite() {
        return format!("{:.3}{clips}", estimate.mean);
    }
    let decimals = (1.0 - half.max(1e-9).log10().floor()).clamp(1.0, 5.0) as usize;
    let mean = format!("{:.decimals$}", estimate.mean).replace('-', "\u{2212}");
    format!("{mean} \u{b1} {half:.decimals$}{clips}")
}
