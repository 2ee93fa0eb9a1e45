//! The start of an H.264 slice header (ITU-T H.264, 7.3.3).

use super::bitstream::{Bits, unescaped};
use crate::capture::source::error::SourceError;
use rusty_h264_decoder::{Pps, Sps};
use std::collections::BTreeMap;

/// The standard's limit on the entries of a reference picture list (7.4.3).
const MAX_LIST: u32 = 32;
/// No slice header is longer up to the fields that are read here (bytes).
const HEADER_BYTES: usize = 64;

/// The fields of a slice header that the decoder checks.
pub(super) struct SliceHeader {
    pub(super) first_block: u32,
    pub(super) kind: SliceKind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum SliceKind {
    Predicted,
    Bipredicted,
    Intra,
}

/// The parameter sets that slice headers refer to, by their ids.
#[derive(Default)]
pub(super) struct ParameterSets {
    pub(super) sequences: BTreeMap<u32, Sps>,
    pub(super) pictures: BTreeMap<u32, Pps>,
}

impl ParameterSets {
    /// Reads the header of the slice in a NAL unit.
    ///
    /// # Errors
    /// Coding tools that the built-in decoder would decode wrongly, a damaged header, missing parameter sets.
    pub(super) fn slice_header(&self, unit: &[u8]) -> Result<SliceHeader, SourceError> {
        // Type and parameter sets
        let body = unescaped(&unit[1..], HEADER_BYTES);
        let mut bits = Bits { bytes: &body, at: 0 };
        let first_block = bits.golomb()?;
        let kind = match bits.golomb()? % 5 {
            0 => SliceKind::Predicted,
            1 => SliceKind::Bipredicted,
            2 => SliceKind::Intra,
            _ => return Err(SourceError::convertible("H.264 with switching slices (SP, SI)")),
        };
        let missing = || SourceError::damaged("a picture before its parameters");
        let pps = self.pictures.get(&bits.golomb()?).ok_or_else(missing)?;
        let sps = self.sequences.get(&pps.seq_parameter_set_id).ok_or_else(missing)?;
        // Frame number, picture order count
        bits.skip(sps.log2_max_frame_num)?;
        if !sps.frame_mbs_only && bits.bit()? {
            return Err(SourceError::convertible("interlaced H.264"));
        }
        if unit[0] & 0x1f == 5 {
            bits.golomb()?;
        }
        match sps.pic_order_cnt_type {
            0 => {
                bits.skip(sps.log2_max_pic_order_cnt_lsb)?;
                if pps.bottom_field_pic_order_present {
                    bits.golomb()?;
                }
            }
            1 if kind == SliceKind::Bipredicted => {
                return Err(SourceError::convertible("H.264 with B pictures ordered by type 1"));
            }
            1 if !sps.delta_pic_order_always_zero => {
                bits.golomb()?;
                if pps.bottom_field_pic_order_present {
                    bits.golomb()?;
                }
            }
            _ => {}
        }
        if pps.redundant_pic_cnt_present_flag {
            bits.golomb()?;
        }
        // Lengths of the reference lists
        let mut lists = [pps.num_ref_idx_l0_default, pps.num_ref_idx_l1_default];
        if kind == SliceKind::Bipredicted {
            bits.skip(1)?;
        }
        if kind != SliceKind::Intra && bits.bit()? {
            lists[0] = bits.golomb()?.saturating_add(1);
            if kind == SliceKind::Bipredicted {
                lists[1] = bits.golomb()?.saturating_add(1);
            }
        }
        if lists.iter().any(|&length| length == 0 || length > MAX_LIST) {
            return Err(SourceError::damaged("a damaged slice header"));
        }
        Ok(SliceHeader { first_block, kind })
    }
}
