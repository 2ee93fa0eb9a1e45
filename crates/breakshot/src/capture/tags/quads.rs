//! Which dark patches have four straight sides?

use crate::capture::image::GreyImage;
use crate::geometry::Pixel;

/// Side of the tiles of which the darkest and the lightest grey are computed (px); a threshold uses three by three tiles,
/// which contain black and white of a tag of 20 px.
const TILE_PX: usize = 4;
/// Smallest and largest contrast that is required to distinguish black from white (grey levels)...
const CONTRAST: [u8; 2] = [10, 60];
/// ... and in between this multiple of the contrast of noise.
const CONTRAST_OVER_NOISE: f64 = 1.5;
/// Smallest side of a tag (px): eight bits of one pixel.
const SHORTEST_PX: usize = 8;
/// Fraction of a patch's convex hull that its quad must cover: that of a disc covers 0.64.
const FILLED: f64 = 0.85;

/// The corners of every quadrilateral patch, clockwise in the picture, accurate to one or two pixels.
///
/// `threshold` is the limit of dark pixels between the darkest (0) and the lightest (1) grey nearby.
pub(super) fn dark_quads(image: &GreyImage, threshold: f64) -> Vec<[Pixel; 4]> {
    if image.width < SHORTEST_PX || image.height < SHORTEST_PX {
        return Vec::new();
    }
    let levels = Levels::of(image, threshold);
    let runs = dark_runs(image, &levels);
    patches(&runs).iter().filter_map(|patch| quad(patch, image)).collect()
}

/// The grey level below which a pixel is dark, for each tile; 0 where the contrast is too low.
struct Levels {
    columns: usize,
    levels: Vec<u8>,
}

impl Levels {
    fn of(image: &GreyImage, threshold: f64) -> Self {
        let (columns, rows) = (image.width.div_ceil(TILE_PX), image.height.div_ceil(TILE_PX));
        let (mut darkest, mut lightest) = (vec![u8::MAX; columns * rows], vec![0; columns * rows]);
        for (y, line) in image.pixels.chunks_exact(image.width).enumerate() {
            let tiles = y / TILE_PX * columns..(y / TILE_PX + 1) * columns;
            let tiles = darkest[tiles.clone()].iter_mut().zip(&mut lightest[tiles]);
            for (greys, (dark, light)) in line.chunks(TILE_PX).zip(tiles) {
                for &grey in greys {
                    *dark = grey.min(*dark);
                    *light = grey.max(*light);
                }
            }
        }
        let darkest = spread(&darkest, columns, u8::min);
        let lightest = spread(&lightest, columns, u8::max);
        let least = least_contrast(&darkest, &lightest);
        let level = |(&dark, &light): (&u8, &u8)| {
            let contrast = light - dark;
            if contrast < least { 0 } else { dark + (threshold * f64::from(contrast)).round() as u8 }
        };
        Self { columns, levels: darkest.iter().zip(&lightest).map(level).collect() }
    }
}

/// The extreme of each tile and its eight neighbours.
fn spread(tiles: &[u8], columns: usize, extreme: fn(u8, u8) -> u8) -> Vec<u8> {
    let mut wide = tiles.to_vec();
    for (row, wide) in tiles.chunks_exact(columns).zip(wide.chunks_exact_mut(columns)) {
        for k in 1..columns {
            wide[k] = extreme(wide[k], row[k - 1]);
            wide[k - 1] = extreme(wide[k - 1], row[k]);
        }
    }
    let mut both = wide.clone();
    for k in columns..wide.len() {
        both[k] = extreme(both[k], wide[k - columns]);
        both[k - columns] = extreme(both[k - columns], wide[k]);
    }
    both
}

