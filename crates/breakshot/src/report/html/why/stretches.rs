//! Which frames of a film show best why an object was lost or doubtful there?

use crate::detect::{Outcome, Rejection, Search};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Stretches with at most this many trusted frames between them are one: an object that passes behind something is lost, seen and
/// lost again.
const MERGED_FRAMES: usize = 2;
/// Frames of one stretch that are shown, beside one in which the object was found.
const MOST_SHOWN: usize = 3;

/// Successive frames in which an object was lost or doubtful.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Stretch {
    /// The object's index.
    pub object: usize,
    /// Indices of the first and the last search.
    pub range: RangeInclusive<usize>,
    /// Number of frames in which it was lost ...
    pub lost: usize,
    /// ... and in which it was doubtful.
    pub doubtful: usize,
}

impl Stretch {
    /// Number of frames that are not trusted.
    pub(super) fn untrusted(&self) -> usize {
        self.lost + self.doubtful
    }

    /// The searches that show it best, in the order of time: of each reason one from its middle, then the first and the last one.
    pub(super) fn shown(&self, searches: &[Search]) -> Vec<usize> {
        let untrusted: Vec<usize> =
            self.range.clone().filter(|&k| !searches[k].outcome.is_trusted()).collect();
        let mut of_reason: BTreeMap<Reason, Vec<usize>> = BTreeMap::new();
        for &k in &untrusted {
            of_reason.entry(Reason::of(&searches[k].outcome)).or_default().push(k);
        }
        let mut groups: Vec<Vec<usize>> = of_reason.into_values().collect();
        groups.sort_by_key(|group| (usize::MAX - group.len(), group[0]));
        let mut shown: Vec<usize> = groups.iter().map(|group| group[group.len() / 2]).collect();
        shown.extend(untrusted.first());
        shown.extend(untrusted.last());
        let mut kept: Vec<usize> = Vec::new();
        for k in shown {
            if kept.len() < MOST_SHOWN && !kept.contains(&k) {
                kept.push(k);
            }
        }
        kept.sort_unstable();
        kept
    }

    /// A search that found the object, just before the stretch or just after it.
    pub(super) fn reference(&self, searches: &[Search]) -> Option<usize> {
        let before = self.range.start().checked_sub(1);
        let after = (self.range.end() + 1 < searches.len()).then_some(self.range.end() + 1);
        before.or(after)
    }
}

/// What a lost or doubtful frame is due to, without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Reason {
    Nothing,
    Unmeasurable,
    Area,
    Shape,
    Contrast,
    FarPart,
    VisibleElsewhere,
    Taken,
    Outline,
    Further,
    Doubtful,
}

impl Reason {
    pub(super) fn of(outcome: &Outcome) -> Self {
        let Outcome::Lost(candidates) = outcome else { return Self::Doubtful };
        match candidates.first().map(|candidate| &candidate.reason) {
            None => Self::Nothing,
            Some(Rejection::Unmeasurable) => Self::Unmeasurable,
            Some(Rejection::Area { .. }) => Self::Area,
            Some(Rejection::Shape { .. }) => Self::Shape,
            Some(Rejection::Contrast { .. }) => Self::Contrast,
            Some(Rejection::FarPart { .. }) => Self::FarPart,
            Some(Rejection::VisibleElsewhere) => Self::VisibleElsewhere,
            Some(Rejection::Taken { .. }) => Self::Taken,
            Some(Rejection::Outline { .. }) => Self::Outline,
            Some(Rejection::Further) => Self::Further,
        }
    }
}

/// The stretches of one object, in the order of time.
pub(super) fn stretches(object: usize, searches: &[Search]) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = Vec::new();
    for (k, search) in searches.iter().enumerate() {
        let (lost, doubtful) = match search.outcome {
            Outcome::Found(_) => continue,
            Outcome::Lost(_) => (1, 0),
            Outcome::Doubtful(..) => (0, 1),
        };
        match found.last_mut().filter(|stretch| k - stretch.range.end() - 1 <= MERGED_FRAMES) {
            Some(stretch) => {
                stretch.range = *stretch.range.start()..=k;
                stretch.lost += lost;
                stretch.doubtful += doubtful;
            }
            None => found.push(Stretch { object, range: k..=k, lost, doubtful }),
        }
    }
    found
}
