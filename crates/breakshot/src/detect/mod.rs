//! Where was each object at each instant?
//!
//! Section 4 of the paper: every frame becomes a binary image, its 8-connected components become blobs with area and
//! centroid, blobs of the markers' size become tracks that keep their object's identity through the whole clip.

mod assignment;
mod association;
mod candidates;
mod derivatives;
pub mod label;
mod marker;
mod markerless;
mod opening;
mod postprocess;
#[cfg(test)]
mod tests;
mod threshold;
mod track;
mod track_state;
mod tracks;

pub use association::Layout;
pub use tracks::{Sample, Track, Tracks};

use crate::capture::{Camera, Capture, Frame, GreyImage};
use crate::error::{Error, Result};
use crate::object::{self, Object};
use crate::scene::Placed;
use association::Start;
use label::Labeller;
use marker::target::Target;
use markerless::background;
use track::Tracker;

/// How to look.
#[derive(Clone, Copy, Default)]
pub struct Options<'a> {
    /// The grey level that separates marker from object, instead of each marker's own.
    pub threshold: Option<u8>,
    /// A picture of the empty table, which helps to find objects without markers.
    pub table: Option<&'a GreyImage>,
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
/// # Errors
/// A film that breaks off, fewer markers than objects, markers that cannot be told apart.
pub fn tracks(
    capture: Capture,
    objects: &[Object],
    names: &[String],
    layout: &Layout,
    options: &Options,
) -> Result<Tracks> {
    let Capture { mut footage, camera, .. } = capture;
    let clip = Clip { name: footage.name().to_string(), camera: &camera, targets: targets(objects, names)? };
    let mut tracks = clip.tracks(&mut footage, layout, options)?;
    tracks.warnings.splice(0..0, footage.warnings().iter().cloned());
    Ok(tracks)
}

/// What lies on the table in the film's first frames (or in a picture): one pose for each of `names`.
///
/// Also gives what is doubtful about it.
///
/// # Errors
/// As [`tracks`].
pub fn placed(
    capture: Capture,
    objects: &[Object],
    names: &[String],
    options: &Options,
) -> Result<(Vec<Placed>, Vec<String>)> {
    let Capture { mut footage, camera, .. } = capture;
    let clip = Clip { name: footage.name().to_string(), camera: &camera, targets: targets(objects, names)? };
    let opening = opening::opening(&clip.name, &mut footage)?;
    let (starts, warnings) = clip.starts(&opening, &Layout::Unknown, options)?;
    let placed = clip.targets.iter().zip(&starts).map(|(target, start)| Placed {
        object: target.name.to_string(),
        position_m: start.pose.position,
        yaw_rad: start.pose.yaw_rad,
    });
    Ok((placed.collect(), warnings))
}

fn targets<'a>(objects: &'a [Object], names: &'a [String]) -> Result<Vec<Target<'a>>> {
    names.iter().map(|name| Ok(Target::new(name, object::find(objects, name, "detect")?))).collect()
}

/// The tags of a camera that stands still are seen again within some hundredths of a pixel.
const MOVED_PX: f64 = 0.5;
/// How long to wait for markers that are covered when the clip begins (frames).
const LATEST_START: usize = 30;

/// A film, the camera that took it and what is looked for in it.
struct Clip<'a> {
    name: String,
    camera: &'a Camera,
    targets: Vec<Target<'a>>,
}

