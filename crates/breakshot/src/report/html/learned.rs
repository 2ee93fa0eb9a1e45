//! Friction, restitution and mass ratios (Figs. 7 to 9, Table 1).

use super::Story;
use super::text::{figure, numbers, table};
use crate::estimate::ClipFit;
use crate::object::{self, Object, kind, pair_key};
use crate::properties::Properties;
use crate::report::figures::{IntervalRow, Intervals, Palette, Scale, escaped, intervals};
use crate::uncertain::Estimate;
use std::collections::BTreeMap;

pub(super) fn chapter(story: &Story, properties: &Properties, palette: &Palette) -> Option<String> {
    let sections = [
        friction(story, properties, palette),
        restitution(story, properties, palette),
        masses(story, properties, palette),
        table_1(story, properties),
        contact_friction(properties),
    ];
    let told: String = sections.into_iter().flatten().collect();
    (!told.is_empty()).then(|| {
        let from = match story.fits.len() {
            0 => String::new(),
            count => format!(" from {count} films"),
        };
        format!(
            "<h2>What the films say about the objects</h2>\n<p>All values are learned{from}; nothing was weighed or \
             looked up. Small dots are single clips. The line through a dot holds the true mean with 95 % probability: \
             the fewer the clips, the longer it is.</p>\n{told}"
        )
    })
}

/// What one clip says about one property.
struct ClipValue<'a> {
    group: &'static str,
    name: String,
    clip: &'a str,
    value: f64,
}

/// All that a clip says, property by property.
fn clip_values(fit: &ClipFit) -> Vec<ClipValue<'_>> {
    let value = |group, name, value| ClipValue { group, name, clip: &fit.name, value };
    let sliding = fit.bodies.iter().filter_map(|b| Some((kind(&b.object).to_owned(), b.friction?.value)));
    let mut values: Vec<_> = sliding.map(|(name, friction)| value("friction", name, friction)).collect();
    for impact in &fit.impacts {
        let Some(a) = impact.a.as_deref() else { continue };
        let (group, name) = if a == STRIKER {
            ("striker_restitution", kind(&impact.b).to_owned())
        } else {
            ("restitution", pair_key(a, &impact.b))
        };
        values.extend(impact.restitution.map(|e| value(group, name, e.value)));
    }
    values
}

/// What the fits call the striker.
const STRIKER: &str = "striker";

/// Rows for one group of properties.
fn rows(
    story: &Story,
    group: &str,
    values: &BTreeMap<String, Estimate>,
    palette: &Palette,
) -> Vec<IntervalRow> {
    let said: Vec<ClipValue> = story.fits.iter().flat_map(clip_values).filter(|v| v.group == group).collect();
    let row = |(name, estimate): (&String, &Estimate)| {
        let clips = said.iter().filter(|v| v.name == *name && v.value.is_finite());
        IntervalRow {
            name: name.clone(),
            // A pair has the colour of its first object.
            class: palette.class(name.split('/').next().unwrap_or(name)),
            estimate: *estimate,
            clips: clips.map(|v| (v.clip.to_owned(), v.value)).collect(),
            known: None,
        }
    };
    values.iter().map(row).collect()
}

fn friction(story: &Story, properties: &Properties, palette: &Palette) -> Option<String> {
    let rows = rows(story, "friction", &properties.friction, palette);
    let how = Intervals { label: "coefficient of friction", scale: Scale::Linear, known: "", spread: false };
    section(
        "Friction on the table",
        "How hard the table brakes each object: deceleration over <i>g</i>.",
        &rows,
        &how,
    )
}

fn restitution(story: &Story, properties: &Properties, palette: &Palette) -> Option<String> {
    let striker = rows(story, "striker_restitution", &properties.striker_restitution, palette);
    let pairs = rows(story, "restitution", &properties.restitution, palette);
    let how =
        Intervals { label: "coefficient of restitution", scale: Scale::Linear, known: "", spread: false };
    let text = "How much speed an object takes from the striker: at 0 they move on together, at 1 it leaves twice as fast.";
    let by_striker = section("Restitution, struck by the robot", text, &striker, &how);
    let text = "How fast two objects part after they met, over how fast they met.";
    let by_object = section("Restitution between objects", text, &pairs, &how);
    let both: String = by_striker.into_iter().chain(by_object).collect();
    (!both.is_empty()).then_some(both)
}

