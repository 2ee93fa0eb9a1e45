//! The page of a film's lost and doubtful frames: what was searched in them, and what was found.

mod crop;
mod stretches;
#[cfg(test)]
mod tests;

use super::super::figures::escaped;
use super::page_of;
use super::text::{mm, sentence};
use crate::capture::Frame;
use crate::detect::{Candidate, Explained, ObjectSearches, Outcome, Search};
use crate::geometry::Pixel;
use crate::object;
use crop::Subject;
use std::collections::BTreeMap;
use std::fmt::Write;
use stretches::{Reason, Stretch, stretches};

/// A page of the frames in which objects were lost or doubtful, for people: the parts of the frames in which they were searched, magnified,
/// with what was expected, what was found and why it was refused or is doubtful.
///
/// It says which frames it shows; these are given to it one by one, so that the film need not be in memory.
///
/// ```
/// # use breakshot::capture::{Capture, Footage, Frame, GreyImage, camera};
/// # use breakshot::cell::{Cell, Striker, Workspace};
/// # use breakshot::detect::{Layout, Options, explained};
/// # use breakshot::geometry::Pose;
/// # use breakshot::object::{Marker, Object, Shape};
/// # use breakshot::synthetic::film::{Thing, View, film};
/// use breakshot::report::WhyPage;
///
/// # let cell = Cell::from_above(1000.0, Workspace::centred([0.3, 0.2]), Striker::rod(0.01, [0.1, 1.0]));
/// # let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.01 }));
/// # let puck = Object { name: "puck".into(), shape: Shape::Disc { radius_m: 0.03 }, height_m: 0.02, marker, mass_kg: None, support: None };
/// # let blank = GreyImage { width: 320, height: 200, pixels: vec![0; 320 * 200] };
/// # let view = View::new(camera("drawn", &[&blank], &cell)?);
/// # let times_s: Vec<f64> = (0..12).map(|k| f64::from(k) / 60.0).collect();
/// # let lid = |t: f64| Thing::flat(Shape::Disc { radius_m: 0.04 }, Pose::new(0.0, 0.0, 0.0), if t > 0.12 { 0.03 } else { -1.0 }, 150.0);
/// # let frames = film(&view, &times_s, |t| {
/// #     let mut things = Thing::object(&puck, Pose::new(0.0, 0.0, 0.0)).to_vec();
/// #     if t > 0.12 { things.push(lid(t)); }
/// #     things
/// # });
/// # let read_again = frames.clone();
/// # let capture = Capture::of(Footage::from_frames("drawn", frames), &cell)?;
/// // A lid is put on the puck after 0.12 s.
/// let found = explained(capture, &[puck], &["puck".into()], &Layout::Unknown, &Options::default())?;
/// let mut page = WhyPage::new(&found);
/// for (number, frame) in read_again.iter().enumerate() {
///     page.add(number, frame);
/// }
/// assert!(page.html().contains("puck: not found in 4 frames"));
/// # Ok::<(), breakshot::Error>(())
/// ```
pub struct WhyPage<'a> {
    found: &'a Explained,
    /// The stretches of all objects, in their order and in that of time.
    stretches: Vec<Stretch>,
    /// The drawings of the stretches that have some, by object and search; empty until the frame was added.
    drawings: BTreeMap<(usize, usize), String>,
    /// How far the crops of a stretch reach (px), by the number of the stretch.
    reaches_px: BTreeMap<usize, f64>,
}

/// Drawings on one page; further stretches have none.
const MOST_DRAWINGS: usize = 60;
/// Stretches without drawings that are listed.
const MOST_LISTED: usize = 40;
/// Width of the bar of a film (its own units).
const BAR_WIDTH: f64 = 1000.0;

impl<'a> WhyPage<'a> {
    /// The page of these tracks; the longest stretches are drawn.
    pub fn new(found: &'a Explained) -> Self {
        let of_object = |(k, searches): (usize, &ObjectSearches)| stretches(k, &searches.frames);
        let all: Vec<Stretch> = found.searches.iter().enumerate().flat_map(of_object).collect();
        let mut page = Self { found, stretches: all, drawings: BTreeMap::new(), reaches_px: BTreeMap::new() };
        let mut longest_first: Vec<usize> = (0..page.stretches.len()).collect();
        longest_first.sort_by_key(|&n| usize::MAX - page.stretches[n].untrusted());
        for number in longest_first {
            let stretch = page.stretches[number].clone();
            let searches = page.drawn(&stretch);
            let subjects = searches.iter().filter_map(|&k| page.subject(stretch.object, k));
            let reach_px = subjects.filter_map(|subject| subject.reach_px()).fold(0.0, f64::max);
            if reach_px > 0.0 && page.drawings.len() + searches.len() <= MOST_DRAWINGS {
                page.reaches_px.insert(number, reach_px);
                page.drawings.extend(searches.into_iter().map(|k| ((stretch.object, k), String::new())));
            }
        }
        page
    }

