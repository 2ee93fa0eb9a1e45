//! From coded pictures to their luma (ITU-T H.264), one picture at a time.
//!
//! The decoder behind it is exact for progressive 8-bit 4:2:0.  What it could mistake, or what could make it ask for
//! memory without limit, is read from the headers first and refused by name.

use super::bitstream::{Bits, unescaped, units};
use super::catch_panic::without_panic;
use super::parameters::Coding;
use crate::capture::image::GreyImage;
use crate::capture::source::error::Refusal;
use crate::capture::source::limits::check_size;
use rusty_h264_decoder::{DecodeError, Decoder, Pps, Sps};
use std::collections::BTreeMap;

type Result<T> = std::result::Result<T, Refusal>;

/// The standard's limit on reference pictures (A.3.1), and on entries of a reference list (7.4.3).
const MAX_REFERENCES: u32 = 16;
const MAX_LIST: u32 = 32;
/// No slice header is longer up to the fields that are read here (bytes).
const HEADER_BYTES: usize = 64;
/// A coded picture is never much larger than the picture itself: factor and bytes for what else it carries.
const MAX_CODED: (usize, usize) = (4, 1 << 20);

/// One decoded picture and its place in the stream's own order.
pub(crate) struct Picture {
    pub image: GreyImage,
    pub order: Order,
}

/// The stream's own order of showing: pictures up to an instant refresh (IDR) come before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Order {
    period: u32,
    count: i32,
}

/// A film's decoder.
pub(crate) struct Stream {
    decoder: Decoder,
    length_bytes: usize,
    sequences: BTreeMap<u32, Sps>,
    pictures: BTreeMap<u32, Pps>,
    coded: Vec<u8>,
    period: u32,
    /// Whether the first picture is an instant refresh: nothing in the film refers to what was before it.
    pub(crate) begins_anew: bool,
}

impl Stream {
    /// A decoder with the film's parameter sets, which its first picture may add to.
    pub(crate) fn new(coding: &Coding, first_sample: &[u8]) -> Result<Self> {
        let mut stream = Self {
            decoder: Decoder::new(),
            length_bytes: coding.length_bytes,
            sequences: BTreeMap::new(),
            pictures: BTreeMap::new(),
            coded: Vec::new(),
            period: 0,
            begins_anew: true,
        };
        for unit in &coding.parameter_sets {
            stream.read_parameters(unit)?;
        }
        stream.decode(&coding.parameter_sets.iter().map(Vec::as_slice).collect::<Vec<_>>())?;
        stream.check_first(first_sample)?;
        Ok(stream)
    }

    /// The pictures' size (px).
    pub(crate) fn size_px(&self) -> Result<[usize; 2]> {
        let sps = self.sequences.values().next();
        let sps = sps.ok_or_else(|| Refusal::damaged("H.264 without its parameters (SPS)"))?;
        Ok([sps.display_width(), sps.display_height()])
    }

    /// Refuses a film that does not begin with a whole, progressive picture of its own.
    fn check_first(&mut self, sample: &[u8]) -> Result<()> {
        let units = units(sample, self.length_bytes)?;
        for unit in units.iter().filter(|unit| matches!(unit[0] & 0x1f, 7 | 8)) {
            self.read_parameters(unit)?;
        }
        let [width, height] = self.size_px()?;
        check_size(width as u64, height as u64)?;
        let slice = units.iter().find(|unit| matches!(unit[0] & 0x1f, 1 | 5));
        let slice = slice.ok_or_else(|| Refusal::damaged("a first frame without a picture"))?;
        if self.slice(slice)?.kind != SliceKind::Intra {
            return Err(Refusal::damaged("a film that does not begin with a key frame"));
        }
        self.begins_anew = slice[0] & 0x1f == 5;
        Ok(())
    }

