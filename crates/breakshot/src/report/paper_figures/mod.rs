//! The paper's Figs. 7, 8, 9 and Table 1 as files that stand alone: SVG for people, CSV for whoever draws their own.
//!
//! The drawings are those of the report with their style written into them, light, and without CSS variables: every
//! program that shows SVG shows them alike.

mod style;
mod table;

use super::Motion;
use super::figures::{IntervalRow, Intervals, Palette, Scale, intervals};
use super::html::motion::drawing;
use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::estimate::ClipValue;
use crate::object::{self, Object};
use crate::plan::Plan;
use crate::properties::Properties;
use crate::uncertain::Estimate;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Files to be written, and what could not be drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Published {
    /// Names and contents.
    pub files: Vec<(String, String)>,
    /// The figures that the data do not support, each with the reason.
    pub missing: Vec<String>,
}

/// The three panels of Fig. 6 as a file: distance, speed and acceleration of every object over time.
pub(super) fn motion(tracks: &Tracks) -> Option<String> {
    let palette = Palette::new(tracks.tracks.iter().map(|t| t.object.as_str()));
    drawing(&Motion { tracks, fit: None }, &palette).map(|svg| style::standalone(&svg))
}

/// A plan as a file: the pile, the strike, and where the objects may come to rest.
pub(super) fn plan(plan: &Plan) -> String {
    style::standalone(&super::html::planned::drawing(plan))
}

/// What a figure shows.
struct Source<'a> {
    properties: &'a Properties,
    clips: &'a [ClipValue],
    objects: &'a [Object],
    palette: Palette,
}

/// A row of a figure, and what the CSV says of it.
struct Shown {
    quantity: &'static str,
    row: IntervalRow,
}

/// Fig. 7 (friction), Fig. 8 (restitution), Fig. 9 (mass ratios) and Table 1 (their errors) of these properties.
///
/// `clips` are the values of the single clips, for the small dots; masses that someone weighed give the errors.
///
/// # Errors
/// Properties that hold none of these quantities.
pub(super) fn published(
    properties: &Properties,
    clips: &[ClipValue],
    objects: &[Object],
) -> Result<Published> {
    let names = properties.friction.keys().chain(properties.mass_ratio.keys()).map(String::as_str);
    let palette = Palette::new(objects.iter().map(|o| o.name.as_str()).chain(names));
    let source = Source { properties, clips, objects, palette };
    let mut published = Published::default();
    for figure in [source.friction(), source.restitution(), source.pair_masses(), source.joint_masses()] {
        figure.add_to(&mut published);
    }
    let errors = source.mass_errors();
    if !errors.rows.is_empty() {
        errors.add_to(&mut published);
    }
    match table::table_1(&source) {
        Some(files) => published.files.extend(files),
        None => published.missing.push("table1: no clip tells the mass ratio of a pair".into()),
    }
    if published.files.is_empty() {
        let needed = "the estimate of at least one friction, restitution or mass ratio";
        return Err(Error::invalid("figures", "properties", "without anything to draw", needed));
    }
    Ok(published)
}

/// A figure before it is drawn.
struct Figure<'a> {
    file: &'static str,
    rows: Vec<Shown>,
    how: Intervals<'a>,
    title: &'static str,
    /// Why it may be missing.
    without: &'static str,
}

impl Figure<'_> {
    fn add_to(self, published: &mut Published) {
        if self.rows.is_empty() {
            published.missing.push(format!("{}: {}", self.file, self.without));
            return;
        }
        let (csv, clips_csv) = (summary_csv(&self.rows), clips_csv(&self.rows));
        let rows: Vec<IntervalRow> = self.rows.into_iter().map(|shown| shown.row).collect();
        let svg = style::standalone(&intervals(&rows, &self.how, self.title));
        let file = self.file;
        published.files.push((format!("{file}.svg"), svg));
        published.files.push((format!("{file}.csv"), csv));
        if let Some(clips_csv) = clips_csv {
            published.files.push((format!("{file}_clips.csv"), clips_csv));
        }
    }
}

