//! The arm: links, joints, limits, tool.

use super::capsule::Capsule;
use super::frame::Frame;
use super::inertia::{Body, doubt};
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Translation3, UnitVector3, Vector3};

/// A serial arm of six or seven turning joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Its name.
    pub name: String,
    /// What stands still.
    pub base: Base,
    /// What moves, from the base to the flange; all that is fixed to a moving link is part of it.
    pub links: Vec<Link>,
    /// The frame that the tool is screwed to, in the last link's frame.
    pub last_from_flange: Frame,
    /// That frame's name.
    pub flange: String,
    /// What is screwed to it.
    pub tool: Tool,
    /// Gravity in the base frame (m/s2).
    pub gravity_m_s2: Vector3<f64>,
    /// What a user should know about the model, such as an inertia that cannot be.
    pub warnings: Vec<String>,
}

/// The part of an arm that stands still.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// The root link's name; its frame is the base frame.
    pub name: String,
    /// What it weighs.
    pub body: Body,
    /// What it fills.
    pub capsules: Vec<Capsule>,
}

/// A moving link and the joint that moves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// The joint between it and the link before it; its frame is the link's frame.
    pub joint: Joint,
    /// What it weighs.
    pub body: Body,
    /// What it fills.
    pub capsules: Vec<Capsule>,
}

/// A turning joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Where it sits, at angle zero, in the frame of the link before it.
    pub parent_from_joint: Frame,
    /// What it turns about, in its own frame.
    pub axis: UnitVector3<f64>,
    /// Its least and largest angle (rad); infinite for a joint that turns for ever.
    pub range_rad: [f64; 2],
    /// Its largest speed (rad/s).
    pub speed_rad_s: f64,
    /// Its largest torque (N m).
    pub torque_n_m: f64,
    /// Its rotor's inertia as felt at the joint (kg m2): the rotor's own times the gear ratio squared.
    pub armature_kg_m2: f64,
}

/// What is screwed to the flange: the striker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Its tip in the flange's frame (m).
    pub offset_m: Vector3<f64>,
    /// Its mass (kg), thought to be spread evenly from the flange to the tip.
    pub mass_kg: f64,
}

impl Tool {
    /// No tool: the tip is the flange.
    pub fn none() -> Self {
        Self { offset_m: Vector3::zeros(), mass_kg: 0.0 }
    }

    /// A thin rod from the flange to the tip, in the flange's frame.
    fn body(&self) -> Body {
        let along = self.offset_m * self.offset_m.transpose();
        let across = Matrix3::identity() * self.offset_m.norm_squared() - along;
        Body {
            mass_kg: self.mass_kg,
            com_m: self.offset_m / 2.0,
            inertia_kg_m2: across * (self.mass_kg / 12.0),
        }
    }
}

impl Arm {
    /// How many joints it has.
    pub fn joint_count(&self) -> usize {
        self.links.len()
    }

    /// The joints' names, from the base on.
    pub fn joint_names(&self) -> Vec<String> {
        self.links.iter().map(|link| link.joint.name.clone()).collect()
    }

    /// The same arm with another tool.
    ///
    /// # Errors
    /// A mass below zero, numbers that are none.
    pub fn with_tool(mut self, tool: Tool) -> Result<Self> {
        if !(tool.mass_kg >= 0.0 && tool.mass_kg.is_finite()) {
            return Err(Error::invalid(&self.name, "tool_mass_kg", tool.mass_kg, "zero or more kilograms"));
        }
        if !tool.offset_m.iter().all(|x| x.is_finite()) {
            return Err(Error::invalid(&self.name, "tool_offset_m", "not a number", "three numbers"));
        }
        self.tool = tool;
        Ok(self)
    }

