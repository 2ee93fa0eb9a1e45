//! Many strikes into arrays, on several threads.

use crate::error::{internal, invalid, raised};
use crate::work::{MOST_THREADS, SIGNAL_PERIOD, Stop, check_signals, pool};
use crate::world::World;
use breakshot::geometry::Point;
use breakshot::physics::{Outcome, Simulator};
use breakshot::scene::Strike;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use rayon::ThreadPool;
use rayon::prelude::*;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::Instant;

/// Numbers of a strike in an array: start x, start y, heading, speed, travel.
const STRIKE_NUMBERS: usize = 5;
/// The most rows that a thread simulates before it takes others.
const MOST_ROWS_A_JOB: usize = 256;
/// Jobs of a thread: so many that all threads end at about the same time.
const JOBS_A_THREAD: usize = 64;
/// Rows after which a thread that simulates alone looks at the clock; the slowest take some ten milliseconds each.
const ROWS_A_LOOK: usize = 2;
/// Fewer rows are not worth waking threads for.
const LEAST_ROWS_FOR_THREADS: usize = 4;
/// The most rows of one call; more are further calls.
pub(crate) const MOST_ROWS: usize = 100_000_000;

/// Worlds and strikes by row.
struct Rows<'a> {
    /// Length of each axis.
    shape: Vec<usize>,
    worlds: Vec<&'a World>,
    /// Index of the world of each row.
    world_of: Operand<'a, i64>,
    /// Five numbers for each strike.
    strikes: Operand<'a, f64>,
    seed: u64,
}

/// An array that is broadcast to the shape of the rows.
struct Operand<'a, T> {
    numbers: &'a [T],
    /// How many entries later the next one along each axis of the rows is; zero where the same one is used again.
    steps: Vec<usize>,
}

impl<'a, T> Operand<'a, T> {
    /// A contiguous array of this shape for rows of another one.
    fn new(numbers: &'a [T], own: &[usize], shape: &[usize]) -> PyResult<Self> {
        let fits = own.len() <= shape.len();
        let mut steps = vec![0; shape.len()];
        let mut entries = 1;
        for ((step, length), axis) in steps.iter_mut().zip(shape).rev().zip(own.iter().rev()) {
            if axis == length {
                *step = entries;
            } else if *axis != 1 {
                return Err(internal("an array that does not fit the rows of the rollout"));
            }
            entries *= axis;
        }
        if fits {
            Ok(Self { numbers, steps })
        } else {
            Err(internal("an array of more axes than the rows have"))
        }
    }
}

impl Rows<'_> {
    /// Simulates one row; `None` where the strike cannot start in its world.
    fn outcome(&self, simulator: &mut Simulator, row: usize) -> Option<Outcome> {
        let (mut world, mut first, mut rest) = (0, 0, row);
        for (axis, length) in self.shape.iter().enumerate().rev() {
            world += rest % length * self.world_of.steps[axis];
            first += rest % length * self.strikes.steps[axis];
            rest /= length;
        }
        let world = self.worlds[usize::try_from(self.world_of.numbers[world]).ok()?];
        let strike = strike(std::array::from_fn(|k| self.strikes.numbers[STRIKE_NUMBERS * first + k]));
        world.outcome(simulator, &strike, [self.seed, row as u64])
    }
}

/// The strike of five numbers.
fn strike([x_m, y_m, heading_rad, speed_m_s, travel_m]: [f64; STRIKE_NUMBERS]) -> Strike {
    Strike { object: None, start_m: Point::new(x_m, y_m), heading_rad, speed_m_s, travel_m }
}

/// The arrays of some successive rows.
struct Outputs<'a> {
    first_row: usize,
    /// Objects of a row; worlds of fewer objects leave the last ones NaN.
    objects: usize,
    poses: &'a mut [f64],
    fallen: &'a mut [bool],
    impacts: &'a mut [i64],
    energy: &'a mut [f64],
    duration_s: &'a mut [f64],
    complete: &'a mut [bool],
}

impl<'a> Outputs<'a> {
    fn rows(&self) -> usize {
        self.complete.len()
    }