impl Source<'_> {
    fn rows(&self, quantity: &'static str, values: &BTreeMap<String, Estimate>, suffix: &str) -> Vec<Shown> {
        let row = |(name, estimate): (&String, &Estimate)| {
            let said =
                self.clips.iter().filter(|v| v.group == quantity && v.name == *name && v.value.is_finite());
            let row = IntervalRow {
                name: format!("{name}{suffix}"),
                // A pair has the colour of its first object.
                class: self.palette.class(name.split('/').next().unwrap_or(name)),
                estimate: *estimate,
                clips: said.map(|v| (v.clip.clone(), v.value)).collect(),
                known: self.known(quantity, name),
            };
            Shown { quantity, row }
        };
        values.iter().map(row).collect()
    }

    /// What a scale says of a mass ratio.
    fn known(&self, quantity: &str, name: &str) -> Option<f64> {
        let (one, other) = match quantity {
            "pair_mass_ratio" => name.split_once('/')?,
            "mass_ratio" => (name, self.properties.reference.as_str()),
            _ => return None,
        };
        Some(self.weighed_kg(one)? / self.weighed_kg(other)?)
    }

    fn weighed_kg(&self, name: &str) -> Option<f64> {
        object::find(self.objects, name, "figures").ok()?.mass_kg
    }

    fn friction(&self) -> Figure<'_> {
        Figure {
            file: "fig7_friction",
            rows: self.rows("friction", &self.properties.friction, ""),
            how: how("coefficient of friction against the table", Scale::Linear),
            title: "Fig. 7: friction of every object against the table",
            without: "no clip tells the friction of an object",
        }
    }

    fn restitution(&self) -> Figure<'_> {
        let mut rows = self.rows("striker_restitution", &self.properties.striker_restitution, " / striker");
        rows.extend(self.rows("restitution", &self.properties.restitution, ""));
        for shown in &mut rows {
            shown.row.name = spaced(&shown.row.name);
        }
        Figure {
            file: "fig8_restitution",
            rows,
            how: how("coefficient of restitution", Scale::Linear),
            title: "Fig. 8: restitution against the striker and between objects",
            without: "no clip tells a restitution",
        }
    }

    fn pair_masses(&self) -> Figure<'_> {
        let mut rows = self.rows("pair_mass_ratio", &self.properties.pair_mass_ratio, "");
        for shown in &mut rows {
            shown.row.name = spaced(&shown.row.name);
        }
        Figure {
            file: "fig9_mass_ratio",
            rows,
            how: how(
                "mass of the first over mass of the second, from the pair's own clips",
                Scale::Logarithmic,
            ),
            title: "Fig. 9: mass ratios of pairs",
            without: "no clip tells the mass ratio of a pair",
        }
    }

    /// The errors of the pairs' ratios, where both objects were weighed.
    fn mass_errors(&self) -> Figure<'_> {
        let mut rows = self.pair_masses().rows;
        rows.retain(|shown| shown.row.known.is_some());
        for Shown { row, .. } in &mut rows {
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
            for (_, value) in &mut row.clips {
                *value = percent(*value);
            }
            row.known = Some(0.0);
        }
        Figure {
            file: "fig9_mass_ratio_error",
            rows,
            how: how("error of the pair's mass ratio against the weighed one (%)", Scale::Linear),
            title: "Errors of the mass ratios of pairs",
            without: "nobody weighed both objects of a pair",
        }
    }

    fn joint_masses(&self) -> Figure<'_> {
        let mut rows = self.rows("mass_ratio", &self.properties.mass_ratio, "");
        rows.retain(|shown| shown.row.name != self.properties.reference);
        Figure {
            file: "fig9_mass_ratio_joint",
            rows,
            how: how("mass over the reference object's, from all clips together", Scale::Logarithmic),
            title: "Mass ratios from all clips together",
            without: "no impacts connect an object with the reference",
        }
    }
}

fn how(label: &str, scale: Scale) -> Intervals<'_> {
    Intervals { label, scale, known: "weighed", spread: true }
}

/// A pair's name with room around the stroke.
fn spaced(name: &str) -> String {
    name.split('/').map(str::trim).collect::<Vec<_>>().join(" / ")
}

const HEAD: &str = "quantity,name,mean,std,standard_error,low_95,high_95,n";

