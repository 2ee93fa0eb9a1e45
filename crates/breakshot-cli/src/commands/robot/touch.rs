//! `breakshot command --touch`: the table's pose in the robot's base frame, from touched points.

use crate::args::CommandArgs;
use crate::{Outcome, console};
use breakshot::cell::{Cell, Transform};
use breakshot::robot::{self, Arm, TouchedPoint};
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::Path;
use toml_edit::{Array, DocumentMut, InlineTable, Item, TomlError, Value};

/// The file of the touched points.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TouchFile {
    touches: Vec<TouchedPoint>,
}

/// Residual (mm) above which a touch or the tool is probably wrong: twice the accuracy of the tags and of a touch.
const DOUBTFUL_MM: f64 = 2.0;

/// Fits the touched points and writes `base_from_table` into the cell file.
pub(crate) fn run(touches: &Path, cell: &Cell, args: &CommandArgs) -> Result<Outcome> {
    let robot = cell.robot.as_ref().ok_or_else(|| {
        Error::invalid(args.cell.display().to_string(), "robot", "missing", "a [robot] table with `arm`")
    })?;
    let arm = Arm::of_cell(robot)?;
    let file: TouchFile = files::read_toml(touches)?;
    let fit = robot::base_registration(&arm, &file.touches)?;
    let largest_mm = fit.residuals_mm.iter().copied().fold(0.0, f64::max);
    let is_accepted = largest_mm <= DOUBTFUL_MM || args.accept_residuals;
    if is_accepted {
        let text = std::fs::read_to_string(&args.cell)
            .map_err(|source| Error::Read { path: args.cell.clone(), source })?;
        let changed = with_base(&text, &fit.base_from_table)
            .map_err(|e| Error::Syntax { path: args.cell.clone(), problem: e.to_string() })?;
        // A file that cannot be loaded is not written.
        files::cell_of(&args.cell, changed.clone())?;
        files::write_whole(&args.cell, changed.as_bytes())?;
    }
    if args.json {
        console::print_json(&fit)?;
    } else {
        for (k, residual_mm) in fit.residuals_mm.iter().enumerate() {
            println!("touch {}: {residual_mm:.2} mm", k + 1);
        }
        println!("root mean square {:.2} mm", fit.rms_mm);
        let base = inline(&fit.base_from_table);
        if is_accepted {
            println!("Wrote into {}: base_from_table = {base}", args.cell.display());
        } else {
            println!(
                "refused: a residual of {largest_mm:.2} mm; needed: at most {DOUBTFUL_MM} mm, or --accept-residuals"
            );
            println!("not written: base_from_table = {base}");
        }
    }
    Ok(Outcome::doubtful_if(largest_mm > DOUBTFUL_MM))
}

/// The cell file's text with `base_from_table` in its `[robot]` table; everything else, comments included, stays the same.
fn with_base(text: &str, base: &Transform) -> std::result::Result<String, TomlError> {
    let mut document: DocumentMut = text.parse()?;
    let written = inline(base);
    let robot = document.entry("robot").or_insert(toml_edit::table());
    match robot.get_mut("base_from_table") {
        // A table of its own: each key stays where it is.
        Some(Item::Table(table)) => {
            for (key, value) in &written {
                replace(table.entry(key).or_insert(Item::None), value.clone());
            }
        }
        Some(item) => replace(item, written.into()),
        None => {
            if let Some(robot) = robot.as_table_like_mut() {
                robot.insert("base_from_table", toml_edit::value(written));
            }
        }
    }
    Ok(document.to_string())
}

/// Replaces a value; the spaces and comments around it stay.
fn replace(item: &mut Item, mut value: Value) {
    if let Some(old) = item.as_value() {
        *value.decor_mut() = old.decor().clone();
    }
    *item = Item::Value(value);
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
        let commented = text.replace(old, &format!("{old}  # measured in May"));
        assert_eq!(with_base(&commented, &base).expect("TOML"), commented.replace(old, new));
        let table = "[robot]\narm = \"indy7\"\n[robot.base_from_table]  # the table\nposition_m = [1, 2, 3]  # touched\n# end\n";
        let expected = "[robot]\narm = \"indy7\"\n[robot.base_from_table]  # the table\nposition_m = [0.5, 0.0, 0.03]  # touched\n\
                        rpy_rad = [0.0, 0.0, 1.5]\n# end\n";
        assert_eq!(with_base(table, &base).expect("TOML"), expected);
        let dotted =
            with_base("robot.arm = \"indy7\"\nrobot.base_from_table.position_m = [1, 2, 3] # x\n", &base)
                .expect("TOML");
        assert!(dotted.contains("robot.base_from_table.position_m = [0.5, 0.0, 0.03] # x"), "{dotted}");
        assert!(dotted.parse::<DocumentMut>().is_ok(), "{dotted}");
        let bare = with_base("# a cell\n", &base).expect("TOML");
        assert!(bare.contains(&format!("[robot]\n{new}")) && bare.contains("# a cell"), "{bare}");
    }
}
