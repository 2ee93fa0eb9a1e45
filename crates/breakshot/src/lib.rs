//! *Breakshot* learns how objects slide and bounce from video, and plans the one strike that singulates a pile.
//!
//! The data flow is the folder tree; every folder is a stage with one public function:
//!
//! | stage | question | answer |
//! |---|---|---|
//! | [`capture`] | what did the camera see, and from where? | [`Footage`](capture::Footage), [`Camera`](capture::Camera) |
//! | [`detect`] | where was each object at each instant? | [`Tracks`](detect::Tracks) |
//! | [`estimate`] | how do the objects slide and bounce? | [`Properties`](properties::Properties) |
//! | [`physics`] | what does this strike do to this pile? | [`Trajectory`](physics::Trajectory) |
//! | [`plan`] | which strike singulates it? | [`Plan`](plan::Plan) |
//! | [`robot`] | how does the arm carry it out? | `Command` |
//! | [`verify`] | did it happen as predicted? | [`Report`](verify::Report) |
//!
//! The files beside the folders are the vocabulary all stages share.  Everything is SI and radians; the table frame
//! is the default.

pub mod campaign;
pub mod capture;
pub mod cell;
pub mod detect;
pub mod error;
pub mod estimate;
pub mod files;
pub mod geometry;
pub mod object;
pub mod outline;
pub mod physics;
pub mod plan;
pub mod properties;
pub mod robot;
pub mod scene;
pub mod singulation;
pub mod uncertain;
pub mod verify;

pub use error::{Error, Result};
