//! What lies on the table, if nothing about the objects is known?
//!
//! Regions with an edge all around ([`regions`]) that differ from the table are objects; regions inside them are markers. Their edges are
//! measured to a fraction of a pixel ([`edges`]) in the plane of the objects' tops, and the simplest shape that fits ([`shape_fit`]) is the outline.

mod candidates;
mod contrast;
mod edges;
mod marker;
mod own_colour;
mod regions;
mod shape_fit;
#[cfg(test)]
mod tests;

use super::first_frames::{first_frames, mean_image};
use crate::capture::{Camera, Capture, GreyImage};
use crate::error::bounds::length;
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::object::{Object, Shape};
use candidates::{Candidate, TopSearch, Tops, tops};
use shape_fit::Fitted;
use std::collections::BTreeMap;

/// The heights of the objects' tops, which one picture does not show.
#[derive(Clone, Debug, PartialEq)]
pub struct Heights {
    /// The height of all objects that are not named (m).
    pub default_m: f64,
    /// Heights by the drafted name (m).
    pub named_m: BTreeMap<String, f64>,
}

impl Default for Heights {
    /// 20 mm for all objects.
    fn default() -> Self {
        Self { default_m: 0.02, named_m: BTreeMap::new() }
    }
}

/// An object as a picture shows it.
#[derive(Clone, Debug)]
pub struct Drafted {
    /// Outline and marker at the given height.
    pub object: Object,
    /// Where it lies.
    pub pose: Pose,
    /// Root mean square distance of the measured edges from the outline (m).
    pub rms_m: f64,
    /// Whether its marker is lighter than its top; `None` without a marker.
    pub light_marker: Option<bool>,
}

/// The objects of a picture, from left to right.
#[derive(Clone, Debug)]
pub struct Draft {
    /// The objects, named `object_1`, `object_2` and so on.
    pub objects: Vec<Drafted>,
    /// The picture.
    pub image: GreyImage,
    /// Its camera.
    pub camera: Camera,
    /// What was left out, and what is doubtful.
    pub warnings: Vec<String>,
}

/// A disc whose radius is that of the striker within this fraction is the striker.
const STRIKER_FRACTION: f64 = 0.05;
/// What has no marker and is at most as large may be one (m2): a disc of 20 mm.
const MARKER_SIZED_M2: f64 = 1.3e-3;

/// Everything that stands out from the table in a picture, or in the first frames of a film, as objects.
///
/// Outlines are measured in the plane of the given heights. `colours` are further planes of the same picture, as [`colours`](crate::capture::colours) gives them; they may be missing.
///
/// # Errors
/// A film that cannot be decoded, a height that is not a length, a height of an object that is not there, a picture without objects.
pub fn draft(capture: Capture, colours: Vec<GreyImage>, heights: &Heights) -> Result<Draft> {
    length("--height-m", "height_m", heights.default_m)?;
    for (name, height_m) in &heights.named_m {
        length("--height-m", name, *height_m)?;
    }
    let Capture { mut footage, camera, cell } = capture;
    let clip = footage.name().to_string();
    let image = mean_image(&first_frames(&clip, &mut footage)?);
    let mut warnings: Vec<String> = footage.warnings().to_vec();
    let planes: Vec<GreyImage> = std::iter::once(image).chain(colours).collect();
    let image = &planes[0];
    let same_size = |plane: &GreyImage| [plane.width, plane.height] == [image.width, image.height];
    let plain = if planes.iter().all(same_size) { planes.len() } else { 1 };
    let contrasts = contrast::contrasts(&planes[1..plain], &camera, &cell);
    let planes: Vec<GreyImage> = planes.into_iter().take(plain).chain(contrasts).collect();
    let image = &planes[0];
    let nothing = || Error::Markers {
        clip: clip.clone(),
        found: "nothing that stands out from the table".into(),
        needed: "objects whose tops differ from the table by 6 grey levels or more".into(),
    };
    let search = TopSearch::new(&planes, &camera, &cell, heights.default_m).ok_or_else(nothing)?;
    let Tops { mut found, is_complete } = tops(&search);
    if !is_complete {
        warnings.push(
            "the table shows too many outlines, as of a pattern: the weaker ones are not searched for objects".into(),
        );
    }
    // Numbers do not depend on the heights of single objects.
    found.sort_by(|a, b| {
        let at = |candidate: &Candidate| candidate.outline.pose.position;
        at(a).x.total_cmp(&at(b).x).then(at(a).y.total_cmp(&at(b).y))
    });
    warn_of_the_edge(&search, &mut warnings);
    let mut objects = Vec::new();
    found.retain(|candidate| !is_striker(&search, candidate, &mut warnings));
    for (k, candidate) in found.iter().enumerate() {
        let name = format!("object_{}", k + 1);
        let height_m = heights.named_m.get(&name).copied().unwrap_or(heights.default_m);
        let Some(top) = search.at_height(candidate, height_m) else {
            warnings.push(format!(
                "`{name}` has no outline at a height of {} mm: it is left out",
                1e3 * height_m
            ));
            continue;
        };
        objects.extend(drafted(&search, &top, name, &mut warnings));
    }
    if objects.is_empty() {
        return Err(nothing());
    }
    let names: Vec<String> = (1..=found.len()).map(|k| format!("object_{k}")).collect();
    if let Some(name) = heights.named_m.keys().find(|name| !names.contains(name)) {
        let needed = format!("one of object_1 to object_{}", found.len());
        return Err(Error::invalid("--height-m", "object", format!("`{name}`"), needed));
    }
    Ok(Draft { objects, image: image.clone(), camera, warnings })
}

