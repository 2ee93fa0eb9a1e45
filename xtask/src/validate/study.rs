//! Which parameter or law explains the difference between predicted and filmed strikes on piles?
//!
//! `cargo xtask validate scatter LAB`: every film of `scatter/` is simulated again with one change: some of the estimated
//! properties replaced by the true ones of the lab, or one law replaced by another.  The truth is read for measuring only; no
//! parameter is tuned to it.

use super::row::mean_and_worst;
use super::truth::{Clip, Truth};
use super::{Program, campaign};
use crate::bench::physics as peers;
use breakshot::files;
use breakshot::geometry::Pose;
use breakshot::object::{Shape, kind, pair_key};
use breakshot::physics::{
    Compliance, ContactForce, ImpactLaw, MultipleImpact, Options, Simulator, Spin, Stiffness, World,
};
use breakshot::properties::{
    ContactFriction, Properties, SlipDamping, TangentialDamping, TangentialRestitution,
};
use breakshot::scene::{Scene, Strike};
use breakshot::uncertain::Estimate;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// One film of a strike on a pile.
struct Film {
    name: String,
    scene: Scene,
    strike: Strike,
    clip: Clip,
}

/// The inputs that are replaced by the true ones of the lab.
#[allow(clippy::struct_excessive_bools)] // independent switches
#[derive(Clone, Copy, Default)]
struct TrueInputs {
    poses: bool,
    friction: bool,
    restitution: bool,
    masses: bool,
    contact_friction: bool,
}

impl TrueInputs {
    const ALL: Self =
        Self { poses: true, friction: true, restitution: true, masses: true, contact_friction: true };
}

/// The estimated properties, and the truth of the films that they come from and of the films on piles.
struct Sources {
    estimated: Properties,
    campaign: Truth,
    scatter: Truth,
}

/// One prediction: which inputs are true, and by which laws it is computed.
struct Variant {
    name: String,
    true_inputs: TrueInputs,
    options: Options,
    /// Replaces the contact friction of the lab.
    contact_friction: Option<f64>,
    /// Replaces the estimated laws of tangential restitution.
    slip: Option<Slip>,
    /// Whether objects press on the table only along their rims or at their corners.
    on_rims: bool,
}

/// What is left of the slip after impacts that stick, between objects and with the striker.
#[derive(Clone, Copy)]
enum Slip {
    /// Nothing: the tangential restitution is 0.
    None,
    /// The part e^p, with this exponent.
    Damped(f64),
}

impl Variant {
    fn new(name: &str, true_inputs: TrueInputs) -> Self {
        let options = Options::default();
        Self { name: name.into(), true_inputs, options, contact_friction: None, slip: None, on_rims: false }
    }

    fn multiple_impact(name: &str, multiple_impact: MultipleImpact) -> Self {
        let options = Options { multiple_impact, ..Options::default() };
        Self { options, ..Self::new(name, TrueInputs::ALL) }
    }
}

