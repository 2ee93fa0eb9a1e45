//! Which parameter or law explains how far the predicted strikes on piles are from the filmed ones?
//!
//! `cargo xtask validate scatter LAB`: every film of `scatter/` is simulated again with one thing changed: the learned
//! properties replaced by the lab's own, a law replaced by another.  The truth is read for measuring; nothing is tuned to it.

use super::row::mean_and_worst;
use super::truth::{Clip, Truth};
use super::{Program, campaign};
use crate::bench::physics as peers;
use breakshot::files;
use breakshot::geometry::Pose;
use breakshot::object::{Shape, kind, pair_key};
use breakshot::physics::{
    Compliance, ContactForce, ImpactLaw, Options, Simulator, Spin, Stiffness, Touching, World,
};
use breakshot::properties::{ContactFriction, Properties};
use breakshot::scene::{Scene, Strike};
use breakshot::uncertain::Estimate;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// One film.
struct Film {
    name: String,
    scene: Scene,
    strike: Strike,
    clip: Clip,
}

/// What is taken from the lab instead of from the films.
#[allow(clippy::struct_excessive_bools)] // each answers a question of its own
#[derive(Clone, Copy, Default)]
struct Given {
    poses: bool,
    friction: bool,
    restitution: bool,
    masses: bool,
    contact_friction: bool,
}

impl Given {
    const ALL: Self =
        Self { poses: true, friction: true, restitution: true, masses: true, contact_friction: true };
}

/// One way to predict.
struct Variant {
    name: String,
    given: Given,
    options: Options,
    /// Instead of the lab's contact friction.
    contact_friction: Option<f64>,
    /// Whether objects press on the table along their rims or corners only.
    on_rims: bool,
}

impl Variant {
    fn new(name: &str, given: Given) -> Self {
        let options = Options::default();
        Self { name: name.into(), given, options, contact_friction: None, on_rims: false }
    }

    fn touching(name: &str, touching: Touching) -> Self {
        let options = Options { touching, ..Options::default() };
        Self { options, ..Self::new(name, Given::ALL) }
    }
}

/// The study's lines: first one property after the other, then one law after the other with all properties true.
fn variants() -> Vec<Variant> {
    let given = Given::default();
    let springs = |contact_time_s: f64, force: ContactForce, stiffness: Stiffness| {
        Touching::Compliant(Compliance { contact_time_s, force, stiffness, ..Compliance::default() })
    };
    let soft = springs(LAB_CONTACT_S, ContactForce::Linear, Stiffness::SameContactTime);
    let mut all = vec![
        Variant::new("learned properties, as shipped", given),
        Variant::new("true start poses", Given { poses: true, ..given }),
        Variant::new("true table friction", Given { friction: true, ..given }),
        Variant::new("true restitution", Given { restitution: true, ..given }),
        Variant::new("true masses", Given { masses: true, ..given }),
        Variant::new("true contact friction", Given { contact_friction: true, ..given }),
        Variant::new("all true", Given::ALL),
        Variant::touching("all true; impacts one by one", Touching::Pairwise),
        Variant::touching("all true; linear springs", springs(1e-4, ContactForce::Linear, Stiffness::Same)),
        Variant::touching(
            "all true; Hertz, contacts of 1 ms",
            springs(LAB_CONTACT_S, ContactForce::Hertz, Stiffness::Same),
        ),
        Variant::touching(
            "all true; linear, every contact 0.1 ms",
            springs(1e-4, ContactForce::Linear, Stiffness::SameContactTime),
        ),
        Variant::touching("all true; linear, every contact 1 ms", soft),
    ];
    for friction in [0.0, 0.1, 0.2, 0.3] {
        let name = format!("all true; contact friction {friction}");
        all.push(Variant { contact_friction: Some(friction), ..Variant::new(&name, Given::ALL) });
    }
    let laws = Options { impact: ImpactLaw::Newton, ..Options::default() };
    all.push(Variant { options: laws, ..Variant::new("all true; Newton's restitution", Given::ALL) });
    let apart = Options { spin: Spin::Decoupled, ..Options::default() };
    all.push(Variant { options: apart, ..Variant::new("all true; slide and spin apart", Given::ALL) });
    all.push(Variant { on_rims: true, ..Variant::new("all true; pressed on rims and corners", Given::ALL) });
    all.push(Variant { on_rims: true, ..Variant::touching("all true; rims and every contact 1 ms", soft) });
    all
}

