//! Where is a sliding body between two impacts?
//!
//! Every slide has a closed form: a parabola in time without spin, a piece of a tabulated curve with spin on a round
//! support, a chain of short parabolas on any other support.

pub(crate) mod body;
pub(crate) mod limit_surface;
pub(crate) mod motion;
pub(crate) mod patch_friction;
#[cfg(test)]
mod piecewise_tests;
pub(crate) mod pressure;
pub(crate) mod slide_curve;
