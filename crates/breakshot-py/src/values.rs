//! The library's values as Python classes: named fields, text, pickle, equality.
//!
//! The fields of a value are those of its JSON, the same as in the files that the program writes.  A class holds the library's value
//! itself; its fields are made when the first of them is read.

use crate::arguments::{Arg, fields_of, json_of, reconstructed};
use crate::error::{invalid, raised};
use crate::held::Held;
use breakshot::{Error as LibraryError, Result};
use breakshot::{files, report, robot};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyTuple};
use std::sync::Arc;

/// Checks the cell, and reads the URDF of its arm again, which JSON only names.
fn checked_cell(mut cell: breakshot::cell::Cell, name: &str) -> Result<breakshot::cell::Cell> {
    cell.check(name)?;
    if let Some(robot) = &mut cell.robot {
        files::load_arm(robot)?;
    }
    Ok(cell)
}

/// Checks every object, which moves the origins of polygons to their centroids, and the rest of the scene.
fn checked_scene(mut scene: breakshot::scene::Scene) -> Result<breakshot::scene::Scene> {
    scene.cell = checked_cell(scene.cell, "Scene: cell")?;
    for object in &mut scene.objects {
        object.check()?;
    }
    scene.check("Scene")?;
    Ok(scene)
}

/// A class that holds a value of the library; further methods follow in braces.
macro_rules! class {
    ($(#[$doc:meta])* $name:ident($value:ty), checked = $checked:expr, { $($methods:tt)* }) => {
        $(#[$doc])*
        #[pyclass(frozen, module = "breakshot")]
        pub(crate) struct $name {
            pub(crate) value: Arc<$value>,
            fields: PyOnceLock<Py<PyAny>>,
        }

        impl From<Arc<$value>> for $name {
            fn from(value: Arc<$value>) -> Self {
                Self { value, fields: PyOnceLock::new() }
            }
        }

        impl From<$value> for $name {
            fn from(value: $value) -> Self {
                Arc::new(value).into()
            }
        }

        impl Held for $value {
            const NAME: &'static str = stringify!($name);

            fn held_by(object: &Bound<'_, PyAny>) -> Option<Arc<Self>> {
                object.cast::<$name>().ok().map(|object| object.get().value.clone())
            }

            fn checked(self) -> Result<Self> {
                let checked: fn(Self) -> Result<Self> = $checked;
                checked(self)
            }
        }

        #[pymethods]
        impl $name {
            /// The value of JSON text, as `to_json` gives it.
            ///
            /// Raises `Error` for an unknown or missing field and for impossible values.
            #[staticmethod]
            fn from_json(text: &str) -> PyResult<Self> {
                <$value>::from_text(text).map(Self::from)
            }

            /// The value as JSON text: the text of the file that the program writes.
            fn to_json(&self) -> PyResult<String> {
                json_of(&*self.value)
            }

            /// The same value with other fields, which are given by name.
            ///
            /// Raises `Error` for an unknown field and for impossible values.
            #[pyo3(signature = (**fields))]
            fn replace(&self, py: Python, fields: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
                let text = reconstructed(py, &self.to_json()?, fields)?;
                let value = Self::from(<$value>::from_text(&text)?);
                check_taken(value.fields(py)?, fields, stringify!($name))?;
                Ok(value)
            }

            fn __getattr__(&self, py: Python, name: &str) -> PyResult<Py<PyAny>> {
                if name.starts_with('_') {
                    let message = format!("`{}` has no attribute `{name}`", stringify!($name));
                    return Err(PyAttributeError::new_err(message));
                }
                Ok(self.fields(py)?.getattr(name)?.unbind())
            }

            fn __dir__<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<Bound<'py, PyAny>>> {
                let mut names: Vec<_> = slf.get_type().dir()?.iter().collect();
                names.extend(slf.get().fields(slf.py())?.dir()?.iter());
                Ok(names)
            }

            fn __repr__(&self, py: Python) -> PyResult<String> {
                self.fields(py)?.call_method1("_shown_as", (stringify!($name),))?.extract()
            }

            fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
                <$value as Held>::held_by(other).is_some_and(|other| self.value == other)
            }

            fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
                slf
            }

            fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
                slf
            }

            fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
                let read = slf.get_type().getattr("from_json")?;
                let text = (slf.get().to_json()?,);
                (read, text).into_pyobject(slf.py())
            }

            $($methods)*
        }

        impl $name {
            /// The fields as a `breakshot.Record`.
            fn fields<'py>(&self, py: Python<'py>) -> PyResult<&Bound<'py, PyAny>> {
                let made = self.fields.get_or_try_init(py, || fields_of(py, &self.to_json()?))?;
                Ok(made.bind(py))
            }
        }
    };
}

