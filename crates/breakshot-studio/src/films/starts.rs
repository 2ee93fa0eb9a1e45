//! Where the objects of a clip are in its first frame: as a person has seen them, or as they were found; and how one looks at another pose.

use super::clips::{self, tracks};
use crate::project::Project;
use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::{Camera, Capture, Footage};
use breakshot::geometry::{Pixel, Point, Pose};
use breakshot::object::{self, Object, Shape};
use breakshot::{Error, Result};
use serde::{Deserialize, Serialize};
use std::sync::{Arc, Mutex, PoisonError};

/// An object at another place of the first frame.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SeenRequest {
    pub(crate) campaign: String,
    /// The clip's number in the campaign.
    clip: String,
    object: String,
    /// The image of its centre at its height (px), ...
    pixel: Option<[f64; 2]>,
    /// ... or its centre (m).
    position_m: Option<Point>,
    yaw_rad: f64,
}

/// An object in the first frame.
#[derive(Debug, Serialize)]
pub(crate) struct Seen {
    object: String,
    position_m: Point,
    yaw_rad: f64,
    /// Whether its outline shows its yaw.
    turns: bool,
    /// Whether a person has given this pose.
    is_given: bool,
    center_px: Pixel,
    outline_px: Vec<Pixel>,
    /// The image of a point ahead of its centre, at its yaw.
    ahead_px: Pixel,
}

/// The camera of the film that was asked for last: while an object is dragged it is not calibrated anew.
#[derive(Default)]
pub(crate) struct Cameras(Mutex<Option<Known>>);

struct Known {
    campaign: Arc<Campaign>,
    clip: String,
    camera: Arc<Camera>,
}

impl Cameras {
    /// The camera of a clip's film.
    ///
    /// # Errors
    /// A clip without a film, a film whose camera cannot be calibrated.
    fn camera(&self, campaign: &Arc<Campaign>, clip: &Clip) -> Result<Arc<Camera>> {
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*known
            && Arc::ptr_eq(&known.campaign, campaign)
            && known.clip == clip.name
        {
            return Ok(known.camera.clone());
        }
        let Source::Film(path) = &clip.source else {
            return Err(Error::invalid(&clip.name, "starts", "a clip without a film", "a film"));
        };
        let camera = Arc::new(Capture::of(Footage::open(path)?, &campaign.cell)?.camera);
        *known = Some(Known { campaign: campaign.clone(), clip: clip.name.clone(), camera: camera.clone() });
        Ok(camera)
    }

    /// All objects of a clip in its first frame.
    ///
    /// # Errors
    /// A clip without a film, a film whose camera cannot be calibrated, tracks that cannot be read.
    pub(crate) fn listed(
        &self,
        project: &Project,
        campaign: &Arc<Campaign>,
        number: &str,
    ) -> Result<Vec<Seen>> {
        let clip = clips::clip(campaign, number)?;
        let camera = self.camera(campaign, clip)?;
        let tracks = tracks(project, campaign, clip)?;
        let found = |name: &str| {
            let track = tracks.as_ref()?.tracks.iter().find(|track| track.object == name)?;
            let first = track.samples.first()?;
            Some(Pose { position: first.position(), yaw_rad: first.yaw_rad.unwrap_or(0.0) })
        };
        let seen = |(k, name): (usize, &String)| {
            let object = object::find(&campaign.objects, name, "the clip")?;
            let given = clip.starts.iter().find(|start| start.object == *name);
            let pose = match given {
                Some(start) => Pose { position: start.position_m, yaw_rad: start.yaw_rad.unwrap_or(0.0) },
                None => found(name).unwrap_or_else(|| somewhere(campaign, k, clip.objects.len())),
            };
            Ok(Seen { is_given: given.is_some(), ..seen(&camera, name, object, pose) })
        };
        clip.objects.iter().enumerate().map(seen).collect()
    }

    /// An object at another pose.
    ///
    /// # Errors
    /// As [`Cameras::listed`]; an object that is not in the clip, a place that is none.
    pub(crate) fn seen(&self, campaign: &Arc<Campaign>, request: &SeenRequest) -> Result<Seen> {
        let clip = clips::clip(campaign, &request.clip)?;
        let camera = self.camera(campaign, clip)?;
        let name = &request.object;
        if !clip.objects.contains(name) {
            let needed = clip.objects.join(", ");
            return Err(Error::invalid(&clip.name, "object", name.escape_debug(), needed));
        }
        let object = object::find(&campaign.objects, name, "the clip")?;
        let position = match (request.pixel, request.position_m) {
            (Some([x, y]), None) => camera.table_from_pixel(Pixel::new(x, y), object.height_m),
            (None, Some(position_m)) => position_m,
            _ => return Err(Error::invalid(name, "its place", "none, or two", "`pixel` or `position_m`")),
        };
        if !position.is_finite() || !request.yaw_rad.is_finite() {
            return Err(Error::invalid(name, "its place", "not on the table", "a place that the film shows"));
        }
        Ok(seen(&camera, name, object, Pose { position, yaw_rad: request.yaw_rad }))
    }
}

/// A place for an object of which nothing is known: all stand side by side in the middle of the workspace.
fn somewhere(campaign: &Campaign, k: usize, count: usize) -> Pose {
    let workspace = &campaign.cell.workspace;
    let part = (k + 1) as f64 / (count + 1) as f64;
    let at = |low: f64, high: f64, part: f64| low + part * (high - low);
    let (low, high) = (workspace.min_m, workspace.max_m);
    Pose::new(at(low.x, high.x, part), at(low.y, high.y, 0.5), 0.0)
}

fn seen(camera: &Camera, name: &str, object: &Object, pose: Pose) -> Seen {
    let pixel = |body: Point| camera.pixel_from_table(pose.table_from_body(body), object.height_m);
    Seen {
        object: name.to_owned(),
        position_m: pose.position,
        yaw_rad: pose.yaw_rad,
        turns: !matches!(object.shape, Shape::Disc { .. }),
        is_given: true,
        center_px: pixel(Point::ORIGIN),
        outline_px: object.shape.outline_points().into_iter().map(pixel).collect(),
        ahead_px: pixel(Point::new(object.shape.outer_radius_m(), 0.0)),
    }
}
