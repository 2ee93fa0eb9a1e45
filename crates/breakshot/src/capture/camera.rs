//! The camera: lens and pose, and the maps between pixels and points at any height above the table.

use super::lens::{Lens, middle_px};
use crate::cell::Transform;
use crate::geometry::{Pixel, Point};
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// The calibrated camera of a film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Width and height of the picture (px).
    pub size_px: [usize; 2],
    /// The map from the table to the picture.
    pub(super) projection: Projection,
    /// Root mean square distance between the measured pixels of the tags' corners (or the reference points) and those that
    /// this camera predicts (px).
    pub reprojection_rms_px: f64,
    /// The same on the table (m).
    pub reprojection_rms_m: f64,
    /// One standard deviation of a position on the table at the worst corner of the workspace (m); `None` for a scale, whose
    /// accuracy is unknown, and if no ray reaches a corner.
    #[serde(rename = "place_std_m")]
    pub position_std_m: Option<f64>,
    /// The covariance of the pose; `None` if it is unknown.
    #[serde(skip)]
    pub(super) pose_covariance: Option<DMatrix<f64>>,
    /// The numbers of the tags that the pose was fitted to.
    pub tags_found: Vec<u32>,
    /// Every tag of the cell that was detected, used or not.
    pub tags: Vec<TagFit>,
    /// The mean width of the tags' black squares over `size_m`, where lengths are those between their centres; `None` if fewer than four tags
    /// are used, if they differ, or if one is narrower than 40 px.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag_width_ratio: Option<f64>,
    /// How long a rolling shutter takes from the first to the last row (s); 0 for a global one.
    #[serde(default)]
    pub readout_s: f64,
    /// How long the shutter stays open, if known (s).
    #[serde(default)]
    pub exposure_s: Option<f64>,
    /// The height of the tags' faces above the table (m), which is height zero of the projection.
    #[serde(default)]
    pub tag_thickness_m: f64,
    /// Warnings about the pose.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// A detected tag and its reprojection error.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TagFit {
    /// Its number.
    pub id: u32,
    /// The measured pixels of its corners: top left, top right, bottom right, bottom left of the upright tag.
    pub corners_px: [Pixel; 4],
    /// Root mean square distance of the corners from those that the camera predicts (px).
    pub rms_px: f64,
    /// The same on the table (m).
    pub rms_m: f64,
    /// Whether the pose was fitted to it; a tag that contradicts the others is left out.
    pub used: bool,
}

/// The map from the table to the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Projection {
    /// A lens and its pose: valid at every height.
    Space {
        /// The lens.
        lens: Lens,
        /// Its pose.
        pose: Extrinsics,
    },
    /// A homography of the table: valid at height zero only.
    Plane {
        /// Homogeneous pixels from homogeneous table points, row by row.
        pixel_from_table: [[f64; 3]; 3],
    },
}

/// The rigid motion that takes table coordinates into the camera's frame (x right, y down, z forward).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Extrinsics {
    /// Row by row.
    pub(super) rotation: [[f64; 3]; 3],
    /// The table's origin in the camera's frame (m).
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

    /// The camera's position in the table frame (m).
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
    pub(super) fn pixel(&self, point: Point, height_m: f64) -> Option<Pixel> {
        match self {
            Self::Space { lens, pose } => {
                let p = pose.rotation() * Vector3::new(point.x, point.y, height_m) + pose.translation_m();
                let in_front = p.z > 0.0;
                in_front.then(|| lens.pixel_from_ray([p.x / p.z, p.y / p.z])).flatten()
            }
            Self::Plane { pixel_from_table } => {
                let p = matrix(pixel_from_table) * Vector3::new(point.x, point.y, 1.0);
                (p.z > 0.0).then(|| Pixel::new(p.x / p.z, p.y / p.z))
            }
        }
    }

    /// See [`Camera::table_from_pixel`].
    pub(super) fn table_point(&self, pixel: Pixel, height_m: f64) -> Option<Point> {
        match self {
            Self::Space { lens, pose } => {
                let [x, y] = lens.ray_from_pixel(pixel)?;
                let ray = pose.rotation().transpose() * Vector3::new(x, y, 1.0);
                let center = pose.position_m();
                let along = (height_m - center.z) / ray.z;
                let in_front = along > 0.0 && along.is_finite();
                in_front.then(|| Point::new(center.x + along * ray.x, center.y + along * ray.y))
            }
            Self::Plane { pixel_from_table } => {
                let p = matrix(pixel_from_table).try_inverse()? * Vector3::new(pixel.x, pixel.y, 1.0);
                (p.z > 0.0).then(|| Point::new(p.x / p.z, p.y / p.z))
            }
        }
    }
}

const NO_POINT: Point = Point::new(f64::NAN, f64::NAN);
pub(super) const NO_PIXEL: Pixel = Pixel::new(f64::NAN, f64::NAN);
/// Half the step of numerical derivatives (px): over one pixel the camera is nearly linear.
const HALF_PIXEL: f64 = 0.5;

