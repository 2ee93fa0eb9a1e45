//! Two pucks on an air table, filmed by motion capture: do the simulator's impacts predict what was recorded?
//!
//! Restitution and contact friction are fitted on every second run by name, and the velocity vectors after impact of the
//! others are predicted from those before it.  `breakshot estimate` reads the same tables as `tracks`.  The folder's README describes the columns and the truth.

use super::Program;
use super::row::{self, Row, median};
use breakshot::files;
use breakshot::geometry::{Point, Vec2};
use breakshot::object::Shape;
use breakshot::physics::{ImpactBody, ImpactLaw, PairImpact};
use nalgebra::{Matrix3, Vector3};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Weighed masses: the puck that moves first, the one that rests (kg).
pub(crate) const MASS_KG: [f64; 2] = [0.028_726_2, 0.028_185_2];
/// Radius of both pucks (m); the first one's rubber band makes it a little larger.
pub(crate) const RADIUS_M: f64 = 0.025;
/// The files hold no times: motion capture at 500 Hz.
pub(crate) const STEP_S: f64 = 0.002;

/// The pose of a puck at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) time_s: f64,
    pub(crate) position: Point,
    /// Continuous: without jumps by 2 pi.
    pub(crate) yaw_rad: f64,
}

/// One recorded collision.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Recording {
    pub(crate) name: String,
    file: PathBuf,
    /// The letters of the pucks in the file.
    letters: [char; 2],
    /// The puck that moves first, then the one that rests; lost samples are left out.
    pub(crate) pucks: [Vec<Sample>; 2],
}

/// Every run of a folder, by name.
pub(crate) fn recordings(folder: &Path) -> Result<Vec<Recording>, String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut files: Vec<_> = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "csv"));
    files.sort();
    if files.is_empty() {
        return Err(format!("{}: no runs (*.csv)", folder.display()));
    }
    files.iter().map(|file| recording(file)).collect()
}

fn recording(file: &Path) -> Result<Recording, String> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{}: {e}", file.display()))?;
    let mut pucks = [const { Vec::new() }; 2];
    for (k, line) in text.lines().skip(1).enumerate() {
        let fields: Vec<Option<f64>> = line.split(',').map(|field| field.trim().parse().ok()).collect();
        if fields.len() != 6 {
            return Err(format!("{}: line {} has {} fields, not 6", file.display(), k + 2, fields.len()));
        }
        for (puck, of_puck) in pucks.iter_mut().zip(fields.chunks(3)) {
            if let [Some(x), Some(y), Some(angle)] = *of_puck {
                puck.push(Sample {
                    time_s: k as f64 * STEP_S,
                    position: Point::new(x, y),
                    yaw_rad: unwound(puck.last(), angle),
                });
            }
        }
    }
    if pucks.iter().any(|puck| puck.len() < FEWEST_SAMPLES) {
        return Err(format!("{}: fewer than {FEWEST_SAMPLES} samples of a puck", file.display()));
    }
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut recording = Recording { name, file: file.into(), letters: ['a', 'b'], pucks };
    // The names `a` and `b` do not specify it: the first puck is the one that moves farther just before the impact.
    let hit_s = nearest_s(&recording);
    let distance_m = |puck: &Vec<Sample>| {
        let mut before = puck.iter().filter(|s| (hit_s - WINDOW_S..hit_s - CONTACT_S).contains(&s.time_s));
        let first = before.next();
        first.zip(before.next_back()).map_or(0.0, |(first, last)| first.position.distance(last.position))
    };
    if distance_m(&recording.pucks[0]) < distance_m(&recording.pucks[1]) {
        recording.pucks.swap(0, 1);
        recording.letters.swap(0, 1);
    }
    Ok(recording)
}

/// A shorter recording has too few samples for a velocity on either side of the impact.
const FEWEST_SAMPLES: usize = 100;

/// The angle, modulo 2 pi, that is nearest to the last one (rad).
fn unwound(last: Option<&Sample>, angle_rad: f64) -> f64 {
    let revolutions = last.map_or(0.0, |last| ((last.yaw_rad - angle_rad) / std::f64::consts::TAU).round());
    angle_rad + revolutions * std::f64::consts::TAU
}

/// Both pucks just before and just after their impact.
#[derive(Clone, Debug)]
pub(crate) struct Collision {
    pub(crate) before: [ImpactBody; 2],
    pub(crate) after: [ImpactBody; 2],
}

/// Velocities are fitted to samples within this time before and after the impact (s).
const WINDOW_S: f64 = 0.08;
/// Samples this near to the impact are left out: the rubber band yields for some milliseconds.
const CONTACT_S: f64 = 0.004;

