//! The model of a pile and its strike for another simulator, as `breakshot export` writes it.

use super::request::{Cache, PileRequest};
use crate::project::Project;
use breakshot::scene::Strike;
use breakshot::{Error, Result, files, physics};
use serde::{Deserialize, Serialize};

/// A pile and a strike that are to be exported.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExportRequest {
    pile: PileRequest,
    properties: String,
    strike: Strike,
    output: String,
}

/// The file that was written, and the approximations of its model.
#[derive(Serialize)]
pub(crate) struct Exported {
    file: String,
    notes: Vec<String>,
}

/// Writes the pile and the strike as a model of `MuJoCo`.
///
/// # Errors
/// A pile or strike that is not valid, a file that is not of the project, not named `.xml`, or that cannot be written.
pub(crate) fn exported(project: &Project, cache: &Cache, request: &ExportRequest) -> Result<Exported> {
    let ExportRequest { pile, properties, strike, output } = request;
    let path = project.new_file(output)?;
    if path.extension().is_none_or(|extension| extension != "xml") {
        return Err(Error::invalid(output, "the name", "not one of XML", "a name that ends with .xml"));
    }
    let scene = cache.pile(project, pile)?;
    let properties = cache.properties(project, properties, &scene)?;
    strike.check("the strike")?;
    let model = physics::mjcf(&scene, &properties, strike, &physics::Options::default())?;
    files::write_whole(&path, model.text.as_bytes())?;
    Ok(Exported { file: output.clone(), notes: model.notes })
}
