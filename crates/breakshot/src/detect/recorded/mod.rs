//! Tracks that something else than this project measured: motion capture, or another tracker.
//!
//! A table of positions becomes the same [`Tracks`] as a film: its samples get their noise and their derivatives as those
//! of a film do.

mod table;

use super::tracks::{Sample, Track, Tracks};
use super::{derivatives, postprocess};
use crate::cell::Workspace;
use crate::columns::Columns;
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::retiming::Retiming;
use crate::statistics::sorted_by_value;
use crate::uncertain::Measured;
use std::f64::consts::TAU;
use table::{Row, Table, syntax};

/// A file of tracks and how to read it.
#[derive(Clone, Copy, Debug)]
pub struct Recording<'a> {
    /// The file's name, for messages.
    pub name: &'a str,
    /// Its content: a table (CSV), or JSON as `breakshot detect` writes it.
    pub text: &'a str,
    /// What the columns of a table hold; `None` for those that `breakshot detect` writes.
    pub columns: Option<&'a Columns>,
    /// The rate at which the samples were taken, where the file says another or no times (Hz).
    pub frame_rate_hz: Option<f64>,
}

/// The standard deviation of a position that says nothing of its own (m); it is raised to the scatter about smooth motion.
const ASSUMED_STD_M: f64 = 5e-5;
/// Windows of samples that last longer (s) usually contain a strike, an impact or a stop, which is no noise along the motion.
const LONGEST_SMOOTH_S: f64 = 0.1;
/// A position further from the origin is a mistake (m), and so is a time (s).
const FURTHEST_M: f64 = 1e4;
const LATEST_S: f64 = 1e11;
/// Times are counted from the first one if that is later: those of a clock, whose last digits would be lost.
const LATEST_START_S: f64 = 1e4;
/// Positions that extend over so many times the workspace are in another unit.
const WIDEST: f64 = 20.0;

/// The tracks of `names` in a recording.
///
/// ```
/// use breakshot::cell::Workspace;
/// use breakshot::detect::{Recording, recorded_tracks};
///
/// let text = "object,time_s,x_m,y_m\npuck,0.00,0.10,0.02\npuck,0.01,0.11,0.02\npuck,0.02,0.12,0.02\n";
/// let recording = Recording { name: "run.csv", text, columns: None, frame_rate_hz: None };
/// let tracks = recorded_tracks(&recording, &["puck".into()], &Workspace::centred([0.4, 0.3]))?;
/// let vx_m_s = tracks.tracks[0].samples[1].vx_m_s.expect("a velocity");
/// assert!((vx_m_s - 1.0).abs() < 1e-9, "{vx_m_s} m/s");
/// # Ok::<(), breakshot::Error>(())
/// ```
///
/// # Errors
/// A table without the columns, a field that is not a number, times that do not grow, no position of an object, positions
/// far outside the workspace; each names the file and, of a field, line and column.
pub fn recorded_tracks(recording: &Recording, names: &[String], workspace: &Workspace) -> Result<Tracks> {
    let mut tracks = if recording.text.trim_start().starts_with('{') {
        let mut tracks = from_json(recording, names)?;
        let Tracks { tracks: objects, striker, striker_onset_s, .. } = &mut tracks;
        let of_striker = striker.iter_mut().flat_map(|striker| &mut striker.samples).map(|s| &mut s.time_s);
        let striker_s = of_striker.chain(striker_onset_s.as_mut().map(|onset_s| &mut onset_s.value));
        retime(objects, striker_s, recording.frame_rate_hz);
        tracks
    } else {
        let mut tracks = from_table(recording, names)?;
        count_from_the_start(&mut tracks);
        retime(
            &mut tracks,
            std::iter::empty(),
            recording.frame_rate_hz.filter(|_| columns(recording).time.is_some()),
        );
        // Another instrument may be noisier along the motion than perpendicular to it.
        let unsmooth = postprocess::scale_noise(&mut tracks);
        let window_s =
            tracks.iter().filter_map(|track| derivatives::window_s(&track.samples)).fold(0.0, f64::max);
        if window_s <= LONGEST_SMOOTH_S {
            for sample in tracks.iter_mut().flat_map(|track| &mut track.samples) {
                sample.std_m *= unsmooth;
            }
        }
        let warnings = tracks.iter().filter_map(gap_warning).collect();
        Tracks { version: 1, tracks, warnings, ..Tracks::default() }
    };
    for track in &mut tracks.tracks {
        derivatives::fill(&mut track.samples);
    }
    recording.name.clone_into(&mut tracks.video);
    check_extent(recording.name, &tracks.tracks, workspace)?;
    Ok(tracks)
}

