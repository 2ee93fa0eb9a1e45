//! Which pictures does a camera take of known objects?
//!
//! Draws discs, polygons, blocks and tags in known poses through a [`Camera`]: every pixel is the exact area average of
//! what covers it, with a point spread function, motion blur during the exposure, the delay of each row under a rolling
//! shutter, and noise from a seed.  Tests and tutorials compare measurements with these known poses.

use crate::capture::{self, Camera, Frame, GreyImage};
use crate::cell::Tag;
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{Object, Shape};
use crate::statistics::sorted_by_value;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// A camera with its image quality, and the table in view.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The camera; its `exposure_s` and `readout_s` blur and shear moving things.
    pub camera: Camera,
    /// The table's grey level.
    pub table_grey: f64,
    /// Relative increase of the light from the left edge to the right one, and from the top to the bottom.
    pub shading: [f64; 2],
    /// Standard deviation of the lens's point spread function (px).
    pub blur_px: f64,
    /// Standard deviation of the noise (grey levels).
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl View {
    /// A uniformly lit table without noise, through a lens of usual sharpness.
    pub fn new(camera: Camera) -> Self {
        Self { camera, table_grey: 190.0, shading: [0.0; 2], blur_px: 0.7, noise: 0.0, seed: 1 }
    }
}

/// The appearance of a thing from above.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// A uniform surface.
    Plain(Shape),
    /// An AprilTag of family 36h11 with its white margin, one bit wide.
    Tag {
        /// Its number.
        id: u32,
        /// The side of its black square (m).
        size_m: f64,
    },
}

/// A flat or upright thing in the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Thing {
    /// Its appearance from above.
    pub figure: Figure,
    /// The figure's origin in the frame of its body.
    pub at_m: Point,
    /// The body's pose in the middle of the exposure of the picture's first row.
    pub pose: Pose,
    /// The body's velocity (m/s).
    pub velocity: Vec2,
    /// The body's angular velocity (rad/s).
    pub yaw_rate_rad_s: f64,
    /// The height of its upper face (m).
    pub height_m: f64,
    /// The height of its sides below that face (m).
    pub thickness_m: f64,
    /// The grey level of its upper face; the black of a tag.
    pub grey: f64,
    /// The grey level of its sides; the white of a tag.
    pub side_grey: f64,
}

/// Default grey levels.
const OBJECT_GREY: f64 = 150.0;
const SIDE_GREY: f64 = 95.0;
const MARKER_GREY: f64 = 20.0;
const PAPER_GREY: f64 = 235.0;

impl Thing {
    /// A uniform flat thing at rest, `height_m` above the table.
    pub fn flat(shape: Shape, pose: Pose, height_m: f64, grey: f64) -> Self {
        Self {
            figure: Figure::Plain(shape),
            at_m: Point::ORIGIN,
            pose,
            velocity: Vec2::ZERO,
            yaw_rate_rad_s: 0.0,
            height_m,
            thickness_m: 0.0,
            grey,
            side_grey: grey,
        }
    }

    /// A tag lying on the table.
    pub fn tag(tag: &Tag) -> Self {
        let figure = Figure::Tag { id: tag.id, size_m: tag.size_m };
        let pose = Pose { position: tag.center_m, yaw_rad: tag.yaw_rad };
        let nothing = Shape::Disc { radius_m: 0.0 };
        Self { figure, side_grey: PAPER_GREY, ..Self::flat(nothing, pose, 0.0, MARKER_GREY) }
    }

    /// An object standing on the table, and the marker on top of it.
    pub fn object(object: &Object, pose: Pose) -> [Self; 2] {
        let body = Self {
            thickness_m: object.height_m,
            side_grey: SIDE_GREY,
            ..Self::flat(object.shape.clone(), pose, object.height_m, OBJECT_GREY)
        };
        let feature = object.feature();
        let top_m = object.height_m + feature.thickness_m;
        let marker = Self::flat(feature.shape, pose, top_m, MARKER_GREY);
        [body, Self { at_m: feature.at_m, thickness_m: feature.thickness_m, ..marker }]
    }

