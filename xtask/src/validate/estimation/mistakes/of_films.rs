//! Mistakes that change what the camera sees or how it is calibrated, made on a part of the films.

use super::{Answer, Mistake, Tally, answer, words};
use crate::validate::estimation::saved::Saved;
use breakshot::campaign::{Campaign, Clip, Source};
use breakshot::capture::{Decoder, Footage, Frame, GreyImage};
use breakshot::estimate::ClipTracks;
use breakshot::object::kind;

/// A mistake; how the cell and the objects' file get it; and how a frame gets it, by its number.
struct Made {
    mistake: Mistake,
    change: Box<dyn Fn(&mut Campaign)>,
    frame: Box<dyn Fn(usize, GreyImage) -> GreyImage>,
}

/// The size of a mistake in a height, and how it changes the height (m).
type Height = (&'static str, fn(f64) -> f64);

/// The clips are those of the first pair's objects, up to this number of a case.
const MOST_OF_A_CASE: usize = 3;
/// The frame from which a camera is bumped, in the middle of the motion.
const BUMPED_FROM: usize = 20;

pub(super) fn run(saved: &Saved, tally: &mut Tally) -> Result<(), String> {
    let first_pair = saved.campaign.clips.iter().find(|clip| clip.objects.len() == 2);
    let objects = &first_pair.ok_or("no clip has two objects")?.objects;
    let of_objects = |clip: &&Clip| clip.objects.iter().all(|name| objects.contains(name));
    let number = |clip: &Clip| {
        clip.name.trim_end_matches(".mp4").rsplit('_').next().and_then(|n| n.parse::<usize>().ok())
    };
    let clips: Vec<Clip> = saved.campaign.clips.iter().filter(of_objects).cloned().collect();
    let clips = clips.into_iter().filter(|clip| number(clip).is_none_or(|n| n <= MOST_OF_A_CASE)).collect();
    let campaign = Campaign { clips, ..saved.campaign.clone() };
    let right = tracked(&campaign, &|_, image| image).map_err(|e| e.to_string())?;
    for Made { mistake, change, frame } in mistakes() {
        let mut campaign = campaign.clone();
        change(&mut campaign);
        tally.add(&mistake, &right, &tracked(&campaign, &frame));
    }
    Ok(())
}

fn mistakes() -> Vec<Made> {
    let same = || -> Box<dyn Fn(usize, GreyImage) -> GreyImage> { Box::new(|_, image| image) };
    let cell = |kind, size: &str, named_by: &[&str], change: fn(&mut Campaign)| Made {
        mistake: Mistake { kind, size: size.into(), named_by: words(named_by) },
        change: Box::new(change),
        frame: same(),
    };
    let camera = |kind, size: String, named_by: &[&str], frame| Made {
        mistake: Mistake { kind, size, named_by: words(named_by) },
        change: Box::new(|_| {}),
        frame,
    };
    let mut all = Vec::new();
    for shift_px in [1_usize, 2, 5] {
        let bumped = move |number: usize, image: GreyImage| {
            if number < BUMPED_FROM { image } else { shifted(&image, shift_px) }
        };
        let size = format!("{shift_px} px");
        all.push(camera("camera bumped in mid-clip", size, &["the camera moved"][..], Box::new(bumped)));
    }
    let shaken = |number: usize, image: GreyImage| shifted(&image, number % 3);
    all.push(camera("camera shakes", "2 px".into(), &["the camera moved"][..], Box::new(shaken)));
    let dimmed = |number: usize, mut image: GreyImage| {
        let percent = if number.is_multiple_of(2) { 100 } else { 85 };
        image.pixels.iter_mut().for_each(|p| *p = (u32::from(*p) * percent / 100) as u8);
        image
    };
    all.push(camera("lamp flickers", "15 %".into(), &["lamp", "light"][..], Box::new(dimmed)));
    all.push(cell("size of all tags", "x 1.05", &["size_m"], |c| {
        c.cell.tags.iter_mut().for_each(|tag| tag.size_m *= 1.05);
    }));
    all.push(cell("position of one tag", "5 mm", &["tag"], |c| c.cell.tags[0].center_m.x += 0.005));
    all.push(cell("focal length", "x 1.03", &["lens", "tag", "focal"], |c| {
        c.cell.camera.focal_px = c.cell.camera.focal_px.map(|focal| focal.map(|f| 1.03 * f));
    }));
    all.push(cell("distortion left out", "-", &["lens", "tag", "mm from their positions"], |c| {
        c.cell.camera.distortion = None;
    }));
    let heights: [Height; 8] = [
        ("10 mm too high", |m| m + 0.01),
        ("20 mm too high", |m| m + 0.02),
        ("5 mm too low", |m| m - 0.005),
        ("10 mm too low", |m| m - 0.01),
        ("x 0.8", |m| 0.8 * m),
        ("x 0.9", |m| 0.9 * m),
        ("x 1.1", |m| 1.1 * m),
        ("x 1.2", |m| 1.2 * m),
    ];
    for (size, changed_m) in heights {
        all.push(of_heights("height of all objects", size, move |c| {
            c.objects.iter_mut().for_each(|o| o.height_m = changed_m(o.height_m));
        }));
        all.push(of_heights("height of one object", size, move |c| {
            if let Some(name) = c.clips.first().map(|clip| kind(&clip.objects[0]).to_owned()) {
                c.objects
                    .iter_mut()
                    .filter(|o| o.name == name)
                    .for_each(|o| o.height_m = changed_m(o.height_m));
            }
        }));
    }
    all
}

/// A mistake in the heights of objects.
fn of_heights(kind: &'static str, size: &str, change: impl Fn(&mut Campaign) + 'static) -> Made {
    let mistake = Mistake { kind, size: size.into(), named_by: words(&["height_m"]) };
    Made { mistake, change: Box::new(change), frame: Box::new(|_, image| image) }
}

/// The picture moved to the left, its last columns repeated.
fn shifted(image: &GreyImage, by_px: usize) -> GreyImage {
    let rows = image.pixels.chunks_exact(image.width);
    let moved = rows.flat_map(|row| {
        let last = std::iter::repeat_n(row[image.width - 1], by_px);
        row[by_px..].iter().copied().chain(last)
    });
    GreyImage { pixels: moved.collect(), ..*image }
}

/// The answer for the films with every frame changed.
fn tracked(campaign: &Campaign, frame: &dyn Fn(usize, GreyImage) -> GreyImage) -> Answer {
    let mut clips = Vec::new();
    let mut unreadable = Vec::new();
    for clip in &campaign.clips {
        match clip_tracks(campaign, clip, frame) {
            Ok(tracks) => clips.push(tracks),
            Err(error) => unreadable.push(breakshot::unreadable_clip(clip, &error)),
        }
    }
    if clips.is_empty()
        && let Some(first) = campaign.clips.first()
    {
        clip_tracks(campaign, first, frame)?;
    }
    answer(campaign, &clips, unreadable)
}

fn clip_tracks(
    campaign: &Campaign,
    clip: &Clip,
    change: &dyn Fn(usize, GreyImage) -> GreyImage,
) -> breakshot::Result<ClipTracks> {
    let Source::Film(path) = &clip.source else {
        return breakshot::clip_tracks(campaign, clip, Decoder::default());
    };
    let frames = Footage::open(path)?.enumerate().map(|(number, frame)| {
        let Frame { time_s, image } = frame?;
        Ok(Frame { time_s, image: change(number, image) })
    });
    let footage = Footage::from_frames(&clip.name, frames.collect::<breakshot::Result<_>>()?);
    breakshot::footage_tracks(campaign, clip, footage)
}
