//! A command in the formats of other programs: ROS 2, URScript and MCAP, and the figure of the impulse geometry.

mod foxglove;
pub(crate) mod impulse_figure;
mod mcap;
pub(crate) mod recording;
pub(crate) mod ros;
mod urscript;
