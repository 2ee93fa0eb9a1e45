//! Axes with round tick values.

/// A mapping from a range of values to a range of pixels.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    pixels: [f64; 2],
    scale: Scale,
    /// The values with a grid line and a number.
    pub(super) ticks: Vec<f64>,
    decimals: usize,
}

/// The mapping from values to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths.
    Logarithmic,
}

impl Axis {
    /// An axis that covers all `values`, with about `count` ticks; values that are not finite (or not positive, on a
    /// logarithmic axis) are ignored.
    pub(super) fn new(values: &[f64], pixels: [f64; 2], count: usize, scale: Scale) -> Self {
        let usable = |v: &f64| v.is_finite() && (scale == Scale::Linear || *v > 0.0);
        let values: Vec<f64> = values.iter().copied().filter(usable).collect();
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // An axis of whole numbers has no ticks between them.
        let least_step = if values.iter().all(|v| v.fract() == 0.0) { 1.0 } else { 0.0 };
        match scale {
            _ if low > high => Self::linear([0.0, 1.0], 0.0, pixels, count),
            Scale::Linear => Self::linear([low, high], least_step, pixels, count),
            Scale::Logarithmic => Self::logarithmic(low, high, pixels),
        }
    }

    fn linear([low, high]: [f64; 2], least_step: f64, pixels: [f64; 2], count: usize) -> Self {
        // A single value needs a range around it.
        let room = match high.abs() {
            _ if high > low => 0.0,
            0.0 => 1.0,
            size => 0.5 * size,
        };
        let (low, high) = (low - room, high + room);
        let step = nice_step((high - low) / count as f64).max(least_step);
        let (first, last) = ((low / step + ROUNDING).floor(), (high / step - ROUNDING).ceil());
        let ticks = (0..=(last - first) as usize).map(|k| (first + k as f64) * step).collect();
        let decimals = (-step.log10()).ceil().clamp(0.0, 9.0) as usize;
        Self { low: first * step, high: last * step, pixels, scale: Scale::Linear, ticks, decimals }
    }

    fn logarithmic(low: f64, high: f64, pixels: [f64; 2]) -> Self {
        let digits: &[f64] = if high / low < MOST_RATIO_WITH_DIGITS { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let exponents = (low.log10().floor() as i32)..=(high.log10().ceil() as i32 + 1);
        let mut ticks: Vec<f64> = exponents
            .flat_map(|exponent| digits.iter().map(move |digit| digit * 10f64.powi(exponent)))
            .collect();
        // Keep the range from the last tick below all values to the first one above.
        let start = ticks.iter().rposition(|&t| t <= low * (1.0 + ROUNDING)).unwrap_or(0);
        ticks.drain(..start);
        let end = ticks.iter().position(|&t| t >= high * (1.0 - ROUNDING)).unwrap_or(ticks.len() - 1);
        ticks.truncate(end.max(1) + 1);
        Self {
            low: ticks[0],
            high: ticks[ticks.len() - 1],
            pixels,
            scale: Scale::Logarithmic,
            ticks,
            decimals: 0,
        }
    }

    /// The coordinate of a value (px).
    pub(super) fn px(&self, value: f64) -> f64 {
        let fraction = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        self.pixels[0] + fraction * (self.pixels[1] - self.pixels[0])
    }

    /// The text of a tick.
    pub(super) fn tick_text(&self, tick: f64) -> String {
        match self.scale {
            Scale::Linear => signed(&format!("{:.*}", self.decimals, tick + 0.0)),
            Scale::Logarithmic => format!("{}", (tick * 1e9).round() / 1e9),
        }
    }
}

/// A logarithmic axis with a larger ratio of its ends has ticks at powers of ten only, so that their texts do not overlap.
const MOST_RATIO_WITH_DIGITS: f64 = 3e3;
/// Relative tolerance for an end of the range that coincides with a tick.
const ROUNDING: f64 = 1e-9;

/// The number with a typographic minus sign instead of a hyphen, and without a sign before zero.
fn signed(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.into(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => number.into(),
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `step`.
fn nice_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|d| d * power >= step * (1.0 - ROUNDING)).unwrap_or(10.0);
    digit * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(values: &[f64], scale: Scale) -> Vec<String> {
        let axis = Axis::new(values, [0.0, 100.0], 5, scale);
        axis.ticks.iter().map(|&t| axis.tick_text(t)).collect()
    }

    #[test]
    fn ticks_are_round_numbers_that_enclose_the_values() {
        assert_eq!(texts(&[0.0, 0.93], Scale::Linear), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(
            texts(&[-113.0, 87.0], Scale::Linear),
            ["\u{2212}150", "\u{2212}100", "\u{2212}50", "0", "50", "100"]
        );
        assert_eq!(texts(&[0.056, 0.8], Scale::Logarithmic), ["0.05", "0.1", "0.2", "0.5", "1"]);
    }

    #[test]
    fn degenerate_values_still_give_an_axis() {
        for values in [&[][..], &[f64::NAN], &[3.0], &[0.0], &[0.0, f64::INFINITY], &[-1.0, -1.0], &[1e-300]]
        {
            for scale in [Scale::Linear, Scale::Logarithmic] {
                let axis = Axis::new(values, [0.0, 100.0], 5, scale);
                assert!(axis.px(axis.ticks[0]).is_finite() && axis.ticks.len() < 20, "{values:?}: {axis:?}");
            }
        }
    }

    #[test]
    fn equal_ratios_have_equal_lengths_on_a_logarithmic_axis() {
        let axis = Axis::new(&[0.1, 10.0], [0.0, 100.0], 5, Scale::Logarithmic);
        assert!((axis.px(1.0) - 50.0).abs() < 1e-9, "{} px", axis.px(1.0));
    }
}
