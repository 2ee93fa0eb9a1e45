//! The flags of `breakshot studio`.

use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(crate) struct StudioArgs {
    /// The folder of the project: scenes, properties, plans. The page reads and writes nothing outside of it.
    #[arg(default_value = ".", value_name = "DIR")]
    pub(crate) folder: PathBuf,
    /// The port of 127.0.0.1; a free one if not given.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) port: u16,
    /// Only prints the link.
    #[arg(long)]
    pub(crate) no_open: bool,
}
