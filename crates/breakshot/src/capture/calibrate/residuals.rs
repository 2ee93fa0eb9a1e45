//! Where does each tag lie in the picture, and where does the fitted camera predict it?

use super::Calibration;
use crate::cell::Tag;
use crate::geometry::{Pixel, Vec2};
use serde::Serialize;

/// A detected tag beside the prediction for its position in the cell.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TagResidual {
    /// Its number.
    pub id: u32,
    /// The pixels of its corners that the camera predicts, in the order of [`TagFit::corners_px`](super::super::TagFit::corners_px).
    pub predicted_px: [Pixel; 4],
    /// The measured pixels of its corners.
    pub measured_px: [Pixel; 4],
    /// Where its corners are measured on the table, less where they are by the cell: the mean over the corners (m).
    pub offset_m: Vec2,
}

impl Calibration {
    /// The residuals of the detected tags, in the order of [`Camera::tags`](super::super::Camera::tags). Tags that lie rotated by quarter turns
    /// against the cell are compared as they were used.
    pub fn tag_residuals(&self) -> Vec<TagResidual> {
        let residuals = |quarters: usize| -> Vec<TagResidual> {
            let fits = self.camera.tags.iter();
            fits.filter_map(|fit| {
                let tag = self.cell.tags.iter().find(|tag| tag.id == fit.id)?;
                Some(self.tag_residual(tag, &fit.corners_px, quarters))
            })
            .collect()
        };
        let all = [0, 1, 2, 3].map(residuals);
        let used = |residual: &&TagResidual| self.camera.tags_found.contains(&residual.id);
        let sum_px =
            |all: &[TagResidual]| -> f64 { all.iter().filter(used).flat_map(TagResidual::lengths_px).sum() };
        all.into_iter().min_by(|a, b| sum_px(a).total_cmp(&sum_px(b))).unwrap_or_default()
    }

    fn tag_residual(&self, tag: &Tag, measured_px: &[Pixel; 4], quarters: usize) -> TagResidual {
        let camera = &self.camera;
        let mut corners = tag.corners_m();
        corners.rotate_right(quarters);
        let offset = |k: usize| camera.table_from_pixel(measured_px[k], camera.tag_thickness_m) - corners[k];
        TagResidual {
            id: tag.id,
            predicted_px: corners.map(|corner| camera.tag_pixel(corner)),
            measured_px: *measured_px,
            offset_m: (0..4).fold(Vec2::ZERO, |sum, k| sum + offset(k) / 4.0),
        }
    }
}

impl TagResidual {
    /// The distance between the measured and the predicted pixel of each corner (px).
    fn lengths_px(&self) -> [f64; 4] {
        [0, 1, 2, 3].map(|k| self.measured_px[k].distance_px(self.predicted_px[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::calibration;
    use super::*;
    use crate::capture::{Camera, Capture, Footage, Lens};
    use crate::cell::{Cell, Striker, Transform, Workspace};
    use crate::geometry::Point;
    use crate::synthetic::film::{Thing, View, film};
    use std::f64::consts::FRAC_PI_2;

    fn tag(id: u32, x_m: f64, y_m: f64, yaw_rad: f64) -> Tag {
        Tag { family: "36h11".into(), id, size_m: 0.06, center_m: Point::new(x_m, y_m), yaw_rad }
    }

    /// Five tags, turned as given, as drawn.
    fn tags(yaw_rad: f64) -> Vec<Tag> {
        let places = [(-0.2, -0.12), (0.2, -0.12), (0.2, 0.12), (-0.2, 0.12), (0.0, 0.12)];
        (0..).zip(places).map(|(id, (x, y))| tag(id, x, y, yaw_rad)).collect()
    }

    /// The calibration of a drawn film of these tags with a cell that gives them as `given`.
    fn calibrated(drawn: &[Tag], given: Vec<Tag>) -> Calibration {
        let size_px = [640, 480];
        let table_from_camera = Transform { position_m: [0.02, -0.01, 1.0], rpy_rad: [0.05, 0.1, 0.0] };
        let camera = Camera::new(size_px, Lens::pinhole(size_px, 800.0), table_from_camera);
        let frames = film(&View::new(camera), &[0.0], |_| drawn.iter().map(Thing::tag).collect());
        let mut cell =
            Cell::from_above(800.0, Workspace::centred([0.4, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
        cell.camera.focal_px = Some([800.0; 2]);
        cell.tags = given;
        let capture = Capture::of(Footage::from_frames("drawn", frames), &cell).expect("a camera");
        calibration(capture).expect("a picture")
    }

    #[test]
    fn the_residuals_are_those_of_the_reported_errors() {
        for quarters in 0..4 {
            let yaw_rad = FRAC_PI_2 * f64::from(quarters);
            let fit = calibrated(&tags(yaw_rad), tags(0.0));
            let residuals = fit.tag_residuals();
            assert_eq!(residuals.len(), 5);
            for (residual, tag) in residuals.iter().zip(&fit.camera.tags) {
                let squares = residual.lengths_px().map(|length| length * length);
                let rms_px = (squares.iter().sum::<f64>() / 4.0).sqrt();
                let off_px = rms_px - tag.rms_px;
                assert!(off_px.abs() < 1e-9, "tag {}: {rms_px} px, reported {} px", tag.id, tag.rms_px);
                assert!(residual.offset_m.length() <= tag.rms_m + 1e-12, "tag {}: {residual:?}", tag.id);
            }
        }
    }

    #[test]
    fn a_tag_that_is_given_elsewhere_is_offset_by_as_much() {
        let mut given = tags(0.0);
        given[4].center_m += Vec2::new(0.004, -0.003);
        let fit = calibrated(&tags(0.0), given);
        assert_eq!(fit.camera.tags_found, [0, 1, 2, 3], "the fifth tag is left out");
        let offset_m = fit.tag_residuals()[4].offset_m;
        let off_m = offset_m - Vec2::new(-0.004, 0.003);
        assert!(off_m.length() < 2e-4, "offset ({}, {}) m, not (-0.004, 0.003) m", offset_m.x, offset_m.y);
    }
}
