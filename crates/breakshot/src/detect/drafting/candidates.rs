//! Which regions of a picture are the tops of objects?
//!
//! A top has an edge all around that a disc, a rectangle or a polygon fits. So have markers on it, its silhouette with its side, and sometimes
//! its shadow. A region that contains a smaller one, its marker, is a top before all others; regions that touch a top are its side and its shadow.

use super::edges::TopView;
use super::regions::{Region, regions};
use super::shape_fit::Fitted;
use crate::cell::Cell;
use crate::detect::label::Window;
use crate::geometry::Pixel;
use crate::geometry::outline::Outline;
use crate::statistics::median;

/// A region and the outline that fits it.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub region: Region,
    pub outline: Fitted,
}

/// Area of an object's outline (m2): from a coin of 11 mm to a plate of 200 mm.
const AREAS_M2: [f64; 2] = [1e-4, 0.04];
/// Least step of grey level around an object, and difference of its top from the table: steps of noise are below two levels in the mean of nine pixels.
pub(super) const LEAST_STRENGTH: f64 = 6.0;
/// Least area of a marker over that of its top, and largest.
pub(super) const MARKER_FRACTIONS: [f64; 2] = [0.01, 0.5];
/// Least number of pixels of a marker: fewer have no shape.
const LEAST_MARKER_PX: u64 = 20;
/// Regions whose areas differ by less than this fraction have the same border.
const SAME_BORDER: f64 = 0.06;
/// Distance from an object at which the table is read (m), beyond lines that are drawn on it.
const TABLE_AT_M: [f64; 3] = [3e-3, 4.5e-3, 6e-3];
/// Height of the tallest object (m), by which the silhouette of a side is bounded, and the steps in height at which it is compared.
const TALLEST_M: f64 = 0.08;
const HEIGHT_STEPS: usize = 8;
/// Least step of grey level around a silhouette, above that of most shadows, and the number of silhouettes that are tried.
const SILHOUETTE_STRENGTH: f64 = 15.0;
const MOST_SILHOUETTES: usize = 60;
/// Heights that are tried for a silhouette (m).
const HEIGHTS_M: [f64; 4] = [0.015, 0.03, 0.045, 0.06];
/// Regions nearer than this touch (px).
const TOUCHING_PX: f64 = 3.0;

/// The tops in a picture.
pub(super) fn tops(view: &TopView, cell: &Cell) -> Vec<Candidate> {
    let middle = cell.workspace.min_m + (cell.workspace.max_m - cell.workspace.min_m) * 0.5;
    let pixel_m = view.pixel_m(view.camera.pixel_from_table(middle, view.height_m));
    if !pixel_m.is_finite() || pixel_m <= 0.0 {
        return Vec::new();
    }
    let [least_px, most_px] = AREAS_M2.map(|area_m2| (area_m2 / (pixel_m * pixel_m)) as u64);
    let areas_px = LEAST_MARKER_PX..=most_px.max(LEAST_MARKER_PX + 1);
    let all: Vec<Region> = distinct(
        regions(view.image, Window::whole(view.image), &areas_px)
            .into_iter()
            .filter(|region| region.strength >= LEAST_STRENGTH && is_on_table(view, cell, region)),
    );
    // Tops and markers that are regions of their own
    let ink = TopView { solid: false, ..*view };
    let is_marker_size = |region: &Region| (region.area_px as u64) < least_px;
    let direct = |region: &Region| {
        let view = if is_marker_size(region) { &ink } else { view };
        let outline = view.nearest(region).filter(|outline| outline.fits)?;
        Some(Candidate { region: region.clone(), outline })
    };
    let candidates: Vec<Candidate> = all.iter().filter_map(direct).collect();
    let is_top_size = |region: &Region| !is_marker_size(region) && differs(view, region, pixel_m);
    let has_marker = |top: &Region| candidates.iter().any(|other| is_marker(&other.region, top));
    let mut chosen = Chosen { view, tops: Vec::new() };
    // The innermost of marked regions is the top, the others are its silhouette and its shadow.
    let mut large: Vec<&Candidate> =
        candidates.iter().filter(|candidate| is_top_size(&candidate.region)).collect();
    large.sort_by_key(|candidate| candidate.region.area_px);
    for candidate in large.iter().filter(|candidate| has_marker(&candidate.region)) {
        chosen.add(candidate, false);
    }
    // Silhouettes around a marker: sides as light as the tops
    let mut others: Vec<&Region> = all
        .iter()
        .filter(|region| {
            region.strength >= SILHOUETTE_STRENGTH && is_top_size(region) && chosen.is_free(region, false)
        })
        .take(MOST_SILHOUETTES)
        .collect();
    others.sort_by_key(|region| region.area_px);
    let (marked, bare): (Vec<&Region>, Vec<&Region>) =
        others.into_iter().partition(|region| has_marker(region));
    for region in marked {
        chosen.add_silhouette(region, false);
    }
    // Without a marker the strongest edges first
    large.sort_by(|a, b| b.region.strength.total_cmp(&a.region.strength));
    for candidate in large.into_iter().filter(|candidate| !has_marker(&candidate.region)) {
        chosen.add(candidate, true);
    }
    for region in bare {
        chosen.add_silhouette(region, true);
    }
    chosen.tops
}

