//! Reading an arm from a URDF, and writing one.
//!
//! Links with inertials and primitive collision shapes, and joints with origin, axis and limits are read; meshes are named in a
//! warning, transmissions and materials are ignored.

use super::capsule::Capsule;
use super::frame::{Frame, frame, rpy_rad};
use super::inertia::LinkInertia;
use super::serial_arm::{Arm, Base, GRAVITY_M_S2, Joint, Link, Tool};
use crate::cell::xml;
use crate::error::bounds::{angle, length, position, positive, zero_or_more};
use crate::error::{Error, Result};
use nalgebra::{Matrix3, UnitVector3, Vector3};
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The kind of a joint.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Motion {
    Fixed,
    Revolute,
    /// Prismatic, floating, or driven by another joint (`mimic`): not part of the arm.
    Other,
}

/// A joint element.
struct JointElement<'a, 'input> {
    node: Node<'a, 'input>,
    name: &'a str,
    child: &'a str,
    motion: Motion,
}

/// The links of the file as a tree.
struct Tree<'a, 'input> {
    file: &'a str,
    links: BTreeMap<&'a str, Node<'a, 'input>>,
    children: BTreeMap<&'a str, Vec<JointElement<'a, 'input>>>,
    root: &'a str,
}

/// A link that revolute and fixed joints connect to the root.
struct End<'t, 'a, 'input> {
    link: &'a str,
    /// The last joint before the link; `None` for the root.
    joint: Option<&'t JointElement<'a, 'input>>,
    /// Index of the link before that joint.
    before: usize,
    /// Number of revolute joints from the root to the link.
    revolute_count: usize,
}

/// Largest number of joints in a file: a humanoid robot has about a hundred.
const MOST_JOINTS: usize = 1000;
/// Largest number of collision shapes in a file, meshes included.
const MOST_SHAPES: usize = 5000;
/// Number of names in a message.
const NAMES_SHOWN: usize = 5;

/// The first names of a list, and how many more there are.
fn named(names: &[&str]) -> String {
    let more = names.len().saturating_sub(NAMES_SHOWN);
    let shown = format!("{:?}", &names[..names.len() - more]);
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}

/// Common names of the flange, the most common first.
const COMMON_FLANGES: [&str; 6] = ["tcp", "tool0", "hand_tcp", "flange", "ee_link", "tool"];

/// The arm of a URDF, from its root to the link `flange`, or to the outermost link if it is unique.
///
/// # Errors
/// Not a URDF, a xacro file, more links, joints or shapes than a robot has, not one root, not six or seven revolute joints, joints without limits; the message starts
/// with `file`.
pub(crate) fn arm(text: &str, file: &str, flange: Option<&str>) -> Result<Arm> {
    let document = xml::document(text, file)?;
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        return Err(syntax(
            file,
            format!("its root is <{}>; needed: a URDF's <robot>", robot.tag_name().name()),
        ));
    }
    if robot.descendants().any(|node| node.tag_name().namespace().is_some_and(|ns| ns.contains("xacro"))) {
        let problem =
            "it is a xacro file; needed: a plain URDF (`ros2 run xacro xacro arm.xacro > arm.urdf`)";
        return Err(syntax(file, problem.into()));
    }
    let tree = Tree::read(robot, file)?;
    let chain = tree.chain(flange)?;
    let mut arm = tree.assembled(robot.attribute("name").unwrap_or("arm"), &chain)?;
    arm.warnings.extend(arm.inertia_warnings());
    Ok(arm)
}

fn syntax(file: &str, problem: String) -> Error {
    Error::Syntax { path: file.into(), problem }
}

fn child<'a, 'input>(node: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    node.children().find(|child| child.has_tag_name(tag))
}

