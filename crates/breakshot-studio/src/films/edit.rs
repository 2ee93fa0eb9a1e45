//! Changes of a campaign's clips, written into its file with its comments, and taken back.

use crate::project::Project;
use breakshot::campaign::ClipStart;
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, value};

/// A change of one clip; what is not given stays.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ClipChange {
    campaign: String,
    /// The clip's name in the campaign.
    clip: String,
    /// Whether the whole clip is left out.
    excluded: Option<bool>,
    /// The stretches of time that are left out (s of the clip).
    excluded_s: Option<Vec<[f64; 2]>>,
    /// Its objects, the struck one first.
    objects: Option<Vec<String>>,
    /// Where objects are in the first frame.
    starts: Option<Vec<ClipStart>>,
}

/// A campaign whose last change is taken back.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Undo {
    campaign: String,
}

/// The changes that can be taken back, for each campaign.
#[derive(Debug, Default)]
pub(crate) struct Edits(Mutex<BTreeMap<PathBuf, Vec<Step>>>);

/// The text of a file before and after a change.
#[derive(Debug)]
struct Step {
    before: String,
    after: String,
}

/// Most changes that are remembered.
const MOST_STEPS: usize = 100;

impl Edits {
    /// The number of changes of a campaign that can be taken back.
    ///
    /// # Errors
    /// A file that is not of the project.
    pub(crate) fn count(&self, project: &Project, campaign: &str) -> Result<usize> {
        let path = project.file(campaign)?;
        let steps = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(steps.get(&path).map_or(0, Vec::len))
    }

    /// Changes a clip; returns the number of changes that can be taken back.
    ///
    /// # Errors
    /// A clip that the campaign does not have, a change after which the campaign is not valid, a file that cannot be written.
    pub(crate) fn change(&self, project: &Project, request: &ClipChange) -> Result<usize> {
        let path = project.file(&request.campaign)?;
        self.edited(&path, None, |text| {
            let number = entry_number(&path, text, &request.clip)?;
            let mut document = parsed(&path, text)?;
            let tables = document.get_mut("clips").and_then(Item::as_array_of_tables_mut);
            let needed = "`[[clips]]` entries, each a table of its own";
            let table = tables.and_then(|tables| tables.get_mut(number)).ok_or_else(|| {
                Error::invalid(&request.campaign, "clips", "written in another form", needed)
            })?;
            set_clip(table, request);
            Ok(document.to_string())
        })
    }

    /// Appends a film and its objects as the last clip; a campaign that does not exist yet begins with its `first` lines.
    ///
    /// # Errors
    /// A campaign that is not valid with it, a file that cannot be written.
    pub(crate) fn append(
        &self,
        path: &Path,
        first: Option<&str>,
        (film, objects): (&str, &[String]),
    ) -> Result<usize> {
        self.edited(path, first, |text| {
            let objects: Vec<String> =
                objects.iter().map(|name| toml::Value::from(name.as_str()).to_string()).collect();
            let break_before = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
            Ok(format!(
                "{text}{break_before}\n[[clips]]\nvideo = {}\nobjects = [{}]\n# strike = {{ speed_m_s = 0.4, heading_rad = 0.0, start_m = [-0.30, 0.0], travel_m = 0.07 }}\n",
                toml::Value::from(film),
                objects.join(", ")
            ))
        })
    }

    /// Takes back the last change; returns the number of those that are left.
    ///
    /// # Errors
    /// No change, a file that another program has changed since.
    pub(crate) fn undo(&self, project: &Project, request: &Undo) -> Result<usize> {
        let path = project.file(&request.campaign)?;
        let mut steps = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(of_file) = steps.get_mut(&path).filter(|steps| !steps.is_empty()) else {
            return Err(Error::invalid(&request.campaign, "changes", "none", "a change to take back"));
        };
        let is_current = of_file.last().is_some_and(|step| read(&path).is_ok_and(|text| text == step.after));
        if !is_current {
            // What is in the file now is not ours to replace.
            of_file.clear();
            let needed = "the file as the studio wrote it";
            return Err(Error::invalid(
                &request.campaign,
                "the file",
                "changed since by another program",
                needed,
            ));
        }
        if let Some(step) = of_file.pop() {
            files::write_whole(&path, step.before.as_bytes())?;
        }
        Ok(of_file.len())
    }

    /// Writes the new text of a campaign if it is valid; that a new one begins is not taken back.
    fn edited(
        &self,
        path: &Path,
        first: Option<&str>,
        new_text: impl FnOnce(&str) -> Result<String>,
    ) -> Result<usize> {
        let mut steps = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = first.filter(|_| path.symlink_metadata().is_err());
        let before = begun.map_or_else(|| read(path), |first| Ok(first.to_owned()))?;
        let after = new_text(&before)?;
        files::campaign_of(path, &after)?;
        let of_file = steps.entry(path.to_owned()).or_default();
        if before != after {
            files::write_whole(path, after.as_bytes())?;
            if begun.is_some() {
                return Ok(of_file.len());
            }
            of_file.push(Step { before, after });
            if of_file.len() > MOST_STEPS {
                of_file.remove(0);
            }
        }
        Ok(of_file.len())
    }
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source })
}

fn parsed(path: &Path, text: &str) -> Result<DocumentMut> {
    text.parse().map_err(|error: toml_edit::TomlError| Error::Syntax {
        path: path.into(),
        problem: error.to_string(),
    })
}

