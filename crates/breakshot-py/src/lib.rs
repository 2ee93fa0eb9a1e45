//! The Python module `breakshot._breakshot`: the library's stages as functions, its values as classes.
//!
//! `values` are the classes, `stages` the functions, `world` and `rollouts` the simulator behind `breakshot.Simulator`.  `work` runs
//! what takes long: without the interpreter's lock, in threads of this module, until Ctrl-C.  What Python users see of it is in
//! `python/breakshot`.

mod arguments;
mod error;
mod held;
mod rollouts;
mod stages;
mod values;
mod work;
mod world;

/// What `breakshot/__init__.py` re-exports.
#[pyo3::pymodule]
mod _breakshot {
    #[pymodule_export]
    use crate::error::Error;
    #[pymodule_export]
    use crate::rollouts::rollout;
    #[pymodule_export]
    use crate::stages::{
        command, estimate, load_cell, load_objects, load_properties, load_scene, load_strike, plan, simulate,
        survey, track, verify,
    };
    #[pymodule_export]
    use crate::values::{
        Cell, Command, Object, Plan, Properties, Refusal, Report, Scene, Strike, Survey, Tracks, Trajectory,
    };
    #[pymodule_export]
    use crate::world::World;

    #[pymodule_init]
    fn init(module: &pyo3::Bound<'_, pyo3::types::PyModule>) -> pyo3::PyResult<()> {
        use pyo3::types::PyModuleMethods;
        crate::error::quiet_decoder_panics();
        module.add("MOST_ROWS", crate::rollouts::MOST_ROWS)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
