//! Positions of tags in the text of a cell file; comments and everything else in the file stay.

use crate::pile::save::{pair, set};
use crate::project::Project;
use breakshot::cell::Cell;
use breakshot::geometry::Point;
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::PathBuf;
use toml_edit::{ArrayOfTables, DocumentMut, Item, TableLike};

/// Most tags of a question.
const MOST_TAGS: usize = 1000;

/// Another position of a tag.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TagPosition {
    id: u32,
    center_m: Point,
    yaw_rad: f64,
}

/// Positions that are to be written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveTags {
    cell: String,
    tags: Vec<TagPosition>,
}

/// A cell file with other positions of its tags.
pub(crate) struct EditedCell {
    path: PathBuf,
    text: String,
    /// The cell as it is loaded from that text.
    pub(crate) cell: Cell,
}

/// The cell of a file with these tags elsewhere.
///
/// # Errors
/// A file that is not of the project, or that names one that is not; a tag that the cell does not have; a cell that is not valid.
pub(crate) fn edited(project: &Project, name: &str, tags: &[TagPosition]) -> Result<EditedCell> {
    let path = project.file(name)?;
    project.check_cell(&path)?;
    if tags.len() > MOST_TAGS {
        return Err(Error::invalid(name, "number of tags", tags.len(), format!("at most {MOST_TAGS}")));
    }
    let unreadable = |source| Error::Read { path: name.into(), source };
    let mut text = std::fs::read_to_string(&path).map_err(unreadable)?;
    if !tags.is_empty() {
        let syntax = |e: toml_edit::TomlError| Error::Syntax { path: path.clone(), problem: e.to_string() };
        let mut document: DocumentMut = text.parse().map_err(syntax)?;
        set_tags(&mut document, name, tags)?;
        text = document.to_string();
    }
    let cell = files::cell_of(&path, text.clone())?;
    Ok(EditedCell { path, text, cell })
}

/// Writes the positions into the cell file.
///
/// # Errors
/// As [`edited`]; a file that cannot be written.
pub(crate) fn save(project: &Project, request: &SaveTags) -> Result<String> {
    let edited = edited(project, &request.cell, &request.tags)?;
    files::write_whole(&edited.path, edited.text.as_bytes())?;
    Ok(request.cell.clone())
}

/// The tables of the tags, in either of TOML's notations.
fn tables(document: &mut DocumentMut) -> Vec<&mut dyn TableLike> {
    match document.get_mut("tags") {
        Some(Item::ArrayOfTables(tables)) => {
            ArrayOfTables::iter_mut(tables).map(|table| table as &mut dyn TableLike).collect()
        }
        Some(Item::Value(toml_edit::Value::Array(array))) => array
            .iter_mut()
            .filter_map(|v| v.as_inline_table_mut())
            .map(|t| t as &mut dyn TableLike)
            .collect(),
        _ => Vec::new(),
    }
}

fn set_tags(document: &mut DocumentMut, name: &str, tags: &[TagPosition]) -> Result<()> {
    let mut tables = tables(document);
    for tag in tags {
        let id = i64::from(tag.id);
        let Some(table) =
            tables.iter_mut().find(|table| table.get("id").and_then(Item::as_integer) == Some(id))
        else {
            return Err(Error::invalid(name, "tags", format!("no tag {id}"), "a tag of the cell"));
        };
        set(&mut **table, "center_m", pair([tag.center_m.x, tag.center_m.y]));
        if tag.yaw_rad != 0.0 || table.contains_key("yaw_rad") {
            set(&mut **table, "yaw_rad", tag.yaw_rad.into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(text: &str, tags: &[TagPosition]) -> Result<String> {
        let mut document: DocumentMut = text.parse().unwrap();
        set_tags(&mut document, "cell.toml", tags).map(|()| document.to_string())
    }

    fn tag(id: u32, x_m: f64, y_m: f64, yaw_rad: f64) -> TagPosition {
        TagPosition { id, center_m: Point::new(x_m, y_m), yaw_rad }
    }

    #[test]
    fn only_the_numbers_that_change_are_written() {
        let text = "# The cell.\n[[tags]] # lower left\nid = 0\nsize_m = 0.05\ncenter_m = [-0.40, 0] # measured\n\n\
            [[tags]]\nid = 7 # new\nsize_m = 0.05\ncenter_m = [0.4, 0.1]\nyaw_rad = 1.50 # turned\n";
        assert_eq!(moved(text, &[tag(0, -0.4, 0.0, 0.0), tag(7, 0.4, 0.1, 1.5)]).unwrap(), text);
        let found = moved(text, &[tag(7, 0.4012, 0.1, 1.5)]).unwrap();
        assert_eq!(found, text.replace("[0.4, 0.1]", "[0.4012, 0.1]"));
        let found = moved(text, &[tag(0, -0.4, 0.0, 0.25)]).unwrap();
        assert!(found.contains("center_m = [-0.40, 0] # measured\nyaw_rad = 0.25\n"), "{found}");
    }

    #[test]
    fn tags_in_one_line_are_moved_too_and_an_unknown_one_is_named() {
        let text = "tags = [{ id = 3, size_m = 0.05, center_m = [0.1, 0.2] }] # one\n";
        let found = moved(text, &[tag(3, 0.1, 0.25, 0.0)]).unwrap();
        assert_eq!(found, text.replace("[0.1, 0.2]", "[0.1, 0.25]"));
        let error = moved(text, &[tag(4, 0.0, 0.0, 0.0)]).unwrap_err().to_string();
        assert!(error.contains("no tag 4"), "{error}");
    }
}
