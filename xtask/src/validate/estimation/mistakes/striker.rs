//! The striker that the films show, beside the strikes that were carried out.

use super::answer;
use crate::validate::estimation::saved::Saved;
use crate::validate::row::{Row, mean_and_worst, rms};
use breakshot::estimate::{ClipFit, ClipTracks, Options, estimation};
use breakshot::geometry::{Vec2, wrapped_rad};

/// What the lines that compare strikers with their strikes contain.
const LINES: [&str; 4] =
    ["the striker is seen", "the striker moves", "the striker starts", "the striker takes"];

/// Errors of the striker's motion in the right campaign, over all clips.
#[derive(Default)]
struct Errors {
    /// Of the speed, as a fraction, and over its standard deviation.
    speed: Vec<f64>,
    speed_stds: Vec<f64>,
    /// Of the heading (rad), and over its standard deviation.
    heading_rad: Vec<f64>,
    heading_stds: Vec<f64>,
    /// Of the line, aside in the middle of the positions (m).
    aside_m: Vec<f64>,
    /// Of the rest position (m).
    start_m: Vec<f64>,
}

/// How accurate the measured strikers are, and what is said wrongly about right strikes.
pub(super) fn rows(saved: &Saved) -> Result<Vec<Row>, String> {
    let mut errors = Errors::default();
    let mut strikes = 0;
    for clip in &saved.clips {
        let Some(strike) = &clip.strike else { continue };
        strikes += 1;
        let Some(seen) = &clip.tracks.striker else { continue };
        let (speed, heading) = (seen.speed_m_s(), seen.heading_rad());
        errors.speed.push(speed.value / strike.speed_m_s - 1.0);
        errors.speed_stds.push((speed.value - strike.speed_m_s) / speed.std);
        let turn_rad = wrapped_rad(heading.value - strike.heading_rad);
        errors.heading_rad.push(turn_rad);
        errors.heading_stds.push(turn_rad / heading.std);
        let ahead = Vec2::from_heading(strike.heading_rad);
        errors.aside_m.push(ahead.cross(seen.middle().0 - strike.start_m));
        errors.start_m.extend(seen.start_m.map(|start| start.distance(strike.start_m)));
    }
    let right = answer(&saved.campaign, &saved.clips, Vec::new()).map_err(|e| e.to_string())?;
    let is_of_striker = |warning: &&String| LINES.iter().any(|line| warning.contains(line));
    let false_alarms = right.warnings.iter().filter(is_of_striker).count();
    let of = |what: &str, values: &[f64], scale: f64, unit| {
        let worst = mean_and_worst(values).1;
        [
            Row::plain(format!("{what}: rms error"), scale * rms(values), unit),
            Row::plain(format!("{what}: worst error"), scale * worst, unit),
        ]
    };
    let mut rows = vec![
        Row::plain(format!("clips whose striker is seen, of {strikes}"), errors.speed.len() as f64, ""),
        Row::plain("clips whose striker is seen at rest", errors.start_m.len() as f64, ""),
    ];
    rows.extend(of("speed", &errors.speed, 100.0, "%"));
    let mean_speed = mean_speed_errors(saved)?;
    rows.push(Row::plain("clips whose mean speed to the impact is measured", mean_speed.len() as f64, ""));
    rows.extend(of("mean speed to the impact", &mean_speed, 100.0, "%"));
    rows.extend(of("heading", &errors.heading_rad, 1f64.to_degrees(), "deg"));
    rows.extend(of("line, aside", &errors.aside_m, 1e3, "mm"));
    rows.extend(of("rest position", &errors.start_m, 1e3, "mm"));
    rows.push(Row::plain("speed: errors over their standard deviations, rms", rms(&errors.speed_stds), ""));
    rows.push(Row::plain(
        "heading: errors over their standard deviations, rms",
        rms(&errors.heading_stds),
        "",
    ));
    rows.push(Row::at_most("wrong lines about right strikes", false_alarms as f64, 0.0, ""));
    Ok(rows)
}

/// Errors of the mean speeds from the striker's first motion to the impact, as fractions.
fn mean_speed_errors(saved: &Saved) -> Result<Vec<f64>, String> {
    let Saved { campaign, clips } = saved;
    let fits = estimation(clips, &campaign.cell, &campaign.objects, &Options::default())
        .map_err(|e| e.to_string())?
        .clips;
    let error = |(clip, fit): (&ClipTracks, &ClipFit)| {
        let (strike, onset_s) = (clip.strike.as_ref()?, clip.tracks.striker_onset_s?);
        let impact = fit.impacts.first()?;
        let mean_m_s = impact.striker_distance_m? / (impact.time.value - onset_s.value);
        Some(mean_m_s / strike.speed_m_s - 1.0)
    };
    Ok(clips.iter().zip(&fits).filter_map(error).collect())
}
