//! A striker that catches up with the body that it has struck and hits it again, and a strike that looks like two.

use super::{ClipTracks, Options, estimation};
use crate::cell::{Cell, Striker, Workspace};
use crate::detect::{Sample, Track, Tracks};
use crate::geometry::Point;
use crate::object::{Object, Shape};
use crate::physics::GRAVITY_M_S2;
use crate::properties::Properties;
use crate::scene::Strike;
use crate::uncertain::Estimate;
use std::collections::BTreeMap;

const STRIKER_RADIUS_M: f64 = 0.012;
const RADIUS_M: f64 = 0.03;
const SPEED_M_S: f64 = 0.33;
const TRAVEL_M: f64 = 0.074;
/// The gap between the outlines at the start (m).
const GAP_M: f64 = 0.05;
const FRICTION: f64 = 0.46;
const RESTITUTION: f64 = 0.4;
const FRAME_S: f64 = 1.0 / 120.0;
/// When the striker starts (s).
const START_S: f64 = 0.05;

/// The displacements of a body that the striker hits whenever it catches up with it (m), frame by frame, and the number of impacts.
fn displacements_m() -> (Vec<f64>, usize) {
    const STEP_S: f64 = 1e-5;
    let (mut moved_m, mut speed_m_s, mut impacts) = (0.0, 0.0, 0);
    let (mut all, mut next_s) = (Vec::new(), 0.0);
    for k in 0..60_000 {
        let time_s = STEP_S * f64::from(k);
        if time_s >= next_s {
            all.push(moved_m);
            next_s += FRAME_S;
        }
        let out_m = SPEED_M_S * (time_s - START_S).max(0.0);
        if out_m <= TRAVEL_M && out_m - GAP_M >= moved_m && speed_m_s < SPEED_M_S {
            speed_m_s = SPEED_M_S + RESTITUTION * (SPEED_M_S - speed_m_s);
            impacts += 1;
        }
        moved_m += speed_m_s * STEP_S;
        speed_m_s = (speed_m_s - FRICTION * GRAVITY_M_S2 * STEP_S).max(0.0);
    }
    (all, impacts)
}

/// The displacement of a body that the striker hits once (m).
fn slid_m(time_s: f64) -> f64 {
    const STRUCK_S: f64 = START_S + GAP_M / SPEED_M_S;
    const SLOWED_M_S2: f64 = FRICTION * GRAVITY_M_S2;
    let speed_m_s = (1.0 + RESTITUTION) * SPEED_M_S;
    let slid_s = (time_s - STRUCK_S).clamp(0.0, speed_m_s / SLOWED_M_S2);
    (speed_m_s - SLOWED_M_S2 * slid_s / 2.0) * slid_s
}

/// Without an impact of its own the second strike looks like less friction and a smaller restitution.
#[test]
fn a_second_strike_changes_neither_friction_nor_restitution() {
    const NOISE_M: f64 = 3e-5;
    let (displacements_m, impacts) = displacements_m();
    assert_eq!(impacts, 2, "the drawn striker hits the body twice");
    // Noise that repeats after three frames, along and across.
    let noise_m = |k: usize| NOISE_M * ([0.0, 1.2, -1.2][k % 3]);
    let sample = |(k, moved_m): (usize, &f64)| {
        let at = Point::new(moved_m + noise_m(k), noise_m(k + 1));
        Sample::new(FRAME_S * k as f64, at, None, NOISE_M)
    };
    let found = properties(displacements_m.iter().enumerate().map(sample).collect(), TRAVEL_M);
    let (friction, restitution) = (found.friction["a"].mean, found.striker_restitution["a"].mean);
    println!("friction {friction:.4}, restitution {restitution:.4}: {:?}", found.warnings);
    assert!((friction / FRICTION - 1.0).abs() < 0.02, "friction {friction}");
    assert!((restitution - RESTITUTION).abs() < 0.01, "restitution {restitution}");
    assert!(found.warnings.iter().any(|warning| warning.contains("hits `a` again")), "{:?}", found.warnings);
}

