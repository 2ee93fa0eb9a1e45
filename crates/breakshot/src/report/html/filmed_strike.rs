//! The chapter on filmed strikes and their simulations (Figs. 12 to 17).

use super::content::FilmedStrike;
use super::explanation::explanation;
use super::player::{Moment, Motion, Player, played};
use super::text::{
    Conclusion, DASH, HALF_WIDTH_PX, HALF_WORKSPACE_FACTOR, Half, KeyNumber, conclusion, figure, figure_pair,
    key_numbers, mm, mm_or_dash, sentence, table,
};
use super::top_views::{drawn_objects, simulated_view};
use crate::detect::Sample;
use crate::geometry::Pose;
use crate::report::figures::{
    BarPair, CentrePath, Layer, LowerBound, Palette, TopView, Viewport, bar_chart, escaped, film_image,
    top_view,
};
use crate::verify::{DistanceErrors, GoalCheck, ObservedPose, PairDifference, Report};
use std::collections::BTreeMap;

pub(super) fn chapter(filmed: &[FilmedStrike], palette: &Palette) -> Option<String> {
    if filmed.is_empty() {
        return None;
    }
    let strikes: String = filmed.iter().map(|film| strike(film, palette)).collect();
    let overview = if filmed.len() > 1 { overview(filmed) } else { String::new() };
    Some(format!(
        "<h2>Filmed against simulated</h2>\n<p>A strike was filmed, and the same strike was simulated with the estimated \
         properties from the initial poses of the objects. Nothing was fitted to the outcome in the film.</p>\n{overview}{strikes}"
    ))
}

/// A table of all films, with separate columns for discs and for general shapes.
fn overview(filmed: &[FilmedStrike]) -> String {
    let rows: Vec<Vec<String>> = filmed
        .iter()
        .map(|film| {
            let report = film.report;
            let mean = |errors: Option<DistanceErrors>| mm_or_dash(errors.map(|e| e.mean_m));
            let yes_or_no = |goal: &GoalCheck| if goal.fulfilled { "yes" } else { "no" }.to_owned();
            vec![
                report.video.clone(),
                report.objects.len().to_string(),
                mean(report.summary.discs),
                mean(report.summary.general),
                mm_or_dash(report.summary.all.map(|e| e.worst_m)),
                yes_or_no(&report.goal.observed),
                yes_or_no(&report.goal.predicted),
            ]
        })
        .collect();
    let head = [
        "film",
        "objects",
        "mean difference, discs",
        "mean difference, other shapes",
        "largest difference",
        "singulated, filmed",
        "simulated",
    ];
    table(&head, &rows)
}

/// One film: the goal, two frames, drawings, pairwise distances and objects.
fn strike(film: &FilmedStrike, palette: &Palette) -> String {
    let report = film.report;
    let rows: Vec<BarPair> = report
        .pairs
        .iter()
        .map(|p| BarPair {
            name: format!("{} \u{2013} {}", p.a, p.b),
            filmed: p.observed_m * 1e3,
            simulated: p.predicted_m * 1e3,
        })
        .collect();
    let least_m = film.scene.goal.min_distance_m;
    let bound = (least_m > 0.0).then(|| LowerBound {
        value: least_m * 1e3,
        label: format!("required least distance ({:.0} mm)", least_m * 1e3),
    });
    let mut section = format!("<h3>{}</h3>\n{}", escaped(&report.video), goal_conclusion(report));
    if let Some([before, after]) = film.frames {
        let before = film_image(before, "The pile before the strike");
        let after = film_image(after, "The objects after the strike");
        let (left, right) =
            (Half { title: "Before", image: &before }, Half { title: "After", image: &after });
        section += &figure_pair(&left, &right, "Two frames of the film.");
    }
    let still = beside(film, palette)
        + &figure(
            &overlay(film, palette),
            "Filled outlines: the filmed final poses. Dashed outlines: the simulated ones.",
        );
    section += &player(film, palette, &still);
    section += &explanation(film);
    if !rows.is_empty() {
        let label = "Pairwise distances, filmed and simulated";
        let svg = bar_chart(&rows, "distance between centres (mm)", bound.as_ref(), label);
        section += &figure(&svg, "Distances after the strike for each pair (Fig. 17).");
        section += &distance_errors(report);
        section += &pair_table(report);
    }
    section + &object_table(report)
}