/// The rows of the table: one input after the other, then one law after the other with all inputs true.
fn variants() -> Vec<Variant> {
    let none = TrueInputs::default();
    let springs = |contact_time_s: f64, force: ContactForce, stiffness: Stiffness| {
        MultipleImpact::Compliant(Compliance { contact_time_s, force, stiffness, ..Compliance::default() })
    };
    let soft = springs(LAB_CONTACT_S, ContactForce::Linear, Stiffness::SameContactTime);
    let mut all = vec![
        Variant::new("estimated properties, as shipped", none),
        Variant::new("true start poses", TrueInputs { poses: true, ..none }),
        Variant::new("true table friction", TrueInputs { friction: true, ..none }),
        Variant::new("true restitution", TrueInputs { restitution: true, ..none }),
        Variant::new("true masses", TrueInputs { masses: true, ..none }),
        Variant::new("true contact friction", TrueInputs { contact_friction: true, ..none }),
        Variant::new("all true", TrueInputs::ALL),
        Variant::multiple_impact("all true; impacts one by one", MultipleImpact::Pairwise),
        Variant::multiple_impact(
            "all true; linear springs",
            springs(1e-4, ContactForce::Linear, Stiffness::Same),
        ),
        Variant::multiple_impact(
            "all true; Hertz, contacts of 1 ms",
            springs(LAB_CONTACT_S, ContactForce::Hertz, Stiffness::Same),
        ),
        Variant::multiple_impact(
            "all true; linear, every contact 0.1 ms",
            springs(1e-4, ContactForce::Linear, Stiffness::SameContactTime),
        ),
        Variant::multiple_impact("all true; linear, every contact 1 ms", soft),
    ];
    for friction in [0.0, 0.1, 0.2, 0.3] {
        let name = format!("all true; contact friction {friction}");
        all.push(Variant { contact_friction: Some(friction), ..Variant::new(&name, TrueInputs::ALL) });
    }
    for (name, slip) in
        [("all true; no slip left", Slip::None), ("all true; damped slip, p = 2", Slip::Damped(2.0))]
    {
        all.push(Variant { slip: Some(slip), ..Variant::new(name, TrueInputs::ALL) });
    }
    let damped = Variant::new("all true; damped slip, contact friction 0.1", TrueInputs::ALL);
    all.push(Variant { slip: Some(Slip::Damped(2.0)), contact_friction: Some(0.1), ..damped });
    let laws = Options { impact: ImpactLaw::Newton, ..Options::default() };
    all.push(Variant { options: laws, ..Variant::new("all true; Newton's restitution", TrueInputs::ALL) });
    let apart = Options { spin: Spin::Decoupled, ..Options::default() };
    all.push(Variant { options: apart, ..Variant::new("all true; slide and spin apart", TrueInputs::ALL) });
    all.push(Variant {
        on_rims: true,
        ..Variant::new("all true; pressed on rims and corners", TrueInputs::ALL)
    });
    all.push(Variant {
        on_rims: true,
        ..Variant::multiple_impact("all true; rims and every contact 1 ms", soft)
    });
    all
}

/// Contact time of the lab's physics engine, by its own documentation: about a millisecond.
const LAB_CONTACT_S: f64 = 1e-3;

