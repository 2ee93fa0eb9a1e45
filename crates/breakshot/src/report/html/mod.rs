//! The report: one page without scripts or files beside it, light or dark as the reader's system is.
//!
//! A chapter is told if the story holds what it needs.  The page is well-formed XML.

#![allow(clippy::format_collect, clippy::format_push_string, reason = "a page is built once: clarity first")]

mod film;
mod learned;
pub(super) mod motion;
pub(super) mod planned;
mod simulated;
#[cfg(test)]
mod tests;
mod text;

use super::figures::{Palette, escaped};
use crate::capture::GreyImage;
use crate::detect::Tracks;
use crate::estimate::ClipFit;
use crate::object::Object;
use crate::physics::Trajectory;
use crate::plan::Plan;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use crate::verify::Report;

/// What there is to tell; whatever is missing is left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Story<'a> {
    /// The page's title.
    pub title: &'a str,
    /// The kinds of objects: weighed masses are compared with the learned ratios.
    pub objects: &'a [Object],
    /// One clip's motion (Fig. 6).
    pub motion: Option<Motion<'a>>,
    /// Friction, restitution, mass ratios (Figs. 7 to 9, Table 1).
    pub properties: Option<&'a Properties>,
    /// The fits of the single clips that they rest on.
    pub fits: &'a [ClipFit],
    /// The strike for a pile.
    pub plan: Option<&'a Plan>,
    /// What the simulation says that a strike does.
    pub simulated: Option<Simulated<'a>>,
    /// Filmed strikes beside their simulations (Figs. 12 to 17).
    pub filmed: &'a [Filmed<'a>],
    /// What the reader should know.
    pub warnings: &'a [String],
}

/// One clip.
#[derive(Clone, Copy, Debug)]
pub struct Motion<'a> {
    /// Where its objects were.
    pub tracks: &'a Tracks,
    /// What was fitted to them.
    pub fit: Option<&'a ClipFit>,
}

/// A simulated strike.
#[derive(Clone, Copy, Debug)]
pub struct Simulated<'a> {
    /// What lay on the table.
    pub scene: &'a Scene,
    /// The strike.
    pub strike: &'a Strike,
    /// What it does.
    pub trajectory: &'a Trajectory,
}

/// A filmed strike beside its simulation.
#[derive(Clone, Copy, Debug)]
pub struct Filmed<'a> {
    /// What lay on the table.
    pub scene: &'a Scene,
    /// The strike.
    pub strike: &'a Strike,
    /// The film's tracks, for the ways.
    pub tracks: Option<&'a Tracks>,
    /// The simulation, for the ways.
    pub trajectory: Option<&'a Trajectory>,
    /// Predicted against observed.
    pub report: &'a Report,
    /// A frame from before the strike and one from after it.
    pub pictures: Option<[&'a GreyImage; 2]>,
}

/// The whole page.
pub(super) fn page(story: &Story) -> String {
    let palette = palette(story);
    let chapters: Vec<String> = [
        story.motion.and_then(|motion| motion::chapter(&motion, &palette)),
        story.properties.and_then(|properties| learned::chapter(story, properties, &palette)),
        story.plan.map(|plan| planned::plan_chapter(plan, &palette)),
        story.simulated.map(|simulated| simulated::chapter(&simulated, &palette)),
        film::chapter(story.filmed, &palette),
        warnings_chapter(story),
    ]
    .into_iter()
    .flatten()
    .collect();
    let title = escaped(if story.title.is_empty() { "Breakshot report" } else { story.title });
    let lead = "How objects slide and bounce, learned from films of strikes; the one strike that singulates a pile; \
                and whether it happened as predicted.";
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
         <style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n<p class=\"lead\">{lead}</p>\n{}{}\
         <footer>Made by breakshot {}. Lengths in mm, times in s; distances are between centres unless said \
         otherwise.</footer>\n</main>\n</body>\n</html>\n",
        include_str!("report.css"),
        flow(story),
        chapters.concat(),
        env!("CARGO_PKG_VERSION"),
    )
}

/// Every object that any chapter shows, so that colours are the same in all of them.
fn palette(story: &Story) -> Palette {
    let tracks = story.motion.iter().flat_map(|m| m.tracks.tracks.iter().map(|t| t.object.as_str()));
    let learned = story
        .properties
        .iter()
        .flat_map(|p| p.friction.keys().chain(p.mass_ratio.keys()))
        .map(String::as_str);
    let scenes = story.plan.map(|p| &p.scene).into_iter();
    let scenes = scenes.chain(story.simulated.map(|s| s.scene)).chain(story.filmed.iter().map(|f| f.scene));
    let placed = scenes.flat_map(|scene| scene.objects.iter().map(|o| o.name.as_str()));
    Palette::new(story.objects.iter().map(|o| o.name.as_str()).chain(tracks).chain(learned).chain(placed))
}

/// The stages as a row; those that this page tells of are marked.
fn flow(story: &Story) -> String {
    let stages = [
        ("Film", "strikes, seen from above", story.motion.is_some() || !story.fits.is_empty()),
        ("Track", "every marker, every frame", story.motion.is_some() || !story.filmed.is_empty()),
        ("Learn", "friction, restitution, mass", story.properties.is_some()),
        ("Plan", "the strike for a pile", story.plan.is_some()),
        ("Simulate", "what it will do", story.simulated.is_some() || !story.filmed.is_empty()),
        ("Verify", "filmed against simulated", !story.filmed.is_empty()),
    ];
    let items: String = stages
        .iter()
        .map(|(name, what, told)| {
            let class = if *told { " class=\"done\"" } else { "" };
            format!("<li{class}><b>{name}</b>{what}</li>")
        })
        .collect();
    format!("<ol class=\"flow\">{items}</ol>\n")
}

fn warnings_chapter(story: &Story) -> Option<String> {
    let learned = story.properties.iter().flat_map(|p| &p.warnings);
    let seen = story.motion.iter().flat_map(|m| &m.tracks.warnings);
    let filmed = story.filmed.iter().flat_map(|f| &f.report.warnings);
    let mut told: Vec<&String> = Vec::new();
    for warning in story.warnings.iter().chain(learned).chain(seen).chain(filmed) {
        if !told.contains(&warning) {
            told.push(warning);
        }
    }
    let items: String = told.iter().map(|w| format!("<li>{}</li>\n", escaped(w))).collect();
    (!told.is_empty()).then(|| {
        format!(
            "<h2>Warnings</h2>\n<p>What the data did not support, or what looked wrong. Read the numbers above with \
             this in mind.</p>\n<ul class=\"warnings\">\n{items}</ul>\n"
        )
    })
}
