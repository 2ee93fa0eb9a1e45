//! One file for each command, and what several commands have in common.

pub(crate) mod calibrate;
pub(crate) mod campaign;
pub(crate) mod check;
pub(crate) mod command;
pub(crate) mod demo;
pub(crate) mod detect;
mod detect_campaign;
mod encoder;
pub(crate) mod estimate;
pub(crate) mod export;
pub(crate) mod film;
pub(crate) mod film_report;
mod film_report_args;
mod frames;
pub(crate) mod init;
pub(crate) mod lens;
pub(crate) mod look;
#[cfg(feature = "manual")]
pub(crate) mod manual;
pub(crate) mod objects;
mod overlay_film;
pub(crate) mod plan;
pub(crate) mod run;
pub(crate) mod simulate;
pub(crate) mod strike;
pub(crate) mod studio;
pub(crate) mod tags;
mod touch;
mod track_folder;
pub(crate) mod verify;

pub(crate) use film_report_args::FilmReportArgs;
