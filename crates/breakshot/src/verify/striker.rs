//! Does the striker move as the strike given for it says?
//!
//! The film shows the striker's own speed and heading, and often where it rested before. Where they differ from the given ones in one clip,
//! its strike is wrong. Where all speeds differ by one factor, either all given speeds or the frame rate of the films is wrong, which
//! changes all results alike: no comparison between clips shows it.

use super::approach::{MeanSpeed, own_std};
use super::spread::{LEAST_TURN_RAD, STDS, Spread, degrees};
use crate::detect::StrikerTrack;
use crate::estimate::ClipTracks;
use crate::geometry::{Point, Vec2, wrapped_rad};
use crate::retiming::{is_same_rate, usual_hz, usual_within};
use crate::scene::Strike;
use crate::statistics::{STD_OVER_MEDIAN_ABSOLUTE, median};
use crate::uncertain::Measured;
use crate::warning::{Cause, Warning};
use std::collections::BTreeSet;

/// Differences below these are not reported: robots and rulers are that accurate (of the speed as a fraction; m).
const LEAST_SPEED_ERROR: f64 = 0.03;
const LEAST_OFFSET_M: f64 = 0.004;
/// A frame rate within this fraction of a usual one is probably that.
const USUAL_RATE: f64 = 0.015;
/// Centres of tags are not wrong by more than this part.
const LENGTH_ERROR: f64 = 0.15;
/// A factor of the lengths on the table explains one of the speeds within this.
const SAME_FACTOR: f64 = 0.02;
/// Fewest mean speeds whose median is that of the right ones, if one of them is wrong.
const LEAST_MEAN_SPEEDS: usize = 4;
/// A mean speed is reported if it differs from the others by so many of its own standard deviations, which are stated and not taken from few clips.
const MEAN_SPEED_STDS: f64 = 5.0;
/// The expected scatter of mean speeds weighs as much as so many films.
const SCATTER_WEIGHT: f64 = 4.0;
/// A mean speed counts in place of the speed of a striker that is seen at rest if its standard deviation is so many times smaller.
const MORE_ACCURATE: f64 = 2.0;
/// What is seen to move within this many standard deviations of the striker's mean speed may be the striker.
const SAME_SPEED_STDS: f64 = 2.0;
/// A common difference is from zero by this many standard deviations of one clip.
const COMMON_STDS: f64 = 4.0;
/// The part of the clips that a difference has in common.
const MOST: f64 = 0.6;

/// What the strikers that are seen say about the given strikes.
#[derive(Default)]
pub(super) struct Findings {
    pub warnings: Vec<Warning>,
    /// The clips that have a warning of their own.
    pub clips: BTreeSet<String>,
    /// The clips whose striker is seen to move as given.
    pub as_given: BTreeSet<String>,
    /// The clips in which something else than the striker was followed.
    pub others_followed: BTreeSet<String>,
    /// Whether the strikers of most clips head elsewhere.
    pub turned: bool,
}

/// A clip whose striker is seen, or at least when it begins to move, beside its given strike.
struct Compared<'a> {
    clip: &'a ClipTracks,
    strike: &'a Strike,
    rate_hz: f64,
    /// The speed of what is seen; the mean one where the striker itself is not seen at rest or its speed is known far worse.
    speed: Speed,
    /// The mean speed, if the film shows it.
    mean: Option<MeanSpeed>,
    /// Logarithm of the speed of what is seen over the given one, if something is.
    seen: Option<Measured>,
    /// The heading less the given one (rad, counter-clockwise), if the striker is seen.
    turn: Option<Measured>,
    /// The start beside the given one, if the striker is seen at rest.
    start: Option<Start>,
}

/// The speed of a striker.
#[derive(Clone, Copy)]
struct Speed {
    /// Its logarithm over the given one.
    log_ratio: Measured,
    /// The part of the standard deviation that may be the same in all films: that of the scale, or of the first motion.
    common_std: f64,
    /// Whether it is the mean speed from the first motion to the impact.
    is_mean: bool,
}

impl From<MeanSpeed> for Speed {
    fn from(MeanSpeed { log_ratio, common_std, .. }: MeanSpeed) -> Self {
        Self { log_ratio, common_std, is_mean: true }
    }
}

