//! One clip's motion (Fig. 6): what the film shows as dots, what was fitted as lines.

use super::Motion;
use super::text::figure;
use crate::detect::{Sample, Track};
use crate::estimate::{BodyFit, ClipFit};
use crate::geometry::Vec2;
use crate::report::figures::{Mark, PANEL_PX, Palette, Panel, Series, Stroke, escaped, lines};

/// Below this an object has no direction of motion that noise would not change (m/s).
const MOVING_M_S: f64 = 0.03;
/// Points of a fitted curve.
const FIT_POINTS: usize = 600;
/// The fitted speed is differenced over this time (s).
const FIT_STEP_S: f64 = 1e-3;

/// Distance from the first place (mm), speed (m/s) and acceleration along the motion (m/s2) at some time (s).
type Row = (f64, [Option<f64>; 3]);

/// The three panels of Fig. 6; none for tracks without a sample.
pub(in crate::report) fn drawing(motion: &Motion, palette: &Palette) -> Option<String> {
    let tracks: Vec<&Track> = motion.tracks.tracks.iter().filter(|t| !t.samples.is_empty()).collect();
    if tracks.is_empty() {
        return None;
    }
    let curves: Vec<(&Track, Vec<Row>, Vec<Row>)> =
        tracks.iter().map(|track| (*track, filmed(track), fitted(track, motion.fit))).collect();
    let labels = ["distance (mm)", "speed (m/s)", "acceleration (m/s\u{b2})"];
    let panels: Vec<Panel> = (0..3)
        .map(|k| Panel {
            label: labels[k].into(),
            series: curves
                .iter()
                .flat_map(|(track, seen, fit)| series(track, [seen, fit], k, palette))
                .collect(),
            bounds: Vec::new(),
            height_px: PANEL_PX,
        })
        .collect();
    Some(lines("time (s)", &panels, &marks(motion), "Distance, speed and acceleration of one clip over time"))
}

pub(super) fn chapter(motion: &Motion, palette: &Palette) -> Option<String> {
    let svg = drawing(motion, palette)?;
    let name = escaped(&motion.tracks.video);
    let how = match motion.fit {
        Some(_) => {
            "Dots are frames, lines the fitted motion: rest, slide, impact, slide, rest. Dashed lines are the \
                    impacts; their instants lie between frames."
        }
        None => "Speed and acceleration are differences between frames.",
    };
    let caption = format!(
        "Motion in <code>{name}</code>: distance from where the object lay, speed, and acceleration along the motion. {how}"
    );
    let frames = motion.tracks.tracks.iter().map(|t| t.samples.len()).max().unwrap_or(0);
    Some(format!(
        "<h2>One strike, frame by frame</h2>\n<p>The robot hits the first object, which may hit the next. An impact makes \
         speed jump; after it each object slides to rest at a steady deceleration, friction times <i>g</i>. The markers \
         were found in {frames} frames; the camera's pose fits the tags to {:.2} px.{}</p>\n{}",
        motion.tracks.reprojection_rms_px,
        motion.fit.map_or(String::new(), residual),
        figure(&svg, &caption)
    ))
}

fn residual(fit: &ClipFit) -> String {
    format!(" While they move, the frames lie {:.3} mm (rms) from the fit.", fit.residual_rms_m * 1e3)
}

fn marks(motion: &Motion) -> Vec<Mark> {
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

/// Dots for the film, a line for the fit; without a fit the film is the line.
fn series(track: &Track, [seen, fit]: [&[Row]; 2], k: usize, palette: &Palette) -> Vec<Series> {
    let one = |rows: &[Row], stroke: Stroke| Series {
        name: track.object.clone(),
        class: palette.class(&track.object),
        points: rows.iter().map(|(time_s, values)| [*time_s, values[k].unwrap_or(f64::NAN)]).collect(),
        stroke,
    };
    match fit {
        [] => vec![one(seen, Stroke::Line)],
        _ => vec![one(seen, Stroke::Dots), one(fit, Stroke::Line)],
    }
}

fn filmed(track: &Track) -> Vec<Row> {
    let first = track.samples[0].position();
    let row = |sample: &Sample| {
        let velocity = velocity(sample);
        let acceleration = velocity.zip(acceleration(sample)).map(|(v, a)| along(v, a));
        let distance_mm = sample.position().distance(first) * 1e3;
        (sample.time_s, [Some(distance_mm), velocity.map(Vec2::length), acceleration])
    };
    track.samples.iter().map(row).collect()
}

fn velocity(sample: &Sample) -> Option<Vec2> {
    Some(Vec2::new(sample.vx_m_s?, sample.vy_m_s?))
}

fn acceleration(sample: &Sample) -> Option<Vec2> {
    Some(Vec2::new(sample.ax_m_s2?, sample.ay_m_s2?))
}

/// The acceleration's part along the motion: negative while friction brakes, zero at rest.
fn along(velocity: Vec2, acceleration: Vec2) -> f64 {
    let direction = velocity.direction().filter(|_| velocity.length() > MOVING_M_S);
    direction.map_or(0.0, |direction| acceleration.dot(direction))
}

/// The fitted motion over the track's time; its acceleration is left out where an impact makes it infinite.
fn fitted(track: &Track, fit: Option<&ClipFit>) -> Vec<Row> {
    let body = fit.and_then(|fit| fit.bodies.iter().find(|b| b.object == track.object));
    let (Some(fit), Some(body), Some(last)) = (fit, body, track.samples.last()) else {
        return Vec::new();
    };
    let (from_s, until_s) = (track.samples[0].time_s, last.time_s);
    let times = (0..FIT_POINTS).map(|k| from_s + (until_s - from_s) * k as f64 / (FIT_POINTS - 1) as f64);
    let hit = |time_s: f64| fit.impacts.iter().any(|i| (i.time.value - time_s).abs() < 2.0 * FIT_STEP_S);
    let first = body.motion(from_s).pose.position;
    times
        .map(|time_s| {
            let motion = body.motion(time_s);
            let distance_mm = motion.pose.position.distance(first) * 1e3;
            let acceleration = (!hit(time_s)).then(|| speed_change(body, time_s));
            (time_s, [Some(distance_mm), Some(motion.velocity.length()), acceleration])
        })
        .collect()
}

/// How fast the fitted speed grows (m/s2).
fn speed_change(body: &BodyFit, time_s: f64) -> f64 {
    let speed = |time_s: f64| body.motion(time_s).velocity.length();
    (speed(time_s + FIT_STEP_S) - speed(time_s - FIT_STEP_S)) / (2.0 * FIT_STEP_S)
}
