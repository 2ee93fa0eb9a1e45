//! The chapter on the planned strike and the search for it.

use super::text::{
    Conclusion, HALF_WIDTH_PX, HALF_WORKSPACE_FACTOR, Half, conclusion, figure, figure_pair, mm, sentence,
    table,
};
use super::top_views::{drawn_objects, simulated_view};
use crate::geometry::Vec2;
use crate::plan::{Contact, EvaluatedStrike, Iteration, Outcome, Plan, Remedy};
use crate::properties::Assumption;
use crate::report::figures::{
    Approach, Bound, DrawnObject, LOW_PANEL_PX, Layer, Palette, Panel, Series, Stroke, TopView, Viewport,
    WIDTH_PX, escaped, line_chart, top_view,
};
use crate::scene::Scene;
use crate::statistics::sorted_by_value;
use std::collections::BTreeMap;

pub(super) fn chapter(plan: &Plan, palette: &Palette) -> String {
    let (class, title) = match plan.outcome {
        Outcome::Found => (Conclusion::Yes, "Found."),
        Outcome::BestEffort => (Conclusion::Uncertain, "Best effort."),
        Outcome::Unreachable => (Conclusion::No, "Unreachable."),
    };
    let reason = sentence(&plan.reason);
    let mut chapter = format!("<h2>The planned strike</h2>\n{}", conclusion(class, title, &reason));
    if let Some(strike) = &plan.strike {
        let object = escaped(strike.object.as_deref().unwrap_or("the pile"));
        chapter += &format!(
            "<p>Strike {object} at {:.3} m/s with heading {:.1}\u{b0}: the striker starts from rest at ({:.1}, {:.1}) mm, \
             clear of all objects, and stops after {}.</p>\n",
            strike.speed_m_s,
            strike.heading_rad.to_degrees(),
            strike.start_m.x * 1e3,
            strike.start_m.y * 1e3,
            mm(strike.travel_m)
        );
    }
    chapter += &drawings(plan, palette);
    chapter + &remedies(plan) + &assumed(&plan.assumed) + &robustness(plan) + &search(plan)
}

/// What would increase the success probability.
fn remedies(plan: &Plan) -> String {
    if plan.remedies.is_empty() {
        return String::new();
    }
    let row = |r: &Remedy| vec![escaped(&r.change), format!("{:.0} %", 100.0 * r.success_probability)];
    let rows: Vec<_> = plan.remedies.iter().map(row).collect();
    format!("<h3>What would help</h3>\n{}", table(&["one change", "success probability with it"], &rows))
}

/// The properties that no clip measured.
fn assumed(assumptions: &[Assumption]) -> String {
    if assumptions.is_empty() {
        return String::new();
    }
    let row = |a: &Assumption| {
        let [low, high] = a.interval_95;
        vec![
            format!("{} of {}", a.quantity.words(), escaped(&a.name)),
            format!("{:.3}", a.mean),
            format!("{low:.3} to {high:.3}"),
            escaped(&a.from),
            escaped(&a.clip.replace('`', "")),
        ]
    };
    let rows: Vec<_> = assumptions.iter().map(row).collect();
    let columns =
        ["assumed, not measured", "value", "95 % interval", "inferred from", "would be measured by"];
    format!("<h3>Assumed properties</h3>\n{}", table(&columns, &rows))
}

/// Drawings of the pile with the strike (left) and of the expected outcome (right).
fn drawings(plan: &Plan, palette: &Palette) -> String {
    let scene = &plan.scene;
    let current = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let before = TopView {
        scene,
        objects: drawn_objects(scene, current, Layer::Current, palette),
        paths: Vec::new(),
        strike: plan.strike.as_ref(),
        approaches: Vec::new(),
    };
    let (Some(strike), Some(prediction)) = (&plan.strike, &plan.prediction) else {
        let view = Viewport::of(&[&before], HALF_WORKSPACE_FACTOR);
        let svg = top_view(&before, view, HALF_WIDTH_PX, "The pile from above");
        return figure(&svg, "The pile from above.");
    };
    let mut after = simulated_view(scene, strike, &prediction.final_poses, None, palette);
    after.strike = None;
    after.objects.splice(0..0, possible_poses(plan, palette));
    let view = Viewport::of(&[&before, &after], HALF_WORKSPACE_FACTOR);
    let left = top_view(&before, view, HALF_WIDTH_PX, "The pile and the strike, from above");
    let right = top_view(&after, view, HALF_WIDTH_PX, "The expected poses after the strike, from above");
    let caption = "Arrow: the path of the striker's centre. Right: pale outlines are the poses before the strike, filled \
                   outlines the expected final poses; faint outlines are final poses in sampled scenarios.";
    let left = Half { title: "The pile and the strike", image: &left };
    let right = Half { title: "The expected outcome", image: &right };
    figure_pair(&left, &right, caption)
}

