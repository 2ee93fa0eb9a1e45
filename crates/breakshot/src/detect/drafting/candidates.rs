//! Which regions of a picture are the tops of objects?
//!
//! A top has an edge all around that a disc, a rectangle or a polygon fits. So have markers on it, its silhouette with its side, and sometimes
//! its shadow. A region that contains a smaller one, its marker, is a top before all others; regions that touch a top are its side and its shadow.

use super::edges::TopView;
use super::regions::{Region, SearchPlanes};
use super::shape_fit::Fitted;
use crate::capture::{Camera, GreyImage};
use crate::cell::Cell;
use crate::detect::label::Window;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point, Vec2};
use crate::object::Shape;
use crate::statistics::median;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::rc::Rc;

/// A region and the outline that fits it.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub region: Region,
    /// Where its outline fits best: 0 for the luma, then the colours.
    pub plane: usize,
    /// At `height_m`.
    pub outline: Fitted,
    pub height_m: f64,
    /// The regions among which it was chosen.
    pub around: Rc<[Region]>,
}

/// Area of an object's outline (m2): from a coin of 11 mm to a plate of 200 mm.
const AREAS_M2: [f64; 2] = [1e-4, 0.04];
/// Least step of grey level around an object, and difference of its top from the table: steps of noise are below two levels in the mean of nine pixels.
pub(super) const LEAST_STRENGTH: f64 = 6.0;
/// Least area of a marker over that of its top, and largest.
pub(super) const MARKER_FRACTIONS: [f64; 2] = [0.01, 0.5];
/// Least number of pixels of a marker: fewer have no shape.
const LEAST_MARKER_PX: u64 = 20;
/// Least area of a marker (m2): a spot of 4 mm.
const LEAST_MARKER_M2: f64 = 1.2e-5;
/// So many markers, and so many regions without one, are searched for tops, the strongest first, and so many regions around each of them, the smallest first:
/// a table with a pattern has thousands.
const MOST_OBJECTS: usize = 100;
const MOST_REGIONS: usize = 16;
/// So many regions, the strongest first, are tried for markers, and so many times an outline is fitted for tops that carry one and for others: a picture takes seconds.
const MOST_INKS: usize = 400;
const MOST_FITS: [usize; 2] = [3000, 1500];
/// Regions whose areas differ by less than this fraction have the same border.
const SAME_BORDER: f64 = 0.06;
/// Distance from an object at which the table is read (m), beyond lines that are drawn on it.
const TABLE_AT_M: [f64; 3] = [3e-3, 4.5e-3, 6e-3];
/// Height of the tallest object (m), by which the silhouette of a side is bounded, and the steps in height at which it is compared.
const TALLEST_M: f64 = 0.08;
const HEIGHT_STEPS: usize = 8;
/// Largest area of a marker (m2), and the least step of grey level around it.
const MOST_MARKER_M2: f64 = 2.5e-3;
const MARKER_STRENGTH: f64 = 12.0;
/// A marker with at least this fraction of the strongest one's step is none of a shadow.
const CERTAIN: f64 = 0.5;
/// So much of the outline around a weaker marker bounds the colour of its top.
const WEAK_BOUNDED: f64 = 0.8;
/// Heights that are tried for a silhouette (m).
const HEIGHTS_M: [f64; 4] = [0.015, 0.03, 0.045, 0.06];
/// A polygon of the same area within this fraction is nearer to the edges than a disc is if its points are at most this factor as far off, and the
/// disc's at least this far (px).
const POLYGON_AREA: f64 = 0.1;
const POLYGON_FACTOR: f64 = 0.5;
const POLYGON_RMS_PX: f64 = 0.2;
/// Their centres are then within this distance (px).
const CENTRED_PX: f64 = 2.0;
/// Outlines of the same form are equally near to their edges up to this factor, or within this distance (px), and equally visible up to this fraction.
const RMS_FACTOR: f64 = 2.0;
const LEAST_RMS_PX: f64 = 0.1;
const LESS_VISIBLE: f64 = 0.06;
/// An outline with fewer corners is taken as long as at most this fraction less of it is visible.
const SIMPLER_VISIBLE: f64 = 0.1;
/// So much of the outline of an object without a marker is visible.
const BARE_VISIBLE: f64 = 0.9;
/// It is at least this wide (m), and at most this many times as long: strips between shadows, lines and grain of the table are narrower.
const BARE_WIDTH_M: f64 = 0.012;
const BARE_LENGTH: f64 = 6.0;
/// Regions nearer than this touch (px).
const TOUCHING_PX: f64 = 3.0;