/// Velocities at the impact, from quadratic fits on either side of it; the instant is where the fits meet.
pub(crate) fn collision(recording: &Recording) -> Result<Collision, String> {
    let mut time_s = nearest_s(recording);
    let mut fits = [[Fit::default(); 2]; 2];
    for _ in 0..REFINEMENTS {
        let windows = [(time_s - WINDOW_S, time_s - CONTACT_S), (time_s + CONTACT_S, time_s + WINDOW_S)];
        for (side, window) in fits.iter_mut().zip(windows) {
            for (fit, puck) in side.iter_mut().zip(&recording.pucks) {
                *fit = Fit::of(puck, time_s, window).ok_or_else(|| format!("{}: no fit", recording.name))?;
            }
        }
        // Least squares: after - before = gap + jump x time.
        let pairs =
            || fits[0].iter().zip(&fits[1]).map(|(b, a)| (a.position - b.position, a.velocity - b.velocity));
        let (product, square) =
            pairs().fold((0.0, 0.0), |sum, (gap, jump)| (sum.0 + gap.dot(jump), sum.1 + jump.dot(jump)));
        time_s -= (product / square).clamp(-STEP_S, STEP_S);
    }
    let [before, after] = fits.map(|side| {
        let mover = |k: usize| ImpactBody {
            mass_kg: MASS_KG[k],
            gyration_m: Shape::Disc { radius_m: RADIUS_M }.radius_of_gyration_m(),
            position: side[k].position,
            velocity: side[k].velocity,
            yaw_rate_rad_s: side[k].yaw_rate_rad_s,
        };
        [mover(0), mover(1)]
    });
    Ok(Collision { before, after })
}

/// Enough for the instant to settle within a microsecond.
const REFINEMENTS: usize = 6;

/// When the pucks' centres are nearest.
fn nearest_s(recording: &Recording) -> f64 {
    let [a, b] = &recording.pucks;
    let mut nearest = (f64::INFINITY, 0.0);
    let mut k = 0;
    for sample in a {
        while k + 1 < b.len() && b[k].time_s < sample.time_s {
            k += 1;
        }
        let distance_m = sample.position.distance(b[k].position);
        if b[k].time_s == sample.time_s && distance_m < nearest.0 {
            nearest = (distance_m, sample.time_s);
        }
    }
    nearest.1
}

/// Motion at an instant.
#[derive(Clone, Copy, Debug, Default)]
struct Fit {
    position: Point,
    velocity: Vec2,
    yaw_rate_rad_s: f64,
}

impl Fit {
    fn of(puck: &[Sample], at_s: f64, (from_s, to_s): (f64, f64)) -> Option<Self> {
        let inside: Vec<&Sample> = puck.iter().filter(|s| (from_s..=to_s).contains(&s.time_s)).collect();
        let fit =
            |value: &dyn Fn(&Sample) -> f64| parabola(inside.iter().map(|s| (s.time_s - at_s, value(s))));
        let (x, y, yaw) = (fit(&|s| s.position.x)?, fit(&|s| s.position.y)?, fit(&|s| s.yaw_rad)?);
        let (position, velocity) = (Point::new(x[0], y[0]), Vec2::new(x[1], y[1]));
        Some(Self { position, velocity, yaw_rate_rad_s: yaw[1] })
    }
}

/// The coefficients of the parabola nearest to points, the constant first.
fn parabola(points: impl Iterator<Item = (f64, f64)>) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (t, value) in points {
        // In hundredths of a second, so that the squares are of one size.
        let powers = Vector3::new(1.0, t / UNIT_S, (t / UNIT_S).powi(2));
        normal += powers * powers.transpose();
        right += powers * value;
    }
    let solution = normal.cholesky()?.solve(&right);
    Some(Vector3::new(solution[0], solution[1] / UNIT_S, solution[2] / (UNIT_S * UNIT_S)))
}

const UNIT_S: f64 = 0.01;

impl Collision {
    /// Speed of the first puck against the second before the impact (m/s).
    fn approach_m_s(&self) -> f64 {
        (self.before[0].velocity - self.before[1].velocity).length()
    }

    /// Both pucks after the impact as the simulator predicts them.
    fn predicted(&self, restitution: f64, friction: f64) -> Result<[ImpactBody; 2], String> {
        let [a, b] = self.before;
        let between = b.position - a.position;
        let normal_ab = between.direction().ok_or("two pucks at one position")?;
        // The resting puck's rim; what is left of the distance is the other one's radius with its band.
        let point = b.position - normal_ab * RADIUS_M;
        PairImpact {
            point,
            normal_ab,
            restitution,
            friction,
            tangential_restitution: 0.0,
            law: ImpactLaw::Stronge,
        }
        .after(self.before)
        .map_err(|e| e.to_string())
    }