    /// The dot beside the object's marker, if it has one.
    pub fn dot(object: &Object, pose: Pose) -> Option<Self> {
        let dot = object.feature().dot?;
        let disc = Shape::Disc { radius_m: dot.radius_m };
        Some(Self { at_m: dot.at_m, ..Self::flat(disc, pose, object.height_m, MARKER_GREY) })
    }

    /// The same thing with a moving body.
    #[must_use]
    pub fn moving(self, velocity: Vec2, yaw_rate_rad_s: f64) -> Self {
        Self { velocity, yaw_rate_rad_s, ..self }
    }

    fn moves(&self) -> bool {
        self.velocity != Vec2::ZERO || self.yaw_rate_rad_s != 0.0
    }

    fn pose_at(&self, time_s: f64) -> Pose {
        let position = self.pose.position + self.velocity * time_s;
        Pose { position, yaw_rad: self.pose.yaw_rad + self.yaw_rate_rad_s * time_s }
    }

    /// The layers to draw from the bottom up, each within the one below: outlines in the body's frame, heights, grey.
    fn layers(&self) -> Vec<Layer> {
        let shifted = |outline: Vec<Point>| outline.into_iter().map(|p| p + self.at_m.to_vec()).collect();
        match &self.figure {
            Figure::Plain(shape) => {
                let outline: Vec<Point> = shifted(outline(shape));
                let slices = (self.thickness_m / SLICE_M).ceil() as usize;
                let height_m = |k: usize| self.height_m - self.thickness_m * k as f64 / slices.max(1) as f64;
                let top = Layer::new(vec![outline], self.height_m, self.grey);
                let heights_m = (0..=slices).map(height_m).collect();
                let whole = Layer { heights_m, grey: self.side_grey, ..top.clone() };
                if slices > 0 { vec![whole, top] } else { vec![top] }
            }
            Figure::Tag { id, size_m } => {
                let word = capture::CODES.get(*id as usize).copied().unwrap_or_default();
                let bit = size_m / 8.0;
                // A square of `side` bits whose upper left corner is this many bits right of and below the tag's.
                let square = |column: f64, row: f64, side: f64| {
                    let (x, y) = ((column - 4.0) * bit, (4.0 - row) * bit);
                    let s = side * bit;
                    shifted(subdivided(
                        &[(x, y), (x, y - s), (x + s, y - s), (x + s, y)].map(|(x, y)| Point::new(x, y)),
                    ))
                };
                let white = (0..36).filter(|k| capture::is_white(word, k / 6, k % 6));
                let bits = white.map(|k| square((k % 6) as f64 + 1.0, (k / 6) as f64 + 1.0, 1.0)).collect();
                [
                    (vec![square(-1.0, -1.0, 10.0)], self.side_grey),
                    (vec![square(0.0, 0.0, 8.0)], self.grey),
                    (bits, self.side_grey),
                ]
                .map(|(outlines, grey)| Layer::new(outlines, self.height_m, grey))
                .into()
            }
        }
    }
}

/// Thickness of the slices that sides are drawn as (m).
const SLICE_M: f64 = 1e-3;
/// Number of corners of the polygon that a disc is drawn as...
const DISC_CORNERS: u32 = 720;
/// ... and number of segments of a straight side, which lens and rolling shutter may distort.
const PIECES: u32 = 12;

fn outline(shape: &Shape) -> Vec<Point> {
    match shape {
        Shape::Disc { radius_m } => {
            // The radius that gives the polygon the disc's area.
            let step_rad = std::f64::consts::TAU / f64::from(DISC_CORNERS);
            let radius_m = radius_m * (step_rad / step_rad.sin()).sqrt();
            let corner = |k| Point::ORIGIN + Vec2::from_heading(step_rad * f64::from(k)) * radius_m;
            (0..DISC_CORNERS).map(corner).collect()
        }
        _ => subdivided(&shape.corners()),
    }
}

