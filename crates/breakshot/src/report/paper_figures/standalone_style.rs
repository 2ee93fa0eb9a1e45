//! The style of the HTML page, embedded in a drawing.

use std::fmt::Write;

const REPORT_CSS: &str = include_str!("../html/report.css");
/// The fonts of a standalone drawing.
const FONT: &str = "\"Helvetica Neue\", Helvetica, Arial, \"Liberation Sans\", sans-serif";

/// The drawing with its style, light colours and a white background.
pub(super) fn standalone(svg: &str) -> String {
    let (head, body) = svg.split_once('\n').unwrap_or((svg, ""));
    format!(
        "{head}\n<style>\n{}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}",
        style()
    )
}

/// The CSS rules for drawings with every variable replaced by its light value.
fn style() -> String {
    let colours = variables();
    let mut css = String::new();
    for rule in REPORT_CSS.lines().filter(|line| line.starts_with("svg ")) {
        let rule = resolved(rule, &colours).replace("font-family: inherit", &format!("font-family: {FONT}"));
        if !rule.contains("var(--c)") {
            let _ = writeln!(css, "{rule}");
            continue;
        }
        // One rule for each colour: `svg .curve {..}` becomes `svg .curve.c0 {..}`.
        for (name, value) in colours.iter().filter(|(name, _)| name.strip_prefix('c').is_some_and(is_number))
        {
            let _ = writeln!(css, "{}", coloured(&rule, name, value));
        }
        let grey = colours.iter().find(|(name, _)| *name == "muted").map_or("#5d6672", |(_, value)| value);
        let _ = writeln!(css, "{}", coloured(&rule, "grey", grey));
    }
    css
}

fn coloured(rule: &str, class: &str, value: &str) -> String {
    rule.replacen(" {", &format!(".{class} {{"), 1).replace("var(--c)", value)
}

fn is_number(text: &str) -> bool {
    text.parse::<u8>().is_ok()
}

/// The names and values of the light colours: the first block of the style.
fn variables() -> Vec<(&'static str, &'static str)> {
    let block = REPORT_CSS.split('}').next().unwrap_or_default();
    block
        .split(';')
        .filter_map(|entry| entry.rsplit("--").next()?.split_once(": "))
        .filter(|(_, value)| value.starts_with('#'))
        .collect()
}

fn resolved(rule: &str, colours: &[(&str, &str)]) -> String {
    colours.iter().fold(rule.to_owned(), |rule, (name, value)| rule.replace(&format!("var(--{name})"), value))
}
