//! Which tracks would a clip give if the objects had these properties?
//!
//! The simulator moves the objects, and a camera of given frame rate and noise observes them.  Experimental design and tests
//! with known truth use such clips.

use crate::detect::{Sample, Track, Tracks};
use crate::error::{Error, Result, bounds};
use crate::estimate::clip_tracks::ClipTracks;
use crate::geometry::{Pose, Vec2};
use crate::object::{Object, Shape};
use crate::physics;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// The camera of a simulated clip: infinitely short exposure, every object visible in every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedCamera {
    /// Frames per second.
    pub frame_rate_hz: f64,
    /// Standard deviation of the position noise along each axis, which is also the one that the track claims (m).
    pub position_std_m: f64,
    /// Standard deviation of the yaw noise, for objects whose marker is not a disc (rad).
    pub yaw_std_rad: f64,
    /// Seed of the noise; without a seed the positions are exact.
    pub seed: Option<u64>,
}

/// Time before the striker starts and after all objects have come to rest (s).
const LEAD_S: f64 = 0.2;
const TAIL_S: f64 = 0.2;

impl SimulatedCamera {
    fn check(&self) -> Result<()> {
        bounds::positive("camera", "frame_rate_hz", self.frame_rate_hz)?;
        bounds::positive("camera", "position_std_m", self.position_std_m)?;
        if !(self.yaw_std_rad >= 0.0 && self.yaw_std_rad.is_finite()) {
            return Err(Error::invalid("camera", "yaw_std_rad", self.yaw_std_rad, "zero or more"));
        }
        Ok(())
    }
}

/// The tracks of a clip of this strike, its objects in the order of the scene.
///
/// # Errors
/// A scene or strike that cannot be simulated; a frame rate or position noise that is not positive.
pub fn simulated_clip(
    name: &str,
    scene: &Scene,
    properties: &Properties,
    strike: &Strike,
    camera: &SimulatedCamera,
) -> Result<ClipTracks> {
    camera.check()?;
    let trajectory = physics::trajectory(scene, properties, strike, &physics::Options::default())?;
    let mut random = camera.seed.map(Pcg64Mcg::seed_from_u64);
    let mut noise = move || random.as_mut().map_or(0.0, |r| StandardNormal.sample(r));
    let frames = ((LEAD_S + trajectory.duration_s + TAIL_S) * camera.frame_rate_hz).ceil() as usize;
    let tracks = scene.placed.iter().map(|placed| {
        let object = scene.object(&placed.object)?;
        let samples = (0..=frames).map(|k| {
            let time_s = k as f64 / camera.frame_rate_hz;
            let pose = trajectory.pose(&placed.object, time_s - LEAD_S).unwrap_or_default();
            camera.sample(object, pose, time_s, &mut noise)
        });
        Ok(Track { object: placed.object.clone(), samples: samples.collect() })
    });
    let tracks = tracks.collect::<Result<_>>()?;
    Ok(ClipTracks {
        name: name.into(),
        objects: scene.placed.iter().map(|p| p.object.clone()).collect(),
        strike: Some(strike.clone()),
        tracks: Tracks { version: 1, video: name.into(), tracks, ..Tracks::default() },
    })
}

impl SimulatedCamera {
    /// The noisy observation of an object; `noise` draws standard normal numbers.
    fn sample(&self, object: &Object, pose: Pose, time_s: f64, noise: &mut impl FnMut() -> f64) -> Sample {
        let yaw_visible = !matches!(object.feature().shape, Shape::Disc { .. });
        let position = pose.position + Vec2::new(noise(), noise()) * self.position_std_m;
        let yaw_rad = yaw_visible.then(|| pose.yaw_rad + self.yaw_std_rad * noise());
        Sample::new(time_s, position, yaw_rad, self.position_std_m)
    }
}
