//! `breakshot film`: records a film from a camera.

use crate::recording::{RecordArgs, Recording, Source, record};
use crate::{Outcome, console};
use breakshot::capture::Footage;
use breakshot::{Error, Result, files};
use serde::Serialize;
use std::path::Path;
use std::process::Command;

/// Gaps between pictures beyond this many intervals are missing pictures.
const GAP: f64 = 1.5;
/// Difference of the frame rate from the requested one that is reported.
const OTHER_RATE: f64 = 0.02;
/// Gaps that are named with their time.
const NAMED_GAPS: usize = 3;

/// Names of the mode of exposure, of which 1 is the manual one (`V4L2_EXPOSURE_MANUAL`), and of its time; the second ones are those of older
/// kernels.
const EXPOSURE_CONTROLS: [[&str; 2]; 2] =
    [["auto_exposure", "exposure_time_absolute"], ["exposure_auto", "exposure_absolute"]];

/// Records, reads the recording once, and reports what it contains and what is missing.
pub(crate) fn run(args: &RecordArgs) -> Result<Outcome> {
    check_settings(args)?;
    let mut warnings = exposure(args)?;
    let file = files::Unfinished::file(&args.output)?;
    let recording = Recording {
        source: &args.source,
        size: args.size,
        rate_hz: args.fps,
        coding: args.camera_coding.as_deref(),
        skipped_s: 0.0,
        seconds: args.seconds,
    };
    let bar =
        console::activity(if args.seconds.is_some() { "recording" } else { "recording; Ctrl-C ends it" });
    warnings.extend(record(&recording, &file.path())?);
    bar.finish_and_clear();
    let recorded = Recorded::read(&file.path(), &args.source)?;
    warnings.extend(recorded.warnings(args)?);
    file.finish()?;
    console::warn(&warnings);
    if args.json {
        console::print_json(&Printed { version: 1, recorded: &recorded, warnings: &warnings })?;
    } else {
        let [width, height] = recorded.size_px;
        println!(
            "{} pictures of {width} x {height} px in {:.2} s ({:.2} per second), {} missing",
            recorded.frames, recorded.duration_s, recorded.frame_rate_hz, recorded.missing_frames
        );
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::doubtful_if(!warnings.is_empty()))
}

/// Only a camera of this machine is set to a size, a rate, an exposure, a coding.
fn check_settings(args: &RecordArgs) -> Result<()> {
    let given = [
        ("--size", args.size.is_some()),
        ("--fps", args.fps.is_some()),
        ("--exposure-us", args.exposure_us.is_some()),
        ("--camera-coding", args.camera_coding.is_some()),
    ];
    match given.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) if !matches!(args.source, Source::Device(_)) => Err(Error::invalid(
            args.source.to_string(),
            flag,
            "given",
            "settings at the camera itself; only a camera of this machine (v4l2:/dev/video0) is set",
        )),
        _ => Ok(()),
    }
}

/// Fixes the exposure time of a camera of this machine; a warning where it may change during the recording.
fn exposure(args: &RecordArgs) -> Result<Vec<String>> {
    let Source::Device(device) = &args.source else {
        return Ok(match args.source {
            Source::Address(_) => {
                vec![format!(
                    "{}: whether its exposure is fixed is not known: fix it at the camera",
                    args.source
                )]
            }
            _ => Vec::new(),
        });
    };
    let control =
        |arguments: &[&str]| Command::new("v4l2-ctl").arg("-d").arg(device).args(arguments).output();
    let Some(exposure_us) = args.exposure_us else {
        let is_manual = EXPOSURE_CONTROLS.into_iter().any(|[mode, _]| {
            control(&["-C", mode])
                .is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim().ends_with(": 1"))
        });
        let warning = format!("{}: its exposure may change by itself; --exposure-us fixes it", args.source);
        return Ok(if is_manual { Vec::new() } else { vec![warning] });
    };
    // Video4Linux counts in 100 us.
    let units = ((exposure_us + 50) / 100).max(1);
    let mut found = String::new();
    for [mode, time] in EXPOSURE_CONTROLS {
        match control(&["-c", &format!("{mode}=1,{time}={units}")]) {
            Ok(output) if output.status.success() => return Ok(Vec::new()),
            Ok(output) => {
                let message = String::from_utf8_lossy(&output.stderr).replace(char::is_control, " ");
                found = format!("refused ({})", message.trim());
            }
            Err(error) => found = format!("not set: `v4l2-ctl` cannot be started ({error})"),
        }
    }
    let needed =
        "a camera whose exposure the program `v4l2-ctl` (package v4l-utils) can set, or no --exposure-us";
    Err(Error::invalid(args.source.to_string(), "--exposure-us", found, needed))
}

