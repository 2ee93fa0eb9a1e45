//! The robots that a command can be sent to: an Indy 7, any arm behind a rosbridge, and a simulation.

pub(crate) mod arm;
pub(crate) mod driver;
#[cfg(feature = "network")]
pub mod indy;
#[cfg(feature = "network")]
pub mod rosbridge;
pub(crate) mod sim;