/// The lab says that its contacts last about a millisecond.
const LAB_CONTACT_S: f64 = 1e-3;

/// Takes what the last `validate LAB` learned from the campaign, or learns it; predicts every film of `scatter/` in every way, prints the table; then runs the exported
/// models in MuJoCo.
pub(crate) fn run(lab: &Path, python: Option<&str>) -> Result<(), String> {
    let program = Program::build()?;
    let learned = program.output.join("properties.json");
    if !learned.exists() {
        campaign(&program, &lab.join("campaign"), &learned, false)?;
    }
    let learned = files::load_properties(&learned).map_err(|e| e.to_string())?;
    let (cell, scatter) = (Truth::read(&lab.join("campaign"))?, Truth::read(&lab.join("scatter"))?);
    let films = films(&lab.join("scatter"), &scatter)?;
    println!("\nDistances between centres, predicted against the lab's own, mean (and worst) in mm");
    let names: Vec<String> = films.iter().map(|film| format!("{:>14}", film.name)).collect();
    println!("{:<42} {:>16} {:>10} {}", "", "all pairs", "explained", names.join(""));
    let mut shipped_mm = None;
    for variant in variants() {
        let mut errors_mm = Vec::new();
        let mut each = String::new();
        for film in &films {
            let of_film = errors(film, &variant, (&learned, &cell, &scatter))?;
            let (mean, worst) = mean_and_worst(&of_film);
            let _ = write!(each, " {mean:>6.1} ({worst:>4.1})");
            errors_mm.extend(of_film);
        }
        let (mean, worst) = mean_and_worst(&errors_mm);
        let explained = 100.0 * (1.0 - mean / *shipped_mm.get_or_insert(mean));
        println!("{:<42} {mean:>8.2} ({worst:>5.1}) {explained:>8.0} % {each}", variant.name);
    }
    exported(&program, &films, &lab.join("scatter"), &peers::mujoco(python)?)
}

/// Exports every film's scene with the learned properties, runs it in MuJoCo and compares distances with our own.
fn exported(program: &Program, films: &[Film], folder: &Path, python: &Path) -> Result<(), String> {
    println!(
        "\nThe exported models in MuJoCo: distances between centres against the lab's own, mean (and worst) in mm"
    );
    for film in films {
        let file =
            |ending: &str| folder.join(format!("{}{ending}", film.name)).to_string_lossy().into_owned();
        let model = program.output.join(format!("{}.xml", film.name)).to_string_lossy().into_owned();
        let properties = program.output.join("properties.json").to_string_lossy().into_owned();
        let (scene, strike) = (file(".scene.toml"), file(".strike.json"));
        program.run(&[
            "export",
            &scene,
            "--properties",
            &properties,
            "--strike",
            &strike,
            "--to",
            "mjcf",
            "-o",
            &model,
        ])?;
        let run = crate::process::run(Command::new(python).args(["xtask/peers/mujoco_run.py", &model]))?;
        let mut places = Vec::new();
        for line in run.stdout.lines() {
            let fields: Vec<&str> = line.split(',').collect();
            let number = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok()).unwrap_or(f64::NAN);
            let truth = film.clip.last.get(fields[0]).copied().unwrap_or([f64::NAN; 3]);
            places.push(([number(1), number(2)], truth));
        }
        if run.code != 0 || places.len() != film.scene.placed.len() {
            return Err(format!("{}: MuJoCo did not run the exported model", film.name));
        }
        let mut errors_mm = Vec::new();
        for (k, (p, p_true)) in places.iter().enumerate() {
            for (q, q_true) in &places[..k] {
                let ours_m = (p[0] - q[0]).hypot(p[1] - q[1]);
                errors_mm.push(1e3 * (ours_m - (p_true[0] - q_true[0]).hypot(p_true[1] - q_true[1])));
            }
        }
        let (mean, worst) = mean_and_worst(&errors_mm);
        println!("{:<42} {mean:>8.2} ({worst:>5.1})", film.name);
    }
    Ok(())
}