    /// The first `rows` rows, and the others.
    fn split(self, rows: usize) -> (Self, Self) {
        let objects = self.objects;
        let (poses, more_poses) = self.poses.split_at_mut(3 * objects * rows);
        let (fallen, more_fallen) = self.fallen.split_at_mut(objects * rows);
        let (impacts, more_impacts) = self.impacts.split_at_mut(rows);
        let (energy, more_energy) = self.energy.split_at_mut(rows);
        let (duration_s, more_duration_s) = self.duration_s.split_at_mut(rows);
        let (complete, more_complete) = self.complete.split_at_mut(rows);
        let first =
            Self { first_row: self.first_row, objects, poses, fallen, impacts, energy, duration_s, complete };
        let others = Self {
            first_row: self.first_row + rows,
            objects,
            poses: more_poses,
            fallen: more_fallen,
            impacts: more_impacts,
            energy: more_energy,
            duration_s: more_duration_s,
            complete: more_complete,
        };
        (first, others)
    }

    /// Jobs of at most so many rows.
    fn jobs(self, rows_a_job: usize) -> Vec<Outputs<'a>> {
        let (mut jobs, mut rest) = (Vec::new(), self);
        while rest.rows() > 0 {
            let rows = rows_a_job.min(rest.rows());
            let (job, others) = rest.split(rows);
            jobs.push(job);
            rest = others;
        }
        jobs
    }

    /// Writes a row, counted from the first one.
    fn write(&mut self, row: usize, outcome: Option<&Outcome>) {
        let objects = self.objects;
        let poses = &mut self.poses[3 * objects * row..3 * objects * (row + 1)];
        let fallen = &mut self.fallen[objects * row..objects * (row + 1)];
        poses.fill(f64::NAN);
        fallen.fill(false);
        let none = Outcome { striker_work_j: f64::NAN, duration_s: f64::NAN, ..Outcome::default() };
        let outcome = outcome.unwrap_or(&none);
        for (to, pose) in poses.chunks_exact_mut(3).zip(&outcome.poses) {
            to.copy_from_slice(&[pose.position.x, pose.position.y, pose.yaw_rad]);
        }
        for (to, fell) in fallen.iter_mut().zip(&outcome.fallen) {
            *to = *fell;
        }
        self.impacts[row] = i64::try_from(outcome.impacts).unwrap_or(i64::MAX);
        self.energy[row] = outcome.striker_work_j;
        self.duration_s[row] = outcome.duration_s;
        self.complete[row] = outcome.complete;
    }
}

/// Arrays of one axis: poses, fallen, impacts, energy, duration, complete.
type Arrays<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
);

/// Simulates every row of a shape into arrays of one axis.
///
/// `world_of` holds an index of `worlds` for every row, `strikes` five numbers on its last axis; both are contiguous, and broadcast to
/// the shape.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "the arrays of a rollout")]
pub(crate) fn rollout<'py>(
    py: Python<'py>,
    worlds: Vec<Bound<'py, World>>,
    world_of: PyReadonlyArrayDyn<'py, i64>,
    strikes: PyReadonlyArrayDyn<'py, f64>,
    shape: Vec<usize>,
    outputs: Arrays<'py>,
    seed: u64,
    threads: Option<usize>,
) -> PyResult<()> {
    if threads.is_some_and(|threads| !(1..=MOST_THREADS).contains(&threads)) {
        let needed = format!("from 1 to {MOST_THREADS}, or None");
        return Err(invalid("rollout", "threads", threads.unwrap_or_default(), &needed));
    }
    let strike_shape = strikes.shape().to_vec();
    let Some((&STRIKE_NUMBERS, strike_shape)) = strike_shape.split_last() else {
        return Err(internal("strikes of another number of numbers than five"));
    };
    let numbers = strikes.as_slice().map_err(internal)?;
    check_strikes(numbers)?;
    let rows = Rows {
        worlds: worlds.iter().map(Bound::get).collect(),
        world_of: Operand::new(world_of.as_slice().map_err(internal)?, world_of.shape(), &shape)?,
        strikes: Operand::new(numbers, strike_shape, &shape)?,
        seed,
        shape,
    };
    if rows.world_of.numbers.iter().any(|&k| usize::try_from(k).map_or(true, |k| k >= rows.worlds.len())) {
        return Err(internal("an index of a world that is not there"));
    }
    let (poses, fallen, impacts, energy, duration_s, complete) = &outputs;
    let (mut poses, mut fallen) = (writable(poses)?, writable(fallen)?);
    let (mut impacts, mut energy) = (writable(impacts)?, writable(energy)?);
    let (mut duration_s, mut complete) = (writable(duration_s)?, writable(complete)?);
    let outputs = Outputs {
        first_row: 0,
        objects: rows.worlds.iter().map(|world| world.objects()).max().unwrap_or(0),
        poses: poses.as_slice_mut().map_err(internal)?,
        fallen: fallen.as_slice_mut().map_err(internal)?,
        impacts: impacts.as_slice_mut().map_err(internal)?,
        energy: energy.as_slice_mut().map_err(internal)?,
        duration_s: duration_s.as_slice_mut().map_err(internal)?,
        complete: complete.as_slice_mut().map_err(internal)?,
    };
    check_lengths(&rows.shape, &outputs)?;
    if threads == Some(1) || outputs.rows() < LEAST_ROWS_FOR_THREADS {
        return py.detach(|| on_this_thread(&rows, outputs));
    }
    let pool = pool(py, threads)?;
    py.detach(|| on_threads(&pool, &rows, outputs))
}

