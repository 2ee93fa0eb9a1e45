//! How does a filmed strike compare with its simulation?

pub(crate) mod comparing;
pub(crate) mod shown;

/// The files that a comparison consists of, in the folder that `breakshot verify -o` names.
const REPORT: &str = "report.json";
const TRACKS: &str = "tracks.json";
const TRAJECTORY: &str = "trajectory.json";
const DISTANCES: &str = "distances.csv";
