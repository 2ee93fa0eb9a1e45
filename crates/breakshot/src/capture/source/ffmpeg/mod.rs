//! Films that the program `ffmpeg` decodes.

pub(super) mod h264;
pub(super) mod process;
mod showinfo;
mod watched;
