//! The measurements of single clips, as the evidence of the properties stores them.

use crate::error::Result;
use crate::estimate::measure::ClipMeasurements;
use crate::estimate::measure::quantity::Quantity;
use crate::properties::Properties;

/// One measurement of one clip.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipValue {
    /// The clip's name.
    pub clip: String,
    /// The group of the properties to which it belongs: `friction`, `striker_restitution`, `restitution` or `pair_mass_ratio`.
    pub group: &'static str,
    /// The object or pair, by its key in that group.
    pub name: String,
    /// The measured value.
    pub value: f64,
    /// Standard deviation of its noise.
    pub std: f64,
}

/// The measurements of all clips, in the order of the evidence; empty if the properties contain no evidence.
///
/// # Errors
/// Evidence that is damaged.
pub fn clip_values(properties: &Properties) -> Result<Vec<ClipValue>> {
    let mut values = Vec::new();
    for record in properties.evidence.iter().flat_map(|e| &e.clips) {
        let measurements = ClipMeasurements::from_evidence(record)?.measurements;
        for (k, quantity) in measurements.quantities.iter().enumerate() {
            let measured = measurements.measured(k);
            let (group, name) = match quantity {
                Quantity::Friction(object) => ("friction", object.clone()),
                Quantity::StrikerRestitution(object) => ("striker_restitution", object.clone()),
                Quantity::Restitution(a, b) => ("restitution", format!("{a}/{b}")),
                Quantity::MassRatio(a, b) => ("pair_mass_ratio", format!("{a}/{b}")),
            };
            let (value, std) = match quantity {
                Quantity::MassRatio(..) => (measured.value.exp(), measured.std * measured.value.exp()),
                _ => (measured.value, measured.std),
            };
            values.push(ClipValue { clip: record.clip.clone(), group, name, value, std });
        }
    }
    Ok(values)
}
