//! `breakshot lens`: the lens from a film of a calibration board.

use crate::args::LensArgs;
use crate::{Outcome, console};
use breakshot::capture::{Footage, LensCalibration, lens_calibration};
use breakshot::{Result, files};

/// Calibrates the lens, prints its parameters with their errors, and writes it as a ROS `CameraInfo` file.
pub(crate) fn run(args: &LensArgs) -> Result<Outcome> {
    let board = files::load_board(&args.board)?;
    let open = || Footage::open_with(&args.film, args.decoder.into());
    let activity = console::activity("calibrating");
    let calibration = lens_calibration(&open, &board, args.model.into());
    activity.finish_and_clear();
    let calibration = calibration?;
    console::warn(&calibration.warnings);
    files::write_whole(&args.output, calibration.camera_info().as_bytes())?;
    if let Some(figure) = &args.figure {
        files::write_whole(figure, calibration.drawing().as_bytes())?;
    }
    if args.json {
        console::print_json(&calibration)?;
    } else {
        print_summary(&calibration);
        for path in [Some(&args.output), args.figure.as_ref()].into_iter().flatten() {
            println!("Wrote {}", path.display());
        }
    }
    Ok(Outcome::doubtful_if(!calibration.warnings.is_empty()))
}

fn print_summary(calibration: &LensCalibration) {
    let [width, height] = calibration.image_size_px;
    println!("lens `{}` of {} ({width} x {height} px)", calibration.model.name(), calibration.film);
    println!("{:<10} {:>14} {:>16}", "parameter", "value", "standard error");
    for (k, parameter) in calibration.parameters.iter().enumerate() {
        let (digits, unit) = if k < 4 { (2, " px") } else { (7, "") };
        let (value, error) = (parameter.value, parameter.standard_error);
        println!("{:<10} {value:>14.digits$} {error:>16.digits$}{unit}", parameter.name);
    }
    println!(
        "reprojection error: {:.3} px rms over {} corners in {} frames ({} outliers; the board was seen in {} frames)",
        calibration.reprojection_rms_px,
        calibration.corners,
        calibration.frames,
        calibration.outliers,
        calibration.frames_with_board
    );
    println!(
        "coverage of the picture: {:.0} %; tilt of the board: up to {:.0} degrees",
        calibration.coverage * 100.0,
        calibration.largest_tilt_rad.to_degrees()
    );
    println!(
        "error of positions on a table 1 m from the camera, by the lens alone: {:.3} mm (one standard deviation)",
        calibration.table_std_m_per_m * 1e3
    );
}
