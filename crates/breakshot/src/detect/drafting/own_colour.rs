//! Where does the colour of a top end?
//!
//! A top has one colour, or one with a grain; its side, its shadow and the table have others, brighter or darker. In the plane of the distances from
//! the colour of a top, the top is darker than all that surrounds it, whatever that is. Distances are linear across an edge: it stays where it is.

use super::candidates::{Candidate, Kind, TopSearch, has_same_border, has_same_outline, levels};
use super::contrast::TABLE_LEVEL;
use super::regions::{PLAIN_PLANES, Region, SearchPlanes};
use crate::capture::GreyImage;
use crate::detect::label::Window;
use crate::detect::markerless::edge_visibility::outline_points;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point, Vec2};
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, median};
use std::rc::Rc;

/// The colour of the top is read at so many points in each direction of the outline's extent, at least so far inside (px).
const GRID: usize = 24;
const CORE_PX: f64 = 3.0;
/// Distance from the outline at which inside and outside are read (px), and distance of these points along it.
const READ_AT_PX: f64 = 3.0;
const SPACING_PX: f64 = 2.0;
/// The outside is further from the colour of the top than the inside by at least this (grey levels).
const LEAST_FURTHER: f64 = 6.0;
/// An outline bounds its colour better than another by more than this fraction of its length.
const BETTER: f64 = 0.04;
/// The colour of a region is read at so many of its pixels.
const MOST_PIXELS: usize = 1000;
/// The window around an object, as a fraction of the width and the height of its region beyond it.
const AROUND: f64 = 0.6;
/// Area of a region over that of the outline whose colour it has.
const AREA_RATIOS: [f64; 2] = [0.3, 3.0];
/// The colour ends at so many standard deviations of its grain and noise, or at a multiple of that where that has no region.
const GRAIN_STDS: f64 = 4.0;
const LIMITS: [f64; 3] = [1.0, 1.6, 2.5];
/// Distance from the end of the colour at which an outline agrees no more (px), the mean agreement of an outline, and by how much less another may agree.
const DISAGREES_PX: f64 = 3.0;
const LEAST_AGREEMENT: f64 = 0.6;
const LESS_AGREEMENT: f64 = 0.04;
/// A region with an outline that agrees at least so well is the whole top. The agreement with the end of the colour at a larger limit is better by at least this.
const CLOSED_AGREEMENT: f64 = 0.77;
const MORE_AGREEMENT: f64 = 0.08;

