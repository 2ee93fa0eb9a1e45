//! The frames of a film in which the board is measured, and a varied selection of them.

use super::bundle::{Corner, Observations};
use crate::capture::footage::Footage;
use crate::capture::homography::Homography;
use crate::capture::image::{Frame, GreyImage};
use crate::capture::lens::Lens;
use crate::capture::tags::{self, DetectedTag};
use crate::cell::{Board, Tag};
use crate::error::Result;
use crate::geometry::{Pixel, Point};
use rayon::prelude::*;

/// Smallest number of views that are fitted.
pub(super) const LEAST_VIEWS: usize = 5;
/// Largest number of views that are fitted: more of one film repeat each other.
const MOST_VIEWS: usize = 60;
/// Smallest number of tags in a view: sixteen corners for six unknowns of a pose.
const LEAST_TAGS: usize = 4;
/// Number of frames in which the board is searched; of longer films every second, fourth, ... is taken.
const MOST_SEARCHED: usize = 256;
/// Number of frames that are searched side by side.
const SIDE_BY_SIDE: usize = 8;
/// Smallest difference of two views: the mean distance of the board's corners over the picture's width.
const DIFFERENT: f64 = 0.02;

/// The tags of the board in one frame.
pub(super) struct View {
    frame: usize,
    tags: Vec<DetectedTag>,
    /// The corners of the whole board, also of tags that were not detected, over the picture's width.
    outline: [[f64; 2]; 4],
}

fn board_tag(board: &Board, id: u32) -> Option<&Tag> {
    board.tags.iter().find(|tag| tag.id == id)
}

/// The detected tags of the board, each once.
fn tags_of(board: &Board, image: &GreyImage) -> Vec<DetectedTag> {
    let known = |tag: &&DetectedTag| board_tag(board, tag.id).is_some();
    let enough = |tags: &[DetectedTag]| 2 * tags.iter().filter(known).count() >= board.tags.len();
    let all = tags::detected(image, None, &enough);
    let once = |tag: &DetectedTag| all.iter().filter(|other| other.id == tag.id).count() == 1;
    all.iter().filter(known).filter(|tag| once(tag)).cloned().collect()
}

fn view(board: &Board, frame: usize, image: &GreyImage) -> Option<View> {
    let tags = tags_of(board, image);
    if tags.len() < LEAST_TAGS {
        return None;
    }
    let pairs: Vec<(Point, Pixel)> =
        tags.iter().flat_map(|tag| corners(board, tag)).map(|corner| (corner.point, corner.pixel)).collect();
    let homography = Homography::fitted(&pairs)?;
    let points = || board.tags.iter().flat_map(Tag::corners_m);
    let bound = |pick: fn(f64, f64) -> f64, value: fn(&Point) -> f64, from: f64| {
        points().map(|p| value(&p)).fold(from, pick)
    };
    let (left, right) = (bound(f64::min, |p| p.x, f64::MAX), bound(f64::max, |p| p.x, f64::MIN));
    let (low, high) = (bound(f64::min, |p| p.y, f64::MAX), bound(f64::max, |p| p.y, f64::MIN));
    let width = image.width as f64;
    let mut outline = [[0.0; 2]; 4];
    for (corner, (x, y)) in outline.iter_mut().zip([(left, low), (right, low), (right, high), (left, high)]) {
        let pixel = homography.pixel(Point::new(x, y))?;
        *corner = [pixel.x / width, pixel.y / width];
    }
    Some(View { frame, tags, outline })
}

/// Views as different as possible, in the order of the film, and the number of frames that show the board.
pub(super) fn varied(footage: Footage, board: &Board) -> Result<(Vec<View>, usize)> {
    let mut found: Vec<View> = Vec::new();
    let mut every = 1;
    let mut searched = 0;
    let mut waiting: Vec<(usize, Frame)> = Vec::new();
    let search = |waiting: &mut Vec<(usize, Frame)>, found: &mut Vec<View>| {
        let views: Vec<_> =
            waiting.par_iter().map(|(index, frame)| view(board, *index, &frame.image)).collect();
        waiting.clear();
        found.extend(views.into_iter().flatten());
    };
    for (index, frame) in footage.enumerate() {
        let frame = frame?;
        if index % every != 0 {
            continue;
        }
        waiting.push((index, frame));
        searched += 1;
        if waiting.len() == SIDE_BY_SIDE {
            search(&mut waiting, &mut found);
        }
        if searched == MOST_SEARCHED {
            search(&mut waiting, &mut found);
            every *= 2;
            found.retain(|view| view.frame % every == 0);
            searched = MOST_SEARCHED / 2;
        }
    }
    search(&mut waiting, &mut found);
    let count = found.len();
    Ok((selected(found), count))
}

/// The view with the largest board first, then always the one that differs most from those already selected.
fn selected(mut views: Vec<View>) -> Vec<View> {
    let area = |view: &View| {
        let [a, b, c, d] = view.outline;
        ((c[0] - a[0]) * (d[1] - b[1]) - (d[0] - b[0]) * (c[1] - a[1])).abs()
    };
    let difference = |a: &View, b: &View| {
        let apart = a.outline.iter().zip(&b.outline).map(|(p, q)| (p[0] - q[0]).hypot(p[1] - q[1]));
        apart.sum::<f64>() / 4.0
    };
    let Some(largest) =
        (0..views.len()).max_by(|&i, &k| area(&views[i]).total_cmp(&area(&views[k])).then(k.cmp(&i)))
    else {
        return views;
    };
    let mut nearest: Vec<f64> = views.iter().map(|view| difference(view, &views[largest])).collect();
    let mut chosen = vec![largest];
    while chosen.len() < MOST_VIEWS {
        let farthest = (0..views.len()).max_by(|&i, &k| nearest[i].total_cmp(&nearest[k]).then(k.cmp(&i)));
        let Some(next) = farthest.filter(|&next| nearest[next] > DIFFERENT) else { break };
        chosen.push(next);
        for (k, distance) in nearest.iter_mut().enumerate() {
            *distance = distance.min(difference(&views[k], &views[next]));
        }
    }
    let mut index = 0;
    views.retain(|_| {
        index += 1;
        chosen.contains(&(index - 1))
    });
    views
}

/// The same tags, measured with a known lens; a tag that is not found again stays as it was.
pub(super) fn measured_again(footage: Footage, mut views: Vec<View>, lens: &Lens) -> Result<Vec<View>> {
    let last = views.last().map_or(0, |view| view.frame);
    for (index, frame) in footage.take(last + 1).enumerate() {
        let frame = frame?;
        if let Some(view) = views.iter_mut().find(|view| view.frame == index) {
            view.tags.par_iter_mut().for_each(|tag| {
                *tag = tags::redetected(&frame.image, Some(lens), tag).unwrap_or_else(|| tag.clone());
            });
        }
    }
    Ok(views)
}

fn corners<'a>(board: &'a Board, tag: &'a DetectedTag) -> impl Iterator<Item = Corner> + 'a {
    let points = board_tag(board, tag.id).map(Tag::corners_m);
    points
        .into_iter()
        .flat_map(|points| points.into_iter().zip(tag.corners_px))
        .map(|(point, pixel)| Corner { point, pixel })
}

/// The corners of each view.
pub(super) fn observations(views: &[View], board: &Board) -> Observations {
    views.iter().map(|view| view.tags.iter().flat_map(|tag| corners(board, tag)).collect()).collect()
}
