//! `breakshot check`: what the films of a campaign show, and what does not fit, before anything is estimated.

use crate::check_args::CheckArgs;
use crate::{Outcome, console};
use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::Decoder;
use breakshot::estimate::{self, ClipTracks};
use breakshot::report::{CheckPage, CheckedClip, check_page};
use breakshot::{Error, Result, ViewedClip, files, verify};
use rayon::prelude::*;

/// Reads every film once, compares the clips with their files and with each other, and writes the page.
pub(crate) fn run(args: &CheckArgs) -> Result<Outcome> {
    let loaded = files::load_campaign(&args.campaign)?;
    console::note(&loaded.notes);
    let campaign = loaded.value;
    let views = views(&campaign, args.decoder.into());
    let warnings = warnings(&campaign, &views);

    let clips: Vec<CheckedClip> =
        campaign.clips.iter().zip(&views).map(|(clip, view)| checked(clip, view.as_ref().ok())).collect();
    let name = args.campaign.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let striker =
        Some(&campaign.cell.striker).filter(|striker| !striker.is_none()).map(|striker| &striker.shape);
    let objects = &campaign.objects;
    let page = CheckPage { campaign: &name, objects, striker, clips: &clips, warnings: &warnings };
    files::write_whole(&args.output, check_page(&page).as_bytes())?;

    if args.json {
        console::print_json(&Printed { version: 1, clips: clips.len(), warnings: &warnings })?;
    } else {
        console::warn_by_kind(&warnings, &args.output);
        match warnings.len() {
            0 => println!("{} clips: everything fits", clips.len()),
            n => println!("{} clips: {n} things are missing or do not fit", clips.len()),
        }
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::doubtful_if(!warnings.is_empty()))
}

/// The output of `--json`.
#[derive(serde::Serialize)]
struct Printed<'a> {
    version: u32,
    clips: usize,
    warnings: &'a [String],
}

/// What every film shows; clips are processed in parallel.
fn views(campaign: &Campaign, decoder: Decoder) -> Vec<Result<ViewedClip>> {
    let bar = console::progress(campaign.clips.len(), "clips");
    let view = |clip: &Clip| {
        let view = breakshot::viewed_clip(campaign, clip, decoder);
        bar.inc(1);
        view
    };
    let views = campaign.clips.par_iter().map(view).collect();
    bar.finish_and_clear();
    views
}

/// Everything that does not fit: films that cannot be used, and what the clips say about each other and their strikes.
fn warnings(campaign: &Campaign, views: &[Result<ViewedClip>]) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut clips: Vec<ClipTracks> = Vec::new();
    for (clip, view) in campaign.clips.iter().zip(views) {
        match view.as_ref().map(|view| view.tracks.as_ref()) {
            Ok(Ok(tracks)) => clips.push(tracks.clone()),
            Ok(Err(error)) | Err(error) => warnings.push(named(clip, error)),
        }
    }
    for clip in &clips {
        warnings.extend(clip.tracks.warnings.iter().map(|warning| format!("{}: {warning}", clip.name)));
    }
    let (cell, objects) = (&campaign.cell, &campaign.objects);
    match estimate::estimation(&clips, cell, objects, &estimate::Options::default()) {
        Ok(estimation) => {
            warnings.extend(verify::campaign_warnings(&clips, &estimation, cell, objects));
            warnings.extend(estimation.properties.warnings);
        }
        Err(error) => warnings.push(error.to_string()),
    }
    warnings
}

/// An error as a warning about its clip.
fn named(clip: &Clip, error: &Error) -> String {
    let (name, text) = (&clip.name, error.to_string());
    let text = text.strip_prefix(&format!("{name}: ")).unwrap_or(&text);
    format!("{name}: {text}")
}

fn checked<'a>(clip: &'a Clip, view: Option<&'a ViewedClip>) -> CheckedClip<'a> {
    CheckedClip {
        name: &clip.name,
        objects: &clip.objects,
        strike: clip.strike.as_ref(),
        first: view.and_then(|view| view.first.as_ref()).map(|(image, camera)| (image, camera)),
        tracks: view.and_then(|view| view.tracks.as_ref().ok()).map(|clip| &clip.tracks),
    }
}