/// The tops that were found so far.
struct Chosen<'a> {
    view: &'a TopView<'a>,
    tops: Vec<Candidate>,
}

impl Chosen<'_> {
    /// Whether a region overlaps no top, and if it is `apart` touches none.
    fn is_free(&self, region: &Region, apart: bool) -> bool {
        let is_hit =
            |top: &Candidate| top.region.overlaps(region) || apart && touches(self.view, top, region);
        !self.tops.iter().any(is_hit)
    }

    fn add(&mut self, candidate: &Candidate, apart: bool) {
        if self.is_free(&candidate.region, apart) {
            self.tops.push(candidate.clone());
        }
    }

    /// Adds a silhouette, if it is that of an outline at one of some heights: the height decides which top it has.
    fn add_silhouette(&mut self, region: &Region, apart: bool) {
        if !self.is_free(region, apart) {
            return;
        }
        let at = |height_m: f64| TopView { height_m, ..*self.view }.outline(region);
        let heights_m = std::iter::once(self.view.height_m).chain(HEIGHTS_M);
        if let Some(outline) = heights_m.filter_map(at).find(|outline| outline.fits) {
            self.tops.push(Candidate { region: region.clone(), outline });
        }
    }
}

/// Of regions with the same border the one with the strongest edge.
fn distinct(all: impl Iterator<Item = Region>) -> Vec<Region> {
    let mut by_strength: Vec<Region> = all.collect();
    by_strength.sort_by(|a, b| b.strength.total_cmp(&a.strength).then(b.area_px.cmp(&a.area_px)));
    let mut kept: Vec<Region> = Vec::new();
    for region in by_strength {
        if !kept.iter().any(|other| has_same_border(other, &region)) {
            kept.push(region);
        }
    }
    kept
}

/// Whether areas and centroids of two regions agree.
fn has_same_border(a: &Region, b: &Region) -> bool {
    let [area, other] = [a, b].map(|region| region.area_px as f64);
    let off_px = (a.centroid.x - b.centroid.x).hypot(a.centroid.y - b.centroid.y);
    (area - other).abs() < SAME_BORDER * area && off_px < 0.5 * SAME_BORDER * area.sqrt()
}

/// Whether a region can be a marker on a top.
fn is_marker(marker: &Region, top: &Region) -> bool {
    let fraction = marker.area_px as f64 / top.area_px as f64;
    (MARKER_FRACTIONS[0]..MARKER_FRACTIONS[1]).contains(&fraction) && top.covers(marker)
}

/// Whether a region lies in the workspace and is no tag.
fn is_on_table(view: &TopView, cell: &Cell, region: &Region) -> bool {
    const TAG_WITH_MARGIN: f64 = 1.25;
    let at = view.camera.table_from_pixel(region.centroid, view.height_m);
    let on_tag = |tag: &crate::cell::Tag| {
        let center = view.camera.pixel_from_table(tag.center_m, 0.0);
        let near_m = view.camera.table_from_pixel(region.centroid, 0.0).distance(tag.center_m);
        region.contains(center) || near_m < 0.5 * TAG_WITH_MARGIN * std::f64::consts::SQRT_2 * tag.size_m
    };
    cell.workspace.contains(at) && !cell.tags.iter().any(on_tag)
}

/// Whether the grey level just inside a region differs from the table a few millimetres outside: what lines on the table enclose does not.
fn differs(view: &TopView, region: &Region, pixel_m: f64) -> bool {
    const INSIDE_PX: f64 = 4.0;
    let radial = |pixel: &Pixel, off_px: f64| {
        let (dx, dy) = (pixel.x - region.centroid.x, pixel.y - region.centroid.y);
        let length_px = dx.hypot(dy).max(1.0);
        let factor = 1.0 + off_px / length_px;
        Pixel::new(region.centroid.x + factor * dx, region.centroid.y + factor * dy)
    };
    let inside = region.border.iter().filter_map(|pixel| view.image.grey_at(radial(pixel, -INSIDE_PX)));
    let outside = region.border.iter().flat_map(|pixel| {
        let at = TABLE_AT_M.map(|off_m| radial(pixel, off_m / pixel_m));
        at.into_iter().filter(|&at| !region.contains(at)).filter_map(|at| view.image.grey_at(at))
    });
    median(inside).zip(median(outside)).is_some_and(|(top, table)| (top - table).abs() >= LEAST_STRENGTH)
}

/// Whether a region touches the silhouette of an object, whose height is not known yet.
fn touches(view: &TopView, object: &Candidate, region: &Region) -> bool {
    let outline = Outline::new(&object.outline.shape, object.outline.pose);
    let margin_m = TOUCHING_PX * view.pixel_m(object.region.centroid);
    let inside = |pixel: &Pixel| {
        (0..=HEIGHT_STEPS).any(|step| {
            let height_m = view.height_m - TALLEST_M * step as f64 / HEIGHT_STEPS as f64;
            let point = view.camera.table_from_pixel(*pixel, height_m);
            outline.contains(point) || outline.border_distance_m(point) < margin_m
        })
    };
    region.border.iter().any(inside)
}
