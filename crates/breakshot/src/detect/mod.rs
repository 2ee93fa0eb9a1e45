//! Where was each object at each instant?
//!
//! Section 4 of the paper: each frame becomes a binary image, its 8-connected components become blobs with area and
//! centroid, and the blobs of markers become tracks, one per object through the whole clip.

mod assignment;
mod association;
mod candidates;
mod derivatives;
mod drafting;
mod first_frames;
#[doc(hidden)]
pub mod label;
mod marker;
mod markerless;
mod motion_blur;
mod object_outline;
mod postprocess;
mod recorded;
mod striker;
#[cfg(test)]
mod tests;
mod threshold;
mod track;
mod track_state;
mod tracks;
mod why;

pub use association::Layout;
pub use drafting::{Draft, Drafted, Heights, draft};
pub use recorded::{Recording, recorded_tracks};
pub use striker::{StrikerSample, StrikerTrack};
pub use tracks::{Sample, Track, Tracks};
pub use why::{
    Candidate, Doubt, Explained, MOST_CANDIDATES, ObjectSearches, Outcome, Rejection, Search, Sighting, Spot,
};

use crate::capture::{Camera, CameraMotion, Capture, Frame, GreyImage, RECORDED_LENS};
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::scene::{Placed, Strike};
use association::Start;
use first_frames::{MOST_FRAMES, first_frames, mean_image};
use label::Labeller;
use marker::target::Target;
use markerless::edge_fit::OutlineFit;
use markerless::edge_visibility::OutlineView;
use markerless::{background, outline_size};
use postprocess::DoubtedTrack;
use std::collections::BTreeSet;
use striker::{Follower, GivenStrike, StrikerPlace};
use track::Tracker;
use why::recorder::Recorder;

/// Settings of the detection.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// The grey level that separates markers from objects, instead of a level per marker.
    pub threshold: Option<u8>,
    /// An image of the empty table from the same camera; it improves the detection of objects without markers.
    pub table: Option<&'a GreyImage>,
    /// The strike that is given for the film: the striker is searched near it, and its own motion is measured.
    pub strike: Option<&'a Strike>,
    /// Called after each frame with the number of frames so far.
    pub on_frame: Option<&'a (dyn Fn(usize) + Sync)>,
}

impl std::fmt::Debug for Options<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.debug_struct("Options").field("threshold", &self.threshold).finish_non_exhaustive()
    }
}

/// One track for each of `names`, from the first to the last frame.
///
/// ```
/// use breakshot::capture::{Capture, Footage, GreyImage, camera};
/// use breakshot::cell::{Cell, Striker, Workspace};
/// use breakshot::detect::{Layout, Options, tracks};
/// use breakshot::geometry::Pose;
/// use breakshot::object::{Marker, Object, Shape};
/// use breakshot::synthetic::film::{Thing, View, film};
///
/// // A puck with a black marker, drawn as a camera above the table sees it, 10 mm further in the second frame.
/// let cell = Cell::from_above(1000.0, Workspace::centred([0.3, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
/// let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.01 }));
/// let shape = Shape::Disc { radius_m: 0.03 };
/// let puck = Object { name: "puck".into(), shape, height_m: 0.02, marker, mass_kg: None, support: None };
/// let blank = GreyImage { width: 640, height: 400, pixels: vec![0; 640 * 400] };
/// let view = View::new(camera("drawn", &[&blank], &cell)?);
/// let frames = film(&view, &[0.00, 0.02], |t| Thing::object(&puck, Pose::new(0.05 + 0.5 * t, 0.03, 0.0)).to_vec());
///
/// let capture = Capture::of(Footage::from_frames("drawn", frames), &cell)?;
/// let found = tracks(capture, &[puck], &["puck".into()], &Layout::Unknown, &Options::default())?;
/// let x_mm = 1e3 * found.tracks[0].samples[1].x_m;
/// assert!((x_mm - 60.0).abs() < 0.1, "x = {x_mm} mm, drawn at 60 mm");
/// # Ok::<(), breakshot::Error>(())
/// ```
///
/// # Errors
/// A film that cannot be decoded to its end, an unknown name, or fewer markers (or outlines) than objects.
pub fn tracks(
    capture: Capture,
    objects: &[Object],
    names: &[String],
    layout: &Layout,
    options: &Options,
) -> Result<Tracks> {
    Ok(tracked(capture, &Wanted { objects, names, layout }, false, options)?.tracks)
}

