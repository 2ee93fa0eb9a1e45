//! `breakshot film-report`: a film of a whole procedure.

use super::encoder::{Encoder, write_error};
use super::film_report_args::FilmReportArgs;
use super::verify;
use crate::commands::detection::track_folder::TrackFolder;
use crate::commands::planning::simulate::{self, SimulationInputs};
use crate::{Outcome, console};
use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::{Camera, Capture, Footage, Frame};
use breakshot::detect::Tracks;
use breakshot::object::Object;
use breakshot::physics::{self, Trajectory};
use breakshot::plan::{self, Plan};
use breakshot::properties::Properties;
use breakshot::report::{Beside, Caption, FilmPages, Overlay, RgbImage};
use breakshot::scene::{Scene, Strike};
use breakshot::verify::{Observed, Report};
use breakshot::{Error, Result, files};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Frames per second of the film.
const RATE_HZ: f64 = 30.0;
/// How long pages that do not move are shown (s).
const TITLE_S: f64 = 3.0;
const PAGE_S: f64 = 5.0;
const PLAN_S: f64 = 7.0;
/// How long the last image of a motion stays (s).
const REST_S: f64 = 1.5;
/// A motion is shown for at most this long (s of the film); the rest is left out, and the caption says so.
const MOST_S: f64 = 30.0;
/// What is shown of a strike film before its first and after its last motion (s).
const BEFORE_S: f64 = 0.3;
const AFTER_S: f64 = 0.5;
/// An object has moved where it is this far from its first position (m).
const MOVED_M: f64 = 1e-3;

/// Everything that is shown.
struct Shown {
    pages: FilmPages,
    campaign: Option<Campaign>,
    clips: Vec<ShownClip>,
    properties: Option<Properties>,
    plan: Option<Plan>,
    simulated: Option<Simulated>,
    executed: Option<Executed>,
}

/// A strike film, and where it stands in the campaign.
struct ShownClip {
    number: usize,
    film: PathBuf,
    frame_rate_hz: Option<f64>,
    tracks: Tracks,
}

struct Simulated {
    scene: Scene,
    strike: Strike,
    trajectory: Trajectory,
}

struct Executed {
    film: PathBuf,
    tracks: Tracks,
    report: Report,
}

/// Loads and tracks everything, then encodes the film page by page.
pub(crate) fn run(args: &FilmReportArgs) -> Result<Outcome> {
    check_encoder(&args.output)?;
    let (shown, outcome) = loaded(args)?;
    let output = files::Unfinished::file(&args.output)?;
    let size_px = shown.pages.size_px();
    let encoder = Encoder::start(&output.path(), size_px, RATE_HZ)
        .map_err(|source| write_error(&args.output, source))?;
    let bar = console::activity("drawing and encoding");
    encoder.encode(images(args, &shown)?, &args.output)?;
    output.finish()?;
    bar.finish_and_clear();
    println!("Wrote {}", args.output.display());
    Ok(outcome)
}

/// An error where `ffmpeg` cannot be started: before anything is tracked.
fn check_encoder(output: &Path) -> Result<()> {
    let found = Command::new("ffmpeg").arg("-version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    match found {
        Ok(_) => Ok(()),
        Err(error) => {
            let found = match error.kind() {
                ErrorKind::NotFound => {
                    "not to be encoded without the program `ffmpeg`, which is not installed".to_owned()
                }
                _ => format!("not to be encoded: the program `ffmpeg` cannot be started ({error})"),
            };
            Err(Error::invalid(output.display().to_string(), "the film", found, "an installed `ffmpeg`"))
        }
    }
}

