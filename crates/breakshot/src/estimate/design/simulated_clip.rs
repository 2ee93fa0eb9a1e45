//! A clip that nobody filmed: what a camera would see of a strike if the objects were as the properties say.
//!
//! The simulator moves the objects, a camera of given frame rate and noise looks at them.  Advice on what to film next and
//! tests with known truth are made of such clips.

use crate::detect::{Sample, Track, Tracks};
use crate::error::{Error, Result};
use crate::estimate::clip_tracks::ClipTracks;
use crate::object::{Object, Shape};
use crate::physics::{self, Trajectory};
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;

/// How a staged clip is filmed: with an infinitely short exposure, every object in every frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filming {
    /// Frames per second.
    pub frame_rate_hz: f64,
    /// One standard deviation of a position's noise along each axis, and what the track claims (m).
    pub place_std_m: f64,
    /// One standard deviation of a yaw's noise, for objects whose marker is no disc (rad).
    pub yaw_std_rad: f64,
    /// The noise's seed; without one the positions are exact.
    pub seed: Option<u64>,
}

/// The clip begins this long before the striker starts and ends this long after everything rests (s).
const LEAD_S: f64 = 0.2;
const TAIL_S: f64 = 0.2;

impl Filming {
    fn check(&self) -> Result<()> {
        crate::object::positive("filming", "frame_rate_hz", self.frame_rate_hz)?;
        crate::object::positive("filming", "place_std_m", self.place_std_m)?;
        if !(self.yaw_std_rad >= 0.0 && self.yaw_std_rad.is_finite()) {
            return Err(Error::invalid("filming", "yaw_std_rad", self.yaw_std_rad, "zero or more"));
        }
        Ok(())
    }
}

/// The tracks of a clip of this strike, its objects in the scene's order.
///
/// # Errors
/// Whatever cannot be simulated; a frame rate or noise that is not positive.
pub fn staged(
    name: &str,
    scene: &Scene,
    properties: &Properties,
    strike: &Strike,
    filming: &Filming,
) -> Result<ClipTracks> {
    filming.check()?;
    let trajectory = physics::trajectory(scene, properties, strike, &physics::Options::default())?;
    let mut random = filming.seed.map(Pcg64Mcg::seed_from_u64);
    let mut noise = move || random.as_mut().map_or(0.0, |r| StandardNormal.sample(r));
    let frames = ((LEAD_S + trajectory.duration_s + TAIL_S) * filming.frame_rate_hz).ceil() as usize;
    let tracks = scene.placed.iter().map(|placed| {
        let object = scene.object(&placed.object)?;
        let samples =
            (0..=frames).map(|k| sample(&trajectory, (&placed.object, object), (k, filming), &mut noise));
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

/// An object in frame `k`.
fn sample(
    trajectory: &Trajectory,
    (name, object): (&str, &Object),
    (k, filming): (usize, &Filming),
    noise: &mut impl FnMut() -> f64,
) -> Sample {
    let time_s = k as f64 / filming.frame_rate_hz;
    let pose = trajectory.pose(name, time_s - LEAD_S).unwrap_or_default();
    let told = !matches!(object.feature().shape, Shape::Disc { .. });
    Sample {
        time_s,
        x_m: pose.position.x + filming.place_std_m * noise(),
        y_m: pose.position.y + filming.place_std_m * noise(),
        yaw_rad: told.then(|| pose.yaw_rad + filming.yaw_std_rad * noise()),
        vx_m_s: None,
        vy_m_s: None,
        yaw_rate_rad_s: None,
        ax_m_s2: None,
        ay_m_s2: None,
        std_m: filming.place_std_m,
        doubtful: false,
    }
}
