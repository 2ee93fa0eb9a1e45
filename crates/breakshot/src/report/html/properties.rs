//! The chapter on friction, restitution and mass ratios (Figs. 7 to 9, Table 1).

use super::content::Page;
use super::text::{DASH, KeyNumber, figure, key_numbers, table};
use crate::estimate::ClipFit;
use crate::object::{kind, pair_key};
use crate::properties::{Properties, SlipDamping};
use crate::report::figures::{ClipDot, IntervalChart, IntervalRow, Palette, Scale, escaped, interval_chart};
use crate::report::weighed::{error_percent, weighed_pair_ratio, weighed_ratio};
use crate::uncertain::Estimate;
use std::collections::BTreeMap;

pub(super) fn chapter(page: &Page, properties: &Properties, palette: &Palette) -> Option<String> {
    let sections = [
        friction(page, properties, palette),
        restitution(page, properties, palette),
        masses(page, properties, palette),
        table_1(page, properties),
        contact_friction(properties),
        support(page, properties, palette),
        properties.tilt.map(|tilt| format!("<h3>Tilt</h3>\n<p>By the curves of the slides, {tilt}.</p>\n")),
    ];
    let sections: String = sections.into_iter().flatten().collect();
    (!sections.is_empty()).then(|| {
        let from = match page.fits.len() {
            0 => String::new(),
            count => format!(" from {count} films"),
        };
        format!(
            "<h2>Estimated properties of the objects</h2>\n<p>All values are estimated{from}, without weighed masses. Small \
             dots: single clips. Large dots and lines: mean and 95 % confidence interval of the mean.</p>\n{sections}"
        )
    })
}

/// The measurement of one property in one clip.
struct ClipValue<'a> {
    group: &'static str,
    name: String,
    clip: &'a str,
    value: f64,
}

/// The friction and restitution values of one clip.
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

/// The name of the striker in the fits.
const STRIKER: &str = "striker";

/// The rows of the chart of one group of properties.
fn rows(
    page: &Page,
    group: &str,
    values: &BTreeMap<String, Estimate>,
    palette: &Palette,
) -> Vec<IntervalRow> {
    let values_of_clips: Vec<ClipValue> =
        page.fits.iter().flat_map(clip_values).filter(|v| v.group == group).collect();
    let row = |(name, estimate): (&String, &Estimate)| {
        let clips = values_of_clips.iter().filter(|v| v.name == *name && v.value.is_finite());
        IntervalRow {
            name: name.clone(),
            // The colour of a pair is that of its first object.
            class: palette.class(name.split('/').next().unwrap_or(name)),
            estimate: *estimate,
            clips: clips.map(|v| ClipDot { clip: v.clip.to_owned(), value: v.value }).collect(),
            known: None,
        }
    };
    values.iter().map(row).collect()
}

fn friction(page: &Page, properties: &Properties, palette: &Palette) -> Option<String> {
    let rows = rows(page, "friction", &properties.friction, palette);
    let chart =
        IntervalChart { label: "coefficient of friction", scale: Scale::Linear, known: "", spread: false };
    section(
        "Friction on the table",
        "The coefficient of sliding friction between object and table: deceleration over <i>g</i>.",
        &rows,
        &chart,
    )
}

fn restitution(page: &Page, properties: &Properties, palette: &Palette) -> Option<String> {
    let striker = rows(page, "striker_restitution", &properties.striker_restitution, palette);
    let pairs = rows(page, "restitution", &properties.restitution, palette);
    let chart =
        IntervalChart { label: "coefficient of restitution", scale: Scale::Linear, known: "", spread: false };
    let text = "Relative normal speed after the impact over that before it. The striker keeps its speed: at 0 the object moves on \
                with the speed of the striker, at 1 with twice that speed.";
    let by_striker = section("Restitution between striker and object", text, &striker, &chart);
    let text = "Relative normal speed of two objects after an impact over that before it.";
    let by_object = section("Restitution between objects", text, &pairs, &chart);
    let both: String = by_striker.into_iter().chain(by_object).collect();
    (!both.is_empty()).then_some(both)
}