fn loaded(args: &FilmReportArgs) -> Result<(Shown, Outcome)> {
    let mut outcome = Outcome::Done;
    let campaign = args.campaign.as_deref().map(files::load_campaign).transpose()?;
    let campaign = campaign.map(|loaded| {
        console::note(&loaded.notes);
        loaded.value
    });
    let measured = args.properties.as_deref().map(files::load_properties).transpose()?;
    let mut plan = None;
    let mut simulated = None;
    if let Some(file) = &args.strike {
        let planned = files::load_planned(file)?;
        plan = planned.scene.is_some().then(|| files::read_json::<Plan>(file)).transpose()?;
        let scene = match (&args.scene, planned.scene) {
            (Some(scene), _) => files::load_scene(scene)?.value,
            (None, Some(scene)) => scene,
            (None, None) => {
                let name = file.display().to_string();
                return Err(Error::invalid(name, "the scene", "none", "a plan file, or --scene"));
            }
        };
        if let Some(measured) = &measured {
            let assumed = simulate::assumed(scene, measured.clone(), &args.assumptions)?;
            let SimulationInputs { scene, properties, outcome: of_inputs, .. } = assumed;
            outcome = outcome.and(of_inputs);
            let laws = plan::laws(&scene)?;
            let trajectory = physics::trajectory(&scene, &properties, &planned.strike, &laws)?;
            console::warn(&trajectory.notes);
            outcome = outcome.and(Outcome::doubtful_if(!trajectory.complete));
            simulated = Some(Simulated { scene, strike: planned.strike, trajectory });
        }
    }
    let names = names(campaign.as_ref(), measured.as_ref(), plan.as_ref(), simulated.as_ref());
    let pages = FilmPages::new(args.size.0, names.iter().map(String::as_str))?;
    let executed = match (&args.executed, &simulated) {
        (Some(film), Some(simulated)) => Some(executed(args, film, simulated)?),
        _ => None,
    };
    if let Some(executed) = &executed {
        console::warn(&executed.report.warnings);
        outcome = outcome.and(Outcome::doubtful_if(!executed.report.warnings.is_empty()));
    }
    let clips = campaign.as_ref().map(|campaign| clips(args, campaign)).transpose()?.unwrap_or_default();
    Ok((Shown { pages, campaign, clips, properties: measured, plan, simulated, executed }, outcome))
}

/// The names of all objects that are shown: each has one colour in the whole film.
fn names(
    campaign: Option<&Campaign>,
    properties: Option<&Properties>,
    plan: Option<&Plan>,
    simulated: Option<&Simulated>,
) -> Vec<String> {
    let of_objects = |objects: &[Object]| objects.iter().map(|object| object.name.clone()).collect();
    let scenes = plan.map(|plan| &plan.scene).into_iter().chain(simulated.map(|s| &s.scene));
    let mut names: Vec<String> = campaign.map(|c| of_objects(&c.objects)).unwrap_or_default();
    names.extend(scenes.flat_map(|scene| of_objects(&scene.objects) as Vec<String>));
    names.extend(properties.iter().flat_map(|p| p.friction.keys().cloned()));
    names
}

/// The tracks of the strike films that are shown, spread uniformly over those of the campaign; a film that cannot be read is an error.
fn clips(args: &FilmReportArgs, campaign: &Campaign) -> Result<Vec<ShownClip>> {
    let films: Vec<(usize, &Clip)> = campaign
        .clips
        .iter()
        .enumerate()
        .filter(|(_, clip)| matches!(clip.source, Source::Film(_)))
        .collect();
    let count = films.len().min(args.clips as usize);
    let chosen = (0..count).map(|k| films[k * films.len() / count]);
    let folder = args.tracks.as_deref();
    let folder = folder.map(|folder| TrackFolder::new(folder, campaign, args.decoder.into())).transpose()?;
    let bar = console::progress(count, "clips");
    let shown = chosen.map(|(number, clip)| {
        let tracked = match &folder {
            Some(folder) => folder.tracks(clip)?.clip,
            None => breakshot::clip_tracks(campaign, clip, args.decoder.into())?,
        };
        bar.inc(1);
        let film = clip.source.path().to_owned();
        Ok(ShownClip { number, film, frame_rate_hz: clip.frame_rate_hz, tracks: tracked.tracks })
    });
    let shown = shown.collect();
    bar.finish_and_clear();
    shown
}

