//! The readers by what they read, with seeds from the fixtures of the repository.

pub mod cells;
pub mod films;
pub mod numbers;
pub mod robots;
pub mod scenes;

use crate::Outcome;
use std::path::{Path, PathBuf};

/// What JSON is made of.
const JSON: &[&str] = &[
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "\"",
    "null",
    "true",
    "-1",
    "1e308",
    "1e-320",
    "1e999",
    "0",
    "\\u0000",
    "[[",
    "]]",
    "-0.0",
    "\"version\"",
];

/// A folder or file of the repository.
fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}

/// The bytes of a file of the repository.
fn fixture(path: &str) -> Vec<u8> {
    let path = repository(path);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The text of a file of the repository.
fn fixture_text(path: &str) -> String {
    String::from_utf8(fixture(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// A value or an error; an error that neither names a file that cannot be read nor contains any of these names is wrong.
fn outcome<T>(read: breakshot::Result<T>, names: &[&str]) -> Result<Outcome, String> {
    match read {
        Ok(_) => Ok(Outcome::Read),
        Err(breakshot::Error::Read { .. }) => {
            Ok(Outcome::Refused("a file that it names cannot be read".into()))
        }
        Err(error) => {
            let said = error.to_string();
            if names.iter().any(|name| said.contains(name)) {
                Ok(Outcome::Refused(said))
            } else {
                Err(format!("the error `{said}` names none of {names:?}"))
            }
        }
    }
}

/// A JSON value with some changes, one a line: a pointer, a space, and the new value, or nothing to remove it. What does not fit is
/// ignored. Without such lines, mutations of a large file would rarely leave it one.
fn edited(mut value: serde_json::Value, edits: &str) -> serde_json::Value {
    for line in edits.lines() {
        let (pointer, new) = line.split_once(' ').unwrap_or((line, ""));
        if new.is_empty() {
            let Some((parent, key)) = pointer.rsplit_once('/') else { continue };
            match value.pointer_mut(parent) {
                Some(serde_json::Value::Object(fields)) => drop(fields.remove(key)),
                Some(serde_json::Value::Array(items)) => {
                    if let Some(at) = key.parse().ok().filter(|at| *at < items.len()) {
                        items.remove(at);
                    }
                }
                _ => {}
            }
        } else if let (Some(old), Ok(new)) = (value.pointer_mut(pointer), serde_json::from_str(new)) {
            *old = new;
        }
    }
    value
}
