//! The tracks of the lab's films, saved once, and what can be made of them without the films.

use breakshot::campaign::Campaign;
use breakshot::estimate::ClipTracks;
use breakshot::files;
use std::path::Path;

/// The campaign of the films, and the tracks of its clips.
pub(crate) struct Saved {
    pub(crate) campaign: Campaign,
    pub(crate) clips: Vec<ClipTracks>,
}

impl Saved {
    /// Reads what `breakshot estimate --tracks` wrote for the films in `folder`.
    pub(crate) fn read(folder: &Path, tracks: &Path) -> Result<Self, String> {
        let campaign = files::load_campaign(folder.join("campaign.toml")).map_err(|e| e.to_string())?.value;
        let clips = campaign.clips.iter().map(|clip| {
            let path = tracks.join(&clip.name).with_extension("json");
            Ok(ClipTracks {
                name: clip.name.clone(),
                objects: clip.objects.clone(),
                strike: clip.strike.clone(),
                tracks: files::read_json(&path).map_err(|e| e.to_string())?,
            })
        });
        let clips = clips.collect::<Result<_, String>>()?;
        Ok(Self { campaign, clips })
    }
}
