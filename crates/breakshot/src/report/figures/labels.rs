//! Labels that do not lie on each other.

/// The height of a label's line (px).
const LINE_PX: f64 = 14.0;
/// How wide a character of the reader's sans serif is on average at 12 px (px); digits and lower case letters are at most that.
const CHARACTER_PX: f64 = 6.8;

/// Boxes that are taken.
#[derive(Default)]
pub(super) struct Labels {
    taken: Vec<[f64; 4]>,
}

impl Labels {
    /// Keeps a box free of labels: left, top, right, bottom (px).
    pub(super) fn keep_free(&mut self, area: [f64; 4]) {
        self.taken.push(area);
    }

    /// The first of these centres at which a text lies on no other, and takes it; `None` if there is none.
    pub(super) fn place(&mut self, text: &str, centres: &[[f64; 2]]) -> Option<[f64; 2]> {
        let half = [width_px(text) / 2.0 + 1.0, LINE_PX / 2.0];
        let (centre, area) = centres.iter().find_map(|&[x, y]| {
            let area = [x - half[0], y - half[1], x + half[0], y + half[1]];
            let free = self.taken.iter().all(|taken| !overlap(taken, &area));
            free.then_some(([x, y], area))
        })?;
        self.taken.push(area);
        Some(centre)
    }
}

/// About how wide a text is at 12 px (px).
pub(super) fn width_px(text: &str) -> f64 {
    text.chars().count() as f64 * CHARACTER_PX
}

fn overlap(one: &[f64; 4], other: &[f64; 4]) -> bool {
    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_label_moves_on_until_it_lies_on_no_other() {
        let mut labels = Labels::default();
        let centres = [[0.0, 0.0], [0.0, 5.0], [0.0, 20.0]];
        assert_eq!(labels.place("a", &centres), Some([0.0, 0.0]));
        assert_eq!(labels.place("b", &centres), Some([0.0, 20.0]));
        assert_eq!(labels.place("c", &centres), None);
    }
}
