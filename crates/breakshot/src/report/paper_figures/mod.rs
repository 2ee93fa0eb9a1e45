//! The figures and the table of the paper as standalone files: SVG for people, CSV for other plotting programs.
//!
//! The drawings are those of the HTML page with their style embedded: light colours and no CSS variables, so that every
//! SVG viewer shows them identically.

mod figure_file;
mod interval_figures;
mod mass_ratio_table;
mod standalone_style;

pub use figure_file::FigureFile;

use super::figures::Palette;
use super::html::{ClipMotion, clip_motion, plan as plan_chapter};
use crate::detect::Tracks;
use crate::error::{Error, Result};
use crate::estimate::ClipValue;
use crate::object::Object;
use crate::plan::{EvaluatedStrike, Plan};
use crate::properties::Properties;
use crate::scene::Scene;
use interval_figures::Source;

/// The files of the figures, and the figures that could not be drawn.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PaperFigures {
    /// The files to write.
    pub files: Vec<FigureFile>,
    /// The figures without data, each with the reason.
    pub missing: Vec<String>,
}

/// The three panels of Fig. 6: distance, speed and acceleration of every object over time; none without a sample.
pub(super) fn motion(tracks: &Tracks) -> Option<String> {
    let palette = Palette::new(tracks.tracks.iter().map(|t| t.object.as_str()));
    let motion = ClipMotion { tracks, fit: None, cell: None, strike: None };
    clip_motion::drawing(&motion, &palette).map(|svg| standalone_style::standalone(&svg))
}

/// A plan: the pile, the strike, the expected and the possible final poses.
pub(super) fn plan(plan: &Plan) -> String {
    standalone_style::standalone(&plan_chapter::drawing(plan))
}

/// The pile with evaluated strikes.
pub(super) fn map(scene: &Scene, strikes: &[EvaluatedStrike]) -> String {
    standalone_style::standalone(&plan_chapter::map(scene, strikes))
}

/// Fig. 7 (friction), Fig. 8 (restitution), Fig. 9 (mass ratios) and Table 1 (errors of the mass ratios).
///
/// # Errors
/// Properties without any of these quantities.
pub(super) fn paper_figures(
    properties: &Properties,
    clips: &[ClipValue],
    objects: &[Object],
) -> Result<PaperFigures> {
    let names = properties.friction.keys().chain(properties.mass_ratio.keys()).map(String::as_str);
    let palette = Palette::new(objects.iter().map(|o| o.name.as_str()).chain(names));
    let source = Source { properties, clips, objects, palette };
    let mut figures = PaperFigures::default();
    for figure in [source.friction(), source.restitution(), source.pair_masses(), source.joint_masses()] {
        match figure.files() {
            Ok(files) => figures.files.extend(files),
            Err(reason) => figures.missing.push(reason),
        }
    }
    // The figure of the errors is optional: it needs weighed masses.
    figures.files.extend(source.mass_errors().files().unwrap_or_default());
    match mass_ratio_table::table_1(properties, objects) {
        Some(files) => figures.files.extend(files),
        None => figures.missing.push("table1: no clip measures the mass ratio of a pair".into()),
    }
    if figures.files.is_empty() {
        let needed = "the estimate of at least one friction, restitution or mass ratio";
        return Err(Error::invalid("figures", "properties", "without anything to draw", needed));
    }
    Ok(figures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::object::{Marker, Shape};
    use crate::uncertain::Estimate;

    fn estimate(mean: f64) -> Estimate {
        let interval_95 = [mean - 0.02, mean + 0.02];
        Estimate { mean, std: Some(0.01), standard_error: 0.008, interval_95, n: 3 }
    }

    fn object(name: &str, mass_kg: Option<f64>) -> Object {
        let shape = Shape::Disc { radius_m: 0.03 };
        let marker = Some(Marker::centred(shape.clone()));
        Object { name: name.into(), shape, height_m: 0.04, marker, mass_kg, support: None }
    }

    fn estimated() -> Properties {
        let mut properties = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        properties.friction.insert("a".into(), estimate(0.3));
        properties.striker_restitution.insert("a".into(), estimate(0.6));
        properties.restitution.insert("a/b".into(), estimate(0.5));
        properties.pair_mass_ratio.insert("a/b".into(), estimate(2.1));
        properties.mass_ratio.insert("a".into(), Estimate::exact(1.0));
        properties.mass_ratio.insert("b".into(), estimate(0.49));
        properties
    }

    fn file<'a>(figures: &'a PaperFigures, name: &str) -> &'a str {
        &figures.files.iter().find(|file| file.name == name).unwrap_or_else(|| panic!("{name}")).text
    }

    #[test]
    fn every_figure_is_a_drawing_and_a_table_of_its_numbers() {
        let clip =
            ClipValue { clip: "1,2.mp4".into(), group: "friction", name: "a".into(), value: 0.31, std: 0.01 };
        let objects = [object("a", Some(0.2)), object("b", Some(0.1))];
        let found = paper_figures(&estimated(), &[clip], &objects).expect("figures");
        assert!(found.missing.is_empty(), "{:?}", found.missing);
        assert!(file(&found, "fig7_friction_clips.csv").contains("friction,a,\"1,2.mp4\",0.310000\n"));
        assert!(file(&found, "fig8_restitution.csv").contains("\nstriker_restitution,a/striker,0.600000,"));
        // 2.1 against 0.2 kg over 0.1 kg.
        assert!(file(&found, "fig9_mass_ratio.csv").contains(",2.000000,5.000\n"));
        assert!(file(&found, "table1.csv").contains("a/b,2.100000,"));
        for FigureFile { name, text } in found.files.iter().filter(|file| file.text.starts_with("<svg")) {
            roxmltree::Document::parse(text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(!text.contains("var("), "{name} contains a CSS variable");
        }
    }

    #[test]
    fn a_figure_without_data_is_listed_as_missing() {
        let mut some = Properties { version: 1, reference: "a".into(), ..Properties::default() };
        assert!(paper_figures(&some, &[], &[]).expect_err("nothing").to_string().contains("needed"));
        some.friction.insert("a".into(), estimate(0.3));
        let found = paper_figures(&some, &[], &[]).expect("one figure");
        assert_eq!(
            found.files.iter().map(|file| file.name.as_str()).collect::<Vec<_>>(),
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
