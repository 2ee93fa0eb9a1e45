//! Mistakes in a campaign's files, made on the saved tracks of all films.

use super::{Mistake, Tally, answer, words};
use crate::validate::estimation::saved::Saved;
use breakshot::campaign::Campaign;
use breakshot::detect::{Sample, StrikerTrack};
use breakshot::estimate::ClipTracks;
use breakshot::geometry::{Point, Vec2};
use breakshot::object::Shape;
use breakshot::scene::Strike;
use std::f64::consts::FRAC_PI_2;

/// A change of the campaign's files and of its clips.
type Change = Box<dyn Fn(&mut Campaign, &mut Vec<ClipTracks>)>;

/// A mistake and how it is made.
type Made = (Mistake, Change);

/// The clips that get the mistakes of one clip, and the objects that take part in mistakes.
struct Chosen {
    /// A clip with one object, and that object.
    alone: String,
    of_alone: String,
    /// A clip with two objects.
    pair: String,
    /// The first and the last other object: wrong names for that of `alone`.
    wrong_names: [String; 2],
    /// A disc.
    disc: Option<String>,
}

impl Chosen {
    /// The clips in the middle of those with one and with two objects.
    fn new(saved: &Saved) -> Result<Self, String> {
        let of_size = |n: usize| -> Result<&ClipTracks, String> {
            let clips: Vec<&ClipTracks> = saved.clips.iter().filter(|c| c.objects.len() == n).collect();
            clips.get(clips.len() / 2).copied().ok_or_else(|| format!("no clip has {n} objects"))
        };
        let (alone, pair) = (of_size(1)?, of_size(2)?);
        let of_alone = alone.objects[0].clone();
        let names = saved.campaign.objects.iter().map(|object| &object.name);
        let others: Vec<&String> = names.filter(|name| **name != of_alone).collect();
        let [first, .., last] = others[..] else {
            return Err("the campaign has fewer than three objects".into());
        };
        let is_disc = |name: &str| {
            let of_name = saved.campaign.objects.iter().find(|object| object.name == name);
            of_name.is_some_and(|object| matches!(object.shape, Shape::Disc { .. }))
        };
        let struck = std::iter::once(&of_alone).chain(&pair.objects);
        let disc = struck.into_iter().find(|name| is_disc(name)).cloned();
        let (alone, pair) = (alone.name.clone(), pair.name.clone());
        Ok(Self { alone, of_alone, pair, wrong_names: [first.clone(), last.clone()], disc })
    }
}

pub(super) fn run(saved: &Saved, tally: &mut Tally) -> Result<(), String> {
    let right = answer(&saved.campaign, &saved.clips, Vec::new()).map_err(|e| e.to_string())?;
    let chosen = Chosen::new(saved)?;
    let mut all = strikes(&chosen);
    all.extend(frame_rates(&chosen));
    all.extend(clips(&chosen));
    all.extend(measures(&chosen));
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
    clip: Option<&str>,
    change: impl Fn(&mut Strike) + 'static,
) -> Made {
    let named_by = match clip {
        Some(name) => words(&[name]),
        None => words(&["strike.", "given speed of the striker"]),
    };
    let clip = clip.map(str::to_owned);
    let make = move |_: &mut Campaign, clips: &mut Vec<ClipTracks>| {
        let concerned = clips.iter_mut().filter(|c| clip.as_ref().is_none_or(|name| c.name == *name));
        concerned.filter_map(|c| c.strike.as_mut()).for_each(&change);
    };
    (Mistake { kind, size, named_by }, Box::new(make))
}

