//! The motion in short windows around the impacts, for clips in which not Coulomb friction alone decelerates the bodies.
//!
//! The cause of the deceleration (air, a rail, a table that is not level) may be anything that changes little within
//! [`WINDOW_S`]: there each leg of a body has its own constant acceleration.  The velocities just before and after the
//! impacts follow, and from them restitutions and mass ratios; friction does not.

use super::fit::MotionFit;
use super::initial_guess::{InitialGuess, frame_s, moved_m, noise_m};
use super::motion_model::{Body, Cause, Exposure, MotionLaw, MotionModel};
use super::striker::path::StrikerPath;

/// Accelerations are taken as constant for this long before and after an impact (s), and for at least this number of frames.
const WINDOW_S: f64 = 0.08;
const WINDOW_FRAMES: f64 = 5.0;
/// Residuals of a slide that are this many times the noise, and larger than this (m), show that its deceleration is not
/// Coulomb's; rocking after an impact causes residuals of a tenth of a millimetre.
const NON_COULOMB_NOISES: f64 = 8.0;
const NON_COULOMB_M: f64 = 2e-4;

/// One fit for every group of impacts that are close together in time, from observations that are not binned.
pub(crate) fn fits(bodies: Vec<Body>, striker: Option<&StrikerPath>, exposure: Exposure) -> Vec<MotionFit> {
    let half_s = WINDOW_S.max(WINDOW_FRAMES * frame_s(&bodies));
    let guess = InitialGuess::new(bodies, striker, exposure);
    windows(&guess, half_s)
        .into_iter()
        .map(|window_s| MotionFit::from_guess(within(&guess, window_s)))
        .collect()
}

/// Begin and end of the windows around the impacts of known partners (s); windows that overlap are joined.
fn windows(guess: &InitialGuess, half_s: f64) -> Vec<[f64; 2]> {
    let mut windows: Vec<[f64; 2]> = Vec::new();
    for (event, time_s) in guess.model.events.iter().zip(guess.times_s()) {
        match windows.last_mut() {
            _ if event.cause == Cause::Unknown => {}
            Some(last) if time_s - half_s <= last[1] => last[1] = time_s + half_s,
            _ => windows.push([time_s - half_s, time_s + half_s]),
        }
    }
    windows
}

/// The observations and impacts within a window, with constant accelerations.
fn within(guess: &InitialGuess, [from_s, to_s]: [f64; 2]) -> InitialGuess {
    let inside = |time_s: f64| (from_s..=to_s).contains(&time_s);
    let events = || guess.model.events.iter().zip(guess.times_s()).filter(|(_, time_s)| inside(*time_s));
    let bodies = guess.model.bodies.iter().enumerate().map(|(k, body)| {
        let first_s = events().find(|(e, _)| e.members.contains(&k)).map_or(f64::INFINITY, |(_, t)| t);
        let mut body = body.clone();
        body.observations.retain(|o| inside(o.time_s));
        body.moves_at_start = moves_before(&body, first_s);
        body
    });
    let mut model = MotionModel::new(bodies.collect(), guess.model.exposure);
    model.law = MotionLaw::ConstantRates;
    let (events, times_s): (Vec<_>, Vec<f64>) =
        events().map(|(event, time_s)| (event.clone(), time_s)).unzip();
    model.events = events;
    InitialGuess::from_times(model, &times_s)
}

/// Whether a body is in motion before a time.
fn moves_before(body: &Body, until_s: f64) -> bool {
    let before = &body.observations[..body.observations.partition_point(|o| o.time_s < until_s)];
    match before {
        [first, .., last] => first.position.distance(last.position) > moved_m(&body.observations),
        _ => false,
    }
}

/// The bodies of a clip whose slides have residuals that neither noise nor rocking explains.
pub(crate) fn non_coulomb_bodies(fitted: &MotionFit) -> Vec<String> {
    let non_coulomb = |k: usize, body: &Body| {
        let max_m = (NON_COULOMB_NOISES * noise_m(&body.observations)).max(NON_COULOMB_M);
        fitted.layout.bodies[k].friction.is_some() && fitted.residual_rms_of_m(k) > max_m
    };
    let bodies = fitted.model.bodies.iter().enumerate();
    bodies.filter(|(k, body)| non_coulomb(*k, body)).map(|(_, body)| body.object.clone()).collect()
}

