//! Can any strike fulfil the goal?  Bounds that are checked before a strike is simulated.

use crate::scene::Scene;

/// The reason why no arrangement of these objects in the workspace fulfils the goal; `None` if no bound excludes it.
pub(crate) fn impossible(scene: &Scene) -> Option<String> {
    too_wide(scene).or_else(|| too_many(scene))
}

/// An object without a feasible grasp.
fn too_wide(scene: &Scene) -> Option<String> {
    let gripper = scene.goal.gripper.as_ref()?;
    let never = |name: &str| scene.object(name).is_ok_and(|object| gripper.grasps(&object.shape).is_empty());
    let grasped = scene.placed.iter().map(|p| p.object.as_str()).filter(|name| scene.goal.asks_of(name));
    grasped.into_iter().find(|name| never(name)).map(|name| {
        let [opening_mm, clearance_mm] = [gripper.opening_m, gripper.clearance_m].map(|m| m * 1e3);
        format!(
            "{name} is wider in every direction than the gripper opens: {opening_mm:.1} mm, {clearance_mm:.1} mm of it room on each \
             side"
        )
    })
}

/// More objects than fit into the workspace at the required distances.
fn too_many(scene: &Scene) -> Option<String> {
    let goal = &scene.goal;
    // Around a target only two have to be apart.
    let count = if goal.target.is_some() { scene.placed.len().min(2) } else { scene.placed.len() };
    if !goal.inside_workspace || count < 2 {
        return None;
    }
    let size = scene.cell.workspace.max_m - scene.cell.workspace.min_m;
    let workspace = format!("the workspace of {:.0} x {:.0} mm", size.x * 1e3, size.y * 1e3);
    if count > most_points(size.x, size.y, goal.min_distance_m, count) {
        return Some(format!(
            "{count} centres at least {:.1} mm apart do not fit into {workspace}",
            goal.min_distance_m * 1e3
        ));
    }
    let most_m = greatest_mean_m(size.x, size.y, count);
    (goal.target.is_none() && goal.mean_distance_m[0] > most_m).then(|| {
        format!(
            "a mean distance of {:.1} mm is wanted, but {count} centres in {workspace} are at most {:.1} mm apart on average",
            goal.mean_distance_m[0] * 1e3,
            most_m * 1e3
        )
    })
}

/// An upper bound on the number of points in a rectangle with distances of at least `apart_m`; not tight above `count`.
///
/// The inequality of Oler (1961), with lengths in units of `apart_m`, and the pigeonhole principle: a cell with a diagonal below
/// `apart_m` contains at most one point.
fn most_points(width_m: f64, height_m: f64, apart_m: f64, count: usize) -> usize {
    if apart_m <= 0.0 {
        return usize::MAX;
    }
    let (width, height) = (width_m / apart_m, height_m / apart_m);
    let oler = (2.0 / 3f64.sqrt() * width * height + width + height + 1.0).floor() as usize;
    let cells = (1..=count).flat_map(|columns| (1..=count / columns).map(move |rows| (columns, rows)));
    let single =
        |&(columns, rows): &(usize, usize)| (width / columns as f64).hypot(height / rows as f64) < 1.0;
    let pigeonholes = cells.filter(single).map(|(columns, rows)| columns * rows).min();
    oler.min(pigeonholes.unwrap_or(usize::MAX))
}

/// The greatest mean distance between `count` points in a rectangle (m).
///
/// The sum of distances is convex in every point, hence some optimal arrangement has all points in the corners.
fn greatest_mean_m(width_m: f64, height_m: f64, count: usize) -> f64 {
    let diagonal_m = width_m.hypot(height_m);
    let mut greatest_m = 0f64;
    for a in 0..=count {
        for b in 0..=count - a {
            for c in 0..=count - a - b {
                // Number of points per corner, counter-clockwise.
                let [a, b, c, d] = [a, b, c, count - a - b - c].map(|n| n as f64);
                let sum_m =
                    width_m * (a * b + c * d) + height_m * (b * c + a * d) + diagonal_m * (a * c + b * d);
                greatest_m = greatest_m.max(sum_m);
            }
        }
    }
    greatest_m / (count * (count - 1) / 2) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_centres_fit_up_to_the_diagonal() {
        assert!(most_points(0.3, 0.4, 0.5, 2) >= 2);
        assert!(most_points(0.3, 0.4, 0.500_001, 2) < 2);
        assert!((greatest_mean_m(0.3, 0.4, 2) - 0.5).abs() < 1e-15);
    }

    #[test]
    fn the_bound_never_excludes_a_grid_or_a_triangular_lattice() {
        for (columns, rows) in [(2_u32, 2_u32), (3, 4), (5, 2), (7, 7)] {
            let (width_m, height_m) = (0.1 * f64::from(columns - 1), 0.1 * f64::from(rows - 1));
            let count = (columns * rows) as usize;
            let most = most_points(width_m + 1e-9, height_m + 1e-9, 0.1, count);
            assert!(most >= count, "{columns} x {rows}: {most}");
        }
        // Seven points: a hexagon and its centre.
        assert!(most_points(2.0, 3f64.sqrt() + 1e-9, 1.0, 7) >= 7);
    }

    #[test]
    fn three_points_do_not_fit_where_half_the_rectangle_is_too_small_for_two() {
        assert!(most_points(1.0, 0.8, 0.95, 3) < 3);
    }

    #[test]
    fn four_points_are_farthest_apart_in_the_corners() {
        let by_hand_m: f64 = (2.0 * 0.3 + 2.0 * 0.4 + 2.0 * 0.5) / 6.0;
        let two_and_two_m = 4.0 * 0.5 / 6.0;
        let greatest_m = greatest_mean_m(0.3, 0.4, 4);
        assert!((greatest_m - by_hand_m.max(two_and_two_m)).abs() < 1e-15, "{greatest_m} m");
    }
}
