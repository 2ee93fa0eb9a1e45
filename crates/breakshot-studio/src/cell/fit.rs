//! The fit of the camera, and what is drawn onto its picture.

use super::editing::{TagPosition, edited};
use super::first_frames::FirstFrames;
use crate::pile::request::Cache;
use crate::project::Project;
use breakshot::capture::{self, Calibration, Camera, Capture, TagResidual};
use breakshot::cell::{Cell, DistortionModel, Workspace};
use breakshot::geometry::{Pixel, Point, Pose, Vec2};
use breakshot::object;
use breakshot::scene::Scene;
use breakshot::{Result, files};
use serde::{Deserialize, Serialize};

/// A film of a cell, and what the page has moved.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FitRequest {
    cell: String,
    film: String,
    /// A scene whose objects are drawn with their heights.
    scene: Option<String>,
    /// The tags that are not where the file gives them.
    #[serde(default)]
    tags: Vec<TagPosition>,
}

/// What `breakshot calibrate --json` prints of the edited cell, and its drawing.
#[derive(Serialize)]
pub(crate) struct Fit {
    calibration: Calibration,
    lens: Option<LensValues>,
    /// The height of the tags' faces above the table (m).
    tag_thickness_m: f64,
    knows_heights: bool,
    tags: Vec<DrawnTag>,
    /// Lines along the workspace's edge, of the grid, and of the axes x, y and z (px).
    workspace_px: Vec<Line>,
    grid_px: Vec<Line>,
    axes_px: Vec<(&'static str, Line)>,
    objects: Vec<DrawnObject>,
    grid_m: f64,
    axis_m: f64,
    /// Reference points instead of tags: where they were read off, and where the camera predicts them (px).
    points_px: Vec<[Option<[f64; 2]>; 2]>,
}

/// Points in the picture (px, rounded to hundredths).
type Line = Vec<[f64; 2]>;

/// The lens, as it was given or fitted.
#[derive(Serialize)]
struct LensValues {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    model: DistortionModel,
    /// Name and value of each coefficient of the distortion.
    coefficients: Vec<(&'static str, f64)>,
    /// Whether the cell's file gives it; otherwise it was fitted to the tags or read from the film.
    is_given: bool,
}

/// A tag of the cell in the picture.
#[derive(Serialize)]
struct DrawnTag {
    id: u32,
    size_m: f64,
    center_m: Point,
    yaw_rad: f64,
    center_px: Option<[f64; 2]>,
    /// Its outline on its face where the cell gives it, and on the table below it.
    outline_px: Line,
    base_px: Line,
    /// The derivatives of its position by the pixel's x and y (m / px), row by row.
    table_per_px_m: [[f64; 2]; 2],
    /// None of a tag that was not detected.
    residual: Option<TagResidual>,
}

/// An object of a scene with its height.
#[derive(Serialize)]
struct DrawnObject {
    name: String,
    height_m: f64,
    base_px: Line,
    top_px: Line,
    /// From the centre on the table to the centre at its height.
    center_px: Line,
}

/// Spacing of the grid and length of the axes (m): those of the drawing of `breakshot calibrate`.
const GRID_M: f64 = 0.05;
const AXIS_M: f64 = 0.1;
/// Largest number of grid lines per axis, for workspaces with wrong units.
const MOST_LINES: f64 = 400.0;
/// Pieces of a line, because a lens bends straight lines.
const PIECES: u32 = 24;

/// The fit of a cell's camera to the first frames of a film.
///
/// # Errors
/// Files that are not of the project or not valid, a film in which the tags are not where the cell gives them.
pub(crate) fn fitted(
    project: &Project,
    cache: &Cache,
    films: &FirstFrames,
    request: &FitRequest,
) -> Result<Fit> {
    let cell = edited(project, &request.cell, &request.tags)?.cell;
    let scene = match &request.scene {
        Some(name) => Some(cache.scene_file(project, name)?),
        None => None,
    };
    let footage = films.film(&project.file(&request.film)?)?;
    let calibration = capture::calibration(Capture::of(footage, &cell)?)?;
    let residuals = calibration.tag_residuals();
    let drawing = Drawing { camera: &calibration.camera, cell: &cell };
    Ok(Fit {
        lens: drawing.lens(),
        tag_thickness_m: calibration.camera.tag_thickness_m,
        knows_heights: calibration.camera.knows_heights(),
        tags: drawing.tags(&residuals),
        workspace_px: drawing.workspace(),
        grid_px: drawing.grid(),
        axes_px: drawing.axes(),
        objects: scene.map_or(Vec::new(), |scene| drawing.objects(&scene.0)),
        grid_m: GRID_M,
        axis_m: AXIS_M,
        points_px: drawing.points(),
        calibration,
    })
}

struct Drawing<'a> {
    camera: &'a Camera,
    cell: &'a Cell,
}

fn rounded(pixel: Pixel) -> Option<[f64; 2]> {
    let [x, y] = [pixel.x, pixel.y].map(|v| (v * 100.0).round() / 100.0);
    (x.is_finite() && y.is_finite()).then_some([x, y])
}

impl Drawing<'_> {
    fn px(&self, point: Point, height_m: f64) -> Option<[f64; 2]> {
        rounded(self.camera.pixel_from_table(point, height_m))
    }

