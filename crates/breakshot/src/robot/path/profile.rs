//! Distance along a path over time: jerk-limited motion from rest to rest (seven-segment or S-curve profile).
//!
//! A ramp consists of a constant jerk, a constant acceleration and the opposite jerk; deceleration is its mirror image. The
//! fastest such motion from rest to rest has a closed form up to its peak speed, so no trajectory generator is needed.

/// Limits of a motion along a path, in the path's unit (m, or the fraction of a joint-space motion).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProfileLimits {
    /// Largest speed (unit/s).
    pub(crate) speed: f64,
    /// Largest acceleration (unit/s2).
    pub(crate) acceleration: f64,
    /// Largest jerk (unit/s3).
    pub(crate) jerk: f64,
}

/// Position, speed and acceleration along the path at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct State {
    pub(crate) position: f64,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

/// A motion with piecewise constant jerk.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Profile {
    /// Duration (s) and jerk of each segment.
    segments: Vec<(f64, f64)>,
}

impl ProfileLimits {
    /// The length of a ramp between rest and full speed: by symmetry, its duration times half the full speed.
    pub(crate) fn ramp_length(&self) -> f64 {
        self.speed * self.ramp_time_s() / 2.0
    }

    /// The duration of a ramp (s).
    pub(crate) fn ramp_time_s(&self) -> f64 {
        let (jerk_s, constant_s) = self.ramp_times();
        2.0 * jerk_s + constant_s
    }

    /// The durations of the constant jerk and of the constant acceleration in a ramp (s).
    fn ramp_times(&self) -> (f64, f64) {
        let rise_s = (self.acceleration / self.jerk).min((self.speed / self.jerk).sqrt());
        (rise_s, (self.speed / (self.jerk * rise_s) - rise_s).max(0.0))
    }
}

impl Profile {
    /// The fastest motion from rest to rest over `length`.
    pub(crate) fn rest_to_rest(length: f64, limits: &ProfileLimits) -> Self {
        let mut limits = *limits;
        if 2.0 * limits.ramp_length() > length {
            // Too short for the full speed. The ramp's length increases with its peak speed: bisection finds the peak speed.
            let (mut low, mut high) = (0.0, limits.speed);
            for _ in 0..BISECTIONS {
                limits.speed = f64::midpoint(low, high);
                if 2.0 * limits.ramp_length() > length {
                    high = limits.speed;
                } else {
                    low = limits.speed;
                }
            }
            limits.speed = low.max(f64::MIN_POSITIVE);
        }
        Self::stroke(&limits, length - 2.0 * limits.ramp_length(), &limits)
    }

    /// A ramp to full speed, the distance `cruise` at constant speed, and a ramp to rest. Both ramps have the same speed.
    pub(crate) fn stroke(run_up: &ProfileLimits, cruise: f64, stop: &ProfileLimits) -> Self {
        let (rise_s, hold_s) = run_up.ramp_times();
        let (fall_s, brake_s) = stop.ramp_times();
        let segments = vec![
            (rise_s, run_up.jerk),
            (hold_s, 0.0),
            (rise_s, -run_up.jerk),
            (cruise.max(0.0) / run_up.speed, 0.0),
            (fall_s, -stop.jerk),
            (brake_s, 0.0),
            (fall_s, stop.jerk),
        ];
        Self { segments }
    }

    /// The duration (s).
    pub(crate) fn duration_s(&self) -> f64 {
        self.segments.iter().map(|segment| segment.0).sum()
    }

    /// The state at a time (s); at rest before the start and after the end.
    pub(crate) fn at(&self, time_s: f64) -> State {
        let mut left_s = time_s.max(0.0);
        let mut state = State::default();
        for &(segment_s, jerk) in &self.segments {
            let dt = left_s.min(segment_s);
            state = State {
                position: state.position
                    + dt * (state.speed + dt * (state.acceleration / 2.0 + dt * jerk / 6.0)),
                speed: state.speed + dt * (state.acceleration + dt * jerk / 2.0),
                acceleration: state.acceleration + dt * jerk,
            };
            left_s -= dt;
            if left_s <= 0.0 {
                return state;
            }
        }
        State { speed: 0.0, acceleration: 0.0, ..state }
    }
}

/// Number of bisections, enough for the last bit of a speed.
const BISECTIONS: u32 = 60;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Rounding error of a few hundred summed terms.
    const TIGHT: f64 = 1e-9;

    proptest! {
        #[test]
        fn a_motion_keeps_its_limits_and_ends_at_rest_at_its_length(
            length in 0.001..2.0_f64, speed in 0.05..1.5_f64, acceleration in 0.5..20.0_f64, jerk in 5.0..500.0_f64,
        ) {
            let limits = ProfileLimits { speed, acceleration, jerk };
            let profile = Profile::rest_to_rest(length, &limits);
            let duration_s = profile.duration_s();
            for k in 0..=200 {
                let state = profile.at(duration_s * f64::from(k) / 200.0);
                prop_assert!(state.speed <= speed * (1.0 + TIGHT), "speed {} over {speed}", state.speed);
                prop_assert!(state.speed >= -TIGHT, "it reverses at {}", state.speed);
                prop_assert!(state.acceleration.abs() <= acceleration * (1.0 + TIGHT), "acceleration {}", state.acceleration);
            }
            let end = profile.at(duration_s - 1e-12);
            prop_assert!((end.position - length).abs() < 1e-8, "ends at {}, not {length}", end.position);
            prop_assert!(end.speed.abs() < 1e-6, "still moves at {}", end.speed);
        }
    }

    #[test]
    fn a_ramp_without_jerk_limit_is_half_v_squared_over_a() {
        let limits = ProfileLimits { speed: 1.0, acceleration: 4.0, jerk: 1e9 };
        assert!((limits.ramp_length() - 0.125).abs() < 1e-6, "{} m", limits.ramp_length());
    }

    #[test]
    fn the_speed_between_the_ramps_is_exactly_the_requested_one() {
        let up = ProfileLimits { speed: 0.6, acceleration: 5.0, jerk: 100.0 };
        let down = ProfileLimits { speed: 0.6, acceleration: 15.0, jerk: 900.0 };
        let profile = Profile::stroke(&up, 0.03, &down);
        let up_s = 0.6 / 5.0 + 5.0 / 100.0;
        let middle = profile.at(up_s + 0.025);
        let at_m = up.ramp_length() + 0.015;
        assert!((middle.position - at_m).abs() < TIGHT, "{} m, not {at_m} m", middle.position);
        assert!((middle.speed - 0.6).abs() < TIGHT, "{} m/s", middle.speed);
        let end_m = up.ramp_length() + 0.03 + down.ramp_length();
        let end = profile.at(9.0);
        assert!((end.position - end_m).abs() < TIGHT, "ends at {} m, not {end_m} m", end.position);
    }
}
