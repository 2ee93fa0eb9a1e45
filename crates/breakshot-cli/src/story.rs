//! What the fits of the clips tell, in the words of the report.

use breakshot::estimate::{Estimation, Impact};
use breakshot::object::{kind, pair_key};
use breakshot::verify::{self, ClipValue};

/// The name that estimates give to what strikes.
const STRIKER: &str = "striker";

/// The impacts of one clip, for the marks in its figure.
pub(crate) fn impacts(estimation: &Estimation, clip: &str) -> Vec<verify::Impact> {
    let fits = estimation.clips.iter().filter(|fit| fit.name == clip);
    fits.flat_map(|fit| &fit.impacts)
        .map(|impact| {
            let who = impact.a.as_deref().unwrap_or("something");
            verify::Impact { time_s: impact.time.value, what: format!("{who} hits {}", impact.b) }
        })
        .collect()
}

/// What every single clip says about every property, for the small dots beside the means.
pub(crate) fn clip_values(estimation: &Estimation) -> Vec<ClipValue> {
    let mut values = Vec::new();
    for fit in &estimation.clips {
        let mut say = |property: String, value: f64| {
            values.push(ClipValue { property, clip: fit.name.clone(), value });
        };
        for body in &fit.bodies {
            if let Some(friction) = body.friction {
                say(format!("friction/{}", kind(&body.object)), friction.value);
            }
        }
        for impact in &fit.impacts {
            if let (Some(property), Some(restitution)) = (restitution_name(impact), impact.restitution) {
                say(property, restitution.value);
            }
            if let (Some((property, inverse)), Some(ratio)) = (mass_ratio_name(impact), impact.mass_ratio) {
                say(property, if inverse { 1.0 / ratio.value } else { ratio.value });
            }
        }
    }
    values
}

fn restitution_name(impact: &Impact) -> Option<String> {
    match impact.a.as_deref()? {
        STRIKER => Some(format!("striker_restitution/{}", kind(&impact.b))),
        a => Some(format!("restitution/{}", pair_key(a, &impact.b))),
    }
}

/// The pair's name, and whether it names b first: ratios are given for pairs in alphabetical order.
fn mass_ratio_name(impact: &Impact) -> Option<(String, bool)> {
    let (a, b) = (kind(impact.a.as_deref()?), kind(&impact.b));
    Some((format!("pair_mass_ratio/{}", pair_key(a, b)), a > b))
}
