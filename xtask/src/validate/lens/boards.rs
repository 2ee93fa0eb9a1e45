//! Lenses calibrated from films of boards with known truth: `cargo xtask validate boards FILMS`.
//!
//! FILMS is a folder of films as `lab/board.py` makes them (`NAME.mp4`, `NAME.truth.json`, `NAME.board.json`). The corners that
//! are fitted are also given to `cv2.calibrateCamera` (`peers/opencv_boards.py`). Truth is read for measuring only.

use crate::example::target;
use crate::validate::row::{Row, median, print_all};
use crate::venv;
use breakshot::capture::{Footage, Lens, LensCalibration, lens_calibration};
use breakshot::cell::DistortionModel;
use breakshot::files;
use breakshot::geometry::Pixel;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// What the film was drawn with.
#[derive(Deserialize)]
struct Truth {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
}

/// What OpenCV finds.
#[derive(Deserialize)]
struct Peer {
    focal_px: [f64; 2],
    center_px: [f64; 2],
    distortion: [f64; 5],
    rms_px: f64,
}

/// One film's result.
struct Measured {
    focal: f64,
    map_px: f64,
    rms_px: f64,
    /// Parameters inside their intervals, and all.
    inside: [usize; 2],
    peer_focal: f64,
    peer_map_px: f64,
    peer_rms_px: f64,
    frames: usize,
    wall_s: f64,
}

/// Number of pixels per axis at which maps are compared.
const COMPARED: usize = 15;