    /// The number of the last frame that the page shows; `None` if it shows none.
    pub fn last_frame(&self) -> Option<usize> {
        self.drawings.keys().map(|&(object, k)| self.found.searches[object].frames[k].frame).max()
    }

    /// Draws what the page shows of the frame with this number; other frames are passed over.
    pub fn add(&mut self, number: usize, frame: &Frame) {
        let here = |&&(object, k): &&(usize, usize)| self.found.searches[object].frames[k].frame == number;
        let wanted: Vec<(usize, usize)> = self.drawings.keys().filter(here).copied().collect();
        for (object, k) in wanted {
            let of = |stretch: &Stretch| stretch.object == object && self.drawn(stretch).contains(&k);
            let drawn = self.reaches_px.iter().find(|&(&n, _)| of(&self.stretches[n]));
            let Some((subject, (_, &reach_px))) = self.subject(object, k).zip(drawn) else { continue };
            let [width, height] = subject.camera.size_px;
            if [frame.image.width, frame.image.height] == [width, height] {
                let label = format!("`{}` in frame {number}", self.found.searches[object].object);
                let svg = subject.svg(&frame.image, subject.square(reach_px), &label);
                self.drawings.insert((object, k), svg);
            }
        }
    }

    /// The page: well-formed XML without scripts and without references to other files.
    pub fn html(&self) -> String {
        let film = escaped(&self.found.tracks.video);
        let lead = "The frames in which an object was not found, or in which its position may be wrong: what was searched there, and what \
                    was found.";
        let mut body = self.summary();
        if !self.stretches.is_empty() {
            body += LEGEND;
        }
        for (object, searches) in self.found.searches.iter().enumerate() {
            body += &self.chapter(object, searches);
        }
        body += &self.warnings();
        page_of(&format!("Lost and doubtful frames of {film}"), lead, &body)
    }

    /// The searches of a stretch that are drawn: one that found the object first.
    fn drawn(&self, stretch: &Stretch) -> Vec<usize> {
        let searches = &self.found.searches[stretch.object].frames;
        stretch.reference(searches).into_iter().chain(stretch.shown(searches)).collect()
    }

