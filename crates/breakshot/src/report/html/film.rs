//! Filmed strikes beside their simulations (Figs. 12 to 17).

use super::Filmed;
use super::simulated::{lays, simulated_pile};
use super::text::{
    HALF_WIDTH_PX, HALF_WORKSPACE_FACTOR, figure, figure_pair, mm, mm_or_dash, numbers, sentence, table,
    verdict,
};
use crate::geometry::{Point, Pose};
use crate::report::figures::{BarPair, Layer, Palette, Pile, View, bars, escaped, photo, pile};
use crate::verify::{GoalCheck, Report, Seen, Spread};
use std::collections::BTreeMap;

pub(super) fn chapter(filmed: &[Filmed], palette: &Palette) -> Option<String> {
    if filmed.is_empty() {
        return None;
    }
    let strikes: String = filmed.iter().map(|film| strike(film, palette)).collect();
    let overview = if filmed.len() > 1 { overview(filmed) } else { String::new() };
    Some(format!(
        "<h2>Real against virtual</h2>\n<p>A strike was filmed, and the same strike was simulated with the learned \
         properties from where the objects lay. Nothing was fitted to the film's outcome.</p>\n{overview}{strikes}"
    ))
}

/// All films in one table, discs and general shapes apart.
fn overview(filmed: &[Filmed]) -> String {
    let rows: Vec<Vec<String>> = filmed
        .iter()
        .map(|film| {
            let report = film.report;
            let spread = |s: Option<Spread>| mm_or_dash(s.map(|s| s.mean_m));
            let yes = |goal: &GoalCheck| if goal.fulfilled { "yes" } else { "no" }.to_owned();
            vec![
                report.video.clone(),
                report.objects.len().to_string(),
                spread(report.summary.discs),
                spread(report.summary.general),
                mm_or_dash(report.summary.all.map(|s| s.worst_m)),
                yes(&report.goal.observed),
                yes(&report.goal.predicted),
            ]
        })
        .collect();
    let head = [
        "film",
        "objects",
        "mean difference, discs",
        "mean difference, other shapes",
        "worst difference",
        "singulated, filmed",
        "simulated",
    ];
    table(&head, &rows)
}

fn strike(film: &Filmed, palette: &Palette) -> String {
    let report = film.report;
    let rows: Vec<BarPair> = report
        .pairs
        .iter()
        .map(|p| BarPair {
            name: format!("{} \u{2013} {}", p.a, p.b),
            real: p.observed_m * 1e3,
            virtual_: p.predicted_m * 1e3,
        })
        .collect();
    let least_m = film.scene.goal.min_distance_m;
    let least_text = format!("least distance wanted ({:.0} mm)", least_m * 1e3);
    let least = (least_m > 0.0).then_some((least_m * 1e3, least_text.as_str()));
    let mut told = format!("<h3>{}</h3>\n{}", escaped(&report.video), goal_verdict(report));
    if let Some([before, after]) = film.pictures {
        let (before, after) =
            (photo(before, "The pile before the strike"), photo(after, "The objects after it"));
        told += &figure_pair(("Before", &before), ("After", &after), "Two frames of the film.");
    }
    told += &beside(film, palette);
    told += &figure(
        &overlay(film, palette),
        "Where the objects came to rest (filled) and where they were expected (dashed).",
    );
    if !rows.is_empty() {
        let svg =
            bars(&rows, "distance between centres (mm)", least, "Pairwise distances, filmed and simulated");
        told += &figure(&svg, "Distances after the strike, pair by pair (Fig. 17).");
        told += &spreads(report);
    }
    told + &object_table(report)
}

fn goal_verdict(report: &Report) -> String {
    let (real, expected) = (&report.goal.observed, &report.goal.predicted);
    let (class, title) = match (real.fulfilled, expected.fulfilled) {
        (true, true) => ("yes", "Singulated, as predicted."),
        (true, false) => ("doubt", "Singulated, though the simulation did not expect it."),
        (false, true) => ("no", "Not singulated, though the simulation expected it."),
        (false, false) => ("doubt", "Not singulated, as predicted."),
    };
    let why = real.violations.first().map(|v| sentence(&format!("in the film {v}"))).unwrap_or_default();
    let distances = format!(
        "<p>Least distance {} filmed, {} simulated; mean distance {} filmed, {} simulated.</p>\n",
        mm_or_dash(real.min_distance_m),
        mm_or_dash(expected.min_distance_m),
        mm_or_dash(real.mean_distance_m),
        mm_or_dash(expected.mean_distance_m)
    );
    verdict(class, title, &why) + if real.min_distance_m.is_some() { &distances } else { "" }
}

