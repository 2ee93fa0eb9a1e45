//! What does a strike do to this pile, where may an object be put, and which strike is planned?

pub(crate) mod forecast;
pub(crate) mod planning;
pub(crate) mod request;
pub(crate) mod save;
pub(crate) mod settle;
