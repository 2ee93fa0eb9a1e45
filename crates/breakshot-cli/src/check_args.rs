//! The flags of `breakshot check`.

use crate::decoder_args::DecoderArgs;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    /// The campaign file.
    #[arg(value_name = "CAMPAIGN")]
    pub(crate) campaign: PathBuf,
    #[command(flatten)]
    pub(crate) decoder: DecoderArgs,
    /// The output file (HTML).
    #[arg(short, long, value_name = "FILE", default_value = "check.html")]
    pub(crate) output: PathBuf,
    /// Prints everything that does not fit as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}
