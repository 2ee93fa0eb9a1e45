//! Images of pixels: what is drawn onto frames of films and onto the pages of a film.

mod canvas;
mod glyphs;
mod lettering;
mod rgb_image;

pub(in crate::report) use canvas::{Area, Canvas, Colour, FAINT, Pen, STRONG};
pub(in crate::report) use lettering::{Lettering, text_width_px, wrapped};
pub use rgb_image::RgbImage;

/// One colour for each kind of object; further kinds repeat them.  Colours in the manner of Okabe and Ito, which most people with
/// a colour vision deficiency can distinguish.
pub(in crate::report) const COLOURS: [Colour; 8] = [
    [0, 158, 255],
    [255, 140, 0],
    [0, 200, 110],
    [230, 80, 190],
    [240, 228, 66],
    [90, 220, 255],
    [213, 70, 30],
    [170, 130, 255],
];