impl Camera {
    /// A camera with a known lens and pose.
    ///
    /// At zero angles of `table_from_camera` the camera looks straight down, with the picture's right along the table's x
    /// and its top along y.
    pub fn new(size_px: [usize; 2], lens: Lens, table_from_camera: Transform) -> Self {
        let [roll, pitch, yaw] = table_from_camera.rpy_rad;
        let down = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let rotation = (Rotation3::from_euler_angles(roll, pitch, yaw).matrix() * down).transpose();
        let position = Vector3::from(table_from_camera.position_m);
        let pose = Extrinsics::new(&rotation, &-(rotation * position));
        Self::with_projection(size_px, Projection::Space { lens, pose })
    }

    /// A camera that looks straight down from far: `scale_px_per_m` at the table, its origin at `center_px` (default:
    /// the picture's middle).  It ignores heights.
    pub fn flat(size_px: [usize; 2], scale_px_per_m: f64, center_px: Option<[f64; 2]>) -> Self {
        let [cx, cy] = center_px.unwrap_or(middle_px(size_px));
        let s = scale_px_per_m;
        let pixel_from_table = [[s, 0.0, cx], [0.0, -s, cy], [0.0, 0.0, 1.0]];
        Self::with_projection(size_px, Projection::Plane { pixel_from_table })
    }

    /// A camera without residuals and warnings.
    pub(super) fn with_projection(size_px: [usize; 2], projection: Projection) -> Self {
        Self {
            size_px,
            projection,
            reprojection_rms_px: 0.0,
            reprojection_rms_m: 0.0,
            position_std_m: None,
            pose_covariance: None,
            tags_found: Vec::new(),
            tags: Vec::new(),
            tag_width_ratio: None,
            readout_s: 0.0,
            exposure_s: None,
            tag_thickness_m: 0.0,
            warnings: Vec::new(),
        }
    }

    /// The pixel of a point `height_m` above the table.
    ///
    /// Not a number for a point behind the camera or outside the range of its lens model.  A camera without a pose
    /// ([`Self::knows_heights`]) ignores the height.
    pub fn pixel_from_table(&self, point: Point, height_m: f64) -> Pixel {
        self.projection.pixel(point, height_m - self.tag_thickness_m).unwrap_or(NO_PIXEL)
    }

    /// The point of a pixel in the plane `height_m` above the table: the intersection of the pixel's ray with that plane.
    ///
    /// Not a number for a pixel whose ray does not meet the plane, such as one above the horizon.
    pub fn table_from_pixel(&self, pixel: Pixel, height_m: f64) -> Point {
        self.projection.table_point(pixel, height_m - self.tag_thickness_m).unwrap_or(NO_POINT)
    }

    /// The pixel of a point on the tags' faces.
    pub(super) fn tag_pixel(&self, point: Point) -> Pixel {
        self.pixel_from_table(point, self.tag_thickness_m)
    }

    /// The Jacobian of [`Self::table_from_pixel`]: the derivatives of (x, y) by the pixel's x and y (m / px), row by row.
    pub fn table_per_pixel_m(&self, pixel: Pixel, height_m: f64) -> [[f64; 2]; 2] {
        let point =
            |dx: f64, dy: f64| self.table_from_pixel(Pixel::new(pixel.x + dx, pixel.y + dy), height_m);
        let by_x = point(HALF_PIXEL, 0.0) - point(-HALF_PIXEL, 0.0);
        let by_y = point(0.0, HALF_PIXEL) - point(0.0, -HALF_PIXEL);
        [[by_x.x, by_y.x], [by_x.y, by_y.y]]
    }

    /// The side of the square that has the area of one pixel at that height (m / px); outside the image that of the nearest pixel in it, since a lens
    /// model is not valid far outside: there a pixel may show any small part of the table.
    pub fn scale_m_per_px(&self, pixel: Pixel, height_m: f64) -> f64 {
        let [width, height] = self.size_px.map(|size| size as f64);
        let nearest = Pixel::new(pixel.x.clamp(0.0, width), pixel.y.clamp(0.0, height));
        let [[xx, xy], [yx, yy]] = self.table_per_pixel_m(nearest, height_m);
        (xx * yy - xy * yx).abs().sqrt()
    }

    /// Whether the camera has a pose, so that heights are taken into account; false for a homography or a scale alone.
    pub fn knows_heights(&self) -> bool {
        matches!(self.projection, Projection::Space { .. })
    }

    /// The scale (m / px) at a point of that height; `None` if the camera sees nothing within `reach_m` of it.
    pub fn scale_where_shown(&self, point: Point, height_m: f64, reach_m: f64) -> Option<f64> {
        let at = self.pixel_from_table(point, height_m);
        let scale_m_per_px = self.scale_m_per_px(at, height_m);
        let is_shown = scale_m_per_px.is_finite() && self.shows_within(at, reach_m / scale_m_per_px);
        is_shown.then_some(scale_m_per_px)
    }

