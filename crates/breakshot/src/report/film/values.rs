//! Learned values with their intervals, one line for each.

use super::page::{Caption, FilmPages};
use super::style::{MUTED, TEXT};
use crate::geometry::Pixel;
use crate::properties::Properties;
use crate::report::raster::{Area, Canvas, FAINT, Lettering, Pen, RgbImage, STRONG, text_width_px};
use crate::uncertain::Estimate;

/// The height of a line (px of the design).
const LINE_PX: f64 = 34.0;
/// Most pages; further values are counted.
const MOST_PAGES: usize = 8;
/// Part of the axis that is left free at both ends.
const FREE: f64 = 0.06;

/// The values of one kind.
struct Group {
    title: String,
    rows: Vec<(String, Estimate)>,
    is_logarithmic: bool,
}

/// A line of a page.
enum Line<'a> {
    Title(&'a Group),
    Value(&'a Group, &'a str, &'a Estimate),
}

fn groups(properties: &Properties) -> Vec<Group> {
    let rows = |values: &std::collections::BTreeMap<String, Estimate>| {
        values.iter().map(|(name, estimate)| (name.clone(), *estimate)).collect()
    };
    let contact = [
        ("between objects", properties.contact_friction.objects),
        ("at the striker", properties.contact_friction.striker),
    ];
    let contact = contact.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?)));
    let group = |title: &str, rows| Group { title: title.to_owned(), rows, is_logarithmic: false };
    let mass = format!("Mass over that of {} (logarithmic)", properties.reference);
    let all = vec![
        group("Friction on the table", rows(&properties.friction)),
        group("Restitution against the striker", rows(&properties.striker_restitution)),
        group("Restitution of a pair", rows(&properties.restitution)),
        Group { is_logarithmic: true, ..group(&mass, rows(&properties.mass_ratio)) },
        group("Friction of contacts", contact.collect()),
        group("Support (1 for an even weight)", rows(&properties.support)),
    ];
    all.into_iter().filter(|group| !group.rows.is_empty()).collect()
}

/// The pages; none without values.
pub(super) fn pages(pages: &FilmPages, properties: &Properties) -> Vec<RgbImage> {
    let groups = groups(properties);
    let area = pages.content();
    let lines_per_page = ((area.size[1] as f64 / pages.px(LINE_PX)) as usize).max(3);
    let mut parts: Vec<Vec<Line>> = vec![Vec::new()];
    for group in &groups {
        let mut begin_page = false;
        for (k, (name, estimate)) in group.rows.iter().enumerate() {
            let Some(last) = parts.last_mut() else { return Vec::new() };
            // A title stands above at least two values, and again on each page.
            let needed = if k == 0 { 1 + group.rows.len().min(2) } else { 1 };
            begin_page = begin_page || last.len() + needed > lines_per_page;
            if begin_page && !last.is_empty() {
                parts.push(Vec::new());
            }
            let Some(last) = parts.last_mut() else { return Vec::new() };
            if k == 0 || begin_page {
                last.push(Line::Title(group));
            }
            begin_page = false;
            last.push(Line::Value(group, name, estimate));
        }
    }
    parts.retain(|part| !part.is_empty());
    let total: usize = groups.iter().map(|group| group.rows.len()).sum();
    let values = |part: &[Line]| part.iter().filter(|line| matches!(line, Line::Value(..))).count();
    let shown: usize = parts.iter().take(MOST_PAGES).map(|part| values(part)).sum();
    let more = match total - shown {
        0 => String::new(),
        more => format!(" {more} further values are not shown."),
    };
    let text = format!(
        "Dots: means. Lines: 95 % intervals of the means. All values are ratios without a unit.{more}"
    );
    let count = parts.len().min(MOST_PAGES);
    let page = |(k, part): (usize, &Vec<Line>)| {
        let clock = if count > 1 { format!("{} of {count}", k + 1) } else { String::new() };
        let heading = "Learned properties of the objects";
        let mut canvas = pages.captioned(&Caption { heading, line: &text, clock: &clock });
        for (number, line) in part.iter().enumerate() {
            draw(pages, &mut canvas, line, area.corner[1] as f64 + pages.px(LINE_PX) * (number as f64 + 0.5));
        }
        canvas.finish()
    };
    parts.iter().take(MOST_PAGES).enumerate().map(page).collect()
}

