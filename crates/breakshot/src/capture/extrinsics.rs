//! Which camera pose explains the cell's tags (or points, or scale), and which tags contradict it?

use super::camera::{Camera, Projection, TagFit};
use super::image::GreyImage;
use super::lens::{Lens, middle_px};
use super::pose::{self, Correspondence, FreeParameters, PoseFit};
use super::tag_widths::WidthRatios;
use super::tags::{self, DetectedTag};
use crate::cell::{CameraSpec, Cell, ReferencePoint, Tag, Workspace, width_warning};
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point};
use crate::statistics::sorted_by_value;
use std::f64::consts::FRAC_PI_2;

/// Largest distance of a tag's corners from where the pose of the other tags predicts them (m): errors of a ruler are
/// smaller...
const MISPLACED_M: f64 = 2e-3;
/// ... and errors of an edge in the picture are smaller than this (px).
const MISPLACED_PX: f64 = 2.0;
/// Root mean square error of the corners from which on the user is warned (m): a tenth of it is usual.
const DOUBTFUL_M: f64 = 3e-4;
/// Standard deviation of a position at the workspace's corners from which on the user is warned (m).
const UNCERTAIN_M: f64 = 1e-4;
/// Standard deviations of a fitted corner, at least, and of a pixel picked by hand (px).
pub(super) const CORNER_NOISE_PX: f64 = 0.02;
const CLICK_NOISE_PX: f64 = 0.5;
/// Largest relative standard deviation of an accepted focal length: 1 % shifts a point 5 cm above the table by 0.04 % of
/// its distance from the point below the camera.
pub(super) const FOCAL_STD: f64 = 0.01;
/// Relative tolerance of a tag's size: the error of a ruler on the smallest tags.
const SAME_SIZE: f64 = 0.03;
/// Number of tags whose centres alone determine the pose.
const TAGS_OF_A_POSE: usize = 4;
/// Largest standard error of the mean width of the tags over `size_m`, and the least width (px): overexposure makes a black square narrower by
/// some tenths of a pixel.
const WIDTH_RATIO_STD: f64 = 0.002;
const LEAST_WIDTH_PX: f64 = 40.0;
/// k1 is estimated if it differs from zero by this many standard deviations.
const SIGNIFICANT: f64 = 5.0;
/// Initial guesses of an unknown focal length in picture widths: from wide angle to telephoto.
const FOCAL_GUESSES: [f64; 4] = [0.6, 1.0, 1.8, 4.0];
/// Largest motion of a corner between two frames of a fixed camera (px): noise is smaller.
const STILL_PX: f64 = 1.0;

/// Where the size of the calibrated picture is from, in messages.
pub(super) const SIZE_OF_CELL: &str = "the camera's image_size_px";

/// The name of the picture in messages, and what is known before the pose.
struct PoseProblem<'a> {
    name: &'a str,
    size_px: [usize; 2],
    cell: &'a Cell,
    spec: CameraSpec,
    /// The lens, if its focal length is given.
    lens: Option<Lens>,
    /// The clockwise rotation of all tags against the cell, in units of 90 degrees.
    quarter_turns: usize,
    warnings: Vec<String>,
}

/// The camera that took these pictures of one still scene: tags are detected in the first one that shows any, and their
/// corners are averaged over the others.
///
/// # Errors
/// A picture of another size than the lens was calibrated for, a distortion that is not one to one, no or contradicting
/// tags, points that do not span the table.
pub fn camera(name: &str, pictures: &[&GreyImage], cell: &Cell) -> Result<Camera> {
    let first = pictures.first().ok_or_else(|| failure(name, "no picture", "at least one"))?;
    let size_px = [first.width, first.height];
    let mut problem = problem(name, size_px, cell)?;
    let mut camera = if !cell.tags.is_empty() {
        let camera = problem.by_tags(pictures)?;
        Camera { tag_thickness_m: problem.spec.tag_thickness_m.unwrap_or(0.0), ..camera }
    } else if !cell.points.is_empty() {
        problem.by_points()?
    } else {
        problem.by_scale()?
    };
    camera.warnings = problem.warnings;
    camera.readout_s = problem.spec.readout_s.unwrap_or(0.0);
    camera.exposure_s = problem.spec.exposure_s;
    Ok(camera)
}

