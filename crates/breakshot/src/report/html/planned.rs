//! The strike for a pile, and how it was found.

use super::simulated::{lays, simulated_pile};
use super::text::{HALF_WIDTH_PX, HALF_WORKSPACE_FACTOR, figure, figure_pair, mm, sentence, table, verdict};
use crate::plan::{Contact, Iteration, Outcome, Plan};
use crate::report::figures::{
    Bound, LOW_PANEL_PX, Lay, Layer, Palette, Panel, Pile, Series, Stroke, View, WIDTH_PX, escaped, lines,
    pile,
};

pub(super) fn plan_chapter(plan: &Plan, palette: &Palette) -> String {
    let (class, title) = match plan.outcome {
        Outcome::Found => ("yes", "Found."),
        Outcome::BestEffort => ("doubt", "Best effort."),
        Outcome::Unreachable => ("no", "Unreachable."),
    };
    let mut told =
        format!("<h2>The strike for this pile</h2>\n{}", verdict(class, title, &sentence(&plan.reason)));
    if let Some(strike) = &plan.strike {
        let object = escaped(strike.object.as_deref().unwrap_or("the pile"));
        told += &format!(
            "<p>Strike {object} at {:.3} m/s along {:.1}\u{b0}: the striker starts at ({:.1}, {:.1}) mm, at rest and clear \
             of everything, and stops after {}.</p>\n",
            strike.speed_m_s,
            strike.heading_rad.to_degrees(),
            strike.start_m.x * 1e3,
            strike.start_m.y * 1e3,
            mm(strike.travel_m)
        );
    }
    told += &drawings(plan, palette);
    told + &why(plan) + &search(plan)
}

/// The pile and the strike at the left, what is expected at the right.
fn drawings(plan: &Plan, palette: &Palette) -> String {
    let scene = &plan.scene;
    let here = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let before = Pile {
        scene,
        lays: lays(scene, here, Layer::Here, palette),
        paths: Vec::new(),
        strike: plan.strike.as_ref(),
    };
    let (Some(strike), Some(prediction)) = (&plan.strike, &plan.prediction) else {
        let view = View::of(&[&before], HALF_WORKSPACE_FACTOR);
        return figure(&pile(&before, view, HALF_WIDTH_PX, "The pile from above"), "The pile from above.");
    };
    let mut after = simulated_pile(scene, strike, (&prediction.final_poses, None), palette);
    after.strike = None;
    after.lays.splice(0..0, cloud(plan, palette));
    let view = View::of(&[&before, &after], HALF_WORKSPACE_FACTOR);
    let left = pile(&before, view, HALF_WIDTH_PX, "The pile and the strike, from above");
    let right = pile(&after, view, HALF_WIDTH_PX, "The expected places after the strike, from above");
    let caption = "The arrow is the way of the striker's centre. At the right, pale outlines are where the objects lay, \
                   filled ones where they are expected to come to rest; the faint ones are where they may come to rest, for \
                   all that is known.";
    figure_pair(("The pile and the strike", &left), ("Expected after it", &right), caption)
}

/// Everything in one picture: the pile, the strike, where the objects are expected and where else they may come to rest.
pub(in crate::report) fn drawing(plan: &Plan) -> String {
    let scene = &plan.scene;
    let palette = Palette::new(scene.placed.iter().map(|p| p.object.as_str()));
    let here = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let mut drawn = cloud(plan, &palette);
    drawn.extend(lays(scene, here, Layer::Before, &palette));
    if let (Some(_), Some(prediction)) = (&plan.strike, &plan.prediction) {
        let expected = prediction.final_poses.iter().map(|(name, pose)| (name.as_str(), *pose));
        drawn.extend(lays(scene, expected, Layer::Here, &palette));
    }
    let whole = Pile { scene, lays: drawn, paths: Vec::new(), strike: plan.strike.as_ref() };
    pile(
        &whole,
        View::of(&[&whole], WORKSPACE_FACTOR),
        WIDTH_PX,
        "The pile, the strike, and where the objects may end",
    )
}

/// The workspace is shown whole unless it is this much wider than all that happens.
const WORKSPACE_FACTOR: f64 = 2.0;

