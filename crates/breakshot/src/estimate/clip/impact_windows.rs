//! The motion right around the impacts of a clip in which something else than Coulomb friction slows the bodies.
//!
//! Nothing is assumed of what slows them (air, a rail, a table that is not level) but that it changes little within
//! [`NEAR_S`]: there every leg of a body has an acceleration of its own.  Velocities just before and after the impacts
//! come out of it, and so restitutions and mass ratios; friction does not.

use super::fit::Fitted;
use super::initial_guess::{Draft, frame_s, moved_m, noise_m};
use super::motion_model::{Body, Cause, Exposure, Law, Model};
use super::striker_path::StrikerRun;

/// So long before and after an impact, and for no less than so many frames, accelerations are taken for constant (s).
const NEAR_S: f64 = 0.08;
const NEAR_FRAMES: f64 = 5.0;
/// Residuals of a slide this many times larger than the noise, and longer than this (m), tell that its deceleration is
/// not Coulomb's; bodies that rock after an impact slide unevenly by a tenth of a millimetre.
const UNEVEN_NOISES: f64 = 8.0;
const UNEVEN_M: f64 = 2e-4;

/// One fit for every group of impacts that lie close together, from all sights.
pub(crate) fn around_impacts(
    bodies: Vec<Body>,
    striker: Option<&StrikerRun>,
    exposure: Exposure,
) -> Vec<Fitted> {
    let near_s = NEAR_S.max(NEAR_FRAMES * frame_s(&bodies));
    let draft = Draft::new(bodies, striker, exposure);
    spans(&draft, near_s).into_iter().map(|span_s| Fitted::of_draft(part(&draft, span_s))).collect()
}

/// From when to when around the impacts whose partners are known.
fn spans(draft: &Draft, near_s: f64) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    for (event, time_s) in draft.model.events.iter().zip(draft.times_s()) {
        match spans.last_mut() {
            _ if event.cause == Cause::Unknown => {}
            Some(last) if time_s - near_s <= last[1] => last[1] = time_s + near_s,
            _ => spans.push([time_s - near_s, time_s + near_s]),
        }
    }
    spans
}

/// What happens within a span.
fn part(draft: &Draft, [from_s, to_s]: [f64; 2]) -> Draft {
    let inside = |time_s: f64| (from_s..=to_s).contains(&time_s);
    let events = || draft.model.events.iter().zip(draft.times_s()).filter(|(_, time_s)| inside(*time_s));
    let bodies = draft.model.bodies.iter().enumerate().map(|(k, body)| {
        let first_s = events().find(|(e, _)| e.members.contains(&k)).map_or(f64::INFINITY, |(_, t)| t);
        let mut body = body.clone();
        body.sights.retain(|s| inside(s.time_s));
        body.moves_at_start = moves_until(&body, first_s);
        body
    });
    let mut model = Model::new(bodies.collect(), draft.model.exposure);
    model.law = Law::Free;
    let (events, times_s): (Vec<_>, Vec<f64>) =
        events().map(|(event, time_s)| (event.clone(), time_s)).unzip();
    model.events = events;
    Draft::from_times(model, &times_s)
}

/// Whether a body is under way before a time.
fn moves_until(body: &Body, until_s: f64) -> bool {
    let before = &body.sights[..body.sights.partition_point(|s| s.time_s < until_s)];
    match before {
        [first, .., last] => first.position.distance(last.position) > moved_m(&body.sights),
        _ => false,
    }
}

/// The bodies of a clip whose slides leave residuals that neither noise nor rocking explains.
pub(crate) fn unevenly_slowed(fitted: &Fitted) -> Vec<String> {
    let uneven = |k: usize, body: &Body| {
        let most_m = (UNEVEN_NOISES * noise_m(&body.sights)).max(UNEVEN_M);
        fitted.layout.bodies[k].friction.is_some() && fitted.residual_rms_of(k) > most_m
    };
    let bodies = fitted.model.bodies.iter().enumerate();
    bodies.filter(|(k, body)| uneven(*k, body)).map(|(_, body)| body.object.clone()).collect()
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

    /// How far a body has come that starts at `speed` and loses it by air drag; backwards as well.
    fn dragged(speed: f64, elapsed_s: f64, rate_hz: f64) -> f64 {
        speed * (1.0 - (-rate_hz * elapsed_s).exp()) / rate_hz
    }

    /// A puck that comes along and hits one at rest; both are slowed by air.
    fn clip(n: u32) -> ClipTracks {
        let rate_hz = 1.0 + 0.3 * f64::from(n);
        let along = Vec2::from_heading(0.4 + f64::from(n));
        let speed = 0.5;
        let hit = speed * (1.0 + RESTITUTION) / (1.0 + RATIO);
        let noise = |k: usize, part: f64| {
            2e-5 * ((k as f64 * 12.9898 + part * 78.233 + f64::from(n) * 3.1).sin() * 43758.5).sin()
        };
        let way_m = |body: usize, t: f64| match body {
            0 if t < 0.0 => dragged(speed, t, rate_hz),
            0 => dragged(speed - hit, t, rate_hz),
            _ => 2.0 * RADIUS_M + dragged(hit * RATIO, t.max(0.0), rate_hz),
        };
        let track = |body: usize| Track {
            object: ["a", "b"][body].into(),
            samples: (0..800)
                .map(|k| {
                    let time_s = k as f64 * STEP_S;
                    let place = Point::ORIGIN + along * way_m(body, time_s - HIT_S);
                    Sample {
                        time_s,
                        x_m: place.x + noise(k, body as f64),
                        y_m: place.y + noise(k, body as f64 + 7.0),
                        yaw_rad: None,
                        vx_m_s: None,
                        vy_m_s: None,
                        yaw_rate_rad_s: None,
                        ax_m_s2: None,
                        ay_m_s2: None,
                        std_m: 2e-5,
                        doubtful: false,
                    }
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
    fn pucks_that_air_slows_tell_mass_and_restitution_but_no_friction() {
        let objects = ["a", "b"].map(|name| Object {
            name: name.into(),
            shape: Shape::Disc { radius_m: RADIUS_M },
            height_m: 0.01,
            marker: Some(Marker::centred(Shape::Disc { radius_m: 0.005 })),
            mass_kg: None,
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
