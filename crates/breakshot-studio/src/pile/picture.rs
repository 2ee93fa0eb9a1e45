//! A pile from a picture: its scene, and the picture itself beneath the table's drawing.

use super::request::Cache;
use super::save::{is_new_scene, project_path};
use crate::project::Project;
use breakshot::campaign::named_objects;
use breakshot::capture::{self, Camera, Capture, Footage, GreyImage, PngEffort};
use breakshot::cell::Workspace;
use breakshot::files::{self, SceneFile};
use breakshot::geometry::Point;
use breakshot::geometry::outline::Outline;
use breakshot::{Error, Result, detect};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A picture of a pile.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PictureRequest {
    cell: String,
    objects: String,
    /// A picture, or a film whose first frames are taken.
    picture: String,
    /// The objects in it.
    names: Vec<String>,
    /// The scene file to write.
    output: String,
}

/// The objects of a file in the name of a picture.
///
/// # Errors
/// A file that is not of the project, or holds no objects.
pub(crate) fn drafted(project: &Project, objects: &str, picture: &str) -> Result<Vec<String>> {
    let known = files::load_objects(project.file(objects)?)?.value;
    let names: Vec<String> = known.into_iter().map(|object| object.name).collect();
    let stem = Path::new(picture).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(named_objects(&stem, &names))
}

/// A scene that was taken from a picture.
#[derive(Debug, Serialize)]
pub(crate) struct Taken {
    file: String,
    warnings: Vec<String>,
}

/// Writes the scene that `breakshot look` writes of a picture; a file that exists is not replaced.
///
/// # Errors
/// Files that are not of the project or not valid, a picture in which the tags or the objects are not found, a name that is taken.
pub(crate) fn taken(project: &Project, request: &PictureRequest) -> Result<Taken> {
    let PictureRequest { cell, objects, picture, names, output } = request;
    let path = is_new_scene(project, output)?;
    let cell_file = project.file(cell)?;
    project.check_cell(&cell_file)?;
    let known = files::load_objects(project.file(objects)?)?.value;
    let film = project.file(picture)?;
    if names.is_empty() {
        return Err(Error::invalid(picture, "objects", "none", "the names of the objects in the picture"));
    }
    let capture = Capture::of(Footage::open(&film)?, &files::load_cell(&cell_file)?)?;
    let (placed, warnings) = detect::placed(capture, &known, names, &detect::Options::default())?;
    let observed_unix_s = capture::recorded_unix_s(&film);
    let scene = SceneFile::of_picture(cell.into(), objects.into(), placed, observed_unix_s);
    let unwritable =
        |e: toml::ser::Error| Error::Write { path: project_path(output), source: std::io::Error::other(e) };
    files::write_whole(&path, toml::to_string(&scene).map_err(unwritable)?.as_bytes())?;
    Ok(Taken { file: output.clone(), warnings })
}

/// Pixels along the longer side of the workspace: about one for each pixel of the picture.
const PIXELS: f64 = 1400.0;

/// The workspace of a scene from above, as the first frame of a picture or film shows it (PNG): inside the outline of an object at the
/// object's height, elsewhere at that of the table.
///
/// # Errors
/// Files that are not of the project or not valid, a picture in which the tags are not found.
pub(crate) fn beneath(project: &Project, cache: &Cache, scene: &str, picture: &str) -> Result<Vec<u8>> {
    let scene = &cache.scene_file(project, scene)?.0;
    let path = project.file(picture)?;
    let mut capture = Capture::of(Footage::open(&path)?, &scene.cell)?;
    let unseen = |found: &str| Error::video(&path, found.to_owned(), "a picture of the cell");
    let frame = capture.footage.next().transpose()?.ok_or_else(|| unseen("no frame"))?;
    let mut ground = Ground::new(scene.cell.workspace, &capture.camera, &frame.image);
    ground.fill([scene.cell.workspace.min_m, scene.cell.workspace.max_m], 0.0, |_| true);
    for placed in &scene.placed {
        let object = scene.object(&placed.object)?;
        let outline = Outline::new(&object.shape, placed.pose());
        let reach_m = object.shape.outer_radius_m();
        let Point { x, y } = placed.position_m;
        let around = [Point::new(x - reach_m, y - reach_m), Point::new(x + reach_m, y + reach_m)];
        ground.fill(around, object.height_m, |point| outline.contains(point));
    }
    ground.image.png(PngEffort::Fast).ok_or_else(|| unseen("a picture that cannot be shown"))
}

/// A picture seen from above.
struct Ground<'a> {
    workspace: Workspace,
    camera: &'a Camera,
    seen: &'a GreyImage,
    pixels_per_m: f64,
    image: GreyImage,
}

impl<'a> Ground<'a> {
    fn new(workspace: Workspace, camera: &'a Camera, seen: &'a GreyImage) -> Self {
        let (x, y) = (workspace.max_m.x - workspace.min_m.x, workspace.max_m.y - workspace.min_m.y);
        let pixels_per_m = PIXELS / x.max(y);
        let [width, height] = [x, y].map(|side| (side * pixels_per_m).round().max(1.0) as usize);
        let image = GreyImage { width, height, pixels: vec![0; width * height] };
        Self { workspace, camera, seen, pixels_per_m, image }
    }

    /// Fills what `is_inside` of a rectangle with the picture at a height; what the picture does not show stays as it is.
    fn fill(&mut self, [low, high]: [Point; 2], height_m: f64, is_inside: impl Fn(Point) -> bool) {
        let Workspace { min_m, max_m } = self.workspace;
        let index = |offset_m: f64, most: usize| ((offset_m * self.pixels_per_m).max(0.0) as usize).min(most);
        let columns = index(low.x - min_m.x, self.image.width)
            ..index(high.x - min_m.x + 1.0 / self.pixels_per_m, self.image.width);
        let rows = index(max_m.y - high.y, self.image.height)
            ..index(max_m.y - low.y + 1.0 / self.pixels_per_m, self.image.height);
        for row in rows {
            for column in columns.clone() {
                let along = |k: usize| (k as f64 + 0.5) / self.pixels_per_m;
                let point = Point::new(min_m.x + along(column), max_m.y - along(row));
                if !is_inside(point) {
                    continue;
                }
                if let Some(grey) = self.seen.grey_at(self.camera.pixel_from_table(point, height_m)) {
                    self.image.pixels[row * self.image.width + column] = grey.round() as u8;
                }
            }
        }
    }
}
