//! How does the striker itself move?
//!
//! A film shows the striker before it strikes. What has changed since the first frame around the given path is compared with the
//! outlines of the striker's foot and of its top, and the points which they have moved through in a straight line give its speed and
//! its heading, and the point that they have left gives its start. The given strike is where the search begins: it may be wrong.

mod crops;
mod edge;
mod grid;
mod search;
#[cfg(test)]
mod tests;
mod track;

pub use track::{StrikerSample, StrikerTrack};

use super::marker::target::Target;
use super::tracks::{Sample, Track};
use crate::capture::{Camera, Frame};
use crate::cell::Striker;
use crate::geometry::{Pixel, Point, Pose, Vec2, outline};
use crate::scene::Strike;
use crate::uncertain::Measured;
use crops::Crops;
use edge::{Edge, Outline, SeenOutlines, Steps};
use grid::{Greys, Grid};
use search::{Candidate, LEAST_PART, Peak, Searched, Struck, UniformMotion};

/// How far around the given path the striker is searched: behind the start and beyond the end, and aside (m), and aside as a part of the travel.
const ALONG_M: f64 = 0.03;
const ASIDE_M: f64 = 0.02;
const ASIDE_TRAVEL: f64 = 0.1;
/// Longest path that is looked at (m).
const LONGEST_M: f64 = 0.25;
/// In a search every second node is looked at.
const SEARCH_EVERY: usize = 2;
/// Peaks of each frame, their least strength, and the distance between them (m).
const MOST_PEAKS: usize = 5;
const LEAST_STRENGTH: f64 = 0.25;
const PEAK_DISTANCE_M: f64 = 0.004;
/// A peak belongs to a motion within so many nodes of the search.
const TOLERANCE_NODES: f64 = 2.5;
/// Displacement of an object from which it has been struck (m), and of one whose position is doubtful.
const STRUCK_M: f64 = 1e-3;
const SURELY_STRUCK_M: f64 = 4e-3;
/// Repetitions of the measurement with the outline's appearance from the one before, and steps of each.
const ROUNDS: usize = 2;
const STEPS: usize = 4;
/// Least agreement with the outline's appearance.
const LEAST_AGREEMENT: f64 = 0.5;
/// Fewest positions among which one may be an outlier, and how far off it is then (standard deviations).
const LEAST_POSITIONS: usize = 3;
const OUTLIER_STDS: f64 = 4.0;
/// Fewest points, positions and the rest position together, that make a motion: two positions fit a line exactly, and three that
/// are not all the striker's fit one well enough by chance.
const LEAST_POINTS: usize = 4;
/// Intervals of the striker's height in which a line of sight is looked at.
const HEIGHTS: usize = 16;
/// Least noise of a position (nodes).
const LEAST_STD_NODES: f64 = 0.1;
/// Largest noise of a position with which it is a uniform motion (widths of the filter).
const MOST_STD_WIDTHS: f64 = 0.5;
/// Standard deviation of the scale of the table at one place over that at others, by lens and pose of the camera (1).
const SCALE_STD: f64 = 0.005;
/// Standard deviation of the height of what is followed, over the striker's, if the rest position does not show it: the foot or the top.
const HEIGHT_STD: f64 = 0.5;
/// Offset that all positions may have in common, by shade along the outline (widths of the filter) and by its measure (m).
const OFFSET_WIDTHS: f64 = 0.25;
const OFFSET_M: f64 = 5e-4;

/// Where the striker is in an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StrikerPlace {
    /// At its start.
    Start,
    /// Somewhere on its path.
    Path,
}

/// The strike that is given for a film, and the striker.
#[derive(Clone, Copy)]
pub(super) struct GivenStrike<'a> {
    pub strike: &'a Strike,
    pub striker: &'a Striker,
}

impl GivenStrike<'_> {
    /// Whether the line of sight through a pixel may meet the striker.
    pub(super) fn covers(&self, camera: &Camera, place: StrikerPlace) -> impl Fn(Pixel) -> bool {
        let Self { strike, striker } = *self;
        let travel_m = match place {
            StrikerPlace::Start => 0.0,
            StrikerPlace::Path => strike.travel_m,
        };
        let along = Vec2::from_heading(strike.heading_rad) * travel_m;
        let swept = outline::Outline::swept(&striker.shape, self.pose(0.0), along);
        move |pixel| {
            let mut heights_m = (0..=HEIGHTS).map(|k| striker.height_m * k as f64 / HEIGHTS as f64);
            heights_m.any(|height_m| swept.contains(camera.table_from_pixel(pixel, height_m)))
        }
    }

    /// The pose of the striker after a part of its travel.
    fn pose(&self, along_m: f64) -> Pose {
        let Strike { start_m, heading_rad, .. } = *self.strike;
        let position = start_m + Vec2::from_heading(heading_rad) * along_m;
        Pose { position, yaw_rad: heading_rad }
    }
}