class! {
    /// A robot cell: camera, tags, workspace, table, striker and arm (`cell.toml`).
    Cell(breakshot::cell::Cell),
    checked = |cell| checked_cell(cell, "Cell"),
    {}
}

class! {
    /// A kind of object: outline, height, marker, mass (`objects.toml`).
    Object(breakshot::object::Object),
    checked = |mut object| {
        object.check()?;
        Ok(object)
    },
    {}
}

class! {
    /// A pile on the table of a cell, and the goal (`scene.toml`).
    ///
    /// Positions are in the table frame: x to the right, y up in the camera's image, metres; yaws in radians, counter-clockwise.
    Scene(breakshot::scene::Scene),
    checked = checked_scene,
    {
        /// The robot cell.
        #[getter]
        fn cell(&self) -> Cell {
            self.value.cell.clone().into()
        }

        /// The pile from above, as notebooks show it.
        fn _repr_svg_(&self) -> String {
            report::scene_figure(&self.value)
        }
    }
}

class! {
    /// A straight motion of the striker: start (m), heading (rad), speed (m/s) and travel (m) in the table frame.
    Strike(breakshot::scene::Strike),
    checked = |strike| {
        strike.check("Strike")?;
        Ok(strike)
    },
    {
        #[new]
        #[pyo3(signature = (start_m, heading_rad, speed_m_s, travel_m, object = None))]
        fn new(
            start_m: [f64; 2],
            heading_rad: f64,
            speed_m_s: f64,
            travel_m: f64,
            object: Option<String>,
        ) -> PyResult<Self> {
            let start_m = start_m.into();
            let strike = breakshot::scene::Strike { object, start_m, heading_rad, speed_m_s, travel_m };
            Ok(strike.checked().map_err(raised)?.into())
        }
    }
}

class! {
    /// Friction, restitution and mass ratios of objects and pairs, with intervals and covariance (`properties.json`).
    Properties(breakshot::properties::Properties),
    checked = |properties| {
        properties.check("Properties")?;
        Ok(properties)
    },
    {
        /// Drawn properties: `n` draws from the uncertainty of the means and the variation from strike to strike.
        ///
        /// Each draw is exact: its values have no uncertainty of their own.  Draw `k` depends on `(seed, k)` alone.
        #[pyo3(signature = (n, seed = 0))]
        fn sample(&self, n: usize, seed: u64) -> PyResult<Vec<Self>> {
            /// Some hundred megabytes.
            const MOST_SAMPLES: usize = 100_000;
            if n > MOST_SAMPLES {
                let needed = format!("at most {MOST_SAMPLES}");
                return Err(invalid("sample", "n", n, &needed));
            }
            let drawn = breakshot::plan::drawn_properties(&self.value, n, seed);
            Ok(drawn.into_iter().map(Self::from).collect())
        }

        /// Friction, restitution and mass ratios with their intervals, as notebooks show them; `None` if there are none.
        fn _repr_html_(&self) -> Option<String> {
            report::property_pictures(&self.value).ok()
        }
    }
}

