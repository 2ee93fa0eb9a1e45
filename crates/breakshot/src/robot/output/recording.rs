//! A strike as a recording for Foxglove, Lichtblick, PlotJuggler or Rerun: an MCAP file with Foxglove's schemas in JSON.

use super::foxglove;
use super::mcap::Container;
use crate::error::Result;
use crate::geometry::Pose;
use crate::object::Shape;
use crate::physics::Trajectory;
use crate::robot::arm::joint_state::JointState;
use crate::robot::arm::model::capsule::Capsule;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::mounted_arm::MountedArm;
use crate::robot::command::Command;
use crate::robot::phase::PhaseName;
use crate::scene::Scene;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};

/// The severity of a log line, with Foxglove's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Information.
    Info = 2,
    /// A warning.
    Warning = 3,
    /// An error.
    Error = 4,
}

/// A recording of the arm, the objects on the table and a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    container: Container,
    transforms: u16,
    joints: u16,
    tip: u16,
    scene: u16,
    log: u16,
}

impl Default for Recording {
    fn default() -> Self {
        let mut container = Container::default();
        let mut channel = |topic, name, schema: Value| container.channel(topic, name, &schema.to_string());
        let transforms = channel("/tf", "foxglove.FrameTransforms", foxglove::frame_transforms());
        let joints = channel("/joint_states", "foxglove.JointStates", foxglove::joint_states());
        let tip = channel("/tip", "foxglove.PoseInFrame", foxglove::pose_in_frame());
        let scene = channel("/scene", "foxglove.SceneUpdate", foxglove::scene_update());
        let log = channel("/log", "foxglove.Log", foxglove::log());
        Self { container, transforms, joints, tip, scene, log }
    }
}

impl Recording {
    /// Adds the arm's state at a time (s): joints, links and tip.
    pub fn add_state(&mut self, time_s: f64, mounted: &MountedArm, state: &JointState) {
        let (arm, stamp) = (mounted.arm(), stamp(time_s));
        let mut parent = arm.base.name.clone();
        let mut transforms = vec![transform(&stamp, "table", &parent, &mounted.base_from_table.inverse())];
        let mut joints = Vec::new();
        for (k, link) in arm.links.iter().enumerate() {
            let rotation = Rotation3::from_axis_angle(&link.joint.axis, state.q_rad[k]);
            transforms.push(transform(
                &stamp,
                &parent,
                &link.name,
                &(link.joint.parent_from_joint * rotation),
            ));
            parent.clone_from(&link.name);
            joints.push(json!({
                "name": link.joint.name,
                "position": state.q_rad[k],
                "velocity": state.qd_rad_s[k],
                "acceleration": state.qdd_rad_s2[k],
            }));
        }
        let tip = mounted.base_from_table.inverse() * arm.tip(&state.q_rad);
        self.add(self.transforms, time_s, &json!({ "transforms": transforms }));
        self.add(self.joints, time_s, &json!({ "timestamp": stamp, "joints": joints }));
        self.add(self.tip, time_s, &json!({ "timestamp": stamp, "frame_id": "table", "pose": pose(&tip) }));
    }

    /// Adds the arm's shapes, each fixed to its link.
    pub fn add_arm(&mut self, time_s: f64, mounted: &MountedArm) {
        let arm = mounted.arm();
        let parts = std::iter::once((&arm.base.name, &arm.base.capsules))
            .chain(arm.links.iter().map(|link| (&link.name, &link.capsules)));
        let mut entities: Vec<Value> = parts
            .map(|(name, capsules)| {
                let shapes: Vec<Value> = capsules.iter().map(|capsule| cylinder(capsule, GREY)).collect();
                entity(time_s, name, &format!("arm/{name}"), &json!({ "cylinders": shapes }))
            })
            .collect();
        if let Some(last) = arm.links.last() {
            let radius_m = mounted.striker.outer_radius_m();
            let tool = Capsule { from_m: Vector3::zeros(), to_m: arm.tool.offset_m, radius_m };
            let tool = cylinder(&tool.transformed(&arm.last_from_flange), ORANGE);
            entities.push(entity(time_s, &last.name, "arm/tool", &json!({ "cylinders": [tool] })));
        }
        self.add(self.scene, time_s, &json!({ "deletions": [], "entities": entities }));
    }

