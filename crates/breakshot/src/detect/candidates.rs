//! What in a picture may be a marker?

use super::label::{Component, Labeller, Window};
use super::marker::blob::{self, Blob};
use super::marker::target::Target;
use super::threshold::{Level, levels};
use crate::capture::{Camera, GreyImage};
use crate::geometry::Pixel;
use std::borrow::Cow;
use std::ops::RangeInclusive;

/// Something that may be a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub blob: Blob,
    pub level: Level,
}

/// At half the expected area or less, or at twice, a component is something else (or partly covered).
const AREA_TOLERANCE: f64 = 2.0;
/// Seen at the next level, the same marker lies within this part of its own size.
const SAME_PLACE: f64 = 0.25;

/// What may be a marker of one of the targets, wherever it lies, the clearest first.
pub(super) fn candidates(
    image: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    threshold: Option<u8>,
    labeller: &mut Labeller,
) -> Vec<Candidate> {
    let areas_px = component_areas_px(camera, targets);
    let search = Search::new(image, areas_px);
    let mut groups: Vec<Group> = Vec::new();
    for (rank, level) in levels(threshold).enumerate() {
        let found =
            labeller.components(&search.picture, Window::whole(&search.picture), level, &search.areas_px);
        for component in found {
            let plausible = |t: &Target| t.full_enough(component.area_px as f64, component.covariance_px2());
            if targets.iter().any(plausible) {
                gather(&mut groups, Sighting { rank, level, component: *component });
            }
        }
    }
    let mut candidates: Vec<Candidate> = groups
        .iter()
        .filter(|group| group.sightings.len() > 1 || threshold.is_some())
        .filter_map(|group| {
            let Sighting { level, component, .. } = &group.sightings[group.sightings.len() / 2];
            let whole = search.enlarged(component, *level, labeller)?;
            candidate(image, &whole, *level)
        })
        .filter(|c| targets.iter().any(|t| t.mismatch(camera, &c.blob).tolerable()))
        .filter(|c| !on_tag(camera, c.blob.centroid))
        .collect();
    candidates.sort_by(|a, b| b.blob.contrast.abs().total_cmp(&a.blob.contrast.abs()));
    let mut kept: Vec<Candidate> = Vec::new();
    for c in candidates {
        if kept.iter().all(|k| !same_place(k.blob.centroid, c.blob.centroid, c.blob.area_px2)) {
            kept.push(c);
        }
    }
    kept
}

/// What may be one of the targets without a marker in a picture from which the table was taken away.
pub(super) fn outlines(
    levelled: &GreyImage,
    camera: &Camera,
    targets: &[Target],
    labeller: &mut Labeller,
) -> Vec<Candidate> {
    let targets: Vec<Target> = targets.iter().filter(|t| t.markerless()).cloned().collect();
    let areas_px = component_areas_px(camera, &targets);
    let middle = u8::MAX / 2 + 1;
    let mut found: Vec<Candidate> = Vec::new();
    for away in OUTLINE_LEVELS {
        for level in [Level::Below(middle - away), Level::Above(middle + away)] {
            for component in labeller.components(levelled, Window::whole(levelled), level, &areas_px) {
                let blob = Blob::rough(component, f64::from(away));
                let like = |t: &Target| t.mismatch(camera, &blob).within(OUTLINE_TOLERANCE);
                let known = found.iter().any(|f| same_place(f.blob.centroid, blob.centroid, blob.area_px2));
                if !known && targets.iter().any(like) && !on_tag(camera, blob.centroid) {
                    found.push(Candidate { blob, level });
                }
            }
        }
    }
    found
}

/// An object stands out from the table by one of these (grey levels).
const OUTLINE_LEVELS: [u8; 6] = [8, 12, 20, 32, 48, 72];
/// A blob shows an object's sides and shadow as well, which make it larger.
pub(super) const OUTLINE_TOLERANCE: f64 = 0.6;

/// Areas of components that are worth a closer look (px).
pub(super) fn component_areas_px(camera: &Camera, targets: &[Target]) -> RangeInclusive<u64> {
    let areas = targets.iter().map(|t| t.areas_px2(camera));
    let (least, most) = areas.fold((f64::INFINITY, 0.0_f64), |(least, most), areas| {
        (least.min(*areas.start()), most.max(*areas.end()))
    });
    let least = (least / AREA_TOLERANCE).max(LEAST_AREA_PX);
    least as u64..=(most * AREA_TOLERANCE) as u64
}

