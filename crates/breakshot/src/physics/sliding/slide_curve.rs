//! How does a sliding and spinning body come to rest?
//!
//! Coulomb friction does not change when both speeds are scaled alike, so all slides of a shape are one curve, scaled.
//! With the rim's speed `w = R |omega|`, times in units of a scale l and speeds in units of `mu g l`,
//!
//! `dv/dt = -f(v/w)`,  `dw/dt = -t(v/w) / kappa`,  `kappa = (radius of gyration / R)^2`.
//!
//! Both speeds stop together (Weidman and Malhotra, Phys. Rev. Lett. 95, 264303 (2005)): every slide runs into the ray
//! with `f / eps = t / kappa`.  The curve is tabulated from that ray outwards, once towards pure sliding and once towards
//! pure spinning, over the time that remains.  A slide finds its place on it and reads way, turn and both speeds at any
//! time from the same polynomials.

use crate::physics::sliding::patch_friction::patch_force_and_torque;

/// All slides of bodies with one `kappa`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SlideCurve {
    /// Both decelerations on the final ray.
    ray: [f64; 2],
    /// The rim's deceleration of a body that spins in place.
    spin: f64,
    /// From the final ray towards pure sliding, and towards pure spinning.
    branches: [Branch; 2],
}

/// One side of the final ray, tabulated over the remaining time.
#[derive(Clone, Debug, Default, PartialEq)]
struct Branch {
    spans: Vec<Span>,
}

/// One interval of the remaining time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    /// Where it starts, and one over its length.
    start: f64,
    per_length: f64,
    /// `v / w` at its far end.
    eps: f64,
    /// Remaining way and remaining turn of the rim over the part of the span passed.
    way: [f64; 6],
    turn: [f64; 6],
}

/// Where on the curve a slide is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// So near pure sliding, pure spinning or the final ray that both speeds fall evenly, in this time.
    Even {
        /// Remaining time over the time unit in which speeds are given.
        remaining: f64,
    },
    /// On a branch.
    Curved {
        /// Which.
        branch: u8,
        /// Remaining time on the table.
        remaining: f64,
        /// The slide's own time unit over the table's.
        scale: f64,
    },
}

/// What remains of a slide.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Remainder {
    /// The way still to go.
    pub(crate) way: f64,
    /// The speed.
    pub(crate) speed: f64,
    /// The turn of the rim still to make.
    pub(crate) turn: f64,
    /// The rim's speed.
    pub(crate) rim_speed: f64,
}

/// Bounds of the decelerations, over mu g.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounds {
    /// Least and greatest deceleration.
    pub(crate) way: [f64; 2],
    /// Greatest deceleration of the rim.
    pub(crate) turn: f64,
}

/// The table's second derivatives are this good (relative).
const BOUND_SLACK: f64 = 1e-3;
/// Beyond it one speed is a thousandth of the other and bends nothing.
const EXTREME_EPS: f64 = 1e3;
/// How far from the final ray the table starts (relative); closer, the ray itself is as good.
const RAY_DEVIATION: f64 = 1e-4;
/// A slide this far down the table's first span runs on the ray (error: this part of [`RAY_DEVIATION`]).
const ON_THE_RAY: f64 = 0.25;
/// Each doubling of the remaining time is cut into four spans of equal length.
const SPANS_PER_OCTAVE: usize = 4;
/// Sixty octaves are eighteen decades, more than any support needs.
const MAX_SPANS: usize = 60 * SPANS_PER_OCTAVE;
/// Runge-Kutta steps a span: error below 1e-10.
const STEPS: usize = 4;

impl SlideCurve {
    /// The curve of bodies with `kappa`, their squared radius of gyration over the squared patch radius.
    pub(crate) fn new(kappa: f64) -> Self {
        let eps = final_eps(kappa);
        let [force, torque] = patch_force_and_torque(eps);
        let branches = [1.0, -1.0].map(|side| Branch::new(kappa, eps, side));
        Self { ray: [force, torque / kappa], spin: 2.0 / (3.0 * kappa), branches }
    }

