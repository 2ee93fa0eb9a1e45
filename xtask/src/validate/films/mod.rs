//! Films of other cameras, in other codings and containers.

mod bags;
mod cameras;

pub(crate) use bags::bags;
pub(crate) use cameras::cameras;

use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::Decoder;
use breakshot::detect::Tracks;

/// The tracks of a clip, decoded without other programs.
pub(crate) fn tracks(campaign: &Campaign, clip: &Clip) -> Result<Tracks, String> {
    breakshot::clip_tracks(campaign, clip, Decoder::Builtin)
        .map(|clip| clip.tracks)
        .map_err(|e| e.to_string())
}

/// Distances between samples of the same frames.
#[derive(Default)]
pub(crate) struct Differences {
    /// Infinite if tracks or samples differ in number.
    pub(crate) largest_mm: f64,
    squares_mm2: f64,
    count: usize,
}

impl Differences {
    pub(crate) fn add(&mut self, found: &Tracks, wanted: &Tracks) {
        let is_same_count = found.tracks.len() == wanted.tracks.len();
        self.largest_mm = if is_same_count { self.largest_mm } else { f64::INFINITY };
        for (found, wanted) in found.tracks.iter().zip(&wanted.tracks) {
            if found.object != wanted.object || found.samples.len() != wanted.samples.len() {
                self.largest_mm = f64::INFINITY;
            }
            for (a, b) in found.samples.iter().zip(&wanted.samples) {
                let distance_mm = 1e3 * (a.x_m - b.x_m).hypot(a.y_m - b.y_m);
                self.largest_mm = self.largest_mm.max(distance_mm);
                self.squares_mm2 += distance_mm.powi(2);
                self.count += 1;
            }
        }
    }

    pub(crate) fn rms_mm(&self) -> f64 {
        (self.squares_mm2 / self.count as f64).sqrt()
    }
}