/// Below this a component has no shape.
const LEAST_AREA_PX: f64 = 4.0;

struct Sighting {
    rank: usize,
    level: Level,
    component: Component,
}

/// The same marker at neighbouring levels.
struct Group {
    sightings: Vec<Sighting>,
}

/// The marker measured at the level in the middle of those at which it is seen, then at its own.
fn candidate(image: &GreyImage, component: &Component, level: Level) -> Option<Candidate> {
    let blob = blob::measured(image, component, level, [0.0, 0.0])?;
    Some(Candidate { blob, level: blob.level() })
}

/// The picture in which markers are searched at every level: made smaller where even the smallest stays large.
struct Search<'a> {
    picture: Cow<'a, GreyImage>,
    areas_px: RangeInclusive<u64>,
    factor: usize,
    /// The picture as it is, and the areas that markers have in it (px).
    image: &'a GreyImage,
    whole_areas_px: RangeInclusive<u64>,
}

/// A component of so many pixels keeps its shape.
const PLENTY_PX: u64 = 150;

impl<'a> Search<'a> {
    fn new(image: &'a GreyImage, whole_areas_px: RangeInclusive<u64>) -> Self {
        let factor = ((whole_areas_px.start() / PLENTY_PX).isqrt() as usize).max(1);
        let part = (factor * factor) as u64;
        let areas_px = whole_areas_px.start() / part..=whole_areas_px.end() / part;
        let picture = if factor > 1 { Cow::Owned(image.shrunk(factor)) } else { Cow::Borrowed(image) };
        Self { picture, areas_px, factor, image, whole_areas_px }
    }

    /// The component of the picture itself that a component of the smaller one shows.
    fn enlarged(&self, component: &Component, level: Level, labeller: &mut Labeller) -> Option<Component> {
        if self.factor == 1 {
            return Some(*component);
        }
        let whole = |at: f64| (at + 0.5) * self.factor as f64 - 0.5;
        let Pixel { x, y } = component.centroid();
        let centroid = Pixel::new(whole(x), whole(y));
        let span = |[first, last]: [u32; 2], size: usize| {
            let (first, last) = (first as usize, last as usize);
            [first.saturating_sub(1) * self.factor, ((last + 2) * self.factor).min(size)]
        };
        let window =
            Window { x: span(component.x, self.image.width), y: span(component.y, self.image.height) };
        let found = labeller.components(self.image, window, level, &self.whole_areas_px).iter();
        let off_px = |c: &Component| c.centroid().distance_px(centroid);
        found.min_by(|a, b| off_px(a).total_cmp(&off_px(b))).copied()
    }
}

fn gather(groups: &mut Vec<Group>, sighting: Sighting) {
    let place = sighting.component.centroid();
    let area = sighting.component.area_px as f64;
    let same = |group: &&mut Group| {
        group.sightings.last().is_some_and(|last| {
            let same_side =
                matches!(last.level, Level::Below(_)) == matches!(sighting.level, Level::Below(_));
            let near = last.rank + 2 >= sighting.rank && last.rank < sighting.rank;
            same_side && near && same_place(last.component.centroid(), place, area)
        })
    };
    match groups.iter_mut().find(same) {
        Some(group) => group.sightings.push(sighting),
        None => groups.push(Group { sightings: vec![sighting] }),
    }
}

fn same_place(one: Pixel, other: Pixel, area_px2: f64) -> bool {
    one.distance_px(other) < SAME_PLACE * area_px2.sqrt()
}

/// Whether a place lies on a tag that was seen: the tags' cells are as black and as small as markers.
fn on_tag(camera: &Camera, place: Pixel) -> bool {
    camera.tags.iter().any(|tag| {
        let side = |k: usize| {
            let (p, q) = (tag.corners_px[k], tag.corners_px[(k + 1) % 4]);
            (q.x - p.x) * (place.y - p.y) - (q.y - p.y) * (place.x - p.x)
        };
        let sides: [f64; 4] = std::array::from_fn(side);
        sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
    })
}