/// Filmed at the left, simulated at the right.
fn beside(film: &Filmed, palette: &Palette) -> String {
    let real = filmed_pile(film, palette);
    let virtual_ =
        simulated_pile(film.scene, film.strike, (&film.report.predicted, film.trajectory), palette);
    let view = View::of(&[&real, &virtual_], HALF_WORKSPACE_FACTOR);
    let left = pile(&real, view, HALF_WIDTH_PX, "The pile before and after the strike, as filmed");
    let right = pile(&virtual_, view, HALF_WIDTH_PX, "The pile before and after the strike, as simulated");
    let caption = "The table from above: pale outlines lay there before the strike, filled ones after it; lines are the \
                   ways of the centres.";
    figure_pair(("Filmed", &left), ("Simulated", &right), caption)
}

/// The drawing of the final places alone (px).
const OVERLAY_WIDTH_PX: f64 = 520.0;

fn filmed_pile<'a>(film: &Filmed<'a>, palette: &Palette) -> Pile<'a> {
    let report = film.report;
    let pose = |seen: &Seen| Pose { position: seen.position, yaw_rad: seen.yaw_rad.unwrap_or(0.0) };
    let seen =
        |seen: &'a BTreeMap<String, Seen>| seen.iter().map(move |(name, seen)| (name.as_str(), pose(seen)));
    let mut drawn = lays(film.scene, seen(&report.before), Layer::Before, palette);
    drawn.extend(lays(film.scene, seen(&report.observed), Layer::Here, palette));
    let tracks = film.tracks.into_iter().flat_map(|t| &t.tracks);
    let paths = tracks.filter(|t| report.observed.contains_key(&t.object)).map(|track| {
        let way: Vec<Point> =
            track.samples.iter().filter(|s| !s.doubtful).map(crate::detect::Sample::position).collect();
        (palette.class(&track.object), way)
    });
    Pile { scene: film.scene, lays: drawn, paths: paths.collect(), strike: Some(film.strike) }
}

/// Filmed and expected final places on one drawing.
fn overlay(film: &Filmed, palette: &Palette) -> String {
    let mut drawing = filmed_pile(film, palette);
    drawing.lays.retain(|lay| lay.layer == Layer::Here);
    drawing.paths.clear();
    drawing.strike = None;
    let expected = film.report.predicted.iter().map(|(name, pose)| (name.as_str(), *pose));
    drawing.lays.extend(lays(film.scene, expected, Layer::Expected, palette));
    let view = View::close(&drawing);
    pile(&drawing, view, OVERLAY_WIDTH_PX, "Final places, filmed and expected")
}

fn spreads(report: &Report) -> String {
    let summary = &report.summary;
    let mut items = Vec::new();
    if let Some(all) = summary.all {
        items.push((mm(all.mean_m), "mean difference of a distance"));
        items.push((mm(all.worst_m), "worst difference"));
        items.push((format!("{:.1} %", all.relative * 100.0), "mean difference over mean distance"));
    }
    if let (Some(discs), Some(general)) = (summary.discs, summary.general) {
        items.push((mm(discs.mean_m), "mean difference, pairs of discs"));
        items.push((mm(general.mean_m), "mean difference, pairs with other shapes"));
    }
    numbers(&items)
}

fn object_table(report: &Report) -> String {
    let rows: Vec<Vec<String>> = report
        .objects
        .iter()
        .map(|o| {
            let yaw =
                o.yaw_error_rad.map_or("\u{2013}".into(), |yaw| format!("{:.1}\u{b0}", yaw.to_degrees()));
            vec![o.object.clone(), mm(o.observed_way_m), mm(o.predicted_way_m), mm(o.position_error_m), yaw]
        })
        .collect();
    let head = ["object", "moved, filmed", "moved, simulated", "final place off by", "turned off by"];
    table(&head, &rows)
}