    /// The same arm with rotor inertias as felt at the joints (kg m2).
    ///
    /// # Errors
    /// Not one number per joint, or one below zero.
    pub fn with_armature(mut self, armature_kg_m2: &[f64]) -> Result<Self> {
        if armature_kg_m2.len() != self.joint_count() {
            let needed = format!("{}, one per joint", self.joint_count());
            let found = format!("{} numbers", armature_kg_m2.len());
            return Err(Error::invalid(&self.name, "armature_kg_m2", found, needed));
        }
        for (link, &armature) in self.links.iter_mut().zip(armature_kg_m2) {
            if !(armature >= 0.0 && armature.is_finite()) {
                let owner = format!("{}: joint `{}`", self.name, link.joint.name);
                return Err(Error::invalid(owner, "armature_kg_m2", armature, "zero or more"));
            }
            link.joint.armature_kg_m2 = armature;
        }
        Ok(self)
    }

    /// The tip's frame in the last link's frame.
    pub(crate) fn last_from_tip(&self) -> Frame {
        self.last_from_flange * Translation3::from(self.tool.offset_m)
    }

    /// A link's body with all it carries.
    pub(crate) fn moving_body(&self, link: usize) -> Body {
        let body = self.links[link].body;
        if link + 1 < self.links.len() || self.tool.mass_kg <= 0.0 {
            return body;
        }
        body.joined(&self.tool.body().seen_from(&self.last_from_flange))
    }

    /// What all its links weigh together, without the tool (kg).
    pub fn mass_kg(&self) -> f64 {
        self.base.body.mass_kg + self.links.iter().map(|link| link.body.mass_kg).sum::<f64>()
    }

    /// One sentence for each moving link whose inertia cannot be or is hard to believe.
    pub(crate) fn inertia_warnings(&self) -> Vec<String> {
        let doubts = (0..self.links.len()).filter_map(|k| {
            let (low, high) = self.extent(k);
            doubt(&self.links[k].body, &low, &high)
                .map(|doubt| format!("arm `{}`: link `{}`: {doubt}", self.name, self.links[k].name))
        });
        doubts.collect()
    }

    /// The box that a link fills, as far as is known: its capsules, its joints and its centre of mass.
    fn extent(&self, link: usize) -> (Vector3<f64>, Vector3<f64>) {
        let next =
            self.links.get(link + 1).map_or(self.last_from_flange, |next| next.joint.parent_from_joint);
        let body = self.links[link].body;
        // Shapes are often incomplete; where the centre of mass is, there is some mass around it.
        let around = Vector3::repeat(ASSUMED_LINK_RADIUS_M);
        let points = [Vector3::zeros(), next.translation.vector, body.com_m - around, body.com_m + around];
        let mut low = points.iter().fold(Vector3::repeat(f64::MAX), |low, p| low.inf(p));
        let mut high = points.iter().fold(Vector3::repeat(f64::MIN), |high, p| high.sup(p));
        for capsule in &self.links[link].capsules {
            // Flat ends: most capsules stand for cylinders.
            let along = (capsule.to_m - capsule.from_m).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            let radius = along.map(|part| capsule.radius_m * (1.0 - part * part).max(0.0).sqrt());
            low = low.inf(&(capsule.from_m.inf(&capsule.to_m) - radius));
            high = high.sup(&(capsule.from_m.sup(&capsule.to_m) + radius));
        }
        (low, high)
    }

    /// Capsules for a link of which no shape is known: from its joint over its centre of mass to the next joint.
    pub(crate) fn assumed_capsules(body: &Body, next: &Frame) -> Vec<Capsule> {
        let middle = if body.mass_kg > 0.0 { body.com_m } else { next.translation.vector / 2.0 };
        let ends = [Vector3::zeros(), middle, next.translation.vector];
        ends.windows(2)
            .map(|pair| Capsule { from_m: pair[0], to_m: pair[1], radius_m: ASSUMED_LINK_RADIUS_M })
            .collect()
    }
}

/// How thick a link is whose shape no file tells (m): arms of table size are 0.10 to 0.15 m across.
const ASSUMED_LINK_RADIUS_M: f64 = 0.06;

/// The standard value (m/s2), as the simulators use it.
pub(crate) const GRAVITY_M_S2: f64 = 9.81;
