//! What lies on the table, if nothing about the objects is known?
//!
//! Regions with an edge all around ([`regions`]) that differ from the table are objects; regions inside them are markers. Their edges are
//! measured to a fraction of a pixel ([`edges`]) in the plane of the objects' tops, and the simplest shape that fits ([`shape_fit`]) is the outline.

mod edges;
mod marker;
mod regions;
mod shape_fit;
#[cfg(test)]
mod tests;

use super::first_frames::{first_frames, mean_image};
use super::label::Window;
use crate::capture::{Camera, Capture, GreyImage};
use crate::cell::Cell;
use crate::error::bounds::length;
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point, Pose};
use crate::object::{Object, Shape};
use crate::statistics::median;
use edges::TopView;
use regions::{Region, regions};
use shape_fit::{Fitted, fitted};
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

/// Area of an object's outline (m2): from a coin of 11 mm to a plate of 200 mm.
const AREAS_M2: [f64; 2] = [1e-4, 0.04];
/// Least step of grey level around an object, and difference of its top from the table: steps of noise are below two levels in the mean of nine pixels.
const LEAST_STRENGTH: f64 = 6.0;
/// A marker covers at most this fraction of its object's top.
const MARKER_FRACTION: f64 = 0.5;
/// Regions whose areas differ by less than this fraction have the same border.
const SAME_BORDER: f64 = 0.06;
/// Distance from an object at which the table is read (m), beyond lines that are drawn on it.
const TABLE_AT_M: [f64; 3] = [3e-3, 4.5e-3, 6e-3];
/// Distances from the outline within which edges are searched, round by round (px).
const REACHES_PX: [f64; 4] = [4.0, 3.0, 2.0, 2.0];
/// Spacing of the points of an outline (px).
const SPACING_PX: f64 = 1.0;
/// A disc whose radius is that of the striker within this fraction is the striker.
const STRIKER_FRACTION: f64 = 0.05;

/// Everything that stands out from the table in a picture, or in the first frames of a film, as objects.
///
/// Outlines are measured in the plane of the given heights.
///
/// # Errors
/// A film that cannot be decoded, a height that is not a length, a height of an object that is not there, a picture without objects.
pub fn draft(capture: Capture, heights: &Heights) -> Result<Draft> {
    length("--height-m", "height_m", heights.default_m)?;
    for (name, height_m) in &heights.named_m {
        length("--height-m", name, *height_m)?;
    }
    let Capture { mut footage, camera, cell } = capture;
    let clip = footage.name().to_string();
    let image = mean_image(&first_frames(&clip, &mut footage)?);
    let mut warnings: Vec<String> = footage.warnings().to_vec();
    let mut found = Search { image: &image, camera: &camera, cell: &cell }.objects(heights, &mut warnings);
    found.sort_by(|a, b| a.centroid.x.total_cmp(&b.centroid.x).then(a.centroid.y.total_cmp(&b.centroid.y)));
    let search = Search { image: &image, camera: &camera, cell: &cell };
    // Numbers do not depend on the heights of single objects.
    found.retain(|region| search.has_outline(region, heights.default_m, &mut warnings));
    let mut objects = Vec::new();
    for region in &found {
        let name = format!("object_{}", objects.len() + 1);
        let height_m = heights.named_m.get(&name).copied().unwrap_or(heights.default_m);
        objects.extend(search.drafted(region, name, height_m, &mut warnings));
    }
    if objects.is_empty() {
        return Err(Error::Markers {
            clip,
            found: "nothing that stands out from the table".into(),
            needed: "objects whose tops differ from the table by 6 grey levels or more".into(),
        });
    }
    if let Some(name) = heights.named_m.keys().find(|name| objects.iter().all(|o| &o.object.name != *name)) {
        let needed = format!("one of object_1 to object_{}", objects.len());
        return Err(Error::invalid("--height-m", "object", format!("`{name}`"), needed));
    }
    Ok(Draft { objects, image, camera, warnings })
}