/// Draws a line about the height `y`.
fn draw(pages: &FilmPages, canvas: &mut Canvas, line: &Line, y: f64) {
    let Area { corner: [left, _], size: [width, _] } = pages.content();
    let (left, width) = (left as f64, width as f64);
    let base = y + pages.px(7.0);
    let letters = |height: f64, colour| Lettering { height_px: pages.px(height), colour };
    let (group, name, estimate) = match line {
        Line::Title(group) => {
            canvas.text(&group.title, Pixel::new(left, base), letters(16.0, MUTED));
            let end = left + text_width_px(&group.title, pages.px(16.0)) + pages.px(16.0);
            let pen = Pen { colour: MUTED, width_px: pages.px(1.0), opacity: 0.35 };
            canvas.polyline(&[Pixel::new(end, y), Pixel::new(left + width, y)], pen);
            return;
        }
        Line::Value(group, name, estimate) => (group, name, estimate),
    };
    let (axis_left, axis_px) = (left + 0.2 * width, 0.42 * width);
    let height = 15.0_f64.min(0.18 * width / text_width_px(name, pages.px(1.0)).max(1e-9));
    canvas.text(name, Pixel::new(left + pages.px(14.0), base), letters(height, TEXT));
    let [low, high] = estimate.interval_95;
    let is_exact = low == high;
    let position = scale(group);
    let at = |value: f64| Pixel::new(axis_left + axis_px * position(value), y);
    let ends = [Pixel::new(axis_left, y), Pixel::new(axis_left + axis_px, y)];
    canvas.polyline(&ends, Pen { colour: MUTED, width_px: pages.px(1.0), opacity: 0.25 });
    let colour = pages.colour(name);
    if !is_exact {
        canvas.polyline(&[at(low), at(high)], Pen { colour, width_px: pages.px(3.0), opacity: STRONG });
        for end in [low, high] {
            let tick = |side: f64| Pixel::new(at(end).x, y + side * pages.px(6.0));
            canvas
                .polyline(&[tick(-1.0), tick(1.0)], Pen { colour, width_px: pages.px(2.0), opacity: FAINT });
        }
    }
    let dot = at(estimate.mean);
    canvas.polyline(&[dot, dot], Pen { colour, width_px: pages.px(11.0), opacity: STRONG });
    let text_left = axis_left + axis_px + pages.px(20.0);
    let text = if is_exact {
        format!("{:.4}   by definition", estimate.mean)
    } else {
        let clips = if estimate.n == 1 { "1 clip".to_owned() } else { format!("{} clips", estimate.n) };
        format!("{:.4}   {low:.4} to {high:.4}   {clips}", estimate.mean)
    };
    let most_px = left + width - text_left;
    let height = 14.0_f64.min(most_px / text_width_px(&text, pages.px(1.0)));
    canvas.text(&text, Pixel::new(text_left, base), letters(height, TEXT));
}

/// The place of a value on the axis of its group, 0 to 1.
fn scale(group: &Group) -> impl Fn(f64) -> f64 {
    let is_logarithmic =
        group.is_logarithmic && group.rows.iter().all(|(_, e)| e.mean > 0.0 && e.interval_95[0] > 0.0);
    let of = move |value: f64| if is_logarithmic { value.ln() } else { value };
    let values = group.rows.iter().flat_map(|(_, e)| [e.mean, e.interval_95[0], e.interval_95[1]]).map(of);
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let span = (high - low).max(1e-9);
    move |value: f64| (FREE + (1.0 - 2.0 * FREE) * (of(value) - low) / span).clamp(0.0, 1.0)
}