/// Collects what the frames show around the path of the striker.
pub(super) struct Follower<'a> {
    given: GivenStrike<'a>,
    camera: &'a Camera,
    grid: Grid,
    edge: Edge,
    /// The height of the lowest outline above the table (m).
    height_m: f64,
    /// Standard deviation of the scale, and that of a motion whose height is not checked by its rest position (1).
    scale_std: f64,
    height_scale_std: f64,
    crops: Crops,
}

impl<'a> Follower<'a> {
    /// A follower for a film; `None` if the camera does not see the path.
    pub(super) fn new(camera: &'a Camera, given: GivenStrike<'a>, interval_s: f64) -> Option<Self> {
        let GivenStrike { strike, striker } = given;
        let travel_m = strike.travel_m.min(LONGEST_M);
        let path = [0.0, travel_m / 2.0, travel_m].map(|along_m| given.pose(along_m));
        let seen = SeenOutlines::new(camera, &striker.shape, striker.height_m, &path);
        let heights_m: Vec<f64> = seen.outlines.iter().map(|outline| outline.height_m).collect();
        let height_m = heights_m[0];
        let distance_m = camera.position_m().map_or(1.0, |[_, _, z]| z - height_m);
        let scale_std = SCALE_STD.hypot(seen.height_std_m / distance_m);
        let height_scale_std = HEIGHT_STD * striker.height_m / distance_m;
        let pixel_m = camera.scale_m_per_px(camera.pixel_from_table(path[0].position, height_m), height_m);
        if !(pixel_m.is_finite() && distance_m > 0.0) {
            return None;
        }
        let blur_m = strike.speed_m_s * camera.exposure_s.unwrap_or(interval_s / 4.0);
        let edge = Edge::new(seen.outlines, pixel_m, blur_m);
        let reach_m = edge.reach_m();
        let aside_m = ASIDE_M + ASIDE_TRAVEL * travel_m + reach_m;
        let corners =
            [Point::new(-ALONG_M - reach_m, -aside_m), Point::new(travel_m + ALONG_M + reach_m, aside_m)];
        let grid = Grid::new(camera, path[0], corners, &heights_m)?;
        let crops = Crops::new(grid.window_width());
        let is_seen = grid.window_px() > 0;
        is_seen.then_some(Self { given, camera, grid, edge, height_m, scale_std, height_scale_std, crops })
    }

    /// Adds the next frame, taken by this camera; a camera that has moved sees the path elsewhere.
    pub(super) fn add(&mut self, frame: &Frame, camera: &Camera) {
        let is_whole = [frame.image.width, frame.image.height] == self.camera.size_px;
        if self.crops.wants_next() && is_whole && std::ptr::eq(camera, self.camera) {
            self.crops.push(frame.time_s, self.grid.crop(&frame.image));
        }
    }

    /// When the striker or its arm has begun to move (s), if the film shows that; `tracks` are those of the objects `targets`.
    pub(super) fn onset_s(&self, targets: &[Target], tracks: &[Track]) -> Option<Measured> {
        let onset_s = self.crops.onset_s(self.struck(targets, tracks).map(|struck| struck.time_s))?;
        let row_px = self.camera.pixel_from_table(self.given.strike.start_m, self.height_m).y;
        Some(Measured { value: onset_s.value + self.readout_s(row_px), ..onset_s })
    }

    /// A rolling shutter exposes a row this much later than the first one (s).
    fn readout_s(&self, row_px: f64) -> f64 {
        self.camera.readout_s * row_px / self.camera.size_px[1] as f64
    }

