//! Generators of drawn truth, against which tests and tutorials measure.

pub mod campaign;
pub mod film;
