//! Figs. 7 to 9: estimates with their 95 % intervals as drawings and as CSV.

use super::figure_file::FigureFile;
use super::standalone_style::standalone;
use crate::estimate::ClipValue;
use crate::object::Object;
use crate::properties::Properties;
use crate::report::figures::{ClipDot, IntervalChart, IntervalRow, Palette, Scale, interval_chart};
use crate::report::weighed::{error_percent, weighed_pair_ratio, weighed_ratio};
use crate::uncertain::Estimate;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The data of all figures.
pub(super) struct Source<'a> {
    pub properties: &'a Properties,
    pub clips: &'a [ClipValue],
    pub objects: &'a [Object],
    pub palette: Palette,
}

/// A row of a figure with the name of its quantity for the CSV.
struct QuantityRow {
    quantity: &'static str,
    row: IntervalRow,
}

/// A figure before it is drawn.
pub(super) struct Figure<'a> {
    file: &'static str,
    rows: Vec<QuantityRow>,
    chart: IntervalChart<'a>,
    title: &'static str,
    /// The reason if there are no rows.
    without_data: &'static str,
}

impl Figure<'_> {
    /// The drawing, its numbers and the values of the clips; the reason if there is nothing to draw.
    pub(super) fn files(self) -> Result<Vec<FigureFile>, String> {
        if self.rows.is_empty() {
            return Err(format!("{}: {}", self.file, self.without_data));
        }
        let (csv, clips_csv) = (summary_csv(&self.rows), clips_csv(&self.rows));
        let rows: Vec<IntervalRow> = self.rows.into_iter().map(|entry| entry.row).collect();
        let svg = standalone(&interval_chart(&rows, &self.chart, self.title));
        let named = |ending: &str, text| FigureFile { name: format!("{}{ending}", self.file), text };
        let mut files = vec![named(".svg", svg), named(".csv", csv)];
        files.extend(clips_csv.map(|text| named("_clips.csv", text)));
        Ok(files)
    }
}

impl Source<'_> {
    fn rows(
        &self,
        quantity: &'static str,
        values: &BTreeMap<String, Estimate>,
        suffix: &str,
    ) -> Vec<QuantityRow> {
        let row = |(name, estimate): (&String, &Estimate)| {
            let values =
                self.clips.iter().filter(|v| v.group == quantity && v.name == *name && v.value.is_finite());
            let row = IntervalRow {
                name: format!("{name}{suffix}"),
                // The colour of a pair is that of its first object.
                class: self.palette.class(name.split('/').next().unwrap_or(name)),
                estimate: *estimate,
                clips: values.map(|v| ClipDot { clip: v.clip.clone(), value: v.value }).collect(),
                known: self.weighed(quantity, name),
            };
            QuantityRow { quantity, row }
        };
        values.iter().map(row).collect()
    }

    /// A mass ratio from weighed masses.
    fn weighed(&self, quantity: &str, name: &str) -> Option<f64> {
        match quantity {
            "pair_mass_ratio" => weighed_pair_ratio(self.objects, name),
            "mass_ratio" => weighed_ratio(self.objects, name, &self.properties.reference),
            _ => None,
        }
    }

    /// Fig. 7.
    pub(super) fn friction(&self) -> Figure<'_> {
        Figure {
            file: "fig7_friction",
            rows: self.rows("friction", &self.properties.friction, ""),
            chart: chart("coefficient of friction with the table", Scale::Linear),
            title: "Fig. 7: friction between each object and the table",
            without_data: "no clip measures the friction of an object",
        }
    }

    /// Fig. 8.
    pub(super) fn restitution(&self) -> Figure<'_> {
        let mut rows = self.rows("striker_restitution", &self.properties.striker_restitution, " / striker");
        rows.extend(self.rows("restitution", &self.properties.restitution, ""));
        for entry in &mut rows {
            entry.row.name = spaced(&entry.row.name);
        }
        Figure {
            file: "fig8_restitution",
            rows,
            chart: chart("coefficient of restitution", Scale::Linear),
            title: "Fig. 8: restitution between striker and objects and between objects",
            without_data: "no clip measures a restitution",
        }
    }

    /// Fig. 9: each pair from its own clips.
    pub(super) fn pair_masses(&self) -> Figure<'_> {
        let mut rows = self.rows("pair_mass_ratio", &self.properties.pair_mass_ratio, "");
        for entry in &mut rows {
            entry.row.name = spaced(&entry.row.name);
        }
        Figure {
            file: "fig9_mass_ratio",
            rows,
            chart: chart(
                "mass of the first over mass of the second, from the pair's own clips",
                Scale::Logarithmic,
            ),
            title: "Fig. 9: mass ratios of pairs",
            without_data: "no clip measures the mass ratio of a pair",
        }
    }

    /// The errors of the mass ratios of the pairs whose objects were both weighed.
    pub(super) fn mass_errors(&self) -> Figure<'_> {
        let mut rows = self.pair_masses().rows;
        rows.retain(|entry| entry.row.known.is_some());
        for QuantityRow { row, .. } in &mut rows {
            let known = row.known.unwrap_or(1.0);
            let percent = |value: f64| error_percent(value, known);
            let Estimate { mean, std, standard_error, interval_95: [low, high], n } = row.estimate;
            row.estimate = Estimate {
                mean: percent(mean),
                std: std.map(|s| s / known * 100.0),
                standard_error: standard_error / known * 100.0,
                interval_95: [percent(low), percent(high)],
                n,
            };
            for dot in &mut row.clips {
                dot.value = percent(dot.value);
            }
            row.known = Some(0.0);
        }
        Figure {
            file: "fig9_mass_ratio_error",
            rows,
            chart: chart("error of the pair's mass ratio against the weighed one (%)", Scale::Linear),
            title: "Errors of the mass ratios of pairs",
            without_data: "no pair of two weighed objects",
        }
    }

    /// The mass ratios from all clips together.
    pub(super) fn joint_masses(&self) -> Figure<'_> {
        let mut rows = self.rows("mass_ratio", &self.properties.mass_ratio, "");
        rows.retain(|entry| entry.row.name != self.properties.reference);
        Figure {
            file: "fig9_mass_ratio_joint",
            rows,
            chart: chart("mass over the reference object's, from all clips together", Scale::Logarithmic),
            title: "Mass ratios from all clips together",
            without_data: "no impacts connect an object to the reference",
        }
    }
}

