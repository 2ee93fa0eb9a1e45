//! Which AprilTags (36h11) does a picture show, and where are their corners?
//!
//! Dark patches with four straight sides are candidates ([`quads`]); their sides are fitted with sub-pixel accuracy
//! where the grey rises from the tag's black border to its white margin ([`edges`]); the bits inside are decoded
//! as a code word ([`family`]).  If the lens is known, its distortion is removed before the sides are fitted.

mod edges;
mod family;
mod quads;
mod sheet;
mod undistortion;

use super::camera::NO_PIXEL;
use super::image::GreyImage;
use super::lens::Lens;
use crate::cell::Tag;
use crate::geometry::{Pixel, Point, Pose};
use edges::Step;
use undistortion::Undistortion;

pub use sheet::{board_sheet, tag_sheet};

#[cfg(any(test, feature = "synthetic"))]
pub(crate) use family::is_white;

pub(crate) use family::CODES;

/// A tag in a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DetectedTag {
    /// Its number.
    pub(super) id: u32,
    /// Top left, top right, bottom right, bottom left of the upright tag's black square (px).
    pub(super) corners_px: [Pixel; 4],
    /// The fitted grey steps of its sides: top, right, bottom, left.
    steps: [Option<Step>; 4],
}

impl DetectedTag {
    /// A tag known from an earlier picture.
    pub(super) fn from_earlier(id: u32, corners_px: [Pixel; 4]) -> Self {
        Self { id, corners_px, steps: [None; 4] }
    }

    /// One standard deviation of each corner (px), from the residuals of its sides' fits; 0 without fits.
    pub(super) fn std_px(&self) -> [f64; 4] {
        let side = |k: usize| self.steps[k].as_ref().map_or(0.0, Step::std_px);
        [0, 1, 2, 3].map(|k| side(k).max(side((k + 3) % 4)))
    }

    /// The pixel of its centre: the intersection of its diagonals, under any perspective.
    pub(super) fn center_px(&self) -> Pixel {
        let [a, b, c, d] = self.corners_px;
        let cross = |p: (f64, f64), q: (f64, f64)| p.0 * q.1 - p.1 * q.0;
        let (ac, bd, ab) = ((c.x - a.x, c.y - a.y), (d.x - b.x, d.y - b.y), (b.x - a.x, b.y - a.y));
        let fraction = cross(ab, bd) / cross(ac, bd);
        Pixel::new(a.x + fraction * ac.0, a.y + fraction * ac.1)
    }

    fn side_px(&self) -> f64 {
        (0..4).map(|k| self.corners_px[k].distance_px(self.corners_px[(k + 1) % 4])).sum::<f64>() / 4.0
    }
}

impl Tag {
    /// The corners of its black square on the table: top left, top right, bottom right, bottom left of the upright
    /// tag (m).
    pub fn corners_m(&self) -> [Point; 4] {
        let pose = Pose { position: self.center_m, yaw_rad: self.yaw_rad };
        let half = self.size_m / 2.0;
        [(-half, half), (half, half), (half, -half), (-half, -half)]
            .map(|(x, y)| pose.table_from_body(Point::new(x, y)))
    }
}

/// Thresholds of dark pixels between the darkest (0) and the lightest (1) grey nearby: the middle first, then a lower
/// and a higher one for tags crossed by a shadow or a glare.
const THRESHOLDS: [f64; 3] = [0.5, 0.3, 0.7];

