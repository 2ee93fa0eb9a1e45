//! `breakshot tags`: a sheet of tags to print.

use crate::Outcome;
use crate::args::TagsArgs;
use breakshot::{Result, capture, files};
use std::path::{Path, PathBuf};

/// Writes one SVG a page: `tags.svg`, then `tags-2.svg` and so on.
pub(crate) fn run(args: &TagsArgs) -> Result<Outcome> {
    for (k, page) in capture::tag_sheet(&args.ids, args.size_m)?.iter().enumerate() {
        let path = page_path(&args.output, k);
        files::write_whole(&path, page.as_bytes())?;
        println!("Wrote {}", path.display());
    }
    println!("Print at 100 % and check the 100 mm line with a ruler.");
    Ok(Outcome::Done)
}

/// The first page has the name asked for, later ones a number before the ending.
fn page_path(output: &Path, index: usize) -> PathBuf {
    if index == 0 {
        return output.to_path_buf();
    }
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let ending = output.extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy()));
    output.with_file_name(format!("{stem}-{}{ending}", index + 1))
}
