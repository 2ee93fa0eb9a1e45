//! Where does the camera of a cell see the tags, and where does the cell give them?

pub(crate) mod editing;
pub(crate) mod first_frames;
pub(crate) mod fit;
