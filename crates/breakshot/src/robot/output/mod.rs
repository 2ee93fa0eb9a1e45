//! A command in the words of other programs: ROS 2, URScript, MCAP, and pictures.

mod foxglove;
pub(crate) mod impulse_figure;
mod mcap;
pub(crate) mod recording;
pub(crate) mod ros;
mod urscript;