/// Objects near the picture's edge have no edge all around: their workspace is named.
fn warn_of_the_edge(search: &TopSearch, warnings: &mut Vec<String>) {
    let corners = [search.cell.workspace.min_m, search.cell.workspace.max_m];
    let hidden =
        corners.iter().any(|&corner| !search.camera.shows(search.camera.pixel_from_table(corner, 0.0)));
    if hidden {
        warnings.push(
            "the picture does not show the whole workspace: objects that its edge cuts are left out".into(),
        );
    }
}

/// The object of a region; `None` for the striker, and without a shape that fits.
fn drafted(search: &TopSearch, top: &Candidate, name: String, warnings: &mut Vec<String>) -> Option<Drafted> {
    let Candidate { outline, height_m, .. } = top;
    let at = outline.pose.position;
    let place = format!("at ({:.0}, {:.0}) mm", 1e3 * at.x, 1e3 * at.y);
    if is_concave(&outline.shape) {
        warnings.push(format!(
            "the outline of `{name}` {place} is concave: if it is two objects that touch, move them apart"
        ));
    }
    let marked = marker::marked(search, top, &name, warnings);
    let (shape, marker) = (marked.outline.shape, marked.marker);
    if marker.is_none() && shape.area_m2() <= MARKER_SIZED_M2 {
        warnings.push(format!(
            "`{name}` {place} has the size of a marker: if it is one, the top around it does not differ enough from the table"
        ));
    }
    let mut object = Object { name, shape, height_m: *height_m, marker, mass_kg: None, support: None };
    if let Err(error) = object.check() {
        warnings.push(format!("what lies {place} is left out: {error}"));
        return None;
    }
    Some(Drafted {
        object,
        pose: marked.outline.pose,
        rms_m: marked.outline.rms_m,
        light_marker: marked.light,
    })
}

/// Whether an object is the striker, which is left out with a warning.
fn is_striker(search: &TopSearch, candidate: &Candidate, warnings: &mut Vec<String>) -> bool {
    let striker = &search.cell.striker;
    let Shape::Disc { radius_m: given_m } = striker.shape else { return false };
    let view = search.view(candidate.plane, striker.height_m);
    let Some(Fitted { shape: Shape::Disc { radius_m }, pose, .. }) = view.outline(&candidate.region) else {
        return false;
    };
    let is_striker = given_m > 0.0 && (radius_m - given_m).abs() < STRIKER_FRACTION * given_m;
    if is_striker {
        let at = pose.position;
        let place = format!("at ({:.0}, {:.0}) mm", 1e3 * at.x, 1e3 * at.y);
        warnings.push(format!("the disc {place} has the striker's size: it is left out"));
    }
    is_striker
}

/// Whether a polygon turns to the right somewhere.
fn is_concave(shape: &Shape) -> bool {
    let corners = shape.corners();
    let n = corners.len();
    (0..n)
        .any(|k| (corners[(k + 1) % n] - corners[k]).cross(corners[(k + 2) % n] - corners[(k + 1) % n]) < 0.0)
}