/// A shadow makes the positions until the second strike doubtful, and one strike with a larger restitution explains the others.
#[test]
fn a_second_strike_that_only_doubtful_positions_show_gives_no_restitution() {
    const NOISE_M: f64 = 3e-5;
    const SHADED_S: [f64; 2] = [0.18, 0.26];
    let sample = |(k, moved_m): (usize, &f64)| {
        let time_s = FRAME_S * k as f64;
        let doubtful = (SHADED_S[0]..SHADED_S[1]).contains(&time_s);
        let std_m = if doubtful { 1e-3 } else { NOISE_M };
        let at = Point::new(moved_m + std_m * [0.0, 1.2, -1.2][k % 3], 0.0);
        Sample { doubtful, ..Sample::new(time_s, at, None, std_m) }
    };
    let found = properties(displacements_m().0.iter().enumerate().map(sample).collect(), TRAVEL_M);
    assert!(found.striker_restitution.is_empty(), "{:?}", found.striker_restitution);
    assert!(
        found.warnings.iter().any(|warning| warning.contains("may hit `a` again")),
        "{:?}",
        found.warnings
    );
}

/// Positions that are displaced by a fraction of a millimetre from the strike on. A second impact of unknown origin within a frame would explain
/// that, too, and friction or restitution would have no value.
#[test]
fn a_displacement_at_the_strike_is_no_impact_of_its_own() {
    const NOISE_M: f64 = 2e-5;
    const ASIDE_M: f64 = 3e-4;
    // The striker stops before it could catch up.
    const FOLLOWED_M: f64 = 0.01;
    let noise_m = |k: usize| NOISE_M * ([0.0, 1.2, -1.2][k % 3]);
    let sample = |k: usize| {
        let time_s = FRAME_S * k as f64;
        let moved_m = slid_m(time_s);
        let aside_m = if moved_m > 0.0 { ASIDE_M } else { 0.0 };
        Sample::new(time_s, Point::new(moved_m + noise_m(k), aside_m + noise_m(k + 1)), None, NOISE_M)
    };
    let found = properties((0..80).map(sample).collect(), GAP_M + FOLLOWED_M);
    let mean = |values: &BTreeMap<String, Estimate>| values.get("a").map(|v| v.mean);
    let (friction, restitution) = (mean(&found.friction), mean(&found.striker_restitution));
    println!("friction {friction:?}, restitution {restitution:?}: {:?}", found.warnings);
    assert!(friction.is_some_and(|f| (f / FRICTION - 1.0).abs() < 0.02), "{friction:?}");
    assert!(restitution.is_some_and(|e| (e - RESTITUTION).abs() < 0.01), "{restitution:?}");
}

/// The striker retracts when the gap is 1 mm.
#[test]
fn a_striker_that_nearly_catches_up_with_a_body_is_no_push() {
    const NOISE_M: f64 = 3e-5;
    const FOLLOWED_M: f64 = 0.0163;
    let noise_m = |k: usize| NOISE_M * ([0.0, 1.0, -1.0][k % 3]);
    let sample = |k: usize| {
        let time_s = FRAME_S * k as f64;
        let moved_m = slid_m(time_s);
        Sample::new(time_s, Point::new(moved_m + noise_m(k), noise_m(k + 1)), None, NOISE_M)
    };
    let found = properties((0..80).map(sample).collect(), GAP_M + FOLLOWED_M);
    let friction = found.friction.get("a").map(|friction| friction.mean);
    println!("friction {friction:?}: {:?}", found.warnings);
    assert!(friction.is_some_and(|f| (f / FRICTION - 1.0).abs() < 0.02), "{friction:?}");
    assert!(!found.warnings.iter().any(|warning| warning.contains("pushes it")), "{:?}", found.warnings);
}

