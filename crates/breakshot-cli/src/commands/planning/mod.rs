//! The commands that simulate and plan strikes on a pile.

pub(crate) mod export;
pub(crate) mod plan;
pub(crate) mod run;
pub(crate) mod simulate;