    /// The next picture, in decoding order.
    pub(crate) fn picture(&mut self, sample: &[u8]) -> Result<Picture> {
        let [width, height] = self.size_px()?;
        if sample.len() > MAX_CODED.0 * width * height + MAX_CODED.1 {
            return Err(Refusal::damaged(format!("{} bytes for {width} x {height} px", sample.len())));
        }
        let units = units(sample, self.length_bytes)?;
        let mut begun = 0;
        for unit in &units {
            match unit[0] & 0x1f {
                1 | 5 => begun += usize::from(self.slice(unit)?.first_block == 0),
                2..=4 => return Err(Refusal::convertible("H.264 with data partitions")),
                7 | 8 => self.read_parameters(unit)?,
                _ => {}
            }
        }
        if begun > 1 {
            return Err(Refusal::convertible("H.264 with two pictures in one frame"));
        }
        self.period += u32::from(units.iter().any(|unit| unit[0] & 0x1f == 5));
        let y = self.decode(&units)?.ok_or_else(|| Refusal::damaged("an incomplete picture"))?;
        let image = self.cropped(y)?;
        Ok(Picture { image, order: Order { period: self.period, count: self.decoder.last_poc() } })
    }

    /// Hands NAL units to the decoder.
    fn decode(&mut self, units: &[&[u8]]) -> Result<Option<GreyImage>> {
        self.coded.clear();
        for unit in units.iter().filter(|unit| matches!(unit[0] & 0x1f, 1 | 5 | 7 | 8)) {
            self.coded.extend_from_slice(&[0, 0, 1]);
            self.coded.extend_from_slice(unit);
        }
        let (decoder, coded) = (&mut self.decoder, &self.coded);
        match without_panic(|| decoder.decode(coded)) {
            Some(Ok(frame)) => {
                Ok(frame.map(|frame| GreyImage { width: frame.width, height: frame.height, pixels: frame.y }))
            }
            Some(Err(e)) => Err(refusal(&e)),
            None => {
                self.decoder = Decoder::new();
                Err(Refusal::damaged("coded bytes that make no sense"))
            }
        }
    }

    /// Cuts what the sequence hides at the left and the top; the decoder cuts right and bottom.
    fn cropped(&self, image: GreyImage) -> Result<GreyImage> {
        let [width, height] = self.size_px()?;
        let (left, top) = match (image.width.checked_sub(width), image.height.checked_sub(height)) {
            (Some(0), Some(0)) if image.pixels.len() == width * height => return Ok(image),
            (Some(left), Some(top)) if image.pixels.len() == image.width * image.height => (left, top),
            _ => return Err(Refusal::damaged(format!("a picture of {} x {} px", image.width, image.height))),
        };
        let rows = image.pixels.chunks_exact(image.width).skip(top);
        let pixels = rows.flat_map(|row| &row[left..]).copied().collect();
        Ok(GreyImage { width, height, pixels })
    }