/// Where a striker starts, seen from the given start.
#[derive(Clone, Copy)]
struct Start {
    /// To the left (m).
    aside: Measured,
    /// Ahead (m).
    along: Measured,
}

/// What the differences of most clips have in common.
struct Common {
    /// Of the speeds that show it most accurately.
    speed: Spread,
    /// Whether these are mean speeds to the impact.
    speed_is_mean: bool,
    /// Of the mean speeds alone, whether or not they are as given.
    mean_speed: Spread,
    /// The scatter of the mean speeds over the one that their standard deviations expect, at most 1.
    mean_speed_scatter: f64,
    turn: Spread,
    aside: Spread,
    along: Spread,
}

/// Compares the strikers that are seen with the given strikes; `mean_speeds` are those from the first motion to the impact,
/// and `scale_error` is the error of the lengths on the table, if one is known (as a fraction): all positions are wrong then.
pub(super) fn findings(
    clips: &[ClipTracks],
    mean_speeds: &[Option<MeanSpeed>],
    scale_error: Option<f64>,
) -> Findings {
    let given = clips.iter().zip(mean_speeds);
    let mut compared: Vec<Compared> = given.filter_map(|(clip, mean)| Compared::new(clip, *mean)).collect();
    if scale_error.is_some() {
        for compared in &mut compared {
            compared.start = None;
        }
    }
    let mut findings = Findings::default();
    while let Some(rate_hz) = compared.first().map(|compared| compared.rate_hz) {
        let (mut group, others): (Vec<_>, Vec<_>) =
            compared.into_iter().partition(|compared| is_same_rate(compared.rate_hz, rate_hz));
        share_least_error(&mut group);
        findings.add(&group, scale_error);
        compared = others;
    }
    findings
}

/// The instants of the first motion have no more of their errors in common than the error of the best known one.
fn share_least_error(group: &mut [Compared]) {
    let stds = group.iter().filter_map(|compared| compared.mean).map(|mean| mean.common_std);
    let least = stds.fold(f64::INFINITY, f64::min);
    for compared in group {
        if let Some(mean) = &mut compared.mean {
            mean.common_std = least;
            compared.speed = if compared.speed.is_mean { (*mean).into() } else { compared.speed };
        }
    }
}

impl Findings {
    /// Adds what the clips of one frame rate show.
    fn add(&mut self, group: &[Compared], scale_error: Option<f64>) {
        let common = Common::of(group);
        let n = group.len();
        if common.speed.median != 0.0 {
            let factor = common.speed.median.exp();
            let is_scale = scale_error.is_some_and(|error| (factor - 1.0 - error).abs() < SAME_FACTOR);
            if !is_scale {
                let text = rate_or_speed(common.speed.n, (factor, common.speed_is_mean), group[0].rate_hz);
                self.warnings.push(Warning::new(Cause::FrameRate, text));
            }
        }
        if common.turn.median != 0.0 {
            self.turned = true;
            let aside = degrees(common.turn.median);
            let text = format!(
                "in {n} clips the striker moves {aside} of the given heading (median): strike.heading_rad or the robot's table frame is rotated"
            );
            self.warnings.push(Warning::new(Cause::GivenStrike, text));
        }
        if common.aside.median != 0.0 || common.along.median != 0.0 {
            let displaced = displacement(common.aside.median, common.along.median);
            let lengths = error_of_lengths(group).map_or(String::new(), |error| or_lengths(1.0 + error));
            let text = format!(
                "in {n} clips the striker starts {displaced} the given start (median): strike.start_m or the robot's table frame is \
                 displaced{lengths}"
            );
            self.warnings.push(Warning::new(Cause::GivenStrike, text));
        }
        for compared in group {
            let name = &compared.clip.name;
            let speeds = compared.seen.zip(compared.mean).map(|(seen, mean)| [seen, mean.log_ratio]);
            if speeds.is_some_and(|speeds| is_other_followed(speeds, common.speed.median)) {
                self.others_followed.insert(name.clone());
            }
            match compared.finding(&common) {
                Some(text) => {
                    self.clips.insert(name.clone());
                    self.warnings.push(Warning::of_clip(Cause::GivenStrike, name, text));
                }
                None if common.is_nothing() && compared.turn.is_some() => {
                    self.as_given.insert(name.clone());
                }
                None => {}
            }
        }
    }
}