fn subdivided(corners: &[Point]) -> Vec<Point> {
    let next = |k: usize| corners[(k + 1) % corners.len()];
    let side = |k: usize| (0..PIECES).map(move |i| f64::from(i) / f64::from(PIECES)).map(move |t| (k, t));
    (0..corners.len()).flat_map(side).map(|(k, t)| corners[k] + (next(k) - corners[k]) * t).collect()
}

/// Outlines of one grey that do not overlap, drawn at each of these heights.
#[derive(Clone)]
struct Layer {
    outlines: Vec<Vec<Point>>,
    heights_m: Vec<f64>,
    grey: f64,
}

impl Layer {
    fn new(outlines: Vec<Vec<Point>>, height_m: f64, grey: f64) -> Self {
        Self { outlines, heights_m: vec![height_m], grey }
    }
}

/// The picture of these things; higher ones cover lower ones.
pub fn picture(view: &View, things: &[Thing]) -> GreyImage {
    let things = sorted_by_value(things.iter().collect(), |thing: &&Thing| thing.height_m);
    let [width, height] = view.camera.size_px;
    let mut table = Canvas { width, height, greys: vec![view.table_grey as f32; width * height] };
    // Things at rest below all moving ones are drawn once.
    let still = things.iter().position(|thing| thing.moves()).unwrap_or(things.len());
    things[..still].iter().for_each(|thing| table.draw(view, thing, 0.0));
    let moving = &things[still..];
    let instants = instants(view, moving);
    let mut sum = vec![0.0; width * height];
    for k in 0..instants {
        let fraction = (k as f64 + 0.5) / instants as f64 - 0.5;
        let mut now = table.clone();
        for thing in moving {
            now.draw(view, thing, fraction * view.camera.exposure_s.unwrap_or(0.0));
        }
        sum.iter_mut().zip(&now.greys).for_each(|(sum, grey)| *sum += grey / instants as f32);
    }
    let blurred = Canvas { width, height, greys: sum }.blurred(view.blur_px);
    blurred.developed(view)
}

/// The pictures at these times, each with its own noise.
pub fn film(view: &View, times_s: &[f64], things: impl Fn(f64) -> Vec<Thing>) -> Vec<Frame> {
    let mut view = view.clone();
    let frame = |&time_s: &f64| {
        view.seed = view.seed.wrapping_add(1);
        Frame { time_s, image: picture(&view, &things(time_s)) }
    };
    times_s.iter().map(frame).collect()
}

/// Largest motion between two drawn instants of an exposure (px).
const SMEAR_PX: f64 = 0.2;
/// Largest number of instants: more would not change eight-bit grey levels.
const MOST_INSTANTS: usize = 200;

fn instants(view: &View, moving: &[&Thing]) -> usize {
    let exposure_s = view.camera.exposure_s.unwrap_or(0.0);
    let smear_px = moving.iter().map(|thing| {
        let scale = view.camera.scale_m_per_px(
            view.camera.pixel_from_table(thing.pose.position, thing.height_m),
            thing.height_m,
        );
        let reach_m = match &thing.figure {
            Figure::Plain(shape) => shape.outer_radius_m(),
            Figure::Tag { size_m, .. } => *size_m,
        } + thing.at_m.to_vec().length();
        (thing.velocity.length() + thing.yaw_rate_rad_s.abs() * reach_m) * exposure_s / scale
    });
    let most_px = smear_px.filter(|px| px.is_finite()).fold(0.0, f64::max);
    ((most_px / SMEAR_PX).ceil() as usize).clamp(1, MOST_INSTANTS)
}

/// Grey levels before they are blurred, shaded and rounded.
#[derive(Clone)]
struct Canvas {
    width: usize,
    height: usize,
    greys: Vec<f32>,
}

