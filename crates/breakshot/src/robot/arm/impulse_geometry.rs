//! What impulse the tip can give in which direction (Eq. 8, Fig. 10).
//!
//! With `A = J M^-1 J' + E / m_o` an arm that meets a free object of mass `m_o` centrally along the unit vector n gives it,
//! per unit of approach speed, the impulse `(1 + e) / (n' A n)`: a belted ellipsoid (the *normalized* geometry).  Its
//! extremes lie along the eigenvectors of `J M^-1 J'`.  The impulse the arm can really give is that times the speed that its
//! joints allow in that direction, and it is that one which tells the directions apart: objects are light against arms.

use super::ik_solution::Posture;
use super::mounted_arm::Station;
use crate::geometry::{Point, Vec2};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use serde::{Deserialize, Serialize};

/// What is hit, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The object's mass (kg); infinite for the arm's own share alone.
    pub object_mass_kg: f64,
    /// The restitution of the impact.
    pub restitution: f64,
    /// The fastest strike that is allowed (m/s).
    pub speed_cap_m_s: f64,
}

/// The impulse geometry of one pose of the arm; directions and places in the table's frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImpulseGeometry {
    /// The joint angles (rad).
    pub angles_rad: Vec<f64>,
    /// The tip (m).
    pub tip_m: [f64; 3],
    /// The arm as a stick: base, joints, flange, tip (m).
    pub skeleton_m: Vec<[f64; 3]>,
    /// `J M^-1 J'` of the tip's point (1/kg).
    pub mobility_per_kg: [[f64; 3]; 3],
    /// The principal directions in space, the heaviest first.
    pub principal: [Direction; 3],
    /// The heaviest and the lightest direction along the table.
    pub along_table: [Direction; 2],
    /// What can be given along the table, heading by heading.
    pub headings: Vec<HeadingImpulse>,
}

/// A direction and what the tip weighs along it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Direction {
    /// The unit vector.
    pub direction: [f64; 3],
    /// Effective mass (kg).
    pub effective_mass_kg: f64,
    /// Impulse on the object per unit of approach speed (kg).
    pub impulse_per_speed_kg: f64,
}

/// What the tip can do along one heading.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeadingImpulse {
    /// The heading (rad).
    pub heading_rad: f64,
    /// Effective mass (kg).
    pub effective_mass_kg: f64,
    /// Impulse on the object per unit of approach speed (kg).
    pub impulse_per_speed_kg: f64,
    /// The tip's largest straight speed, joints within their limits (m/s); not capped.
    pub speed_m_s: f64,
    /// The largest impulse on the object (N s): at that speed, or at the cap if it is lower.
    pub impulse_n_s: f64,
}

/// Headings in a full turn.
const HEADINGS: u32 = 72;

impl Station {
    /// The impulse geometry at a place of the table, in the arm's fastest upright posture there (the mean over all
    /// headings counts); `None` out of its reach.
    pub fn impulse_geometry(&self, place: Point, hit: &Hit) -> Option<ImpulseGeometry> {
        let postures = self.postures(place, 0.0);
        let speed = |posture: &Posture| {
            let headings =
                (0..HEADINGS / 6).map(|k| f64::from(k * 6) * std::f64::consts::TAU / f64::from(HEADINGS));
            let directions = headings.map(|heading| self.direction_in_base(Vec2::from_heading(heading)));
            directions.map(|direction| self.straight_speed_m_s(posture, &direction)).sum::<f64>()
        };
        let fastest = postures.iter().max_by(|a, b| speed(a).total_cmp(&speed(b)))?;
        self.impulse_geometry_of(&fastest.angles, hit)
    }

    /// The impulse geometry of one pose of the arm; `None` if its inertias are impossible.
    pub fn impulse_geometry_of(&self, angles_rad: &[f64], hit: &Hit) -> Option<ImpulseGeometry> {
        let table_from_base = self.base_from_table.inverse();
        let turn = table_from_base.rotation.matrix();
        let mobility = turn * self.arm.tip_mobility(angles_rad)? * turn.transpose();
        let along_table = mobility.fixed_view::<2, 2>(0, 0).into_owned();
        let flat = SymmetricEigen::new(along_table);
        let in_space = SymmetricEigen::new(mobility);
        let (heavy, light) = if flat.eigenvalues[0] < flat.eigenvalues[1] { (0, 1) } else { (1, 0) };
        let flat_axis = |k: usize| Vector3::new(flat.eigenvectors[(0, k)], flat.eigenvectors[(1, k)], 0.0);
        let mut order = [0, 1, 2];
        order.sort_by(|&i, &j| in_space.eigenvalues[i].total_cmp(&in_space.eigenvalues[j]));
        let posture =
            Posture { yaw_rad: 0.0, angles: angles_rad.to_vec(), still: self.still_joint(angles_rad) };
        let on_table = |point: [f64; 3]| (table_from_base * nalgebra::Point3::from(point)).into();
        Some(ImpulseGeometry {
            angles_rad: angles_rad.to_vec(),
            tip_m: on_table(self.arm.tip(angles_rad).translation.vector.into()),
            skeleton_m: self.arm.skeleton(angles_rad).into_iter().map(on_table).collect(),
            mobility_per_kg: std::array::from_fn(|i| std::array::from_fn(|j| mobility[(i, j)])),
            principal: order.map(|k| Direction::new(in_space.eigenvectors.column(k).into(), &mobility, hit)),
            along_table: [heavy, light].map(|k| Direction::new(flat_axis(k), &mobility, hit)),
            headings: self.heading_impulses(&posture, &mobility, hit),
        })
    }

