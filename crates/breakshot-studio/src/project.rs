//! The folder of the project: which files it holds, and that no name leads out of it.

use breakshot::campaign::FILM_EXTENSIONS;
use breakshot::cell::CameraInfo;
use breakshot::files::FilmPath;
use breakshot::{Error, Result, files};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Component, Path, PathBuf};

/// The folder that the studio was started for.
#[derive(Debug)]
pub(crate) struct Project {
    root: PathBuf,
}

/// Deepest folder that is listed.
const MOST_DEPTH: usize = 3;
/// Most files that are looked at for the list.
const MOST_FILES: usize = 5000;

/// The files of a project by what they are.
#[derive(Debug, Default, serde::Serialize)]
pub(crate) struct Contents {
    /// The name of the folder.
    name: String,
    pub(crate) scenes: Vec<String>,
    pub(crate) properties: Vec<String>,
    pub(crate) plans: Vec<String>,
    pub(crate) strikes: Vec<String>,
    pub(crate) campaigns: Vec<String>,
    pub(crate) cells: Vec<String>,
    pub(crate) objects: Vec<String>,
    pub(crate) films: Vec<String>,
    pub(crate) pictures: Vec<String>,
    pub(crate) tracks: Vec<String>,
    pub(crate) comparisons: Vec<String>,
}

impl Project {
    /// # Errors
    /// A folder that does not exist.
    pub(crate) fn open(folder: &Path) -> Result<Self> {
        let unreadable = |source| Error::Read { path: folder.into(), source };
        let root = folder.canonicalize().map_err(unreadable)?;
        if !root.is_dir() {
            return Err(Error::invalid(folder.display().to_string(), "the project", "a file", "a folder"));
        }
        Ok(Self { root })
    }

    /// An existing file of the project.
    ///
    /// # Errors
    /// A name that is absolute or leads out of the folder, a link on the way, no such file.
    pub(crate) fn file(&self, name: &str) -> Result<PathBuf> {
        let path = self.new_file(name)?;
        if !path.is_file() {
            return Err(Error::invalid(name, "the file", "missing", "a file of the project"));
        }
        Ok(path)
    }

    /// A file of the project that may exist already.
    ///
    /// # Errors
    /// As [`Project::file`], but the file may be missing.
    pub(crate) fn new_file(&self, name: &str) -> Result<PathBuf> {
        let refused = |found: &str| {
            let needed = "a file of the project: a name without `..`, and no link";
            Err(Error::invalid(name.escape_debug().to_string(), "the file", found, needed))
        };
        if name.is_empty() || name.len() > 1000 || name.contains(|c: char| c.is_control() || c == '\\') {
            return refused("not such a name");
        }
        let mut path = self.root.clone();
        for part in Path::new(name).components() {
            let Component::Normal(part) = part else { return refused("outside of the folder") };
            if part.to_string_lossy().starts_with('.') {
                return refused("hidden");
            }
            path.push(part);
            if path.symlink_metadata().is_ok_and(|file| file.file_type().is_symlink()) {
                return refused("a link");
            }
        }
        Ok(path)
    }

    /// A file that a file of the project names, relative to it.
    ///
    /// # Errors
    /// As [`Project::file`].
    pub(crate) fn named_in(&self, file: &Path, named: &Path) -> Result<PathBuf> {
        let folder = file.parent().unwrap_or(&self.root);
        let mut parts: Vec<String> = Vec::new();
        let whole = FilmPath::of(&folder.join(named)).file;
        let Ok(inside) = whole.strip_prefix(&self.root) else {
            return self.file(&named.to_string_lossy());
        };
        for part in inside.components() {
            match part {
                Component::ParentDir if parts.pop().is_none() => return self.file("../"),
                Component::Normal(part) => parts.push(part.to_string_lossy().into_owned()),
                _ => {}
            }
        }
        self.file(&parts.join("/"))
    }

