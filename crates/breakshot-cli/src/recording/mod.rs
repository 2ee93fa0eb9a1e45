//! Films from live cameras, through the program `ffmpeg`: which source, what it delivers, and what is missing in the recording.

mod args;
mod ffmpeg;
mod interrupt;
mod source;

pub(crate) use args::RecordArgs;
pub(crate) use ffmpeg::{Recording, record};
pub(crate) use source::Source;
