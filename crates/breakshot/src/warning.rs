//! What a warning is about, and what a user can do about it.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Why a campaign gives warnings, in the order in which a user should look at them: an earlier cause may be the reason for warnings
/// with a later one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Times of the films and speeds of the strikes contradict each other.
    FrameRate,
    /// The lens in a film and that of the cell contradict each other, or the lens changes in a film.
    Lens,
    /// Lengths on the table and sizes of the objects contradict each other.
    Lengths,
    /// Given strikes do not fit the films.
    GivenStrike,
    /// The camera moved during clips.
    CameraMotion,
    /// Films that begin after the strike.
    Cut,
    /// Clips that could not be used.
    Unreadable,
    /// Objects that were lost or found doubtfully.
    Tracking,
    /// Clips that contradict the other clips.
    Contradiction,
    /// Motion that the laws of sliding and impact do not describe, or that shows no single value.
    Motion,
    /// Values that the clips leave too uncertain.
    Uncertain,
    /// Values that no clip measures.
    NotMeasured,
}

impl Cause {
    /// Whether one of the causes that are none may be the reason for its warnings.
    pub(crate) fn is_consequence(self) -> bool {
        self >= Self::Contradiction
    }

    /// What is wrong and what to do, for this many clips.
    fn summary(self, clips: usize) -> String {
        let in_clips = match clips {
            0 => String::new(),
            1 => " in 1 clip".to_owned(),
            n => format!(" in {n} clips"),
        };
        let (what, remedy) = match self {
            Self::FrameRate => (
                "frame rates and given speeds do not fit each other",
                "set frame_rate_hz to the rate at which the films were taken, or correct strike.speed_m_s",
            ),
            Self::Lens => (
                "the lens in the film is doubtful",
                "correct or remove the lens in the cell, which is used if it gives one",
            ),
            Self::Lengths => (
                "lengths on the table and sizes of objects do not fit each other",
                "check size_m and center_m of the tags, and the outlines and heights of the objects",
            ),
            Self::GivenStrike => (
                "the given strike does not fit the film",
                "correct start_m, heading_rad, speed_m_s or travel_m of the strike",
            ),
            Self::CameraMotion => (
                "the camera moved",
                "its motion is taken out of the tracks; fasten the camera before further clips are filmed",
            ),
            Self::Cut => (
                "the film begins after the strike",
                "only what it shows is used; use the whole film, from before the strike on",
            ),
            Self::Unreadable => (
                "nothing could be measured",
                "correct what is named for each, or remove the clip from the campaign",
            ),
            Self::Tracking => (
                "objects are lost or found doubtfully",
                "`breakshot detect FILM --overlay` draws where; doubtful positions are not used",
            ),
            Self::Contradiction => (
                "values contradict those of the other clips",
                "compare the names of the objects and the strike of each with its film; what contradicts is left out",
            ),
            Self::Motion => (
                "a part of the motion gives no value",
                "nothing needs to be done unless a value is missing in the end",
            ),
            Self::Uncertain => (
                "values are impossible or too uncertain to be given",
                "film more clips that show them; `breakshot estimate --advise 5` names the best ones",
            ),
            Self::NotMeasured => (
                "values are not measured by any clip, and are assumed in plans",
                "film clips that show them; `breakshot estimate --advise 5` names the best ones",
            ),
        };
        format!("{what}{in_clips}: {remedy}")
    }
}

/// One warning of a campaign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// What it is about.
    pub cause: Cause,
    /// The clip that it concerns; `None` if it concerns several or all.
    pub clip: Option<String>,
    /// What was found, without the name of the clip.
    pub text: String,
}

impl Warning {
    /// A warning about the whole campaign.
    pub fn new(cause: Cause, text: impl Into<String>) -> Self {
        Self { cause, clip: None, text: text.into() }
    }

    /// A warning about one clip.
    pub fn of_clip(cause: Cause, clip: &str, text: impl Into<String>) -> Self {
        Self { clip: Some(clip.to_owned()), ..Self::new(cause, text) }
    }
}