/// The tops that were found.
pub(super) struct Tops {
    pub found: Vec<Candidate>,
    /// Whether every region that may be one was tried.
    pub is_complete: bool,
}

/// The tops in a picture.
pub(super) fn tops(search: &TopSearch) -> Tops {
    let all = search.regions();
    let may_be_ink = all.iter().filter(|found| search.may_be_ink(found));
    let inks: Vec<&PlaneRegion> =
        may_be_ink.take(MOST_INKS).filter(|found| search.has_outline(found)).collect();
    // What carries ink itself is a top. The regions are in the order of their strengths.
    let is_blank = |found: &&PlaneRegion| !inks.iter().any(|ink| can_carry(&found.region, &ink.region));
    let markers: Vec<&PlaneRegion> = inks.iter().copied().filter(is_blank).collect();
    let mut large: Vec<&PlaneRegion> = all.iter().filter(|found| search.is_top_size(found)).collect();
    large.sort_by_key(|found| found.region.area_px);
    let mut chosen = Chosen { view: search.view(0, search.height_m), tops: Vec::new() };
    let strongest = markers.first().map_or(0.0, |marker| marker.region.strength);
    let mut fits_left = MOST_FITS.map(Some);
    // Several weak blots on one strip of grain are searched once.
    let mut rejected: Vec<Vec<&PlaneRegion>> = Vec::new();
    for marker in markers.iter().take(MOST_OBJECTS) {
        let apart = marker.region.strength < CERTAIN * strongest;
        let around = large
            .iter()
            .copied()
            .filter(|found| can_carry(&found.region, &marker.region) && chosen.is_free(&found.region, apart));
        let around: Vec<&PlaneRegion> = around.take(MOST_REGIONS).collect();
        if apart && rejected.iter().any(|others| are_same(others, &around)) {
            continue;
        }
        let top = search.top(&around, Kind::Marked, &mut fits_left[0]);
        // Blots of the table's grain look like weak markers, on strips between others.
        let is_object = |top: &Candidate| {
            !apart || is_wide(&top.outline.shape) && search.bounded_fraction(top) >= WEAK_BOUNDED
        };
        match top.filter(is_object) {
            Some(top) => chosen.tops.push(top),
            None => rejected.push(around),
        }
    }
    // Without a marker the strongest edges first
    let is_bare = |found: &&&PlaneRegion| {
        !found.of_either_sign && !markers.iter().any(|marker| can_carry(&found.region, &marker.region))
    };
    let bare: Vec<&PlaneRegion> = large.iter().filter(is_bare).copied().collect();
    // A shadow touches what casts it: that is searched first.
    let rank = |found: &PlaneRegion| (search.may_be_shadow(&found.region), found.region.strength);
    let mut ranked: Vec<((bool, f64), &PlaneRegion)> =
        bare.into_iter().map(|found| (rank(found), found)).collect();
    ranked.sort_by(|((a, x), _), ((b, y), _)| a.cmp(b).then(y.total_cmp(x)));
    let bare = ranked.into_iter().map(|(_, found)| found);
    for found in bare.take(MOST_OBJECTS) {
        if chosen.is_free(&found.region, true) {
            let same = |other: &&&PlaneRegion| is_same_object(&other.region, &found.region);
            let around: Vec<&PlaneRegion> = large.iter().filter(same).copied().take(MOST_REGIONS).collect();
            let top = search.top(&around, Kind::Bare, &mut fits_left[1]);
            chosen.tops.extend(top.filter(is_bare_object));
        }
    }
    Tops { found: chosen.tops, is_complete: fits_left.iter().all(Option::is_some) }
}

/// Whether an object is searched around its marker.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Marked,
    Bare,
}

/// A region of one of the planes.
struct PlaneRegion {
    region: Region,
    plane: usize,
    /// Whether its edges are of either sign, and in any plane.
    of_either_sign: bool,
}

