//! Pictures for people: inline SVG with one style for charts and table drawings.
//!
//! No fonts, no scripts: text is set in the reader's own sans serif, colours are CSS variables that `report.css`
//! defines for light and dark pages.  Every object has one colour through all pictures ([`Palette`]).

mod axis;
mod bars;
mod intervals;
mod labels;
mod lines;
mod photo;
mod pile;
mod svg;

pub(super) use axis::Scale;
pub(super) use bars::{BarPair, bars};
pub(super) use intervals::{IntervalRow, Intervals, intervals};
pub(super) use lines::{Bound, LOW_PANEL_PX, Mark, PANEL_PX, Panel, Series, Stroke, lines};
pub(super) use photo::photo;
pub(super) use pile::{Lay, Layer, Pile, View, pile};
pub(super) use svg::{Anchor, Svg, escaped};

use crate::object::kind;
use std::collections::BTreeSet;

/// As wide as the page's text: a picture that fills it (px).
pub(super) const WIDTH_PX: f64 = 856.0;

/// Which colour an object has: its place in the alphabet of all kinds.
#[derive(Clone, Debug, Default)]
pub(super) struct Palette {
    kinds: Vec<String>,
}

/// How many colours `report.css` defines; more kinds than that share them.
const COLOURS: usize = 8;

impl Palette {
    /// For these names; copies share the colour of their kind.
    pub(super) fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let kinds: BTreeSet<&str> = names.into_iter().map(kind).collect();
        Self { kinds: kinds.into_iter().map(str::to_owned).collect() }
    }

    /// The CSS class that sets an object's colour; grey for names that are no object.
    pub(super) fn class(&self, name: &str) -> String {
        match self.kinds.iter().position(|k| k == kind(name)) {
            Some(index) => format!("c{}", index % COLOURS),
            None => "grey".into(),
        }
    }
}
