//! The impulse geometry as an SVG figure (Fig. 10).

use crate::robot::arm::impulse_geometry::{HeadingImpulse, ImpulseConditions, ImpulseGeometry};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;

/// Side of a small panel (px).
const PANEL: f64 = 230.0;
/// Space between the panels (px).
const GAP: f64 = 26.0;
/// Side of the large panel (px).
const LARGE: f64 = 2.0 * PANEL + GAP;
/// Number of meridians and parallels of the drawn surface.
const LINES: u32 = 18;
/// Number of points along each line.
const POINTS: u32 = 48;

/// Fig. 10 of the paper for some poses of an arm: (a) the normalized impulse surface of the first pose, for an object much
/// heavier than the arm, (b) the arm with that surface at its tip, (c) the largest impulse on the object along the table, with
/// its largest and smallest direction.
///
/// At most four poses are drawn.
pub fn impulse_figure(geometries: &[ImpulseGeometry]) -> String {
    let poses = &geometries[..geometries.len().min(4)];
    let width = LARGE + GAP * 3.0 + (PANEL + GAP) * poses.len().max(1) as f64;
    let height = LARGE + GAP * 4.0;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} \
         {height:.0}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"none\" stroke-linejoin=\"round\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    if let Some(first) = poses.first() {
        text(&mut svg, (GAP, GAP), "(a) the tip's own impulse per approach speed, normalized");
        let view =
            View { center: (GAP + LARGE / 2.0, GAP * 2.0 + LARGE / 2.0), origin: [0.0; 3], px: LARGE * 0.42 };
        surface(&mut svg, &view, [0.0; 3], 1.0, first);
        axes(&mut svg, &view);
    }
    for (k, geometry) in poses.iter().enumerate() {
        let left = LARGE + GAP * 2.0 + (PANEL + GAP) * k as f64;
        text(&mut svg, (left, GAP), &format!("(b) pose {}", k + 1));
        pose(&mut svg, (left, GAP * 1.5), geometry);
        let top = GAP * 2.5 + PANEL;
        text(&mut svg, (left, top), "(c) largest impulse along the table");
        polar(&mut svg, (left, top + GAP * 0.5), geometry);
    }
    svg.push_str("</svg>\n");
    svg
}

/// An object much heavier than any arm, which leaves the contribution of the arm alone.
const HEAVY: ImpulseConditions =
    ImpulseConditions { object_mass_kg: f64::INFINITY, restitution: 0.0, speed_cap_m_s: 1.0 };

/// A parallel projection from the front right and above.
struct View {
    center: (f64, f64),
    origin: [f64; 3],
    px: f64,
}

impl View {
    fn px(&self, point: [f64; 3]) -> (f64, f64) {
        /// Azimuth and elevation of the view (rad).
        const AZIMUTH: f64 = -0.6;
        const ELEVATION: f64 = 0.45;
        let [x, y, z] = std::array::from_fn(|k| point[k] - self.origin[k]);
        let right = x * AZIMUTH.cos() - y * AZIMUTH.sin();
        let away = x * AZIMUTH.sin() + y * AZIMUTH.cos();
        let up = z * ELEVATION.cos() + away * ELEVATION.sin();
        (self.center.0 + self.px * right, self.center.1 - self.px * up)
    }
}

fn text(svg: &mut String, (x, y): (f64, f64), content: &str) {
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#222\">{content}</text>");
}

fn polyline(svg: &mut String, points: &[(f64, f64)], style: &str) {
    let list: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
    let _ = writeln!(svg, "<polyline points=\"{}\" {style}/>", list.join(" "));
}

/// The normalized surface around a point, with a largest radius of `size` metres.
fn surface(svg: &mut String, view: &View, at: [f64; 3], size: f64, geometry: &ImpulseGeometry) {
    let point = |azimuth: f64, polar: f64| {
        let direction = [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()];
        let radius = size * geometry.normalized(direction, &HEAVY);
        view.px(std::array::from_fn(|k| at[k] + radius * direction[k]))
    };
    let fractions = || (0..=POINTS).map(|k| f64::from(k) / f64::from(POINTS));
    for k in 0..LINES {
        let fraction = f64::from(k) / f64::from(LINES);
        let meridian: Vec<_> = fractions().map(|u| point(fraction * TAU, u * PI)).collect();
        polyline(svg, &meridian, "stroke=\"#4878a8\" stroke-width=\"0.6\"");
        let parallel: Vec<_> = fractions().map(|u| point(u * TAU, fraction * PI)).collect();
        polyline(svg, &parallel, "stroke=\"#a8c4e0\" stroke-width=\"0.6\"");
    }
    for (axis, color) in geometry.principal.iter().zip(["#c03028", "#888", "#208040"]) {
        let ends = [-1.0, 1.0].map(|sign| {
            let length = size * geometry.normalized(axis.direction, &HEAVY);
            view.px(std::array::from_fn(|k| at[k] + sign * length * axis.direction[k]))
        });
        polyline(svg, &ends, &format!("stroke=\"{color}\" stroke-width=\"1.8\""));
    }
}

