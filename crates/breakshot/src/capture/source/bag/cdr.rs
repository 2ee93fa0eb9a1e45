//! Fields of a message in CDR, the serialisation of ROS 2 (OMG, Common Data Representation; DDSI-RTPS 2.5, 10.2).

use crate::capture::source::error::SourceError;

type Result<T> = std::result::Result<T, SourceError>;

/// Bytes before the fields: the representation and its options. Alignment counts from behind them.
const HEAD_BYTES: usize = 4;
const NANOSECONDS: i64 = 1_000_000_000;

/// Reads the fields of a message in their order.
pub(super) struct Cdr<'a> {
    fields: &'a [u8],
    at: usize,
    is_big_endian: bool,
}

impl<'a> Cdr<'a> {
    /// # Errors
    /// A representation other than plain CDR.
    pub(super) fn of(message: &'a [u8]) -> Result<Self> {
        let (head, fields) = message.split_at_checked(HEAD_BYTES).ok_or_else(ends_early)?;
        let is_big_endian = match head {
            [0, 0, ..] => true,
            [0, 1, ..] => false,
            [0x28, 0xb5, 0x2f, 0xfd] => {
                return Err(SourceError::of_compressed_bag("a bag whose messages are compressed"));
            }
            _ => {
                let found = format!("messages of CDR representation {:02x} {:02x}", head[0], head[1]);
                return Err(SourceError::unsuitable(found, "plain CDR (00 00 or 00 01), as ROS 2 writes it"));
            }
        };
        Ok(Self { fields, at: 0, is_big_endian })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let taken = self.fields.get(self.at..).and_then(|rest| rest.get(..count)).ok_or_else(ends_early)?;
        self.at += count;
        Ok(taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8> {
        self.take(1).map(|byte| byte[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32> {
        self.at = self.at.next_multiple_of(4);
        let mut bytes = [0; 4];
        bytes.copy_from_slice(self.take(4)?);
        Ok(if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// Numbers of double precision, of a fixed count.
    pub(super) fn f64_array(&mut self, count: usize) -> Result<Vec<f64>> {
        self.at = self.at.next_multiple_of(8);
        let number = if self.is_big_endian { f64::from_be_bytes } else { f64::from_le_bytes };
        Ok(self.take(8 * count)?.as_chunks().0.iter().copied().map(number).collect())
    }

    /// A sequence of numbers of double precision.
    ///
    /// # Errors
    /// A message that ends early, more than `most` numbers.
    pub(super) fn f64_sequence(&mut self, most: usize) -> Result<Vec<f64>> {
        let count = self.u32()? as usize;
        if count > most {
            return Err(SourceError::damaged(format!("a message with a list of {count} numbers")));
        }
        // Nothing is aligned for numbers that are not there.
        if count == 0 { Ok(Vec::new()) } else { self.f64_array(count) }
    }

    /// A sequence of bytes.
    pub(super) fn bytes(&mut self) -> Result<&'a [u8]> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    /// A string, which ends with a zero byte.
    pub(super) fn text(&mut self) -> Result<&'a str> {
        let bytes = self.bytes()?;
        let text = std::str::from_utf8(bytes.strip_suffix(b"\0").unwrap_or(bytes));
        text.map_err(|_| SourceError::damaged("a message with a text that is none"))
    }

    /// `builtin_interfaces/msg/Time` (ns).
    pub(super) fn time_ns(&mut self) -> Result<i64> {
        let (seconds, nanoseconds) = (self.u32()?.cast_signed(), self.u32()?);
        time_ns(i64::from(seconds), i64::from(nanoseconds))
    }
}

/// A time of whole seconds and a fraction (ns).
pub(super) fn time_ns(seconds: i64, nanoseconds: i64) -> Result<i64> {
    let impossible = || SourceError::damaged(format!("a time of {seconds} s and {nanoseconds} ns"));
    if !(0..NANOSECONDS).contains(&nanoseconds) {
        return Err(impossible());
    }
    let whole = seconds.checked_mul(NANOSECONDS).and_then(|whole| whole.checked_add(nanoseconds));
    whole.ok_or_else(impossible)
}

fn ends_early() -> SourceError {
    SourceError::damaged("a message that ends early")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_aligned_in_both_byte_orders() {
        let little = [0, 1, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0, b'a', 0, 9, 0, 4, 3, 2, 1];
        let mut cdr = Cdr::of(&little).expect("CDR");
        assert_eq!((cdr.u8().unwrap(), cdr.text().unwrap(), cdr.u8().unwrap()), (7, "a", 9));
        assert_eq!(cdr.u32().unwrap(), 0x0102_0304);
        assert!(cdr.u8().is_err(), "the end");
        let mut cdr = Cdr::of(&[0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 5]).expect("CDR");
        assert_eq!(cdr.time_ns().unwrap(), 2_000_000_005);
        let one = 1_f64.to_le_bytes();
        let numbers =
            [&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0][..], &one, &one].concat();
        let mut cdr = Cdr::of(&numbers).expect("CDR");
        assert_eq!((cdr.u8().unwrap(), cdr.f64_sequence(3).unwrap()), (1, vec![]));
        assert_eq!((cdr.f64_sequence(3).unwrap(), cdr.f64_array(1).unwrap()), (vec![1.0], vec![1.0]));
        assert!(cdr.f64_array(1).is_err(), "the end");
        assert!(Cdr::of(&[0, 1, 0, 0, 9, 0, 0, 0]).expect("CDR").f64_sequence(3).is_err(), "too many");
        assert!(Cdr::of(&[0, 7, 0, 0]).is_err() && Cdr::of(&[0, 1]).is_err());
        assert!(time_ns(1, NANOSECONDS).is_err() && time_ns(i64::MAX, 0).is_err());
    }
}
