//! What does an impact do to the bodies that take part in it?

pub(crate) mod compliant;
pub(crate) mod island;
pub(crate) mod moreau;
pub(crate) mod pair_impact;
pub(crate) mod routh;
