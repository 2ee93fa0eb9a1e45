//! Which pixels of a row are foreground, one bit each, and which runs do they form?
//!
//! Sixteen grey levels are compared at a time. Most of an image is background: a span is masked only if its extreme
//! grey level is foreground.

use crate::detect::threshold::Level;
use std::ops::Range;
use wide::u8x16;

/// Pixels in a word of bits.
pub(super) const WORD_PX: usize = u64::BITS as usize;
/// Pixels compared at once.
const LANES: usize = 16;
/// Words, and pixels, whose extreme grey level is tested before they are masked.
const SPAN_WORDS: usize = 8;
const SPAN_PX: usize = SPAN_WORDS * WORD_PX;

/// Adjacent foreground pixels of one row; `end` is excluded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub start: u32,
    pub end: u32,
    pub label: u32,
}

/// The foreground of a row, with an empty word at either end.
#[derive(Debug, Default)]
pub(super) struct RowBits {
    foreground: Vec<u64>,
    /// Whether the left or the right neighbour of a pixel is foreground.
    beside: Vec<u64>,
    /// The range of words outside of which no pixel is foreground.
    used: Range<usize>,
}

impl RowBits {
    /// Makes it an empty row of the given number of words.
    pub(super) fn resize(&mut self, words: usize) {
        for bits in [&mut self.foreground, &mut self.beside] {
            bits.clear();
            bits.resize(words + 2, 0);
        }
        self.used = 0..0;
    }

    /// Reads a row of pixels.
    ///
    /// A row below an empty one is usually empty too: with `below_empty` the extreme grey level of the whole row is
    /// tested first.
    pub(super) fn read(&mut self, row: &[u8], level: Level, below_empty: bool) {
        self.clear();
        if below_empty && !level.has_foreground(row) {
            return;
        }
        let words = self.foreground.len() - 2;
        self.used = mask_row(row, level, &mut self.foreground[1..=words]);
        let Range { start, end } = widened(&self.used, words);
        let [left, here, right] = [0, 1, 2].map(|k| &self.foreground[start + k..end + k]);
        let sides = left.iter().zip(right).map(|(left, right)| left >> 63 | right << 63);
        for (beside, (here, sides)) in self.beside[1..][start..end].iter_mut().zip(here.iter().zip(sides)) {
            *beside = here << 1 | here >> 1 | sides;
        }
    }

    /// Makes all pixels background; the number of words stays.
    pub(super) fn clear(&mut self) {
        if !self.used.is_empty() {
            let words = self.foreground.len() - 2;
            self.foreground[1..][self.used.clone()].fill(0);
            self.beside[1..][widened(&self.used, words)].fill(0);
            self.used = 0..0;
        }
    }

    /// Whether no pixel is foreground.
    pub(super) fn is_empty(&self) -> bool {
        self.used.is_empty()
    }

    /// The words that may contain foreground, and their range in the row.
    pub(super) fn words(&self) -> (&[u64], Range<usize>) {
        (&self.foreground[1..][self.used.clone()], self.used.clone())
    }
}

/// The pixels of the middle row that have a foreground neighbour: single pixels are noise and cannot join any
/// component.
///
/// The result is that of [`RowBits::words`]; `kept` is a buffer.
pub(super) fn with_neighbours<'a>(
    [previous, current, next]: [&RowBits; 3],
    kept: &'a mut Vec<u64>,
) -> (&'a [u64], Range<usize>) {
    let used = current.used.clone();
    kept.clear();
    let [above, beside_above, here, beside, below, beside_below] = [
        &previous.foreground,
        &previous.beside,
        &current.foreground,
        &current.beside,
        &next.foreground,
        &next.beside,
    ]
    .map(|bits| &bits[1..][used.clone()]);
    kept.extend(
        (0..used.len())
            .map(|k| here[k] & (beside[k] | above[k] | beside_above[k] | below[k] | beside_below[k])),
    );
    (kept, used)
}

/// The range of words that contains the neighbours of all pixels of a range.
fn widened(used: &Range<usize>, words: usize) -> Range<usize> {
    if used.is_empty() { 0..0 } else { used.start.saturating_sub(1)..(used.end + 1).min(words) }
}

