//! An empty folder becomes a project: the templates of `breakshot init`.

use crate::project::Project;
use breakshot::{Error, Result, files};

/// Name and text of each template.
pub(crate) type Templates = &'static [(&'static str, &'static str)];

/// The page lists the films that are added in a campaign of its own; the template names films that do not exist.
const CAMPAIGN: &str = "campaign.toml";

/// Writes the templates but that of the campaign; nothing is written where one of the files exists.
///
/// # Errors
/// A file that exists, or cannot be written.
pub(crate) fn written(project: &Project, templates: Templates) -> Result<Vec<String>> {
    let templates: Vec<_> = templates.iter().filter(|(name, _)| *name != CAMPAIGN).collect();
    for (name, _) in &templates {
        if project.new_file(name)?.symlink_metadata().is_ok() {
            return Err(Error::invalid(
                *name,
                "the file",
                "already exists",
                "a folder without it; nothing was written",
            ));
        }
    }
    for (name, text) in &templates {
        files::write_whole(&project.new_file(name)?, text.as_bytes())?;
    }
    Ok(templates.iter().map(|(name, _)| (*name).to_owned()).collect())
}