/// The speed of a striker over the given one, or the mean speed to the impact, for people.
fn motion(ratio: f64, is_mean: bool) -> String {
    if is_mean {
        format!("takes {:.2} times as long as given from its first motion to the impact", 1.0 / ratio)
    } else {
        format!("moves {ratio:.2} times as fast as given")
    }
}

/// The warning that all strikers are this factor as fast as given in films of this frame rate.
fn rate_or_speed(n: usize, (factor, is_mean): (f64, bool), rate_hz: f64) -> String {
    let (percent, direction) = (100.0 * (1.0 / factor - 1.0), if factor < 1.0 { "high" } else { "low" });
    let (said_hz, true_hz) = (usual_hz(rate_hz), rate_hz / factor);
    let speeds = format!("strike.speed_m_s is {:.0} % too {direction} in all of them", percent.abs());
    let causes = if let Some(usual_hz) = usual_within(true_hz, USUAL_RATE) {
        format!(
            "probably the films were taken at {usual_hz} frames/s where their files say {said_hz}, then write frame_rate_hz = {usual_hz}; \
             otherwise {speeds}"
        )
    } else {
        let true_hz = usual_hz(true_hz);
        format!(
            "probably {speeds}; otherwise the films were taken at {true_hz} frames/s, which is no usual rate, where their files say \
             {said_hz}: then write frame_rate_hz = {true_hz}"
        )
    };
    let is_length = (factor - 1.0).abs() < LENGTH_ERROR;
    let lengths = match (is_mean, is_length) {
        (true, _) => "; or lengths on the table are wrong: check the centres of the tags".to_owned(),
        (false, true) => or_lengths(factor),
        (false, false) => String::new(),
    };
    let late = if is_mean && factor < 1.0 { "; or the robot reaches its speed late" } else { "" };
    let motion = motion(factor, is_mean);
    format!("in {n} clips the striker {motion} (median): {causes}{lengths}{late}")
}

/// The cause, beside others, that all lengths on the table are this factor of the true ones.
fn or_lengths(factor: f64) -> String {
    let (percent, size) = (100.0 * (factor - 1.0).abs(), if factor < 1.0 { "small" } else { "large" });
    format!("; or lengths on the table are {percent:.0} % too {size}: check the centres of the tags")
}

/// The error of all lengths on the table (as a fraction) that explains the displacements of the starts from the given ones as well as one
/// displacement does: each is then along the position from the origin of the table frame.
fn error_of_lengths(group: &[Compared]) -> Option<f64> {
    let displaced = |c: &Compared| {
        let (given, seen) = (c.strike.start_m, c.clip.tracks.striker.as_ref()?.start_m?);
        Some((given.to_vec(), seen - given, 2.0 * c.start?.aside.std.powi(2)))
    };
    let all: Vec<(Vec2, Vec2, f64)> = group.iter().filter_map(displaced).collect();
    let squares_m2: f64 = all.iter().map(|(at, ..)| at.length_squared()).sum();
    let error = all.iter().map(|(at, by, _)| at.dot(*by)).sum::<f64>() / squares_m2;
    let mean = all.iter().fold(Vec2::ZERO, |sum, (_, by, _)| sum + *by) / all.len() as f64;
    let noise_m2: f64 = all.iter().map(|(.., variance)| variance).sum();
    let left_m2: f64 = all.iter().map(|(at, by, _)| (*by - *at * error).length_squared()).sum();
    let left_by_mean_m2: f64 = all.iter().map(|(_, by, _)| (*by - mean).length_squared()).sum();
    (error.abs() < LENGTH_ERROR && left_m2 <= left_by_mean_m2 + noise_m2).then_some(error)
}

/// A displacement for people.
fn displacement(left_m: f64, ahead_m: f64) -> String {
    let part = |m: f64, positive: &str, negative: &str| {
        let side = if m > 0.0 { positive } else { negative };
        (m != 0.0).then(|| format!("{:.1} mm {side}", 1e3 * m.abs()))
    };
    let parts = [part(left_m, "to the left of", "to the right of"), part(ahead_m, "ahead of", "behind")];
    parts.into_iter().flatten().collect::<Vec<_>>().join(" and ")
}

