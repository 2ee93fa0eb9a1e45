//! Pages of tags for printing.

use super::family::{CODES, is_white};
use crate::cell::Board;
use crate::error::{Error, Result};
use std::fmt::Write;

/// The size of A4 and its unprintable margin (mm).
const PAGE_MM: [f64; 2] = [210.0, 297.0];
const UNPRINTED_MM: f64 = 10.0;
/// Height of the line of text below a tag (mm).
const TEXT_MM: f64 = 5.0;
/// Length of a line with which the printed scale can be checked (mm).
const CHECK_MM: f64 = 100.0;
/// The text is no wider than its tag: average width of a letter over its font's height...
const LETTER_WIDTH: f64 = 0.52;
/// ... and the largest height (mm).
const LARGEST_FONT_MM: f64 = 3.0;
/// Smallest side of a printed tag (m).
const LEAST_SIZE_M: f64 = 0.005;

/// Pages of A4, each an SVG at true scale, with these tags of family 36h11, their black squares `size_m` wide, and a
/// line to check the printer's scale.
///
/// # Errors
/// Numbers above 586, a size that does not fit the page.
pub fn tag_sheet(ids: &[u32], size_m: f64) -> Result<Vec<String>> {
    if let Some(id) = ids.iter().find(|&&id| id as usize >= CODES.len()) {
        return Err(Error::invalid("tag sheet", "id", id, format!("0 to {}", CODES.len() - 1)));
    }
    let side_mm = size_m * 1e3;
    let bit_mm = side_mm / 8.0;
    // A white margin of a bit all round, then the text.
    let cell_mm = [side_mm + 2.0 * bit_mm, side_mm + 2.0 * bit_mm + TEXT_MM];
    let room_mm = [PAGE_MM[0] - 2.0 * UNPRINTED_MM, PAGE_MM[1] - 2.0 * UNPRINTED_MM - 2.0 * TEXT_MM];
    let fits = |axis: usize| (room_mm[axis] / cell_mm[axis]).floor();
    if !(size_m >= LEAST_SIZE_M && fits(0) >= 1.0 && fits(1) >= 1.0) {
        let largest_m = room_mm[0] * 0.8e-3;
        let needed = format!("{LEAST_SIZE_M} to {largest_m:.3} m, the black square's side");
        return Err(Error::invalid("tag sheet", "size_m", size_m, needed));
    }
    let (columns, rows) = (fits(0) as usize, fits(1) as usize);
    let page = |ids: &[u32]| {
        let mut svg = page_start(PAGE_MM);
        for (k, &id) in ids.iter().enumerate() {
            let left = UNPRINTED_MM + bit_mm + (k % columns) as f64 * cell_mm[0];
            let top = UNPRINTED_MM + bit_mm + (k / columns) as f64 * cell_mm[1];
            draw_tag(&mut svg, id, [left, top], bit_mm);
        }
        svg + "</svg>\n"
    };
    Ok(ids.chunks(columns * rows).map(page).collect())
}

/// Width of the white margin between two tags of a board, over the side of a black square: a bit of each.
const BOARD_GAP: f64 = 0.25;
/// Largest side of a board's page (m).
const LARGEST_PAGE_M: f64 = 5.0;

