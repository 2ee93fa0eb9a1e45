//! What would the arm of a cell do for a strike? The joint path is computed and shown; nothing here can reach an arm.

pub(crate) mod command;
