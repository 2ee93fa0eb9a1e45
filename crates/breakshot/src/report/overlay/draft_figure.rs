//! A picture with the drafted objects drawn on it.

use super::{IMAGE_OVER_PEN, LEAST_PEN_PX, closed_outline, letter_px, rimmed_text};
use crate::detect::{Draft, Drafted};
use crate::geometry::{Pixel, Pose};
use crate::object::Shape;
use crate::report::raster::{COLOURS, Canvas, Pen, RgbImage, STRONG};

/// The picture of a draft with the outline, the marker and the name of each object.
pub fn draft_figure(draft: &Draft) -> RgbImage {
    let mut canvas = Canvas::of(&draft.image);
    let longer_px = draft.image.width.max(draft.image.height) as f64;
    let width_px = (longer_px / IMAGE_OVER_PEN).max(LEAST_PEN_PX);
    let height_px = letter_px(longer_px as usize);
    for (Drafted { object, pose, .. }, colour) in draft.objects.iter().zip(COLOURS.iter().cycle()) {
        let pixels = |shape: &Shape, at: Pose| -> Vec<Pixel> {
            let points = closed_outline(shape).into_iter();
            points.map(|p| draft.camera.pixel_from_table(at.table_from_body(p), object.height_m)).collect()
        };
        let pen = Pen { colour: *colour, width_px, opacity: STRONG };
        let outline = pixels(&object.shape, *pose);
        canvas.polyline(&outline, pen);
        if let Some(marker) = &object.marker {
            let placed = |at| Pose { position: pose.table_from_body(at), yaw_rad: pose.yaw_rad };
            canvas.polyline(&pixels(&marker.shape, placed(marker.at_m)), pen);
            if let Some(dot) = marker.dot {
                canvas.polyline(&pixels(&Shape::Disc { radius_m: dot.radius_m }, placed(dot.at_m)), pen);
            }
        }
        let right = outline.iter().map(|pixel| pixel.x).fold(0.0, f64::max);
        let top = outline.iter().map(|pixel| pixel.y).fold(f64::INFINITY, f64::min);
        rimmed_text(&mut canvas, &object.name, Pixel::new(right, top.max(height_px)), height_px);
    }
    canvas.finish()
}
