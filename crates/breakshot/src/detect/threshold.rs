//! Which grey level separates a marker from its object?
//!
//! No single level need fit a whole picture: light falls off, objects differ, a marker may be the lighter of the two.
//! So every level is tried, and a marker is what keeps its area and shape over many of them; the level halfway
//! between it and its surroundings is its own.

/// Which grey levels are foreground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All below this one.
    Below(u8),
    /// All above this one.
    Above(u8),
}

impl Level {
    /// Whether this grey level is foreground.
    #[must_use]
    pub const fn holds(self, grey: u8) -> bool {
        match self {
            Self::Below(threshold) => grey < threshold,
            Self::Above(threshold) => grey > threshold,
        }
    }
}

/// Steps between the grey levels tried: a marker too faint to show at two of them is too faint to measure.
const LEVEL_STEP: usize = 8;

pub(super) fn levels(threshold: Option<u8>) -> impl Iterator<Item = Level> {
    let steps: Vec<u8> = match threshold {
        Some(level) => vec![level],
        None => (LEVEL_STEP..256).step_by(LEVEL_STEP).map(|level| level as u8).collect(),
    };
    let above = steps.clone();
    steps.into_iter().map(Level::Below).chain(above.into_iter().map(Level::Above))
}
