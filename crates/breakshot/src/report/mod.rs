//! How are the results shown to a person?
//!
//! An HTML page, figures (SVG with their numbers as CSV), film frames with the tracks drawn on them, and the pages of a film of a whole
//! procedure.  This module
//! is a door, not a stage: it may use the outputs of all stages and computes no result of its own.

mod figures;
mod film;
mod html;
mod overlay;
mod paper_figures;
mod raster;
mod warning_lines;
mod weighed;

pub use film::{Beside, Caption, FilmPages};
pub use html::{
    CheckPage, CheckedClip, ClipMotion, DifferenceReason, FilmedStrike, Page, SimulatedStrike, WhyPage,
    difference_reasons,
};
pub use overlay::{Overlay, draft_figure};
pub use paper_figures::{FigureFile, PaperFigures};
pub use raster::RgbImage;
pub use warning_lines::warning_lines;

use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::estimate::ClipValue;
use crate::object::Object;
use crate::plan::{EvaluatedStrike, Plan};
use crate::properties::Properties;
use crate::scene::Scene;

/// A self-contained HTML page with a chapter for every result that `page` holds.
///
/// The page is well-formed XML without references to other files. Where it holds motions it has one script, which plays them; without it
/// drawings stand in their place.
///
/// ```
/// use breakshot::properties::Properties;
/// use breakshot::report::{Page, html};
/// use breakshot::uncertain::Estimate;
///
/// let mut properties = Properties::default();
/// properties.friction.insert("puck".into(), Estimate::exact(0.21));
/// let page = html(&Page { title: "Three films", properties: Some(&properties), ..Page::default() });
/// assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<h1>Three films</h1>"));
/// assert!(page.contains("0.21"), "the page shows the coefficient of friction (dimensionless)");
/// ```
pub fn html(page: &Page) -> String {
    html::html(page)
}

/// A self-contained HTML page of a campaign's clips: each film's first frame, what was found on it, the given strike, and everything that
/// does not fit.
///
/// The page is well-formed XML without scripts and without references to other files.
pub fn check_page(page: &CheckPage) -> String {
    html::check::check(page)
}

/// Figs. 7, 8, 9 and Table 1 of the paper for these properties: drawings (SVG) and their numbers (CSV).
///
/// `clips` are the values of the single clips, drawn as small dots.  The weighed masses of `objects` give the errors
/// of the mass ratios.
///
/// # Errors
/// Properties without a friction, restitution or mass ratio.
pub fn paper_figures(
    properties: &Properties,
    clips: &[ClipValue],
    objects: &[Object],
) -> Result<PaperFigures> {
    paper_figures::paper_figures(properties, clips, objects)
}

/// Fig. 6 of the paper for one clip as a standalone SVG: distance from the first position, speed, and acceleration
/// along the motion, over time.
///
/// # Errors
/// Tracks without a sample.
pub fn motion_figure(tracks: &Tracks) -> Result<String> {
    paper_figures::motion(tracks).ok_or_else(|| {
        Error::invalid(&tracks.video, "tracks", "no sample", "at least one sample of one object")
    })
}

/// A plan as a standalone SVG: the pile, the strike, the expected and the possible final poses of the objects.
pub fn plan_figure(plan: &Plan) -> String {
    paper_figures::plan(plan)
}

/// A pile as a standalone SVG: the objects on the table, walls and areas to keep out of.
pub fn scene_figure(scene: &Scene) -> String {
    paper_figures::pile(scene)
}

/// Figs. 7, 8, 9 and Table 1 of the paper as a part of an HTML page: pictures that load nothing and whose style stays their own.
///
/// # Errors
/// As [`paper_figures()`].
pub fn property_pictures(properties: &Properties) -> Result<String> {
    paper_figures::property_pictures(properties)
}

/// The success probability of strikes by contact point and direction as a standalone SVG: the pile, and the last part of the
/// striker's path to each contact, with the best of the speeds that were evaluated ([`crate::plan::evaluate_grid`]).
pub fn strike_map(scene: &Scene, strikes: &[EvaluatedStrike]) -> String {
    paper_figures::map(scene, strikes)
}