fn summary_csv(rows: &[Shown]) -> String {
    // In the figure of errors the weighed value is zero.
    let weighed = rows.iter().any(|shown| shown.row.known.is_some_and(|k| k != 0.0));
    let mut csv = format!("{HEAD}{}\n", if weighed { ",weighed,error_percent" } else { "" });
    for Shown { quantity, row } in rows {
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

/// One line a clip; none where no clip's own value is known.
fn clips_csv(rows: &[Shown]) -> Option<String> {
    let mut csv = "quantity,name,clip,value\n".to_owned();
    for Shown { quantity, row } in rows {
        for (clip, value) in &row.clips {
            let _ = writeln!(csv, "{quantity},{},{},{value:.6}", plain(&row.name), quoted(clip));
        }
    }
    rows.iter().any(|shown| !shown.row.clips.is_empty()).then_some(csv)
}

/// The name as the properties have it.
fn plain(name: &str) -> String {
    name.replace(" / ", "/")
}

/// A film's name may hold a comma; objects' names may not.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.into() }
}

fn error_percent(mean: f64, known: f64) -> f64 {
    (mean / known - 1.0) * 100.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::{Marker, Shape};

    fn estimate(mean: f64) -> Estimate {
        let interval_95 = [mean - 0.02, mean + 0.02];
        Estimate { mean, std: Some(0.01), standard_error: 0.008, interval_95, n: 3 }
    }

    fn object(name: &str, mass_kg: Option<f64>) -> Object {
        let shape = Shape::Disc { radius_m: 0.03 };
        let marker = Some(Marker::centred(shape.clone()));
        Object { name: name.into(), shape, height_m: 0.04, marker, mass_kg }
    }

    fn learned() -> Properties {
        let mut properties = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        properties.friction.insert("a".into(), estimate(0.3));
        properties.striker_restitution.insert("a".into(), estimate(0.6));
        properties.restitution.insert("a/b".into(), estimate(0.5));
        properties.pair_mass_ratio.insert("a/b".into(), estimate(2.1));
        properties.mass_ratio.insert("a".into(), Estimate::exact(1.0));
        properties.mass_ratio.insert("b".into(), estimate(0.49));
        properties
    }

    fn file<'a>(published: &'a Published, name: &str) -> &'a str {
        &published.files.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("{name}")).1
    }

    #[test]
    fn every_figure_has_a_drawing_and_its_numbers() {
        let clip =
            ClipValue { clip: "1,2.mp4".into(), group: "friction", name: "a".into(), value: 0.31, std: 0.01 };
        let objects = [object("a", Some(0.2)), object("b", Some(0.1))];
        let found = published(&learned(), &[clip], &objects).expect("figures");
        assert!(found.missing.is_empty(), "{:?}", found.missing);
        assert!(file(&found, "fig7_friction_clips.csv").contains("friction,a,\"1,2.mp4\",0.310000\n"));
        assert!(file(&found, "fig8_restitution.csv").contains("\nstriker_restitution,a/striker,0.600000,"));
        // 2.1 against 0.2 kg over 0.1 kg.
        assert!(file(&found, "fig9_mass_ratio.csv").contains(",2.000000,5.000\n"));
        assert!(file(&found, "table1.csv").contains("a/b,2.100000,"));
        for (name, text) in found.files.iter().filter(|(_, text)| text.starts_with("<svg")) {
            roxmltree::Document::parse(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(!text.contains("var("), "{name} leaves a variable to the browser");
        }
    }

    #[test]
    fn what_the_data_do_not_support_is_said_not_drawn_empty() {
        let mut some = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        assert!(published(&some, &[], &[]).expect_err("nothing").to_string().contains("needed"));
        some.friction.insert("a".into(), estimate(0.3));
        let found = published(&some, &[], &[]).expect("one figure");
        assert_eq!(
            found.files.iter().map(|f| f.0.as_str()).collect::<Vec<_>>(),
            ["fig7_friction.svg", "fig7_friction.csv"]
        );
        assert!(
            found.missing.iter().any(|m| m.starts_with("fig8_restitution: no clip")),
            "{:?}",
            found.missing
        );
        assert!(found.missing.iter().any(|m| m.starts_with("table1: ")), "{:?}", found.missing);
    }
}