/// A picture in which tops are searched.
pub(super) struct TopSearch<'a> {
    /// The luma and the colours.
    pub planes: Vec<&'a GreyImage>,
    pub search_planes: SearchPlanes,
    pub camera: &'a Camera,
    pub cell: &'a Cell,
    /// The height of the tops, before other heights are tried (m).
    pub height_m: f64,
    /// The side of a pixel in the middle of the workspace (m).
    pub pixel_m: f64,
}

impl<'a> TopSearch<'a> {
    /// `None` if the camera does not see the workspace.
    pub(super) fn new(
        planes: &'a [GreyImage],
        camera: &'a Camera,
        cell: &'a Cell,
        height_m: f64,
    ) -> Option<Self> {
        let middle = cell.workspace.min_m + (cell.workspace.max_m - cell.workspace.min_m) * 0.5;
        let pixel_m = camera.scale_m_per_px(camera.pixel_from_table(middle, height_m), height_m);
        let search = || Self {
            planes: planes.iter().collect(),
            search_planes: SearchPlanes::new(planes),
            camera,
            cell,
            height_m,
            pixel_m,
        };
        (pixel_m.is_finite() && pixel_m > 0.0).then(search)
    }

    /// One of the planes, and the outlines of bodies at a height.
    pub(super) fn view(&self, plane: usize, height_m: f64) -> TopView<'a> {
        TopView { image: self.planes[plane], camera: self.camera, height_m, solid: true }
    }

    /// The regions of all planes, of regions with the same border the one with the strongest edge.
    fn regions(&self) -> Vec<PlaneRegion> {
        let most_px = (AREAS_M2[1] / (self.pixel_m * self.pixel_m)) as u64;
        let least_px = ((LEAST_MARKER_M2 / (self.pixel_m * self.pixel_m)) as u64).max(LEAST_MARKER_PX);
        let areas_px = least_px..=most_px.max(least_px + 1);
        let window = Window::whole(self.planes[0]);
        let of_plane = |plane: usize| {
            let found = self.search_planes.regions(plane, window, &areas_px).into_iter();
            found.map(move |region| PlaneRegion { region, plane, of_either_sign: false })
        };
        let view = self.view(0, self.height_m);
        let stands_out = |found: &PlaneRegion| {
            found.region.strength >= LEAST_STRENGTH && is_on_table(&view, self.cell, &found.region)
        };
        let uniform = self.search_planes.uniform_regions(window, &areas_px).into_iter();
        let uniform = uniform.map(|region| PlaneRegion { region, plane: 0, of_either_sign: true });
        let uniform: Vec<PlaneRegion> = uniform.filter(stands_out).collect();
        let mut all = distinct((0..self.planes.len()).flat_map(of_plane).filter(stands_out));
        let new =
            |found: &PlaneRegion| !all.iter().any(|other| has_same_border(&other.region, &found.region));
        let new: Vec<PlaneRegion> = distinct(uniform.into_iter()).into_iter().filter(new).collect();
        all.extend(new);
        all
    }

    /// Whether a region is large enough for a top, and other than the table.
    fn is_top_size(&self, PlaneRegion { region, plane, .. }: &PlaneRegion) -> bool {
        let area_m2 = region.area_px as f64 * self.pixel_m * self.pixel_m;
        area_m2 >= AREAS_M2[0] && differs(&self.view(*plane, self.height_m), region, self.pixel_m)
    }

    /// Whether a region has the size and the edge of a marker.
    fn may_be_ink(&self, PlaneRegion { region, of_either_sign, .. }: &PlaneRegion) -> bool {
        let area_m2 = region.area_px as f64 * self.pixel_m * self.pixel_m;
        !of_either_sign && area_m2 <= MOST_MARKER_M2 && region.strength >= MARKER_STRENGTH
    }

    /// Whether a region has the outline of a marker.
    fn has_outline(&self, PlaneRegion { region, plane, .. }: &PlaneRegion) -> bool {
        let ink = TopView { solid: false, ..self.view(*plane, self.height_m) };
        ink.nearest(region).is_some_and(|outline| outline.fits)
    }

    /// The top of an object among regions that belong to it: a side or a shadow adds corners to it, and parts of it have weaker edges.
    ///
    /// `fits_left` is how many outlines may still be fitted; `None` once they have not been enough.
    fn top(&self, around: &[&PlaneRegion], kind: Kind, fits_left: &mut Option<usize>) -> Option<Candidate> {
        // Most regions without a marker are no objects.
        let others: &[f64] = if kind == Kind::Marked { &HEIGHTS_M } else { &[] };
        let mut heights_m = std::iter::once(self.height_m).chain(others.iter().copied());
        heights_m.find_map(|height_m| {
            *fits_left = (*fits_left)?.checked_sub(around.len() * self.planes.len());
            (*fits_left)?;
            let fits: Vec<Candidate> =
                around.iter().flat_map(|found| self.fits(&found.region, height_m)).collect();
            let top = self.simplest(fits.clone(), kind)?;
            let top = Candidate { around: around.iter().map(|found| found.region.clone()).collect(), ..top };
            // Most regions without a marker are no objects.
            Some(if kind == Kind::Bare && !is_bare_object(&top) { top } else { self.settled(top, &fits) })
        })
    }

    /// The outlines that fit near the border of a region, in any plane.
    pub(super) fn fits(&self, region: &Region, height_m: f64) -> Vec<Candidate> {
        let in_plane = |plane: usize| {
            let outlines = self.view(plane, height_m).outlines(region).into_iter();
            let fits = outlines.filter(|outline| outline.fits);
            fits.map(move |outline| {
                let (region, around) = (region.clone(), Rc::default());
                Candidate { region, plane, outline, height_m, around }
            })
        };
        (0..self.planes.len()).flat_map(in_plane).collect()
    }

    /// The top among outlines of one object. Silhouettes and shadows need more corners, or are larger; a line inside the top has a weak edge, or is off its edges.
    pub(super) fn simplest(&self, mut fits: Vec<Candidate>, kind: Kind) -> Option<Candidate> {
        fits.sort_by(|a, b| a.outline.rms_m.total_cmp(&b.outline.rms_m));
        let mut apart: Vec<Candidate> = Vec::new();
        for fit in fits {
            if !apart.iter().any(|other| has_same_outline(&other.outline, &fit.outline, self.pixel_m)) {
                apart.push(fit);
            }
        }
        let simplified = |candidate: Candidate| {
            let view = self.view(candidate.plane, candidate.height_m);
            Candidate { outline: view.simplified(candidate.outline.clone(), self.pixel_m), ..candidate }
        };
        let is_strong = |candidate: &Candidate| self.strength(candidate) >= LEAST_STRENGTH;
        // No outline is simpler than a disc, but polygons of many equal sides are no discs.
        let is_disc = |candidate: &Candidate| matches!(candidate.outline.shape, Shape::Disc { .. });
        let polygons: Vec<Fitted> =
            apart.iter().filter(|fit| !is_disc(fit)).map(|fit| fit.outline.clone()).collect();
        let is_polygon =
            |disc: &Fitted| polygons.iter().any(|polygon| is_nearer(polygon, disc, self.pixel_m));
        apart.retain(|candidate| !is_disc(candidate) || !is_polygon(&candidate.outline));
        if apart.iter().any(|candidate| is_disc(candidate) && is_strong(candidate)) {
            apart.retain(is_disc);
        }
        let all: Vec<Candidate> = apart.into_iter().map(simplified).collect();
        let mut strong: Vec<Candidate> = all.iter().filter(|top| is_strong(top)).cloned().collect();
        // A marker is on some top, however weak its edges are.
        if strong.is_empty() && kind == Kind::Marked {
            strong = all;
        }
        let most_visible = |strong: &[Candidate]| {
            strong.iter().map(|candidate| candidate.outline.visible_fraction).fold(0.0, f64::max)
        };
        let least_visible = most_visible(&strong) - SIMPLER_VISIBLE;
        strong.retain(|candidate| candidate.outline.visible_fraction >= least_visible);
        let least = strong.iter().map(|candidate| candidate.outline.complexity()).min()?;
        strong.retain(|candidate| candidate.outline.complexity() == least);
        let outlines = || strong.iter().map(|candidate| &candidate.outline);
        let least_rms_m = outlines().map(|outline| outline.rms_m).fold(f64::INFINITY, f64::min);
        let most_visible = most_visible(&strong);
        let limit_m = (RMS_FACTOR * least_rms_m).max(LEAST_RMS_PX * self.pixel_m);
        let is_equal = |candidate: &Candidate| {
            let outline = &candidate.outline;
            outline.rms_m <= limit_m && outline.visible_fraction >= most_visible - LESS_VISIBLE
        };
        let area_m2 = |candidate: &Candidate| candidate.outline.shape.area_m2();
        strong.retain(is_equal);
        strong.into_iter().min_by(|a, b| area_m2(a).total_cmp(&area_m2(b)))
    }

    /// A candidate at the height of its top.
    pub(super) fn at_height(&self, candidate: &Candidate, height_m: f64) -> Option<Candidate> {
        if height_m.to_bits() == candidate.height_m.to_bits() {
            return Some(candidate.clone());
        }
        let camera = self.camera;
        let moved =
            |point| camera.table_from_pixel(camera.pixel_from_table(point, candidate.height_m), height_m);
        let top = self.view(candidate.plane, height_m);
        let corrected =
            candidate.outline.mapped(moved).and_then(|outline| top.corrected(outline, self.pixel_m));
        let corrected = corrected.filter(|outline| outline.fits);
        let corrected = corrected.map(|outline| Candidate { outline, height_m, ..candidate.clone() });
        // At the height that was searched first, another region may have looked like the top.
        let fits = candidate.around.iter().flat_map(|region| self.fits(region, height_m));
        let fits: Vec<Candidate> = corrected.into_iter().chain(fits).collect();
        let top = self.simplest(fits.clone(), Kind::Marked)?;
        Some(self.settled(Candidate { around: Rc::clone(&candidate.around), ..top }, &fits))
    }

    /// The step of grey level across the weakest side of an outline, in that plane in which it is largest.
    fn strength(&self, Candidate { outline, height_m, .. }: &Candidate) -> f64 {
        const READ_AT_PX: f64 = 2.5;
        let pixel =
            |point: Point| self.camera.pixel_from_table(outline.pose.table_from_body(point), *height_m);
        let step = |at: Point, outward: Vec2| {
            let [inside, outside] =
                [-READ_AT_PX, READ_AT_PX].map(|px| pixel(at + outward * (px * self.pixel_m)));
            let step = |plane: &GreyImage| Some((plane.grey_at(outside)? - plane.grey_at(inside)?).abs());
            self.planes.iter().copied().filter_map(step).fold(0.0, f64::max)
        };
        let of_side =
            |side: Vec<(Point, Vec2)>| median(side.into_iter().map(|(at, outward)| step(at, outward)));
        sides(&outline.shape).into_iter().filter_map(of_side).fold(f64::INFINITY, f64::min)
    }
}

