//! How long does estimation take, and how does that grow? `cargo xtask bench estimate [LAB TRACKS]`.

use crate::process;
use crate::validate::estimation::saved::Saved;
use crate::validate::row::{self, Row};
use breakshot::estimate::{self, ClipTracks, Options};
use breakshot::synthetic::campaign::{CampaignSpec, campaign};
use breakshot::{cell::Cell, object::Object};
use std::path::Path;
use std::time::Instant;

/// Clips of the largest campaign; the smaller ones halve it.
const MOST_CLIPS: usize = 5000;
const HALVINGS: u32 = 3;

/// Times drawn campaigns of growing size.
pub(crate) fn drawn() -> Result<(), String> {
    let spec = CampaignSpec { objects: 6, ..CampaignSpec::default() };
    let whole = campaign(&spec, 1);
    let mut rows = Vec::new();
    let mut per_clip = Vec::new();
    for halving in (0..=HALVINGS).rev() {
        let count = MOST_CLIPS >> halving;
        // More films of the same cases: the same clips again, with other names.
        let clips: Vec<ClipTracks> = (0..count)
            .map(|k| {
                let clip = &whole.clips[k % whole.clips.len()];
                ClipTracks { name: format!("{k}_{}", clip.name), ..clip.clone() }
            })
            .collect();
        let (wall_s, cpu_s) = timed(&clips, &whole.cell, &whole.objects)?;
        rows.push(Row::plain(format!("{count} clips, CPU time"), cpu_s, "s"));
        let what = format!("{count} clips, wall time");
        rows.push(if halving == 0 {
            Row::at_most(what, wall_s, 60.0, "s")
        } else {
            Row::plain(what, wall_s, "s")
        });
        per_clip.push(cpu_s / count as f64);
    }
    let growth = per_clip[per_clip.len() - 1] / per_clip[0];
    rows.push(Row::at_most("CPU time a clip, most clips over fewest", growth, 1.3, ""));
    if row::print_all("Estimation of drawn campaigns", &rows) { Ok(()) } else { Err("too slow".into()) }
}

/// Times the films' campaign from saved tracks.
pub(crate) fn lab(folder: &Path, tracks: &Path) -> Result<(), String> {
    let saved = Saved::read(&folder.join("campaign"), tracks)?;
    let (wall_s, cpu_s) = timed(&saved.clips, &saved.campaign.cell, &saved.campaign.objects)?;
    let rows = [
        Row::plain("clips", saved.clips.len() as f64, ""),
        Row::at_most("from tracks to properties, wall time", wall_s, 2.0, "s"),
        Row::plain("from tracks to properties, CPU time", cpu_s, "s"),
    ];
    if row::print_all("Estimation from the films' tracks", &rows) { Ok(()) } else { Err("too slow".into()) }
}

/// Wall and CPU time of one estimation (s).
fn timed(clips: &[ClipTracks], cell: &Cell, objects: &[Object]) -> Result<(f64, f64), String> {
    let (start, before_s) = (Instant::now(), process::own_cpu_s()?);
    estimate::estimation(clips, cell, objects, &Options::default()).map_err(|e| e.to_string())?;
    Ok((start.elapsed().as_secs_f64(), process::own_cpu_s()? - before_s))
}
