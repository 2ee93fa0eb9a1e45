//! What the camera and the detector make of a motion.

use super::world::{Path, STEP_S};
use super::{CLIP_S, Recipe, normal};
use crate::detect::{Sample, Track};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;

/// Instants of the open shutter that are averaged.
const MOMENTS: usize = 16;
/// The noise of a bar's angle over that of its place, one over half its length (1/m).
const YAW_PER_PLACE: f64 = 150.0;
/// A hidden marker stays hidden for this many frames.
const HIDDEN_FRAMES: usize = 4;
/// By how much a wrong position is off (m).
const WRONG_M: f64 = 2e-3;
/// The detector's claims are wrong by up to this factor.
const CLAIM: f64 = 1.4;

/// The track of one body.
pub(super) fn track(path: &Path, recipe: &Recipe, random: &mut Pcg64Mcg) -> Track {
    let mut claim = || random.random_range((1.0 / CLAIM).ln()..CLAIM.ln()).exp();
    let std_m = recipe.noise_m * claim();
    let mut offset = [0.0; 3];
    let mut was_still = false;
    let mut hidden = 0;
    let mut samples = Vec::new();
    let frames = (CLIP_S / recipe.frame_s) as usize;
    for frame in 0..frames {
        let time_s = (frame as f64 + 0.5) * recipe.frame_s;
        let exposure_s = recipe.exposure_frames * recipe.frame_s;
        let pose = seen(path, time_s, exposure_s);
        let still = path.still(time_s);
        let mut fresh = || [0; 3].map(|_| normal(random));
        if still && !was_still {
            offset = fresh();
        }
        was_still = still;
        let anew = if still { recipe.still_noise } else { 1.0 };
        let kept = (1.0 - anew * anew).sqrt();
        let mut noise = fresh();
        for (noise, offset) in noise.iter_mut().zip(offset) {
            *noise = recipe.noise_m * (anew * *noise + kept * offset);
        }
        if random.random_bool(recipe.wrong) {
            noise[0] += WRONG_M * random.random_range(0.3..1.0);
        }
        if hidden == 0 && random.random_bool(recipe.hidden / HIDDEN_FRAMES as f64) {
            hidden = HIDDEN_FRAMES;
        }
        if hidden > 0 {
            hidden -= 1;
            continue;
        }
        samples.push(Sample {
            time_s,
            x_m: pose[0] + noise[0],
            y_m: pose[1] + noise[1],
            yaw_rad: path.sees_yaw.then(|| pose[2] + YAW_PER_PLACE * noise[2]),
            vx_m_s: None,
            vy_m_s: None,
            yaw_rate_rad_s: None,
            ax_m_s2: None,
            ay_m_s2: None,
            std_m,
            doubtful: false,
        });
    }
    Track { object: path.object.clone(), samples }
}

/// The mean pose over the exposure.
fn seen(path: &Path, time_s: f64, exposure_s: f64) -> [f64; 3] {
    let mut mean = [0.0; 3];
    for moment in 0..MOMENTS {
        let part = (moment as f64 + 0.5) / MOMENTS as f64 - 0.5;
        let pose = path.at(time_s + part * exposure_s);
        for (mean, value) in mean.iter_mut().zip(pose) {
            *mean += value / MOMENTS as f64;
        }
    }
    mean
}

impl Path {
    /// The pose at a time, between the world's steps on a straight line.
    fn at(&self, time_s: f64) -> [f64; 3] {
        let steps = (time_s / STEP_S).max(0.0);
        let k = (steps as usize).min(self.poses.len() - 2);
        let part = (steps - k as f64).min(1.0);
        [0, 1, 2].map(|n| self.poses[k][n] + part * (self.poses[k + 1][n] - self.poses[k][n]))
    }

    /// Whether the body rests from the frame before to the frame after.
    fn still(&self, time_s: f64) -> bool {
        self.at(time_s - 0.01) == self.at(time_s + 0.01)
    }
}