impl<'a, 'input> Tree<'a, 'input> {
    fn read(robot: Node<'a, 'input>, file: &'a str) -> Result<Self> {
        let count = |tag: &str| robot.descendants().filter(|node| node.has_tag_name(tag)).count();
        for (tag, what, most) in [
            ("link", "links", MOST_JOINTS + 1),
            ("joint", "joints", MOST_JOINTS),
            ("collision", "collision shapes", MOST_SHAPES),
        ] {
            let found = count(tag);
            if found > most {
                return Err(Error::invalid(
                    file,
                    format!("its number of {what}"),
                    found,
                    format!("at most {most}"),
                ));
            }
        }
        let mut links = BTreeMap::new();
        for node in robot.children().filter(|node| node.has_tag_name("link")) {
            let name = attribute(file, node, "name")?;
            if links.insert(name, node).is_some() {
                return Err(syntax(file, format!("link `{name}` is given twice; needed: every link once")));
            }
        }
        let mut children: BTreeMap<&str, Vec<JointElement>> = BTreeMap::new();
        let mut parents: BTreeMap<&str, &str> = BTreeMap::new();
        for node in robot.children().filter(|node| node.has_tag_name("joint")) {
            let name = attribute(file, node, "name")?;
            let end = |tag: &str| -> Result<&'a str> {
                let link = child(node, tag).and_then(|node| node.attribute("link"));
                link.filter(|link| links.contains_key(link)).ok_or_else(|| {
                    syntax(
                        file,
                        format!("joint `{name}`: its <{tag}> is not a link of the file; needed: link=\"..\""),
                    )
                })
            };
            let (parent, child_link) = (end("parent")?, end("child")?);
            if let Some(other) = parents.insert(child_link, parent) {
                let problem = format!(
                    "link `{child_link}` has the parents `{other}` and `{parent}`; needed: one parent"
                );
                return Err(syntax(file, problem));
            }
            let motion = match node.attribute("type") {
                Some("fixed") => Motion::Fixed,
                Some("revolute" | "continuous") if child(node, "mimic").is_none() => Motion::Revolute,
                _ => Motion::Other,
            };
            children.entry(parent).or_default().push(JointElement { node, name, child: child_link, motion });
        }
        let roots: Vec<&str> = links.keys().copied().filter(|link| !parents.contains_key(link)).collect();
        let &[root] = &roots[..] else {
            let problem =
                format!("{} links have no parent: {}; needed: one root", roots.len(), named(&roots));
            return Err(syntax(file, problem));
        };
        Ok(Self { file, links, children, root })
    }

    fn joints_of(&self, link: &str) -> &[JointElement<'a, 'input>] {
        self.children.get(link).map_or(&[], Vec::as_slice)
    }

    /// The joints from the root to the flange.
    fn chain(&self, flange: Option<&str>) -> Result<Vec<&JointElement<'a, 'input>>> {
        let mut ends = self.ends();
        if let Some(flange) = flange {
            let end = ends.iter().position(|end| end.link == flange).ok_or_else(|| {
                syntax(
                    self.file,
                    format!("no link `{flange}` is connected to the root by revolute and fixed joints"),
                )
            })?;
            return Ok(Self::chain_to(&ends, end));
        }
        let most = ends.iter().map(|end| end.revolute_count).max().unwrap_or(0);
        let is_candidate = |end: &End| end.revolute_count == most && self.is_outermost(end.link);
        let candidates: Vec<usize> = (0..ends.len()).filter(|&k| is_candidate(&ends[k])).collect();
        let is_named = |end: &End, name| end.link.trim_start_matches(['/', '_']).ends_with(name);
        let common = COMMON_FLANGES
            .iter()
            .find_map(|name| candidates.iter().copied().find(|&k| is_named(&ends[k], name)));
        match (common, &candidates[..]) {
            (Some(end), _) | (None, &[end]) => Ok(Self::chain_to(&ends, end)),
            _ => {
                ends.retain(is_candidate);
                let names: Vec<&str> = ends.iter().map(|end| end.link).collect();
                let found = named(&names);
                let problem =
                    format!("the flange may be any of {found}; needed: `flange = \"..\"` in [robot]");
                Err(syntax(self.file, problem))
            }
        }
    }

    /// The links that revolute and fixed joints connect to the root, each after the one before it.
    fn ends<'t>(&'t self) -> Vec<End<'t, 'a, 'input>> {
        let mut ends: Vec<End> = Vec::new();
        let mut waiting = vec![End { link: self.root, joint: None, before: 0, revolute_count: 0 }];
        while let Some(end) = waiting.pop() {
            let (link, revolute_count, before) = (end.link, end.revolute_count, ends.len());
            ends.push(end);
            for joint in self.joints_of(link).iter().rev().filter(|joint| joint.motion != Motion::Other) {
                let revolute_count = revolute_count + usize::from(joint.motion == Motion::Revolute);
                waiting.push(End { link: joint.child, joint: Some(joint), before, revolute_count });
            }
        }
        ends
    }

    /// The joints from the root to an end.
    fn chain_to<'t>(ends: &[End<'t, 'a, 'input>], mut end: usize) -> Vec<&'t JointElement<'a, 'input>> {
        let mut chain = Vec::new();
        while let Some(joint) = ends[end].joint {
            chain.push(joint);
            end = ends[end].before;
        }
        chain.reverse();
        chain
    }

    fn is_outermost(&self, link: &str) -> bool {
        self.joints_of(link).iter().all(|joint| joint.motion == Motion::Other)
    }

    /// The arm along a chain. Other branches are fixed in their position at joint angle zero.
    fn assembled(&self, name: &str, chain: &[&JointElement]) -> Result<Arm> {
        let mut arm = Arm {
            name: name.into(),
            base: Base { name: self.root.into(), inertia: LinkInertia::none(), capsules: Vec::new() },
            links: Vec::new(),
            last_from_flange: Frame::identity(),
            flange: chain.last().map_or(self.root, |joint| joint.child).into(),
            tool: Tool::none(),
            gravity_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2),
            warnings: Vec::new(),
        };
        let mut carried = Carried::default();
        let mut link = self.root;
        for joint in chain {
            self.carry(link, arm.last_from_flange, Some(joint.child), &mut carried)?;
            let here = arm.last_from_flange * origin(self.file, joint.node)?;
            if joint.motion == Motion::Revolute {
                carried.assign_to(&mut arm, &here);
                arm.links.push(self.moving_link(joint, here)?);
                arm.last_from_flange = Frame::identity();
            } else {
                arm.last_from_flange = here;
            }
            link = joint.child;
        }
        self.carry(link, arm.last_from_flange, None, &mut carried)?;
        let last_from_flange = arm.last_from_flange;
        carried.assign_to(&mut arm, &last_from_flange);
        arm.warnings = carried.notes;
        arm.warnings.extend(mesh_warning(self.file, &carried.meshes));
        if !(6..=7).contains(&arm.links.len()) {
            let found =
                format!("{} revolute joints from `{}` to `{}`", arm.links.len(), self.root, arm.flange);
            let owner = self.file.to_owned();
            return Err(Error::invalid(owner, "the arm", found, "six or seven"));
        }
        Ok(arm)
    }

    fn moving_link(&self, joint: &JointElement, parent_from_joint: Frame) -> Result<Link> {
        let owner = format!("{}: joint `{}`", self.file, joint.name);
        let limit = child(joint.node, "limit");
        let number = |name: &str| -> Result<f64> {
            let text = limit
                .and_then(|limit| limit.attribute(name))
                .ok_or_else(|| Error::invalid(&owner, format!("limit {name}"), "missing", "a number"))?;
            numbers::<1>(self.file, text).map(|[value]| value)
        };
        let continuous = joint.node.attribute("type") == Some("continuous");
        let range_rad = if continuous {
            [f64::NEG_INFINITY, f64::INFINITY]
        } else {
            [number("lower")?, number("upper")?]
        };
        if range_rad[0] >= range_rad[1] {
            let found = format!("from {} to {} rad", range_rad[0], range_rad[1]);
            return Err(Error::invalid(owner, "its range", found, "the lower limit below the upper one"));
        }
        let (speed_rad_s, torque_n_m) = (number("velocity")?, number("effort")?);
        for (what, value) in [("limit velocity", speed_rad_s), ("limit effort", torque_n_m)] {
            positive(&owner, what, value)?;
        }
        let axis = match child(joint.node, "axis").and_then(|node| node.attribute("xyz")) {
            Some(text) => Vector3::from(numbers::<3>(self.file, text)?),
            None => Vector3::x(),
        };
        let axis = UnitVector3::try_new(axis, f64::EPSILON)
            .ok_or_else(|| Error::invalid(&owner, "its axis", "of zero length", "a direction"))?;
        let joint_name = joint.name.into();
        let joint_limits = Joint {
            name: joint_name,
            parent_from_joint,
            axis,
            range_rad,
            speed_rad_s,
            torque_n_m,
            armature_kg_m2: 0.0,
        };
        Ok(Link {
            name: joint.child.into(),
            joint: joint_limits,
            inertia: LinkInertia::none(),
            capsules: Vec::new(),
        })
    }

    /// Adds a link and its descendants, except the branch to `onward`, to the bodies carried by a moving link.
    fn carry(&self, link: &str, at: Frame, onward: Option<&str>, carried: &mut Carried) -> Result<()> {
        let mut waiting = vec![(link, at, None)];
        while let Some((link, before, joint)) = waiting.pop() {
            let joint: Option<&JointElement> = joint;
            let at = match joint {
                Some(joint) => before * origin(self.file, joint.node)?,
                None => before,
            };
            if let Some(joint) = joint.filter(|joint| joint.motion != Motion::Fixed) {
                let note = format!("joint `{}` is not part of the arm and stays at zero", joint.name);
                carried.notes.push(note);
            }
            let node = self.links[link];
            carried.inertia = carried.inertia.joined(&inertial(self.file, node, link)?.transformed(&at));
            for collision in node.children().filter(|node| node.has_tag_name("collision")) {
                let shape_at = at * origin(self.file, collision)?;
                match shape(self.file, collision)? {
                    Shape::Capsule(capsule) => carried.capsules.push(capsule.transformed(&shape_at)),
                    Shape::Unread(file) => {
                        carried.has_unread = true;
                        carried.meshes.extend(file.map(str::to_owned));
                    }
                }
            }
            let onward = if joint.is_none() { onward } else { None };
            let branches = self.joints_of(link).iter().rev().filter(|joint| Some(joint.child) != onward);
            waiting.extend(branches.map(|joint| (joint.child, at, Some(joint))));
        }
        Ok(())
    }
}

