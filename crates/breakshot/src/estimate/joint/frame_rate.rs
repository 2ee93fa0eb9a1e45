//! Do the files of the films say the rate at which these were taken?
//!
//! The striker does not yield: after its impact an object of restitution e is 1 + e times as fast as the given speed of the
//! striker, along the normal. Where objects come out slower or faster than any restitution allows, and a plain factor between the
//! rates explains all of them, the films were probably taken at that rate.

use crate::estimate::clip_tracks::ClipTracks;
use crate::estimate::measure::ClipMeasurements;
use crate::estimate::measure::quantity::Quantity;
use crate::retiming::{is_same_rate, usual_hz};
use crate::statistics::median;
use crate::warning::{Cause, Warning};
use std::collections::BTreeMap;

/// Factors between the true rate and that of the file, the likeliest first. Of the powers of two about one fits any speed.
const FACTORS: [f64; 14] =
    [2.0, 4.0, 8.0, 16.0, 0.5, 0.25, 0.125, 6.0 / 5.0, 5.0 / 6.0, 5.0 / 4.0, 4.0 / 5.0, 3.0, 1.0 / 3.0, 10.0];
/// A speed is impossible if it is outside the range by this much, in speeds of the striker, and by so many standard deviations.
const MARGIN: f64 = 0.05;
const MARGIN_STDS: f64 = 4.0;
/// Number of clips that a warning needs.
const CLIPS_NEEDED: usize = 2;

/// The speed of an object after the striker's impact over that of the striker, in each of its clips.
#[derive(Default)]
struct SpeedRatios {
    ratios: Vec<f64>,
    stds: Vec<f64>,
}

impl SpeedRatios {
    /// Whether a rate that is higher by this factor makes the median possible.
    fn is_possible(&self, factor: f64) -> bool {
        let (ratio, std) = (median(self.ratios.iter().copied()), median(self.stds.iter().copied()));
        let (ratio, std) = (factor * ratio.unwrap_or(1.0), factor * std.unwrap_or(0.0));
        let margin = MARGIN.max(MARGIN_STDS * std);
        (1.0 - margin..=2.0 + margin).contains(&ratio)
    }
}

/// The clips of one frame rate.
struct RateGroup<'a> {
    rate_hz: f64,
    objects: BTreeMap<&'a str, SpeedRatios>,
    clips: Vec<&'a str>,
}

/// A warning for each frame rate of the clips that is probably not the true one, with the likely one.
pub(crate) fn warnings(measured: &[ClipMeasurements], clips: &[ClipTracks]) -> Vec<Warning> {
    let mut groups: Vec<RateGroup> = Vec::new();
    for (clip, tracks) in measured.iter().zip(clips) {
        // A striker that is seen is the better evidence, and is compared with the given strike.
        if tracks.tracks.striker.is_some() {
            continue;
        }
        let Some(rate_hz) = tracks.frame_rate_hz() else { continue };
        let struck =
            (0..clip.measurements.quantities.len()).filter_map(|k| match &clip.measurements.quantities[k] {
                Quantity::StrikerRestitution(object) => {
                    Some((object.as_str(), clip.measurements.measured(k)))
                }
                _ => None,
            });
        for (object, restitution) in struck {
            let known = groups.iter().position(|group| is_same_rate(rate_hz, group.rate_hz));
            let number = known.unwrap_or_else(|| {
                groups.push(RateGroup { rate_hz, objects: BTreeMap::new(), clips: Vec::new() });
                groups.len() - 1
            });
            let group = &mut groups[number];
            let of_object = group.objects.entry(object).or_default();
            of_object.ratios.push(1.0 + restitution.value);
            of_object.stds.push(restitution.std);
            group.clips.push(&clip.name);
        }
    }
    groups.iter().filter_map(warning).map(|text| Warning::new(Cause::FrameRate, text)).collect()
}

fn warning(RateGroup { rate_hz, objects, clips }: &RateGroup) -> Option<String> {
    let impossible = objects.values().filter(|ratios| !ratios.is_possible(1.0)).count();
    if clips.len() < CLIPS_NEEDED || 2 * impossible < objects.len() || impossible == 0 {
        return None;
    }
    let factor = FACTORS.iter().find(|factor| objects.values().all(|ratios| ratios.is_possible(**factor)))?;
    let likely_hz = usual_hz(rate_hz * factor);
    let all = objects.values().flat_map(|ratios| &ratios.ratios);
    let (least, most) = all.fold((f64::INFINITY, 0.0_f64), |(low, high), r| (low.min(*r), high.max(*r)));
    let (count, first) = (clips.len(), clips[0]);
    Some(format!(
        "in {count} clips (`{first}` ..) struck objects are {least:.2} to {most:.2} times as fast as the given speed of the striker, \
         possible are 1 to 2 times: as if the films were taken at {likely_hz} frames/s where their files say {}; \
         if so, write frame_rate_hz = {likely_hz} (frictions are wrong by the square of the factor), otherwise correct strike.speed_m_s",
        usual_hz(*rate_hz)
    ))
}

#[cfg(test)]
mod tests {
    use crate::estimate::{Options, estimation};
    use crate::synthetic::campaign::{CampaignSpec, SyntheticCampaign, campaign};

    /// The clips as if their files said the rate of the drawn ones over `factor`.
    fn slowed(factor: f64, mut drawn: SyntheticCampaign) -> SyntheticCampaign {
        let samples =
            drawn.clips.iter_mut().flat_map(|clip| &mut clip.tracks.tracks).flat_map(|t| &mut t.samples);
        samples.for_each(|sample| sample.time_s *= factor);
        drawn
    }

    /// The warnings about the frame rate.
    fn warnings(drawn: &SyntheticCampaign) -> Vec<String> {
        let found =
            estimation(&drawn.clips, &drawn.cell, &drawn.objects, &Options::default()).expect("properties");
        found.properties.warnings.into_iter().filter(|warning| warning.contains("frame_rate_hz")).collect()
    }

    #[test]
    fn a_wrong_frame_rate_is_named_and_a_right_one_is_not_doubted() {
        for seed in 1..=4 {
            let spec = CampaignSpec { objects: 3, ..CampaignSpec::default() };
            let drawn = campaign(&spec, seed);
            let true_hz = drawn.clips[0].frame_rate_hz().expect("samples");
            assert_eq!(warnings(&drawn), Vec::<String>::new(), "seed {seed}");
            for factor in [2.0, 4.0, 0.5] {
                let found = warnings(&slowed(factor, drawn.clone()));
                let named = format!("frame_rate_hz = {} ", super::usual_hz(true_hz));
                assert!(
                    found.len() == 1 && found[0].contains(&named),
                    "seed {seed}, {named}, factor {factor}: {found:?}"
                );
            }
        }
    }
}
