//! Are the tracks what one sees?  Drawn on the film: outlines, ways, velocities, the time.

use crate::capture::{Camera, Frame, GreyImage};
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{self, Object, Shape};

/// A picture in colour, row by row, red, green and blue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width (px).
    pub width: usize,
    /// Height (px).
    pub height: usize,
    /// `3 * width * height` levels.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// The picture as a PNG file; none without pixels.
    pub fn png(&self) -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().ok()?;
        writer.write_image_data(&self.rgb).ok()?;
        writer.finish().ok()?;
        Some(bytes)
    }
}

/// What is drawn on a film.
#[derive(Clone, Copy, Debug)]
pub struct Overlay<'a> {
    /// The film's camera.
    pub camera: &'a Camera,
    /// Where the objects were.
    pub tracks: &'a Tracks,
    /// Their outlines.
    pub objects: &'a [Object],
}

type Colour = [u8; 3];

/// One a track; more tracks than that share them.  Told apart by most colour-blind people too (Okabe and Ito).
const COLOURS: [Colour; 8] = [
    [0, 158, 255],
    [255, 140, 0],
    [0, 200, 110],
    [230, 80, 190],
    [240, 228, 66],
    [90, 220, 255],
    [213, 70, 30],
    [170, 130, 255],
];
const WHITE: Colour = [255, 255, 255];
const BLACK: Colour = [0, 0, 0];
/// Doubtful places are drawn in this.
const DOUBT: Colour = [255, 40, 40];
/// A velocity's arrow shows the way of this time (s).
const ARROW_S: f64 = 0.15;
/// A line is this part of the picture wide, and at least so wide (px) that it shows.
const PICTURE_OVER_PEN: f64 = 800.0;
const LEAST_PEN_PX: f64 = 1.5;
/// Slower objects get no arrow (m/s): it would show noise.
const LEAST_SPEED_M_S: f64 = 0.02;
/// How strongly lines cover the film.
const STRONG: f64 = 0.95;
const FAINT: f64 = 0.6;
/// Pieces of an outline's side or a disc's rim, which lens and perspective may bend.
const PIECES: usize = 8;
const RIM_PIECES: usize = 72;

impl Overlay<'_> {
    /// The frame with everything known of it, up to its time.
    pub fn drawn(&self, frame: &Frame) -> Picture {
        let mut canvas = Canvas::of(&frame.image);
        let pen_px = (frame.image.width.max(frame.image.height) as f64 / PICTURE_OVER_PEN).max(LEAST_PEN_PX);
        for (track, colour) in self.tracks.tracks.iter().zip(COLOURS.iter().cycle()) {
            let Ok(object) = object::find(self.objects, &track.object, "overlay") else { continue };
            self.draw_way(&mut canvas, (track, object), frame.time_s, (*colour, pen_px));
            // A rolling shutter sees the object a little after the frame begins.
            let until_s = frame.time_s + self.camera.readout_s + SAME_TIME_S;
            let now = track.samples.iter().rfind(|s| s.time_s <= until_s);
            if let Some(sample) = now.filter(|s| s.time_s >= frame.time_s - SAME_TIME_S) {
                self.draw_object(&mut canvas, (sample, object), (*colour, pen_px));
            }
        }
        let size = (frame.image.height / 270).max(2);
        canvas.write(&format!("{:.3} s", frame.time_s), [3 * size, 3 * size], size);
        Picture { width: frame.image.width, height: frame.image.height, rgb: canvas.rgb }
    }

    fn draw_way(
        &self,
        canvas: &mut Canvas,
        (track, object): (&Track, &Object),
        time_s: f64,
        (colour, pen_px): (Colour, f64),
    ) {
        let so_far =
            track.samples.iter().take_while(|s| s.time_s <= time_s + self.camera.readout_s + SAME_TIME_S);
        let way: Vec<Pixel> =
            so_far.map(|s| self.camera.pixel_from_table(s.position(), object.height_m)).collect();
        canvas.lines(&way, 0.7 * pen_px, colour, FAINT);
    }

    fn draw_object(
        &self,
        canvas: &mut Canvas,
        (sample, object): (&Sample, &Object),
        (colour, pen_px): (Colour, f64),
    ) {
        let seen = |place: Point| self.camera.pixel_from_table(place, object.height_m);
        let colour = if sample.doubtful { DOUBT } else { colour };
        // Without a direction a disc is still a disc; anything else is drawn as it lies at zero.
        let pose = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
        if sample.yaw_rad.is_some() || matches!(object.shape, Shape::Disc { .. }) {
            let rim: Vec<Pixel> =
                rim(&object.shape).into_iter().map(|p| seen(pose.table_from_body(p))).collect();
            canvas.lines(&rim, pen_px, colour, STRONG);
        }
        let cross_m = 0.15 * object.shape.outer_radius_m();
        for along in [Vec2::new(cross_m, 0.0), Vec2::new(0.0, cross_m)] {
            let ends = [pose.position - along, pose.position + along].map(seen);
            canvas.lines(&ends, 0.7 * pen_px, colour, STRONG);
        }
        let velocity = sample.vx_m_s.zip(sample.vy_m_s).map(|(x, y)| Vec2::new(x, y));
        if let Some(velocity) = velocity.filter(|v| v.length() > LEAST_SPEED_M_S) {
            let tip = pose.position + velocity * ARROW_S;
            let barb = |turn_rad: f64| tip - (velocity * ARROW_S).rotated(turn_rad) * 0.25;
            let arrow = [pose.position, tip, barb(0.4), tip, barb(-0.4)].map(seen);
            canvas.lines(&arrow, 1.2 * pen_px, colour, STRONG);
        }
    }
}

