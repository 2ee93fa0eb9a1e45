//! Does the striker touch the struck object when it strikes it?
//!
//! At a strike the outlines of striker and object touch. Where the film shows a gap or an overlap, the height of the object is wrong, which moves
//! it on the line to the point below the camera, or the size of one of both.

use super::striker::Findings;
use crate::estimate::{ClipFit, ClipTracks, Impact};
use crate::geometry::Vec2;
use crate::object::{self, Object, kind};
use crate::warning::{Cause, Warning};
use nalgebra::{Matrix2, Vector2};
use std::collections::BTreeMap;

/// A gap is reported from here on (m): the outlines of two bodies by a ruler.
const LEAST_GAP_M: f64 = 1e-3;
/// Number of positions after a strike that have to be trusted.
const POSITIONS_AFTER_STRIKE: usize = 2;
/// Fewest strikes of an object that show its height: one strike may be wrong.
const FEWEST: usize = 2;
/// Standard deviations of one gap, of the sum of both outlines' errors, and of the height of an object that is not measured (m).
const GAP_STD_M: f64 = 3e-4;
const OUTLINES_STD_M: f64 = 7e-4;
const HEIGHT_STD_M: f64 = 0.02;
/// An error explains the gaps if it leaves less than this part of them.
const UNEXPLAINED: f64 = 0.5;

/// The distance between the outlines of the striker and the struck object at a strike.
#[derive(Clone, Copy, Debug)]
struct Gap<'a> {
    /// The kind of the struck object.
    kind: &'a str,
    /// Along the striker's heading (m); negative where the outlines overlap.
    distance_m: f64,
    /// By how much it grows for each metre by which the height of the object is given too large (1).
    per_height: f64,
    /// Whether the striker is seen at rest before.
    from_rest: bool,
}

/// The error of the heights and that of the outlines that explain gaps best.
struct Explanation {
    /// By how much the heights are given too large (m).
    height_error_m: f64,
    /// Root mean square of the gaps that both errors explain (m).
    explained_m: f64,
    /// Whether the height explains more than half of them.
    is_of_height: bool,
}

/// A warning for each kind of object that the striker does not touch when it strikes it, or one for all of them.
///
/// `striker` is what the strikers that are seen say about the given strikes: clips with a wrong strike, and those in which something else was followed, do
/// not count.
pub(super) fn warnings(
    clips: &[ClipTracks],
    fits: &[ClipFit],
    objects: &[Object],
    striker: &Findings,
) -> Vec<Warning> {
    if striker.turned {
        return Vec::new();
    }
    let is_right = |(clip, _): &(&ClipTracks, &ClipFit)| {
        !striker.clips.contains(&clip.name) && !striker.others_followed.contains(&clip.name)
    };
    let of_clips = clips.iter().zip(fits).filter(is_right);
    let mut gaps: Vec<Gap> = of_clips.filter_map(|(clip, fit)| gap(clip, fit, objects)).collect();
    if gaps.iter().any(|gap| gap.from_rest) {
        gaps.retain(|gap| gap.from_rest);
    }
    let mut of_kinds: BTreeMap<&str, Vec<Gap>> = BTreeMap::new();
    for gap in &gaps {
        of_kinds.entry(gap.kind).or_default().push(*gap);
    }
    of_kinds.retain(|_, gaps| gaps.len() >= FEWEST);
    let wrong = of_kinds.iter().filter(|(_, gaps)| explanation(gaps).is_some()).count();
    let warning = |text| Warning::new(Cause::Lengths, text);
    if wrong > 1
        && wrong == of_kinds.len()
        && let Some(common) = explanation(&gaps)
    {
        return vec![warning(common.text(&gaps, "the struck objects"))];
    }
    let of_kind =
        |(name, gaps): (&&str, &Vec<Gap>)| Some(warning(explanation(gaps)?.text(gaps, &format!("`{name}`"))));
    of_kinds.iter().filter_map(of_kind).collect()
}

/// Whether the instant of a strike is known: it measures something, and the next positions of the struck object are trusted. Where they are not, the
/// fitted strike may be a quarter of a frame off, in which the striker moves by a millimetre.
fn is_instant_known(clip: &ClipTracks, strike: &Impact) -> bool {
    let track = clip.tracks.tracks.iter().find(|track| track.object == strike.b);
    let samples = track.map_or(&[][..], |track| &track.samples);
    let mut next = samples.iter().filter(|s| s.time_s > strike.time.value).take(POSITIONS_AFTER_STRIKE);
    strike.restitution.is_some() && next.all(|sample| !sample.doubtful)
}

