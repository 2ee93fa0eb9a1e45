//! `board.toml`: the tags of a calibration board.

use super::{check_version, json_of, label, parsed_toml, text};
use crate::cell::Board;
use crate::error::Result;
use std::path::Path;

/// A calibration board, as TOML or as JSON.
///
/// # Errors
/// A file that cannot be read, unknown keys, and what [`Board::check`] refuses.
pub fn load_board(path: impl AsRef<Path>) -> Result<Board> {
    let path = path.as_ref();
    let content = text(path)?;
    let mut board: Board = if content.trim_start().starts_with('{') {
        json_of(path, &content)?
    } else {
        parsed_toml(path, &content, "a board file")?
    };
    check_version(path, board.version)?;
    board.check(&label(path))?;
    Ok(board)
}
