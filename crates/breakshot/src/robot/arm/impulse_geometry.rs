//! The impulse that the tip can transfer in each direction (Eq. 8, Fig. 10).
//!
//! In a central impact along the unit vector n, an arm transfers to a free object of mass `m_o`, per unit of approach speed, the
//! impulse `(1 + e) / (n' A n)` with `A = J M^-1 J' + E / m_o`: a belted ellipsoid (the *normalized* geometry). Its extremes
//! lie along the eigenvectors of `J M^-1 J'`. The largest impulse is that value times the tip speed that the joints allow in
//! that direction. For objects much lighter than the arm, the speed dominates the dependence on the direction.

use super::ik_solution::IkSolution;
use super::mounted_arm::MountedArm;
use crate::geometry::{Point, Vec2};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

/// The struck object and the limits of the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpulseConditions {
    /// The object's mass (kg); infinite for the contribution of the arm alone.
    pub object_mass_kg: f64,
    /// The coefficient of restitution.
    pub restitution: f64,
    /// The largest permitted strike speed (m/s).
    pub speed_cap_m_s: f64,
}

/// The impulse geometry of one pose of the arm, in the table frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ImpulseGeometry {
    /// The joint angles (rad).
    pub angles_rad: Vec<f64>,
    /// The tip's position (m).
    pub tip_m: [f64; 3],
    /// The origins of base, joints, flange and tip (m).
    pub skeleton_m: Vec<[f64; 3]>,
    /// The mobility `J M^-1 J'` of the tip's point (1/kg).
    pub mobility_per_kg: [[f64; 3]; 3],
    /// The principal directions in space, the largest effective mass first.
    pub principal: [Direction; 3],
    /// The directions of the largest and the smallest effective mass along the table.
    pub along_table: [Direction; 2],
    /// The largest impulse along the table for each heading.
    pub headings: Vec<HeadingImpulse>,
}

/// A direction with the tip's effective mass along it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Direction {
    /// The unit vector.
    pub direction: [f64; 3],
    /// Effective mass (kg).
    pub effective_mass_kg: f64,
    /// Impulse on the object per unit of approach speed (kg).
    pub impulse_per_speed_kg: f64,
}

/// The largest impulse along one heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct HeadingImpulse {
    /// The heading (rad).
    pub heading_rad: f64,
    /// Effective mass (kg).
    pub effective_mass_kg: f64,
    /// Impulse on the object per unit of approach speed (kg).
    pub impulse_per_speed_kg: f64,
    /// The tip's largest speed without rotation, by the joints' speed limits (m/s); not capped.
    pub speed_m_s: f64,
    /// The largest impulse on the object (N s), at that speed or at the cap, whichever is lower.
    pub impulse_n_s: f64,
}

/// Number of headings in a full circle.
const HEADINGS: u32 = 72;

impl MountedArm {
    /// The impulse geometry at a point of the table, for the IK solution with the largest mean speed over all headings;
    /// `None` out of reach.
    pub fn impulse_geometry(
        &self,
        position: Point,
        conditions: &ImpulseConditions,
    ) -> Option<ImpulseGeometry> {
        let ik_solutions = self.ik_solutions(position, 0.0);
        let speed = |solution: &IkSolution| {
            let headings =
                (0..HEADINGS / 6).map(|k| f64::from(k * 6) * std::f64::consts::TAU / f64::from(HEADINGS));
            let directions = headings.map(|heading| self.direction_in_base(Vec2::from_heading(heading)));
            directions.map(|direction| self.straight_speed_m_s(solution, &direction)).sum::<f64>()
        };
        let fastest = ik_solutions.iter().max_by(|a, b| speed(a).total_cmp(&speed(b)))?;
        self.impulse_geometry_of(&fastest.angles, conditions)
    }