    /// The files that a cell names, all of the project.
    ///
    /// # Errors
    /// A cell that is not TOML, or that names another file.
    pub(crate) fn check_cell(&self, cell: &Path) -> Result<Vec<PathBuf>> {
        let table: toml::Table = files::read_toml(cell)?;
        let named = |section: &str, key: &str| table.get(section)?.get(key)?.as_str().map(PathBuf::from);
        let arm = named("robot", "arm").filter(|arm| arm.extension().is_some());
        let lens = named("camera", "camera_info").map(|path| CameraInfo::from(path).file_and_camera().0);
        let names = lens.into_iter().chain(arm);
        names.map(|name| self.named_in(cell, &name)).collect()
    }

    /// The name of a file of the project, with `/` between folders.
    pub(crate) fn name(&self, path: &Path) -> String {
        let inside = path.strip_prefix(&self.root).unwrap_or(path);
        let parts: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
        parts.join("/")
    }

    /// A number that changes when a file of the project is written, added or removed.
    pub(crate) fn stamp(&self) -> u64 {
        let mut left = MOST_FILES;
        let mut files = Vec::new();
        collect(&self.root, MOST_DEPTH, &mut left, &mut files);
        files.sort();
        let mut hasher = DefaultHasher::new();
        for path in files {
            let file = path.metadata().ok();
            (self.name(&path), file.as_ref().and_then(|f| f.modified().ok()), file.map(|f| f.len()))
                .hash(&mut hasher);
        }
        // Whole numbers up to this size are exact in the page.
        hasher.finish() >> 12
    }

    /// The files of the project, by name.
    pub(crate) fn contents(&self) -> Contents {
        let name = self.root.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut found = Contents { name, ..Contents::default() };
        let mut left = MOST_FILES;
        let mut files = Vec::new();
        collect(&self.root, MOST_DEPTH, &mut left, &mut files);
        files.sort();
        for path in files {
            let name = self.name(&path);
            match kind(&path) {
                Some(Kind::Scene) => found.scenes.push(name),
                Some(Kind::Properties) => found.properties.push(name),
                Some(Kind::Plan) => found.plans.push(name),
                Some(Kind::Strike) => found.strikes.push(name),
                Some(Kind::Campaign) => found.campaigns.push(name),
                Some(Kind::Cell) => found.cells.push(name),
                Some(Kind::Objects) => found.objects.push(name),
                Some(Kind::Film) => found.films.push(name),
                Some(Kind::Picture) => found.pictures.push(name),
                Some(Kind::Tracks) => found.tracks.push(name),
                Some(Kind::Comparison) => found.comparisons.push(name),
                None => {}
            }
        }
        found
    }
}