impl Canvas {
    /// Draws a thing `time_s` after the middle of the exposure.
    fn draw(&mut self, view: &View, thing: &Thing, time_s: f64) {
        let mut below = None;
        for layer in thing.layers() {
            let at_height = |&height_m: &f64| {
                let projected = |outline: &Vec<Point>| {
                    outline.iter().map(|&p| pixel_of(view, thing, p, height_m, time_s)).collect()
                };
                layer.outlines.iter().map(projected).collect()
            };
            let figures: Vec<Vec<Vec<Pixel>>> = layer.heights_m.iter().map(at_height).collect();
            let whole = figures.iter().flatten().flatten().all(|p| p.x.is_finite() && p.y.is_finite());
            if whole {
                self.fill(&figures, layer.grey as f32, below);
            }
            below = Some(layer.grey as f32);
        }
    }

    /// Draws a grey over the union of the figures: over the canvas, or over the layer `below` of the same thing, which
    /// covers at least the same area.  The outlines of one figure do not overlap each other.
    fn fill(&mut self, figures: &[Vec<Vec<Pixel>>], grey: f32, below: Option<f32>) {
        let within = |outline: &Vec<Pixel>| clipped(outline, self.width, self.height);
        let figures: Vec<Vec<_>> = figures.iter().map(|f| f.iter().map(within).collect()).collect();
        let axis = |value: fn(&Pixel) -> f64| {
            let values = || figures.iter().flatten().flatten().map(value);
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
        };
        let ((left, right), (top, bottom)) = (axis(|p| p.x), axis(|p| p.y));
        if !(left < right && top < bottom) {
            return;
        }
        let (left, top) = (left.floor() as usize, top.floor() as usize);
        let (right, bottom) =
            ((right.ceil() as usize).min(self.width), (bottom.ceil() as usize).min(self.height));
        let mut covers = vec![0.0_f32; (right - left) * (bottom - top)];
        for figure in &figures {
            let mut cover = Cover::new(right - left, bottom - top);
            for outline in figure {
                for k in 0..outline.len() {
                    let (p, q) = (outline[k], outline[(k + 1) % outline.len()]);
                    let shifted = |p: Pixel| (p.x - left as f64, p.y - top as f64);
                    cover.add(shifted(p), shifted(q));
                }
            }
            covers
                .iter_mut()
                .zip(cover.rows().flatten())
                .for_each(|(most, fraction)| *most = most.max(fraction));
        }
        for (row, covers) in covers.chunks_exact(right - left).enumerate() {
            let line = &mut self.greys[(top + row) * self.width + left..][..right - left];
            for (pixel, fraction) in line.iter_mut().zip(covers) {
                *pixel += (grey - below.unwrap_or(*pixel)) * fraction;
            }
        }
    }

    /// Convolved with a Gaussian of that standard deviation.
    fn blurred(self, blur_px: f64) -> Self {
        let reach = (4.0 * blur_px).ceil() as usize;
        if reach == 0 {
            return self;
        }
        let weight = |k: usize| (-0.5 * ((k as f64 - reach as f64) / blur_px).powi(2)).exp();
        let total: f64 = (0..=2 * reach).map(weight).sum();
        let kernel: Vec<f32> = (0..=2 * reach).map(|k| (weight(k) / total) as f32).collect();
        let once = convolved(&self.greys, self.width, &kernel);
        let columns = transposed(&once, self.width);
        let twice = convolved(&columns, self.height, &kernel);
        Self { greys: transposed(&twice, self.height), ..self }
    }