/// What a recording contains.
#[derive(Debug, Serialize)]
struct Recorded {
    frames: usize,
    size_px: [usize; 2],
    /// From the median interval (1/s).
    frame_rate_hz: f64,
    /// From the first picture to the last (s).
    duration_s: f64,
    missing_frames: usize,
    /// Beginning and missing pictures of each gap.
    #[serde(skip)]
    gaps: Vec<(f64, usize)>,
    /// What reading it reported.
    #[serde(skip)]
    notes: Vec<String>,
}

/// The output of `--json`.
#[derive(Serialize)]
struct Printed<'a> {
    version: u32,
    #[serde(flatten)]
    recorded: &'a Recorded,
    warnings: &'a [String],
}

impl Recorded {
    /// Reads the whole recording, so that it is known to be readable.
    fn read(path: &Path, source: &Source) -> Result<Self> {
        let footage = Footage::open(path)?;
        let (size_px, mut notes) = (footage.size_px(), footage.warnings().to_vec());
        let mut times_s = Vec::new();
        for frame in footage {
            times_s.push(frame?.time_s);
        }
        notes.sort();
        notes.dedup();
        if times_s.len() < 2 {
            let found = format!("{} pictures", times_s.len());
            return Err(Error::invalid(source.to_string(), "the recording", found, "two pictures or more"));
        }
        Ok(Self::of(&times_s, size_px, notes))
    }

    fn of(times_s: &[f64], size_px: [usize; 2], notes: Vec<String>) -> Self {
        let steps_s: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let mut sorted_s = steps_s.clone();
        sorted_s.sort_by(f64::total_cmp);
        let interval_s = sorted_s[sorted_s.len() / 2];
        let gap = |(&from_s, step_s): (&f64, &f64)| {
            (*step_s > GAP * interval_s).then(|| (from_s, (step_s / interval_s).round() as usize - 1))
        };
        let gaps: Vec<(f64, usize)> = times_s.iter().zip(&steps_s).filter_map(gap).collect();
        Self {
            frames: times_s.len(),
            size_px,
            frame_rate_hz: 1.0 / interval_s,
            duration_s: times_s[times_s.len() - 1] - times_s[0],
            missing_frames: gaps.iter().map(|(_, missing)| missing).sum(),
            gaps,
            notes,
        }
    }

    /// What is missing or other than requested; an error for another size.
    fn warnings(&self, args: &RecordArgs) -> Result<Vec<String>> {
        let [width, height] = self.size_px;
        if let Some([wanted_width, wanted_height]) = args.size
            && [wanted_width as usize / 2, wanted_height as usize / 2] != [width / 2, height / 2]
        {
            let found = format!("{wanted_width}x{wanted_height}, and the camera gives {width}x{height}");
            return Err(Error::invalid(
                args.source.to_string(),
                "--size",
                found,
                "a size that the camera has",
            ));
        }
        let mut warnings = self.notes.clone();
        if let Some(wanted_hz) = args.fps.filter(|hz| (self.frame_rate_hz / hz - 1.0).abs() > OTHER_RATE) {
            warnings.push(format!(
                "{}: the camera gives {:.2} pictures per second, not {wanted_hz}: less light, another --size or --camera-coding may allow it",
                args.source, self.frame_rate_hz
            ));
        }
        if self.missing_frames > 0 {
            let named: Vec<String> =
                self.gaps.iter().take(NAMED_GAPS).map(|(at, n)| format!("{n} after {at:.3} s")).collect();
            let more = if self.gaps.len() > NAMED_GAPS { ", .." } else { "" };
            warnings.push(format!(
                "{}: {} pictures are missing ({}{more}): a smaller size, a lower rate or a faster disk may help",
                args.source,
                self.missing_frames,
                named.join(", ")
            ));
        }
        Ok(warnings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_pictures_are_counted_from_the_times() {
        let times_s: Vec<f64> = [0, 1, 2, 5, 6, 7, 9, 10].map(|k| 0.01 * f64::from(k)).into();
        let recorded = Recorded::of(&times_s, [64, 48], Vec::new());
        assert_eq!((recorded.frames, recorded.missing_frames), (8, 3));
        assert_eq!(recorded.gaps.iter().map(|gap| gap.1).collect::<Vec<_>>(), [2, 1]);
        assert!((recorded.frame_rate_hz - 100.0).abs() < 1e-6 && (recorded.duration_s - 0.1).abs() < 1e-12);
    }
}
