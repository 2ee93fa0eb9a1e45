//! The built-in model of Neuromeka's Indy 7, first and second generation.
//!
//! Frames, limits and inertias are facts from `indy_description` of neuromeka-robotics/indy-ros2 (2023-08, BSD-3-Clause),
//! `urdf/config/indy7*/{kinematics,physical_parameters,joint_limits}.yaml`; the link shapes of the first generation
//! from `indy7_simplified.urdf` of neuromeka-robotics/neuromeka-isaac (2025-03, Apache-2.0).
//!
//! The controller's own kinematics puts the tip 0.5 mm higher than these frames (its base is 0.3000 m, not
//! 0.0775 + 0.222 m, high).

use super::capsule::Capsule;
use super::frame::{Frame, frame};
use super::inertia::{LinkInertia, about_com};
use super::serial_arm::{Arm, Base, GRAVITY_M_S2, Joint, Link, Tool};
use nalgebra::{Matrix3, Vector3};

/// Mass (kg), centre of mass (m), tensor ixx iyy izz ixy iyz ixz (kg m2) as published.
type Published = (f64, [f64; 3], [f64; 6]);
/// Position (m) and roll, pitch, yaw (rad) of a joint in the previous link's frame.
type Placement = ([f64; 3], [f64; 3]);
/// A capsule: its link (0 is the base), its ends (m) and its radius (m).
type Shape = (usize, [f64; 3], [f64; 3], f64);

/// A right angle with the digits of the published files.
#[allow(clippy::approx_constant)]
const RIGHT: f64 = 1.570796327;
/// 180 degrees with the digits of the published files.
#[allow(clippy::approx_constant)]
const STRAIGHT: f64 = 3.1415926536;

#[rustfmt::skip]
const BODIES_V1: [Published; 7] = [
    (1.6703078, [0.00131966, -0.00000218, 0.03212832], [0.00661309, 0.00644765, 0.00792090, 0.00000183, -0.00000027, 0.00002695]),
    (11.44444535, [-0.00023749, -0.04310313, 0.13245396], [0.35065005, 0.30479800, 0.06003147, 0.00011931, -0.10984447, -0.00037553]),
    (5.84766553, [-0.29616699, 0.00002254, 0.04483069], [0.03599743, 0.72293306, 0.70024119, -0.00004693, 0.00000176, -0.05240346]),
    (2.68206064, [-0.16804016, 0.00021421, -0.07000383], [0.01617210, 0.11364055, 0.10022522, -0.00011817, -0.00004371, 0.03341882]),
    (2.12987371, [-0.00026847, -0.07098440, 0.07649128], [0.02798891, 0.01443076, 0.01496211, 0.00003893, -0.01266296, -0.00004768]),
    (2.22412271, [-0.09796232, -0.00023114, 0.06445892], [0.01105297, 0.03698291, 0.02754795, 0.00005517, -0.00003740, -0.01481977]),
    (0.38254932, [0.00008147, -0.00046556, 0.03079097], [0.00078982, 0.00079764, 0.00058319, -0.00000034, -0.00000508, 0.00000083]),
];

#[rustfmt::skip]
const BODIES_V2: [Published; 7] = [
    (1.66957888, [0.00133032, -0.00000218, 0.03163661], [0.00655829, 0.00639165, 0.00791712, 0.00000183, -0.00000027, 0.00002634]),
    (11.43955917, [-0.00027386, -0.04348767, 0.13216705], [0.35097123, 0.30435880, 0.06048047, 0.00013006, -0.11072619, -0.00042705]),
    (6.11383823, [-0.00010864, 0.29071865, 0.04588251], [0.74655601, 0.03850444, 0.72200046, -0.00032714, 0.05314531, 0.00000481]),
    (2.68211719, [0.00006691, -0.16802208, -0.07025671], [0.11373278, 0.01627234, 0.10021441, -0.00003686, 0.03355709, -0.00001286]),
    (2.12830848, [-0.00026808, -0.07105971, 0.07645329], [0.02795227, 0.01439850, 0.01495514, 0.00003938, -0.01265087, -0.00004713]),
    (2.32413397, [-0.00022538, -0.00354123, 0.07650762], [0.01771876, 0.01593616, 0.00358348, 0.00000904, -0.00069656, -0.00004336]),
    (0.39652271, [0.0, -0.00071501, 0.03219123], [0.00077839, 0.00076561, 0.00051275, 0.00000026, -0.00000699, 0.0]),
];