    /// The impulse geometry of one pose; `None` if the mass matrix is not positive definite.
    pub fn impulse_geometry_of(
        &self,
        angles_rad: &[f64],
        conditions: &ImpulseConditions,
    ) -> Option<ImpulseGeometry> {
        let table_from_base = self.base_from_table.inverse();
        let rotation = table_from_base.rotation.matrix();
        let mobility = rotation * self.arm.tip_mobility(angles_rad)? * rotation.transpose();
        let along_table = mobility.fixed_view::<2, 2>(0, 0).into_owned();
        let flat = SymmetricEigen::new(along_table);
        let in_space = SymmetricEigen::new(mobility);
        let (heavy, light) = if flat.eigenvalues[0] < flat.eigenvalues[1] { (0, 1) } else { (1, 0) };
        let flat_axis = |k: usize| Vector3::new(flat.eigenvectors[(0, k)], flat.eigenvectors[(1, k)], 0.0);
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&i, &j| in_space.eigenvalues[i].total_cmp(&in_space.eigenvalues[j]));
        let solution = IkSolution {
            yaw_rad: 0.0,
            angles: angles_rad.to_vec(),
            fixed_joint: self.fixed_joint_of(angles_rad),
        };
        let on_table = |point: [f64; 3]| (table_from_base * nalgebra::Point3::from(point)).into();
        Some(ImpulseGeometry {
            angles_rad: angles_rad.to_vec(),
            tip_m: on_table(self.arm.tip(angles_rad).translation.vector.into()),
            skeleton_m: self.skeleton_on_table(angles_rad),
            mobility_per_kg: std::array::from_fn(|i| std::array::from_fn(|j| mobility[(i, j)])),
            principal: order
                .map(|k| Direction::new(in_space.eigenvectors.column(k).into(), &mobility, conditions)),
            along_table: [heavy, light].map(|k| Direction::new(flat_axis(k), &mobility, conditions)),
            headings: self.heading_impulses(&solution, &mobility, conditions),
        })
    }

    fn heading_impulses(
        &self,
        solution: &IkSolution,
        mobility: &Matrix3<f64>,
        conditions: &ImpulseConditions,
    ) -> Vec<HeadingImpulse> {
        let headings = (0..HEADINGS).map(|k| {
            let heading_rad = f64::from(k) * std::f64::consts::TAU / f64::from(HEADINGS);
            let along = Vec2::from_heading(heading_rad);
            let direction = Direction::new(Vector3::new(along.x, along.y, 0.0), mobility, conditions);
            let speed_m_s = self.straight_speed_m_s(solution, &self.direction_in_base(along));
            HeadingImpulse {
                heading_rad,
                effective_mass_kg: direction.effective_mass_kg,
                impulse_per_speed_kg: direction.impulse_per_speed_kg,
                speed_m_s,
                impulse_n_s: direction.impulse_per_speed_kg * speed_m_s.min(conditions.speed_cap_m_s),
            }
        });
        headings.collect()
    }
}

impl Direction {
    fn new(direction: Vector3<f64>, mobility: &Matrix3<f64>, conditions: &ImpulseConditions) -> Self {
        let mobility_per_kg = direction.dot(&(mobility * direction));
        Self {
            direction: direction.into(),
            effective_mass_kg: 1.0 / mobility_per_kg,
            impulse_per_speed_kg: impulse_per_speed_kg(mobility_per_kg, conditions),
        }
    }
}

impl ImpulseGeometry {
    /// The impulse per unit of approach speed along a unit vector of the table frame, normalized by its maximum over all
    /// directions (0 to 1).
    pub fn normalized(&self, direction: [f64; 3], conditions: &ImpulseConditions) -> f64 {
        let direction = Vector3::from(direction);
        let mobility = Matrix3::from_fn(|i, j| self.mobility_per_kg[i][j]);
        let mobility_per_kg = direction.dot(&(mobility * direction));
        let most = 1.0 / self.principal[0].effective_mass_kg;
        impulse_per_speed_kg(mobility_per_kg, conditions) / impulse_per_speed_kg(most, conditions)
    }

    /// The heading of the largest impulse.
    pub fn strongest(&self) -> Option<&HeadingImpulse> {
        self.headings.iter().max_by(|a, b| a.impulse_n_s.total_cmp(&b.impulse_n_s))
    }
}

