//! Do the tags (or points, or the scale) of the cell tell where the camera is, and which of them contradict?

use super::camera::{Camera, Projection, TagFit};
use super::image::GreyImage;
use super::lens::{Lens, middle_px};
use super::pose::{self, Fit, Sighting, Unknown};
use super::tags::{self, SeenTag};
use crate::cell::{CameraSpec, Cell, ReferencePoint, Tag, Workspace};
use crate::error::{Error, Result};
use crate::geometry::{Pixel, Point};
use std::f64::consts::{FRAC_PI_2, SQRT_2};

/// A tag's corners farther than this from where the other tags have them (m): no ruler errs so much...
const MISPLACED_M: f64 = 2e-3;
/// ... nor does an edge in the picture (px).
const MISPLACED_PX: f64 = 2.0;
/// Corners farther off than this on average are told to the user (m): a tenth of it is usual.
const DOUBTFUL_M: f64 = 3e-4;
/// A pose that leaves places at the workspace's corners more uncertain than this is told to the user (m).
const UNCERTAIN_M: f64 = 1e-4;
/// The least noise of a fitted corner and of a pixel read off by hand (px).
const CORNER_NOISE_PX: f64 = 0.02;
const CLICK_NOISE_PX: f64 = 0.5;
/// A focal length must be known to this part of itself: at 5 cm height 1 % of it is 0.04 % of a place.
const FOCAL_STD: f64 = 0.01;
/// Tags are as wide as told, and as each other, to this part of their width: a ruler on the smallest errs so much.
const SAME_SIZE: f64 = 0.03;
/// k1 is estimated if it differs from zero by this many standard deviations.
const SIGNIFICANT: f64 = 5.0;
/// Guesses at an unknown focal length, as parts of the picture's width: from wide angle to telephoto.
const FOCAL_GUESSES: [f64; 4] = [0.6, 1.0, 1.8, 4.0];
/// Between two frames of a camera that stands still a corner moves by no more than noise (px).
const STILL_PX: f64 = 1.0;

/// What a message calls the picture, and what is known beforehand.
struct Question<'a> {
    name: &'a str,
    size_px: [usize; 2],
    cell: &'a Cell,
    spec: CameraSpec,
    /// The lens, if its focal length is given.
    lens: Option<Lens>,
    /// By how many quarters the tags are printed or laid turned clockwise against the cell.
    turns: usize,
    warnings: Vec<String>,
}

/// The camera that took these pictures of one still scene; the first is looked through, the others lower the noise.
///
/// # Errors
/// A picture of another size than the lens was calibrated for, a lens that folds, no or contradicting tags, points
/// that do not span the table.
pub fn camera(name: &str, pictures: &[&GreyImage], cell: &Cell) -> Result<Camera> {
    let first = pictures.first().ok_or_else(|| failure(name, "no picture", "at least one"))?;
    let size_px = [first.width, first.height];
    let mut question = question(name, size_px, cell)?;
    let mut camera = if !cell.tags.is_empty() {
        let seen = question.by_tags(pictures)?;
        Camera { tag_thickness_m: question.spec.tag_thickness_m.unwrap_or(0.0), ..seen }
    } else if !cell.points.is_empty() {
        question.by_points()?
    } else {
        question.by_scale()?
    };
    camera.warnings = question.warnings;
    camera.readout_s = question.spec.readout_s.unwrap_or(0.0);
    camera.exposure_s = question.spec.exposure_s;
    Ok(camera)
}

fn failure(name: &str, found: impl Into<String>, needed: impl Into<String>) -> Error {
    Error::Camera { name: name.into(), found: found.into(), needed: needed.into() }
}

