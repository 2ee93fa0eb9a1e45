//! Estimates against the truth: of the lab's films, of the same films thinned and spoilt, of the
//! motions of drawn cells, and of synthetic campaigns.

pub(crate) mod advise;
pub(crate) mod advised_films;
pub(crate) mod altered;
pub(crate) mod bound;
pub(crate) mod campaigns;
pub(crate) mod contact;
pub(crate) mod mistakes;
pub(crate) mod properties;
pub(crate) mod saved;
pub(crate) mod subsets;
