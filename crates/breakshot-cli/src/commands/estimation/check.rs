//! `breakshot check`: what the films of a campaign show, and what does not fit, before anything is estimated.

use crate::check_args::CheckArgs;
use crate::{Outcome, console};
use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::{Decoder, Pictures};
use breakshot::estimate::{self, ClipTracks};
use breakshot::report::{CheckPage, CheckedClip, check_page};
use breakshot::warning::{Cause, GroupedWarnings, Warning, WarningGroup};
use breakshot::{Result, ViewedClip, files};
use rayon::prelude::*;

/// Reads every film, compares the clips with their files and with each other, and writes the page.
pub(crate) fn run(args: &CheckArgs) -> Result<Outcome> {
    let loaded = files::load_campaign(&args.campaign)?;
    console::note(&loaded.notes);
    let campaign = loaded.value;
    let (views, warnings) = views(&campaign, args.decoder.into());

    let clips: Vec<CheckedClip> =
        campaign.clips.iter().zip(&views).map(|(clip, view)| checked(clip, view.as_ref().ok())).collect();
    let name = args.campaign.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let striker =
        Some(&campaign.cell.striker).filter(|striker| !striker.is_none()).map(|striker| &striker.shape);
    let objects = &campaign.objects;
    let page = CheckPage { campaign: &name, objects, striker, clips: &clips, warnings: &warnings };
    files::write_whole(&args.output, check_page(&page).as_bytes())?;

    if args.json {
        console::print_json(&Printed {
            version: 1,
            clips: clips.len(),
            warnings: &warnings.lines,
            causes: &warnings.causes,
        })?;
    } else {
        console::warn_by_cause(&warnings.lines, &warnings.causes, &args.output);
        match warnings.lines.len() {
            0 => println!("{} clips: everything fits", clips.len()),
            n => println!("{} clips: {n} things are missing or do not fit", clips.len()),
        }
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::doubtful_if(!warnings.lines.is_empty()))
}

/// The output of `--json`.
#[derive(serde::Serialize)]
struct Printed<'a> {
    version: u32,
    clips: usize,
    warnings: &'a [String],
    causes: &'a [WarningGroup],
}

/// What every film shows, and everything that does not fit; clips are processed in parallel.
///
/// First only the pictures that others refer to are decoded. A clip that a warning concerns, and one that cannot be used, is then read
/// whole, until none is left: no such warning is due to a picture that was skipped.
fn views(campaign: &Campaign, decoder: Decoder) -> (Vec<Result<ViewedClip>>, GroupedWarnings) {
    let bar = console::progress(campaign.clips.len(), "clips");
    let view = |clip: &Clip, pictures: Pictures| {
        let view = breakshot::viewed_clip(campaign, clip, decoder, pictures);
        bar.inc(1);
        view
    };
    let first = campaign.clips.par_iter().map(|clip| view(clip, Pictures::References));
    let mut views: Vec<Result<ViewedClip>> = first.collect();
    let whole = |view: &Result<ViewedClip>| view.as_ref().is_ok_and(|view| view.is_whole);
    let mut is_whole: Vec<bool> = views.iter().map(whole).collect();
    loop {
        let warnings = warnings(campaign, &views);
        let doubtful = |k: usize| lacks_striker(&views[k]) || concerns(&warnings.causes, &campaign.clips[k]);
        let again: Vec<usize> = (0..views.len()).filter(|&k| !is_whole[k] && doubtful(k)).collect();
        if again.is_empty() {
            bar.finish_and_clear();
            return (views, warnings);
        }
        bar.inc_length(again.len() as u64);
        let read = again.into_par_iter().map(|k| (k, view(&campaign.clips[k], Pictures::All)));
        for (k, view) in read.collect::<Vec<_>>() {
            (views[k], is_whole[k]) = (view, true);
        }
    }
}

/// Whether a film does not show the given strike; with the skipped pictures it may.
fn lacks_striker(view: &Result<ViewedClip>) -> bool {
    let clip = view.as_ref().ok().and_then(|view| view.tracks.as_ref().ok());
    clip.is_some_and(|clip| clip.strike.is_some() && clip.tracks.striker.is_none())
}

/// Whether a warning concerns this clip: one that names it, or one about all clips that could name a wrong number.
fn concerns(causes: &[WarningGroup], clip: &Clip) -> bool {
    causes.iter().any(|group| match group.cause {
        Cause::FrameRate | Cause::Lengths => true,
        Cause::NotMeasured => false,
        _ => group.clips.is_empty() || group.clips.contains(&clip.name),
    })
}

/// Everything that does not fit: clips that cannot be used, and what the others say about each other and their strikes.
fn warnings(campaign: &Campaign, views: &[Result<ViewedClip>]) -> GroupedWarnings {
    let mut unreadable = Vec::new();
    let mut clips: Vec<ClipTracks> = Vec::new();
    for (clip, view) in campaign.clips.iter().zip(views) {
        match view.as_ref().map(|view| view.tracks.as_ref()) {
            Ok(Ok(tracks)) => clips.push(tracks.clone()),
            Ok(Err(error)) | Err(error) => unreadable.push(breakshot::unreadable_clip(clip, error)),
        }
    }
    let options = estimate::Options::default();
    match breakshot::campaign_properties(campaign, None, &clips, unreadable.clone(), &options) {
        Ok(properties) => GroupedWarnings { lines: properties.warnings, causes: properties.causes },
        Err(error) => {
            unreadable.extend(breakshot::track_warnings(&clips));
            unreadable.push(Warning::new(Cause::Unreadable, error.to_string()));
            unreadable.into()
        }
    }
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
