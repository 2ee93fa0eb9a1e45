//! Where exactly in the image is a marker?
//!
//! A component of the binary image gives the position roughly, the grey levels around it give it to a hundredth of a
//! pixel: each pixel is weighted by the fraction of marker that it shows, from the local background (0) to the
//! marker's own grey level (1).

use super::super::label::Component;
use super::super::threshold::Level;
use super::patch::{Patch, Plane, RIM_PX, THIRDS};
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use crate::geometry::moments::{Moments, principal_axes};
use std::f64::consts::PI;

/// A marker, or a region that resembles one, measured in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::detect) struct Blob {
    /// Centroid of the weights.
    pub centroid: Pixel,
    /// Standard deviation of the centroid along each axis due to noise (px).
    pub std_px: f64,
    /// Sum of the weights (px2).
    pub area_px2: f64,
    /// Central second moments over the area: xx, xy, yy (px2).
    pub covariance_px2: [f64; 3],
    /// The same without a dead band of the weights, which includes the blur of the lens and noise. Motion blur adds
    /// exactly its own variance to these moments.
    pub linear_covariance_px2: [f64; 3],
    /// Grey level of the background at the centroid.
    pub background: f64,
    /// Background minus marker (grey levels); negative for a light marker.
    pub contrast: f64,
    /// Root mean square difference of the surroundings from a plane (grey levels): noise and structure.
    pub background_rms: f64,
    /// Whether the component touches the border of the image, which may cut it off.
    pub at_border: bool,
}

impl Blob {
    /// Centroid and principal axis.
    pub(in crate::detect) fn image_pose(&self) -> ImagePose {
        ImagePose { centroid: self.centroid, axis_rad: principal_axes(self.covariance_px2).2 }
    }

    /// Contrast over background: independent of the illumination.
    pub(in crate::detect) fn relative_contrast(&self) -> f64 {
        self.contrast / self.background.max(1.0)
    }

    /// A component as a blob: every pixel has the weight 1.
    pub(in crate::detect) fn from_component(component: &Component, contrast: f64) -> Self {
        Self {
            centroid: component.centroid(),
            std_px: 1.0,
            area_px2: component.area_px as f64,
            covariance_px2: component.covariance_px2(),
            linear_covariance_px2: component.covariance_px2(),
            background: f64::from(u8::MAX) / 2.0,
            contrast,
            background_rms: 0.0,
            at_border: false,
        }
    }

    /// The blob with the position and the shape of its component.
    pub(in crate::detect) fn with_shape_of(self, component: &Component) -> Self {
        let Self { background, contrast, background_rms, at_border, .. } = self;
        Self { background, background_rms, at_border, ..Self::from_component(component, contrast) }
    }

    /// The level halfway between the marker and its background.
    pub(in crate::detect) fn level(&self) -> Level {
        Level::nearest(self.contrast > 0.0, self.background - self.contrast / 2.0)
    }
}

/// Centroid of a marker's image and direction of its principal axis (rad, y down).
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct ImagePose {
    pub centroid: Pixel,
    pub axis_rad: f64,
}

/// Dead band of the weights: a fraction within this of 0 or 1 counts as 0 or 1, so that noise far from the edge does
/// not move the centroid. It is wider where noise is a larger fraction of the contrast, but always less than half.
const DEAD_BAND: f64 = 0.1;
const WIDEST_DEAD_BAND: f64 = 0.35;
/// Compression and quantisation leave an error that does not average out along a marker's edge (px): a hundredth in a film of high
/// quality, a tenth in one of low quality.
const FLOOR_STD_PX: f64 = 0.03;
/// A smaller contrast (grey levels) is not a marker: eight-bit video rounds by one level and compression adds a few.
const LEAST_CONTRAST: f64 = 10.0;

/// The blob that a component roughly shows; `blur_px` is how far it moved during the exposure, if known.
///
/// `None` without enough background around it or without contrast.
pub(in crate::detect) fn measured(
    image: &GreyImage,
    component: &Component,
    level: Level,
    blur_px: [f64; 2],
) -> Option<Blob> {
    ComponentPatch::new(image, component, level, blur_px)?.measured()
}

