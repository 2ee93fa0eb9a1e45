//! `breakshot export`: the model of a scene and a strike for another simulator.

use super::simulate::{self, SimulationInputs};
use crate::args::{ExportArgs, ModelName};
use crate::{Outcome, console};
use breakshot::{Result, files, physics};

/// Writes the model and prints its approximations.
pub(crate) fn run(args: &ExportArgs) -> Result<Outcome> {
    let SimulationInputs { scene, properties, outcome, .. } =
        simulate::inputs(&args.scene, &args.properties, &args.assumptions)?;
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