fn failure(name: &str, found: impl Into<String>, needed: impl Into<String>) -> Error {
    Error::Camera { name: name.into(), found: found.into(), needed: needed.into() }
}

fn problem<'a>(name: &'a str, size_px: [usize; 2], cell: &'a Cell) -> Result<PoseProblem<'a>> {
    let spec = cell.camera.resolved("cell")?;
    check_size(name, size_px, &spec, SIZE_OF_CELL)?;
    let mut warnings = Vec::new();
    let lens = given_lens(&spec, size_px)?;
    if lens.is_some() && spec.center_px.is_none() {
        warnings.push("camera.center_px is not given: the middle of the picture is taken".into());
    }
    Ok(PoseProblem { name, size_px, cell, spec, lens, quarter_turns: 0, warnings })
}

/// The lens in the camera's own keys, with the principal point in the middle of the picture if none is given; `None` without a focal length.
///
/// # Errors
/// A distortion without a focal length, or one that is not one to one in the picture.
pub(super) fn given_lens(spec: &CameraSpec, size_px: [usize; 2]) -> Result<Option<Lens>> {
    let Some(focal_px) = spec.focal_px else {
        if spec.distortion.iter().flatten().any(|&k| k != 0.0) || spec.distortion_model.is_some() {
            return Err(Error::invalid("cell", "camera.focal_px", "not given", "focal_px beside distortion"));
        }
        return Ok(None);
    };
    let distortion = spec.own_distortion("cell")?.unwrap_or_default();
    let lens = Lens::new(focal_px, spec.center_px.unwrap_or(middle_px(size_px)), distortion);
    lens.check("cell", size_px)?;
    Ok(Some(lens))
}

/// An error for a picture of another size than the calibration.
///
/// The picture may be scaled, binned or cropped: the error's message holds the numbers for a scaled one, which are never
/// used without the user. `whose` says where the size of the calibration is from.
pub(super) fn check_size(
    name: &str,
    [width, height]: [usize; 2],
    spec: &CameraSpec,
    whose: &str,
) -> Result<()> {
    let Some([w, h]) = spec.image_size_px else { return Ok(()) };
    if (w as usize, h as usize) == (width, height) {
        return Ok(());
    }
    let mut needed = format!("{w} x {h}, {whose}");
    if let (true, Some([fx, fy])) = (w as usize * height == h as usize * width, spec.focal_px) {
        let s = width as f64 / f64::from(w);
        let [cx, cy] = spec.center_px.unwrap_or(middle_px([w as usize, h as usize]));
        let [fx, fy, cx, cy] = [fx * s, fy * s, (cx + 0.5) * s - 0.5, (cy + 0.5) * s - 0.5];
        let scaled = format!(
            "; if the film shows the whole sensor, write image_size_px = [{width}, {height}], \
             focal_px = [{fx:.4}, {fy:.4}], center_px = [{cx:.4}, {cy:.4}]"
        );
        needed += &scaled;
    }
    Err(failure(name, format!("a picture of {width} x {height} px"), needed))
}

