//! `breakshot campaign`: a draft of the clip list from a folder of films.

use crate::campaign_args::CampaignArgs;
use crate::commands::detection::look::from_folder_of;
use crate::{Outcome, console};
use breakshot::campaign::{FILM_EXTENSIONS, named_objects};
use breakshot::{Error, Result, files};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The file that makes a folder of pictures a film.
const TIMING: &str = "timing.toml";
/// The file that makes a folder a bag of ROS 2, and its first key.
const METADATA: [&str; 2] = ["metadata.yaml", "rosbag2_bagfile_information"];
/// Folders are searched so deep, and for so many clips.
const DEEPEST: usize = 4;
const MOST_CLIPS: usize = 10_000;

/// Writes the draft: one entry for each film or table of tracks.
pub(crate) fn run(args: &CampaignArgs) -> Result<Outcome> {
    if args.output.exists() {
        let name = args.output.display().to_string();
        return Err(Error::invalid(
            name,
            "the output",
            "a file that exists",
            "another name, or no such file",
        ));
    }
    let mut clips = Vec::new();
    collect(&args.folder, DEEPEST, &mut clips)?;
    clips.sort();
    if clips.is_empty() {
        let needed = "films (.mp4, .mov, ..), folders of pictures with a timing.toml, or tracks (.csv)";
        return Err(Error::invalid(args.folder.display().to_string(), "the folder", "without clips", needed));
    }
    let (cell, objects) = (
        input(args, args.cell.as_deref(), "cell.toml"),
        input(args, args.objects.as_deref(), "objects.toml"),
    );
    let mut names = Vec::new();
    if objects.exists() {
        let loaded = files::load_objects(&objects)?;
        names = loaded.value.into_iter().map(|object| object.name).collect();
    }
    let head =
        Head { cell: from_folder_of(&args.output, &cell)?, objects: from_folder_of(&args.output, &objects)? };
    let Draft { text, warnings } = draft(args, &head, &clips, &names)?;
    let mut all = Vec::new();
    for (file, what) in [(&cell, "camera, workspace and striker"), (&objects, "the objects")] {
        if !file.exists() {
            all.push(format!(
                "{} does not exist yet; needed: {what} (`breakshot init` writes a template)",
                file.display()
            ));
        }
    }
    all.extend(warnings);
    console::warn(&all);
    files::write_whole(&args.output, text.as_bytes())?;
    println!("Wrote {}: fill in what its comments say, then run", args.output.display());
    println!("  breakshot check {}", args.output.display());
    println!("  breakshot estimate {} -o properties.json", args.output.display());
    Ok(Outcome::doubtful_if(!all.is_empty()))
}

/// The given file, or the one of this name beside the output or in the folder of the films.
fn input(args: &CampaignArgs, given: Option<&Path>, name: &str) -> PathBuf {
    let beside = args.output.with_file_name(name);
    let within = args.folder.join(name);
    given.map_or_else(|| if !beside.exists() && within.exists() { within } else { beside }, Path::to_path_buf)
}

/// Whether a folder is a bag of ROS 2.
fn is_bag(folder: &Path) -> bool {
    let [file, key] = METADATA;
    std::fs::read_to_string(folder.join(file)).is_ok_and(|text| text.contains(key))
}

/// Adds the films and tables in a folder and in its folders.
fn collect(folder: &Path, deepest: usize, clips: &mut Vec<PathBuf>) -> Result<()> {
    let unreadable = |source| Error::Read { path: folder.into(), source };
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let is_clip = |extension: &str| FILM_EXTENSIONS.contains(&extension) || extension == "csv";
        if is_hidden {
        } else if path.is_dir() && !path.join(TIMING).exists() && !is_bag(&path) {
            if deepest > 0 {
                collect(&path, deepest - 1, clips)?;
            }
        } else if path.is_dir() || extension.as_deref().is_some_and(is_clip) {
            clips.push(path);
        }
    }
    if clips.len() > MOST_CLIPS {
        let found = format!("more than {MOST_CLIPS} clips");
        return Err(Error::invalid(
            folder.display().to_string(),
            "the folder",
            found,
            "the films of one campaign",
        ));
    }
    Ok(())
}

/// The files that the campaign names.
struct Head {
    cell: PathBuf,
    objects: PathBuf,
}

/// A draft, and what is doubtful in it.
struct Draft {
    text: String,
    warnings: Vec<String>,
}

fn draft(args: &CampaignArgs, head: &Head, clips: &[PathBuf], names: &[String]) -> Result<Draft> {
    let mut text = format!(
        "# The clips from which the properties are estimated: a draft, to be completed.\n\
         #\n\
         # objects   the struck object first, then the one it hits; a second copy is \"puck#2\". FILL IN where the list is\n\
         #           empty, and CHECK where it comes from the name of the file.\n\
         # strike    the commanded strike: from `start_m` (the striker's centre) by `travel_m` along `heading_rad` (from x\n\
         #           towards y) at `speed_m_s`. FILL IN and remove the `#`; without it nothing is assumed of how the objects\n\
         #           were set in motion, and nothing is learned of the striker.\n\
         # Slow motion also needs `frame_rate_hz = 240.0`, the rate at which it was taken.\n\
         cell = {}\n\
         objects = {}\n",
        quoted(&head.cell),
        quoted(&head.objects)
    );
    let (mut warnings, mut unnamed) = (Vec::new(), Vec::new());
    let repeated = files::repeats(clips)?;
    for (clip, earlier) in clips.iter().zip(repeated) {
        let path = quoted(&from_folder_of(&args.output, clip)?);
        if let Some(earlier) = earlier {
            let same = quoted(&from_folder_of(&args.output, &clips[earlier])?);
            let _ = writeln!(text, "\n# {path} is left out: it has the same content as {same}.");
            warnings.push(format!("{} is left out: it has the same content as {same}", clip.display()));
            continue;
        }
        let is_table = clip.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv"));
        let key = if is_table { "tracks" } else { "video" };
        let found = named_objects(&clip.file_stem().unwrap_or_default().to_string_lossy(), names);
        let objects: Vec<String> =
            found.iter().map(|name| toml::Value::from(name.as_str()).to_string()).collect();
        let hint = if found.is_empty() { "FILL IN" } else { "CHECK: from the name of the file" };
        let _ = writeln!(text, "\n[[clips]]\n{key} = {path}\nobjects = [{}]    # {hint}", objects.join(", "));
        if is_table {
            let _ = writeln!(
                text,
                "# columns = {{ .. }}    # unless the columns are object,time_s,x_m,y_m: see docs/formats.md"
            );
        }
        let _ = writeln!(
            text,
            "# strike = {{ speed_m_s = 0.4, heading_rad = 0.0, start_m = [-0.30, 0.0], travel_m = 0.07 }}"
        );
        if found.is_empty() {
            unnamed.push(clip.display().to_string());
        }
    }
    if let Some(first) = unnamed.first() {
        let count = unnamed.len();
        let clips = if count == 1 { first.clone() } else { format!("{count} clips ({first} ..)") };
        warnings.push(format!("{clips}: no object of the objects file is in the name; fill in `objects`"));
    }
    Ok(Draft { text, warnings })
}

/// A path as TOML text.
fn quoted(path: &Path) -> String {
    toml::Value::from(path.to_string_lossy().into_owned()).to_string()
}