/// Predicts every film of `scatter/` in every variant and prints the table, then runs the exported models in MuJoCo.
///
/// The properties are those that the last `validate LAB` estimated from the campaign; without any, they are estimated first.
pub(crate) fn run(lab: &Path, python: Option<&str>) -> Result<(), String> {
    let program = Program::build()?;
    let file = program.output.join("properties.json");
    if !file.exists() {
        campaign(&program, &lab.join("campaign"), &file, false)?;
    }
    let sources = Sources {
        estimated: files::load_properties(&file).map_err(|e| e.to_string())?,
        campaign: Truth::read(&lab.join("campaign"))?,
        scatter: Truth::read(&lab.join("scatter"))?,
    };
    let films = films(&lab.join("scatter"), &sources.scatter)?;
    println!("\nDistances between centres, predicted against the lab's own, mean (and worst) in mm");
    let names: Vec<String> = films.iter().map(|film| format!("{:>14}", film.name)).collect();
    println!("{:<42} {:>16} {:>10} {}", "", "all pairs", "explained", names.join(""));
    let mut shipped_mm = None;
    for variant in variants() {
        let mut errors_mm = Vec::new();
        let mut each = String::new();
        for film in &films {
            let of_film = distance_errors_mm(film, &variant, &sources)?;
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

/// Exports the scene of every film with the estimated properties, runs it in MuJoCo, and compares distances with the lab's.
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
        let mut positions = Vec::new();
        for line in run.stdout.lines() {
            let fields: Vec<&str> = line.split(',').collect();
            let number = |k: usize| fields.get(k).and_then(|f| f.parse::<f64>().ok()).unwrap_or(f64::NAN);
            let truth = film.clip.last.get(fields[0]).copied().unwrap_or([f64::NAN; 3]);
            positions.push(([number(1), number(2)], truth));
        }
        if run.code != 0 || positions.len() != film.scene.placed.len() {
            return Err(format!("{}: MuJoCo did not run the exported model", film.name));
        }
        let mut errors_mm = Vec::new();
        for (k, (p, p_true)) in positions.iter().enumerate() {
            for (q, q_true) in &positions[..k] {
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
        let scene = files::load_scene(folder.join(format!("{name}.scene.toml")));
        let strike = files::load_strike(folder.join(format!("{name}.strike.json")));
        let scene = scene.map_err(|e| e.to_string())?.value;
        Ok(Film { name, scene, strike: strike.map_err(|e| e.to_string())?, clip: clip.clone() })
    };
    truth.clips.iter().map(film).collect()
}

/// Predicted minus true distance of every pair (mm).
fn distance_errors_mm(film: &Film, variant: &Variant, sources: &Sources) -> Result<Vec<f64>, String> {
    let mut scene = film.scene.clone();
    if variant.true_inputs.poses {
        for placed in &mut scene.placed {
            if let Some([x, y, yaw]) = film.clip.start.get(&placed.object) {
                let pose = Pose::new(*x, *y, *yaw);
                (placed.position_m, placed.yaw_rad) = (pose.position, pose.yaw_rad);
            }
        }
    }
    let properties = properties(sources, variant, film.clip.friction_scale);
    let mut world = World::new(&scene, &properties, &variant.options).map_err(|e| e.to_string())?;
    if variant.on_rims {
        for placed in &scene.placed {
            let shape = &scene.object(&placed.object).map_err(|e| e.to_string())?.shape;
            world.set_support_arm(&placed.object, rim_arm_m(shape)).map_err(|e| e.to_string())?;
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

/// The estimated properties; a variant's true values replace the estimated ones.
fn properties(sources: &Sources, variant: &Variant, friction_scale: f64) -> Properties {
    let Sources { estimated, campaign, scatter } = sources;
    let mut properties = estimated.clone();
    let true_inputs = variant.true_inputs;
    if true_inputs.friction {
        for (name, friction) in &scatter.friction {
            properties.friction.insert(name.clone(), Estimate::exact(friction * friction_scale));
        }
    }
    if true_inputs.masses {
        let reference = scatter.mass_kg[kind(&properties.reference)];
        for (name, mass) in &scatter.mass_kg {
            properties.mass_ratio.insert(name.clone(), Estimate::exact(mass / reference));
        }
    }
    if true_inputs.restitution {
        for (pair, restitution) in campaign.mean_restitution() {
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
    if true_inputs.contact_friction {
        let estimate = |own: Option<f64>| variant.contact_friction.or(own).map(Estimate::exact);
        properties.contact_friction = ContactFriction {
            objects: estimate(scatter.surface_friction),
            striker: estimate(scatter.striker_friction),
        };
    }
    if let Some(slip) = variant.slip {
        let (probability, exponent) = match slip {
            Slip::None => (0.0, SlipDamping::assumed().exponent),
            Slip::Damped(exponent) => (1.0, Estimate::exact(exponent)),
        };
        let (constant, damping) = (Some(Estimate::exact(0.0)), Some(SlipDamping { probability, exponent }));
        properties.tangential_restitution = TangentialRestitution { objects: constant, striker: constant };
        properties.tangential_damping = TangentialDamping { objects: damping, striker: damping };
    }
    properties
}

/// Mean distance of the rim or the corners of an outline from its centroid (m).
fn rim_arm_m(shape: &Shape) -> f64 {
    let corners = shape.corners();
    if corners.is_empty() {
        return shape.outer_radius_m();
    }
    corners.iter().map(|c| c.to_vec().length()).sum::<f64>() / corners.len() as f64
}