/// A pentagon that is struck off its centre spins, and its next corner meets the striker 37 ms later, before the two have parted: true poses of one strike
/// in a simulation that shares no model with the estimator (MuJoCo), which itself shows a restitution of 0.725, friction 0.418 and the second strike at 0.2475 s.
#[test]
fn a_corner_that_meets_the_striker_before_they_part_is_a_second_strike() {
    const AT_REST: [f64; 3] = [-0.11638, 0.03379, -1.06630];
    const FRAMES_AT_REST: usize = 5;
    const MOVING: [[f64; 3]; 8] = [
        [-0.11324, 0.03430, -1.16010],
        [-0.10891, 0.03505, -1.28361],
        [-0.10471, 0.03580, -1.39773],
        [-0.10077, 0.03652, -1.49840],
        [-0.09608, 0.03693, -1.57098],
        [-0.08964, 0.03671, -1.60064],
        [-0.08351, 0.03651, -1.62755],
        [-0.07764, 0.03634, -1.65197],
    ];
    const FIRST_S: f64 = 0.175;
    let corners =
        [(0.0402, 0.0), (0.01242, 0.03823), (-0.03252, 0.02363), (-0.03252, -0.02363), (0.01242, -0.03823)];
    let strike = Strike {
        object: None,
        start_m: Point::new(-0.21444, 0.05340),
        heading_rad: -0.19334,
        speed_m_s: 0.547,
        travel_m: 0.07,
    };
    let poses = [AT_REST; FRAMES_AT_REST].into_iter().chain(MOVING);
    let found = properties_of(vec![polygon(&corners, poses, FIRST_S, FRAME_S)], strike, 0.0142);
    let restitution = found.striker_restitution.get("a").map(|restitution| restitution.mean);
    println!("restitution {restitution:?}: {:?}", found.warnings);
    assert!(restitution.is_some_and(|e| (e - 0.725).abs() < 0.02), "{restitution:?}");
    assert!(found.warnings.iter().any(|warning| warning.contains("hits `a` again")), "{:?}", found.warnings);
}

/// The same where the corner meets the striker after 1.9 frames, at 0.2498 s, and the pentagon another body at 0.2932 s. Without the second strike
/// the mean velocity before that impact is too low: a restitution of 0.57 in place of 0.68, and a ratio of the masses of 3.4 in place of 9.5.
#[test]
fn a_second_strike_after_a_single_position_is_found() {
    const SLOW_FRAME_S: f64 = 1.0 / 59.94;
    const FIRST_S: f64 = 9.0 * SLOW_FRAME_S;
    const AT_REST: [[f64; 3]; 2] = [[-0.09976, 0.02434, -2.82410], [-0.017098, 0.054076, 2.8802]];
    const FRAMES_AT_REST: [usize; 2] = [5, 9];
    const MOVING: [&[[f64; 3]]; 2] = [
        &[
            [-0.092608, 0.022677, -2.619147],
            [-0.085459, 0.021001, -2.432476],
            [-0.075014, 0.020074, -2.350236],
            [-0.065562, 0.019239, -2.276163],
            [-0.057252, 0.018266, -2.207726],
            [-0.050172, 0.017135, -2.147185],
            [-0.044038, 0.016149, -2.096008],
            [-0.038820, 0.015300, -2.053372],
            [-0.034538, 0.014592, -2.019544],
            [-0.031202, 0.014030, -1.993938],
        ],
        &[
            [-0.015042, 0.055931, 2.839876],
            [-0.010790, 0.059788, 2.758736],
            [-0.007216, 0.063058, 2.690915],
            [-0.004320, 0.065749, 2.636465],
            [-0.002098, 0.067853, 2.595433],
            [-0.000547, 0.069347, 2.567283],
        ],
    ];
    let corners: [&[(f64, f64)]; 2] = [
        &[(0.0339, 0.0), (0.01048, 0.03224), (-0.02743, 0.01993), (-0.02743, -0.01993), (0.01048, -0.03224)],
        &[
            (0.03113, 0.00591),
            (0.02016, 0.02098),
            (-0.01384, 0.02439),
            (-0.0313, -0.00521),
            (-0.01045, -0.02557),
            (0.01599, -0.02342),
        ],
    ];
    let body = |k: usize| {
        let poses = [AT_REST[k]].repeat(FRAMES_AT_REST[k]).into_iter().chain(MOVING[k].iter().copied());
        polygon(corners[k], poses, FIRST_S, SLOW_FRAME_S)
    };
    let strike = Strike {
        object: None,
        start_m: Point::new(-0.19874, 0.02229),
        heading_rad: 0.02575,
        speed_m_s: 0.509,
        travel_m: 0.07,
    };
    let found = properties_of(vec![body(0), body(1)], strike, 0.0192);
    println!("{:?}, {:?}: {:?}", found.restitution, found.pair_mass_ratio, found.warnings);
    assert!(found.warnings.iter().any(|warning| warning.contains("hits `a` again")), "{:?}", found.warnings);
    assert!(found.restitution.is_empty() && found.pair_mass_ratio.is_empty(), "{found:?}");
}

