//! `breakshot init`: templates of the input files.

use crate::Outcome;
use crate::args::InitArgs;
use breakshot::{Error, Result, files};

/// The file names and the texts of the templates.
pub(crate) const TEMPLATES: &[(&str, &str)] = &[
    ("cell.toml", include_str!("../../../templates/cell.toml")),
    ("objects.toml", include_str!("../../../templates/objects.toml")),
    ("campaign.toml", include_str!("../../../templates/campaign.toml")),
    ("scene.toml", include_str!("../../../templates/scene.toml")),
    ("FILMING.md", include_str!("../../../templates/FILMING.md")),
];

/// Writes the templates; if one of the files already exists, this is an error and nothing is written.
pub(crate) fn run(args: &InitArgs) -> Result<Outcome> {
    let folder = &args.folder;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    if let Some((name, _)) = TEMPLATES.iter().find(|(name, _)| folder.join(name).exists()) {
        let path = folder.join(name).display().to_string();
        return Err(Error::invalid(
            path,
            "the file",
            "already exists",
            "a folder without it; nothing was written",
        ));
    }
    for (name, text) in TEMPLATES {
        files::write_whole(&folder.join(name), text.as_bytes())?;
    }
    println!("Wrote to {}:", folder.display());
    println!("  cell.toml      camera, tags, workspace and striker: measure and fill in");
    println!("  objects.toml   outlines, heights and markers of the objects");
    println!("  campaign.toml  the list of strike videos");
    println!("  scene.toml     a pile and the goal; `breakshot look` writes it from an image");
    println!("  FILMING.md     how to film: camera, light, markers, clips");
    println!("Next: breakshot calibrate {}/cell.toml CLIP.mp4", folder.display());
    Ok(Outcome::Done)
}
