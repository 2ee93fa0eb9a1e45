//! The tilt of the table over all clips, and its effect on every other measurement.
//!
//! Two kinds of evidence give the slope.  Across a slide, gravity bends the path: every clip shows the component of the slope across
//! its slides.  Along a slide, gravity changes the apparent friction: that of one object differs between slides up and down.

use crate::estimate::clip::result::Measured;
use crate::estimate::joint::random_effects::{
    Group, between_clip_std_with_prior, groups_of_kind, quantile_95,
};
use crate::estimate::measure::measurements::Measurements;
use crate::estimate::measure::quantity::Quantity;
use crate::estimate::measure::sliding::tilt::ClipTilt;
use crate::properties::Tilt;
use crate::statistics::median;
use crate::uncertain::Estimate;
use nalgebra::{Matrix2, SymmetricEigen, Vector2};
use std::collections::BTreeSet;

/// A component of the slope that one clip shows.
struct Component {
    along: Vector2<f64>,
    value: f64,
    std: f64,
}

/// Components with a larger error say nothing about any table that objects rest on.
const LARGEST_STD: f64 = 0.1;
/// A slope is given if each component is known to within this, 0.2 degrees: a worse one would change friction by more than it corrects.
const LARGEST_ERROR: f64 = 0.0035;
/// It is known to within this many times as much without any one of the components and without the frictions of any one clip: one slide alone
/// that gives the slope in a direction may bend for another reason.
const ERRORS_WITHOUT_ONE: f64 = 1.5;
/// A component this many standard deviations off the common slope is left out, and so is a friction that is as far off the median of its object.
const OUTLIER_STDS: f64 = 6.0;
/// Number of components from which the slope is estimated.
const COMPONENTS_NEEDED: usize = 4;
/// A slope below this part of the least friction changes no slide by more than a third of what friction varies between clips.
const NEGLIGIBLE: f64 = 0.005;
/// The friction of a straight slide changes by as much as the slope along it; that of a body which hardly slid can change by many times as much,
/// and not in proportion: beyond this it says nothing about the slope.
const LARGEST_CHANGE: f64 = 3.0;
/// Passes of estimating the slope and the scatter of the components in turn.
const PASSES: usize = 4;
/// Largest scatter of the components from clip to clip.
const LARGEST_SCATTER: f64 = 0.1;
/// Least scatter of them: friction that differs by half a per cent between the directions of a body or of the table bends a path as much.
const LEAST_SCATTER: f64 = 0.001;

/// The slope of the table with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Slope {
    pub(crate) value: [f64; 2],
    pub(crate) covariance: Matrix2<f64>,
    degrees_of_freedom: f64,
    clips: usize,
}

impl Slope {
    /// The slope that all clips show together; `None` if they do not determine it.
    pub(crate) fn new(tilts: &[Option<ClipTilt>], measurements: &[Measurements]) -> Option<Self> {
        let mut components: Vec<Component> = tilts.iter().flatten().flat_map(components).collect();
        let groups = groups_of_frictions(measurements);
        let mut frictions = comparisons(&groups, Vector2::zeros(), None);
        let mut scatter = typical_scatter(&components);
        for _ in 0..PASSES {
            let (information, gradient) = of_all(&components, scatter, &frictions);
            let value = information.try_inverse()? * gradient;
            let before = (components.len(), frictions.len());
            components.retain(|c| c.residual(value).abs() <= OUTLIER_STDS * c.std.hypot(scatter));
            if components.len() < COMPONENTS_NEEDED {
                return None;
            }
            frictions = comparisons(&groups, value, None);
            let found = scatter_of(&components, value);
            let is_settled = before == (components.len(), frictions.len());
            if is_settled && (found - scatter).abs() < 1e-3 * scatter {
                break;
            }
            scatter = found;
        }
        let (information, gradient) = of_all(&components, scatter, &frictions);
        let covariance = information.try_inverse()?;
        let value = covariance * gradient;
        is_known_without_any_one(value, &components, scatter, &groups).then(|| Self {
            value: [value[0], value[1]],
            covariance,
            degrees_of_freedom: (components.len() - 2) as f64,
            clips: tilts.iter().flatten().count(),
        })
    }