    /// The striker's motion, if the film shows it; `tracks` are those of the objects `targets`.
    pub(super) fn track(&self, targets: &[Target], tracks: &[Track]) -> Option<StrikerTrack> {
        let (first, still_s) = (self.crops.first()?, self.crops.still_s()?);
        let struck = self.struck(targets, tracks);
        let impact_s = struck.map(|struck| struck.time_s);
        let chosen = self.crops.chosen(impact_s);
        let times_s: Vec<f64> = chosen.iter().map(|crop| crop.time_s).collect();
        let greys: Vec<Greys> =
            chosen.iter().map(|crop| self.grid.difference(&crop.pixels, &first.pixels)).collect();

        let before_impact =
            impact_s.map_or(times_s.len(), |impact_s| times_s.partition_point(|t| *t < impact_s));
        let tolerance_m = TOLERANCE_NODES * SEARCH_EVERY as f64 * self.grid.step_m;
        let below_camera =
            self.camera.position_m().map(|[x, y, _]| self.grid.strike.body_from_table(Point::new(x, y)));
        let searched = Searched {
            peaks: &[],
            times_s: &times_s,
            before_impact,
            struck,
            still_s,
            strike: self.given.strike,
            below_camera,
            tolerance_m,
        };
        // All outlines together are searched, and the foot alone: the arm may hide the top.
        let all = self.edge.outlines();
        let view = |outlines| View { follower: self, outlines, greys: &greys, times_s: &times_s };
        let views: Vec<View> = (1..=all.len()).rev().map(|n| view(&all[..n])).collect();
        let motions = (0..views.len()).flat_map(|k| {
            let peaks = views[k].peaks();
            let searched = Searched { peaks: &peaks, ..searched };
            let candidate = searched.best();
            let motion = |view: &View| view.motion(&searched, candidate.as_ref()?);
            views[k..].iter().filter_map(motion).collect::<Vec<SeenMotion>>()
        });
        self.most_precise(&motions.collect::<Vec<SeenMotion>>())
    }

    /// The track by the outlines that show the motion most precisely. Where they differ in speed, edges that move otherwise disturb them.
    fn most_precise(&self, motions: &[SeenMotion]) -> Option<StrikerTrack> {
        let tracks = motions.iter().filter_map(|motion| self.fitted(motion));
        let mut best = tracks.min_by(|a, b| a.speed_m_s().std.total_cmp(&b.speed_m_s().std))?;
        let speed_m_s = best.speed_m_s().value;
        let checking = motions.iter().filter(|motion| motion.positions.len() >= LEAST_POSITIONS);
        let apart = checking.map(|motion| (motion.line.velocity.length() / speed_m_s - 1.0).abs());
        best.scale_std = best.scale_std.hypot(apart.fold(0.0, f64::max));
        Some(best)
    }

    /// The first object that is displaced.
    fn struck(&self, targets: &[Target], tracks: &[Track]) -> Option<Struck> {
        let displaced = |(target, track): (&Target, &Track)| {
            let from = track.samples.first()?.position();
            let least_m = |sample: &Sample| if sample.doubtful { SURELY_STRUCK_M } else { STRUCK_M };
            let moved = track.samples.iter().find(|s| s.position().distance(from) > least_m(s))?;
            let reach_m = target.object.shape.outer_radius_m() + self.given.striker.shape.outer_radius_m();
            Some(Struck { time_s: moved.time_s, at: self.grid.strike.body_from_table(from), reach_m })
        };
        let displaced = targets.iter().zip(tracks).filter_map(displaced);
        displaced.min_by(|a, b| a.time_s.total_cmp(&b.time_s))
    }

    /// The track of a motion, if enough of it is seen.
    fn fitted(&self, motion: &SeenMotion) -> Option<StrikerTrack> {
        let SeenMotion { positions, rest, line, is_checked } = motion;
        let std_m = line.scatter_m(positions, self.grid.step_m).max(LEAST_STD_NODES * self.grid.step_m);
        if !is_checked || std_m > MOST_STD_WIDTHS * self.edge.width_m() {
            return None;
        }
        let table = |at: Point| self.grid.strike.table_from_body(at);
        let sample = |&(time_s, at): &(f64, Point)| {
            let position = table(at);
            let time_s = time_s + self.readout_s(self.camera.pixel_from_table(position, self.height_m).y);
            StrikerSample { time_s, x_m: position.x, y_m: position.y }
        };
        Some(StrikerTrack {
            samples: positions.iter().map(sample).collect(),
            start_m: rest.map(table),
            std_m,
            offset_std_m: OFFSET_M.hypot(OFFSET_WIDTHS * self.edge.width_m()),
            scale_std: self.scale_std.hypot(if rest.is_none() { self.height_scale_std } else { 0.0 }),
        })
    }
}

/// Whether enough points check each other, and whether they are of most frames between the first and the last one: where the
/// striker is lost in many frames, the others may show something else.
fn is_redundant(positions: &[(f64, Point)], rest: Option<Point>, times_s: &[f64]) -> bool {
    let ([first, ..], [.., last]) = (positions, positions) else { return false };
    let between = times_s.iter().filter(|time_s| (first.0..=last.0).contains(*time_s)).count();
    let n = positions.len();
    n + usize::from(rest.is_some()) >= LEAST_POINTS && n as f64 >= LEAST_PART * between as f64
}

