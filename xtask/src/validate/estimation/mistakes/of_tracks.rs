//! Mistakes in a campaign's files, made on the saved tracks of all films.

use super::{Mistake, Tally, answer};
use crate::validate::estimation::saved::Saved;
use breakshot::campaign::Campaign;
use breakshot::detect::{Sample, StrikerTrack};
use breakshot::estimate::ClipTracks;
use breakshot::geometry::Vec2;
use breakshot::object::Shape;
use breakshot::scene::Strike;

/// A mistake and how it is made.
type Made = (Mistake, Box<dyn Fn(&mut Campaign, &mut Vec<ClipTracks>)>);

/// Names of the clips that get the mistakes of one clip.
const ALONE: &str = "single_c_3.mp4";
const PAIR: &str = "pair_a_c_2.mp4";

pub(super) fn run(saved: &Saved, tally: &mut Tally) -> Result<(), String> {
    let right = answer(&saved.campaign, &saved.clips, Vec::new()).map_err(|e| e.to_string())?;
    let mut all = strikes();
    all.extend(frame_rates());
    all.extend(clips());
    all.extend(measures());
    for (mistake, make) in all {
        let (mut campaign, mut clips) = (saved.campaign.clone(), saved.clips.clone());
        make(&mut campaign, &mut clips);
        tally.add(&mistake, &right, &answer(&campaign, &clips, Vec::new()));
    }
    Ok(())
}

/// A mistake in the strike of one clip, or of all clips if no name is given.
fn of_strike(
    kind: &'static str,
    size: String,
    clip: Option<&'static str>,
    change: impl Fn(&mut Strike) + 'static,
) -> Made {
    let named_by: &[&str] = match clip {
        Some(ALONE) => &["single_c_3"],
        Some(_) => &["pair_a_c_2"],
        None => &["strike.", "striker was told"],
    };
    let make = move |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
        let concerned = clips.iter_mut().filter(|c| clip.is_none_or(|name| c.name == name));
        concerned.filter_map(|c| c.strike.as_mut()).for_each(&change);
    };
    (Mistake { kind, size, named_by }, Box::new(make))
}

fn strikes() -> Vec<Made> {
    let mut all = Vec::new();
    for clip in [ALONE, PAIR] {
        for factor in [0.8, 0.9, 1.05, 1.1, 1.25] {
            let size = format!("x {factor}");
            all.push(of_strike("speed of one clip", size, Some(clip), move |s| {
                s.speed_m_s *= factor;
            }));
        }
        for turn_rad in [-0.1, -0.05, 0.05, 0.1, 0.2] {
            let size = format!("{turn_rad} rad");
            let turn = move |s: &mut Strike| s.heading_rad += turn_rad;
            all.push(of_strike("heading of one clip", size, Some(clip), turn));
        }
        for (aside_m, along_m) in [(0.0025, 0.0), (0.005, 0.0), (-0.01, 0.0), (0.0, -0.02), (0.0, 0.02)] {
            let size = format!("{} mm aside, {} mm along", 1e3 * aside_m, 1e3 * along_m);
            let shift = move |s: &mut Strike| {
                let along = Vec2::from_heading(s.heading_rad);
                s.start_m += along * along_m + along.perpendicular() * aside_m;
            };
            all.push(of_strike("start of one clip", size, Some(clip), shift));
        }
    }
    all.push(of_strike("travel of one clip", "x 0.5".into(), Some(PAIR), |s| s.travel_m *= 0.5));
    all.push(of_strike("heading of all clips", "0.1 rad".into(), None, |s| s.heading_rad += 0.1));
    for factor in [0.95, 1.05, 1.1, 2.0] {
        all.push(of_strike("speed of all clips", format!("x {factor}"), None, move |s| {
            s.speed_m_s *= factor;
        }));
    }
    all
}

/// Every sample of the clips that `concerns` admits, changed, and every time and position of their strikers likewise.
fn of_samples(
    mistake: Mistake,
    concerns: impl Fn(&ClipTracks) -> bool + 'static,
    change: impl Fn(&mut Sample) + 'static,
) -> Made {
    let make = move |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
        for clip in clips.iter_mut().filter(|clip| concerns(clip)) {
            clip.tracks.tracks.iter_mut().flat_map(|track| &mut track.samples).for_each(&change);
            if let Some(striker) = &mut clip.tracks.striker {
                change_striker(striker, &change);
            }
        }
    };
    (mistake, Box::new(make))
}

fn change_striker(striker: &mut StrikerTrack, change: &impl Fn(&mut Sample)) {
    for seen in &mut striker.samples {
        let mut sample = Sample::new(seen.time_s, seen.position(), None, striker.std_m);
        change(&mut sample);
        (seen.time_s, seen.x_m, seen.y_m) = (sample.time_s, sample.x_m, sample.y_m);
    }
    if let Some(start) = &mut striker.start_m {
        let mut sample = Sample::new(0.0, *start, None, striker.std_m);
        change(&mut sample);
        *start = sample.position();
    }
}

