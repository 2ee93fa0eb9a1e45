//! Which regions of a picture are the tops of objects?
//!
//! A top has an edge all around that a disc, a rectangle or a polygon fits. So have markers on it, its silhouette with its side, and sometimes
//! its shadow. A region that contains a smaller one, its marker, is a top before all others; regions that touch a top are its side and its shadow.

use super::edges::TopView;
use super::regions::{Region, regions, uniform_regions};
use super::shape_fit::{Fitted, simplest};
use crate::capture::GreyImage;
use crate::cell::Cell;
use crate::detect::label::Window;
use crate::geometry::Pixel;
use crate::geometry::outline::Outline;
use crate::statistics::median;

/// A region and the outline that fits it.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    pub region: Region,
    /// Where its outline fits best: 0 for the luma, then the colours.
    pub plane: usize,
    /// At `height_m`.
    pub outline: Fitted,
    pub height_m: f64,
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
/// Least step of grey level around a silhouette, above that of most shadows.
const SILHOUETTE_STRENGTH: f64 = 15.0;
/// Largest area of a marker (m2), and the least step of grey level around it.
const MOST_MARKER_M2: f64 = 2.5e-3;
const MARKER_STRENGTH: f64 = 12.0;
/// A marker with at least this step is none of a shadow.
const CERTAIN_STRENGTH: f64 = 30.0;
/// Heights that are tried for a silhouette (m).
const HEIGHTS_M: [f64; 4] = [0.015, 0.03, 0.045, 0.06];
/// The edge of a top is at least this fraction as strong as the strongest one around its marker.
const LEAST_RELATIVE: f64 = 0.15;
/// So much of the outline of an object without a marker is visible.
const BARE_VISIBLE: f64 = 0.9;
/// Regions nearer than this touch (px).
const TOUCHING_PX: f64 = 3.0;

/// The tops in a picture, of which `planes` are the luma and the colours.
pub(super) fn tops<'a>(planes: &'a [GreyImage], view: &TopView<'a>, cell: &Cell) -> Vec<Candidate> {
    let middle = cell.workspace.min_m + (cell.workspace.max_m - cell.workspace.min_m) * 0.5;
    let pixel_m = view.pixel_m(view.camera.pixel_from_table(middle, view.height_m));
    if !pixel_m.is_finite() || pixel_m <= 0.0 {
        return Vec::new();
    }
    let search = Search { planes, view: *view, cell, pixel_m };
    let all = search.regions();
    let inks: Vec<&PlaneRegion> = all.iter().filter(|found| !found.several && search.is_ink(found)).collect();
    // What carries ink itself is a top. The regions are in the order of their strengths.
    let is_blank = |found: &&PlaneRegion| !inks.iter().any(|ink| can_carry(&found.region, &ink.region));
    let markers: Vec<&PlaneRegion> = inks.iter().copied().filter(is_blank).collect();
    let mut large: Vec<&PlaneRegion> = all.iter().filter(|found| search.is_top_size(found)).collect();
    large.sort_by_key(|found| found.region.area_px);
    if let Ok(d) = std::env::var("DBG") {
        let v: Vec<f64> = d.split(',').filter_map(|x| x.parse().ok()).collect();
        let px = view.camera.pixel_from_table(crate::geometry::Point::new(v[0] / 1e3, v[1] / 1e3), view.height_m);
        for m in &markers {
            if m.region.centroid.distance_px(px) < 40.0 { eprintln!("marker plane {} area {} strength {:.0} at {:?}", m.plane, m.region.area_px, m.region.strength, m.region.centroid); }
        }
        for l in all.iter().filter(|l| l.region.contains(px) && l.region.area_px > 300) {
            let v = search.view(l.plane);
            let _=v; let own = search.best(|v| v.nearest(&l.region)).map(|x| x.1); let out = search.best(|v| v.outline(&l.region)).map(|x| x.1);
            let show = |f: &Option<Fitted>| f.as_ref().map(|f| format!("{} {:.2}px fits {}", match &f.shape { crate::object::Shape::Disc{..} => 'd'.to_string(), s => s.corners().len().to_string() }, f.rms_m / search.pixel_m, f.fits));
            eprintln!("region {} plane {} area {} strength {:.1} light {} top_size {} own {:?} outline {:?}", l.several, l.plane, l.region.area_px, l.region.strength, l.region.is_light, search.is_top_size(l), show(&own), show(&out));
        }
    }
    let mut chosen = Chosen { view, tops: Vec::new() };
    for marker in &markers {
        let apart = marker.region.strength < CERTAIN_STRENGTH;
        let mut around = large
            .iter()
            .copied()
            .filter(|found| can_carry(&found.region, &marker.region) && chosen.is_free(&found.region, apart));
        // Silhouettes and shadows need more corners than tops, and parts of tops have weaker edges.
        let fits: Vec<(Candidate, f64)> = around.clone().filter_map(|found| search.top(found)).collect();
        let strongest = fits.iter().map(|(_, strength)| *strength).fold(0.0, f64::max);
        if std::env::var("DBG").is_ok() { for (c, st) in &fits { eprintln!("fit marker {:?} area {} plane {} complexity {} rms {:.2} visible {:.2} strength {:.1}", marker.region.centroid, c.region.area_px, c.plane, c.outline.complexity(), c.outline.rms_m / pixel_m, c.outline.visible_fraction, st); } }
        let likely = fits.into_iter().filter(|(_, strength)| *strength >= LEAST_RELATIVE * strongest);
        let top = likely.map(|(top, _)| top).min_by_key(|top| top.outline.complexity());
        let top = top.or_else(|| around.find_map(|found| search.silhouette(found, LEAST_STRENGTH)));
        chosen.tops.extend(top);
    }
    // Without a marker the strongest edges first
    let is_bare =
        |found: &&&PlaneRegion| !found.several && !markers.iter().any(|marker| can_carry(&found.region, &marker.region));
    let mut bare: Vec<&PlaneRegion> = large.iter().filter(is_bare).copied().collect();
    bare.sort_by(|a, b| b.region.strength.total_cmp(&a.region.strength));
    for found in bare {
        if chosen.is_free(&found.region, true) {
            chosen.tops.extend(search.bare(found));
        }
    }
    chosen.tops
}

