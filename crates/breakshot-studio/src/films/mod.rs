//! What do the films of a campaign show, and what was found in them?

pub(crate) mod advice;
pub(crate) mod clips;
pub(crate) mod edit;
pub(crate) mod frames;
pub(crate) mod learning;
pub(crate) mod motion;
pub(crate) mod starts;
pub(crate) mod upload;