/// A slow striker hits a disc again after 1.6 frames: true poses of a simulation that shares no model with the estimator (MuJoCo), which itself shows
/// friction 0.491 and the impacts at 0.3085 and 0.3620 s. Without the second one friction is 0.09 to 0.31 and the restitution 0.08 in place of 0.49.
/// The single position between them shows the restitution together with the instant of the second one, since the striker has not changed. A second
/// clip, of another disc, shows the noise.
#[test]
fn a_second_strike_after_a_frame_and_a_half_is_found() {
    let strike = Strike {
        object: None,
        start_m: Point::new(-0.20747, 0.01655),
        heading_rad: -0.19277,
        speed_m_s: 0.265,
        travel_m: 0.07,
    };
    let moving =
        [(-0.110982, -0.002641), (-0.103753, -0.0041), (-0.096395, -0.00558), (-0.094212, -0.006008)];
    let samples = at_30_a_second((-0.119196, -0.000983), &moving, 8);
    let noise_m = |k: usize| 2e-5 * ([0.0, 1.2, -1.2][k % 3]);
    let sample_of_other = |k: usize| {
        let time_s = FRAME_S * k as f64;
        Sample::new(time_s, Point::new(slid_m(time_s) + noise_m(k), noise_m(k + 1)), None, 2e-5)
    };
    let strike_of_other = Strike {
        object: None,
        start_m: Point::new(-RADIUS_M - 0.0131 - GAP_M, 0.0),
        heading_rad: 0.0,
        speed_m_s: SPEED_M_S,
        travel_m: GAP_M + 0.01,
    };
    let other = vec![("b", Shape::Disc { radius_m: RADIUS_M }, (0..80).map(sample_of_other).collect())];
    let struck_again = vec![("a", Shape::Disc { radius_m: 0.0271 }, samples)];
    let films = vec![(struck_again, strike), (other, strike_of_other)];
    let found = properties_of_clips(films, 0.0131, Some(1e-4));
    let friction = found.friction.get("a").map(|friction| friction.mean);
    println!("friction {:?}: {:?}, {:?}", found.friction, found.striker_restitution, found.warnings);
    let restitution = found.striker_restitution.get("a").map(|restitution| restitution.mean);
    assert!(found.warnings.iter().any(|warning| warning.contains("hits `a` again")), "{:?}", found.warnings);
    assert!(friction.is_some_and(|f| (f / 0.491 - 1.0).abs() < 0.02), "{friction:?}");
    assert!(restitution.is_some_and(|e| (e / 0.486 - 1.0).abs() < 0.05), "{restitution:?}");
}

