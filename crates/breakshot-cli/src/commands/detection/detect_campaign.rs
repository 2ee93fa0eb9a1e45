//! `breakshot detect --campaign`: the tracks of the clips of a campaign, or of one share of them.

use super::track_folder::TrackFolder;
use crate::detect_args::Shard;
use crate::{Outcome, console};
use breakshot::campaign::Clip;
use breakshot::capture::Decoder;
use breakshot::warning::Warning;
use breakshot::{Error, Result, files};
use rayon::prelude::*;
use std::path::Path;

/// What happened to one clip.
struct Done {
    name: String,
    /// Whether its tracks were there before; `None` if it has none.
    were_finished: Option<bool>,
    warnings: Vec<Warning>,
}

/// The output of `--json`.
#[derive(serde::Serialize)]
struct Printed {
    version: u32,
    /// Clips that were tracked now.
    tracked: Vec<String>,
    /// Clips whose tracks were there.
    finished: Vec<String>,
    /// Clips that have no tracks.
    failed: Vec<String>,
    warnings: Vec<String>,
}

/// Tracks every clip of the shard whose tracks are not in the folder; clips are processed in parallel, and each is written when it is done.
pub(crate) fn run(
    campaign: &Path,
    folder: &Path,
    shard: Shard,
    decoder: Decoder,
    json: bool,
) -> Result<Outcome> {
    let loaded = files::load_campaign(campaign)?;
    console::note(&loaded.notes);
    let campaign = loaded.value;
    let folder = TrackFolder::new(folder, &campaign, decoder)?;
    let numbered = campaign.clips.iter().enumerate();
    let clips: Vec<&Clip> =
        numbered.filter(|(number, _)| shard.contains(*number)).map(|(_, clip)| clip).collect();
    let bar = console::progress(clips.len(), "clips");
    let track = |clip: &&Clip| {
        let done = match folder.tracks(clip) {
            // No later file could be written either.
            Err(error @ Error::Write { .. }) => return Err(error),
            Err(error) => {
                let warnings = vec![breakshot::unreadable_clip(clip, &error)];
                Done { name: clip.name.clone(), were_finished: None, warnings }
            }
            Ok(found) => {
                let warnings = breakshot::track_warnings(std::slice::from_ref(&found.clip));
                Done { name: clip.name.clone(), were_finished: Some(found.were_finished), warnings }
            }
        };
        bar.inc(1);
        Ok(done)
    };
    let done = clips.par_iter().map(track).collect::<Result<Vec<Done>>>();
    bar.finish_and_clear();
    print(done?, clips.len(), campaign.clips.len(), json)
}

/// Prints what happened to the clips of a shard.
fn print(done: Vec<Done>, in_shard: usize, of_all: usize, json: bool) -> Result<Outcome> {
    let names = |wanted: Option<bool>| -> Vec<String> {
        done.iter().filter(|d| d.were_finished == wanted).map(|d| d.name.clone()).collect()
    };
    let printed = Printed {
        version: 1,
        tracked: names(Some(false)),
        finished: names(Some(true)),
        failed: names(None),
        warnings: done.iter().flat_map(|d| &d.warnings).map(ToString::to_string).collect(),
    };
    let outcome = Outcome::doubtful_if(!printed.warnings.is_empty());
    console::warn(&printed.warnings);
    if json {
        console::print_json(&printed)?;
        return Ok(outcome);
    }
    let [tracked, finished, failed] = [&printed.tracked, &printed.finished, &printed.failed].map(Vec::len);
    println!(
        "{in_shard} of {of_all} clips: {tracked} tracked, {finished} finished before, {failed} left out"
    );
    Ok(outcome)
}
