//! What an estimate would be if the tracks had no error: the true poses of a cell's films, read as recorded tracks.
//!
//! The difference from the estimate of the films is due to the camera; the rest to what the bodies do, and how many impacts there are.

use crate::validate::Program;
use crate::validate::truth::Clip;
use breakshot::files;
use breakshot::properties::Properties;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Exposure that the cell file of the true poses states (s); zero is refused.
const EXPOSURE_S: f64 = 1e-6;
/// The standard deviation that the recorded tracks state (m).
const STD_M: f64 = 2e-5;

/// The properties by the true poses of the films in `folder`, whose copies as tables go to `output`; none if the estimate is refused.
pub(crate) fn properties(
    program: &Program,
    folder: &Path,
    clips: &BTreeMap<String, Clip>,
    frame_rate_hz: f64,
    output: &Path,
) -> Result<Option<Properties>, String> {
    let failed = |e: std::io::Error| format!("{}: {e}", output.display());
    fs::create_dir_all(output).map_err(failed)?;
    fs::copy(folder.join("objects.toml"), output.join("objects.toml")).map_err(failed)?;
    let cell = fs::read_to_string(folder.join("cell.toml")).map_err(failed)?;
    fs::write(output.join("cell.toml"), at_instants(&cell)).map_err(failed)?;
    let mut text = fs::read_to_string(folder.join("campaign.toml")).map_err(failed)?;
    for (video, clip) in clips {
        let recording = Path::new(video).with_extension("csv");
        text =
            text.replace(&format!("video = \"{video}\""), &format!("tracks = \"{}\"", recording.display()));
        fs::write(output.join(recording), table(clip, frame_rate_hz)).map_err(failed)?;
    }
    let (campaign, properties) = (output.join("campaign.toml"), output.join("properties.json"));
    fs::write(&campaign, text).map_err(failed)?;
    if let Err(reason) = program.estimate(&campaign, &properties, &output.join("tracks")) {
        println!("{}: {reason}", output.display());
        return Ok(None);
    }
    files::load_properties(&properties).map(Some).map_err(|e| e.to_string())
}

/// The cell file with an exposure of nearly zero: the true poses are those of instants.
fn at_instants(cell: &str) -> String {
    let others = cell.lines().filter(|line| !line.starts_with("exposure_s"));
    let lines = others.flat_map(|line| {
        let exposure = (line == "[camera]").then(|| format!("exposure_s = {EXPOSURE_S}"));
        std::iter::once(line.to_owned()).chain(exposure)
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The true poses of a film's frames, one row for each object and frame.
fn table(clip: &Clip, frame_rate_hz: f64) -> String {
    let mut text = "object,time_s,x_m,y_m,yaw_rad,std_m\n".to_owned();
    for (object, poses) in &clip.frames {
        for (k, [x_m, y_m, yaw_rad]) in poses.iter().enumerate() {
            let time_s = k as f64 / frame_rate_hz;
            let _ = writeln!(text, "{object},{time_s:.9},{x_m:.9},{y_m:.9},{yaw_rad:.9},{STD_M}");
        }
    }
    text
}
