//! The path of a film, behind which the topic of a bag may stand: `bag.mcap#/camera/image_raw`.

use std::path::{Path, PathBuf};

/// The file or folder of a film, and the topic if it is a bag of ROS.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilmPath {
    /// The file or folder.
    pub file: PathBuf,
    /// What stands behind the `#`.
    pub topic: Option<String>,
}

impl FilmPath {
    /// Splits the path of a film at the first `#` before which a file or folder is; a path that exists itself has no topic.
    pub fn of(path: &Path) -> Self {
        let whole = || Self { file: path.to_path_buf(), topic: None };
        let Some(text) = path.to_str().filter(|_| !path.exists()) else { return whole() };
        let mut splits = text.match_indices('#').map(|(at, _)| (Path::new(&text[..at]), &text[at + 1..]));
        let split = splits.find(|(file, topic)| !topic.is_empty() && file.exists());
        split.map_or_else(whole, |(file, topic)| Self { file: file.into(), topic: Some(topic.to_owned()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_split_where_a_file_ends_and_the_topic_begins() {
        let folder = tempfile::tempdir().expect("a folder");
        let (bag, odd) = (folder.path().join("a.mcap"), folder.path().join("b#2.mcap"));
        for file in [&bag, &odd] {
            std::fs::write(file, b"").expect("a file");
        }
        let of = |file: &Path, behind: &str| FilmPath::of(Path::new(&format!("{}{behind}", file.display())));
        assert_eq!(of(&bag, ""), FilmPath { file: bag.clone(), topic: None });
        assert_eq!(of(&bag, "#/c/image"), FilmPath { file: bag.clone(), topic: Some("/c/image".into()) });
        assert_eq!(of(&odd, ""), FilmPath { file: odd.clone(), topic: None });
        assert_eq!(of(&odd, "#image"), FilmPath { file: odd.clone(), topic: Some("image".into()) });
        assert_eq!(of(folder.path(), "/#/x").topic.as_deref(), Some("/x"), "a folder with a slash");
        let missing = folder.path().join("none.mcap#/x");
        assert_eq!(FilmPath::of(&missing), FilmPath { file: missing.clone(), topic: None });
    }
}
