//! The result as a file for other programs and as a picture.

use super::LensCalibration;
use super::assessment::{field_counts, fields};
use std::fmt::Write;

/// Length of a residual in the drawing over its length in the picture.
const ENLARGED: f64 = 200.0;

impl LensCalibration {
    /// The lens as a ROS `CameraInfo` YAML file, which a cell reads as `camera_info`; the standard errors are comments.
    pub fn camera_info(&self) -> String {
        let [width, height] = self.image_size_px;
        let ([fx, fy], [cx, cy]) = (self.lens.focal_px(), self.lens.center_px());
        let film: String = self.film.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let mut text = format!(
            "# calibrated by `breakshot lens` from {film}: {} corners in {} frames, {:.3} px rms\n# standard errors:",
            self.corners, self.frames, self.reprojection_rms_px
        );
        for parameter in &self.parameters {
            let _ = write!(text, " {} {:.2e}", parameter.name, parameter.standard_error);
        }
        let coefficients = self.lens.distortion();
        let list: Vec<String> = coefficients.coefficients().iter().map(f64::to_string).collect();
        let _ = write!(
            text,
            "\nimage_width: {width}\nimage_height: {height}\ncamera_name: camera\n\
             camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{fx}, 0.0, {cx}, 0.0, {fy}, {cy}, 0.0, 0.0, 1.0]\n\
             distortion_model: {}\n\
             distortion_coefficients:\n  rows: 1\n  cols: {}\n  data: [{}]\n\
             rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n\
             projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{fx}, 0.0, {cx}, 0.0, 0.0, {fy}, {cy}, 0.0, 0.0, 0.0, 1.0, 0.0]\n",
            self.model.name(),
            list.len(),
            list.join(", ")
        );
        text
    }

    /// Where in the picture corners were measured, and how far they are from their predictions (200 times as long): a
    /// self-contained SVG.
    pub fn drawing(&self) -> String {
        let [width, height] = self.image_size_px.map(|size| size as f64);
        let line = width.max(height) / 1000.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"-0.5 -0.5 {width} {height}\" font-family=\"sans-serif\" font-size=\"{:.1}\">\n\
             <rect x=\"-0.5\" y=\"-0.5\" width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n",
            14.0 * line
        );
        let [columns, rows] = field_counts();
        let (wide, high) = (width / columns as f64, height / rows as f64);
        for (k, _) in
            fields(self.image_size_px, &self.residuals).iter().enumerate().filter(|(_, count)| **count == 0)
        {
            let (x, y) = ((k % columns) as f64 * wide - 0.5, (k / columns) as f64 * high - 0.5);
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{wide:.1}\" height=\"{high:.1}\" fill=\"#ffd9b3\"/>"
            );
        }
        for residual in &self.residuals {
            let (at, to) = (residual.predicted, residual.measured);
            let colour = if residual.is_outlier { "#e03030" } else { "#2a7fff" };
            let (dx, dy) = ((to.x - at.x) * ENLARGED, (to.y - at.y) * ENLARGED);
            // An outlier may be anywhere: its line ends within the picture's size.
            let shorter = (width / dx.hypot(dy)).min(1.0);
            let _ = writeln!(
                svg,
                "<path d=\"M{:.2} {:.2}l{:.2} {:.2}\" stroke=\"{colour}\" stroke-width=\"{:.2}\"/>\
                 <circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"{:.2}\" fill=\"{colour}\"/>",
                at.x,
                at.y,
                dx * shorter,
                dy * shorter,
                0.6 * line,
                at.x,
                at.y,
                1.2 * line
            );
        }
        let (x, y) = (10.0 * line, height - 10.0 * line);
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"#222\" stroke=\"#fff\" stroke-width=\"0.3em\" paint-order=\"stroke\">{} corners in {} \
             frames, {:.3} px rms; residuals x {ENLARGED}; without corners: orange</text>\n</svg>",
            self.corners, self.frames, self.reprojection_rms_px
        );
        svg
    }
}
