//! The chapter on the motion in one clip (Fig. 6): measurements as dots, the fitted motion as lines.

use super::content::ClipMotion;
use super::player::{Moment, Motion, Player, played};
use super::text::{HALF_WORKSPACE_FACTOR, figure};
use super::top_views::drawn_objects;
use crate::detect::{Sample, Track};
use crate::estimate::{BodyFit, ClipFit};
use crate::geometry::{Pose, Vec2};
use crate::object::Object;
use crate::report::figures::{
    CentrePath, Layer, Mark, PANEL_PX, Palette, Panel, Series, Stroke, TopView, Viewport, escaped, line_chart,
};
use crate::scene::Scene;

/// At a lower speed (m/s) noise dominates the direction of motion.
const MOVING_M_S: f64 = 0.03;
/// The number of points of a fitted curve.
const FIT_POINTS: usize = 600;
/// The time step of the differences of the fitted speed (s).
const FIT_STEP_S: f64 = 1e-3;

/// The motion of an object at one time.
struct Row {
    time_s: f64,
    /// Distance from the first position (mm), speed (m/s), acceleration along the motion (m/s2).
    values: [Option<f64>; 3],
}

/// The motion of one object, as measured and as fitted.
struct Curves<'a> {
    track: &'a Track,
    measured: Vec<Row>,
    fitted: Vec<Row>,
}

/// The three panels of Fig. 6 as an SVG; none for tracks without a sample.
pub(in crate::report) fn drawing(motion: &ClipMotion, palette: &Palette) -> Option<String> {
    let tracks: Vec<&Track> = motion.tracks.tracks.iter().filter(|t| !t.samples.is_empty()).collect();
    if tracks.is_empty() {
        return None;
    }
    let curves: Vec<Curves> = tracks
        .iter()
        .map(|&track| Curves { track, measured: measured(track), fitted: fitted(track, motion.fit) })
        .collect();
    let labels = ["distance (mm)", "speed (m/s)", "acceleration (m/s\u{b2})"];
    let panels: Vec<Panel> = (0..3)
        .map(|k| Panel {
            label: labels[k].into(),
            series: curves.iter().flat_map(|curves| series(curves, k, palette)).collect(),
            bounds: Vec::new(),
            height_px: PANEL_PX,
        })
        .collect();
    Some(line_chart(
        "time (s)",
        &panels,
        &marks(motion),
        "Distance, speed and acceleration of one clip over time",
    ))
}

pub(super) fn chapter(motion: &ClipMotion, objects: &[Object], palette: &Palette) -> Option<String> {
    let svg = drawing(motion, palette)?;
    let name = escaped(&motion.tracks.video);
    let legend = match motion.fit {
        Some(_) => {
            "Dots: frames. Lines: the fitted motion (rest, slide, impact, slide, rest). Dashed lines: \
                    impacts; their times are estimated between frames."
        }
        None => "Speed and acceleration are differences between frames.",
    };
    let caption = format!(
        "Motion in <code>{name}</code>: distance from the initial position, speed, and acceleration along the motion. {legend}"
    );
    let frames = motion.tracks.tracks.iter().map(|t| t.samples.len()).max().unwrap_or(0);
    Some(format!(
        "<h2>The motion in one clip</h2>\n<p>The striker hits the first object, which may hit the second. An impact changes \
         the speeds instantaneously; after it each object slides to rest with a constant deceleration, the coefficient of \
         friction times <i>g</i>. The objects were tracked in {frames} frames; the reprojection error of the tags is \
         {:.2} px (rms).{}</p>\n{}{}",
        motion.tracks.reprojection_rms_px,
        motion.fit.map_or(String::new(), residual),
        figure(&svg, &caption),
        player(motion, objects, palette)
    ))
}

/// The clip played: the film, and the fitted motion.
fn player(motion: &ClipMotion, objects: &[Object], palette: &Palette) -> String {
    let Some(cell) = motion.cell else { return String::new() };
    let film = Motion::filmed(motion.tracks, 0.0);
    let fitted = motion.fit.map(|fit| Motion::fitted(fit, motion.tracks));
    let scene = Scene::on_free_table(cell.clone(), objects.to_vec(), Vec::new());
    // The part of the table that the first and the last poses and the paths need.
    let tracks = || motion.tracks.tracks.iter();
    let pose = |sample: &Sample| Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
    let ends = tracks().flat_map(|track| {
        let ends = track.samples.first().into_iter().chain(track.samples.last());
        ends.map(|sample| (track.object.as_str(), pose(sample)))
    });
    let paths = tracks().map(|track| CentrePath {
        class: palette.class(&track.object),
        points: track.samples.iter().map(Sample::position).collect(),
    });
    let mut ground = TopView {
        scene: &scene,
        objects: drawn_objects(&scene, ends, Layer::Current, palette),
        paths: paths.collect(),
        strike: motion.strike,
        approaches: Vec::new(),
    };
    let view = Viewport::of(&[&ground], HALF_WORKSPACE_FACTOR);
    ground.paths.clear();
    ground.objects.clear();
    let drawn = if fitted.is_some() {
        "Filled outlines and solid lines: the film. Dashed outlines and lines: the fitted motion."
    } else {
        "Outlines: the film. Lines: the paths of the centres."
    };
    let caption = film.caption(drawn);
    let title = format!("Motion in {}", motion.tracks.video);
    let player = Player {
        title: &title,
        ground,
        view,
        moments: motion.fit.map(Moment::of_fit).unwrap_or_default(),
        motions: std::iter::once(film).chain(fitted).collect(),
        film_start_s: Some(0.0),
        caption,
    };
    played(&player, palette, "")
}

