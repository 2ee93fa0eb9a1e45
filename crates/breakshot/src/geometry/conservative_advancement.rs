//! How far can something advance before it touches something else?
//!
//! Conservative advancement (Mirtich 1996): a lower bound of the free distance or time is a safe step.  Near the contact the
//! steps become as short as the gap, so a search never passes a contact.

/// The result of one look during an advancement.
pub(crate) enum Step<T> {
    /// Everything up to this distance or time is free: the search goes on from there.
    To(f64),
    /// The search ends with this answer.
    End(T),
}

/// Advances from `start` by safe steps until a look ends the search, for at most `most_steps` looks.
///
/// The distance or time that was reached is the error where the steps do not suffice.
pub(crate) fn advance<T>(
    start: f64,
    most_steps: usize,
    mut look: impl FnMut(f64) -> Step<T>,
) -> Result<T, f64> {
    let mut reached = start;
    for _ in 0..most_steps {
        match look(reached) {
            Step::To(next) => reached = next,
            Step::End(answer) => return Ok(answer),
        }
    }
    Err(reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_advance_by_the_gap_ends_at_the_contact() {
        // A point moves along x towards a circle of radius 1 m about (3 m, 0.6 m): contact at x = 3 - 0.8 m.
        let look = |x: f64| {
            let gap_m = (x - 3.0f64).hypot(0.6) - 1.0;
            if gap_m < 1e-12 { Step::End(x) } else { Step::To(x + gap_m) }
        };
        let contact_m = advance(0.0, 100, look).expect("a contact within 100 steps");
        assert!((contact_m - 2.2).abs() < 1e-11, "{contact_m} m");
        assert!(advance(0.0, 3, look).expect_err("too few steps") < 2.2, "metres");
    }
}
