//! A picture with the drafted objects drawn on it.

use super::canvas::{Canvas, Pen, STRONG};
use super::{COLOURS, IMAGE_OVER_PEN, LEAST_PEN_PX, RgbImage, closed_outline};
use crate::detect::{Draft, Drafted};
use crate::geometry::{Pixel, Pose};
use crate::object::Shape;

/// The picture of a draft with the outline, the marker and the number of each object: 2 for `object_2`.
pub fn draft_figure(draft: &Draft) -> RgbImage {
    let mut canvas = Canvas::of(&draft.image);
    let longer_px = draft.image.width.max(draft.image.height) as f64;
    let width_px = (longer_px / IMAGE_OVER_PEN).max(LEAST_PEN_PX);
    let size = (draft.image.height / 270).max(2);
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
        let number = object.name.rsplit('_').next().unwrap_or_default();
        let right = outline.iter().map(|pixel| pixel.x).fold(0.0, f64::max);
        let top = outline.iter().map(|pixel| pixel.y).fold(f64::INFINITY, f64::min).max(0.0);
        canvas.write(number, [right as usize, top as usize], size);
    }
    canvas.finish()
}
