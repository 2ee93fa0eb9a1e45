//! The commands from a folder of films to the properties of the objects.

pub(crate) mod campaign;
pub(crate) mod check;
pub(crate) mod estimate;
