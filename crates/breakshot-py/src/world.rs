//! A pile ready to be struck many times.

use crate::arguments::Arg;
use crate::error::{invalid, raised};
use crate::stages::noise;
use crate::values::{Properties, Scene};
use breakshot::geometry::Pose;
use breakshot::physics::{self, AfterStrike};
use breakshot::plan::{ExecutionNoise, Scenario, Scenarios};
use breakshot::scene::{GoalEvaluator, GoalMargin};
use breakshot::{properties, scene};
use numpy::ndarray::{ArrayD, Axis};
use numpy::{IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::borrow::Cow;
use std::sync::Arc;

/// What a world was made from.
pub(crate) struct Source {
    scene: Arc<scene::Scene>,
    properties: Arc<properties::Properties>,
    noise: ExecutionNoise,
    lift: bool,
    scenarios: Scenarios,
}

/// Which of the scenarios a row of a rollout is simulated in.
enum Choice {
    /// The properties at their means, the objects where they were seen, every strike as commanded.
    Mean,
    /// Another one for every row.
    EachRow,
    /// One draw of this seed, for all rows.
    Drawn { seed: u64, number: u64, scenario: Box<Scenario> },
}

/// A scene and its properties, checked once and ready to be struck many times.
///
/// `World(scene, properties)` has the properties at their means.  With `uncertain=True` every row of a rollout is another
/// scenario: friction, restitution, masses and contacts from their uncertainty, poses and the executed strike with the noise given.
#[pyclass(frozen, module = "breakshot")]
pub(crate) struct World {
    source: Arc<Source>,
    choice: Choice,
}

#[pymethods]
impl World {
    #[new]
    #[pyo3(signature = (scene, properties, *, uncertain = false, after_strike = "retract", position_std_m = None,
        yaw_std_rad = None, speed_std = None, heading_std_rad = None))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python,
        scene: Arg<scene::Scene>,
        properties: Arg<properties::Properties>,
        uncertain: bool,
        after_strike: &str,
        position_std_m: Option<f64>,
        yaw_std_rad: Option<f64>,
        speed_std: Option<f64>,
        heading_std_rad: Option<f64>,
    ) -> PyResult<Self> {
        let lift = match after_strike {
            "retract" => false,
            "lift" => true,
            other => {
                let found = format!("`{other}`");
                return Err(invalid("World", "after_strike", found, "`retract` or `lift`"));
            }
        };
        let noise = noise(position_std_m, yaw_std_rad, speed_std, heading_std_rad);
        let (scene, properties) = (scene.0, properties.0);
        let scenarios = py.detach(|| {
            let mut laws = breakshot::plan::laws(&scene)?;
            if lift {
                laws.after_strike = AfterStrike::Lift;
            }
            Scenarios::new(&scene, &properties, noise, &laws)
        });
        let source = Source { scene, properties, noise, lift, scenarios: scenarios.map_err(raised)? };
        let choice = if uncertain { Choice::EachRow } else { Choice::Mean };
        Ok(Self { source: Arc::new(source), choice })
    }

    /// The names of the objects, in the order of the scene's placed objects and of the columns of a rollout.
    #[getter]
    fn names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.source.scenarios.mean().names())
    }

    /// The scene.
    #[getter]
    fn scene(&self) -> Scene {
        self.source.scene.clone().into()
    }

    /// The properties.
    #[getter]
    fn properties(&self) -> Properties {
        self.source.properties.clone().into()
    }

    /// Whether every row of a rollout is another scenario.
    #[getter]
    fn uncertain(&self) -> bool {
        matches!(self.choice, Choice::EachRow)
    }

    /// Scenarios: `n` draws, each with its own error of execution.
    ///
    /// Draw `k` depends on `(seed, k)` alone; it is the world of row `k` of a rollout with this seed in an uncertain world.
    #[pyo3(signature = (n, seed = 0))]
    fn sample(&self, py: Python, n: usize, seed: u64) -> PyResult<Vec<Self>> {
        /// Some hundred megabytes.
        const MOST_WORLDS: usize = 100_000;
        if n > MOST_WORLDS {
            return Err(invalid("sample", "n", n, &format!("at most {MOST_WORLDS}")));
        }
        (0..n as u64)
            .map(|number| {
                py.check_signals()?;
                Self::drawn(self.source.clone(), seed, number)
            })
            .collect()
    }

    /// How clearly poses fulfil the goal of the scene: `(margin_m, singulated)`.
    ///
    /// `poses` has the shape `(..., objects, 3)`, `fallen` (booleans) `(..., objects)`.  The margin (m) is the slack of the tightest
    /// condition, negative where the goal is missed; `singulated` counts the objects that are free of all others.  Poses that are not
    /// numbers fulfil nothing.
    #[pyo3(signature = (poses, fallen = None))]
    #[allow(clippy::type_complexity, reason = "a pair of arrays")]
    fn goal<'py>(
        &self,
        py: Python<'py>,
        poses: &Bound<'py, PyAny>,
        fallen: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<i64>>)> {
        let objects = self.objects();
        let (poses, shape) = shaped(poses)?;
        let needed = format!("(..., {objects}, 3)");
        let [rows @ .., count, 3] = &shape[..] else {
            return Err(invalid("goal", "the shape of poses", format!("{shape:?}"), &needed));
        };
        if *count != objects {
            return Err(invalid("goal", "the shape of poses", format!("{shape:?}"), &needed));
        }
        let fallen = fallen.map(shaped).transpose()?;
        if let Some((_, fallen)) = &fallen
            && fallen[..] != shape[..shape.len() - 1]
        {
            let needed = "that of poses without its last axis";
            return Err(invalid("goal", "the shape of fallen", format!("{fallen:?}"), needed));
        }
        let poses = numbers::<f64>(&poses, "float64")?;
        let fallen = fallen.map(|(fallen, _)| numbers::<bool>(&fallen, "bool")).transpose()?;
        let evaluator = GoalEvaluator::new(&self.source.scene).map_err(raised)?;
        let (mut margins, mut singulated) = (Vec::new(), Vec::new());
        let fallen = fallen.as_ref().map(PyReadonlyArrayDyn::as_array);
        let mut all_fallen =
            fallen.iter().flat_map(|fallen| fallen.lanes(Axis(rows.len()))).map(|lane| lane.to_vec());
        let all: Vec<f64> = poses.as_array().iter().copied().collect();
        for row in all.chunks_exact((3 * objects).max(1)) {
            let fallen = all_fallen.next().unwrap_or_default();
            let poses: Vec<Pose> = row.chunks_exact(3).map(|p| Pose::new(p[0], p[1], p[2])).collect();
            let finite = row.iter().all(|number| number.is_finite());
            let margin = if finite { evaluator.margin(&poses, &fallen) } else { GoalMargin::FAILED };
            margins.push(margin.margin_m);
            singulated.push(i64::try_from(margin.singulated).unwrap_or(i64::MAX));
        }
        let margins = ArrayD::from_shape_vec(rows, margins).map_err(crate::error::internal)?;
        let singulated = ArrayD::from_shape_vec(rows, singulated).map_err(crate::error::internal)?;
        Ok((margins.into_pyarray(py), singulated.into_pyarray(py)))
    }

    fn __repr__(&self) -> String {
        let names = self.source.scenarios.mean().names().join(", ");
        match &self.choice {
            Choice::Mean => format!("World({names})"),
            Choice::EachRow => format!("World({names}; uncertain)"),
            Choice::Drawn { seed, number, .. } => format!("World({names}; draw {number} of seed {seed})"),
        }
    }

    fn __copy__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, world) = (slf.py(), slf.get());
        let Source { noise, lift, .. } = &*world.source;
        let keywords = PyDict::new(py);
        keywords.set_item("uncertain", world.uncertain())?;
        keywords.set_item("after_strike", if *lift { "lift" } else { "retract" })?;
        keywords.set_item("position_std_m", noise.position_m)?;
        keywords.set_item("yaw_std_rad", noise.yaw_rad)?;
        keywords.set_item("speed_std", noise.speed)?;
        keywords.set_item("heading_std_rad", noise.heading_rad)?;
        let draw = match world.choice {
            Choice::Drawn { seed, number, .. } => Some((seed, number)),
            Choice::Mean | Choice::EachRow => None,
        };
        let arguments = (world.scene(), world.properties(), keywords, draw);
        (slf.get_type().getattr("_restored")?, arguments).into_pyobject(py)
    }

    /// The world of a pickle.
    #[staticmethod]
    fn _restored<'py>(
        scene: Bound<'py, PyAny>,
        properties: Bound<'py, PyAny>,
        keywords: Bound<'py, PyDict>,
        draw: Option<(u64, u64)>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = scene.py();
        let world = py.get_type::<Self>().call((scene, properties), Some(&keywords))?;
        let Some((seed, number)) = draw else { return Ok(world) };
        let source = world.cast::<Self>()?.get().source.clone();
        Ok(Bound::new(py, Self::drawn(source, seed, number)?)?.into_any())
    }
}