impl TopSearch<'_> {
    /// The planes of a colour: red, green and blue; the luma without them.
    fn colours(&self) -> std::ops::Range<usize> {
        if self.planes.len() >= PLAIN_PLANES { 1..PLAIN_PLANES } else { 0..1 }
    }

    /// The colour in the middle of an outline: the median of each plane, and the largest distance from it (grey levels) that belongs to its grain and its noise.
    fn colour_of(&self, top: &Candidate) -> Option<(Vec<f64>, f64)> {
        let pixels = self.core(top);
        let level = |plane: usize| {
            let image = self.search_planes.smooth(plane);
            median(pixels.iter().filter_map(|&pixel| image.grey_at(pixel)))
        };
        let colour: Vec<f64> = self.colours().map(level).collect::<Option<_>>()?;
        let distances: Vec<f64> = pixels.iter().filter_map(|&pixel| self.distance(pixel, &colour)).collect();
        let middle = median(distances.iter().copied())?;
        let scatter = STD_OVER_MEDIAN_ABSOLUTE * median(distances.iter().map(|here| (here - middle).abs()))?;
        Some((colour, (middle + GRAIN_STDS * scatter).max(LEAST_FURTHER)))
    }

    /// Pixels of a grid inside an outline and apart from it.
    fn core(&self, top: &Candidate) -> Vec<Pixel> {
        let outline = Outline::new(&top.outline.shape, top.outline.pose);
        let reach_m = top.outline.shape.outer_radius_m();
        let margin_m = CORE_PX * self.pixel_m;
        let offset_m = |k: usize| reach_m * (2.0 * (k as f64 + 0.5) / GRID as f64 - 1.0);
        let at = |k: usize| Point::new(offset_m(k % GRID), offset_m(k / GRID));
        (0..GRID * GRID)
            .map(|k| top.outline.pose.position + at(k).to_vec())
            .filter(|&point| outline.contains(point) && outline.border_distance_m(point) > margin_m)
            .map(|point| self.camera.pixel_from_table(point, top.height_m))
            .collect()
    }

    /// The distance of a pixel's colour from another (grey levels, root mean square of the planes).
    fn distance(&self, pixel: Pixel, colour: &[f64]) -> Option<f64> {
        let of_plane = |plane: usize| self.search_planes.smooth(plane).grey_at(pixel);
        let levels: Option<Vec<f64>> = self.colours().map(of_plane).collect();
        levels.map(|levels| root_mean_square(levels.into_iter(), colour))
    }

    /// The fraction of an outline's length at which its inside has the colour of its middle and its outside another one.
    pub(super) fn bounded_fraction(&self, top: &Candidate) -> f64 {
        let Some((colour, _)) = self.colour_of(top) else { return 0.0 };
        let pose = top.outline.pose;
        let points = outline_points(&top.outline.shape, SPACING_PX * self.pixel_m);
        let bounds = |(at, outward): &(Point, Vec2)| {
            let distance = |px: f64| {
                let point = pose.table_from_body(*at + *outward * (px * self.pixel_m));
                self.distance(self.camera.pixel_from_table(point, top.height_m), &colour)
            };
            distance(-READ_AT_PX)
                .zip(distance(READ_AT_PX))
                .is_some_and(|(inside, outside)| outside >= inside + LEAST_FURTHER)
        };
        points.iter().filter(|point| bounds(point)).count() as f64 / points.len().max(1) as f64
    }

    /// Whether a region has the table's colour and is darker than what is around it, as a shadow; not known without colours.
    pub(super) fn may_be_shadow(&self, region: &Region) -> bool {
        let contrasts = PLAIN_PLANES..self.planes.len();
        let every = region.area_px.div_ceil(MOST_PIXELS).max(1);
        let level = |plane: usize| {
            let image = self.search_planes.smooth(plane);
            median(region.pixels().step_by(every).filter_map(|pixel| image.grey_at(pixel)))
        };
        let is_neutral =
            |plane: usize| level(plane).is_some_and(|level| (level - TABLE_LEVEL).abs() < LEAST_FURTHER);
        !contrasts.is_empty()
            && contrasts.into_iter().all(is_neutral)
            && levels(&self.view(0, self.height_m), region, self.pixel_m)
                .is_some_and(|(inside, outside)| inside < outside)
    }

    /// The top among outlines of one object that agrees best with where its own colour ends; `top` is the one that was found without it.
    pub(super) fn settled(&self, top: Candidate, fits: &[Candidate]) -> Candidate {
        let Some(own) = self.in_own_colour(&top, fits) else { return top };
        // The plane of the distances is not one of the picture: the luma stands for it.
        let own = Candidate { plane: own.plane % self.planes.len(), around: Rc::clone(&top.around), ..own };
        if has_same_outline(&own.outline, &top.outline, self.pixel_m)
            || self.bounded_fraction(&own) < self.bounded_fraction(&top) - BETTER
        {
            return top;
        }
        own
    }

    /// The outline that agrees with the end of the colour in the middle of another outline; `fits` are outlines of the same object.
    fn in_own_colour(&self, top: &Candidate, fits: &[Candidate]) -> Option<Candidate> {
        let (colour, limit) = self.colour_of(top)?;
        let window = around(top.region.window(), self.planes[0]);
        let plane = self.distances(&colour, window);
        let planes = self.planes.iter().copied().chain(std::iter::once(&plane)).collect();
        let search_planes = SearchPlanes::within(std::slice::from_ref(&plane), window);
        let own = TopSearch { planes, search_planes, ..*self };
        let mut best: Option<(f64, Vec<Candidate>)> = None;
        for region in own.regions_of_colour(top, limit, window) {
            let border = first_edges(own.search_planes.smooth(0), &region.border).into_iter();
            let border: Vec<Point> =
                border.map(|pixel| self.camera.table_from_pixel(pixel, top.height_m)).collect();
            let all: Vec<Candidate> = fits.iter().cloned().chain(own.fits(&region, top.height_m)).collect();
            let (most, agreeing) = agreeing(all, &border, self.pixel_m);
            let least = best.as_ref().map_or(LEAST_AGREEMENT, |(most, _)| most + MORE_AGREEMENT);
            if most >= least {
                best = Some((most, agreeing));
            }
            // Beyond the grain of the top, a larger region has more of its side.
            if most >= CLOSED_AGREEMENT {
                break;
            }
        }
        own.simplest(best?.1, Kind::Marked)
    }

    /// The regions of a colour around the middle of an outline, in the first plane of this search, that of the distances from the colour; the closest limit first.
    fn regions_of_colour(&self, top: &Candidate, limit: f64, window: Window) -> Vec<Region> {
        let area_px = top.outline.shape.area_m2() / (self.pixel_m * self.pixel_m);
        let [least_px, most_px] = AREA_RATIOS.map(|ratio| (ratio * area_px) as u64);
        let areas_px = least_px.max(1)..=most_px.max(2);
        let is_own = |region: &Region| region.contains(top.region.centroid) || region.overlaps(&top.region);
        let mut kept: Vec<Region> = Vec::new();
        for factor in LIMITS {
            let level = (factor * limit).clamp(1.0, 254.0) as u8;
            let found = self.search_planes.regions_below(0, level, window, &areas_px).into_iter();
            let own = found.filter(is_own).max_by_key(|region| region.area_px);
            let is_new = |region: &Region| !kept.iter().any(|other| has_same_border(other, region));
            kept.extend(own.filter(is_new));
        }
        kept
    }

    /// The plane of the distances from a colour in a window; the largest distance beyond it.
    fn distances(&self, colour: &[f64], window: Window) -> GreyImage {
        let image = self.planes[0];
        let mut pixels = vec![u8::MAX; image.pixels.len()];
        for y in window.y[0]..window.y[1] {
            let row = y * image.width;
            let (from, to) = (row + window.x[0], row + window.x[1]);
            for (at, distance) in pixels[from..to].iter_mut().enumerate().map(|(k, pixel)| (from + k, pixel))
            {
                let of_plane = |plane: usize| f64::from(self.search_planes.smooth(plane).pixels[at]);
                let here = root_mean_square(self.colours().map(of_plane), colour);
                *distance = here.round().min(f64::from(u8::MAX)) as u8;
            }
        }
        GreyImage { pixels, ..*image }
    }
}

