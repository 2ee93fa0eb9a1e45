//! What a lens that `breakshot lens` calibrates costs on the table: `cargo xtask validate corners LAB`.
//!
//! The lab's `board.py` films boards through the lens of the lab's own camera (`peers/lab_board.py`). With each lens that is calibrated from such a film
//! a film of the campaign is tracked again, and the corners of pictures of the cell's tags are mapped onto the table; the cell's own lens is the truth.

use crate::example::target;
use crate::validate::films::{self, Differences};
use crate::validate::row::{Row, print_all, rms};
use crate::venv;
use breakshot::campaign::Campaign;
use breakshot::capture::{Camera, Capture, Footage, Frame, Lens, lens_calibration};
use breakshot::cell::{CameraSpec, Cell, DistortionModel, Transform};
use breakshot::detect::Tracks;
use breakshot::files;
use breakshot::geometry::{Pixel, Point};
use breakshot::synthetic::film::{Thing, View, film};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What board.py imports.
const PACKAGES: [&str; 3] = ["numpy", "scipy", "opencv-python-headless==5.0.0.93"];
/// Seeds of the films of boards, whose length and rate are those of a person who moves a board for ten seconds.
const SEEDS: [u64; 3] = [1, 2, 3];
const LENGTH: [&str; 4] = ["--seconds", "10", "--fps", "8"];
/// Tilts of the camera (degrees) from which the tags are drawn, and its distance from the middle of the table (m), that of the lab's camera.
const TILTS_DEG: [f64; 3] = [0.0, 8.0, 20.0];
const DISTANCE_M: f64 = 1.35;
/// Noise of the drawn pictures (grey levels), that of the lab's camera.
const NOISE: f64 = 2.5;
/// Largest displacement on the table that the lens may cause (mm).
const MOST_MM: f64 = 0.1;
/// Pixels for each axis of the picture inside which the mean displacement is measured.
const COMPARED: usize = 9;

/// What one calibrated lens costs.
#[derive(Default)]
struct Cost {
    tracks_mm: f64,
    /// At the corners of the picture, for each tilt.
    corners_mm: [f64; TILTS_DEG.len()],
    /// Root mean square over the picture, for each tilt.
    picture_mm: [f64; TILTS_DEG.len()],
    focal_px: f64,
    center_px: f64,
}

/// Calibrates the lab's lens from films of boards; whether every target holds.
pub(crate) fn validate(lab: &Path) -> Result<bool, String> {
    let python = venv::python("board", &PACKAGES)?;
    let campaign = files::load_campaign(lab.join("campaign/campaign.toml")).map_err(|e| e.to_string())?.value;
    let truth = Reference::new(&campaign)?;
    let mut costs = Vec::new();
    for seed in SEEDS {
        let film = filmed(&python, lab, seed)?;
        let board = files::load_board(film.with_extension("board.json")).map_err(|e| e.to_string())?;
        let found = lens_calibration(&|| Footage::open(&film), &board, DistortionModel::PlumbBob)
            .map_err(|e| e.to_string())?;
        let cost = truth.cost(found.lens())?;
        println!(
            "seed {seed}: focal length {:.3} px off, centre {:.3} px, tracks {:.4} mm, corners {:.4?} mm",
            cost.focal_px, cost.center_px, cost.tracks_mm, cost.corners_mm
        );
        costs.push(cost);
    }
    let worst = |of: &dyn Fn(&Cost) -> f64| costs.iter().map(of).fold(0.0, f64::max);
    let mut rows = vec![
        Row::plain("largest error of a focal length", worst(&|cost| cost.focal_px), "px"),
        Row::plain("largest error of a centre", worst(&|cost| cost.center_px), "px"),
        Row::at_most("largest difference of a track", worst(&|cost| cost.tracks_mm), MOST_MM, "mm"),
    ];
    for (k, tilt_deg) in TILTS_DEG.iter().enumerate() {
        let what = |part: &str| format!("{part}, camera tilted by {tilt_deg} degrees");
        let corners = worst(&|cost| cost.corners_mm[k]);
        rows.push(Row::at_most(what("largest displacement of a corner"), corners, MOST_MM, "mm"));
        rows.push(Row::plain(what("  rms over the picture"), worst(&|cost| cost.picture_mm[k]), "mm"));
    }
    Ok(print_all("The lab's own lens, calibrated from films of boards", &rows))
}

/// The film of a board through the lab's lens.
fn filmed(python: &Path, lab: &Path, seed: u64) -> Result<PathBuf, String> {
    let folder = target().join("validate/lab_boards");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let film = folder.join(format!("{seed}.mp4"));
    let mut command = Command::new(python);
    command.arg("xtask/peers/lab_board.py").arg(lab).arg(lab.join("campaign_spec.json"));
    venv::succeed(command.arg(seed.to_string()).arg(&film).args(LENGTH))?;
    Ok(film)
}