/// The pile, the strike, the expected and the possible final poses in one drawing.
pub(in crate::report) fn drawing(plan: &Plan) -> String {
    let scene = &plan.scene;
    let palette = Palette::new(scene.placed.iter().map(|p| p.object.as_str()));
    let current = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let mut objects = possible_poses(plan, &palette);
    objects.extend(drawn_objects(scene, current, Layer::Before, &palette));
    if let (Some(_), Some(prediction)) = (&plan.strike, &plan.prediction) {
        let expected = prediction.final_poses.iter().map(|(name, pose)| (name.as_str(), *pose));
        objects.extend(drawn_objects(scene, expected, Layer::Current, &palette));
    }
    let strike = plan.strike.as_ref();
    let whole = TopView { scene, objects, paths: Vec::new(), strike, approaches: Vec::new() };
    let view = Viewport::of(&[&whole], WORKSPACE_FACTOR);
    top_view(&whole, view, WIDTH_PX, "The pile, the strike, and the possible final poses")
}

/// The pile alone.
pub(in crate::report) fn pile(scene: &Scene) -> String {
    let palette = Palette::new(scene.placed.iter().map(|p| p.object.as_str()));
    let current = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let objects = drawn_objects(scene, current, Layer::Current, &palette);
    let whole = TopView { scene, objects, paths: Vec::new(), strike: None, approaches: Vec::new() };
    let view = Viewport::of(&[&whole], WORKSPACE_FACTOR);
    top_view(&whole, view, WIDTH_PX, "The pile from above")
}

/// The pile with the evaluated strikes: of those that differ in the speed alone, the best.
pub(in crate::report) fn map(scene: &Scene, strikes: &[EvaluatedStrike]) -> String {
    let mut best: BTreeMap<(&str, u64, u64), &EvaluatedStrike> = BTreeMap::new();
    for evaluated in strikes {
        let aim = &evaluated.aim;
        let line = (aim.object.as_str(), aim.heading_rad.to_bits(), aim.offset_m.to_bits());
        let entry = best.entry(line).or_insert(evaluated);
        if evaluated.success_probability > entry.success_probability {
            *entry = evaluated;
        }
    }
    let approach = |EvaluatedStrike { aim, strike, success_probability, .. }: &EvaluatedStrike| {
        let to_contact_m = strike.travel_m - aim.follow_through_m;
        let contact = strike.start_m + Vec2::from_heading(strike.heading_rad) * to_contact_m;
        Approach { contact, heading_rad: strike.heading_rad, success_probability: *success_probability }
    };
    let approaches: Vec<Approach> = best.into_values().map(approach).collect();
    let approaches = sorted_by_value(approaches, |approach| approach.success_probability);
    let palette = Palette::new(scene.placed.iter().map(|p| p.object.as_str()));
    let current = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let objects = drawn_objects(scene, current, Layer::Current, &palette);
    let drawing = TopView { scene, objects, paths: Vec::new(), strike: None, approaches };
    let view = Viewport::of(&[&drawing], 1.0);
    top_view(&drawing, view, WIDTH_PX, "The success probability of strikes by contact point and direction")
}

/// The drawing shows the whole workspace if it is at most this many times as wide as the contents.
const WORKSPACE_FACTOR: f64 = 2.0;

