//! Lenses beside OpenCV: `cargo xtask validate lenses`, calibration from films of boards: `validate boards`, and what it costs on
//! the table: `validate corners`.

mod boards;
mod corners;
mod models;

pub(crate) use boards::validate as boards;
pub(crate) use corners::validate as corners;
pub(crate) use models::validate as models;

/// What the peers import.
const PACKAGES: [&str; 2] = ["numpy", "opencv-python-headless==5.0.0.93"];