/// The root of the mean square of the differences of levels from those of a colour (grey levels).
fn root_mean_square(levels: impl Iterator<Item = f64>, colour: &[f64]) -> f64 {
    let squares = levels.zip(colour).map(|(level, of_colour)| (level - of_colour).powi(2));
    (squares.sum::<f64>() / colour.len().max(1) as f64).sqrt()
}

/// A window with margins on all sides, within an image.
fn around(window: Window, image: &GreyImage) -> Window {
    let grown = |[from, to]: [usize; 2], most: usize| {
        let margin = (AROUND * (to - from) as f64) as usize;
        [from.saturating_sub(margin), (to + margin).min(most)]
    };
    Window { x: grown(window.x, image.width), y: grown(window.y, image.height) }
}

/// The best agreement of outlines with points of the end of their colour, and those of about this agreement.
fn agreeing(fits: Vec<Candidate>, border: &[Point], pixel_m: f64) -> (f64, Vec<Candidate>) {
    let agreements: Vec<f64> = fits.iter().map(|fit| agreement(fit, border, pixel_m)).collect();
    let most = agreements.iter().copied().fold(0.0, f64::max);
    let is_near = |(fit, here): (Candidate, f64)| (here >= most - LESS_AGREEMENT).then_some(fit);
    (most, fits.into_iter().zip(agreements).filter_map(is_near).collect())
}

/// The mean agreement of an outline with points of the end of its colour, at its height: 1 on it, 0 for distances beyond [`DISAGREES_PX`].
fn agreement(fit: &Candidate, border: &[Point], pixel_m: f64) -> f64 {
    let outline = Outline::new(&fit.outline.shape, fit.outline.pose);
    let limit_m = DISAGREES_PX * pixel_m;
    let here = |point: &Point| 1.0 - outline.border_distance_m(*point).min(limit_m) / limit_m;
    border.iter().filter(|point| point.is_finite()).map(here).sum::<f64>() / border.len().max(1) as f64
}