/// The tracks of the executed strike, and its comparison with the simulation.
fn executed(args: &FilmReportArgs, film: &Path, simulated: &Simulated) -> Result<Executed> {
    let Simulated { scene, trajectory, .. } = simulated;
    let tracks = if let Some(file) = &args.executed_tracks {
        verify::recorded_tracks(file, args.rate, scene)?
    } else {
        let footage = args.rate.open(film, args.decoder, &scene.cell)?;
        verify::tracked_strike(scene, Capture::of(footage, &scene.cell)?)?.tracks
    };
    let observed = Observed::from_tracks(&tracks);
    let mut report = breakshot::verify::comparison(scene, &trajectory.final_poses, &observed)?;
    report.align(&tracks, trajectory);
    Ok(Executed { film: film.to_owned(), tracks, report })
}

/// The images of the film, in their order.
type Images<'a> = Box<dyn Iterator<Item = Result<RgbImage>> + 'a>;

fn images<'a>(args: &'a FilmReportArgs, shown: &'a Shown) -> Result<Images<'a>> {
    let pages = &shown.pages;
    let mut all: Vec<Images> = vec![still(pages.title(&args.title, &contents(shown)), TITLE_S)];
    for (k, clip) in shown.clips.iter().enumerate() {
        if let Some(campaign) = &shown.campaign {
            all.push(strike_film(args, shown, campaign, (k, clip))?);
        }
    }
    for page in shown.properties.iter().flat_map(|properties| pages.properties(properties)) {
        all.push(still(page, PAGE_S));
    }
    if let Some(plan) = &shown.plan {
        let caption = Caption {
            heading: "The plan",
            line: "Outlines: the pile. Filled outlines: the expected final poses. Faint outlines: final poses in scenarios.",
            clock: "",
        };
        all.push(still(pages.plan(&caption, plan), PLAN_S));
    }
    if let Some(simulated) = &shown.simulated {
        if let Some(executed) = &shown.executed {
            all.push(executed_film(args, shown, simulated, executed)?);
            let caption = Caption {
                heading: "Filmed against simulated",
                line: "Filled outlines: final poses in the film. Light outlines: simulated. Nothing was fitted to the outcome.",
                clock: "",
            };
            all.push(still(pages.comparison(&caption, &simulated.scene, &executed.report), PLAN_S));
        } else {
            all.push(simulation(args, pages, simulated));
        }
    }
    Ok(Box::new(all.into_iter().flatten()))
}

/// The lines below the title.
fn contents(shown: &Shown) -> Vec<String> {
    let films = shown.campaign.as_ref().map(|campaign| {
        format!("{} of {} strike films with their tracks", shown.clips.len(), campaign.clips.len())
    });
    let values =
        shown.properties.as_ref().map(|_| "Learned friction, restitution and mass ratios".to_owned());
    let plan = shown.plan.as_ref().map(|_| "The plan for a pile".to_owned());
    let strike = shown.simulated.as_ref().map(|_| match shown.executed {
        Some(_) => "The executed strike beside its simulation".to_owned(),
        None => "The simulated strike".to_owned(),
    });
    films.into_iter().chain(values).chain(plan).chain(strike).collect()
}

/// An image for a time (s).
fn still<'a>(image: RgbImage, seconds: f64) -> Images<'a> {
    Box::new((0..(seconds * RATE_HZ) as usize).map(move |_| Ok(image.clone())))
}

/// The times of the film's images between two times of a motion (s), and whether the motion was cut.
fn times(from_s: f64, until_s: f64, speed: f64) -> (impl Iterator<Item = f64>, bool) {
    let step_s = speed / RATE_HZ;
    let count = ((until_s - from_s).max(0.0) / step_s).ceil() + 1.0;
    let most = MOST_S * RATE_HZ;
    ((0..count.min(most) as usize).map(move |k| (from_s + k as f64 * step_s).min(until_s)), count > most)
}