/// Positions without those that are not on the straight line of the others: each must stand out against their scatter and against the
/// uncertainty of their line at its time. The last ones before the impact may be, where the struck object hides a part of the outline.
fn without_outliers(mut positions: Vec<(f64, Point)>, step_m: f64) -> Vec<(f64, Point)> {
    while positions.len() > LEAST_POSITIONS {
        let without = |k: usize| {
            let mut others = positions.clone();
            let (time_s, at) = others.remove(k);
            let line = UniformMotion::through(&others)?;
            let squares_s2: f64 = others.iter().map(|(t, _)| (t - line.time_s).powi(2)).sum();
            let leverage = 1.0 / others.len() as f64 + (time_s - line.time_s).powi(2) / squares_s2;
            let std_m = line.scatter_m(&others, step_m) * (1.0 + leverage).sqrt();
            Some((line.at(time_s).distance(at) / std_m, others))
        };
        let worst = (0..positions.len()).filter_map(without).max_by(|a, b| a.0.total_cmp(&b.0));
        match worst {
            Some((stds, others)) if stds > OUTLIER_STDS => positions = others,
            _ => break,
        }
    }
    positions
}

/// The striker's positions along some outlines, in the strike frame.
struct SeenMotion {
    positions: Vec<(f64, Point)>,
    rest: Option<Point>,
    /// The uniform motion through the positions.
    line: UniformMotion,
    /// Whether the positions check each other and are those of the foot.
    is_checked: bool,
}

/// The changes of the chosen frames along some outlines.
struct View<'a> {
    follower: &'a Follower<'a>,
    outlines: &'a [Outline],
    greys: &'a [Greys],
    times_s: &'a [f64],
}

