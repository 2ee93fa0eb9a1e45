//! Which AprilTags (36h11) does a picture show, and where are their corners?
//!
//! Dark patches with four straight sides are candidates ([`quads`]); their sides are fitted to a small part of a
//! pixel where the grey rises from the tag's black border to its white margin ([`edges`]); what they enclose is read
//! as a code word ([`family`]).  A known lens straightens the sides before they are fitted.

mod edges;
mod family;
mod quads;

use super::lens::Lens;
use super::{GreyImage, camera::UNSEEN};
use crate::cell::Tag;
use crate::geometry::{Pixel, Point, Pose};
use edges::Straight;

pub(super) use family::{CODES, is_white};

/// A tag in a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SeenTag {
    /// Its number.
    pub(super) id: u32,
    /// Top left, top right, bottom right, bottom left of the upright tag's black square (px).
    pub(super) corners_px: [Pixel; 4],
}

impl SeenTag {
    pub(super) fn center_px(&self) -> Pixel {
        let [x, y] =
            [|p: &Pixel| p.x, |p: &Pixel| p.y].map(|axis| self.corners_px.iter().map(axis).sum::<f64>());
        Pixel::new(x / 4.0, y / 4.0)
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
    let ideal = edges::fitted(image, straight, near_px)?;
    let (id, turns) = family::identified(family::code(image, straight, &ideal)?)?;
    let mut corners_px = ideal.map(|p| straight.bent(p).unwrap_or(UNSEEN));
    corners_px.rotate_left(turns);
    Some(SeenTag { id, corners_px })
}

/// The tag `id`, looked for where its corners should be; `None` if it does not lie there upright.
pub(super) fn expected(
    image: &GreyImage,
    lens: Option<&Lens>,
    id: u32,
    near_px: [Pixel; 4],
) -> Option<SeenTag> {
    let first = |tag: &SeenTag| tag.corners_px[0].distance_px(near_px[0]) < tag.side_px() / 2.0;
    read(image, &Straight { lens }, near_px).filter(|tag| tag.id == id && first(tag))
}

/// The same tag's corners in another picture in which it hardly moved, without reading it again.
pub(super) fn again(image: &GreyImage, lens: Option<&Lens>, tag: &SeenTag) -> Option<SeenTag> {
    let straight = Straight { lens };
    let ideal = edges::fitted(image, &straight, tag.corners_px)?;
    let corners_px = ideal.map(|p| straight.bent(p).unwrap_or(UNSEEN));
    Some(SeenTag { id: tag.id, corners_px })
}
