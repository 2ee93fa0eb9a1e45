//! The frames of an MP4, a MOV or a fragmented MP4 film: index, time stamps, orientation.

mod boxes;
mod orientation;
pub(super) mod reader;
mod samples;
mod timeline;
pub(super) mod track;
