//! `breakshot command --touch`: the table's pose in the robot's base frame, from touched points.

use crate::args::CommandArgs;
use crate::{Outcome, console};
use breakshot::cell::{Cell, Transform};
use breakshot::robot::{self, Arm, TouchedPoint};
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::Path;
use toml_edit::{Array, DocumentMut, InlineTable, TomlError};

/// The file of the touched points.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TouchFile {
    touches: Vec<TouchedPoint>,
}

/// Root mean square (mm) above which a touch or the tool is probably wrong: twice the accuracy of the tags and of a touch.
const DOUBTFUL_MM: f64 = 2.0;

/// Fits the touched points and writes `base_from_table` into the cell file.
pub(crate) fn run(touches: &Path, cell: &Cell, args: &CommandArgs) -> Result<Outcome> {
    let robot = cell.robot.as_ref().ok_or_else(|| {
        Error::invalid(args.cell.display().to_string(), "robot", "missing", "a [robot] table with `arm`")
    })?;
    let arm = Arm::of_cell(robot)?;
    let file: TouchFile = files::read_toml(touches)?;
    let fit = robot::base_registration(&arm, &file.touches)?;
    let text = std::fs::read_to_string(&args.cell)
        .map_err(|source| Error::Read { path: args.cell.clone(), source })?;
    let changed = with_base(&text, &fit.base_from_table)
        .map_err(|e| Error::Syntax { path: args.cell.clone(), problem: e.to_string() })?;
    files::write_whole(&args.cell, changed.as_bytes())?;
    files::load_cell(&args.cell)?;
    if args.json {
        console::print_json(&fit)?;
    } else {
        for (k, residual_mm) in fit.residuals_mm.iter().enumerate() {
            println!("touch {}: {residual_mm:.2} mm", k + 1);
        }
        println!("root mean square {:.2} mm", fit.rms_mm);
        println!("Wrote into {}: base_from_table = {}", args.cell.display(), inline(&fit.base_from_table));
    }
    Ok(Outcome::doubtful_if(fit.rms_mm > DOUBTFUL_MM))
}

/// The cell file's text with `base_from_table` in its `[robot]` table; everything else, comments included, stays the same.
fn with_base(text: &str, base: &Transform) -> std::result::Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    document.entry("robot").or_insert(toml_edit::table())["base_from_table"] = toml_edit::value(inline(base));
    Ok(document.to_string())
}

/// A transform as an inline table, rounded to a micrometre and a microradian.
fn inline(transform: &Transform) -> InlineTable {
    // Adding zero converts a negative zero into a positive one.
    let rounded =
        |values: [f64; 3]| values.into_iter().map(|x| (x * 1e6).round() / 1e6 + 0.0).collect::<Array>();
    let mut table = InlineTable::new();
    table.insert("position_m", rounded(transform.position_m).into());
    table.insert("rpy_rad", rounded(transform.rpy_rad).into());
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_base_pose_of_the_cell_changes() {
        let base = Transform { position_m: [0.5, -0.0, 0.03], rpy_rad: [0.0, 0.0, 1.5] };
        let old = "base_from_table = { position_m = [1, 2, 3] }";
        let new = "base_from_table = { position_m = [0.5, 0.0, 0.03], rpy_rad = [0.0, 0.0, 1.5] }";
        let text = format!(
            "# a cell\n[striker]\nheight_m = 0.1\n\n[robot]\narm = \"indy7\"  # ours\n{old}\n\n[table]\n"
        );
        assert_eq!(with_base(&text, &base).expect("TOML"), text.replace(old, new));
        let without = text.replace(&format!("{old}\n"), "");
        let expected = text.replace(old, new);
        assert_eq!(with_base(&without, &base).expect("TOML"), expected);
        let bare = with_base("# a cell\n", &base).expect("TOML");
        assert!(bare.contains(&format!("[robot]\n{new}")) && bare.contains("# a cell"), "{bare}");
    }
}
