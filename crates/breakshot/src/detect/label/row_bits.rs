//! Which pixels of a row are foreground, one bit each, and which runs do they form?
//!
//! Grey levels are compared sixteen at a time; most of a picture shows nothing, and is only looked at for its darkest.

use crate::detect::threshold::Level;
use std::ops::Range;
use wide::u8x16;

/// Pixels in a word of bits, and pixels compared at once.
pub(super) const BLOCK: usize = 64;
const LANES: usize = 16;
/// Words whose darkest pixel is looked for first, and so many pixels.
const SPAN_WORDS: usize = 8;
const SPAN: usize = SPAN_WORDS * BLOCK;

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
    /// The words outside of which nothing is.
    used: Range<usize>,
}

impl Bits {
    /// An empty row of so many words.
    pub(super) fn clear(&mut self, words: usize) {
        for bits in [&mut self.here, &mut self.beside] {
            bits.clear();
            bits.resize(words + 2, 0);
        }
        self.used = 0..0;
    }

    /// Takes in a row of pixels.
    ///
    /// Below an empty row most are empty: the whole of it is looked at first.
    pub(super) fn read(&mut self, row: &[u8], level: Level, below_empty: bool) {
        self.empty();
        if below_empty && !level.shows(row) {
            return;
        }
        let words = self.here.len() - 2;
        self.used = mask_row(row, level, &mut self.here[1..=words]);
        let Range { start, end } = reached(&self.used, words);
        let [left, here, right] = [0, 1, 2].map(|k| &self.here[start + k..end + k]);
        let sides = left.iter().zip(right).map(|(left, right)| left >> 63 | right << 63);
        for (beside, (here, sides)) in self.beside[1..][start..end].iter_mut().zip(here.iter().zip(sides)) {
            *beside = here << 1 | here >> 1 | sides;
        }
    }

    /// Leaves nothing in a row of as many words.
    pub(super) fn empty(&mut self) {
        if !self.used.is_empty() {
            let words = self.here.len() - 2;
            self.here[1..][self.used.clone()].fill(0);
            self.beside[1..][reached(&self.used, words)].fill(0);
            self.used = 0..0;
        }
    }

    /// Whether nothing is foreground.
    pub(super) fn is_empty(&self) -> bool {
        self.used.is_empty()
    }

    /// The words that may hold foreground, and which these are.
    pub(super) fn words(&self) -> (&[u64], Range<usize>) {
        (&self.here[1..][self.used.clone()], self.used.clone())
    }
}

/// The pixels of the middle row that have at least one neighbour: lone ones are noise and cannot join anything.
///
/// As [`Bits::words`]; `company` is room to work in.
pub(super) fn in_company<'a>(
    [previous, current, next]: [&Bits; 3],
    company: &'a mut Vec<u64>,
) -> (&'a [u64], Range<usize>) {
    let used = current.used.clone();
    company.clear();
    let [above, beside_above, here, beside, below, beside_below] =
        [&previous.here, &previous.beside, &current.here, &current.beside, &next.here, &next.beside]
            .map(|bits| &bits[1..][used.clone()]);
    company.extend(
        (0..used.len())
            .map(|k| here[k] & (beside[k] | above[k] | beside_above[k] | below[k] | beside_below[k])),
    );
    (company, used)
}

/// The words that hold neighbours of what these hold.
fn reached(used: &Range<usize>, words: usize) -> Range<usize> {
    if used.is_empty() { 0..0 } else { used.start.saturating_sub(1)..(used.end + 1).min(words) }
}

/// One bit per pixel, into empty words: whether it is foreground.  Tells outside of which words nothing is.
fn mask_row(row: &[u8], level: Level, masks: &mut [u64]) -> Range<usize> {
    let Some(test) = Test::of(level) else { return 0..0 };
    let mut used = 0..0;
    let mut mask = |k: usize, span: &[u8]| {
        let words = k * SPAN_WORDS..k * SPAN_WORDS + span.len().div_ceil(BLOCK);
        test.mask(span, &mut masks[words.clone()]);
        used = if used.is_empty() { words } else { used.start..words.end };
    };
    let (spans, rest) = row.as_chunks::<SPAN>();
    for (k, span) in spans.iter().enumerate() {
        if level.shows(span) {
            mask(k, span);
        }
    }
    // Of a short end the row's last pixels are looked at: they are more, but of a fixed number.
    if !rest.is_empty()
        && row.last_chunk::<SPAN>().map_or_else(|| level.shows(rest), |last| level.shows(last))
    {
        mask(spans.len(), rest);
    }
    used
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

    /// A bit for each pixel.
    fn mask(self, span: &[u8], masks: &mut [u64]) {
        let (blocks, rest) = span.as_chunks::<BLOCK>();
        for (block, mask) in blocks.iter().zip(masks.iter_mut()) {
            *mask = self.mask_block(block);
        }
        if !rest.is_empty() {
            let mut block = [0; BLOCK];
            block[..rest.len()].copy_from_slice(rest);
            masks[blocks.len()] = self.mask_block(&block) & (u64::MAX >> (BLOCK - rest.len()));
        }
    }

    #[inline]
    fn mask_block(self, block: &[u8; BLOCK]) -> u64 {
        let lanes = block.as_chunks::<LANES>().0.iter().enumerate();
        lanes.fold(0, |mask, (k, &lanes)| mask | self.passed(u8x16::new(lanes) ^ self.flip) << (LANES * k))
    }
}

impl Level {
    /// Whether any pixel is foreground; of a fixed number of pixels a few instructions.
    #[inline]
    fn shows(self, pixels: &[u8]) -> bool {
        match self {
            Self::Below(threshold) => pixels.iter().fold(u8::MAX, |least, &p| least.min(p)) < threshold,
            Self::Above(threshold) => pixels.iter().fold(0, |most: u8, &p| most.max(p)) > threshold,
        }
    }
}

/// The runs of words of bits, the first of which begins in a column; `filled` is room to work in.
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