impl<'a> Compared<'a> {
    /// The comparison by the striker that is seen, and by its mean speed to the impact where it is not seen at rest, its speed is known far worse, or
    /// contradicts the mean speed, which is nearer to the given one: what is seen may be the arm above it, whose height nothing shows. It is certainly
    /// not the striker if it is not as fast.
    fn new(clip: &'a ClipTracks, mean: Option<MeanSpeed>) -> Option<Self> {
        let (strike, rate_hz) = (clip.strike.as_ref()?, clip.frame_rate_hz()?);
        let seen = clip.tracks.striker.as_ref().and_then(|seen| Self::with_seen(clip, strike, rate_hz, seen));
        let seen = seen.map(|seen| Self { mean, ..seen });
        let is_better = |mean: &MeanSpeed| {
            let is_worse = |seen: &Self| MORE_ACCURATE * mean.log_ratio.std < seen.speed.log_ratio.std;
            let is_other = |seen: &Self| is_other_followed([seen.speed.log_ratio, mean.log_ratio], 0.0);
            seen.as_ref().is_none_or(|seen| seen.start.is_none() || is_worse(seen) || is_other(seen))
        };
        let Some(better) = mean.filter(is_better) else { return seen };
        let seen_speed = seen.as_ref().map(|seen| seen.speed.log_ratio);
        let is_striker = |seen: &Self| is_as_fast(seen.speed.log_ratio, better.log_ratio);
        let (turn, start) = seen.filter(is_striker).map_or((None, None), |seen| (seen.turn, seen.start));
        Some(Self { clip, strike, rate_hz, speed: better.into(), mean, seen: seen_speed, turn, start })
    }

    fn with_seen(
        clip: &'a ClipTracks,
        strike: &'a Strike,
        rate_hz: f64,
        seen: &StrikerTrack,
    ) -> Option<Self> {
        let (speed, heading) = (seen.speed_m_s(), seen.heading_rad());
        let ratio = speed.value / strike.speed_m_s;
        let turn = Measured { value: wrapped_rad(heading.value - strike.heading_rad), ..heading };
        let log_ratio = Measured { value: ratio.ln(), std: speed.std / speed.value };
        let is_known = ratio.is_finite() && ratio > 0.0 && turn.value.is_finite() && turn.std.is_finite();
        is_known.then(|| Self {
            clip,
            strike,
            rate_hz,
            speed: Speed { log_ratio, common_std: seen.scale_std, is_mean: false },
            mean: None,
            seen: Some(log_ratio),
            turn: Some(turn),
            start: start(strike, seen),
        })
    }

    /// How far the logarithm of the speed is off that of most clips, if its deviation does not explain it.
    fn speed_off(&self, common: &Common) -> Option<f64> {
        if self.speed.is_mean && common.mean_speed.n >= LEAST_MEAN_SPEEDS {
            self.mean_speed_off(common)
        } else {
            common.speed.off(self.speed.log_ratio, LEAST_SPEED_ERROR, STDS)
        }
    }

    /// The same of the mean speed. Mean speeds of several clips are compared with each other: what they have in common cancels.
    fn mean_speed_off(&self, common: &Common) -> Option<f64> {
        let mean = self.mean.filter(|_| common.mean_speed.n >= LEAST_MEAN_SPEEDS)?;
        let own = Measured { std: common.mean_speed_scatter * mean.own_std(), ..mean.log_ratio };
        common.mean_speed.off(own, LEAST_SPEED_ERROR, MEAN_SPEED_STDS)
    }

    /// A given speed that is wrong, for people; `is_mean` if the mean speed shows it.
    fn wrong_speed(&self, off: f64, is_mean: bool) -> String {
        let (ratio, given) = (off.exp(), self.strike.speed_m_s);
        let or_rate = usual_within(self.rate_hz / ratio, USUAL_RATE).map_or(String::new(), |true_hz| {
            let said_hz = usual_hz(self.rate_hz);
            format!(", or the film was taken at {true_hz} frames/s where its file says {said_hz}: then write frame_rate_hz = {true_hz}")
        });
        let or_start = self.mean.filter(|_| is_mean).map_or(String::new(), |mean| {
            let (mm, side) =
                (1e3 * mean.distance_m * (1.0 / ratio - 1.0), if ratio < 1.0 { "back" } else { "ahead" });
            format!(", or a start_m {:.1} mm further {side}", mm.abs())
        });
        let (motion, fits) = (motion(ratio, is_mean), ratio * given);
        format!("{motion}: strike.speed_m_s is {given:.3}, and {fits:.3} would fit{or_start}{or_rate}")
    }

