//! Which parts of an image are bounded by an edge all around?
//!
//! Components of the grey levels at every threshold, and components of small gradient, which also separate a top from a shadow that is
//! darker and a table that is lighter. Holes are filled, so that a marker belongs to its top.

use crate::capture::GreyImage;
use crate::detect::label::{Component, Labeller, Level, Window};
use crate::detect::threshold::search_thresholds;
use crate::geometry::Pixel;
use std::ops::RangeInclusive;

/// A region without holes and the edge around it.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// The window of `mask`, which has a free pixel on each side of the region.
    window: Window,
    mask: Vec<bool>,
    /// Number of pixels, with the filled holes.
    pub area_px: usize,
    /// Mean position of its pixels.
    pub centroid: Pixel,
    /// The pixels of its border, in the order of a walk around it.
    pub border: Vec<Pixel>,
    /// Step of grey level across the weakest parts of the border.
    pub strength: f64,
    /// Whether it is lighter inside than outside.
    pub is_light: bool,
}

/// Whether all of a region is lighter than what is outside or all of it darker, or parts of it may be either.
#[derive(Clone, Copy)]
enum Sign {
    Same,
    Either,
}

/// Images in which the edge around a region is measured, and its sign.
type Edges<'a> = (&'a [GreyImage], Sign);

/// Levels of the gradient (grey levels per two pixels) below which an area is uniform.
const GRADIENTS: [u8; 6] = [5, 8, 12, 18, 28, 44];
/// By this many pixels a uniform area ends before the edge around it.
const GRADIENT_REACH_PX: usize = 2;
/// The bounding box of a region is at most this factor larger than the largest area that is searched: lines of a table have larger ones.
const MOST_BOX: u64 = 4;
/// Distance on either side of the border at which grey levels are compared (px), beyond the blur of the lens, and offsets of the border.
const READ_AT_PX: f64 = 2.0;
const OFFSETS_PX: [f64; 3] = [-1.0, 0.0, 1.0];
/// The weakest parts are this fraction of the border: corners have no edge across their normal.
const WEAKEST: f64 = 0.15;
/// Half the distance of the border's points that give its direction.
const DIRECTION_POINTS: usize = 4;
/// A border of fewer points has no direction.
const LEAST_BORDER: usize = 4 * DIRECTION_POINTS;

/// A region belongs to a top if at least this fraction of its border does.
pub(super) const NEARLY_ALL: f64 = 0.95;

/// Number of planes that are luma and colours: the others are combinations of them, with more noise.
pub(super) const PLAIN_PLANES: usize = 4;

/// The planes of a picture as regions are searched in them: smoothed, and the gradients of the smoothed ones.
pub(super) struct SearchPlanes {
    smooth: Vec<GreyImage>,
    steep: Vec<GreyImage>,
}

impl SearchPlanes {
    pub(super) fn new(planes: &[GreyImage]) -> Self {
        let whole = Window { x: [0, usize::MAX], y: [0, usize::MAX] };
        Self::within(planes, whole)
    }

    /// The same in a window; what is beyond it stays as it is.
    pub(super) fn within(planes: &[GreyImage], window: Window) -> Self {
        let smooth_for_search = |(plane, image): (usize, &GreyImage)| {
            let once = smoothed(image, window);
            if plane < PLAIN_PLANES { once } else { smoothed(&once, window) }
        };
        let smooth: Vec<GreyImage> = planes.iter().enumerate().map(smooth_for_search).collect();
        let steep = smooth.iter().map(|image| gradient(image, window)).collect();
        Self { smooth, steep }
    }

    /// A plane, smoothed.
    pub(super) fn smooth(&self, plane: usize) -> &GreyImage {
        &self.smooth[plane]
    }

    /// All regions of a plane in a window whose number of pixels lies in a range.
    pub(super) fn regions(
        &self,
        plane: usize,
        window: Window,
        areas_px: &RangeInclusive<u64>,
    ) -> Vec<Region> {
        let smooth = &self.smooth[plane];
        let greys = search_thresholds().flat_map(|level| [Level::Below(level), Level::Above(level)]);
        let passes = greys.map(|level| (smooth, level, 0));
        let edges = (std::slice::from_ref(smooth), Sign::Same);
        searched(passes.chain(uniform(&self.steep[plane])), edges, window, areas_px)
    }

    /// The regions of a plane in a window below a level.
    pub(super) fn regions_below(
        &self,
        plane: usize,
        level: u8,
        window: Window,
        areas_px: &RangeInclusive<u64>,
    ) -> Vec<Region> {
        let smooth = &self.smooth[plane];
        searched(
            std::iter::once((smooth, Level::Below(level), 0)),
            (std::slice::from_ref(smooth), Sign::Same),
            window,
            areas_px,
        )
    }