impl PoseProblem<'_> {
    fn by_scale(&mut self) -> Result<Camera> {
        let scale_px_per_m = self.cell.scale_px_per_m().ok_or_else(|| {
            failure(
                self.name,
                "a cell without tags, points and scale",
                "[[tags]], [[points]] or scale_px_per_m",
            )
        })?;
        let Some(lens) = &self.lens else {
            self.warnings.push(heights_warning());
            return Ok(Camera::flat(self.size_px, scale_px_per_m, self.spec.center_px));
        };
        let down = nalgebra::Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, -1.0, -1.0));
        let far = nalgebra::Vector3::new(0.0, 0.0, lens.focal_px()[0] / scale_px_per_m);
        let pose = super::camera::Extrinsics::new(&down, &far);
        Ok(self.camera_with(Projection::Space { lens: lens.clone(), pose }))
    }

    fn by_points(&mut self) -> Result<Camera> {
        let correspondence = |p: &ReferencePoint| Correspondence {
            point: p.table_m,
            pixel: p.image_px,
            std_px: CLICK_NOISE_PX,
        };
        let correspondences: Vec<Correspondence> = self.cell.points.iter().map(correspondence).collect();
        let outside =
            correspondences.iter().position(|s| !Camera::flat(self.size_px, 1.0, None).shows(s.pixel));
        if let Some(k) = outside {
            let found = format!(
                "points[{k}].image_px at ({}, {})",
                correspondences[k].pixel.x, correspondences[k].pixel.y
            );
            return Err(failure(
                self.name,
                found,
                format!("inside {} x {} px", self.size_px[0], self.size_px[1]),
            ));
        }
        let fit = match &self.lens {
            Some(lens) => pose::pose(lens, &correspondences, FreeParameters::Pose),
            None => self.unknown_focal(&correspondences, false).or_else(|| {
                self.warnings.push(heights_warning());
                pose::plane(&correspondences)
            }),
        };
        let spanning = || failure(self.name, "points that do not span the table", "4 points, no 3 on a line");
        let fit = fit.ok_or_else(spanning)?;
        let mut camera = self.camera_with(fit.projection.clone());
        (camera.reprojection_rms_px, camera.reprojection_rms_m) = rms(&camera, &correspondences);
        self.assess(&mut camera, &fit);
        Ok(camera)
    }

    /// A fit with an unknown focal length (square pixels), if the perspective is strong enough to determine it; with
    /// `distorted` also with k1, if that is significant.
    fn unknown_focal(&self, correspondences: &[Correspondence], distorted: bool) -> Option<PoseFit> {
        let center_px = self.spec.center_px.unwrap_or(middle_px(self.size_px));
        let fits = FOCAL_GUESSES.iter().filter_map(|widths| {
            let guess = Lens::new([widths * self.size_px[0] as f64; 2], center_px, [0.0; 5]);
            pose::pose(&guess, correspondences, FreeParameters::PoseAndFocal)
        });
        let mut best = fits.min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
        if distorted && let Projection::Space { lens, .. } = &best.projection {
            let with_k1 = pose::pose(lens, correspondences, FreeParameters::PoseFocalAndK1).filter(|fit| {
                let k1 = match &fit.projection {
                    Projection::Space { lens, .. } => lens.distortion().coefficients()[0],
                    Projection::Plane { .. } => 0.0,
                };
                fit.k1_std().is_some_and(|std| k1.abs() > SIGNIFICANT * std)
            });
            best = with_k1.unwrap_or(best);
        }
        best.focal_std().is_some_and(|std| std < FOCAL_STD).then_some(best)
    }

    fn by_tags(&mut self, pictures: &[&GreyImage]) -> Result<Camera> {
        // Detected tags that agree with the cell
        let (pictures, detected) = self.first_detections(pictures)?;
        let (mut detected, repeated) = unique_ids(detected);
        if detected.is_empty() {
            let found = format!("tag {} detected twice", list(&repeated));
            return Err(failure(
                self.name,
                found,
                "each tag once, or other tags that decide which one is right",
            ));
        }
        let mut used = self.consistent_tags(&detected)?;
        let mut fit = self.fit(&used)?;
        // Tags that the first pass missed, because of shadow or glare, at their predicted positions
        let found = self.missed_tags(pictures[0], &fit, &detected);
        if !found.is_empty() {
            detected.extend(found);
            detected = sorted_by_value(detected, |tag| f64::from(tag.id));
            used = self.consistent_tags(&detected)?;
            fit = self.fit(&used)?;
        }
        for id in repeated {
            let at_its_position = detected.iter().any(|tag| tag.id == id);
            let taken =
                if at_its_position { "the one where cell.toml has it is taken" } else { "both are left out" };
            self.warnings.push(format!("tag {id} is detected twice in the picture: {taken}"));
        }
        // Average, fit, residuals, warnings
        average_corners(&mut detected, pictures, self.lens.as_ref());
        used.retain_mut(|tag| detected.iter().find(|s| s.id == tag.id).map(|s| *tag = s.clone()).is_some());
        fit = self.fit(&used).unwrap_or(fit);
        let mut camera = self.camera_with(fit.projection.clone());
        (camera.reprojection_rms_px, camera.reprojection_rms_m) = rms(&camera, &self.correspondences(&used));
        camera.tags_found = used.iter().map(|tag| tag.id).collect();
        camera.tag_width_ratio = self.width_ratio(&used, &fit.projection);
        self.warnings.extend(camera.tag_width_ratio.and_then(width_warning));
        camera.tags = detected.iter().map(|tag| self.tag_fit(&camera, tag)).collect();
        for tag in camera.tags.iter().filter(|tag| !tag.used) {
            let off = format!("tag {} is {:.1} mm from its position in cell.toml", tag.id, tag.rms_m * 1e3);
            self.warnings.push(format!("{off} and is left out"));
        }
        self.assess(&mut camera, &fit);
        Ok(camera)
    }

    /// The cell's tags in the first picture that shows one, and the pictures from that one on.
    ///
    /// # Errors
    /// No picture shows one.
    fn first_detections<'p>(
        &self,
        pictures: &'p [&'p GreyImage],
    ) -> Result<(&'p [&'p GreyImage], Vec<DetectedTag>)> {
        let known = |tag: &DetectedTag| self.tag(tag.id).is_some();
        let wanted = self.cell.tags.len().min(2);
        let enough = |tags: &[DetectedTag]| tags.iter().filter(|tag| known(tag)).count() >= wanted;
        let mut other_ids = Vec::new();
        for (k, picture) in pictures.iter().enumerate() {
            let all = tags::detected(picture, self.lens.as_ref(), &enough);
            let (ours, others): (Vec<_>, Vec<_>) = all.into_iter().partition(known);
            if !ours.is_empty() {
                return Ok((&pictures[k..], ours));
            }
            other_ids.extend(ids(&others));
        }
        let looked_for: Vec<u32> = self.cell.tags.iter().map(|tag| tag.id).collect();
        other_ids.sort_unstable();
        other_ids.dedup();
        let in_a_mirror = || tags::detected(&pictures[0].mirrored(), None, &|tags| !tags.is_empty());
        let found = if !other_ids.is_empty() {
            format!("tag {}, none of the cell's tags {}", list(&other_ids), list(&looked_for))
        } else if in_a_mirror().is_empty() {
            format!("no AprilTag of family 36h11, none of the cell's tags {}", list(&looked_for))
        } else {
            "a mirrored picture: its tags read right only in a mirror".into()
        };
        let needed =
            "one of them or better four, whole and flat in view, each side 20 px or longer, white around it";
        Err(failure(self.name, found, needed))
    }

    fn tag(&self, id: u32) -> Option<&Tag> {
        self.cell.tags.iter().find(|tag| tag.id == id)
    }

    /// The corners of a tag on the table (m), in the order of the detected corners.
    fn corners_m(&self, tag: &Tag) -> [Point; 4] {
        let mut corners = tag.corners_m();
        corners.rotate_right(self.quarter_turns);
        corners
    }

    fn correspondences(&self, detected: &[DetectedTag]) -> Vec<Correspondence> {
        let corners = |tag: &DetectedTag| {
            let points = self.tag(tag.id).map(|tag| self.corners_m(tag)).unwrap_or_default();
            let std_px = tag.std_px().map(|std_px| std_px.hypot(CORNER_NOISE_PX));
            [0, 1, 2, 3].map(|k| Correspondence {
                point: points[k],
                pixel: tag.corners_px[k],
                std_px: std_px[k],
            })
        };
        detected.iter().flat_map(corners).collect()
    }

    /// The projection fitted to these tags.
    fn fit(&self, used: &[DetectedTag]) -> Result<PoseFit> {
        let correspondences = self.correspondences(used);
        let flat = || failure(self.name, "tags that do not span the table", "tags lying flat on the table");
        if let Some(lens) = &self.lens {
            return pose::pose(lens, &correspondences, FreeParameters::Pose).ok_or_else(flat);
        }
        let distorted = used.len() >= 4;
        self.unknown_focal(&correspondences, distorted).ok_or_else(|| {
            let found = format!(
                "no focal_px, and tag {} viewed too perpendicularly to determine it",
                list(&ids(used))
            );
            let needed =
                "camera.focal_px, or a camera_info as `breakshot lens` makes it (not needed for a camera tilted by 20 degrees or more)";
            failure(self.name, found, needed)
        })
    }

    /// The tags whose positions agree with the cell; if none do, all tags are tried rotated by multiples of 90 degrees.
    ///
    /// # Errors
    /// No rotation makes them agree.
    fn consistent_tags(&mut self, detected: &[DetectedTag]) -> Result<Vec<DetectedTag>> {
        if let Some(used) = self.consensus(detected) {
            return Ok(used);
        }
        for quarters in 1..4 {
            self.quarter_turns = quarters;
            if let Some(used) = self.consensus(detected) {
                let (less_deg, less_rad) = (90 * quarters, FRAC_PI_2 * quarters as f64);
                self.warnings.push(format!(
                    "the tags are rotated against cell.toml and used as they are: \
                     each yaw_rad should be {less_rad:.4} less ({less_deg} degrees)"
                ));
                return Ok(used);
            }
        }
        self.quarter_turns = 0;
        Err(self.inconsistency(detected))
    }

    /// All tags if they agree with each other, else the largest subset that does.
    fn consensus(&self, detected: &[DetectedTag]) -> Option<Vec<DetectedTag>> {
        let all = self.rough_camera(detected).map(|camera| self.tags_close_to(&camera, detected));
        all.filter(|close| close.len() == detected.len()).or_else(|| self.largest_consensus(detected))
    }

    /// The error for tags that do not agree with each other: wrong sizes, a wrong lens, or wrong positions.
    fn inconsistency(&self, detected: &[DetectedTag]) -> Error {
        if let Some(times) = self.size_ratio(detected) {
            let found = format!("tags whose black squares are {times:.3} times as wide as size_m");
            return failure(
                self.name,
                found,
                "size_m, the side of the black square without its white margin",
            );
        }
        let without_lens =
            pose::plane(&self.correspondences(detected)).map(|fit| self.camera_with(fit.projection));
        let flat =
            without_lens.is_some_and(|camera| self.tags_close_to(&camera, detected).len() == detected.len());
        if flat && self.lens.is_some() {
            let found = "tags that are placed as in cell.toml, but not through this lens";
            let needed = "focal_px, center_px and distortion of this film: its zoom, size and crop";
            return failure(self.name, found, needed);
        }
        let distances = self.rough_camera(detected).map_or(String::new(), |camera| {
            let each = detected.iter().map(|tag| self.tag_fit(&camera, tag));
            let each: Vec<_> = each.map(|t| format!("tag {} by {:.1} mm", t.id, t.rms_m * 1e3)).collect();
            format!(" ({})", each.join(", "))
        });
        let found = format!("tags that are not placed as in cell.toml{distances}");
        let needed =
            "center_m, size_m (the black square's side) and yaw_rad as measured on the table, within 2 mm";
        failure(self.name, found, needed)
    }

    /// The ratio of the tags' true size to `size_m`, if their centres agree with the cell and all ratios are equal.
    fn size_ratio(&self, detected: &[DetectedTag]) -> Option<f64> {
        let centers = self.centers(detected);
        let camera = self.camera_with(self.projection(&centers)?);
        let WidthRatios { all, mean, .. } = self.width_ratios(&camera, detected);
        let alike = all.iter().all(|ratio| (ratio / mean - 1.0).abs() < SAME_SIZE);
        let right = rms(&camera, &centers).1 < MISPLACED_M;
        (alike && right && (mean - 1.0).abs() > SAME_SIZE).then_some(mean)
    }

    /// The mean width of the tags' black squares over `size_m`, by a camera whose pose their centres alone determine; `None` if they do not,
    /// if the tags differ, or if they are small.
    fn width_ratio(&self, used: &[DetectedTag], fitted: &Projection) -> Option<f64> {
        let Projection::Space { lens, .. } = fitted else { return None };
        let is_small = |tag: &DetectedTag| tag.corners_px[0].distance_px(tag.corners_px[1]) < LEAST_WIDTH_PX;
        if used.len() < TAGS_OF_A_POSE || used.iter().any(is_small) {
            return None;
        }
        let by_centers = pose::pose(lens, &self.centers(used), FreeParameters::Pose)?;
        let ratios = self.width_ratios(&self.camera_with(by_centers.projection), used);
        (ratios.standard_error < WIDTH_RATIO_STD).then_some(ratios.mean)
    }

    /// The centres of these tags in the cell and in the picture.
    fn centers(&self, detected: &[DetectedTag]) -> Vec<Correspondence> {
        let center = |tag: &DetectedTag| {
            let point = self.tag(tag.id)?.center_m;
            Some(Correspondence { point, pixel: tag.center_px(), std_px: CLICK_NOISE_PX })
        };
        detected.iter().filter_map(center).collect()
    }

    /// The widths of these tags as this camera sees them.
    fn width_ratios(&self, camera: &Camera, detected: &[DetectedTag]) -> WidthRatios {
        WidthRatios::of(camera, detected.iter().filter_map(|tag| Some((tag, self.tag(tag.id)?))))
    }

    fn camera_with(&self, projection: Projection) -> Camera {
        Camera::with_projection(self.size_px, projection)
    }

    /// A projection fitted with the lens if it is known, else a homography.
    fn projection(&self, correspondences: &[Correspondence]) -> Option<Projection> {
        let fit = match &self.lens {
            Some(lens) => pose::pose(lens, correspondences, FreeParameters::Pose),
            None => pose::plane(correspondences),
        };
        fit.map(|fit| fit.projection)
    }

    /// A camera fitted to these tags, for comparing them.
    fn rough_camera(&self, detected: &[DetectedTag]) -> Option<Camera> {
        self.projection(&self.correspondences(detected)).map(|projection| self.camera_with(projection))
    }

    fn tags_close_to(&self, camera: &Camera, detected: &[DetectedTag]) -> Vec<DetectedTag> {
        let close = |tag: &&DetectedTag| {
            let (rms_px, rms_m) = rms(camera, &self.correspondences(std::slice::from_ref(tag)));
            rms_m < MISPLACED_M || rms_px < MISPLACED_PX
        };
        detected.iter().filter(close).cloned().collect()
    }

    /// The largest set of tags that agree with the pose fitted to two of them: at least three, and more than half.
    fn largest_consensus(&self, detected: &[DetectedTag]) -> Option<Vec<DetectedTag>> {
        let n = detected.len();
        let pairs = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
        let consensuses = pairs.filter_map(|[a, b]| {
            let pair = [detected[a].clone(), detected[b].clone()];
            let close = self.tags_close_to(&self.rough_camera(&pair)?, detected);
            // The pose of two tags extrapolates less accurately than the pose of all tags that agree with it.
            self.rough_camera(&close).map(|camera| self.tags_close_to(&camera, detected))
        });
        let largest =
            consensuses.fold(Vec::new(), |best, next| if next.len() > best.len() { next } else { best });
        (largest.len() >= 3 && 2 * largest.len() > n).then_some(largest)
    }

    /// Tags of the cell that should be in view but were not detected: searched at their predicted positions first, then
    /// with all thresholds in the whole picture.
    fn missed_tags(&self, picture: &GreyImage, fit: &PoseFit, detected: &[DetectedTag]) -> Vec<DetectedTag> {
        let camera = self.camera_with(fit.projection.clone());
        let mut missing: Vec<(u32, [Pixel; 4])> = Vec::new();
        for tag in self.cell.tags.iter().filter(|tag| detected.iter().all(|s| s.id != tag.id)) {
            let near_px = self.corners_m(tag).map(|point| camera.pixel_from_table(point, 0.0));
            if near_px.iter().all(|&p| camera.shows(p)) {
                missing.push((tag.id, near_px));
            }
        }
        let lens = self.lens.as_ref();
        let mut found: Vec<DetectedTag> = missing
            .iter()
            .filter_map(|&(id, near_px)| tags::detected_near(picture, lens, id, near_px))
            .collect();
        missing.retain(|(id, _)| found.iter().all(|tag| tag.id != *id));
        if !missing.is_empty() {
            let enough =
                |tags: &[DetectedTag]| missing.iter().all(|(id, _)| tags.iter().any(|tag| tag.id == *id));
            let (unique, _) = unique_ids(tags::detected(picture, lens, &enough));
            found.extend(unique.into_iter().filter(|tag| missing.iter().any(|(id, _)| tag.id == *id)));
        }
        found
    }

    fn tag_fit(&self, camera: &Camera, tag: &DetectedTag) -> TagFit {
        let (rms_px, rms_m) = rms(camera, &self.correspondences(std::slice::from_ref(tag)));
        let used = camera.tags_found.contains(&tag.id);
        TagFit { id: tag.id, corners_px: tag.corners_px, rms_px, rms_m, used }
    }

    /// Sets the standard deviation of positions and warns the user where it or the residuals are too large.
    fn assess(&mut self, camera: &mut Camera, fit: &PoseFit) {
        let Workspace { min_m, max_m } = self.cell.workspace;
        let corners = [min_m, max_m, Point::new(min_m.x, max_m.y), Point::new(max_m.x, min_m.y)];
        let worst_m = corners
            .map(|corner| pose::position_std_m(&fit.projection, &fit.covariance, corner, 0.0))
            .into_iter()
            .fold(0.0, f64::max);
        camera.pose_covariance = Some(fit.covariance.clone());
        camera.position_std_m = Some(worst_m).filter(|std_m| std_m.is_finite());
        let off_mm = camera.reprojection_rms_m * 1e3;
        if camera.reprojection_rms_m > DOUBTFUL_M && camera.reprojection_rms_px > STILL_PX / 2.0 {
            self.warnings.push(format!(
                "on average the table's marks are {off_mm:.2} mm from their positions in cell.toml"
            ));
        }
        if camera.position_std_m.is_none_or(|std_m| std_m > UNCERTAIN_M) {
            let marks = match camera.tags_found.len() {
                0 => "the points".into(),
                1 => "one tag".into(),
                n => format!("{n} tags"),
            };
            let accuracy = match camera.position_std_m {
                Some(std_m) => format!("to {:.2} mm only", std_m * 1e3),
                None => "not at all".into(),
            };
            self.warnings.push(format!("{marks} determine positions at the workspace's corners {accuracy}"));
        }
    }
}

