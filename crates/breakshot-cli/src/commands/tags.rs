//! `breakshot tags`: a sheet of tags to print.

use crate::Outcome;
use crate::args::TagsArgs;
use breakshot::{Result, capture, files};
use std::path::{Path, PathBuf};

/// Writes one SVG for each page: `tags.svg`, then `tags-2.svg` and so on.
pub(crate) fn run(args: &TagsArgs) -> Result<Outcome> {
    for (k, page) in capture::tag_sheet(&args.ids, args.size_m)?.iter().enumerate() {
        let path = page_path(&args.output, k);
        files::write_whole(&path, page.as_bytes())?;
        println!("Wrote {}", path.display());
    }
    println!("Print at 100 % and check the 100 mm line with a ruler.");
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
