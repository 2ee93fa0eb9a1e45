//! Which grey levels count as foreground?
//!
//! One threshold rarely fits a whole image: illumination is uneven, objects differ in brightness, and a marker may be
//! lighter or darker than its object. The search for markers therefore tries all levels on both sides.

/// A threshold on the grey level and the side of it that is foreground.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// All grey levels below this one.
    Below(u8),
    /// All grey levels above this one.
    Above(u8),
}

impl Level {
    /// The threshold with dark foreground or with light foreground.
    pub(super) const fn new(dark: bool, threshold: u8) -> Self {
        if dark { Self::Below(threshold) } else { Self::Above(threshold) }
    }

    /// The threshold nearest to a grey level that separates it from both ends of the range.
    pub(super) fn nearest(dark: bool, grey: f64) -> Self {
        Self::new(dark, grey.round().clamp(1.0, 254.0) as u8)
    }

    /// Whether a pixel of this grey level is foreground.
    #[must_use]
    pub const fn is_foreground(self, grey: u8) -> bool {
        match self {
            Self::Below(threshold) => grey < threshold,
            Self::Above(threshold) => grey > threshold,
        }
    }

    /// Whether the foreground is darker than the background.
    pub(super) const fn is_dark(self) -> bool {
        matches!(self, Self::Below(_))
    }
}

/// Step between the grey levels of a search. A marker that shows at fewer than two of them has too little contrast to
/// be measured.
pub(super) const SEARCH_STEP: usize = 8;

/// All levels of a search from dark to light.
pub(super) fn search_thresholds() -> impl Iterator<Item = u8> {
    (SEARCH_STEP..256).step_by(SEARCH_STEP).map(|level| level as u8)
}

/// The given threshold, or else all levels of a search: first with dark, then with light foreground.
pub(super) fn levels(threshold: Option<u8>) -> impl Iterator<Item = Level> {
    let thresholds: Vec<u8> = match threshold {
        Some(level) => vec![level],
        None => search_thresholds().collect(),
    };
    let dark = thresholds.clone();
    dark.into_iter().map(Level::Below).chain(thresholds.into_iter().map(Level::Above))
}
