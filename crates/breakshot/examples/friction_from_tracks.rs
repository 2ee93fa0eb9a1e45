//! Estimates the friction of two discs from the tracks of decelerating objects, and compares it with the drawn truth.
//!
//! Each track is drawn from the closed form of a slide under Coulomb friction, `x = v t - mu g t^2 / 2` until the disc
//! stops, with noise of 0.05 mm: no film and no strike is needed.
//!
//! `cargo run --example friction_from_tracks`

use breakshot::cell::{CameraSpec, Cell, Striker, Workspace};
use breakshot::detect::{Sample, Track, Tracks};
use breakshot::estimate::{ClipTracks, Options, estimation};
use breakshot::geometry::{Point, Vec2};
use breakshot::object::{Marker, Object, Shape};
use breakshot::physics::GRAVITY_M_S2;

/// The true coefficient of friction of each object.
const TRUTH: [(&str, f64); 2] = [("felt", 0.32), ("wood", 0.18)];
/// Initial speeds of the clips of each object (m/s).
const SPEEDS_M_S: [f64; 4] = [0.5, 0.6, 0.7, 0.8];
const FRAME_RATE_HZ: f64 = 60.0;
const NOISE_STD_M: f64 = 5e-5;
/// Largest accepted relative error of a friction.
const TOLERANCE: f64 = 0.02;

fn main() -> Result<(), breakshot::Error> {
    // The cell: a camera with a short exposure that looks straight down.
    let camera = CameraSpec { exposure_s: Some(0.0), ..CameraSpec::default() };
    let above = Cell::from_above(1000.0, Workspace::centred([2.0, 2.0]), Striker::rod(0.01, [0.1, 1.0]));
    let cell = Cell { camera, ..above };
    let objects = TRUTH.map(|(name, _)| disc(name));

    // One object in each clip, sliding in another direction
    let clips: Vec<ClipTracks> = (TRUTH.iter().enumerate())
        .flat_map(|(k, &(name, friction))| {
            SPEEDS_M_S.iter().enumerate().map(move |(n, &speed_m_s)| {
                let heading_rad = 1.3 * (k * SPEEDS_M_S.len() + n) as f64;
                clip(name, n, friction, Vec2::from_heading(heading_rad) * speed_m_s)
            })
        })
        .collect();

    let properties = estimation(&clips, &cell, &objects, &Options::default())?.properties;
    for (name, truth) in TRUTH {
        let found = &properties.friction[name];
        let [low, high] = found.interval_95;
        println!("{name}: friction {:.4} (95 % interval {low:.4} to {high:.4}), truth {truth}", found.mean);
        let error = found.mean / truth - 1.0;
        assert!(error.abs() < TOLERANCE, "{name}: relative error {error} of the friction (no unit)");
    }
    Ok(())
}

/// A disc of 30 mm radius with a round marker, which does not show the yaw.
fn disc(name: &str) -> Object {
    let marker = Some(Marker::centred(Shape::Disc { radius_m: 0.01 }));
    let shape = Shape::Disc { radius_m: 0.03 };
    Object { name: name.into(), shape, height_m: 0.02, marker, mass_kg: None, support: None }
}

/// A clip of one object that is in motion from the first frame on until it stops.
fn clip(name: &str, number: usize, friction: f64, velocity: Vec2) -> ClipTracks {
    let deceleration_m_s2 = friction * GRAVITY_M_S2;
    let stop_s = velocity.length() / deceleration_m_s2;
    let samples = (0..(1.5 * stop_s * FRAME_RATE_HZ) as usize).map(|frame| {
        let time_s = frame as f64 / FRAME_RATE_HZ;
        let t = time_s.min(stop_s);
        let position = Point::ORIGIN + velocity * (t - t * t / (2.0 * stop_s));
        let error = Vec2::new(noise(frame, 2 * number), noise(frame, 2 * number + 1)) * NOISE_STD_M;
        Sample::new(time_s, position + error, None, NOISE_STD_M)
    });
    let track = Track { object: name.into(), samples: samples.collect() };
    ClipTracks {
        name: format!("{name}_{number}"),
        objects: vec![name.into()],
        strike: None,
        tracks: Tracks { version: 1, tracks: vec![track], ..Tracks::default() },
    }
}

/// A reproducible number with zero mean and unit variance.
fn noise(frame: usize, stream: usize) -> f64 {
    let phase = (12.9898 * frame as f64 + 78.233 * stream as f64).sin() * 43758.5453;
    // A uniform number from -1 to 1 has the variance 1/3.
    (2.0 * (phase - phase.floor()) - 1.0) * 3f64.sqrt()
}