/// The same tracks, with a record of how every object was searched in each frame: where it was expected, and why it was lost or
/// its position is doubtful.
///
/// # Errors
/// As [`tracks()`].
pub fn explained(
    capture: Capture,
    objects: &[Object],
    names: &[String],
    layout: &Layout,
    options: &Options,
) -> Result<Explained> {
    tracked(capture, &Wanted { objects, names, layout }, true, options)
}

/// What is to be found in a film.
struct Wanted<'a> {
    objects: &'a [Object],
    names: &'a [String],
    layout: &'a Layout,
}

fn tracked(
    capture: Capture,
    &Wanted { objects, names, layout }: &Wanted,
    is_recorded: bool,
    options: &Options,
) -> Result<Explained> {
    let Capture { mut footage, camera, cell } = capture;
    let striker = Some(&cell.striker).filter(|striker| !striker.is_none());
    let given = options.strike.zip(striker).map(|(strike, striker)| GivenStrike { strike, striker });
    let targets = targets(objects, names)?;
    let clip = Clip { name: footage.name().to_string(), camera: &camera, targets, given, is_recorded };
    let mut found = clip.explained(objects, &mut footage, layout, options)?;
    let of_film = lens_warnings(&camera).chain(footage.warnings().iter().cloned());
    found.tracks.warnings.splice(0..0, of_film);
    Ok(found)
}

/// The pose of each of `names` in the first frames of a film, or in a picture; and warnings.
///
/// # Errors
/// As [`tracks()`].
pub fn placed(
    capture: Capture,
    objects: &[Object],
    names: &[String],
    options: &Options,
) -> Result<(Vec<Placed>, Vec<String>)> {
    let Capture { mut footage, camera, .. } = capture;
    let targets = targets(objects, names)?;
    let name = footage.name().to_string();
    let clip = Clip { name, camera: &camera, targets, given: None, is_recorded: false };
    let frames = first_frames(&clip.name, &mut footage)?;
    let layout = Layout::Unknown;
    let found = |clip: &Clip, frames: &[Frame]| clip.starts(frames, StrikerPlace::Start, &layout, options);
    let opening = Opening { starts: found(&clip, &frames), frames, earlier: 0 };
    let (starts, warnings) = match clip.resized(objects, &opening, &layout, options) {
        None => opening.starts?,
        Some(Resized { objects, warnings: sizes }) => {
            let (starts, warnings) = found(&clip.with_objects(&objects)?, &opening.frames)?;
            (starts, [warnings, sizes].concat())
        }
    };
    let placed = clip.targets.iter().zip(&starts).map(|(target, start)| Placed {
        object: target.name.to_string(),
        position_m: start.pose.position,
        yaw_rad: start.pose.yaw_rad,
    });
    Ok((placed.collect(), lens_warnings(&camera).chain(warnings).collect()))
}

/// The camera's warnings about the lens in the film's own file.
fn lens_warnings(camera: &Camera) -> impl Iterator<Item = String> {
    camera.warnings.iter().filter(|warning| warning.starts_with(RECORDED_LENS)).cloned()
}

fn targets<'a>(objects: &'a [Object], names: &'a [String]) -> Result<Vec<Target<'a>>> {
    names.iter().map(|name| Ok(Target::new(name, object::find(objects, name, "detect")?))).collect()
}

/// Fraction of an outline that is visible if it has the right size, apart from shadows on it ...
const WHOLLY_VISIBLE: f64 = 0.7;
/// ... and without any.
const ALL_AROUND_VISIBLE: f64 = 0.95;
/// Number of frames, and of their pixels, within which all markers must become visible: a second of a film of 120 frames per second in
/// 1080p.
const LATEST_START: usize = 120;
const MOST_PIXELS: usize = 1 << 28;
/// Assumed interval between frames until there are two (s).
const USUAL_INTERVAL_S: f64 = 1.0 / 60.0;

