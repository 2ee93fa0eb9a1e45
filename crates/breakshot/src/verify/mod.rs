//! Did it happen as predicted?
//!
//! Section 6 of the paper: pairwise distances after the strike, filmed beside simulated (Fig. 17).

use crate::geometry::Pose;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Predicted against observed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The file format's version.
    pub version: u32,
    /// Where every object lay before the strike, as filmed.
    pub before: BTreeMap<String, Pose>,
    /// Where it came to rest, as filmed.
    pub observed: BTreeMap<String, Pose>,
    /// Where it was predicted to come to rest.
    pub predicted: BTreeMap<String, Pose>,
}