/// A picture in which objects are searched.
#[derive(Clone, Copy)]
struct Search<'a> {
    image: &'a GreyImage,
    camera: &'a Camera,
    cell: &'a Cell,
}

impl Search<'_> {
    /// The regions of the objects' tops.
    fn objects(&self, heights: &Heights, warnings: &mut Vec<String>) -> Vec<Region> {
        let middle =
            self.cell.workspace.min_m + (self.cell.workspace.max_m - self.cell.workspace.min_m) * 0.5;
        let top = TopView { image: self.image, camera: self.camera, height_m: heights.default_m };
        let pixel_m = top.pixel_m(middle);
        if !pixel_m.is_finite() || pixel_m <= 0.0 {
            return Vec::new();
        }
        let areas_px = AREAS_M2.map(|area_m2| (area_m2 / (pixel_m * pixel_m)) as u64);
        let all =
            regions(self.image, Window::whole(self.image), &(areas_px[0].max(20)..=areas_px[1].max(21)));
        let stands_out = |region: &Region| {
            region.strength >= LEAST_STRENGTH
                && self.is_on_table(region, &top)
                && self.differs(region, pixel_m)
        };
        let mut rest: Vec<Region> = all.into_iter().filter(stands_out).collect();
        rest.sort_by(|a, b| b.area_px.cmp(&a.area_px).then(b.strength.total_cmp(&a.strength)));
        let mut chosen: Vec<Region> = Vec::new();
        while let Some(outer) = rest.first().cloned() {
            let (inside, others): (Vec<Region>, Vec<Region>) =
                rest.drain(..).partition(|region| outer.covers(region));
            let parts = parts(&outer, &inside);
            for top in parts {
                if !chosen.iter().any(|other| other.overlaps(&top)) {
                    chosen.push(top);
                }
            }
            rest = others
                .into_iter()
                .filter(|region| !chosen.iter().any(|other| other.overlaps(region)))
                .collect();
        }
        self.warn_of_the_edge(&chosen, warnings);
        chosen
    }

    /// Objects near the picture's edge have no edge all around: their workspace is named.
    fn warn_of_the_edge(&self, chosen: &[Region], warnings: &mut Vec<String>) {
        let corners = [self.cell.workspace.min_m, self.cell.workspace.max_m];
        let hidden =
            corners.iter().any(|&corner| !self.camera.shows(self.camera.pixel_from_table(corner, 0.0)));
        if hidden && !chosen.is_empty() {
            warnings.push(
                "the picture does not show the whole workspace: objects that its edge cuts are left out"
                    .into(),
            );
        }
    }

    /// Whether a region lies in the workspace and is no tag.
    fn is_on_table(&self, region: &Region, top: &TopView) -> bool {
        const TAG_WITH_MARGIN: f64 = 1.25;
        let at = self.camera.table_from_pixel(region.centroid, top.height_m);
        let on_tag = |tag: &crate::cell::Tag| {
            let center = self.camera.pixel_from_table(tag.center_m, 0.0);
            let near_m = self.camera.table_from_pixel(region.centroid, 0.0).distance(tag.center_m);
            region.contains(center) || near_m < 0.5 * TAG_WITH_MARGIN * std::f64::consts::SQRT_2 * tag.size_m
        };
        self.cell.workspace.contains(at) && !self.cell.tags.iter().any(on_tag)
    }

    /// Whether the grey level just inside a region differs from the table a few millimetres outside: what lines on the table enclose does not.
    fn differs(&self, region: &Region, pixel_m: f64) -> bool {
        const INSIDE_PX: f64 = 4.0;
        let radial = |pixel: &Pixel, off_px: f64| {
            let (dx, dy) = (pixel.x - region.centroid.x, pixel.y - region.centroid.y);
            let length_px = dx.hypot(dy).max(1.0);
            let factor = 1.0 + off_px / length_px;
            Pixel::new(region.centroid.x + factor * dx, region.centroid.y + factor * dy)
        };
        let inside = region.border.iter().filter_map(|pixel| self.image.grey_at(radial(pixel, -INSIDE_PX)));
        let outside = region.border.iter().flat_map(|pixel| {
            let at = TABLE_AT_M.map(|off_m| radial(pixel, off_m / pixel_m));
            at.into_iter().filter(|&at| !region.contains(at)).filter_map(|at| self.image.grey_at(at))
        });
        median(inside).zip(median(outside)).is_some_and(|(top, table)| (top - table).abs() >= LEAST_STRENGTH)
    }

    /// Whether a disc, a rectangle or a polygon fits a region's edges: a shadow has none that ends sharply.
    fn has_outline(&self, region: &Region, height_m: f64, warnings: &mut Vec<String>) -> bool {
        let top = TopView { image: self.image, camera: self.camera, height_m };
        if outline(&top, region).is_some_and(|outline| outline.fits) {
            return true;
        }
        let at = self.camera.table_from_pixel(region.centroid, height_m);
        let (x_mm, y_mm) = (1e3 * at.x, 1e3 * at.y);
        warnings.push(format!("no outline fits what lies at ({x_mm:.0}, {y_mm:.0}) mm, a shadow or objects that touch: it is left out"));
        false
    }

    /// The object of a region; `None` for the striker, and without a shape that fits.
    fn drafted(
        &self,
        region: &Region,
        name: String,
        height_m: f64,
        warnings: &mut Vec<String>,
    ) -> Option<Drafted> {
        let top = TopView { image: self.image, camera: self.camera, height_m };
        let at = self.camera.table_from_pixel(region.centroid, height_m);
        let place = format!("at ({:.0}, {:.0}) mm", 1e3 * at.x, 1e3 * at.y);
        let Some(outline) = outline(&top, region) else {
            warnings.push(format!("what lies {place} has no outline that can be measured: it is left out"));
            return None;
        };
        if self.is_striker(region) {
            warnings.push(format!("the disc {place} has the striker's size: it is left out"));
            return None;
        }
        if !outline.fits {
            let mm = 1e3 * outline.rms_m;
            warnings.push(format!("doubtful: the outline of `{name}` {place} fits its edges to {mm:.2} mm only; a shadow or a second object may touch it"));
        } else if is_concave(&outline.shape) {
            warnings.push(format!(
                "the outline of `{name}` {place} is concave: if it is two objects that touch, move them apart"
            ));
        }
        let marked = marker::marked(&top, region, outline, &name, warnings);
        let (shape, marker) = (marked.outline.shape, marked.marker);
        let mut object = Object { name, shape, height_m, marker, mass_kg: None, support: None };
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

    /// Whether a region is the top of the striker.
    fn is_striker(&self, region: &Region) -> bool {
        let (striker, image, camera) = (&self.cell.striker, self.image, self.camera);
        let Shape::Disc { radius_m: given_m } = striker.shape else { return false };
        let top = TopView { image, camera, height_m: striker.height_m };
        let radius_m = match outline(&top, region) {
            Some(Fitted { shape: Shape::Disc { radius_m }, .. }) => radius_m,
            _ => return false,
        };
        given_m > 0.0 && (radius_m - given_m).abs() < STRIKER_FRACTION * given_m
    }
}

