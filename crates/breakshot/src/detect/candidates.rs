//! Which regions of an image may be markers or objects?
//!
//! All grey levels are tried, and a marker is a region that keeps its area and shape over several of them (compare
//! the maximally stable extremal regions of Matas et al., 2002). It is measured at the level halfway between its own
//! grey level and its background's.

use super::label::{Component, Labeller, Window};
use super::marker::blob::{self, Blob};
use super::marker::target::Target;
use super::threshold::{Level, levels};
use crate::capture::{Camera, GreyImage};
use crate::geometry::Pixel;
use crate::statistics::sorted_by_value;
use std::borrow::Cow;
use std::ops::RangeInclusive;

/// A blob that may be a marker, and the level at which it is separate from its background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub blob: Blob,
    pub level: Level,
    /// Whether the light changes across it: its component has a marker's shape, its grey levels have another one.
    pub is_unevenly_lit: bool,
}

/// A component of less than half or more than twice the expected area is not a marker (or is partly covered).
const AREA_TOLERANCE: f64 = 2.0;
/// Regions of neighbouring levels are the same if the distance of their centroids over their size is below this.
const SAME_REGION: f64 = 0.25;
/// A component of fewer pixels has no shape.
const LEAST_AREA_PX: f64 = 4.0;
/// A component of this many pixels keeps its shape in a reduced image.
const ENOUGH_PX: u64 = 150;
/// Differences between objects and table that are tried (grey levels).
const OUTLINE_LEVELS: [u8; 6] = [8, 12, 20, 32, 48, 72];
/// Tolerance of an object's silhouette (logarithm of a ratio of lengths): its sides and its shadow enlarge it.
pub(super) const OUTLINE_TOLERANCE: f64 = 0.6;

/// All blobs of the image that may be the marker of a target, by decreasing contrast.
pub(super) fn candidates(
    image: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    threshold: Option<u8>,
    labeller: &mut Labeller,
) -> Vec<Candidate> {
    // Stable regions
    let areas_px = component_areas_px(camera, targets);
    let search = SearchImage::new(image, areas_px);
    let mut regions: Vec<StableRegion> = Vec::new();
    for (rank, level) in levels(threshold).enumerate() {
        let found =
            labeller.components(&search.reduced, Window::whole(&search.reduced), level, &search.areas_px);
        for component in found {
            let plausible =
                |t: &Target| t.has_similar_compactness(component.area_px as f64, component.covariance_px2());
            if targets.iter().any(plausible) {
                add(&mut regions, RegionAtLevel { rank, level, component: *component });
            }
        }
    }

    // Measured at the middle one of the levels at which they were found
    let candidates: Vec<Candidate> = regions
        .iter()
        .filter(|region| region.levels.len() > 1 || threshold.is_some())
        .filter_map(|region| {
            let RegionAtLevel { level, component, .. } = &region.levels[region.levels.len() / 2];
            let component = search.in_full_resolution(component, *level, labeller)?;
            let blob = blob::measured(image, &component, *level, [0.0, 0.0])?;
            let is_marker = |blob: &Blob| targets.iter().any(|t| t.mismatch(camera, blob).is_tolerable());
            if is_marker(&blob) {
                return Some(Candidate { blob, level: blob.level(), is_unevenly_lit: false });
            }
            let blob = blob.with_shape_of(&component);
            is_marker(&blob).then_some(Candidate { blob, level: *level, is_unevenly_lit: true })
        })
        .filter(|c| !is_on_tag(camera, c.blob.centroid))
        .collect();

    // Of several at the same position the one with the highest contrast, in even light if there is one
    let (uneven, even): (Vec<Candidate>, Vec<Candidate>) =
        sorted_by_value(candidates, |c| -c.blob.contrast.abs()).into_iter().partition(|c| c.is_unevenly_lit);
    let mut kept: Vec<Candidate> = Vec::new();
    for c in even.into_iter().chain(uneven) {
        if kept.iter().all(|k| !is_same_position(k.blob.centroid, c.blob.centroid, c.blob.area_px2)) {
            kept.push(c);
        }
    }
    kept
}

/// All regions that may be a target without a marker, in an image from which the table was subtracted.
pub(super) fn silhouettes(
    subtracted: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    labeller: &mut Labeller,
) -> Vec<Candidate> {
    let targets: Vec<Target> = targets.iter().filter(|t| t.is_markerless()).cloned().collect();
    let areas_px = component_areas_px(camera, &targets);
    let middle = u8::MAX / 2 + 1;
    let mut found: Vec<Candidate> = Vec::new();
    for difference in OUTLINE_LEVELS {
        for level in [Level::Below(middle - difference), Level::Above(middle + difference)] {
            for component in labeller.components(subtracted, Window::whole(subtracted), level, &areas_px) {
                let blob = Blob::from_component(component, f64::from(difference));
                let matches = |t: &Target| t.mismatch(camera, &blob).is_within(OUTLINE_TOLERANCE);
                let known =
                    found.iter().any(|f| is_same_position(f.blob.centroid, blob.centroid, blob.area_px2));
                if !known && targets.iter().any(matches) && !is_on_tag(camera, blob.centroid) {
                    found.push(Candidate { blob, level, is_unevenly_lit: false });
                }
            }
        }
    }
    found
}

