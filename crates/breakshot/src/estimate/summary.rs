//! From what every clip tells to the properties and their warnings.

use super::impact::{ClipFit, Measured};
use super::joint::{Joint, exponential};
use super::reading::{Key, Readings};
use super::{Estimation, Told, contact_friction, doubt, friction};
use crate::object::{Object, kind};
use crate::properties::Properties;
use crate::uncertain::Estimate;
use std::collections::{BTreeMap, BTreeSet};

/// Contact friction of dry, hard objects if no impact tells it.
const ASSUMED_CONTACT_FRICTION: Measured = Measured { value: 0.2, std: 0.1 };

/// All clips together.
pub(super) fn estimation(told: Vec<Told>, objects: &[Object], reference: String) -> Estimation {
    let names: Vec<String> = told.iter().map(|t| t.fit.name.clone()).collect();
    let readings: Vec<Readings> = told.iter().map(|t| t.readings.clone()).collect();
    let drags: Vec<_> = told.iter().flat_map(|t| t.drags.iter().cloned()).collect();
    let grazings: Vec<_> = told.iter().flat_map(|t| t.grazings.iter().copied()).collect();
    let clips: Vec<ClipFit> = told.into_iter().map(|t| t.fit).collect();

    let (readings, contradictions) = doubt::without_contradictions(&readings, &names);
    let refused = friction::refused(&readings, &drags);
    let expected = friction::expected(&readings);
    let [of_objects, of_striker] = [false, true].map(|with_striker| {
        let some: Vec<_> = grazings.iter().copied().filter(|g| g.with_striker == with_striker).collect();
        contact_friction::coefficient(&some)
    });
    let contact =
        of_objects.map_or(ASSUMED_CONTACT_FRICTION, |e| Measured { value: e.mean, std: e.standard_error });
    let readings: Vec<Readings> = readings
        .iter()
        .map(|r| r.given_friction(&expected).without_pressing(&expected, contact.value))
        .collect();
    let joint = Joint::new(&readings, &reference, contact);

    let mut properties = properties(&joint, reference);
    properties.contact_friction.objects = of_objects;
    properties.contact_friction.striker = of_striker;
    for (object, why) in &refused {
        properties.friction.remove(object);
        properties.warnings.push(format!("friction of `{object}` is refused: {why}"));
    }
    properties.warnings.extend(contradictions);
    remove_impossible(&mut properties);
    properties.warnings.extend(absent(&properties, &clips, objects, &refused));
    for clip in &clips {
        let of_impacts = clip.impacts.iter().flat_map(|i| &i.remarks);
        properties
            .warnings
            .extend(clip.remarks.iter().chain(of_impacts).map(|r| format!("{}: {r}", clip.name)));
    }
    Estimation { properties, clips }
}

fn properties(joint: &Joint, reference: String) -> Properties {
    let mut properties = Properties { version: 1, reference: reference.clone(), ..Properties::default() };
    let mut ratios = 0;
    for (key, (group, mean)) in &joint.groups {
        match key {
            Key::Friction(object) => properties.friction.insert(object.clone(), mean.estimate(group)),
            Key::StrikerRestitution(object) => {
                properties.striker_restitution.insert(object.clone(), mean.estimate(group))
            }
            Key::Restitution(a, b) => properties.restitution.insert(format!("{a}/{b}"), mean.estimate(group)),
            Key::MassRatio(a, b) => {
                ratios += group.values.len();
                let estimate = exponential(mean, group.std(), group.values.len());
                properties.pair_mass_ratio.insert(format!("{a}/{b}"), estimate)
            }
        };
    }
    properties.mass_ratio.insert(reference, Estimate::exact(1.0));
    for (object, mean) in &joint.log_masses {
        properties.mass_ratio.insert(object.clone(), exponential(mean, None, ratios));
    }
    properties.covariance = joint.covariance.clone();
    properties
}

/// Means that no body can have are taken out, and told.
fn remove_impossible(properties: &mut Properties) {
    let warnings = &mut properties.warnings;
    let mut check = |what: &str, values: &mut BTreeMap<String, Estimate>, most: f64| {
        values.retain(|name, estimate| {
            let possible = estimate.mean >= 0.0 && estimate.mean <= most;
            if !possible {
                warnings.push(format!("{what} of `{name}` is left out: {:.3} is impossible", estimate.mean));
            }
            possible
        });
    };
    check("friction", &mut properties.friction, f64::MAX);
    check("striker restitution", &mut properties.striker_restitution, 1.0);
    check("restitution", &mut properties.restitution, 1.0);
}

/// What the clips' objects need and no clip tells.
fn absent(
    properties: &Properties,
    clips: &[ClipFit],
    objects: &[Object],
    refused: &BTreeMap<String, String>,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for name in objects.iter().map(|o| &o.name) {
        if !properties.friction.contains_key(name) && !refused.contains_key(name) {
            warnings.push(format!("friction of `{name}` is absent: no clip shows it slide"));
        }
        if !properties.striker_restitution.contains_key(name) {
            warnings.push(format!(
                "striker restitution of `{name}` is absent: in no clip the striker hits it alone"
            ));
        }
        if !properties.mass_ratio.contains_key(name) {
            let reference = &properties.reference;
            warnings
                .push(format!("mass ratio of `{name}` is absent: no impacts connect it with `{reference}`"));
        }
    }
    let filmed: BTreeSet<(&str, &str)> = clips
        .iter()
        .flat_map(|clip| {
            let kinds: Vec<&str> = clip.bodies.iter().map(|b| kind(&b.object)).collect();
            (0..kinds.len())
                .flat_map(move |i| {
                    let kinds = kinds.clone();
                    (i + 1..kinds.len()).map(move |j| (kinds[i].min(kinds[j]), kinds[i].max(kinds[j])))
                })
                .collect::<Vec<_>>()
        })
        .collect();
    let mut never = Vec::new();
    for (i, a) in objects.iter().enumerate() {
        for b in &objects[i..] {
            let (a, b) = (a.name.as_str().min(&b.name), a.name.as_str().max(&b.name));
            let key = format!("{a}/{b}");
            if properties.restitution.contains_key(&key) {
                continue;
            }
            if filmed.contains(&(a, b)) {
                warnings.push(format!("restitution of `{key}` is absent: none of its clips tells one"));
            } else if a != b {
                never.push(format!("`{key}`"));
            }
        }
    }
    if !never.is_empty() {
        warnings
            .push(format!("restitution is absent for pairs that were never filmed: {}", never.join(", ")));
    }
    for (what, value) in [
        ("objects", properties.contact_friction.objects),
        ("objects and striker", properties.contact_friction.striker),
    ] {
        if value.is_none() {
            warnings.push(format!("contact friction of {what} is absent: too few impacts off centre"));
        }
    }
    warnings
}