/// The tops that were found so far.
struct Chosen<'a> {
    view: TopView<'a>,
    tops: Vec<Candidate>,
}

impl Chosen<'_> {
    /// Whether a region overlaps no top, and if it is `apart` touches none.
    fn is_free(&self, region: &Region, apart: bool) -> bool {
        let is_hit =
            |top: &Candidate| top.region.overlaps(region) || apart && touches(&self.view, top, region);
        !self.tops.iter().any(is_hit)
    }
}

fn distinct(all: impl Iterator<Item = PlaneRegion>) -> Vec<PlaneRegion> {
    let mut by_strength: Vec<PlaneRegion> = all.collect();
    by_strength.sort_by(|a, b| {
        b.region.strength.total_cmp(&a.region.strength).then(b.region.area_px.cmp(&a.region.area_px))
    });
    let mut kept: Vec<PlaneRegion> = Vec::new();
    for found in by_strength {
        if !kept.iter().any(|other| has_same_border(&other.region, &found.region)) {
            kept.push(found);
        }
    }
    kept
}

/// Whether two lists are of the same regions.
fn are_same(a: &[&PlaneRegion], b: &[&PlaneRegion]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| std::ptr::eq(*a, *b))
}

/// Whether areas and centroids of two regions agree.
pub(super) fn has_same_border(a: &Region, b: &Region) -> bool {
    let [area, other] = [a, b].map(|region| region.area_px as f64);
    let off_px2 = (a.centroid.x - b.centroid.x).powi(2) + (a.centroid.y - b.centroid.y).powi(2);
    (area - other).abs() < SAME_BORDER * area && off_px2 < (0.5 * SAME_BORDER).powi(2) * area
}