/// The blob of a component that shows all of a moving marker, from the faintest part on: every pixel has the weight of the time for
/// which the marker covered it, by the marker's own contrast over the background. Its centroid is the mean position during the exposure,
/// its area that of the marker, whatever the motion was.
///
/// `None` without enough background around it or without contrast.
pub(in crate::detect) fn exposed(
    image: &GreyImage,
    component: &Component,
    level: Level,
    relative_contrast: f64,
) -> Option<Blob> {
    let patch = ComponentPatch::new(image, component, level, [0.0, 0.0])?;
    let contrast = relative_contrast.abs() * patch.plane.grey_at(component.centroid());
    if contrast < LEAST_CONTRAST {
        return None;
    }
    patch.blob(&patch.fractions(relative_contrast.abs()), |fraction| fraction != 0.0, contrast)
}

/// A component, the pixels around it and their background.
pub(in crate::detect) struct ComponentPatch {
    pixels: Patch,
    /// Centroid of the component.
    centroid: Pixel,
    plane: Plane,
    /// Background of each pixel, how much the pixel differs from it in the marker's direction, and its distance from the component.
    background: Vec<f64>,
    depths: Vec<f64>,
    thirds: Vec<u8>,
    /// Whether a pixel belongs to the component.
    foreground: Vec<bool>,
    /// 1 for a dark marker, -1 for a light one.
    sign: f64,
    /// Whether the component touches the border of the image.
    at_border: bool,
}

impl ComponentPatch {
    /// The patch of a component that moved during the exposure by this displacement (px).
    pub(in crate::detect) fn new(
        image: &GreyImage,
        component: &Component,
        level: Level,
        blur_px: [f64; 2],
    ) -> Option<Self> {
        let pixels = Patch::around(image, component, blur_px);
        let seed = pixels.index(component.seed[0] as usize, component.seed[1] as usize);
        let foreground = pixels.connected(image, level, seed);
        let thirds = pixels.distance_thirds(&pixels.smeared(&foreground, blur_px));
        let sign = if level.is_dark() { 1.0 } else { -1.0 };
        let (plane, background, depths) = background(&pixels, image, &thirds, sign)?;
        let at_border = touches_border(component, image);
        let centroid = component.centroid();
        Some(Self { pixels, centroid, plane, background, depths, thirds, foreground, sign, at_border })
    }

    /// The same without the pixels on the rim of the dot beside a disc that are nearer to the dot.
    pub(in crate::detect) fn beside(mut self, dot: &Blob, image: &GreyImage) -> Option<Self> {
        self.pixels.leave_out(dot.centroid, (dot.area_px2 / PI).sqrt(), &mut self.thirds);
        let (plane, background, depths) = background(&self.pixels, image, &self.thirds, self.sign)?;
        Some(Self { plane, background, depths, ..self })
    }

    /// See [`measured`].
    pub(in crate::detect) fn measured(&self) -> Option<Blob> {
        let contrast = self.plateau()?;
        let brightness = self.plane.grey_at(self.centroid);
        if contrast < LEAST_CONTRAST || brightness <= 0.0 {
            return None;
        }
        let dead = (2.0 * self.plane.scatter / contrast).clamp(DEAD_BAND, WIDEST_DEAD_BAND);
        let fractions = self.fractions(contrast / brightness);
        let weights: Vec<f64> = fractions
            .iter()
            .map(|fraction| ((fraction - dead) / (1.0 - 2.0 * dead)).clamp(0.0, 1.0))
            .collect();
        let is_edge = |weight: f64| 0.0 < weight && weight < 1.0;
        let blob = self.blob(&weights, is_edge, contrast * (1.0 - 2.0 * dead))?;
        let linear = self.pixels.moments(&fractions);
        Some(Blob {
            contrast: self.sign * contrast,
            linear_covariance_px2: linear.map_or(blob.covariance_px2, |linear| linear.covariance),
            ..blob
        })
    }

    /// See [`plateau`].
    fn plateau(&self) -> Option<f64> {
        let inside = self.depths.iter().zip(&self.foreground).filter(|&(_, &inside)| inside);
        plateau(inside.map(|(&depth, _)| depth).collect())
    }

    /// The fraction of marker that each pixel shows, up to the rim. Marker and background have the same illumination: contrast is
    /// proportional to the background's grey level.
    fn fractions(&self, relative_contrast: f64) -> Vec<f64> {
        let fraction = |(&depth, (&background, &thirds)): (&f64, (&f64, &u8))| {
            if thirds <= THIRDS * RIM_PX { depth / (relative_contrast * background.max(1.0)) } else { 0.0 }
        };
        self.depths.iter().zip(self.background.iter().zip(&self.thirds)).map(fraction).collect()
    }

