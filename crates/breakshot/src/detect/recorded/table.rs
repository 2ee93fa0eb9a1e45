//! A table of text: one line of column names, then rows of as many fields.

use crate::error::{Error, Result};
use std::collections::BTreeSet;

/// The columns of a table and where the rows begin.
pub(super) struct Table<'t> {
    /// The file's name, for messages.
    name: &'t str,
    text: &'t str,
    separator: char,
    /// The line of the header, counted from 1.
    header_line: usize,
    columns: Vec<String>,
}

/// A row, or rather its fields.
pub(super) struct Row<'t> {
    table: &'t Table<'t>,
    /// The line, counted from 1.
    line: usize,
    fields: Vec<String>,
}

impl<'t> Table<'t> {
    /// Reads the header; fields are separated by commas, semicolons or tabs, whichever the header has most of.
    pub(super) fn new(name: &'t str, text: &'t str) -> Result<Self> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let (line, header) =
            lines(text).next().ok_or_else(|| syntax(name, "no line; needed: a line of column names"))?;
        let count = |separator: &char| header.matches(*separator).count();
        let separator = [';', '\t', ','].into_iter().max_by_key(count).unwrap_or(',');
        let columns = fields(header, separator).map_err(|at| unclosed(name, line, at))?;
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        if let Some(twice) = columns.iter().find(|column| !column.is_empty() && !seen.insert(column)) {
            return Err(syntax(
                name,
                &format!("line {line}: column `{twice}` is given twice; needed: every column once"),
            ));
        }
        Ok(Self { name, text, separator, header_line: line, columns })
    }

    /// The index of a column.
    pub(super) fn column(&self, column: &str) -> Result<usize> {
        self.optional_column(column).ok_or_else(|| {
            let line = self.header_line;
            let shown: Vec<String> = self.columns.iter().take(SHOWN).map(|c| format!("`{c}`")).collect();
            let found = shown.join(", ") + if self.columns.len() > SHOWN { ", .." } else { "" };
            syntax(
                self.name,
                &format!(
                    "line {line}: no column `{column}`; needed: it among the columns, which are {found}"
                ),
            )
        })
    }

    pub(super) fn optional_column(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|c| c == column)
    }

    /// The rows in the order of the file.
    pub(super) fn rows(&'t self) -> impl Iterator<Item = Result<Row<'t>>> {
        lines(self.text).skip(1).map(|(line, text)| {
            let fields = fields(text, self.separator).map_err(|at| unclosed(self.name, line, at))?;
            if fields.len() != self.columns.len() {
                let (found, needed) = (fields.len(), self.columns.len());
                return Err(syntax(
                    self.name,
                    &format!("line {line} has {found} fields; needed: {needed}, as the columns"),
                ));
            }
            Ok(Row { table: self, line, fields })
        })
    }
}

impl Row<'_> {
    pub(super) fn text(&self, column: usize) -> &str {
        &self.fields[column]
    }

    /// The number in a column; `None` where the field is empty or not a number by name.
    pub(super) fn number(&self, column: usize) -> Result<Option<f64>> {
        let text = self.text(column);
        if text.is_empty() || ["nan", "na", "null", "none"].contains(&text.to_ascii_lowercase().as_str()) {
            return Ok(None);
        }
        // Where fields are separated by semicolons, the comma may be the decimal point.
        let number =
            if self.table.separator == ';' { text.replace(',', ".").parse() } else { text.parse::<f64>() };
        match number {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ => Err(self.wrong(column, "a number, or nothing where the object was not seen")),
        }
    }

    /// The error that a field is not what is needed.
    pub(super) fn wrong(&self, column: usize, needed: &str) -> Error {
        let (line, name) = (self.line, &self.table.columns[column]);
        let shown: String = self.fields[column].chars().take(SHOWN).collect();
        let problem = format!("line {line}, column {} (`{name}`) is `{shown}`; needed: {needed}", column + 1);
        syntax(self.table.name, &problem)
    }
}

/// Columns that a message lists, and letters of a field that it quotes.
const SHOWN: usize = 30;

/// An error that names the file.
pub(super) fn syntax(name: &str, problem: &str) -> Error {
    Error::Syntax { path: name.into(), problem: problem.into() }
}

fn unclosed(name: &str, line: usize, column: usize) -> Error {
    syntax(
        name,
        &format!(
            "line {line}, column {column}: a quotation mark that is not closed; needed: a second one in this line"
        ),
    )
}

/// The lines with their numbers, counted from 1, without empty ones and comments.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let numbered = text.lines().enumerate().map(|(k, line)| (k + 1, line));
    numbered.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
}

/// The fields of a line, trimmed and without their quotation marks; the error is the number of the field whose mark is not
/// closed.
fn fields(line: &str, separator: char) -> std::result::Result<Vec<String>, usize> {
    let mut fields = Vec::new();
    let mut rest = Some(line);
    while let Some(text) = rest {
        let trimmed = text.trim_start_matches(' ');
        let Some(mut quoted) = trimmed.strip_prefix('"') else {
            let (field, after) =
                text.split_once(separator).map_or((text, None), |(f, after)| (f, Some(after)));
            fields.push(field.trim().to_owned());
            rest = after;
            continue;
        };
        let mut field = String::new();
        loop {
            let (part, after) = quoted.split_once('"').ok_or(fields.len() + 1)?;
            field.push_str(part);
            let doubled = after.strip_prefix('"');
            quoted = doubled.unwrap_or(after);
            if doubled.is_none() {
                break;
            }
            field.push('"');
        }
        fields.push(field.trim().to_owned());
        rest = quoted.split_once(separator).map(|(_, after)| after);
    }
    Ok(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_fields_may_contain_the_separator_and_quotation_marks() {
        let found = fields(r#"a, "b, ""c""" ,,d"#, ',').expect("closed");
        assert_eq!(found, ["a", r#"b, "c""#, "", "d"]);
        assert_eq!(fields("a,\"b", ','), Err(2));
    }

    #[test]
    fn the_separator_is_the_most_frequent_one_and_a_decimal_comma_is_read() {
        let table =
            Table::new("run.csv", "\u{feff}# recorded on Monday\n\nt;x\n0,5;-1,25\n").expect("a table");
        let row = table.rows().next().expect("a row").expect("two fields");
        assert_eq!([row.number(0).ok(), row.number(1).ok()], [Some(Some(0.5)), Some(Some(-1.25))]);
    }
}