/// Every tag of the family in the picture, in order of number.
///
/// A first pass at full size finds them in good light; unless it finds `enough`, further passes try other thresholds
/// and a picture of half the size, which is less sensitive to noise and blur.
pub(super) fn detected(
    image: &GreyImage,
    lens: Option<&Lens>,
    enough: &dyn Fn(&[DetectedTag]) -> bool,
) -> Vec<DetectedTag> {
    let undistortion = Undistortion { lens };
    let mut tags = Vec::new();
    let half = (image.width >= 2 * SMALLEST_HALVED_PX && image.height >= 2 * SMALLEST_HALVED_PX)
        .then(std::cell::OnceCell::new);
    for threshold in THRESHOLDS {
        let whole = quads::dark_quads(image, threshold);
        add(&mut tags, image, &undistortion, whole);
        if enough(&tags) {
            break;
        }
        if let Some(half) = &half {
            let half = half.get_or_init(|| image.halved());
            let double = |p: Pixel| Pixel::new(2.0 * p.x + 0.5, 2.0 * p.y + 0.5);
            let coarse =
                quads::dark_quads(half, threshold).into_iter().map(|quad| quad.map(double)).collect();
            add(&mut tags, image, &undistortion, coarse);
            if enough(&tags) {
                break;
            }
        }
    }
    let position = |tag: &DetectedTag| (tag.center_px().x, tag.center_px().y);
    tags.sort_unstable_by(|a, b| {
        let ((ax, ay), (bx, by)) = (position(a), position(b));
        a.id.cmp(&b.id).then(ax.total_cmp(&bx)).then(ay.total_cmp(&by))
    });
    tags
}

/// Smallest side of the halved picture (px): in smaller ones no further tag can be found.
const SMALLEST_HALVED_PX: usize = 32;

fn add(tags: &mut Vec<DetectedTag>, image: &GreyImage, undistortion: &Undistortion, quads: Vec<[Pixel; 4]>) {
    for quad in quads {
        let Some(tag) = read(image, undistortion, quad) else { continue };
        let apart =
            |other: &DetectedTag| tag.center_px().distance_px(other.center_px()) > tag.side_px() / 2.0;
        if tags.iter().all(apart) {
            tags.push(tag);
        }
    }
}

/// The tag whose corners are near these pixels, with any number and orientation.
fn read(image: &GreyImage, undistortion: &Undistortion, near_px: [Pixel; 4]) -> Option<DetectedTag> {
    let (ideal, mut steps) = edges::fitted(image, undistortion, near_px, None, [None; 4])?;
    let (id, quarters) = family::identified(family::code(image, undistortion, &ideal)?)?;
    let mut corners_px = ideal.map(|p| undistortion.distorted(p).unwrap_or(NO_PIXEL));
    corners_px.rotate_left(quarters);
    steps.rotate_left(quarters);
    // A tag that was decoded but does not fit its own code is partly covered: the first fit is kept.
    let tag = DetectedTag { id, corners_px, steps };
    Some(refined(image, undistortion, &tag).unwrap_or(tag))
}

/// The corners of a decoded tag, fitted again with its code as part of the model.
fn refined(image: &GreyImage, undistortion: &Undistortion, tag: &DetectedTag) -> Option<DetectedTag> {
    let word = CODES.get(tag.id as usize).copied();
    let (ideal, steps) = edges::fitted(image, undistortion, tag.corners_px, word, tag.steps)?;
    let corners_px = ideal.map(|p| undistortion.distorted(p).unwrap_or(NO_PIXEL));
    Some(DetectedTag { id: tag.id, corners_px, steps })
}

/// The tag `id` near its predicted corners; `None` if it is not there or is rotated.
///
/// More wrong bits are accepted than in [`detected`], because the number and the position are known.
pub(super) fn detected_near(
    image: &GreyImage,
    lens: Option<&Lens>,
    id: u32,
    near_px: [Pixel; 4],
) -> Option<DetectedTag> {
    let undistortion = Undistortion { lens };
    let (ideal, steps) = edges::fitted(image, &undistortion, near_px, None, [None; 4])?;
    let wrong = family::code(image, &undistortion, &ideal)? ^ CODES.get(id as usize)?;
    let corners_px = ideal.map(|p| undistortion.distorted(p).unwrap_or(NO_PIXEL));
    let tag = DetectedTag { id, corners_px, steps };
    (wrong.count_ones() <= WRONG_BITS_EXPECTED).then(|| refined(image, &undistortion, &tag)).flatten()
}

/// Largest number of wrong bits: a random pattern has 18 of 36 wrong on average, and one in 150,000 has so few.
const WRONG_BITS_EXPECTED: u32 = 5;

/// The same tag's corners in another picture in which it hardly moved, without decoding it again.
pub(super) fn redetected(image: &GreyImage, lens: Option<&Lens>, tag: &DetectedTag) -> Option<DetectedTag> {
    refined(image, &Undistortion { lens }, tag)
}