fn clock(time_s: f64, speed: f64) -> String {
    if speed == 1.0 { format!("{time_s:.2} s") } else { format!("{time_s:.2} s   speed \u{d7} {speed}") }
}

/// When something moves (s): a little before the first motion until a little after the last.
fn moving(tracks: &Tracks) -> Option<[f64; 2]> {
    let times = || tracks.tracks.iter().flat_map(|track| &track.samples).map(|sample| sample.time_s);
    let (first_s, last_s) = (times().reduce(f64::min)?, times().reduce(f64::max)?);
    let mut span: Option<[f64; 2]> = None;
    for track in &tracks.tracks {
        let clear: Vec<_> = track.samples.iter().filter(|sample| !sample.doubtful).collect();
        let (Some(first), Some(last)) = (clear.first(), clear.last()) else { continue };
        let start = clear.iter().find(|s| s.position().distance(first.position()) > MOVED_M);
        let end = clear.iter().rfind(|s| s.position().distance(last.position()) > MOVED_M);
        if let (Some(start), Some(end)) = (start, end) {
            let [from_s, until_s] = span.unwrap_or([start.time_s, end.time_s]);
            span = Some([from_s.min(start.time_s), until_s.max(end.time_s)]);
        }
    }
    let [from_s, until_s] = span.unwrap_or([first_s, last_s]);
    Some([(from_s - BEFORE_S).max(first_s), (until_s + AFTER_S).min(last_s)])
}

/// A film with its tracks drawn on it: for each time the last frame that began before it.
struct DrawnFrames<'a> {
    footage: Footage,
    camera: Camera,
    tracks: &'a Tracks,
    objects: &'a [Object],
    current: Option<RgbImage>,
    next: Option<Frame>,
}

/// Two times that differ by less than this (s) belong to the same frame.
const SAME_TIME_S: f64 = 1e-4;

impl<'a> DrawnFrames<'a> {
    fn new(capture: Capture, tracks: &'a Tracks, objects: &'a [Object]) -> Self {
        let Capture { footage, camera, .. } = capture;
        Self { footage, camera, tracks, objects, current: None, next: None }
    }

    /// The drawn frame at a time, which must not go back; the first or the last one outside of the film.
    fn at(&mut self, time_s: f64) -> Result<Option<&RgbImage>> {
        let mut last = None;
        loop {
            if self.next.is_none() {
                self.next = self.footage.next().transpose()?;
            }
            let is_due = |frame: &Frame| frame.time_s <= time_s + SAME_TIME_S;
            let is_first = self.current.is_none() && last.is_none();
            match self.next.take() {
                Some(frame) if is_due(&frame) || is_first => last = Some(frame),
                other => {
                    self.next = other;
                    break;
                }
            }
        }
        if let Some(frame) = last {
            let overlay = Overlay { camera: &self.camera, tracks: self.tracks, objects: self.objects };
            self.current = Some(overlay.drawn(&frame));
        }
        Ok(self.current.as_ref())
    }
}

/// One strike film of the campaign.
fn strike_film<'a>(
    args: &'a FilmReportArgs,
    shown: &'a Shown,
    campaign: &'a Campaign,
    (k, clip): (usize, &'a ShownClip),
) -> Result<Images<'a>> {
    let listed = &campaign.clips[clip.number];
    let rate_hz = clip.frame_rate_hz.or(campaign.cell.camera.frame_rate_hz);
    let footage = Footage::open_with(&clip.film, args.decoder.into())?.at_frame_rate(rate_hz);
    let capture = Capture::of(footage, &campaign.cell)?;
    let mut frames = DrawnFrames::new(capture, &clip.tracks, &campaign.objects);
    let strike = listed.strike.as_ref().map_or(String::new(), |strike| {
        format!(
            "; struck at {:.2} m/s, heading {:.1}\u{b0}",
            strike.speed_m_s,
            strike.heading_rad.to_degrees()
        )
    });
    let heading = format!("Strike film {} of {}: {}", k + 1, shown.clips.len(), listed.name);
    let [from_s, until_s] = moving(&clip.tracks).unwrap_or([0.0, 0.0]);
    let (times, is_cut) = times(from_s, until_s, args.speed);
    let cut = if is_cut { "; its end is not shown" } else { "" };
    let line = format!("Objects {}{strike}{cut}", listed.objects.join(", "));
    let images = times.filter_map(move |time_s| {
        let clock = clock(time_s, args.speed);
        let frame = match frames.at(time_s) {
            Ok(frame) => frame?,
            Err(error) => return Some(Err(error)),
        };
        Some(Ok(shown.pages.filmed(&Caption { heading: &heading, line: &line, clock: &clock }, frame)))
    });
    Ok(Box::new(held(images)))
}