/// A region of one of the planes.
struct PlaneRegion {
    region: Region,
    plane: usize,
    /// Whether its edges are those of several planes together.
    several: bool,
}

/// Where tops are searched.
struct Search<'a> {
    planes: &'a [GreyImage],
    view: TopView<'a>,
    cell: &'a Cell,
    pixel_m: f64,
}

impl<'a> Search<'a> {
    /// The regions of all planes, of regions with the same border the one with the strongest edge.
    fn regions(&self) -> Vec<PlaneRegion> {
        let most_px = (AREAS_M2[1] / (self.pixel_m * self.pixel_m)) as u64;
        let areas_px = LEAST_MARKER_PX..=most_px.max(LEAST_MARKER_PX + 1);
        let of_plane = |plane: usize| {
            let image = &self.planes[plane];
            let found = regions(image, Window::whole(image), &areas_px).into_iter();
            found.map(move |region| PlaneRegion { region, plane, several: false })
        };
        let stands_out = |found: &PlaneRegion| {
            found.region.strength >= LEAST_STRENGTH && is_on_table(&self.view, self.cell, &found.region)
        };
        let window = Window::whole(&self.planes[0]);
        let uniform = if self.planes.len() > 1 { uniform_regions(self.planes, window, &areas_px) } else { Vec::new() };
        let uniform = uniform.into_iter().map(|region| PlaneRegion { region, plane: 0, several: true });
        let uniform: Vec<PlaneRegion> = uniform.filter(stands_out).collect();
        let mut all = distinct((0..self.planes.len()).flat_map(of_plane).filter(stands_out));
        let new = |found: &PlaneRegion| !all.iter().any(|other| has_same_border(&other.region, &found.region));
        let new: Vec<PlaneRegion> = distinct(uniform.into_iter()).into_iter().filter(new).collect();
        all.extend(new);
        all
    }

