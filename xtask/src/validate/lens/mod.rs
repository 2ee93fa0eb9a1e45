//! Lenses beside OpenCV: `cargo xtask validate lenses`, and calibration from films of boards: `validate boards`.

mod boards;
mod models;

pub(crate) use boards::validate as boards;
pub(crate) use models::validate as models;

/// What the peers import.
const PACKAGES: [&str; 2] = ["numpy", "opencv-python-headless==5.0.0.93"];
