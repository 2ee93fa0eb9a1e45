//! How are the measurements of a clip stored, so that later clips can be added without its film?
//!
//! A record in the evidence of the properties holds all that the joint estimate needs of a clip: its measurements with their
//! covariance, its noise statistics, and the chi-square of its frames around impacts for every candidate exposure.

use crate::cell::Cell;
use crate::detect::Track;
use crate::error::{Error, Result};
use crate::estimate::clip_tracks::ClipTracks;
use crate::estimate::measure::ClipMeasurements;
use crate::fingerprint::Fingerprint;
use crate::object::{self, Object, kind};
use crate::properties::Properties;
use crate::properties::evidence::{ClipRecord, Difference, Evidence, FilmedWith};
use std::collections::{BTreeMap, BTreeSet};

impl ClipMeasurements {
    /// The record of this clip in the evidence.
    fn record(&self, tracks: &ClipTracks) -> Result<ClipRecord> {
        let content = serde_json::to_value(self)
            .map_err(|e| Error::invalid(&self.name, "evidence", e, "numbers that can be written"))?;
        let (clip, objects) = (self.name.clone(), self.objects.clone());
        Ok(ClipRecord { clip, fingerprint: fingerprint(tracks), objects, measurements: content })
    }

    /// The measurements of a stored record.
    ///
    /// # Errors
    /// A record that does not have the format of this version, or has lists of different lengths or values that are not finite, or
    /// a matrix that is no covariance.
    pub(crate) fn from_evidence(record: &ClipRecord) -> Result<Self> {
        let owner = || format!("properties: evidence of `{}`", record.clip);
        let mut measurements: Self = serde_json::from_value(record.measurements.clone()).map_err(|e| {
            Error::invalid(owner(), "told", e, "what `breakshot estimate` of this version wrote")
        })?;
        if !measurements.measurements.is_valid() {
            let needed = "as many values and covariances as keys, all of them finite numbers";
            return Err(Error::invalid(owner(), "readings", "not valid", needed));
        }
        measurements.measurements.named_covariance().check(&owner())?;
        if measurements.tilt.is_some_and(|tilt| !tilt.is_valid()) {
            return Err(Error::invalid(
                owner(),
                "tilt",
                "not valid",
                "finite numbers and no negative information",
            ));
        }
        if measurements.supports.iter().any(|s| !(s.log_ratio.value.is_finite() && s.log_ratio.std > 0.0)) {
            return Err(Error::invalid(
                owner(),
                "supports",
                "not valid",
                "finite numbers and positive errors",
            ));
        }
        measurements.name.clone_from(&record.clip);
        measurements.objects.clone_from(&record.objects);
        Ok(measurements)
    }
}

/// The evidence of these clips: cell, objects, and one record per clip.
pub(crate) fn evidence(
    measurements: &[ClipMeasurements],
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
) -> Result<Evidence> {
    let records =
        measurements.iter().zip(clips).map(|(clip, tracks)| clip.record(tracks)).collect::<Result<_>>()?;
    Ok(Evidence { filmed_with: FilmedWith::new(cell), objects: all_objects(None, objects), clips: records })
}

/// Old and new objects in alphabetical order, without their weighed masses; a new object replaces an old one of its name.
pub(crate) fn all_objects(old: Option<&Evidence>, new: &[Object]) -> Vec<Object> {
    let known = old.map_or(&[][..], |e| &e.objects);
    let mut all: Vec<Object> = new.to_vec();
    all.extend(known.iter().filter(|o| new.iter().all(|n| n.name != o.name)).cloned());
    for object in &mut all {
        object.mass_kg = None;
    }
    all.sort_unstable_by(|p, q| p.name.cmp(&q.name));
    all
}

/// The measurements of the earlier clips, if the new clips are compatible with them.
///
/// # Errors
/// As [`check_basis`]; also damaged evidence, and a clip whose tracks the evidence already contains.
pub(crate) fn earlier(
    old: &Properties,
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
    reference: Option<&str>,
) -> Result<Vec<ClipMeasurements>> {
    let names: Vec<&str> = clips.iter().map(|c| c.name.as_str()).collect();
    let evidence = check_basis(old, &names, cell, objects, reference)?;
    check_new(clips, evidence)?;
    for record in &evidence.clips {
        for name in &record.objects {
            object::find(&evidence.objects, name, &format!("properties: evidence of `{}`", record.clip))?;
        }
    }
    evidence.clips.iter().map(ClipMeasurements::from_evidence).collect()
}

