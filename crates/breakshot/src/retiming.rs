//! When was each frame taken, if the file says another rate?
//!
//! A film of high frame rate is often written with the times of an ordinary one, so that it plays slowly.

use crate::statistics::upper_median;

/// Usual frame rates (Hz).
const USUAL_HZ: [f64; 17] = [
    24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 90.0, 100.0, 120.0, 180.0, 200.0, 240.0, 300.0, 480.0, 500.0, 960.0,
    1000.0,
];
/// Rates within this fraction are the same (59.94 and 60 Hz).
const SAME_RATE: f64 = 0.01;
/// Whether two frame rates are the same but for the names of their standards.
pub(crate) fn is_same_rate(one_hz: f64, other_hz: f64) -> bool {
    (one_hz / other_hz - 1.0).abs() < SAME_RATE
}

/// The usual frame rate that is meant (Hz), if there is one within this fraction.
pub(crate) fn usual_within(rate_hz: f64, fraction: f64) -> Option<f64> {
    let off = |usual: &f64| (rate_hz / usual - 1.0).abs();
    let nearest = USUAL_HZ.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    nearest.filter(|usual| off(usual) < fraction)
}

/// The usual rate that is meant, or the rate in three digits.
pub(crate) fn usual_hz(rate_hz: f64) -> f64 {
    usual_within(rate_hz, SAME_RATE).unwrap_or_else(|| {
        let scale = 10_f64.powf(2.0 - rate_hz.log10().floor());
        (rate_hz * scale).round() / scale
    })
}

/// Times of frames from the times in a file that says another frame rate.
///
/// Regular times become whole multiples of the true interval, exactly as in a file that says the true rate; irregular ones
/// keep their proportions.
#[derive(Clone, Debug)]
pub(crate) struct Retiming {
    /// The rate at which the frames were taken.
    rate_hz: f64,
    /// The interval between frames in the file, as far as it is known (s), and its first estimate.
    step_s: f64,
    first_step_s: f64,
    /// The time in the file of the first frame (s), and its number.
    start: Option<(f64, f64)>,
    /// The number of the last frame.
    last: f64,
}

impl Retiming {
    /// Number of first frames from which the interval in the file is estimated.
    pub(crate) const FIRST_FRAMES: usize = 16;

    /// To the rate `rate_hz` from the times of the first frames (s), which grow; `None` for fewer than two frames.
    pub(crate) fn new(rate_hz: f64, first_s: &[f64]) -> Option<Self> {
        /// Steps are regular if they are whole multiples of the usual one within this fraction of it, ...
        const REGULAR: f64 = 0.2;
        /// ... and a film if this fraction of its steps are.
        const MOST: f64 = 0.8;
        let steps_s = || first_s.windows(2).map(|pair| pair[1] - pair[0]);
        let usual_s = upper_median(steps_s())?;
        let multiples = steps_s().map(|step| (step, (step / usual_s).round().max(1.0)));
        let regular: Vec<_> = multiples
            .filter(|(step, multiple)| (step - multiple * usual_s).abs() <= REGULAR * usual_s)
            .collect();
        let count = steps_s().count() as f64;
        let step_s = if regular.len() as f64 >= MOST * count {
            let (sum_s, number) =
                regular.iter().fold((0.0, 0.0), |(s, n), (step, multiple)| (s + step, n + multiple));
            sum_s / number
        } else {
            steps_s().sum::<f64>() / count
        };
        let known = step_s.is_finite() && step_s > 0.0;
        known.then_some(Self { rate_hz, step_s, first_step_s: step_s, start: None, last: f64::NEG_INFINITY })
    }

    /// The time of the next frame (s), whose time in the file is `file_s`.
    pub(crate) fn time_s(&mut self, file_s: f64) -> f64 {
        let first = file_s / self.step_s;
        let first = if self.is_regular(first) { first.round() } else { first };
        let (start_s, first) = *self.start.get_or_insert((file_s, first));
        let since_s = file_s - start_s;
        let count = since_s / self.step_s;
        let mut number = first + since_s / self.first_step_s;
        if self.is_regular(count) && first + count.round() > self.last {
            number = first + count.round();
            if count.round() > 0.0 {
                self.step_s = since_s / count.round();
            }
        }
        // Where the estimates of the interval meet, times must grow all the same.
        self.last = if number > self.last { number } else { self.last.next_up() };
        self.last / self.rate_hz
    }

    /// Whether a number of intervals is whole, but for the rounding of the clock.
    fn is_regular(&self, intervals: f64) -> bool {
        /// Clocks of files tick at least once a millisecond.
        const TICK_S: f64 = 1.1e-3;
        let tolerance = (TICK_S / self.step_s).clamp(0.01, 0.2);
        (intervals - intervals.round()).abs() <= tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn retimed(rate_hz: f64, file_s: &[f64]) -> Vec<f64> {
        let first = &file_s[..file_s.len().min(Retiming::FIRST_FRAMES)];
        let mut retiming = Retiming::new(rate_hz, first).expect("two frames");
        file_s.iter().map(|t| retiming.time_s(*t)).collect()
    }

    #[test]
    fn a_retimed_film_gets_the_times_of_the_original_to_the_bit() {
        let original: Vec<f64> = (0..500).map(|n| f64::from(n) / 120.0).collect();
        let clocks: [fn(i32) -> f64; 4] = [
            |n| f64::from(n) / 30.0,
            |n| (f64::from(n) / 30.0 * 1e3).round() / 1e3,
            |n| (f64::from(n) / 30.0 * 600.0).round() / 600.0,
            |n| f64::from(n) * 1001.0 / 30000.0,
        ];
        for clock in clocks {
            assert_eq!(retimed(120.0, &(0..500).map(clock).collect::<Vec<_>>()), original);
        }
        // The film starts late, and frames are missing.
        let kept = |n: &i32| *n > 1 && ![5, 40, 41, 300].contains(n);
        let file: Vec<f64> = (0..500).filter(kept).map(|n| f64::from(n) / 30.0).collect();
        let expected: Vec<f64> = (0..500).filter(kept).map(|n| f64::from(n) / 120.0).collect();
        assert_eq!(retimed(120.0, &file), expected);
    }

    #[test]
    fn irregular_times_keep_their_proportions_and_grow() {
        let file: Vec<f64> = (0..300).map(|n| f64::from(n) / 30.0 + 0.012 * f64::from(n % 3)).collect();
        let times = retimed(120.0, &file);
        let scale = times[299] / file[299];
        for (time_s, file_s) in times.iter().zip(&file) {
            assert!((time_s - scale * file_s).abs() < 1.2e-3, "{time_s} s, in the file {file_s} s");
        }
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((scale - 0.25).abs() < 0.01, "a factor of {scale}");
    }

    #[test]
    fn a_single_frame_has_no_rate() {
        assert!(Retiming::new(120.0, &[0.0]).is_none());
        assert!(Retiming::new(120.0, &[]).is_none());
    }

    #[test]
    fn rates_are_named_as_cameras_have_them() {
        assert_eq!([119.88, 29.97, 72.04, 1001.0].map(super::usual_hz), [120.0, 30.0, 72.0, 1000.0]);
    }
}
