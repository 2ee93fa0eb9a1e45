//! How must the coded picture be turned to be seen upright?  (The matrix of ISO/IEC 14496-12, 8.3.2.)

use crate::capture::image::GreyImage;
use crate::capture::source::error::Refusal;

/// A turn by a multiple of a right angle, perhaps mirrored: a pixel (x, y) goes to (a x + c y, b x + d y).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Orientation {
    a: i8,
    b: i8,
    c: i8,
    d: i8,
}

impl Orientation {
    pub(super) const UPRIGHT: Self = Self { a: 1, b: 0, c: 0, d: 1 };

    /// From the matrix's entries a, b, c, d: only their signs are used.
    pub(super) fn of([a, b, c, d]: [i32; 4]) -> Result<Self, Refusal> {
        let orientation =
            Self { a: a.signum() as i8, b: b.signum() as i8, c: c.signum() as i8, d: d.signum() as i8 };
        match orientation {
            Self { a: -1 | 1, b: 0, c: 0, d: -1 | 1 } | Self { a: 0, b: -1 | 1, c: -1 | 1, d: 0 } => {
                Ok(orientation)
            }
            _ => Err(Refusal::convertible("a film turned by an angle that is not a multiple of 90 degrees")),
        }
    }

    /// This turn, then another one.
    pub(super) fn then(self, next: Self) -> Self {
        Self {
            a: self.a * next.a + self.b * next.c,
            b: self.a * next.b + self.b * next.d,
            c: self.c * next.a + self.d * next.c,
            d: self.c * next.b + self.d * next.d,
        }
    }

    /// The size that a coded picture of `[width, height]` is seen at.
    pub(super) fn size([width, height]: [usize; 2], orientation: Self) -> [usize; 2] {
        if orientation.a == 0 { [height, width] } else { [width, height] }
    }

    /// The picture as it is to be seen.
    pub(super) fn upright(self, coded: GreyImage) -> GreyImage {
        if self == Self::UPRIGHT {
            return coded;
        }
        let [width, height] = Self::size([coded.width, coded.height], self);
        // The inverse of a turn is its transpose: where the first pixel comes from, and the steps from there.
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

    fn turned(matrix: [i32; 4]) -> (usize, Vec<u8>) {
        let seen = Orientation::of(matrix).unwrap().upright(picture());
        assert_eq!(seen.width * seen.height, 6);
        (seen.width, seen.pixels)
    }

    #[test]
    fn a_picture_is_turned_as_its_matrix_says() {
        assert_eq!(turned([1, 0, 0, 1]), (3, vec![1, 2, 3, 4, 5, 6]));
        // 90 degrees clockwise: the left column becomes the top row.
        assert_eq!(turned([0, 65_536, -65_536, 0]), (2, vec![4, 1, 5, 2, 6, 3]));
        assert_eq!(turned([-1, 0, 0, -1]), (3, vec![6, 5, 4, 3, 2, 1]));
        assert_eq!(turned([0, -1, 1, 0]), (2, vec![3, 6, 2, 5, 1, 4]));
        assert_eq!(turned([-1, 0, 0, 1]), (3, vec![3, 2, 1, 6, 5, 4]));
        assert_eq!(turned([0, 1, 1, 0]), (2, vec![1, 4, 2, 5, 3, 6]));
    }

    #[test]
    fn four_quarter_turns_change_nothing() {
        let quarter = Orientation::of([0, 1, -1, 0]).unwrap();
        let full = quarter.then(quarter).then(quarter).then(quarter);
        assert_eq!(full, Orientation::UPRIGHT);
    }

    #[test]
    fn an_oblique_turn_is_refused() {
        assert!(Orientation::of([46_341, 46_341, -46_341, 46_341]).is_err());
    }
}