    /// The lens, if it is known.
    pub fn lens(&self) -> Option<&Lens> {
        match &self.projection {
            Projection::Space { lens, .. } => Some(lens),
            Projection::Plane { .. } => None,
        }
    }

    /// The camera's position in the table frame (m), if it is known.
    pub fn position_m(&self) -> Option<[f64; 3]> {
        match &self.projection {
            Projection::Space { pose, .. } => {
                let [x, y, z]: [f64; 3] = pose.position_m().into();
                Some([x, y, z + self.tag_thickness_m])
            }
            Projection::Plane { .. } => None,
        }
    }

    /// The angle between the optical axis and straight down (rad), if it is known.
    pub fn tilt_rad(&self) -> Option<f64> {
        match &self.projection {
            Projection::Space { pose, .. } => Some((-pose.rotation[2][2]).clamp(-1.0, 1.0).acos()),
            Projection::Plane { .. } => None,
        }
    }

    /// Whether a pixel is inside the picture.
    pub fn shows(&self, pixel: Pixel) -> bool {
        self.shows_within(pixel, 0.0)
    }

    /// Whether the square of this half side around a pixel meets the picture; false if the pixel is not a number.
    fn shows_within(&self, pixel: Pixel, reach_px: f64) -> bool {
        let margin_px = HALF_PIXEL + reach_px;
        let inside = |v: f64, size: usize| v >= -margin_px && v <= size as f64 - 2.0 * HALF_PIXEL + margin_px;
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
                    let point = Point::new(f64::from(k % 7) * 0.1 - 0.3, f64::from(k / 7) * 0.05 - 0.2);
                    let pixel = camera.pixel_from_table(point, height_m);
                    let back = camera.table_from_pixel(pixel, height_m);
                    assert!(back.distance(point) < 1e-11, "{point:?} at {height_m} m came back as {back:?}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn any_position_in_view_of_any_camera_is_found_again(
            roll_rad in -0.8..0.8, pitch_rad in -0.8..0.8, yaw_rad in -3.0..3.0,
            k1 in -0.2..0.2, x_px in 0.0..1279.0, y_px in 0.0..719.0, height_m in 0.0..0.3,
        ) {
            let lens = Lens::new([1100.0, 1098.0], [642.0, 355.0], [k1, 0.03, 0.001, -0.0005, 0.0]);
            let at = Transform { position_m: [0.05, -0.1, 1.2], rpy_rad: [roll_rad, pitch_rad, yaw_rad] };
            let camera = Camera::new([1280, 720], lens, at);
            let point = camera.table_from_pixel(Pixel::new(x_px, y_px), height_m);
            prop_assume!(point.is_finite());
            let back = camera.pixel_from_table(point, height_m);
            prop_assert!(back.distance_px(Pixel::new(x_px, y_px)) < 1e-6, "came back as {back:?}");
        }
    }

    /// Far outside the image the polynomial of a lens spreads a small part of the table over many pixels: a search in steps of so many pixels there would not end.
    #[test]
    fn the_scale_far_outside_the_image_is_that_of_its_border() {
        let lens = Lens::new([2088.0, 2088.0], [959.5, 539.5], [0.034, 0.044, 0.0008, 0.0004, 0.0]);
        let at = Transform { position_m: [0.0, 0.0, 0.8], rpy_rad: [0.1, 0.0, 0.0] };
        let camera = Camera::new([1920, 1080], lens, at);
        let far = Pixel::new(-7700.0, -3740.0);
        assert!(camera.table_from_pixel(far, 0.0).is_finite());
        let [outside, border] = [far, Pixel::new(0.0, 0.0)].map(|pixel| camera.scale_m_per_px(pixel, 0.0));
        assert_eq!(outside.to_bits(), border.to_bits(), "{outside} m/px beside {border} m/px");
        assert!(!camera.shows_within(far, 100.0) && camera.shows_within(Pixel::new(-50.0, 500.0), 60.0));
        assert!(!camera.shows_within(Pixel::new(f64::NAN, 0.0), 1e9));
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
    fn pixels_of_the_sky_and_points_behind_the_camera_have_no_finite_position() {
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
        let point = camera.table_from_pixel(Pixel::new(419.5, 139.5), 0.05);
        assert!(point.distance(Point::new(0.1, 0.1)) < 1e-12, "{point:?}");
        assert!(!camera.knows_heights());
    }

    #[test]
    fn a_camera_written_and_read_again_is_the_same_camera() {
        let camera = camera([0.3, -0.2, 0.1]);
        let text = serde_json::to_string(&camera).expect("writes");
        assert_eq!(serde_json::from_str::<Camera>(&text).expect("reads"), camera);
    }
}
