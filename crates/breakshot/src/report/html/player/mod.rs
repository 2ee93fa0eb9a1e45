//! A player of motions: film, fit and simulation on one time axis, in the page itself.
//!
//! The page contains one script and, for each player, its data.  Without the script the drawings are those without a player.

mod data;
mod script;

pub(super) use data::{Moment, Motion};
pub(super) use script::{PLAYER_CSS, content_security_policy, scripts};

use crate::object::{Object, Shape};
use crate::report::figures::{Palette, TopView, Viewport, WIDTH_PX, escaped, top_view};
use data::{Body, PlayerData, View};

/// The start of each player with the drawings that stand for it.
pub(super) const PLAYED: &str = "<div class=\"played\">";

/// How the players of a page are used; shown where they work.
pub(super) const ABOUT_KEYS: &str = "<p id=\"about-keys\" hidden=\"hidden\">Motions can be played, stepped and compared, also with keys: those \
    of the motion with the focus. <button type=\"button\" id=\"help\" aria-keyshortcuts=\"?\">Keys <kbd>?</kbd></button></p>\n";

/// What a player shows.
pub(super) struct Player<'a> {
    /// The heading and the description for screen readers.
    pub title: &'a str,
    /// What does not move: the table, the strike, and objects before it.
    pub ground: TopView<'a>,
    /// The part of the table that is shown.
    pub view: Viewport,
    /// One motion, or the filmed one and another on the same time axis.
    pub motions: Vec<Motion>,
    /// Impacts and other events (s on that axis).
    pub moments: Vec<Moment>,
    /// The film's time at zero of that axis (s); none if film and simulation have no common time.
    pub film_start_s: Option<f64>,
    /// What is drawn how.
    pub caption: String,
}

/// A player with drawings that stand for it where no script runs.
pub(super) fn played(player: &Player, palette: &Palette, still: &str) -> String {
    let data = data(player, palette);
    if data.motions.is_empty() {
        return still.to_owned();
    }
    let still =
        if still.is_empty() { String::new() } else { format!("<div class=\"still\">\n{still}</div>\n") };
    format!("{PLAYED}\n{still}{}</div>\n", markup(player, &data))
}

fn markup(player: &Player, data: &PlayerData) -> String {
    let ground = top_view(&player.ground, player.view, WIDTH_PX, player.title);
    let compared = data.motions.len() > 1;
    let beside = if compared {
        "<button type=\"button\" class=\"beside\" aria-pressed=\"false\" aria-keyshortcuts=\"b\">Side by side</button>\n"
    } else {
        ""
    };
    let kinds = data.motions.iter().map(|motion| motion.kind).collect::<Vec<_>>().join(" and ");
    let distances = if compared && player.film_start_s.is_some() {
        format!(
            "<table class=\"now\"><caption>Distance between the positions, {kinds}, at the time shown</caption>\n<thead><tr>\
             <th scope=\"col\">object</th><th scope=\"col\">distance</th><th scope=\"col\" class=\"text\">remark</th></tr></thead>\
             <tbody></tbody></table>\n"
        )
    } else {
        String::new()
    };
    format!(
        "<div class=\"player\" role=\"group\" tabindex=\"0\" aria-label=\"{title}\" hidden=\"hidden\">\n\
         <div class=\"views\">\n{ground}</div>\n<div class=\"bar\">\n\
         <button type=\"button\" class=\"play\" aria-keyshortcuts=\"Space\">Play</button>\n\
         <button type=\"button\" class=\"back\" aria-label=\"One step back\" title=\"One step back (left arrow)\">\u{2039}</button>\n\
         <button type=\"button\" class=\"forth\" aria-label=\"One step forth\" title=\"One step forth (right arrow)\">\u{203a}</button>\n\
         <svg class=\"timeline\" role=\"slider\" tabindex=\"0\" aria-label=\"Time\"></svg>\n<output class=\"time\"></output>\n\
         <label>Pace <select class=\"pace\"><option value=\"1\">1</option><option value=\"0.5\">1/2</option>\
         <option value=\"0.25\" selected=\"selected\">1/4</option><option value=\"0.1\">1/10</option></select></label>\n{beside}</div>\n\
         <p class=\"event\"></p>\n<ol class=\"impacts\" aria-label=\"Impacts\"></ol>\n{distances}\
         <p class=\"caption\">{caption}</p>\n<script type=\"application/json\" class=\"data\">{data}</script>\n</div>\n",
        title = escaped(player.title),
        caption = escaped(&player.caption),
        data = data.json(),
    )
}

fn data<'a>(player: &'a Player, palette: &Palette) -> PlayerData<'a> {
    let scene = player.ground.scene;
    let names =
        player.motions.iter().flat_map(|motion| motion.tracks.iter().map(|track| track.name.as_str()));
    let mut bodies: Vec<Body> = Vec::new();
    for name in names {
        if bodies.iter().all(|body| body.name != name)
            && let Some(body) = body(scene.object(name).ok(), &scene.cell.striker.shape, name, palette)
        {
            bodies.push(body);
        }
    }
    let drawn = player.motions.iter().map(|motion| motion.of_bodies(&bodies));
    PlayerData {
        view: View::of(player.view, WIDTH_PX),
        motions: drawn.filter(|motion| !motion.is_empty()).collect(),
        bodies,
        events: &player.moments,
        is_aligned: player.film_start_s.is_some(),
        film_start_s: player.film_start_s.unwrap_or(0.0),
    }
}

/// A body as it is drawn; none for a name that is neither an object's nor the striker's.
fn body<'a>(
    object: Option<&'a Object>,
    striker: &'a Shape,
    name: &'a str,
    palette: &Palette,
) -> Option<Body<'a>> {
    match object {
        Some(Object { shape, marker, .. }) => {
            Some(Body { name, class: palette.class(name), shape, marker: marker.as_ref() })
        }
        None if name == data::STRIKER => {
            Some(Body { name, class: data::STRIKER.into(), shape: striker, marker: None })
        }
        None => None,
    }
}
