//! The model of a serial arm: links, joints, limits and tool.

use super::capsule::Capsule;
use super::frame::Frame;
use super::inertia::{LinkInertia, implausibility};
use crate::error::{Error, Result};
use nalgebra::{Matrix3, Translation3, UnitVector3, Vector3};

/// A serial arm with six or seven revolute joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// Its name.
    pub name: String,
    /// The fixed base.
    pub base: Base,
    /// The moving links from the base to the flange. Bodies fixed to a moving link are part of it.
    pub links: Vec<Link>,
    /// The flange, which carries the tool, in the last link's frame.
    pub last_from_flange: Frame,
    /// The flange's name.
    pub flange: String,
    /// The tool on the flange.
    pub tool: Tool,
    /// Gravity in the base frame (m/s2).
    pub gravity_m_s2: Vector3<f64>,
    /// Warnings about the model, such as an impossible inertia.
    pub warnings: Vec<String>,
}

/// The fixed base of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// The root link's name; its frame is the base frame.
    pub name: String,
    /// Its inertial parameters.
    pub inertia: LinkInertia,
    /// Its collision shape.
    pub capsules: Vec<Capsule>,
}

/// A moving link and its joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// The joint to the previous link; the joint's frame is the link's frame.
    pub joint: Joint,
    /// Its inertial parameters.
    pub inertia: LinkInertia,
    /// Its collision shape.
    pub capsules: Vec<Capsule>,
}

/// A revolute joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Its frame at angle zero, in the previous link's frame.
    pub parent_from_joint: Frame,
    /// Its axis in its own frame.
    pub axis: UnitVector3<f64>,
    /// Its smallest and largest angle (rad); infinite for a continuous joint.
    pub range_rad: [f64; 2],
    /// Its speed limit (rad/s).
    pub speed_rad_s: f64,
    /// Its torque limit (N m).
    pub torque_n_m: f64,
    /// Its rotor's inertia reflected to the joint (kg m2): the rotor's own inertia times the gear ratio squared.
    pub armature_kg_m2: f64,
}

/// The tool on the flange: the striker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Its tip in the flange's frame (m).
    pub offset_m: Vector3<f64>,
    /// Its mass (kg), modelled as a uniform rod from the flange to the tip.
    pub mass_kg: f64,
}

impl Tool {
    /// No tool; the tip is the flange.
    pub fn none() -> Self {
        Self { offset_m: Vector3::zeros(), mass_kg: 0.0 }
    }

    /// The inertial parameters of a thin rod from the flange to the tip, in the flange's frame.
    fn inertia(&self) -> LinkInertia {
        let along = self.offset_m * self.offset_m.transpose();
        let across = Matrix3::identity() * self.offset_m.norm_squared() - along;
        LinkInertia {
            mass_kg: self.mass_kg,
            com_m: self.offset_m / 2.0,
            inertia_kg_m2: across * (self.mass_kg / 12.0),
        }
    }
}

impl Arm {
    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.links.len()
    }

    /// The joints' names in order from the base.
    pub fn joint_names(&self) -> Vec<String> {
        self.links.iter().map(|link| link.joint.name.clone()).collect()
    }

    /// The same arm with another tool.
    ///
    /// # Errors
    /// A negative mass, or numbers that are not finite.
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

    /// Whether the rotor inertia of any joint is known.
    pub(crate) fn has_rotor_inertias(&self) -> bool {
        self.links.iter().any(|link| link.joint.armature_kg_m2 > 0.0)
    }

    /// The same arm with rotor inertias reflected to the joints (kg m2).
    ///
    /// # Errors
    /// Not one number per joint, or a negative one.
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

    /// A link's inertial parameters, for the last link with the tool.
    pub(crate) fn moving_inertia(&self, link: usize) -> LinkInertia {
        let body = self.links[link].inertia;
        if link + 1 < self.links.len() || self.tool.mass_kg <= 0.0 {
            return body;
        }
        body.joined(&self.tool.inertia().transformed(&self.last_from_flange))
    }

    /// The mass of base and links without the tool (kg).
    pub fn mass_kg(&self) -> f64 {
        self.base.inertia.mass_kg + self.links.iter().map(|link| link.inertia.mass_kg).sum::<f64>()
    }

    /// One sentence for each moving link with impossible or implausible inertial parameters.
    pub(crate) fn inertia_warnings(&self) -> Vec<String> {
        let warnings = (0..self.links.len()).filter_map(|k| {
            let (low, high) = self.extent(k);
            implausibility(&self.links[k].inertia, &low, &high)
                .map(|reason| format!("arm `{}`: link `{}`: {reason}", self.name, self.links[k].name))
        });
        warnings.collect()
    }

    /// The bounding box of a link's capsules, joints and centre of mass (m, link axes).
    fn extent(&self, link: usize) -> (Vector3<f64>, Vector3<f64>) {
        let next =
            self.links.get(link + 1).map_or(self.last_from_flange, |next| next.joint.parent_from_joint);
        let body = self.links[link].inertia;
        // Collision shapes are often incomplete: the centre of mass is surrounded by mass.
        let around = Vector3::repeat(ASSUMED_LINK_RADIUS_M);
        let points = [Vector3::zeros(), next.translation.vector, body.com_m - around, body.com_m + around];
        let mut low = points.iter().fold(Vector3::repeat(f64::MAX), |low, p| low.inf(p));
        let mut high = points.iter().fold(Vector3::repeat(f64::MIN), |high, p| high.sup(p));
        for capsule in &self.links[link].capsules {
            // Most capsules represent cylinders: bound them with flat ends.
            let along = (capsule.to_m - capsule.from_m).try_normalize(0.0).unwrap_or_else(Vector3::zeros);
            let radius = along.map(|cosine| capsule.radius_m * (1.0 - cosine * cosine).max(0.0).sqrt());
            low = low.inf(&(capsule.from_m.inf(&capsule.to_m) - radius));
            high = high.sup(&(capsule.from_m.sup(&capsule.to_m) + radius));
        }
        (low, high)
    }

    /// Capsules for a link without a known shape: from its joint over its centre of mass to the next joint.
    pub(crate) fn assumed_capsules(body: &LinkInertia, next: &Frame) -> Vec<Capsule> {
        let middle = if body.mass_kg > 0.0 { body.com_m } else { next.translation.vector / 2.0 };
        let ends = [Vector3::zeros(), middle, next.translation.vector];
        ends.windows(2)
            .map(|pair| Capsule { from_m: pair[0], to_m: pair[1], radius_m: ASSUMED_LINK_RADIUS_M })
            .collect()
    }
}

/// The radius of a link without a known shape (m): the links of table-size arms are 0.10 to 0.15 m across.
const ASSUMED_LINK_RADIUS_M: f64 = 0.06;

/// Gravitational acceleration (m/s2), as in `physics`.
pub(crate) const GRAVITY_M_S2: f64 = 9.81;
