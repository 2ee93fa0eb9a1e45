//! In which order, and when, are the coded pictures shown?

use crate::capture::source::error::Refusal;
use crate::capture::source::timestamps::NEEDED_TIMES;

/// A stretch of a track that is shown (`elst`), in ticks of the track's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edit {
    /// The first tick that is shown.
    pub media_start: i64,
    /// The first tick that is not.
    pub media_end: i64,
    /// When its first tick is shown.
    pub shown_at: i64,
}

/// The same stretches from tick `start` on.
pub(super) fn from(start: i64, edits: &[Edit]) -> Vec<Edit> {
    if edits.is_empty() {
        return vec![Edit { media_start: start, media_end: i64::MAX, shown_at: 0 }];
    }
    let late = |edit: &Edit| {
        let hidden = start.saturating_sub(edit.media_start).max(0);
        Edit {
            media_start: edit.media_start.max(start),
            shown_at: edit.shown_at.saturating_add(hidden),
            ..*edit
        }
    };
    edits.iter().map(late).filter(|edit| edit.media_start < edit.media_end).collect()
}

/// How far apart decoding and showing can be: H.264 keeps at most 16 pictures (A.3.1 h).
const MAX_REORDERED: usize = 16;
/// The order of showing, from the order of decoding.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Timeline {
    /// For each coded picture its place among those shown; none: decoded, but not shown.
    pub places: Vec<Option<u32>>,
    /// When each place is shown (s); the first one at 0.
    pub times_s: Vec<f64>,
}

impl Timeline {
    /// From the ticks at which the track shows each coded picture, and the stretches of the track that are shown.
    pub(super) fn of(ticks: &[i64], edits: &[Edit], timescale: u32) -> Result<Self, Refusal> {
        let mut shown: Vec<(i64, usize)> = Vec::with_capacity(ticks.len());
        for (n, &tick) in ticks.iter().enumerate() {
            let edit = edits.iter().find(|edit| (edit.media_start..edit.media_end).contains(&tick));
            match edit {
                Some(edit) => {
                    shown.push((tick.saturating_sub(edit.media_start).saturating_add(edit.shown_at), n));
                }
                None if edits.is_empty() => shown.push((tick, n)),
                None => {}
            }
        }
        shown.sort_unstable();
        let Some(&(first, _)) = shown.first() else {
            let found = format!("an edit list that shows none of its {} frames", ticks.len());
            return Err(Refusal::unfit(found, "at least one frame"));
        };
        let seconds = |tick: i64| tick.saturating_sub(first) as f64 / f64::from(timescale);
        if let Some(pair) = shown.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let found = format!("two frames at the same time ({:.4} s)", seconds(pair[0].0));
            return Err(Refusal::unfit(found, NEEDED_TIMES));
        }
        let mut places = vec![None; ticks.len()];
        for (place, &(_, n)) in (0..).zip(&shown) {
            places[n] = Some(place);
        }
        let times_s = shown.iter().map(|&(tick, _)| seconds(tick)).collect();
        let timeline = Self { places, times_s };
        timeline.check_order()?;
        Ok(timeline)
    }

    /// An error where a picture would have to wait for more than [`MAX_REORDERED`] others.
    fn check_order(&self) -> Result<(), Refusal> {
        let mut decoded = vec![false; self.times_s.len()];
        let (mut next, mut waiting) = (0, 0);
        for place in self.places.iter().flatten() {
            decoded[*place as usize] = true;
            waiting += 1;
            while decoded.get(next) == Some(&true) {
                next += 1;
                waiting -= 1;
            }
            if waiting > MAX_REORDERED {
                let time_s = self.times_s[next];
                let found =
                    format!("time stamps that go back: the frame at {time_s:.4} s comes far too late");
                return Err(Refusal::unfit(found, NEEDED_TIMES));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_shown_in_the_order_of_their_times() {
        // I P B B, as they are coded; shown I B B P.
        let timeline = Timeline::of(&[20, 50, 30, 40], &[], 10).unwrap();
        assert_eq!(timeline.places, [Some(0), Some(3), Some(1), Some(2)]);
        assert_eq!(timeline.times_s, [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn an_edit_list_hides_what_lies_before_and_behind_it() {
        let edit = Edit { media_start: 30, media_end: 50, shown_at: 7 };
        let timeline = Timeline::of(&[20, 30, 40, 50], &[edit], 10).unwrap();
        assert_eq!(timeline.places, [None, Some(0), Some(1), None]);
        assert_eq!(timeline.times_s, [0.0, 1.0]);
    }

    #[test]
    fn leading_pictures_can_be_left_out() {
        let timeline = Timeline::of(&[20, 0, 10, 30], &from(20, &[]), 10).unwrap();
        assert_eq!(timeline.places, [Some(0), None, None, Some(1)]);
        let edits = [
            Edit { media_start: 5, media_end: 15, shown_at: 0 },
            Edit { media_start: 15, media_end: 99, shown_at: 10 },
        ];
        assert_eq!(from(20, &edits), [Edit { media_start: 20, media_end: 99, shown_at: 15 }]);
    }

    #[test]
    fn two_edits_follow_one_another() {
        let edits = [
            Edit { media_start: 0, media_end: 20, shown_at: 0 },
            Edit { media_start: 50, media_end: 70, shown_at: 20 },
        ];
        let ticks: Vec<i64> = (0..8).map(|n| 10 * n).collect();
        let timeline = Timeline::of(&ticks, &edits, 10).unwrap();
        assert_eq!(timeline.times_s, [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(timeline.places[5], Some(2));
    }

    #[test]
    fn times_that_repeat_or_jump_back_are_refused() {
        assert!(Timeline::of(&[0, 10, 10], &[], 10).unwrap_err().found.contains("same time"));
        let mut ticks: Vec<i64> = (1..40).map(|n| 10 * n).collect();
        ticks.push(0);
        assert!(Timeline::of(&ticks, &[], 10).unwrap_err().found.contains("go back"));
    }
}
