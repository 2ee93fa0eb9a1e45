//! The properties and their warnings from the measurements of all clips.

use super::means::{JointMeans, exponential};
use super::refusal::{self, Refused};
use super::sliding::tilt::Slope;
use super::sliding::{friction, support};
use super::{conditioning, contact_friction, outliers};
use crate::estimate::clip::result::Measured;
use crate::estimate::measure::ClipMeasurements;
use crate::estimate::measure::measurements::{Measurements, grouped, without_replaceable_double_contacts};
use crate::estimate::measure::quantity::Quantity;
use crate::object::{Object, kind};
use crate::ordered_map::map_of;
use crate::properties::{
    ContactFriction, Properties, PropertyGroup, TangentialDamping, TangentialRestitution,
};
use crate::uncertain::Estimate;
use crate::warning::{Cause, Warning};
use std::collections::{BTreeMap, BTreeSet};

/// The properties of all objects from the measurements of all clips, without evidence.
///
/// Absent, refused and excluded values are listed in the warnings.
pub(crate) fn properties(
    clips: &[&ClipMeasurements],
    objects: &[Object],
    reference: &str,
) -> (Properties, Vec<Warning>) {
    let names: Vec<String> = clips.iter().map(|c| c.name.clone()).collect();
    let measurements: Vec<Measurements> = clips.iter().map(|c| c.measurements.clone()).collect();
    let tilt = Slope::new(&clips.iter().map(|c| c.tilt).collect::<Vec<_>>(), &measurements);
    let tilt = tilt.map(|slope| (slope, slope.tilt(least_friction(&measurements))));
    let slope = tilt.filter(|(_, tilt)| !tilt.level).map(|(slope, _)| slope);
    let measurements = match &slope {
        Some(slope) => measurements.iter().map(|m| m.on_slope(slope.value)).collect(),
        None => measurements,
    };
    let drags: Vec<_> = clips.iter().flat_map(|c| c.drags.iter().cloned()).collect();

    // Outliers and laws of friction
    let measurements = without_replaceable_double_contacts(&measurements);
    let (measurements, contradictions) = outliers::without_outliers(&measurements, &names);
    // A clip that contradicts all others gives neither contact friction nor a support.
    let kept: Vec<&ClipMeasurements> = (clips.iter().zip(&measurements))
        .filter(|(_, kept)| !kept.quantities.is_empty())
        .map(|(clip, _)| *clip)
        .collect();
    let oblique_impacts: Vec<_> = kept.iter().flat_map(|clip| clip.oblique_impacts.iter().cloned()).collect();
    let in_clips: Vec<&String> = clips.iter().flat_map(|c| &c.non_coulomb).collect();
    let non_coulomb = friction::refused(&measurements, &drags, &in_clips);

    // Corrections that need the frictions of all clips
    let frictions = friction::means(&measurements);
    let restitutions = mean_restitutions(&measurements);
    let [between_objects, of_striker] = [false, true].map(|with_striker| {
        let impacts: Vec<_> =
            oblique_impacts.iter().filter(|i| i.with_striker == with_striker).cloned().collect();
        contact_friction::contact_law(&impacts, &restitutions)
    });
    let contact = between_objects.friction.unwrap_or(ContactFriction::assumed());
    let contact = Measured { value: contact.mean, std: contact.standard_error };
    let measurements: Vec<Measurements> = conditioning::conditioned_on_other_clips(&measurements)
        .iter()
        .map(|m| m.corrected_for_table_friction(&frictions, contact.value))
        .collect();

    // Means
    let joint = JointMeans::new(&measurements, reference, contact, slope.as_ref());
    let mut properties = from_means(&joint, &measurements, reference.to_owned());
    properties.contact_friction =
        ContactFriction { objects: between_objects.friction, striker: of_striker.friction };
    properties.tangential_restitution = TangentialRestitution {
        objects: between_objects.tangential_restitution,
        striker: of_striker.tangential_restitution,
    };
    properties.tangential_damping =
        TangentialDamping { objects: Some(between_objects.damping), striker: Some(of_striker.damping) };

    properties.tilt = tilt.map(|(_, tilt)| tilt);
    properties.support = support::supports(kept.iter().map(|clip| clip.supports.as_slice()));

    // Refused and impossible values, warnings
    let mut warnings = contradictions;
    for (object, why) in &non_coulomb {
        properties.remove(PropertyGroup::Friction, object);
        warnings.push(Warning::new(Cause::Motion, format!("friction of `{object}` is refused: {why}")));
    }
    let double_contacts = double_contacts(&measurements);
    let removed = refusal::remove_useless(&mut properties, &double_contacts);
    warnings.extend(removed.warnings);
    let mut refused = removed.refused;
    refused.extend(non_coulomb.into_keys().map(|object| (PropertyGroup::Friction, object)));
    let uncertain = double_contact_warnings(&double_contacts, &refused);
    warnings.extend(uncertain.into_iter().map(|text| Warning::new(Cause::Uncertain, text)));
    let absent = absence_warnings(&properties, clips, objects, &refused);
    warnings.extend(absent.into_iter().map(|text| Warning::new(Cause::NotMeasured, text)));
    for clip in clips {
        warnings.extend(clip.remarks.iter().map(|r| Warning::of_clip(Cause::Motion, &clip.name, r)));
    }
    (properties, warnings)
}

