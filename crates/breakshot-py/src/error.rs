//! The library's errors as a Python exception.

use breakshot::capture::is_decoding;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::{PyErr, create_exception};
use std::panic::{set_hook, take_hook};

create_exception!(
    breakshot,
    Error,
    PyValueError,
    "Input that is wrong: a sentence that names the file, object or argument, what was found and what is needed."
);

/// An error of the library, with the sentence that the program prints.
pub(crate) fn raised(error: breakshot::Error) -> PyErr {
    Error::new_err(error.to_string())
}

/// An [`Error`] with the sentence `name: what is found; needed: needed`.
pub(crate) fn invalid(name: &str, what: &str, found: impl std::fmt::Display, needed: &str) -> PyErr {
    raised(breakshot::Error::invalid(name, what, found, needed))
}

/// An error of this package itself, which no input should cause.
pub(crate) fn internal(error: impl std::fmt::Display) -> PyErr {
    PyRuntimeError::new_err(format!("{error}"))
}

/// A panic of the built-in decoder becomes an error that names the film: it is not printed as well. The hook concerns this module alone,
/// whose shared object has a standard library of its own.
pub(crate) fn quiet_decoder_panics() {
    let previous = take_hook();
    set_hook(Box::new(move |panic| {
        if !is_decoding() {
            previous(panic);
        }
    }));
}