fn chart(label: &str, scale: Scale) -> IntervalChart<'_> {
    IntervalChart { label, scale, known: "weighed", spread: true }
}

/// The name of a pair with spaces around the slash.
pub(super) fn spaced(name: &str) -> String {
    name.split('/').map(str::trim).collect::<Vec<_>>().join(" / ")
}

const HEAD: &str = "quantity,name,mean,std,standard_error,low_95,high_95,n";

fn summary_csv(rows: &[QuantityRow]) -> String {
    // The figure of errors has a weighed value of zero and no such columns.
    let weighed = rows.iter().any(|entry| entry.row.known.is_some_and(|k| k != 0.0));
    let mut csv = format!("{HEAD}{}\n", if weighed { ",weighed,error_percent" } else { "" });
    for QuantityRow { quantity, row } in rows {
        let Estimate { mean, std, standard_error, interval_95: [low, high], n } = row.estimate;
        let std = std.map_or(String::new(), |s| format!("{s:.6}"));
        let name = plain(&row.name);
        let _ = write!(csv, "{quantity},{name},{mean:.6},{std},{standard_error:.6},{low:.6},{high:.6},{n}");
        if weighed {
            let known = row.known.map_or(",".into(), |k| format!("{k:.6},{:.3}", error_percent(mean, k)));
            let _ = write!(csv, ",{known}");
        }
        csv.push('\n');
    }
    csv
}

/// The values of the single clips; none if no row has any.
fn clips_csv(rows: &[QuantityRow]) -> Option<String> {
    let mut csv = "quantity,name,clip,value\n".to_owned();
    for QuantityRow { quantity, row } in rows {
        for ClipDot { clip, value } in &row.clips {
            let _ = writeln!(csv, "{quantity},{},{},{value:.6}", plain(&row.name), quoted(clip));
        }
    }
    rows.iter().any(|entry| !entry.row.clips.is_empty()).then_some(csv)
}

/// The name of the pair as in the properties.
fn plain(name: &str) -> String {
    name.replace(" / ", "/")
}

/// A CSV field: names of films, unlike those of objects, may contain commas.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}
