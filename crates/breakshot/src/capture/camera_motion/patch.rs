//! Has a tag moved since an earlier picture?

use super::super::image::GreyImage;
use crate::geometry::Pixel;
use nalgebra::{Matrix3, Vector3};

/// Number of pixels that are compared: those of the strongest edges.
const MOST_PIXELS: usize = 1024;
/// Size of the patch over that of the tag's black square: as far as its white margin.
const MARGIN: f64 = 1.2;

/// A tag's pixels in an earlier picture, prepared for one step of image registration (Lucas and Kanade, 1981) with an unknown
/// gain and offset of the grey levels.
pub(super) struct Patch {
    /// Index of each pixel, and its weights in the shift along x and y (px per grey level).
    weights: Vec<(usize, [f64; 2])>,
    /// The weighted sum of the earlier picture's grey levels (px).
    earlier_px: [f64; 2],
}

/// A pixel of the patch: its index, grey level, and gradient (grey levels per px).
struct Edge {
    index: usize,
    grey: f64,
    gradient: [f64; 2],
}

impl Patch {
    /// The patch about a tag's corners; `None` if it is cut off by the image's border or has no edges in two directions.
    pub(super) fn new(image: &GreyImage, corners_px: [Pixel; 4]) -> Option<Self> {
        let mut edges = edges(image, corners_px)?;
        let strength = |edge: &Edge| edge.gradient[0].powi(2) + edge.gradient[1].powi(2);
        edges.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        edges.truncate(MOST_PIXELS);

        // Least squares for grey = gain earlier + offset - gradient . shift, with centred columns instead of the offset
        let n = edges.len() as f64;
        let column = |edge: &Edge| Vector3::new(-edge.gradient[0], -edge.gradient[1], edge.grey);
        let mean = edges.iter().map(column).sum::<Vector3<f64>>() / n;
        let rows: Vec<Vector3<f64>> = edges.iter().map(|edge| column(edge) - mean).collect();
        let normal = rows.iter().fold(Matrix3::zeros(), |sum, row| sum + row * row.transpose());
        let inverse = normal.try_inverse().filter(|inverse| inverse.iter().all(|v| v.is_finite()))?;
        let weights = edges.iter().zip(&rows).map(|(edge, row)| {
            let weight = inverse * row;
            (edge.index, [weight.x, weight.y])
        });
        let weights: Vec<_> = weights.collect();
        let earlier_px = weighted_sum(image, &weights);
        Some(Self { weights, earlier_px })
    }

    /// The length of the shift between the earlier picture and this one (px), to first order: exact for a fraction of a pixel,
    /// and some pixel or more for larger ones.
    pub(super) fn shift_px(&self, image: &GreyImage) -> f64 {
        let [x_px, y_px] = weighted_sum(image, &self.weights);
        (x_px - self.earlier_px[0]).hypot(y_px - self.earlier_px[1])
    }
}

fn weighted_sum(image: &GreyImage, weights: &[(usize, [f64; 2])]) -> [f64; 2] {
    weights.iter().fold([0.0, 0.0], |[x, y], &(index, [by_x, by_y])| {
        let grey = image.pixels.get(index).map_or(0.0, |&grey| f64::from(grey));
        [x + by_x * grey, y + by_y * grey]
    })
}

/// The pixels of the patch with their gradients.
fn edges(image: &GreyImage, corners_px: [Pixel; 4]) -> Option<Vec<Edge>> {
    let center = Pixel::new(
        corners_px.iter().map(|p| p.x).sum::<f64>() / 4.0,
        corners_px.iter().map(|p| p.y).sum::<f64>() / 4.0,
    );
    let from_center = |value: f64, center: f64| center + MARGIN * (value - center);
    let corners = corners_px.map(|p| Pixel::new(from_center(p.x, center.x), from_center(p.y, center.y)));
    let range = |values: [f64; 4], size: usize| {
        let (low, high) =
            values.iter().fold((f64::MAX, f64::MIN), |(low, high), &v| (low.min(v), high.max(v)));
        (low >= 1.0 && high <= size as f64 - 2.0).then(|| low.ceil() as usize..=high.floor() as usize)
    };
    let columns = range(corners.map(|p| p.x), image.width)?;
    let rows = range(corners.map(|p| p.y), image.height)?;
    let inside = |x: f64, y: f64| {
        let side = |k: usize| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)
        };
        let sides = [side(0), side(1), side(2), side(3)];
        sides.iter().all(|&s| s >= 0.0) || sides.iter().all(|&s| s <= 0.0)
    };
    let grey = |index: usize| f64::from(image.pixels[index]);
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
    let edges = pixels.filter(|&(x, y)| inside(x as f64, y as f64)).map(|(x, y)| {
        let index = y * image.width + x;
        let gradient = [
            (grey(index + 1) - grey(index - 1)) / 2.0,
            (grey(index + image.width) - grey(index - image.width)) / 2.0,
        ];
        Edge { index, grey: grey(index), gradient }
    });
    Some(edges.collect())
}