/// A film, its camera and the objects to be found in it.
struct Clip<'a> {
    name: String,
    camera: &'a Camera,
    targets: Vec<Target<'a>>,
    /// The strike, if it is given.
    given: Option<GivenStrike<'a>>,
    /// Whether a record of the searches is kept.
    is_recorded: bool,
}

/// The beginning of a film.
struct Opening {
    /// The frames that were read.
    frames: Vec<Frame>,
    /// The number of frames before those in which all targets are visible.
    earlier: usize,
    /// The marker and the pose of every target in the frames after these, and warnings.
    starts: Result<(Vec<Start>, Vec<String>)>,
}

/// Objects, some with outlines of another size than the given one.
struct Resized {
    objects: Vec<Object>,
    /// A warning for each of these.
    warnings: Vec<String>,
}

/// What was found in one image.
struct Found {
    /// The marker and the pose of every target, if it was found.
    starts: Vec<Option<Start>>,
    warnings: Vec<String>,
    /// Number of blobs and outlines that may have been one of them.
    candidates: usize,
}

impl Clip<'_> {
    /// The tracks; an object without marker may have another size than the given one.
    fn explained(
        &self,
        objects: &[Object],
        frames: &mut dyn Iterator<Item = Result<Frame>>,
        layout: &Layout,
        options: &Options,
    ) -> Result<Explained> {
        let opening = self.opening(frames, layout, options)?;
        let Some(resized) = self.resized(objects, &opening, layout, options) else {
            return Ok(Explained { objects: objects.to_vec(), ..self.followed(opening, frames, options)? });
        };
        let clip = self.with_objects(&resized.objects)?;
        let mut frames = opening.frames.into_iter().map(Ok).chain(frames);
        let opening = clip.opening(&mut frames, layout, options)?;
        let mut found = clip.followed(opening, &mut frames, options)?;
        found.tracks.warnings.extend(resized.warnings);
        found.objects.clone_from(&resized.objects);
        Ok(found)
    }

    /// Reads frames until all targets are visible, but no more than [`LATEST_START`]; a marker may be covered or in a shadow at first.
    fn opening(
        &self,
        frames: &mut dyn Iterator<Item = Result<Frame>>,
        layout: &Layout,
        options: &Options,
    ) -> Result<Opening> {
        let mut read = first_frames(&self.name, frames)?;
        let most = LATEST_START.min(MOST_PIXELS / read[0].image.pixels.len().max(1));
        let mut earlier = 0;
        loop {
            let striker = if earlier > 0 { StrikerPlace::Path } else { StrikerPlace::Start };
            let starts = self.starts(&read[earlier..], striker, layout, options);
            let next = if starts.is_err() && earlier < most { frames.next() } else { None };
            let Some(frame) = next else { return Ok(Opening { frames: read, earlier, starts }) };
            earlier = read.len();
            read.push(frame?);
        }
    }

    /// The tracks, frame by frame: from the opening on, and backward in time from it through the earlier frames.
    fn followed(
        &self,
        opening: Opening,
        frames: &mut dyn Iterator<Item = Result<Frame>>,
        options: &Options,
    ) -> Result<Explained> {
        let Opening { frames: mut read, earlier, starts } = opening;
        let (starts, mut warnings) = starts?;
        let interval_s = read.get(1).map_or(USUAL_INTERVAL_S, |second| second.time_s - read[0].time_s);
        let opening = read.split_off(earlier);
        let starts: Vec<_> = self.targets.iter().cloned().zip(starts).collect();
        let tracker = || Tracker::new(self.camera, starts.clone(), options.threshold, interval_s);
        let mut motion = CameraMotion::new(self.camera);
        let mut follower = self.given.and_then(|given| Follower::new(self.camera, given, interval_s));
        let mut recorder = self.is_recorded.then(|| Recorder::new(self.camera, self.targets.len()));
        let mut done = 0;
        let mut is_done = || {
            done += 1;
            if let Some(on_frame) = options.on_frame {
                on_frame(done);
            }
        };

        // Earlier frames
        let mut cameras = Vec::with_capacity(earlier);
        for frame in &read {
            let camera = motion.follow(frame).clone();
            if let Some(follower) = &mut follower {
                follower.add(frame, &camera);
            }
            cameras.push(camera);
            is_done();
        }
        let mut mirrored = tracker();
        for (frame, camera) in read.into_iter().zip(&cameras).rev() {
            let frame = Frame { time_s: -frame.time_s, ..frame };
            let camera = if camera == self.camera { self.camera } else { camera };
            track(&mut mirrored, recorder.as_mut(), &frame, camera);
        }
        if let Some(recorder) = &mut recorder {
            recorder.mirror();
        }

        // Later frames
        let mut tracker = tracker();
        for frame in opening.into_iter().map(Ok).chain(frames) {
            let frame = frame?;
            let camera = motion.follow(&frame);
            track(&mut tracker, recorder.as_mut(), &frame, camera);
            if let Some(follower) = &mut follower {
                follower.add(&frame, camera);
            }
            is_done();
        }
        tracker.precede(mirrored);
        warnings.extend(motion.warning());
        let mut found = self.postprocessed(&tracker, recorder, warnings);
        if let Some(follower) = follower {
            let objects = &found.tracks.tracks;
            found.tracks.striker_onset_s = follower.onset_s(&self.targets, objects);
            found.tracks.striker = follower.track(&self.targets, objects);
        }
        Ok(found)
    }

    /// The tracks and the record, if one was kept.
    fn postprocessed(
        &self,
        tracker: &Tracker,
        recorder: Option<Recorder>,
        mut warnings: Vec<String>,
    ) -> Explained {
        let camera = self.camera;
        let exposure_s =
            motion_blur::exposure_s(camera, &tracker.states).or(camera.exposure_s).unwrap_or(0.0);
        let doubted = tracker.states.iter().map(|state| {
            let mut doubted = postprocess::track(camera, state, exposure_s);
            object_outline::refine(camera, state, &mut doubted);
            doubted
        });
        let (mut tracks, mut doubts): (Vec<Track>, Vec<_>) =
            doubted.map(|DoubtedTrack { track, doubts }| (track, doubts)).unzip();
        let unsmooth = postprocess::scale_noise(&mut tracks);
        for ((state, track), doubts) in tracker.states.iter().zip(&mut tracks).zip(&mut doubts) {
            postprocess::doubt_noise(camera, state, unsmooth, track, doubts);
            postprocess::doubt_jumps(track, doubts);
        }
        for track in &mut tracks {
            derivatives::fill(&mut track.samples);
        }
        let gaps = |state| postprocess::gap_warnings(camera, state, tracker.times_s());
        warnings.extend(tracker.states.iter().flat_map(gaps));
        let undetermined = self.targets.iter().filter(|t| t.is_off_centre() && !t.has_observable_yaw());
        warnings.extend(undetermined.map(|target| {
            let name = target.name;
            format!("doubtful: the marker of `{name}` is off its centroid and does not determine its yaw: if it rotates, its positions are wrong")
        }));
        for (target, track) in self.targets.iter().zip(&mut tracks) {
            let with_pose_std = |sample: &Sample| {
                let pose_std_m = camera.pose_std_m(sample.position(), target.height_m());
                sample.with_pose_std(pose_std_m.unwrap_or(0.0))
            };
            track.samples = track.samples.iter().map(with_pose_std).collect();
        }
        let finished = |recorder: Recorder| recorder.finished(&tracker.states, &tracks, &doubts);
        let (cameras, searches) = recorder.map(finished).unwrap_or_default();
        let tracks = Tracks {
            version: 1,
            video: self.name.clone(),
            reprojection_rms_px: camera.reprojection_rms_px,
            tag_width_ratio: camera.tag_width_ratio,
            camera_position_m: camera.position_m(),
            tracks,
            striker: None,
            striker_onset_s: None,
            warnings,
        };
        Explained { tracks, objects: Vec::new(), cameras, searches }
    }

    /// The marker and the pose of every target in the mean of the first frames, or of later ones, and warnings.
    fn starts(
        &self,
        opening: &[Frame],
        striker: StrikerPlace,
        layout: &Layout,
        options: &Options,
    ) -> Result<(Vec<Start>, Vec<String>)> {
        let image = mean_image(opening);
        let Found { starts, warnings, candidates } = self.found(&image, striker, layout, options)?;
        let missing: Vec<&str> = self
            .targets
            .iter()
            .zip(&starts)
            .filter(|(_, start)| start.is_none())
            .map(|(t, _)| t.name)
            .collect();
        if missing.is_empty() {
            return Ok((starts.into_iter().flatten().collect(), warnings));
        }
        Err(self.too_few(&image, candidates, &missing, layout))
    }

    /// Which targets an image shows. What looks like a marker and belongs to the striker is none.
    fn found(
        &self,
        image: &GreyImage,
        striker: StrikerPlace,
        layout: &Layout,
        options: &Options,
    ) -> Result<Found> {
        // Candidates
        let mut labeller = Labeller::default();
        let mut candidates =
            candidates::candidates(image, self.camera, &self.targets, options.threshold, &mut labeller);
        if let Some(given) = self.given {
            let covers = given.covers(self.camera, striker);
            candidates.retain(|c| !covers(c.blob.centroid));
        }
        if self.targets.iter().any(Target::is_markerless) {
            self.check_size(image, options.table)?;
            let subtracted = background::subtracted(image, options.table);
            candidates.extend(candidates::silhouettes(
                &subtracted,
                self.camera,
                &self.targets,
                &mut labeller,
            ));
            candidates.extend(association::placed_candidates(self.camera, &self.targets, layout));
        }

        // Assignment
        let (starts, warnings) = association::starts(image, self.camera, &self.targets, &candidates, layout);
        Ok(Found { starts, warnings, candidates: candidates.len() })
    }

    /// The same clip with the same names of other objects.
    fn with_objects<'o>(&'o self, objects: &'o [Object]) -> Result<Clip<'o>> {
        let target =
            |target: &Target<'o>| Ok(Target::new(target.name, object::find(objects, target.name, "detect")?));
        let targets = self.targets.iter().map(target).collect::<Result<_>>()?;
        Ok(Clip { name: self.name.clone(), targets, ..*self })
    }

    /// Whether all targets were found, and the outlines of those without markers are visible nearly all around.
    fn are_wholly_visible(&self, opening: &Opening) -> bool {
        let Ok((starts, _)) = &opening.starts else { return false };
        if !self.targets.iter().any(Target::is_markerless) {
            return true;
        }
        let image = mean_image(&opening.frames[opening.earlier..]);
        let starts: Vec<Option<Start>> = starts.iter().copied().map(Some).collect();
        let least = self.outline_fit(&image, &starts, None);
        least.is_some_and(|fit| fit.visible_fraction >= WHOLLY_VISIBLE)
    }

    /// The least visible outline of the targets without markers, of one kind if it is given; `None` if one was not found, or there are none.
    fn outline_fit(
        &self,
        image: &GreyImage,
        starts: &[Option<Start>],
        kind: Option<&str>,
    ) -> Option<OutlineFit> {
        let chosen =
            |target: &Target| target.is_markerless() && kind.is_none_or(|kind| target.object.name == kind);
        let fit = |(target, start): (&Target, &Option<Start>)| {
            OutlineView::of_target(image, self.camera, target).fitted(start.as_ref()?.pose, [0.0, 0.0])
        };
        let fits = self.targets.iter().zip(starts).filter(|(target, _)| chosen(target)).map(fit);
        let fits = fits.collect::<Option<Vec<_>>>()?;
        fits.into_iter().min_by(|a, b| a.visible_fraction.total_cmp(&b.visible_fraction))
    }

    /// The objects, those without markers with the outlines at which the first frames show them wholly; `None` if all keep their sizes.
    ///
    /// An object that is found so in the given size, or in none, keeps it.
    fn resized(
        &self,
        objects: &[Object],
        opening: &Opening,
        layout: &Layout,
        options: &Options,
    ) -> Option<Resized> {
        if self.are_wholly_visible(opening) {
            return None;
        }
        let mut resized = Resized { objects: objects.to_vec(), warnings: Vec::new() };
        let image = mean_image(&opening.frames[..MOST_FRAMES.min(opening.frames.len())]);
        let markerless = self.targets.iter().filter(|target| target.is_markerless());
        let kinds: BTreeSet<&str> = markerless.map(|target| target.object.name.as_str()).collect();
        for kind in kinds {
            let Some(number) = objects.iter().position(|object| object.name == kind) else { continue };
            let given = &objects[number];
            let fit = |factor: f64| {
                let mut scaled = objects.to_vec();
                scaled[number].shape = given.shape.scaled(factor);
                let clip = self.with_objects(&scaled).ok()?;
                let found = clip.found(&image, StrikerPlace::Start, layout, options).ok()?;
                clip.outline_fit(&image, &found.starts, Some(kind))
            };
            let in_given_size = fit(1.0);
            let least_visible = match &in_given_size {
                Some(fit) if fit.visible_fraction >= WHOLLY_VISIBLE => continue,
                // A shadow may hide a part of the right outline, and be taken for a part of a larger one.
                Some(_) => ALL_AROUND_VISIBLE,
                None => WHOLLY_VISIBLE,
            };
            let is_visible = |fit: &OutlineFit| fit.visible_fraction >= least_visible;
            let in_given_size = in_given_size.filter(is_visible);
            if let Some(factor) = outline_size::factor(in_given_size, |factor| fit(factor).filter(is_visible))
            {
                resized.objects[number].shape = given.shape.scaled(factor);
                resized.warnings.push(outline_size::warning(given, factor));
            }
        }
        Some(resized).filter(|resized| !resized.warnings.is_empty())
    }

    /// An error unless the image of the empty table has the size of the film's frames.
    fn check_size(&self, image: &GreyImage, table: Option<&GreyImage>) -> Result<()> {
        let size = |image: &GreyImage| format!("{} x {} px", image.width, image.height);
        match table {
            Some(table) if size(table) != size(image) => {
                Err(Error::invalid(&self.name, "picture of the empty table", size(table), size(image)))
            }
            _ => Ok(()),
        }
    }

    fn too_few(&self, image: &GreyImage, candidates: usize, missing: &[&str], layout: &Layout) -> Error {
        let (darkest, lightest) =
            image.pixels.iter().fold((u8::MAX, 0), |(low, high), &p| (low.min(p), high.max(p)));
        let sizes: Vec<String> = self
            .targets
            .iter()
            .filter(|t| missing.contains(&t.name))
            .map(|t| {
                let near = layout.start(t).map_or(String::new(), |start| {
                    format!(
                        " near the start that is given, x = {:.3}, y = {:.3} m",
                        start.position_m.x, start.position_m.y
                    )
                });
                format!("`{}` ({:.0} px){near}", t.name, t.projected_areas_px2(self.camera).end())
            })
            .collect();
        Error::Markers {
            clip: self.name.clone(),
            found: format!(
                "{candidates} blobs that may be markers in an image with grey levels {darkest} to {lightest}, and none of them for {}",
                sizes.join(", ")
            ),
            needed: format!(
                "{} markers (or outlines with contrast to the table), one for each of {}, of the shape and size in the objects' file",
                self.targets.len(),
                self.targets.iter().map(|t| t.name).collect::<Vec<_>>().join(", ")
            ),
        }
    }
}

/// Tracks the next frame, and records how if a record is kept.
fn track(tracker: &mut Tracker, recorder: Option<&mut Recorder>, frame: &Frame, camera: &Camera) {
    match recorder {
        Some(recorder) => recorder.track(tracker, frame, camera),
        None => tracker.track(frame, camera),
    }
}
