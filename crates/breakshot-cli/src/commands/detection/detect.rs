//! `breakshot detect`: tracks of the objects in one clip, or in those of a campaign.

use super::detect_campaign;
use super::frames::{FRAME_MEMORY_BYTES, FrameBuffer};
use crate::commands::report::overlay_film;
use crate::detect_args::DetectArgs;
use crate::{Outcome, console};
use breakshot::capture::{Capture, Footage, Frame};
use breakshot::detect::{Layout, Tracks};
use breakshot::report::{self, Overlay, WhyPage};
use breakshot::{Error, Result, detect, files};
use std::fmt::Write;
use std::path::Path;

/// The files of one clip.
struct ClipFiles<'a> {
    cell: &'a Path,
    objects: &'a Path,
    video: &'a Path,
    output: &'a Path,
}

/// Tracks the clips of a campaign, or one clip.
pub(crate) fn run(args: &DetectArgs) -> Result<Outcome> {
    if let (Some(campaign), Some(tracks)) = (&args.batch.campaign, &args.batch.tracks) {
        return detect_campaign::run(campaign, tracks, args.batch.shard, args.decoder.into(), args.json);
    }
    match (&args.cell, &args.objects, &args.video, &args.output) {
        (Some(cell), Some(objects), Some(video), Some(output)) => {
            one_clip(args, &ClipFiles { cell, objects, video, output })
        }
        _ => Err(Error::invalid(
            "detect",
            "its files",
            "not all given",
            "CELL OBJECTS VIDEO and --output, or --campaign",
        )),
    }
}

/// Tracks the named objects and writes the tracks as CSV or JSON, the plot and the overlay.
fn one_clip(args: &DetectArgs, named: &ClipFiles) -> Result<Outcome> {
    let ClipFiles { cell, objects, video, output } = *named;
    let is_csv = csv_wanted(output)?;
    let cell = files::load_cell(cell)?;
    let objects = files::load_objects(objects)?;
    console::note(&objects.notes);
    let layout = match (&args.scene, args.strike_heading_rad) {
        (Some(scene), _) => Layout::Placed(files::load_scene(scene)?.value.placed),
        (None, Some(heading_rad)) => Layout::AlongStrike { heading_rad, start_m: None },
        (None, None) => Layout::Unknown,
    };

    // The frames for the pictures are kept while the film is tracked.
    let mut film = Capture::of(args.rate.open(video, args.decoder, &cell)?, &cell)?;
    let (camera, size_px) = (film.camera.clone(), film.footage.size_px());
    let buffer = FrameBuffer::default();
    if args.overlay.is_some() || args.why.is_some() {
        film.footage = buffer.keeping(film.footage, FRAME_MEMORY_BYTES);
    }
    let bar = console::progress(film.footage.frame_count().unwrap_or(0), "frames");
    let count = |frames: usize| bar.set_position(frames as u64);
    let table = args.decoder.table(args.table.as_deref())?;
    let options = detect::Options {
        threshold: args.threshold,
        table: table.as_ref(),
        on_frame: Some(&count),
        strike: None,
    };
    let (tracks, found) = if args.why.is_some() {
        let found = detect::explained(film, &objects.value, &args.names, &layout, &options)?;
        (found.tracks.clone(), Some(found))
    } else {
        (detect::tracks(film, &objects.value, &args.names, &layout, &options)?, None)
    };
    bar.finish_and_clear();
    console::warn(&tracks.warnings);

    // Output files.
    if is_csv {
        files::write_whole(output, csv(&tracks).as_bytes())?;
    } else {
        files::write_json(output, &tracks)?;
    }
    if let Some(plot) = &args.plot {
        files::write_whole(plot, report::motion_figure(&tracks)?.as_bytes())?;
    }
    let mut written = vec![output.to_path_buf()];
    written.extend(args.plot.clone());
    let kept = buffer.into_frames();
    if let (Some(page), Some(found)) = (&args.why, &found) {
        let mut why = WhyPage::new(found);
        match &kept {
            Some(frames) => frames.iter().enumerate().for_each(|(number, frame)| why.add(number, frame)),
            None => add_frames(&mut why, args.rate.open(video, args.decoder, &cell)?)?,
        }
        files::write_whole(page, why.html().as_bytes())?;
        written.push(page.clone());
    }
    if let Some(film) = &args.overlay {
        let overlay = Overlay { camera: &camera, tracks: &tracks, objects: &objects.value };
        let frames: Box<dyn Iterator<Item = Result<Frame>>> = match kept {
            Some(frames) => Box::new(frames.into_iter().map(Ok)),
            None => Box::new(args.rate.open(video, args.decoder, &cell)?),
        };
        written.push(overlay_film::write(&overlay, overlay_film::Frames { frames, size_px }, film)?);
    }
    if args.json {
        console::print_json(&tracks)?;
    } else {
        for track in &tracks.tracks {
            println!("{}: {} samples", track.object, track.samples.len());
        }
        for file in &written {
            println!("Wrote {}", file.display());
        }
    }
    Ok(Outcome::doubtful_if(!tracks.warnings.is_empty()))
}

/// Reads a film up to the last frame that the page shows.
fn add_frames(why: &mut WhyPage, film: Footage) -> Result<()> {
    let count = why.last_frame().map_or(0, |last| last + 1);
    for (number, frame) in film.take(count).enumerate() {
        why.add(number, &frame?);
    }
    Ok(())
}

/// Whether the output is CSV, by the extension of its name.
fn csv_wanted(output: &Path) -> Result<bool> {
    match output.extension().and_then(|e| e.to_str()) {
        Some("csv") => Ok(true),
        Some("json") => Ok(false),
        _ => {
            let name = output.display().to_string();
            Err(Error::invalid(name, "the output", "another extension", "a name that ends in .csv or .json"))
        }
    }
}

/// The tracks as CSV, one line for each sample; the field of a value that was not measured is empty.
fn csv(tracks: &Tracks) -> String {
    let mut text =
        String::from("object,time_s,x_m,y_m,yaw_rad,vx_m_s,vy_m_s,yaw_rate_rad_s,ax_m_s2,ay_m_s2\n");
    let cell = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
    for track in &tracks.tracks {
        for s in &track.samples {
            let optional = [s.yaw_rad, s.vx_m_s, s.vy_m_s, s.yaw_rate_rad_s, s.ax_m_s2, s.ay_m_s2].map(cell);
            let _ = writeln!(
                text,
                "{},{:.6},{:.7},{:.7},{}",
                track.object,
                s.time_s,
                s.x_m,
                s.y_m,
                optional.join(",")
            );
        }
    }
    text
}
