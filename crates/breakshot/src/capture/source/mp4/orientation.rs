//! How must the coded picture be rotated for display?  (The matrix of ISO/IEC 14496-12, 8.3.2.)

use crate::capture::image::GreyImage;
use crate::capture::source::error::SourceError;

/// A rotation by a multiple of 90 degrees, possibly mirrored: a pixel (x, y) goes to (a x + c y, b x + d y).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orientation {
    a: i8,
    b: i8,
    c: i8,
    d: i8,
}

impl Orientation {
    pub(super) const UPRIGHT: Self = Self { a: 1, b: 0, c: 0, d: 1 };

    /// From the entries a, b, c, d of the matrix, of which only the signs are used.
    ///
    /// # Errors
    /// Any other rotation.
    pub(super) fn of([a, b, c, d]: [i32; 4]) -> Result<Self, SourceError> {
        let orientation =
            Self { a: a.signum() as i8, b: b.signum() as i8, c: c.signum() as i8, d: d.signum() as i8 };
        match orientation {
            Self { a: -1 | 1, b: 0, c: 0, d: -1 | 1 } | Self { a: 0, b: -1 | 1, c: -1 | 1, d: 0 } => {
                Ok(orientation)
            }
            _ => Err(SourceError::convertible(
                "a film rotated by an angle that is not a multiple of 90 degrees",
            )),
        }
    }

    /// This rotation followed by another one.
    pub(super) fn then(self, next: Self) -> Self {
        Self {
            a: self.a * next.a + self.b * next.c,
            b: self.a * next.b + self.b * next.d,
            c: self.c * next.a + self.d * next.c,
            d: self.c * next.b + self.d * next.d,
        }
    }

    /// The displayed size of a coded picture of `[width, height]`.
    pub(super) fn displayed_size([width, height]: [usize; 2], orientation: Self) -> [usize; 2] {
        if orientation.a == 0 { [height, width] } else { [width, height] }
    }

    /// The picture as it is displayed.
    pub(super) fn upright(self, coded: GreyImage) -> GreyImage {
        if self == Self::UPRIGHT {
            return coded;
        }
        let [width, height] = Self::displayed_size([coded.width, coded.height], self);
        // The inverse of a rotation is its transpose: index of the first displayed pixel in the coded picture, and the
        // index steps to the right and down.
        let [coded_width, coded_height] = [coded.width, coded.height].map(usize::cast_signed);
        let first_x = if self.a + self.b < 0 { coded_width - 1 } else { 0 };
        let first_y = if self.c + self.d < 0 { coded_height - 1 } else { 0 };
        let right = isize::from(self.a) + isize::from(self.c) * coded_width;
        let down = isize::from(self.b) + isize::from(self.d) * coded_width;
        let first = first_x + first_y * coded_width;
        let mut pixels = Vec::with_capacity(width * height);
        for v in 0..height.cast_signed() {
            let row = first + v * down;
            pixels.extend((0..width.cast_signed()).map(|u| coded.pixels[(row + u * right).cast_unsigned()]));
        }
        GreyImage { width, height, pixels }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture() -> GreyImage {
        GreyImage { width: 3, height: 2, pixels: vec![1, 2, 3, 4, 5, 6] }
    }

    fn rotated(matrix: [i32; 4]) -> (usize, Vec<u8>) {
        let displayed = Orientation::of(matrix).unwrap().upright(picture());
        assert_eq!(displayed.width * displayed.height, 6);
        (displayed.width, displayed.pixels)
    }

    #[test]
    fn a_picture_is_rotated_by_its_matrix() {
        assert_eq!(rotated([1, 0, 0, 1]), (3, vec![1, 2, 3, 4, 5, 6]));
        // 90 degrees clockwise: the left column becomes the top row.
        assert_eq!(rotated([0, 65_536, -65_536, 0]), (2, vec![4, 1, 5, 2, 6, 3]));
        assert_eq!(rotated([-1, 0, 0, -1]), (3, vec![6, 5, 4, 3, 2, 1]));
        assert_eq!(rotated([0, -1, 1, 0]), (2, vec![3, 6, 2, 5, 1, 4]));
        assert_eq!(rotated([-1, 0, 0, 1]), (3, vec![3, 2, 1, 6, 5, 4]));
        assert_eq!(rotated([0, 1, 1, 0]), (2, vec![1, 4, 2, 5, 3, 6]));
    }

    #[test]
    fn four_rotations_by_90_degrees_change_nothing() {
        let quarter = Orientation::of([0, 1, -1, 0]).unwrap();
        let full = quarter.then(quarter).then(quarter).then(quarter);
        assert_eq!(full, Orientation::UPRIGHT);
    }

    #[test]
    fn a_rotation_by_45_degrees_is_an_error() {
        assert!(Orientation::of([46_341, 46_341, -46_341, 46_341]).is_err());
    }
}