fn masses(story: &Story, properties: &Properties, palette: &Palette) -> Option<String> {
    let mut rows = rows(story, "mass_ratio", &properties.mass_ratio, palette);
    let reference = object::find(story.objects, &properties.reference, "report").ok().and_then(|o| o.mass_kg);
    for row in &mut rows {
        row.known =
            weighed(story.objects, &row.name).zip(reference).map(|(mass_kg, unit_kg)| mass_kg / unit_kg);
    }
    let how = Intervals {
        label: "mass over the reference object's mass (logarithmic)",
        scale: Scale::Logarithmic,
        known: "weighed",
        spread: false,
    };
    let text = format!(
        "How heavy each object is, measured by what it does to others. The unit is the mass of {}; the ratios of all pairs \
         were reconciled with each other.",
        escaped(&properties.reference)
    );
    section("Mass ratios", &text, &rows, &how)
}

fn weighed(objects: &[Object], name: &str) -> Option<f64> {
    object::find(objects, name, "report").ok()?.mass_kg
}

fn section(title: &str, text: &str, rows: &[IntervalRow], how: &Intervals) -> Option<String> {
    (!rows.is_empty()).then(|| {
        let svg = intervals(rows, how, title);
        format!("<h3>{title}</h3>\n<p>{text}</p>\n{}", figure(&svg, ""))
    })
}

/// Each pair's ratio from its own clips alone; errors where both objects were weighed.
fn table_1(story: &Story, properties: &Properties) -> Option<String> {
    let mut errors = Vec::new();
    let rows: Vec<Vec<String>> = properties
        .pair_mass_ratio
        .iter()
        .map(|(key, estimate)| {
            let half = (estimate.interval_95[1] - estimate.interval_95[0]) / 2.0;
            let known = key
                .split_once('/')
                .and_then(|(a, b)| Some(weighed(story.objects, a)? / weighed(story.objects, b)?));
            let error = known.map(|known| (estimate.mean / known - 1.0).abs() * 100.0);
            errors.extend(error);
            let dash = || "\u{2013}".to_owned();
            vec![
                key.clone(),
                format!("{:.4}", estimate.mean),
                if half.is_finite() { format!("\u{b1} {half:.4}") } else { dash() },
                estimate.n.to_string(),
                known.map_or_else(dash, |known| format!("{known:.4}")),
                error.map_or_else(dash, |error| format!("{error:.2}")),
            ]
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let head = ["pair", "learned ratio", "95 %", "clips", "weighed ratio", "error (%)"];
    let mut told = format!(
        "<h3>Each pair alone (Table 1)</h3>\n<p>The mass of the first object over that of the second, from the clips of \
         that pair only.{}</p>\n{}",
        if errors.is_empty() { "" } else { " Someone weighed the objects; estimation never saw the result." },
        table(&head, &rows)
    );
    if !errors.is_empty() {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst = errors.iter().copied().fold(0.0, f64::max);
        told += &numbers(&[
            (format!("{mean:.2} %"), "mean error"),
            (format!("{worst:.2} %"), "worst error"),
            (errors.len().to_string(), "pairs with both objects weighed"),
        ]);
    }
    Some(told)
}

fn contact_friction(properties: &Properties) -> Option<String> {
    let friction = [
        ("between objects", properties.contact_friction.objects),
        ("between an object and the striker", properties.contact_friction.striker),
    ];
    let told: Vec<String> = friction
        .iter()
        .filter_map(|(what, estimate)| {
            let estimate = estimate.as_ref()?;
            let [low, high] = estimate.interval_95;
            Some(format!("{what} {:.3} (95 %: {low:.3} to {high:.3})", estimate.mean))
        })
        .collect();
    (!told.is_empty())
        .then(|| format!("<p>Friction where surfaces touch in an impact: {}.</p>\n", told.join(", ")))
}
