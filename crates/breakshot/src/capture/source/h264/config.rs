//! The H.264 configuration that a container holds beside the coded pictures (`avcC`, ISO/IEC 14496-15).

/// How the NAL units of a sample are delimited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Framing {
    /// By a length of this many bytes before each of them (ISO/IEC 14496-15).
    Lengths(usize),
    /// By start codes (ITU-T H.264, annex B).
    StartCodes,
}

/// The decoder's configuration.
#[derive(Debug)]
pub(crate) struct H264Config {
    /// How the NAL units are delimited.
    pub framing: Framing,
    /// Sequence and picture parameter sets.
    pub parameter_sets: Vec<Vec<u8>>,
}