fn question<'a>(name: &'a str, size_px: [usize; 2], cell: &'a Cell) -> Result<Question<'a>> {
    let spec = cell.camera.resolved("cell")?;
    check_size(name, size_px, &spec)?;
    let mut warnings = Vec::new();
    let lens = match spec.focal_px {
        Some(focal_px) => {
            if spec.center_px.is_none() {
                warnings.push("camera.center_px is not given: the middle of the picture is taken".into());
            }
            let mut distortion = [0.0; 5];
            for (k, value) in distortion.iter_mut().zip(spec.distortion.iter().flatten()) {
                *k = *value;
            }
            let lens = Lens::new(focal_px, spec.center_px.unwrap_or(middle_px(size_px)), distortion);
            lens.check("cell", size_px)?;
            Some(lens)
        }
        None if spec.distortion.iter().flatten().any(|&k| k != 0.0) => {
            return Err(Error::invalid("cell", "camera.focal_px", "not given", "focal_px beside distortion"));
        }
        None => None,
    };
    Ok(Question { name, size_px, cell, spec, lens, turns: 0, warnings })
}

/// A film of another size may be scaled, binned or cropped: only the user knows, so the numbers for a scaled one are
/// offered and never taken.
fn check_size(name: &str, [width, height]: [usize; 2], spec: &CameraSpec) -> Result<()> {
    let Some([w, h]) = spec.image_size_px else { return Ok(()) };
    if (w as usize, h as usize) == (width, height) {
        return Ok(());
    }
    let mut needed = format!("{w} x {h}, the camera's image_size_px");
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

impl Question<'_> {
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
        Ok(self.seeing(Projection::Space { lens: lens.clone(), pose }))
    }

    fn by_points(&mut self) -> Result<Camera> {
        let sighting =
            |p: &ReferencePoint| Sighting { place: p.table_m, pixel: p.image_px, std_px: CLICK_NOISE_PX };
        let sightings: Vec<Sighting> = self.cell.points.iter().map(sighting).collect();
        let outside = sightings.iter().position(|s| !Camera::flat(self.size_px, 1.0, None).shows(s.pixel));
        if let Some(k) = outside {
            let found =
                format!("points[{k}].image_px at ({}, {})", sightings[k].pixel.x, sightings[k].pixel.y);
            return Err(failure(
                self.name,
                found,
                format!("inside {} x {} px", self.size_px[0], self.size_px[1]),
            ));
        }
        let fit = match &self.lens {
            Some(lens) => pose::pose(lens, &sightings, Unknown::Pose),
            None => self.unknown_focal(&sightings, false).or_else(|| {
                self.warnings.push(heights_warning());
                pose::plane(&sightings)
            }),
        };
        let spanning = || failure(self.name, "points that do not span the table", "4 points, no 3 on a line");
        let fit = fit.ok_or_else(spanning)?;
        let mut camera = self.seeing(fit.projection.clone());
        (camera.reprojection_rms_px, camera.reprojection_rms_m) = rms(&camera, &sightings);
        self.judge(&mut camera, &fit);
        Ok(camera)
    }

    /// A lens of square pixels around the picture's middle, where the perspective is strong enough to tell its focal
    /// length; with `distorted` also k1, where that is significant.
    fn unknown_focal(&self, sightings: &[Sighting], distorted: bool) -> Option<Fit> {
        let center_px = self.spec.center_px.unwrap_or(middle_px(self.size_px));
        let fits = FOCAL_GUESSES.iter().filter_map(|part| {
            let guess = Lens::new([part * self.size_px[0] as f64; 2], center_px, [0.0; 5]);
            pose::pose(&guess, sightings, Unknown::Focal)
        });
        let mut best = fits.min_by(|a, b| a.misfit.total_cmp(&b.misfit))?;
        if distorted && let Projection::Space { lens, .. } = &best.projection {
            let bent = pose::pose(lens, sightings, Unknown::FocalAndK1).filter(|fit| {
                let k1 = match &fit.projection {
                    Projection::Space { lens, .. } => lens.distortion()[0],
                    Projection::Plane { .. } => 0.0,
                };
                fit.k1_std().is_some_and(|std| k1.abs() > SIGNIFICANT * std)
            });
            best = bent.unwrap_or(best);
        }
        best.focal_std().is_some_and(|std| std < FOCAL_STD).then_some(best)
    }

    fn by_tags(&mut self, pictures: &[&GreyImage]) -> Result<Camera> {
        let (pictures, seen) = self.sighted(pictures)?;
        let (mut seen, twice) = once(seen);
        if seen.is_empty() {
            let found = format!("tag {} seen twice", list(&twice));
            return Err(failure(self.name, found, "each tag once, or other tags that say which is right"));
        }
        let mut used = self.agreeing(&seen)?;
        let mut fit = self.fit(&used)?;
        // Tags that shadow or glare hid from the first look are looked for where they must be.
        let found = self.hidden(pictures[0], &fit, &seen);
        if !found.is_empty() {
            seen.extend(found);
            seen.sort_by_key(|tag| tag.id);
            used = self.agreeing(&seen)?;
            fit = self.fit(&used)?;
        }
        for id in twice {
            let at_its_place = seen.iter().any(|tag| tag.id == id);
            let taken =
                if at_its_place { "the one where cell.toml has it is taken" } else { "both are left out" };
            self.warnings.push(format!("tag {id} is seen twice in the picture: {taken}"));
        }
        averaged(&mut seen, pictures, self.lens.as_ref());
        used.retain_mut(|tag| seen.iter().find(|s| s.id == tag.id).map(|s| *tag = s.clone()).is_some());
        fit = self.fit(&used).unwrap_or(fit);
        let mut camera = self.seeing(fit.projection.clone());
        (camera.reprojection_rms_px, camera.reprojection_rms_m) = rms(&camera, &self.sightings(&used));
        camera.tags_found = used.iter().map(|tag| tag.id).collect();
        camera.tags = seen.iter().map(|tag| self.tag_fit(&camera, tag)).collect();
        for tag in camera.tags.iter().filter(|tag| !tag.used) {
            let off = format!("tag {} lies {:.1} mm from where cell.toml has it", tag.id, tag.rms_m * 1e3);
            self.warnings.push(format!("{off} and is left out"));
        }
        self.judge(&mut camera, &fit);
        Ok(camera)
    }

    /// The cell's tags in the first picture that shows one, and the pictures from that one on.
    fn sighted<'p>(&self, pictures: &'p [&'p GreyImage]) -> Result<(&'p [&'p GreyImage], Vec<SeenTag>)> {
        let known = |tag: &SeenTag| self.tag(tag.id).is_some();
        let wanted = self.cell.tags.len().min(2);
        let enough = |tags: &[SeenTag]| tags.iter().filter(|tag| known(tag)).count() >= wanted;
        let mut strangers = Vec::new();
        for (k, picture) in pictures.iter().enumerate() {
            let all = tags::seen(picture, self.lens.as_ref(), enough);
            let (ours, others): (Vec<_>, Vec<_>) = all.into_iter().partition(known);
            if !ours.is_empty() {
                return Ok((&pictures[k..], ours));
            }
            strangers.extend(ids(&others));
        }
        let looked_for: Vec<u32> = self.cell.tags.iter().map(|tag| tag.id).collect();
        strangers.sort_unstable();
        strangers.dedup();
        let in_a_mirror = || tags::seen(&pictures[0].mirrored(), None, |tags| !tags.is_empty());
        let found = if !strangers.is_empty() {
            format!("tag {}, none of the cell's tags {}", list(&strangers), list(&looked_for))
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

    /// Where the corners of a tag should be, in the order in which they are seen.
    fn corners_m(&self, tag: &Tag) -> [Point; 4] {
        let mut corners = tag.corners_m();
        corners.rotate_right(self.turns);
        corners
    }

    fn sightings(&self, seen: &[SeenTag]) -> Vec<Sighting> {
        let corners = |tag: &SeenTag| {
            let places = self.tag(tag.id).map(|tag| self.corners_m(tag)).unwrap_or_default();
            let std_px = tag.std_px().map(|std_px| std_px.hypot(CORNER_NOISE_PX));
            [0, 1, 2, 3].map(|k| Sighting { place: places[k], pixel: tag.corners_px[k], std_px: std_px[k] })
        };
        seen.iter().flat_map(corners).collect()
    }

    /// The projection that these tags tell.
    fn fit(&self, used: &[SeenTag]) -> Result<Fit> {
        let sightings = self.sightings(used);
        let flat = || failure(self.name, "tags that do not span the table", "tags lying flat on the table");
        if let Some(lens) = &self.lens {
            return pose::pose(lens, &sightings, Unknown::Pose).ok_or_else(flat);
        }
        let distorted = used.len() >= 4;
        self.unknown_focal(&sightings, distorted).ok_or_else(|| {
            let found = format!("no focal_px, and tag {} seen too straight on to tell it", list(&ids(used)));
            let needed =
                "camera.focal_px or camera_info (a camera tilted by 20 degrees or more tells it by itself)";
            failure(self.name, found, needed)
        })
    }

    /// The tags that lie where the cell has them, as far as they tell among themselves.
    fn agreeing(&mut self, seen: &[SeenTag]) -> Result<Vec<SeenTag>> {
        if let Some(used) = self.agreement(seen) {
            return Ok(used);
        }
        for turns in 1..4 {
            self.turns = turns;
            if let Some(used) = self.agreement(seen) {
                let (less_deg, less_rad) = (90 * turns, FRAC_PI_2 * turns as f64);
                self.warnings.push(format!(
                    "the tags lie turned against cell.toml and are taken as they lie: \
                     each yaw_rad should be {less_rad:.4} less ({less_deg} degrees)"
                ));
                return Ok(used);
            }
        }
        self.turns = 0;
        Err(self.contradiction(seen))
    }

    /// All tags if they agree with each other, or else the most of them that do.
    fn agreement(&self, seen: &[SeenTag]) -> Option<Vec<SeenTag>> {
        let all = self.rough(seen).map(|camera| self.close_to(&camera, seen));
        all.filter(|close| close.len() == seen.len()).or_else(|| self.largest_agreement(seen))
    }

    /// What is wrong with tags that do not agree with each other.
    fn contradiction(&self, seen: &[SeenTag]) -> Error {
        if let Some(times) = self.size_factor(seen) {
            let found = format!("tags whose black squares are {times:.3} times as wide as size_m");
            return failure(
                self.name,
                found,
                "size_m, the side of the black square without its white margin",
            );
        }
        let without_lens = pose::plane(&self.sightings(seen)).map(|fit| self.seeing(fit.projection));
        let flat = without_lens.is_some_and(|camera| self.close_to(&camera, seen).len() == seen.len());
        if flat && self.lens.is_some() {
            let found = "tags that lie to each other as in cell.toml, but not through this lens";
            let needed = "focal_px, center_px and distortion of this film: its zoom, size and crop";
            return failure(self.name, found, needed);
        }
        let distances = self.rough(seen).map_or(String::new(), |camera| {
            let each = seen.iter().map(|tag| self.tag_fit(&camera, tag));
            let told: Vec<_> = each.map(|t| format!("tag {} by {:.1} mm", t.id, t.rms_m * 1e3)).collect();
            format!(" ({})", told.join(", "))
        });
        let found = format!("tags that do not lie to each other as in cell.toml{distances}");
        let needed =
            "center_m, size_m (the black square's side) and yaw_rad as measured on the table, within 2 mm";
        failure(self.name, found, needed)
    }

    /// How many times as wide as told the tags are, if their centres lie right and tell it.
    fn size_factor(&self, seen: &[SeenTag]) -> Option<f64> {
        let center = |tag: &SeenTag| {
            let place = self.tag(tag.id)?.center_m;
            Some(Sighting { place, pixel: tag.center_px(), std_px: CLICK_NOISE_PX })
        };
        let centers: Vec<Sighting> = seen.iter().map(center).collect::<Option<_>>()?;
        let camera = self.seeing(self.projection(&centers)?);
        let ratio = |tag: &SeenTag| {
            let [a, b, c, d] = tag.corners_px.map(|corner| camera.table_from_pixel(corner, 0.0));
            let diagonals_m = a.distance(c) + b.distance(d);
            Some(diagonals_m / (2.0 * SQRT_2 * self.tag(tag.id)?.size_m))
        };
        let ratios: Vec<f64> = seen.iter().map(ratio).collect::<Option<_>>()?;
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        let alike = ratios.iter().all(|ratio| (ratio / mean - 1.0).abs() < SAME_SIZE);
        let right = rms(&camera, &centers).1 < MISPLACED_M;
        (alike && right && (mean - 1.0).abs() > SAME_SIZE).then_some(mean)
    }

    fn seeing(&self, projection: Projection) -> Camera {
        Camera::seeing(self.size_px, projection)
    }

    /// With the lens if it is known, else by homography.
    fn projection(&self, sightings: &[Sighting]) -> Option<Projection> {
        let fit = match &self.lens {
            Some(lens) => pose::pose(lens, sightings, Unknown::Pose),
            None => pose::plane(sightings),
        };
        fit.map(|fit| fit.projection)
    }

    /// A camera for comparing tags.
    fn rough(&self, seen: &[SeenTag]) -> Option<Camera> {
        self.projection(&self.sightings(seen)).map(|projection| self.seeing(projection))
    }

    fn close_to(&self, camera: &Camera, seen: &[SeenTag]) -> Vec<SeenTag> {
        let close = |tag: &&SeenTag| {
            let (rms_px, rms_m) = rms(camera, &self.sightings(std::slice::from_ref(tag)));
            rms_m < MISPLACED_M || rms_px < MISPLACED_PX
        };
        seen.iter().filter(close).cloned().collect()
    }

    /// The most tags that agree with the pose that two of them tell: three at least, and more than half.
    fn largest_agreement(&self, seen: &[SeenTag]) -> Option<Vec<SeenTag>> {
        let n = seen.len();
        let couples = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
        let agreements = couples.filter_map(|[a, b]| {
            let couple = [seen[a].clone(), seen[b].clone()];
            let close = self.close_to(&self.rough(&couple)?, seen);
            // The pose of two tags reaches far less well than that of all that agree with it.
            self.rough(&close).map(|camera| self.close_to(&camera, seen))
        });
        let largest =
            agreements.fold(Vec::new(), |best, next| if next.len() > best.len() { next } else { best });
        (largest.len() >= 3 && 2 * largest.len() > n).then_some(largest)
    }

    /// Tags of the cell that should be in view and were not seen at first: looked for at their place, and then, more
    /// thoroughly than before, everywhere.
    fn hidden(&self, picture: &GreyImage, fit: &Fit, seen: &[SeenTag]) -> Vec<SeenTag> {
        let camera = self.seeing(fit.projection.clone());
        let mut missing: Vec<(u32, [Pixel; 4])> = Vec::new();
        for tag in self.cell.tags.iter().filter(|tag| seen.iter().all(|s| s.id != tag.id)) {
            let near_px = self.corners_m(tag).map(|place| camera.pixel_from_table(place, 0.0));
            if near_px.iter().all(|&p| camera.shows(p)) {
                missing.push((tag.id, near_px));
            }
        }
        let lens = self.lens.as_ref();
        let mut found: Vec<SeenTag> =
            missing.iter().filter_map(|&(id, near_px)| tags::expected(picture, lens, id, near_px)).collect();
        missing.retain(|(id, _)| found.iter().all(|tag| tag.id != *id));
        if !missing.is_empty() {
            let enough =
                |tags: &[SeenTag]| missing.iter().all(|(id, _)| tags.iter().any(|tag| tag.id == *id));
            let (once, _) = once(tags::seen(picture, lens, enough));
            found.extend(once.into_iter().filter(|tag| missing.iter().any(|(id, _)| tag.id == *id)));
        }
        found
    }

    fn tag_fit(&self, camera: &Camera, tag: &SeenTag) -> TagFit {
        let (rms_px, rms_m) = rms(camera, &self.sightings(std::slice::from_ref(tag)));
        let used = camera.tags_found.contains(&tag.id);
        TagFit { id: tag.id, corners_px: tag.corners_px, rms_px, rms_m, used }
    }

    /// Fills in how sure the pose is, and tells the user where that is not enough.
    fn judge(&mut self, camera: &mut Camera, fit: &Fit) {
        let Workspace { min_m, max_m } = self.cell.workspace;
        let corners = [min_m, max_m, Point::new(min_m.x, max_m.y), Point::new(max_m.x, min_m.y)];
        let worst_m = corners.map(|corner| fit.place_std_m(corner)).into_iter().fold(0.0, f64::max);
        camera.place_std_m = Some(worst_m).filter(|std_m| std_m.is_finite());
        let off_mm = camera.reprojection_rms_m * 1e3;
        if camera.reprojection_rms_m > DOUBTFUL_M && camera.reprojection_rms_px > STILL_PX / 2.0 {
            self.warnings.push(format!(
                "on average the table's marks lie {off_mm:.2} mm from where cell.toml has them"
            ));
        }
        if camera.place_std_m.is_none_or(|std_m| std_m > UNCERTAIN_M) {
            let marks = match camera.tags_found.len() {
                0 => "the points".into(),
                1 => "one tag".into(),
                n => format!("{n} tags"),
            };
            let told = match camera.place_std_m {
                Some(std_m) => format!("to {:.2} mm only", std_m * 1e3),
                None => "not at all".into(),
            };
            self.warnings.push(format!("{marks} tell places at the workspace's corners {told}"));
        }
    }
}

fn heights_warning() -> String {
    "without camera.focal_px heights are not corrected: a marker 5 cm above the table seen from 1.2 m appears 4 % \
     too far from the point below the camera"
        .into()
}

fn ids(seen: &[SeenTag]) -> Vec<u32> {
    seen.iter().map(|tag| tag.id).collect()
}

fn list(ids: &[u32]) -> String {
    ids.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

/// The tags seen once, and the numbers seen more often.
fn once(seen: Vec<SeenTag>) -> (Vec<SeenTag>, Vec<u32>) {
    let mut twice: Vec<u32> =
        seen.windows(2).filter(|pair| pair[0].id == pair[1].id).map(|pair| pair[0].id).collect();
    twice.dedup();
    (seen.into_iter().filter(|tag| !twice.contains(&tag.id)).collect(), twice)
}

/// Root mean square distance between seen and expected pixels (px), and between seen and true places (m).
fn rms(camera: &Camera, sightings: &[Sighting]) -> (f64, f64) {
    let n = sightings.len().max(1) as f64;
    let (mut px2, mut m2) = (0.0, 0.0);
    for s in sightings {
        px2 += camera.pixel_from_table(s.place, 0.0).distance_px(s.pixel).powi(2) / n;
        m2 += (camera.table_from_pixel(s.pixel, 0.0) - s.place).length_squared() / n;
    }
    (px2.sqrt(), m2.sqrt())
}

/// Each tag's corners become their mean over the pictures in which they are found in the same place.
fn averaged(seen: &mut [SeenTag], pictures: &[&GreyImage], lens: Option<&Lens>) {
    for tag in seen {
        let (first, mut sum, mut n) = (tag.corners_px, tag.corners_px, 1.0);
        for picture in &pictures[1..] {
            let Some(again) = tags::again(picture, lens, tag) else { continue };
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

impl Camera {
    /// How far the tags of a later picture lie from where they were when the camera was found (px): the median over
    /// the tags that are still in view, `None` if none is.
    ///
    /// A camera that stands still gives some hundredths; more than half a pixel means that it was moved.
    pub fn shift_px(&self, later: &GreyImage) -> Option<f64> {
        let mut all = None;
        let shifts = self.tags.iter().filter_map(|fit| {
            let tag = SeenTag::remembered(fit.id, fit.corners_px);
            let again = tags::again(later, self.lens(), &tag).or_else(|| {
                let seen = all.get_or_insert_with(|| tags::seen(later, self.lens(), |tags| !tags.is_empty()));
                seen.iter().find(|tag| tag.id == fit.id).cloned()
            })?;
            let square = |k: usize| again.corners_px[k].distance_px(fit.corners_px[k]).powi(2);
            Some(((0..4).map(square).sum::<f64>() / 4.0).sqrt())
        });
        let mut shifts: Vec<f64> = shifts.collect();
        shifts.sort_by(f64::total_cmp);
        shifts.get(shifts.len() / 2).copied()
    }
}