    /// All regions in a window in which neither the luma nor a colour has an edge, bounded by edges of either sign: a top may be darker than the table and lighter
    /// than its side, or differ from them in several colours.
    pub(super) fn uniform_regions(&self, window: Window, areas_px: &RangeInclusive<u64>) -> Vec<Region> {
        let steepest = self.steep.iter().take(PLAIN_PLANES).cloned().reduce(|mut most, plane| {
            most.pixels.iter_mut().zip(&plane.pixels).for_each(|(most, &here)| *most = here.max(*most));
            most
        });
        steepest.map_or_else(Vec::new, |steep| {
            let plain = &self.smooth[..PLAIN_PLANES.min(self.smooth.len())];
            searched(uniform(&steep), (plain, Sign::Either), window, areas_px)
        })
    }
}

/// Where components are searched: an image, the level below or above which its pixels belong to one, and by how many pixels it is grown.
type Pass<'a> = (&'a GreyImage, Level, usize);

/// The areas of small gradient.
fn uniform(steep: &GreyImage) -> impl Iterator<Item = Pass<'_>> {
    GRADIENTS.into_iter().map(move |level| (steep, Level::Below(level), GRADIENT_REACH_PX))
}

/// The regions of all passes; their edges are measured in the images.
fn searched<'a>(
    passes: impl Iterator<Item = Pass<'a>>,
    edges: Edges<'_>,
    window: Window,
    areas_px: &RangeInclusive<u64>,
) -> Vec<Region> {
    let mut labeller = Labeller::default();
    let mut found = Vec::new();
    for (source, level, grown_px) in passes {
        let components = labeller.components(source, window, level, areas_px).to_vec();
        let region = |component: &Component| Region::new(source, edges, window, (component, level, grown_px));
        let most_box_px = MOST_BOX * areas_px.end();
        let is_compact = |component: &&Component| {
            let [width, height] = [component.x, component.y].map(|[from, to]| u64::from(to - from) + 1);
            width * height <= most_box_px
        };
        found.extend(
            components
                .iter()
                .filter(is_compact)
                .filter_map(region)
                .filter(|region| areas_px.contains(&(region.area_px as u64))),
        );
    }
    found
}

impl Region {
    /// The region of a component of `source`; the edge is measured in the images of `edges`.
    fn new(
        source: &GreyImage,
        edges: Edges<'_>,
        within: Window,
        (component, level, grown_px): (&Component, Level, usize),
    ) -> Option<Self> {
        let margin = grown_px + 1;
        let [x0, x1] = [component.x[0] as usize, component.x[1] as usize + 1 + margin];
        let [y0, y1] = [component.y[0] as usize, component.y[1] as usize + 1 + margin];
        // What reaches the border of the window is cut off by it.
        if x0 < within.x[0] + margin || y0 < within.y[0] + margin || x1 > within.x[1] || y1 > within.y[1] {
            return None;
        }
        let window = Window { x: [x0 - margin, x1], y: [y0 - margin, y1] };
        let [width, height] = [x1 + margin - x0, y1 + margin - y0];
        let mut mask = vec![false; width * height];
        let inside = |k: usize| {
            let at = (window.y[0] + k / width) * source.width + window.x[0] + k % width;
            level.is_foreground(source.pixels[at])
        };
        let seed =
            (component.seed[1] as usize - window.y[0]) * width + component.seed[0] as usize - window.x[0];
        flood(&mut mask, width, seed, true, inside);
        for _ in 0..grown_px {
            mask = grown(&mask, width);
        }
        let mut outside = vec![false; mask.len()];
        flood(&mut outside, width, 0, false, |k| !mask[k]);
        let mask: Vec<bool> = outside.iter().map(|outside| !outside).collect();
        let mut region = Self {
            window,
            mask,
            area_px: 0,
            centroid: Pixel::new(0.0, 0.0),
            border: Vec::new(),
            strength: 0.0,
            is_light: false,
        };
        region.measure(edges, width)?;
        Some(region)
    }

    /// The part of a region that is also in it when shifted.
    ///
    /// The silhouette of an upright body is the union of its shifted tops from table to top: with the top's points and the points straight below them
    /// in it, this is the top.
    pub(super) fn shared_with_shifted(
        &self,
        image: &GreyImage,
        shifted: impl Fn(Pixel) -> Pixel,
    ) -> Option<Self> {
        let [width, _] = self.size();
        let at = |k: usize| {
            Pixel::new((self.window.x[0] + k % width) as f64, (self.window.y[0] + k / width) as f64)
        };
        let shared: Vec<bool> =
            (0..self.mask.len()).map(|k| self.mask[k] && self.contains(shifted(at(k)))).collect();
        let distance_px = |k: &usize| at(*k).distance_px(self.centroid);
        let seed = (0..shared.len())
            .filter(|&k| shared[k])
            .min_by(|a, b| distance_px(a).total_cmp(&distance_px(b)))?;
        let mut mask = vec![false; shared.len()];
        flood(&mut mask, width, seed, false, |k| shared[k]);
        let mut top = Self { mask, ..self.clone() };
        top.measure((std::slice::from_ref(image), Sign::Same), width)?;
        Some(top)
    }