    /// The blob of these weights; noise changes those of edge pixels, by one for a change of `levels` grey levels.
    fn blob(&self, weights: &[f64], is_edge: impl Fn(f64) -> bool, levels: f64) -> Option<Blob> {
        let Moments { area, centroid: [x, y], covariance } = self.pixels.moments(weights)?;
        let edge: Vec<f64> = weights.iter().map(|&w| if is_edge(w) { 1.0 } else { 0.0 }).collect();
        // Sum of squared distances from the centroid, per axis, over the pixels whose noise changes their weight.
        let leverage_px2 = self.pixels.moments(&edge).map_or(0.0, |edge| {
            let [dx, dy] = [edge.centroid[0] - x, edge.centroid[1] - y];
            edge.area * f64::midpoint(edge.covariance[0] + dx * dx, edge.covariance[2] + dy * dy)
        });
        let centroid = Pixel::new(x, y);
        Some(Blob {
            centroid,
            std_px: (leverage_px2.sqrt() * self.plane.scatter / (levels * area)).max(FLOOR_STD_PX),
            area_px2: area,
            covariance_px2: covariance,
            linear_covariance_px2: covariance,
            background: self.plane.grey_at(centroid),
            contrast: self.sign * levels,
            background_rms: self.plane.rms,
            at_border: self.at_border,
        })
    }
}

/// The plane of the background around a component, its grey level at each pixel, and how much the pixel differs from it in the direction of
/// the sign.
fn background(
    pixels: &Patch,
    image: &GreyImage,
    thirds: &[u8],
    sign: f64,
) -> Option<(Plane, Vec<f64>, Vec<f64>)> {
    let plane = pixels.background(image, thirds)?;
    let background = pixels.background_levels(&plane);
    let depths = pixels.depths(image, &background, sign);
    Some((plane, background, depths))
}

fn touches_border(component: &Component, image: &GreyImage) -> bool {
    component.x[0] == 0
        || component.y[0] == 0
        || component.x[1] as usize + 1 == image.width
        || component.y[1] as usize + 1 == image.height
}

/// The contrast of the pixels that show only marker: the median of the depths near the 90th percentile.
fn plateau(all: Vec<f64>) -> Option<f64> {
    let step = (all.len() / ENOUGH_DEPTHS).max(1);
    let mut depths: Vec<f64> = all.into_iter().step_by(step).collect();
    let n = depths.len();
    if n == 0 {
        return None;
    }
    let near_deepest = 0.8 * *depths.select_nth_unstable_by((n - 1) * 9 / 10, f64::total_cmp).1;
    let first = depths.iter().filter(|&&d| d < near_deepest).count();
    Some(*depths.select_nth_unstable_by(usize::midpoint(first, n - 1), f64::total_cmp).1)
}