/// The first edge of a plane outward of each pixel of a border.
fn first_edges(image: &GreyImage, border: &[Pixel]) -> Vec<Pixel> {
    const DIRECTION_POINTS: usize = 4;
    const FROM_PX: f64 = -1.0;
    const STEP_PX: f64 = 0.5;
    const STEPS: usize = 9;
    const LEAST_SLOPE: f64 = 1.5;
    const LEAST_FRACTION: f64 = 0.25;
    let n = border.len();
    let edge = |k: usize| {
        let (from, to) = (border[(k + n - DIRECTION_POINTS % n) % n], border[(k + DIRECTION_POINTS) % n]);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let length_px = dx.hypot(dy).max(1.0);
        // The walk goes clockwise in the image: outside is on its left.
        let at = |px: f64| Pixel::new(border[k].x + px * dy / length_px, border[k].y - px * dx / length_px);
        let slope = |i: usize| {
            let px = FROM_PX + i as f64 * STEP_PX;
            image.grey_at(at(px + STEP_PX)).zip(image.grey_at(at(px - STEP_PX))).map_or(0.0, |(b, a)| b - a)
        };
        let slopes: Vec<f64> = (0..STEPS).map(slope).collect();
        let least = LEAST_SLOPE.max(LEAST_FRACTION * slopes.iter().copied().fold(0.0, f64::max));
        let is_peak =
            |&i: &usize| slopes[i] >= least && slopes[i] >= slopes[i - 1] && slopes[i] > slopes[i + 1];
        (1..STEPS - 1).find(is_peak).map_or(border[k], |i| at(FROM_PX + i as f64 * STEP_PX))
    };
    (0..n).map(edge).collect()
}

#[cfg(test)]
mod tests {
    use super::super::contrast::contrasts;
    use super::*;
    use crate::capture::{Camera, Lens};
    use crate::cell::{Cell, Striker, Transform, Workspace};

    const SIDE: usize = 64;

    fn image(level: impl Fn(usize, usize) -> u8) -> GreyImage {
        let pixels = (0..SIDE * SIDE).map(|k| level(k % SIDE, k / SIDE)).collect();
        GreyImage { width: SIDE, height: SIDE, pixels }
    }

    #[test]
    fn the_first_edge_outward_is_that_of_the_top_and_not_the_higher_one_of_its_side() {
        // A square top, a side of 3 px around it, the table
        let distance = |x: usize, y: usize| x.abs_diff(32).max(y.abs_diff(32));
        let plane =
            image(|x, y| [20, 60, 200][usize::from(distance(x, y) > 10) + usize::from(distance(x, y) > 13)]);
        let square: Vec<Pixel> = (0..80)
            .map(|k| {
                let (along, side) = ((k % 20) as f64 - 10.0, k / 20);
                let [x, y] = [[along, -10.0], [10.0, along], [-along, 10.0], [-10.0, -along]][side];
                Pixel::new(32.0 + x, 32.0 + y)
            })
            .collect();
        let edges = first_edges(&plane, &square);
        let off_px = |pixel: &Pixel| (pixel.x - 32.0).abs().max((pixel.y - 32.0).abs()) - 10.5;
        // Near corners directions are between those of the sides.
        let apart = (0..80).filter(|k| (5..15).contains(&(k % 20)));
        let worst_px = apart.map(|k| off_px(&edges[k]).abs()).fold(0.0, f64::max);
        assert!(worst_px <= 0.5, "{worst_px} px");
    }

    #[test]
    fn what_is_darker_and_has_the_colour_of_the_table_may_be_a_shadow() {
        // Pixels of a millimetre: the table is read some millimetres beyond a border.
        let at = Transform { position_m: [0.0, 0.0, 1.0], rpy_rad: [0.0; 3] };
        let camera = Camera::new([SIDE; 2], Lens::pinhole([SIDE; 2], 1000.0), at);
        let cell = Cell::from_above(1000.0, Workspace::centred([0.06, 0.06]), Striker::none());
        let table = [150.0, 120.0, 70.0];
        for (patch, is_shadow) in [(table.map(|level| 0.5 * level), true), ([40.0, 50.0, 110.0], false)] {
            let is_patch = |x: usize, y: usize| (24..40).contains(&x) && (24..40).contains(&y);
            let plane =
                |channel: usize| image(|x, y| (if is_patch(x, y) { patch } else { table })[channel] as u8);
            let colours = [0, 1, 2].map(plane);
            let luma = plane(1);
            let contrasts = contrasts(&colours, &camera, &cell);
            let planes: Vec<GreyImage> = std::iter::once(luma).chain(colours).chain(contrasts).collect();
            let search = TopSearch::new(&planes, &camera, &cell, 0.0).expect("the workspace is seen");
            let regions = search.search_planes.regions(0, Window::whole(&planes[0]), &(100..=400));
            let region = regions.first().expect("the patch");
            assert_eq!(search.may_be_shadow(region), is_shadow, "{patch:?}");
        }
    }
}
