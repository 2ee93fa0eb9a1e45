//! Where the camera stands, and the way from a pixel to a place at any height above the table and back.

use super::lens::{Lens, middle_px};
use crate::cell::Transform;
use crate::geometry::{Pixel, Point};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// Where the camera stands and what its lens does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Width and height of the picture (px).
    pub size_px: [usize; 2],
    /// The way from the table to the picture.
    pub(super) projection: Projection,
    /// Root mean square distance between where the tags' corners (or the reference points) were seen and where this
    /// camera sees them (px).
    pub reprojection_rms_px: f64,
    /// The same on the table (m).
    pub reprojection_rms_m: f64,
    /// One standard deviation of a place on the table at the worst corner of the workspace, as far as what was seen
    /// tells (m); unknown for a scale, which says nothing of itself, and for a corner that no ray reaches.
    pub place_std_m: Option<f64>,
    /// The numbers of the tags that were found and used.
    pub tags_found: Vec<u32>,
    /// Every tag that was seen, used or not.
    pub tags: Vec<TagFit>,
    /// How long a rolling shutter takes from the first to the last row (s); 0 for a global one.
    #[serde(default)]
    pub readout_s: f64,
    /// How long the shutter stays open, if known (s).
    #[serde(default)]
    pub exposure_s: Option<f64>,
    /// How far above the table the tags' faces lie, which the projection calls height zero (m).
    #[serde(default)]
    pub tag_thickness_m: f64,
    /// What the user should know about the pose.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// A tag in the picture, beside where the camera expects it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagFit {
    /// Its number.
    pub id: u32,
    /// Where its corners were seen: top left, top right, bottom right, bottom left of the upright tag (px).
    pub corners_px: [Pixel; 4],
    /// Root mean square distance of the corners from where the camera expects them (px).
    pub rms_px: f64,
    /// The same on the table (m).
    pub rms_m: f64,
    /// Whether the pose rests on it; a tag that contradicts the others is left out.
    pub used: bool,
}

/// The way from the table to the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Projection {
    /// A lens at a place in space: right at every height.
    Space {
        /// The lens.
        lens: Lens,
        /// Where it stands.
        pose: Extrinsics,
    },
    /// A homography of the table itself: right at height zero only.
    Plane {
        /// Homogeneous pixels from homogeneous table places, row by row.
        pixel_from_table: [[f64; 3]; 3],
    },
}

/// The rigid motion that takes table coordinates into the camera's frame (x right, y down, z forward).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Extrinsics {
    /// Row by row.
    pub(super) rotation: [[f64; 3]; 3],
    /// The table's origin as the camera sees it (m).
    pub(super) translation_m: [f64; 3],
}

impl Extrinsics {
    pub(super) fn new(rotation: &Matrix3<f64>, translation_m: &Vector3<f64>) -> Self {
        Self { rotation: rows(rotation), translation_m: (*translation_m).into() }
    }

    pub(super) fn rotation(&self) -> Matrix3<f64> {
        matrix(&self.rotation)
    }

    pub(super) fn translation_m(&self) -> Vector3<f64> {
        self.translation_m.into()
    }

    /// Where the camera stands on the table (m).
    pub(super) fn position_m(&self) -> Vector3<f64> {
        -(self.rotation().transpose() * self.translation_m())
    }
}

fn rows(m: &Matrix3<f64>) -> [[f64; 3]; 3] {
    m.transpose().into()
}

