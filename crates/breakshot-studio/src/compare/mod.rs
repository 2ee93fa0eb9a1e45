//! How does a filmed strike compare with its simulation?

pub(crate) mod comparing;
pub(crate) mod shown;
