//! Pictures from the film, set into the page.

use super::escaped;
use crate::capture::GreyImage;

/// Pictures are shrunk by whole factors until they are at most so wide (px): twice the width that they are shown at.
const MOST_WIDTH_PX: usize = 960;

/// A picture of the film as an `img` element that needs no file; nothing for a picture without pixels.
pub(in crate::report) fn photo(image: &GreyImage, label: &str) -> String {
    let small = image.shrunk(image.width.div_ceil(MOST_WIDTH_PX).max(1));
    let (GreyImage { width, height, .. }, label) = (&small, escaped(label));
    let img =
        |url: String| format!("<img alt=\"{label}\" width=\"{width}\" height=\"{height}\" src=\"{url}\"/>\n");
    small.data_url().map(img).unwrap_or_default()
}
