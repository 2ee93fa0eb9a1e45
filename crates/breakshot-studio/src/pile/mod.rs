//! What does a strike do to this pile, where may an object be put, which strike is planned, and what does a picture show?

pub(crate) mod export;
pub(crate) mod forecast;
pub(crate) mod picture;
pub(crate) mod planning;
pub(crate) mod request;
pub(crate) mod save;
pub(crate) mod settle;
