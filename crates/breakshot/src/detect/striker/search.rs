//! Which of the changes along the outline are the striker on its path?
//!
//! Every frame has several points at which the outline has changed: the striker itself, its rest position, which it has left, parts of
//! the arm and shadows. Those of the striker lie on a straight line at equal speed, from its rest position on. Of several such lines the
//! strongest one near the given strike counts.

use crate::geometry::{Point, Vec2};
use crate::scene::Strike;

/// A point of the strike frame at which the outline has changed in one frame.
#[derive(Clone, Copy)]
pub(super) struct Peak {
    pub frame: usize,
    pub at: Point,
    pub strength: f64,
}

/// A motion at constant velocity in the strike frame.
#[derive(Clone, Copy)]
pub(super) struct UniformMotion {
    pub at: Point,
    pub time_s: f64,
    pub velocity: Vec2,
}

/// A uniform motion that explains peaks of several frames.
pub(super) struct Candidate {
    pub motion: UniformMotion,
    /// The rest position from which it starts.
    pub rest: Option<Point>,
    /// Sum of the strengths of its peaks, and the same weighted by how well it fits the given strike.
    strength: f64,
    score: f64,
}

/// The first object that is displaced, in the strike frame.
#[derive(Clone, Copy)]
pub(super) struct Struck {
    /// The time at which its displacement is seen (s).
    pub time_s: f64,
    /// Where its centroid was before.
    pub at: Point,
    /// The largest distance of its centroid from the striker's while the two touch (m).
    pub reach_m: f64,
}

/// What is searched, and where.
#[derive(Clone, Copy)]
pub(super) struct Searched<'a> {
    pub peaks: &'a [Peak],
    pub times_s: &'a [f64],
    /// Frames before the impact: only the striker moves in them.
    pub before_impact: usize,
    pub struck: Option<Struck>,
    /// The last time at which nothing had moved (s).
    pub still_s: f64,
    pub strike: &'a Strike,
    /// The point of the table below the camera, in the strike frame; `None` for a camera without a pose.
    pub below_camera: Option<Point>,
    /// Distance within which a peak belongs to a motion (m).
    pub tolerance_m: f64,
}

/// The scatter of positions in shade, of a striker that is cut off by shadows or by its arm, over the step of the grid.
const ASSUMED_STD_NODES: f64 = 0.6;
/// Speeds over the given one, and largest difference of the headings (rad), that are searched: films may play at a wrong rate.
const SPEED_RATIOS: std::ops::RangeInclusive<f64> = 0.1..=8.0;
const MOST_TURN_RAD: f64 = 0.4;
/// How far the given strike may be off, as in a distribution with long tails: aside and along (m), and in its heading (rad).
const ASIDE_M: f64 = 0.006;
const ALONG_M: f64 = 0.012;
const TURN_RAD: f64 = 0.15;
/// The weight of a motion whose rest position is not seen.
const WITHOUT_REST: f64 = 0.4;
/// A part above the striker's foot is seen so far from it (m), away from the camera within this deviation (1); the displacement along
/// one axis shows it if the axis has this part of that direction.
const ELEVATED_M: f64 = 0.005;
const OUTWARD_DEVIATION: f64 = 0.4;
const OUTWARD_PART: f64 = 0.25;
/// A striker further than this from the struck object (m) when this is seen to move is not its foot.
const APART_M: f64 = 0.01;
/// The part of the difference in speed from which it is one: its outline differs from the foot's.
const ELEVATED_SPEED: f64 = 0.3;
/// A speed within this fraction of the given one is as given, and a motion of this part of another one's strength about as strong.
const AS_GIVEN: f64 = 0.025;
const AS_STRONG: f64 = 0.7;
/// Frames that a motion needs, with and without a rest position from which it starts.
const LEAST_FRAMES: [usize; 2] = [2, 3];
/// The part of the frames between its first and its last one in which it must be seen, and the mean strength there.
pub(super) const LEAST_PART: f64 = 0.6;
const LEAST_STRENGTH: f64 = 0.3;

impl UniformMotion {
    /// The position at a time (s).
    pub(super) fn at(&self, time_s: f64) -> Point {
        self.at + self.velocity * (time_s - self.time_s)
    }

    /// The motion through points at times by least squares; `None` for one point.
    pub(super) fn through(points: &[(f64, Point)]) -> Option<Self> {
        let n = points.len() as f64;
        let time_s = points.iter().map(|(t, _)| t).sum::<f64>() / n;
        let sum = points.iter().fold(Vec2::ZERO, |sum, (_, at)| sum + at.to_vec());
        let at = Point::ORIGIN + sum / n;
        let squares_s2: f64 = points.iter().map(|(t, _)| (t - time_s).powi(2)).sum();
        let product = points.iter().fold(Vec2::ZERO, |sum, (t, p)| sum + (*p - at) * (t - time_s));
        (squares_s2 > 0.0).then(|| Self { at, time_s, velocity: product / squares_s2 })
    }

