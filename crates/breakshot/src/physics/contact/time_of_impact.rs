//! What is known about the next contact of two moving bodies, and for how long does a gap stay open?

use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::Motion;

/// A body and its present motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MovingBody<'a> {
    pub(crate) body: &'a Body,
    pub(crate) motion: &'a Motion,
}

/// Two moving bodies, and the times between which their next contact is searched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ContactSearch<'a> {
    pub(crate) bodies: [MovingBody<'a>; 2],
    /// Start of the search (s).
    pub(crate) from_s: f64,
    /// End of the search (s); a later contact is only "not before".
    pub(crate) until_s: f64,
    /// A sustained contact is ignored until this time (s).
    pub(crate) ignored_until_s: f64,
}

/// What is known about the next contact of two bodies, as long as neither changes its motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TimeOfImpact {
    /// They never touch.
    Never,
    /// They touch at this time (s).
    At(f64),
    /// They do not touch before this time (s); the search has to go on from there.
    NotBefore(f64),
}

/// Gap at which two bodies touch (m): a fiftieth of the shortest wavelength of light.
pub(crate) const CONTACT_GAP_M: f64 = 1e-8;
/// Least gap in a time bound (m), so that discs that move together are not searched in infinitely short steps.
pub(super) const SMALLEST_GAP_M: f64 = 1e-9;
/// Approach speed below which a contact is sustained rather than an impact (m/s).
pub(crate) const SUSTAINED_CONTACT_M_S: f64 = 3e-3;
/// A sustained contact is ignored for at most this time (s): approaching at that speed and braked by friction and spin,
/// bodies penetrate each other by less than two micrometres in it.
pub(crate) const SUSTAINED_CONTACT_S: f64 = 4e-4;

/// For how long `gap + change t - deceleration t^2 / 2` is positive (s), for a positive gap.
pub(crate) fn safe_time_s(gap_m: f64, change_m_s: f64, deceleration_m_s2: f64) -> f64 {
    let square = change_m_s * change_m_s + 2.0 * deceleration_m_s2 * gap_m;
    if square < 0.0 {
        return f64::INFINITY;
    }
    let root = square.sqrt();
    if change_m_s > 0.0 {
        return if deceleration_m_s2 > 0.0 { (change_m_s + root) / deceleration_m_s2 } else { f64::INFINITY };
    }
    let below = root - change_m_s;
    if below > 0.0 { 2.0 * gap_m / below } else { f64::INFINITY }
}
