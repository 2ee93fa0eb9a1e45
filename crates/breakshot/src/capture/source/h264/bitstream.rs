//! The bits of a coded picture: NAL units, emulation prevention, Exp-Golomb numbers.

use super::config::Framing;
use crate::capture::source::error::SourceError;

type Result<T> = std::result::Result<T, SourceError>;

/// The NAL units of a sample.
pub(super) fn units(sample: &[u8], framing: Framing) -> Result<Vec<&[u8]>> {
    match framing {
        Framing::Lengths(length_bytes) => units_by_length(sample, length_bytes),
        Framing::StartCodes => units_by_start_code(sample),
    }
}

/// The parts between start codes, each without the zeros behind it (ITU-T H.264, B.1).
fn units_by_start_code(sample: &[u8]) -> Result<Vec<&[u8]>> {
    let mut units = Vec::new();
    let mut parts = StartCodes { rest: sample };
    if parts.next().is_none_or(|before| before.iter().any(|&byte| byte != 0)) {
        return Err(SourceError::damaged("H.264 that does not begin with a start code"));
    }
    for part in parts {
        let length = part.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        match part[..length].first() {
            None => {}
            Some(head) if head & 0x80 != 0 => return Err(SourceError::damaged("a forbidden bit")),
            Some(_) => units.push(&part[..length]),
        }
    }
    Ok(units)
}

/// The parts before, between and behind the start codes `00 00 01`.
struct StartCodes<'a> {
    rest: &'a [u8],
}

impl<'a> Iterator for StartCodes<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let code = self.rest.windows(3).position(|bytes| bytes == [0, 0, 1]);
        let (part, rest) = code.map_or((self.rest, &[][..]), |at| (&self.rest[..at], &self.rest[at + 3..]));
        self.rest = rest;
        Some(part)
    }
}

/// The parts before each of which its length stands (ISO/IEC 14496-15).
fn units_by_length(sample: &[u8], length_bytes: usize) -> Result<Vec<&[u8]>> {
    let mut units = Vec::new();
    let mut rest = sample;
    while let Some((length, behind)) = rest.split_at_checked(length_bytes) {
        let length = length.iter().fold(0, |length, &byte| (length << 8) | usize::from(byte));
        let Some((unit, behind)) = behind.split_at_checked(length) else {
            return Err(SourceError::damaged("a part that is longer than its frame"));
        };
        rest = behind;
        match unit.first() {
            None => {}
            Some(head) if head & 0x80 != 0 => return Err(SourceError::damaged("a forbidden bit")),
            Some(_) => units.push(unit),
        }
    }
    if rest.is_empty() { Ok(units) } else { Err(SourceError::damaged("bytes left over behind its parts")) }
}

/// The first `limit` bytes without the emulation prevention bytes (ITU-T H.264, 7.4.1).
pub(super) fn unescaped(escaped: &[u8], limit: usize) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(escaped.len().min(limit));
    let mut zeros = 0;
    for &byte in escaped {
        if bytes.len() == limit {
            break;
        }
        if zeros >= 2 && byte == 3 {
            zeros = 0;
            continue;
        }
        zeros = if byte == 0 { zeros + 1 } else { 0 };
        bytes.push(byte);
    }
    bytes
}

/// Reads bits and Exp-Golomb numbers (9.1).
pub(super) struct Bits<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl Bits<'_> {
    pub(super) fn bit(&mut self) -> Result<bool> {
        let byte = self
            .bytes
            .get(self.at / 8)
            .ok_or_else(|| SourceError::damaged("a slice header that ends early"))?;
        let bit = byte >> (7 - self.at % 8) & 1;
        self.at += 1;
        Ok(bit == 1)
    }

    pub(super) fn skip(&mut self, count: u32) -> Result<()> {
        (0..count).try_for_each(|_| self.bit().map(drop))
    }

    pub(super) fn golomb(&mut self) -> Result<u32> {
        let mut zeros = 0;
        while !self.bit()? {
            zeros += 1;
        }
        if zeros > 31 {
            return Err(SourceError::damaged("a damaged slice header"));
        }
        let mut number = 1_u32;
        for _ in 0..zeros {
            number = number << 1 | u32::from(self.bit()?);
        }
        Ok(number - 1)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Writes bits and Exp-Golomb numbers, as [`Bits`] reads them.
    #[derive(Default)]
    pub(crate) struct Writer(Vec<bool>);

    impl Writer {
        pub(crate) fn bits(mut self, value: u32, count: u32) -> Self {
            self.0.extend((0..count).rev().map(|k| value >> k & 1 == 1));
            self
        }

        pub(crate) fn golomb(self, number: u32) -> Self {
            let length = (number + 1).ilog2();
            self.bits(0, length).bits(number + 1, length + 1)
        }

        pub(crate) fn bytes(mut self) -> Vec<u8> {
            self.0.resize(self.0.len().div_ceil(8) * 8, false);
            self.0.chunks(8).map(|bits| bits.iter().fold(0, |byte, &bit| byte << 1 | u8::from(bit))).collect()
        }
    }

    #[test]
    fn exp_golomb_numbers_are_read_as_they_were_written() {
        let bytes = Writer::default().golomb(0).golomb(1).golomb(6).golomb(70_000).bits(1, 1).bytes();
        let mut bits = Bits { bytes: &bytes, at: 0 };
        let read: Vec<u32> = (0..4).map(|_| bits.golomb().unwrap()).collect();
        assert_eq!(read, [0, 1, 6, 70_000]);
        assert!(bits.bit().unwrap());
        assert!(Bits { bytes: &[0; 9], at: 0 }.golomb().is_err(), "72 zeros are no number");
        assert!(Bits { bytes: &[], at: 0 }.bit().is_err());
    }

    #[test]
    fn emulation_prevention_bytes_are_removed() {
        assert_eq!(unescaped(&[1, 0, 0, 3, 1, 0, 0, 3, 0, 0, 3], 99), [1, 0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(unescaped(&[9; 20], 4), [9; 4]);
    }

    #[test]
    fn a_nal_unit_longer_than_its_sample_is_an_error() {
        assert_eq!(
            units(&[0, 2, 0x65, 1, 0, 1, 0x06], Framing::Lengths(2)).unwrap(),
            [&[0x65, 1][..], &[0x06]]
        );
        assert!(units(&[0, 3, 0x65, 1], Framing::Lengths(2)).is_err());
        assert!(units(&[0, 1, 0x65, 0], Framing::Lengths(2)).is_err());
        assert!(units(&[0, 1, 0xe5], Framing::Lengths(2)).is_err());
    }
    #[test]
    fn start_codes_of_three_and_four_bytes_delimit_units() {
        let units = |sample| units(sample, Framing::StartCodes);
        let two = units(&[0, 0, 0, 1, 0x67, 5, 0, 0, 0, 0, 1, 0x65, 1, 0]);
        assert_eq!(two.expect("two units"), [&[0x67, 5][..], &[0x65, 1]]);
        assert_eq!(units(&[0, 0, 1]).expect("no unit"), <[&[u8]; 0]>::default());
        assert!(units(&[0x67, 0, 0, 1, 0x65]).is_err() && units(&[]).is_err());
        assert!(units(&[0, 0, 1, 0xe5]).is_err(), "a forbidden bit");
    }
}