    /// The standard deviation of positions along each axis about the motion that was fitted to them (m), on a grid of this step.
    pub(super) fn scatter_m(&self, positions: &[(f64, Point)], step_m: f64) -> f64 {
        let squares_m2: f64 = positions.iter().map(|(t, p)| (*p - self.at(*t)).length_squared()).sum();
        // A line has four parameters.  Few residuals may be small by chance, and two positions leave none: the assumed scatter
        // counts as one more.
        let freedom = 2.0 * positions.len() as f64 - 4.0;
        let assumed_m = ASSUMED_STD_NODES * step_m;
        ((squares_m2 + assumed_m.powi(2)) / (freedom + 1.0)).sqrt()
    }

    /// How well the motion fits the line of the given strike, 1 at best.
    fn weight(&self) -> f64 {
        tail(self.aside_m() / ASIDE_M) * tail(self.velocity.heading_rad() / TURN_RAD)
    }

    /// How far to the left of the given start its line passes (m).
    fn aside_m(&self) -> f64 {
        self.at.y - self.velocity.y / self.velocity.x * self.at.x
    }
}

impl Searched<'_> {
    /// The motion that is probably the striker's.
    pub(super) fn best(&self) -> Option<Candidate> {
        let nearest = self.nearest()?;
        let foot = self.foot_below(&nearest);
        Some(foot.unwrap_or(nearest))
    }

    /// The strongest motion near the given strike.
    fn nearest(&self) -> Option<Candidate> {
        let early: Vec<&Peak> = self.peaks.iter().filter(|peak| peak.frame < self.before_impact).collect();
        let mut best: Option<Candidate> = None;
        for (k, later) in early.iter().enumerate() {
            for earlier in &early[..k] {
                let pair = [earlier, later].map(|peak| (self.times_s[peak.frame], peak.at));
                let Some(motion) = UniformMotion::through(&pair).filter(|m| self.is_possible(m)) else {
                    continue;
                };
                // The strength of a frame is at most 1, and refitting hardly changes the weight.
                let bound = self.before_impact as f64 * motion.weight();
                if best.as_ref().is_some_and(|best| best.score >= bound) {
                    continue;
                }
                if let Some(candidate) = self.candidate(&motion)
                    && best.as_ref().is_none_or(|best| candidate.score > best.score)
                {
                    best = Some(candidate);
                }
            }
        }
        best
    }

    fn is_possible(&self, motion: &UniformMotion) -> bool {
        let ratio = motion.velocity.length() / self.strike.speed_m_s;
        SPEED_RATIOS.contains(&ratio) && motion.velocity.heading_rad().abs() < MOST_TURN_RAD
    }

    /// The motion refitted to its peaks, with its score.
    fn candidate(&self, rough: &UniformMotion) -> Option<Candidate> {
        let matched = self.matched(rough, self.before_impact);
        let points: Vec<(f64, Point)> = matched.iter().map(|p| (self.times_s[p.frame], p.at)).collect();
        let motion = UniformMotion::through(&points).filter(|m| self.is_possible(m))?;
        let matched = self.matched(&motion, self.before_impact);
        let (first, last) = (matched.first()?.frame, matched.last()?.frame);
        let n = matched.len();
        let strength: f64 = matched.iter().map(|peak| peak.strength).sum();
        let is_seen =
            n as f64 >= LEAST_PART * (last - first + 1) as f64 && strength >= LEAST_STRENGTH * n as f64;
        let rest = self.rest(&motion, first);
        if self.is_elevated(&motion, rest) || !is_seen || n < LEAST_FRAMES[usize::from(rest.is_none())] {
            return None;
        }
        let near_rest = rest.map_or(WITHOUT_REST, |rest| tail(rest.x / ALONG_M));
        let closeness = |peak: &Peak| {
            let off = motion.at(self.times_s[peak.frame]).distance(peak.at) / self.tolerance_m;
            peak.strength * (1.0 - off * off)
        };
        let score = matched.iter().map(closeness).sum::<f64>() * motion.weight() * near_rest;
        Some(Candidate { motion, rest, strength, score })
    }

    /// The motion of the striker's foot if another one is that of a part above it: that one is faster than given, and the foot's is as fast
    /// as given, about as strong, and nearer to the point below the camera by about as much. The given start is wrong then.
    fn foot_below(&self, part: &Candidate) -> Option<Candidate> {
        let below = self.below_camera?;
        let ratio = |motion: &UniformMotion| motion.velocity.length() / self.strike.speed_m_s;
        if ratio(&part.motion) - 1.0 < AS_GIVEN {
            return None;
        }
        let at = part.motion.at;
        let is_foot = |motion: &UniformMotion| {
            let foot = motion.at(part.motion.time_s);
            let Some(outward) = (foot - below).direction() else { return false };
            let displaced_m = (at - foot).dot(outward);
            let excess = displaced_m / foot.distance(below);
            let faster = ratio(&part.motion) / ratio(motion) - 1.0;
            displaced_m > ELEVATED_M
                && (at - foot).cross(outward).abs() < OUTWARD_DEVIATION * displaced_m
                && faster > ELEVATED_SPEED * excess
                && faster < excess / ELEVATED_SPEED
                && (ratio(motion) - 1.0).abs() < AS_GIVEN
        };
        let early: Vec<&Peak> = self.peaks.iter().filter(|peak| peak.frame < self.before_impact).collect();
        let pairs = (0..early.len()).flat_map(|k| (0..k).map(move |j| (j, k)));
        let motions = pairs.filter_map(|(j, k)| {
            let pair = [early[j], early[k]].map(|peak| (self.times_s[peak.frame], peak.at));
            UniformMotion::through(&pair).filter(|motion| self.is_possible(motion) && is_foot(motion))
        });
        let candidates = motions.filter_map(|motion| self.candidate(&motion));
        let feet = candidates.filter(|c| is_foot(&c.motion) && c.strength > AS_STRONG * part.strength);
        feet.max_by(|a, b| a.strength.total_cmp(&b.strength))
    }

    /// Whether this is probably not the striker's foot but a part above it. The camera sees such a part displaced away from the point
    /// below the camera, and faster by the same factor. It may be far from the struck object when the foot touches this.
    pub(super) fn is_elevated(&self, motion: &UniformMotion, rest: Option<Point>) -> bool {
        let is_apart =
            |struck: Struck| motion.at(struck.time_s).distance(struck.at) > struck.reach_m + APART_M;
        if self.struck.is_some_and(is_apart) {
            return true;
        }
        let Some(below) = self.below_camera else { return false };
        let outward = rest.unwrap_or(motion.at) - below;
        let distance_m = outward.length();
        let Some(outward) = outward.direction() else { return false };
        let ratio = motion.velocity.length() / self.strike.speed_m_s;
        let along = rest.map(|rest| (rest.x, outward.x));
        [Some((motion.aside_m(), outward.y)), along].into_iter().flatten().any(|(displaced_m, part)| {
            let outward_m = displaced_m / part;
            let factor = 1.0 + outward_m / distance_m;
            let is_faster = ratio - 1.0 > ELEVATED_SPEED * (factor - 1.0);
            part.abs() > OUTWARD_PART && outward_m > ELEVATED_M && is_faster
        })
    }

    /// The strongest peak of each frame that belongs to a motion.
    fn matched(&self, motion: &UniformMotion, frames: usize) -> Vec<Peak> {
        let mut matched: Vec<Peak> = Vec::new();
        let near = |peak: &&Peak| {
            peak.frame < frames && motion.at(self.times_s[peak.frame]).distance(peak.at) < self.tolerance_m
        };
        for peak in self.peaks.iter().filter(near) {
            match matched.last_mut() {
                Some(last) if last.frame == peak.frame => {
                    if peak.strength > last.strength {
                        *last = *peak;
                    }
                }
                _ => matched.push(*peak),
            }
        }
        matched
    }

    /// The point on the line of a motion, behind its first frame, that has changed in most frames: its rest position.
    fn rest(&self, motion: &UniformMotion, first: usize) -> Option<Point> {
        let direction = motion.velocity.direction()?;
        let from = motion.at(self.times_s[first]);
        let longest_m = motion.velocity.length() * (self.times_s[first] - self.still_s) + self.tolerance_m;
        let is_on_line = |peak: &&Peak| {
            let back = from - peak.at;
            let along_m = back.dot(direction);
            back.cross(direction).abs() < self.tolerance_m
                && (-self.tolerance_m..longest_m).contains(&along_m)
        };
        let on_line: Vec<&Peak> = self.peaks.iter().filter(is_on_line).collect();
        let around = |centre: &Peak| {
            let near = on_line.iter().filter(|p| p.at.distance(centre.at) < self.tolerance_m);
            // A frame counts once.
            let mut frames: Vec<usize> = near.map(|peak| peak.frame).collect();
            frames.dedup();
            frames.len()
        };
        let (count, centre) = on_line.iter().fold((0, None), |best, peak| {
            let count = around(peak);
            if count > best.0 { (count, Some(peak.at)) } else { best }
        });
        let others = self.times_s.len() - first;
        (count >= 3 && 2 * count >= others).then_some(centre).flatten()
    }
}

/// 1 at 0, 1/2 at 1, and slowly to 0.
fn tail(value: f64) -> f64 {
    1.0 / (1.0 + value * value)
}
