//! `breakshot tags`: a sheet of tags or a calibration board to print.

use crate::Outcome;
use crate::args::TagsArgs;
use breakshot::{Error, Result, capture, files};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The side of a tag's black square (m) if none is given.
const SIZE_M: f64 = 0.05;

/// Writes one SVG for each page: `tags.svg`, then `tags-2.svg` and so on; or a board and its geometry.
pub(crate) fn run(args: &TagsArgs) -> Result<Outcome> {
    if let Some(grid) = args.board {
        return board(grid, args);
    }
    for (k, page) in capture::tag_sheet(&args.ids, args.size_m.unwrap_or(SIZE_M))?.iter().enumerate() {
        let path = page_path(&args.output, k);
        files::write_whole(&path, page.as_bytes())?;
        println!("Wrote {}", path.display());
    }
    println!("Print at 100 % and check the 100 mm line with a ruler.");
    Ok(Outcome::Done)
}

/// Writes `board.svg`, and beside it `board.toml`.
fn board(grid: [usize; 2], args: &TagsArgs) -> Result<Outcome> {
    let (page, board) = capture::board_sheet(grid, args.size_m)?;
    let geometry = args.output.with_extension("toml");
    if geometry == args.output {
        let found = format!("`{}`", args.output.display());
        return Err(Error::invalid(
            "--output",
            "the name",
            found,
            "one that does not end in .toml, which is the geometry's",
        ));
    }
    let mut text = String::from(
        "# A calibration board, for `breakshot lens`. If the print is not to scale (check the 100 mm line), multiply size_m and center_m.\n",
    );
    let _ = write!(text, "version = 1\nfamily = \"{}\"\n", board.family);
    for tag in &board.tags {
        let (x, y) = (tag.center_m.x, tag.center_m.y);
        let _ = write!(
            text,
            "[[tags]]\nid = {}\nsize_m = {:.5}\ncenter_m = [{x:.6}, {y:.6}]\n",
            tag.id, tag.size_m
        );
    }
    files::write_whole(&args.output, page.as_bytes())?;
    files::write_whole(&geometry, text.as_bytes())?;
    println!("Wrote {}\nWrote {}", args.output.display(), geometry.display());
    println!(
        "Print at 100 %, check the 100 mm line with a ruler, and glue it onto something flat and stiff."
    );
    Ok(Outcome::Done)
}

/// The path of a page: the given one for the first page, with a number before the extension for the others.
fn page_path(output: &Path, index: usize) -> PathBuf {
    if index == 0 {
        return output.to_path_buf();
    }
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let extension = output.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    output.with_file_name(format!("{stem}-{}{extension}", index + 1))
}
