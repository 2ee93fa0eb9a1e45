//! What the simulation says that a strike does.

use super::Simulated;
use super::text::{figure, mm, numbers, table};
use crate::geometry::{Point, Pose, Vec2};
use crate::physics::{Event, Trajectory};
use crate::report::figures::{
    Lay, Layer, Mark, PANEL_PX, Palette, Panel, Pile, Series, Stroke, View, WIDTH_PX, lines, pile,
};
use crate::scene::{Scene, Strike};
use std::collections::BTreeMap;

/// A workspace up to so many times as wide as what happens in it is shown as a whole.
const WORKSPACE_FACTOR: f64 = 3.5;
/// A way is drawn from so many points: finer than a pixel.
const WAY_POINTS: usize = 160;
/// Points of a speed curve.
const SPEED_POINTS: usize = 800;
/// Speeds are differences of places over twice this time (s).
const SPEED_STEP_S: f64 = 5e-5;
/// The table of impacts shows so many of them.
const MOST_IMPACTS: usize = 12;

pub(super) fn chapter(simulated: &Simulated, palette: &Palette) -> String {
    let Simulated { scene, strike, trajectory } = *simulated;
    let drawing = simulated_pile(scene, strike, (&trajectory.final_poses, Some(trajectory)), palette);
    let view = View::of(&[&drawing], WORKSPACE_FACTOR);
    let svg = pile(&drawing, view, WIDTH_PX, "The simulated strike: ways and final places");
    let way_m = |name: &String| ways(trajectory, name).windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    let longest_m = trajectory.final_poses.keys().map(way_m).fold(0.0, f64::max);
    let items = [
        (trajectory.events.len().to_string(), "impacts"),
        (format!("{:.2} s", rest_s(trajectory)), "from the striker's start until all objects rest"),
        (mm(longest_m), "longest way of an object"),
    ];
    format!(
        "<h2>What the strike will do</h2>\n<p>The simulation jumps from impact to impact; between them every object slides \
         under friction in closed form.</p>\n{}{}{}{}",
        figure(
            &svg,
            "Pale outlines are the pile before the strike, filled ones the end; lines are the ways of the centres."
        ),
        numbers(&items),
        speeds(trajectory, palette),
        impacts(trajectory)
    )
}

/// When the last object stops (s).
fn rest_s(trajectory: &Trajectory) -> f64 {
    let objects = trajectory.motions.iter().filter(|(name, _)| trajectory.final_poses.contains_key(*name));
    let moves = |c: &[f64]| c.iter().skip(1).any(|c| *c != 0.0);
    let moving = objects
        .flat_map(|(_, segments)| segments)
        .filter(|s| moves(&s.x_m) || moves(&s.y_m) || moves(&s.yaw_rad));
    moving.map(|s| s.end_s).filter(|t| t.is_finite()).fold(0.0, f64::max)
}

/// Speed of every object over time, the impacts marked.
fn speeds(trajectory: &Trajectory, palette: &Palette) -> String {
    let first_s = trajectory.events.first().map_or(0.0, |e| e.time_s);
    let until_s = rest_s(trajectory);
    if until_s <= first_s {
        return String::new();
    }
    let margin_s = 0.05 * (until_s - first_s);
    let (from_s, until_s) = ((first_s - margin_s).max(0.0), until_s + margin_s);
    let time = |k: usize| from_s + (until_s - from_s) * k as f64 / (SPEED_POINTS - 1) as f64;
    let after_ms = |time_s: f64| (time_s - first_s) * 1e3;
    let series = |name: &String| Series {
        name: name.clone(),
        class: palette.class(name),
        points: (0..SPEED_POINTS)
            .map(|k| [after_ms(time(k)), speed_m_s(trajectory, name, time(k))])
            .collect(),
        stroke: Stroke::Line,
    };
    let panel = Panel {
        label: "speed (m/s)".into(),
        series: trajectory.final_poses.keys().map(series).collect(),
        bounds: Vec::new(),
        height_px: PANEL_PX,
    };
    let marks: Vec<Mark> = trajectory
        .events
        .iter()
        .map(|e| Mark { x: after_ms(e.time_s), label: e.bodies.join(" hits ") })
        .collect();
    let svg = lines("time after the first impact (ms)", &[panel], &marks, "Speed of every object over time");
    figure(&svg, "Speed of every object; dashed lines are impacts.")
}

