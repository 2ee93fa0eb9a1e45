//! The lens that a film's own file gives, as `CameraInfo` in a bag, beside that of the cell.

use super::extrinsics::{FOCAL_STD, SIZE_OF_CELL, check_size, given_lens};
use super::lens::Lens;
use crate::cell::{Cell, Intrinsics};
use crate::error::Result;
use crate::geometry::Pixel;

/// The lens in a film's own file.
pub(super) struct RecordedLens {
    /// Where in the file.
    pub topic: String,
    /// The lens, or why it cannot be used.
    pub intrinsics: Result<Intrinsics>,
    /// The number of the first message, from 1 on, that does not hold the same lens.
    pub change: Option<u64>,
}

/// The beginning of all warnings about the lens in a film's own file.
pub(crate) const RECORDED_LENS: &str = "the lens in the film";
/// Points along each side of the picture at which two lenses are compared.
const GRID: usize = 9;

/// The cell with the lens that was recorded with a film, unless the cell gives a lens; and warnings, also of a recorded lens that differs from
/// the cell's. `name` is the film's name in messages.
///
/// # Errors
/// A recorded lens that is needed and cannot be used, or belongs to pictures of another size; a cell that contradicts itself.
pub(super) fn with_recorded(
    cell: &Cell,
    recorded: Option<RecordedLens>,
    name: &str,
    size_px: [usize; 2],
) -> Result<(Cell, Vec<String>)> {
    let Some(RecordedLens { topic, intrinsics, change }) = recorded else {
        return Ok((cell.clone(), Vec::new()));
    };
    let topic = topic.escape_debug().to_string();
    if cell.camera.gives_lens() {
        let spec = cell.camera.resolved("cell")?;
        check_size(name, size_px, &spec, SIZE_OF_CELL)?;
        let warning = match given_lens(&spec, size_px)? {
            Some(lens) => difference(&lens, &topic, intrinsics, size_px),
            None => Some(format!(
                "{RECORDED_LENS} (`{topic}`) is not used: the cell gives a part of the lens, without camera.focal_px"
            )),
        };
        return Ok((cell.clone(), warning.into_iter().collect()));
    }
    check_size(name, size_px, &cell.camera, SIZE_OF_CELL)?;
    let intrinsics = intrinsics?;
    let camera = cell.camera.with_intrinsics(intrinsics);
    let whose =
        format!("the size in `{topic}`, or focal_px, center_px and distortion of this film in the cell");
    check_size(name, size_px, &camera, &whose)?;
    lens_of(&intrinsics).check(&format!("{name}: `{topic}`"), size_px)?;
    let doubt = change.map(|n| {
        format!("{RECORDED_LENS} (`{topic}`) is that of the first message: message {n} holds another one or is damaged")
    });
    Ok((Cell { camera, ..cell.clone() }, doubt.into_iter().collect()))
}

fn lens_of(intrinsics: &Intrinsics) -> Lens {
    Lens::new(intrinsics.focal_px, intrinsics.center_px, intrinsics.distortion)
}

/// A warning that names the cell's lens and the recorded one if their focal lengths differ by more than one per cent, or the positions of a ray
/// in the picture by as much of the focal length, or if their models differ.
fn difference(
    given: &Lens,
    topic: &str,
    recorded: Result<Intrinsics>,
    size_px: [usize; 2],
) -> Option<String> {
    let used = "that of the cell is used";
    let recorded = match recorded {
        Ok(recorded) => recorded,
        Err(error) => {
            return Some(format!(
                "{RECORDED_LENS} cannot be compared with that of the cell ({error}): {used}"
            ));
        }
    };
    let lens = lens_of(&recorded);
    let [w, h] = recorded.image_size_px;
    let is_same_size = [w as usize, h as usize] == size_px;
    let off_px = largest_displacement_px(given, &lens, size_px);
    let is_far = |a: f64, b: f64| (a - b).abs() > FOCAL_STD * a.min(b);
    let differs = given.distortion().model() != lens.distortion().model()
        || [0, 1].iter().any(|&axis| is_far(given.focal_px()[axis], lens.focal_px()[axis]))
        || off_px.is_none_or(|off_px| off_px > FOCAL_STD * given.focal_px()[0])
        || !is_same_size;
    let of_size = if is_same_size { String::new() } else { format!(", of pictures of {w} x {h} px") };
    differs.then(|| {
        let apart = off_px.map_or("in the rays that they represent".to_owned(), |off_px| {
            format!("by up to {off_px:.1} px")
        });
        format!(
            "{RECORDED_LENS} (`{topic}`: {}{of_size}) and that of the cell ({}) differ {apart}: {used}",
            described(&lens),
            described(given)
        )
    })
}

/// The largest distance in the picture between the positions of a ray through two lenses (px); `None` if only one of them represents a ray.
fn largest_displacement_px(one: &Lens, two: &Lens, size_px: [usize; 2]) -> Option<f64> {
    let coordinate = |k: usize, side: usize| k as f64 / (GRID - 1) as f64 * (side as f64 - 1.0);
    let mut largest_px = 0.0_f64;
    for (row, column) in (0..GRID * GRID).map(|k| (k / GRID, k % GRID)) {
        let pixel = Pixel::new(coordinate(column, size_px[0]), coordinate(row, size_px[1]));
        // A fisheye's picture may reach beyond the longest ray that is represented.
        let Some(ray) = one.ray_from_pixel(pixel) else { continue };
        largest_px = largest_px.max(two.pixel_from_ray(ray)?.distance_px(pixel));
    }
    Some(largest_px)
}

fn described(lens: &Lens) -> String {
    let ([fx, fy], [cx, cy]) = (lens.focal_px(), lens.center_px());
    format!("{}, focal_px [{fx:.1}, {fy:.1}], center_px [{cx:.1}, {cy:.1}]", lens.distortion().model().name())
}
