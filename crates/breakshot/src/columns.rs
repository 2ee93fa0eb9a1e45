//! Which columns of a table of tracks hold what (`columns` in `campaign.toml`).

use crate::error::bounds::positive;
use crate::error::{Error, Result};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Which columns of a table of tracks hold what, and in which units.
///
/// A table has one row for each object and instant, and a column with the object's name; or one row for each instant, and
/// columns of their own for each object.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Columns {
    /// The column of the time; without it the rows follow each other at the clip's `frame_rate_hz`.
    pub time: Option<String>,
    /// The unit of the time.
    #[serde(default)]
    pub time_unit: TimeUnit,
    /// The column of the object's name.
    pub object: Option<String>,
    /// What an object is called in that column, if not by its own name.
    #[serde(default)]
    pub names: BTreeMap<String, String>,
    /// The column of x.
    pub x: Option<String>,
    /// The column of y.
    pub y: Option<String>,
    /// The column of the yaw, if any.
    pub yaw: Option<String>,
    /// The columns of each object, in a table with one row for each instant.
    #[serde(default)]
    pub objects: BTreeMap<String, ObjectColumns>,
    /// The unit of x, y and of the column `std`.
    #[serde(default)]
    pub length_unit: LengthUnit,
    /// The unit of the yaw.
    #[serde(default)]
    pub angle_unit: AngleUnit,
    /// The column of the standard deviation of a position along each axis, if any.
    pub std: Option<String>,
    /// The standard deviation of all positions along each axis (m), if it is known.
    pub std_m: Option<f64>,
}

/// The columns of one object.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectColumns {
    /// The column of x.
    pub x: String,
    /// The column of y.
    pub y: String,
    /// The column of the yaw, if any.
    pub yaw: Option<String>,
}

/// A unit of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TimeUnit {
    /// Seconds.
    #[default]
    S,
    /// Milliseconds.
    Ms,
    /// Microseconds.
    Us,
    /// Nanoseconds.
    Ns,
}

impl TimeUnit {
    /// How many of them are a second.
    pub fn per_second(self) -> f64 {
        match self {
            Self::S => 1.0,
            Self::Ms => 1e3,
            Self::Us => 1e6,
            Self::Ns => 1e9,
        }
    }
}

/// A unit of length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LengthUnit {
    /// Metres.
    #[default]
    M,
    /// Centimetres.
    Cm,
    /// Millimetres.
    Mm,
}

impl LengthUnit {
    /// How many of them are a metre.
    pub fn per_metre(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 1e2,
            Self::Mm => 1e3,
        }
    }
}

/// A unit of angles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AngleUnit {
    /// Radians.
    #[default]
    Rad,
    /// Degrees.
    Deg,
}

impl AngleUnit {
    /// An angle in this unit, in radians.
    pub fn radians(self, angle: f64) -> f64 {
        match self {
            Self::Rad => angle,
            Self::Deg => angle.to_radians(),
        }
    }
}

impl Columns {
    /// The columns that `breakshot detect` writes.
    pub fn of_detect() -> Self {
        let name = |name: &str| Some(name.to_owned());
        Self {
            time: name("time_s"),
            object: name("object"),
            x: name("x_m"),
            y: name("y_m"),
            yaw: name("yaw_rad"),
            std: name("std_m"),
            ..Self::default()
        }
    }

    /// Checks that these columns give the positions and the times of a clip's objects.
    ///
    /// # Errors
    /// Neither or both kinds of tables, an object of the clip without columns, neither a time nor a rate; `owner` names the
    /// clip.
    pub fn check(&self, owner: &str, objects: &[String], frame_rate_hz: Option<f64>) -> Result<()> {
        let owner = format!("{owner}: columns");
        let shared = [("object", &self.object), ("x", &self.x), ("y", &self.y)];
        if self.objects.is_empty() {
            if let Some((key, _)) = shared.iter().find(|(_, column)| column.is_none()) {
                let needed =
                    "object, x and y; or, for one row an instant, objects = { NAME = { x, y, yaw }, .. }";
                return Err(Error::invalid(owner, *key, "missing", needed));
            }
        } else {
            let rows = shared.iter().find(|(_, column)| column.is_some()).map(|(key, _)| *key);
            let rows =
                rows.or(self.yaw.is_some().then_some("yaw")).or((!self.names.is_empty()).then_some("names"));
            if let Some(key) = rows {
                let needed =
                    "only `objects` for one row an instant, or only `object`, `x`, `y` for one row an object";
                return Err(Error::invalid(owner, key, "given beside `objects`", needed));
            }
            if let Some(name) = objects.iter().find(|name| !self.objects.contains_key(*name)) {
                let needed = format!("`{name} = {{ x = \"..\", y = \"..\" }}`");
                return Err(Error::invalid(owner, "objects", format!("without `{name}`"), needed));
            }
        }
        if self.time.is_none() && frame_rate_hz.is_none() {
            let needed = "the column of the time, or frame_rate_hz in the clip";
            return Err(Error::invalid(owner, "time", "missing", needed));
        }
        if self.std.is_some() && self.std_m.is_some() {
            return Err(Error::invalid(owner, "std_m", "given beside `std`", "one of them"));
        }
        self.std_m.map_or(Ok(()), |std_m| positive(&owner, "std_m", std_m))
    }
}
