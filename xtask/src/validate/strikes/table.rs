//! What came of the strikes, by pile size.

use super::solvable::REPEATS;
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
    /// How many of ten disturbed repeats of the first robust strike worked.
    pub repeats: usize,
    /// Whether any strike works in most repeats.
    pub solvable: bool,
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
            None => "never".into(),
        };
        write!(
            f,
            "{} {} objects: robust {robust} (stated {:.2}; {} of {REPEATS} repeats), {}, paper {}, random {}",
            self.pile,
            self.size,
            self.stated,
            self.repeats,
            if self.solvable { "solvable" } else { "nothing reliable found" },
            word(self.paper),
            word(self.random)
        )
    }
}

/// Prints success rates by pile size, and how far the stated probability is from what happened.
pub(super) fn print(trials: &[Trial]) {
    println!(
        "\n| objects | piles | robust, one strike | within three | stated | disturbed repeats | robustly solvable \
         | robust on those | paper | random |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
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
        let repeats = of.iter().map(|t| t.repeats as f64).sum::<f64>() / of.len() as f64;
        let solvable = of.iter().filter(|t| t.solvable).count();
        let solved = of.iter().filter(|t| t.solvable && t.at_once()).count();
        println!(
            "| {label} | {} | {:.0} % | {:.0} % | {stated:.0} % | {:.0} % | {solvable} | {:.0} % | {:.0} % | {:.0} % |",
            of.len(),
            rate(&Trial::at_once),
            rate(&|t| t.strikes.is_some()),
            100.0 * repeats / REPEATS as f64,
            100.0 * solved as f64 / solvable.max(1) as f64,
            rate(&|t| t.paper),
            rate(&|t| t.random),
        );
    }
    println!("\nBrier score of the stated probability: {:.3} (wanted: at most 0.15)", brier(trials));
    for bin in bins(trials) {
        println!("stated {:.2}: {:.2} of {} piles", bin.stated, bin.observed, bin.count);
    }
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