/// The required contrast: most of a picture is plain, so that the median contrast is that of noise.
fn least_contrast(darkest: &[u8], lightest: &[u8]) -> u8 {
    let mut counts = [0_usize; 256];
    for (dark, light) in darkest.iter().zip(lightest) {
        counts[usize::from(light - dark)] += 1;
    }
    let mut below = 0;
    let median = counts.iter().position(|count| {
        below += count;
        2 * below >= darkest.len()
    });
    let wanted = CONTRAST_OVER_NOISE * median.unwrap_or_default() as f64;
    wanted.clamp(f64::from(CONTRAST[0]), f64::from(CONTRAST[1])) as u8
}

/// Adjacent dark pixels of a row, from `start` to before `end`; `patch` is the run's parent in the union-find forest.
struct Run {
    row: usize,
    start: usize,
    end: usize,
    patch: usize,
}

/// Runs in order of row and column, joined into 4-connected patches (union-find).
fn dark_runs(image: &GreyImage, levels: &Levels) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut above = 0..0;
    for (row, line) in image.pixels.chunks_exact(image.width).enumerate() {
        let first = runs.len();
        let tiles = &levels.levels[row / TILE_PX * levels.columns..][..levels.columns];
        let mut dark = false;
        for (tile, (greys, &level)) in line.chunks(TILE_PX).zip(tiles).enumerate() {
            if level == 0 && !dark {
                continue;
            }
            for (k, &grey) in greys.iter().enumerate() {
                let column = tile * TILE_PX + k;
                if (grey < level) != dark {
                    dark = !dark;
                    match runs.last_mut() {
                        Some(run) if !dark => run.end = column,
                        _ => {
                            let patch = runs.len();
                            runs.push(Run { row, start: column, end: image.width, patch });
                        }
                    }
                }
            }
        }
        join(&mut runs, above, first);
        above = first..runs.len();
    }
    runs
}

/// Joins the runs from `first` on with the overlapping ones of the row above.
fn join(runs: &mut [Run], above: std::ops::Range<usize>, first: usize) {
    let mut upper = above.start;
    for lower in first..runs.len() {
        while upper < above.end && runs[upper].end <= runs[lower].start {
            upper += 1;
        }
        let mut k = upper;
        while k < above.end && runs[k].start < runs[lower].end {
            let (a, b) = (root(runs, k), root(runs, lower));
            runs[a.max(b)].patch = a.min(b);
            k += 1;
        }
    }
}

fn root(runs: &mut [Run], mut k: usize) -> usize {
    while runs[k].patch != k {
        runs[k].patch = runs[runs[k].patch].patch;
        k = runs[k].patch;
    }
    k
}

/// A patch's outermost dark pixels in each of its rows: row, first column, last column.
type Patch = Vec<[usize; 3]>;

fn patches(runs: &[Run]) -> Vec<Patch> {
    // The root of a patch is its first run, so that every run comes after its root.
    let mut roots = vec![0; runs.len()];
    let mut patches: Vec<Patch> = Vec::new();
    for (k, run) in runs.iter().enumerate() {
        if run.patch == k {
            roots[k] = patches.len();
            patches.push(Vec::new());
        } else {
            roots[k] = roots[run.patch];
        }
        let patch = &mut patches[roots[k]];
        match patch.last_mut() {
            Some([row, first, last]) if *row == run.row => {
                *first = run.start.min(*first);
                *last = (run.end - 1).max(*last);
            }
            _ => patch.push([run.row, run.start, run.end - 1]),
        }
    }
    patches.retain(|patch| patch.len() >= SHORTEST_PX);
    patches
}

/// The four corners of a patch, if a quadrilateral describes it and it is inside the picture.
fn quad(patch: &Patch, image: &GreyImage) -> Option<[Pixel; 4]> {
    let (left, right) = (patch.iter().map(|p| p[1]).min()?, patch.iter().map(|p| p[2]).max()?);
    let inside = patch[0][0] > 0 && patch[patch.len() - 1][0] + 1 < image.height;
    if !inside || left == 0 || right + 1 == image.width || right - left < SHORTEST_PX {
        return None;
    }
    let hull = hull(patch);
    let mut corners = four_corners(&hull)?;
    grow(&hull, &mut corners);
    let quad = corners.map(|k| hull[k]);
    (area_px2(&quad) > FILLED * area_px2(&hull)).then_some(quad)
}

