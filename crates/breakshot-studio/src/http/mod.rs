//! A small HTTP/1.1 server for one person on one machine.
//!
//! It speaks the part of the protocol that the page needs, and refuses the rest: `GET` and `POST`, bodies with a length, one request
//! after the other on a connection. Every size, time and number is bounded, and every connection has a thread of its own.

pub(crate) mod gate;
pub(crate) mod limits;
pub(crate) mod request;
pub(crate) mod response;
pub(crate) mod server;
