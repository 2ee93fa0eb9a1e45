//! One colour for each object, the same in all figures.

use crate::object::kind;
use std::collections::BTreeSet;

/// Assigns colours to objects: by the alphabetical rank of their kind.
#[derive(Clone, Debug, Default)]
pub(in crate::report) struct Palette {
    kinds: Vec<String>,
}

/// The number of colours in `report.css`; with more kinds than that, several share a colour.
const COLOURS: usize = 8;

impl Palette {
    /// A palette for the objects of these names; copies share the colour of their kind.
    pub(in crate::report) fn new<'a>(names: impl IntoIterator<Item = &'a str>) -> Self {
        let kinds: BTreeSet<&str> = names.into_iter().map(kind).collect();
        Self { kinds: kinds.into_iter().map(str::to_owned).collect() }
    }

    /// The CSS class that sets an object's colour; `grey` for a name that is not in the palette.
    pub(in crate::report) fn class(&self, name: &str) -> String {
        self.number(name).map_or_else(|| "grey".into(), |index| format!("c{}", index % COLOURS))
    }

    /// The rank of an object's kind; `None` for a name that is not in the palette.
    pub(in crate::report) fn number(&self, name: &str) -> Option<usize> {
        self.kinds.iter().position(|k| k == kind(name))
    }
}
