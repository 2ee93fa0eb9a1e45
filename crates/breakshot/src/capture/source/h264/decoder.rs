//! Coded H.264 pictures to their luma (ITU-T H.264), one picture at a time.
//!
//! The decoder crate is exact for progressive 8-bit 4:2:0.  Whatever it could decode wrongly, and whatever could make it
//! allocate memory without limit, is found in the headers first and is an error that names it.

use super::bitstream::{unescaped, units};
use super::config::{Framing, H264Config};
use super::slice_header::{ParameterSets, SliceKind};
use crate::capture::image::GreyImage;
use crate::capture::source::catch_panic::catch_panic;
use crate::capture::source::error::SourceError;
use crate::capture::source::limits::check_size;
use rusty_h264_decoder::{DecodeError, Decoder, Pps, Sps};

type Result<T> = std::result::Result<T, SourceError>;

/// The standard's limit on reference pictures (A.3.1).
const MAX_REFERENCES: u32 = 16;
/// Largest coded picture: this factor times the picture's bytes, plus this many bytes for other data.
const MAX_CODED: (usize, usize) = (4, 1 << 20);

/// One decoded picture and its position in the stream's display order.
pub(crate) struct Picture {
    pub image: GreyImage,
    pub order: DisplayOrder,
}

/// The display order that the stream itself codes: all pictures before an instantaneous decoder refresh (IDR) are
/// displayed before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct DisplayOrder {
    /// Number of IDR pictures so far.
    idr_count: u32,
    /// The picture order count (8.2.1).
    order_count: i32,
}

/// The decoder of one film.
pub(crate) struct H264Decoder {
    decoder: Decoder,
    framing: Framing,
    parameters: ParameterSets,
    /// NAL units with start codes, as the decoder crate takes them.
    coded: Vec<u8>,
    idr_count: u32,
    /// Whether the first picture is an IDR: then no picture of the film refers to one before it.
    pub(crate) starts_with_idr: bool,
}

impl H264Decoder {
    /// A decoder with the film's parameter sets, to which the first sample may add.
    ///
    /// # Errors
    /// The film does not start with a complete, progressive key frame.
    pub(crate) fn new(config: &H264Config, first_sample: &[u8]) -> Result<Self> {
        let mut decoder = Self {
            decoder: Decoder::new(),
            framing: config.framing,
            parameters: ParameterSets::default(),
            coded: Vec::new(),
            idr_count: 0,
            starts_with_idr: true,
        };
        for unit in &config.parameter_sets {
            decoder.read_parameters(unit)?;
        }
        decoder.decode(&config.parameter_sets.iter().map(Vec::as_slice).collect::<Vec<_>>())?;
        decoder.check_first(first_sample)?;
        Ok(decoder)
    }

    /// Width and height of the pictures (px).
    pub(crate) fn size_px(&self) -> Result<[usize; 2]> {
        let sps = self.parameters.sequences.values().next();
        let sps = sps.ok_or_else(|| SourceError::damaged("H.264 without its parameters (SPS)"))?;
        Ok([sps.display_width(), sps.display_height()])
    }

    /// An error unless the first sample holds a complete, progressive key frame.
    fn check_first(&mut self, sample: &[u8]) -> Result<()> {
        let units = units(sample, self.framing)?;
        for unit in units.iter().filter(|unit| matches!(unit[0] & 0x1f, 7 | 8)) {
            self.read_parameters(unit)?;
        }
        let [width, height] = self.size_px()?;
        check_size(width as u64, height as u64)?;
        let slice = units.iter().find(|unit| matches!(unit[0] & 0x1f, 1 | 5));
        let slice = slice.ok_or_else(|| SourceError::damaged("a first frame without a picture"))?;
        if self.parameters.slice_header(slice)?.kind != SliceKind::Intra {
            return Err(SourceError::damaged("a film that does not begin with a key frame"));
        }
        self.starts_with_idr = slice[0] & 0x1f == 5;
        Ok(())
    }