/// Writes one bit per pixel, set for foreground, into words that are zero; gives the range of words that may be
/// nonzero.
fn mask_row(row: &[u8], level: Level, masks: &mut [u64]) -> Range<usize> {
    let Some(comparison) = Comparison::new(level) else { return 0..0 };
    let mut used = 0..0;
    let mut mask = |k: usize, span: &[u8]| {
        let words = k * SPAN_WORDS..k * SPAN_WORDS + span.len().div_ceil(WORD_PX);
        comparison.mask(span, &mut masks[words.clone()]);
        used = if used.is_empty() { words } else { used.start..words.end };
    };
    let (spans, rest) = row.as_chunks::<SPAN_PX>();
    for (k, span) in spans.iter().enumerate() {
        if level.has_foreground(span) {
            mask(k, span);
        }
    }
    // For a short rest the last full span of the row is tested: more pixels, but their number is a constant.
    if !rest.is_empty()
        && row
            .last_chunk::<SPAN_PX>()
            .map_or_else(|| level.has_foreground(rest), |last| level.has_foreground(last))
    {
        mask(spans.len(), rest);
    }
    used
}

/// The comparison with a level as one vector operation: foreground is a pixel that is at most `last` after its bits
/// are flipped by `flip`.
#[derive(Clone, Copy)]
struct Comparison {
    flip: u8x16,
    last: u8x16,
}

impl Comparison {
    /// `None` for a level at which no pixel is foreground.
    fn new(level: Level) -> Option<Self> {
        let (flip, below) = match level {
            Level::Below(threshold) => (0, threshold),
            Level::Above(threshold) => (u8::MAX, u8::MAX - threshold),
        };
        let last = below.checked_sub(1)?;
        Some(Self { flip: u8x16::splat(flip), last: u8x16::splat(last) })
    }

    #[inline]
    fn foreground(self, pixels: u8x16) -> u64 {
        u64::from(pixels.min(self.last).simd_eq(pixels).to_bitmask())
    }

    /// Writes one bit per pixel.
    fn mask(self, span: &[u8], masks: &mut [u64]) {
        let (words, rest) = span.as_chunks::<WORD_PX>();
        for (word, mask) in words.iter().zip(masks.iter_mut()) {
            *mask = self.mask_word(word);
        }
        if !rest.is_empty() {
            let mut word = [0; WORD_PX];
            word[..rest.len()].copy_from_slice(rest);
            masks[words.len()] = self.mask_word(&word) & (u64::MAX >> (WORD_PX - rest.len()));
        }
    }

    #[inline]
    fn mask_word(self, word: &[u8; WORD_PX]) -> u64 {
        let lanes = word.as_chunks::<LANES>().0.iter().enumerate();
        lanes
            .fold(0, |mask, (k, &lanes)| mask | self.foreground(u8x16::new(lanes) ^ self.flip) << (LANES * k))
    }
}

impl Level {
    /// Whether any of the pixels is foreground; a few instructions if their number is a constant.
    #[inline]
    fn has_foreground(self, pixels: &[u8]) -> bool {
        match self {
            Self::Below(threshold) => pixels.iter().fold(u8::MAX, |least, &p| least.min(p)) < threshold,
            Self::Above(threshold) => pixels.iter().fold(0, |most: u8, &p| most.max(p)) > threshold,
        }
    }
}

/// Appends the runs of words of bits to `row`; the first bit is column `first_x`, and `nonzero` is a buffer.
pub(super) fn runs(words: &[u64], first_x: u32, nonzero: &mut Vec<u32>, row: &mut Vec<Run>) {
    // Nonzero words are collected without a branch: in a noisy image it would often be mispredicted.
    nonzero.resize(words.len() + 1, 0);
    let mut count = 0;
    for (k, &word) in words.iter().enumerate() {
        nonzero[count] = k as u32;
        count += usize::from(word != 0);
    }
    for &k in &nonzero[..count] {
        let base = first_x + k * u64::BITS;
        let mut rest = words[k as usize];
        while rest != 0 {
            let start = rest.trailing_zeros();
            let end = start + (rest >> start).trailing_ones();
            match row.last_mut() {
                Some(last) if start == 0 && last.end == base => last.end = base + end,
                _ => row.push(Run { start: base + start, end: base + end, label: 0 }),
            }
            // Adding the lowest bit of the run clears the run by carrying.
            rest &= rest.wrapping_add(1 << start);
        }
    }
}
