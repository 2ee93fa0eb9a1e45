//! `breakshot verify`: a filmed strike beside its simulation.

use super::simulate;
use crate::args::VerifyArgs;
use crate::{Outcome, console};
use breakshot::capture::{Decoder, Footage, GreyImage};
use breakshot::detect::{self, Layout};
use breakshot::estimate::{self, ClipTracks};
use breakshot::plan::Plan;
use breakshot::report::{self, Filmed, Story};
use breakshot::scene::Scene;
use breakshot::verify::{self, Observed, Report};
use breakshot::{Error, Result, files, physics};
use std::path::Path;

/// Tracks the film, simulates the strike, writes `report.html`, `report.json`, `distances.csv`, `tracks.json` and
/// `trajectory.json`.
pub(crate) fn run(args: &VerifyArgs) -> Result<Outcome> {
    let (scene, properties, outcome) = simulate::world(&args.scene, &args.properties, &args.assumptions)?;
    let strike = files::load_strike(&args.strike)?;
    // A plan tells why as well; a file with just the strike does not.
    let plan: Option<Plan> = files::read_json(&args.strike).ok();
    let trajectory = physics::trajectory(&scene, &properties, &strike, &physics::Options::default())?;
    let names: Vec<String> = scene.placed.iter().map(|p| p.object.clone()).collect();
    let film = args.decoder.film(&args.video, &scene.cell)?;
    let layout = Layout::Placed(scene.placed.clone());
    let tracks = detect::tracks(film, &scene.objects, &names, &layout, &detect::Options::default())?;
    let report = verify::comparison(&scene, &trajectory.final_poses, &Observed::from_tracks(&tracks))?;
    console::warn(&trajectory.notes);
    console::warn(&report.warnings);

    let pictures = first_and_last(&args.video, args.decoder.into())?;
    let filmed = [Filmed {
        scene: &scene,
        strike: &strike,
        tracks: Some(&tracks),
        trajectory: Some(&trajectory),
        report: &report,
        pictures: pictures.as_ref().map(|[first, last]| [first, last]),
    }];
    let page = report::html(&Story {
        title: "Real against virtual",
        objects: &scene.objects,
        plan: plan.as_ref(),
        filmed: &filmed,
        warnings: &report.warnings,
        ..Story::default()
    });
    let folder = &args.output;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    files::write_json(&folder.join("tracks.json"), &tracks)?;
    files::write_json(&folder.join("trajectory.json"), &trajectory)?;
    files::write_json(&folder.join("report.json"), &report)?;
    files::write_whole(&folder.join("distances.csv"), report.csv().as_bytes())?;
    files::write_whole(&folder.join("report.html"), page.as_bytes())?;
    let mut outcome = outcome;
    if let Some(path) = &args.update {
        let clip = ClipTracks {
            name: args.video.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            objects: names,
            strike: Some(strike.clone()),
            tracks: tracks.clone(),
        };
        outcome = outcome.and(feed_back(args, path, &scene, clip)?);
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

/// Adds what the film tells to the properties as measured, without what the user let stand in.
///
/// Only impacts that are single and clean count; what is left out of the film is told.
fn feed_back(args: &VerifyArgs, path: &Path, scene: &Scene, clip: ClipTracks) -> Result<Outcome> {
    let old = files::load_properties(&args.properties)?;
    let name = clip.name.clone();
    let options = estimate::Options::default();
    let properties = estimate::updated(&old, &[clip], &scene.cell, &scene.objects, &options)?.properties;
    let of_film: Vec<String> = properties.warnings.iter().filter(|w| w.starts_with(&name)).cloned().collect();
    console::warn(&of_film);
    files::write_json(path, &properties)?;
    Ok(Outcome::doubtful_if(!of_film.is_empty()))
}

/// The film's first and last frame.
pub(crate) fn first_and_last(film: &Path, decoder: Decoder) -> Result<Option<[GreyImage; 2]>> {
    let mut frames = Footage::open_with(film, decoder)?;
    let Some(first) = frames.next().transpose()? else { return Ok(None) };
    let last = frames.last().transpose()?;
    Ok(last.map(|last| [first.image, last.image]))
}

/// Pairwise distances side by side (Fig. 17).
pub(crate) fn print_table(report: &Report) {
    println!("{:<12} {:>10} {:>14} {:>16}", "pair", "real (mm)", "virtual (mm)", "difference (mm)");
    for pair in &report.pairs {
        println!(
            "{:<12} {:>10.1} {:>14.1} {:>+16.1}",
            format!("{} - {}", pair.a, pair.b),
            pair.observed_m * 1e3,
            pair.predicted_m * 1e3,
            pair.difference_m * 1e3
        );
    }
    if let Some(all) = &report.summary.all {
        println!("mean difference {:.1} mm, worst {:.1} mm", all.mean_m * 1e3, all.worst_m * 1e3);
    }
}