impl World {
    fn drawn(source: Arc<Source>, seed: u64, number: u64) -> PyResult<Self> {
        let scenario = Box::new(source.scenarios.draw(seed, number).map_err(raised)?);
        Ok(Self { source, choice: Choice::Drawn { seed, number, scenario } })
    }

    /// The number of objects.
    pub(crate) fn objects(&self) -> usize {
        self.source.scenarios.mean().names().len()
    }

    /// Simulates row `row` of a rollout; `None` where the strike cannot start in this world.
    pub(crate) fn outcome(
        &self,
        simulator: &mut physics::Simulator,
        strike: &scene::Strike,
        [seed, row]: [u64; 2],
    ) -> Option<physics::Outcome> {
        let drawn;
        let (world, strike) = match &self.choice {
            Choice::Mean => (self.source.scenarios.mean(), Cow::Borrowed(strike)),
            Choice::Drawn { scenario, .. } => (&scenario.world, Cow::Owned(scenario.executed(strike))),
            Choice::EachRow => {
                drawn = self.source.scenarios.draw(seed, row).ok()?;
                (&drawn.world, Cow::Owned(drawn.executed(strike)))
            }
        };
        simulator.run(world, &strike).ok()
    }
}

/// An array of an argument, and its shape; the numbers are not converted yet.
fn shaped<'py>(object: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyAny>, Vec<usize>)> {
    let array = object.py().import("numpy")?.call_method1("asarray", (object,))?;
    let shape = array.getattr("shape")?.extract()?;
    Ok((array, shape))
}

/// The numbers of an array as numbers of this type.
fn numbers<'py, T: numpy::Element>(
    array: &Bound<'py, PyAny>,
    dtype: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let array = array.py().import("numpy")?.call_method1("require", (array, dtype, "A"))?;
    let array = array.cast_into::<PyArrayDyn<T>>()?;
    array.try_readonly().map_err(crate::error::internal)
}