    fn heading_impulses(&self, posture: &Posture, mobility: &Matrix3<f64>, hit: &Hit) -> Vec<HeadingImpulse> {
        let headings = (0..HEADINGS).map(|k| {
            let heading_rad = f64::from(k) * std::f64::consts::TAU / f64::from(HEADINGS);
            let along = Vec2::from_heading(heading_rad);
            let direction = Direction::new(Vector3::new(along.x, along.y, 0.0), mobility, hit);
            let speed_m_s = self.straight_speed_m_s(posture, &self.direction_in_base(along));
            HeadingImpulse {
                heading_rad,
                effective_mass_kg: direction.effective_mass_kg,
                impulse_per_speed_kg: direction.impulse_per_speed_kg,
                speed_m_s,
                impulse_n_s: direction.impulse_per_speed_kg * speed_m_s.min(hit.speed_cap_m_s),
            }
        });
        headings.collect()
    }
}

impl Direction {
    fn new(direction: Vector3<f64>, mobility: &Matrix3<f64>, hit: &Hit) -> Self {
        let felt = direction.dot(&(mobility * direction));
        Self {
            direction: direction.into(),
            effective_mass_kg: 1.0 / felt,
            impulse_per_speed_kg: impulse_per_speed_kg(felt, hit),
        }
    }
}

impl ImpulseGeometry {
    /// The impulse per unit of approach speed along any unit vector of the table's frame, over the largest of all
    /// directions: 0 to 1.
    pub fn normalized(&self, direction: [f64; 3], hit: &Hit) -> f64 {
        let direction = Vector3::from(direction);
        let mobility = Matrix3::from_fn(|i, j| self.mobility_per_kg[i][j]);
        let felt = direction.dot(&(mobility * direction));
        let most = 1.0 / self.principal[0].effective_mass_kg;
        impulse_per_speed_kg(felt, hit) / impulse_per_speed_kg(most, hit)
    }

    /// The heading along which the arm can give the largest impulse.
    pub fn strongest(&self) -> Option<&HeadingImpulse> {
        self.headings.iter().max_by(|a, b| a.impulse_n_s.total_cmp(&b.impulse_n_s))
    }
}

/// Eq. 8 for unit speed: the reduced mass of arm and object, times one plus the restitution.
fn impulse_per_speed_kg(felt_per_kg: f64, hit: &Hit) -> f64 {
    (1.0 + hit.restitution) / (felt_per_kg + 1.0 / hit.object_mass_kg)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{Arm, Frame};

    const HOME_DEG: [f64; 6] = [0.0, -15.0, -90.0, 0.0, -75.0, 0.0];

    fn station(name: &str) -> Station {
        Station {
            arm: Arm::built_in(name).expect("built in"),
            base_from_table: Frame::identity(),
            strike_height_m: 0.1,
            striker: crate::object::Shape::Disc { radius_m: 0.01 },
            home_rad: None,
        }
    }

    fn at(name: &str, angles_deg: [f64; 6], hit: &Hit) -> ImpulseGeometry {
        station(name).impulse_geometry_of(&angles_deg.map(f64::to_radians), hit).expect("a real arm")
    }

    fn hit(object_mass_kg: f64) -> Hit {
        Hit { object_mass_kg, restitution: 0.0, speed_cap_m_s: 1.0 }
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
        let geometry = at("indy7", FRONT_DEG, &hit(0.143));
        for (k, direction) in geometry.along_table.iter().enumerate() {
            let (mass_kg, impulse) = (direction.effective_mass_kg, direction.impulse_per_speed_kg);
            assert!((mass_kg - FRONT_KG[k]).abs() < 1e-6, "{mass_kg} kg, not {}", FRONT_KG[k]);
            assert!((impulse - FRONT_N_S[k]).abs() < 1e-6, "{impulse} N s, not {}", FRONT_N_S[k]);
        }
        let posture = Posture { yaw_rad: 0.0, angles: geometry.angles_rad.clone(), still: None };
        let along = Vec2::from_heading(FASTEST_DEG.to_radians());
        let fastest_m_s = station("indy7").straight_speed_m_s(&posture, &Vector3::new(along.x, along.y, 0.0));
        assert!((fastest_m_s - FASTEST_M_S).abs() < 1e-6, "{fastest_m_s} m/s, not {FASTEST_M_S}");
    }

    #[test]
    fn no_direction_in_space_gives_more_than_the_first_principal_one() {
        let hit = hit(0.061);
        let geometry = at("indy7", HOME_DEG, &hit);
        for k in 0..200 {
            let (azimuth, z) = (f64::from(k) * 2.4, f64::from(k) / 100.0 - 1.0);
            let flat = (1.0 - z * z).sqrt();
            let share = geometry.normalized([flat * azimuth.cos(), flat * azimuth.sin(), z], &hit);
            assert!(share > 0.0 && share <= 1.0 + 1e-12, "{share}");
        }
    }

    #[test]
    fn an_endless_object_feels_the_arms_own_mass() {
        let geometry = at("indy7", HOME_DEG, &hit(f64::INFINITY));
        for direction in geometry.principal {
            assert_eq!(direction.effective_mass_kg, direction.impulse_per_speed_kg);
        }
    }

    #[test]
    fn where_the_arm_is_stretched_out_it_is_heavy_but_cannot_strike() {
        // All links in one line upwards: there the tip cannot move.
        let geometry = at("indy7", [0.0; 6], &hit(f64::INFINITY));
        let heavy = geometry.principal[0];
        assert!(heavy.effective_mass_kg > 1e6, "{} kg", heavy.effective_mass_kg);
        let posture = Posture { yaw_rad: 0.0, angles: geometry.angles_rad.clone(), still: None };
        let speed_m_s = station("indy7").straight_speed_m_s(&posture, &Vector3::from(heavy.direction));
        assert!(speed_m_s < 1e-3, "{speed_m_s} m/s");
    }
}