/// The text, after the name of the clip and a colon if it concerns one.
impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.clip {
            Some(clip) => write!(f, "{clip}: {}", self.text),
            None => f.write_str(&self.text),
        }
    }
}

/// The warnings that have one cause.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WarningGroup {
    /// The cause.
    pub cause: Cause,
    /// What is wrong and what to do.
    pub summary: String,
    /// The clips that single warnings concern, each once, in the order of the warnings.
    pub clips: Vec<String>,
    /// The number of warnings.
    pub warnings: usize,
}

/// Warnings as lines, with a group for each cause.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct GroupedWarnings {
    /// The lines: those of one cause together, in the order of the causes.
    pub lines: Vec<String>,
    /// The causes in the order of their lines.
    pub causes: Vec<WarningGroup>,
}

impl From<Vec<Warning>> for GroupedWarnings {
    fn from(mut warnings: Vec<Warning>) -> Self {
        warnings.sort_by_key(|warning| warning.cause);
        let mut causes: Vec<WarningGroup> = Vec::new();
        for same in warnings.chunk_by(|a, b| a.cause == b.cause) {
            let (cause, mut named) = (same[0].cause, BTreeSet::new());
            let clips: Vec<String> = same
                .iter()
                .filter_map(|w| w.clip.clone().filter(|clip| named.insert(clip.clone())))
                .collect();
            let follows = cause.is_consequence() && causes.iter().any(|group| !group.cause.is_consequence());
            let hint = if follows { "; the causes before may explain this" } else { "" };
            let summary = cause.summary(clips.len()) + hint;
            causes.push(WarningGroup { cause, summary, clips, warnings: same.len() });
        }
        Self { lines: warnings.iter().map(Warning::to_string).collect(), causes }
    }
}

/// Each cause with its lines; lines that no cause counts are left out.
pub fn by_cause<'a>(
    lines: &'a [String],
    causes: &'a [WarningGroup],
) -> impl Iterator<Item = (&'a WarningGroup, &'a [String])> {
    causes.iter().scan(lines, |rest, group| {
        let (own, others) = rest.split_at(group.warnings.min(rest.len()));
        *rest = others;
        Some((group, own))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_of_one_cause_are_together_the_first_cause_in_front() {
        let warnings = vec![
            Warning::new(Cause::NotMeasured, "friction of `b`"),
            Warning::of_clip(Cause::GivenStrike, "1.mp4", "`a` leaves to the left"),
            Warning::of_clip(Cause::Contradiction, "1.mp4", "left out"),
            Warning::of_clip(Cause::GivenStrike, "2.mp4", "`a` leaves to the right"),
            Warning::of_clip(Cause::GivenStrike, "1.mp4", "`a` is slow"),
        ];
        let GroupedWarnings { lines, causes: groups } = warnings.into();
        let expected_lines = [
            "1.mp4: `a` leaves to the left",
            "2.mp4: `a` leaves to the right",
            "1.mp4: `a` is slow",
            "1.mp4: left out",
            "friction of `b`",
        ];
        assert_eq!(lines, expected_lines);
        let sizes: Vec<_> = groups.iter().map(|g| (g.cause, g.clips.len(), g.warnings)).collect();
        let expected = [(Cause::GivenStrike, 2, 3), (Cause::Contradiction, 1, 1), (Cause::NotMeasured, 0, 1)];
        assert_eq!(sizes, expected);
        assert!(groups[0].summary.starts_with("the given strike does not fit the film in 2 clips: correct"));
        let own: Vec<&[String]> = by_cause(&lines, &groups).map(|(_, own)| own).collect();
        assert_eq!(own, [&expected_lines[..3], &expected_lines[3..4], &expected_lines[4..]]);
        assert!(groups[1].summary.ends_with("; the causes before may explain this"), "{}", groups[1].summary);
    }
}
