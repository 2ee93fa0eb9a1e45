//! Where was each object at each instant?
//!
//! Section 4 of the paper: every frame becomes a binary image, its 8-connected components become blobs with area and
//! centroid, blobs of the markers' size become tracks that keep their object's identity through the whole clip.

mod assignment;
mod bits;
mod blob;
mod contour;
mod dot;
mod follower;
mod ground;
mod identity;
pub mod label;
mod marker;
mod markerless;
mod motion;
mod outline;
mod review;
mod strip;
#[cfg(test)]
mod tests;
mod threshold;
mod track;

use crate::capture::{Camera, Capture, Frame, GreyImage};
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::object::{self, Object};
use crate::scene::Placed;
use identity::Start;
use label::Labeller;
use marker::Target;
use serde::{Deserialize, Serialize};
use track::Tracker;

/// Where every object of a clip was, frame by frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    /// The file format's version.
    pub version: u32,
    /// The film.
    pub video: String,
    /// How well the camera's pose explains the tags (px, root mean square).
    pub reprojection_rms_px: f64,
    /// One track per object, in the order asked for.
    pub tracks: Vec<Track>,
    /// What the user should know.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// One object through the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// The object; `a#2` for the second copy.
    pub object: String,
    /// In order of time; frames in which the marker was not seen are missing.
    pub samples: Vec<Sample>,
}

/// One object in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Presentation time (s).
    pub time_s: f64,
    /// The object's centroid on the table (m).
    pub x_m: f64,
    /// The object's centroid on the table (m).
    pub y_m: f64,
    /// How it is turned (rad, continuous over time); unknown where the marker cannot tell.
    pub yaw_rad: Option<f64>,
    /// Velocity (m/s), for display: estimation fits positions.
    pub vx_m_s: Option<f64>,
    /// Velocity (m/s), for display.
    pub vy_m_s: Option<f64>,
    /// Rate of turn (rad/s), for display.
    pub yaw_rate_rad_s: Option<f64>,
    /// Acceleration (m/s2), for display.
    pub ax_m_s2: Option<f64>,
    /// Acceleration (m/s2), for display.
    pub ay_m_s2: Option<f64>,
    /// One standard deviation of the position's noise along each axis (m).
    pub std_m: f64,
    /// Whether something (the striker's arm, a shadow, another marker) may have spoilt the position.
    #[serde(default)]
    pub doubtful: bool,
}

impl Sample {
    /// The object's centroid.
    pub fn position(&self) -> Point {
        Point::new(self.x_m, self.y_m)
    }
}

/// What is known about which marker belongs to which object.
#[derive(Clone, Debug, PartialEq)]
pub enum Layout {
    /// Nothing: marker shapes and object outlines must tell.
    Unknown,
    /// The struck object comes first along the strike, the others in their order behind it.
    AlongStrike {
        /// The strike's direction (rad).
        heading_rad: f64,
        /// Where the striker's centre starts, if known.
        start_m: Option<Point>,
    },
    /// Each object lay here when the clip began.
    Placed(Vec<Placed>),
}

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
    let opening = clip.opening(&mut footage)?;
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

/// The first frames are averaged against noise, as long as nothing moves.
const OPENING_FRAMES: usize = 5;
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
        let mut opening = self.opening(frames)?;
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
        let exposure_s = review::exposure_s(camera, &tracker.followers).or(camera.exposure_s).unwrap_or(0.0);
        let mut tracks: Vec<Track> =
            tracker.followers.iter().map(|follower| review::track(camera, follower, exposure_s)).collect();
        review::scale_noise(&mut tracks);
        for track in &mut tracks {
            motion::fill(&mut track.samples);
        }
        warnings.extend(tracker.followers.iter().flat_map(|f| review::gaps(camera, f, tracker.times_s())));
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

    /// The first frames, as long as they show the same.
    fn opening(&self, frames: &mut dyn Iterator<Item = Result<Frame>>) -> Result<Vec<Frame>> {
        let first = frames.next().ok_or_else(|| Error::Markers {
            clip: self.name.clone(),
            found: "no frame".into(),
            needed: "a film or a picture".into(),
        })??;
        let mut opening = vec![first];
        while opening.len() < OPENING_FRAMES {
            let Some(frame) = frames.next() else { break };
            let frame = frame?;
            let still = same_picture(&opening[0].image, &frame.image);
            opening.push(frame);
            if !still {
                break;
            }
        }
        Ok(opening)
    }

    /// Where every target is in the first frames.
    fn starts(
        &self,
        opening: &[Frame],
        layout: &Layout,
        options: &Options,
    ) -> Result<(Vec<Start>, Vec<String>)> {
        let image = mean(opening);
        let mut labeller = Labeller::default();
        let mut candidates =
            threshold::candidates(&image, self.camera, &self.targets, options.threshold, &mut labeller);
        if self.targets.iter().any(Target::markerless) {
            self.check_table(&image, options.table)?;
            let levelled = ground::levelled(&image, options.table);
            candidates.extend(threshold::outlines(&levelled, self.camera, &self.targets, &mut labeller));
            candidates.extend(identity::outlines_placed(self.camera, &self.targets, layout));
        }
        let (starts, warnings) = identity::starts(&image, self.camera, &self.targets, &candidates, layout);
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
/// Blocks of this side (px) are compared by their means, which noise leaves within a level or two.
const STILL_BLOCK_PX: usize = 16;
const STILL_LEVELS: u32 = 6;

fn same_picture(one: &GreyImage, other: &GreyImage) -> bool {
    let rows = one.pixels.chunks_exact(one.width).zip(other.pixels.chunks_exact(other.width));
    rows.step_by(STILL_BLOCK_PX).all(|(a, b)| {
        a.chunks_exact(STILL_BLOCK_PX).zip(b.chunks_exact(STILL_BLOCK_PX)).all(|(a, b)| {
            let sum = |row: &[u8]| row.iter().map(|&p| u32::from(p)).sum::<u32>();
            sum(a).abs_diff(sum(b)) < STILL_LEVELS * STILL_BLOCK_PX as u32
        })
    })
}

/// The mean picture of all frames but a last one that differs.
fn mean(frames: &[Frame]) -> GreyImage {
    let first = &frames[0].image;
    let still = frames.iter().take_while(|f| same_picture(first, &f.image)).count().max(1);
    let mut sums = vec![(still / 2) as u16; first.pixels.len()];
    for frame in &frames[..still] {
        for (sum, &p) in sums.iter_mut().zip(&frame.image.pixels) {
            *sum += u16::from(p);
        }
    }
    // Whole numbers this small are divided exactly, and many at a time.
    let count = still as f32;
    GreyImage { pixels: sums.into_iter().map(|sum| (f32::from(sum) / count) as u8).collect(), ..*first }
}