    fn subject(&self, object: usize, k: usize) -> Option<Subject<'a>> {
        let found = self.found;
        let searches = &found.searches[object];
        let (search, height_m) = (&searches.frames[k], searches.height_m);
        let object = object::find(&found.objects, &searches.object, "why").ok()?;
        Some(Subject { object, height_m, search, camera: found.cameras.get(search.camera)? })
    }

    fn summary(&self) -> String {
        let frames = self.found.searches.iter().map(|s| s.frames.len()).max().unwrap_or(0);
        if self.stretches.is_empty() {
            return format!(
                "<p class=\"conclusion yes\">Nothing is lost or doubtful: every object was found in all {frames} frames.</p>\n"
            );
        }
        let untrusted: usize = self.stretches.iter().map(Stretch::untrusted).sum();
        let all: usize = self.found.searches.iter().map(|s| s.frames.len()).sum();
        let without: Vec<&Stretch> = self.without_drawings().collect();
        let left_out = if without.is_empty() {
            String::new()
        } else {
            let frames: usize = without.iter().map(|stretch| stretch.untrusted()).sum();
            format!(
                " The longest stretches are drawn; {} shorter ones ({frames} frames) have no pictures and are listed.",
                without.len()
            )
        };
        format!(
            "<p class=\"conclusion doubt\">{untrusted} of {all} positions are missing or doubtful, in {} stretches.{left_out}</p>\n",
            self.stretches.len()
        )
    }

    fn without_drawings(&self) -> impl Iterator<Item = &Stretch> {
        let numbered = self.stretches.iter().enumerate();
        numbered.filter(|(number, _)| !self.reaches_px.contains_key(number)).map(|(_, stretch)| stretch)
    }

    fn chapter(&self, object: usize, searches: &ObjectSearches) -> String {
        let name = escaped(&searches.object);
        let mine = || self.stretches.iter().enumerate().filter(move |(_, stretch)| stretch.object == object);
        let [lost, doubtful] = mine().fold([0, 0], |[l, d], (_, s)| [l + s.lost, d + s.doubtful]);
        let mut text = format!("<h2>{name}: {}</h2>\n{}", kinds(lost, doubtful), bar(&searches.frames));
        for (_, stretch) in mine().filter(|(number, _)| self.reaches_px.contains_key(number)) {
            text += &self.section(stretch, &searches.frames);
        }
        let listed: Vec<&Stretch> = self.without_drawings().filter(|s| s.object == object).collect();
        if !listed.is_empty() {
            text += "<h3>Without pictures</h3>\n<ul>\n";
            for stretch in listed.iter().take(MOST_LISTED) {
                let (when, what) = (when(stretch, &searches.frames), kinds(stretch.lost, stretch.doubtful));
                let _ =
                    writeln!(text, "<li>{when}: {what}. {}</li>", self.reasons(stretch, &searches.frames));
            }
            if let Some(more) = listed.len().checked_sub(MOST_LISTED).filter(|more| *more > 0) {
                let _ = writeln!(text, "<li>{more} more</li>");
            }
            text += "</ul>\n";
        }
        text
    }

    /// One stretch with its drawings.
    fn section(&self, stretch: &Stretch, searches: &[Search]) -> String {
        let (when, what) = (when(stretch, searches), kinds(stretch.lost, stretch.doubtful));
        let mut text = format!(
            "<h3>{}: {what}</h3>\n<p>{}</p>\n<ul class=\"clips\">\n",
            sentence(&when).trim_end_matches('.'),
            self.reasons(stretch, searches)
        );
        for k in self.drawn(stretch) {
            let search = &searches[k];
            let svg = self.drawings.get(&(stretch.object, k)).filter(|svg| !svg.is_empty());
            let svg = svg.map_or("<p class=\"nothing\">the frame was not read</p>", String::as_str);
            let _ = writeln!(text, "<li>{svg}{}</li>", self.caption(search));
        }
        text + "</ul>\n"
    }

    /// Whether the object was expected where the camera does not look.
    fn is_outside(&self, search: &Search) -> bool {
        self.found.cameras.get(search.camera).is_some_and(|camera| {
            let Pixel { x, y } = camera.pixel_from_table(search.predicted.position, 0.0);
            let [width, height] = camera.size_px.map(|px| px as f64);
            !(x > 0.0 && y > 0.0 && x < width && y < height)
        })
    }

    /// The reasons of a stretch with the number of frames of each, the most frequent first.
    fn reasons(&self, stretch: &Stretch, searches: &[Search]) -> String {
        let mut of_reason: BTreeMap<Reason, Vec<usize>> = BTreeMap::new();
        for k in stretch.range.clone().filter(|&k| !searches[k].outcome.is_trusted()) {
            of_reason.entry(Reason::of(&searches[k].outcome)).or_default().push(k);
        }
        let mut groups: Vec<Vec<usize>> = of_reason.into_values().collect();
        groups.sort_by_key(|group| (usize::MAX - group.len(), group[0]));
        let text = |group: &Vec<usize>| {
            let reason = escaped(&self.reason(&searches[group[group.len() / 2]]));
            if group.len() == stretch.untrusted() {
                sentence(&reason)
            } else if group.len() == 1 {
                format!("In 1 frame {reason}.")
            } else {
                format!("In {} frames {reason}.", group.len())
            }
        };
        groups.iter().map(text).collect::<Vec<_>>().join(" ")
    }

    /// Why one frame is not trusted.
    fn reason(&self, search: &Search) -> String {
        match &search.outcome {
            Outcome::Found(_) => "the object was found".to_owned(),
            Outcome::Doubtful(_, doubts) => {
                doubts.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
            }
            Outcome::Lost(candidates) => match candidates.first() {
                None if self.is_outside(search) => "it was expected outside the picture".to_owned(),
                None => format!(
                    "nothing of about its size, shape and shade was within {} of where it was expected: it may be covered, or much lighter or \
                     darker than before",
                    mm(search.radius_m)
                ),
                Some(Candidate { distance_m, reason, .. }) => format!(
                    "what was nearest to the expected place, {} from it, was refused: {reason}",
                    mm(*distance_m)
                ),
            },
        }
    }

    /// The text below a drawing.
    fn caption(&self, search: &Search) -> String {
        let (title, class) = match search.outcome {
            Outcome::Found(_) => ("found", "yes"),
            Outcome::Doubtful(..) => ("doubtful", "doubt"),
            Outcome::Lost(_) => ("not found", "no"),
        };
        let (time_s, frame) = (search.time_s, search.frame);
        let mut text =
            format!("<h3>{time_s:.3} s, frame {frame}: <span class=\"{class}\">{title}</span></h3>");
        match &search.outcome {
            Outcome::Found(sighting) => {
                let _ =
                    write!(text, "<p>for comparison; standard deviation {:.2} mm</p>", 1e3 * sighting.std_m);
            }
            Outcome::Doubtful(sighting, doubts) => {
                for doubt in doubts {
                    let _ = write!(text, "<p>{}</p>", sentence(&escaped(&doubt.to_string())));
                }
                let off_m = sighting.pose.position.distance(search.predicted.position);
                let _ = write!(
                    text,
                    "<p>Standard deviation {:.2} mm; {} from where it was expected.</p>",
                    1e3 * sighting.std_m,
                    mm(off_m)
                );
            }
            Outcome::Lost(candidates) if candidates.is_empty() => {
                let _ = write!(text, "<p>{}</p>", sentence(&escaped(&self.reason(search))));
            }
            Outcome::Lost(candidates) => {
                text += "<ol>";
                for Candidate { distance_m, reason, .. } in candidates {
                    let reason = escaped(&reason.to_string());
                    let _ = write!(text, "<li>{} from the expected place: {reason}.</li>", mm(*distance_m));
                }
                text += "</ol>";
            }
        }
        text
    }

    fn warnings(&self) -> String {
        let warnings = &self.found.tracks.warnings;
        if warnings.is_empty() {
            return String::new();
        }
        let items: String = warnings
            .iter()
            .fold(String::new(), |list, warning| list + &format!("<li>{}</li>\n", escaped(warning)));
        format!("<h2>Warnings</h2>\n<ul class=\"warnings\">\n{items}</ul>\n")
    }
}

