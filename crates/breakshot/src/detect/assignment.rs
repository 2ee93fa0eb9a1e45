//! Who goes with whom at the least total cost?

/// For each row the column it is given, no column twice, so that the costs add up to the least.
///
/// A pair that cannot be is infinite; a row that can be given nothing goes without (and so does one for whose sake
/// others would have to).  Of equally good answers the one with the lower numbers, always the same.
pub(super) fn assignment(costs: &[Vec<f64>]) -> Vec<Option<usize>> {
    let rows = costs.len();
    let columns = costs.iter().map(Vec::len).max().unwrap_or(0);
    // One private column a row stands for going without: dearer than any change of the others can be.
    let largest = costs.iter().flatten().filter(|c| c.is_finite()).fold(0.0_f64, |most, c| most.max(c.abs()));
    let without = (largest + 1.0) * 4.0 * (rows + 1) as f64;
    let forbidden = without * 4.0 * (rows + 1) as f64;
    let cost = |row: usize, column: usize| {
        if column >= columns {
            return if column - columns == row { without } else { forbidden };
        }
        costs[row].get(column).copied().filter(|c| c.is_finite()).unwrap_or(forbidden)
    };
    let row_of = shortest_paths(rows, columns + rows, cost);
    let mut given = vec![None; rows];
    for (column, row) in row_of.into_iter().enumerate().take(columns) {
        if let Some(row) = row
            && cost(row, column) < forbidden
        {
            given[row] = Some(column);
        }
    }
    given
}

/// The Hungarian method by shortest augmenting paths (Jonker and Volgenant 1987): for each column its row.
fn shortest_paths(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<Option<usize>> {
    let mut row_of: Vec<Option<usize>> = vec![None; columns];
    let (mut row_price, mut column_price) = (vec![0.0; rows], vec![0.0; columns]);
    for start in 0..rows {
        let mut least = vec![f64::INFINITY; columns];
        let mut reached_from: Vec<Option<usize>> = vec![None; columns];
        let mut done = vec![false; columns];
        let (mut row, mut last) = (start, None);
        let free = loop {
            let (mut step, mut next) = (f64::INFINITY, 0);
            for column in (0..columns).filter(|&c| !done[c]) {
                let reduced = cost(row, column) - row_price[row] - column_price[column];
                if reduced < least[column] {
                    (least[column], reached_from[column]) = (reduced, last);
                }
                if least[column] < step {
                    (step, next) = (least[column], column);
                }
            }
            row_price[start] += step;
            for column in 0..columns {
                if done[column] {
                    column_price[column] -= step;
                    if let Some(row) = row_of[column] {
                        row_price[row] += step;
                    }
                } else {
                    least[column] -= step;
                }
            }
            done[next] = true;
            match row_of[next] {
                Some(taken_by) => (row, last) = (taken_by, Some(next)),
                None => break next,
            }
        };
        // Back along the path, each column takes the row of the one before it.
        let mut column = free;
        while let Some(before) = reached_from[column] {
            row_of[column] = row_of[before];
            column = before;
        }
        row_of[column] = Some(start);
    }
    row_of
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// The readable law: the best of all ways, going without as the last resort.
    fn best_of_all(costs: &[Vec<f64>], row: usize, taken: &mut Vec<usize>) -> (usize, f64) {
        if row == costs.len() {
            return (0, 0.0);
        }
        let (without, total) = best_of_all(costs, row + 1, taken);
        let mut best = (without + 1, total);
        for column in 0..costs[row].len() {
            if costs[row][column].is_finite() && !taken.contains(&column) {
                taken.push(column);
                let (without, total) = best_of_all(costs, row + 1, taken);
                taken.pop();
                let this = (without, total + costs[row][column]);
                if this.0 < best.0 || (this.0 == best.0 && this.1 < best.1) {
                    best = this;
                }
            }
        }
        best
    }

    #[test]
    fn no_other_way_of_giving_costs_less() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        for trial in 0..400 {
            let (rows, columns) = (1 + trial % 5, trial % 6);
            let mut cost = || if rng.random_bool(0.25) { f64::INFINITY } else { rng.random_range(-3.0..9.0) };
            let costs: Vec<Vec<f64>> = (0..rows).map(|_| (0..columns).map(|_| cost()).collect()).collect();
            let given = assignment(&costs);
            let total: f64 = given.iter().enumerate().filter_map(|(row, c)| c.map(|c| costs[row][c])).sum();
            let without = given.iter().filter(|c| c.is_none()).count();
            let (least_without, least) = best_of_all(&costs, 0, &mut Vec::new());
            assert_eq!(without, least_without, "{costs:?} gave {given:?}");
            assert!((total - least).abs() < 1e-9, "{total}, not {least}: {costs:?} gave {given:?}");
        }
    }
}
