//! `breakshot verify`: compares a filmed strike with its simulation.

use crate::args::VerifyArgs;
use crate::commands::detection::frames::EndFrames;
use crate::commands::planning::simulate::{self, SimulationInputs};
use crate::decoder_args::{DecoderArgs, RateArgs};
use crate::{Outcome, console};
use breakshot::capture::{Capture, GreyImage};
use breakshot::detect::{self, Layout, Recording, Tracks};
use breakshot::estimate::{self, ClipTracks};
use breakshot::files::FilmPath;
use breakshot::plan::{self, Plan};
use breakshot::properties::Properties;
use breakshot::report::{self, FilmedStrike, Page};
use breakshot::scene::{Scene, Strike};
use breakshot::verify::{self, GoalChecks, Observed, Report};
use breakshot::warning::Warning;
use breakshot::{Error, Result, files, physics};
use std::path::Path;

/// Tracks the film, simulates the strike, writes `report.html`, `report.json`, `distances.csv`, `tracks.json` and
/// `trajectory.json`.
pub(crate) fn run(args: &VerifyArgs) -> Result<Outcome> {
    let inputs = simulate::inputs(&args.scene, &args.properties, &args.assumptions)?;
    let SimulationInputs { scene, properties, .. } = &inputs;
    let strike = files::load_strike(&args.strike)?;
    // A plan file adds a chapter to the page; a file with only the strike does not.
    let plan: Option<Plan> = files::read_json(&args.strike).ok();
    let trajectory = physics::trajectory(scene, properties, &strike, &plan::laws(scene)?)?;
    let TrackedStrike { tracks, end_frames } =
        observed_strike(&args.video, (args.rate, args.decoder), scene)?;
    let mut report = verify::comparison(scene, &trajectory.final_poses, &Observed::from_tracks(&tracks))?;
    report.align(&tracks, &trajectory);
    console::warn(&trajectory.notes);
    console::warn(&report.warnings);

    // Output files.
    let filmed = [FilmedStrike {
        scene,
        strike: &strike,
        tracks: Some(&tracks),
        trajectory: Some(&trajectory),
        report: &report,
        frames: end_frames.as_ref().map(|[first, last]| [first, last]),
    }];
    let page = report::html(&Page {
        title: "Filmed against simulated",
        objects: &scene.objects,
        plan: plan.as_ref(),
        filmed: &filmed,
        warnings: &report.warnings,
        ..Page::default()
    });
    let folder = &args.output;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    files::write_json(&folder.join("tracks.json"), &tracks)?;
    files::write_json(&folder.join("trajectory.json"), &trajectory)?;
    files::write_json(&folder.join("report.json"), &report)?;
    files::write_whole(&folder.join("distances.csv"), report.csv().as_bytes())?;
    files::write_whole(&folder.join("report.html"), page.as_bytes())?;
    let mut outcome = inputs.outcome.and(Outcome::doubtful_if(!trajectory.complete));
    if let Some(path) = &args.update {
        let learned = learned(&inputs.measured, clip(&args.video, tracks.clone(), &strike, scene), scene)?;
        files::write_json(path, &learned.properties)?;
        outcome = outcome.and(learned.outcome);
    }
    if args.json {
        console::print_json(&report)?;
    } else {
        print_table(&report);
        println!("Wrote {}", folder.join("report.html").display());
        if let Some(path) = &args.update {
            println!("Wrote {}", path.display());
        }
    }
    Ok(outcome.and(Outcome::doubtful_if(!report.warnings.is_empty())))
}

/// What was learned from a filmed strike.
pub(crate) struct Learned {
    /// The measured properties with the measurements of the film, without assumed values.
    pub(crate) properties: Properties,
    /// Doubtful if something was left out.
    pub(crate) outcome: Outcome,
}

/// The tracks of a strike under the name of its film.
pub(crate) fn clip(film: &Path, tracks: Tracks, strike: &Strike, scene: &Scene) -> ClipTracks {
    let name = FilmPath::of(film).file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    ClipTracks { name, objects: names(scene), strike: Some(strike.clone()), tracks }
}

