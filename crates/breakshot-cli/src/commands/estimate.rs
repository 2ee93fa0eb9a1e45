//! `breakshot estimate`: the properties of all objects from the clips of a campaign.

use crate::args::EstimateArgs;
use crate::{Outcome, console};
use breakshot::campaign::Campaign;
use breakshot::estimate::{self, ClipTracks};
use breakshot::properties::Properties;
use breakshot::uncertain::Estimate;
use breakshot::{Error, Result, files};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Tracks every clip, estimates, and writes the properties.
pub(crate) fn run(args: &EstimateArgs) -> Result<Outcome> {
    let campaign = files::load_campaign(&args.campaign)?;
    console::note(&campaign.notes);
    let campaign = campaign.value;
    let (clips, unread) = tracked(&campaign)?;
    if let Some(folder) = &args.tracks {
        write_tracks(folder, &clips)?;
    }
    let options = estimate::Options { reference: args.reference.clone() };
    let mut properties =
        estimate::estimation(&clips, &campaign.cell, &campaign.objects, &options)?.properties;
    properties.warnings.splice(0..0, unread);
    console::warn(&properties.warnings);
    files::write_json(&args.output, &properties)?;
    if args.json {
        console::print_json(&properties)?;
    } else {
        print_tables(&properties);
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::doubtful_if(!properties.warnings.is_empty()))
}

/// The tracks of every clip that can be read, and a warning for every other one.
///
/// Clips run side by side; each is decoded frame by frame.
pub(crate) fn tracked(campaign: &Campaign) -> Result<(Vec<ClipTracks>, Vec<String>)> {
    let bar = console::progress(campaign.clips.len(), "clips");
    let results: Vec<Result<ClipTracks>> = campaign
        .clips
        .par_iter()
        .map(|clip| {
            let tracks = breakshot::clip_tracks(campaign, clip);
            bar.inc(1);
            tracks
        })
        .collect();
    bar.finish_and_clear();
    let (mut clips, mut errors) = (Vec::new(), Vec::new());
    for result in results {
        match result {
            Ok(tracks) => clips.push(tracks),
            Err(error) => errors.push(error),
        }
    }
    if clips.is_empty()
        && let Some(first) = errors.pop()
    {
        return Err(first);
    }
    Ok((clips, errors.iter().map(|e| format!("left out: {e}")).collect()))
}

/// One JSON file a clip.
fn write_tracks(folder: &Path, clips: &[ClipTracks]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    clips.iter().try_for_each(|clip| {
        let path = folder.join(&clip.name).with_extension("json");
        files::write_json(&path, &clip.tracks)
    })
}

/// The properties as short tables.
pub(crate) fn print_tables(properties: &Properties) {
    let reference = format!("mass / mass of {}", properties.reference);
    let tables = [
        ("friction", &properties.friction),
        ("striker restitution", &properties.striker_restitution),
        ("restitution", &properties.restitution),
        (reference.as_str(), &properties.mass_ratio),
    ];
    for (title, values) in tables {
        print_table(title, values);
    }
}

fn print_table(title: &str, values: &BTreeMap<String, Estimate>) {
    if values.is_empty() {
        return;
    }
    println!("{title:<20} {:>8} {:>8} {:>19} {:>4}", "mean", "spread", "95 % interval", "n");
    for (name, e) in values {
        let spread = e.std.map_or("-".into(), |s| format!("{s:.4}"));
        let interval = format!("{:.4} .. {:.4}", e.interval_95[0], e.interval_95[1]);
        println!("  {name:<18} {:>8.4} {spread:>8} {interval:>19} {:>4}", e.mean, e.n);
    }
}