    /// Adds the objects on the table, at `poses` where it returns one and otherwise at their poses in the scene.
    ///
    /// # Errors
    /// An object of an unknown kind.
    pub fn add_scene(
        &mut self,
        time_s: f64,
        scene: &Scene,
        poses: impl Fn(&str) -> Option<Pose>,
    ) -> Result<()> {
        let mut entities = Vec::new();
        for placed in &scene.placed {
            let object = scene.object(&placed.object)?;
            let at = poses(&placed.object).unwrap_or(placed.pose());
            let id = format!("object/{}", placed.object);
            entities.push(entity(time_s, "table", &id, &prism(&object.shape, object.height_m, at)));
        }
        self.add(self.scene, time_s, &json!({ "deletions": [], "entities": entities }));
        Ok(())
    }

    /// Adds a log line.
    pub fn add_log(&mut self, time_s: f64, level: LogLevel, message: &str) {
        let line = json!({
            "timestamp": stamp(time_s), "level": level as u8, "message": message, "name": "breakshot", "file": "", "line": 0,
        });
        self.add(self.log, time_s, &line);
    }

    fn add(&mut self, channel: u16, time_s: f64, message: &Value) {
        self.container.message(
            channel,
            (time_s.max(0.0) * 1e9).round() as u64,
            message.to_string().as_bytes(),
        );
    }

    /// The MCAP file.
    pub fn finished(&self) -> Vec<u8> {
        self.container.finished()
    }
}

impl Command {
    /// The planned strike as a recording. With a trajectory, the objects move as predicted.
    ///
    /// # Errors
    /// An arm model that cannot be built, or an object of an unknown kind.
    pub fn recording(&self, trajectory: Option<&Trajectory>) -> Result<Recording> {
        /// Interval of the recorded samples outside the strike.
        const SPARSE: usize = 10;
        let mounted = self.mounted_arm()?;
        let mut recording = Recording::default();
        recording.add_arm(0.0, &mounted);
        recording.add_log(0.0, LogLevel::Info, &format!("planned strike {}", self.short_hash()));
        self.warnings.iter().for_each(|warning| recording.add_log(0.0, LogLevel::Warning, warning));
        // The trajectory's time starts when a striker at constant speed leaves the strike's start.
        let lead_s = self.stroke.contact_after_m.unwrap_or(0.0) / self.strike.speed_m_s;
        let starts_s = self.stroke.contact_time_s - lead_s;
        for phase in &self.phases {
            recording.add_log(phase.span_s()[0], LogLevel::Info, phase.name.label());
            let step = if phase.name == PhaseName::Strike { 1 } else { SPARSE };
            for (k, &time_s) in phase.time_s.iter().enumerate().filter(|(k, _)| k % step == 0) {
                recording.add_state(time_s, &mounted, &phase.sample(k));
                if let Some(scene) = self.scene.as_ref().filter(|_| k % SPARSE == 0) {
                    let pose =
                        |name: &str| trajectory.and_then(|t| t.pose(name, (time_s - starts_s).max(0.0)));
                    recording.add_scene(time_s, scene, pose)?;
                }
            }
        }
        Ok(recording)
    }
}

const GREY: [f64; 4] = [0.75, 0.76, 0.78, 1.0];
const ORANGE: [f64; 4] = [0.9, 0.45, 0.1, 1.0];
const BLUE: [f64; 4] = [0.3, 0.5, 0.75, 1.0];