/// Times as if the file said another rate.
fn stretch(factor: f64) -> impl Fn(&mut Sample) + 'static {
    move |sample: &mut Sample| {
        sample.time_s *= factor;
        for velocity in
            [&mut sample.vx_m_s, &mut sample.vy_m_s, &mut sample.yaw_rate_rad_s].into_iter().flatten()
        {
            *velocity /= factor;
        }
        for acceleration in [&mut sample.ax_m_s2, &mut sample.ay_m_s2].into_iter().flatten() {
            *acceleration /= factor * factor;
        }
    }
}

fn frame_rates() -> Vec<Made> {
    let mut all = Vec::new();
    for factor in [0.25, 0.5, 5.0 / 6.0, 6.0 / 5.0, 2.0, 4.0] {
        let mistake = |kind, named_by| Mistake { kind, size: format!("x {factor:.2}"), named_by };
        let rate = mistake("duration of all films", &["frame_rate_hz", "times as fast"]);
        all.push(of_samples(rate, |_| true, stretch(factor)));
        let one = mistake("duration of one film", &["single_c_3"]);
        all.push(of_samples(one, |clip| clip.name == ALONE, stretch(factor)));
    }
    all
}

/// Clips with wrong names, doubled ones, and films that are cut.
fn clips() -> Vec<Made> {
    let named = |kind, size: &str, named_by| Mistake { kind, size: size.into(), named_by };
    let exchanged = |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
        for clip in clips.iter_mut().filter(|clip| clip.name == PAIR) {
            clip.objects.reverse();
            let names: Vec<String> = clip.tracks.tracks.iter().rev().map(|t| t.object.clone()).collect();
            clip.tracks.tracks.iter_mut().zip(names).for_each(|(track, name)| track.object = name);
        }
    };
    let misnamed = |name: &'static str| {
        move |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
            for clip in clips.iter_mut().filter(|clip| clip.name == ALONE) {
                clip.objects = vec![name.to_owned()];
                name.clone_into(&mut clip.tracks.tracks[0].object);
            }
        }
    };
    let doubled = |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
        let copy = clips.iter().find(|clip| clip.name == ALONE).cloned();
        clips.extend(copy.map(|clip| ClipTracks { name: "copy.mp4".into(), ..clip }));
    };
    let cut = |keep: fn(usize, usize) -> bool| {
        move |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
            for track in clips.iter_mut().filter(|c| c.name == PAIR).flat_map(|c| &mut c.tracks.tracks) {
                let n = track.samples.len();
                let mut number = 0..n;
                track.samples.retain(|_| number.next().is_some_and(|k| keep(k, n)));
            }
        }
    };
    vec![
        (named("names of a pair", "exchanged", &["pair_a_c_2"]), Box::new(exchanged)),
        (named("name of an object alone", "a for c", &["single_c_3"]), Box::new(misnamed("a"))),
        (named("name of an object alone", "e for c", &["single_c_3"]), Box::new(misnamed("e"))),
        (named("the same film twice", "-", &["copy.mp4"]), Box::new(doubled)),
        (named("film cut", "the second half", &["pair_a_c_2"]), Box::new(cut(|k, n| 2 * k < n))),
        (named("film cut", "the first half", &["pair_a_c_2"]), Box::new(cut(|k, n| 2 * k >= n))),
    ]
}

/// Wrong measures of the cell and its objects, as far as they leave the tracks as they are.
fn measures() -> Vec<Made> {
    let mut all: Vec<Made> = Vec::new();
    for factor in [1.02, 1.05, 1.1] {
        let mistake = Mistake {
            kind: "scale of the table",
            size: format!("x {factor}"),
            named_by: &["lengths on the table"],
        };
        all.push(of_samples(
            mistake,
            |_| true,
            move |sample| {
                let lengths =
                    [&mut sample.vx_m_s, &mut sample.vy_m_s, &mut sample.ax_m_s2, &mut sample.ay_m_s2];
                lengths.into_iter().flatten().for_each(|value| *value *= factor);
                (sample.x_m, sample.y_m) = (factor * sample.x_m, factor * sample.y_m);
            },
        ));
    }
    for factor in [0.92, 0.96, 1.04, 1.08] {
        let mistake = Mistake {
            kind: "radius of one object",
            size: format!("x {factor}"),
            named_by: &["outline of `c`", "outlines"],
        };
        let resize = move |campaign: &mut Campaign, _: &mut Vec<ClipTracks>| {
            for object in campaign.objects.iter_mut().filter(|object| object.name == "c") {
                if let Shape::Disc { radius_m } = &mut object.shape {
                    *radius_m *= factor;
                }
            }
        };
        all.push((mistake, Box::new(resize)));
    }
    let mirrored = Mistake { kind: "y axis", size: "mirrored".into(), named_by: &["strike.", "strike"] };
    all.push(of_samples(
        mirrored,
        |_| true,
        |sample| {
            sample.y_m = -sample.y_m;
            sample.yaw_rad = sample.yaw_rad.map(|yaw| -yaw);
            for value in
                [&mut sample.vy_m_s, &mut sample.yaw_rate_rad_s, &mut sample.ay_m_s2].into_iter().flatten()
            {
                *value = -*value;
            }
        },
    ));
    all
}
