//! How is a scene and its strike written as a MuJoCo model?
//!
//! The model needs no further code: reset to its keyframe `strike`, the striker moves and stops.  The approximations are listed
//! at the top of the model and in [`Mjcf::notes`].

use crate::error::Result;
use crate::geometry::{Point, Pose, Vec2};
use crate::object::Shape;
use crate::physics::contact::convex_decomposition::convex_parts;
use crate::physics::options::Options;
use crate::physics::sliding::body::STRIKER;
use crate::physics::sliding::patch_friction::{GRAVITY_M_S2, PATCH_RADIUS_PER_ARM};
use crate::physics::world::World;
use crate::properties::Properties;
use crate::scene::{Scene, Strike};
use std::f64::consts::TAU;
use std::fmt::Write;

/// A MuJoCo model.
#[derive(Clone, Debug, PartialEq)]
pub struct Mjcf {
    /// The model (MJCF, XML).
    pub text: String,
    /// What is approximated or omitted.
    pub notes: Vec<String>,
}

/// Duration of a contact (s): MuJoCo's contacts are springs that need some steps.
const CONTACT_S: f64 = 2e-3;
/// MuJoCo's time step (s): twenty per contact.
const STEP_S: f64 = 1e-4;
/// Feet of an object on the circle of its mean lever arm, which gives its greatest friction torque.
const FEET: usize = 6;
/// Radius of a foot, and height of the outlines above the table (m).
const FOOT_M: f64 = 0.001;
/// Mass of a striker of prescribed motion, over the mass of all objects.
const PRESCRIBED_MASS_RATIO: f64 = 1e4;
/// Half of the thickness of a wall (m), and half of its height.
const WALL_HALF_M: [f64; 2] = [1e-3, 0.05];
/// Least restitution; a smaller one would need a pure damper.
const LEAST_RESTITUTION: f64 = 1e-3;

/// A MuJoCo model of a scene, its properties and a strike.
///
/// # Errors
/// The same as [`trajectory`](crate::physics::trajectory()): what cannot be simulated is not exported.
pub fn mjcf(scene: &Scene, properties: &Properties, strike: &Strike, options: &Options) -> Result<Mjcf> {
    let world = World::new(scene, properties, options)?;
    world.check_strike(strike)?;
    let mut model = Model { world: &world, scene, assets: String::new(), geoms: Vec::new() };
    let mut bodies = model.striker(strike, options);
    for (index, placed) in scene.placed.iter().enumerate() {
        let object = scene.object(&placed.object)?;
        bodies += &model.object(index, &object.shape, object.height_m, placed.pose());
    }
    bodies += &model.walls();
    let notes = notes(scene, &world);
    let mut text = String::from("<!--\n  Written by breakshot.  Start from the keyframe `strike`.\n");
    for note in &notes {
        // Two hyphens would end the comment.
        let _ = writeln!(text, "  * {}", note.replace("--", "- -"));
    }
    // The native convex collider of MuJoCo 4.0 reports false, deep contacts between prisms; the older one does not.
    let tilt = world.slope * GRAVITY_M_S2;
    let _ = write!(
        text,
        "-->\n<mujoco model=\"breakshot\">\n  <compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n  \
         <option timestep=\"{STEP_S}\" gravity=\"{} {} -{GRAVITY_M_S2}\" cone=\"elliptic\" impratio=\"100\" tolerance=\"1e-12\">\n    \
         <flag nativeccd=\"disable\"/>\n  </option>\n  \
         <asset>\n{}  </asset>\n  <worldbody>\n    <light pos=\"0 0 3\"/>\n    \
         <geom name=\"table\" type=\"plane\" size=\"2 2 0.1\" contype=\"0\" conaffinity=\"1\" friction=\"0 0 0\"/>\n{bodies}  \
         </worldbody>\n  <contact>\n{}  </contact>\n  <keyframe>\n    <key name=\"strike\" qvel=\"{}{}\"/>\n  </keyframe>\n</mujoco>\n",
        tilt.x,
        tilt.y,
        model.assets,
        model.pairs(),
        strike.speed_m_s,
        " 0 0 0 0".repeat(scene.placed.len()),
    );
    Ok(Mjcf { text, notes })
}

fn notes(scene: &Scene, world: &World) -> Vec<String> {
    let mut notes = vec![
        format!(
            "contacts are springs of {} ms whose damping gives each pair's restitution; ours take no time",
            CONTACT_S * 1e3
        ),
        "contact friction acts on these springs; ours is Routh's method with Stronge's restitution".into(),
        format!(
            "objects slide and rotate on the table but never tip; each has {FEET} feet on the circle of its mean lever arm"
        ),
        "the striker is stopped by the end of its joint and stays there; it does not draw back".into(),
    ];
    if !scene.keep_out.is_empty() {
        notes.push("keep-out areas are omitted: nothing happens at their edges".into());
    }
    if scene.cell.table.is_some() {
        notes.push("the table has no edges: nothing falls".into());
    }
    notes.extend(world.notes.iter().cloned());
    notes.extend(world.assumed.iter().map(ToString::to_string));
    notes
}

