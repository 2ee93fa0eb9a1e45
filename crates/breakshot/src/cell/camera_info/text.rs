//! The text of a calibration file as one value, be it YAML, XML or JSON.

use super::NEEDED;
use crate::cell::{xml, yaml};
use crate::error::{Error, Result};
use roxmltree::Node;
use serde_json::{Map, Value};
use std::path::Path;

/// The deepest nesting of elements that is read; OpenCV nests a matrix three deep.
const MAX_DEPTH: usize = 32;

/// The keys of the file.
///
/// # Errors
/// No YAML, XML or JSON, or a file without keys.
pub(super) fn content(path: &Path, text: &str) -> Result<Map<String, Value>> {
    let syntax = |e: &dyn std::fmt::Display| Error::Syntax {
        path: path.into(),
        problem: format!("{e}; needed: {NEEDED}"),
    };
    let text = text.trim_start_matches('\u{feff}');
    let value = match text.trim_start().chars().next() {
        Some('<') => {
            let document = xml::document(text.trim_start(), &path.display().to_string())?;
            xml_value(document.root_element(), 0).map_err(|e| syntax(&e))?
        }
        Some('{') => match serde_json::from_str(text) {
            Ok(value) => value,
            // YAML in flow style starts with a brace, too.
            Err(e) => yaml::value(text).map_err(|_| syntax(&e))?,
        },
        _ => {
            // OpenCV starts its files with `%YAML:1.0`, which is no YAML directive.
            let yaml = if text.starts_with("%YAML:") { text.replacen('%', "#", 1) } else { text.into() };
            yaml::value(yaml).map_err(|e| syntax(&e))?
        }
    };
    match value {
        Value::Object(map) => Ok(map),
        _ => Err(syntax(&"a file without keys")),
    }
}

/// An element as OpenCV writes it: children by their names (`_` in lists), or a text of numbers.
fn xml_value(node: Node, depth: usize) -> std::result::Result<Value, String> {
    if depth == MAX_DEPTH {
        return Err(format!("nesting deeper than {MAX_DEPTH}"));
    }
    let mut children = node.children().filter(Node::is_element).peekable();
    if children.peek().is_none() {
        return Ok(scalars(node.text().unwrap_or_default()));
    }
    let mut items = Vec::new();
    let mut map = Map::new();
    for child in children {
        let (name, value) = (child.tag_name().name(), xml_value(child, depth + 1)?);
        if name == "_" {
            items.push(value);
        } else if map.insert(name.into(), value).is_some() {
            return Err(format!("a second element <{name}>"));
        }
    }
    Ok(if map.is_empty() { Value::Array(items) } else { Value::Object(map) })
}

/// One number, a list of numbers, or the text itself.
fn scalars(text: &str) -> Value {
    let numbers: Option<Vec<Value>> = text
        .split_whitespace()
        .map(|word| word.parse::<f64>().ok().filter(|v| v.is_finite()).map(Value::from))
        .collect();
    match numbers {
        Some(mut numbers) if numbers.len() == 1 => numbers.swap_remove(0),
        Some(numbers) if !numbers.is_empty() => Value::Array(numbers),
        _ => Value::String(text.trim().trim_matches('"').into()),
    }
}