#[cfg(test)]
mod tests {
    use crate::detect::{Sample, Track, Tracks};
    use crate::estimate::{ClipTracks, Options, estimation};
    use crate::geometry::{Point, Vec2};
    use crate::object::{Marker, Object, Shape};
    use crate::synthetic::campaign;

    const RADIUS_M: f64 = 0.025;
    const STEP_S: f64 = 0.002;
    const HIT_S: f64 = 0.8;
    const RATIO: f64 = 1.3;
    const RESTITUTION: f64 = 0.7;

    /// The distance (m) of a body that starts at `speed` and is decelerated by linear air drag; also for negative times.
    fn dragged(speed: f64, elapsed_s: f64, rate_hz: f64) -> f64 {
        speed * (1.0 - (-rate_hz * elapsed_s).exp()) / rate_hz
    }

    /// A moving puck hits one at rest; air drag decelerates both.
    fn clip(n: u32) -> ClipTracks {
        let rate_hz = 1.0 + 0.3 * f64::from(n);
        let along = Vec2::from_heading(0.4 + f64::from(n));
        let speed = 0.5;
        let hit = speed * (1.0 + RESTITUTION) / (1.0 + RATIO);
        let noise = |k: usize, phase: f64| {
            2e-5 * ((k as f64 * 12.9898 + phase * 78.233 + f64::from(n) * 3.1).sin() * 43758.5).sin()
        };
        let distance_m = |body: usize, t: f64| match body {
            0 if t < 0.0 => dragged(speed, t, rate_hz),
            0 => dragged(speed - hit, t, rate_hz),
            _ => 2.0 * RADIUS_M + dragged(hit * RATIO, t.max(0.0), rate_hz),
        };
        let track = |body: usize| Track {
            object: ["a", "b"][body].into(),
            samples: (0..800)
                .map(|k| {
                    let time_s = k as f64 * STEP_S;
                    let position = Point::ORIGIN + along * distance_m(body, time_s - HIT_S);
                    let error = Vec2::new(noise(k, body as f64), noise(k, body as f64 + 7.0));
                    Sample::new(time_s, position + error, None, 2e-5)
                })
                .collect(),
        };
        ClipTracks {
            name: format!("{n}.mp4"),
            objects: ["a", "b"].map(String::from).to_vec(),
            strike: None,
            tracks: Tracks { version: 1, tracks: vec![track(0), track(1)], ..Tracks::default() },
        }
    }

    #[test]
    fn pucks_slowed_by_air_give_mass_ratio_and_restitution_but_no_friction() {
        let objects = ["a", "b"].map(|name| Object {
            name: name.into(),
            shape: Shape::Disc { radius_m: RADIUS_M },
            height_m: 0.01,
            marker: Some(Marker::centred(Shape::Disc { radius_m: 0.005 })),
            mass_kg: None,
            support: None,
        });
        let clips: Vec<_> = (0..4).map(clip).collect();
        let options = Options { reference: Some("b".into()) };
        let found = estimation(&clips, &campaign::cell(), &objects, &options).expect("an estimation");
        let properties = found.properties;
        assert!(properties.friction.is_empty(), "{:?}", properties.friction);
        for name in ["a", "b"] {
            let refused = format!("friction of `{name}` is refused: its deceleration is not Coulomb's");
            assert!(
                properties.warnings.iter().any(|w| w.starts_with(&refused)),
                "{:#?}",
                properties.warnings
            );
        }
        let (ratio, restitution) = (&properties.mass_ratio["a"], &properties.restitution["a/b"]);
        assert!((ratio.mean / RATIO - 1.0).abs() < 0.01, "{ratio:?}");
        assert!((restitution.mean / RESTITUTION - 1.0).abs() < 0.01, "{restitution:?}");
    }
}