    /// Keeps a sequence or picture parameter set for reading slice headers; checks what the decoder does not.
    fn read_parameters(&mut self, unit: &[u8]) -> Result<()> {
        let Some((&head, body)) = unit.split_first() else {
            return Ok(());
        };
        let body = unescaped(body, usize::MAX);
        match head & 0x1f {
            7 => {
                let sps = without_panic(|| Sps::parse(&body));
                let sps = sps.ok_or_else(|| Refusal::damaged("damaged H.264 parameters (SPS)"))?;
                self.keep_sequence(sps.map_err(|e| refusal(&e))?)
            }
            8 => {
                let pps = without_panic(|| Pps::parse(&body));
                let pps = pps.ok_or_else(|| Refusal::damaged("damaged H.264 parameters (PPS)"))?;
                let pps = pps.map_err(|e| refusal(&e))?;
                self.pictures.insert(pps.pic_parameter_set_id, pps);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn keep_sequence(&mut self, sps: Sps) -> Result<()> {
        check_size(sps.display_width() as u64, sps.display_height() as u64)?;
        if sps.max_num_ref_frames > MAX_REFERENCES {
            return Err(Refusal::damaged(format!("{} reference pictures", sps.max_num_ref_frames)));
        }
        let size = |sps: &Sps| [sps.display_width(), sps.display_height()];
        if let Some(other) = self.sequences.values().find(|other| size(other) != size(&sps)) {
            let ([w, h], [new_w, new_h]) = (size(other), size(&sps));
            let found = format!("a film whose pictures change from {w} x {h} to {new_w} x {new_h} px");
            return Err(Refusal::convertible(found));
        }
        self.sequences.insert(sps.seq_parameter_set_id, sps);
        Ok(())
    }

    /// Reads the beginning of a slice header (7.3.3) and refuses what the decoder could mistake.
    fn slice(&self, unit: &[u8]) -> Result<Slice> {
        let body = unescaped(&unit[1..], HEADER_BYTES);
        let mut bits = Bits { bytes: &body, at: 0 };
        let first_block = bits.golomb()?;
        let kind = match bits.golomb()? % 5 {
            0 => SliceKind::Predicted,
            1 => SliceKind::Bipredicted,
            2 => SliceKind::Intra,
            _ => return Err(Refusal::convertible("H.264 with switching slices (SP, SI)")),
        };
        let missing = || Refusal::damaged("a picture before its parameters");
        let pps = self.pictures.get(&bits.golomb()?).ok_or_else(missing)?;
        let sps = self.sequences.get(&pps.seq_parameter_set_id).ok_or_else(missing)?;
        bits.skip(sps.log2_max_frame_num)?;
        if !sps.frame_mbs_only && bits.bit()? {
            return Err(Refusal::convertible("interlaced H.264"));
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
                return Err(Refusal::convertible("H.264 with B pictures ordered by type 1"));
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
            return Err(Refusal::damaged("a damaged slice header"));
        }
        Ok(Slice { first_block, kind })
    }
}

/// What is needed of a slice's header.
struct Slice {
    first_block: u32,
    kind: SliceKind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum SliceKind {
    Predicted,
    Bipredicted,
    Intra,
}

/// Coding tools that the decoder knows and does not have; any other complaint of its is about damaged bytes.
const FOREIGN_TOOLS: [&str; 7] = [
    "non-4:2:0 chroma",
    "bit depth > 8",
    "interlace",
    "slice groups",
    "SP/SI slices",
    "explicit B weighted prediction",
    "transform-bypass",
];

/// The decoder's own words, as a refusal.
fn refusal(error: &DecodeError) -> Refusal {
    match error {
        DecodeError::Unsupported(what) if FOREIGN_TOOLS.iter().any(|tool| what.starts_with(tool)) => {
            Refusal::convertible(format!("H.264 with {what}"))
        }
        DecodeError::Unsupported(what) => {
            Refusal::damaged(format!("a picture that cannot be decoded ({what})"))
        }
        other => Refusal::damaged(format!("a picture that cannot be decoded ({other})")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::bitstream::tests::Writer;
    use super::*;

    /// A baseline sequence of so many blocks and reference pictures.
    fn sequence(width_blocks: u32, height_blocks: u32, references: u32) -> Vec<u8> {
        let head = Writer::default().bits(0x67, 8).bits(66, 8).bits(0, 8).bits(30, 8);
        let counts = head.golomb(0).golomb(0).golomb(2).golomb(references).bits(0, 1);
        let size = counts.golomb(width_blocks - 1).golomb(height_blocks - 1).bits(1, 1);
        // Direct inference, no crop, no further parameters, the end.
        size.bits(0b1001, 4).bytes()
    }

    fn opened(parameters: Vec<u8>) -> Result<Stream> {
        Stream::new(&Coding { length_bytes: 4, parameter_sets: vec![parameters] }, &[])
    }

    #[test]
    fn a_header_that_asks_for_too_much_is_refused_before_memory_is() {
        let said = |parameters| opened(parameters).err().unwrap().found;
        // 1250 x 1250 blocks are 20,000 x 20,000 px; the second size is below the decoder's own limit.
        assert!(
            said(sequence(1250, 1250, 1)).contains("frame too large"),
            "said: {}",
            said(sequence(1250, 1250, 1))
        );
        assert!(said(sequence(1250, 3, 1)).contains("20000 x 48 px"), "said: {}", said(sequence(1250, 3, 1)));
        assert!(said(sequence(4, 3, 900)).contains("900 reference pictures"));
        // What is left to miss is the first picture.
        assert!(said(sequence(4, 3, 1)).contains("without a picture"), "said: {}", said(sequence(4, 3, 1)));
    }
}
