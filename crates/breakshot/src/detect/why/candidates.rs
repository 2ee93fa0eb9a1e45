//! Which regions near the expected place of a lost object were not accepted, and why?

use super::super::label::{Component, Labeller, Window};
use super::super::markerless;
use super::super::markerless::edge_visibility::OutlineView;
use super::super::motion_blur::FrameView;
use super::super::threshold::{Level, search_thresholds};
use super::super::track::{AREA_RATIOS, Detection, Prediction};
use super::reason::Rejection;
use super::{Candidate, MOST_CANDIDATES, Spot};
use crate::geometry::{Pixel, Point};
use crate::statistics::sorted_by_value;

/// Components from this fraction of the marker's area on, and up to this multiple, are regions that a person may take for it.
const LEAST_AREA: f64 = 0.1;
const LARGEST_AREA: f64 = 4.0;
/// Components of two levels are the same region if the distance of their centroids over the marker's size is below this.
const SAME_REGION: f64 = 0.5;
/// Regions that are compared: a patterned table has thousands.
const MOST_REGIONS: usize = 100;

/// An object that was found in the same frame.
pub(super) struct Seen {
    pub name: String,
    /// Where its marker appears on the table (m).
    pub marker_m: Point,
    /// How near to that another marker is the same one (m).
    pub reach_m: f64,
}

/// The regions nearest to where a lost object was expected, by distance.
pub(super) fn candidates(
    prediction: &Prediction,
    view: &FrameView,
    labeller: &mut Labeller,
    seen: &[Seen],
) -> Vec<Candidate> {
    if prediction.state.target.is_markerless() {
        return outline(prediction, view, seen).into_iter().collect();
    }
    let beside_m = prediction.state.target.object.shape.outer_radius_m();
    let candidate = |region: Vec<Detection>| {
        let component = region[0].component;
        let reason = verdict(prediction, view, &region, seen);
        let distance_m = prediction.distance_m(view.camera, component.centroid());
        // Further away nobody would take such a region for the marker.
        let is_faint = matches!(reason, Rejection::Area { .. } | Rejection::Unmeasurable);
        let spot = Spot { centroid: component.centroid(), covariance_px2: component.covariance_px2() };
        (!is_faint || distance_m < beside_m).then_some(Candidate { spot, distance_m, reason })
    };
    regions(prediction, view, labeller).into_iter().filter_map(candidate).take(MOST_CANDIDATES).collect()
}

/// Components around the expected place, grouped into regions, by their distance from it; each region with the largest
/// component first.
fn regions(prediction: &Prediction, view: &FrameView, labeller: &mut Labeller) -> Vec<Vec<Detection>> {
    let (state, camera, image) = (prediction.state, view.camera, &view.frame.image);
    let target = &state.target;
    let at = camera.pixel_from_table(prediction.pose.table_from_body(target.feature.at_m), target.height_m());
    let radius_m = prediction.search_radius_m(view);
    let reach_px = radius_m / camera.scale_m_per_px(at, target.height_m());
    let area_px2 = state.expected_area_px2(camera, prediction.pose);
    if !reach_px.is_finite() || !area_px2.is_finite() {
        return Vec::new();
    }
    let window = Window::around(at, reach_px, image);
    let areas_px = (area_px2 * LEAST_AREA).max(1.0) as u64..=(area_px2 * LARGEST_AREA) as u64;
    let near_px = SAME_REGION * area_px2.sqrt();
    let mut regions: Vec<Vec<Detection>> = Vec::new();
    for level in search_thresholds().map(|threshold| Level::new(state.is_dark(), threshold)) {
        for &component in labeller.components(image, window, level, &areas_px) {
            let is_in_reach = prediction.distance_m(camera, component.centroid()) <= radius_m;
            let detection = Detection { component, level };
            let same = |region: &Vec<Detection>| {
                region[0].component.centroid().distance_px(component.centroid()) < near_px
            };
            match regions.iter().position(same) {
                Some(number) => regions[number].push(detection),
                None if is_in_reach && regions.len() < MOST_REGIONS => regions.push(vec![detection]),
                None => {}
            }
        }
    }
    let difference = |d: &Detection| (d.component.area_px as f64 / area_px2).ln().abs();
    let regions = regions.into_iter().map(|region| sorted_by_value(region, difference)).collect();
    sorted_by_value(regions, |region: &Vec<Detection>| region[0].component.centroid().distance_px(at))
}

/// Why a region is not the object.
fn verdict(prediction: &Prediction, view: &FrameView, region: &[Detection], seen: &[Seen]) -> Rejection {
    let state = prediction.state;
    let height_m = state.target.height_m();
    let centroid = region[0].component.centroid();
    let at_m = view.camera.table_from_pixel(centroid, height_m);
    if let Some(other) = seen.iter().find(|other| other.marker_m.distance(at_m) < other.reach_m) {
        return Rejection::Taken { by: other.name.clone() };
    }
    let expected_px2 = state.expected_area_px2(view.camera, prediction.pose);
    let ratio = |component: &Component| component.area_px as f64 / expected_px2;
    let mut nearest: Option<Rejection> = None;
    for detection in region.iter().filter(|d| AREA_RATIOS.contains(&ratio(&d.component))) {
        match prediction.judged(view, detection) {
            // The tracker tries fewer regions.
            Ok(_) => return Rejection::Further,
            Err(reason) if nearest.as_ref().is_none_or(|n| progress(&reason) > progress(n)) => {
                nearest = Some(reason);
            }
            Err(_) => {}
        }
    }
    nearest.unwrap_or(Rejection::Area { ratio: ratio(&region[0].component) })
}

/// How far a region came: of several reasons the one that was reached last explains most.
fn progress(reason: &Rejection) -> u8 {
    match reason {
        Rejection::FarPart { .. } | Rejection::VisibleElsewhere => 3,
        Rejection::Contrast { .. } => 2,
        Rejection::Shape { .. } => 1,
        _ => 0,
    }
}

/// The best fit of an outline near its expected place.
fn outline(prediction: &Prediction, view: &FrameView, seen: &[Seen]) -> Option<Candidate> {
    let (state, camera) = (prediction.state, view.camera);
    let range = markerless::search_range(view, state);
    let fit = OutlineView::of_target(&view.frame.image, camera, &state.target).searched(
        prediction.pose,
        range,
        |_| true,
    )?;
    let blob = markerless::silhouette(&state.target, camera, &fit);
    let (visible, needed) = (state.contrast_ratio(&blob), markerless::LEAST_VISIBILITY);
    let taken = seen.iter().find(|other| other.marker_m.distance(fit.pose.position) < other.reach_m);
    let reason = match taken {
        Some(other) => Rejection::Taken { by: other.name.clone() },
        None if visible > needed => Rejection::Further,
        None => Rejection::Outline { visible, needed },
    };
    let Pixel { x, y } = blob.centroid;
    Some(Candidate {
        spot: Spot { centroid: Pixel::new(x, y), covariance_px2: blob.covariance_px2 },
        distance_m: fit.pose.position.distance(prediction.pose.position),
        reason,
    })
}
