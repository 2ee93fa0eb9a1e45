//! The colours of a page.

use crate::report::figures::Palette;
use crate::report::raster::{COLOURS, Colour};

pub(super) const BACKGROUND: Colour = [18, 21, 26];
pub(super) const PANEL: Colour = [30, 35, 43];
pub(super) const TEXT: Colour = [236, 239, 244];
pub(super) const MUTED: Colour = [160, 169, 182];

/// The colour of an object's kind.
pub(super) fn colour(palette: &Palette, name: &str) -> Colour {
    palette.number(name).map_or(MUTED, |number| COLOURS[number % COLOURS.len()])
}
