//! What is the middle of a set of numbers, how widely do they scatter when some of them are outliers, and what is
//! their order?
//!
//! Two conventions of the median are in use, and they give different bits for an even number of values.

/// Standard deviation of a normal distribution over the median of its absolute values.
pub(crate) const STD_OVER_MEDIAN_ABSOLUTE: f64 = 1.4826;

/// The median; for an even number of values the mean of the two in the middle.  `None` without values.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len();
    (n > 0).then(|| f64::midpoint(sorted[(n - 1) / 2], sorted[n / 2]))
}

/// The median; for an even number of values the upper of the two in the middle.  `None` without values.
///
/// Always one of the values, and found without sorting all of them.
pub(crate) fn upper_median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The indices of the values in ascending order; equal values keep their order.
pub(crate) fn argsort(values: &[f64]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|&i, &k| values[i].total_cmp(&values[k]).then(i.cmp(&k)));
    order
}

/// The items in ascending order of a value; items of equal values keep their order.
///
/// All item types share the machine code of one sort, which a stable sort per type would multiply.
pub(crate) fn sorted_by_value<T>(items: Vec<T>, value: impl Fn(&T) -> f64) -> Vec<T> {
    let values: Vec<f64> = items.iter().map(value).collect();
    let mut items: Vec<Option<T>> = items.into_iter().map(Some).collect();
    argsort(&values).into_iter().filter_map(|k| items[k].take()).collect()
}

/// The standard normal distribution function, to 1e-7 (Abramowitz and Stegun 1964, 7.1.26).
pub(crate) fn normal_cdf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs() / std::f64::consts::SQRT_2);
    let series = t
        * (0.254_829_592
            + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let tail = 0.5 * series * (-0.5 * x * x).exp();
    if x < 0.0 { tail } else { 1.0 - tail }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_distribution_has_its_tabulated_values() {
        for (x, probability) in
            [(0.0, 0.5), (1.0, 0.841_344_746), (1.959_963_985, 0.975), (-3.0, 0.001_349_898)]
        {
            assert!((normal_cdf(x) - probability).abs() < 2e-7, "{x}");
        }
    }

    #[test]
    fn equal_values_keep_their_order() {
        let items = vec![(2.0, 'a'), (-1.0, 'b'), (2.0, 'c'), (0.0, 'd'), (-1.0, 'e')];
        let names = |sorted: Vec<(f64, char)>| sorted.into_iter().map(|(_, name)| name).collect::<String>();
        assert_eq!(names(sorted_by_value(items.clone(), |item| item.0)), "bedac");
        assert_eq!(names(sorted_by_value(items, |item| -item.0)), "acdbe");
        assert_eq!(argsort(&[]), Vec::<usize>::new());
    }

    #[test]
    fn the_two_medians_differ_for_an_even_number_of_values_only() {
        assert_eq!((median([3.0, 1.0, 2.0]), upper_median([3.0, 1.0, 2.0])), (Some(2.0), Some(2.0)));
        assert_eq!(
            (median([4.0, 1.0, 2.0, 3.0]), upper_median([4.0, 1.0, 2.0, 3.0])),
            (Some(2.5), Some(3.0))
        );
        assert_eq!((median([]), upper_median([])), (None, None));
    }
}