/// What the true lens gives.
struct Reference<'a> {
    campaign: &'a Campaign,
    lens: Lens,
    size_px: [usize; 2],
    tracks: Tracks,
    cameras: Vec<(Vec<Frame>, Camera)>,
}

impl<'a> Reference<'a> {
    fn new(campaign: &'a Campaign) -> Result<Self, String> {
        let CameraSpec { image_size_px, focal_px, center_px, distortion, .. } = &campaign.cell.camera;
        let (Some(size_px), Some(focal_px), Some(center_px), Some(distortion)) =
            (image_size_px, focal_px, center_px, distortion)
        else {
            return Err(
                "the lab's cell has no lens; needed: the size of the picture and the whole lens".into()
            );
        };
        let size_px = size_px.map(|size| size as usize);
        let coefficients: [f64; 5] =
            distortion[..].try_into().map_err(|_| "needed: five coefficients of the lab's lens")?;
        let lens = Lens::new(*focal_px, *center_px, coefficients);
        let camera = |tilt_deg: &f64| {
            let tilt_rad = tilt_deg.to_radians();
            // It looks at the middle of the table.
            let position_m = [0.0, -DISTANCE_M * tilt_rad.sin(), DISTANCE_M * tilt_rad.cos()];
            let at = Transform { position_m, rpy_rad: [tilt_rad, 0.0, 0.0] };
            let view = View { noise: NOISE, ..View::new(Camera::new(size_px, lens.clone(), at)) };
            let frames =
                film(&view, &[0.0, 0.1, 0.2], |_| campaign.cell.tags.iter().map(Thing::tag).collect());
            let seen = seen(&frames, &campaign.cell)?;
            Ok((frames, seen))
        };
        let cameras = TILTS_DEG.iter().map(camera).collect::<Result<_, String>>()?;
        let tracks = tracks(campaign)?;
        Ok(Self { campaign, lens, size_px, tracks, cameras })
    }

    fn cost(&self, found: &Lens) -> Result<Cost, String> {
        let campaign = with_lens(self.campaign, found);
        let mut differences = Differences::default();
        differences.add(&tracks(&campaign)?, &self.tracks);
        let mut cost = Cost { tracks_mm: differences.largest_mm, ..Cost::default() };
        let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        cost.focal_px = apart(found.focal_px(), self.lens.focal_px());
        cost.center_px = apart(found.center_px(), self.lens.center_px());
        for (k, (frames, truth)) in self.cameras.iter().enumerate() {
            let camera = seen(frames, &campaign.cell)?;
            let off_mm = |pixel: Pixel| {
                let on_table = |camera: &Camera| camera.table_from_pixel(pixel, 0.0);
                1e3 * Point::distance(on_table(&camera), on_table(truth))
            };
            let at =
                |k: usize, axis: usize| k as f64 / (COMPARED - 1) as f64 * (self.size_px[axis] as f64 - 1.0);
            let pixel = |x: usize, y: usize| Pixel::new(at(x, 0), at(y, 1));
            let last = COMPARED - 1;
            let corners = [(0, 0), (last, 0), (last, last), (0, last)].map(|(x, y)| off_mm(pixel(x, y)));
            cost.corners_mm[k] = corners.into_iter().fold(0.0, f64::max);
            let all: Vec<f64> =
                (0..COMPARED * COMPARED).map(|k| off_mm(pixel(k % COMPARED, k / COMPARED))).collect();
            cost.picture_mm[k] = rms(&all);
        }
        Ok(cost)
    }
}

/// The camera of these frames, as the cell's lens gives it.
fn seen(frames: &[Frame], cell: &Cell) -> Result<Camera, String> {
    let footage = Footage::from_frames("drawn tags", frames.to_vec());
    Capture::of(footage, cell).map(|capture| capture.camera).map_err(|e| e.to_string())
}

/// The same campaign in a cell with another lens.
fn with_lens(campaign: &Campaign, lens: &Lens) -> Campaign {
    let camera = CameraSpec {
        focal_px: Some(lens.focal_px()),
        center_px: Some(lens.center_px()),
        distortion: Some(lens.distortion().coefficients().to_vec()),
        distortion_model: Some(lens.distortion().model()),
        ..campaign.cell.camera.clone()
    };
    Campaign { cell: Cell { camera, ..campaign.cell.clone() }, ..campaign.clone() }
}

/// The tracks of the campaign's first film.
fn tracks(campaign: &Campaign) -> Result<Tracks, String> {
    let clip = campaign.clips.first().ok_or("the lab's campaign has no clips")?;
    films::tracks(campaign, clip)
}