const LEGEND: &str = "<p>In each picture: <b class=\"why-key expected\">yellow, dashed</b> the object and its marker where they were expected; \
     <b class=\"why-key region\">blue, dotted</b> how far around the marker was searched; <b class=\"why-key refused\">red, numbered</b> \
     regions that were refused, as ellipses with their second moments; <b class=\"why-key found\">green</b> an object that was found, \
     <b class=\"why-key doubtful\">orange</b> one whose position is doubtful, and <b class=\"why-key measured\">pink</b> the region that was measured as \
     its marker. The little map shows where in the picture it is; contrasts are stretched.</p>\n";

/// Such as "not found in 3 frames, doubtful in 2".
fn kinds(lost: usize, doubtful: usize) -> String {
    let frames = |n: usize| if n == 1 { "1 frame".to_owned() } else { format!("{n} frames") };
    match (lost, doubtful) {
        (0, 0) => "found in all frames".to_owned(),
        (0, n) => format!("doubtful in {}", frames(n)),
        (n, 0) => format!("not found in {}", frames(n)),
        (lost, doubtful) => format!("not found in {}, doubtful in {doubtful}", frames(lost)),
    }
}

fn when(stretch: &Stretch, searches: &[Search]) -> String {
    let (first, last) = (&searches[*stretch.range.start()], &searches[*stretch.range.end()]);
    if stretch.range.start() == stretch.range.end() {
        format!("at {:.3} s (frame {})", first.time_s, first.frame)
    } else {
        format!("{:.3} to {:.3} s (frames {} to {})", first.time_s, last.time_s, first.frame, last.frame)
    }
}

/// The film from left to right: where the object was found, doubtful and lost.
fn bar(searches: &[Search]) -> String {
    let scale = BAR_WIDTH / searches.len().max(1) as f64;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {BAR_WIDTH} 30\" class=\"why-bar\" role=\"img\" aria-label=\"found, doubtful and lost frames over time\">\
         <rect x=\"0\" y=\"0\" width=\"{BAR_WIDTH}\" height=\"14\" class=\"why-good\"/>"
    );
    let class = |outcome: &Outcome| match outcome {
        Outcome::Found(_) => None,
        Outcome::Doubtful(..) => Some("why-some"),
        Outcome::Lost(_) => Some("why-none"),
    };
    let mut k = 0;
    while k < searches.len() {
        let this = class(&searches[k].outcome);
        let same = searches[k..].iter().take_while(|s| class(&s.outcome) == this).count();
        if let Some(class) = this {
            // A single frame of a long film stays visible.
            let (x, width) = (k as f64 * scale, (same as f64 * scale).max(2.0));
            let _ = write!(
                svg,
                "<rect x=\"{x:.1}\" y=\"0\" width=\"{width:.1}\" height=\"14\" class=\"{class}\"/>"
            );
        }
        k += same;
    }
    let ends = searches.first().zip(searches.last()).map(|(first, last)| [first.time_s, last.time_s]);
    if let Some([from_s, to_s]) = ends {
        let _ = write!(
            svg,
            "<text x=\"0\" y=\"27\" class=\"small\">{from_s:.2} s</text>\
             <text x=\"{BAR_WIDTH}\" y=\"27\" class=\"small\" text-anchor=\"end\">{to_s:.2} s</text>"
        );
    }
    svg + "</svg>\n"
}
