//! The demo's pile, and the properties of its objects estimated from its films.

use breakshot::capture::Decoder;
use breakshot::properties::Properties;
use breakshot::scene::Scene;
use breakshot::{clip_tracks, estimate, files};
use std::path::{Path, PathBuf};

/// The folder of its files.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/demo")
}

/// A pile, and the properties of its objects.
pub(crate) struct Demo {
    pub scene: Scene,
    pub properties: Properties,
}

impl Demo {
    /// Reads the scene and measures the films, which takes some seconds.
    pub(crate) fn load() -> Self {
        let folder = folder();
        let campaign = files::load_campaign(folder.join("campaign.toml")).expect("the campaign").value;
        let tracks = campaign.clips.iter().map(|clip| clip_tracks(&campaign, clip, Decoder::Builtin));
        let clips = tracks.collect::<Result<Vec<_>, _>>().expect("tracks");
        let options = estimate::Options::default();
        let estimation = estimate::estimation(&clips, &campaign.cell, &campaign.objects, &options);
        Self {
            scene: files::load_scene(folder.join("pile.scene.toml")).expect("the scene").value,
            properties: estimation.expect("properties").properties,
        }
    }
}
