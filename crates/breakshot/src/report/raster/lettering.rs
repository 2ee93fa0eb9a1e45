//! Text in letters of lines.

use super::canvas::{Canvas, Colour, Pen, STRONG};
use super::glyphs::{CAPITAL, SPACE, glyph};
use crate::geometry::Pixel;

/// How text is drawn.
#[derive(Clone, Copy, Debug)]
pub(in crate::report) struct Lettering {
    /// The height of a capital letter (px).
    pub height_px: f64,
    /// The colour.
    pub colour: Colour,
}

/// The distance between two letters, in units of the strokes.
const BETWEEN: f64 = 3.6;
/// The width of a line over the height of a capital letter, ...
const LINE_TO_HEIGHT: f64 = 0.105;
/// ... and the least width (px).
const LEAST_LINE_PX: f64 = 1.1;
/// How often the corners of a round stroke are cut.
const CUTS: usize = 3;
/// What is drawn for a character without strokes: a box.
const UNKNOWN: (f64, &str) = (8.0, "0,0 8,0 8,12 0,12 0,0");

fn strokes(letter: char) -> (f64, &'static str) {
    if letter == ' ' { (SPACE - BETWEEN, "") } else { glyph(letter).unwrap_or(UNKNOWN) }
}

/// The width of a line of text (px).
pub(in crate::report) fn text_width_px(text: &str, height_px: f64) -> f64 {
    let units: f64 = text.chars().map(|letter| strokes(letter).0 + BETWEEN).sum();
    (units - BETWEEN).max(0.0) * height_px / CAPITAL
}

/// The words of a text in lines that are not wider than this; a word that is wider alone has a line of its own.
pub(in crate::report) fn wrapped(text: &str, height_px: f64, width_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width_px(&format!("{line} {word}"), height_px) <= width_px => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

impl Canvas {
    /// Text from its left end on the base line.
    pub(in crate::report) fn text(&mut self, text: &str, left: Pixel, style: Lettering) {
        let scale = style.height_px / CAPITAL;
        let width_px = (LINE_TO_HEIGHT * style.height_px).max(LEAST_LINE_PX);
        let pen = Pen { colour: style.colour, width_px, opacity: STRONG };
        let mut at = left.x;
        for letter in text.chars() {
            let (width, lines) = strokes(letter);
            for line in lines.split(';').filter(|line| !line.is_empty()) {
                let points = points(line).into_iter();
                let points: Vec<Pixel> =
                    points.map(|[x, y]| Pixel::new(at + x * scale, left.y - y * scale)).collect();
                self.polyline(&points, pen);
            }
            at += (width + BETWEEN) * scale;
        }
    }
}

/// The points of one stroke.
fn points(line: &str) -> Vec<[f64; 2]> {
    let point = |text: &str| {
        let (x, y) = text.split_once(',')?;
        Some([x.parse().ok()?, y.parse().ok()?])
    };
    let (is_round, line) = line.strip_prefix('~').map_or((false, line), |rest| (true, rest));
    let mut points: Vec<[f64; 2]> = line.split(' ').filter_map(point).collect();
    for _ in 0..if is_round { CUTS } else { 0 } {
        points = with_cut_corners(&points);
    }
    points
}

/// A line with its corners cut at a quarter of both sides (Chaikin, 1974); the ends stay.
fn with_cut_corners(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let [Some(&first), Some(&last)] = [points.first(), points.last()] else { return Vec::new() };
    let between = |p: [f64; 2], q: [f64; 2], part: f64| [0, 1].map(|k| p[k] + part * (q[k] - p[k]));
    let mut cut = vec![first];
    for pair in points.windows(2) {
        cut.extend([0.25, 0.75].map(|part| between(pair[0], pair[1], part)));
    }
    cut.push(last);
    cut
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_character_of_ascii_has_strokes_within_its_width() {
        for letter in '!'..='~' {
            let (width, lines) = glyph(letter).unwrap_or_else(|| panic!("no strokes for {letter}"));
            for line in lines.split(';') {
                let listed = line.trim_start_matches('~').split(' ').count();
                assert_eq!(
                    points(line.trim_start_matches('~')).len(),
                    listed,
                    "a point of {letter} is unreadable"
                );
                for [x, y] in points(line) {
                    assert!((-1.0..=width + 1.0).contains(&x), "{letter} reaches x = {x} of {width}");
                    assert!((-4.0..=16.0).contains(&y), "{letter} reaches y = {y}");
                }
            }
        }
    }

    #[test]
    fn characters_that_are_not_the_same_do_not_look_the_same() {
        let letters: Vec<char> = ('!'..='~').collect();
        for (k, one) in letters.iter().enumerate() {
            for other in &letters[..k] {
                let same = glyph(*one) == glyph(*other);
                assert!(!same, "{one} is drawn as {other}");
            }
        }
    }

    #[test]
    fn lines_are_as_wide_as_they_may_be_and_keep_all_words() {
        let text = "The strike moves the objects apart in every scenario that was drawn.";
        let lines = wrapped(text, 14.0, 220.0);
        assert_eq!(lines.join(" "), text);
        assert!(lines.len() > 1);
        for (k, line) in lines.iter().enumerate() {
            assert!(text_width_px(line, 14.0) <= 220.0, "{line} is too wide");
            if let Some(word) = lines.get(k + 1).and_then(|next| next.split(' ').next()) {
                assert!(text_width_px(&format!("{line} {word}"), 14.0) > 220.0, "{word} fits into {line}");
            }
        }
        assert_eq!(wrapped("pneumonoultramicroscopic", 14.0, 20.0).len(), 1);
    }

    #[test]
    fn text_covers_its_width_and_nothing_beside_it() {
        let mut canvas = Canvas::blank([200, 40], [0; 3]);
        canvas.text("Hxl", Pixel::new(50.0, 30.0), Lettering { height_px: 20.0, colour: [255; 3] });
        let image = canvas.finish();
        let columns: Vec<usize> =
            (0..200).filter(|x| (0..40).any(|y| image.rgb[3 * (y * 200 + x)] > 60)).collect();
        let (first, last) = (columns[0], columns[columns.len() - 1]);
        let width = text_width_px("Hxl", 20.0);
        assert!(first.abs_diff(50) <= 2, "the text begins at {first}");
        assert!((last as f64 - 50.0 - width).abs() < 3.0, "the text ends at {last}, its width is {width}");
    }
}
