//! `breakshot calibrate`: the camera pose from the tags.

use crate::args::CalibrateArgs;
use crate::{Outcome, console};
use breakshot::capture::{self, Calibration};
use breakshot::{Result, files};

/// Calibrates the camera, prints its pose and the reprojection errors of the tags, and draws the fit.
pub(crate) fn run(args: &CalibrateArgs) -> Result<Outcome> {
    let cell = files::load_cell(&args.cell)?;
    let calibration = capture::calibration(args.decoder.film(&args.film, &cell)?)?;
    console::warn(&calibration.camera.warnings);
    if let Some(output) = &args.output {
        files::write_whole(output, calibration.drawing()?.as_bytes())?;
    }
    if args.json {
        console::print_json(&calibration)?;
    } else {
        print_summary(&calibration);
        if let Some(output) = &args.output {
            println!("Wrote {}", output.display());
        }
    }
    Ok(Outcome::doubtful_if(!calibration.camera.warnings.is_empty()))
}

fn print_summary(calibration: &Calibration) {
    if let (Some([x, y, z]), Some(tilt_rad)) = (calibration.position_m, calibration.tilt_rad) {
        let tilt_deg = tilt_rad.to_degrees();
        println!("camera at ({x:.3}, {y:.3}, {z:.3}) m, optical axis {tilt_deg:.1} deg from the vertical");
    }
    println!("pixel size on the table: {:.3} mm", calibration.pixel_size_m * 1e3);
    let camera = &calibration.camera;
    println!("{:<6} {:>10} {:>10}", "tag", "error (px)", "error (mm)");
    for tag in &camera.tags {
        println!("{:<6} {:>10.3} {:>10.3}", tag.id, tag.rms_px, tag.rms_m * 1e3);
    }
    println!("{:<6} {:>10.3} {:>10.3}", "all", camera.reprojection_rms_px, camera.reprojection_rms_m * 1e3);
}