fn axes(svg: &mut String, view: &View) {
    for (axis, name) in [([1.1, 0.0, 0.0], "x"), ([0.0, 1.1, 0.0], "y"), ([0.0, 0.0, 1.1], "z")] {
        let (from, to) = (view.px([0.0; 3]), view.px(axis));
        polyline(svg, &[from, to], "stroke=\"#222\" stroke-width=\"0.8\" stroke-dasharray=\"3 3\"");
        text(svg, (to.0 + 3.0, to.1 - 3.0), name);
    }
}

/// The arm's skeleton with the surface at its tip.
fn pose(svg: &mut String, (left, top): (f64, f64), geometry: &ImpulseGeometry) {
    /// The largest radius of the surface (m), and the width of the panel (m).
    const SIZE_M: f64 = 0.16;
    const WIDTH_M: f64 = 1.1;
    let base = geometry.skeleton_m.first().copied().unwrap_or_default();
    let middle =
        std::array::from_fn(|k| f64::midpoint(base[k], geometry.tip_m[k]) + if k == 2 { 0.2 } else { 0.0 });
    let view = View { center: (left + PANEL / 2.0, top + PANEL / 2.0), origin: middle, px: PANEL / WIDTH_M };
    surface(svg, &view, geometry.tip_m, SIZE_M, geometry);
    let stick: Vec<_> = geometry.skeleton_m.iter().map(|&point| view.px(point)).collect();
    polyline(
        svg,
        &stick,
        "stroke=\"#333\" stroke-width=\"4\" stroke-opacity=\"0.75\" stroke-linecap=\"round\"",
    );
    for (x, y) in &stick {
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"white\" stroke=\"#333\"/>");
    }
}

/// The largest impulse along the table, from above, with arrows at its largest and smallest heading.
fn polar(svg: &mut String, (left, top): (f64, f64), geometry: &ImpulseGeometry) {
    let center = (left + PANEL / 2.0, top + PANEL / 2.0 - GAP * 0.3);
    let most = geometry.headings.iter().map(|h| h.impulse_n_s).fold(0.0, f64::max);
    if most <= 0.0 {
        return;
    }
    let at = |heading: f64, fraction: f64| {
        let radius = fraction * PANEL * 0.42;
        (center.0 + radius * heading.cos(), center.1 - radius * heading.sin())
    };
    for fraction in [0.5, 1.0] {
        let _ = writeln!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{:.1}\" stroke=\"#ccc\" stroke-dasharray=\"2 3\"/>",
            center.0,
            center.1,
            fraction * PANEL * 0.42
        );
    }
    let mut curve: Vec<_> =
        geometry.headings.iter().map(|h| at(h.heading_rad, h.impulse_n_s / most)).collect();
    curve.extend(curve.first().copied());
    polyline(svg, &curve, "stroke=\"#4878a8\" stroke-width=\"1.4\" fill=\"#4878a8\" fill-opacity=\"0.12\"");
    let by_impulse = |a: &&HeadingImpulse, b: &&HeadingImpulse| a.impulse_n_s.total_cmp(&b.impulse_n_s);
    let ends = [
        (geometry.headings.iter().max_by(by_impulse), "#c03028"),
        (geometry.headings.iter().min_by(by_impulse), "#208040"),
    ];
    for (heading, color) in ends {
        let Some(heading) = heading else { continue };
        let tip = at(heading.heading_rad, heading.impulse_n_s / most);
        polyline(svg, &[center, tip], &format!("stroke=\"{color}\" stroke-width=\"2\""));
        let inwards = if tip.0 > center.0 { -62.0 } else { 6.0 };
        text(svg, (tip.0 + inwards, tip.1 - 6.0), &format!("{:.0} mN s", 1e3 * heading.impulse_n_s));
    }
}
