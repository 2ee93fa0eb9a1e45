//! Friction against the table (Eq. 29 and 30), and whether the deceleration is Coulomb's at all.

use super::quantity::{Key, Readings, grouped};
use crate::estimate::clip::fit::Fitted;
use crate::estimate::clip::initial_guess::median;
use crate::estimate::clip::result::Measured;
use crate::estimate::joint::random_effects::{Group, Spread, spread};
use crate::geometry::Vec2;
use crate::object::kind;
use crate::physics::GRAVITY_M_S2;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// How much of an object's deceleration grows with its speed, over the Coulomb part, in one clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Drag {
    pub(crate) object: String,
    pub(crate) share: Measured,
}

/// A share of drag, or a variation of friction from clip to clip, beyond this refuses the friction.
const REFUSED_DRAG: f64 = 0.3;
const REFUSED_SPREAD: f64 = 0.3;
/// Both must exceed their own uncertainty this many times.
const SURE: f64 = 4.0;

/// Mean and spread of the friction of every object that enough clips show.
pub(crate) fn expected(clips: &[Readings]) -> BTreeMap<String, Measured> {
    const CLIPS_NEEDED: usize = 3;
    let (groups, typical) = groups(clips);
    groups
        .iter()
        .filter(|(_, group)| group.values.len() >= CLIPS_NEEDED)
        .filter_map(|(object, group)| {
            let mean = group.mean(typical)?;
            let spread = typical.relative * group.scale * mean.dispersion.sqrt();
            Some((object.clone(), Measured { value: mean.value, std: spread.hypot(mean.standard_error) }))
        })
        .collect()
}

fn groups(clips: &[Readings]) -> (BTreeMap<String, Group>, Spread) {
    let groups: BTreeMap<String, Group> = grouped(clips)
        .into_iter()
        .filter_map(|(key, places)| match key {
            Key::Friction(object) => Some((object.clone(), Group::of(clips, key, &places))),
            _ => None,
        })
        .collect();
    let typical = spread(&groups.values().cloned().collect::<Vec<_>>());
    (groups, typical)
}

/// The drag of every body that slid, as far as its clip can tell (a score test: the other parameters follow).
pub(crate) fn drags(fitted: &Fitted) -> Vec<Drag> {
    (0..fitted.model.bodies.len())
        .filter_map(|k| {
            let friction = fitted.minimum.parameters[fitted.layout.bodies[k].friction?];
            let legs = fitted.paths[k].legs();
            let speed_m_s = legs.iter().map(|leg| leg.velocity.length()).fold(0.0, f64::max);
            let deceleration = friction.abs() * GRAVITY_M_S2;
            // By how much a drag of 1/s would have moved the body by then.
            let moved = |time_s: f64| {
                legs.iter().fold(Vec2::ZERO, |sum, leg| {
                    let t = (time_s.min(leg.end_s) - leg.start_s).max(0.0);
                    let speed = leg.velocity.length();
                    let slowed = deceleration * t / (3.0 * speed.max(f64::MIN_POSITIVE));
                    sum - leg.velocity * (t * t / 2.0 * (1.0 - slowed))
                })
            };
            let (rate, std) = fitted.response(k, moved)?;
            let per_share = speed_m_s / deceleration.max(f64::MIN_POSITIVE);
            let share = Measured { value: rate * per_share, std: std * per_share };
            let object = kind(&fitted.model.bodies[k].object).to_owned();
            (share.value.is_finite() && share.std.is_finite()).then_some(Drag { object, share })
        })
        .collect()
}

/// The objects whose deceleration is not Coulomb's, with the evidence; `uneven` names an object once for every clip in
/// which it slid so.
pub(crate) fn refused(clips: &[Readings], drags: &[Drag], uneven: &[&String]) -> BTreeMap<String, String> {
    let mut refused = BTreeMap::new();
    let even = groups(clips).0;
    for object in uneven.iter().copied().collect::<BTreeSet<_>>() {
        let count = uneven.iter().filter(|name| **name == object).count();
        let slid = count + even.get(object).map_or(0, |group| group.values.len());
        if 2 * count > slid {
            refused.insert(
                object.clone(),
                format!("its deceleration is not Coulomb's in {count} of {slid} clips"),
            );
        }
    }
    let mut shares: BTreeMap<&str, Group> = BTreeMap::new();
    for drag in drags {
        let group = shares.entry(&drag.object).or_insert(Group { values: Vec::new(), scale: 1.0 });
        group.values.push(drag.share);
    }
    for (object, group) in shares {
        let own = spread(std::slice::from_ref(&group));
        let Some(mean) = group.mean(own) else { continue };
        if mean.value.abs() > REFUSED_DRAG && mean.value.abs() > SURE * mean.standard_error {
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
    for (object, group) in even {
        let own = spread(std::slice::from_ref(&group));
        let noise = median(group.values.iter().map(|m| m.std / group.scale));
        if own.relative > REFUSED_SPREAD && own.relative > SURE * noise && group.values.len() > 3 {
            refused
                .entry(object)
                .or_insert_with(|| format!("it differs from clip to clip by {:.0} %", own.relative * 100.0));
        }
    }
    refused
}
