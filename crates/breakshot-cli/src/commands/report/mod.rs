//! The commands that show what came of it: a filmed strike beside its simulation, reports, films, the page of the studio.

pub(crate) mod demo;
mod encoder;
pub(crate) mod film_report;
mod film_report_args;
pub(super) mod overlay_film;
pub(crate) mod studio;
pub(crate) mod verify;

pub(crate) use film_report_args::FilmReportArgs;
