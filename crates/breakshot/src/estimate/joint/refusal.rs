//! Which means are refused: those that are physically impossible, and those that the clips leave too uncertain.

use crate::properties::{Properties, PropertyGroup};
use crate::uncertain::Estimate;
use crate::warning::{Cause, Warning};
use std::collections::BTreeSet;

/// The quantities whose values are refused.
pub(crate) type Refused = BTreeSet<(PropertyGroup, String)>;

/// An interval whose ends differ by more than this factor is hardly narrower than that of a prior from other objects ...
const MAX_FACTOR: f64 = 2.0;
/// ... unless it is a restitution near zero with an interval narrower than this.
const NARROW_RESTITUTION: f64 = 0.2;

/// What was removed, and a warning for each.
pub(crate) struct Removed {
    pub(crate) refused: Refused,
    pub(crate) warnings: Vec<Warning>,
}

/// Removes the values that are impossible or too uncertain.
///
/// `double_contacts` are the pairs all of whose restitutions come from bodies that met more than once.
pub(crate) fn remove_useless(properties: &mut Properties, double_contacts: &BTreeSet<String>) -> Removed {
    let (mut refused, mut warnings) = (Refused::new(), Vec::new());
    for group in PropertyGroup::ALL {
        let useless: Vec<(String, String)> = (properties.group(group).iter())
            .filter_map(|(name, estimate)| Some((name.clone(), reason(group, estimate)?)))
            .collect();
        for (name, reason) in useless {
            let twice = group == PropertyGroup::Restitution && double_contacts.contains(&name);
            let cause = if twice { "; in all its clips they met more than once" } else { "" };
            let text = format!("{} of `{name}` {reason}{cause}", group.words());
            warnings.push(Warning::new(Cause::Uncertain, text));
            properties.remove(group, &name);
            refused.insert((group, name));
        }
    }
    let (kept, wide) = std::mem::take(&mut properties.pair_mass_ratio)
        .into_iter()
        .partition(|(_, estimate)| too_wide(estimate).is_none());
    properties.pair_mass_ratio = kept;
    for (pair, reason) in wide.iter().filter_map(|(pair, e)| Some((pair, too_wide(e)?))) {
        warnings.push(Warning::new(Cause::Uncertain, format!("mass ratio of the pair `{pair}` {reason}")));
    }
    Removed { refused, warnings }
}

/// Why the value is refused, a predicate; `None` if it is not.
fn reason(group: PropertyGroup, estimate: &Estimate) -> Option<String> {
    let is_restitution = matches!(group, PropertyGroup::Restitution | PropertyGroup::StrikerRestitution);
    let most = if is_restitution { 1.0 } else { f64::MAX };
    if estimate.mean < 0.0 || estimate.mean > most {
        return Some(format!("is left out: {:.3} is impossible", estimate.mean));
    }
    let [low, high] = estimate.interval_95;
    let narrow = is_restitution && high - low < NARROW_RESTITUTION;
    if narrow { None } else { too_wide(estimate) }
}

/// That the interval is too wide, a predicate.
fn too_wide(estimate: &Estimate) -> Option<String> {
    let [low, high] = estimate.interval_95;
    let clips = if estimate.n == 1 { "1 clip leaves".into() } else { format!("{} clips leave", estimate.n) };
    (high > MAX_FACTOR * low).then(|| {
        format!("is refused: {clips} an interval from {low:.3} to {high:.3}, wider than a factor of two")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::properties::Covariance;

    fn estimate(mean: f64, half: f64) -> Estimate {
        Estimate {
            mean,
            std: None,
            standard_error: half / 1.96,
            interval_95: [mean - half, mean + half],
            n: 1,
        }
    }

    #[test]
    fn impossible_and_wide_values_are_removed_with_a_warning_each_and_their_covariance() {
        let mut properties = Properties {
            friction: [("a".into(), estimate(0.3, 0.09)), ("b".into(), estimate(0.3, 0.11))].into(),
            striker_restitution: [("a".into(), estimate(0.06, 0.05)), ("b".into(), estimate(1.2, 0.01))]
                .into(),
            restitution: [("a/b".into(), estimate(0.5, 0.26))].into(),
            mass_ratio: [("a".into(), Estimate::exact(1.0)), ("b".into(), estimate(4.0, 3.9))].into(),
            pair_mass_ratio: [("a/b".into(), estimate(4.0, 3.9))].into(),
            covariance: Covariance {
                names: ["friction/a", "friction/b"].map(String::from).to_vec(),
                matrix: vec![vec![1.0, 2.0], vec![2.0, 4.0]],
            },
            ..Properties::default()
        };
        let Removed { refused, warnings } = remove_useless(&mut properties, &["a/b".to_owned()].into());
        let left = [&properties.friction, &properties.striker_restitution, &properties.mass_ratio];
        assert!(left.iter().all(|group| group.keys().eq(["a"])), "{properties:?}");
        assert!(properties.restitution.is_empty() && properties.pair_mass_ratio.is_empty());
        assert_eq!((properties.covariance.names.len(), refused.len()), (1, 4));
        let expected = [
            "friction of `b` is refused: 1 clip leaves an interval from 0.190 to 0.410, wider than a factor of two",
            "striker restitution of `b` is left out: 1.200 is impossible",
            "restitution of `a/b` is refused: 1 clip leaves an interval from 0.240 to 0.760, wider than a factor of two; in all its clips they met more than once",
            "mass ratio of `b` is refused: 1 clip leaves an interval from 0.100 to 7.900, wider than a factor of two",
            "mass ratio of the pair `a/b` is refused: 1 clip leaves an interval from 0.100 to 7.900, wider than a factor of two",
        ];
        assert_eq!(warnings.iter().map(Warning::to_string).collect::<Vec<_>>(), expected);
    }
}