    /// How far the predicted velocities are from the recorded ones, over the approach speed.
    fn errors(&self, restitution: f64, friction: f64) -> Result<[f64; 2], String> {
        let predicted = self.predicted(restitution, friction)?;
        Ok([0, 1].map(|k| (predicted[k].velocity - self.after[k].velocity).length() / self.approach_m_s()))
    }

    /// Slip between the rims after the impact over that before it, with the sign reversed: tangential restitution.
    fn slip_regained(&self) -> f64 {
        let slip = |[a, b]: &[ImpactBody; 2]| {
            let normal = (b.position - a.position).direction().unwrap_or_default();
            let rims = (a.yaw_rate_rad_s + b.yaw_rate_rad_s) * RADIUS_M;
            (a.velocity - b.velocity).dot(normal.perpendicular()) + rims
        };
        -slip(&self.after) / slip(&self.before)
    }
}

fn all_errors(collisions: &[&Collision], restitution: f64, friction: f64) -> Result<Vec<f64>, String> {
    let errors: Result<Vec<[f64; 2]>, String> =
        collisions.iter().map(|c| c.errors(restitution, friction)).collect();
    Ok(errors?.into_iter().flatten().collect())
}

/// Restitution and contact friction with the least mean error: a grid, made finer three times.
fn fitted(collisions: &[&Collision], friction_fitted: bool) -> Result<[f64; 2], String> {
    let (mut best, mut at) = (f64::INFINITY, [0.5, if friction_fitted { 0.5 } else { 0.0 }]);
    for width in [0.5, 0.05, 0.005] {
        let middle = at;
        for i in -10..=10 {
            for k in if friction_fitted { -10..=10 } else { 0..=0 } {
                let restitution = middle[0] + width * f64::from(i) / 10.0;
                let friction = middle[1] + width * f64::from(k) / 10.0;
                if !(0.0..=1.0).contains(&restitution) || friction < 0.0 {
                    continue;
                }
                let errors = all_errors(collisions, restitution, friction)?;
                let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                if mean < best {
                    (best, at) = (mean, [restitution, friction]);
                }
            }
        }
    }
    Ok(at)
}

/// Fits on every second run and predicts the others; returns whether the target holds.
pub(crate) fn run(folder: &Path) -> Result<bool, String> {
    let recordings = recordings(folder)?;
    let estimation_holds = row::print_all("Air table: estimation", &estimated(&recordings)?);
    let collisions: Vec<Collision> = recordings.iter().map(collision).collect::<Result<_, _>>()?;
    let half = |odd: usize| collisions.iter().skip(odd).step_by(2).collect::<Vec<_>>();
    let [[restitution, friction], other] = [fitted(&half(0), true)?, fitted(&half(1), true)?];
    let frictionless = fitted(&half(0), false)?;
    let percent =
        |odd: usize, [e, f]: [f64; 2]| Ok::<_, String>(100.0 * median(all_errors(&half(odd), e, f)?));
    let glancing = collisions.iter().filter(|c| {
        let normal = (c.before[1].position - c.before[0].position).direction().unwrap_or_default();
        c.before[0].velocity.dot(normal) < GLANCING_COSINE * c.before[0].velocity.length()
    });
    let predictions_hold = row::print_all(
        "Air table: velocity vectors after impact, over the approach speed",
        &[
            Row::plain("recorded collisions", collisions.len() as f64, ""),
            Row::plain("restitution fitted on every second run, from the first", restitution, ""),
            Row::plain("contact friction fitted with it", friction, ""),
            Row::at_most(
                "the other runs predicted: median error",
                percent(1, [restitution, friction])?,
                5.5,
                "%",
            ),
            Row::plain("the same with both halves exchanged: median error", percent(0, other)?, "%"),
            Row::plain("without contact friction: median error", percent(1, frictionless)?, "%"),
            Row::plain(
                "slip that springs back, median of glancing impacts",
                median(glancing.map(Collision::slip_regained).collect()),
                "",
            ),
        ],
    );
    Ok(estimation_holds && predictions_hold)
}

/// The puck that moves, and the one that rests.
const PUCKS: [&str; 2] = ["moving", "resting"];

