//! How far along a path, how fast: jerk-limited motion from rest to rest.
//!
//! Speeding up is a jerk, an even acceleration and the opposite jerk; slowing down is its mirror image.  From rest to
//! rest the fastest such motion has a closed form, so no trajectory generator is needed.

/// What a motion along a path must not exceed, in the path's unit (m, or a share of a joint move).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// Per second.
    pub(crate) speed: f64,
    /// Per second squared.
    pub(crate) acceleration: f64,
    /// Per second cubed.
    pub(crate) jerk: f64,
}

/// Where a motion stands at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct State {
    pub(crate) position: f64,
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

/// A motion of even jerk in every piece.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Profile {
    /// How long each piece lasts (s), and its jerk.
    pieces: Vec<(f64, f64)>,
}

impl Limits {
    /// The path it takes to speed up from rest, or to stop again: half the time at full speed, by symmetry.
    pub(crate) fn ramp_length(&self) -> f64 {
        self.speed * self.ramp_time_s() / 2.0
    }

    /// How long a ramp takes (s).
    pub(crate) fn ramp_time_s(&self) -> f64 {
        let (rise_s, even_s) = self.ramp_times();
        2.0 * rise_s + even_s
    }

    /// How long the jerk and the even acceleration of a ramp last (s).
    fn ramp_times(&self) -> (f64, f64) {
        let rise_s = (self.acceleration / self.jerk).min((self.speed / self.jerk).sqrt());
        (rise_s, (self.speed / (self.jerk * rise_s) - rise_s).max(0.0))
    }
}

impl Profile {
    /// The fastest motion from rest to rest over `length`.
    pub(crate) fn rest_to_rest(length: f64, limits: &Limits) -> Self {
        let mut limits = *limits;
        if 2.0 * limits.ramp_length() > length {
            // Too short for the full speed: the ramp's length grows with the speed, so halving finds it.
            let (mut low, mut high) = (0.0, limits.speed);
            for _ in 0..HALVINGS {
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

    /// A ramp to full speed, the way `even` at that speed, a ramp to rest; both ramps with the same speed.
    pub(crate) fn stroke(up: &Limits, even: f64, down: &Limits) -> Self {
        let (rise_s, hold_s) = up.ramp_times();
        let (fall_s, brake_s) = down.ramp_times();
        let pieces = vec![
            (rise_s, up.jerk),
            (hold_s, 0.0),
            (rise_s, -up.jerk),
            (even.max(0.0) / up.speed, 0.0),
            (fall_s, -down.jerk),
            (brake_s, 0.0),
            (fall_s, down.jerk),
        ];
        Self { pieces }
    }

    /// How long it takes (s).
    pub(crate) fn duration_s(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.0).sum()
    }

    /// The state at a time; before the start and after the end it rests.
    pub(crate) fn at(&self, time_s: f64) -> State {
        let mut left_s = time_s.max(0.0);
        let mut state = State::default();
        for &(piece_s, jerk) in &self.pieces {
            let dt = left_s.min(piece_s);
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

/// Enough for the last bit of a speed.
const HALVINGS: u32 = 60;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Sums of a few hundred rounded terms.
    const TIGHT: f64 = 1e-9;

    proptest! {
        #[test]
        fn a_motion_keeps_its_limits_and_ends_at_rest_where_it_should(
            length in 0.001..2.0_f64, speed in 0.05..1.5_f64, acceleration in 0.5..20.0_f64, jerk in 5.0..500.0_f64,
        ) {
            let limits = Limits { speed, acceleration, jerk };
            let profile = Profile::rest_to_rest(length, &limits);
            let duration_s = profile.duration_s();
            for k in 0..=200 {
                let state = profile.at(duration_s * f64::from(k) / 200.0);
                prop_assert!(state.speed <= speed * (1.0 + TIGHT), "speed {} over {speed}", state.speed);
                prop_assert!(state.speed >= -TIGHT, "it turns back at {}", state.speed);
                prop_assert!(state.acceleration.abs() <= acceleration * (1.0 + TIGHT), "acceleration {}", state.acceleration);
            }
            let end = profile.at(duration_s - 1e-12);
            prop_assert!((end.position - length).abs() < 1e-8, "ends at {}, not {length}", end.position);
            prop_assert!(end.speed.abs() < 1e-6, "still moves at {}", end.speed);
        }
    }

    #[test]
    fn a_ramp_without_jerk_limit_is_half_v_squared_over_a() {
        let limits = Limits { speed: 1.0, acceleration: 4.0, jerk: 1e9 };
        assert!((limits.ramp_length() - 0.125).abs() < 1e-6, "{} m", limits.ramp_length());
    }

    #[test]
    fn the_speed_between_the_ramps_is_exactly_the_asked_one() {
        let up = Limits { speed: 0.6, acceleration: 5.0, jerk: 100.0 };
        let down = Limits { speed: 0.6, acceleration: 15.0, jerk: 900.0 };
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
