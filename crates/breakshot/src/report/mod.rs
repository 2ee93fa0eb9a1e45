//! How are the results shown to a person?
//!
//! Pages, figures and drawn frames of every stage's output.  A door: it may use what all stages give and computes no
//! result of its own.

mod figures;
mod html;
mod overlay;
mod paper_figures;

pub use html::{Filmed, Motion, Simulated, Story};
pub use overlay::{Overlay, Picture};
pub use paper_figures::Published;

use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::estimate::ClipValue;
use crate::object::Object;
use crate::plan::Plan;
use crate::properties::Properties;

/// A self-contained page that tells, in plain words and pictures, whatever the story holds.
pub fn html(story: &Story) -> String {
    html::page(story)
}

/// The paper's Figs. 7, 8, 9 and Table 1 of these properties as files: drawings (SVG) and their numbers (CSV).
///
/// `clips` are the values of the single clips, for the small dots; masses that someone weighed give the errors.
///
/// # Errors
/// Properties that hold nothing to draw.
pub fn published(properties: &Properties, clips: &[ClipValue], objects: &[Object]) -> Result<Published> {
    paper_figures::published(properties, clips, objects)
}

/// The paper's Fig. 6 of one clip as an SVG that stands alone: distance from the first place, speed, and acceleration
/// along the motion, over time.
///
/// # Errors
/// Tracks without a sample.
pub fn motion(tracks: &Tracks) -> Result<String> {
    paper_figures::motion(tracks)
        .ok_or_else(|| Error::invalid(&tracks.video, "tracks", "not one sample", "an object that was seen"))
}

/// A plan as an SVG that stands alone: the pile, the strike, and where the objects are expected and may come to rest.
pub fn planned(plan: &Plan) -> String {
    paper_figures::plan(plan)
}