/// The gap at the strike of a clip, if the film shows the striker and the camera's position is known.
///
/// The striker is where it is seen, and where it is after the same displacement from the given start if it is seen at rest: its shade and a robot whose
/// table frame is displaced make only one of them wrong. The smaller gap counts, and none if one is a gap and the other an overlap. Where it is not
/// seen at rest, what its shade may do is taken off.
fn gap<'a>(clip: &ClipTracks, fit: &'a ClipFit, objects: &[Object]) -> Option<Gap<'a>> {
    let (strike, seen) = (clip.strike.as_ref()?, clip.tracks.striker.as_ref()?);
    let [x, y, z] = clip.tracks.camera_position_m?;
    let impact = fit.impacts.first().filter(|impact| is_instant_known(clip, impact))?;
    let height_m = object::find(objects, &impact.b, "strike").ok()?.height_m;
    let ahead = Vec2::from_heading(strike.heading_rad);

    let to_contact_m = impact.striker_distance_m?;
    let position = seen.position_at(impact.time.value);
    let by_position_m = to_contact_m - (position - strike.start_m).dot(ahead);
    let distance_m = match seen.start_m {
        Some(start) => {
            let by_displacement_m = to_contact_m - (position - start).dot(ahead);
            if by_position_m * by_displacement_m <= 0.0 {
                0.0
            } else {
                by_position_m.signum() * by_position_m.abs().min(by_displacement_m.abs())
            }
        }
        None => by_position_m.signum() * (by_position_m.abs() - 2.0 * seen.offset_std_m).max(0.0),
    };
    let object = impact.before[1].pose.position;
    let from_below_camera = Vec2::new(object.x - x, object.y - y);
    let per_height = -from_below_camera.dot(ahead) / (z - height_m);
    let from_rest = seen.start_m.is_some();
    Some(Gap { kind: kind(&impact.b), distance_m, per_height, from_rest })
        .filter(|gap| gap.distance_m.is_finite())
}

/// The errors of height and outlines that explain these gaps (least squares with the priors above); `None` if the gaps are no larger than rulers
/// are wrong, or if both errors leave too much of them.
fn explanation(gaps: &[Gap]) -> Option<Explanation> {
    let mut information =
        Matrix2::from_diagonal(&Vector2::new(OUTLINES_STD_M.powi(-2), HEIGHT_STD_M.powi(-2)));
    let mut right = Vector2::zeros();
    for gap in gaps {
        let row = Vector2::new(1.0, gap.per_height) / GAP_STD_M;
        information += row * row.transpose();
        right += row * (gap.distance_m / GAP_STD_M);
    }
    let errors_m = information.try_inverse()? * right;
    let by_height_m = |gap: &Gap| errors_m.y * gap.per_height;
    let both_m = |gap: &Gap| errors_m.x + by_height_m(gap);

    let rms = |value: &dyn Fn(&Gap) -> f64| {
        (gaps.iter().map(|gap| value(gap).powi(2)).sum::<f64>() / gaps.len() as f64).sqrt()
    };
    let (explained_m, left_m) = (rms(&both_m), rms(&|gap| gap.distance_m - both_m(gap)));
    let is_wrong = explained_m > LEAST_GAP_M && left_m < UNEXPLAINED * explained_m;
    is_wrong.then(|| Explanation {
        height_error_m: errors_m.y,
        explained_m,
        is_of_height: 2.0 * rms(&by_height_m) > explained_m,
    })
}

impl Explanation {
    fn text(&self, gaps: &[Gap], objects: &str) -> String {
        let Self { height_error_m, explained_m, is_of_height } = *self;
        let (n, mm) = (gaps.len(), 1e3 * explained_m);
        let apart = gaps.iter().filter(|gap| gap.distance_m > 0.0).count();
        let found = match apart {
            0 => format!("overlap by {mm:.1} mm"),
            _ if apart == n => format!("are {mm:.1} mm apart"),
            _ => format!("are {mm:.1} mm apart or overlap by as much"),
        };
        let of = if objects.starts_with('`') { "its" } else { "their" };
        let as_if = if is_of_height {
            let large = if height_error_m > 0.0 { "large" } else { "small" };
            format!(", as if {of} height_m were {:.0} mm too {large}", 1e3 * height_error_m.abs())
        } else {
            String::new()
        };
        format!(
            "in {n} clips the outlines of the striker and of {objects} {found} at the strike (root mean square){as_if}: check {of} height_m and sizes \
             in objects.toml, and the striker's in cell.toml"
        )
    }
}