/// Whether the goal was reached, in the film and in the simulation.
fn goal_conclusion(report: &Report) -> String {
    let (real, expected) = (&report.goal.observed, &report.goal.predicted);
    let (class, title) = match (real.fulfilled, expected.fulfilled) {
        (true, true) => (Conclusion::Yes, "Singulated, as predicted."),
        (true, false) => (Conclusion::Uncertain, "Singulated, contrary to the prediction."),
        (false, true) => (Conclusion::No, "Not singulated, contrary to the prediction."),
        (false, false) => (Conclusion::Uncertain, "Not singulated, as predicted."),
    };
    let reason = real.violations.first().map(|v| sentence(&format!("in the film {v}"))).unwrap_or_default();
    let distances = format!(
        "<p>Least distance {} filmed, {} simulated; mean distance {} filmed, {} simulated.</p>\n",
        mm_or_dash(real.min_distance_m),
        mm_or_dash(expected.min_distance_m),
        mm_or_dash(real.mean_distance_m),
        mm_or_dash(expected.mean_distance_m)
    );
    conclusion(class, title, &reason) + if real.min_distance_m.is_some() { &distances } else { "" }
}

/// Drawings of the filmed strike (left) and of the simulated one (right).
fn beside(film: &FilmedStrike, palette: &Palette) -> String {
    let real = filmed_view(film, palette);
    let simulated = simulated_view(film.scene, film.strike, &film.report.predicted, film.trajectory, palette);
    let view = Viewport::of(&[&real, &simulated], HALF_WORKSPACE_FACTOR);
    let left = top_view(&real, view, HALF_WIDTH_PX, "The pile before and after the strike, as filmed");
    let right =
        top_view(&simulated, view, HALF_WIDTH_PX, "The pile before and after the strike, as simulated");
    let caption = "The table from above. Pale outlines: the poses before the strike. Filled outlines: the final poses. Lines: \
                   the paths of the centres.";
    let (left, right) = (Half { title: "Filmed", image: &left }, Half { title: "Simulated", image: &right });
    figure_pair(&left, &right, caption)
}

/// Film and simulation played on one time axis; without a script the drawings.
fn player(film: &FilmedStrike, palette: &Palette, still: &str) -> String {
    let start_s = film.report.alignment.as_ref().map(|alignment| alignment.start_s);
    let filmed = film.tracks.map(|tracks| Motion::filmed(tracks, start_s.unwrap_or(0.0)));
    let simulated = film.trajectory.map(Motion::simulated);
    let real = filmed_view(film, palette);
    let expected = simulated_view(film.scene, film.strike, &film.report.predicted, film.trajectory, palette);
    let view = Viewport::of(&[&real, &expected], HALF_WORKSPACE_FACTOR);
    let drawn = match (&filmed, &simulated, start_s) {
        (None, None, _) => return still.to_owned(),
        (Some(_), Some(_), Some(_)) => {
            "Filled outlines and solid lines: the film. Dashed outlines and lines: the simulation. Short lines: from the filmed to \
             the simulated position. The times are equal where the struck object has first moved by as much in both."
        }
        (Some(_), Some(_), None) => {
            "Filled outlines and solid lines: the film. Dashed outlines and lines: the simulation. The struck object does not move in \
             both: each begins at its own start, and there are no distances."
        }
        _ => "Outlines: the objects. Lines: the paths of the centres.",
    };
    let caption = filmed.as_ref().map_or_else(|| drawn.to_owned(), |filmed| filmed.caption(drawn));
    let title = format!("Motion in {}, filmed and simulated", film.report.video);
    let ground = TopView {
        scene: film.scene,
        objects: Vec::new(),
        paths: Vec::new(),
        strike: Some(film.strike),
        approaches: Vec::new(),
    };
    let player = Player {
        title: &title,
        ground,
        view,
        motions: filmed.into_iter().chain(simulated).collect(),
        moments: film.trajectory.map(Moment::of).unwrap_or_default(),
        film_start_s: start_s,
        caption,
    };
    played(&player, palette, still)
}

