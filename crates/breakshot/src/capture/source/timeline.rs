//! In which order, and when, are the coded pictures shown?

use super::refusal::Refusal;

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
/// Steps that differ from the usual one by less are the usual step: clocks are rounded, cameras jitter.
const STEP_TOLERANCE: f64 = 0.2;
/// A rate is called variable when more than this share of the steps is unusual.
const VARIABLE_SHARE: f64 = 0.05;

/// The order of showing, from the order of decoding.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Timeline {
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

/// What time stamps must do.
pub(super) const NEEDED_TIMES: &str = "time stamps that grow from frame to frame";

/// What is odd about the times of the frames (s), which a clock of steps `tick_s` gave: gaps and a changing rate.
pub(super) fn warnings(times_s: &[f64], tick_s: f64) -> Vec<String> {
    let steps: Vec<f64> = times_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let Some(usual) = median(&steps) else {
        return Vec::new();
    };
    let tolerance = (STEP_TOLERANCE * usual).max(1.5 * tick_s);
    let (mut missing, mut gaps, mut first_gap_s, mut unusual) = (0.0, 0, None, 0);
    for (step, time_s) in steps.iter().zip(times_s) {
        let multiple = (step / usual).round();
        if (step - usual).abs() <= tolerance {
        } else if multiple >= 2.0 && (step - multiple * usual).abs() <= tolerance {
            missing += multiple - 1.0;
            gaps += 1;
            first_gap_s = first_gap_s.or(Some(*time_s));
        } else {
            unusual += 1;
        }
    }
    let mut warnings = Vec::new();
    if let Some(first_s) = first_gap_s {
        warnings.push(format!(
            "{missing:.0} frames are missing in {gaps} gaps of the time stamps, the first one after {first_s:.3} s \
             (usual step: {:.3} ms)",
            1e3 * usual
        ));
    }
    if f64::from(unusual) > VARIABLE_SHARE * steps.len() as f64 {
        let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
        let longest = steps.iter().copied().fold(0.0, f64::max);
        warnings.push(format!(
            "the frame rate varies: steps of {:.3} to {:.3} ms (median {:.3} ms); the time stamps are used",
            1e3 * shortest,
            1e3 * longest,
            1e3 * usual
        ));
    }
    warnings
}

fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied()
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

    #[test]
    fn gaps_are_counted_and_jitter_is_not() {
        let even: Vec<f64> = (0..60).map(|n| f64::from(n) / 60.0).collect();
        assert_eq!(warnings(&even, 1e-5), Vec::<String>::new());
        // Times in whole milliseconds: steps of 16 and 17 ms.
        let rounded: Vec<f64> = even.iter().map(|t| (t * 1e3).round() / 1e3).collect();
        assert_eq!(warnings(&rounded, 1e-3), Vec::<String>::new());
        let gaps: Vec<f64> =
            even.iter().enumerate().filter(|(n, _)| ![20, 40, 41].contains(n)).map(|(_, t)| *t).collect();
        let said = warnings(&gaps, 1e-5);
        assert!(said.len() == 1 && said[0].starts_with("3 frames are missing in 2 gaps"), "said: {said:?}");
        assert!(said[0].contains("after 0.317 s"), "said: {said:?}");
    }

    #[test]
    fn a_varying_rate_is_named() {
        let times_s: Vec<f64> = (0..40).map(|n: i32| f64::from(n) / 30.0 + 0.01 * f64::from(n % 3)).collect();
        let said = warnings(&times_s, 1e-5);
        assert!(said.iter().any(|w| w.contains("rate varies")), "said: {said:?}");
    }
}