/// Regular files below a folder; links and hidden files are left out.
fn collect(folder: &Path, depth: usize, left: &mut usize, found: &mut Vec<PathBuf>) {
    let Ok(entries) = folder.read_dir() else { return };
    for entry in entries.flatten() {
        let Ok(kind) = entry.file_type() else { continue };
        if *left == 0 || entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        *left -= 1;
        if kind.is_file() {
            found.push(entry.path());
        } else if kind.is_dir() && depth > 0 {
            collect(&entry.path(), depth - 1, left, found);
        }
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Scene,
    Properties,
    Plan,
    Strike,
    Campaign,
    Cell,
    Objects,
    Film,
    Picture,
    Tracks,
    Comparison,
}

/// The extension of pictures that are read as films of one frame.
pub(crate) const PICTURE_EXTENSION: &str = "png";
/// Largest file whose content decides what it is (bytes).
const MOST_BYTES: u64 = 64 << 20;

/// The files of an output of `breakshot verify` that make a comparison.
pub(crate) const REPORT: &str = "report.json";
pub(crate) const TRACKS: &str = "tracks.json";
pub(crate) const TRAJECTORY: &str = "trajectory.json";

/// Whether a report has tracks and a trajectory beside it, as `breakshot verify` writes them.
fn is_comparison(report: &Path) -> bool {
    report.file_name().is_some_and(|name| name == REPORT)
        && [TRACKS, TRAJECTORY].iter().all(|name| report.with_file_name(name).is_file())
}

/// What a file is: a film by its extension, others by the keys at their top.
fn kind(path: &Path) -> Option<Kind> {
    let extension = path.extension()?.to_str()?;
    if FILM_EXTENSIONS.contains(&extension.to_ascii_lowercase().as_str()) {
        return Some(Kind::Film);
    }
    if extension.eq_ignore_ascii_case(PICTURE_EXTENSION) {
        return Some(Kind::Picture);
    }
    if !matches!(extension, "toml" | "json") || path.metadata().ok()?.len() > MOST_BYTES {
        return None;
    }
    let text = std::fs::read_to_string(path).ok()?;
    let has = |keys: &[&str], known: &dyn Fn(&str) -> bool| keys.iter().all(|key| known(key));
    if extension == "toml" {
        let table: toml::Table = text.parse().ok()?;
        let known = |key: &str| table.contains_key(key);
        return match () {
            () if has(&["clips", "cell"], &known) => Some(Kind::Campaign),
            () if has(&["cell", "objects"], &known) => Some(Kind::Scene),
            () if has(&["workspace", "striker"], &known) => Some(Kind::Cell),
            () if has(&["objects"], &known) => Some(Kind::Objects),
            () => None,
        };
    }
    let keys: Keys = serde_json::from_str(&text).ok()?;
    let known = |key: &str| keys.0.iter().any(|k| k == key);
    match () {
        () if has(&["strike", "outcome", "prediction"], &known) => Some(Kind::Plan),
        () if has(&["friction", "mass_ratio"], &known) => Some(Kind::Properties),
        () if has(&["video", "tracks"], &known) => Some(Kind::Tracks),
        () if has(&["before", "observed", "predicted"], &known) => {
            is_comparison(path).then_some(Kind::Comparison)
        }
        () if has(&["start_m", "heading_rad", "travel_m"], &known) => Some(Kind::Strike),
        () => None,
    }
}

/// The keys of a JSON object; the values are skipped.
struct Keys(Vec<String>);

impl<'de> serde::Deserialize<'de> for Keys {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Keys;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<M: serde::de::MapAccess<'de>>(
                self,
                mut map: M,
            ) -> std::result::Result<Keys, M::Error> {
                let mut keys = Vec::new();
                while let Some(key) = map.next_key::<String>()? {
                    map.next_value::<serde::de::IgnoredAny>()?;
                    keys.push(key);
                }
                Ok(Keys(keys))
            }
        }
        deserializer.deserialize_map(Visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_and_no_link_leads_out_of_the_folder() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("project");
        std::fs::create_dir_all(root.join("sub")).unwrap();
        std::fs::write(folder.path().join("secret"), "s").unwrap();
        std::fs::write(root.join("sub/a.toml"), "").unwrap();
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(folder.path().join("secret"), root.join("link")).unwrap();
            std::os::unix::fs::symlink(folder.path(), root.join("up")).unwrap();
        }
        let project = Project::open(&root).unwrap();
        assert!(project.file("sub/a.toml").is_ok());
        for name in [
            "../secret",
            "sub/../../secret",
            "/etc/passwd",
            "link",
            "up/secret",
            "",
            "a\0",
            ".git/x",
            "sub",
            "none",
        ] {
            assert!(project.file(name).is_err(), "{name:?}");
        }
        let file = project.file("sub/a.toml").unwrap();
        assert_eq!(project.named_in(&file, Path::new("../sub/a.toml")).unwrap(), file);
        for name in ["../../secret", "../../../x", "/etc/passwd"] {
            assert!(project.named_in(&file, Path::new(name)).is_err(), "{name:?}");
        }
    }
}