    /// Area, centroid, border and strength.
    fn measure(&mut self, (images, sign): Edges, width: usize) -> Option<()> {
        let at = |k: usize| [(self.window.x[0] + k % width) as f64, (self.window.y[0] + k / width) as f64];
        let (mut count, mut sum) = (0, [0.0; 2]);
        for k in (0..self.mask.len()).filter(|&k| self.mask[k]) {
            let [x, y] = at(k);
            (count, sum) = (count + 1, [sum[0] + x, sum[1] + y]);
        }
        self.area_px = count;
        self.centroid = Pixel::new(sum[0] / count as f64, sum[1] / count as f64);
        self.border = walk(&self.mask, width).into_iter().map(|k| Pixel::new(at(k)[0], at(k)[1])).collect();
        if self.border.len() < LEAST_BORDER {
            return None;
        }
        let step = |k: usize| {
            let steps = images.iter().map(|image| self.step(image, k));
            steps.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
        };
        let mut steps: Vec<f64> = (0..self.border.len()).map(step).collect();
        self.is_light = steps.iter().sum::<f64>() < 0.0;
        let strength = |step: f64| match sign {
            Sign::Either => step.abs(),
            Sign::Same if self.is_light => -step,
            Sign::Same => step,
        };
        for step in &mut steps {
            *step = strength(*step);
        }
        steps.sort_unstable_by(f64::total_cmp);
        self.strength = steps[(WEAKEST * steps.len() as f64) as usize];
        Some(())
    }

    /// The largest step of grey level across a point of the border, outside minus inside.
    fn step(&self, image: &GreyImage, k: usize) -> f64 {
        let n = self.border.len();
        let (from, to) =
            (self.border[(k + n - DIRECTION_POINTS) % n], self.border[(k + DIRECTION_POINTS) % n]);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let length_px = dx.hypot(dy).max(1.0);
        // The walk goes clockwise in the image: outside is on its left.
        let outward = [dy / length_px, -dx / length_px];
        let here = self.border[k];
        let grey = |out_px: f64| {
            let at = Pixel::new(here.x + out_px * outward[0], here.y + out_px * outward[1]);
            image.grey_at(at).unwrap_or(f64::NAN)
        };
        let steps = OFFSETS_PX
            .map(|offset_px| grey(offset_px + 0.5 + READ_AT_PX) - grey(offset_px + 0.5 - READ_AT_PX));
        let known = steps.into_iter().filter(|step| step.is_finite());
        known.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    }

    /// The region's pixels.
    pub(super) fn pixels(&self) -> impl Iterator<Item = Pixel> {
        let [width, _] = self.size();
        let at = move |k: usize| {
            Pixel::new((self.window.x[0] + k % width) as f64, (self.window.y[0] + k / width) as f64)
        };
        (0..self.mask.len()).filter(|&k| self.mask[k]).map(at)
    }

    /// Whether a pixel belongs to the region.
    pub(super) fn contains(&self, pixel: Pixel) -> bool {
        let (x, y) = (pixel.x.round() - self.window.x[0] as f64, pixel.y.round() - self.window.y[0] as f64);
        let [width, height] = self.size();
        let inside = x >= 0.0 && y >= 0.0 && x < width as f64 && y < height as f64;
        inside && self.mask[y as usize * width + x as usize]
    }

    /// Whether nearly all of another region belongs to this one, and so do the pixels within a margin around it.
    pub(super) fn covers(&self, other: &Self, margin_px: f64) -> bool {
        self.covered_fraction(other, margin_px) >= NEARLY_ALL
    }

    /// The fraction of another region's border that belongs to this one, moved outwards by a margin.
    pub(super) fn covered_fraction(&self, other: &Self, margin_px: f64) -> f64 {
        other.border_fraction(|pixel| {
            let [dx, dy] = [pixel.x - other.centroid.x, pixel.y - other.centroid.y];
            let factor = 1.0 + margin_px / dx.hypot(dy).max(1.0);
            self.contains(Pixel::new(other.centroid.x + factor * dx, other.centroid.y + factor * dy))
        })
    }