class! {
    /// Positions and yaws of the objects of one film over time.
    Tracks(breakshot::detect::Tracks),
    checked = Ok,
    {
        /// The samples of every object: a dictionary from its name to a structured array of shape `(samples,)`.
        ///
        /// Its columns are `time_s`, `x_m`, `y_m` (table frame), `yaw_rad` (continuous), `vx_m_s`, `vy_m_s`, `yaw_rate_rad_s`,
        /// `ax_m_s2`, `ay_m_s2` and `std_m`; what was not measured is NaN.
        fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
            crate::arguments::track_arrays(py, &self.value)
        }

        /// Distance, speed and acceleration over time, as notebooks show them; `None` without a sample.
        fn _repr_svg_(&self) -> Option<String> {
            report::motion_figure(&self.value).ok()
        }
    }
}

class! {
    /// What happens during a strike: final poses, events, exact motions, energies (`trajectory.json`).
    Trajectory(breakshot::physics::Trajectory),
    checked = Ok,
    {
        /// The pose `(x_m, y_m, yaw_rad)` of an object, or of `striker`, `time_s` seconds after the striker starts.
        fn pose(&self, object: &str, time_s: f64) -> PyResult<(f64, f64, f64)> {
            let pose = self.value.pose(object, time_s).filter(|_| time_s.is_finite());
            let pose = pose.ok_or_else(|| {
                let found = format!("`{object}` at {time_s} s");
                invalid("pose", "the object", found, "an object of the trajectory, at a time that is a number")
            })?;
            Ok((pose.position.x, pose.position.y, pose.yaw_rad))
        }
    }
}

class! {
    /// A planned strike with its prediction, or the reason why there is none (`plan.json`).
    Plan(breakshot::plan::Plan),
    checked = Ok,
    {
        /// The scene that was planned for.
        #[getter]
        fn scene(&self) -> Scene {
            self.value.scene.clone().into()
        }

        /// The strike; `None` where none is needed or possible.
        #[getter]
        fn strike(&self) -> Option<Strike> {
            self.value.strike.clone().map(Strike::from)
        }

        /// The pile, the strike and the final poses, as notebooks show them.
        fn _repr_svg_(&self) -> String {
            report::plan_figure(&self.value)
        }
    }
}

class! {
    /// Strikes on every object from all directions with their success probabilities.
    Survey(breakshot::plan::Survey),
    checked = Ok,
    {}
}

class! {
    /// A filmed strike beside its prediction (`report.json`).
    Report(breakshot::verify::Report),
    checked = Ok,
    {}
}

class! {
    /// The joint path of a strike, checked against the limits of the arm (`command.json`).
    Command(robot::Command),
    checked = |command| {
        command.check()?;
        Ok(command)
    },
    {
        /// The hash that permits the motion, as `breakshot strike --hash` takes it.
        fn short_hash(&self) -> String {
            self.value.short_hash()
        }
    }
}

class! {
    /// Why the arm cannot carry a strike out: the limit, the part of the arm, the fastest possible speed.
    Refusal(robot::Refusal),
    checked = Ok,
    {}
}

/// An error for the first given field that the value does not have.
fn check_taken(value: &Bound<'_, PyAny>, given: Option<&Bound<'_, PyDict>>, class: &str) -> PyResult<()> {
    for (field, content) in given.into_iter().flatten() {
        if !content.is_none() && !value.contains(&field)? {
            let known: Vec<String> =
                value.try_iter()?.map(|name| name?.extract()).collect::<PyResult<_>>()?;
            let needed = format!("one of {}", known.join(", "));
            return Err(invalid(class, "the field", format!("`{field}`"), &needed));
        }
    }
    Ok(())
}

/// The strike of a strike or of a plan.
pub(crate) fn strike_of(object: &Bound<'_, PyAny>) -> PyResult<Arc<breakshot::scene::Strike>> {
    let Some(plan) = breakshot::plan::Plan::held_by(object) else {
        return Ok(object.extract::<Arg<breakshot::scene::Strike>>()?.0);
    };
    let missing = || LibraryError::invalid("plan", "strike", "None", "a plan with a strike");
    plan.strike.clone().map(Arc::new).ok_or_else(|| raised(missing()))
}
