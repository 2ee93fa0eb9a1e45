//! `breakshot demo`: all stages on films that are embedded in the program.

use super::verify as verify_command;
use super::verify::TrackedStrike;
use crate::args::DemoArgs;
use crate::commands::estimation::estimate as estimate_command;
use crate::commands::planning::plan as plan_command;
use crate::{Outcome, console};
use breakshot::campaign::Campaign;
use breakshot::capture::Decoder;
use breakshot::estimate::{self, ClipTracks, Estimation};
use breakshot::physics::{self, Trajectory};
use breakshot::plan::{self, Plan};
use breakshot::report::{self, ClipMotion, FilmedStrike, Page, SimulatedStrike};
use breakshot::scene::{Scene, Strike};
use breakshot::verify::{self, Observed, Report};
use breakshot::{Error, Result, capture, files};
use std::path::Path;

/// The clip whose motion the page shows.
const SHOWN_CLIP: &str = "pair_a_c_3.mp4";

macro_rules! example {
    ($($file:literal),* $(,)?) => {
        [$(($file, include_bytes!(concat!("../../../example/", $file)).as_slice())),*]
    };
}

/// The example: twelve films of strikes, a film of a strike on a pile, and the files that describe them.
const EXAMPLE: [(&str, &[u8]); 18] = example![
    "cell.toml",
    "objects.toml",
    "campaign.toml",
    "pile.scene.toml",
    "pile.strike.json",
    "pile.mp4",
    "single_a_3.mp4",
    "single_a_5.mp4",
    "single_c_3.mp4",
    "single_c_5.mp4",
    "single_e_3.mp4",
    "single_e_5.mp4",
    "pair_a_c_1.mp4",
    "pair_a_c_3.mp4",
    "pair_a_e_1.mp4",
    "pair_a_e_3.mp4",
    "pair_c_e_1.mp4",
    "pair_c_e_3.mp4",
];

/// Unpacks the example, runs all stages on it and writes their outputs.
pub(crate) fn run(args: &DemoArgs) -> Result<Outcome> {
    let folder = &args.output;
    unpack(folder)?;
    let campaign = files::load_campaign(folder.join("campaign.toml"))?.value;
    let scene = files::load_scene(folder.join("pile.scene.toml"))?.value;

    say(args, "Estimating friction, restitution and mass ratios of three objects from 12 films ...");
    let (clips, unreadable) = estimate_command::tracked(&campaign, Decoder::Builtin)?;
    let estimation =
        estimate::estimation(&clips, &campaign.cell, &campaign.objects, &estimate::Options::default())?;
    let properties = &estimation.properties;
    if !args.json {
        estimate_command::print_tables(properties);
    }

    say(args, "\nPlanning the strike that singulates a pile of these objects ...");
    let plan = plan::plan(&scene, properties, &plan::Options::default())?;
    let simulate = |strike| physics::trajectory(&scene, properties, strike, &physics::Options::default());
    let planned = plan.strike.as_ref().map(simulate).transpose()?;
    if !args.json {
        plan_command::print_summary(&plan);
    }

    say(args, "\nComparing a film of a strike that was planned for this pile with its simulation ...");
    let strike = files::load_strike(folder.join("pile.strike.json"))?;
    let simulated = simulate(&strike)?;
    let film = capture::capture(&folder.join("pile.mp4"), &scene.cell)?;
    let tracked = verify_command::tracked_strike(&scene, film)?;
    let observed = Observed::from_tracks(&tracked.tracks);
    let mut report = verify::comparison(&scene, &simulated.final_poses, &observed)?;
    report.align(&tracked.tracks, &simulated);
    if !args.json {
        verify_command::print_table(&report);
    }

    let results = Results {
        campaign: &campaign,
        scene: &scene,
        clips: &clips,
        estimation: &estimation,
        plan: &plan,
        planned: planned.as_ref(),
        filmed: Filmed { strike: &strike, tracked: &tracked, simulated: &simulated, report: &report },
    };
    write(folder, &results)?;
    if args.json {
        console::print_json(properties)?;
    } else {
        println!("\nReport: {}", folder.join("report.html").display());
        println!(
            "The films and all other files are in the same folder; the other commands can be run on them."
        );
    }
    console::warn(&unreadable);
    Ok(Outcome::doubtful_if(!unreadable.is_empty()))
}

/// The outputs of all stages.
struct Results<'a> {
    campaign: &'a Campaign,
    scene: &'a Scene,
    clips: &'a [ClipTracks],
    estimation: &'a Estimation,
    plan: &'a Plan,
    planned: Option<&'a Trajectory>,
    filmed: Filmed<'a>,
}

/// The filmed strike on the pile.
struct Filmed<'a> {
    strike: &'a Strike,
    tracked: &'a TrackedStrike,
    simulated: &'a Trajectory,
    report: &'a Report,
}

/// Prints the next step, unless the output is JSON.
fn say(args: &DemoArgs, text: &str) {
    if !args.json {
        println!("{text}");
    }
}

fn unpack(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    EXAMPLE.iter().try_for_each(|(name, bytes)| files::write_whole(&folder.join(name), bytes))
}

/// Writes all results to the folder of the example's files.
fn write(folder: &Path, results: &Results) -> Result<()> {
    let Filmed { strike, tracked, simulated, report } = results.filmed;
    let track_folder = folder.join("tracks");
    std::fs::create_dir_all(&track_folder)
        .map_err(|source| Error::Write { path: track_folder.clone(), source })?;
    for clip in results.clips {
        files::write_json(&track_folder.join(&clip.name).with_extension("json"), &clip.tracks)?;
    }
    files::write_json(&track_folder.join("pile.json"), &tracked.tracks)?;
    files::write_json(&folder.join("properties.json"), &results.estimation.properties)?;
    files::write_json(&folder.join("plan.json"), results.plan)?;
    if let Some(planned) = results.planned {
        files::write_json(&folder.join("trajectory.json"), planned)?;
    }
    files::write_json(&folder.join("pile.trajectory.json"), simulated)?;
    files::write_json(&folder.join("pile.report.json"), report)?;

    let shown = results.clips.iter().find(|clip| clip.name == SHOWN_CLIP);
    let fit = results.estimation.clips.iter().find(|fit| fit.name == SHOWN_CLIP);
    let filmed = [FilmedStrike {
        scene: results.scene,
        strike,
        tracks: Some(&tracked.tracks),
        trajectory: Some(simulated),
        report,
        frames: tracked.end_frames.as_ref().map(|[first, last]| [first, last]),
    }];
    let simulation = results.plan.strike.as_ref().zip(results.planned);
    let page = report::html(&Page {
        title: "Breakshot: from strike videos to a strike",
        objects: &results.campaign.objects,
        motion: shown.map(|clip| ClipMotion {
            tracks: &clip.tracks,
            fit,
            cell: Some(&results.campaign.cell),
            strike: clip.strike.as_ref(),
        }),
        properties: Some(&results.estimation.properties),
        fits: &results.estimation.clips,
        plan: Some(results.plan),
        simulated: simulation.map(|(strike, trajectory)| SimulatedStrike {
            scene: results.scene,
            strike,
            trajectory,
        }),
        filmed: &filmed,
        warnings: &results.estimation.properties.warnings,
    });
    files::write_whole(&folder.join("report.html"), page.as_bytes())
}
