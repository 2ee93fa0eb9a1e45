//! What the single clips said, quantity by quantity, as the evidence of the properties keeps it.

use crate::error::Result;
use crate::estimate::measure::ClipMeasurements;
use crate::estimate::measure::quantity::Quantity;
use crate::properties::Properties;

/// What one clip says of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipValue {
    /// The clip.
    pub clip: String,
    /// Which group of the properties: `friction`, `striker_restitution`, `restitution` or `pair_mass_ratio`.
    pub group: &'static str,
    /// The object or pair, as that group calls it.
    pub name: String,
    /// The value.
    pub value: f64,
    /// One standard deviation of its noise.
    pub std: f64,
}

/// What every clip says; none if the properties keep no evidence.
///
/// # Errors
/// Evidence that does not hold what it must.
pub fn clip_values(properties: &Properties) -> Result<Vec<ClipValue>> {
    let mut values = Vec::new();
    for kept in properties.evidence.iter().flat_map(|e| &e.clips) {
        let measurements = ClipMeasurements::from_kept(kept)?.measurements;
        for (k, key) in measurements.quantities.iter().enumerate() {
            let measured = measurements.measured(k);
            let (group, name) = match key {
                Quantity::Friction(object) => ("friction", object.clone()),
                Quantity::StrikerRestitution(object) => ("striker_restitution", object.clone()),
                Quantity::Restitution(a, b) => ("restitution", format!("{a}/{b}")),
                Quantity::MassRatio(a, b) => ("pair_mass_ratio", format!("{a}/{b}")),
            };
            let (value, std) = match key {
                Quantity::MassRatio(..) => (measured.value.exp(), measured.std * measured.value.exp()),
                _ => (measured.value, measured.std),
            };
            values.push(ClipValue { clip: kept.clip.clone(), group, name, value, std });
        }
    }
    Ok(values)
}
