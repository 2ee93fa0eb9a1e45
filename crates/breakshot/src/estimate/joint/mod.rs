//! Which properties explain the measurements of all clips, and how uncertain are they?
//!
//! Repeated measurements of one quantity are averaged with a random-effects model (`random_effects`) after clips that
//! contradict the majority have been left out (`outliers`), and what all clips say about the frictions and strikes of one has been
//! used for its other values (`conditioning`).  The mass ratios of all pairs are adjusted so that they agree
//! around every loop (`mass_network`).  `sliding` holds what the table does to all of them.  `means` carries the covariance of the clips' noise through to that of the result,
//! `refusal` removes what is impossible or too uncertain, `frame_rate` examines the rate of the films, `properties` assembles the
//! result with its warnings, and `record` stores the measurements for later updates.

pub(crate) mod clip_values;
pub(crate) mod conditioning;
pub(crate) mod contact_friction;
pub(crate) mod frame_rate;
pub(crate) mod mass_network;
pub(crate) mod means;
pub(crate) mod outliers;
pub(crate) mod properties;
pub(crate) mod random_effects;
pub(crate) mod record;
pub(crate) mod refusal;
pub(crate) mod sliding;
#[cfg(test)]
pub(crate) mod update_tests;