    /// The eight-bit picture with shading and noise.
    fn developed(self, view: &View) -> GreyImage {
        let mut noise = Pcg64Mcg::seed_from_u64(view.seed);
        let (width, height) = (self.width as f64, self.height as f64);
        let grey = |(k, &grey): (usize, &f32)| {
            let (x, y) = ((k % self.width) as f64, (k / self.width) as f64);
            let light = 1.0 + view.shading[0] * (x / width - 0.5) + view.shading[1] * (y / height - 0.5);
            let normal: f64 = if view.noise > 0.0 { StandardNormal.sample(&mut noise) } else { 0.0 };
            (f64::from(grey) * light + view.noise * normal).round().clamp(0.0, 255.0) as u8
        };
        let pixels = self.greys.iter().enumerate().map(grey).collect();
        GreyImage { width: self.width, height: self.height, pixels }
    }
}

/// The pixel of a point of a thing's body, counted from the picture's corner, at the time at which a rolling shutter
/// exposes its row.
fn pixel_of(view: &View, thing: &Thing, body: Point, height_m: f64, time_s: f64) -> Pixel {
    let pixel_at = |time_s: f64| {
        let pixel = view.camera.pixel_from_table(thing.pose_at(time_s).table_from_body(body), height_m);
        Pixel::new(pixel.x + 0.5, pixel.y + 0.5)
    };
    let mut pixel = pixel_at(time_s);
    if view.camera.readout_s > 0.0 && thing.moves() {
        for _ in 0..ROW_STEPS {
            pixel =
                pixel_at(time_s + view.camera.readout_s * (pixel.y - 0.5) / view.camera.size_px[1] as f64);
        }
    }
    pixel
}

/// Fixed-point steps for the row: each reduces its error to a hundredth, because nothing crosses the picture during its
/// readout.
const ROW_STEPS: usize = 4;

/// The polygon clipped to the picture (Sutherland and Hodgman 1974).
fn clipped(polygon: &[Pixel], width: usize, height: usize) -> Vec<Pixel> {
    let (right, bottom) = (width as f64, height as f64);
    let inside: [&dyn Fn(&Pixel) -> f64; 4] = [&|p| p.x, &|p| right - p.x, &|p| p.y, &|p| bottom - p.y];
    inside.iter().fold(polygon.to_vec(), |polygon, inside| {
        let mut kept = Vec::with_capacity(polygon.len() + 4);
        for (k, p) in polygon.iter().enumerate() {
            let q = &polygon[(k + 1) % polygon.len()];
            let (at_p, at_q) = (inside(p), inside(q));
            if at_p >= 0.0 {
                kept.push(*p);
            }
            if (at_p >= 0.0) != (at_q >= 0.0) {
                let t = at_p / (at_p - at_q);
                let cut = Pixel::new(p.x + t * (q.x - p.x), p.y + t * (q.y - p.y));
                kept.push(Pixel::new(cut.x.clamp(0.0, right), cut.y.clamp(0.0, bottom)));
            }
        }
        kept
    })
}

/// The exact fraction of each pixel that polygons cover: every edge adds the area to its right, row by row.
struct Cover {
    width: usize,
    /// Changes along each row; their running sum is the covered fraction.
    changes: Vec<f32>,
}

impl Cover {
    fn new(width: usize, height: usize) -> Self {
        // An edge on the right border writes one change past it.
        Self { width, changes: vec![0.0; (width + 2) * height] }
    }

    /// Adds the edge from `p` to `q`, both inside.
    fn add(&mut self, p: (f64, f64), q: (f64, f64)) {
        if p.1 == q.1 {
            return;
        }
        let (sign, upper, lower) = if p.1 < q.1 { (1.0, p, q) } else { (-1.0, q, p) };
        let slope = (lower.0 - upper.0) / (lower.1 - upper.1);
        let rows = self.changes.len() / (self.width + 2);
        for row in upper.1.floor() as usize..(lower.1.ceil() as usize).min(rows) {
            let top = upper.1.max(row as f64);
            let bottom = lower.1.min(row as f64 + 1.0);
            let x = |y: f64| (upper.0 + (y - upper.1) * slope).clamp(0.0, self.width as f64);
            self.add_in_row(row, (x(top), x(bottom)), sign * (bottom - top));
        }
    }

