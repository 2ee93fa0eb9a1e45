//! Safety notes for the user before the arm moves.

use crate::robot::arm::model::serial_arm::Arm;
use crate::robot::command::Command;

/// Largest tip speed outside the strike, and in a strike without the permission for a faster one (m/s): the reduced speed of
/// ISO 10218-1.
pub const SLOW_M_S: f64 = 0.25;

/// The largest speed at which the tip may touch a region of the human body, by contact force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ContactSpeed {
    /// The region of the body.
    pub region: &'static str,
    /// The speed (m/s).
    pub speed_m_s: f64,
}

/// Region, its effective mass (kg), stiffness (N/m) and permitted transient force (N, twice the quasi-static one), after
/// ISO/TS 15066, Annex A.
const REGIONS: [(&str, f64, f64, f64); 3] =
    [("chest", 40.0, 25_000.0, 280.0), ("abdomen", 40.0, 10_000.0, 220.0), ("back", 40.0, 35_000.0, 420.0)];

impl Arm {
    /// The largest speeds at which the tip may touch a person by contact force alone; the pressure of a sharp tool limits them
    /// further.
    ///
    /// `v = F / sqrt(mu k)` (ISO/TS 15066) with the reduced mass `mu` of the region and the arm; the arm's mass is half its
    /// moving mass plus the tool.
    pub fn contact_speeds(&self) -> [ContactSpeed; 3] {
        let moving_kg = self.links.iter().map(|link| link.inertia.mass_kg).sum::<f64>();
        let arm_kg = moving_kg / 2.0 + self.tool.mass_kg;
        REGIONS.map(|(region, mass_kg, stiffness_n_m, force_n)| {
            let reduced_kg = 1.0 / (1.0 / mass_kg + 1.0 / arm_kg);
            ContactSpeed { region, speed_m_s: force_n / (reduced_kg * stiffness_n_m).sqrt() }
        })
    }
}

impl Command {
    /// Notes for the user: the stroke's energy, the speeds at which people must keep away, and the limits of a network stop.
    ///
    /// # Errors
    /// An arm model that cannot be built.
    pub fn safety_notes(&self) -> crate::Result<Vec<String>> {
        let mounted = self.mounted_arm()?;
        let speed_m_s = self.strike.speed_m_s;
        let mut notes = vec![format!(
            "the stroke's energy is {:.2} J: {:.2} kg effective mass at the tip, {speed_m_s:.2} m/s",
            self.stroke.energy_j, self.stroke.effective_mass_kg
        )];
        if speed_m_s > SLOW_M_S {
            notes.push(format!(
                "{speed_m_s:.2} m/s is faster than the {SLOW_M_S} m/s at which a person may be near: keep the cell clear of people, and \
                 expect flying objects"
            ));
        }
        let least =
            mounted.arm().contact_speeds().into_iter().min_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s));
        if let Some(least) = least.filter(|least| speed_m_s > least.speed_m_s) {
            notes.push(format!(
                "it is also faster than the {:.2} m/s at which this arm may touch a person's {} (ISO/TS 15066, force only)",
                least.speed_m_s, least.region
            ));
        }
        notes.push(
            "a stop over the network is not a safety function: keep a hand on the emergency stop".into(),
        );
        Ok(notes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_speeds_of_the_indy_agree_with_a_calculation_by_hand() {
        let speeds = Arm::built_in("indy7").expect("built in").contact_speeds();
        for (speed, by_hand_m_s) in speeds.iter().zip([0.58, 0.72, 0.73]) {
            let off_m_s = speed.speed_m_s - by_hand_m_s;
            assert!(off_m_s.abs() < 0.006, "{}: {} m/s, not {by_hand_m_s}", speed.region, speed.speed_m_s);
        }
    }
}
