//! Where exactly in the picture is a marker?
//!
//! A component of the binary image says roughly where; the grey levels around it say to a hundredth of a pixel.  Every
//! pixel counts by how far it is from the local background towards the marker's own grey.

use super::super::label::Component;
use super::super::threshold::Level;
use super::patch::{Patch, RIM_PX, THIRDS};
use crate::capture::GreyImage;
use crate::geometry::Pixel;
use crate::moments::{Moments, principal_axes};

/// A marker, or something like one, measured in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::detect) struct Blob {
    /// Its mean place, each pixel weighted by how much of the marker it shows.
    pub centroid: Pixel,
    /// One standard deviation of the centroid's noise along each axis (px).
    pub std_px: f64,
    /// Its area (px2), parts of pixels counted as parts.
    pub area_px2: f64,
    /// Central second moments over the area: xx, xy, yy (px2).
    pub covariance_px2: [f64; 3],
    /// The same without a dead band, so that it tells the lens and the noise too: to this one smear adds just its own
    /// variance.
    pub linear_covariance_px2: [f64; 3],
    /// The grey level around it.
    pub background: f64,
    /// How much darker than its surroundings it is; negative if lighter (grey levels).
    pub contrast: f64,
    /// Root mean square difference of its surroundings from a plane (grey levels): noise, and whatever else is there.
    pub unevenness: f64,
    /// Whether the picture's edge may cut it.
    pub cut: bool,
}

impl Blob {
    /// Where its picture has its centroid and its long axis.
    pub(in crate::detect) fn aim(&self) -> Aim {
        Aim { centroid: self.centroid, axis_rad: principal_axes(self.covariance_px2).2 }
    }

    /// The contrast as a part of the grey level around: the same in light and shade.
    pub(in crate::detect) fn relative_contrast(&self) -> f64 {
        self.contrast / self.background.max(1.0)
    }

    /// What a component says by itself, tops and sides of any grey together.
    pub(in crate::detect) fn rough(component: &Component, contrast: f64) -> Self {
        Self {
            centroid: component.centroid(),
            std_px: 1.0,
            area_px2: component.area_px as f64,
            covariance_px2: component.covariance_px2(),
            linear_covariance_px2: component.covariance_px2(),
            background: f64::from(u8::MAX) / 2.0,
            contrast,
            unevenness: 0.0,
            cut: false,
        }
    }

    /// The level halfway between the marker and its surroundings.
    pub(in crate::detect) fn level(&self) -> Level {
        let middle = (self.background - self.contrast / 2.0).round().clamp(1.0, 254.0) as u8;
        if self.contrast > 0.0 { Level::Below(middle) } else { Level::Above(middle) }
    }
}

/// Where a marker's picture has its centroid and its long axis.
#[derive(Clone, Copy, Debug)]
pub(in crate::detect) struct Aim {
    pub centroid: Pixel,
    pub axis_rad: f64,
}

/// Weights this close to background or marker count as such, so that noise far from the edge does not move the
/// centroid; wider where the noise is a larger part of the contrast, but never half.
const DEAD_BAND: f64 = 0.1;
const WIDEST_DEAD_BAND: f64 = 0.35;
/// Compression and quantisation leave an error that does not average out over a marker's edge (px).
const FLOOR_STD_PX: f64 = 0.01;

/// Measures what the component roughly shows; `blur_px` is how far it moved while the shutter was open, if known.
///
/// Nothing if there is no background around it to compare with, or no contrast.
pub(in crate::detect) fn measured(
    image: &GreyImage,
    component: &Component,
    level: Level,
    blur_px: [f64; 2],
) -> Option<Blob> {
    let patch = Patch::around(image, component, blur_px);
    let seed = patch.index(component.seed[0] as usize, component.seed[1] as usize);
    let core = patch.connected(image, level, seed);
    let away = patch.distances(&patch.smeared(&core, blur_px));
    let plane = patch.background(image, &away)?;
    let light_over_dark = match level {
        Level::Below(_) => 1.0,
        Level::Above(_) => -1.0,
    };
    let light = patch.light(&plane);
    let depth = patch.depths(image, &light, light_over_dark);
    let contrast =
        plateau(depth.iter().zip(&core).filter(|&(_, &inside)| inside).map(|(&d, _)| d).collect())?;
    let brightness = plane.at_place(component.centroid());
    if contrast < LEAST_CONTRAST || brightness <= 0.0 {
        return None;
    }
    let dead = (2.0 * plane.scatter / contrast).clamp(DEAD_BAND, WIDEST_DEAD_BAND);
    // Marker and surroundings share the light: where it is brighter, the contrast is larger in proportion.
    let share = |(&depth, (&light, &away)): (&f64, (&f64, &u8))| {
        if away <= THIRDS * RIM_PX { depth * brightness / (contrast * light.max(1.0)) } else { 0.0 }
    };
    let shares: Vec<f64> = depth.iter().zip(light.iter().zip(&away)).map(share).collect();
    let weights: Vec<f64> =
        shares.iter().map(|share| ((share - dead) / (1.0 - 2.0 * dead)).clamp(0.0, 1.0)).collect();
    let Moments { area, centroid: [x, y], covariance } = patch.moments(&weights)?;
    let partly: Vec<f64> = weights.iter().map(|&w| if 0.0 < w && w < 1.0 { 1.0 } else { 0.0 }).collect();
    // Sum of the squared distances from the centroid, per axis, over the pixels whose noise counts.
    let leverage_px2 = patch.moments(&partly).map_or(0.0, |partly| {
        let [dx, dy] = [partly.centroid[0] - x, partly.centroid[1] - y];
        partly.area * f64::midpoint(partly.covariance[0] + dx * dx, partly.covariance[2] + dy * dy)
    });
    let noise_of_weight = plane.scatter / (contrast * (1.0 - 2.0 * dead));
    let centroid = Pixel::new(x, y);
    Some(Blob {
        centroid,
        std_px: (leverage_px2.sqrt() * noise_of_weight / area).max(FLOOR_STD_PX),
        area_px2: area,
        covariance_px2: covariance,
        linear_covariance_px2: patch.moments(&shares).map_or(covariance, |linear| linear.covariance),
        background: plane.at_place(centroid),
        contrast: light_over_dark * contrast,
        unevenness: plane.unevenness,
        cut: component.x[0] == 0
            || component.y[0] == 0
            || component.x[1] as usize + 1 == image.width
            || component.y[1] as usize + 1 == image.height,
    })
}