    /// A line on the table; what is out of view is left out.
    fn line(&self, points: &[Point]) -> Line {
        let fraction = |k: u32| f64::from(k) / f64::from(PIECES);
        let pieces = points
            .windows(2)
            .flat_map(|ends| (0..=PIECES).map(move |k| ends[0] + (ends[1] - ends[0]) * fraction(k)));
        pieces.filter_map(|point| self.px(point, 0.0)).collect()
    }

    fn lens(&self) -> Option<LensValues> {
        let lens = self.camera.lens()?;
        let distortion = lens.distortion();
        let names = distortion.model().coefficient_names();
        let given = &self.cell.camera;
        Some(LensValues {
            focal_px: lens.focal_px(),
            center_px: lens.center_px(),
            model: distortion.model(),
            coefficients: names.iter().copied().zip(distortion.coefficients().iter().copied()).collect(),
            is_given: given.focal_px.is_some() || given.camera_info.is_some(),
        })
    }

    fn tags(&self, residuals: &[TagResidual]) -> Vec<DrawnTag> {
        let face_m = self.camera.tag_thickness_m;
        let drawn = |tag: &breakshot::cell::Tag| {
            let [a, b, c, d] = tag.corners_m();
            let outline = |height_m: f64| [a, b, c, d].iter().filter_map(|&p| self.px(p, height_m)).collect();
            let center_px = self.camera.pixel_from_table(tag.center_m, face_m);
            DrawnTag {
                id: tag.id,
                size_m: tag.size_m,
                center_m: tag.center_m,
                yaw_rad: tag.yaw_rad,
                center_px: rounded(center_px),
                outline_px: outline(face_m),
                base_px: outline(0.0),
                table_per_px_m: self.camera.table_per_pixel_m(center_px, face_m),
                residual: residuals.iter().find(|residual| residual.id == tag.id).cloned(),
            }
        };
        self.cell.tags.iter().map(drawn).collect()
    }

    fn workspace(&self) -> Vec<Line> {
        let Workspace { min_m, max_m } = self.cell.workspace;
        let (right, left) = (Point::new(max_m.x, min_m.y), Point::new(min_m.x, max_m.y));
        vec![self.line(&[min_m, right, max_m, left, min_m])]
    }

    fn grid(&self) -> Vec<Line> {
        let Workspace { min_m, max_m } = self.cell.workspace;
        let steps = |from: f64, to: f64| {
            let first = (from / GRID_M).ceil();
            let last = (to / GRID_M).floor().min(first + MOST_LINES);
            (0..).map(move |k| first + f64::from(k)).take_while(move |k| *k <= last).map(|k| k * GRID_M)
        };
        let up = steps(min_m.x, max_m.x).map(|x| [Point::new(x, min_m.y), Point::new(x, max_m.y)]);
        let across = steps(min_m.y, max_m.y).map(|y| [Point::new(min_m.x, y), Point::new(max_m.x, y)]);
        up.chain(across).map(|ends| self.line(&ends)).collect()
    }

    fn axes(&self) -> Vec<(&'static str, Line)> {
        let along = |axis: Vec2| self.line(&[Point::ORIGIN, Point::ORIGIN + axis]);
        let mut axes = vec![("x", along(Vec2::new(AXIS_M, 0.0))), ("y", along(Vec2::new(0.0, AXIS_M)))];
        if self.camera.knows_heights() {
            let up = [0.0, AXIS_M].iter().filter_map(|&z| self.px(Point::ORIGIN, z)).collect();
            axes.push(("z", up));
        }
        axes
    }

    /// The objects where the scene places them, from the table to their height.
    fn objects(&self, scene: &Scene) -> Vec<DrawnObject> {
        let drawn = |placed: &breakshot::scene::Placed| {
            let object = object::find(&scene.objects, &placed.object, "the scene").ok()?;
            let pose = Pose { position: placed.position_m, yaw_rad: placed.yaw_rad };
            let outline: Vec<Point> =
                object.shape.outline_points().into_iter().map(|point| pose.table_from_body(point)).collect();
            let at = |height_m: f64| outline.iter().filter_map(|&point| self.px(point, height_m)).collect();
            let center = [0.0, object.height_m];
            Some(DrawnObject {
                name: placed.object.clone(),
                height_m: object.height_m,
                base_px: at(0.0),
                top_px: at(object.height_m),
                center_px: center.iter().filter_map(|&z| self.px(placed.position_m, z)).collect(),
            })
        };
        scene.placed.iter().filter_map(drawn).collect()
    }

    fn points(&self) -> Vec<[Option<[f64; 2]>; 2]> {
        let points = self.cell.points.iter().filter(|_| self.cell.tags.is_empty());
        points.map(|point| [rounded(point.image_px), self.px(point.table_m, 0.0)]).collect()
    }
}

/// The cell of a file as it is.
///
/// # Errors
/// A file that is not of the project or not valid.
pub(crate) fn cell(project: &Project, name: &str) -> Result<Cell> {
    let path = project.file(name)?;
    project.check_cell(&path)?;
    files::load_cell(path)
}
