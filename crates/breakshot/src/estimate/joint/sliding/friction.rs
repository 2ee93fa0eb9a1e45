//! The friction of each object over all clips, and whether its deceleration is Coulomb's (Eq. 29 and 30).

use crate::estimate::joint::random_effects::{BetweenClipStd, Group, between_clip_std, groups_of_kind};
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use crate::estimate::measure::sliding::drag::Drag;
use crate::ordered_map::map_of;
use crate::statistics::median;
use std::collections::{BTreeMap, BTreeSet};

/// The friction of an object is refused beyond this fraction of drag, or this relative standard deviation from clip to
/// clip.
const MAX_DRAG: f64 = 0.3;
const MAX_BETWEEN_CLIP_STD: f64 = 0.3;
/// Either must also exceed this many times its own uncertainty.
const SIGNIFICANT: f64 = 4.0;

/// The mean friction of every object that slides in a clip.
pub(crate) fn means(clips: &[Measurements]) -> BTreeMap<String, f64> {
    let (groups, typical) = groups(clips);
    map_of(groups.into_iter().filter_map(|(object, group)| Some((object, group.mean(typical)?.value))))
}

fn groups(clips: &[Measurements]) -> (BTreeMap<String, Group>, BetweenClipStd) {
    let groups = map_of(groups_of_kind(clips, Quantity::FRICTION).filter_map(|(key, _, group)| match key {
        Quantity::Friction(object) => Some((object.clone(), group)),
        _ => None,
    }));
    let typical = between_clip_std(&groups.values().cloned().collect::<Vec<_>>());
    (groups, typical)
}

/// The objects whose deceleration is not Coulomb's, with the evidence.
///
/// `non_coulomb` lists an object once for every clip whose fit already found that.
pub(crate) fn refused(
    clips: &[Measurements],
    drags: &[Drag],
    non_coulomb: &[&String],
) -> BTreeMap<String, String> {
    let mut refused = BTreeMap::new();
    let coulomb = groups(clips).0;
    for object in non_coulomb.iter().copied().collect::<BTreeSet<_>>() {
        let count = non_coulomb.iter().filter(|name| **name == object).count();
        let total = count + coulomb.get(object).map_or(0, |group| group.values.len());
        if 2 * count > total {
            refused.insert(
                object.clone(),
                format!("its deceleration is not Coulomb's in {count} of {total} clips"),
            );
        }
    }
    let mut fractions: BTreeMap<&str, Group> = BTreeMap::new();
    for drag in drags {
        let group = fractions.entry(&drag.object).or_insert(Group { scale: 1.0, ..Group::default() });
        group.values.push(drag.fraction);
    }
    for (object, group) in fractions {
        let own = between_clip_std(std::slice::from_ref(&group));
        let Some(mean) = group.mean(own) else { continue };
        if mean.value.abs() > MAX_DRAG && mean.value.abs() > SIGNIFICANT * mean.standard_error {
            let grows = if mean.value > 0.0 { "grows" } else { "falls" };
            refused.entry(object.to_owned()).or_insert_with(|| {
                format!(
                    "its deceleration {grows} with speed: {:.0} % of the constant part at the highest speed (+- {:.0} %)",
                    mean.value.abs() * 100.0,
                    mean.standard_error * 100.0
                )
            });
        }
    }
    for (object, group) in coulomb {
        let own = between_clip_std(std::slice::from_ref(&group));
        let noise = median(group.values.iter().map(|m| m.std / group.scale)).unwrap_or(0.0);
        if own.relative > MAX_BETWEEN_CLIP_STD && own.relative > SIGNIFICANT * noise && group.values.len() > 3
        {
            refused
                .entry(object)
                .or_insert_with(|| format!("it differs from clip to clip by {:.0} %", own.relative * 100.0));
        }
    }
    refused
}
