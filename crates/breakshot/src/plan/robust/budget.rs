//! How many strikes are evaluated, and in how many scenarios?

/// The extent of a plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Lines of the grid, each at all paces; more are thinned uniformly.
    pub lines: usize,
    /// Rounds of successive halving.
    pub rounds: &'static [Round],
    /// Distinct strikes that are varied.
    pub finalists: usize,
    /// The local search about the finalists.
    pub generations: &'static [Generation],
    /// Searches, each in a grid of its own; the next one begins only if the best strike so far fails too often.
    pub searches: u64,
    /// Fresh scenarios for the comparison of the best strikes, and again for the final evaluation.
    pub fresh: usize,
    /// Whether the winner's sensitivity to each source of uncertainty is measured.
    pub sensitivities: bool,
}

/// One round of successive halving.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// Strikes that take part.
    pub strikes: usize,
    /// Scenarios in which each has been evaluated after the round.
    pub samples: usize,
}

/// One generation of the local search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Generation {
    /// Strikes that are varied: the best ones of the generation before.
    pub strikes: usize,
    /// Variants of each.
    pub variants: usize,
    /// Scenarios in which each variant is evaluated.
    pub samples: usize,
}

impl Budget {
    /// About twenty thousand rollouts a search.
    pub(crate) const FULL: Self = Self {
        lines: 160,
        rounds: &[
            Round { strikes: 1600, samples: 1 },
            Round { strikes: 480, samples: 3 },
            Round { strikes: 160, samples: 8 },
            Round { strikes: 80, samples: 24 },
        ],
        finalists: 30,
        generations: &[
            Generation { strikes: 30, variants: 6, samples: 16 },
            Generation { strikes: 15, variants: 8, samples: 24 },
            Generation { strikes: 8, variants: 10, samples: 48 },
            Generation { strikes: 4, variants: 10, samples: 64 },
            Generation { strikes: 2, variants: 10, samples: 96 },
        ],
        searches: 8,
        fresh: 400,
        sensitivities: true,
    };

    /// A tenth of the rollouts of one search, to compare scenes with each other.
    pub(crate) const SHORT: Self = Self {
        lines: 70,
        rounds: &[
            Round { strikes: 700, samples: 1 },
            Round { strikes: 120, samples: 3 },
            Round { strikes: 40, samples: 8 },
            Round { strikes: 12, samples: 20 },
            Round { strikes: 6, samples: 32 },
        ],
        finalists: 2,
        generations: &[Generation { strikes: 2, variants: 6, samples: 24 }; 2],
        searches: 1,
        fresh: 100,
        sensitivities: false,
    };

    /// Scenarios of the search.
    pub(super) fn samples(&self) -> usize {
        let of_rounds = self.rounds.iter().map(|round| round.samples);
        of_rounds.chain(self.generations.iter().map(|generation| generation.samples)).max().unwrap_or(1)
    }
}