/// The number of a clip's entry in the file, where excluded clips count too.
fn entry_number(path: &Path, text: &str, clip: &str) -> Result<usize> {
    let campaign = files::campaign_of(path, text)?.value;
    let document = parsed(path, text)?;
    let entries = document.get("clips").and_then(Item::as_array_of_tables).into_iter().flatten();
    let (mut included, mut excluded) = (campaign.clips.iter(), campaign.excluded.iter());
    let names = entries.map(|entry| {
        let is_excluded = entry.get("exclude").and_then(Item::as_bool) == Some(true);
        let next = if is_excluded { excluded.next() } else { included.next() };
        next.map(|clip| clip.name.clone())
    });
    let names: Vec<Option<String>> = names.collect();
    let needed = "the name of a clip of the campaign";
    let found = names.iter().position(|name| name.as_deref() == Some(clip));
    found.ok_or_else(|| Error::invalid("the campaign", "clip", clip.escape_debug(), needed))
}

fn set_clip(table: &mut Table, request: &ClipChange) {
    if let Some(objects) = &request.objects {
        put(table, "objects", objects.iter().map(String::as_str).collect::<Array>().into());
    }
    match request.starts.as_deref() {
        Some([]) => {
            table.remove("starts");
        }
        Some(starts) => {
            let starts = starts.iter().map(|start| toml_edit::Value::InlineTable(start_table(start)));
            put(table, "starts", starts.collect::<Array>().into());
        }
        None => {}
    }
    match (request.excluded, &request.excluded_s) {
        (Some(true), _) => put(table, "exclude", true.into()),
        (_, Some(stretches)) if !stretches.is_empty() => {
            let pairs = stretches.iter().map(|pair| toml_edit::Value::Array(Array::from_iter(*pair)));
            put(table, "exclude", pairs.collect::<Array>().into());
        }
        (Some(false), _) | (None, Some(_)) => {
            table.remove("exclude");
        }
        (None, None) => {}
    }
}

/// A start as it is written: lengths in whole tenths of a millimetre, a fifth of a pixel of usual films.
fn start_table(start: &ClipStart) -> InlineTable {
    let rounded = |value: f64| (value * 1e4).round() / 1e4;
    let mut table = InlineTable::new();
    table.insert("object", start.object.as_str().into());
    let position_m = [start.position_m.x, start.position_m.y].map(rounded);
    table.insert("position_m", Array::from_iter(position_m).into());
    if let Some(yaw_rad) = start.yaw_rad {
        table.insert("yaw_rad", rounded(yaw_rad).into());
    }
    table
}

/// Sets a value; the comment behind it stays.
fn put(table: &mut Table, key: &str, new: toml_edit::Value) {
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) => {
            let decor = old.decor().clone();
            *old = new;
            *old.decor_mut() = decor;
        }
        None => {
            table.insert(key, value(new));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Films.\ncell = \"cell.toml\"\n\n[[clips]] # first\nvideo = \"a.mp4\"\nobjects = [\"a\"] # struck\n\n[[clips]]\nvideo = \"b.mp4\"\nobjects = [\"a\"]\n";

    fn changed(text: &str, number: usize, change: serde_json::Value) -> String {
        let mut question = serde_json::json!({ "campaign": "c", "clip": "x" });
        for (key, value) in change.as_object().unwrap() {
            question[key] = value.clone();
        }
        let request: ClipChange = serde_json::from_value(question).unwrap();
        let mut document: DocumentMut = text.parse().unwrap();
        let tables = document.get_mut("clips").and_then(Item::as_array_of_tables_mut).unwrap();
        set_clip(tables.get_mut(number).unwrap(), &request);
        document.to_string()
    }

    #[test]
    fn comments_stay_where_clips_change_and_back_is_back() {
        let other = changed(TEXT, 0, serde_json::json!({ "objects": ["c", "a"] }));
        assert!(
            other.contains("objects = [\"c\", \"a\"] # struck") && other.contains("[[clips]] # first"),
            "{other}"
        );
        assert_eq!(changed(&other, 0, serde_json::json!({ "objects": ["a"] })), TEXT);
        let left_out = changed(TEXT, 1, serde_json::json!({ "excluded": true }));
        assert!(left_out.ends_with("objects = [\"a\"]\nexclude = true\n"), "{left_out}");
        assert_eq!(changed(&left_out, 1, serde_json::json!({ "excluded": false })), TEXT);
        let stretch = changed(TEXT, 1, serde_json::json!({ "excluded_s": [[0.25, 0.5]] }));
        assert!(stretch.ends_with("exclude = [[0.25, 0.5]]\n"), "{stretch}");
        assert_eq!(changed(&stretch, 1, serde_json::json!({ "excluded_s": [] })), TEXT);
        assert_eq!(changed(TEXT, 0, serde_json::json!({})), TEXT);
        let start = serde_json::json!({ "object": "a", "position_m": [0.12345, -0.02], "yaw_rad": 1.25 });
        let seen = changed(TEXT, 1, serde_json::json!({ "starts": [start] }));
        let written = "starts = [{ object = \"a\", position_m = [0.1235, -0.02], yaw_rad = 1.25 }]\n";
        assert!(seen.ends_with(written), "{seen}");
        assert_eq!(changed(&seen, 1, serde_json::json!({ "starts": [] })), TEXT);
    }
}