fn speed_m_s(trajectory: &Trajectory, name: &str, time_s: f64) -> f64 {
    let at = |time_s: f64| trajectory.pose(name, time_s).map_or(Point::ORIGIN, |pose| pose.position);
    (at(time_s + SPEED_STEP_S) - at(time_s - SPEED_STEP_S)).length() / (2.0 * SPEED_STEP_S)
}

fn impacts(trajectory: &Trajectory) -> String {
    if trajectory.events.is_empty() {
        return "<p>The striker hits nothing.</p>\n".into();
    }
    let first_s = trajectory.events[0].time_s;
    let shown = trajectory.events.iter().take(MOST_IMPACTS);
    let rows: Vec<Vec<String>> = shown.map(|event| impact_row(event, first_s)).collect();
    let more = match trajectory.events.len().saturating_sub(MOST_IMPACTS) {
        0 => String::new(),
        more => format!("<p>And {more} more.</p>\n"),
    };
    table(&["impact", "time (ms)", "approach (m/s)", "parting (m/s)"], &rows) + &more
}

fn impact_row(event: &Event, first_s: f64) -> Vec<String> {
    // Speed of the first body towards the second, along the normal; the centres' where an object spins.
    let towards = |velocities: &[Vec2]| match velocities {
        [a, b] => (*a - *b).dot(event.normal),
        _ => 0.0,
    };
    let approach_m_s = towards(&event.velocities_before_m_s);
    let parting_m_s = -towards(&event.velocities_after_m_s);
    let row = [
        event.bodies.join(" hits "),
        format!("{:.1}", (event.time_s - first_s) * 1e3),
        format!("{approach_m_s:.3}"),
        format!("{parting_m_s:.3}"),
    ];
    row.to_vec()
}

/// Objects at these poses, as they are drawn.
pub(super) fn lays<'a>(
    scene: &'a Scene,
    poses: impl Iterator<Item = (&'a str, Pose)>,
    layer: Layer,
    palette: &Palette,
) -> Vec<Lay<'a>> {
    let lay = |(name, pose): (&'a str, Pose)| {
        let shape = &scene.object(name).ok()?.shape;
        Some(Lay { name, class: palette.class(name), shape, pose, layer })
    };
    poses.filter_map(lay).collect()
}

/// Before and after, ways and striker of a simulated strike.
pub(super) fn simulated_pile<'a>(
    scene: &'a Scene,
    strike: &'a Strike,
    (final_poses, trajectory): (&'a BTreeMap<String, Pose>, Option<&Trajectory>),
    palette: &Palette,
) -> Pile<'a> {
    let before = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let after = final_poses.iter().map(|(name, pose)| (name.as_str(), *pose));
    let mut drawn = lays(scene, before, Layer::Before, palette);
    drawn.extend(lays(scene, after, Layer::Here, palette));
    let way = |name: &String| Some((palette.class(name), ways(trajectory?, name)));
    let paths = final_poses.keys().filter_map(way).collect();
    Pile { scene, lays: drawn, paths, strike: Some(strike) }
}

/// The way of an object's centre.
fn ways(trajectory: &Trajectory, name: &str) -> Vec<Point> {
    let time = |k: usize| trajectory.duration_s * k as f64 / (WAY_POINTS - 1) as f64;
    let poses: Vec<Pose> = (0..WAY_POINTS).filter_map(|k| trajectory.pose(name, time(k))).collect();
    poses.into_iter().map(|pose| pose.position).collect()
}