/// The convex hull of the pixels' own squares, clockwise in the picture.
fn hull(patch: &Patch) -> Vec<Pixel> {
    let mut sides = [Vec::new(), Vec::new()];
    for &[row, first, last] in patch {
        for y in [row as f64 - 0.5, row as f64 + 0.5] {
            push_convex(&mut sides[0], Pixel::new(last as f64 + 0.5, y), 1.0);
            push_convex(&mut sides[1], Pixel::new(first as f64 - 0.5, y), -1.0);
        }
    }
    let [right, mut left] = sides;
    left.reverse();
    [right, left].concat()
}

/// Adds the next point down one side of a hull; `sense` is the sign of the allowed change of direction.
fn push_convex(side: &mut Vec<Pixel>, point: Pixel, sense: f64) {
    while let [.., a, b] = side[..]
        && sense * ((b.x - a.x) * (point.y - b.y) - (b.y - a.y) * (point.x - b.x)) <= 0.0
    {
        side.pop();
    }
    side.push(point);
}

/// Indices into the hull, in its order: the vertex farthest from the middle, the one farthest from that, and twice
/// the one farthest outside the polygon so far.
fn four_corners(hull: &[Pixel]) -> Option<[usize; 4]> {
    let n = hull.len();
    let farthest =
        |from: Pixel| (0..n).max_by(|&a, &b| from.distance_px(hull[a]).total_cmp(&from.distance_px(hull[b])));
    let [x, y] = [|p: &Pixel| p.x, |p: &Pixel| p.y].map(|axis| hull.iter().map(axis).sum::<f64>() / n as f64);
    let first = farthest(Pixel::new(x, y))?;
    let mut corners = vec![first, farthest(hull[first])?];
    while corners.len() < 4 {
        corners.sort_unstable();
        let outside = |k: usize| {
            let next = corners.iter().position(|&c| c >= k).unwrap_or(0);
            let previous = corners[(next + corners.len() - 1) % corners.len()];
            height_px(hull[previous], hull[corners[next]], hull[k])
        };
        corners.push((0..n).max_by(|&a, &b| outside(a).total_cmp(&outside(b)))?);
    }
    corners.sort_unstable();
    let distinct = corners.windows(2).all(|pair| pair[0] < pair[1]);
    corners.try_into().ok().filter(|_| distinct)
}

/// Moves each corner along the hull while that makes the quad larger.
fn grow(hull: &[Pixel], corners: &mut [usize; 4]) {
    let n = hull.len();
    for _ in 0..MOST_MOVES {
        let mut moved = false;
        for k in 0..4 {
            for next in [(corners[k] + 1) % n, (corners[k] + n - 1) % n] {
                let mut other = *corners;
                other[k] = next;
                let area = |corners: &[usize; 4]| area_px2(&corners.map(|k| hull[k]));
                if area(&other) > area(corners) {
                    *corners = other;
                    moved = true;
                }
            }
        }
        if !moved {
            break;
        }
    }
}

/// Each move goes to the neighbouring hull vertex; a hull has some tens.
const MOST_MOVES: usize = 32;

/// The distance of a point from the line from `a` to `b` (px), positive outside a clockwise hull.
fn height_px(a: Pixel, b: Pixel, point: Pixel) -> f64 {
    let length = a.distance_px(b).max(f64::MIN_POSITIVE);
    -((b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x)) / length
}

fn area_px2(polygon: &[Pixel]) -> f64 {
    let n = polygon.len();
    (0..n).map(|k| (polygon[k], polygon[(k + 1) % n])).map(|(p, q)| p.x * q.y - q.x * p.y).sum::<f64>() / 2.0
}