/// Fewer grey levels than this between marker and object are not a marker: eight-bit video alone rounds by one and
/// compresses by a few.
const LEAST_CONTRAST: f64 = 10.0;

/// The contrast of pixels that show nothing but marker: the middle of those near the deepest.
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

/// So many pixels spread over a marker tell its grey well within a level.
const ENOUGH_DEPTHS: usize = 1000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detect::label::{Labeller, Window};
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    use rand_pcg::Pcg64Mcg;

    /// A disc or a light disc on a shaded ground, seen by a lens that smears a point over 0.7 px.
    struct Picture {
        centre: Pixel,
        radius_px: f64,
        ground: f64,
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
                            let part =
                                if steps == 1 { 0.0 } else { f64::from(step) / f64::from(steps - 1) - 0.5 };
                            let (dx, dy) = (
                                x - self.centre.x - part * self.blur_px[0],
                                y - self.centre.y - part * self.blur_px[1],
                            );
                            // A smooth edge of about the width that a lens of 0.7 px gives.
                            1.0 / (1.0 + ((dx.hypot(dy) - self.radius_px) * 1.702 / 0.7).exp())
                        })
                        .sum::<f64>()
                        / f64::from(steps);
                    let ground = self.ground + self.slope_per_px * (x + 0.5 * y);
                    let shown = ground + (self.marker - ground) * coverage;
                    (shown + noise.sample(rng)).round().clamp(0.0, 255.0) as u8
                })
                .collect();
            GreyImage { width, height, pixels }
        }

        fn measured(&self, rng: &mut Pcg64Mcg) -> Blob {
            let image = self.drawn(rng);
            let middle = f64::midpoint(self.ground + self.slope_per_px * 100.0, self.marker) as u8;
            let level = if self.marker < self.ground { Level::Below(middle) } else { Level::Above(middle) };
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
        ground: 180.0,
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
    fn motion_while_the_shutter_is_open_leaves_the_centroid_at_mid_exposure() {
        for blur_px in [[5.0, 0.0], [20.0, 0.0], [12.0, -12.0]] {
            let error_px = rms_px(|centre| Picture { centre, slope_per_px: 0.1, blur_px, ..PLAIN });
            println!("blur {blur_px:?} px: rms {error_px:.4} px");
            assert!(error_px < 0.02, "blur {blur_px:?} px: rms {error_px} px");
        }
    }

    #[test]
    fn a_light_marker_on_a_dark_object_is_measured_as_well() {
        let error_px = rms_px(|centre| Picture { centre, ground: 60.0, marker: 210.0, ..PLAIN });
        assert!(error_px < 0.01, "rms {error_px} px");
    }

    #[test]
    fn dim_light_and_noise_cost_what_the_standard_deviation_says() {
        let dim = Picture { ground: 70.0, marker: 20.0, noise: 4.0, radius_px: 12.0, ..PLAIN };
        let said_px = dim.measured(&mut Pcg64Mcg::seed_from_u64(1)).std_px;
        let error_px = rms_px(|centre| Picture { centre, ..dim });
        assert!((0.5..2.0).contains(&(error_px / said_px)), "rms {error_px} px, said {said_px} px");
    }

    #[test]
    fn area_and_moments_are_those_of_the_disc() {
        let blob = PLAIN.measured(&mut Pcg64Mcg::seed_from_u64(3));
        let area_px2 = std::f64::consts::PI * 22.0 * 22.0;
        assert!((blob.area_px2 / area_px2 - 1.0).abs() < 0.01, "{} px2 of {area_px2}", blob.area_px2);
        let [xx, xy, yy] = blob.covariance_px2;
        assert!((xx / 121.0 - 1.0).abs() < 0.02 && (yy / 121.0 - 1.0).abs() < 0.02, "{xx} {yy} px2 of 121");
        assert!(xy.abs() < 1.0, "{xy} px2");
        assert!((blob.contrast - 155.0).abs() < 2.0 && !blob.cut, "{blob:?}");
    }
}