    fn view(&self, plane: usize) -> TopView<'a> {
        TopView { image: &self.planes[plane], ..self.view }
    }

    /// Whether a region is large enough for a top, and other than the table.
    fn is_top_size(&self, PlaneRegion { region, plane, .. }: &PlaneRegion) -> bool {
        let area_m2 = region.area_px as f64 * self.pixel_m * self.pixel_m;
        area_m2 >= AREAS_M2[0] && differs(&self.view(*plane), region, self.pixel_m)
    }

    /// Whether a region has the outline of a marker.
    fn is_ink(&self, PlaneRegion { region, plane, .. }: &PlaneRegion) -> bool {
        let area_m2 = region.area_px as f64 * self.pixel_m * self.pixel_m;
        let ink = TopView { solid: false, ..self.view(*plane) };
        area_m2 <= MOST_MARKER_M2
            && region.strength >= MARKER_STRENGTH
            && ink.nearest(region).is_some_and(|outline| outline.fits)
    }

    /// A region as a top, and the strength of its outline.
    fn top(&self, found: &PlaneRegion) -> Option<(Candidate, f64)> {
        let region = &found.region;
        let (plane, outline) = self.best(|view| view.nearest(region))?;
        let outline = self.view(plane).simplified(outline, self.pixel_m);
        let strength = self.strength(&outline);
        Some((Candidate { region: region.clone(), plane, outline, height_m: self.view.height_m }, strength))
    }

    /// A region without a marker as an object: its outline is visible all around.
    fn bare(&self, found: &PlaneRegion) -> Option<Candidate> {
        let visible = |top: &Candidate| top.outline.visible_fraction >= BARE_VISIBLE;
        let top = self.top(found).map(|(top, _)| top).filter(visible);
        top.or_else(|| self.silhouette(found, SILHOUETTE_STRENGTH).filter(visible))
    }

    /// The step of grey level across the weakest parts of an outline, in that plane in which it is largest.
    fn strength(&self, outline: &Fitted) -> f64 {
        const READ_AT_PX: f64 = 2.5;
        const WEAKEST: f64 = 0.15;
        let center = self.view.camera.pixel_from_table(outline.pose.position, self.view.height_m);
        let points = outline.shape.outline_points();
        let step = |point: &crate::geometry::Point| {
            let at = self.view.camera.pixel_from_table(outline.pose.table_from_body(*point), self.view.height_m);
            let (dx, dy) = (at.x - center.x, at.y - center.y);
            let length_px = dx.hypot(dy).max(1.0);
            let off = |px: f64| Pixel::new(at.x + px * dx / length_px, at.y + px * dy / length_px);
            let planes = self.planes.iter().filter_map(|plane| {
                Some((plane.grey_at(off(READ_AT_PX))? - plane.grey_at(off(-READ_AT_PX))?).abs())
            });
            planes.fold(0.0, f64::max)
        };
        let mut steps: Vec<f64> = points.iter().map(step).collect();
        steps.sort_unstable_by(f64::total_cmp);
        steps.get((WEAKEST * steps.len() as f64) as usize).copied().unwrap_or(0.0)
    }

    /// A region as the silhouette of an object: its height decides which top it has.
    fn silhouette(&self, found: &PlaneRegion, least_strength: f64) -> Option<Candidate> {
        let region = &found.region;
        if region.strength < least_strength {
            return None;
        }
        let heights_m = std::iter::once(self.view.height_m).chain(HEIGHTS_M);
        let at = |height_m: f64| {
            let (plane, outline) = self.best(|view| TopView { height_m, ..*view }.outline(region))?;
            let outline = TopView { height_m, ..self.view(plane) }.simplified(outline, self.pixel_m);
            Some(Candidate { region: region.clone(), plane, outline, height_m })
        };
        heights_m.filter_map(at).next()
    }

    /// The plane in which an outline fits best, and the outline.
    fn best(&self, outline: impl Fn(&TopView) -> Option<Fitted>) -> Option<(usize, Fitted)> {
        let all: Vec<(usize, Fitted)> = (0..self.planes.len())
            .filter_map(|plane| Some((plane, outline(&self.view(plane)).filter(|fit| fit.fits)?)))
            .collect();
        let best = simplest(all.iter().map(|(_, fit)| fit.clone()).collect())?;
        all.into_iter().find(|(_, fit)| fit.rms_m.to_bits() == best.rms_m.to_bits())
    }
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

/// Whether areas and centroids of two regions agree.
fn has_same_border(a: &Region, b: &Region) -> bool {
    let [area, other] = [a, b].map(|region| region.area_px as f64);
    let off_px = (a.centroid.x - b.centroid.x).hypot(a.centroid.y - b.centroid.y);
    (area - other).abs() < SAME_BORDER * area && off_px < 0.5 * SAME_BORDER * area.sqrt()
}

/// Whether a top can carry a marker.
fn can_carry(top: &Region, marker: &Region) -> bool {
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