    /// The rim's deceleration of a body that spins in place, the greatest there is.
    pub(crate) fn spin_deceleration(&self) -> f64 {
        self.spin
    }

    /// The place of a slide with speed `v` and rim speed `w`, not both zero.
    pub(crate) fn place(&self, v: f64, w: f64) -> Place {
        if v >= w * EXTREME_EPS {
            return Place::Even { remaining: v };
        }
        if w >= v * EXTREME_EPS {
            return Place::Even { remaining: w / self.spin };
        }
        let branch = usize::from(v * self.ray[1] < w * self.ray[0]);
        match self.branches[branch].remaining(v / w, branch == 1) {
            Some(remaining) => {
                let there = self.branches[branch].remainder(remaining);
                let scale = if v > w { v / there.speed } else { w / there.rim_speed };
                Place::Curved { branch: branch as u8, remaining, scale }
            }
            None => Place::Even { remaining: (v + w) / (self.ray[0] + self.ray[1]) },
        }
    }

    /// Bounds of both decelerations from a remaining time on: on either branch they only rise or only fall.
    pub(crate) fn bounds(&self, branch: u8, remaining: f64) -> Bounds {
        let span = self.branches[usize::from(branch)].span(remaining);
        let part = (remaining - span.start) * span.per_length;
        let square = span.per_length * span.per_length;
        let way = speed_and_change(&span.way, part)[1] * square;
        let turn = speed_and_change(&span.turn, part)[1] * square;
        Bounds {
            way: [way.min(self.ray[0]) * (1.0 - BOUND_SLACK), way.max(self.ray[0]) * (1.0 + BOUND_SLACK)],
            turn: turn.max(self.ray[1]) * (1.0 + BOUND_SLACK),
        }
    }

    /// The remaining time at which a way is left, below a time at which more is left.
    pub(crate) fn remaining_of_way(&self, branch: u8, left: f64, mut remaining: f64) -> f64 {
        // The way left is convex in the remaining time: Newton's method falls towards the root and never passes it.
        for _ in 0..2 * NEWTON_STEPS {
            let rest = self.remainder(branch, remaining);
            let step = (rest.way - left) / rest.speed;
            remaining -= step;
            if step <= PART_TOLERANCE * remaining {
                break;
            }
        }
        remaining
    }

    /// What remains of a slide, in the table's units.
    pub(crate) fn remainder(&self, branch: u8, remaining: f64) -> Remainder {
        self.branches[usize::from(branch)].remainder(remaining)
    }
}

/// A stretch of a slide on one span of the table, in the table's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stretch {
    /// Remaining time at its start and at its end.
    pub(crate) remaining: [f64; 2],
    /// The way still to go, as a polynomial in the time since its start.
    pub(crate) way: [f64; 6],
    /// The turn of the rim still to make, as a polynomial in the time since its start.
    pub(crate) turn: [f64; 6],
}

impl SlideCurve {
    /// The stretches of a slide between two remaining times, the first the larger.
    pub(crate) fn stretches(&self, branch: u8, from: f64, to: f64) -> Vec<Stretch> {
        let spans = &self.branches[usize::from(branch)].spans;
        let inside = |s: &&Span| s.start < from && s.start + 1.0 / s.per_length > to;
        spans.iter().filter(inside).rev().map(|s| s.stretch(from, to)).collect()
    }
}