/// Range of the areas of components that may be one of the targets (px).
pub(super) fn component_areas_px(camera: &Camera, targets: &[Target]) -> RangeInclusive<u64> {
    let areas = targets.iter().map(|t| t.projected_areas_px2(camera));
    let (least, most) = areas.fold((f64::INFINITY, 0.0_f64), |(least, most), areas| {
        (least.min(*areas.start()), most.max(*areas.end()))
    });
    let least = (least / AREA_TOLERANCE).max(LEAST_AREA_PX);
    least as u64..=(most * AREA_TOLERANCE) as u64
}

/// A component at one of the levels of a search.
struct RegionAtLevel {
    /// Number of the level in the order of the search.
    rank: usize,
    level: Level,
    component: Component,
}

/// The same region at successive levels.
struct StableRegion {
    levels: Vec<RegionAtLevel>,
}

/// Adds a component to the region that contained it at one of the two levels before, or as a new region.
fn add(regions: &mut Vec<StableRegion>, this: RegionAtLevel) {
    let centroid = this.component.centroid();
    let area = this.component.area_px as f64;
    let same = |region: &&mut StableRegion| {
        region.levels.last().is_some_and(|last| {
            let same_side = last.level.is_dark() == this.level.is_dark();
            let successive = last.rank + 2 >= this.rank && last.rank < this.rank;
            same_side && successive && is_same_position(last.component.centroid(), centroid, area)
        })
    };
    match regions.iter_mut().find(same) {
        Some(region) => region.levels.push(this),
        None => regions.push(StableRegion { levels: vec![this] }),
    }
}

/// The image in which all levels are searched: of reduced size where even the smallest marker has many pixels.
struct SearchImage<'a> {
    reduced: Cow<'a, GreyImage>,
    /// Areas of markers in the reduced image (px).
    areas_px: RangeInclusive<u64>,
    /// Reduction of width and height.
    factor: usize,
    /// The image in full resolution, and the areas of markers in it (px).
    full: &'a GreyImage,
    full_areas_px: RangeInclusive<u64>,
}

impl<'a> SearchImage<'a> {
    fn new(full: &'a GreyImage, full_areas_px: RangeInclusive<u64>) -> Self {
        let factor = ((full_areas_px.start() / ENOUGH_PX).isqrt() as usize).max(1);
        let area_factor = (factor * factor) as u64;
        let areas_px = full_areas_px.start() / area_factor..=full_areas_px.end() / area_factor;
        let reduced = if factor > 1 { Cow::Owned(full.shrunk(factor)) } else { Cow::Borrowed(full) };
        Self { reduced, areas_px, factor, full, full_areas_px }
    }

    /// The component of the full image that corresponds to one of the reduced image.
    fn in_full_resolution(
        &self,
        component: &Component,
        level: Level,
        labeller: &mut Labeller,
    ) -> Option<Component> {
        if self.factor == 1 {
            return Some(*component);
        }
        let scaled = |at: f64| (at + 0.5) * self.factor as f64 - 0.5;
        let Pixel { x, y } = component.centroid();
        let centroid = Pixel::new(scaled(x), scaled(y));
        let span = |[first, last]: [u32; 2], size: usize| {
            let (first, last) = (first as usize, last as usize);
            [first.saturating_sub(1) * self.factor, ((last + 2) * self.factor).min(size)]
        };
        let window = Window { x: span(component.x, self.full.width), y: span(component.y, self.full.height) };
        let found = labeller.components(self.full, window, level, &self.full_areas_px).iter();
        let distance_px = |c: &Component| c.centroid().distance_px(centroid);
        found.min_by(|a, b| distance_px(a).total_cmp(&distance_px(b))).copied()
    }
}

fn is_same_position(one: Pixel, other: Pixel, area_px2: f64) -> bool {
    one.distance_px(other) < SAME_REGION * area_px2.sqrt()
}

/// Whether a position is inside a detected tag, whose cells are as black and as small as markers.
fn is_on_tag(camera: &Camera, position: Pixel) -> bool {
    camera.tags.iter().any(|tag| {
        let side = |k: usize| {
            let (p, q) = (tag.corners_px[k], tag.corners_px[(k + 1) % 4]);
            (q.x - p.x) * (position.y - p.y) - (q.y - p.y) * (position.x - p.x)
        };
        let sides: [f64; 4] = std::array::from_fn(side);
        sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
    })
}