    /// Adds a piece of an edge within one row: from x to x, `drop` rows down.
    fn add_in_row(&mut self, row: usize, (a, b): (f64, f64), drop: f64) {
        let (low, high) = (a.min(b), a.max(b));
        let changes = &mut self.changes[row * (self.width + 2)..][..self.width + 2];
        // The fraction of the piece in each column that it crosses, and its mean position in that column
        for column in low.floor() as usize..=high.floor() as usize {
            let (from, to) = (low.max(column as f64), high.min(column as f64 + 1.0));
            let fraction = if high > low { (to - from) / (high - low) } else { 1.0 };
            let right_of_it = 1.0 - (f64::midpoint(from, to) - column as f64);
            let d = drop * fraction;
            changes[column] += (d * right_of_it) as f32;
            changes[column + 1] += (d * (1.0 - right_of_it)) as f32;
        }
    }

    /// The covered fraction of each pixel, row by row.
    fn rows(&self) -> impl Iterator<Item = impl Iterator<Item = f32> + '_> + '_ {
        self.changes.chunks_exact(self.width + 2).map(|changes| {
            let sum = changes.iter().scan(0.0_f32, |sum, change| {
                *sum += change;
                Some(sum.abs().min(1.0))
            });
            sum.take(self.width)
        })
    }
}

/// Every row convolved with the kernel, with its end pixels repeated.
fn convolved(greys: &[f32], width: usize, kernel: &[f32]) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let mut out = Vec::with_capacity(greys.len());
    let mut padded = vec![0.0; width + 2 * reach];
    for row in greys.chunks_exact(width) {
        padded[..reach].fill(row[0]);
        padded[reach..reach + width].copy_from_slice(row);
        padded[reach + width..].fill(row[width - 1]);
        out.extend(
            padded.windows(kernel.len()).map(|w| w.iter().zip(kernel).map(|(a, b)| a * b).sum::<f32>()),
        );
    }
    out
}

