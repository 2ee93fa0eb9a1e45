//! What a container tells about an H.264 track.

/// The decoder's configuration (`avcC`).
#[derive(Debug, Default)]
pub(crate) struct Coding {
    /// How many bytes the length before each NAL unit takes.
    pub length_bytes: usize,
    /// Sequence and picture parameter sets.
    pub parameter_sets: Vec<Vec<u8>>,
}