/// Positions of a film that are more accurate than they are: the fit keeps the disc just ahead of the striker and takes it for pushed. What remains of its
/// motion are two positions, which measure nothing. The simulation shows a single impact and friction 0.369.
#[test]
fn a_body_pushed_after_two_positions_measures_nothing() {
    let strike = Strike {
        object: None,
        start_m: Point::new(-0.19083, 0.06687),
        heading_rad: -0.20312,
        speed_m_s: 0.313,
        travel_m: 0.07,
    };
    let moving = [(-0.096629, 0.047908), (-0.086501, 0.045817), (-0.080403, 0.044652), (-0.078104, 0.044192)];
    let samples = at_30_a_second((-0.104657, 0.049422), &moving, 7);
    let found = properties_of(vec![(Shape::Disc { radius_m: 0.025 }, samples)], strike, 0.0131);
    println!("{:?}, {:?}: {:?}", found.friction, found.striker_restitution, found.warnings);
    assert!(found.warnings.iter().any(|w| w.contains("only 2 trusted positions")), "{:?}", found.warnings);
    assert!(found.friction.is_empty() && found.striker_restitution.is_empty(), "{found:?}");
}

/// A disc hits a rectangle off its centre, which stops, and catches up with it: the rectangle moves another millimetre and a half. Positions of a
/// film of the same simulation, which itself shows frictions of 0.261 and 0.464, a first restitution of 0.486 and a mass ratio of 2.05. Without the second impact they are
/// 0.289, 0.410, 0.447 and 2.34.
#[test]
fn a_body_that_is_hit_again_after_it_has_stopped_is_fitted_with_both_impacts() {
    let strike = Strike {
        object: None,
        start_m: Point::new(0.19788, 0.01562),
        heading_rad: 3.25209,
        speed_m_s: 0.514,
        travel_m: 0.07,
    };
    let disc = [
        [0.106395, 0.005856, -2.1706],
        [0.092555, 0.004486, -2.1739],
        [0.068455, 0.002085, -2.1874],
        [0.052884, 0.000926, -2.2484],
        [0.040083, -0.000110, -2.2772],
        [0.030122, -0.000962, -2.3133],
        [0.023036, -0.001483, -2.3415],
        [0.019741, -0.001476, -2.3482],
        [0.019528, -0.001502, -2.3476],
    ];
    let rectangle = [
        [0.007498, -0.027871, -1.8576],
        [0.007498, -0.027871, -1.8576],
        [0.004102, -0.028513, -1.7531],
        [-0.009142, -0.030379, -1.3782],
        [-0.018991, -0.031605, -1.1778],
        [-0.024620, -0.032078, -1.1169],
        [-0.025813, -0.032130, -1.1020],
        [-0.027292, -0.032746, -1.0816],
        [-0.027289, -0.032771, -1.0765],
    ];
    let samples = |moving: [[f64; 3]; 9], std_m: f64| {
        let before = std::iter::repeat_n(moving[0], 6);
        let after = std::iter::repeat_n(moving[8], 5);
        let sample = |(k, [x, y, yaw]): (usize, [f64; 3])| {
            Sample::new(k as f64 / 30.0, Point::new(x, y), Some(yaw), std_m)
        };
        before.chain(moving).chain(after).enumerate().map(sample).collect::<Vec<_>>()
    };
    let bodies = vec![
        ("a", Shape::Disc { radius_m: 0.0311 }, samples(disc, 5e-5)),
        ("b", Shape::Rectangle { size_m: [0.0753, 0.0486] }, samples(rectangle, 8e-5)),
    ];
    let found = properties_of_clips(vec![(bodies, strike)], 0.0113, Some(1.7e-3));
    println!("{:?}, {:?}: {:?}", found.friction, found.restitution, found.warnings);
    let values = [
        (found.friction["a"].mean, 0.261),
        (found.friction["b"].mean, 0.464),
        (found.restitution["a/b"].mean, 0.486),
        (found.pair_mass_ratio["a/b"].mean, 2.05),
    ];
    for (value, truth) in values {
        assert!((value / truth - 1.0).abs() < 0.05, "{value} of {truth}, of all {values:.3?}");
    }
}

