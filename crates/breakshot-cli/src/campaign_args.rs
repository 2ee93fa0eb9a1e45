//! The flags of `breakshot campaign`.

use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct CampaignArgs {
    /// The folder of the films and tracks; films in its folders count too.
    #[arg(value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// The cell file; `cell.toml` beside the output or in DIR if not given.
    #[arg(long, value_name = "FILE")]
    pub(crate) cell: Option<PathBuf>,
    /// The objects file, whose names are looked for in the names of the films; `objects.toml` beside the output or in DIR if
    /// not given.
    #[arg(long, value_name = "FILE")]
    pub(crate) objects: Option<PathBuf>,
    /// The output file (campaign, TOML); it must not exist yet.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
}
