//! What is kept of a clip, so that later clips can be added without its film.
//!
//! A record holds everything that the joint estimate asks of a clip: measurements with the covariance of their noise, and
//! what its noise and its frames around impacts say about those of all clips.

use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::estimate::clip_tracks::ClipTracks;
use crate::estimate::measure::ClipMeasurements;
use crate::evidence::{ClipRecord, Difference, Evidence, FilmedWith};
use crate::object::{self, Object, kind};
use crate::properties::Properties;

impl ClipMeasurements {
    /// As the properties keep it.
    fn kept(&self, tracks: &ClipTracks) -> Result<ClipRecord> {
        let measurements = serde_json::to_value(self)
            .map_err(|e| Error::invalid(&self.name, "evidence", e, "numbers that can be written"))?;
        let (clip, objects) = (self.name.clone(), self.objects.clone());
        Ok(ClipRecord { clip, fingerprint: fingerprint(tracks), objects, measurements })
    }

    pub(crate) fn from_kept(kept: &ClipRecord) -> Result<Self> {
        let owner = || format!("properties: evidence of `{}`", kept.clip);
        let mut record: Self = serde_json::from_value(kept.measurements.clone()).map_err(|e| {
            Error::invalid(owner(), "told", e, "what `breakshot estimate` of this version wrote")
        })?;
        if !record.measurements.is_valid() {
            let needed = "as many values and covariances as keys, all of them numbers";
            return Err(Error::invalid(owner(), "readings", "not sound", needed));
        }
        record.name.clone_from(&kept.clip);
        record.objects.clone_from(&kept.objects);
        Ok(record)
    }
}

/// The evidence of these clips.
pub(crate) fn evidence(
    records: &[ClipMeasurements],
    clips: &[ClipTracks],
    cell: &Cell,
    objects: &[Object],
) -> Result<Evidence> {
    let kept =
        records.iter().zip(clips).map(|(record, tracks)| record.kept(tracks)).collect::<Result<_>>()?;
    Ok(Evidence { filmed_with: FilmedWith::new(cell), objects: all_objects(None, objects), clips: kept })
}

/// Old objects and new ones, by name, without their weighed masses.
pub(crate) fn all_objects(old: Option<&Evidence>, new: &[Object]) -> Vec<Object> {
    let known = old.map_or(&[][..], |e| &e.objects);
    let mut all: Vec<Object> = new.to_vec();
    all.extend(known.iter().filter(|o| new.iter().all(|n| n.name != o.name)).cloned());
    for object in &mut all {
        object.mass_kg = None;
    }
    all.sort_by(|p, q| p.name.cmp(&q.name));
    all
}

/// The records of earlier clips, if new clips may join them.
///
/// # Errors
/// As [`check_basis`]; also evidence that does not hold what it must, and a clip that it knows by its content.
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
    evidence.clips.iter().map(ClipMeasurements::from_kept).collect()
}

/// The evidence of the properties, if clips of these names, cell and objects may join it.
///
/// # Errors
/// Properties without evidence; another reference, cell or object than theirs; a name that they know.
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
        check_alike(object, known)?;
    }
    for (k, name) in names.iter().enumerate() {
        if names[..k].contains(name) || evidence.clips.iter().any(|c| c.clip == *name) {
            let needed = "a name that no earlier clip has (films of one name are taken for one clip)";
            return Err(Error::invalid(format!("clip `{name}`"), "name", "that of an earlier clip", needed));
        }
    }
    Ok(evidence)
}

/// An error that names what a ruler measured otherwise than for the earlier clips.
fn check_alike(now: &Object, then: &Object) -> Result<()> {
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

/// An error that names a clip whose content is there already.
fn check_new(clips: &[ClipTracks], evidence: &Evidence) -> Result<()> {
    let mut known: Vec<(&str, String)> =
        evidence.clips.iter().map(|c| (c.clip.as_str(), c.fingerprint.clone())).collect();
    for clip in clips {
        let print = fingerprint(clip);
        if let Some((name, _)) = known.iter().find(|(_, p)| *p == print) {
            let found = format!("the one that is known as `{name}`");
            let owner = format!("clip `{}`", clip.name);
            return Err(Error::invalid(owner, "content", found, "every clip once"));
        }
        known.push((&clip.name, print));
    }
    Ok(())
}

/// A number that two clips share only if they are the same: FNV-1a over names, times and places.
fn fingerprint(clip: &ClipTracks) -> String {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    let mut hash = OFFSET;
    let mut eat = |bytes: &[u8]| {
        for byte in bytes {
            hash = (hash ^ u128::from(*byte)).wrapping_mul(PRIME);
        }
    };
    for track in &clip.tracks.tracks {
        eat(kind(&track.object).as_bytes());
        for sample in &track.samples {
            for number in [sample.time_s, sample.x_m, sample.y_m] {
                eat(&number.to_bits().to_le_bytes());
            }
        }
    }
    format!("{hash:032x}")
}