/// The parts of a model.
struct Model<'a> {
    world: &'a World,
    scene: &'a Scene,
    /// Meshes of polygons.
    assets: String,
    /// Names of geoms, with the indices of their bodies.
    geoms: Vec<(usize, String)>,
}

/// What a name is in XML.
fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

impl Model<'_> {
    /// The striker: a heavy body on a slide along its heading, which ends after its travel.
    fn striker(&mut self, strike: &Strike, options: &Options) -> String {
        let all: f64 = self.world.bodies[1..=self.world.objects].iter().map(|b| 1.0 / b.inverse_mass).sum();
        let mass = options.striker_mass_kg.unwrap_or(PRESCRIBED_MASS_RATIO * all.max(1.0));
        let Point { x, y } = strike.start_m;
        let (heading, travel) = (strike.heading_rad, strike.travel_m);
        let striker = &self.scene.cell.striker;
        let geoms = self.outline("striker", STRIKER, &striker.shape, striker.height_m);
        format!(
            "    <body name=\"striker\" pos=\"{x} {y} 0\" euler=\"0 0 {heading}\">\n      \
             <inertial pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"{mass} {mass} {mass}\"/>\n      \
             <joint name=\"striker\" type=\"slide\" axis=\"1 0 0\" limited=\"true\" range=\"-1 {travel}\" solreflimit=\"0.001 1\"/>\n\
             {geoms}    </body>\n"
        )
    }

    /// An object: joints along x, y and z and about z, an outline and feet.
    fn object(&mut self, index: usize, shape: &Shape, height_m: f64, pose: Pose) -> String {
        let body = self.world.body_of[index];
        let (mass, inertia) =
            (1.0 / self.world.bodies[body].inverse_mass, 1.0 / self.world.bodies[body].inverse_inertia);
        let name = escaped(&self.world.names[index]);
        let Pose { position: Point { x, y }, yaw_rad } = pose;
        let mut text = format!(
            "    <body name=\"{name}\" pos=\"{x} {y} 0\" euler=\"0 0 {yaw_rad}\">\n      \
             <inertial pos=\"0 0 0\" mass=\"{mass}\" diaginertia=\"{inertia} {inertia} {inertia}\"/>\n"
        );
        // Joint axes are given in the body's frame; rotated back they are the axes of the table.
        let back = [Vec2::from_heading(-yaw_rad), Vec2::from_heading(-yaw_rad).perpendicular()];
        for (joint, axis) in ["x", "y"].into_iter().zip(back) {
            let _ = writeln!(
                text,
                "      <joint name=\"{name} {joint}\" type=\"slide\" axis=\"{} {} 0\"/>",
                axis.x, axis.y
            );
        }
        let _ = writeln!(text, "      <joint name=\"{name} z\" type=\"slide\" axis=\"0 0 1\"/>");
        let _ = writeln!(text, "      <joint name=\"{name} yaw\" type=\"hinge\" axis=\"0 0 1\"/>");
        text += &self.outline(&name, body, shape, height_m);
        let friction = self.world.bodies[body].friction_deceleration_m_s2 / GRAVITY_M_S2;
        let arm_m = self.world.bodies[body].patch_radius_m / PATCH_RADIUS_PER_ARM;
        for foot in 0..FEET {
            let at = Vec2::from_heading(foot as f64 / FEET as f64 * TAU) * arm_m;
            let _ = writeln!(
                text,
                "      <geom type=\"sphere\" size=\"{FOOT_M}\" pos=\"{} {} {FOOT_M}\" contype=\"1\" conaffinity=\"0\" condim=\"3\" \
                 priority=\"1\" friction=\"{friction} 0 0\" solref=\"0.002 1\"/>",
                at.x, at.y
            );
        }
        text + "    </body>\n"
    }

    /// The geoms of an outline, as high as the object; they collide only in the pairs of [`Model::pairs`].
    fn outline(&mut self, name: &str, body: usize, shape: &Shape, height_m: f64) -> String {
        let half_m = 0.5 * (height_m - FOOT_M).max(FOOT_M);
        let middle_m = FOOT_M + half_m;
        let mut text = String::new();
        let mut geom = |geoms: &mut Vec<(usize, String)>, kind: String| {
            let own = format!("{name} {}", geoms.iter().filter(|g| g.0 == body).count());
            let _ = writeln!(
                text,
                "      <geom name=\"{own}\" {kind} pos=\"0 0 {middle_m}\" contype=\"0\" conaffinity=\"0\"/>"
            );
            geoms.push((body, own));
        };
        match shape {
            Shape::Disc { radius_m } => {
                geom(&mut self.geoms, format!("type=\"cylinder\" size=\"{radius_m} {half_m}\""));
            }
            Shape::Rectangle { size_m: [x, y] } => {
                geom(&mut self.geoms, format!("type=\"box\" size=\"{} {} {half_m}\"", 0.5 * x, 0.5 * y));
            }
            Shape::Polygon { points_m } => {
                for part in convex_parts(points_m) {
                    let mesh = format!("{name} mesh {}", self.geoms.len());
                    let corners: Vec<String> = [-half_m, half_m]
                        .iter()
                        .flat_map(|z| part.iter().map(move |p| format!("{} {} {z}", p.x, p.y)))
                        .collect();
                    let _ =
                        writeln!(self.assets, "    <mesh name=\"{mesh}\" vertex=\"{}\"/>", corners.join(" "));
                    geom(&mut self.geoms, format!("type=\"mesh\" mesh=\"{mesh}\""));
                }
            }
        }
        text
    }

    fn walls(&mut self) -> String {
        let mut text = String::new();
        for (k, wall) in self.scene.walls.iter().enumerate() {
            let half = (wall.to_m - wall.from_m) * 0.5;
            let (middle, name) = (wall.from_m + half, format!("walls[{k}]"));
            let [thick, high] = WALL_HALF_M;
            let _ = writeln!(
                text,
                "    <geom name=\"{name}\" type=\"box\" pos=\"{} {} {high}\" euler=\"0 0 {}\" size=\"{} {thick} {high}\" \
                 contype=\"0\" conaffinity=\"0\"/>",
                middle.x,
                middle.y,
                half.heading_rad(),
                half.length()
            );
            self.geoms.push((1 + self.world.objects + k, name));
        }
        text
    }

    /// All pairs of geoms that can collide, with their restitution and friction.
    fn pairs(&self) -> String {
        let mut text = String::new();
        for (k, (a, geom_a)) in self.geoms.iter().enumerate() {
            for (b, geom_b) in &self.geoms[k + 1..] {
                let is_object = |body: usize| (1..=self.world.objects).contains(&body);
                if a == b || !(is_object(*a) || is_object(*b)) {
                    continue;
                }
                let c = self.world.coefficients(*a, *b);
                let (stiffness, damping) = spring(c.restitution);
                let condim = if c.friction > 0.0 { 3 } else { 1 };
                let _ = writeln!(
                    text,
                    "    <pair geom1=\"{geom_a}\" geom2=\"{geom_b}\" condim=\"{condim}\" friction=\"{f} {f} 0 0 0\" \
                     solref=\"-{stiffness} -{damping}\" solimp=\"0.9999 0.9999 0.001 0.5 2\"/>",
                    f = c.friction
                );
            }
        }
        text
    }
}