fn heights_warning() -> String {
    "without camera.focal_px heights are not corrected: a marker 5 cm above the table viewed from 1.2 m appears 4 % \
     too far from the point below the camera"
        .into()
}

fn ids(detected: &[DetectedTag]) -> Vec<u32> {
    detected.iter().map(|tag| tag.id).collect()
}

fn list(ids: &[u32]) -> String {
    ids.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

/// The tags whose number occurs once, and the numbers that occur more often.
fn unique_ids(detected: Vec<DetectedTag>) -> (Vec<DetectedTag>, Vec<u32>) {
    let mut repeated: Vec<u32> =
        detected.windows(2).filter(|pair| pair[0].id == pair[1].id).map(|pair| pair[0].id).collect();
    repeated.dedup();
    (detected.into_iter().filter(|tag| !repeated.contains(&tag.id)).collect(), repeated)
}

/// Root mean square distance between measured and predicted pixels (px), and between measured and true positions (m).
fn rms(camera: &Camera, correspondences: &[Correspondence]) -> (f64, f64) {
    let n = correspondences.len().max(1) as f64;
    let (mut px2, mut m2) = (0.0, 0.0);
    for s in correspondences {
        px2 += camera.pixel_from_table(s.point, 0.0).distance_px(s.pixel).powi(2) / n;
        m2 += (camera.table_from_pixel(s.pixel, 0.0) - s.point).length_squared() / n;
    }
    (px2.sqrt(), m2.sqrt())
}

/// Replaces each tag's corners by their mean over the pictures in which they have not moved.
fn average_corners(detected: &mut [DetectedTag], pictures: &[&GreyImage], lens: Option<&Lens>) {
    for tag in detected {
        let (first, mut sum, mut n) = (tag.corners_px, tag.corners_px, 1.0);
        for picture in &pictures[1..] {
            let Some(again) = tags::redetected(picture, lens, tag) else { continue };
            let still = first.iter().zip(&again.corners_px).all(|(a, b)| a.distance_px(*b) < STILL_PX);
            if still {
                n += 1.0;
                for (sum, corner) in sum.iter_mut().zip(again.corners_px) {
                    *sum = Pixel::new(sum.x + corner.x, sum.y + corner.y);
                }
            }
        }
        tag.corners_px = sum.map(|p| Pixel::new(p.x / n, p.y / n));
    }
}
