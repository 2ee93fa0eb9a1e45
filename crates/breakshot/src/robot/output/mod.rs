//! A command in the formats of other programs: ROS 2, URScript and MCAP, and the figures of the impulse geometry.

mod foxglove;
pub(crate) mod impulse_figure;
pub(crate) mod impulse_map;
mod mcap;
pub(crate) mod recording;
pub(crate) mod ros;
mod urscript;
