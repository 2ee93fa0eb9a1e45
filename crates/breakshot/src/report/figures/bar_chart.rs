//! A bar chart of pairwise distances, filmed and simulated (Fig. 17).

use super::axis::{Axis, Scale};
use super::labels::width_px;
use super::svg::{Anchor, Svg, WIDTH_PX};

/// The filmed and the simulated distance of one pair.
pub(in crate::report) struct BarPair {
    /// The names of the two objects.
    pub name: String,
    /// The filmed value.
    pub filmed: f64,
    /// The simulated value.
    pub simulated: f64,
}

const ROW_PX: f64 = 36.0;
const BAR_PX: f64 = 12.0;
const TOP_PX: f64 = 28.0;
const BELOW_PX: f64 = 42.0;
const DIFFERENCE_PX: f64 = 96.0;
const VALUE_PX: f64 = 48.0;

/// A lower bound that the values should reach.
pub(in crate::report) struct LowerBound {
    /// The bound, in the unit of the bars.
    pub value: f64,
    /// Its text in the legend.
    pub label: String,
}

/// One row for each pair: two bars with their values, the difference at the right, and a line at the lower bound.
pub(in crate::report) fn bar_chart(
    rows: &[BarPair],
    x_label: &str,
    bound: Option<&LowerBound>,
    label: &str,
) -> String {
    let names_px = rows.iter().map(|row| width_px(&row.name)).fold(24.0, f64::max);
    let (left_px, right_px) = (names_px + 14.0, WIDTH_PX - DIFFERENCE_PX);
    let bottom_px = TOP_PX + rows.len() as f64 * ROW_PX;
    let mut values: Vec<f64> = rows.iter().flat_map(|row| [row.filmed, row.simulated]).collect();
    values.extend([0.0]);
    values.extend(bound.map(|b| b.value));
    let axis = Axis::new(&values, [left_px, right_px - VALUE_PX], 6, Scale::Linear);
    let mut svg = Svg::new(WIDTH_PX, bottom_px + BELOW_PX);
    draw_legend(&mut svg, left_px, bound.map(|b| b.label.as_str()));
    svg.text("small", [WIDTH_PX - 4.0, 14.0], Anchor::End, "difference");
    for &tick in &axis.ticks {
        let x = axis.px(tick);
        svg.line(if tick == 0.0 { "zero" } else { "grid" }, [x, TOP_PX], [x, bottom_px]);
        svg.text("tick", [x, bottom_px + 16.0], Anchor::Middle, &axis.tick_text(tick));
    }
    svg.text("label", [f64::midpoint(left_px, right_px), bottom_px + 35.0], Anchor::Middle, x_label);
    if let Some(bound) = bound {
        let x = axis.px(bound.value);
        svg.line("bound", [x, TOP_PX - 4.0], [x, bottom_px]);
    }
    for (k, row) in rows.iter().enumerate() {
        let y = TOP_PX + (k as f64 + 0.5) * ROW_PX;
        svg.text("label", [left_px - 8.0, y + 4.0], Anchor::End, &row.name);
        for (class, value, top) in
            [("real", row.filmed, y - BAR_PX - 0.5), ("virtual", row.simulated, y + 0.5)]
        {
            let end = axis.px(value);
            svg.rect(class, [left_px, top], [end - left_px, BAR_PX]);
            svg.text("number small halo", [end + 4.0, top + 10.0], Anchor::Start, &format!("{value:.1}"));
        }
        svg.text("number", [WIDTH_PX - 4.0, y + 4.0], Anchor::End, &difference(row.simulated - row.filmed));
    }
    svg.finish(label)
}

fn draw_legend(svg: &mut Svg, left_px: f64, bound: Option<&str>) {
    let mut x = left_px;
    for (class, text) in [("real", "filmed"), ("virtual", "simulated")] {
        svg.rect(class, [x, 5.0], [16.0, 10.0]);
        svg.text("small", [x + 21.0, 14.0], Anchor::Start, text);
        x += 21.0 + width_px(text) + 16.0;
    }
    if let Some(text) = bound {
        svg.line("bound", [x + 8.0, 3.0], [x + 8.0, 17.0]);
        svg.text("small", [x + 17.0, 14.0], Anchor::Start, text);
    }
}

/// The text of a difference with its sign, in the unit of the bars.
fn difference(value: f64) -> String {
    let sign = if value < -0.05 { "\u{2212}" } else { "+" };
    format!("{sign}{:.1}", value.abs())
}
