//! The numbers that quantities can have: no product of a few of them overflows, and no search over them lasts without end.

use super::{Error, Result};
use std::ops::RangeInclusive;

/// The values of a positive quantity, in SI units or pixels.
const POSITIVE: RangeInclusive<f64> = 1e-12..=1e12;
/// The longest length and the largest coordinate (m).
const LARGEST_M: f64 = 1000.0;
/// The largest angle (rad): the direction of a larger one would be rounded.
const LARGEST_RAD: f64 = 1e6;
/// The frame rates of cameras (Hz): from a frame in a minute to a million in a second.
const FRAME_RATES_HZ: RangeInclusive<f64> = 0.01..=1e6;
/// The speeds of a striker (m/s): twice the break of a billiard player at most.
const STRIKE_SPEEDS_M_S: RangeInclusive<f64> = 1e-4..=20.0;

/// Checks that a value is a positive number; errors name `owner`, as those of all checks here.
///
/// # Errors
/// NaN, zero or a negative number, a number of an impossible size.
pub fn positive(owner: &str, what: &str, value: f64) -> Result<()> {
    if POSITIVE.contains(&value) {
        return Ok(());
    }
    let needed = if value.is_finite() && value > 0.0 {
        format!("from {:e} to {:e}", POSITIVE.start(), POSITIVE.end())
    } else {
        "a positive number".into()
    };
    Err(Error::invalid(owner, what, value, needed))
}

/// Checks that a value is a non-negative number, in the given unit.
///
/// # Errors
/// NaN, a negative number, a number of an impossible size.
pub(crate) fn zero_or_more(owner: &str, what: &str, value: f64, unit: &str) -> Result<()> {
    if (0.0..=*POSITIVE.end()).contains(&value) {
        return Ok(());
    }
    Err(Error::invalid(owner, what, value, format!("zero or more {unit}").trim_end()))
}

/// Checks that a value is a length (m).
///
/// # Errors
/// See [`positive`]; also a length longer than any table.
pub(crate) fn length(owner: &str, what: &str, value_m: f64) -> Result<()> {
    positive(owner, what, value_m)?;
    if value_m > LARGEST_M {
        return Err(Error::invalid(owner, what, value_m, format!("at most {LARGEST_M} m")));
    }
    Ok(())
}

/// Checks that values are coordinates (m).
///
/// # Errors
/// A value that is not finite, or farther away than any table reaches.
pub(crate) fn position(owner: &str, what: &str, coordinates_m: &[f64]) -> Result<()> {
    match coordinates_m.iter().find(|value| !(-LARGEST_M..=LARGEST_M).contains(*value)) {
        None => Ok(()),
        Some(value) if value.is_finite() => {
            Err(Error::invalid(owner, what, value, format!("from -{LARGEST_M} to {LARGEST_M} m")))
        }
        Some(_) => Err(Error::invalid(owner, what, "not a number", "numbers in m")),
    }
}

/// Checks that a value is an angle (rad).
///
/// # Errors
/// A value that is not finite, or larger than 1e6.
pub fn angle(owner: &str, what: &str, value_rad: f64) -> Result<()> {
    if value_rad.abs() <= LARGEST_RAD {
        return Ok(());
    }
    let found = if value_rad.is_finite() { value_rad.to_string() } else { "not a number".into() };
    Err(Error::invalid(owner, what, found, format!("an angle in rad, at most {LARGEST_RAD:e}")))
}

/// Checks that a value is the frame rate of a camera (Hz).
///
/// # Errors
/// A number that is not the rate of a camera.
pub fn frame_rate(owner: &str, what: &str, value_hz: f64) -> Result<()> {
    within(owner, what, value_hz, (FRAME_RATES_HZ, "Hz"))
}

/// Checks that a value is a speed of a striker (m/s).
///
/// # Errors
/// A number that is not the speed of a striker.
pub(crate) fn strike_speed(owner: &str, what: &str, value_m_s: f64) -> Result<()> {
    within(owner, what, value_m_s, (STRIKE_SPEEDS_M_S, "m/s"))
}

/// Checks that a positive value lies in a range, in the given unit.
fn within(owner: &str, what: &str, value: f64, (range, unit): (RangeInclusive<f64>, &str)) -> Result<()> {
    positive(owner, what, value)?;
    if range.contains(&value) {
        return Ok(());
    }
    Err(Error::invalid(owner, what, value, format!("from {} to {} {unit}", range.start(), range.end())))
}