/// Times nearer than this (s) are the same frame's.
const SAME_TIME_S: f64 = 1e-4;

/// Points along an outline, the first one again at its end.
fn rim(shape: &Shape) -> Vec<Point> {
    if let Shape::Disc { radius_m } = shape {
        let step_rad = std::f64::consts::TAU / RIM_PIECES as f64;
        return (0..=RIM_PIECES)
            .map(|k| Point::ORIGIN + Vec2::from_heading(k as f64 * step_rad) * *radius_m)
            .collect();
    }
    let corners = shape.corners();
    let side = |k: usize| {
        let (from, to) = (corners[k], corners[(k + 1) % corners.len()]);
        (0..PIECES).map(move |i| from + (to - from) * (i as f64 / PIECES as f64))
    };
    (0..corners.len()).flat_map(side).chain(corners.first().copied()).collect()
}

/// A film's picture that is drawn on.
struct Canvas {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Canvas {
    fn of(image: &GreyImage) -> Self {
        let rgb = image.pixels.iter().flat_map(|&grey| [grey; 3]).collect();
        Self { width: image.width, height: image.height, rgb }
    }

    fn blend(&mut self, x: usize, y: usize, colour: Colour, cover: f64) {
        let pixel = &mut self.rgb[3 * (y * self.width + x)..][..3];
        for (level, new) in pixel.iter_mut().zip(colour) {
            *level = (f64::from(*level) + (f64::from(new) - f64::from(*level)) * cover).round() as u8;
        }
    }

    /// A line through points, `pen_px` wide, with soft edges.  Every pixel is covered once, by the nearest piece.
    fn lines(&mut self, points: &[Pixel], pen_px: f64, colour: Colour, strength: f64) {
        let reach_px = 0.5 * pen_px + 1.0;
        let mut covers = std::collections::BTreeMap::new();
        for pair in points.windows(2) {
            let [p, q] = [pair[0], pair[1]];
            if ![p.x, p.y, q.x, q.y].iter().all(|v| v.is_finite()) {
                continue;
            }
            let span = |a: f64, b: f64, size: usize| {
                let first = (a.min(b) - reach_px).clamp(0.0, size as f64) as usize;
                first..(a.max(b) + reach_px + 1.0).clamp(0.0, size as f64) as usize
            };
            for y in span(p.y, q.y, self.height) {
                for x in span(p.x, q.x, self.width) {
                    let cover =
                        (reach_px - 0.5 - distance_px(Pixel::new(x as f64, y as f64), p, q)).clamp(0.0, 1.0);
                    if cover > 0.0 {
                        let most: &mut f64 = covers.entry((x, y)).or_insert(0.0);
                        *most = most.max(cover);
                    }
                }
            }
        }
        for ((x, y), cover) in covers {
            self.blend(x, y, colour, strength * cover);
        }
    }

