//! Film frames with the tracks drawn on them: outlines, paths of the centres, velocities, and the time.

mod draft_figure;

pub use draft_figure::draft_figure;

use super::figures::Palette;
use super::raster::{Area, COLOURS, Canvas, Colour, FAINT, Lettering, Pen, RgbImage, STRONG, text_width_px};
use crate::capture::{Camera, Frame};
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{self, Object, Shape};

/// The tracks of a film, to be drawn on its frames.
#[derive(Clone, Copy, Debug)]
pub struct Overlay<'a> {
    /// The camera of the film.
    pub camera: &'a Camera,
    /// The tracks.
    pub tracks: &'a Tracks,
    /// The objects, for their outlines.
    pub objects: &'a [Object],
}

const WHITE: Colour = [255, 255, 255];
const BLACK: Colour = [0, 0, 0];
/// The longer side of the image over the height of a capital letter.
const IMAGE_OVER_LETTER: f64 = 90.0;
/// The least height of a capital letter (px).
const LEAST_LETTER_PX: f64 = 9.0;

fn letter_px(longer_side_px: usize) -> f64 {
    (longer_side_px as f64 / IMAGE_OVER_LETTER).max(LEAST_LETTER_PX)
}

/// Text with a dark rim, from its left end on the base line.
fn rimmed_text(canvas: &mut Canvas, text: &str, at: Pixel, height_px: f64) {
    for (x, y) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
        let rim_px = 0.1 * height_px;
        let left = Pixel::new(at.x + x * rim_px, at.y + y * rim_px);
        canvas.text(text, left, Lettering { height_px, colour: BLACK });
    }
    canvas.text(text, at, Lettering { height_px, colour: WHITE });
}

/// The colour of doubtful samples.
const DOUBTFUL: Colour = [255, 40, 40];
/// The length of a velocity arrow is the distance covered in this time (s).
const ARROW_S: f64 = 0.15;
/// The longer side of the image over the width of a line.
const IMAGE_OVER_PEN: f64 = 800.0;
/// The least width of a line (px).
const LEAST_PEN_PX: f64 = 1.5;
/// Slower objects have no velocity arrow (m/s): it would show noise.
const LEAST_SPEED_M_S: f64 = 0.02;
/// Two times that differ by less than this (s) belong to the same frame.
const SAME_TIME_S: f64 = 1e-4;

impl Overlay<'_> {
    /// The frame with the outlines, velocities and paths of all objects up to its time.
    pub fn drawn(&self, frame: &Frame) -> RgbImage {
        let image = &frame.image;
        let mut canvas = Canvas::of(image);
        let width_px = (image.width.max(image.height) as f64 / IMAGE_OVER_PEN).max(LEAST_PEN_PX);
        // With a rolling shutter an object is imaged up to one readout time after the start of the frame.
        let until_s = frame.time_s + self.camera.readout_s + SAME_TIME_S;
        let palette = Palette::new(self.objects.iter().map(|object| object.name.as_str()));
        for track in &self.tracks.tracks {
            let Ok(object) = object::find(self.objects, &track.object, "overlay") else { continue };
            let colour = COLOURS[palette.number(&track.object).unwrap_or(0) % COLOURS.len()];
            let path_pen = Pen { colour, width_px: 0.7 * width_px, opacity: FAINT };
            canvas.polyline(&self.path(track, object, until_s), path_pen);
            let last = track.samples.iter().rfind(|s| s.time_s <= until_s);
            if let Some(sample) = last.filter(|s| s.time_s >= frame.time_s - SAME_TIME_S) {
                let colour = if sample.doubtful { DOUBTFUL } else { colour };
                self.draw_object(&mut canvas, object, sample, Pen { colour, width_px, opacity: STRONG });
                self.draw_name(&mut canvas, &track.object, object, sample);
            }
        }
        let height_px = letter_px(image.width.max(image.height));
        let margin = height_px.round() as usize;
        let text = format!("{:.3} s", frame.time_s);
        let size = [text_width_px(&text, height_px) as usize + 2 * margin, 3 * margin];
        canvas.fill(Area { corner: [margin; 2], size }, BLACK, FAINT);
        let left = Pixel::new(2.0 * height_px, 3.0 * height_px);
        canvas.text(&text, left, Lettering { height_px, colour: WHITE });
        canvas.finish()
    }

    /// The path of an object's centre up to a time, in the image.
    fn path(&self, track: &Track, object: &Object, until_s: f64) -> Vec<Pixel> {
        let so_far = track.samples.iter().take_while(|s| s.time_s <= until_s);
        so_far.map(|s| self.camera.pixel_from_table(s.position(), object.height_m)).collect()
    }

    /// Writes the name of the track beside the object, with a dark rim.
    fn draw_name(&self, canvas: &mut Canvas, name: &str, object: &Object, sample: &Sample) {
        let beside = sample.position() + Vec2::new(0.9, 0.9) * object.shape.outer_radius_m();
        let at = self.camera.pixel_from_table(beside, object.height_m);
        rimmed_text(canvas, name, at, letter_px(self.camera.size_px[0].max(self.camera.size_px[1])));
    }

    /// Draws the outline, a cross at the centroid and the velocity.
    fn draw_object(&self, canvas: &mut Canvas, object: &Object, sample: &Sample, pen: Pen) {
        let pixel = |point: Point| self.camera.pixel_from_table(point, object.height_m);
        let scaled = |factor: f64| Pen { width_px: factor * pen.width_px, ..pen };
        // Without a yaw only the outline of a disc is known.
        let pose = Pose { position: sample.position(), yaw_rad: sample.yaw_rad.unwrap_or(0.0) };
        if sample.yaw_rad.is_some() || matches!(object.shape, Shape::Disc { .. }) {
            let outline: Vec<Pixel> =
                closed_outline(&object.shape).into_iter().map(|p| pixel(pose.table_from_body(p))).collect();
            canvas.polyline(&outline, pen);
        }
        let cross_m = 0.15 * object.shape.outer_radius_m();
        for along in [Vec2::new(cross_m, 0.0), Vec2::new(0.0, cross_m)] {
            let ends = [pose.position - along, pose.position + along].map(pixel);
            canvas.polyline(&ends, scaled(0.7));
        }
        let velocity = sample.vx_m_s.zip(sample.vy_m_s).map(|(x, y)| Vec2::new(x, y));
        if let Some(velocity) = velocity.filter(|v| v.length() > LEAST_SPEED_M_S) {
            let tip = pose.position + velocity * ARROW_S;
            let barb = |angle_rad: f64| tip - (velocity * ARROW_S).rotated(angle_rad) * 0.25;
            let arrow = [pose.position, tip, barb(0.4), tip, barb(-0.4)].map(pixel);
            canvas.polyline(&arrow, scaled(1.2));
        }
    }
}