/// Where each object comes to rest in worlds that may be.
fn cloud<'a>(plan: &'a Plan, palette: &Palette) -> Vec<Lay<'a>> {
    let clouds = plan.robustness.iter().flat_map(|r| &r.cloud);
    let poses = clouds.flat_map(|(name, poses)| poses.iter().map(move |pose| (name.as_str(), *pose)));
    lays(&plan.scene, poses, Layer::Possible, palette)
}

/// What speaks for this strike and against it.
fn why(plan: &Plan) -> String {
    let Some(robustness) = &plan.robustness else { return String::new() };
    let percent = |part: f64| format!("{:.0} %", 100.0 * part);
    let mut told = String::from("<h3>Why this strike</h3>\n");
    if let Some(other) = &robustness.runner_up {
        told += &format!(
            "<p>The best clearly different strike, {} at {:.3} m/s along {:.1}\u{b0}, works in {} of the same worlds.</p>\n",
            escaped(other.strike.object.as_deref().unwrap_or("the pile")),
            other.strike.speed_m_s,
            other.strike.heading_rad.to_degrees(),
            percent(other.success_probability)
        );
    }
    let failures = robustness.failures.iter().take(MOST_REASONS);
    let failures: Vec<_> = failures.map(|f| vec![escaped(&f.what), percent(f.part)]).collect();
    if !failures.is_empty() {
        told += &table(&["what fails", "of all worlds"], &failures);
    }
    let doubts = robustness.doubts.iter().filter(|d| d.gain > 0.0).take(MOST_REASONS);
    let doubts: Vec<_> = doubts.map(|d| vec![d.source.words().to_owned(), percent(d.gain)]).collect();
    if !doubts.is_empty() {
        told += &table(&["if this were known exactly", "more successes"], &doubts);
    }
    told
}

/// Reasons that are told, the weightiest first.
const MOST_REASONS: usize = 4;

/// How the search went: speed and distances, step by step.
fn search(plan: &Plan) -> String {
    if plan.iterations.len() < 2 {
        return String::new();
    }
    let goal = &plan.scene.goal;
    let mm_bound = |value_m: f64, label: &str| Bound { value: value_m * 1e3, label: label.into() };
    let stroke = if plan.iterations.len() > MOST_STEPS_AS_LINE { Stroke::Dots } else { Stroke::Both };
    let panel = |label: &str, bounds: Vec<Bound>, value: &dyn Fn(usize) -> f64| {
        let points = (0..plan.iterations.len()).map(|k| [(k + 1) as f64, value(k)]).collect();
        Panel {
            label: label.into(),
            series: vec![Series { name: String::new(), class: "c0".into(), points, stroke }],
            bounds,
            height_px: LOW_PANEL_PX,
        }
    };
    let step = |k: usize| &plan.iterations[k];
    let panels = [
        panel("speed (m/s)", Vec::new(), &|k| step(k).strike.speed_m_s),
        panel("least (mm)", vec![mm_bound(goal.min_distance_m, "at least")], &|k| {
            step(k).min_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
        panel("mean (mm)", vec![mm_bound(goal.mean_distance_m[0], "at least")], &|k| {
            step(k).mean_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
    ];
    let svg = lines("simulated strike", &panels, &[], "Speed and distances over the steps of the search");
    let caption = "Each step is one simulated strike: its speed, and the least and the mean distance between centres after \
                   it. They are fed back into the next one's speed until all conditions hold.";
    let pushes = |i: &&Iteration| i.contact == Contact::Pushing;
    let pushing = match plan.iterations.iter().filter(pushes).count() {
        0 => String::new(),
        count => format!(" So slow that the striker would push, not scatter: {count}."),
    };
    let fulfilled = plan.iterations.iter().filter(|i| i.fulfilled).count();
    format!(
        "<h3>The search</h3>\n<p>Simulated strikes: {}. Strikes that fulfil the goal: {fulfilled}.{pushing}</p>\n{}",
        plan.iterations.len(),
        figure(&svg, caption)
    )
}

/// More steps than this are no feedback any more but a scan, which has no order worth a line.
const MOST_STEPS_AS_LINE: usize = 40;