fn stamp(time_s: f64) -> Value {
    let ns = (time_s.max(0.0) * 1e9).round() as u64;
    json!({ "sec": ns / 1_000_000_000, "nsec": ns % 1_000_000_000 })
}

fn xyz(v: &Vector3<f64>) -> Value {
    json!({ "x": v.x, "y": v.y, "z": v.z })
}

fn quaternion(rotation: &Rotation3<f64>) -> Value {
    let q = UnitQuaternion::from_rotation_matrix(rotation);
    json!({ "x": q.i, "y": q.j, "z": q.k, "w": q.w })
}

fn color([r, g, b, a]: [f64; 4]) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}

fn pose(frame: &Frame) -> Value {
    json!({ "position": xyz(&frame.translation.vector), "orientation": quaternion(&frame.rotation) })
}

fn transform(stamp: &Value, parent: &str, child: &str, parent_from_child: &Frame) -> Value {
    json!({
        "timestamp": stamp, "parent_frame_id": parent, "child_frame_id": child,
        "translation": xyz(&parent_from_child.translation.vector),
        "rotation": quaternion(&parent_from_child.rotation),
    })
}

/// A scene entity with some of its lists of shapes filled.
fn entity(time_s: f64, frame: &str, id: &str, shapes: &Value) -> Value {
    let mut entity = json!({
        "timestamp": stamp(time_s), "frame_id": frame, "id": id, "lifetime": { "sec": 0, "nsec": 0 },
        "frame_locked": true, "metadata": [], "arrows": [], "cubes": [], "spheres": [], "cylinders": [], "lines": [],
        "triangles": [], "texts": [], "models": [],
    });
    for (list, content) in shapes.as_object().into_iter().flatten() {
        entity[list] = content.clone();
    }
    entity
}

fn cylinder(capsule: &Capsule, tint: [f64; 4]) -> Value {
    let along = capsule.to_m - capsule.from_m;
    let rotation = Rotation3::rotation_between(&Vector3::z(), &along).unwrap_or_else(Rotation3::identity);
    let middle = Frame::from_parts(((capsule.from_m + capsule.to_m) / 2.0).into(), rotation);
    let size = Vector3::new(
        2.0 * capsule.radius_m,
        2.0 * capsule.radius_m,
        along.norm().max(capsule.radius_m / 2.0),
    );
    json!({ "pose": pose(&middle), "size": xyz(&size), "bottom_scale": 1.0, "top_scale": 1.0, "color": color(tint) })
}

/// An object on the table: a cylinder, or the triangles of a prism.
fn prism(shape: &Shape, height_m: f64, at: Pose) -> Value {
    if let Shape::Disc { radius_m } = shape {
        let foot = Vector3::new(at.position.x, at.position.y, 0.0);
        let disc = Capsule { from_m: foot, to_m: foot + Vector3::z() * height_m, radius_m: *radius_m };
        return json!({ "cylinders": [cylinder(&disc, BLUE)] });
    }
    let corners: Vec<_> = shape.corners().into_iter().map(|corner| at.table_from_body(corner)).collect();
    let n = corners.len();
    let mut points = Vec::new();
    for k in 0..n {
        let (p, q) = (corners[k], corners[(k + 1) % n]);
        let corner = |x: f64, y: f64, z: f64| xyz(&Vector3::new(x, y, z));
        let (low, high) = (0.0, height_m);
        points.extend([corner(p.x, p.y, low), corner(q.x, q.y, low), corner(q.x, q.y, high)]);
        points.extend([corner(p.x, p.y, low), corner(q.x, q.y, high), corner(p.x, p.y, high)]);
        // The top as a fan about the centroid, exact for star-shaped outlines.
        points.extend([
            corner(at.position.x, at.position.y, high),
            corner(p.x, p.y, high),
            corner(q.x, q.y, high),
        ]);
    }
    let origin = pose(&Frame::identity());
    json!({ "triangles": [{ "pose": origin, "points": points, "color": color(BLUE), "colors": [], "indices": [] }] })
}
