//! Do lengths on the table fit the tags, and do the outlines touch when the objects meet?
//!
//! The tags' sizes and the distances of their centres are measured separately: where all tags look too wide, the centres are too far apart in
//! the cell, or the sizes too small.
//!
//! At an impact the outlines of two objects touch. Where they are apart or overlap in most impacts, the sizes of the objects or the
//! scale of the table are wrong; which of them, the objects of the impacts show.

use crate::cell::width_warning;
use crate::estimate::{ClipFit, ClipTracks};
use crate::object::{self, Object, kind};
use crate::statistics::median;
use crate::warning::{Cause, Warning};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// Fewest clips with impacts of an object that show its size: several impacts in a row overlap alike.
const FEWEST: usize = 3;
/// Sweeps over the objects, after which the errors of their radii change no more.
const SWEEPS: usize = 30;
/// An error of all lengths is reported from here on (as a fraction): rulers are better.
const LEAST_SCALE_ERROR: f64 = 0.01;
/// An error of one object's outline is reported from here on (as a fraction, and m).
const LEAST_SIZE_ERROR: f64 = 0.03;
const LEAST_SIZE_ERROR_M: f64 = 5e-4;

/// The gap between the outlines of two objects at an impact (m).
struct Gap<'a> {
    clip: &'a str,
    kinds: [&'a str; 2],
    distance_m: f64,
}

/// What the gaps at impacts say.
#[derive(Default)]
pub(super) struct Findings {
    pub warnings: Vec<Warning>,
    /// The error of all lengths on the table (as a fraction), if there is one.
    pub scale_error: Option<f64>,
}

/// A warning if the tags' sizes do not fit the distances of their centres, one if lengths on the table do not fit the objects, and one for each
/// object whose outline does not fit its impacts.
pub(super) fn findings(clips: &[ClipTracks], fits: &[ClipFit], objects: &[Object]) -> Findings {
    let (tags, outlines) = (of_tags(clips), of_outlines(fits, objects));
    Findings {
        warnings: [tags.warnings, outlines.warnings].concat(),
        scale_error: outlines.scale_error.or(tags.scale_error),
    }
}

/// What the tags' sizes say about the distances of their centres.
fn of_tags(clips: &[ClipTracks]) -> Findings {
    let ratios: Vec<f64> = clips.iter().filter_map(|clip| clip.tracks.tag_width_ratio).collect();
    let n = ratios.len();
    let Some(ratio) = median(ratios) else { return Findings::default() };
    let Some(warning) = width_warning(ratio) else { return Findings::default() };
    let text = format!("in {n} clips {warning} (median)");
    Findings { warnings: vec![Warning::new(Cause::Lengths, text)], scale_error: Some(ratio - 1.0) }
}

/// What the gaps between the outlines at impacts say.
fn of_outlines(fits: &[ClipFit], objects: &[Object]) -> Findings {
    let gaps: Vec<Gap> = fits
        .iter()
        .flat_map(|fit| fit.impacts.iter().map(|impact| (fit.name.as_str(), impact)))
        .filter_map(|(clip, impact)| {
            let a = impact.a.as_deref().filter(|a| object::find(objects, a, "impact").is_ok())?;
            let kinds = [kind(a), kind(&impact.b)];
            // A gap of exactly zero is assumed, not measured.
            (impact.gap_m != 0.0).then_some(Gap { clip, kinds, distance_m: impact.gap_m })
        })
        .collect();
    let errors_m = radius_errors_m(&gaps);
    let relative: BTreeMap<&str, f64> = errors_m
        .iter()
        .filter_map(|(&name, error_m)| {
            let area_m2 = object::find(objects, name, "impact").ok()?.shape.area_m2();
            Some((name, error_m / (area_m2 / PI).sqrt()))
        })
        .collect();
    let Some(scale) = median(relative.values().copied()) else { return Findings::default() };
    let alike = relative
        .values()
        .filter(|error| (*error - scale).abs() < LEAST_SCALE_ERROR.max(scale.abs() / 2.0))
        .count();
    let is_scale = relative.len() > 1 && scale.abs() > LEAST_SCALE_ERROR && 3 * alike >= 2 * relative.len();
    let common = if is_scale { scale } else { 0.0 };
    let mut warnings = Vec::new();
    if is_scale {
        let (percent, n) = (100.0 * scale.abs(), gaps.len());
        let (position, size) = if scale > 0.0 { ("apart", "large") } else { ("overlapping", "small") };
        warnings.push(format!(
            "in {n} impacts the outlines of the objects are {position} when they meet, as if lengths on the table were {percent:.1} % too \
             {size}: check size_m and center_m of the tags, or the sizes and height_m of all objects"
        ));
    }
    for (name, error) in relative {
        let error_m = errors_m[name];
        if (error - common).abs() > LEAST_SIZE_ERROR && error_m.abs() > LEAST_SIZE_ERROR_M {
            let (mm, larger) = (1e3 * error_m.abs(), if error_m > 0.0 { "larger" } else { "smaller" });
            warnings.push(format!(
                "the outline of `{name}` does not fit its impacts: it should be {mm:.1} mm {larger} on each side; check its size and height_m in objects.toml"
            ));
        }
    }
    let warnings = warnings.into_iter().map(|text| Warning::new(Cause::Lengths, text)).collect();
    Findings { warnings, scale_error: is_scale.then_some(scale) }
}

