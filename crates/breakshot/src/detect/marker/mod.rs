//! What must an object's marker look like in the image, and where exactly is it?

pub(super) mod blob;
pub(super) mod blurred_pair;
pub(super) mod dot;
pub(super) mod outline;
mod patch;
pub(super) mod target;
