//! The quantities that a clip measures.

use crate::properties::PropertyGroup;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A quantity that clips measure.
///
/// Serialized by its [name](Quantity::name).
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub(crate) enum Quantity {
    /// The coefficient of friction of an object against the table.
    Friction(String),
    /// The restitution between the striker and an object.
    StrikerRestitution(String),
    /// The restitution between two objects, in alphabetical order.
    Restitution(String, String),
    /// The logarithm of the mass of the first object over that of the second, in alphabetical order.
    MassRatio(String, String),
}

/// How many kinds of quantities there are; those of one kind vary equally from clip to clip.
pub(crate) const KINDS: usize = 4;

impl Quantity {
    /// The index of the kind of frictions.
    pub(crate) const FRICTION: usize = 0;
    /// The index of the kind of restitutions against the striker.
    pub(crate) const STRIKER_RESTITUTION: usize = 1;
    /// The index of the kind of restitutions of pairs.
    pub(crate) const RESTITUTION: usize = 2;
    /// The index of the kind of mass ratios.
    pub(crate) const MASS_RATIO: usize = 3;

    /// The index of its kind, below [`KINDS`].
    pub(crate) fn kind(&self) -> usize {
        match self {
            Self::Friction(_) => Self::FRICTION,
            Self::StrikerRestitution(_) => Self::STRIKER_RESTITUTION,
            Self::Restitution(..) => Self::RESTITUTION,
            Self::MassRatio(..) => Self::MASS_RATIO,
        }
    }

    /// Its name in the covariance of the properties.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Friction(object) => PropertyGroup::Friction.covariance_name(object),
            Self::StrikerRestitution(object) => PropertyGroup::StrikerRestitution.covariance_name(object),
            Self::Restitution(a, b) => PropertyGroup::Restitution.covariance_name(&format!("{a}/{b}")),
            Self::MassRatio(a, b) => format!("log_pair_mass_ratio/{a}/{b}"),
        }
    }

    /// The quantity after exchanging the names of two objects, and the factor that its value gets.
    pub(crate) fn swapped(&self, one: &str, other: &str) -> (Self, f64) {
        let swap = |name: &String| match name.as_str() {
            n if n == one => other.to_owned(),
            n if n == other => one.to_owned(),
            n => n.to_owned(),
        };
        let ordered = |a: String, b: String| if a <= b { (a, b, 1.0) } else { (b, a, -1.0) };
        match self {
            Self::Friction(object) => (Self::Friction(swap(object)), 1.0),
            Self::StrikerRestitution(object) => (Self::StrikerRestitution(swap(object)), 1.0),
            Self::Restitution(a, b) => {
                let (a, b, _) = ordered(swap(a), swap(b));
                (Self::Restitution(a, b), 1.0)
            }
            Self::MassRatio(a, b) => {
                let (a, b, sign) = ordered(swap(a), swap(b));
                (Self::MassRatio(a, b), sign)
            }
        }
    }
}

impl From<Quantity> for String {
    fn from(quantity: Quantity) -> Self {
        quantity.name()
    }
}

impl TryFrom<String> for Quantity {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        let parts: Vec<&str> = name.split('/').collect();
        match parts[..] {
            ["friction", object] => Ok(Self::Friction(object.into())),
            ["striker_restitution", object] => Ok(Self::StrikerRestitution(object.into())),
            ["restitution", a, b] => Ok(Self::Restitution(a.into(), b.into())),
            ["log_pair_mass_ratio", a, b] => Ok(Self::MassRatio(a.into(), b.into())),
            _ => Err(format!("`{name}` is no quantity")),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Friction(object) => write!(f, "friction of `{object}`"),
            Self::StrikerRestitution(object) => write!(f, "restitution of `{object}` against the striker"),
            Self::Restitution(a, b) => write!(f, "restitution of `{a}/{b}`"),
            Self::MassRatio(a, b) => write!(f, "mass ratio `{a}/{b}`"),
        }
    }
}
