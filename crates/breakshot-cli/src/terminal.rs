//! Printing that does not fail: a reader such as `head` may close the pipe before the end.
//!
//! The macros of the standard library panic then. These remember the error instead, print no more, and the command goes on: its files
//! and its exit code are the same as for a reader that reads everything.

use std::fmt::Arguments;
use std::io::{Error, ErrorKind, Write};
use std::sync::Mutex;

/// The first error of standard output.
static FAILURE: Mutex<Option<Error>> = Mutex::new(None);

/// Prints to standard output.
macro_rules! print {
    ($($text:tt)*) => { $crate::terminal::print(format_args!($($text)*)) };
}

/// Prints a line to standard output.
macro_rules! println {
    () => { $crate::terminal::print(format_args!("\n")) };
    ($($text:tt)*) => { $crate::terminal::print(format_args!("{}\n", format_args!($($text)*))) };
}

/// Prints a line to standard error.
macro_rules! eprintln {
    ($($text:tt)*) => { $crate::terminal::print_error(format_args!("{}\n", format_args!($($text)*))) };
}

pub(crate) fn print(text: Arguments) {
    let Ok(mut failure) = FAILURE.lock() else { return };
    if failure.is_none() {
        *failure = std::io::stdout().lock().write_fmt(text).err();
    }
}

/// Prints to standard error. An error of standard error itself cannot be reported.
pub(crate) fn print_error(text: Arguments) {
    let _ = std::io::stderr().lock().write_fmt(text);
}

/// The error for which not everything was printed; a closed pipe is none.
pub(crate) fn failure() -> Option<Error> {
    let flushed = std::io::stdout().lock().flush();
    let first = FAILURE.lock().ok().and_then(|mut failure| failure.take());
    first.or(flushed.err()).filter(|error| error.kind() != ErrorKind::BrokenPipe)
}
