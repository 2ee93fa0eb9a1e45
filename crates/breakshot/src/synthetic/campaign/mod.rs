//! Which tracks would the detector give if the true properties were these?
//!
//! Random objects, frictions and restitutions from a seed; the cases of the paper (the striker against each object, and each
//! pair); and the tracks of every clip.  Motion and impacts follow an integrator of this module (`world`, `body`,
//! `impact`), which has no code in common with the estimator; `observation` adds exposure, noise, a video codec and hidden markers.
//! Tests, benchmarks and `cargo xtask validate estimate` compare estimates with the truth of such campaigns.

mod body;
mod clip;
mod impact;
mod observation;
mod spec;
mod support;
mod truth;
mod world;

pub use spec::CampaignSpec;
pub use truth::Truth;

use crate::cell::{Cell, Striker, Workspace};
use crate::estimate::ClipTracks;
use crate::object::{Object, Shape};
use clip::Subject;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// A synthetic campaign: the input of an estimate, and the truth that it should find.
#[derive(Clone, Debug, PartialEq)]
pub struct SyntheticCampaign {
    /// The cell: striker and camera; the exposure time is left for the estimator to find.
    pub cell: Cell,
    /// The objects: outlines, heights and markers.
    pub objects: Vec<Object>,
    /// The clips.
    pub clips: Vec<ClipTracks>,
    /// The true properties.
    pub truth: Truth,
}

/// The synthetic campaign of a specification and a seed; equal arguments give equal campaigns.
///
/// ```
/// use breakshot::estimate::{Options, estimation};
/// use breakshot::synthetic::campaign::{CampaignSpec, campaign};
///
/// let spec = CampaignSpec { objects: 2, clips_per_case: 2, ..CampaignSpec::default() };
/// let drawn = campaign(&spec, 1);
/// let found = estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default())?;
/// let friction = found.properties.friction("a")?;
/// assert!((friction.mean / drawn.truth.friction["a"] - 1.0).abs() < 0.1, "friction within 10 %, no unit");
/// # Ok::<(), breakshot::Error>(())
/// ```
pub fn campaign(spec: &CampaignSpec, seed: u64) -> SyntheticCampaign {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let objects: Vec<Object> = (0..spec.objects).map(|k| truth::object(k, spec, &mut random)).collect();
    let model = truth::model(&objects, spec, &mut random);
    let subject = Subject { objects: &objects, model: &model, spec };
    let mut clips = Vec::new();
    for case in cases(&objects, &mut random) {
        for n in 0..spec.clips_per_case {
            let names: Vec<&str> = case.iter().map(|&k| objects[k].name.as_str()).collect();
            let name = format!("{}_{}.mp4", names.join("_"), n + 1);
            clips.push(subject.clip(name, &case, &mut random));
        }
    }
    SyntheticCampaign { cell: cell(), objects, clips, truth: model.truth }
}

/// The objects of every case, by index, the struck one first: each object alone, the first one and its copy, and each pair.
///
/// Pairs of squares are left out, because flat sides that meet have no single restitution.
fn cases(objects: &[Object], random: &mut Pcg64Mcg) -> Vec<Vec<usize>> {
    let is_square = |k: usize| !matches!(objects[k].shape, Shape::Disc { .. });
    let mut cases: Vec<Vec<usize>> = (0..objects.len()).map(|k| vec![k]).collect();
    for i in 0..objects.len() {
        for j in i..objects.len() {
            if (i != j || i == 0) && !(is_square(i) && is_square(j)) {
                cases.push(if random.random_bool(0.5) { vec![i, j] } else { vec![j, i] });
            }
        }
    }
    cases
}

/// The cell of every synthetic campaign: a small round striker, and a camera of unknown exposure that looks straight down.
pub fn cell() -> Cell {
    let striker = Striker {
        retract_speed_m_s: world::RETRACT_M_S,
        ..Striker::rod(world::STRIKER_RADIUS_M, [0.1, 1.0])
    };
    Cell::from_above(2000.0, Workspace::centred([2.0, 2.0]), striker)
}
