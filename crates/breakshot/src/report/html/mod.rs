//! The HTML page: one file without references to other files, light or dark as the reader's system.  Its one script plays motions; without it
//! the page is complete.
//!
//! A chapter appears if the page holds the results that it shows.  The page is well-formed XML.

#![allow(clippy::format_collect, clippy::format_push_string, reason = "a page is built once: clarity first")]

pub(super) mod check;
pub(super) mod clip_motion;
mod content;
mod explanation;
mod filmed_strike;
pub(super) mod plan;
mod player;
mod properties;
mod simulated_strike;
#[cfg(test)]
mod tests;
mod text;
mod top_views;
mod warnings;
mod why;

pub use check::{CheckPage, CheckedClip};
pub use content::{ClipMotion, FilmedStrike, Page, SimulatedStrike};
pub use explanation::{DifferenceReason, difference_reasons};
pub use why::WhyPage;

use super::figures::{Palette, escaped};

/// The complete page.
pub(super) fn html(page: &Page) -> String {
    let palette = palette(page);
    let chapters: Vec<String> = [
        page.motion.and_then(|motion| clip_motion::chapter(&motion, page.objects, &palette)),
        page.properties.and_then(|properties| properties::chapter(page, properties, &palette)),
        page.plan.map(|plan| plan::chapter(plan, &palette)),
        page.simulated.map(|simulated| simulated_strike::chapter(&simulated, &palette)),
        filmed_strike::chapter(page.filmed, &palette),
        warnings_chapter(page),
    ]
    .into_iter()
    .flatten()
    .collect();
    let title = escaped(if page.title.is_empty() { "Breakshot report" } else { page.title });
    let lead = "Friction, restitution and mass ratios of the objects, estimated from films of strikes; the planned \
                strike that singulates a pile; and the comparison of a filmed strike with its simulation.";
    page_of(&title, lead, &(flow(page) + &chapters.concat()))
}

/// A page with this title, first paragraph and contents.
fn page_of(title: &str, lead: &str, body: &str) -> String {
    let has_players = body.contains(player::PLAYED);
    let mut style = format!("\n{}", include_str!("report.css"));
    if has_players {
        style += player::PLAYER_CSS;
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\" xmlns=\"http://www.w3.org/1999/xhtml\">\n<head>\n<meta charset=\"utf-8\"/>\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{}\"/>\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{title}</title>\n\
         <style>{style}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n<p class=\"lead\">{lead}</p>\n{}{body}\
         <footer>Made by breakshot {}. Lengths in mm, times in s; distances are between centres unless stated \
         otherwise.</footer>\n</main>\n{}</body>\n</html>\n",
        player::content_security_policy(&style, has_players),
        if has_players { player::ABOUT_KEYS } else { "" },
        env!("CARGO_PKG_VERSION"),
        if has_players { player::scripts() } else { String::new() },
    )
}

/// A palette of all objects in all chapters, so that an object has the same colour everywhere.
fn palette(page: &Page) -> Palette {
    let tracks = page.motion.iter().flat_map(|m| m.tracks.tracks.iter().map(|t| t.object.as_str()));
    let estimated =
        page.properties.iter().flat_map(|p| p.friction.keys().chain(p.mass_ratio.keys())).map(String::as_str);
    let scenes = page.plan.map(|p| &p.scene).into_iter();
    let scenes = scenes.chain(page.simulated.map(|s| s.scene)).chain(page.filmed.iter().map(|f| f.scene));
    let placed = scenes.flat_map(|scene| scene.objects.iter().map(|o| o.name.as_str()));
    Palette::new(page.objects.iter().map(|o| o.name.as_str()).chain(tracks).chain(estimated).chain(placed))
}

/// The stages in a row; those that the page has results of are highlighted.
fn flow(page: &Page) -> String {
    let stages = [
        ("Film", "strikes on a table", page.motion.is_some() || !page.fits.is_empty()),
        ("Track", "every object in every frame", page.motion.is_some() || !page.filmed.is_empty()),
        ("Estimate", "friction, restitution, mass", page.properties.is_some()),
        ("Plan", "the strike on a pile", page.plan.is_some()),
        ("Simulate", "the motion of the pile", page.simulated.is_some() || !page.filmed.is_empty()),
        ("Verify", "filmed against simulated", !page.filmed.is_empty()),
    ];
    let items: String = stages
        .iter()
        .map(|(name, what, included)| {
            let class = if *included { " class=\"done\"" } else { "" };
            format!("<li{class}><b>{name}</b>{what}</li>")
        })
        .collect();
    format!("<ol class=\"flow\">{items}</ol>\n")
}

/// All warnings, each once.
fn warnings_chapter(page: &Page) -> Option<String> {
    let tracked = page.motion.iter().flat_map(|m| &m.tracks.warnings);
    let filmed = page.filmed.iter().flat_map(|f| &f.report.warnings);
    let mut listed: Vec<&String> = Vec::new();
    for warning in page.warnings.iter().chain(tracked).chain(filmed) {
        if !listed.contains(&warning) {
            listed.push(warning);
        }
    }
    let estimated =
        page.properties.map_or_else(String::new, |p| warnings::by_cause(&p.warnings, &p.causes, escaped));
    let known = |warning: &str| page.properties.is_some_and(|p| p.warnings.iter().any(|w| w == warning));
    let items: String =
        listed.iter().filter(|w| !known(w)).map(|w| format!("<li>{}</li>\n", escaped(w))).collect();
    let items = if items.is_empty() { items } else { format!("<ul class=\"warnings\">\n{items}</ul>\n") };
    (!estimated.is_empty() || !items.is_empty()).then(|| {
        format!(
            "<h2>Warnings</h2>\n<p>Quantities that the data do not support, and measurements that are doubtful. The \
             numbers above are subject to these warnings.</p>\n{estimated}{items}"
        )
    })
}