fn residual(fit: &ClipFit) -> String {
    format!(" The residual of the fit during motion is {:.3} mm (rms).", fit.residual_rms_m * 1e3)
}

fn marks(motion: &ClipMotion) -> Vec<Mark> {
    let impacts = motion.fit.into_iter().flat_map(|fit| &fit.impacts);
    impacts
        .map(|impact| {
            let what = match &impact.a {
                Some(a) => format!("{a} hits {}", impact.b),
                None => format!("{} is hit", impact.b),
            };
            Mark { x: impact.time.value, label: what }
        })
        .collect()
}

/// The series of one quantity: the measurements as dots and the fit as a line, or the measurements as a line if there is
/// no fit.
fn series(curves: &Curves, k: usize, palette: &Palette) -> Vec<Series> {
    let Curves { track, measured, fitted } = curves;
    let one = |rows: &[Row], stroke: Stroke| Series {
        name: track.object.clone(),
        class: palette.class(&track.object),
        points: rows.iter().map(|row| [row.time_s, row.values[k].unwrap_or(f64::NAN)]).collect(),
        stroke,
    };
    if fitted.is_empty() {
        return vec![one(measured, Stroke::Line)];
    }
    vec![one(measured, Stroke::Dots), one(fitted, Stroke::Line)]
}

/// The measured motion: positions, and their differences between frames.
fn measured(track: &Track) -> Vec<Row> {
    let first = track.samples[0].position();
    let row = |sample: &Sample| {
        let velocity = velocity(sample);
        let acceleration = velocity.zip(acceleration(sample)).map(|(v, a)| along(v, a));
        let distance_mm = sample.position().distance(first) * 1e3;
        let values = [Some(distance_mm), velocity.map(Vec2::length), acceleration];
        Row { time_s: sample.time_s, values }
    };
    track.samples.iter().map(row).collect()
}

fn velocity(sample: &Sample) -> Option<Vec2> {
    Some(Vec2::new(sample.vx_m_s?, sample.vy_m_s?))
}

fn acceleration(sample: &Sample) -> Option<Vec2> {
    Some(Vec2::new(sample.ax_m_s2?, sample.ay_m_s2?))
}

/// The component of the acceleration along the velocity (m/s2): negative during sliding, zero at rest.
fn along(velocity: Vec2, acceleration: Vec2) -> f64 {
    let direction = velocity.direction().filter(|_| velocity.length() > MOVING_M_S);
    direction.map_or(0.0, |direction| acceleration.dot(direction))
}

/// The fitted motion over the time of the track; without an acceleration at impacts, where it is infinite.
fn fitted(track: &Track, fit: Option<&ClipFit>) -> Vec<Row> {
    let body = fit.and_then(|fit| fit.bodies.iter().find(|b| b.object == track.object));
    let (Some(fit), Some(body), Some(last)) = (fit, body, track.samples.last()) else {
        return Vec::new();
    };
    let (from_s, until_s) = (track.samples[0].time_s, last.time_s);
    let times = (0..FIT_POINTS).map(|k| from_s + (until_s - from_s) * k as f64 / (FIT_POINTS - 1) as f64);
    let at_impact =
        |time_s: f64| fit.impacts.iter().any(|i| (i.time.value - time_s).abs() < 2.0 * FIT_STEP_S);
    let first = body.motion(from_s).pose.position;
    times
        .map(|time_s| {
            let motion = body.motion(time_s);
            let distance_mm = motion.pose.position.distance(first) * 1e3;
            let acceleration = (!at_impact(time_s)).then(|| tangential_acceleration_m_s2(body, time_s));
            Row { time_s, values: [Some(distance_mm), Some(motion.velocity.length()), acceleration] }
        })
        .collect()
}

/// The time derivative of the fitted speed (m/s2).
fn tangential_acceleration_m_s2(body: &BodyFit, time_s: f64) -> f64 {
    let speed = |time_s: f64| body.motion(time_s).velocity.length();
    (speed(time_s + FIT_STEP_S) - speed(time_s - FIT_STEP_S)) / (2.0 * FIT_STEP_S)
}