/// The warning that names the meshes, which are not read, and their packages.
fn mesh_warning(file: &str, meshes: &BTreeSet<String>) -> Option<String> {
    let packages = meshes.iter().filter_map(|mesh| mesh.strip_prefix("package://")?.split('/').next());
    let packages: Vec<&str> = packages.collect::<BTreeSet<_>>().into_iter().collect();
    let meshes: Vec<&str> = meshes.iter().map(String::as_str).collect();
    let of_packages =
        if packages.is_empty() { String::new() } else { format!(" (packages {})", named(&packages)) };
    (!meshes.is_empty()).then(|| {
        format!(
            "{file}: the meshes {}{of_packages} are not read: their links count as 12 cm thick beside their other shapes",
            named(&meshes)
        )
    })
}

/// The bodies and shapes fixed to the current link.
#[derive(Default)]
struct Carried {
    inertia: LinkInertia,
    capsules: Vec<Capsule>,
    /// Whether the current link has a shape that is not read.
    has_unread: bool,
    notes: Vec<String>,
    /// The files of the meshes of all links so far.
    meshes: BTreeSet<String>,
}

impl Carried {
    /// Moves everything to the arm's outermost moving link, or to its base; `next` is the frame of the next joint.
    fn assign_to(&mut self, arm: &mut Arm, next: &Frame) {
        let body = std::mem::take(&mut self.inertia);
        let mut capsules = std::mem::take(&mut self.capsules);
        // A mesh beside a primitive shape may be larger than that.
        if std::mem::take(&mut self.has_unread) || capsules.is_empty() {
            capsules.extend(Arm::assumed_capsules(&body, next));
        }
        if let Some(link) = arm.links.last_mut() {
            (link.inertia, link.capsules) = (body, capsules);
        } else {
            (arm.base.inertia, arm.base.capsules) = (body, capsules);
        }
    }
}

