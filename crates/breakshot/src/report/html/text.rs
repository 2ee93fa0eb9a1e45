//! Numbers and pieces of the page, in words.

use crate::report::figures::escaped;

/// Two drawings fit beside each other (px).
pub(super) const HALF_WIDTH_PX: f64 = 418.0;
/// Two drawings beside each other show a workspace as a whole if it is at most so many times as wide as the event.
pub(super) const HALF_WORKSPACE_FACTOR: f64 = 1.5;

/// A length in millimetres, one digit after the point.
pub(super) fn mm(length_m: f64) -> String {
    format!("{:.1} mm", length_m * 1e3)
}

/// A length in millimetres that may not exist.
pub(super) fn mm_or_dash(length_m: Option<f64>) -> String {
    length_m.map_or("\u{2013}".into(), mm)
}

/// A picture and what one sees in it.
pub(super) fn figure(svg: &str, caption: &str) -> String {
    format!("<figure>\n{svg}<figcaption>{caption}</figcaption>\n</figure>\n")
}

/// Two pictures beside each other.
pub(super) fn figure_pair(left: (&str, &str), right: (&str, &str), caption: &str) -> String {
    let half = |(title, svg): (&str, &str)| format!("<figure><h4>{title}</h4>\n{svg}</figure>\n");
    format!(
        "<figure>\n<div class=\"pair\">\n{}{}</div>\n<figcaption>{caption}</figcaption>\n</figure>\n",
        half(left),
        half(right)
    )
}

/// A table; cells are text, the first column is aligned to the left.
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

/// A few numbers in large print, each with what it is.
pub(super) fn numbers(items: &[(String, &str)]) -> String {
    let items: String = items
        .iter()
        .map(|(value, what)| format!("<li><b>{}</b>{}</li>", escaped(value), escaped(what)))
        .collect();
    format!("<ul class=\"numbers\">{items}</ul>\n")
}

/// A judgement: `yes`, `doubt` or `no`, and why.
pub(super) fn verdict(class: &str, title: &str, why: &str) -> String {
    let why = if why.is_empty() { String::new() } else { format!(" {}", escaped(why)) };
    format!("<div class=\"verdict {class}\"><p><b class=\"{class}\">{}</b>{why}</p></div>\n", escaped(title))
}

/// A sentence: first letter large, a full stop at its end.
pub(super) fn sentence(text: &str) -> String {
    let mut chars = text.trim_end_matches('.').chars();
    let first: String = chars.next().into_iter().flat_map(char::to_uppercase).collect();
    if first.is_empty() { first } else { format!("{first}{}.", chars.as_str()) }
}