#[rustfmt::skip]
const PLACEMENTS_V1: [Placement; 6] = [
    ([0.0, 0.0, 0.0775], [0.0, 0.0, 0.0]),
    ([0.0, -0.109, 0.222], [RIGHT, RIGHT, 0.0]),
    ([-0.45, 0.0, -0.0305], [0.0, 0.0, 0.0]),
    ([-0.267, 0.0, -0.075], [-RIGHT, 0.0, RIGHT]),
    ([0.0, -0.114, 0.083], [RIGHT, RIGHT, 0.0]),
    ([-0.168, 0.0, 0.069], [-RIGHT, 0.0, RIGHT]),
];

#[rustfmt::skip]
const PLACEMENTS_V2: [Placement; 6] = [
    ([0.0, 0.0, 0.0775], [0.0, 0.0, 0.0]),
    ([0.0, -0.109, 0.222], [RIGHT, 0.0, 0.0]),
    ([0.0, 0.45, -0.0305], [0.0, 0.0, STRAIGHT]),
    ([0.0, -0.267, -0.075], [-RIGHT, 0.0, STRAIGHT]),
    ([0.0, -0.114, 0.0835], [RIGHT, 0.0, 0.0]),
    ([0.0, 0.052, 0.085], [-RIGHT, 0.0, 0.0]),
];

#[rustfmt::skip]
const SHAPES_V1: [Shape; 9] = [
    (0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.077], 0.11),
    (1, [0.0, 0.0, 0.0], [0.0, 0.0, 0.15], 0.075),
    (1, [0.0, 0.045, 0.225], [0.0, -0.045, 0.225], 0.075),
    (2, [-0.06, 0.0, 0.075], [-0.36, 0.0, 0.075], 0.075),
    (3, [0.0, 0.0, -0.025], [0.0, 0.0, 0.025], 0.05),
    (3, [-0.065, 0.0, -0.075], [-0.285, 0.0, -0.075], 0.05),
    (4, [0.0, 0.0, 0.08], [0.0, -0.13, 0.08], 0.05),
    (5, [0.045, 0.0, 0.07], [-0.165, 0.0, 0.07], 0.05),
    (6, [0.0, 0.0, 0.0], [0.0, 0.0, 0.06], 0.05),
];

/// Largest angle to either side (deg), speed (deg/s) and torque (N m) of each joint.
const LIMITS: [(f64, f64, f64); 6] = [
    (175.0, 150.0, 431.97),
    (175.0, 150.0, 431.97),
    (175.0, 150.0, 197.23),
    (175.0, 180.0, 79.79),
    (175.0, 180.0, 79.79),
    (215.0, 180.0, 79.79),
];

/// The flange's face in the last link's frame (m).
const FLANGE_M: [f64; 3] = [0.0, 0.0, 0.06];