fn columns(recording: &Recording) -> Columns {
    recording.columns.cloned().unwrap_or_else(Columns::of_detect)
}

/// Where a table holds what is known of an object.
struct Places {
    x: usize,
    y: usize,
    yaw: Option<usize>,
    std: Option<usize>,
}

/// What is common to all rows of a table.
struct Reader<'a> {
    columns: Columns,
    time: Option<usize>,
    recording: &'a Recording<'a>,
}

fn from_table(recording: &Recording, names: &[String]) -> Result<Vec<Track>> {
    let table = Table::new(recording.name, recording.text)?;
    let columns = columns(recording);
    columns.check(recording.name, names, recording.frame_rate_hz)?;
    let time = columns.time.as_deref().map(|time| table.column(time)).transpose()?;
    let reader = Reader { columns, time, recording };
    let mut tracks: Vec<Track> =
        names.iter().map(|name| Track { object: name.clone(), samples: Vec::new() }).collect();
    if reader.columns.objects.is_empty() {
        reader.read_objects(&table, &mut tracks)?;
    } else {
        reader.read_instants(&table, &mut tracks)?;
    }
    Ok(tracks)
}

impl Reader<'_> {
    /// A table with one row for each object and instant.
    fn read_objects(&self, table: &Table, tracks: &mut [Track]) -> Result<()> {
        let Columns { object, x, y, yaw, std, names, .. } = &self.columns;
        let needed = |column: &Option<String>| table.column(column.as_deref().unwrap_or_default());
        let object = needed(object)?;
        // The columns that `breakshot detect` may leave out
        let known = |column: &Option<String>| match column {
            Some(column) if self.recording.columns.is_some() => table.column(column).map(Some),
            column => Ok(column.as_deref().and_then(|column| table.optional_column(column))),
        };
        let places = Places { x: needed(x)?, y: needed(y)?, yaw: known(yaw)?, std: known(std)? };
        let called: Vec<String> =
            tracks.iter().map(|t| names.get(&t.object).unwrap_or(&t.object).clone()).collect();
        let mut others: Vec<String> = Vec::new();
        let mut rows = vec![0; tracks.len()];
        for row in table.rows() {
            let row = row?;
            let name = row.text(object);
            match called.iter().position(|called| called == name) {
                Some(k) => {
                    self.add(&row, &places, rows[k], &mut tracks[k])?;
                    rows[k] += 1;
                }
                None if others.len() < MOST_LISTED && !others.iter().any(|o| o == name) => {
                    others.push(name.chars().take(30).collect());
                }
                None => {}
            }
        }
        let Some(k) = tracks.iter().position(|track| track.samples.is_empty()) else { return Ok(()) };
        let found =
            if others.is_empty() { String::new() } else { format!("; others are `{}`", others.join("`, `")) };
        Err(self.no_position(&format!("`{}`{found}", called[k]), &tracks[k].object))
    }

    /// A table with one row for each instant.
    fn read_instants(&self, table: &Table, tracks: &mut [Track]) -> Result<()> {
        let std = self.columns.std.as_deref().map(|std| table.column(std)).transpose()?;
        let places = tracks.iter().map(|track| {
            let own = &self.columns.objects[&track.object];
            let yaw = own.yaw.as_deref().map(|yaw| table.column(yaw)).transpose()?;
            Ok(Places { x: table.column(&own.x)?, y: table.column(&own.y)?, yaw, std })
        });
        let places: Vec<Places> = places.collect::<Result<_>>()?;
        for (number, row) in table.rows().enumerate() {
            let row = row?;
            for (track, places) in tracks.iter_mut().zip(&places) {
                self.add(&row, places, number, track)?;
            }
        }
        let empty = tracks.iter().find(|track| track.samples.is_empty());
        empty.map_or(Ok(()), |track| Err(self.no_position("it", &track.object)))
    }

    fn no_position(&self, of: &str, object: &str) -> Error {
        let needed = format!("rows with the positions of `{object}`");
        syntax(self.recording.name, &format!("no position of {of}; needed: {needed}"))
    }

    /// Adds the sample of a row to a track, if the object was seen in it.
    fn add(&self, row: &Row, places: &Places, number: usize, track: &mut Track) -> Result<()> {
        // Time
        let units = &self.columns;
        let last = track.samples.last();
        let time_s = match self.time {
            None => number as f64 / self.recording.frame_rate_hz.unwrap_or(1.0),
            Some(column) => {
                let time = row.number(column)?.ok_or_else(|| row.wrong(column, "the time of the row"))?;
                let time_s = time / units.time_unit.per_second();
                if time_s.abs() > LATEST_S {
                    return Err(row.wrong(column, "a time; is `time_unit` right?"));
                }
                if let Some(last) = last.filter(|last| last.time_s >= time_s) {
                    let needed =
                        format!("times that grow (`{}` was seen at {} s before)", track.object, last.time_s);
                    return Err(row.wrong(column, &needed));
                }
                time_s
            }
        };

        // Pose
        let length_m = |column: usize| -> Result<Option<f64>> {
            let length_m = row.number(column)?.map(|length| length / units.length_unit.per_metre());
            match length_m {
                Some(length_m) if length_m.abs() > FURTHEST_M => {
                    Err(row.wrong(column, "a position within 10 km; is `length_unit` right?"))
                }
                length_m => Ok(length_m),
            }
        };
        let (Some(x_m), Some(y_m)) = (length_m(places.x)?, length_m(places.y)?) else { return Ok(()) };
        let yaw = places.yaw.map_or(Ok(None), |column| row.number(column))?;
        let known_rad = track.samples.iter().rev().find_map(|sample| sample.yaw_rad);
        let yaw_rad = yaw.map(|yaw| unwound_rad(known_rad, units.angle_unit.radians(yaw)));

        // Noise
        let std_m = match places.std {
            Some(column) => match length_m(column)? {
                Some(std_m) if std_m > 0.0 => std_m,
                None => ASSUMED_STD_M,
                Some(_) => return Err(row.wrong(column, "a positive standard deviation")),
            },
            None => units.std_m.unwrap_or(ASSUMED_STD_M),
        };
        track.samples.push(Sample::new(time_s, Point::new(x_m, y_m), yaw_rad, std_m));
        Ok(())
    }
}

