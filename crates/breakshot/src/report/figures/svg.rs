//! An SVG document, written element by element.

use std::fmt::Write;

/// As wide as the text of the page: the width of a figure that fills it (px).
pub(in crate::report) const WIDTH_PX: f64 = 856.0;

/// An SVG document under construction.
pub(in crate::report) struct Svg {
    width_px: f64,
    height_px: f64,
    body: String,
}

/// The point of a text that its position refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Anchor {
    Start,
    Middle,
    End,
}

impl Svg {
    pub(in crate::report) fn new(width_px: f64, height_px: f64) -> Self {
        Self { width_px, height_px, body: String::new() }
    }

    pub(in crate::report) fn line(&mut self, class: &str, from: [f64; 2], to: [f64; 2]) {
        let (x1, y1, x2, y2) = (number(from[0]), number(from[1]), number(to[0]), number(to[1]));
        self.element(&format!(r#"<line class="{class}" x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"/>"#));
    }

    pub(in crate::report) fn rect(&mut self, class: &str, corner: [f64; 2], size: [f64; 2]) {
        let (x, y) = (number(corner[0]), number(corner[1]));
        let (width, height) = (number(size[0].max(0.0)), number(size[1].max(0.0)));
        self.element(&format!(
            r#"<rect class="{class}" x="{x}" y="{y}" width="{width}" height="{height}"/>"#
        ));
    }

    /// A circle; `hint` is its tooltip.
    pub(in crate::report) fn circle(&mut self, class: &str, center: [f64; 2], radius_px: f64, hint: &str) {
        let (x, y, r) = (number(center[0]), number(center[1]), number(radius_px));
        let hint = if hint.is_empty() { String::new() } else { format!("<title>{}</title>", escaped(hint)) };
        self.element(&format!(r#"<circle class="{class}" cx="{x}" cy="{y}" r="{r}">{hint}</circle>"#));
    }

    /// A line through points, closed or not.
    pub(in crate::report) fn path(&mut self, class: &str, points: &[[f64; 2]], closed: bool) {
        let mut d = String::new();
        for (k, [x, y]) in points.iter().enumerate() {
            let command = if k == 0 { 'M' } else { 'L' };
            let _ = write!(d, "{command}{} {}", number(*x), number(*y));
        }
        if closed {
            d.push('Z');
        }
        self.element(&format!(r#"<path class="{class}" d="{d}"/>"#));
    }

    pub(in crate::report) fn text(&mut self, class: &str, at: [f64; 2], anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let (x, y, text) = (number(at[0]), number(at[1]), escaped(text));
        self.element(&format!(
            r#"<text class="{class}" x="{x}" y="{y}" text-anchor="{anchor}">{text}</text>"#
        ));
    }

    /// A text rotated to read upwards, for the label of a vertical axis.
    pub(in crate::report) fn text_upwards(&mut self, class: &str, at: [f64; 2], text: &str) {
        let (x, y, text) = (number(at[0]), number(at[1]), escaped(text));
        self.element(&format!(
            r#"<text class="{class}" transform="translate({x} {y}) rotate(-90)" text-anchor="middle">{text}</text>"#
        ));
    }

    /// Clips all elements up to [`Svg::end_window`] to this area.
    pub(in crate::report) fn begin_window(&mut self, width_px: f64, height_px: f64) {
        let (width, height) = (number(width_px), number(height_px));
        self.element(&format!(r#"<svg x="0" y="0" width="{width}" height="{height}">"#));
    }

    pub(in crate::report) fn end_window(&mut self) {
        self.element("</svg>");
    }

    fn element(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    /// The complete document; `label` is the description for screen readers.
    pub(in crate::report) fn finish(self, label: &str) -> String {
        let (width, height, label) = (number(self.width_px), number(self.height_px), escaped(label));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\" aria-label=\"{label}\">\n{}</svg>\n",
            self.body
        )
    }
}

/// A coordinate rounded to a hundredth of a pixel; zero if it is not finite.
pub(super) fn number(value: f64) -> String {
    let rounded = if value.is_finite() { (value * 100.0).round() / 100.0 } else { 0.0 };
    // Minus zero prints as `-0`.
    format!("{}", rounded + 0.0)
}

/// Text with the special characters of XML escaped.
pub(in crate::report) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML allows no other control characters.
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_are_short_and_finite() {
        for (value, text) in [
            (1.0, "1"),
            (0.126, "0.13"),
            (-0.001, "0"),
            (f64::NAN, "0"),
            (f64::INFINITY, "0"),
            (-2.5, "-2.5"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn special_characters_of_xml_are_escaped() {
        assert_eq!(escaped("a<b & \"c\"\n"), "a&lt;b &amp; &quot;c&quot; ");
    }
}