/// The difference of two lenses in the picture (px, root mean square), after the rotation of the camera that makes it smallest:
/// a principal point that is off is mostly a camera that is turned.
fn map_difference_px(found: &Lens, truth: &Lens, size_px: [usize; 2]) -> f64 {
    let mut rows = Vec::new();
    for k in 0..COMPARED * COMPARED {
        let at = |k: usize, axis: usize| k as f64 / (COMPARED - 1) as f64 * (size_px[axis] as f64 - 1.0);
        let pixel = Pixel::new(at(k % COMPARED, 0), at(k / COMPARED, 1));
        let (Some([x, y]), Some(a)) = (truth.ray_from_pixel(pixel), found.ray_from_pixel(pixel)) else {
            continue;
        };
        rows.push(([a[0] - x, a[1] - y], [[x * y, 1.0 + x * x, -y], [1.0 + y * y, x * y, x]]));
    }
    // Normal equations of three small angles, solved by Cramer's rule.
    let (mut normal, mut side) = ([[0.0; 3]; 3], [0.0; 3]);
    for (difference, slopes) in &rows {
        for (error, slope) in difference.iter().zip(slopes) {
            for i in 0..3 {
                side[i] += slope[i] * error;
                for j in 0..3 {
                    normal[i][j] += slope[i] * slope[j];
                }
            }
        }
    }
    let determinant = |m: [[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let angles = [0, 1, 2].map(|k| {
        let mut with = normal;
        for i in 0..3 {
            with[i][k] = side[i];
        }
        determinant(with) / determinant(normal)
    });
    let left = rows.iter().flat_map(|(difference, slopes)| {
        difference
            .iter()
            .zip(slopes)
            .map(|(error, s)| error - s[0] * angles[0] - s[1] * angles[1] - s[2] * angles[2])
    });
    let squares: f64 = left.map(|error| error * error).sum();
    (squares / rows.len().max(1) as f64 / 2.0).sqrt() * truth.focal_px()[0]
}

fn peer(python: &Path, calibration: &LensCalibration) -> Result<Peer, String> {
    let views: Vec<_> = calibration
        .corners_by_view()
        .into_iter()
        .map(|corners| {
            let points: Vec<_> = corners.iter().map(|(point, _)| [point.x, point.y]).collect();
            let pixels: Vec<_> = corners.iter().map(|(_, pixel)| [pixel.x, pixel.y]).collect();
            serde_json::json!({"points_m": points, "pixels": pixels})
        })
        .collect();
    let file = target().join("validate/corners.json");
    let given = serde_json::json!({"image_size_px": calibration.image_size_px, "views": views});
    files::write_json(&file, &given).map_err(|e| e.to_string())?;
    let output = Command::new(python).arg("xtask/peers/opencv_boards.py").arg(&file).output();
    let output = output.map_err(|e| format!("opencv_boards.py: {e}"))?;
    serde_json::from_slice(&output.stdout)
        .map_err(|e| format!("opencv_boards.py: {e}; {}", String::from_utf8_lossy(&output.stderr)))
}

fn measured(film: &Path, python: &Path) -> Result<Measured, String> {
    let text = |e: &dyn std::fmt::Display| format!("{}: {e}", film.display());
    let truth: Truth = files::read_json(&film.with_extension("truth.json")).map_err(|e| text(&e))?;
    let board = files::load_board(film.with_extension("board.json")).map_err(|e| text(&e))?;
    let started = Instant::now();
    let found =
        lens_calibration(&|| Footage::open(film), &board, DistortionModel::PlumbBob).map_err(|e| text(&e))?;
    let wall_s = started.elapsed().as_secs_f64();
    let lens = Lens::new(truth.focal_px, truth.center_px, truth.distortion);
    let wanted = [&truth.focal_px[..], &truth.center_px, &truth.distortion].concat();
    let inside = found
        .parameters
        .iter()
        .zip(&wanted)
        .filter(|(p, v)| p.interval_95[0] <= **v && **v <= p.interval_95[1]);
    let focal_error = |focal_px: [f64; 2]| {
        (0..2).map(|k| 100.0 * (focal_px[k] / truth.focal_px[k] - 1.0).abs()).fold(0.0, f64::max)
    };
    let theirs = peer(python, &found)?;
    let their_lens = Lens::new(theirs.focal_px, theirs.center_px, theirs.distortion);
    Ok(Measured {
        focal: focal_error(found.lens().focal_px()),
        map_px: map_difference_px(found.lens(), &lens, found.image_size_px),
        rms_px: found.reprojection_rms_px,
        inside: [inside.count(), wanted.len()],
        peer_focal: focal_error(theirs.focal_px),
        peer_map_px: map_difference_px(&their_lens, &lens, found.image_size_px),
        peer_rms_px: theirs.rms_px,
        frames: found.frames,
        wall_s,
    })
}

/// Calibrates from every film of a folder.
pub(crate) fn validate(folder: &Path, python: Option<&str>) -> Result<bool, String> {
    let python = venv::given_or(python, "opencv", &super::PACKAGES)?;
    std::fs::create_dir_all(target().join("validate")).map_err(|e| e.to_string())?;
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut films: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    films.retain(|film| {
        film.extension().is_some_and(|e| e == "mp4") && film.with_extension("truth.json").exists()
    });
    films.sort();
    if films.is_empty() {
        return Err(format!("{}: no NAME.mp4 with a NAME.truth.json", folder.display()));
    }
    let mut all = Vec::new();
    let mut refused = 0;
    println!(
        "film: focal error %, map px, rms px, intervals | OpenCV's focal error %, map px, rms px | frames, time"
    );
    for film in &films {
        let name = film.file_stem().unwrap_or_default().to_string_lossy();
        match measured(film, &python) {
            Ok(m) => {
                println!(
                    "{name}: {:.3}, {:.3}, {:.3}, {}/{} | {:.3}, {:.3}, {:.3} | {}, {:.1} s",
                    m.focal,
                    m.map_px,
                    m.rms_px,
                    m.inside[0],
                    m.inside[1],
                    m.peer_focal,
                    m.peer_map_px,
                    m.peer_rms_px,
                    m.frames,
                    m.wall_s
                );
                all.push(m);
            }
            Err(error) => {
                println!("{name}: refused: {error}");
                refused += 1;
            }
        }
    }
    Ok(rows(&all, refused))
}

fn rows(all: &[Measured], refused: usize) -> bool {
    let of = |value: fn(&Measured) -> f64| all.iter().map(value).collect::<Vec<_>>();
    let worst = |value: fn(&Measured) -> f64| all.iter().map(value).fold(0.0, f64::max);
    let within = all.iter().filter(|m| m.focal <= 0.15).count() as f64;
    let [inside, count] = [0, 1].map(|k| all.iter().map(|m| m.inside[k]).sum::<usize>() as f64);
    print_all(
        &format!("Lenses from {} films of boards, {refused} more refused", all.len()),
        &[
            Row::at_most("error of the focal length, median", median(of(|m| m.focal)), 0.15, "%"),
            Row::plain("  largest", worst(|m| m.focal), "%"),
            Row::plain("  films within 0.15 %", 100.0 * within / all.len().max(1) as f64, "%"),
            Row::at_least(
                "95 % intervals that contain the truth",
                100.0 * inside / count.max(1.0),
                90.0,
                "%",
            ),
            Row::at_most("  at most", 100.0 * inside / count.max(1.0), 99.0, "%"),
            Row::plain("reprojection error (one coordinate), median", median(of(|m| m.rms_px)), "px"),
            Row::plain("  of cv2.calibrateCamera on the same corners", median(of(|m| m.peer_rms_px)), "px"),
            Row::plain("difference to the true map of the picture, median", median(of(|m| m.map_px)), "px"),
            Row::plain("  of cv2.calibrateCamera", median(of(|m| m.peer_map_px)), "px"),
            Row::plain(
                "error of cv2.calibrateCamera's focal length, median",
                median(of(|m| m.peer_focal)),
                "%",
            ),
            Row::plain("time of a film, median", median(of(|m| m.wall_s)), "s"),
        ],
    )
}