/// The final poses of the objects in sampled scenarios.
fn possible_poses<'a>(plan: &'a Plan, palette: &Palette) -> Vec<DrawnObject<'a>> {
    let samples = plan.robustness.iter().flat_map(|r| &r.final_poses);
    let poses = samples.flat_map(|(name, poses)| poses.iter().map(move |pose| (name.as_str(), *pose)));
    drawn_objects(&plan.scene, poses, Layer::Possible, palette)
}

/// The second-best strike, the reasons for failures, and the sensitivity to uncertain quantities.
fn robustness(plan: &Plan) -> String {
    let Some(robustness) = &plan.robustness else { return String::new() };
    let percent = |fraction: f64| format!("{:.0} %", 100.0 * fraction);
    let mut section = String::from("<h3>Robustness</h3>\n");
    if let Some(other) = &robustness.runner_up {
        section += &format!(
            "<p>The best clearly different strike, {} at {:.3} m/s with heading {:.1}\u{b0}, succeeds in {} of the same \
             scenarios.</p>\n",
            escaped(other.strike.object.as_deref().unwrap_or("the pile")),
            other.strike.speed_m_s,
            other.strike.heading_rad.to_degrees(),
            percent(other.success_probability)
        );
    }
    let failures = robustness.failures.iter().take(MOST_REASONS);
    let failures: Vec<_> = failures.map(|f| vec![escaped(&f.what), percent(f.fraction)]).collect();
    if !failures.is_empty() {
        section += &table(&["violated condition", "fraction of all scenarios"], &failures);
    }
    let sensitivities = robustness.sensitivities.iter().filter(|d| d.gain > 0.0).take(MOST_REASONS);
    let sensitivities: Vec<_> =
        sensitivities.map(|d| vec![d.source.words().to_owned(), percent(d.gain)]).collect();
    if !sensitivities.is_empty() {
        section += &table(&["if this were known exactly", "gain of success probability"], &sensitivities);
    }
    section
}

/// Each table lists at most this many rows, the largest values first.
const MOST_REASONS: usize = 4;

/// The iterations of the search: speed and distances.
fn search(plan: &Plan) -> String {
    if plan.iterations.len() < 2 {
        return String::new();
    }
    let goal = &plan.scene.goal;
    let mm_bound = |value_m: f64, label: &str| Bound { value: value_m * 1e3, label: label.into() };
    let stroke = if plan.iterations.len() > MOST_ITERATIONS_AS_LINE { Stroke::Dots } else { Stroke::Both };
    let panel = |label: &str, bounds: Vec<Bound>, value: &dyn Fn(usize) -> f64| {
        let points = (0..plan.iterations.len()).map(|k| [(k + 1) as f64, value(k)]).collect();
        Panel {
            label: label.into(),
            series: vec![Series { name: String::new(), class: "c0".into(), points, stroke }],
            bounds,
            height_px: LOW_PANEL_PX,
        }
    };
    let iteration = |k: usize| &plan.iterations[k];
    let panels = [
        panel("speed (m/s)", Vec::new(), &|k| iteration(k).strike.speed_m_s),
        panel("least (mm)", vec![mm_bound(goal.min_distance_m, "at least")], &|k| {
            iteration(k).min_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
        panel("mean (mm)", vec![mm_bound(goal.mean_distance_m[0], "at least")], &|k| {
            iteration(k).mean_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
    ];
    let svg = line_chart("iteration", &panels, &[], "Speed and distances over the iterations of the search");
    let caption = "Each iteration simulates one strike: its speed, and the least and the mean distance between centres \
                   after it, from which the speed of the next one is computed, until all conditions hold.";
    let pushes = |i: &&Iteration| i.contact == Contact::Pushing;
    let pushing = match plan.iterations.iter().filter(pushes).count() {
        0 => String::new(),
        count => format!(" Strikes that push the objects instead of scattering them: {count}."),
    };
    let fulfilled = plan.iterations.iter().filter(|i| i.fulfilled).count();
    format!(
        "<h3>The search</h3>\n<p>Simulated strikes: {}. Strikes that fulfil the goal: {fulfilled}.{pushing}</p>\n{}",
        plan.iterations.len(),
        figure(&svg, caption)
    )
}

/// More iterations than this are a scan of the speed range, whose points are not connected by a line.
const MOST_ITERATIONS_AS_LINE: usize = 40;