    /// What is wrong with the given strike beside what is wrong in most clips.
    fn finding(&self, common: &Common) -> Option<String> {
        let Self { strike, .. } = self;
        let mut findings = Vec::new();
        let off = |spread: &Spread, value: Option<Measured>| {
            value.and_then(|value| spread.off(value, LEAST_OFFSET_M, STDS)).unwrap_or(0.0)
        };
        let aside_m = off(&common.aside, self.start.map(|start| start.aside));
        let along_m = off(&common.along, self.start.map(|start| start.along));
        if let Some(off) = self.speed_off(common) {
            findings.push(self.wrong_speed(off, self.speed.is_mean));
        } else if along_m == 0.0
            && let Some(off) = self.mean_speed_off(common)
        {
            findings.push(self.wrong_speed(off, true));
        }
        if let Some(off) = self.turn.and_then(|turn| common.turn.off(turn, LEAST_TURN_RAD, STDS)) {
            let (aside, given, fits) =
                (degrees(off), strike.heading_rad, wrapped_rad(strike.heading_rad + off));
            findings.push(format!(
                "moves {aside} of the given heading: strike.heading_rad is {given:.3}, and {fits:.3} would fit"
            ));
        }
        if aside_m != 0.0 || along_m != 0.0 {
            let ahead = Vec2::from_heading(strike.heading_rad);
            let fits = strike.start_m + ahead * along_m + ahead.perpendicular() * aside_m;
            let (displaced, given) = (displacement(aside_m, along_m), strike.start_m);
            let shown = |at: Point| format!("[{:.4}, {:.4}]", at.x, at.y);
            findings.push(format!(
                "starts {displaced} the given start: strike.start_m is {}, and {} would fit",
                shown(given),
                shown(fits)
            ));
        }
        (!findings.is_empty()).then(|| format!("the striker is seen: it {}", findings.join("; it ")))
    }
}

/// Whether two logarithms of speeds agree within their standard deviations.
fn is_as_fast(one: Measured, other: Measured) -> bool {
    (one.value - other.value).abs() < SAME_SPEED_STDS * one.std.hypot(other.std)
}

/// Whether what is seen is not as fast as the striker: of the logarithms of its speed and of the mean speed to the impact over the given one, the latter
/// is nearer to the common error of the given speeds. Where what is seen is as fast as given instead, the distance to the impact is wrong.
fn is_other_followed([seen, mean]: [Measured; 2], common: f64) -> bool {
    !is_as_fast(seen, mean) && (mean.value - common).abs() < (seen.value - common).abs()
}

/// Where the striker starts, if it is seen at rest. A line of positions alone does not show it: they may be those of a part above the striker.
fn start(strike: &Strike, seen: &StrikerTrack) -> Option<Start> {
    let ahead = Vec2::from_heading(strike.heading_rad);
    let displacement = seen.start_m? - strike.start_m;
    let (_, std) = seen.middle();
    let aside = Measured { value: displacement.dot(ahead.perpendicular()), std };
    Some(Start { aside, along: Measured { value: displacement.dot(ahead), std } })
}

/// The scatter of speeds about their median over the one that their own standard deviations expect, at most 1. The standard deviations hold for any robot
/// and any outlines: films of one robot that agree better show that theirs are smaller. The expected scatter has the weight of
/// `SCATTER_WEIGHT` films; the median of the deviations leaves a wrong speed out.
fn scatter(means: &[MeanSpeed], middle: f64) -> f64 {
    let n = means.len() as f64;
    let deviation = median(means.iter().map(|mean| ((mean.log_ratio.value - middle) / mean.own_std()).abs()));
    let shown = deviation.map_or(1.0, |deviation| (STD_OVER_MEDIAN_ABSOLUTE * deviation).powi(2));
    ((SCATTER_WEIGHT + n * shown) / (SCATTER_WEIGHT + n)).sqrt().min(1.0)
}

impl Common {
    /// Whether most strikers move as given.
    fn is_nothing(&self) -> bool {
        [&self.speed, &self.turn, &self.aside, &self.along].iter().all(|spread| spread.median == 0.0)
    }

