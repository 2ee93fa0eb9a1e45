//! The strike for a pile, and what the simulation says that it does.

use super::Simulated;
use super::words::{figure, mm, numbers, sentence, verdict};
use crate::geometry::{Point, Pose};
use crate::physics::Trajectory;
use crate::plan::{Outcome, Plan};
use crate::scene::{Scene, Strike};
use crate::verify::figures::{
    Bound, Lay, Layer, Palette, Panel, Pile, Series, View, WIDTH_PX, escaped, lines, pile,
};
use std::collections::BTreeMap;

/// A workspace up to so many times as wide as what happens in it is shown as a whole.
const WORKSPACE_FACTOR: f64 = 3.5;
/// A way is drawn from so many points: finer than a pixel.
const WAY_POINTS: usize = 160;

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
    let drawing = planned_pile(plan, palette);
    let view = View::of(&[&drawing], WORKSPACE_FACTOR);
    let caption = match plan.strike {
        Some(_) => {
            "The pile from above (pale), the strike, and where the objects are expected to come to rest (dashed)."
        }
        None => "The pile from above.",
    };
    told += &figure(
        &pile(&drawing, view, WIDTH_PX, "The pile, the strike and the expected final places"),
        caption,
    );
    told + &search(plan)
}

fn planned_pile<'a>(plan: &'a Plan, palette: &Palette) -> Pile<'a> {
    let layer = if plan.prediction.is_some() { Layer::Before } else { Layer::Here };
    let mut lays = placed(&plan.scene, layer, palette);
    for (name, pose) in plan.prediction.iter().flat_map(|p| &p.final_poses) {
        if let Ok(object) = plan.scene.object(name) {
            let class = palette.class(name);
            lays.push(Lay { name, class, shape: &object.shape, pose: *pose, layer: Layer::Expected });
        }
    }
    Pile { scene: &plan.scene, lays, paths: Vec::new(), strike: plan.strike.as_ref() }
}

fn placed<'a>(scene: &'a Scene, layer: Layer, palette: &Palette) -> Vec<Lay<'a>> {
    let lay = |placed: &'a crate::scene::Placed| {
        let shape = &scene.object(&placed.object).ok()?.shape;
        let class = palette.class(&placed.object);
        Some(Lay { name: placed.object.as_str(), class, shape, pose: placed.pose(), layer })
    };
    scene.placed.iter().filter_map(lay).collect()
}

/// How the search went: speed and distances, step by step.
fn search(plan: &Plan) -> String {
    if plan.iterations.len() < 2 {
        return String::new();
    }
    let goal = plan.scene.goal;
    let mm_bound = |value_m: f64, label: &str| Bound { value: value_m * 1e3, label: label.into() };
    let dots = plan.iterations.len() > MOST_STEPS_AS_LINE;
    let panel = |label: &str, bounds: Vec<Bound>, value: &dyn Fn(usize) -> f64| {
        let points = (0..plan.iterations.len()).map(|k| [(k + 1) as f64, value(k)]).collect();
        Panel {
            label: label.into(),
            series: vec![Series { name: String::new(), class: "c0".into(), points, dots }],
            bounds,
        }
    };
    let step = |k: usize| &plan.iterations[k];
    let panels = [
        panel("speed (m/s)", Vec::new(), &|k| step(k).strike.speed_m_s),
        panel("least distance (mm)", vec![mm_bound(goal.min_distance_m, "at least")], &|k| {
            step(k).min_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
        panel("mean distance (mm)", vec![mm_bound(goal.mean_distance_m[0], "at least")], &|k| {
            step(k).mean_distance_m.unwrap_or(f64::NAN) * 1e3
        }),
    ];
    let svg = lines("simulated strike", &panels, &[], "Speed and distances over the steps of the search");
    let caption = "Each step is one simulated strike; its distances are fed back into the next one's speed until all \
                   conditions hold.";
    let fulfilled = plan.iterations.iter().filter(|i| i.fulfilled).count();
    format!(
        "<h3>The search</h3>\n<p>{} strikes were simulated; {fulfilled} of them fulfil the goal.</p>\n{}",
        plan.iterations.len(),
        figure(&svg, caption)
    )
}

/// More steps than this are no feedback any more but a scan, which has no order worth a line.
const MOST_STEPS_AS_LINE: usize = 40;

pub(super) fn simulation_chapter(simulated: &Simulated, palette: &Palette) -> String {
    let Simulated { scene, strike, trajectory } = *simulated;
    let drawing = simulated_pile(scene, strike, (&trajectory.final_poses, Some(trajectory)), palette);
    let view = View::of(&[&drawing], WORKSPACE_FACTOR);
    let svg = pile(&drawing, view, WIDTH_PX, "The simulated strike: ways and final places");
    let names: Vec<&String> = trajectory.final_poses.keys().collect();
    let way = |name: &str| ways(trajectory, name).windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    let farthest = names.iter().map(|n| (way(n), n.as_str())).max_by(|one, other| one.0.total_cmp(&other.0));
    let mut items = vec![(format!("{:.2} s", trajectory.duration_s), "until everything rests")];
    if let Some((length_m, _)) = farthest {
        items.push((mm(length_m), "longest way of an object"));
    }
    format!(
        "<h2>What the strike will do</h2>\n<p>The simulation jumps from impact to impact; between them every object slides \
         under friction.</p>\n{}{}",
        figure(
            &svg,
            "Pale outlines are the pile before the strike, filled ones the end; lines are the ways of the centres."
        ),
        numbers(&items)
    )
}

/// Before and after, ways and striker of a simulated strike.
pub(super) fn simulated_pile<'a>(
    scene: &'a Scene,
    strike: &'a Strike,
    (final_poses, trajectory): (&'a BTreeMap<String, Pose>, Option<&Trajectory>),
    palette: &Palette,
) -> Pile<'a> {
    let mut lays = placed(scene, Layer::Before, palette);
    for (name, pose) in final_poses {
        if let Ok(object) = scene.object(name) {
            let class = palette.class(name);
            lays.push(Lay { name, class, shape: &object.shape, pose: *pose, layer: Layer::Here });
        }
    }
    let way = |name: &String| Some((palette.class(name), ways(trajectory?, name)));
    let paths = final_poses.keys().filter_map(way).collect();
    Pile { scene, lays, paths, strike: Some(strike) }
}

/// The way of an object's centre.
fn ways(trajectory: &Trajectory, name: &str) -> Vec<Point> {
    let time = |k: usize| trajectory.duration_s * k as f64 / (WAY_POINTS - 1) as f64;
    let poses: Vec<Pose> = (0..WAY_POINTS).filter_map(|k| trajectory.pose(name, time(k))).collect();
    poses.into_iter().map(|pose| pose.position).collect()
}
