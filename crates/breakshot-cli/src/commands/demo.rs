//! `breakshot demo`: the whole flow on films that come with the program.

use super::{estimate as estimate_command, plan as plan_command, verify as verify_command};
use crate::args::DemoArgs;
use crate::{Outcome, console};
use breakshot::campaign::Campaign;
use breakshot::capture::Decoder;
use breakshot::detect::{self, Layout, Tracks};
use breakshot::estimate::{self, ClipTracks, Estimation};
use breakshot::physics::{self, Trajectory};
use breakshot::plan::{self, Plan};
use breakshot::report::{self, Filmed, Motion, Simulated, Story};
use breakshot::scene::{Scene, Strike};
use breakshot::verify::{self, Observed, Report};
use breakshot::{Error, Result, capture, files};
use std::path::Path;

/// The clip whose motion the report shows.
const SHOWN_CLIP: &str = "pair_a_c_3.mp4";

macro_rules! example {
    ($($file:literal),* $(,)?) => {
        [$(($file, include_bytes!(concat!("../../../../fixtures/demo/", $file)).as_slice())),*]
    };
}

/// The example: twelve films of strikes, one of a strike on a pile, and the files that describe them.
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

/// Unpacks the example, runs every stage on it and writes what each gives.
pub(crate) fn run(args: &DemoArgs) -> Result<Outcome> {
    let folder = &args.output;
    unpack(folder)?;
    let campaign = files::load_campaign(&folder.join("campaign.toml"))?.value;
    let scene = files::load_scene(&folder.join("pile.scene.toml"))?.value;

    say(args, "Learning from 12 films how three objects slide and bounce ...");
    let (clips, unread) = estimate_command::tracked(&campaign, Decoder::Builtin)?;
    let estimation =
        estimate::estimation(&clips, &campaign.cell, &campaign.objects, &estimate::Options::default())?;
    let properties = &estimation.properties;
    if !args.json {
        estimate_command::print_tables(properties);
    }

    say(args, "\nPlanning the strike that singulates a pile of them ...");
    let plan = plan::plan(&scene, properties, &plan::Options::default())?;
    let simulate = |strike| physics::trajectory(&scene, properties, strike, &physics::Options::default());
    let planned = plan.strike.as_ref().map(simulate).transpose()?;
    if !args.json {
        plan_command::print_summary(&plan);
    }

    say(args, "\nComparing a filmed strike on the same pile with its simulation ...");
    let strike = files::load_strike(&folder.join("pile.strike.json"))?;
    let simulated = simulate(&strike)?;
    let tracks = pile_tracks(&scene, &folder.join("pile.mp4"))?;
    let report = verify::comparison(&scene, &simulated.final_poses, &Observed::from_tracks(&tracks))?;
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
        filmed: (&strike, &tracks, &simulated, &report),
    };
    write(folder, &results)?;
    if args.json {
        console::print_json(properties)?;
    } else {
        println!("\nThe report, with pictures: {}", folder.join("report.html").display());
        println!("The films and all files are beside it: try the other commands on them.");
    }
    console::warn(&unread);
    Ok(Outcome::doubtful_if(!unread.is_empty()))
}

/// Everything the demo made.
struct Results<'a> {
    campaign: &'a Campaign,
    scene: &'a Scene,
    clips: &'a [ClipTracks],
    estimation: &'a Estimation,
    plan: &'a Plan,
    planned: Option<&'a Trajectory>,
    filmed: (&'a Strike, &'a Tracks, &'a Trajectory, &'a Report),
}

fn say(args: &DemoArgs, text: &str) {
    if !args.json {
        println!("{text}");
    }
}

fn unpack(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    EXAMPLE.iter().try_for_each(|(name, bytes)| files::write_whole(&folder.join(name), bytes))
}

fn pile_tracks(scene: &Scene, film: &Path) -> Result<Tracks> {
    let names: Vec<String> = scene.placed.iter().map(|p| p.object.clone()).collect();
    let layout = Layout::Placed(scene.placed.clone());
    let film = capture::capture(film, &scene.cell)?;
    detect::tracks(film, &scene.objects, &names, &layout, &detect::Options::default())
}

/// Writes every result beside the example's own files.
fn write(folder: &Path, results: &Results) -> Result<()> {
    let (strike, tracks, simulated, report) = results.filmed;
    let track_folder = folder.join("tracks");
    std::fs::create_dir_all(&track_folder)
        .map_err(|source| Error::Write { path: track_folder.clone(), source })?;
    for clip in results.clips {
        files::write_json(&track_folder.join(&clip.name).with_extension("json"), &clip.tracks)?;
    }
    files::write_json(&track_folder.join("pile.json"), tracks)?;
    files::write_json(&folder.join("properties.json"), &results.estimation.properties)?;
    files::write_json(&folder.join("plan.json"), results.plan)?;
    if let Some(planned) = results.planned {
        files::write_json(&folder.join("trajectory.json"), planned)?;
    }
    files::write_json(&folder.join("pile.trajectory.json"), simulated)?;
    files::write_json(&folder.join("pile.report.json"), report)?;

    let shown = results.clips.iter().find(|clip| clip.name == SHOWN_CLIP);
    let fit = results.estimation.clips.iter().find(|fit| fit.name == SHOWN_CLIP);
    let pictures = verify_command::first_and_last(&folder.join("pile.mp4"), Decoder::Builtin)?;
    let filmed = [Filmed {
        scene: results.scene,
        strike,
        tracks: Some(tracks),
        trajectory: Some(simulated),
        report,
        pictures: pictures.as_ref().map(|[first, last]| [first, last]),
    }];
    let simulation = results.plan.strike.as_ref().zip(results.planned);
    let page = report::html(&Story {
        title: "Breakshot: from strike videos to a strike",
        objects: &results.campaign.objects,
        motion: shown.map(|clip| Motion { tracks: &clip.tracks, fit }),
        properties: Some(&results.estimation.properties),
        fits: &results.estimation.clips,
        plan: Some(results.plan),
        simulated: simulation.map(|(strike, trajectory)| Simulated {
            scene: results.scene,
            strike,
            trajectory,
        }),
        filmed: &filmed,
        warnings: &results.estimation.properties.warnings,
    });
    files::write_whole(&folder.join("report.html"), page.as_bytes())
}
