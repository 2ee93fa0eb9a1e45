//! XML within bounds of time and memory: what URDF and OpenCV's files need of it.

use crate::error::{Error, Result};
use roxmltree::{Document, ParsingOptions};

/// Largest size of a file (bytes); the meshes of a URDF are in files of their own.
const MOST_BYTES: usize = 32 << 20;
/// Largest number of elements and texts: the parser needs 80 bytes for each, the smallest element has four bytes.
const MOST_NODES: u32 = 1_000_000;
/// Largest number of attributes of an element, which the parser compares with each other; an element of a URDF has up to eight.
const MOST_ATTRIBUTES: usize = 100;
/// Largest number of name spaces, which the parser copies from element to element.
const MOST_NAMESPACES: usize = 1000;

/// The document of a text; errors start with `file`.
///
/// # Errors
/// No XML, or more of it than the bounds allow.
pub(crate) fn document<'a>(text: &'a str, file: &str) -> Result<Document<'a>> {
    check_size(text, file)?;
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|e| match e {
        roxmltree::Error::NodesLimitReached => {
            let needed = format!("at most {MOST_NODES}");
            Error::invalid(file, "its number of elements", "larger", needed)
        }
        other => Error::Syntax { path: file.into(), problem: other.to_string() },
    })
}

/// Checks what the parser's time and memory depend on.
fn check_size(text: &str, file: &str) -> Result<()> {
    // No attribute contains a `<`, and every attribute has two quotation marks.
    let marks = |part: &str| part.bytes().filter(|byte| matches!(byte, b'"' | b'\'')).count();
    let attributes = text.split('<').map(marks).max().unwrap_or(0) / 2;
    for (what, found, most) in [
        ("its size in bytes", text.len(), MOST_BYTES),
        ("the number of attributes of an element", attributes, MOST_ATTRIBUTES),
        ("its number of name spaces", text.matches("xmlns").count(), MOST_NAMESPACES),
    ] {
        if found > most {
            return Err(Error::invalid(file, what, found, format!("at most {most}")));
        }
    }
    Ok(())
}
