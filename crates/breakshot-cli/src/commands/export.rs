//! `breakshot export`: the same scene and strike for another simulator.

use super::simulate;
use crate::args::{ExportArgs, ModelName};
use crate::{Outcome, console};
use breakshot::{Result, files, physics};

/// Writes the model and says what it approximates.
pub(crate) fn run(args: &ExportArgs) -> Result<Outcome> {
    let (scene, properties, outcome) = simulate::world(&args.scene, &args.properties, &args.assumptions)?;
    let strike = files::load_strike(&args.strike)?;
    let options = physics::Options::default();
    let model = match args.to {
        ModelName::Mjcf => physics::mjcf(&scene, &properties, &strike, &options)?,
    };
    console::note(&model.notes);
    files::write_whole(&args.output, model.text.as_bytes())?;
    println!("Wrote {}", args.output.display());
    Ok(outcome)
}
