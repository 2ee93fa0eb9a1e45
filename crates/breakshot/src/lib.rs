//! *Breakshot* learns how objects slide and bounce from video, and plans the one strike that singulates a pile.
//!
//! The data flow is the folder tree; every folder is a stage with one public function:
//!
//! | stage | question | answer |
//! |---|---|---|
//! | [`capture`] | what did the camera see, and from where? | [`Footage`], [`Camera`](capture::Camera) |
//! | [`detect`] | where was each object at each instant? | [`Tracks`](detect::Tracks) |
//! | [`estimate`] | how do the objects slide and bounce? | [`Properties`] |
//! | [`physics`] | what does this strike do to this pile? | [`Trajectory`] |
//! | [`plan`] | which strike singulates it? | [`Plan`] |
//! | [`robot`] | how does the arm carry it out? | [`Command`](robot::Command) |
//! | [`verify`] | did it happen as predicted? | [`Report`](verify::Report) |
//! | [`report`] | how are the results shown to a person? | a page, figures, drawn frames |
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
pub mod physics;
pub mod plan;
pub mod properties;
pub mod report;
pub mod robot;
pub mod scene;
mod statistics;
#[cfg(any(test, feature = "synthetic"))]
pub mod synthetic;
pub mod uncertain;
pub mod verify;

pub use error::{Error, Result};

use campaign::{Campaign, Clip};
use capture::{Capture, Decoder, Footage};
use estimate::ClipTracks;
use physics::Trajectory;
use plan::Plan;
use properties::Properties;
use scene::Scene;

/// The whole data flow: from the clips of a campaign to the strike for a pile, and what it does.
///
/// No strike, no trajectory: then nothing could be reached.
///
/// # Errors
/// The error of the first stage that fails.
pub fn run(campaign: &Campaign, scene: &Scene) -> Result<(Properties, Plan, Option<Trajectory>)> {
    let clips = campaign
        .clips
        .iter()
        .map(|clip| clip_tracks(campaign, clip, Decoder::Auto))
        .collect::<Result<Vec<_>>>()?;
    let estimation =
        estimate::estimation(&clips, &campaign.cell, &campaign.objects, &estimate::Options::default())?;
    let properties = estimation.properties;
    let plan = plan::plan(scene, &properties, &plan::Options::default())?;
    let simulate = |strike| physics::trajectory(scene, &properties, strike, &physics::Options::default());
    let trajectory = plan.strike.as_ref().map(simulate).transpose()?;
    Ok((properties, plan, trajectory))
}

/// The tracks of one clip: its film is opened, its camera found, its objects told apart and followed.
///
/// # Errors
/// See [`capture::capture`] and [`detect::tracks`].
pub fn clip_tracks(campaign: &Campaign, clip: &Clip, decoder: Decoder) -> Result<ClipTracks> {
    let layout = match &clip.placed {
        Some(placed) => detect::Layout::Placed(placed.clone()),
        None => detect::Layout::AlongStrike {
            heading_rad: clip.strike.heading_rad,
            start_m: Some(clip.strike.start_m),
        },
    };
    let film = Capture::of(Footage::open_with(&clip.video, decoder)?, &campaign.cell)?;
    let options = detect::Options::default();
    let tracks = detect::tracks(film, &campaign.objects, &clip.objects, &layout, &options)?;
    Ok(ClipTracks {
        name: clip.name(),
        objects: clip.objects.clone(),
        strike: Some(clip.strike.clone()),
        tracks,
    })
}