fn masses(page: &Page, properties: &Properties, palette: &Palette) -> Option<String> {
    let mut rows = rows(page, "mass_ratio", &properties.mass_ratio, palette);
    for row in &mut rows {
        row.known = weighed_ratio(page.objects, &row.name, &properties.reference);
    }
    let chart = IntervalChart {
        label: "mass over the reference object's mass (logarithmic)",
        scale: Scale::Logarithmic,
        known: "weighed",
        spread: false,
    };
    let text = format!(
        "The mass of each object over that of {}, estimated from the impacts of all pairs together.",
        escaped(&properties.reference)
    );
    section("Mass ratios", &text, &rows, &chart)
}

fn section(title: &str, text: &str, rows: &[IntervalRow], chart: &IntervalChart) -> Option<String> {
    (!rows.is_empty()).then(|| {
        let svg = interval_chart(rows, chart, title);
        format!("<h3>{title}</h3>\n<p>{text}</p>\n{}", figure(&svg, ""))
    })
}

/// The mass ratio of each pair from its own clips, with errors where both objects were weighed.
fn table_1(page: &Page, properties: &Properties) -> Option<String> {
    let mut errors = Vec::new();
    let rows: Vec<Vec<String>> = properties
        .pair_mass_ratio
        .iter()
        .map(|(key, estimate)| {
            let half = (estimate.interval_95[1] - estimate.interval_95[0]) / 2.0;
            let known = weighed_pair_ratio(page.objects, key);
            let error = known.map(|known| error_percent(estimate.mean, known).abs());
            errors.extend(error);
            let dash = || DASH.to_owned();
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
    let head = ["pair", "estimated ratio", "95 %", "clips", "weighed ratio", "error (%)"];
    let mut section = format!(
        "<h3>Mass ratios of single pairs (Table 1)</h3>\n<p>The mass of the first object over that of the second, from \
         the clips of that pair only.{}</p>\n{}",
        if errors.is_empty() { "" } else { " The weighed masses are not used in the estimation." },
        table(&head, &rows)
    );
    if !errors.is_empty() {
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let worst = errors.iter().copied().fold(0.0, f64::max);
        section += &key_numbers(&[
            KeyNumber::new(format!("{mean:.2} %"), "mean error"),
            KeyNumber::new(format!("{worst:.2} %"), "largest error"),
            KeyNumber::new(errors.len().to_string(), "pairs with both objects weighed"),
        ]);
    }
    Some(section)
}

fn support(page: &Page, properties: &Properties, palette: &Palette) -> Option<String> {
    let rows = rows(page, "support", &properties.support, palette);
    let chart = IntervalChart {
        label: "mean distance of the support over that of an even weight",
        scale: Scale::Linear,
        known: "",
        spread: false,
    };
    let text = "How far from the centroid the weight of an object acts on the table, over the mean distance for a weight spread uniformly \
                under the outline (1.5 for a disc on its rim). It scales the braking of the spin.";
    section("Support", text, &rows, &chart)
}

fn contact_friction(properties: &Properties) -> Option<String> {
    let Properties {
        contact_friction: friction,
        tangential_restitution: tangential,
        tangential_damping: damping,
        ..
    } = properties;
    let sentence = |what: &str, of: [Option<String>; 2]| {
        let between = ["between objects", "between an object and the striker"];
        let values =
            between.iter().zip(of).filter_map(|(between, value)| Some(format!("{between} {}", value?)));
        let values: Vec<String> = values.collect();
        (!values.is_empty()).then(|| format!("<p>{what}: {}.</p>\n", values.join(", ")))
    };
    let estimated = |Estimate { mean, interval_95: [low, high], .. }: Estimate| {
        format!("{mean:.3} (95 %: {low:.3} to {high:.3})")
    };
    let damped = |SlipDamping { probability, exponent }: SlipDamping| {
        let Estimate { mean, interval_95: [low, high], .. } = exponent;
        format!(
            "with a probability of {:.0} %, p = {mean:.1} (95 %: {low:.1} to {high:.1})",
            100.0 * probability
        )
    };
    let sentences = [
        sentence(
            "Contact friction in impacts",
            [friction.objects, friction.striker].map(|e| e.map(estimated)),
        ),
        sentence(
            "Tangential restitution in impacts, if it is constant",
            [tangential.objects, tangential.striker].map(|e| e.map(estimated)),
        ),
        sentence(
            "Impacts with restitution e whose contact points stick leave the part e<sup>p</sup> of the slip",
            [damping.objects, damping.striker].map(|d| d.map(damped)),
        ),
    ];
    let sentences: Vec<String> = sentences.into_iter().flatten().collect();
    (!sentences.is_empty()).then(|| sentences.concat())
}