/// The model of a name; `None` for an unknown one.
pub(crate) fn arm(name: &str) -> Option<Arm> {
    let (bodies, placements) = match name {
        "indy7" | "indy7_published" => (&BODIES_V1, &PLACEMENTS_V1),
        "indy7_v2" | "indy7_v2_published" => (&BODIES_V2, &PLACEMENTS_V2),
        _ => return None,
    };
    let is_published = name.ends_with("_published");
    let body = |k: usize| if is_published { published(&bodies[k]) } else { corrected(&bodies[k]) };
    let flange = frame(FLANGE_M, [0.0; 3]);
    let placement = |k: usize| placements.get(k).map_or(flange, |&(position, rpy)| frame(position, rpy));
    let links = (0..6).map(|k| Link {
        name: format!("link{}", k + 1),
        joint: joint(k, placement(k)),
        inertia: body(k + 1),
        capsules: match shapes(name, k + 1) {
            known if known.is_empty() => Arm::assumed_capsules(&body(k + 1), &placement(k + 1)),
            known => known,
        },
    });
    let mut arm = Arm {
        name: name.into(),
        base: Base { name: "link0".into(), inertia: body(0), capsules: shapes("indy7", 0) },
        links: links.collect(),
        last_from_flange: flange,
        flange: "tcp".into(),
        tool: Tool::none(),
        gravity_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2),
        warnings: Vec::new(),
    };
    arm.warnings = arm.inertia_warnings();
    Some(arm)
}

fn joint(k: usize, parent_from_joint: Frame) -> Joint {
    let (range_deg, speed_deg_s, torque_n_m) = LIMITS[k];
    Joint {
        name: format!("joint{k}"),
        parent_from_joint,
        axis: Vector3::z_axis(),
        range_rad: [-range_deg.to_radians(), range_deg.to_radians()],
        speed_rad_s: speed_deg_s.to_radians(),
        torque_n_m,
        armature_kg_m2: 0.0,
    }
}

/// The shapes of the second generation's links were not published; its base and first link are those of the first generation.
fn shapes(name: &str, link: usize) -> Vec<Capsule> {
    let known = !name.starts_with("indy7_v2") || link < 2;
    let capsules = SHAPES_V1.iter().filter(|shape| known && shape.0 == link);
    capsules
        .map(|&(_, from, to, radius_m)| Capsule { from_m: from.into(), to_m: to.into(), radius_m })
        .collect()
}

fn published(&(mass_kg, com, [xx, yy, zz, xy, yz, xz]): &Published) -> LinkInertia {
    let inertia_kg_m2 = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    LinkInertia { mass_kg, com_m: com.into(), inertia_kg_m2 }
}

/// The published body with its tensor converted to the centre of mass, rounded to the eight digits of the published one.
fn corrected(numbers: &Published) -> LinkInertia {
    let body = published(numbers);
    let tensor = about_com(&body.inertia_kg_m2, body.mass_kg, &body.com_m);
    LinkInertia { inertia_kg_m2: tensor.map(eight_digits), ..body }
}

fn eight_digits(value: f64) -> f64 {
    format!("{value:.7e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_tensor_of_link_two_agrees_with_a_calculation_by_hand() {
        let tensor = corrected(&BODIES_V1[2]).inertia_kg_m2;
        let by_hand = Matrix3::new(
            0.024244843,
            7.8933009e-6,
            -0.025238162,
            7.8933009e-6,
            0.19825316,
            4.148971e-6,
            -0.025238162,
            4.148971e-6,
            0.18731387,
        );
        let error = (tensor - by_hand).amax();
        assert!(error < 1e-12, "off by {error} kg m2");
    }

    #[test]
    fn the_published_tensors_of_the_long_links_are_implausible_and_the_corrected_ones_are_not() {
        // The shape of the second generation's fifth link is not known; its tensor is plausible for the assumed shape.
        let cases: [(&str, &[&str]); 4] = [
            ("indy7", &[]),
            ("indy7_published", &["link1", "link2", "link3", "link4", "link5"]),
            ("indy7_v2", &[]),
            ("indy7_v2_published", &["link1", "link2", "link3", "link4"]),
        ];
        for (name, expected) in cases {
            let arm = arm(name).expect("built in");
            let links: Vec<&str> = arm.warnings.iter().filter_map(|w| w.split('`').nth(3)).collect();
            assert_eq!(links, expected, "{name}: {:#?}", arm.warnings);
        }
    }

    #[test]
    fn the_masses_add_up_to_the_makers_value() {
        let mass_kg = arm("indy7").expect("built in").mass_kg();
        assert!((mass_kg - 26.38).abs() < 0.005, "{mass_kg} kg");
    }
}
