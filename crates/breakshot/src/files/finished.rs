//! Results on disk that are used again where nothing has changed that they depend on.

use super::{read_json, write_json};
use crate::error::Result;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A value with the hash of all that it depends on.
#[derive(Serialize)]
struct Written<'a, T> {
    #[serde(flatten)]
    value: &'a T,
    input: &'a str,
}

#[derive(Deserialize)]
struct Finished<T> {
    #[serde(flatten)]
    value: T,
    input: String,
}

/// The value in a file that [`write_finished`] wrote for the same `input`; `None` where the file is missing or something else.
pub fn read_finished<T: DeserializeOwned>(path: &Path, input: &str) -> Option<T> {
    read_json::<Finished<T>>(path).ok().filter(|found| found.input == input).map(|found| found.value)
}

/// Writes a value, which is a JSON object, with the hash `input` of all that it depends on ([`super::clip_input`]).
///
/// # Errors
/// See [`write_json`].
pub fn write_finished<T: Serialize>(path: &Path, value: &T, input: &str) -> Result<()> {
    write_json(path, &Written { value, input })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn only_a_whole_file_of_the_same_input_is_used_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let value: BTreeMap<String, f64> = [("x".to_owned(), 0.1)].into();
        write_finished(&path, &value, "one").unwrap();
        assert_eq!(read_finished(&path, "one"), Some(value));
        let found = |input: &str| read_finished::<BTreeMap<String, f64>>(&path, input);
        assert_eq!(found("two"), None, "another input");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 4]).unwrap();
        assert_eq!(found("one"), None, "half a file");
        std::fs::write(&path, "{\"x\": 0.1}").unwrap();
        assert_eq!(found("one"), None, "a file without an input");
        assert_eq!(read_finished::<BTreeMap<String, f64>>(&folder.path().join("b.json"), "one"), None);
    }
}