/// A calibration board of this many columns and rows of tags on one page, an SVG at true scale, and the positions of its
/// tags. The side of the black squares is the largest that fits a sheet of A4, unless `size_m` is given; a larger board
/// has a larger page.
///
/// # Errors
/// Fewer than two columns or rows, more tags than the family has, an impossible size.
pub fn board_sheet(grid: [usize; 2], size_m: Option<f64>) -> Result<(String, Board)> {
    let [columns, rows] = grid.map(|count| count as f64);
    // The longer side of the board along that of the page
    let page_mm = if columns > rows { [PAGE_MM[1], PAGE_MM[0]] } else { PAGE_MM };
    let margins_mm = [2.0 * UNPRINTED_MM, 2.0 * UNPRINTED_MM + 2.0 * TEXT_MM];
    let pitches = (1.0 + BOARD_GAP) * 1e3;
    let largest_m = |axis: usize, count: f64| (page_mm[axis] - margins_mm[axis]) / (count * pitches);
    let fitting_m = (largest_m(0, columns).min(largest_m(1, rows)) * 1e3 + 1e-9).floor() * 1e-3;
    let size_m = size_m.unwrap_or(fitting_m);
    let needed_m = columns.max(rows) * size_m * (1.0 + BOARD_GAP);
    if !(size_m >= LEAST_SIZE_M && needed_m <= LARGEST_PAGE_M) {
        let needed = format!("{LEAST_SIZE_M} m or more, and a board of at most {LARGEST_PAGE_M} m");
        return Err(Error::invalid("board", "size_m", size_m, needed));
    }
    let board = Board::grid(grid, size_m, size_m * (1.0 + BOARD_GAP))?;
    let (side_mm, pitch_mm) = (size_m * 1e3, size_m * pitches);
    let size_mm = [columns * pitch_mm, rows * pitch_mm];
    // To a thousandth of a millimetre: a board that fits the page by rounding does not enlarge it.
    let enclosing_mm = |axis: usize| ((size_mm[axis] + margins_mm[axis]) * 1e3).round() / 1e3;
    let page_mm = [0, 1].map(|axis| page_mm[axis].max(enclosing_mm(axis)));
    let mut svg = page_start(page_mm);
    let middle_mm = [page_mm[0] / 2.0, UNPRINTED_MM + size_mm[1] / 2.0];
    for tag in &board.tags {
        let left = middle_mm[0] + tag.center_m.x * 1e3 - side_mm / 2.0;
        let top = middle_mm[1] - tag.center_m.y * 1e3 - side_mm / 2.0;
        draw_code(&mut svg, tag.id, [left, top], side_mm / 8.0);
        svg += "\"/>\n";
    }
    Ok((svg + "</svg>\n", board))
}

fn page_start([width, height]: [f64; 2]) -> String {
    let (left, right, y) = (UNPRINTED_MM, UNPRINTED_MM + CHECK_MM, height - UNPRINTED_MM);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"3\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n\
         <path d=\"M{left} {y}H{right}M{left} {}v4M{right} {}v4\" stroke=\"#000\" stroke-width=\"0.2\"/>\n\
         <text x=\"{}\" y=\"{y}\" dy=\"1\">{CHECK_MM} mm, if the page was printed at 100 %</text>\n",
        y - 2.0,
        y - 2.0,
        right + 3.0
    )
}

/// The tag as a path that is not yet closed.
fn draw_code(svg: &mut String, id: u32, [left, top]: [f64; 2], bit_mm: f64) {
    let side_mm = 8.0 * bit_mm;
    let _ = write!(
        svg,
        "<path fill=\"#000\" fill-rule=\"evenodd\" d=\"M{left:.4} {top:.4}h{side_mm:.4}v{side_mm:.4}h-{side_mm:.4}z"
    );
    for (row, column) in (0..6).flat_map(|row| (0..6).map(move |column| (row, column))) {
        if is_white(CODES[id as usize], row, column) {
            let (x, y) = (left + (column as f64 + 1.0) * bit_mm, top + (row as f64 + 1.0) * bit_mm);
            let _ = write!(svg, "M{x:.4} {y:.4}h{bit_mm:.4}v{bit_mm:.4}h-{bit_mm:.4}z");
        }
    }
}

fn draw_tag(svg: &mut String, id: u32, [left, top]: [f64; 2], bit_mm: f64) {
    let side_mm = 8.0 * bit_mm;
    draw_code(svg, id, [left, top], bit_mm);
    let text_y = top + side_mm + bit_mm + 3.0;
    let text = format!("36h11, id {id}, size_m = {:.4}, this side down", side_mm * 1e-3);
    let font_mm = (side_mm / (LETTER_WIDTH * text.len() as f64)).min(LARGEST_FONT_MM);
    let _ = writeln!(
        svg,
        "\"/>\n<text x=\"{left:.2}\" y=\"{text_y:.2}\" font-size=\"{font_mm:.2}\">{text}</text>"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_holds_every_tag_once_with_its_size() {
        let ids: Vec<u32> = (0..11).collect();
        let pages = tag_sheet(&ids, 0.05).expect("fits");
        assert_eq!(pages.len(), 2, "3 by 3 of them fit a page");
        for id in ids {
            let text = format!("id {id}, size_m = 0.0500,");
            assert_eq!(pages.iter().filter(|page| page.contains(&text)).count(), 1, "tag {id}");
        }
    }

    #[test]
    fn tags_that_do_not_exist_or_fit_are_an_error() {
        for (id, size_m, word) in [(587, 0.05, "587"), (0, 0.3, "0.3"), (0, f64::NAN, "NaN"), (0, -1.0, "-1")]
        {
            let message = tag_sheet(&[id], size_m).expect_err("refused").to_string();
            assert!(message.contains(word), "{message}");
        }
    }
}
