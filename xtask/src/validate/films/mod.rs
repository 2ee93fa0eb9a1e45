//! Films of other cameras, in other codings and containers.

mod bags;
mod cameras;

pub(crate) use bags::bags;
pub(crate) use cameras::cameras;
