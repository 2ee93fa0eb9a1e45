//! What do the widths of the tags say about the cell?

/// A relative difference between the widths of the tags and the distances of their centres is reported from here on: prints and rulers are better.
const LEAST_ERROR: f64 = 0.007;

/// That the tags are this many times as wide as `size_m` beside the distances of their centres, and what is wrong in the cell then; `None` if both
/// fit.
pub(crate) fn width_warning(ratio: f64) -> Option<String> {
    let error = ratio - 1.0;
    let (wider, large, small) =
        if error > 0.0 { ("wider", "large", "small") } else { ("narrower", "small", "large") };
    (error.abs() > LEAST_ERROR).then(|| {
        format!(
            "the tags are {:.1} % {wider} than size_m beside the distances of their centres: lengths on the table are as much too {large}, check \
             center_m of the tags; or size_m is too {small}",
            100.0 * error.abs()
        )
    })
}
