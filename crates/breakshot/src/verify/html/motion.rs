//! One clip's motion (Fig. 6).

use super::Motion;
use super::words::figure;
use crate::detect::{Sample, Track};
use crate::geometry::Vec2;
use crate::verify::figures::{Mark, Palette, Panel, Series, escaped, lines};

/// Below this an object has no direction of motion that noise would not change (m/s).
const MOVING_M_S: f64 = 0.03;

pub(super) fn chapter(motion: &Motion, palette: &Palette) -> Option<String> {
    let tracks: Vec<&Track> = motion.tracks.tracks.iter().filter(|t| !t.samples.is_empty()).collect();
    if tracks.is_empty() {
        return None;
    }
    let panel = |label: &str, value: &dyn Fn(&Sample, &Sample) -> Option<f64>| Panel {
        label: label.into(),
        series: tracks.iter().map(|track| series(track, palette, value)).collect(),
        bounds: Vec::new(),
    };
    let panels = [
        panel("distance (mm)", &|sample, first| Some(sample.position().distance(first.position()) * 1e3)),
        panel("speed (m/s)", &|sample, _| Some(velocity(sample)?.length())),
        panel("acceleration (m/s\u{b2})", &|sample, _| acceleration_along(sample)),
    ];
    let marks: Vec<Mark> =
        motion.impacts.iter().map(|i| Mark { x: i.time_s, label: i.what.clone() }).collect();
    let name = escaped(&motion.tracks.video);
    let svg = lines("time (s)", &panels, &marks, "Distance, speed and acceleration of one clip over time");
    let impacts = match motion.impacts {
        [] => "",
        _ => " Dashed lines are the impacts; their instants lie between frames.",
    };
    let caption = format!(
        "Motion in <code>{name}</code>: distance from where the object lay, speed, and acceleration along the motion.{impacts}"
    );
    Some(format!(
        "<h2>One strike, frame by frame</h2>\n<p>The robot hits the first object, which may hit the next. An impact makes \
         speed jump; after it each object slides to rest at a steady deceleration, friction times <i>g</i>. The markers \
         were found in {} frames; the camera's pose fits the tags to {:.2} px.</p>\n{}",
        tracks.iter().map(|t| t.samples.len()).max().unwrap_or(0),
        motion.tracks.reprojection_rms_px,
        figure(&svg, &caption)
    ))
}

fn series(track: &Track, palette: &Palette, value: &dyn Fn(&Sample, &Sample) -> Option<f64>) -> Series {
    let first = &track.samples[0];
    let points = track.samples.iter().map(|s| [s.time_s, value(s, first).unwrap_or(f64::NAN)]).collect();
    Series { name: track.object.clone(), class: palette.class(&track.object), points, dots: false }
}

fn velocity(sample: &Sample) -> Option<Vec2> {
    Some(Vec2::new(sample.vx_m_s?, sample.vy_m_s?))
}

/// The acceleration's part along the motion: negative while friction brakes, zero at rest.
fn acceleration_along(sample: &Sample) -> Option<f64> {
    let (velocity, acceleration) = (velocity(sample)?, Vec2::new(sample.ax_m_s2?, sample.ay_m_s2?));
    let direction = velocity.direction().filter(|_| velocity.length() > MOVING_M_S);
    Some(direction.map_or(0.0, |direction| acceleration.dot(direction)))
}
