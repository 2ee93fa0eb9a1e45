//! HTML elements and formatted numbers for the chapters.

use crate::report::figures::escaped;

/// The width of each of two figures beside each other (px).
pub(super) const HALF_WIDTH_PX: f64 = 418.0;
/// Two figures beside each other show the whole workspace if it is at most this many times as wide as their contents.
pub(super) const HALF_WORKSPACE_FACTOR: f64 = 1.5;
/// The text of a value that does not exist.
pub(super) const DASH: &str = "\u{2013}";

/// A length in millimetres with one decimal.
pub(super) fn mm(length_m: f64) -> String {
    format!("{:.1} mm", length_m * 1e3)
}

/// A length in millimetres, or a dash if it does not exist.
pub(super) fn mm_or_dash(length_m: Option<f64>) -> String {
    length_m.map_or(DASH.into(), mm)
}

/// A figure with its caption.
pub(super) fn figure(svg: &str, caption: &str) -> String {
    format!("<figure>\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n")
}

/// One of two figures beside each other.
pub(super) struct Half<'a> {
    /// The heading of the figure.
    pub title: &'a str,
    /// An SVG or an `img` element.
    pub image: &'a str,
}

/// Two figures beside each other with a common caption.
pub(super) fn figure_pair(left: &Half, right: &Half, caption: &str) -> String {
    let half = |Half { title, image }: &Half| format!("<figure><h4>{title}</h4>\n{image}</figure>\n");
    format!(
        "<figure>\n<div class=\"pair\">\n{}{}</div>\n<figcaption>{caption}</figcaption>\n</figure>\n",
        half(left),
        half(right)
    )
}

/// A table; the cells are plain text, the first column is aligned to the left.
pub(super) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let cells = |row: &[String], tag: &str| -> String {
        row.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
    };
    let head: Vec<String> = head.iter().map(|&h| h.to_owned()).collect();
    let body: String = rows.iter().map(|row| format!("<tr>{}</tr>\n", cells(row, "td"))).collect();
    format!(
        "<div class=\"wide\"><table>\n<thead><tr>{}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n",
        cells(&head, "th")
    )
}

/// A number in large print with its description.
pub(super) struct KeyNumber {
    /// The number with its unit.
    pub value: String,
    /// The description.
    pub label: &'static str,
}

impl KeyNumber {
    pub(super) fn new(value: impl Into<String>, label: &'static str) -> Self {
        Self { value: value.into(), label }
    }
}

/// A row of numbers in large print.
pub(super) fn key_numbers(items: &[KeyNumber]) -> String {
    let items: String = items
        .iter()
        .map(|KeyNumber { value, label }| format!("<li><b>{}</b>{}</li>", escaped(value), escaped(label)))
        .collect();
    format!("<ul class=\"numbers\">{items}</ul>\n")
}

/// The CSS class of a conclusion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Conclusion {
    /// Success.
    Yes,
    /// Partial success, or an outcome that was not predicted.
    Uncertain,
    /// Failure.
    No,
}

/// A conclusion in a highlighted paragraph, with its reason.
pub(super) fn conclusion(conclusion: Conclusion, title: &str, reason: &str) -> String {
    let class = match conclusion {
        Conclusion::Yes => "yes",
        Conclusion::Uncertain => "doubt",
        Conclusion::No => "no",
    };
    let reason = if reason.is_empty() { String::new() } else { format!(" {}", escaped(reason)) };
    format!(
        "<div class=\"conclusion {class}\"><p><b class=\"{class}\">{}</b>{reason}</p></div>\n",
        escaped(title)
    )
}

/// The text as a sentence: with a capital letter and a full stop.
pub(super) fn sentence(text: &str) -> String {
    let mut chars = text.trim_end_matches('.').chars();
    let first: String = chars.next().into_iter().flat_map(char::to_uppercase).collect();
    if first.is_empty() { first } else { format!("{first}{}.", chars.as_str()) }
}
