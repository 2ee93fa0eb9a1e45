//! How is a map filled from pairs of key and value?

use std::collections::BTreeMap;

/// The map of these pairs; of equal keys the last counts.
///
/// `collect` sorts the pairs first, and a sort is compiled for every type of pair: inserting one by one is a third of the
/// machine code, and the project's maps have a few dozen entries.
pub(crate) fn map_of<K: Ord, V>(pairs: impl IntoIterator<Item = (K, V)>) -> BTreeMap<K, V> {
    let mut map = BTreeMap::new();
    map.extend(pairs);
    map
}