/// A collision shape.
enum Shape<'a> {
    /// The capsule around a primitive shape.
    Capsule(Capsule),
    /// A mesh with its file, or what the format does not have.
    Unread(Option<&'a str>),
}

fn shape<'a>(file: &str, collision: Node<'a, '_>) -> Result<Shape<'a>> {
    let shape = child(collision, "geometry").and_then(|geometry| geometry.children().find(Node::is_element));
    let Some(shape) = shape else { return Ok(Shape::Unread(None)) };
    let of_shape = |name: &str| format!("`{name}` of a collision shape");
    let number = |name: &str| -> Result<f64> {
        let [value] = numbers(file, attribute(file, shape, name)?)?;
        length(file, &of_shape(name), value).map(|()| value)
    };
    let (half, radius_m) = match shape.tag_name().name() {
        "sphere" => (Vector3::zeros(), number("radius")?),
        // The caps extend past the cylinder's ends, which is conservative.
        "cylinder" | "capsule" => (Vector3::z() * (number("length")? / 2.0), number("radius")?),
        "box" => {
            let size = Vector3::from(numbers::<3>(file, attribute(file, shape, "size")?)?);
            size.iter().try_for_each(|side_m| length(file, &of_shape("size"), *side_m))?;
            let long = size.imax();
            let mut across = size;
            across[long] = 0.0;
            (Vector3::ith(long, size[long] / 2.0), across.norm() / 2.0)
        }
        _ => return Ok(Shape::Unread(shape.attribute("filename"))),
    };
    Ok(Shape::Capsule(Capsule { from_m: -half, to_m: half, radius_m }))
}