/// Stiffness and damping, over the reduced mass, of a spring that never pulls, lasts [`CONTACT_S`] and has a restitution.
///
/// With damping ratio `sin(phi)` it is `exp(-tan(phi) (pi - 2 phi))` after `(pi - 2 phi) / (omega cos(phi))`; beyond
/// critical damping `cosh(psi)` it is `exp(-2 psi / tanh(psi))` after `2 psi / (omega sinh(psi))` (Schwager and Poeschel,
/// Granular Matter 9 (2007) 465).
fn spring(restitution: f64) -> (f64, f64) {
    let wanted = restitution.max(LEAST_RESTITUTION);
    // One variable for both branches: phi below a right angle, psi above it.
    let right_angle = 0.25 * TAU;
    let answer = |x: f64| {
        if x < right_angle - 1e-6 {
            let left = 2.0 * (right_angle - x);
            ((-x.tan() * left).exp(), left / x.cos(), x.sin())
        } else {
            let psi = (x - right_angle).max(1e-6);
            ((-2.0 * psi / psi.tanh()).exp(), 2.0 * psi / psi.sinh(), psi.cosh())
        }
    };
    let (mut low, mut high) = (0.0, right_angle + 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if answer(middle).0 > wanted { low = middle } else { high = middle }
    }
    let (_, duration, ratio) = answer(low);
    let omega = duration / CONTACT_S;
    (omega * omega, 2.0 * ratio * omega)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_that_never_pulls_has_the_restitution_and_the_duration() {
        for restitution in [0.05, 0.1, 0.2, 0.5, 0.8, 0.99] {
            let (stiffness, damping) = spring(restitution);
            let step_s = 1e-8;
            let (mut position_m, mut speed, mut time_s) = (0.0, -1.0, 0.0);
            loop {
                let push: f64 = -stiffness * position_m - damping * speed;
                if push < 0.0 && speed > 0.0 {
                    break;
                }
                speed += step_s * push;
                position_m += step_s * speed;
                time_s += step_s;
            }
            assert!((speed - restitution).abs() < 1e-3, "{speed}, not {restitution}");
            assert!((time_s - CONTACT_S).abs() < 1e-5, "{time_s} s");
        }
    }

    #[test]
    fn names_are_escaped() {
        assert_eq!(escaped("a<\"b\"&c>"), "a&lt;&quot;b&quot;&amp;c&gt;");
    }
}