fn films(folder: &Path, truth: &Truth) -> Result<Vec<Film>, String> {
    let film = |(video, clip): (&String, &Clip)| {
        let name = video.trim_end_matches(".mp4").to_owned();
        let scene = files::load_scene(&folder.join(format!("{name}.scene.toml")));
        let strike = files::load_strike(&folder.join(format!("{name}.strike.json")));
        let scene = scene.map_err(|e| e.to_string())?.value;
        Ok(Film { name, scene, strike: strike.map_err(|e| e.to_string())?, clip: clip.clone() })
    };
    truth.clips.iter().map(film).collect()
}

/// Predicted less true distance of every pair (mm).
fn errors(
    film: &Film,
    variant: &Variant,
    (learned, cell, scatter): (&Properties, &Truth, &Truth),
) -> Result<Vec<f64>, String> {
    let mut scene = film.scene.clone();
    if variant.given.poses {
        for placed in &mut scene.placed {
            if let Some([x, y, yaw]) = film.clip.start.get(&placed.object) {
                let pose = Pose::new(*x, *y, *yaw);
                (placed.position_m, placed.yaw_rad) = (pose.position, pose.yaw_rad);
            }
        }
    }
    let properties = properties(learned, variant, (cell, scatter), film.clip.friction_scale);
    let mut world = World::new(&scene, &properties, &variant.options).map_err(|e| e.to_string())?;
    if variant.on_rims {
        for (index, placed) in scene.placed.iter().enumerate() {
            let shape = &scene.object(&placed.object).map_err(|e| e.to_string())?.shape;
            world.set_support_arm(index, rim_arm_m(shape)).map_err(|e| e.to_string())?;
        }
    }
    let outcome = Simulator::new().run(&world, &film.strike).map_err(|e| e.to_string())?;
    let mut errors_mm = Vec::new();
    let truth =
        |index: usize| film.clip.last.get(&scene.placed[index].object).copied().unwrap_or([f64::NAN; 3]);
    for i in 0..outcome.poses.len() {
        for k in 0..i {
            let predicted_m = outcome.poses[i].position.distance(outcome.poses[k].position);
            let true_m = (truth(i)[0] - truth(k)[0]).hypot(truth(i)[1] - truth(k)[1]);
            errors_mm.push(1e3 * (predicted_m - true_m));
        }
    }
    Ok(errors_mm)
}

/// The learned properties with what is given put in their place.
fn properties(
    learned: &Properties,
    variant: &Variant,
    (cell, scatter): (&Truth, &Truth),
    friction_scale: f64,
) -> Properties {
    let mut properties = learned.clone();
    let given = variant.given;
    if given.friction {
        for (name, friction) in &scatter.friction {
            properties.friction.insert(name.clone(), Estimate::exact(friction * friction_scale));
        }
    }
    if given.masses {
        let reference = scatter.mass_kg[kind(&properties.reference)];
        for (name, mass) in &scatter.mass_kg {
            properties.mass_ratio.insert(name.clone(), Estimate::exact(mass / reference));
        }
    }
    if given.restitution {
        for (pair, restitution) in cell.mean_restitution() {
            match pair.split_once('/') {
                Some((object, "striker")) => {
                    properties.striker_restitution.insert(object.into(), Estimate::exact(restitution));
                }
                Some((a, b)) => {
                    properties.restitution.insert(pair_key(a, b), Estimate::exact(restitution));
                }
                None => {}
            }
        }
    }
    if given.contact_friction {
        let estimate = |own: Option<f64>| variant.contact_friction.or(own).map(Estimate::exact);
        properties.contact_friction = ContactFriction {
            objects: estimate(scatter.surface_friction),
            striker: estimate(scatter.striker_friction),
        };
    }
    properties
}

/// The mean distance of an outline's rim or corners from the centroid (m).
fn rim_arm_m(shape: &Shape) -> f64 {
    let corners = shape.corners();
    if corners.is_empty() {
        return shape.outer_radius_m();
    }
    corners.iter().map(|c| c.to_vec().length()).sum::<f64>() / corners.len() as f64
}
