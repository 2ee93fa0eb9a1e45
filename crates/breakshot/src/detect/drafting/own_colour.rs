//! Where does the colour of a top end?
//!
//! A top has one colour, or one with a grain; its side, its shadow and the table have others, brighter or darker. In the plane of the distances from
//! the colour of a top, the top is darker than all that surrounds it, whatever that is. Distances are linear across an edge: it stays where it is.

use super::candidates::{Candidate, Kind, LEAST_STRENGTH, TopSearch, distinct_regions, has_same_outline};
use super::regions::{PLAIN_PLANES, Region, SearchPlanes};
use crate::capture::GreyImage;
use crate::detect::label::Window;
use crate::detect::markerless::edge_visibility::outline_points;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point};
use crate::statistics::median;

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
/// The window around an object, as a fraction of the width and the height of its region beyond it.
const AROUND: f64 = 0.6;
/// Area of a region over that of the outline whose colour it has.
const AREA_RATIOS: [f64; 2] = [0.3, 3.0];
/// So many regions of the colour are tried.
const MOST_REGIONS: usize = 6;

impl TopSearch<'_> {
    /// The planes of a colour: red, green and blue; the luma without them.
    fn colours(&self) -> std::ops::Range<usize> {
        if self.planes.len() >= PLAIN_PLANES { 1..PLAIN_PLANES } else { 0..1 }
    }

    /// The colour in the middle of an outline: the median of each plane (grey levels).
    fn colour_of(&self, top: &Candidate) -> Option<Vec<f64>> {
        let pixels = self.core(top);
        let level = |plane: usize| {
            let image = self.search_planes.smooth(plane);
            median(pixels.iter().filter_map(|&pixel| image.grey_at(pixel)))
        };
        self.colours().map(level).collect()
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
        let of_plane = |(plane, level): (usize, &f64)| {
            Some((self.search_planes.smooth(plane).grey_at(pixel)? - level).powi(2))
        };
        let squares: Option<Vec<f64>> = self.colours().zip(colour).map(of_plane).collect();
        squares.map(|squares| (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt())
    }

    /// The fraction of an outline's length at which its inside has the colour of its middle and its outside another one.
    pub(super) fn bounded_fraction(&self, top: &Candidate) -> f64 {
        let Some(colour) = self.colour_of(top) else { return 0.0 };
        let pose = top.outline.pose;
        let points = outline_points(&top.outline.shape, SPACING_PX * self.pixel_m);
        let bounds = |(at, outward): &(Point, crate::geometry::Vec2)| {
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

    /// The same object with the outline of its own colour, if that bounds the colour better.
    pub(super) fn of_own_colour(&self, top: Candidate) -> Candidate {
        let Some(own) = self.in_own_colour(&top) else { return top };
        if std::env::var("BSDEBUG").is_ok() {
            for (n, c) in [("orig", &top), ("own", &own)] {
                let p = self.camera.pixel_from_table(c.outline.pose.position, c.height_m);
                println!("      {n} at {:.0},{:.0} h {:.4} n {} area {:.0} rms {:.3} vis {:.2} bounded {:.3}", p.x, p.y, c.height_m, c.outline.shape.corners().len(), 1e6*c.outline.shape.area_m2(), 1e3*c.outline.rms_m, c.outline.visible_fraction, self.bounded_fraction(c));
            }
        }
        if has_same_outline(&own.outline, &top.outline, self.pixel_m) {
            return top;
        }
        if self.bounded_fraction(&own) > self.bounded_fraction(&top) + BETTER { own } else { top }
    }

    /// The object of the colour in the middle of an outline.
    fn in_own_colour(&self, top: &Candidate) -> Option<Candidate> {
        let colour = self.colour_of(top)?;
        let window = around(top.region.window(), &self.planes[0]);
        let plane = self.distances(&colour, window);
        let planes = std::slice::from_ref(&plane);
        let own = TopSearch { planes, search_planes: SearchPlanes::within(planes, window), ..*self };
        let area_px = top.outline.shape.area_m2() / (self.pixel_m * self.pixel_m);
        let [least_px, most_px] = AREA_RATIOS.map(|ratio| (ratio * area_px) as u64);
        let middle = self.camera.pixel_from_table(top.outline.pose.position, top.height_m);
        let found = own.search_planes.regions(0, window, &(least_px.max(1)..=most_px.max(2)));
        let is_own = |region: &Region| {
            region.strength >= LEAST_STRENGTH
                && !region.is_light
                && (region.contains(middle) || region.overlaps(&top.region))
        };
        let regions = distinct_regions(found.into_iter().filter(is_own));
        let fits = regions.iter().take(MOST_REGIONS).flat_map(|region| own.fits(region, top.height_m));
        let found = own.simplest(fits.collect(), Kind::Bare)?;
        // The own plane is none of the search.
        Some(Candidate { plane: top.plane, around: top.around.clone(), ..found })
    }

    /// The plane of the distances from a colour in a window; the largest distance beyond it.
    fn distances(&self, colour: &[f64], window: Window) -> GreyImage {
        let image = &self.planes[0];
        let mut pixels = vec![u8::MAX; image.pixels.len()];
        for y in window.y[0]..window.y[1] {
            for at in y * image.width + window.x[0]..y * image.width + window.x[1] {
                let planes = self.colours().zip(colour);
                let squares = planes.map(|(plane, level)| (f64::from(self.planes[plane].pixels[at]) - level).powi(2));
                let mean = squares.sum::<f64>() / colour.len().max(1) as f64;
                pixels[at] = mean.sqrt().round().min(f64::from(u8::MAX)) as u8;
            }
        }
        GreyImage { pixels, ..*image }
    }
}

/// A window with margins on all sides, within an image.
fn around(window: Window, image: &GreyImage) -> Window {
    let grown = |[from, to]: [usize; 2], most: usize| {
        let margin = (AROUND * (to - from) as f64) as usize;
        [from.saturating_sub(margin), (to + margin).min(most)]
    };
    Window { x: grown(window.x, image.width), y: grown(window.y, image.height) }
}
