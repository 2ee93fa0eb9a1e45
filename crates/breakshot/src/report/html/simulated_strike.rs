//! The chapter on the simulation of the planned strike.

use super::content::SimulatedStrike;
use super::player::{Moment, Motion, Player, played};
use super::text::{KeyNumber, figure, key_numbers, mm, table};
use super::top_views::{centre_path, drawn_objects, simulated_view};
use crate::geometry::{Point, Vec2};
use crate::physics::{Event, Trajectory};
use crate::report::figures::{
    Layer, Mark, PANEL_PX, Palette, Panel, Series, Stroke, TopView, Viewport, WIDTH_PX, line_chart, top_view,
};

/// The drawing shows the whole workspace if it is at most this many times as wide as the contents.
const WORKSPACE_FACTOR: f64 = 3.5;
/// The number of points of a speed curve.
const SPEED_POINTS: usize = 800;
/// Speeds are central differences of positions with this time step (s).
const SPEED_STEP_S: f64 = 5e-5;
/// The table lists at most this many impacts.
const MOST_IMPACTS: usize = 12;

pub(super) fn chapter(simulated: &SimulatedStrike, palette: &Palette) -> String {
    let SimulatedStrike { scene, strike, trajectory } = *simulated;
    let drawing = simulated_view(scene, strike, &trajectory.final_poses, Some(trajectory), palette);
    let view = Viewport::of(&[&drawing], WORKSPACE_FACTOR);
    let svg = top_view(&drawing, view, WIDTH_PX, "The simulated strike: paths and final poses");
    let still = figure(
        &svg,
        "Pale outlines: the poses before the strike. Filled outlines: the final poses. Lines: the paths of the centres.",
    );
    let path_m =
        |name: &String| centre_path(trajectory, name).windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    let longest_m = trajectory.final_poses.keys().map(path_m).fold(0.0, f64::max);
    let items = [
        KeyNumber::new(trajectory.events.len().to_string(), "impacts"),
        KeyNumber::new(
            format!("{:.2} s", rest_s(trajectory)),
            "from the start of the striker until all objects are at rest",
        ),
        KeyNumber::new(mm(longest_m), "longest path of an object"),
    ];
    format!(
        "<h2>The simulated strike</h2>\n<p>The simulation proceeds from impact to impact; between impacts the motion of each \
         object under friction has a closed form.</p>\n{}{}{}{}",
        player(simulated, view, palette, &still),
        key_numbers(&items),
        speeds(trajectory, palette),
        impacts(trajectory)
    )
}

/// The simulation played; without a script the drawing.
fn player(simulated: &SimulatedStrike, view: Viewport, palette: &Palette, still: &str) -> String {
    let SimulatedStrike { scene, strike, trajectory } = *simulated;
    let before = scene.placed.iter().map(|p| (p.object.as_str(), p.pose()));
    let ground = TopView {
        scene,
        objects: drawn_objects(scene, before, Layer::Before, palette),
        paths: Vec::new(),
        strike: Some(strike),
        approaches: Vec::new(),
    };
    let player = Player {
        title: "Motion of the simulated strike",
        ground,
        view,
        motions: vec![Motion::simulated(trajectory)],
        moments: Moment::of(trajectory),
        film_start_s: None,
        caption: "Filled outlines: the objects and the striker at the time shown. Pale outlines: the poses before the strike. Lines: the paths of the centres.".into(),
    };
    played(&player, palette, still)
}

/// The time at which the last object comes to rest (s).
fn rest_s(trajectory: &Trajectory) -> f64 {
    let objects = trajectory.motions.iter().filter(|(name, _)| trajectory.final_poses.contains_key(*name));
    let moves = |c: &[f64]| c.iter().skip(1).any(|c| *c != 0.0);
    let moving = objects
        .flat_map(|(_, segments)| segments)
        .filter(|s| moves(&s.x_m) || moves(&s.y_m) || moves(&s.yaw_rad));
    moving.map(|s| s.end_s).filter(|t| t.is_finite()).fold(0.0, f64::max)
}

/// The speed of every object over time, with the impacts marked.
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
    let svg =
        line_chart("time after the first impact (ms)", &[panel], &marks, "Speed of every object over time");
    figure(&svg, "The speed of every object. Dashed lines: impacts.")
}

fn speed_m_s(trajectory: &Trajectory, name: &str, time_s: f64) -> f64 {
    let at = |time_s: f64| trajectory.pose(name, time_s).map_or(Point::ORIGIN, |pose| pose.position);
    (at(time_s + SPEED_STEP_S) - at(time_s - SPEED_STEP_S)).length() / (2.0 * SPEED_STEP_S)
}

/// The table of the first impacts.
fn impacts(trajectory: &Trajectory) -> String {
    if trajectory.events.is_empty() {
        return "<p>The striker hits no object.</p>\n".into();
    }
    let first_s = trajectory.events[0].time_s;
    let shown = trajectory.events.iter().take(MOST_IMPACTS);
    let rows: Vec<Vec<String>> = shown.map(|event| impact_row(event, first_s)).collect();
    let more = match trajectory.events.len().saturating_sub(MOST_IMPACTS) {
        0 => String::new(),
        more => format!("<p>{more} further impacts are not listed.</p>\n"),
    };
    table(&["impact", "time (ms)", "approach (m/s)", "separation (m/s)"], &rows) + &more
}

fn impact_row(event: &Event, first_s: f64) -> Vec<String> {
    // The normal component of the relative velocity of the centres; at the contact point it differs if a body spins.
    let normal_speed_m_s = |velocities: &[Vec2]| match velocities {
        [a, b] => (*a - *b).dot(event.normal),
        _ => 0.0,
    };
    let approach_m_s = normal_speed_m_s(&event.velocities_before_m_s);
    let separation_m_s = -normal_speed_m_s(&event.velocities_after_m_s);
    let row = [
        event.bodies.join(" hits "),
        format!("{:.1}", (event.time_s - first_s) * 1e3),
        format!("{approach_m_s:.3}"),
        format!("{separation_m_s:.3}"),
    ];
    row.to_vec()
}
