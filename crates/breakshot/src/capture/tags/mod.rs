//! Which AprilTags (36h11) does a picture show, and where are their corners?
//!
//! Dark patches with four straight sides are candidates ([`quads`]); their sides are fitted to a small part of a
//! pixel where the grey rises from the tag's black border to its white margin ([`edges`]); what they enclose is read
//! as a code word ([`family`]).  A known lens straightens the sides before they are fitted.

mod edges;
mod family;
mod quads;
mod sheet;
mod undistorted;

use super::camera::UNSEEN;
use super::image::GreyImage;
use super::lens::Lens;
use crate::cell::Tag;
use crate::geometry::{Pixel, Point, Pose};
use edges::Step;
use undistorted::Straight;

pub use sheet::tag_sheet;

#[cfg(any(test, feature = "synthetic"))]
pub(crate) use family::is_white;

pub(crate) use family::CODES;

/// A tag in a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SeenTag {
    /// Its number.
    pub(super) id: u32,
    /// Top left, top right, bottom right, bottom left of the upright tag's black square (px).
    pub(super) corners_px: [Pixel; 4],
    /// How its sides look: top, right, bottom, left.
    steps: [Option<Step>; 4],
}

impl SeenTag {
    /// A tag known from an earlier picture.
    pub(super) fn remembered(id: u32, corners_px: [Pixel; 4]) -> Self {
        Self { id, corners_px, steps: [None; 4] }
    }

    /// One standard deviation of each corner, as far as its sides' fits tell (px).
    pub(super) fn std_px(&self) -> [f64; 4] {
        let side = |k: usize| self.steps[k].as_ref().map_or(0.0, Step::std_px);
        [0, 1, 2, 3].map(|k| side(k).max(side((k + 3) % 4)))
    }

    /// The picture of its centre: where its diagonals cross, whatever the perspective.
    pub(super) fn center_px(&self) -> Pixel {
        let [a, b, c, d] = self.corners_px;
        let cross = |p: (f64, f64), q: (f64, f64)| p.0 * q.1 - p.1 * q.0;
        let (ac, bd, ab) = ((c.x - a.x, c.y - a.y), (d.x - b.x, d.y - b.y), (b.x - a.x, b.y - a.y));
        let part = cross(ab, bd) / cross(ac, bd);
        Pixel::new(a.x + part * ac.0, a.y + part * ac.1)
    }

    fn side_px(&self) -> f64 {
        (0..4).map(|k| self.corners_px[k].distance_px(self.corners_px[(k + 1) % 4])).sum::<f64>() / 4.0
    }
}

impl Tag {
    /// The corners of its black square on the table: top left, top right, bottom right, bottom left where it reads
    /// upright.
    pub(super) fn corners_m(&self) -> [Point; 4] {
        let pose = Pose { position: self.center_m, yaw_rad: self.yaw_rad };
        let half = self.size_m / 2.0;
        [(-half, half), (half, half), (half, -half), (-half, -half)]
            .map(|(x, y)| pose.table_from_body(Point::new(x, y)))
    }
}

/// Where between the darkest (0) and the lightest (1) grey nearby a pixel stops being dark: half way first, then
/// lower and higher for tags that a shadow or a glare crosses.
const THRESHOLDS: [f64; 3] = [0.5, 0.3, 0.7];