    /// Whether a level table is within the interval, or the slope changes no slide of this friction noticeably.
    fn is_level(&self, least_friction: f64) -> bool {
        /// 95 % quantile of the chi-square distribution with two degrees of freedom.
        const CHI_SQUARE: f64 = 5.991_464_547;
        let value = Vector2::from(self.value);
        let Some(information) = self.covariance.try_inverse() else { return true };
        let student = quantile_95(self.degrees_of_freedom) / quantile_95(0.0);
        let inside = (value.transpose() * information * value)[(0, 0)] <= CHI_SQUARE * student * student;
        inside || value.norm() < NEGLIGIBLE * least_friction
    }

    /// The entry of the properties.
    pub(crate) fn tilt(&self, least_friction: f64) -> Tilt {
        let component = |axis: usize| {
            let standard_error = self.covariance[(axis, axis)].max(0.0).sqrt();
            let (mean, half) = (self.value[axis], quantile_95(self.degrees_of_freedom) * standard_error);
            Estimate {
                mean,
                std: None,
                standard_error,
                interval_95: [mean - half, mean + half],
                n: self.clips,
            }
        };
        let [x, y] = [component(0), component(1)];
        Tilt { x, y, covariance: self.covariance[(0, 1)], level: self.is_level(least_friction) }
    }
}

/// The components of one clip along the principal axes of its information.
fn components(tilt: &ClipTilt) -> Vec<Component> {
    let (information, gradient) = tilt.information();
    let eigen = SymmetricEigen::new(information);
    let component = |k: usize| {
        let (along, information): (Vector2<f64>, f64) =
            (eigen.eigenvectors.column(k).into_owned(), eigen.eigenvalues[k]);
        let std = information.sqrt().recip();
        (information > 0.0 && std < LARGEST_STD).then(|| Component {
            along,
            value: along.dot(&gradient) / information,
            std,
        })
    };
    (0..2).filter_map(component).collect()
}

/// Information and gradient of all components and frictions.
fn of_all(components: &[Component], scatter: f64, frictions: &[Comparison]) -> (Matrix2<f64>, Vector2<f64>) {
    frictions.iter().fold(sum(components, scatter), |(information, gradient), friction| {
        (information + friction.information(), gradient + friction.gradient())
    })
}

/// Whether the slope is known, and remains known without any one of the components and without the frictions of any one clip.
fn is_known_without_any_one(
    slope: Vector2<f64>,
    components: &[Component],
    scatter: f64,
    groups: &[Vec<SlideFriction>],
) -> bool {
    let is_known = |information: Matrix2<f64>, error: f64| {
        information.try_inverse().is_some_and(|covariance| largest_std(covariance) < error)
    };
    let is_known_without =
        |information: Matrix2<f64>| is_known(information, ERRORS_WITHOUT_ONE * LARGEST_ERROR);
    let of_frictions = |except: Option<usize>| -> Matrix2<f64> {
        comparisons(groups, slope, except).iter().map(Comparison::information).sum()
    };
    let (of_components, _) = sum(components, scatter);
    let all = of_components + of_frictions(None);
    let clips: BTreeSet<usize> = groups.iter().flatten().map(|friction| friction.clip).collect();
    is_known(all, LARGEST_ERROR)
        && components.iter().all(|c| is_known_without(all - c.information(scatter)))
        && clips.into_iter().all(|clip| is_known_without(of_components + of_frictions(Some(clip))))
}

/// The larger standard deviation of the two components of a slope.
fn largest_std(covariance: Matrix2<f64>) -> f64 {
    covariance[(0, 0)].max(covariance[(1, 1)]).sqrt()
}

impl Component {
    /// What it says about both components of the slope, if they scatter so much from clip to clip.
    fn information(&self, scatter: f64) -> Matrix2<f64> {
        self.along * self.along.transpose() / (self.std * self.std + scatter * scatter)
    }

    fn residual(&self, slope: Vector2<f64>) -> f64 {
        self.value - self.along.dot(&slope)
    }
}

/// Information and gradient of all components, if they scatter so much from clip to clip.
fn sum(components: &[Component], scatter: f64) -> (Matrix2<f64>, Vector2<f64>) {
    components.iter().fold((Matrix2::zeros(), Vector2::zeros()), |(information, gradient), c| {
        let weighted = c.information(scatter);
        (information + weighted, gradient + weighted * c.along * c.value)
    })
}

