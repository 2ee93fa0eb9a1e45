//! `breakshot look`: locates the objects on the table.

use crate::args::LookArgs;
use crate::recording::{Recording, Source, record};
use crate::{Outcome, console};
use breakshot::files::{self, SceneFile};
use breakshot::scene::Placed;
use breakshot::{Error, Result, capture, detect};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use tempfile::TempDir;

/// Locates all named objects in the image and writes the scene file.
pub(crate) fn run(args: &LookArgs) -> Result<Outcome> {
    let cell = files::load_cell(&args.cell)?;
    let objects = files::load_objects(&args.objects)?;
    console::note(&objects.notes);
    let camera =
        args.film.to_str().and_then(Source::live).transpose()?.map(|camera| pictures(&camera)).transpose()?;
    let path = camera.as_ref().map_or(args.film.clone(), |pictures| pictures.folder.path().join(PICTURES));
    let film = args.decoder.film(&path, &cell)?;
    let table = args.decoder.table(args.table.as_deref())?;
    let options =
        detect::Options { threshold: args.threshold, table: table.as_ref(), ..detect::Options::default() };
    let (placed, warnings) = detect::placed(film, &objects.value, &args.names, &options)?;
    console::warn(&warnings);
    // The file's date is that of its last copy: a copied picture must not pass for a new one.
    let observed_unix_s = args.taken_unix_s.or_else(|| match &camera {
        Some(pictures) => pictures.taken_unix_s,
        None => capture::recorded_unix_s(&args.film),
    });
    if observed_unix_s.is_none() {
        console::note(&[format!(
            "{} does not say when it was taken: a robot strikes only with --taken-unix-s",
            args.film.display()
        )]);
    }
    let cell = from_folder_of(&args.output, &args.cell)?;
    let scene_objects = from_folder_of(&args.output, &args.objects)?;
    let scene = SceneFile::of_picture(cell, scene_objects, placed, observed_unix_s);
    let text = toml_text(&scene)?;
    files::write_whole(&args.output, text.as_bytes())?;
    if args.json {
        console::print_json(&scene)?;
    } else {
        print_table(&scene.placed);
        println!("Wrote {}", args.output.display());
    }
    Ok(Outcome::doubtful_if(!warnings.is_empty()))
}

/// The name of the pictures of a camera.
const PICTURES: &str = "camera.mp4";
/// The time in which a camera adapts itself to the light (s), and the length of its pictures after that (s).
const ADAPTATION_S: f64 = 0.7;
const LENGTH_S: f64 = 0.3;

/// The latest pictures of a camera.
struct Pictures {
    folder: TempDir,
    /// Before the first one was taken (s since 1970); `None` for a stream that may be a recording.
    taken_unix_s: Option<f64>,
}

/// Takes pictures with a camera.
fn pictures(camera: &Source) -> Result<Pictures> {
    let temporary = |source| Error::Write { path: std::env::temp_dir(), source };
    let folder = tempfile::tempdir().map_err(temporary)?;
    let begun = SystemTime::now().duration_since(UNIX_EPOCH).ok().map(|since| since.as_secs_f64());
    let recording = Recording {
        source: camera,
        size: None,
        rate_hz: None,
        coding: None,
        skipped_s: ADAPTATION_S,
        seconds: Some(LENGTH_S),
    };
    console::warn(&record(&recording, &folder.path().join(PICTURES))?);
    Ok(Pictures { folder, taken_unix_s: begun.filter(|_| camera.takes_now()) })
}

fn print_table(placed: &[Placed]) {
    println!("{:<10} {:>9} {:>9} {:>9}", "object", "x (mm)", "y (mm)", "yaw (deg)");
    for Placed { object, position_m, yaw_rad } in placed {
        let (x, y) = (position_m.x * 1e3, position_m.y * 1e3);
        println!("{object:<10} {x:>9.2} {y:>9.2} {:>9.1}", yaw_rad.to_degrees());
    }
}

fn toml_text(scene: &SceneFile) -> Result<String> {
    toml::to_string(scene)
        .map_err(|e| Error::Write { path: "scene.toml".into(), source: std::io::Error::other(e) })
}

/// The path of `file` relative to the folder of `output`.
pub(crate) fn from_folder_of(output: &Path, file: &Path) -> Result<PathBuf> {
    let absolute = |path: &Path| {
        std::path::absolute(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })
    };
    let (output, file) = (absolute(output)?, absolute(file)?);
    let folder = output.parent().unwrap_or(Path::new("/"));
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().count() - shared;
    let down = file.components().skip(shared);
    Ok(std::iter::repeat_n(PathBuf::from(".."), up).collect::<PathBuf>().join(down.collect::<PathBuf>()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paths_in_a_scene_are_relative_to_its_folder() {
        let named = |output: &str, file: &str| from_folder_of(Path::new(output), Path::new(file)).unwrap();
        assert_eq!(named("scene.toml", "cell.toml"), Path::new("cell.toml"));
        assert_eq!(named("out/scene.toml", "in/cell.toml"), Path::new("../in/cell.toml"));
        assert_eq!(named("/a/b/scene.toml", "/a/cell.toml"), Path::new("../cell.toml"));
    }
}