/// The ratio `v / w` with which both speeds stop: zero for kappa above 2/3, infinite below 1/4.
fn final_eps(kappa: f64) -> f64 {
    // Positive where sliding dies out faster than spinning, so that eps falls.
    let excess = |eps: f64| {
        let [force, torque] = patch_force_and_torque(eps);
        kappa * force - torque * eps
    };
    if excess(1.0 / EXTREME_EPS) >= 0.0 {
        return 0.0;
    }
    if excess(EXTREME_EPS) <= 0.0 {
        return f64::INFINITY;
    }
    let (mut low, mut high) = (1.0 / EXTREME_EPS, EXTREME_EPS);
    // Each step halves the ratio of the bounds' logarithms: 60 leave nothing.
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// Speed, rim speed, way and turn over the matching powers of the remaining time.
type Ratios = [f64; 4];

impl Branch {
    fn new(kappa: f64, final_eps: f64, side: f64) -> Self {
        let Some(mut ratios) = first_ratios(kappa, final_eps, side) else { return Self::default() };
        let rate = |[a, b, x, y]: Ratios| {
            let [force, torque] = patch_force_and_torque(a / b);
            [force - a, torque / kappa - b, a - 2.0 * x, b - 2.0 * y]
        };
        let knot = |time: f64, [a, b, x, y]: Ratios| {
            let [force, torque] = patch_force_and_torque(a / b);
            let square = time * time;
            Knot { time, way: [x * square, a * time, force], turn: [y * square, b * time, torque / kappa] }
        };
        let origin = {
            let [force, torque] = patch_force_and_torque(final_eps);
            Knot { time: 0.0, way: [0.0, 0.0, force], turn: [0.0, 0.0, torque / kappa] }
        };
        let mut spans = Vec::new();
        let (mut from, mut to) = (origin, knot(1.0, ratios));
        loop {
            spans.push(Span::between(&from, &to));
            let eps = ratios[0] / ratios[1];
            if !(1.0 / EXTREME_EPS..=EXTREME_EPS).contains(&eps) || spans.len() == MAX_SPANS {
                return Self { spans };
            }
            let time = far_end(spans.len());
            let step = (time / to.time).ln() / STEPS as f64;
            for _ in 0..STEPS {
                ratios = runge_kutta(rate, ratios, step);
            }
            from = to;
            to = knot(time, ratios);
        }
    }

    /// The span that holds a remaining time: the first ends at 1, then each octave is cut evenly.
    fn span(&self, remaining: f64) -> &Span {
        if remaining < 1.0 {
            return &self.spans[0];
        }
        // Exponent and first two bits of the mantissa count the spans since 1.
        let count = (remaining.to_bits() - 1f64.to_bits()) >> 50;
        &self.spans[(1 + count as usize).min(self.spans.len() - 1)]
    }

    fn remainder(&self, remaining: f64) -> Remainder {
        let span = self.span(remaining);
        let part = (remaining - span.start) * span.per_length;
        let ([way, speed], [turn, rim_speed]) = (horner(&span.way, part), horner(&span.turn, part));
        Remainder { way, speed: speed * span.per_length, turn, rim_speed: rim_speed * span.per_length }
    }

    /// The remaining time at which `v / w` is `eps`; none so near the final ray that it makes no difference.
    fn remaining(&self, eps: f64, falling: bool) -> Option<f64> {
        let k = self.spans.partition_point(|s| if falling { s.eps > eps } else { s.eps < eps });
        let span = self.spans.get(k)?;
        let mut part = 0.5;
        for _ in 0..NEWTON_STEPS {
            let (v, w) = (speed_and_change(&span.way, part), speed_and_change(&span.turn, part));
            let step = (v[0] - eps * w[0]) / (v[1] - eps * w[1]);
            part = (part - step).clamp(0.0, 1.0);
            if step.abs() < PART_TOLERANCE {
                break;
            }
        }
        (k > 0 || part > ON_THE_RAY).then(|| span.start + part / span.per_length)
    }
}

/// Where span k ends.
fn far_end(k: usize) -> f64 {
    let (octave, quarter) = (k / SPANS_PER_OCTAVE, k % SPANS_PER_OCTAVE);
    (1.0 + quarter as f64 / SPANS_PER_OCTAVE as f64) * f64::from(octave as u32).exp2()
}

/// Newton's method doubles its digits each step; a span is nearly straight.
const NEWTON_STEPS: usize = 8;
/// Of a span.
const PART_TOLERANCE: f64 = 1e-15;

/// The branch's first point: a little off the final ray, in the direction in which slides leave it.
///
/// With `a = v / r` and `b = w / r` over the remaining time r, `da/dln r = f - a`, `db/dln r = t / kappa - b`; around
/// the ray the deviation grows along `(f', t' / kappa)` as `r^p`, `p + 1 = f' / b - a t' / (kappa b^2)`.
fn first_ratios(kappa: f64, final_eps: f64, side: f64) -> Option<Ratios> {
    let [force, torque] = patch_force_and_torque(final_eps);
    let (a, b) = (force, torque / kappa);
    if final_eps == 0.0 {
        // Spinning outlasts sliding: leave pure spinning with a little speed.
        let (power, small) = (1.0 / b - 1.0, b / EXTREME_EPS);
        return (side > 0.0).then(|| [small, b, small / (2.0 + power), b / 2.0]);
    }
    if final_eps == f64::INFINITY {
        // Sliding outlasts spinning: leave pure sliding with a little spin.
        let (power, small) = (0.25 / kappa - 1.0, a / EXTREME_EPS);
        return (side < 0.0).then(|| [a, small, a / 2.0, small / (2.0 + power)]);
    }
    let step = 1e-4 * final_eps;
    let (more, less) = (patch_force_and_torque(final_eps + step), patch_force_and_torque(final_eps - step));
    let slope = |k: usize| (more[k] - less[k]) / (2.0 * step);
    let (da, db) = (slope(0), slope(1) / kappa);
    let power = da / b - a * db / (b * b) - 1.0;
    let size = side * RAY_DEVIATION * final_eps / (power + 1.0);
    let (da, db) = (da * size, db * size);
    Some([a + da, b + db, a / 2.0 + da / (2.0 + power), b / 2.0 + db / (2.0 + power)])
}

fn runge_kutta(rate: impl Fn(Ratios) -> Ratios, at: Ratios, step: f64) -> Ratios {
    let moved = |by: Ratios, part: f64| std::array::from_fn(|k| at[k] + part * step * by[k]);
    let k1 = rate(at);
    let k2 = rate(moved(k1, 0.5));
    let k3 = rate(moved(k2, 0.5));
    let k4 = rate(moved(k3, 1.0));
    std::array::from_fn(|k| at[k] + step / 6.0 * (k1[k] + 2.0 * (k2[k] + k3[k]) + k4[k]))
}

/// Value, slope and second derivative of way and turn at one remaining time.
struct Knot {
    time: f64,
    way: [f64; 3],
    turn: [f64; 3],
}

impl Span {
    fn between(from: &Knot, to: &Knot) -> Self {
        let length = to.time - from.time;
        Self {
            start: from.time,
            per_length: 1.0 / length,
            eps: to.way[1] / to.turn[1],
            way: quintic(from.way, to.way, length),
            turn: quintic(from.turn, to.turn, length),
        }
    }
}

impl Span {
    fn stretch(&self, from: f64, to: f64) -> Stretch {
        let first = from.min(self.start + 1.0 / self.per_length);
        let part = (first - self.start) * self.per_length;
        Stretch {
            remaining: [first, to.max(self.start)],
            way: substituted(&self.way, part, -self.per_length),
            turn: substituted(&self.turn, part, -self.per_length),
        }
    }
}

/// The polynomial in y that another in x becomes with `x = at + factor y`.
fn substituted(c: &[f64; 6], at: f64, factor: f64) -> [f64; 6] {
    let mut shifted = *c;
    for low in 0..5 {
        for k in (low..5).rev() {
            shifted[k] += at * shifted[k + 1];
        }
    }
    let mut power = 1.0;
    shifted.map(|c| {
        let scaled = c * power;
        power *= factor;
        scaled
    })
}

/// The polynomial of degree five with given value, slope and second derivative at both ends of an interval.
fn quintic(from: [f64; 3], to: [f64; 3], length: f64) -> [f64; 6] {
    let [c0, c1, c2] = [from[0], from[1] * length, from[2] * length * length / 2.0];
    let value = to[0] - c0 - c1 - c2;
    let slope = to[1] * length - c1 - 2.0 * c2;
    let bend = to[2] * length * length - 2.0 * c2;
    [
        c0,
        c1,
        c2,
        10.0 * value - 4.0 * slope + bend / 2.0,
        -15.0 * value + 7.0 * slope - bend,
        6.0 * value - 3.0 * slope + bend / 2.0,
    ]
}

/// A polynomial and its derivative.
fn horner(c: &[f64; 6], x: f64) -> [f64; 2] {
    let value = c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5]))));
    [value, speed_and_change(c, x)[0]]
}