/// Points along an outline in the object's frame; the first point is repeated at the end.
pub(super) fn closed_outline(shape: &Shape) -> Vec<Point> {
    let mut points = shape.outline_points();
    points.extend(points.first().copied());
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::GreyImage;
    use crate::object::Marker;

    #[test]
    fn only_the_pixels_of_the_outline_are_drawn() {
        let camera = Camera::flat([200, 160], 1000.0, None);
        let shape = Shape::Disc { radius_m: 0.03 };
        let object = Object {
            name: "a".into(),
            shape: shape.clone(),
            height_m: 0.001,
            marker: Some(Marker::centred(shape)),
            mass_kg: None,
            support: None,
        };
        let sample = Sample {
            vx_m_s: Some(0.0),
            vy_m_s: Some(0.0),
            ..Sample::new(0.5, Point::new(0.01, -0.02), None, 1e-5)
        };
        let tracks =
            Tracks { tracks: vec![Track { object: "a".into(), samples: vec![sample] }], ..Tracks::default() };
        let overlay = Overlay { camera: &camera, tracks: &tracks, objects: &[object] };
        let image = GreyImage { width: 200, height: 160, pixels: vec![90; 200 * 160] };
        let at = |image: &RgbImage, p: Pixel| {
            let at = 3 * (p.y.round() as usize * 200 + p.x.round() as usize);
            [image.rgb[at], image.rgb[at + 1], image.rgb[at + 2]]
        };
        let drawn = overlay.drawn(&Frame { time_s: 0.5, image: image.clone() });
        for heading in 0..12 {
            let point = sample.position() + Vec2::from_heading(f64::from(heading)) * 0.03;
            let [red, _, blue] = at(&drawn, camera.pixel_from_table(point, 0.001));
            assert!(blue > red + 60, "no outline at heading {heading} rad: red {red}, blue {blue}");
        }
        let beside = camera.pixel_from_table(sample.position() + Vec2::new(0.02, 0.01), 0.001);
        assert_eq!(at(&drawn, beside), [90; 3], "a pixel inside the outline is changed");
        // A frame at another time has no outline.
        let before = overlay.drawn(&Frame { time_s: 0.25, image });
        let rim = camera.pixel_from_table(sample.position() + Vec2::new(0.03, 0.0), 0.001);
        assert_eq!(at(&before, rim), [90; 3]);
        assert!(before.rgb.iter().any(|&level| level > 200), "no time was written");
    }
}
