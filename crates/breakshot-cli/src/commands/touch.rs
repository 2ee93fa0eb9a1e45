//! `breakshot command --touch`: the table's pose in the robot's base frame, from touched points.

use super::command;
use crate::args::CommandArgs;
use crate::{Outcome, console};
use breakshot::robot::{self, Arm, BaseRegistration, TouchedPoint};
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::Path;

/// The file of the touched points.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TouchFile {
    touches: Vec<TouchedPoint>,
}

/// Root mean square (mm) above which a touch or the tool is probably wrong: twice the accuracy of the tags and of a touch.
const DOUBTFUL_MM: f64 = 2.0;

/// Fits the touched points and writes `base_from_table` into the cell file.
pub(crate) fn run(touches: &Path, args: &CommandArgs) -> Result<Outcome> {
    let cell = command::cell(args)?;
    let robot = cell.robot.as_ref().ok_or_else(|| {
        Error::invalid(args.cell.display().to_string(), "robot", "missing", "a [robot] table with `arm`")
    })?;
    let arm = Arm::of_cell(robot)?;
    let file: TouchFile = files::read_toml(touches)?;
    let fit = robot::base_registration(&arm, &file.touches)?;
    let line = toml_line(&fit);
    let text = std::fs::read_to_string(&args.cell)
        .map_err(|source| Error::Read { path: args.cell.clone(), source })?;
    files::write_whole(&args.cell, with_line(&text, &line).as_bytes())?;
    files::load_cell(&args.cell)?;
    if args.json {
        console::print_json(&fit)?;
    } else {
        for (k, residual_mm) in fit.residuals_mm.iter().enumerate() {
            println!("touch {}: {residual_mm:.2} mm", k + 1);
        }
        println!("root mean square {:.2} mm", fit.rms_mm);
        println!("Wrote into {}: {line}", args.cell.display());
    }
    Ok(Outcome::doubtful_if(fit.rms_mm > DOUBTFUL_MM))
}

fn toml_line(fit: &BaseRegistration) -> String {
    let [x, y, z] = fit.base_from_table.position_m;
    let [roll, pitch, yaw] = fit.base_from_table.rpy_rad;
    format!(
        "base_from_table = {{ position_m = [{x:.6}, {y:.6}, {z:.6}], rpy_rad = [{roll:.6}, {pitch:.6}, {yaw:.6}] }}"
    )
}

/// The cell's text with `line` in its [robot] table, in place of an older one; all else stays as it is.
fn with_line(text: &str, line: &str) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    let header = lines.iter().position(|line| line.trim_start().starts_with("[robot]"));
    let Some(header) = header else {
        return format!("{}\n\n[robot]\n{line}\n", text.trim_end());
    };
    let end = lines[header + 1..].iter().position(|line| line.trim_start().starts_with('['));
    let end = end.map_or(lines.len(), |length| header + 1 + length);
    let old = (header + 1..end).find(|&k| lines[k].trim_start().starts_with("base_from_table"));
    match old {
        Some(old) => lines[old] = line,
        None => lines.insert(header + 1, line),
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_one_line_of_the_cell_changes() {
        let text = "# a cell\n[striker]\nheight_m = 0.1\n\n[robot]\narm = \"indy7\"  # ours\nbase_from_table = { .. }\n[table]\n";
        let new = with_line(text, "base_from_table = NEW");
        assert_eq!(new, text.replace("base_from_table = { .. }", "base_from_table = NEW"));
        let without = text.replace("base_from_table = { .. }\n", "");
        let added = with_line(&without, "base_from_table = NEW");
        assert!(
            added.contains("[robot]\nbase_from_table = NEW\narm = \"indy7\"  # ours\n[table]"),
            "{added}"
        );
    }
}
