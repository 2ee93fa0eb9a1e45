//! What does an impact do to the bodies that take part in it?
//!
//! Two bodies alone: Routh's method (`routh`).  Several contacts that close at the same time form an island (`island`): fast
//! ones are springs (`compliant`), slow ones follow Moreau's law (`moreau`).

pub(crate) mod compliant;
pub(crate) mod island;
pub(crate) mod moreau;
pub(crate) mod pair_impact;
pub(crate) mod routh;