/// The tops in a region: those of objects that touch, or the innermost region that is no marker, without sides and shadows around it.
fn parts(outer: &Region, inside: &[Region]) -> Vec<Region> {
    const LEAST_PART: f64 = 0.1;
    const ALL_PARTS: f64 = 0.65;
    let fraction = |region: &Region| region.area_px as f64 / outer.area_px as f64;
    // Disjoint parts, the largest first, that make up most of the region
    let mut disjoint: Vec<&Region> = Vec::new();
    for region in
        inside.iter().filter(|region| (LEAST_PART..MARKER_FRACTION * 1.5).contains(&fraction(region)))
    {
        if !disjoint.iter().any(|other| other.overlaps(region)) {
            disjoint.push(region);
        }
    }
    let sum: f64 = disjoint.iter().map(|region| fraction(region)).sum();
    if disjoint.len() > 1 && sum > ALL_PARTS {
        return disjoint.into_iter().map(|region| strongest(region, inside)).collect();
    }
    let tops = inside.iter().filter(|region| fraction(region) >= MARKER_FRACTION);
    let innermost = tops.min_by_key(|region| region.area_px).unwrap_or(outer);
    vec![strongest(innermost, inside)]
}

/// Of the regions with the same border the one with the strongest edge.
fn strongest(region: &Region, all: &[Region]) -> Region {
    let same = |other: &&Region| {
        let (a, b) = (region.area_px as f64, other.area_px as f64);
        (a - b).abs() < SAME_BORDER * a && region.overlaps(other)
    };
    let best = all.iter().filter(same).max_by(|a, b| a.strength.total_cmp(&b.strength));
    best.unwrap_or(region).clone()
}