/// A first, robust scatter: the median size of the components over that of a standard normal number.
fn typical_scatter(components: &[Component]) -> f64 {
    (median(components.iter().map(|c| c.value.abs())).unwrap_or(0.0) / 0.6745).max(LEAST_SCATTER)
}

/// The scatter with which the squared residuals have their expectation (Paule and Mandel 1982), at least [`LEAST_SCATTER`].
fn scatter_of(components: &[Component], slope: Vector2<f64>) -> f64 {
    let expected = (components.len() - 2) as f64;
    let excess = |scatter: f64| {
        let squares =
            components.iter().map(|c| c.residual(slope).powi(2) / (c.std * c.std + scatter * scatter));
        squares.sum::<f64>() - expected
    };
    let (mut low, mut high) = (LEAST_SCATTER, LARGEST_SCATTER);
    for _ in 0..50 {
        let middle = f64::midpoint(low, high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    high
}

/// The friction of an object in one clip.
struct SlideFriction {
    clip: usize,
    value: f64,
    /// With the variation from clip to clip.
    variance: f64,
    by_slope: Vector2<f64>,
    /// Number of frictions of its clip.
    of_clip: f64,
}

/// A friction of an object in one clip compared with the mean of all clips.
struct Comparison {
    difference: f64,
    by_slope: Vector2<f64>,
    weight: f64,
}

impl Comparison {
    fn information(&self) -> Matrix2<f64> {
        self.by_slope * self.by_slope.transpose() * self.weight
    }

    fn gradient(&self) -> Vector2<f64> {
        -self.by_slope * (self.difference * self.weight)
    }
}

/// The frictions of each object in several clips.
fn groups_of_frictions(measurements: &[Measurements]) -> Vec<Vec<SlideFriction>> {
    let slides: Vec<Measurements> = measurements.iter().map(of_slides).collect();
    let groups: Vec<_> = groups_of_kind(&slides, Quantity::FRICTION)
        .filter(|(_, indices, _)| indices.len() > 1)
        .map(|(_, indices, group)| (group, indices))
        .collect();
    let typical = between_clip_std_with_prior(&groups.iter().map(|(g, _)| g.clone()).collect::<Vec<_>>());
    let of_group = |(group, indices): &(Group, Vec<(usize, usize)>)| {
        let friction = |(&(clip, k), measured): (&(usize, usize), &Measured)| SlideFriction {
            clip,
            value: measured.value,
            variance: measured.std.powi(2) + (typical.relative * group.scale).powi(2),
            by_slope: Vector2::from(slides[clip].by_slope(k)),
            of_clip: slides[clip].quantities.len() as f64,
        };
        indices.iter().zip(&group.values).map(friction).collect()
    };
    groups.iter().map(of_group).collect()
}

/// What the frictions of each object in slides of different directions say about the slope. Those that contradict the other clips on a table of this
/// slope are left out: one wrong friction with a small standard deviation would tilt the table. Those of
/// the clip `except` are left out, too.
fn comparisons(groups: &[Vec<SlideFriction>], slope: Vector2<f64>, except: Option<usize>) -> Vec<Comparison> {
    groups.iter().flat_map(|frictions| comparisons_of_object(frictions, slope, except)).collect()
}

fn comparisons_of_object(
    frictions: &[SlideFriction],
    slope: Vector2<f64>,
    except: Option<usize>,
) -> Vec<Comparison> {
    let on_level = |f: &SlideFriction| f.value + f.by_slope.dot(&slope);
    let middle = median(frictions.iter().map(on_level)).unwrap_or(0.0);
    let agreeing: Vec<&SlideFriction> = (frictions.iter())
        .filter(|f| except != Some(f.clip))
        .filter(|f| (on_level(f) - middle).abs() <= OUTLIER_STDS * f.variance.sqrt())
        .collect();
    // The frictions of all objects of one clip vary together: they are one piece of evidence.
    let weight = |f: &SlideFriction| 1.0 / (f.variance * f.of_clip);
    let total: f64 = agreeing.iter().map(|f| weight(f)).sum();
    let mean = agreeing.iter().map(|f| weight(f) * f.value).sum::<f64>() / total;
    let mean_by_slope =
        agreeing.iter().fold(Vector2::zeros(), |sum, f| sum + f.by_slope * (weight(f) / total));
    let compared = |f: &&SlideFriction| Comparison {
        difference: f.value - mean,
        by_slope: f.by_slope - mean_by_slope,
        weight: weight(f),
    };
    agreeing.iter().map(compared).collect()
}

/// The frictions of a clip that change with the slope as those of slides do.
fn of_slides(clip: &Measurements) -> Measurements {
    clip.retained(|k| {
        let [x, y] = clip.by_slope(k);
        matches!(clip.quantities[k], Quantity::Friction(_)) && x.hypot(y) < LARGEST_CHANGE
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    fn clip(heading_rad: f64, slope: [f64; 2], error: f64) -> ClipTilt {
        known_clip(heading_rad, slope, error, 1e-4)
    }

    /// The same with a standard deviation of the component across the slide.
    fn known_clip(heading_rad: f64, slope: [f64; 2], error: f64, std: f64) -> ClipTilt {
        let across = [-heading_rad.sin(), heading_rad.cos()];
        let value = across[0] * slope[0] + across[1] * slope[1] + error;
        let information = 1.0 / std.powi(2);
        let products = [across[0] * across[0], across[0] * across[1], across[1] * across[1]];
        let tilt = serde_json::json!({
            "information": products.map(|part| part * information),
            "gradient": across.map(|part| part * value * information),
        });
        serde_json::from_value(tilt).expect("a tilt")
    }

    /// The friction of one object in a clip.
    fn friction(object: &str, value: f64, std: f64, by_slope: [f64; 2]) -> Measurements {
        Measurements {
            quantities: vec![Quantity::Friction(object.into())],
            values: DVector::from_element(1, value),
            covariance: DMatrix::from_element(1, 1, std * std),
            vertical_fractions: vec![0.0],
            double_contact: vec![false],
            by_slope: vec![by_slope],
        }
    }

    /// The frictions 0.2 of three objects on a level table in slides along x, in this many of twelve against it.
    fn frictions_along_x(against: usize) -> Vec<Measurements> {
        let along = |k: usize| if k % 12 < against { [-1.0, 0.0] } else { [1.0, 0.0] };
        let value = |k: usize| 0.2 + 0.002 * (k * 5 % 3) as f64;
        (0..36).map(|k| friction(["a", "b", "c"][k / 12], value(k), 1e-3, along(k))).collect()
    }

    /// Clips whose paths show the component of a level table's slope along y alone.
    fn clips_along_x() -> Vec<Option<ClipTilt>> {
        (0..12).map(|k| Some(clip(0.0, [0.0; 2], 3e-4 * f64::from(k % 3 - 1)))).collect()
    }

    #[test]
    fn one_wrong_friction_does_not_tilt_the_table() {
        let mut frictions = frictions_along_x(4);
        let right = Slope::new(&clips_along_x(), &frictions).expect("a slope");
        frictions.push(friction("a", 0.35, 1e-3, [2.5, 0.0]));
        let found = Slope::new(&clips_along_x(), &frictions).expect("a slope");
        let off = found.value[0] - right.value[0];
        assert!(right.tilt(0.2).level && off.abs() < 2e-4, "{found:?} beside {right:?}");
    }

    #[test]
    fn the_frictions_of_one_clip_alone_do_not_give_the_slope() {
        assert_eq!(Slope::new(&clips_along_x(), &frictions_along_x(0)), None);
        let mut frictions = frictions_along_x(0);
        frictions.push(friction("a", 0.2, 1e-3, [-2.5, 0.0]));
        assert_eq!(Slope::new(&clips_along_x(), &frictions), None);
        frictions.push(friction("b", 0.2, 1e-3, [-2.5, 0.0]));
        assert!(Slope::new(&clips_along_x(), &frictions).is_some());
    }

    fn clips(slope: [f64; 2]) -> Vec<Option<ClipTilt>> {
        (0..24).map(|k| Some(clip(0.5 * f64::from(k), slope, 3e-4 * f64::from(k * 7 % 5 - 2)))).collect()
    }

    #[test]
    fn slides_in_all_directions_give_the_slope_and_its_scatter() {
        let found = Slope::new(&clips([0.01, -0.004]), &[]).expect("a slope");
        let tilt = found.tilt(0.2);
        assert!((tilt.x.mean - 0.01).abs() < 3e-4 && (tilt.y.mean + 0.004).abs() < 3e-4, "{tilt:?}");
        assert!((1e-4..4e-4).contains(&tilt.x.standard_error) && !tilt.level, "{tilt:?}");
    }

    #[test]
    fn a_table_within_the_interval_is_level_and_so_is_one_whose_slope_changes_nothing() {
        let level = |slope: [f64; 2]| Slope::new(&clips(slope), &[]).expect("a slope").tilt(0.2).level;
        assert!(level([0.0, 0.0]) && level([0.0006, 0.0006]) && !level([0.002, 0.002]));
    }

    #[test]
    fn slides_along_one_direction_leave_the_other_component_open() {
        let along: Vec<_> = (0..12).map(|_| Some(clip(0.0, [0.01, 0.01], 0.0))).collect();
        assert_eq!(Slope::new(&along, &[]), None);
    }

    #[test]
    fn one_slide_in_another_direction_does_not_give_the_slope_in_it() {
        let mut along: Vec<_> = (0..12).map(|k| Some(clip(0.01 * f64::from(k), [0.0; 2], 0.0))).collect();
        along.push(Some(clip(1.4, [0.015; 2], 0.0)));
        assert_eq!(Slope::new(&along, &[]), None);
        along.push(Some(clip(1.3, [0.0; 2], 0.0)));
        along.push(Some(clip(1.5, [0.0; 2], 0.0)));
        assert!(Slope::new(&along, &[]).is_some());
    }

    #[test]
    fn a_body_that_bends_its_path_does_not_tilt_the_table_on_which_others_slide_straight() {
        let error = |k: i32| 3e-4 * f64::from(k * 7 % 5 - 2);
        let mut clips: Vec<_> =
            (0..10).map(|k| Some(clip(0.04 * f64::from(k) - 0.2, [0.0; 2], error(k)))).collect();
        clips.extend([0.16, 0.18, 0.20].map(|heading_rad| Some(clip(heading_rad, [0.0; 2], 0.002))));
        let found = Slope::new(&clips, &[]);
        assert!(found.is_none_or(|slope| slope.tilt(0.2).level), "{found:?}");
    }

    #[test]
    fn the_friction_of_a_body_that_hardly_slid_does_not_tilt_the_table() {
        let friction = |value: f64, std: f64, by_slope: [f64; 2]| friction("f", value, std, by_slope);
        let mut clips: Vec<_> =
            (0..12).map(|k| Some(clip(0.01 * f64::from(k), [0.0; 2], 3e-4 * f64::from(k % 3 - 1)))).collect();
        clips.extend((0..10).map(|k| {
            Some(known_clip(1.4 + 0.03 * f64::from(k), [0.0; 2], 3e-3 * f64::from(k % 3 - 1), 0.01))
        }));
        let mut frictions: Vec<_> =
            (0..12).map(|k| friction(0.33 + 0.003 * f64::from(k % 3 - 1), 1e-3, [1.0, 0.0])).collect();
        let level = Slope::new(&clips, &frictions).expect("a slope").tilt(0.2);
        assert!(level.level && level.x.mean.abs() < 2e-3, "{level:?}");
        frictions.extend([friction(0.98, 0.095, [25.6, 64.5]), friction(0.64, 0.047, [14.1, 35.8])]);
        let found = Slope::new(&clips, &frictions).expect("a slope").tilt(0.2);
        assert!(found.level && (found.x.mean - level.x.mean).abs() < 1e-4, "{found:?} beside {level:?}");
    }

    #[test]
    fn one_wrong_clip_changes_little() {
        let mut wrong = clips([0.01, -0.004]);
        wrong.push(Some(clip(0.3, [0.3, 0.3], 0.0)));
        let found = Slope::new(&wrong, &[]).expect("a slope");
        assert!((found.value[0] - 0.01).abs() < 5e-4, "{found:?}");
    }
}
