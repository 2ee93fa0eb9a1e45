//! Which assignment of columns to rows has the least total cost?

/// The column assigned to each row, each column at most once, of least total cost.
///
/// An infinite cost forbids a pair. As many rows as possible get a column; the others get `None`. Among assignments
/// of equal cost the result is always the same one.
pub(super) fn assignment(costs: &[Vec<f64>]) -> Vec<Option<usize>> {
    let rows = costs.len();
    let columns = costs.iter().map(Vec::len).max().unwrap_or(0);
    // One extra column per row means `None`; it costs more than any change of the other rows can save.
    let largest = costs.iter().flatten().filter(|c| c.is_finite()).fold(0.0_f64, |most, c| most.max(c.abs()));
    let unassigned = (largest + 1.0) * 4.0 * (rows + 1) as f64;
    let forbidden = unassigned * 4.0 * (rows + 1) as f64;
    let cost = |row: usize, column: usize| {
        if column >= columns {
            return if column - columns == row { unassigned } else { forbidden };
        }
        costs[row].get(column).copied().filter(|c| c.is_finite()).unwrap_or(forbidden)
    };
    let row_of = shortest_paths(rows, columns + rows, cost);
    let mut assigned = vec![None; rows];
    for (column, row) in row_of.into_iter().enumerate().take(columns) {
        if let Some(row) = row
            && cost(row, column) < forbidden
        {
            assigned[row] = Some(column);
        }
    }
    assigned
}

/// The row assigned to each column: Hungarian method by shortest augmenting paths (Jonker and Volgenant 1987).
fn shortest_paths(rows: usize, columns: usize, cost: impl Fn(usize, usize) -> f64) -> Vec<Option<usize>> {
    let mut row_of: Vec<Option<usize>> = vec![None; columns];
    let (mut row_price, mut column_price) = (vec![0.0; rows], vec![0.0; columns]);
    for start in 0..rows {
        let mut distance = vec![f64::INFINITY; columns];
        let mut predecessor: Vec<Option<usize>> = vec![None; columns];
        let mut done = vec![false; columns];
        let (mut row, mut last) = (start, None);
        let free = loop {
            let (mut step, mut next) = (f64::INFINITY, 0);
            for column in (0..columns).filter(|&c| !done[c]) {
                let reduced = cost(row, column) - row_price[row] - column_price[column];
                if reduced < distance[column] {
                    (distance[column], predecessor[column]) = (reduced, last);
                }
                if distance[column] < step {
                    (step, next) = (distance[column], column);
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
                    distance[column] -= step;
                }
            }
            done[next] = true;
            match row_of[next] {
                Some(assigned) => (row, last) = (assigned, Some(next)),
                None => break next,
            }
        };
        // Augment: along the path each column takes the row of its predecessor.
        let mut column = free;
        while let Some(before) = predecessor[column] {
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

    /// Reference implementation: the best of all assignments, first by the number of unassigned rows, then by cost.
    fn best_of_all(costs: &[Vec<f64>], row: usize, taken: &mut Vec<usize>) -> (usize, f64) {
        if row == costs.len() {
            return (0, 0.0);
        }
        let (unassigned, total) = best_of_all(costs, row + 1, taken);
        let mut best = (unassigned + 1, total);
        for column in 0..costs[row].len() {
            if costs[row][column].is_finite() && !taken.contains(&column) {
                taken.push(column);
                let (unassigned, total) = best_of_all(costs, row + 1, taken);
                taken.pop();
                let this = (unassigned, total + costs[row][column]);
                if this.0 < best.0 || (this.0 == best.0 && this.1 < best.1) {
                    best = this;
                }
            }
        }
        best
    }

    #[test]
    fn no_other_assignment_costs_less() {
        let mut rng = Pcg64Mcg::seed_from_u64(5);
        for trial in 0..400 {
            let (rows, columns) = (1 + trial % 5, trial % 6);
            let mut cost = || if rng.random_bool(0.25) { f64::INFINITY } else { rng.random_range(-3.0..9.0) };
            let costs: Vec<Vec<f64>> = (0..rows).map(|_| (0..columns).map(|_| cost()).collect()).collect();
            let assigned = assignment(&costs);
            let total: f64 =
                assigned.iter().enumerate().filter_map(|(row, c)| c.map(|c| costs[row][c])).sum();
            let unassigned = assigned.iter().filter(|c| c.is_none()).count();
            let (least_unassigned, least) = best_of_all(&costs, 0, &mut Vec::new());
            assert_eq!(unassigned, least_unassigned, "{costs:?} gave {assigned:?}");
            assert!((total - least).abs() < 1e-9, "{total}, not {least}: {costs:?} gave {assigned:?}");
        }
    }
}