    /// White letters on black, each dot of them `size` pixels wide.
    fn write(&mut self, text: &str, [left, top]: [usize; 2], size: usize) {
        let wide = text.len() * (LETTER[0] + 1) * size + size;
        self.fill([left, top], [wide, (LETTER[1] + 2) * size], BLACK, FAINT);
        for (k, letter) in text.chars().enumerate() {
            for (row, bits) in dots(letter).into_iter().enumerate() {
                for column in (0..LETTER[0]).filter(|column| bits >> (LETTER[0] - 1 - column) & 1 == 1) {
                    let corner = [left + (k * (LETTER[0] + 1) + column + 1) * size, top + (row + 1) * size];
                    self.fill(corner, [size, size], WHITE, STRONG);
                }
            }
        }
    }

    fn fill(&mut self, [left, top]: [usize; 2], [width, height]: [usize; 2], colour: Colour, strength: f64) {
        for y in top..(top + height).min(self.height) {
            for x in left..(left + width).min(self.width) {
                self.blend(x, y, colour, strength);
            }
        }
    }
}

/// How far a place is from a piece of line (px).
fn distance_px(place: Pixel, p: Pixel, q: Pixel) -> f64 {
    let (dx, dy) = (q.x - p.x, q.y - p.y);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 { ((place.x - p.x) * dx + (place.y - p.y) * dy) / length2 } else { 0.0 };
    let along = along.clamp(0.0, 1.0);
    place.distance_px(Pixel::new(p.x + along * dx, p.y + along * dy))
}

/// Columns and rows of a letter's dots.
const LETTER: [usize; 2] = [5, 7];

/// The dots of what a time is written with, row by row.
fn dots(letter: char) -> [u8; LETTER[1]] {
    match letter {
        '0' => [0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110],
        '1' => [0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110],
        '2' => [0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111],
        '3' => [0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110],
        '4' => [0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010],
        '5' => [0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110],
        '6' => [0b00110, 0b01000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110],
        '7' => [0b11111, 0b00001, 0b00010, 0b00100, 0b01000, 0b01000, 0b01000],
        '8' => [0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110],
        '9' => [0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00010, 0b01100],
        '.' => [0, 0, 0, 0, 0, 0b01100, 0b01100],
        's' => [0, 0, 0b01110, 0b10000, 0b01110, 0b00001, 0b11110],
        '-' => [0, 0, 0, 0b11111, 0, 0, 0],
        _ => [0; LETTER[1]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::Marker;

    #[test]
    fn the_outline_lies_where_the_camera_sees_it_and_nothing_else_is_touched() {
        let camera = Camera::flat([200, 160], 1000.0, None);
        let shape = Shape::Disc { radius_m: 0.03 };
        let object = Object {
            name: "a".into(),
            shape: shape.clone(),
            height_m: 0.001,
            marker: Some(Marker::centred(shape)),
            mass_kg: None,
        };
        let sample = Sample {
            time_s: 0.5,
            x_m: 0.01,
            y_m: -0.02,
            yaw_rad: None,
            vx_m_s: Some(0.0),
            vy_m_s: Some(0.0),
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            std_m: 1e-5,
            doubtful: false,
        };
        let tracks =
            Tracks { tracks: vec![Track { object: "a".into(), samples: vec![sample] }], ..Tracks::default() };
        let overlay = Overlay { camera: &camera, tracks: &tracks, objects: &[object] };
        let image = GreyImage { width: 200, height: 160, pixels: vec![90; 200 * 160] };
        let at = |picture: &Picture, p: Pixel| {
            let at = 3 * (p.y.round() as usize * 200 + p.x.round() as usize);
            [picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]]
        };
        let picture = overlay.drawn(&Frame { time_s: 0.5, image: image.clone() });
        for heading in 0..12 {
            let place = sample.position() + Vec2::from_heading(f64::from(heading)) * 0.03;
            let [red, _, blue] = at(&picture, camera.pixel_from_table(place, 0.001));
            assert!(blue > red + 60, "no outline at heading {heading} rad: red {red}, blue {blue}");
        }
        let beside = camera.pixel_from_table(sample.position() + Vec2::new(0.02, 0.01), 0.001);
        assert_eq!(at(&picture, beside), [90; 3], "the film within the outline is changed");
        // In another frame there is no outline, only the time.
        let before = overlay.drawn(&Frame { time_s: 0.25, image });
        let rim = camera.pixel_from_table(sample.position() + Vec2::new(0.03, 0.0), 0.001);
        assert_eq!(at(&before, rim), [90; 3]);
        assert!(before.rgb.iter().any(|&level| level > 200), "no time was written");
    }
}