/// Eq. 8 for unit speed: the reduced mass of arm and object times one plus the coefficient of restitution (kg).
fn impulse_per_speed_kg(mobility_per_kg: f64, conditions: &ImpulseConditions) -> f64 {
    (1.0 + conditions.restitution) / (mobility_per_kg + 1.0 / conditions.object_mass_kg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Arm, Frame};

    const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];

    fn mounted(name: &str) -> MountedArm {
        MountedArm {
            arm: Arm::built_in(name).expect("built in"),
            base_from_table: Frame::identity(),
            strike_height_m: 0.1,
            striker: crate::object::Shape::Disc { radius_m: 0.01 },
            home_rad: None,
        }
    }

    fn at(name: &str, angles_deg: [f64; 6], conditions: &ImpulseConditions) -> ImpulseGeometry {
        mounted(name)
            .impulse_geometry_of(&angles_deg.map(f64::to_radians), conditions)
            .expect("possible inertias")
    }

    fn conditions(object_mass_kg: f64) -> ImpulseConditions {
        ImpulseConditions { object_mass_kg, restitution: 0.0, speed_cap_m_s: 1.0 }
    }

    /// From pinocchio 4.1 (mass matrix, Jacobian) and a grid of one degree over the headings; the pose in front of
    /// the base, flange straight down: heaviest and lightest mass (kg), impulse on 143 g at 1 m/s (N s).
    const FRONT_DEG: [f64; 6] = [0.0, -40.654, -112.725, 0.0, -26.621, 0.0];
    const FRONT_KG: [f64; 2] = [2.488816671470017, 0.7070766838866268];
    const FRONT_N_S: [f64; 2] = [0.1352298118427927, 0.11894473206515965];
    /// The fastest heading of that grid and its straight speed.
    const FASTEST_DEG: f64 = 42.0;
    const FASTEST_M_S: f64 = 1.760641287710828;

    #[test]
    fn the_extremes_along_the_table_are_those_of_pinocchio() {
        let geometry = at("indy7", FRONT_DEG, &conditions(0.143));
        for (k, direction) in geometry.along_table.iter().enumerate() {
            let (mass_kg, impulse) = (direction.effective_mass_kg, direction.impulse_per_speed_kg);
            assert!((mass_kg - FRONT_KG[k]).abs() < 1e-6, "{mass_kg} kg, not {}", FRONT_KG[k]);
            assert!((impulse - FRONT_N_S[k]).abs() < 1e-6, "{impulse} N s, not {}", FRONT_N_S[k]);
        }
        let solution = IkSolution { yaw_rad: 0.0, angles: geometry.angles_rad.clone(), fixed_joint: None };
        let along = Vec2::from_heading(FASTEST_DEG.to_radians());
        let fastest_m_s =
            mounted("indy7").straight_speed_m_s(&solution, &Vector3::new(along.x, along.y, 0.0));
        assert!((fastest_m_s - FASTEST_M_S).abs() < 1e-6, "{fastest_m_s} m/s, not {FASTEST_M_S}");
    }

    #[test]
    fn no_direction_in_space_gives_more_than_the_first_principal_one() {
        let conditions = conditions(0.061);
        let geometry = at("indy7", HOME_DEG, &conditions);
        for k in 0..200 {
            let (azimuth, z) = (f64::from(k) * 2.4, f64::from(k) / 100.0 - 1.0);
            let flat = (1.0 - z * z).sqrt();
            let ratio = geometry.normalized([flat * azimuth.cos(), flat * azimuth.sin(), z], &conditions);
            assert!(ratio > 0.0 && ratio <= 1.0 + 1e-12, "{ratio}");
        }
    }

    #[test]
    fn the_impulse_on_an_infinitely_heavy_object_is_the_arms_effective_mass() {
        let geometry = at("indy7", HOME_DEG, &conditions(f64::INFINITY));
        for direction in geometry.principal {
            assert_eq!(direction.effective_mass_kg, direction.impulse_per_speed_kg);
        }
    }

    #[test]
    fn a_stretched_arm_has_a_large_effective_mass_and_no_speed() {
        // All links in one vertical line: the configuration is singular.
        let geometry = at("indy7", [0.0; 6], &conditions(f64::INFINITY));
        let heavy = geometry.principal[0];
        assert!(heavy.effective_mass_kg > 1e6, "{} kg", heavy.effective_mass_kg);
        let solution = IkSolution { yaw_rad: 0.0, angles: geometry.angles_rad.clone(), fixed_joint: None };
        let speed_m_s = mounted("indy7").straight_speed_m_s(&solution, &Vector3::from(heavy.direction));
        assert!(speed_m_s < 1e-3, "{speed_m_s} m/s");
    }
}