    /// Whether a sample holds a picture that no other refers to (`nal_ref_idc` is 0, ITU-T H.264 7.4.1), and nothing else that later
    /// pictures need.
    pub(crate) fn is_unreferenced(&self, sample: &[u8]) -> bool {
        let is_needed = |unit: &&[u8]| match unit[0] & 0x1f {
            1 => unit[0] & 0x60 != 0,
            kind => kind < 6 || matches!(kind, 7 | 8),
        };
        units(sample, self.framing).is_ok_and(|units| !units.iter().any(is_needed))
    }

    /// The next picture, in decoding order.
    pub(crate) fn picture(&mut self, sample: &[u8]) -> Result<Picture> {
        let [width, height] = self.size_px()?;
        if sample.len() > MAX_CODED.0 * width * height + MAX_CODED.1 {
            return Err(SourceError::damaged(format!("{} bytes for {width} x {height} px", sample.len())));
        }
        let units = units(sample, self.framing)?;
        let mut picture_count = 0;
        for unit in &units {
            match unit[0] & 0x1f {
                1 | 5 => picture_count += usize::from(self.parameters.slice_header(unit)?.first_block == 0),
                2..=4 => return Err(SourceError::convertible("H.264 with data partitions")),
                7 | 8 => self.read_parameters(unit)?,
                _ => {}
            }
        }
        if picture_count > 1 {
            return Err(SourceError::convertible("H.264 with two pictures in one frame"));
        }
        self.idr_count += u32::from(units.iter().any(|unit| unit[0] & 0x1f == 5));
        let y = self.decode(&units)?.ok_or_else(|| SourceError::damaged("an incomplete picture"))?;
        let image = self.cropped(y)?;
        Ok(Picture {
            image,
            order: DisplayOrder { idr_count: self.idr_count, order_count: self.decoder.last_poc() },
        })
    }

    /// Decodes NAL units; `None` if they complete no picture.
    fn decode(&mut self, units: &[&[u8]]) -> Result<Option<GreyImage>> {
        self.coded.clear();
        for unit in units.iter().filter(|unit| matches!(unit[0] & 0x1f, 1 | 5 | 7 | 8)) {
            self.coded.extend_from_slice(&[0, 0, 1]);
            self.coded.extend_from_slice(unit);
        }
        let (decoder, coded) = (&mut self.decoder, &self.coded);
        match catch_panic(|| decoder.decode(coded)) {
            Some(Ok(frame)) => {
                Ok(frame.map(|frame| GreyImage { width: frame.width, height: frame.height, pixels: frame.y }))
            }
            Some(Err(e)) => Err(source_error(&e)),
            None => {
                self.decoder = Decoder::new();
                Err(SourceError::damaged("coded bytes that the decoder panics on"))
            }
        }
    }

    /// Crops the left and the top as the sequence demands; the decoder crate crops the right and the bottom.
    fn cropped(&self, image: GreyImage) -> Result<GreyImage> {
        let [width, height] = self.size_px()?;
        let (left, top) = match (image.width.checked_sub(width), image.height.checked_sub(height)) {
            (Some(0), Some(0)) if image.pixels.len() == width * height => return Ok(image),
            (Some(left), Some(top)) if image.pixels.len() == image.width * image.height => (left, top),
            _ => {
                return Err(SourceError::damaged(format!(
                    "a picture of {} x {} px",
                    image.width, image.height
                )));
            }
        };
        let rows = image.pixels.chunks_exact(image.width).skip(top);
        let pixels = rows.flat_map(|row| &row[left..]).copied().collect();
        Ok(GreyImage { width, height, pixels })
    }