/// The evidence of the properties, if it is compatible with clips of these names, this cell and these objects.
///
/// # Errors
/// Properties without evidence; another reference, cell or object than that of the earlier clips; the name of an earlier clip.
pub(crate) fn check_basis<'a>(
    old: &'a Properties,
    names: &[&str],
    cell: &Cell,
    objects: &[Object],
    reference: Option<&str>,
) -> Result<&'a Evidence> {
    let Some(evidence) = &old.evidence else {
        let needed = "the `evidence` that `breakshot estimate` writes into properties.json";
        return Err(Error::invalid("properties", "evidence", "missing", needed));
    };
    if let Some(asked) = reference.filter(|name| *name != old.reference) {
        let needed = format!("`{}`, to which the masses of the properties refer", old.reference);
        return Err(Error::invalid("estimate", "reference", format!("`{asked}`"), needed));
    }
    if let Some(Difference { part, now, before }) = FilmedWith::new(cell).difference(&evidence.filmed_with) {
        let needed = format!("{before}, as for the clips of the properties");
        return Err(Error::invalid("cell", part, now, needed));
    }
    for object in objects {
        let Some(known) = evidence.objects.iter().find(|o| o.name == object.name) else { continue };
        check_same_object(object, known)?;
    }
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) || evidence.clips.iter().any(|c| c.clip == *name) {
            let needed = "a name that no earlier clip has (films of one name are taken for one clip)";
            return Err(Error::invalid(format!("clip `{name}`"), "name", "that of an earlier clip", needed));
        }
    }
    Ok(evidence)
}

/// Checks that height, outline and marker are those of the earlier clips; the error names the difference.
fn check_same_object(now: &Object, then: &Object) -> Result<()> {
    let differs = |what: &str, now_is: String, then_was: String| {
        let needed = format!("{then_was}, as for the clips of the properties");
        Err(Error::invalid(format!("object `{}`", now.name), what, now_is, needed))
    };
    if now.height_m != then.height_m {
        return differs("height_m", now.height_m.to_string(), then.height_m.to_string());
    }
    if now.shape != then.shape {
        return differs("shape", format!("{:?}", now.shape), format!("{:?}", then.shape));
    }
    if now.marker != then.marker {
        return differs("marker", format!("{:?}", now.marker), format!("{:?}", then.marker));
    }
    Ok(())
}

/// Checks that the evidence does not contain the tracks of a clip; the error names both.
fn check_new(clips: &[ClipTracks], evidence: &Evidence) -> Result<()> {
    for clip in clips {
        let print = fingerprint(clip);
        if let Some(known) = evidence.clips.iter().find(|known| known.fingerprint == print) {
            return Err(given_twice(&clip.name, &known.clip));
        }
    }
    Ok(())
}

/// Checks that no two clips show the same motion; the error names both.
///
/// Their objects may have exchanged names: a motion is compared with those of all objects.
///
/// # Errors
/// Two clips with a track of the same times and positions, in which the object moves.
pub(crate) fn check_distinct(clips: &[ClipTracks]) -> Result<()> {
    let mut known: BTreeMap<Fingerprint, &str> = BTreeMap::new();
    for clip in clips {
        let moving = clip.tracks.tracks.iter().filter(|track| has_moved(track));
        let prints: BTreeSet<Fingerprint> =
            moving.map(|track| motion_hash(Fingerprint::default(), track)).collect();
        for print in prints {
            if let Some(other) = known.insert(print, &clip.name) {
                return Err(given_twice(&clip.name, other));
            }
        }
    }
    Ok(())
}

fn given_twice(clip: &str, known: &str) -> Error {
    let found = format!("the one that is known as `{known}`");
    Error::invalid(format!("clip `{clip}`"), "content", found, "every clip once")
}

/// Whether an object moves by more than what any noise does; one at rest may have equal tracks in several clips.
fn has_moved(track: &Track) -> bool {
    const MOVED_M: f64 = 0.005;
    let Some(first) = track.samples.first() else { return false };
    track.samples.iter().any(|sample| sample.position().distance(first.position()) > MOVED_M)
}

/// Hash of the kinds of objects, times and positions of a clip (FNV-1a, 128 bits).
fn fingerprint(clip: &ClipTracks) -> String {
    let mut hash = Fingerprint::default();
    for track in &clip.tracks.tracks {
        hash = hash.with(kind(&track.object).as_bytes());
        hash = motion_hash(hash, track);
    }
    hash.to_string()
}

/// A hash continued by the times and positions of a track.
fn motion_hash(hash: Fingerprint, track: &Track) -> Fingerprint {
    let numbers = track.samples.iter().flat_map(|sample| [sample.time_s, sample.x_m, sample.y_m]);
    numbers.fold(hash, |hash, number| hash.with(&number.to_bits().to_le_bytes()))
}
