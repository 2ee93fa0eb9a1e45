//! Warnings by their causes.

use super::super::figures::escaped;
use crate::warning::{self, WarningGroup};

/// The warnings of each cause under its summary, each as `item` shows it; warnings without causes are one list.
pub(super) fn by_cause(lines: &[String], causes: &[WarningGroup], item: impl Fn(&str) -> String) -> String {
    let list = |lines: &[String]| {
        let items: String = lines.iter().map(|line| format!("<li>{}</li>\n", item(line))).collect();
        format!("<ul class=\"warnings\">\n{items}</ul>\n")
    };
    if causes.is_empty() {
        return if lines.is_empty() { String::new() } else { list(lines) };
    }
    let group = |(group, own): (&WarningGroup, &[String])| {
        format!("<h3>{}</h3>\n{}", escaped(&capitalized(&group.summary)), list(own))
    };
    warning::by_cause(lines, causes).map(group).collect()
}

fn capitalized(text: &str) -> String {
    let mut characters = text.chars();
    characters.next().map_or_else(String::new, |first| first.to_uppercase().chain(characters).collect())
}