fn matrix(rows: &[[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from(*rows).transpose()
}

impl Projection {
    /// See [`Camera::pixel_from_table`].
    pub(super) fn pixel(&self, place: Point, height_m: f64) -> Option<Pixel> {
        match self {
            Self::Space { lens, pose } => {
                let seen = pose.rotation() * Vector3::new(place.x, place.y, height_m) + pose.translation_m();
                let in_front = seen.z > 0.0;
                in_front.then(|| lens.pixel_from_ray([seen.x / seen.z, seen.y / seen.z])).flatten()
            }
            Self::Plane { pixel_from_table } => {
                let p = matrix(pixel_from_table) * Vector3::new(place.x, place.y, 1.0);
                (p.z > 0.0).then(|| Pixel::new(p.x / p.z, p.y / p.z))
            }
        }
    }

    /// See [`Camera::table_from_pixel`].
    pub(super) fn place(&self, pixel: Pixel, height_m: f64) -> Option<Point> {
        match self {
            Self::Space { lens, pose } => {
                let [x, y] = lens.ray_from_pixel(pixel)?;
                let ray = pose.rotation().transpose() * Vector3::new(x, y, 1.0);
                let eye = pose.position_m();
                let along = (height_m - eye.z) / ray.z;
                let ahead = along > 0.0 && along.is_finite();
                ahead.then(|| Point::new(eye.x + along * ray.x, eye.y + along * ray.y))
            }
            Self::Plane { pixel_from_table } => {
                let p = matrix(pixel_from_table).try_inverse()? * Vector3::new(pixel.x, pixel.y, 1.0);
                (p.z > 0.0).then(|| Point::new(p.x / p.z, p.y / p.z))
            }
        }
    }
}

const NOWHERE: Point = Point::new(f64::NAN, f64::NAN);
pub(super) const UNSEEN: Pixel = Pixel::new(f64::NAN, f64::NAN);
/// The scale is taken over one pixel, where the camera is as good as linear.
const HALF_PIXEL: f64 = 0.5;

impl Camera {
    /// A camera of known lens and pose.
    ///
    /// `table_from_camera` at zero angles looks straight down, the picture's right along the table's x, its top towards y.
    pub fn new(size_px: [usize; 2], lens: Lens, table_from_camera: Transform) -> Self {
        let [roll, pitch, yaw] = table_from_camera.rpy_rad;
        let down = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rotation = (Rotation3::from_euler_angles(roll, pitch, yaw).matrix() * down).transpose();
        let position = Vector3::from(table_from_camera.position_m);
        let pose = Extrinsics::new(&rotation, &-(rotation * position));
        Self::seeing(size_px, Projection::Space { lens, pose })
    }

    /// A camera that looks straight down from far: `scale_px_per_m` at the table, its origin at `center_px` (default:
    /// the picture's middle).  It knows no heights.
    pub fn flat(size_px: [usize; 2], scale_px_per_m: f64, center_px: Option<[f64; 2]>) -> Self {
        let [cx, cy] = center_px.unwrap_or(middle_px(size_px));
        let s = scale_px_per_m;
        let pixel_from_table = [[s, 0.0, cx], [0.0, -s, cy], [0.0, 0.0, 1.0]];
        Self::seeing(size_px, Projection::Plane { pixel_from_table })
    }

    /// A camera with nothing measured about it yet.
    pub(super) fn seeing(size_px: [usize; 2], projection: Projection) -> Self {
        Self {
            size_px,
            projection,
            reprojection_rms_px: 0.0,
            reprojection_rms_m: 0.0,
            place_std_m: None,
            tags_found: Vec::new(),
            tags: Vec::new(),
            readout_s: 0.0,
            exposure_s: None,
            tag_thickness_m: 0.0,
            warnings: Vec::new(),
        }
    }

    /// Where a place `height_m` above the table appears in the picture.
    ///
    /// Not a number for what the camera cannot see: behind it, or past the rays its lens model holds for.  A camera
    /// that knows no heights ([`Self::knows_heights`]) shows everything as if it lay on the table.
    pub fn pixel_from_table(&self, place: Point, height_m: f64) -> Pixel {
        self.projection.pixel(place, height_m - self.tag_thickness_m).unwrap_or(UNSEEN)
    }

    /// The place `height_m` above the table that a pixel shows: the ray is cut at that height.
    ///
    /// Not a number for a pixel that shows no place at that height, such as one above the horizon.
    pub fn table_from_pixel(&self, pixel: Pixel, height_m: f64) -> Point {
        self.projection.place(pixel, height_m - self.tag_thickness_m).unwrap_or(NOWHERE)
    }

    /// How a place at that height moves with its pixel: the derivatives of (x, y) by the pixel's x and y (m / px),
    /// row by row.
    pub fn table_per_pixel_m(&self, pixel: Pixel, height_m: f64) -> [[f64; 2]; 2] {
        let place =
            |dx: f64, dy: f64| self.table_from_pixel(Pixel::new(pixel.x + dx, pixel.y + dy), height_m);
        let by_x = place(HALF_PIXEL, 0.0) - place(-HALF_PIXEL, 0.0);
        let by_y = place(0.0, HALF_PIXEL) - place(0.0, -HALF_PIXEL);
        [[by_x.x, by_y.x], [by_x.y, by_y.y]]
    }

    /// The side of a square of the size of one pixel's place at that height (m / px).
    pub fn scale_m_per_px(&self, pixel: Pixel, height_m: f64) -> f64 {
        let [[xx, xy], [yx, yy]] = self.table_per_pixel_m(pixel, height_m);
        (xx * yy - xy * yx).abs().sqrt()
    }

    /// Whether rays are cut at the height asked for; false for a camera known by a homography or a scale alone.
    pub fn knows_heights(&self) -> bool {
        matches!(self.projection, Projection::Space { .. })
    }

    /// The lens, where one is known.
    pub fn lens(&self) -> Option<&Lens> {
        match &self.projection {
            Projection::Space { lens, .. } => Some(lens),
            Projection::Plane { .. } => None,
        }
    }

    /// Where the camera stands in the table's frame (m), where it is known.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        match &self.projection {
            Projection::Space { pose, .. } => {
                let [x, y, z]: [f64; 3] = pose.position_m().into();
                Some([x, y, z + self.tag_thickness_m])
            }
            Projection::Plane { .. } => None,
        }
    }

    /// The angle between the optical axis and straight down (rad), where it is known.
    pub fn tilt_rad(&self) -> Option<f64> {
        match &self.projection {
            Projection::Space { pose, .. } => Some((-pose.rotation[2][2]).clamp(-1.0, 1.0).acos()),
            Projection::Plane { .. } => None,
        }
    }

    /// Whether a pixel lies in the picture.
    pub fn shows(&self, pixel: Pixel) -> bool {
        let inside = |v: f64, size: usize| v >= -HALF_PIXEL && v <= size as f64 - HALF_PIXEL;
        inside(pixel.x, self.size_px[0]) && inside(pixel.y, self.size_px[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{prop_assert, prop_assume, proptest};

    fn camera(rpy_rad: [f64; 3]) -> Camera {
        let lens = Lens::new([1100.0, 1098.0], [642.0, 355.0], [-0.12, 0.03, 0.001, -0.0005, 0.0]);
        Camera::new([1280, 720], lens, Transform { position_m: [0.05, -0.1, 1.2], rpy_rad })
    }

    #[test]
    fn a_place_taken_to_its_pixel_and_back_is_the_same_place_at_every_height() {
        for rpy_rad in [[0.0; 3], [0.3, -0.2, 0.1], [0.0, 0.4, std::f64::consts::PI]] {
            let camera = camera(rpy_rad);
            for height_m in [0.0, 0.05, 0.3] {
                for k in 0..50 {
                    let place = Point::new(f64::from(k % 7) * 0.1 - 0.3, f64::from(k / 7) * 0.05 - 0.2);
                    let pixel = camera.pixel_from_table(place, height_m);
                    let back = camera.table_from_pixel(pixel, height_m);
                    assert!(back.distance(place) < 1e-11, "{place:?} at {height_m} m came back as {back:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn any_place_in_view_of_any_camera_is_found_again(
            roll_rad in -0.8..0.8, pitch_rad in -0.8..0.8, yaw_rad in -3.0..3.0,
            k1 in -0.2..0.2, x_px in 0.0..1279.0, y_px in 0.0..719.0, height_m in 0.0..0.3,
        ) {
            let lens = Lens::new([1100.0, 1098.0], [642.0, 355.0], [k1, 0.03, 0.001, -0.0005, 0.0]);
            let at = Transform { position_m: [0.05, -0.1, 1.2], rpy_rad: [roll_rad, pitch_rad, yaw_rad] };
            let camera = Camera::new([1280, 720], lens, at);
            let place = camera.table_from_pixel(Pixel::new(x_px, y_px), height_m);
            prop_assume!(place.is_finite());
            let back = camera.pixel_from_table(place, height_m);
            prop_assert!(back.distance_px(Pixel::new(x_px, y_px)) < 1e-6, "came back as {back:?}");
        }
    }

    #[test]
    fn a_camera_straight_above_sees_x_to_the_right_and_y_up_and_near_things_larger() {
        let camera = Camera::new(
            [640, 480],
            Lens::pinhole([640, 480], 500.0),
            Transform { position_m: [0.0, 0.0, 1.0], rpy_rad: [0.0; 3] },
        );
        let pixel = camera.pixel_from_table(Point::new(0.1, 0.2), 0.0);
        assert!(pixel.distance_px(Pixel::new(319.5 + 50.0, 239.5 - 100.0)) < 1e-9, "{pixel:?}");
        let raised = camera.pixel_from_table(Point::new(0.1, 0.0), 0.5);
        assert!((raised.x - 419.5).abs() < 1e-9, "{raised:?}");
        assert!((camera.scale_m_per_px(pixel, 0.5) - 0.001).abs() < 1e-12);
        assert_eq!((camera.tilt_rad(), camera.position_m()), (Some(0.0), Some([0.0, 0.0, 1.0])));
    }

    #[test]
    fn what_cannot_be_seen_is_not_a_number() {
        let camera = camera([0.0, 1.3, 0.0]);
        let sky =
            [Pixel::new(0.0, 360.0), Pixel::new(1279.0, 360.0)].map(|p| camera.table_from_pixel(p, 0.0));
        assert_eq!(
            sky.iter().filter(|p| p.is_finite()).count(),
            1,
            "one side of the picture is sky: {sky:?}"
        );
        let behind = camera.pixel_from_table(Point::new(0.05, -0.1), 2.0);
        assert!(behind.x.is_nan() || !camera.shows(behind), "{behind:?}");
    }

    #[test]
    fn a_flat_camera_maps_by_its_scale_alone() {
        let camera = Camera::flat([640, 480], 1000.0, None);
        let place = camera.table_from_pixel(Pixel::new(419.5, 139.5), 0.05);
        assert!(place.distance(Point::new(0.1, 0.1)) < 1e-12, "{place:?}");
        assert!(!camera.knows_heights());
    }

    #[test]
    fn a_camera_written_and_read_again_is_the_same_camera() {
        let camera = camera([0.3, -0.2, 0.1]);
        let text = serde_json::to_string(&camera).expect("writes");
        assert_eq!(serde_json::from_str::<Camera>(&text).expect("reads"), camera);
    }
}
