//! Table 1: the estimated mass ratio of every pair and the weighed one.

use super::figure_file::FigureFile;
use super::interval_figures::spaced;
use super::standalone_style::standalone;
use crate::object::Object;
use crate::properties::Properties;
use crate::report::figures::{Anchor, Svg, WIDTH_PX};
use crate::report::weighed::{error_percent, weighed_pair_ratio};
use crate::uncertain::Estimate;
use std::fmt::Write;

const ROW_PX: f64 = 22.0;
const HEAD_PX: f64 = 34.0;
const LEFT_PX: f64 = 12.0;
const HEADS: [&str; 7] =
    ["pair", "estimated ratio", "\u{b1} 95 %", "clips", "weighed ratio", "error (%)", "all clips: error (%)"];

/// One pair of objects.
struct Line {
    pair: String,
    /// From the clips of this pair alone.
    own: Estimate,
    /// From all clips together; none for two copies of one object.
    joint: Option<f64>,
    weighed: Option<f64>,
}

impl Line {
    fn error(&self) -> Option<f64> {
        Some(error_percent(self.own.mean, self.weighed?))
    }

    fn joint_error(&self) -> Option<f64> {
        Some(error_percent(self.joint?, self.weighed?))
    }
}

/// `table1.svg` and `table1.csv`; none if no pair has a mass ratio.
pub(super) fn table_1(properties: &Properties, objects: &[Object]) -> Option<Vec<FigureFile>> {
    let mass = |name: &str| properties.mass_ratio.get(name).map(|e| e.mean);
    let lines: Vec<Line> = (properties.pair_mass_ratio.iter())
        .map(|(pair, own)| {
            let joint =
                pair.split_once('/').filter(|(a, b)| a != b).and_then(|(a, b)| Some(mass(a)? / mass(b)?));
            Line { pair: pair.clone(), own: *own, joint, weighed: weighed_pair_ratio(objects, pair) }
        })
        .collect();
    (!lines.is_empty()).then(|| {
        let svg = FigureFile { name: "table1.svg".into(), text: standalone(&drawing(&lines)) };
        vec![svg, FigureFile { name: "table1.csv".into(), text: csv(&lines) }]
    })
}

fn csv(lines: &[Line]) -> String {
    let mut csv =
        "pair,learned,low_95,high_95,n,weighed,error_percent,joint,joint_error_percent\n".to_owned();
    let number =
        |value: Option<f64>, decimals: usize| value.map_or(String::new(), |v| format!("{v:.decimals$}"));
    for line in lines {
        let Estimate { mean, interval_95: [low, high], n, .. } = line.own;
        let _ = writeln!(
            csv,
            "{},{mean:.6},{low:.6},{high:.6},{n},{},{},{},{}",
            line.pair,
            number(line.weighed, 6),
            number(line.error(), 3),
            number(line.joint, 6),
            number(line.joint_error(), 3)
        );
    }
    csv
}

/// The table as an SVG.
fn drawing(lines: &[Line]) -> String {
    // The name of the pair is aligned to the left, the numbers to the right of columns of equal width.
    let weighed = lines.iter().any(|line| line.weighed.is_some());
    let columns = if weighed { HEADS.len() } else { 4 };
    let right_px = |k: usize| 120.0 + (WIDTH_PX - 132.0) * k as f64 / (HEADS.len() - 1) as f64;
    let end_px = right_px(columns - 1);
    let bottom_px = HEAD_PX + lines.len() as f64 * ROW_PX;
    let mut svg = Svg::new(end_px + LEFT_PX, bottom_px + if weighed { 34.0 } else { 10.0 });
    svg.text("label small", [LEFT_PX, HEAD_PX - 12.0], Anchor::Start, HEADS[0]);
    for (k, head) in HEADS.iter().enumerate().take(columns).skip(1) {
        svg.text("label small", [right_px(k), HEAD_PX - 12.0], Anchor::End, head);
    }
    svg.line("zero", [LEFT_PX, HEAD_PX - 3.0], [end_px, HEAD_PX - 3.0]);
    for (n, line) in lines.iter().enumerate() {
        let y = HEAD_PX + n as f64 * ROW_PX;
        svg.text("name", [LEFT_PX, y + 15.0], Anchor::Start, &spaced(&line.pair));
        for (k, text) in cells(line).iter().enumerate().take(columns - 1) {
            svg.text("number", [right_px(k + 1), y + 15.0], Anchor::End, text);
        }
        svg.line("grid", [LEFT_PX, y + ROW_PX], [end_px, y + ROW_PX]);
    }
    if weighed {
        let errors = format!(
            "{}; {}",
            summary("each pair alone", lines, Line::error),
            summary("all clips together", lines, Line::joint_error)
        );
        svg.text("label", [LEFT_PX, bottom_px + 23.0], Anchor::Start, &errors);
    }
    svg.finish("Table 1: mass ratios of pairs, estimated and weighed")
}

fn cells(line: &Line) -> [String; 6] {
    let dash = || "\u{2013}".to_owned();
    let signed = |value: Option<f64>| match value {
        Some(v) if v < 0.0 => format!("\u{2212}{:.2}", -v),
        Some(v) => format!("+{v:.2}"),
        None => dash(),
    };
    let half = (line.own.interval_95[1] - line.own.interval_95[0]) / 2.0;
    [
        format!("{:.4}", line.own.mean),
        if half.is_finite() { format!("{half:.4}") } else { dash() },
        line.own.n.to_string(),
        line.weighed.map_or_else(dash, |known| format!("{known:.4}")),
        signed(line.error()),
        signed(line.joint_error()),
    ]
}

/// The mean and the largest absolute error of these lines.
fn summary(what: &str, lines: &[Line], error: impl Fn(&Line) -> Option<f64>) -> String {
    let errors: Vec<f64> = lines.iter().filter_map(error).map(f64::abs).collect();
    let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
    let worst = errors.iter().copied().fold(0.0, f64::max);
    format!("{what}: mean error {mean:.2} %, largest {worst:.2} % ({} pairs)", errors.len())
}