/// The outline of a region in the plane of its top.
fn outline(top: &TopView, region: &Region) -> Option<Fitted> {
    let mut border = top.points(&region.border);
    // The walk around the region goes clockwise in the image, and so seen from above: the camera does not mirror.
    border.reverse();
    let pixel_m = top.pixel_m(top.camera.table_from_pixel(region.centroid, top.height_m));
    let smooth = smooth(&border);
    let mut fit = fitted(&top.edges(&smooth, REACHES_PX[0]), pixel_m)?;
    for reach_px in REACHES_PX {
        // A shape that does not fit would lead the search away from the edges.
        let line = if fit.fits { placed(&fit, SPACING_PX * pixel_m) } else { smooth.clone() };
        fit = fitted(&top.edges(&line, reach_px), pixel_m)?;
    }
    Some(fit)
}

/// A closed line, each point the mean of its neighbours: a border of whole pixels has steps.
fn smooth(border: &[Point]) -> Vec<Point> {
    const NEIGHBOURS: usize = 2;
    let n = border.len();
    let mean = |k: usize| {
        let near = (0..=2 * NEIGHBOURS).map(|i| border[(k + n + i - NEIGHBOURS) % n].to_vec());
        Point::ORIGIN
            + near.fold(crate::geometry::Vec2::ZERO, |sum, p| sum + p) * (1.0 / (2 * NEIGHBOURS + 1) as f64)
    };
    if n > 2 * NEIGHBOURS { (0..n).map(mean).collect() } else { Vec::new() }
}

/// Points along an outline on the table, counter-clockwise, about `spacing_m` apart.
fn placed(fit: &Fitted, spacing_m: f64) -> Vec<Point> {
    let corners = fit.shape.corners();
    let line = if corners.is_empty() { fit.shape.outline_points() } else { corners };
    let n = line.len();
    let between = |k: usize| {
        let (from, to) = (line[k], line[(k + 1) % n]);
        let count = (from.distance(to) / spacing_m).ceil().clamp(1.0, 1e4) as usize;
        (0..count).map(move |i| from + (to - from) * ((i as f64 + 0.5) / count as f64))
    };
    let on_disc = |point: Point| match fit.shape {
        // Not the chord but the circle.
        Shape::Disc { radius_m } => {
            point.to_vec().direction().map_or(point, |out| Point::ORIGIN + out * radius_m)
        }
        _ => point,
    };
    (0..n).flat_map(between).map(|point| fit.pose.table_from_body(on_disc(point))).collect()
}

/// Whether a polygon turns to the right somewhere.
fn is_concave(shape: &Shape) -> bool {
    let corners = shape.corners();
    let n = corners.len();
    (0..n)
        .any(|k| (corners[(k + 1) % n] - corners[k]).cross(corners[(k + 2) % n] - corners[(k + 1) % n]) < 0.0)
}