/// Samples of a disc, 30 a second, that rests for some frames, moves to these positions, and rests at the last one.
fn at_30_a_second(start_m: (f64, f64), moving_m: &[(f64, f64)], frames_at_rest: usize) -> Vec<Sample> {
    const STD_M: f64 = 2e-5;
    let end_m = moving_m.last().copied();
    let positions_m = std::iter::repeat_n(start_m, 2 + frames_at_rest)
        .chain(moving_m.iter().copied())
        .chain(std::iter::repeat_n(end_m.unwrap_or(start_m), 10));
    let sample =
        |(k, (x, y)): (usize, (f64, f64))| Sample::new(k as f64 / 30.0, Point::new(x, y), None, STD_M);
    positions_m.enumerate().map(sample).collect()
}

/// A polygon, and samples of it at these poses from a time on, at this interval (s).
fn polygon(
    corners: &[(f64, f64)],
    poses: impl Iterator<Item = [f64; 3]>,
    first_s: f64,
    frame_s: f64,
) -> (Shape, Vec<Sample>) {
    let points_m = corners.iter().map(|&(x, y)| Point::new(x, y)).collect();
    let sample = |(k, [x, y, yaw]): (usize, [f64; 3])| {
        Sample::new(first_s + frame_s * k as f64, Point::new(x, y), Some(yaw), 2e-5)
    };
    (Shape::Polygon { points_m }, poses.enumerate().map(sample).collect())
}

/// The properties by one clip with these samples of a struck disc and this travel of the striker (m).
fn properties(samples: Vec<Sample>, travel_m: f64) -> Properties {
    let strike = Strike {
        object: None,
        start_m: Point::new(-RADIUS_M - STRIKER_RADIUS_M - GAP_M, 0.0),
        heading_rad: 0.0,
        speed_m_s: SPEED_M_S,
        travel_m,
    };
    properties_of(vec![(Shape::Disc { radius_m: RADIUS_M }, samples)], strike, STRIKER_RADIUS_M)
}

/// The properties by one clip with the shapes and samples of bodies, of which the first one is struck, and a round striker.
fn properties_of(bodies: Vec<(Shape, Vec<Sample>)>, strike: Strike, striker_radius_m: f64) -> Properties {
    let named = bodies.into_iter().zip(["a", "b"]).map(|((shape, samples), name)| (name, shape, samples));
    properties_of_clips(vec![(named.collect(), strike)], striker_radius_m, None)
}

/// A body of a clip: its name, its shape and its samples.
type Filmed<'a> = (&'a str, Shape, Vec<Sample>);

/// The properties by clips, each with the names, shapes and samples of its bodies and with its strike, and the exposure of their films, if it is known.
fn properties_of_clips(
    films: Vec<(Vec<Filmed>, Strike)>,
    striker_radius_m: f64,
    exposure_s: Option<f64>,
) -> Properties {
    let (mut clips, mut objects) = (Vec::new(), Vec::new());
    for (bodies, strike) in films {
        let (mut tracks, mut names) = (Vec::new(), Vec::new());
        for (name, shape, samples) in bodies {
            tracks.push(Track { object: name.into(), samples });
            names.push(name.to_owned());
            let name = name.into();
            objects.push(Object { name, shape, height_m: 0.02, marker: None, mass_kg: None, support: None });
        }
        let tracks = Tracks { version: 1, tracks, ..Tracks::default() };
        let name = if clips.is_empty() { "again".into() } else { format!("clip {}", clips.len()) };
        clips.push(ClipTracks { name, objects: names, strike: Some(strike), tracks });
    }
    let striker = Striker::rod(striker_radius_m, [0.1, 1.0]);
    let mut cell = Cell::from_above(1000.0, Workspace::centred([1.0, 1.0]), striker);
    cell.camera.exposure_s = exposure_s;
    estimation(&clips, &cell, &objects, &Options::default()).expect("properties").properties
}