/// By how much the radius of each kind is too small (m): the gaps are the sums of two of them, and medians leave single wrong
/// impacts out.
fn radius_errors_m<'a>(gaps: &[Gap<'a>]) -> BTreeMap<&'a str, f64> {
    let mut errors_m: BTreeMap<&str, f64> = shown(gaps).into_iter().map(|name| (name, 0.0)).collect();
    for _ in 0..SWEEPS {
        let names: Vec<&str> = errors_m.keys().copied().collect();
        for name in names {
            let own = gaps.iter().filter_map(|gap| match gap.kinds {
                [a, b] if a == name && b == name => Some(gap.distance_m / 2.0),
                [a, b] if a == name => Some(gap.distance_m - errors_m.get(b)?),
                [a, b] if b == name => Some(gap.distance_m - errors_m.get(a)?),
                _ => None,
            });
            let error_m = median(own).unwrap_or(0.0);
            errors_m.insert(name, error_m);
        }
    }
    errors_m
}

/// The kinds whose sizes are shown: by impacts in enough clips, with other kinds that are shown.
fn shown<'a>(gaps: &[Gap<'a>]) -> BTreeSet<&'a str> {
    let mut kinds: BTreeSet<&str> = gaps.iter().flat_map(|gap| gap.kinds).collect();
    loop {
        let is_shown = |name: &&str| {
            let concerns =
                |gap: &&Gap| gap.kinds.contains(name) && gap.kinds.iter().all(|kind| kinds.contains(kind));
            let clips: BTreeSet<&str> = gaps.iter().filter(concerns).map(|gap| gap.clip).collect();
            clips.len() >= FEWEST
        };
        let shown: BTreeSet<&str> = kinds.iter().copied().filter(is_shown).collect();
        if shown.len() == kinds.len() {
            return shown;
        }
        kinds = shown;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impacts_in_one_clip_show_no_size() {
        let gap = |clip, kinds, distance_m| Gap { clip, kinds, distance_m };
        // `b` meets only `a`, in one clip twice: nothing says which of both is larger, or whether the clip is wrong.
        let mut gaps = vec![
            gap("1", ["a", "b"], 1e-3),
            gap("1", ["a", "b"], 1.2e-3),
            gap("2", ["a", "c"], 0.0),
            gap("3", ["b", "d"], 0.0),
            gap("4", ["a", "d"], 0.0),
            gap("5", ["b", "c"], 0.0),
        ];
        assert!(radius_errors_m(&gaps).is_empty());
        gaps.extend([gap("6", ["c", "d"], 0.0), gap("7", ["a", "b"], 1e-3), gap("8", ["a", "b"], 1e-3)]);
        assert_eq!(shown(&gaps), ["a", "b", "c", "d"].into());
    }
}