fn inertial(file: &str, link: Node, name: &str) -> Result<LinkInertia> {
    let Some(node) = child(link, "inertial") else { return Ok(LinkInertia::none()) };
    let part = |tag: &str| {
        child(node, tag).ok_or_else(|| syntax(file, format!("link `{name}`: its <inertial> has no <{tag}>")))
    };
    let [mass_kg] = numbers(file, attribute(file, part("mass")?, "value")?)?;
    zero_or_more(file, &format!("the mass of link `{name}`"), mass_kg, "kilograms")?;
    let tensor = part("inertia")?;
    let moment = |name: &str| -> Result<f64> { Ok(numbers::<1>(file, attribute(file, tensor, name)?)?[0]) };
    let (xx, yy, zz) = (moment("ixx")?, moment("iyy")?, moment("izz")?);
    let (xy, xz, yz) = (moment("ixy")?, moment("ixz")?, moment("iyz")?);
    let inertia_kg_m2 = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    let body = LinkInertia { mass_kg, com_m: Vector3::zeros(), inertia_kg_m2 };
    Ok(body.transformed(&origin(file, node)?))
}

fn origin(file: &str, node: Node) -> Result<Frame> {
    let Some(origin) = child(node, "origin") else { return Ok(Frame::identity()) };
    let triple = |name: &str| origin.attribute(name).map_or(Ok([0.0; 3]), |text| numbers(file, text));
    let (at_m, turns_rad) = (triple("xyz")?, triple("rpy")?);
    position(file, "an origin's `xyz`", &at_m)?;
    turns_rad.iter().try_for_each(|q| angle(file, "an origin's `rpy`", *q))?;
    Ok(frame(at_m, turns_rad))
}