/// Names that a message lists at most.
const MOST_LISTED: usize = 10;

/// The angle, modulo a revolution, that is nearest to the last known one (rad).
fn unwound_rad(last_rad: Option<f64>, angle_rad: f64) -> f64 {
    let revolutions = last_rad.map_or(0.0, |last_rad| ((last_rad - angle_rad) / TAU).round());
    angle_rad + revolutions * TAU
}

/// Tracks as `breakshot detect` and `breakshot estimate --tracks` write them, complete with noise.
fn from_json(recording: &Recording, names: &[String]) -> Result<Tracks> {
    let name = recording.name;
    if recording.columns.is_some() {
        return Err(Error::invalid(
            name,
            "columns",
            "given for a JSON file",
            "a table (CSV), or no `columns`",
        ));
    }
    let mut all: Tracks =
        serde_json::from_str(recording.text).map_err(|e| syntax(name, &format!("{e}; needed: tracks")))?;
    let mut tracks = Vec::new();
    for object in names {
        let Some(track) = all.tracks.iter().find(|t| t.object == *object && !t.samples.is_empty()) else {
            let found: Vec<&str> = all.tracks.iter().take(MOST_LISTED).map(|t| t.object.as_str()).collect();
            let problem = format!(
                "no position of `{object}`; needed: it among the tracks, which are `{}`",
                found.join("`, `")
            );
            return Err(syntax(name, &problem));
        };
        for (k, sample) in track.samples.iter().enumerate() {
            let problem = |what: &str, found: f64, needed: &str| {
                syntax(name, &format!("`{object}`, sample {}: {what} is {found}; needed: {needed}", k + 1))
            };
            if sample.time_s.abs() > LATEST_S || k > 0 && track.samples[k - 1].time_s >= sample.time_s {
                return Err(problem("time_s", sample.time_s, "times that grow"));
            }
            for (what, value) in [("x_m", sample.x_m), ("y_m", sample.y_m)] {
                if value.abs() > FURTHEST_M {
                    return Err(problem(what, value, "a position within 10 km"));
                }
            }
            if !(sample.std_m > 0.0 && sample.std_m < FURTHEST_M) {
                return Err(problem("std_m", sample.std_m, "a positive standard deviation"));
            }
            if !(0.0..sample.std_m).contains(&sample.pose_std_m) {
                return Err(problem(
                    "pose_std_m",
                    sample.pose_std_m,
                    "less than std_m, of which it is a part",
                ));
            }
        }
        tracks.push(track.clone());
    }
    all.tracks = tracks;
    if let Some(striker) = &all.striker {
        striker.check(name)?;
    }
    if let Some(ratio) = all.tag_width_ratio
        && !(ratio.is_finite() && ratio > 0.0)
    {
        return Err(Error::invalid(name, "tag_width_ratio", ratio, "a positive number"));
    }
    if all.camera_position_m.is_some_and(|position| !position.iter().all(|m| m.is_finite())) {
        return Err(Error::invalid(name, "camera_position_m", "not a number", "three numbers"));
    }
    if let Some(Measured { value, std }) = all.striker_onset_s
        && !(value.is_finite() && std.is_finite() && std > 0.0)
    {
        let found = format!("{value} +- {std}");
        return Err(Error::invalid(name, "striker_onset_s", found, "a time and a positive deviation"));
    }
    Ok(all)
}

