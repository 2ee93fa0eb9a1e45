//! What the classes of values have in common, whatever they hold.

use crate::error::raised;
use breakshot::{Result, files};
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;
use std::sync::Arc;

/// A value of the library that a Python class holds.
pub(crate) trait Held: Serialize + DeserializeOwned + Send + Sync + 'static {
    /// The name of the class.
    const NAME: &'static str;

    /// The value that an object of the class holds.
    fn held_by(object: &Bound<'_, PyAny>) -> Option<Arc<Self>>;

    /// A value that was read from JSON, with the checks of a value that was read from a file.
    fn checked(self) -> Result<Self> {
        Ok(self)
    }

    /// The value of its JSON text.
    fn from_text(text: &str) -> PyResult<Arc<Self>> {
        let value = files::json_of::<Self>(Path::new(Self::NAME), text).and_then(Self::checked);
        value.map(Arc::new).map_err(raised)
    }
}
