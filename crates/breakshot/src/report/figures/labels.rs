//! Positions of labels that do not overlap.

/// The height of a label's line (px).
const LINE_PX: f64 = 14.0;
/// Mean width of a character of a sans serif font at 12 px (px); digits and lower case letters are at most this wide.
const CHARACTER_PX: f64 = 6.8;

/// The occupied boxes.
#[derive(Default)]
pub(super) struct Labels {
    occupied: Vec<[f64; 4]>,
}

impl Labels {
    /// Reserves a box that no label may overlap: left, top, right, bottom (px).
    pub(super) fn keep_free(&mut self, area: [f64; 4]) {
        self.occupied.push(area);
    }

    /// Reserves the first of these centres at which the text overlaps no other and returns it; none if there is none.
    pub(super) fn place(&mut self, text: &str, centres: &[[f64; 2]]) -> Option<[f64; 2]> {
        let half = [width_px(text) / 2.0 + 1.0, LINE_PX / 2.0];
        let (centre, area) = centres.iter().find_map(|&[x, y]| {
            let area = [x - half[0], y - half[1], x + half[0], y + half[1]];
            let free = self.occupied.iter().all(|occupied| !overlap(occupied, &area));
            free.then_some(([x, y], area))
        })?;
        self.occupied.push(area);
        Some(centre)
    }
}

/// Approximate width of a text at 12 px (px).
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
    fn a_label_takes_the_first_centre_at_which_it_overlaps_no_other() {
        let mut labels = Labels::default();
        let centres = [[0.0, 0.0], [0.0, 5.0], [0.0, 20.0]];
        assert_eq!(labels.place("a", &centres), Some([0.0, 0.0]));
        assert_eq!(labels.place("b", &centres), Some([0.0, 20.0]));
        assert_eq!(labels.place("c", &centres), None);
    }
}