/// Adds the measurements of an executed strike to the measured properties.
///
/// Impacts that are not single and clean are left out, with a warning.
pub(crate) fn learned(measured: &Properties, clip: ClipTracks, scene: &Scene) -> Result<Learned> {
    let name = clip.name.clone();
    let updated =
        estimate::updated(measured, &[clip], &scene.cell, &scene.objects, &estimate::Options::default())?;
    let of_film = updated.warnings.iter().filter(|warning| warning.clip.as_ref() == Some(&name));
    let of_film: Vec<&Warning> = of_film.collect();
    console::warn(&of_film);
    Ok(Learned { properties: updated.properties, outcome: Outcome::doubtful_if(!of_film.is_empty()) })
}

/// The film of a strike after tracking.
pub(crate) struct TrackedStrike {
    pub(crate) tracks: Tracks,
    /// The first and the last frame; none for a film of one frame.
    pub(crate) end_frames: Option<[GreyImage; 2]>,
}

/// The film of a strike after tracking, or its tracks if the file holds these.
pub(crate) fn observed_strike(
    video: &Path,
    (rate, decoder): (RateArgs, DecoderArgs),
    scene: &Scene,
) -> Result<TrackedStrike> {
    let extension = video.extension().unwrap_or_default();
    if !["csv", "json"].iter().any(|tracks| extension.eq_ignore_ascii_case(tracks)) {
        let film = rate.open(video, decoder, &scene.cell)?;
        return tracked_strike(scene, Capture::of(film, &scene.cell)?);
    }
    Ok(TrackedStrike { tracks: recorded_tracks(video, rate, scene)?, end_frames: None })
}

/// The tracks of a filmed strike from a file (`.csv` or `.json`).
pub(crate) fn recorded_tracks(file: &Path, rate: RateArgs, scene: &Scene) -> Result<Tracks> {
    let (name, text) = (file.display().to_string(), files::tracks_text(file)?);
    let recording = Recording { name: &name, text: &text, columns: None, frame_rate_hz: rate.frame_rate_hz };
    detect::recorded_tracks(&recording, &names(scene), &scene.cell.workspace)
}

fn names(scene: &Scene) -> Vec<String> {
    scene.placed.iter().map(|placed| placed.object.clone()).collect()
}

/// Tracks all objects of a scene in a film that starts with the objects at the poses of the scene.
pub(crate) fn tracked_strike(scene: &Scene, mut film: Capture) -> Result<TrackedStrike> {
    let layout = Layout::Placed(scene.placed.clone());
    let ends = EndFrames::default();
    film.footage = ends.keeping(film.footage);
    let tracks = detect::tracks(film, &scene.objects, &names(scene), &layout, &detect::Options::default())?;
    Ok(TrackedStrike { tracks, end_frames: ends.into_images() })
}

/// Prints the pairwise distances (Fig. 17).
pub(crate) fn print_table(report: &Report) {
    println!("{:<12} {:>12} {:>14} {:>16}", "pair", "filmed (mm)", "simulated (mm)", "difference (mm)");
    for pair in &report.pairs {
        println!(
            "{:<12} {:>12.1} {:>14.1} {:>+16.1}",
            format!("{} - {}", pair.a, pair.b),
            pair.observed_m * 1e3,
            pair.predicted_m * 1e3,
            pair.difference_m * 1e3
        );
    }
    if let Some(all) = &report.summary.all {
        println!("mean difference {:.1} mm, largest {:.1} mm", all.mean_m * 1e3, all.worst_m * 1e3);
    }
    let GoalChecks { observed, predicted, .. } = &report.goal;
    for (check, place) in [(observed, "film"), (predicted, "simulation")] {
        let distances = check.min_distance_m.zip(check.mean_distance_m).map(|(least_m, mean_m)| {
            format!("least distance {:.1} mm, mean {:.1} mm", least_m * 1e3, mean_m * 1e3)
        });
        let words = if check.fulfilled { "goal reached in the" } else { "goal not reached in the" };
        println!("{words} {place}: {}", check.violations.first().cloned().or(distances).unwrap_or_default());
    }
}
