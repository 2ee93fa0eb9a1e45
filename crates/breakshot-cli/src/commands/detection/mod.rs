//! The commands that find objects in pictures and films, and what others need of their frames and tracks.

pub(crate) mod detect;
mod detect_campaign;
pub(super) mod frames;
pub(crate) mod look;
pub(crate) mod objects;
pub(super) mod track_folder;
