//! The H.264 configuration that a container holds beside the coded pictures (`avcC`, ISO/IEC 14496-15).

/// The decoder's configuration.
#[derive(Debug, Default)]
pub(crate) struct H264Config {
    /// Number of bytes of the length before each NAL unit.
    pub length_bytes: usize,
    /// Sequence and picture parameter sets.
    pub parameter_sets: Vec<Vec<u8>>,
}