impl View<'_> {
    /// The striker's motion, if these outlines show it.
    fn motion(&self, searched: &Searched, candidate: &Candidate) -> Option<SeenMotion> {
        let positions = self.positions(candidate, searched.before_impact)?;
        let positions = without_outliers(positions, self.follower.grid.step_m);
        let rest = self.rest(candidate, &positions);
        let line = UniformMotion::through(&positions)?;
        let is_checked = is_redundant(&positions, rest, self.times_s)
            && !searched.is_elevated(&line, rest.or(candidate.rest));
        Some(SeenMotion { positions, rest, line, is_checked })
    }

    /// The peaks of all frames.
    fn peaks(&self) -> Vec<Peak> {
        self.greys.iter().enumerate().flat_map(|(k, greys)| self.peaks_of(k, greys)).collect()
    }

    /// The points of a frame at which the outline has changed most, the strongest first.
    fn peaks_of(&self, frame: usize, greys: &Greys) -> Vec<Peak> {
        let Follower { grid, edge, .. } = self.follower;
        let inner = grid.inner(edge.reach_m(), SEARCH_EVERY);
        if inner.along == 0 || inner.across == 0 {
            return Vec::new();
        }
        let mut strengths = edge.strengths(self.outlines, grid, greys, &inner);
        let reach = (PEAK_DISTANCE_M / (SEARCH_EVERY as f64 * grid.step_m)).ceil() as usize;
        let mut peaks = Vec::new();
        while peaks.len() < MOST_PEAKS {
            let strongest = strengths.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
            let Some((k, &strength)) = strongest.filter(|(_, s)| f64::from(**s) > LEAST_STRENGTH) else {
                break;
            };
            let (i, j) = (k / inner.across, k % inner.across);
            let strength = f64::from(strength);
            peaks.push(Peak { frame, at: grid.inner_point(&inner, i, j), strength });
            for row in strengths
                .chunks_exact_mut(inner.across)
                .take((i + reach + 1).min(inner.along))
                .skip(i.saturating_sub(reach))
            {
                row[j.saturating_sub(reach)..(j + reach + 1).min(inner.across)].fill(0.0);
            }
        }
        peaks
    }

    /// The striker's positions in the frames before the impact.
    fn positions(&self, candidate: &Candidate, before_impact: usize) -> Option<Vec<(f64, Point)>> {
        let width_m = self.follower.edge.width_m();
        let is_clear = |at: Point| candidate.rest.is_none_or(|rest| at.distance(rest) > 2.0 * width_m);
        let mut located: Vec<(usize, Point)> = (0..before_impact)
            .map(|k| (k, candidate.motion.at(self.times_s[k])))
            .filter(|(_, at)| is_clear(*at) && at.x > candidate.rest.map_or(f64::NEG_INFINITY, |rest| rest.x))
            .collect();
        for _ in 0..ROUNDS {
            let template = self.appearance(&located)?;
            located = located
                .iter()
                .filter_map(|&(k, near)| Some((k, self.located(&self.greys[k], &template, near)?)))
                .collect();
        }
        (located.len() >= 2).then(|| located.iter().map(|&(k, at)| (self.times_s[k], at)).collect())
    }

    /// The rest position, which the striker has left.
    fn rest(&self, candidate: &Candidate, positions: &[(f64, Point)]) -> Option<Point> {
        let rest = candidate.rest?;
        let at = positions.iter().map(|(t, at)| {
            let k = self.times_s.iter().position(|s| s == t).unwrap_or(0);
            (k, *at)
        });
        let template: Steps = self.appearance(&at.collect::<Vec<_>>())?.iter().map(|step| -step).collect();
        // The mean of the frames in which it is furthest away
        let far = self.greys.len() / 2;
        let mut mean: Greys = self.greys[0].iter().map(|plane| vec![0.0; plane.len()]).collect();
        for greys in &self.greys[far..] {
            let n = (self.greys.len() - far) as f32;
            for (mean, grey) in mean.iter_mut().flatten().zip(greys.iter().flatten()) {
                *mean += grey / n;
            }
        }
        self.located(&mean, &template, rest)
    }

    /// The mean steps across the outline at these positions.
    fn appearance(&self, at: &[(usize, Point)]) -> Option<Steps> {
        let Follower { grid, edge, .. } = self.follower;
        let mut sum: Option<Steps> = None;
        for &(k, centre) in at {
            let steps = edge.steps(self.outlines, grid, &self.greys[k], centre);
            match &mut sum {
                None => sum = Some(steps),
                Some(sum) => sum.iter_mut().zip(steps).for_each(|(sum, step)| *sum += step),
            }
        }
        let n = at.len() as f64;
        sum.map(|sum| sum.into_iter().map(|step| step / n).collect())
    }

    /// The point near another one at which the outline looks most like `template`.
    fn located(&self, greys: &Greys, template: &Steps, near: Point) -> Option<Point> {
        let Follower { grid, edge, .. } = self.follower;
        let norm: f64 = template.iter().map(|step| step * step).sum();
        let agreement = |at: Point| {
            let steps = edge.steps(self.outlines, grid, greys, at);
            steps.iter().zip(template).map(|(a, b)| a * b).sum::<f64>() / norm
        };
        let (mut at, mut apart_m) = (near, edge.width_m() / 2.0);
        for _ in 0..STEPS {
            let values: [f64; 9] = std::array::from_fn(|k| {
                let (i, j) = (k as f64 / 3.0, (k % 3) as f64);
                agreement(at + Vec2::new(i.floor() - 1.0, j - 1.0) * apart_m)
            });
            at += paraboloid_top(&values)? * apart_m;
            apart_m = (apart_m * 0.7).max(edge.width_m() / 4.0);
        }
        let moved_m = at.distance(near);
        (moved_m < 2.0 * edge.width_m() + PEAK_DISTANCE_M && agreement(at) > LEAST_AGREEMENT).then_some(at)
    }
}

/// The highest point of the paraboloid through 3 x 3 values, from the middle in steps; at most one step away. `None` where they
/// have no top.
fn paraboloid_top(v: &[f64; 9]) -> Option<Vec2> {
    let sum = |keys: [usize; 3]| keys.iter().map(|k| v[*k]).sum::<f64>();
    let (x, y) = ((sum([6, 7, 8]) - sum([0, 1, 2])) / 6.0, (sum([2, 5, 8]) - sum([0, 3, 6])) / 6.0);
    let xx = (sum([6, 7, 8]) - 2.0 * sum([3, 4, 5]) + sum([0, 1, 2])) / 3.0;
    let yy = (sum([2, 5, 8]) - 2.0 * sum([1, 4, 7]) + sum([0, 3, 6])) / 3.0;
    let xy = (v[8] - v[6] - v[2] + v[0]) / 4.0;
    let determinant = xx * yy - xy * xy;
    if !(determinant > 0.0 && xx < 0.0) {
        return None;
    }
    let top = Vec2::new((xy * y - yy * x) / determinant, (xy * x - xx * y) / determinant);
    let length = top.length();
    Some(if length > 1.0 { top / length } else { top })
}
