//! How is a motion written as polynomials of time?

use crate::geometry::Pose;
use crate::physics::output::trajectory::Segment;
use crate::physics::sliding::body::Body;
use crate::physics::sliding::motion::{Motion, SpeedLaw};
use crate::physics::sliding::slide_curve::CurvePiece;

/// The segments of a motion until a time (s).
pub(crate) fn segments(motion: &Motion, until_s: f64, body: &Body) -> Vec<Segment> {
    let end_s = until_s.min(motion.stop_s);
    let mut segments = match motion.law {
        SpeedLaw::Rest => Vec::new(),
        SpeedLaw::Uniform | SpeedLaw::Piece { .. } => uniform_segments(motion, end_s),
        SpeedLaw::Curved { branch, scale_s } => curve_segments(motion, end_s, branch, scale_s, body),
    };
    if until_s > end_s || segments.is_empty() {
        let Pose { position, yaw_rad } = motion.end;
        let (x_m, y_m, yaw_rad) = (vec![position.x], vec![position.y], vec![yaw_rad]);
        segments.push(Segment { start_s: end_s, end_s: until_s, x_m, y_m, yaw_rad });
    }
    segments
}

/// One segment for each span of the slide curve.
fn curve_segments(motion: &Motion, end_s: f64, branch: u8, scale_s: f64, body: &Body) -> Vec<Segment> {
    let remaining = |time_s: f64| (motion.stop_s - time_s) / scale_s;
    let unit_m = body.friction_deceleration_m_s2 * scale_s * scale_s;
    let unit_rad = unit_m.copysign(motion.yaw_rate_rad_s) / body.patch_radius_m;
    let pieces = body.curve.pieces(branch, remaining(motion.start_s), remaining(end_s));
    let segment = |s: &CurvePiece| {
        // Position = end - remaining distance, as polynomials of seconds.
        let polynomial = |end: f64, unit: f64, c: &[f64; 6]| {
            let mut per_power = -unit;
            let mut c = c.map(|c| {
                let scaled = c * per_power;
                per_power /= scale_s;
                scaled
            });
            c[0] += end;
            c.to_vec()
        };
        Segment {
            start_s: motion.stop_s - s.remaining[0] * scale_s,
            end_s: motion.stop_s - s.remaining[1] * scale_s,
            x_m: polynomial(motion.end.position.x, unit_m * motion.direction.x, &s.distance),
            y_m: polynomial(motion.end.position.y, unit_m * motion.direction.y, &s.distance),
            yaw_rad: polynomial(motion.end.yaw_rad, unit_rad, &s.rotation),
        }
    };
    pieces.iter().map(segment).collect()
}

/// One segment, or two if sliding and spinning stop at different times.
fn uniform_segments(motion: &Motion, end_s: f64) -> Vec<Segment> {
    let (deceleration, yaw_deceleration) = (motion.deceleration_m_s2[0], motion.yaw_deceleration_rad_s2);
    let stop = |speed: f64, deceleration: f64| {
        if deceleration > 0.0 { motion.start_s + speed / deceleration } else { motion.stop_s }
    };
    let slide_stop_s = stop(motion.speed_m_s, deceleration);
    let spin_stop_s = stop(motion.yaw_rate_rad_s.abs(), yaw_deceleration);
    let sign = 1.0f64.copysign(motion.yaw_rate_rad_s);
    let mut segments = Vec::new();
    let mut from_s = motion.start_s;
    for to_s in [slide_stop_s.min(spin_stop_s).min(end_s), end_s] {
        if to_s <= from_s {
            continue;
        }
        let (time, middle_s) = (from_s - motion.start_s, 0.5 * (from_s + to_s));
        let coefficients = |speed: f64, deceleration: f64, stop_s: f64| {
            if middle_s < stop_s {
                [time * (speed - 0.5 * deceleration * time), speed - deceleration * time, -0.5 * deceleration]
            } else {
                [if deceleration > 0.0 { 0.5 * speed * speed / deceleration } else { 0.0 }, 0.0, 0.0]
            }
        };
        let distance = coefficients(motion.speed_m_s, deceleration, slide_stop_s);
        let rotation = coefficients(motion.yaw_rate_rad_s.abs(), yaw_deceleration, spin_stop_s);
        let coordinate =
            |start: f64, along: f64, c: [f64; 3]| vec![start + along * c[0], along * c[1], along * c[2]];
        segments.push(Segment {
            start_s: from_s,
            end_s: to_s,
            x_m: coordinate(motion.start.position.x, motion.direction.x, distance),
            y_m: coordinate(motion.start.position.y, motion.direction.y, distance),
            yaw_rad: coordinate(motion.start.yaw_rad, sign, rotation),
        });
        from_s = to_s;
    }
    segments
}
