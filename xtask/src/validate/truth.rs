//! What the lab knows about its own films (`truth.json`): read for measuring, never for tuning.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// One folder of films.
#[derive(Clone, Deserialize)]
pub(crate) struct Truth {
    pub(crate) clips: BTreeMap<String, Clip>,
    pub(crate) mass_kg: BTreeMap<String, f64>,
    pub(crate) friction: BTreeMap<String, f64>,
    /// Contact friction between objects, and with the striker.
    pub(crate) surface_friction: Option<f64>,
    pub(crate) striker_friction: Option<f64>,
}

/// One film.
#[derive(Clone, Deserialize)]
pub(crate) struct Clip {
    /// x, y, yaw of each object before and after.
    #[serde(default)]
    pub(crate) start: BTreeMap<String, [f64; 3]>,
    #[serde(default, rename = "final")]
    pub(crate) last: BTreeMap<String, [f64; 3]>,
    /// x, y, yaw of each object at every frame.
    pub(crate) frames: BTreeMap<String, Vec<[f64; 3]>>,
    pub(crate) friction_scale: f64,
    pub(crate) measured: Measured,
}

#[derive(Clone, Deserialize)]
pub(crate) struct Measured {
    pub(crate) impacts: Vec<Impact>,
}

#[derive(Clone, Deserialize)]
pub(crate) struct Impact {
    pub(crate) pair: [String; 2],
    pub(crate) time_s: f64,
    pub(crate) single: bool,
    pub(crate) restitution: Option<f64>,
}

impl Truth {
    pub(crate) fn read(folder: &Path) -> Result<Self, String> {
        let path = folder.join("truth.json");
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Friction of each object: the mean over its clips of friction x the clip's scale.
    pub(crate) fn mean_friction(&self) -> BTreeMap<String, f64> {
        let mut scales: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for clip in self.clips.values() {
            let mut kinds: Vec<&str> = clip.frames.keys().map(|name| kind(name)).collect();
            kinds.dedup();
            for kind in kinds {
                scales.entry(kind.into()).or_default().push(self.friction[kind] * clip.friction_scale);
            }
        }
        means(scales)
    }

    /// Restitution of every pair, `a/b` or `a/striker`: the mean over all single impacts; bodies that still approach each other after
    /// one have not separated.
    pub(crate) fn mean_restitution(&self) -> BTreeMap<String, f64> {
        restitutions(self.clips.values().flat_map(|clip| &clip.measured.impacts))
    }

    /// The same over the first impact of every pair in each clip. Later ones are slower, and corners of bodies that spin meet in them.
    pub(crate) fn first_restitution(&self) -> BTreeMap<String, f64> {
        restitutions(self.clips.values().flat_map(Clip::first_impacts))
    }
}

impl Clip {
    /// The first impact of every pair.
    fn first_impacts(&self) -> Vec<&Impact> {
        let impacts = &self.measured.impacts;
        let is_first = |&(k, impact): &(usize, &Impact)| impacts[..k].iter().all(|i| i.pair != impact.pair);
        impacts.iter().enumerate().filter(is_first).map(|(_, impact)| impact).collect()
    }
}

/// Mean restitution of every pair over the single impacts after which its bodies part.
fn restitutions<'a>(impacts: impl Iterator<Item = &'a Impact>) -> BTreeMap<String, f64> {
    let mut values: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for impact in impacts {
        if let (true, Some(restitution @ 0.0..)) = (impact.single, impact.restitution) {
            let mut kinds = [kind(&impact.pair[0]), kind(&impact.pair[1])];
            // The striker is named last whatever the alphabet says.
            kinds.sort_by_key(|k| (*k == "striker", *k));
            values.entry(kinds.join("/")).or_default().push(restitution);
        }
    }
    means(values)
}

fn means(groups: BTreeMap<String, Vec<f64>>) -> BTreeMap<String, f64> {
    groups.into_iter().map(|(name, v)| (name, v.iter().sum::<f64>() / v.len() as f64)).collect()
}

fn kind(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}