impl Clip<'_> {
    fn tracks(
        &self,
        frames: &mut dyn Iterator<Item = Result<Frame>>,
        layout: &Layout,
        options: &Options,
    ) -> Result<Tracks> {
        let mut opening = opening::opening(&self.name, frames)?;
        let mut skipped = 0;
        let (starts, mut warnings) = loop {
            match self.starts(&opening, layout, options) {
                Ok(found) => break found,
                // A marker may be covered at first; if it never shows, the first frame's error stands.
                Err(error) => match frames.next() {
                    Some(frame) if skipped < LATEST_START => {
                        skipped += opening.len();
                        opening = vec![frame?];
                    }
                    _ => return Err(error),
                },
            }
        };
        if skipped > 0 {
            let from_s = opening[0].time_s;
            warnings.push(format!("not all markers show before {from_s:.3} s: the tracks begin there"));
        }
        let interval_s = opening.get(1).map_or(USUAL_INTERVAL_S, |second| second.time_s - opening[0].time_s);
        let starts = self.targets.iter().cloned().zip(starts).collect();
        let mut tracker = Tracker::new(self.camera, starts, options.threshold, interval_s);
        let mut done = skipped;
        let mut last = None;
        for frame in opening.into_iter().map(Ok).chain(frames) {
            let frame = frame?;
            tracker.follow(&frame);
            last = Some(frame);
            done += 1;
            if let Some(on_frame) = options.on_frame {
                on_frame(done);
            }
        }
        warnings.extend(last.and_then(|frame| self.moved(&frame)));
        Ok(self.reviewed(&tracker, warnings))
    }

    /// A word if the camera does not stand where it stood when the clip began.
    fn moved(&self, last: &Frame) -> Option<String> {
        let shift_px = self.camera.shift_px(&last.image).filter(|&shift_px| shift_px > MOVED_PX)?;
        Some(format!("the camera moved by {shift_px:.1} px during the clip; needed: one that stands still"))
    }

    fn reviewed(&self, tracker: &Tracker, mut warnings: Vec<String>) -> Tracks {
        let camera = self.camera;
        let exposure_s =
            postprocess::exposure_s(camera, &tracker.followers).or(camera.exposure_s).unwrap_or(0.0);
        let mut tracks: Vec<Track> = tracker
            .followers
            .iter()
            .map(|follower| postprocess::track(camera, follower, exposure_s))
            .collect();
        postprocess::scale_noise(&mut tracks);
        for track in &mut tracks {
            derivatives::fill(&mut track.samples);
        }
        warnings
            .extend(tracker.followers.iter().flat_map(|f| postprocess::gaps(camera, f, tracker.times_s())));
        warnings.extend(self.targets.iter().filter(|t| t.off_centre() && !t.tells_yaw()).map(|t| {
            let name = t.name;
            format!("doubtful: the marker of `{name}` lies off its centroid and cannot tell how it turns: if it turns, its positions are wrong")
        }));
        Tracks {
            version: 1,
            video: self.name.clone(),
            reprojection_rms_px: camera.reprojection_rms_px,
            tracks,
            warnings,
        }
    }

    /// Where every target is in the first frames.
    fn starts(
        &self,
        opening: &[Frame],
        layout: &Layout,
        options: &Options,
    ) -> Result<(Vec<Start>, Vec<String>)> {
        let image = opening::mean(opening);
        let mut labeller = Labeller::default();
        let mut candidates =
            candidates::candidates(&image, self.camera, &self.targets, options.threshold, &mut labeller);
        if self.targets.iter().any(Target::markerless) {
            self.check_table(&image, options.table)?;
            let levelled = background::levelled(&image, options.table);
            candidates.extend(candidates::outlines(&levelled, self.camera, &self.targets, &mut labeller));
            candidates.extend(association::outlines_placed(self.camera, &self.targets, layout));
        }
        let (starts, warnings) = association::starts(&image, self.camera, &self.targets, &candidates, layout);
        let lost: Vec<&str> = self
            .targets
            .iter()
            .zip(&starts)
            .filter(|(_, start)| start.is_none())
            .map(|(t, _)| t.name)
            .collect();
        if lost.is_empty() {
            return Ok((starts.into_iter().flatten().collect(), warnings));
        }
        Err(self.too_few(&image, candidates.len(), &lost))
    }

    fn check_table(&self, image: &GreyImage, table: Option<&GreyImage>) -> Result<()> {
        let size = |image: &GreyImage| format!("{} x {} px", image.width, image.height);
        match table {
            Some(table) if size(table) != size(image) => {
                Err(Error::invalid(&self.name, "picture of the empty table", size(table), size(image)))
            }
            _ => Ok(()),
        }
    }

    fn too_few(&self, image: &GreyImage, candidates: usize, lost: &[&str]) -> Error {
        let (darkest, lightest) =
            image.pixels.iter().fold((u8::MAX, 0), |(low, high), &p| (low.min(p), high.max(p)));
        let sizes: Vec<String> = self
            .targets
            .iter()
            .filter(|t| lost.contains(&t.name))
            .map(|t| format!("`{}` ({:.0} px)", t.name, t.areas_px2(self.camera).end()))
            .collect();
        Error::Markers {
            clip: self.name.clone(),
            found: format!(
                "{candidates} blobs that may be markers in a picture of grey levels {darkest} to {lightest}, none left for {}",
                sizes.join(", ")
            ),
            needed: format!(
                "{} markers (or outlines that stand out from the table), one for each of {}, of the shape and size that the objects' file gives",
                self.targets.len(),
                self.targets.iter().map(|t| t.name).collect::<Vec<_>>().join(", ")
            ),
        }
    }
}

/// Until a second frame tells (s).
const USUAL_INTERVAL_S: f64 = 1.0 / 60.0;
