//! One file for each command, in folders by the steps of the work.

pub(crate) mod capture;
pub(crate) mod detection;
pub(crate) mod estimation;
#[cfg(feature = "manual")]
pub(crate) mod manual;
pub(crate) mod planning;
pub(crate) mod report;
pub(crate) mod robot;
