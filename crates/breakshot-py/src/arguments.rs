//! Arguments from Python, and parts of values for Python.

use crate::error::internal;
use crate::held::Held;
use breakshot::detect::{Sample, Tracks};
use breakshot::files;
use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use serde::Serialize;
use std::sync::Arc;

/// An argument that is a value of a class, or a mapping with its fields.
pub(crate) struct Arg<T>(pub(crate) Arc<T>);

impl<'py, T: Held> FromPyObject<'_, 'py> for Arg<T> {
    type Error = PyErr;

    fn extract(object: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Some(value) = T::held_by(&object) {
            return Ok(Self(value));
        }
        if object.cast::<PyMapping>().is_err() {
            let found = object.get_type().name()?;
            return Err(PyTypeError::new_err(format!("{found} given; needed: {}", T::NAME)));
        }
        let text: String = helpers(object.py())?.call_method1("text_of", (object,))?.extract()?;
        T::from_text(&text).map(Self)
    }
}

/// The module `breakshot._record`.
fn helpers(py: Python<'_>) -> PyResult<Bound<'_, PyModule>> {
    py.import("breakshot._record")
}

/// A value as the JSON text of its file.
pub(crate) fn json_of(value: &impl Serialize) -> PyResult<String> {
    files::json_text(value).map_err(internal)
}

/// The fields of JSON text as a `breakshot.Record`.
pub(crate) fn fields_of(py: Python, text: &str) -> PyResult<Py<PyAny>> {
    Ok(helpers(py)?.call_method1("record_of", (text,))?.unbind())
}

/// JSON text with some of its fields replaced.
pub(crate) fn reconstructed(py: Python, text: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<String> {
    helpers(py)?.call_method1("replaced", (text, fields))?.extract()
}

/// Warns as Python does.
pub(crate) fn warn(py: Python, notes: &[String]) -> PyResult<()> {
    let warnings = py.import("warnings")?;
    notes.iter().try_for_each(|note| warnings.call_method1("warn", (note,)).map(drop))
}

/// A structured array for each object of a film.
pub(crate) fn track_arrays<'py>(py: Python<'py>, tracks: &Tracks) -> PyResult<Bound<'py, PyDict>> {
    type Column = (&'static str, fn(&Sample) -> f64);
    fn or_nan(value: Option<f64>) -> f64 {
        value.unwrap_or(f64::NAN)
    }
    const COLUMNS: [Column; 11] = [
        ("time_s", |s| s.time_s),
        ("x_m", |s| s.x_m),
        ("y_m", |s| s.y_m),
        ("yaw_rad", |s| or_nan(s.yaw_rad)),
        ("vx_m_s", |s| or_nan(s.vx_m_s)),
        ("vy_m_s", |s| or_nan(s.vy_m_s)),
        ("yaw_rate_rad_s", |s| or_nan(s.yaw_rate_rad_s)),
        ("ax_m_s2", |s| or_nan(s.ax_m_s2)),
        ("ay_m_s2", |s| or_nan(s.ay_m_s2)),
        ("std_m", |s| s.std_m),
        ("pose_std_m", |s| s.pose_std_m),
    ];
    let numpy = py.import("numpy")?;
    let arrays = PyDict::new(py);
    for track in &tracks.tracks {
        let types: Vec<_> = COLUMNS.iter().map(|(name, _)| (*name, "f8")).collect();
        let array = numpy.call_method1("empty", (track.samples.len(), types))?;
        for (name, value) in COLUMNS {
            array.set_item(name, PyArray1::from_iter(py, track.samples.iter().map(value)))?;
        }
        arrays.set_item(&track.object, array)?;
    }
    Ok(arrays)
}
