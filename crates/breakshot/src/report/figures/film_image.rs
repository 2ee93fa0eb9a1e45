//! Frames of a film, embedded in the page.

use super::svg::escaped;
use crate::capture::GreyImage;

/// An image is shrunk by a whole factor to at most this width (px): twice the width at which it is shown.
const MOST_WIDTH_PX: usize = 960;

/// A frame as an `img` element with a data URL; empty for an image without pixels.
pub(in crate::report) fn film_image(image: &GreyImage, label: &str) -> String {
    let small = image.shrunk(image.width.div_ceil(MOST_WIDTH_PX).max(1));
    let (GreyImage { width, height, .. }, label) = (&small, escaped(label));
    let img =
        |url: String| format!("<img alt=\"{label}\" width=\"{width}\" height=\"{height}\" src=\"{url}\"/>\n");
    small.data_url().map(img).unwrap_or_default()
}