fn attribute<'a>(file: &str, node: Node<'a, '_>, name: &str) -> Result<&'a str> {
    node.attribute(name)
        .ok_or_else(|| syntax(file, format!("<{}> has no `{name}`{}", node.tag_name().name(), line(node))))
}

fn line(node: Node) -> String {
    format!(" (line {})", node.document().text_pos_at(node.range().start).row)
}

fn numbers<const N: usize>(file: &str, text: &str) -> Result<[f64; N]> {
    let parsed: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
    let words = text.split_whitespace().count();
    match <[f64; N]>::try_from(parsed) {
        Ok(values) if words == N && values.iter().all(|value| value.is_finite()) => Ok(values),
        _ => Err(syntax(file, format!("`{text}` where {N} numbers are needed"))),
    }
}

impl Arm {
    /// The arm as a URDF, with the tool as a link after the flange. The format has no rotor inertias.
    pub fn urdf(&self) -> String {
        let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", self.name);
        write_link(&mut text, &self.base.name, &self.base.inertia);
        let mut parent = &self.base.name;
        for (k, link) in self.links.iter().enumerate() {
            write_link(&mut text, &link.name, &self.moving_inertia(k));
            write_joint(&mut text, &link.joint, parent, &link.name);
            parent = &link.name;
        }
        for (name, parent, frame) in [
            (&self.flange, parent, &self.last_from_flange),
            (&"tip".to_owned(), &self.flange, &Frame::from(self.tool_translation())),
        ] {
            let _ = write!(text, "  <link name=\"{name}\"/>\n  <joint name=\"{name}_fixed\" type=\"fixed\">");
            let _ = writeln!(
                text,
                "<parent link=\"{parent}\"/><child link=\"{name}\"/>{}</joint>",
                origin_text(frame)
            );
        }
        text.push_str("</robot>\n");
        text
    }

    fn tool_translation(&self) -> nalgebra::Translation3<f64> {
        self.tool.offset_m.into()
    }
}

fn origin_text(frame: &Frame) -> String {
    let at = frame.translation.vector;
    let [roll, pitch, yaw] = rpy_rad(&frame.rotation);
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", at.x, at.y, at.z)
}

fn write_link(text: &mut String, name: &str, body: &LinkInertia) {
    let _ = write!(text, "  <link name=\"{name}\">");
    if body.mass_kg > 0.0 {
        let at = body.com_m;
        let i = &body.inertia_kg_m2;
        let _ = write!(
            text,
            "<inertial><origin xyz=\"{} {} {}\"/><mass value=\"{}\"/><inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" \
             iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial>",
            at.x,
            at.y,
            at.z,
            body.mass_kg,
            i[(0, 0)],
            i[(0, 1)],
            i[(0, 2)],
            i[(1, 1)],
            i[(1, 2)],
            i[(2, 2)]
        );
    }
    text.push_str("</link>\n");
}

fn write_joint(text: &mut String, joint: &Joint, parent: &str, link: &str) {
    let [lower, upper] = joint.range_rad;
    let (kind, range) = if lower.is_finite() {
        ("revolute", format!("lower=\"{lower}\" upper=\"{upper}\" "))
    } else {
        ("continuous", String::new())
    };
    let _ = writeln!(
        text,
        "  <joint name=\"{}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{link}\"/>{}\
         <axis xyz=\"{} {} {}\"/><limit {range}effort=\"{}\" velocity=\"{}\"/></joint>",
        joint.name,
        origin_text(&joint.parent_from_joint),
        joint.axis.x,
        joint.axis.y,
        joint.axis.z,
        joint.torque_n_m,
        joint.speed_rad_s
    );
}

#[cfg(test)]
mod tests;