fn transposed(greys: &[f32], width: usize) -> Vec<f32> {
    let height = greys.len() / width;
    (0..greys.len()).map(|k| greys[k % height * width + k / height]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::Lens;
    use crate::cell::Transform;

    fn view(blur_px: f64) -> View {
        let size = [320, 240];
        let at = Transform { position_m: [0.0, 0.0, 1.0], rpy_rad: [0.0; 3] };
        let camera = Camera::new(size, Lens::pinhole(size, 500.0), at);
        View { blur_px, ..View::new(camera) }
    }

    /// Centre and area (px) of what is darker than the table, each pixel weighed by how much darker it is.
    fn dark(image: &GreyImage, table: f64, thing: f64) -> (Pixel, f64) {
        let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
        for (k, &grey) in image.pixels.iter().enumerate() {
            let weight = (table - f64::from(grey)) / (table - thing);
            area += weight;
            x += weight * (k % image.width) as f64;
            y += weight * (k / image.width) as f64;
        }
        (Pixel::new(x / area, y / area), area)
    }

    /// Rounding to grey levels, over the pixels of a drawn edge (px).
    const ROUNDING_PX: f64 = 5e-3;

    #[test]
    fn a_drawn_disc_has_the_centre_and_area_that_the_camera_predicts() {
        for (blur_px, height_m) in [(0.0, 0.0), (0.7, 0.0), (1.5, 0.1)] {
            let view = view(blur_px);
            let point = Point::new(0.0312, -0.0537);
            let shape = Shape::Disc { radius_m: 0.02 };
            let disc = Thing::flat(shape, Pose { position: point, yaw_rad: 0.0 }, height_m, 20.0);
            let (center, area) = dark(&picture(&view, &[disc]), 190.0, 20.0);
            let expected = view.camera.pixel_from_table(point, height_m);
            assert!(center.distance_px(expected) < ROUNDING_PX, "{center:?} instead of {expected:?}");
            let radius_px = 500.0 * 0.02 / (1.0 - height_m);
            let ratio = area / (std::f64::consts::PI * radius_px * radius_px);
            assert!((ratio - 1.0).abs() < 1e-3, "area {ratio} times the disc's");
        }
    }

    #[test]
    fn motion_blur_is_centred_on_the_middle_of_the_exposure() {
        let mut view = view(0.5);
        view.camera.exposure_s = Some(0.02);
        let square = Shape::Rectangle { size_m: [0.02, 0.02] };
        let thing =
            Thing::flat(square, Pose::new(0.01, 0.0, 0.3), 0.0, 20.0).moving(Vec2::new(0.5, 0.2), 2.0);
        let image = picture(&view, &[thing]);
        let (center, area) = dark(&image, 190.0, 20.0);
        let expected = view.camera.pixel_from_table(Point::new(0.01, 0.0), 0.0);
        assert!(center.distance_px(expected) < 0.02, "{center:?} instead of {expected:?}");
        assert!((area - 100.0).abs() < 0.5, "{area} px covered by 100");
        let full = image.pixels.iter().filter(|&&grey| grey < 25).count();
        assert!(full < 75, "{full} px stay fully covered");
    }

    #[test]
    fn a_rolling_shutter_exposes_lower_rows_later() {
        let mut view = view(0.5);
        view.camera.readout_s = 0.02;
        let bar = Shape::Rectangle { size_m: [0.02, 0.3] };
        let thing = Thing::flat(bar, Pose::default(), 0.0, 20.0).moving(Vec2::new(0.5, 0.0), 0.0);
        let image = picture(&view, &[thing]);
        let row = |y: usize| {
            let line =
                GreyImage { width: 320, height: 1, pixels: image.pixels[y * 320..(y + 1) * 320].to_vec() };
            dark(&line, 190.0, 20.0).0.x
        };
        // 0.5 m/s at 500 px/m for the time of 100 of 240 rows.
        let expected_px = 0.5 * 500.0 * 0.02 * 100.0 / 240.0;
        let shear_px = row(170) - row(70);
        assert!((shear_px - expected_px).abs() < 0.02, "{shear_px} px instead of {expected_px}");
    }

    #[test]
    fn the_same_seed_draws_the_same_noise_and_another_one_another() {
        let noisy = |seed| picture(&View { noise: 4.0, seed, ..view(0.0) }, &[]);
        assert_eq!(noisy(3), noisy(3));
        assert_ne!(noisy(3), noisy(4));
        let image = noisy(3);
        let mean = image.pixels.iter().map(|&g| f64::from(g)).sum::<f64>() / image.pixels.len() as f64;
        let variance = image.pixels.iter().map(|&g| (f64::from(g) - mean).powi(2)).sum::<f64>();
        let std = (variance / image.pixels.len() as f64).sqrt();
        assert!((std - 4.0).abs() < 0.1 && (mean - 190.0).abs() < 0.1, "mean {mean}, std {std}");
    }

    #[test]
    fn a_block_covers_what_is_behind_it_and_shows_its_sides() {
        let view = view(0.0);
        let block = Thing {
            thickness_m: 0.1,
            side_grey: 90.0,
            ..Thing::flat(Shape::Disc { radius_m: 0.02 }, Pose::new(0.15, 0.0, 0.0), 0.1, 150.0)
        };
        let image = picture(&view, &[block]);
        let grey = |x: f64, height_m: f64| {
            let p = view.camera.pixel_from_table(Point::new(x, 0.0), height_m);
            image.pixels[p.y.round() as usize * 320 + p.x.round() as usize]
        };
        assert_eq!([grey(0.15, 0.1), grey(0.132, 0.0), grey(0.12, 0.0)], [150, 90, 190]);
    }
}
