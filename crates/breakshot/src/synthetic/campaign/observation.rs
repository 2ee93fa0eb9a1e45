//! The track that a camera and a detector would give of a simulated motion.
//!
//! Positions are averaged over the exposure; noise, a video codec that repeats an unchanged picture, hidden markers and wrong
//! detections are added.

use super::body::STEP_S;
use super::spec::CampaignSpec;
use super::truth::normal;
use super::world::PoseHistory;
use crate::detect::{Sample, Track};
use crate::geometry::Point;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// Length of a clip (s).
pub(super) const CLIP_S: f64 = 1.1;
/// Number of instants of the exposure that are averaged.
const EXPOSURE_INSTANTS: usize = 16;
/// Noise of a bar's yaw over the noise of its position: one over half the bar's length (rad/m).
const YAW_PER_POSITION: f64 = 150.0;
/// Number of frames for which a hidden marker stays hidden.
const HIDDEN_FRAMES: usize = 4;
/// Largest error of a wrong position (m).
const OUTLIER_M: f64 = 2e-3;
/// The standard deviation that the detector reports is wrong by up to this factor.
const CLAIM_FACTOR: f64 = 1.4;

/// The track of one body.
pub(super) fn track(history: &PoseHistory, spec: &CampaignSpec, random: &mut Pcg64Mcg) -> Track {
    let std_m = spec.noise_m * random.random_range((1.0 / CLAIM_FACTOR).ln()..CLAIM_FACTOR.ln()).exp();
    let mut offset = [0.0; 3];
    let mut was_still = false;
    let mut hidden = 0;
    let mut samples = Vec::new();
    let frames = (CLIP_S / spec.frame_s) as usize;
    for frame in 0..frames {
        let time_s = (frame as f64 + 0.5) * spec.frame_s;
        let exposure_s = spec.exposure_frames * spec.frame_s;
        let pose = mean_pose(history, time_s, exposure_s);
        // Noise: independent while the body moves, mostly a constant offset while it rests.
        let still = history.is_still(time_s);
        let mut fresh = || [0; 3].map(|_| normal(random));
        if still && !was_still {
            offset = fresh();
        }
        was_still = still;
        let independent = if still { spec.still_noise } else { 1.0 };
        let constant = (1.0 - independent * independent).sqrt();
        let mut noise = fresh();
        for (noise, offset) in noise.iter_mut().zip(offset) {
            *noise = spec.noise_m * (independent * *noise + constant * offset);
        }
        // Wrong detections and hidden markers.
        if random.random_bool(spec.outlier_fraction) {
            noise[0] += OUTLIER_M * random.random_range(0.3..1.0);
        }
        if hidden == 0 && random.random_bool(spec.hidden_fraction / HIDDEN_FRAMES as f64) {
            hidden = HIDDEN_FRAMES;
        }
        if hidden > 0 {
            hidden -= 1;
            continue;
        }
        let position = Point::new(pose[0] + noise[0], pose[1] + noise[1]);
        let yaw_rad = history.yaw_visible.then(|| pose[2] + YAW_PER_POSITION * noise[2]);
        samples.push(Sample::new(time_s, position, yaw_rad, std_m));
    }
    Track { object: history.object.clone(), samples }
}

/// The mean pose over an exposure centred at `time_s`.
fn mean_pose(history: &PoseHistory, time_s: f64, exposure_s: f64) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for instant in 0..EXPOSURE_INSTANTS {
        let fraction = (instant as f64 + 0.5) / EXPOSURE_INSTANTS as f64 - 0.5;
        let pose = history.pose(time_s + fraction * exposure_s);
        for (mean, value) in mean.iter_mut().zip(pose) {
            *mean += value / EXPOSURE_INSTANTS as f64;
        }
    }
    mean
}

impl PoseHistory {
    /// The pose at a time, interpolated linearly between time steps.
    fn pose(&self, time_s: f64) -> [f64; 3] {
        let steps = (time_s / STEP_S).max(0.0);
        let k = (steps as usize).min(self.poses.len() - 2);
        let fraction = (steps - k as f64).min(1.0);
        [0, 1, 2].map(|n| self.poses[k][n] + fraction * (self.poses[k + 1][n] - self.poses[k][n]))
    }

    /// Whether the body rests from 10 ms before to 10 ms after a time.
    fn is_still(&self, time_s: f64) -> bool {
        self.pose(time_s - 0.01) == self.pose(time_s + 0.01)
    }
}
