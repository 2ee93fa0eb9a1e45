//! A folder with the tracks of a campaign, which several programs may fill.

use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::Decoder;
use breakshot::detect::Tracks;
use breakshot::estimate::ClipTracks;
use breakshot::{Error, Result, files};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One file of tracks for each clip.
pub(crate) struct TrackFolder<'a> {
    campaign: &'a Campaign,
    decoder: Decoder,
    /// The file of each clip, by its name.
    files: BTreeMap<&'a str, PathBuf>,
}

/// The tracks of a clip in the folder.
pub(crate) struct FolderTracks {
    pub(crate) clip: ClipTracks,
    /// They were there before.
    pub(crate) were_finished: bool,
}

impl<'a> TrackFolder<'a> {
    /// The folder, created if it does not exist.
    pub(crate) fn new(folder: &Path, campaign: &'a Campaign, decoder: Decoder) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
        let names: Vec<&str> = campaign.clips.iter().map(|clip| clip.name.as_str()).collect();
        let files = files::track_file_names(&names).into_iter().map(|name| folder.join(name));
        Ok(Self { campaign, decoder, files: names.iter().copied().zip(files).collect() })
    }

    /// The tracks of a clip of the campaign: those in its file, if they were made of the same content by the same version; otherwise
    /// new ones, which are written.
    ///
    /// # Errors
    /// See [`breakshot::clip_tracks`] and [`files::write_whole`].
    pub(crate) fn tracks(&self, clip: &Clip) -> Result<FolderTracks> {
        let file = &self.files[clip.name.as_str()];
        let input = files::clip_input(self.campaign, clip)?;
        // A file that is something else is replaced.
        if let Some(tracks) = files::read_finished::<Tracks>(file, &input) {
            return Ok(FolderTracks { clip: of_clip(clip, tracks), were_finished: true });
        }
        let clip = breakshot::clip_tracks(self.campaign, clip, self.decoder)?;
        files::write_finished(file, &clip.tracks, &input)?;
        Ok(FolderTracks { clip, were_finished: false })
    }
}

fn of_clip(clip: &Clip, tracks: Tracks) -> ClipTracks {
    let (objects, strike) = (clip.objects.clone(), clip.strike.clone());
    ClipTracks { name: clip.name.clone(), objects, strike, tracks }
}
