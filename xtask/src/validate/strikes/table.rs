//! What came of the strikes, by pile size.

use super::solvable::{REPEATS, Reliable};
use std::fmt;

/// One pile, struck by each method.
#[derive(Clone, Debug, Default)]
pub(super) struct Trial {
    pub pile: String,
    /// How many objects.
    pub size: usize,
    /// The success probability that the robust plan stated.
    pub stated: f64,
    /// How many robust strikes it took, if they were enough.
    pub strikes: Option<usize>,
    /// Why the last robust strike was the last, if they were not enough.
    pub ended: &'static str,
    /// Whether the first robust strike, or any other, is reliable; none if that was not examined.
    pub reliable: Option<Reliable>,
    pub paper: bool,
    pub random: bool,
}

impl Trial {
    pub(super) fn at_once(&self) -> bool {
        self.strikes == Some(1)
    }
}

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = |works: bool| if works { "works" } else { "fails" };
        let robust = match self.strikes {
            Some(n) => format!("after {n}"),
            None => format!("never ({})", self.ended),
        };
        let Self { pile, size, stated, .. } = self;
        write!(f, "{pile} {size} objects: robust {robust} (stated {stated:.2})")?;
        if let Some(Reliable { repeats, solvable }) = self.reliable {
            let found = if solvable { "solvable" } else { "nothing reliable found" };
            write!(f, ", {repeats} of {REPEATS} repeats, {found}")?;
        }
        write!(f, ", paper {}, random {}", word(self.paper), word(self.random))
    }
}

/// Prints success rates by pile size, and how far the stated probability is from what happened.
pub(super) fn print(trials: &[Trial]) {
    println!("\n| objects | piles | robust, one strike | robust, within three | stated | paper | random |");
    println!("|---|---|---|---|---|---|---|");
    for (label, sizes) in [
        ("2", 2..=2),
        ("3", 3..=3),
        ("4", 4..=4),
        ("5", 5..=5),
        ("6", 6..=6),
        ("2 to 4", 2..=4),
        ("all", 2..=6),
    ] {
        let of: Vec<&Trial> = trials.iter().filter(|t| sizes.contains(&t.size)).collect();
        if of.is_empty() {
            continue;
        }
        let rate = |holds: &dyn Fn(&Trial) -> bool| {
            100.0 * of.iter().filter(|t| holds(t)).count() as f64 / of.len() as f64
        };
        let stated = 100.0 * of.iter().map(|t| t.stated).sum::<f64>() / of.len() as f64;
        println!(
            "| {label} | {} | {:.0} % | {:.0} % | {stated:.0} % | {:.0} % | {:.0} % |",
            of.len(),
            rate(&Trial::at_once),
            rate(&|t| t.strikes.is_some()),
            rate(&|t| t.paper),
            rate(&|t| t.random),
        );
    }
    print_reliable(trials);
    println!("\nBrier score of the stated probability: {:.3} (target: at most 0.06)", brier(trials));
    for bin in bins(trials) {
        println!("stated {:.2}: {:.2} of {} piles", bin.stated, bin.observed, bin.count);
    }
}

/// The number of piles with a reliable strike, and the success of the robust strike on those.
fn print_reliable(trials: &[Trial]) {
    let found: Vec<_> = trials.iter().filter_map(|t| Some((t, t.reliable?))).collect();
    if found.is_empty() {
        return;
    }
    let repeats: usize = found.iter().map(|(_, r)| r.repeats).sum();
    let solvable = found.iter().filter(|(_, r)| r.solvable).count();
    let solved = found.iter().filter(|(t, r)| r.solvable && t.at_once()).count();
    // Piles that nothing reliable is known of can only lower the rate if the robust strike failed on them.
    let failed = found.iter().filter(|(t, _)| !t.at_once()).count();
    let percent = |part: usize, whole: usize| 100.0 * part as f64 / whole.max(1) as f64;
    println!(
        "\nFound to be robustly solvable: {solvable} of {} piles; the robust strike works on {solved} of them ({:.0} %), on {:.0} % at least \
         if all {failed} on which it failed are solvable (wanted: 85 %), and in {:.0} % of its disturbed repeats on all piles",
        found.len(),
        percent(solved, solvable),
        percent(solved, solved + failed),
        percent(repeats, REPEATS as usize * found.len())
    );
}

/// The mean squared difference between what was stated and what happened.
fn brier(trials: &[Trial]) -> f64 {
    let error = |t: &Trial| t.stated - if t.at_once() { 1.0 } else { 0.0 };
    trials.iter().map(|t| error(t).powi(2)).sum::<f64>() / trials.len().max(1) as f64
}

/// Piles with nearly the same stated probability.
pub(super) struct Bin {
    pub stated: f64,
    pub observed: f64,
    pub count: usize,
}

/// Five bins of stated probability, empty ones left out.
pub(super) fn bins(trials: &[Trial]) -> Vec<Bin> {
    const COUNT: usize = 5;
    let of = |bin: usize| {
        let inside: Vec<&Trial> =
            trials.iter().filter(|t| ((t.stated * COUNT as f64) as usize).min(COUNT - 1) == bin).collect();
        let n = inside.len() as f64;
        (!inside.is_empty()).then(|| Bin {
            stated: inside.iter().map(|t| t.stated).sum::<f64>() / n,
            observed: inside.iter().filter(|t| t.at_once()).count() as f64 / n,
            count: inside.len(),
        })
    };
    (0..COUNT).filter_map(of).collect()
}