/// This many pixels of a marker determine its grey level well within one level.
const ENOUGH_DEPTHS: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::label::{Labeller, Window};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64Mcg;

    /// A dark or light disc on a backbackground with a gradient, with a lens blur of 0.7 px.
    struct Picture {
        centre: Pixel,
        radius_px: f64,
        background: f64,
        slope_per_px: f64,
        marker: f64,
        blur_px: [f64; 2],
        noise: f64,
    }

    impl Picture {
        fn drawn(&self, rng: &mut Pcg64Mcg) -> GreyImage {
            let (width, height) = (160, 140);
            let noise = Normal::new(0.0, self.noise).expect("a standard deviation");
            let steps = if self.blur_px == [0.0, 0.0] { 1 } else { 41 };
            let pixels = (0..width * height)
                .map(|k| {
                    let (x, y) = ((k % width) as f64, (k / width) as f64);
                    let coverage = (0..steps)
                        .map(|step| {
                            let fraction =
                                if steps == 1 { 0.0 } else { f64::from(step) / f64::from(steps - 1) - 0.5 };
                            let (dx, dy) = (
                                x - self.centre.x - fraction * self.blur_px[0],
                                y - self.centre.y - fraction * self.blur_px[1],
                            );
                            // A logistic edge of about the width that a lens blur of 0.7 px gives.
                            1.0 / (1.0 + ((dx.hypot(dy) - self.radius_px) * 1.702 / 0.7).exp())
                        })
                        .sum::<f64>()
                        / f64::from(steps);
                    let background = self.background + self.slope_per_px * (x + 0.5 * y);
                    let shown = background + (self.marker - background) * coverage;
                    (shown + noise.sample(rng)).round().clamp(0.0, 255.0) as u8
                })
                .collect();
            GreyImage { width, height, pixels }
        }

        fn measured(&self, rng: &mut Pcg64Mcg) -> Blob {
            let image = self.drawn(rng);
            let middle = f64::midpoint(self.background + self.slope_per_px * 100.0, self.marker) as u8;
            let level =
                if self.marker < self.background { Level::Below(middle) } else { Level::Above(middle) };
            let mut labeller = Labeller::default();
            let found = labeller.components(&image, Window::whole(&image), level, &(20..=u64::MAX));
            let marker =
                found.iter().min_by_key(|c| c.area_px.abs_diff((3.0 * self.radius_px.powi(2)) as u64));
            measured(&image, marker.expect("a marker"), level, self.blur_px).expect("a blob")
        }
    }

    const PLAIN: Picture = Picture {
        centre: Pixel::new(70.3, 60.6),
        radius_px: 22.0,
        background: 180.0,
        slope_per_px: 0.0,
        marker: 25.0,
        blur_px: [0.0, 0.0],
        noise: 2.0,
    };

    fn rms_px(picture: impl Fn(Pixel) -> Picture) -> f64 {
        let mut rng = Pcg64Mcg::seed_from_u64(7);
        let mut squares = 0.0;
        let trials = 40;
        for k in 0..trials {
            let centre = Pixel::new(70.0 + 0.37 * f64::from(k % 7), 60.0 + 0.23 * f64::from(k));
            let blob = picture(centre).measured(&mut rng);
            squares += (blob.centroid.x - centre.x).powi(2) + (blob.centroid.y - centre.y).powi(2);
        }
        (squares / f64::from(2 * trials)).sqrt()
    }

    #[test]
    fn a_centroid_at_rest_is_right_within_hundredths_of_a_pixel() {
        for (radius_px, noise, slope_per_px, limit_px) in
            [(4.0, 2.0, 0.0, 0.015), (8.0, 2.0, 0.1, 0.012), (22.0, 2.0, 0.2, 0.008), (44.0, 8.0, 0.1, 0.03)]
        {
            let error_px = rms_px(|centre| Picture { centre, radius_px, slope_per_px, noise, ..PLAIN });
            println!("radius {radius_px} px, noise {noise}, slope {slope_per_px}/px: rms {error_px:.4} px");
            assert!(error_px < limit_px, "radius {radius_px} px, noise {noise}: rms {error_px} px");
        }
    }

    #[test]
    fn the_centroid_of_a_moving_marker_is_its_position_at_mid_exposure() {
        for blur_px in [[5.0, 0.0], [20.0, 0.0], [12.0, -12.0]] {
            let error_px = rms_px(|centre| Picture { centre, slope_per_px: 0.1, blur_px, ..PLAIN });
            println!("blur {blur_px:?} px: rms {error_px:.4} px");
            assert!(error_px < 0.02, "blur {blur_px:?} px: rms {error_px} px");
        }
    }

    #[test]
    fn a_light_marker_on_a_dark_object_is_measured_to_a_hundredth_of_a_pixel() {
        let error_px = rms_px(|centre| Picture { centre, background: 60.0, marker: 210.0, ..PLAIN });
        assert!(error_px < 0.01, "rms {error_px} px");
    }

    #[test]
    fn the_standard_deviation_predicts_the_error_in_dim_light_and_noise() {
        let dim = Picture { background: 70.0, marker: 20.0, noise: 4.0, radius_px: 12.0, ..PLAIN };
        let predicted_px = dim.measured(&mut Pcg64Mcg::seed_from_u64(1)).std_px;
        let error_px = rms_px(|centre| Picture { centre, ..dim });
        assert!(
            (0.5..2.0).contains(&(error_px / predicted_px)),
            "rms {error_px} px, predicted {predicted_px} px"
        );
    }

    #[test]
    fn area_and_moments_of_a_blob_are_those_of_the_disc() {
        let blob = PLAIN.measured(&mut Pcg64Mcg::seed_from_u64(3));
        let area_px2 = std::f64::consts::PI * 22.0 * 22.0;
        assert!((blob.area_px2 / area_px2 - 1.0).abs() < 0.01, "{} px2 of {area_px2}", blob.area_px2);
        let [xx, xy, yy] = blob.covariance_px2;
        assert!((xx / 121.0 - 1.0).abs() < 0.02 && (yy / 121.0 - 1.0).abs() < 0.02, "{xx} {yy} px2 of 121");
        assert!(xy.abs() < 1.0, "{xy} px2");
        assert!((blob.contrast - 155.0).abs() < 2.0 && !blob.at_border, "{blob:?}");
    }
}