/// The simulated strike alone.
fn simulation<'a>(args: &'a FilmReportArgs, pages: &'a FilmPages, simulated: &'a Simulated) -> Images<'a> {
    let Simulated { scene, strike, trajectory } = simulated;
    let (times, is_cut) = times(0.0, trajectory.duration_s, args.speed);
    let line = format!(
        "{} at {:.3} m/s, properties at their means; all at rest after {:.2} s{}",
        strike.object.as_deref().unwrap_or("Strike"),
        strike.speed_m_s,
        trajectory.duration_s,
        if is_cut { "; its end is not shown" } else { "" }
    );
    let image = move |time_s: f64| {
        let clock = clock(time_s, args.speed);
        let caption = Caption { heading: "The simulated strike", line: &line, clock: &clock };
        Ok(pages.simulated(&caption, (scene, strike), trajectory, time_s))
    };
    Box::new(held(times.map(image)))
}

/// The executed strike beside its simulation, on one time axis.
fn executed_film<'a>(
    args: &'a FilmReportArgs,
    shown: &'a Shown,
    simulated: &'a Simulated,
    executed: &'a Executed,
) -> Result<Images<'a>> {
    let Simulated { scene, strike, trajectory } = simulated;
    let footage = args.rate.open(&executed.film, args.decoder, &scene.cell)?;
    let capture = Capture::of(footage, &scene.cell)?;
    let mut frames = DrawnFrames::new(capture, &executed.tracks, &scene.objects);
    let [moves_s, ends_s] = moving(&executed.tracks).unwrap_or([0.0, 0.0]);
    let start_s = executed.report.alignment.as_ref().map_or(moves_s, |alignment| alignment.start_s);
    let until_s = trajectory.duration_s.max(ends_s - start_s);
    let (times, is_cut) = times(0.0, until_s, args.speed);
    let line = format!(
        "{}: left with its tracks, right with the properties at their means{}",
        executed.report.video,
        if is_cut { "; its end is not shown" } else { "" }
    );
    let images = times.filter_map(move |time_s| {
        let clock = clock(time_s, args.speed);
        let frame = match frames.at(time_s + start_s) {
            Ok(frame) => frame?,
            Err(error) => return Some(Err(error)),
        };
        let caption =
            Caption { heading: "The executed strike and its simulation", line: &line, clock: &clock };
        let beside = Beside { frame, scene, strike, trajectory, time_s };
        Some(Ok(shown.pages.beside(&caption, &beside)))
    });
    Ok(Box::new(held(images)))
}

/// The images, of which the last one stays for a moment.
fn held<'a>(
    images: impl Iterator<Item = Result<RgbImage>> + 'a,
) -> impl Iterator<Item = Result<RgbImage>> + 'a {
    let mut images = images;
    let mut last: Option<RgbImage> = None;
    let mut left = (REST_S * RATE_HZ) as usize;
    std::iter::from_fn(move || match images.next() {
        Some(Ok(image)) => {
            last = Some(image.clone());
            Some(Ok(image))
        }
        Some(Err(error)) => Some(Err(error)),
        None if left > 0 => {
            left -= 1;
            last.clone().map(Ok)
        }
        None => None,
    })
}
