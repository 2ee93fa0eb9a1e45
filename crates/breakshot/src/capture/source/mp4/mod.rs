//! MP4, MOV and fragmented MP4.

mod boxes;
mod orientation;
pub(super) mod reader;
mod samples;
mod timeline;
pub(super) mod track;