/// Every tag of the family in the picture, in order of number.
///
/// A first look at full size finds them in good light; unless it finds `enough`, further looks try other thresholds
/// and a picture of half the size, which forgives noise and blur.
pub(super) fn seen(
    image: &GreyImage,
    lens: Option<&Lens>,
    enough: impl Fn(&[SeenTag]) -> bool,
) -> Vec<SeenTag> {
    let straight = Straight { lens };
    let mut tags = Vec::new();
    let half = (image.width >= 2 * SMALLEST_HALVED_PX && image.height >= 2 * SMALLEST_HALVED_PX)
        .then(std::cell::OnceCell::new);
    for threshold in THRESHOLDS {
        let whole = quads::dark_quads(image, threshold);
        add(&mut tags, image, &straight, whole);
        if enough(&tags) {
            break;
        }
        if let Some(half) = &half {
            let half = half.get_or_init(|| image.halved());
            let double = |p: Pixel| Pixel::new(2.0 * p.x + 0.5, 2.0 * p.y + 0.5);
            let coarse =
                quads::dark_quads(half, threshold).into_iter().map(|quad| quad.map(double)).collect();
            add(&mut tags, image, &straight, coarse);
            if enough(&tags) {
                break;
            }
        }
    }
    tags.sort_by(|a, b| a.id.cmp(&b.id).then(a.center_px().x.total_cmp(&b.center_px().x)));
    tags
}

/// Below this many pixels in half a picture there is no tag that the whole one does not show.
const SMALLEST_HALVED_PX: usize = 32;

fn add(tags: &mut Vec<SeenTag>, image: &GreyImage, straight: &Straight, quads: Vec<[Pixel; 4]>) {
    for quad in quads {
        let Some(tag) = read(image, straight, quad) else { continue };
        let apart = |other: &SeenTag| tag.center_px().distance_px(other.center_px()) > tag.side_px() / 2.0;
        if tags.iter().all(apart) {
            tags.push(tag);
        }
    }
}

/// The tag whose corners lie near these, whatever its number and turn.
fn read(image: &GreyImage, straight: &Straight, near_px: [Pixel; 4]) -> Option<SeenTag> {
    let (ideal, mut steps) = edges::fitted(image, straight, near_px, None, [None; 4])?;
    let (id, turns) = family::identified(family::code(image, straight, &ideal)?)?;
    let mut corners_px = ideal.map(|p| straight.bent(p).unwrap_or(UNSEEN));
    corners_px.rotate_left(turns);
    steps.rotate_left(turns);
    // A tag that was read and yet does not fit its own code is covered in part; what was fitted stands.
    let tag = SeenTag { id, corners_px, steps };
    Some(known(image, straight, &tag).unwrap_or(tag))
}

/// The corners of a tag that was read, its code now part of the picture that is expected.
fn known(image: &GreyImage, straight: &Straight, tag: &SeenTag) -> Option<SeenTag> {
    let word = CODES.get(tag.id as usize).copied();
    let (ideal, steps) = edges::fitted(image, straight, tag.corners_px, word, tag.steps)?;
    let corners_px = ideal.map(|p| straight.bent(p).unwrap_or(UNSEEN));
    Some(SeenTag { id: tag.id, corners_px, steps })
}

/// The tag `id`, looked for where its corners should be; `None` if it does not lie there upright.
///
/// Since nothing else is expected there, more bits may be wrong than in a tag met anywhere.
pub(super) fn expected(
    image: &GreyImage,
    lens: Option<&Lens>,
    id: u32,
    near_px: [Pixel; 4],
) -> Option<SeenTag> {
    let straight = Straight { lens };
    let (ideal, steps) = edges::fitted(image, &straight, near_px, None, [None; 4])?;
    let wrong = family::code(image, &straight, &ideal)? ^ CODES.get(id as usize)?;
    let corners_px = ideal.map(|p| straight.bent(p).unwrap_or(UNSEEN));
    let tag = SeenTag { id, corners_px, steps };
    (wrong.count_ones() <= WRONG_BITS_EXPECTED).then(|| known(image, &straight, &tag)).flatten()
}

/// A pattern made by chance has half of its 36 bits wrong, and as few as this once in a million.
const WRONG_BITS_EXPECTED: u32 = 5;

/// The same tag's corners in another picture in which it hardly moved, without reading it again.
pub(super) fn again(image: &GreyImage, lens: Option<&Lens>, tag: &SeenTag) -> Option<SeenTag> {
    known(image, &Straight { lens }, tag)
}