fn strikes(chosen: &Chosen) -> Vec<Made> {
    let mut all = Vec::new();
    for clip in [chosen.alone.as_str(), &chosen.pair] {
        for factor in [0.8, 0.9, 1.05, 1.1, 1.25] {
            let size = format!("x {factor}");
            all.push(of_strike("speed of one clip", size, Some(clip), move |s| {
                s.speed_m_s *= factor;
            }));
        }
        for turn_rad in [-0.1, -0.05, 0.05, 0.1, 0.2, 0.35] {
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
    all.push(of_strike("travel of one clip", "x 0.5".into(), Some(&chosen.pair), |s| s.travel_m *= 0.5));
    all.push(of_strike("heading of all clips", "0.1 rad".into(), None, |s| s.heading_rad += 0.1));
    for factor in [0.95, 1.05, 1.1, 2.0] {
        all.push(of_strike("speed of all clips", format!("x {factor}"), None, move |s| {
            s.speed_m_s *= factor;
        }));
    }
    let turned = of_strike("axes of the robot", "a quarter turn".into(), None, |s| {
        s.start_m = Point::new(-s.start_m.y, s.start_m.x);
        s.heading_rad += FRAC_PI_2;
    });
    let exchanged = of_strike("axes of the robot", "exchanged".into(), None, |s| {
        s.start_m = Point::new(s.start_m.y, s.start_m.x);
        s.heading_rad = FRAC_PI_2 - s.heading_rad;
    });
    let of_axes =
        |(mistake, change): Made| (Mistake { named_by: words(&["table frame"]), ..mistake }, change);
    all.extend([turned, exchanged].map(of_axes));
    all
}

/// Every sample of the clips that `concerns` admits, changed, and every time and position of their strikers likewise, with the first motion.
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
            if let Some(onset_s) = &mut clip.tracks.striker_onset_s {
                let changed_s = |time_s| {
                    let mut sample = Sample::new(time_s, Point::ORIGIN, None, 0.0);
                    change(&mut sample);
                    sample.time_s
                };
                let (value, later) = (changed_s(onset_s.value), changed_s(onset_s.value + onset_s.std));
                (onset_s.value, onset_s.std) = (value, later - value);
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

fn frame_rates(chosen: &Chosen) -> Vec<Made> {
    let mut all = Vec::new();
    for factor in [0.25, 0.5, 5.0 / 6.0, 6.0 / 5.0, 2.0, 4.0] {
        let mistake = |kind, named_by: &[&str]| Mistake {
            kind,
            size: format!("x {factor:.2}"),
            named_by: words(named_by),
        };
        let alone = chosen.alone.clone();
        let rate = mistake("duration of all films", &["frame_rate_hz", "times as fast"]);
        all.push(of_samples(rate, |_| true, stretch(factor)));
        let one = mistake("duration of one film", &[&alone]);
        all.push(of_samples(one, move |clip| clip.name == alone, stretch(factor)));
    }
    all
}

/// Clips with wrong names, doubled ones, and films that are cut.
fn clips(chosen: &Chosen) -> Vec<Made> {
    let Chosen { alone, of_alone, pair, wrong_names, .. } = chosen;
    let named =
        |kind, size: &str, named_by: &str| Mistake { kind, size: size.into(), named_by: words(&[named_by]) };
    let of_clip = |name: &str, change: fn(&mut ClipTracks)| -> Change {
        let name = name.to_owned();
        Box::new(move |_, clips| clips.iter_mut().filter(|clip| clip.name == name).for_each(change))
    };
    let mut all = vec![
        (named("names of a pair", "exchanged", pair), of_clip(pair, exchange_names)),
        (named("film cut", "the second half", pair), of_clip(pair, |clip| cut(clip, |k, n| 2 * k < n))),
        (named("film cut", "the first half", pair), of_clip(pair, |clip| cut(clip, |k, n| 2 * k >= n))),
    ];
    for wrong in wrong_names.clone() {
        let mistake = named("name of an object alone", &format!("{wrong} for {of_alone}"), alone);
        let alone = alone.clone();
        all.push((
            mistake,
            Box::new(move |_, clips| {
                for clip in clips.iter_mut().filter(|clip| clip.name == alone) {
                    clip.objects = vec![wrong.clone()];
                    clip.tracks.tracks[0].object.clone_from(&wrong);
                }
            }),
        ));
    }
    let alone = alone.clone();
    all.push((
        named("the same film twice", "-", "copy.mp4"),
        Box::new(move |_, clips| {
            let copy = clips.iter().find(|clip| clip.name == alone).cloned();
            clips.extend(copy.map(|clip| ClipTracks { name: "copy.mp4".into(), ..clip }));
        }),
    ));
    all
}

/// Two objects with each other's names.
fn exchange_names(clip: &mut ClipTracks) {
    clip.objects.reverse();
    let names: Vec<String> = clip.tracks.tracks.iter().rev().map(|t| t.object.clone()).collect();
    clip.tracks.tracks.iter_mut().zip(names).for_each(|(track, name)| track.object = name);
}

/// A film of which only some frames are left, by their number and that of all frames.
fn cut(clip: &mut ClipTracks, keep: fn(usize, usize) -> bool) {
    for track in &mut clip.tracks.tracks {
        let n = track.samples.len();
        let mut number = 0..n;
        track.samples.retain(|_| number.next().is_some_and(|k| keep(k, n)));
    }
    let left = clip.tracks.tracks.iter().flat_map(|track| &track.samples).map(|sample| sample.time_s);
    let (first_s, last_s) =
        left.fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), t| (first.min(t), last.max(t)));
    let is_left = |time_s: f64| (first_s..=last_s).contains(&time_s);
    clip.tracks.striker.take_if(|striker| {
        striker.samples.retain(|sample| is_left(sample.time_s));
        striker.samples.len() < 2
    });
    clip.tracks.striker_onset_s.take_if(|onset_s| !is_left(onset_s.value));
}

/// Wrong measures of the cell and its objects, as far as they leave the tracks as they are.
fn measures(chosen: &Chosen) -> Vec<Made> {
    let mut all: Vec<Made> = Vec::new();
    for factor in [1.01, 1.02, 1.05, 1.1] {
        let mistake = Mistake {
            kind: "distances of the tags",
            size: format!("x {factor}"),
            named_by: words(&["lengths on the table"]),
        };
        let (mistake, scale) = of_samples(
            mistake,
            |_| true,
            move |sample| {
                let lengths =
                    [&mut sample.vx_m_s, &mut sample.vy_m_s, &mut sample.ax_m_s2, &mut sample.ay_m_s2];
                lengths.into_iter().flatten().for_each(|value| *value *= factor);
                (sample.x_m, sample.y_m) = (factor * sample.x_m, factor * sample.y_m);
            },
        );
        let spread = move |campaign: &mut Campaign, clips: &mut Vec<ClipTracks>| {
            scale(campaign, clips);
            clips
                .iter_mut()
                .flat_map(|clip| &mut clip.tracks.tag_width_ratio)
                .for_each(|ratio| *ratio *= factor);
        };
        all.push((mistake, Box::new(spread)));
    }
    let factors: &[f64] = if chosen.disc.is_some() { &[0.92, 0.96, 1.04, 1.08] } else { &[] };
    for (&factor, disc) in factors.iter().zip(chosen.disc.iter().cycle()) {
        let outline = format!("outline of `{disc}`");
        let mistake = Mistake {
            kind: "radius of one object",
            size: format!("x {factor}"),
            named_by: words(&[&outline, "outlines"]),
        };
        let disc = disc.clone();
        let resize = move |campaign: &mut Campaign, _: &mut Vec<ClipTracks>| {
            for object in campaign.objects.iter_mut().filter(|object| object.name == disc) {
                if let Shape::Disc { radius_m } = &mut object.shape {
                    *radius_m *= factor;
                }
            }
        };
        all.push((mistake, Box::new(resize)));
    }
    let mirrored = Mistake { kind: "y axis", size: "mirrored".into(), named_by: words(&["y axis"]) };
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