    /// The fraction of the border whose pixels meet a condition.
    pub(super) fn border_fraction(&self, is_met: impl Fn(Pixel) -> bool) -> f64 {
        self.border.iter().filter(|&&pixel| is_met(pixel)).count() as f64 / self.border.len() as f64
    }

    /// Whether a border crosses, or one region covers the other.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        const SHARED: f64 = 0.2;
        let share = |a: &Self, b: &Self| {
            let shared = b.border.iter().filter(|&&pixel| a.contains(pixel)).count();
            shared as f64 > SHARED * b.border.len() as f64
        };
        share(self, other) || share(other, self)
    }

    /// Width and height of the window (px).
    fn size(&self) -> [usize; 2] {
        [self.window.x[1] - self.window.x[0], self.window.y[1] - self.window.y[0]]
    }

    /// The region's window.
    pub(super) const fn window(&self) -> Window {
        self.window
    }
}

/// The mean of three by three pixels.
fn smoothed(image: &GreyImage, window: Window) -> GreyImage {
    filtered(image, window, |at| {
        let sum: u32 = (0..9).map(|k| u32::from(at(k % 3, k / 3))).sum();
        ((sum + 4) / 9) as u8
    })
}

/// The length of the gradient (grey levels per two pixels).
fn gradient(image: &GreyImage, window: Window) -> GreyImage {
    filtered(image, window, |at| {
        let step = |a: u8, b: u8| f64::from(a) - f64::from(b);
        step(at(2, 1), at(0, 1)).hypot(step(at(1, 2), at(1, 0))).round().min(255.0) as u8
    })
}

/// Each pixel of a window computed from the three by three around it; the image's outermost pixels stay.
fn filtered(
    image: &GreyImage,
    window: Window,
    value: impl Fn(&dyn Fn(usize, usize) -> u8) -> u8,
) -> GreyImage {
    let mut pixels = image.pixels.clone();
    let inner = |[from, to]: [usize; 2], size: usize| from.max(1)..to.min(size.saturating_sub(1));
    for y in inner(window.y, image.height) {
        for x in inner(window.x, image.width) {
            let at = |column: usize, row: usize| image.pixels[(y + row - 1) * image.width + x + column - 1];
            pixels[y * image.width + x] = value(&at);
        }
    }
    GreyImage { pixels, ..*image }
}

/// Marks everything that is connected with a pixel and inside; `diagonal` connects over corners.
fn flood(mask: &mut [bool], width: usize, seed: usize, diagonal: bool, inside: impl Fn(usize) -> bool) {
    let height = mask.len() / width;
    let mut open = vec![seed];
    while let Some(k) = open.pop() {
        if mask[k] || !inside(k) {
            continue;
        }
        mask[k] = true;
        let (x, y) = (k % width, k / width);
        for (dx, dy) in (0..9).map(|n| (n % 3, n / 3)) {
            let side = dx == 1 || dy == 1;
            let within = x + dx >= 1 && y + dy >= 1 && x + dx <= width && y + dy <= height;
            if (side || diagonal) && within {
                open.push((y + dy - 1) * width + x + dx - 1);
            }
        }
    }
}

/// The mask with its neighbours to the four sides; a free margin is needed.
fn grown(mask: &[bool], width: usize) -> Vec<bool> {
    let at = |k: Option<usize>| k.and_then(|k| mask.get(k)).copied().unwrap_or(false);
    let near = |k: usize| [k.checked_sub(1), Some(k + 1), k.checked_sub(width), Some(k + width)];
    (0..mask.len()).map(|k| mask[k] || near(k).into_iter().any(at)).collect()
}

/// The border of the first region of a mask with a free margin, clockwise in the image (Moore's neighbour tracing).
fn walk(mask: &[bool], width: usize) -> Vec<usize> {
    const AROUND: [(isize, isize); 8] =
        [(-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1)];
    let Some(start) = mask.iter().position(|&inside| inside) else { return Vec::new() };
    let neighbour = |k: usize, direction: usize| {
        let (dx, dy) = AROUND[direction % 8];
        k.wrapping_add_signed(dy * width.cast_signed() + dx)
    };
    let (mut border, mut here, mut from) = (vec![start], start, 0);
    // Every pixel is passed at most once from each side.
    for _ in 0..4 * mask.len() {
        let next = (1..=8).map(|turn| from + turn).find(|&direction| mask[neighbour(here, direction)]);
        let Some(direction) = next else { break };
        here = neighbour(here, direction);
        // The search goes on from the free pixel before this one.
        from = (direction + 4 + if direction % 2 == 0 { 2 } else { 1 }) % 8;
        from = (from + 8 - 1) % 8;
        if here == start {
            break;
        }
        border.push(here);
    }
    border
}
