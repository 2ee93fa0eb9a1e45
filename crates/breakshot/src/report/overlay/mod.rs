//! Film frames with the tracks drawn on them: outlines, paths of the centres, velocities, and the time.

mod canvas;
mod draft_figure;
mod rgb_image;

pub use draft_figure::draft_figure;
pub use rgb_image::RgbImage;

use crate::capture::{Camera, Frame};
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::{Pixel, Point, Pose, Vec2};
use crate::object::{self, Object, Shape};
use canvas::{Canvas, Colour, FAINT, Pen, STRONG};

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

/// One colour for each track; further tracks repeat them.  Colours in the manner of Okabe and Ito, which most people with
/// a colour vision deficiency can distinguish.
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
        for (track, colour) in self.tracks.tracks.iter().zip(COLOURS.iter().cycle()) {
            let Ok(object) = object::find(self.objects, &track.object, "overlay") else { continue };
            let path_pen = Pen { colour: *colour, width_px: 0.7 * width_px, opacity: FAINT };
            canvas.polyline(&self.path(track, object, until_s), path_pen);
            let last = track.samples.iter().rfind(|s| s.time_s <= until_s);
            if let Some(sample) = last.filter(|s| s.time_s >= frame.time_s - SAME_TIME_S) {
                let colour = if sample.doubtful { DOUBTFUL } else { *colour };
                self.draw_object(&mut canvas, object, sample, Pen { colour, width_px, opacity: STRONG });
            }
        }
        let size = (image.height / 270).max(2);
        canvas.write(&format!("{:.3} s", frame.time_s), [3 * size, 3 * size], size);
        canvas.finish()
    }

    /// The path of an object's centre up to a time, in the image.
    fn path(&self, track: &Track, object: &Object, until_s: f64) -> Vec<Pixel> {
        let so_far = track.samples.iter().take_while(|s| s.time_s <= until_s);
        so_far.map(|s| self.camera.pixel_from_table(s.position(), object.height_m)).collect()
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