/// The width of the drawing of the final poses (px).
const OVERLAY_WIDTH_PX: f64 = 520.0;

/// The filmed strike: the poses before and after it, the striker, and the paths of the centres.
fn filmed_view<'a>(film: &FilmedStrike<'a>, palette: &Palette) -> TopView<'a> {
    let report = film.report;
    let pose = |observed: &ObservedPose| Pose {
        position: observed.position,
        yaw_rad: observed.yaw_rad.unwrap_or(0.0),
    };
    let poses = |observed: &'a BTreeMap<String, ObservedPose>| {
        observed.iter().map(move |(name, observed)| (name.as_str(), pose(observed)))
    };
    let mut objects = drawn_objects(film.scene, poses(&report.before), Layer::Before, palette);
    objects.extend(drawn_objects(film.scene, poses(&report.observed), Layer::Current, palette));
    let tracks = film.tracks.into_iter().flat_map(|t| &t.tracks);
    let paths = tracks.filter(|t| report.observed.contains_key(&t.object)).map(|track| {
        let points = track.samples.iter().filter(|s| !s.doubtful).map(Sample::position).collect();
        CentrePath { class: palette.class(&track.object), points }
    });
    TopView {
        scene: film.scene,
        objects,
        paths: paths.collect(),
        strike: Some(film.strike),
        approaches: Vec::new(),
    }
}

/// The filmed and the simulated final poses in one drawing.
fn overlay(film: &FilmedStrike, palette: &Palette) -> String {
    let mut drawing = filmed_view(film, palette);
    drawing.objects.retain(|object| object.layer == Layer::Current);
    drawing.paths.clear();
    drawing.strike = None;
    let expected = film.report.predicted.iter().map(|(name, pose)| (name.as_str(), *pose));
    drawing.objects.extend(drawn_objects(film.scene, expected, Layer::Expected, palette));
    let view = Viewport::of_objects(&drawing);
    top_view(&drawing, view, OVERLAY_WIDTH_PX, "Final poses, filmed and simulated")
}

/// The distance of each pair at rest.
fn pair_table(report: &Report) -> String {
    let row = |pair: &PairDifference| {
        let names = format!("{} \u{2013} {}", pair.a, pair.b);
        let difference = format!("{:+.1} mm", pair.difference_m * 1e3);
        vec![names, mm(pair.observed_m), mm(pair.predicted_m), difference]
    };
    let rows: Vec<Vec<String>> = report.pairs.iter().map(row).collect();
    table(&["pair", "distance at rest, filmed", "simulated", "simulated less filmed"], &rows)
}

/// The mean and the largest error of the pairwise distances.
fn distance_errors(report: &Report) -> String {
    let summary = &report.summary;
    let mut items = Vec::new();
    if let Some(all) = summary.all {
        items.push(KeyNumber::new(mm(all.mean_m), "mean difference of a distance"));
        items.push(KeyNumber::new(mm(all.worst_m), "largest difference"));
        items.push(KeyNumber::new(
            format!("{:.1} %", all.relative * 100.0),
            "mean difference over mean distance",
        ));
    }
    if let (Some(discs), Some(general)) = (summary.discs, summary.general) {
        items.push(KeyNumber::new(mm(discs.mean_m), "mean difference, pairs of discs"));
        items.push(KeyNumber::new(mm(general.mean_m), "mean difference, pairs with other shapes"));
    }
    key_numbers(&items)
}

/// The displacement and the final error of each object.
fn object_table(report: &Report) -> String {
    let rows: Vec<Vec<String>> = report
        .objects
        .iter()
        .map(|o| {
            let yaw = o.yaw_error_rad.map_or(DASH.into(), |yaw| format!("{:.1}\u{b0}", yaw.to_degrees()));
            let observed = mm(o.observed_displacement_m);
            let predicted = mm(o.predicted_displacement_m);
            vec![o.object.clone(), observed, predicted, mm(o.position_error_m), yaw]
        })
        .collect();
    let head = ["object", "displacement, filmed", "displacement, simulated", "position error", "yaw error"];
    table(&head, &rows)
}
