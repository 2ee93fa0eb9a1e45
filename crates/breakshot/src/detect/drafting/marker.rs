//! Which marker is on an object's top?

use super::candidates::{Candidate, LEAST_STRENGTH, MARKER_FRACTIONS, TopSearch};
use super::edges::TopView;
use super::is_concave;
use super::regions::{NEARLY_ALL, PLAIN_PLANES, Region};
use super::shape_fit::{Fitted, turned};
use crate::detect::label::Window;
use crate::geometry::outline::Outline;
use crate::geometry::{Pixel, Point};
use crate::object::{Dot, Marker, Shape};

/// An object's outline, its frame turned to that of its marker.
pub(super) struct Marked {
    pub outline: Fitted,
    pub marker: Option<Marker>,
    /// Whether the marker is lighter than the top.
    pub light: Option<bool>,
}

/// Least number of pixels of a marker: fewer have no shape.
const LEAST_PX: u64 = 20;
/// The free pixels around a top in which the regions on it are searched.
const WINDOW_MARGIN_PX: f64 = 3.0;
/// A second shape belongs to the marker if its edge is at least this fraction as strong.
const SECOND_STRENGTH: f64 = 0.6;
/// A marker nearer to the centre of a disc is centred, within the error of its measurement (px).
const CENTRED_PX: f64 = 0.3;
/// A dot of more than this fraction of its disc's radius would be taken for it, unless both are equal.
const LARGEST_DOT: f64 = 0.7;

/// The marker on an object's top.
pub(super) fn marked(search: &TopSearch, top: &Candidate, name: &str, warnings: &mut Vec<String>) -> Marked {
    let Candidate { region: object, outline: own, height_m, .. } = top;
    let own = own.clone();
    let outline = Outline::new(&own.shape, own.pose);
    let by_strength = regions_on_top(search, &own, &outline, *height_m);
    if by_strength.is_empty() {
        return Marked { outline: own, marker: None, light: None };
    }
    let is_on_top = |fit: &Fitted| {
        let points = fit.shape.outline_points();
        points.iter().all(|&point| outline.contains(fit.pose.table_from_body(point)))
    };
    let measured = |(ink, region): &(TopView, Region)| {
        let fit = ink.outline(region).filter(|fit| fit.fits && !is_concave(&fit.shape) && is_on_top(fit))?;
        Some((region.clone(), fit))
    };
    let Some((first, shape)) = by_strength.iter().find_map(measured) else {
        warnings.push(format!("`{name}` has a marker whose shape cannot be measured: it is left out"));
        return Marked { outline: own, marker: None, light: None };
    };
    let belongs = |(_, region): &&(TopView, Region)| {
        region.is_light == first.is_light
            && region.strength >= SECOND_STRENGTH * first.strength
            && !region.overlaps(&first)
    };
    let second = by_strength.iter().filter(belongs).find_map(measured).map(|(_, shape)| shape);
    let mut shapes: Vec<Fitted> = std::iter::once(shape).chain(second).collect();
    shapes.sort_by(|a, b| b.shape.area_m2().total_cmp(&a.shape.area_m2()));
    let Some(main) = shapes.first().cloned() else {
        return Marked { outline: own, marker: None, light: None };
    };
    let (outline, mut marker) = composed(own, &main, shapes.get(1), name, warnings);
    let offset_m = marker.at_m.to_vec().length();
    let centred_m = CENTRED_PX * search.camera.scale_m_per_px(object.centroid, *height_m);
    if matches!(outline.shape, Shape::Disc { .. }) && marker.dot.is_none() && offset_m < centred_m {
        marker.at_m = Point::ORIGIN;
    }
    Marked { outline, marker: Some(marker), light: Some(first.is_light) }
}

/// The regions on a top, the one with the strongest edge first, each with its view.
fn regions_on_top<'a>(
    search: &TopSearch<'a>,
    top: &Fitted,
    outline: &Outline,
    height_m: f64,
) -> Vec<(TopView<'a>, Region)> {
    let camera = search.camera;
    let centre = camera.pixel_from_table(top.pose.position, height_m);
    let pixel_m = camera.scale_m_per_px(centre, height_m);
    let most_px = (MARKER_FRACTIONS[1] * top.shape.area_m2() / (pixel_m * pixel_m)) as u64;
    let areas_px = LEAST_PX..=most_px.max(LEAST_PX);
    let outline_points = top.shape.outline_points();
    let pixels =
        outline_points.iter().map(|&p| camera.pixel_from_table(top.pose.table_from_body(p), height_m));
    let reach_px = pixels.map(|pixel| (pixel.x - centre.x).hypot(pixel.y - centre.y)).fold(0.0, f64::max);
    let window = Window::around(centre, reach_px + WINDOW_MARGIN_PX, search.planes[0]);
    let is_on_top = |pixel: Pixel| outline.contains(camera.table_from_pixel(pixel, height_m));
    let in_plane = |plane: usize| {
        let ink = TopView { solid: false, ..search.view(plane, height_m) };
        let found = search.search_planes.regions(plane, window, &areas_px).into_iter();
        let found = found.filter(|region| {
            region.strength >= LEAST_STRENGTH && region.border_fraction(is_on_top) >= NEARLY_ALL
        });
        found.map(move |region| (ink, region)).collect::<Vec<_>>()
    };
    let mut by_strength: Vec<_> = (0..search.planes.len().min(PLAIN_PLANES)).flat_map(in_plane).collect();
    by_strength.sort_by(|(_, a), (_, b)| b.strength.total_cmp(&a.strength).then(b.area_px.cmp(&a.area_px)));
    by_strength
}

/// The object's frame and the marker in it.
fn composed(
    own: Fitted,
    main: &Fitted,
    second: Option<&Fitted>,
    name: &str,
    warnings: &mut Vec<String>,
) -> (Fitted, Marker) {
    // A bar lies along its object's axes, as far as that frame is free.
    let is_bar = matches!(main.shape, Shape::Rectangle { .. });
    let free = !matches!(own.shape, Shape::Rectangle { .. });
    let outline = if is_bar && free { turned(&own, main.pose.yaw_rad) } else { own };
    let place = |point: Point| outline.pose.body_from_table(point);
    let shape = turned(main, outline.pose.yaw_rad).shape;
    let mut marker = Marker { shape, at_m: place(main.pose.position), dot: None, thickness_m: 0.0 };
    match (&main.shape, second.map(|second| (&second.shape, second.pose))) {
        (Shape::Disc { radius_m }, Some((Shape::Disc { radius_m: dot_m }, pose))) => {
            let at_m = place(pose.position);
            let apart = at_m.distance(marker.at_m) > radius_m + dot_m;
            if apart && *dot_m <= LARGEST_DOT * radius_m {
                marker.dot = Some(Dot { radius_m: *dot_m, at_m });
            } else if apart {
                // The radii are equal within the error of their measurement, or cannot be distinguished.
                marker.shape = Shape::Disc { radius_m: 0.5 * (radius_m + dot_m) };
                marker.dot = Some(Dot { radius_m: 0.5 * (radius_m + dot_m), at_m });
            }
        }
        (_, Some(_)) => {
            warnings.push(format!("`{name}` has two shapes on its top that are not both discs: the larger one is taken for its marker"));
        }
        _ => {}
    }
    (outline, marker)
}