/// Whether a top can carry a marker: its border is apart from the marker's. A blurred edge bounds several regions at distances below its width.
pub(super) fn can_carry(top: &Region, marker: &Region) -> bool {
    const MARGIN_PX: f64 = 3.0;
    const BLUR_PX: f64 = 6.0;
    const WITHIN_BLUR: f64 = 0.5;
    let fraction = marker.area_px as f64 / top.area_px as f64;
    (MARKER_FRACTIONS[0]..MARKER_FRACTIONS[1]).contains(&fraction)
        && top.covers(marker, MARGIN_PX)
        && top.covered_fraction(marker, BLUR_PX) > WITHIN_BLUR
}

/// Whether two regions can be top and silhouette of one object.
fn is_same_object(a: &Region, b: &Region) -> bool {
    const LEAST_RATIO: f64 = 0.5;
    let (small, large) = if a.area_px < b.area_px { (a, b) } else { (b, a) };
    small.area_px as f64 >= LEAST_RATIO * large.area_px as f64 && large.covers(small, 0.0)
}

/// Points of each side of a shape and the directions out of it, in the shape's frame; the sides of a disc are eighths.
fn sides(shape: &Shape) -> Vec<Vec<(Point, Vec2)>> {
    const POINTS: usize = 15;
    const SECTORS: usize = 8;
    // Near corners the edge is that of the other side.
    let fraction = |k: usize| (k as f64 + 1.0) / (POINTS as f64 + 1.0);
    if let Shape::Disc { radius_m } = shape {
        let point = |sector: usize, k: usize| {
            let out = Vec2::from_heading(TAU * (sector as f64 + fraction(k)) / SECTORS as f64);
            (Point::ORIGIN + out * *radius_m, out)
        };
        return (0..SECTORS).map(|sector| (0..POINTS).map(|k| point(sector, k)).collect()).collect();
    }
    let corners = shape.corners();
    let side = |k: usize| {
        let along = corners[(k + 1) % corners.len()] - corners[k];
        let out = along.direction().unwrap_or(Vec2::ZERO).rotated(-FRAC_PI_2);
        (0..POINTS).map(|i| (corners[k] + along * fraction(i), out)).collect()
    };
    (0..corners.len()).map(side).collect()
}