/// The mean restitution of each pair and, by the object's name, with the striker.
fn mean_restitutions(measurements: &[Measurements]) -> BTreeMap<String, f64> {
    map_of(grouped(measurements).into_iter().filter_map(|(quantity, indices)| {
        let name = match quantity {
            Quantity::Restitution(a, b) => format!("{a}/{b}"),
            Quantity::StrikerRestitution(object) => object.clone(),
            Quantity::Friction(_) | Quantity::MassRatio(..) => return None,
        };
        let sum: f64 = indices.iter().map(|&(clip, k)| measurements[clip].values[k]).sum();
        Some((name, sum / indices.len() as f64))
    }))
}

/// The least friction that any clip shows; 0 without any.
fn least_friction(measurements: &[Measurements]) -> f64 {
    let frictions = measurements.iter().flat_map(|m| m.quantities.iter().zip(m.values.iter()));
    let frictions = frictions.filter(|(quantity, _)| matches!(quantity, Quantity::Friction(_)));
    let least = frictions.map(|(_, value)| *value).fold(f64::INFINITY, f64::min);
    if least.is_finite() { least.max(0.0) } else { 0.0 }
}

/// The properties with these means and their covariance.
fn from_means(joint: &JointMeans, measurements: &[Measurements], reference: String) -> Properties {
    let mut properties = Properties { version: 1, reference: reference.clone(), ..Properties::default() };
    for (quantity, (group, mean)) in &joint.groups {
        match quantity {
            Quantity::Friction(object) => properties.friction.insert(object.clone(), mean.estimate(group)),
            Quantity::StrikerRestitution(object) => {
                properties.striker_restitution.insert(object.clone(), mean.estimate(group))
            }
            Quantity::Restitution(a, b) => {
                properties.restitution.insert(format!("{a}/{b}"), mean.estimate(group))
            }
            Quantity::MassRatio(a, b) => {
                let estimate = exponential(mean, mean.std(group), group.clips);
                properties.pair_mass_ratio.insert(format!("{a}/{b}"), estimate)
            }
        };
    }
    properties.mass_ratio.insert(reference, Estimate::exact(1.0));
    for (object, mean) in &joint.log_masses {
        properties
            .mass_ratio
            .insert(object.clone(), exponential(mean, None, clips_with_mass_ratio(measurements, object)));
    }
    properties.covariance = joint.covariance.clone();
    properties
}

/// The pairs all of whose restitutions come from bodies that met more than once.
fn double_contacts(measurements: &[Measurements]) -> BTreeSet<String> {
    let twice = measurements
        .iter()
        .flat_map(|m| m.quantities.iter().zip(&m.double_contact).filter(|(_, twice)| **twice));
    let pair = |quantity: &Quantity| match quantity {
        Quantity::Restitution(a, b) => Some(format!("{a}/{b}")),
        _ => None,
    };
    twice.filter_map(|(quantity, _)| pair(quantity)).collect()
}

/// Warnings about the restitutions that come from double contacts and are not refused.
fn double_contact_warnings(pairs: &BTreeSet<String>, refused: &Refused) -> Vec<String> {
    let kept = pairs.iter().filter(|pair| !refused.contains(&(PropertyGroup::Restitution, (*pair).clone())));
    let warning = |pair| {
        format!(
            "restitution of `{pair}` is only known within wide bounds: in all its clips they met more than once"
        )
    };
    kept.map(warning).collect()
}

/// Number of clips with an impact between the object and one of another kind.
fn clips_with_mass_ratio(measurements: &[Measurements], object: &str) -> usize {
    let concerns = |quantity: &Quantity| matches!(quantity, Quantity::MassRatio(a, b) if a != b && (a == object || b == object));
    measurements.iter().filter(|m| m.quantities.iter().any(concerns)).count()
}

