//! A file with a figure.

/// A file to write: a drawing (SVG) or its numbers (CSV).
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FigureFile {
    /// The name of the file.
    pub name: String,
    /// Its text.
    pub text: String,
}