/// The first and second derivative of a polynomial.
fn speed_and_change(c: &[f64; 6], x: f64) -> [f64; 2] {
    let first = c[1] + x * (2.0 * c[2] + x * (3.0 * c[3] + x * (4.0 * c[4] + x * (5.0 * c[5]))));
    let second = 2.0 * c[2] + x * (6.0 * c[3] + x * (12.0 * c[4] + x * (20.0 * c[5])));
    [first, second]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Way over v^2/(2 mu g), time over v/(mu g) and turn times R over v^2/(mu g) of a slide that starts with `eps`.
    fn slide(kappa: f64, eps: f64) -> [f64; 3] {
        let curve = SlideCurve::new(kappa);
        match curve.place(1.0, 1.0 / eps) {
            Place::Even { remaining } => [remaining, remaining, 0.5 * remaining / eps],
            Place::Curved { branch, remaining, scale } => {
                let rest = curve.remainder(branch, remaining);
                [2.0 * rest.way * scale * scale, remaining * scale, rest.turn * scale * scale]
            }
        }
    }

    #[test]
    fn a_solid_disc_stops_where_the_literature_says() {
        for (eps, way, time, turn) in [
            (0.1, 8.629, 7.608, 37.9),
            (0.3, 3.020, 2.780, 4.54),
            (0.5, 1.967, 1.903, 1.87),
            (1.0, 1.275, 1.340, 0.724),
            (2.0, 1.065, 1.122, 0.343),
            (10.0, 1.0025, 1.009, 0.067),
        ] {
            let found = slide(0.5, eps);
            for (value, expected) in found.into_iter().zip([way, time, turn]) {
                assert!((value - expected).abs() < 5e-3 * expected, "eps {eps}: {found:?}");
            }
        }
    }

    #[test]
    fn a_solid_disc_stops_with_the_ratio_0_653002() {
        assert!((final_eps(0.5) - 0.653_002).abs() < 1e-6, "{}", final_eps(0.5));
        assert_eq!((final_eps(0.2), final_eps(0.7)), (f64::INFINITY, 0.0));
    }

    #[test]
    fn the_table_obeys_the_law_between_its_knots() {
        for kappa in [0.2, 0.3, 0.5, 0.6, 0.8] {
            for branch in SlideCurve::new(kappa).branches {
                // The first span ends within the deviation from the ray that it starts with.
                for span in branch.spans.into_iter().skip(1) {
                    for part in [0.2, 0.5, 0.8] {
                        let (way, turn) =
                            (speed_and_change(&span.way, part), speed_and_change(&span.turn, part));
                        let [force, torque] = patch_force_and_torque(way[0] / turn[0]);
                        let square = span.per_length * span.per_length;
                        let (df, dt) = (way[1] * square - force, turn[1] * square * kappa - torque);
                        assert!(
                            df.abs().max(dt.abs()) < 1.5e-4,
                            "kappa {kappa}, from {}: {df} {dt}",
                            span.start
                        );
                    }
                }
            }
        }
    }
}
