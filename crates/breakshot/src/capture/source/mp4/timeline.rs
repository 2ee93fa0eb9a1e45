//! In which order and at which times are the coded pictures displayed?

use crate::capture::source::error::SourceError;
use crate::capture::source::timestamps::NEEDED_TIMES;

/// An interval of a track that is displayed (`elst`), in ticks of the track's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edit {
    /// The first tick of the interval.
    pub media_start: i64,
    /// The first tick after the interval.
    pub media_end: i64,
    /// The display time of its first tick.
    pub display_start: i64,
}

/// The same intervals without what precedes tick `start`.
pub(super) fn edits_from(start: i64, edits: &[Edit]) -> Vec<Edit> {
    if edits.is_empty() {
        return vec![Edit { media_start: start, media_end: i64::MAX, display_start: 0 }];
    }
    let cut = |edit: &Edit| {
        let removed = start.saturating_sub(edit.media_start).max(0);
        Edit {
            media_start: edit.media_start.max(start),
            display_start: edit.display_start.saturating_add(removed),
            ..*edit
        }
    };
    edits.iter().map(cut).filter(|edit| edit.media_start < edit.media_end).collect()
}

/// The largest number of decoded pictures that wait for display: H.264 keeps at most 16 (A.3.1 h).
const MAX_REORDERED: usize = 16;
/// Display order and display times of the coded pictures.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Timeline {
    /// For each picture in decoding order its index in display order; `None` for one that is decoded but not displayed.
    pub display_indices: Vec<Option<u32>>,
    /// Display times (s) in display order; the first one is 0.
    pub times_s: Vec<f64>,
}

impl Timeline {
    /// From the display tick of each coded picture, before edits, and the intervals of the track that are displayed.
    ///
    /// # Errors
    /// No displayed frame, two frames at the same time, times that go back.
    pub(super) fn of(ticks: &[i64], edits: &[Edit], timescale: u32) -> Result<Self, SourceError> {
        let mut displayed: Vec<(i64, usize)> = Vec::with_capacity(ticks.len());
        for (n, &tick) in ticks.iter().enumerate() {
            let edit = edits.iter().find(|edit| (edit.media_start..edit.media_end).contains(&tick));
            match edit {
                Some(edit) => {
                    displayed
                        .push((tick.saturating_sub(edit.media_start).saturating_add(edit.display_start), n));
                }
                None if edits.is_empty() => displayed.push((tick, n)),
                None => {}
            }
        }
        displayed.sort_unstable();
        let Some(&(first, _)) = displayed.first() else {
            let found = format!("an edit list that shows none of its {} frames", ticks.len());
            return Err(SourceError::unsuitable(found, "at least one frame"));
        };
        let seconds = |tick: i64| tick.saturating_sub(first) as f64 / f64::from(timescale);
        if let Some(pair) = displayed.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let found = format!("two frames at the same time ({:.4} s)", seconds(pair[0].0));
            return Err(SourceError::unsuitable(found, NEEDED_TIMES));
        }
        let mut display_indices = vec![None; ticks.len()];
        for (index, &(_, n)) in (0..).zip(&displayed) {
            display_indices[n] = Some(index);
        }
        let times_s = displayed.iter().map(|&(tick, _)| seconds(tick)).collect();
        let timeline = Self { display_indices, times_s };
        timeline.check_order()?;
        Ok(timeline)
    }

    /// An error where more than [`MAX_REORDERED`] pictures would have to wait for display.
    fn check_order(&self) -> Result<(), SourceError> {
        let mut decoded = vec![false; self.times_s.len()];
        let (mut next, mut waiting) = (0, 0);
        for index in self.display_indices.iter().flatten() {
            decoded[*index as usize] = true;
            waiting += 1;
            while decoded.get(next) == Some(&true) {
                next += 1;
                waiting -= 1;
            }
            if waiting > MAX_REORDERED {
                let time_s = self.times_s[next];
                let found =
                    format!("time stamps that go back: the frame at {time_s:.4} s comes far too late");
                return Err(SourceError::unsuitable(found, NEEDED_TIMES));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_displayed_in_the_order_of_their_times() {
        // Decoding order I P B B, display order I B B P.
        let timeline = Timeline::of(&[20, 50, 30, 40], &[], 10).unwrap();
        assert_eq!(timeline.display_indices, [Some(0), Some(3), Some(1), Some(2)]);
        assert_eq!(timeline.times_s, [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn an_edit_list_hides_the_frames_before_and_after_it() {
        let edit = Edit { media_start: 30, media_end: 50, display_start: 7 };
        let timeline = Timeline::of(&[20, 30, 40, 50], &[edit], 10).unwrap();
        assert_eq!(timeline.display_indices, [None, Some(0), Some(1), None]);
        assert_eq!(timeline.times_s, [0.0, 1.0]);
    }

    #[test]
    fn pictures_before_the_first_key_frame_can_be_left_out() {
        let timeline = Timeline::of(&[20, 0, 10, 30], &edits_from(20, &[]), 10).unwrap();
        assert_eq!(timeline.display_indices, [Some(0), None, None, Some(1)]);
        let edits = [
            Edit { media_start: 5, media_end: 15, display_start: 0 },
            Edit { media_start: 15, media_end: 99, display_start: 10 },
        ];
        assert_eq!(edits_from(20, &edits), [Edit { media_start: 20, media_end: 99, display_start: 15 }]);
    }

    #[test]
    fn two_edits_are_displayed_one_after_the_other() {
        let edits = [
            Edit { media_start: 0, media_end: 20, display_start: 0 },
            Edit { media_start: 50, media_end: 70, display_start: 20 },
        ];
        let ticks: Vec<i64> = (0..8).map(|n| 10 * n).collect();
        let timeline = Timeline::of(&ticks, &edits, 10).unwrap();
        assert_eq!(timeline.times_s, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(timeline.display_indices[5], Some(2));
    }

    #[test]
    fn times_that_repeat_or_go_back_are_an_error() {
        assert!(Timeline::of(&[0, 10, 10], &[], 10).unwrap_err().found.contains("same time"));
        let mut ticks: Vec<i64> = (1..40).map(|n| 10 * n).collect();
        ticks.push(0);
        assert!(Timeline::of(&ticks, &[], 10).unwrap_err().found.contains("go back"));
    }
}
