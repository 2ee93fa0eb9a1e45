//! The outcome of a command.

/// The outcome of a command that returned no error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Outcome {
    /// Done.
    Done,
    /// Done, with warnings that the user should read.
    Doubtful,
    /// Not done: the robot cannot be reached or had to be stopped.
    Failed,
}

impl Outcome {
    /// Doubtful if the condition holds, otherwise done.
    pub(crate) fn doubtful_if(doubtful: bool) -> Self {
        if doubtful { Self::Doubtful } else { Self::Done }
    }

    /// The worse of the two.
    pub(crate) fn and(self, other: Self) -> Self {
        self.max(other)
    }
}