/// An error that names the first strike that no striker can carry out.
fn check_strikes(numbers: &[f64]) -> PyResult<()> {
    for (k, numbers) in numbers.chunks_exact(STRIKE_NUMBERS).enumerate() {
        let strike = strike(std::array::from_fn(|i| numbers[i]));
        // The name of the strike is made for an error alone.
        if strike.check("strikes").is_err() {
            strike.check(&format!("strikes[{k}]")).map_err(raised)?;
        }
    }
    Ok(())
}

/// The array for writing.
fn writable<'py, T: numpy::Element>(
    array: &Bound<'py, PyArray1<T>>,
) -> PyResult<numpy::PyReadwriteArray1<'py, T>> {
    array
        .try_readwrite()
        .map_err(|error| invalid("rollout", "out", error, "writable arrays that nothing else uses"))
}

fn check_lengths(shape: &[usize], outputs: &Outputs) -> PyResult<()> {
    let rows: usize = shape.iter().product();
    let Outputs { objects, poses, fallen, impacts, energy, duration_s, complete, .. } = outputs;
    let lengths = [impacts.len(), energy.len(), duration_s.len(), complete.len()];
    if poses.len() != 3 * objects * rows || fallen.len() != objects * rows || lengths != [rows; 4] {
        return Err(internal("arrays of another length than the rows of the rollout"));
    }
    Ok(())
}

/// Simulates all rows on the thread of the caller; Ctrl-C ends it.
fn on_this_thread(rows: &Rows, mut outputs: Outputs) -> PyResult<()> {
    let (mut simulator, mut looked) = (Simulator::new(), Instant::now());
    for row in 0..outputs.rows() {
        outputs.write(row, rows.outcome(&mut simulator, row).as_ref());
        if row % ROWS_A_LOOK == 0 && looked.elapsed() > SIGNAL_PERIOD {
            check_signals()?;
            looked = Instant::now();
        }
    }
    Ok(())
}

/// Simulates all rows on the threads of the pool, while the thread of the caller looks for Ctrl-C.
fn on_threads(pool: &ThreadPool, rows: &Rows, outputs: Outputs) -> PyResult<()> {
    let jobs = pool.current_num_threads() * JOBS_A_THREAD;
    let rows_a_job = outputs.rows().div_ceil(jobs).clamp(1, MOST_ROWS_A_JOB);
    let (jobs, stop, done) = (outputs.jobs(rows_a_job), Stop::default(), Done::default());
    pool.in_place_scope(|scope| {
        scope.spawn(|_| {
            let _at_the_end = done.at_the_end();
            jobs.into_par_iter().for_each_init(Simulator::new, |simulator, mut job| {
                for row in 0..job.rows() {
                    if stop.is_set() {
                        return;
                    }
                    let outcome = rows.outcome(simulator, job.first_row + row);
                    job.write(row, outcome.as_ref());
                }
            });
        });
        while !done.is_within(SIGNAL_PERIOD) {
            check_signals().inspect_err(|_| stop.set())?;
        }
        Ok(())
    })
}

/// Whether work has ended, for a caller that waits.
#[derive(Default)]
struct Done {
    ended: Mutex<bool>,
    changed: Condvar,
}

impl Done {
    /// Says so when it is dropped, also after a panic.
    fn at_the_end(&self) -> impl Drop + '_ {
        struct AtTheEnd<'a>(&'a Done);
        impl Drop for AtTheEnd<'_> {
            fn drop(&mut self) {
                *self.0.ended.lock().unwrap_or_else(PoisonError::into_inner) = true;
                self.0.changed.notify_all();
            }
        }
        AtTheEnd(self)
    }

    /// Whether the work ends within a time.
    fn is_within(&self, time: std::time::Duration) -> bool {
        let ended = self.ended.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(ended, time, |ended| !*ended);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}
