//! The reliability diagram: the observed success rate of strikes over the predicted probability.

use super::table::{Trial, bins};
use std::fmt::Write;

/// The side of the diagram's square (px).
const SIDE_PX: f64 = 320.0;
/// What surrounds it (px).
const MARGIN_PX: f64 = 56.0;

/// An SVG picture: one circle per bin, its area the number of piles, its bar one standard deviation.
pub(super) fn reliability(trials: &[Trial]) -> String {
    let whole = SIDE_PX + 2.0 * MARGIN_PX;
    let x = |fraction: f64| MARGIN_PX + SIDE_PX * fraction;
    let y = |fraction: f64| MARGIN_PX + SIDE_PX * (1.0 - fraction);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {whole} {whole}\" width=\"{whole}\" \
         height=\"{whole}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#333\">\n\
         <rect width=\"{whole}\" height=\"{whole}\" fill=\"white\"/>\n\
         <path d=\"M{} {}L{} {}\" stroke=\"#999\" stroke-dasharray=\"4 4\"/>\n",
        x(0.0),
        y(0.0),
        x(1.0),
        y(1.0)
    );
    for tick in 0..=5 {
        let fraction = f64::from(tick) / 5.0;
        let _ = writeln!(
            svg,
            "<path d=\"M{0} {1}V{2}M{3} {4}H{5}\" stroke=\"#ddd\"/>\
             <text x=\"{0}\" y=\"{6}\" text-anchor=\"middle\">{fraction:.1}</text>\
             <text x=\"{7}\" y=\"{8}\" text-anchor=\"end\">{fraction:.1}</text>",
            x(fraction),
            y(0.0),
            y(1.0),
            x(0.0),
            y(fraction),
            x(1.0),
            y(0.0) + 18.0,
            x(0.0) - 8.0,
            y(fraction) + 4.0
        );
    }
    for bin in bins(trials) {
        let count = bin.count as f64;
        // Of a rate of so few piles, never zero.
        let centred = (bin.observed * count + 1.0) / (count + 2.0);
        let std = (centred * (1.0 - centred) / (count + 2.0)).sqrt();
        let (low, high) = ((bin.observed - std).max(0.0), (bin.observed + std).min(1.0));
        let _ = writeln!(
            svg,
            "<path d=\"M{0} {1}V{2}\" stroke=\"#1f6fb2\" stroke-width=\"2\"/>\
             <circle cx=\"{0}\" cy=\"{3}\" r=\"{4:.1}\" fill=\"#1f6fb2\"/>\
             <text x=\"{5}\" y=\"{6}\">{7} piles</text>",
            x(bin.stated),
            y(low),
            y(high),
            y(bin.observed),
            1.5 * count.sqrt() + 2.0,
            x(bin.stated) + 12.0,
            y(bin.observed) + 4.0,
            bin.count
        );
    }
    let _ = write!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">stated success probability</text>\n\
         <text transform=\"rotate(-90)\" x=\"{}\" y=\"16\" text-anchor=\"middle\">observed success rate</text>\n\
         <text x=\"{}\" y=\"28\" text-anchor=\"middle\" font-size=\"14\">One robust strike on {} random piles</text>\n</svg>\n",
        x(0.5),
        whole - 12.0,
        -y(0.5),
        x(0.5),
        trials.len()
    );
    svg
}