/// Whether two outlines have the same form, area and centroid within half a pixel.
pub(super) fn has_same_outline(a: &Fitted, b: &Fitted, pixel_m: f64) -> bool {
    const NEAR_PX: f64 = 0.5;
    let size = |fit: &Fitted| fit.shape.area_m2().sqrt();
    let near_m = NEAR_PX * pixel_m;
    let is_near = a.pose.position.distance(b.pose.position) < near_m && (size(a) - size(b)).abs() < near_m;
    is_near && a.complexity() == b.complexity()
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
    levels(view, region, pixel_m).is_some_and(|(top, table)| (top - table).abs() >= LEAST_STRENGTH)
}

/// The grey level just inside a region and that of the table a few millimetres outside.
pub(super) fn levels(view: &TopView, region: &Region, pixel_m: f64) -> Option<(f64, f64)> {
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
    median(inside).zip(median(outside))
}

/// Whether an outline without a marker is visible and wide enough.
fn is_bare_object(top: &Candidate) -> bool {
    top.outline.visible_fraction >= BARE_VISIBLE && is_wide(&top.outline.shape)
}

/// Whether a shape is as wide as an object without a marker is.
pub(super) fn is_wide(shape: &Shape) -> bool {
    const DIRECTIONS: usize = 36;
    let extent_m = |k: usize| {
        let along = Vec2::from_heading(PI * k as f64 / DIRECTIONS as f64);
        shape.reach_m(along) + shape.reach_m(-along)
    };
    let extents_m = || (0..DIRECTIONS).map(extent_m);
    let width_m = extents_m().fold(f64::INFINITY, f64::min);
    width_m >= BARE_WIDTH_M && extents_m().fold(0.0, f64::max) <= BARE_LENGTH * width_m
}

/// Whether a polygon is nearer to the edges of its object than a disc that nearly fits them.
fn is_nearer(polygon: &Fitted, disc: &Fitted, pixel_m: f64) -> bool {
    let is_same = (polygon.shape.area_m2() / disc.shape.area_m2() - 1.0).abs() < POLYGON_AREA
        && polygon.pose.position.distance(disc.pose.position) < pixel_m * CENTRED_PX;
    is_same
        && disc.rms_m > POLYGON_RMS_PX * pixel_m
        && polygon.rms_m < POLYGON_FACTOR * disc.rms_m
        && polygon.visible_fraction >= disc.visible_fraction - LESS_VISIBLE
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