    fn of(group: &[Compared]) -> Self {
        let of = |values: Vec<Measured>, least: f64, common_std: Option<f64>| {
            let mut spread = Spread::of(values.iter().map(|m| m.value));
            let alike = |m: &&Measured| (m.value - spread.median).abs() < least.max(STDS * m.std);
            let n = values.iter().filter(alike).count();
            // One clip has nothing in common, and what is accurate enough is taken as exact.
            let is_common = n > 1 && n as f64 >= MOST * values.len() as f64 && 4 * n >= group.len();
            let error = common_std.or_else(|| median(values.iter().map(|m| m.std))).unwrap_or(0.0);
            if !is_common || spread.median.abs() < least.max(COMMON_STDS * error) {
                spread.median = 0.0;
            }
            spread
        };
        let speeds = Self::most_accurate_speeds(group);
        let speed_std = middle(&speeds).map(|middle| middle.std);
        let turns = group.iter().filter_map(|c| c.turn).collect();
        let of_starts = |value: fn(Start) -> Measured| {
            of(group.iter().filter_map(|c| c.start).map(value).collect(), LEAST_OFFSET_M, None)
        };
        let mean_speeds: Vec<MeanSpeed> = group.iter().filter_map(|c| c.mean).collect();
        let mean_speed = Spread::of(mean_speeds.iter().map(|mean| mean.log_ratio.value));
        Self {
            speed: of(speeds.iter().map(|speed| speed.log_ratio).collect(), LEAST_SPEED_ERROR, speed_std),
            speed_is_mean: 2 * speeds.iter().filter(|speed| speed.is_mean).count() > speeds.len(),
            mean_speed_scatter: scatter(&mean_speeds, mean_speed.median),
            mean_speed,
            turn: of(turns, LEAST_TURN_RAD, None),
            aside: of_starts(|start| start.aside),
            along: of_starts(|start| start.along),
        }
    }

    /// The speeds that show best what all have in common: those of strikers that are seen at rest, because the rest positions show the height
    /// of what is followed, or the mean speeds of the other clips; those of all clips, if there are too few of both. What is seen may be something else
    /// than the striker: where all mean speeds contradict it, and are nearer to the given speeds, these count.
    fn most_accurate_speeds(group: &[Compared]) -> Vec<Speed> {
        let is_enough = |speeds: &Vec<Speed>| speeds.len() > 1 && 4 * speeds.len() >= group.len();
        let std = |speeds: &Vec<Speed>| middle(speeds).map_or(f64::INFINITY, |middle| middle.std);
        let those = |is_in: fn(&&Compared) -> bool| -> Vec<Speed> {
            group.iter().filter(is_in).map(|compared| compared.speed).collect()
        };
        let kinds = [those(|c| c.start.is_some() && !c.speed.is_mean), those(|c| c.speed.is_mean)];
        let enough = kinds.into_iter().filter(is_enough);
        let chosen = enough.min_by(|a, b| std(a).total_cmp(&std(b))).unwrap_or_else(|| those(|_| true));
        let means: Vec<Speed> = group.iter().filter_map(|c| c.mean).map(Speed::from).collect();
        let contradicts = |means: &Vec<Speed>| {
            let middles = middle(&chosen).zip(middle(means));
            is_enough(means) && middles.is_some_and(|(seen, mean)| is_other_followed([seen, mean], 0.0))
        };
        Some(means).filter(contradicts).unwrap_or(chosen)
    }
}

/// The median of speeds. Its standard deviation is that of the noise of all of them, and of what more clips do not reduce because it is wrong in all alike,
/// the height of the outline or the instant of the first motion.
fn middle(speeds: &[Speed]) -> Option<Measured> {
    let own = speeds.iter().map(|speed| own_std(speed.log_ratio.std, speed.common_std));
    let noise = median(own)? / (speeds.len() as f64).sqrt();
    let common_std = median(speeds.iter().map(|speed| speed.common_std))?;
    let value = median(speeds.iter().map(|speed| speed.log_ratio.value))?;
    Some(Measured { value, std: noise.hypot(common_std) })
}

impl Spread {
    /// How far a value is off the median, if that is more than `stds` of its own standard deviations, the spread and `least` explain.
    fn off(&self, value: Measured, least: f64, stds: f64) -> Option<f64> {
        let off = value.value - self.median;
        (off.abs() > self.tolerance(least).max(stds * value.std)).then_some(off)
    }
}
