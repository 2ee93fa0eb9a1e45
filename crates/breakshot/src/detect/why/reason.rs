//! Why a position may be wrong, and why a region is not the object that was searched: in words for people.

use std::fmt::{Display, Formatter, Result};

/// Why the position of an object in one frame may be biased.
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// The marker's size in the picture differs from its usual one.
    Size {
        /// The largest difference of its half axes (px).
        deviation_px: f64,
    },
    /// The border of the picture cuts the marker or the outline off.
    AtBorder,
    /// A part of the outline is not visible.
    Outline {
        /// The visible fraction.
        visible: f64,
    },
    /// The marker is off the object's centre and the yaw was not measured.
    Yaw,
    /// The object may be turned by half a turn about its marker, which is off its centre.
    HalfTurn {
        /// The distance of the marker from the object's centre (m).
        off_m: f64,
    },
    /// The position is that of the visible part of the marker's outline, which determines it or the yaw badly.
    PartOfMarker {
        /// Standard deviation of the position (px).
        std_px: f64,
    },
    /// The positions scatter about smooth motion.
    Noise {
        /// Standard deviation of the position (px).
        std_px: f64,
    },
    /// The marker is covered, and the position is that of the object's own outline.
    MarkerCovered,
    /// The yaw by the marker is uncertain.
    UncertainYaw {
        /// Its standard deviation (rad).
        std_rad: f64,
    },
    /// The marker's grey levels and its outline show different positions.
    OutlineElsewhere,
    /// It is elsewhere before and after, and moved by far less in between.
    Jump {
        /// The distance to the nearer of where it is before and after (m).
        off_m: f64,
    },
    /// A region looks like the marker, and no edges of a marker's outline are around it.
    OutlineNotSeen,
    /// The light changes across the marker, as at the border of a shadow.
    UnevenLight {
        /// Possible displacement of the marker's centre (px).
        shift_px: f64,
    },
}

/// Why a region in the picture is not the object that was searched.
#[derive(Clone, Debug, PartialEq)]
pub enum Rejection {
    /// Too little contrast, or too little background around it.
    Unmeasurable,
    /// Its area differs too much from the marker's.
    Area {
        /// Its area over the expected one.
        ratio: f64,
    },
    /// Its lengths or its compactness differ too much from the marker's.
    Shape {
        /// The largest of these ratios, above 1.
        ratio: f64,
    },
    /// Its contrast differs too much from the marker's.
    Contrast {
        /// Its contrast over the marker's.
        ratio: f64,
    },
    /// It may be a part of the marker, but far from the expected place only a whole marker counts.
    FarPart {
        /// Its area times its contrast over those of the whole marker.
        ratio: f64,
    },
    /// It is far from the expected place, where the marker's outline is visible.
    VisibleElsewhere,
    /// It belongs to another object.
    Taken {
        /// The name of that object.
        by: String,
    },
    /// Too little of an outline is visible there.
    Outline {
        /// The visible fraction over the usual one.
        visible: f64,
        /// The least one that is accepted.
        needed: f64,
    },
    /// Another region was nearer to the expected place, and was refused.
    Further,
}

impl Display for Doubt {
    fn fmt(&self, f: &mut Formatter) -> Result {
        match self {
            Self::Size { deviation_px } => write!(
                f,
                "the size of its marker is {deviation_px:.1} px off the usual one: something covers a part of it, or touches it and looks alike"
            ),
            Self::AtBorder => write!(f, "the border of the picture cuts it off"),
            Self::Outline { visible } => {
                write!(f, "only {:.0} % of its outline can be seen", 100.0 * visible)
            }
            Self::Yaw => {
                write!(
                    f,
                    "the dot beside its marker is not seen: its yaw, and with it its centre, is the expected one"
                )
            }
            Self::HalfTurn { off_m } => write!(
                f,
                "its outline does not distinguish its yaw from one that is half a turn off, and its marker is {:.1} mm off its centre",
                1e3 * off_m
            ),
            Self::PartOfMarker { std_px } => write!(
                f,
                "only a part of its marker's outline is sharp: the position is known to {std_px:.2} px by it"
            ),
            Self::Noise { std_px } => {
                write!(f, "the positions scatter by {std_px:.1} px about smooth motion")
            }
            Self::MarkerCovered => {
                write!(f, "its marker is covered: the position is that of the object's own outline")
            }
            Self::UncertainYaw { std_rad } => {
                write!(f, "its yaw is known to {:.1} degrees only", std_rad.to_degrees())
            }
            Self::OutlineElsewhere => {
                write!(f, "the grey levels of its marker and the marker's outline show different positions")
            }
            Self::Jump { off_m } => write!(
                f,
                "it is {:.1} mm from where it is in the frames before and after, further than it moves between them",
                1e3 * off_m
            ),
            Self::OutlineNotSeen => {
                write!(
                    f,
                    "no outline of a marker is around its grey levels: they may be a lit or shaded part of it"
                )
            }
            Self::UnevenLight { shift_px } => write!(
                f,
                "the light changes across its marker, as at the border of a shadow: it may be {shift_px:.1} px off"
            ),
        }
    }
}

impl Display for Rejection {
    fn fmt(&self, f: &mut Formatter) -> Result {
        let percent = |ratio: &f64| format!("{:.0} %", 100.0 * ratio);
        match self {
            Self::Unmeasurable => write!(f, "it has too little contrast to what is around it"),
            Self::Area { ratio } => write!(f, "its area is {} of the marker's", percent(ratio)),
            Self::Shape { ratio } => write!(
                f,
                "its shape is not the marker's: lengths or compactness differ by a factor of {ratio:.1}"
            ),
            Self::Contrast { ratio } => write!(f, "its contrast is {} of the marker's", percent(ratio)),
            Self::FarPart { ratio } => write!(
                f,
                "it shows {} of a marker, and so far from the expected place only a whole one is accepted",
                percent(ratio)
            ),
            Self::VisibleElsewhere => {
                write!(f, "it is far from the expected place, where the outline of the marker is visible")
            }
            Self::Taken { by } => write!(f, "it belongs to `{by}`"),
            Self::Outline { visible, needed } => write!(
                f,
                "{} of what is usually visible of the outline is visible there, and {} are needed",
                percent(visible),
                percent(needed)
            ),
            Self::Further => {
                write!(f, "another region nearer to the expected place was tried instead, and refused")
            }
        }
    }
}
