//! A line of a table: the quantity, its measured value and its target.

/// A result beside its target.
pub(crate) struct Row {
    pub(crate) what: String,
    pub(crate) figure: f64,
    pub(crate) target: Option<f64>,
    pub(crate) unit: &'static str,
    /// Whether the target is a lower limit, not an upper one.
    least: bool,
}

impl Row {
    /// A figure that must not exceed its target.
    pub(crate) fn at_most(what: impl Into<String>, figure: f64, target: f64, unit: &'static str) -> Self {
        Self { what: what.into(), figure, target: Some(target), unit, least: false }
    }

    /// A figure that must reach its target.
    pub(crate) fn at_least(what: impl Into<String>, figure: f64, target: f64, unit: &'static str) -> Self {
        Self { least: true, ..Self::at_most(what, figure, target, unit) }
    }

    /// A figure without a target.
    pub(crate) fn plain(what: impl Into<String>, figure: f64, unit: &'static str) -> Self {
        Self { what: what.into(), figure, target: None, unit, least: false }
    }

    /// Prints it as a line of a table; returns whether the target holds.
    pub(crate) fn print(&self) -> bool {
        let holds = self
            .target
            .is_none_or(|target| if self.least { self.figure >= target } else { self.figure <= target });
        let sign = if self.least { ">=" } else { "<=" };
        let target = self.target.map_or(String::new(), |t| format!("{sign} {t} {}", self.unit));
        let result = match (self.target, holds) {
            (None, _) => "",
            (_, true) => "holds",
            (_, false) => "MISSED",
        };
        println!(
            "| {:<62} | {:>10.4} {:<4} | {:<14} | {result:<6} |",
            self.what, self.figure, self.unit, target
        );
        holds
    }
}

/// Prints all rows; returns whether every target holds.
pub(crate) fn print_all(title: &str, rows: &[Row]) -> bool {
    println!("\n{title}");
    let missed = rows.iter().filter(|row| !row.print()).count();
    missed == 0
}

/// An error if some target was missed.
pub(crate) fn require(all_hold: bool) -> Result<(), String> {
    if all_hold { Ok(()) } else { Err("some targets were missed".into()) }
}

/// Root mean square; of nothing zero.
pub(crate) fn rms(values: &[f64]) -> f64 {
    (values.iter().fold(0.0, |sum, e| sum + e * e) / values.len().max(1) as f64).sqrt()
}

/// Mean and largest of absolute values.
pub(crate) fn mean_and_worst(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().map(|v| v.abs()).sum::<f64>() / values.len().max(1) as f64;
    (mean, values.iter().fold(0.0, |worst: f64, v| worst.max(v.abs())))
}

/// The middle of some values; not a number if there are none.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let (n, middle) = (values.len(), values.len() / 2);
    match n {
        0 => f64::NAN,
        _ if n % 2 == 1 => values[middle],
        _ => 0.5 * (values[middle - 1] + values[middle]),
    }
}