/// Writes a campaign of the recordings' tables for the program: pucks, and no camera, striker or strike.
fn write_campaign(folder: &Path, recordings: &[Recording]) -> Result<PathBuf, String> {
    let puck = |name: &str| {
        format!(
            "[[objects]]\nname = \"{name}\"\nshape = {{ disc = {{ radius_m = {RADIUS_M} }} }}\nheight_m = 0.01\n"
        )
    };
    let mut campaign = String::from("cell = \"cell.toml\"\nobjects = \"objects.toml\"\n");
    for recording in recordings {
        let file = recording.file.canonicalize().map_err(|e| format!("{}: {e}", recording.file.display()))?;
        let columns = [0, 1].map(|k| {
            let (name, letter) = (PUCKS[k], recording.letters[k]);
            format!("{name} = {{ x = \"c_{letter}_x\", y = \"c_{letter}_y\", yaw = \"ang_{letter}\" }}")
        });
        let _ = writeln!(
            campaign,
            "\n[[clips]]\ntracks = '{}'\nframe_rate_hz = {}\nobjects = {PUCKS:?}\ncolumns = {{ objects = {{ {} }} }}",
            file.display(),
            1.0 / STEP_S,
            columns.join(", ")
        );
    }
    let cell = "[workspace]\nmin_m = [-0.5, -0.5]\nmax_m = [0.5, 0.5]\n".to_owned();
    for (name, text) in
        [("cell.toml", cell), ("objects.toml", PUCKS.map(puck).concat()), ("campaign.toml", campaign)]
    {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(folder.join("campaign.toml"))
}

/// Estimates of the program from the recordings: the mass ratio holds, and friction is refused.
fn estimated(recordings: &[Recording]) -> Result<Vec<Row>, String> {
    let program = Program::build()?;
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let campaign = write_campaign(folder.path(), recordings)?;
    let output = program.output.join("air-table.json");
    let [campaign, properties] = [&campaign, &output].map(|path| path.to_string_lossy());
    let run = program.run(&["estimate", &campaign, "--reference", PUCKS[1], "-o", &properties])?;
    let properties = files::load_properties(&output).map_err(|e| e.to_string())?;
    for warning in &properties.warnings {
        println!("{warning}");
    }
    let truth = MASS_KG[0] / MASS_KG[1];
    let ratio = properties.mass_ratio.get(PUCKS[0]).ok_or("no mass ratio was found")?;
    println!("{ratio:?}");
    let covered = (ratio.interval_95[0]..=ratio.interval_95[1]).contains(&truth);
    let refused = |name: &str| {
        properties.warnings.iter().any(|w| w.starts_with(&format!("friction of `{name}` is refused")))
    };
    Ok(vec![
        Row::plain("estimation of all runs, CPU time", run.cpu_s.unwrap_or(f64::NAN), "s"),
        Row::plain("estimation of all runs, wall time", run.wall_s, "s"),
        Row::at_most("mass ratio: error", 100.0 * (ratio.mean / truth - 1.0).abs(), 1.0, "%"),
        Row::plain(
            "mass ratio: half interval",
            50.0 * (ratio.interval_95[1] - ratio.interval_95[0]) / truth,
            "%",
        ),
        Row::at_most("truth outside the interval", f64::from(u8::from(!covered)), 0.0, ""),
        Row::at_most(
            "pucks whose friction is not refused as not Coulomb",
            PUCKS.iter().filter(|name| !refused(name)).count() as f64,
            0.0,
            "",
        ),
    ])
}

/// Impacts with a cosine of incidence below it are glancing.
const GLANCING_COSINE: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_again() {
        let points = (0..40).map(|k| 0.002 * f64::from(k)).map(|t| (t, 0.3 - 0.5 * t + 2.0 * t * t));
        let found = parabola(points).expect("enough points");
        for (found, drawn) in found.iter().zip([0.3, -0.5, 2.0]) {
            assert!((found - drawn).abs() < 1e-9, "{found}, not {drawn}");
        }
    }

    /// A puck that hits another one at a known instant.
    fn drawn(restitution: f64) -> Recording {
        let hit_s = 0.4;
        let speed = 0.5;
        let total = MASS_KG[0] + MASS_KG[1];
        let after = [
            speed * (MASS_KG[0] - restitution * MASS_KG[1]) / total,
            speed * (1.0 + restitution) * MASS_KG[0] / total,
        ];
        let mut pucks = [const { Vec::new() }; 2];
        for k in 0..400 {
            let time_s = f64::from(k) * STEP_S;
            for (i, puck) in pucks.iter_mut().enumerate() {
                let velocity = if time_s < hit_s { [speed, 0.0][i] } else { after[i] };
                let x = [0.0, 2.0 * RADIUS_M][i] + velocity * (time_s - hit_s);
                puck.push(Sample { time_s, position: Point::new(x, 0.1), yaw_rad: 0.0 });
            }
        }
        Recording { name: "drawn".into(), file: PathBuf::new(), letters: ['a', 'b'], pucks }
    }

    #[test]
    fn velocities_and_restitution_of_a_drawn_collision_are_found_again() {
        let collision = collision(&drawn(0.7)).expect("two pucks");
        assert!((collision.before[0].velocity.x - 0.5).abs() < 1e-9, "{collision:?}");
        let [restitution, _] = fitted(&[&collision], true).expect("possible");
        assert!((restitution - 0.7).abs() < 1e-3, "{restitution}");
    }
}