    /// Stores a sequence or picture parameter set for slice headers and checks what the decoder crate does not check.
    fn read_parameters(&mut self, unit: &[u8]) -> Result<()> {
        let Some((&head, body)) = unit.split_first() else {
            return Ok(());
        };
        let body = unescaped(body, usize::MAX);
        match head & 0x1f {
            7 => {
                let sps = catch_panic(|| Sps::parse(&body));
                let sps = sps.ok_or_else(|| SourceError::damaged("damaged H.264 parameters (SPS)"))?;
                self.store_sequence(sps.map_err(|e| source_error(&e))?)
            }
            8 => {
                let pps = catch_panic(|| Pps::parse(&body));
                let pps = pps.ok_or_else(|| SourceError::damaged("damaged H.264 parameters (PPS)"))?;
                let pps = pps.map_err(|e| source_error(&e))?;
                self.parameters.pictures.insert(pps.pic_parameter_set_id, pps);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn store_sequence(&mut self, sps: Sps) -> Result<()> {
        check_size(sps.display_width() as u64, sps.display_height() as u64)?;
        if sps.max_num_ref_frames > MAX_REFERENCES {
            return Err(SourceError::damaged(format!("{} reference pictures", sps.max_num_ref_frames)));
        }
        let size = |sps: &Sps| [sps.display_width(), sps.display_height()];
        if let Some(other) = self.parameters.sequences.values().find(|other| size(other) != size(&sps)) {
            let ([w, h], [new_w, new_h]) = (size(other), size(&sps));
            let found = format!("a film whose pictures change from {w} x {h} to {new_w} x {new_h} px");
            return Err(SourceError::convertible(found));
        }
        self.parameters.sequences.insert(sps.seq_parameter_set_id, sps);
        Ok(())
    }
}

/// Coding tools that the decoder crate reports as unsupported; all its other errors mean damaged bytes.
const UNSUPPORTED_TOOLS: [&str; 7] = [
    "non-4:2:0 chroma",
    "bit depth > 8",
    "interlace",
    "slice groups",
    "SP/SI slices",
    "explicit B weighted prediction",
    "transform-bypass",
];

/// An error of the decoder crate as one of ours.
fn source_error(error: &DecodeError) -> SourceError {
    match error {
        DecodeError::Unsupported(what) if UNSUPPORTED_TOOLS.iter().any(|tool| what.starts_with(tool)) => {
            SourceError::convertible(format!("H.264 with {what}"))
        }
        DecodeError::Unsupported(what) => {
            SourceError::damaged(format!("a picture that cannot be decoded ({what})"))
        }
        other => SourceError::damaged(format!("a picture that cannot be decoded ({other})")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::bitstream::tests::Writer;
    use super::*;

    /// A baseline sequence parameter set with these numbers of macroblocks and reference pictures.
    fn sequence(width_blocks: u32, height_blocks: u32, references: u32) -> Vec<u8> {
        let head = Writer::default().bits(0x67, 8).bits(66, 8).bits(0, 8).bits(30, 8);
        let counts = head.golomb(0).golomb(0).golomb(2).golomb(references).bits(0, 1);
        let size = counts.golomb(width_blocks - 1).golomb(height_blocks - 1).bits(1, 1);
        // Direct inference, no crop, no further parameters, the end.
        size.bits(0b1001, 4).bytes()
    }

    fn opened(parameters: Vec<u8>) -> Result<H264Decoder> {
        H264Decoder::new(&H264Config { framing: Framing::Lengths(4), parameter_sets: vec![parameters] }, &[])
    }

    #[test]
    fn a_header_with_too_large_numbers_is_an_error_before_memory_is_allocated() {
        let error = |parameters| opened(parameters).err().unwrap().found;
        // 1250 x 1250 macroblocks are 20,000 x 20,000 px; the second size is below the limit of the decoder crate.
        assert!(
            error(sequence(1250, 1250, 1)).contains("frame too large"),
            "error: {}",
            error(sequence(1250, 1250, 1))
        );
        assert!(
            error(sequence(1250, 3, 1)).contains("20000 x 48 px"),
            "error: {}",
            error(sequence(1250, 3, 1))
        );
        assert!(error(sequence(4, 3, 900)).contains("900 reference pictures"));
        // These parameters are valid; only the first picture is missing.
        assert!(
            error(sequence(4, 3, 1)).contains("without a picture"),
            "error: {}",
            error(sequence(4, 3, 1))
        );
    }
}