/// Warnings about quantities of these objects that no clip measures.
fn absence_warnings(
    properties: &Properties,
    clips: &[&ClipMeasurements],
    objects: &[Object],
    refused: &Refused,
) -> Vec<String> {
    let is_absent = |group: PropertyGroup, name: &str| {
        !properties.group(group).contains_key(name) && !refused.contains(&(group, name.to_owned()))
    };
    let mut warnings = Vec::new();
    for name in objects.iter().map(|o| &o.name) {
        if is_absent(PropertyGroup::Friction, name) {
            warnings.push(format!("friction of `{name}` is absent: no clip shows it slide"));
        }
        if is_absent(PropertyGroup::StrikerRestitution, name) {
            warnings.push(format!(
                "striker restitution of `{name}` is absent: in no clip the striker hits it alone"
            ));
        }
        if is_absent(PropertyGroup::MassRatio, name) {
            let reference = &properties.reference;
            warnings
                .push(format!("mass ratio of `{name}` is absent: no impacts connect it with `{reference}`"));
        }
    }
    let filmed: BTreeSet<(&str, &str)> = clips
        .iter()
        .flat_map(|clip| {
            let kinds: Vec<&str> = clip.objects.iter().map(|name| kind(name)).collect();
            (0..kinds.len())
                .flat_map(move |i| {
                    let kinds = kinds.clone();
                    (i + 1..kinds.len()).map(move |j| (kinds[i].min(kinds[j]), kinds[i].max(kinds[j])))
                })
                .collect::<Vec<_>>()
        })
        .collect();
    let mut never_filmed = Vec::new();
    for (i, a) in objects.iter().enumerate() {
        for b in &objects[i..] {
            let (a, b) = (a.name.as_str().min(&b.name), a.name.as_str().max(&b.name));
            let key = format!("{a}/{b}");
            if !is_absent(PropertyGroup::Restitution, &key) {
                continue;
            }
            if filmed.contains(&(a, b)) {
                warnings.push(format!("restitution of `{key}` is absent: none of its clips measures one"));
            } else if a != b {
                never_filmed.push(format!("`{key}`"));
            }
        }
    }
    if !never_filmed.is_empty() {
        warnings.push(format!(
            "restitution is absent for pairs that were never filmed: {}",
            never_filmed.join(", ")
        ));
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

#[cfg(test)]
mod tests {
    use crate::cell::{CameraSpec, Cell, Striker, Workspace};
    use crate::detect::{Sample, Track, Tracks};
    use crate::estimate::{ClipTracks, Options, estimation};
    use crate::geometry::{Point, Vec2};
    use crate::object::{Marker, Object, Shape};
    use crate::physics::GRAVITY_M_S2;
    use crate::scene::Strike;

    const STRIKER_M: f64 = 0.015;
    const RADIUS_M: f64 = 0.03;
    const FRAME_S: f64 = 1.0 / 60.0;

    fn object(name: &str) -> Object {
        let shape = Shape::Disc { radius_m: RADIUS_M };
        let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.01 }));
        Object { name: name.into(), shape, height_m: 0.04, marker, mass_kg: None, support: None }
    }

    fn cell() -> Cell {
        let striker = Striker { retract_speed_m_s: 0.1, ..Striker::rod(STRIKER_M, [0.1, 1.0]) };
        let camera = CameraSpec { exposure_s: Some(1e-4), ..CameraSpec::default() };
        Cell { camera, ..Cell::from_above(1000.0, Workspace::centred([2.0, 2.0]), striker) }
    }

    /// Distance of a slide after a time, and the speed at that time.
    fn slid(speed: f64, friction: f64, after_s: f64) -> (f64, f64) {
        let a = friction * GRAVITY_M_S2;
        let t = after_s.clamp(0.0, speed / a);
        (speed * t - a * t * t / 2.0, if after_s >= 0.0 { speed - a * t } else { 0.0 })
    }

    /// The striker (0.5 m/s, restitution 0.6) hits `a`, which hits `b` after 30 mm; both impacts central, along the heading.
    ///
    /// Frictions 0.2 and 0.3, mass ratio a/b 2, restitution 0.5.
    fn clip(name: &str, objects: [&str; 2], heading_rad: f64, phase_s: f64) -> ClipTracks {
        let (gap_m, first_s, v_a) = (0.03, 0.2 + phase_s, 0.5 * 1.6);
        let a = 0.2 * GRAVITY_M_S2;
        let second_s = first_s + (v_a - (v_a * v_a - 2.0 * a * gap_m).sqrt()) / a;
        let hit = slid(v_a, 0.2, second_s - first_s).1;
        let (after_a, after_b) = (hit * (1.0 - 1.5 / 3.0), hit * 1.5 * 2.0 / 3.0);
        let along = Vec2::from_heading(heading_rad);
        let noise = |k: usize, part: f64| {
            5e-6 * ((k as f64 * 12.9898 + part * 78.233 + phase_s * 1e4).sin() * 43758.5).sin()
        };
        let track = |n: usize| Track {
            object: objects[n].into(),
            samples: (0..60)
                .map(|k| {
                    let t = k as f64 * FRAME_S;
                    let distance_m = match n {
                        0 if t < second_s => slid(v_a, 0.2, t - first_s).0,
                        0 => gap_m + slid(after_a, 0.2, t - second_s).0,
                        _ => 2.0 * RADIUS_M + gap_m + slid(after_b, 0.3, t - second_s).0,
                    };
                    let position = Point::ORIGIN + along * distance_m;
                    let error = Vec2::new(noise(k, n as f64), noise(k, n as f64 + 7.0));
                    Sample::new(t, position + error, None, 5e-6)
                })
                .collect(),
        };
        let strike = Strike {
            object: None,
            start_m: Point::ORIGIN - along * (RADIUS_M + STRIKER_M + 0.03),
            heading_rad,
            speed_m_s: 0.5,
            travel_m: 0.035,
        };
        ClipTracks {
            name: name.into(),
            objects: objects.map(String::from).to_vec(),
            strike: Some(strike),
            tracks: Tracks { version: 1, tracks: vec![track(0), track(1)], ..Tracks::default() },
        }
    }

    fn clips(objects: [&str; 2], heading_rad: f64) -> Vec<ClipTracks> {
        (0..5u32).map(|k| clip(&format!("{k}.mp4"), objects, heading_rad, f64::from(k) * 0.0031)).collect()
    }

    fn close(what: &str, value: f64, truth: f64) {
        assert!((value / truth - 1.0).abs() < 0.01, "{what}: {value}, not {truth}");
    }

    #[test]
    fn clips_of_known_truth_give_it_back() {
        let found =
            estimation(&clips(["a", "b"], 0.4), &cell(), &[object("a"), object("b")], &Options::default());
        let properties = found.expect("an estimation").properties;
        close("friction of a", properties.friction["a"].mean, 0.2);
        close("friction of b", properties.friction["b"].mean, 0.3);
        close("striker restitution", properties.striker_restitution["a"].mean, 0.6);
        close("restitution", properties.restitution["a/b"].mean, 0.5);
        // Bodies of the same height: the correction assumes that a quarter of contact friction acts vertically.
        let correction = f64::exp(0.25 * 0.2 * (0.2 - 0.3));
        close("mass ratio a/b", properties.pair_mass_ratio["a/b"].mean * correction, 2.0);
        assert_eq!(properties.mass_ratio["b"].n, 5);
    }

    #[test]
    fn rotating_the_table_leaves_the_restitution_unchanged() {
        let objects = [object("a"), object("b")];
        let means = [0.0, 2.5].map(|heading_rad| {
            let found = estimation(&clips(["a", "b"], heading_rad), &cell(), &objects, &Options::default());
            found.expect("an estimation").properties.restitution["a/b"].mean
        });
        close("restitution on the rotated table", means[1], means[0]);
    }

    #[test]
    fn swapping_the_names_inverts_the_mass_ratio() {
        let objects = [object("a"), object("b")];
        let ratio = |names| {
            let found = estimation(&clips(names, 0.4), &cell(), &objects, &Options::default());
            found.expect("an estimation").properties.pair_mass_ratio["a/b"].mean
        };
        close("product of the ratios", ratio(["a", "b"]) * ratio(["b", "a"]), 1.0);
    }

    #[test]
    fn missing_frames_and_outliers_change_little() {
        let mut clips = clips(["a", "b"], 0.4);
        for clip in &mut clips {
            for track in &mut clip.tracks.tracks {
                track.samples[20].x_m += 0.004;
                track.samples.retain(|s| (s.time_s / FRAME_S).round() as u32 % 9 != 4);
            }
        }
        let found = estimation(&clips, &cell(), &[object("a"), object("b")], &Options::default());
        let properties = found.expect("an estimation").properties;
        assert!((properties.friction["b"].mean / 0.3 - 1.0).abs() < 0.03, "{:?}", properties.friction["b"]);
    }

    #[test]
    fn tracks_too_short_to_measure_anything_give_warnings_and_no_panic() {
        let objects = [object("a"), object("b")];
        let whole = clip("c.mp4", ["a", "b"], 0.0, 0.0);
        for samples in [0, 1, 2, 5, 13, 14, 16] {
            let mut clip = whole.clone();
            for track in &mut clip.tracks.tracks {
                track.samples.truncate(samples);
            }
            let found = estimation(&[clip], &cell(), &objects, &Options::default());
            let properties = found.expect("an estimation").properties;
            assert!(!properties.warnings.is_empty(), "{samples} samples");
            properties.check("properties").expect("nothing impossible");
        }
    }

    #[test]
    fn outlines_that_overlap_at_an_impact_widen_its_restitution() {
        let found = |radius_m: f64| {
            let objects = ["a", "b"].map(|name| Object { shape: Shape::Disc { radius_m }, ..object(name) });
            estimation(&clips(["a", "b"], 0.4), &cell(), &objects, &Options::default())
                .expect("an estimation")
        };
        for radius_m in [RADIUS_M, RADIUS_M + 5e-4] {
            let [low, high] = found(radius_m).properties.restitution["a/b"].interval_95;
            assert!(high - low < 0.05, "{low} to {high}");
        }
        // Both outlines are 1 mm too large: the interval is wider than a factor of two.
        let found = found(RADIUS_M + 1e-3);
        let warnings = &found.properties.warnings;
        let is_refused =
            |w: &String| w.starts_with("restitution of `a/b` is refused") && w.ends_with("more than once");
        let refused = warnings.iter().find(|w| is_refused(w)).expect("a refusal");
        let ends: Vec<f64> = refused.split([' ', ',']).filter_map(|word| word.parse().ok()).skip(1).collect();
        assert!(ends.len() == 2 && ends[1] - ends[0] > 0.3, "{refused}");
        let remarks: Vec<&String> = found.clips[0].impacts.iter().flat_map(|i| &i.remarks).collect();
        assert!(remarks.iter().any(|r| r.contains("overlap by 2.0 mm")), "{remarks:?}");
    }

    #[test]
    fn an_impact_whose_frame_is_blurred_is_not_split_into_two() {
        // The frame of the impact of a and b shows both nearer to each other than they are, the next one a too far ahead.
        const BLUR_M: f64 = 8e-5;
        for phase_s in [0.0031, 0.0062, 0.0093] {
            let mut clip = clip("c.mp4", ["a", "b"], 0.0, phase_s);
            let [a, b] = &mut clip.tracks.tracks[..] else { panic!("two tracks") };
            let moved = |s: &Sample| s.position().distance(b.samples[0].position()) > 1e-4;
            let frame = b.samples.iter().position(moved).expect("b moves");
            a.samples[frame].x_m += BLUR_M;
            a.samples[frame + 1].x_m += BLUR_M;
            b.samples[frame].x_m -= BLUR_M;
            let objects = [object("a"), object("b")];
            let found = estimation(&[clip], &cell(), &objects, &Options::default()).expect("an estimation");
            let impacts: Vec<f64> = found.clips[0].impacts.iter().map(|i| i.time.value).collect();
            assert_eq!(impacts.len(), 2, "impacts at {impacts:?} s");
        }
    }

    #[test]
    fn clips_without_a_strike_still_measure_pairs() {
        let mut clips = clips(["a", "b"], 0.0);
        for clip in &mut clips {
            clip.strike = None;
        }
        let found = estimation(&clips, &cell(), &[object("a"), object("b")], &Options::default());
        let properties = found.expect("an estimation").properties;
        close("restitution", properties.restitution["a/b"].mean, 0.5);
        assert!(properties.striker_restitution.is_empty());
    }

    #[test]
    fn a_clip_with_swapped_names_is_reported_and_left_out() {
        let mut clips = clips(["a", "b"], 0.0);
        clips.push(clip("swapped.mp4", ["b", "a"], 0.0, 0.002));
        let found = estimation(&clips, &cell(), &[object("a"), object("b")], &Options::default());
        let properties = found.expect("an estimation").properties;
        let reported =
            properties.warnings.iter().any(|w| w.starts_with("swapped.mp4") && w.contains("swapped"));
        assert!(reported, "{:#?}", properties.warnings);
        close("friction of a", properties.friction["a"].mean, 0.2);
    }
}
