//! The commands before the first strike is tracked: templates, tags, lens, pose of the camera, films.

pub(crate) mod calibrate;
pub(crate) mod film;
pub(crate) mod init;
pub(crate) mod lens;
pub(crate) mod tags;