/// Sets the times to those of frames at this rate.
fn retime<'a>(tracks: &mut [Track], striker_s: impl Iterator<Item = &'a mut f64>, rate_hz: Option<f64>) {
    let Some(rate_hz) = rate_hz else { return };
    let samples = || tracks.iter().flat_map(|track| &track.samples);
    let mut file_s = sorted_by_value(samples().map(|sample| sample.time_s).collect::<Vec<_>>(), |t| *t);
    file_s.dedup();
    let first = &file_s[..file_s.len().min(Retiming::FIRST_FRAMES)];
    let Some(mut retiming) = Retiming::new(rate_hz, first) else { return };
    let true_s: Vec<f64> = file_s.iter().map(|t| retiming.time_s(*t)).collect();
    for sample in tracks.iter_mut().flat_map(|track| &mut track.samples) {
        let frame = file_s.partition_point(|t| *t < sample.time_s);
        sample.time_s = true_s[frame];
    }
    // A rolling shutter exposes the striker at other times than the objects.
    for time_s in striker_s {
        let after = file_s.partition_point(|t| t <= time_s).clamp(1, file_s.len() - 1);
        let (from_s, to_s) = (file_s[after - 1], file_s[after]);
        let part = (*time_s - from_s) / (to_s - from_s);
        *time_s = true_s[after - 1] + part * (true_s[after] - true_s[after - 1]);
    }
}

/// Counts the times from the first one where they are those of a clock.
fn count_from_the_start(tracks: &mut [Track]) {
    let starts = tracks.iter().filter_map(|track| track.samples.first());
    let start_s = starts.map(|sample| sample.time_s).fold(f64::INFINITY, f64::min);
    if start_s.abs() > LATEST_START_S && start_s.is_finite() {
        for sample in tracks.iter_mut().flat_map(|track| &mut track.samples) {
            sample.time_s -= start_s;
        }
    }
}

/// A warning if samples are missing.
fn gap_warning(track: &Track) -> Option<String> {
    let steps = || track.samples.windows(2).map(|pair| pair[1].time_s - pair[0].time_s);
    let usual_s = derivatives::usual_interval_s(&track.samples)?;
    let missing = |step: f64| (step / usual_s).round() - 1.0;
    let first = steps().position(|step| missing(step) >= 1.0)?;
    let count: f64 = steps().map(missing).filter(|missing| *missing >= 1.0).sum();
    let first_s = track.samples[first].time_s;
    Some(format!("{count:.0} samples of `{}` are missing, the first ones after {first_s:.3} s", track.object))
}

/// An error if the positions extend over many times the workspace.
fn check_extent(name: &str, tracks: &[Track], workspace: &Workspace) -> Result<()> {
    let widest_m = WIDEST * (workspace.max_m - workspace.min_m).length();
    for axis in [|s: &Sample| s.x_m, |s: &Sample| s.y_m] {
        let values: Vec<f64> = tracks.iter().flat_map(|t| &t.samples).map(axis).collect();
        let values = sorted_by_value(values, |v| *v);
        // Without the outermost tenths, which may be mistakes of a tracker
        let (low, high) = (values.len() / 10, values.len() - 1 - values.len() / 10);
        let extent_m = values[high] - values[low];
        if extent_m > widest_m {
            let found = format!("{extent_m:.0} m wide");
            let needed = format!(
                "positions in the workspace, {:.2} m across; is `length_unit` right?",
                widest_m / WIDEST
            );
            return Err(Error::invalid(name, "the area of the positions", found, needed));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
