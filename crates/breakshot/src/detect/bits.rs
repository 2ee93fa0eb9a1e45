//! Which pixels of a row are foreground, one bit each, and which runs do they form?
//!
//! Grey levels are compared sixteen at a time; most of a picture shows nothing, and is only looked at for its darkest.

use super::label::Level;
use wide::u8x16;

/// Pixels in a word of bits, and pixels compared at once.
pub(super) const BLOCK: usize = 64;
const LANES: usize = 16;
/// Pixels whose darkest is looked for first; whole blocks.
const SPAN: usize = 4 * BLOCK;

/// Foreground pixels side by side in one row, the end excluded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub start: u32,
    pub end: u32,
    pub label: u32,
}

/// A row's foreground, with an empty word at either end.
#[derive(Debug, Default)]
pub(super) struct Bits {
    here: Vec<u64>,
    /// Whether the left or the right neighbour is foreground.
    beside: Vec<u64>,
    /// Whether anything is.
    pub any: bool,
}

impl Bits {
    /// An empty row of so many words.
    pub(super) fn clear(&mut self, words: usize) {
        for bits in [&mut self.here, &mut self.beside] {
            bits.clear();
            bits.resize(words + 2, 0);
        }
        self.any = false;
    }

    /// Takes in a row of pixels.
    pub(super) fn read(&mut self, row: &[u8], level: Level) {
        let words = self.here.len() - 2;
        self.any = mask_row(row, level, &mut self.here[1..=words]);
        if !self.any {
            self.beside.fill(0);
            return;
        }
        let [left, here, right] = [0, 1, 2].map(|k| &self.here[k..k + words]);
        for (k, beside) in self.beside[1..=words].iter_mut().enumerate() {
            *beside = here[k] << 1 | left[k] >> 63 | here[k] >> 1 | right[k] << 63;
        }
    }

    /// The row's words.
    pub(super) fn words(&self) -> &[u64] {
        &self.here[1..self.here.len() - 1]
    }
}

/// The pixels of the middle row that have at least one neighbour: lone ones are noise and cannot join anything.
pub(super) fn in_company([previous, current, next]: [&Bits; 3], company: &mut Vec<u64>) {
    let words = current.words().len();
    company.resize(words, 0);
    let [above, beside_above, here, beside, below, beside_below] =
        [&previous.here, &previous.beside, &current.here, &current.beside, &next.here, &next.beside]
            .map(|bits| &bits[1..=words]);
    for (k, company) in company.iter_mut().enumerate() {
        *company = here[k] & (beside[k] | above[k] | beside_above[k] | below[k] | beside_below[k]);
    }
}

/// One bit per pixel: whether it is foreground.  Tells whether any is.
fn mask_row(row: &[u8], level: Level, masks: &mut [u64]) -> bool {
    let Some(test) = Test::of(level) else {
        masks.fill(0);
        return false;
    };
    let (spans, rest) = row.as_chunks::<SPAN>();
    let (of_spans, of_rest) = masks.split_at_mut(spans.len() * (SPAN / BLOCK));
    let mut any = 0;
    for (span, masks) in spans.iter().zip(of_spans.as_chunks_mut::<{ SPAN / BLOCK }>().0) {
        *masks = [0; SPAN / BLOCK];
        if test.shows(span) {
            for (block, mask) in span.as_chunks::<BLOCK>().0.iter().zip(masks) {
                *mask = test.mask(block);
                any |= *mask;
            }
        }
    }
    let (blocks, rest) = rest.as_chunks::<BLOCK>();
    for (block, mask) in blocks.iter().zip(of_rest.iter_mut()) {
        *mask = test.mask(block);
        any |= *mask;
    }
    if !rest.is_empty() {
        let mut block = [0; BLOCK];
        block[..rest.len()].copy_from_slice(rest);
        let mask = test.mask(&block) & (u64::MAX >> (BLOCK - rest.len()));
        of_rest[blocks.len()] = mask;
        any |= mask;
    }
    any != 0
}

/// Foreground is what lies at most at `last` once its bits are flipped by `flip`.
#[derive(Clone, Copy)]
struct Test {
    flip: u8x16,
    last: u8x16,
}

impl Test {
    /// None for a level that no pixel passes.
    fn of(level: Level) -> Option<Self> {
        let (flip, below) = match level {
            Level::Below(threshold) => (0, threshold),
            Level::Above(threshold) => (u8::MAX, u8::MAX - threshold),
        };
        let last = below.checked_sub(1)?;
        Some(Self { flip: u8x16::splat(flip), last: u8x16::splat(last) })
    }

    #[inline]
    fn passed(self, pixels: u8x16) -> u64 {
        u64::from(pixels.min(self.last).simd_eq(pixels).to_bitmask())
    }

    /// Whether any pixel is foreground.
    #[inline]
    fn shows(self, span: &[u8; SPAN]) -> bool {
        let mut least = [u8x16::MAX; BLOCK / LANES];
        for block in span.as_chunks::<BLOCK>().0 {
            for (least, &lanes) in least.iter_mut().zip(block.as_chunks::<LANES>().0) {
                *least = least.min(u8x16::new(lanes) ^ self.flip);
            }
        }
        self.passed(least.into_iter().fold(u8x16::MAX, u8x16::min)) != 0
    }

    /// A bit for each pixel.
    #[inline]
    fn mask(self, block: &[u8; BLOCK]) -> u64 {
        let lanes = block.as_chunks::<LANES>().0.iter().enumerate();
        lanes.fold(0, |mask, (k, &lanes)| mask | self.passed(u8x16::new(lanes) ^ self.flip) << (LANES * k))
    }
}

/// The runs of a row of bits; `filled` is room to work in.
pub(super) fn runs(words: &[u64], first_x: u32, filled: &mut Vec<u32>, row: &mut Vec<Run>) {
    // Which words hold anything is noted without a branch, which in noise would be guessed wrong.
    filled.resize(words.len() + 1, 0);
    let mut count = 0;
    for (k, &word) in words.iter().enumerate() {
        filled[count] = k as u32;
        count += usize::from(word != 0);
    }
    for &k in &filled[..count] {
        let base = first_x + k * u64::BITS;
        let mut rest = words[k as usize];
        while rest != 0 {
            let start = rest.trailing_zeros();
            let end = start + (rest >> start).trailing_ones();
            match row.last_mut() {
                Some(last) if start == 0 && last.end == base => last.end = base + end,
                _ => row.push(Run { start: base + start, end: base + end, label: 0 }),
            }
            // Adding its lowest bit carries through the run.
            rest &= rest.wrapping_add(1 << start);
        }
    }
}
