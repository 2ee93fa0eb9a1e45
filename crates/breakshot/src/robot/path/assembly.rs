//! The command made of a joint path: the stroke's data at the contact, the checks and the warnings.

use super::joint_path::CheckedPath;
use super::striker_path::StrikerPath;
use crate::cell::{Cell, RobotSpec};
use crate::robot::arm::ik_solution::IkSolution;
use crate::robot::arm::mounted_arm::MountedArm;
use crate::robot::command::{Command, Stroke};
use crate::robot::phase::PhaseName;
use crate::scene::{Scene, Strike};

/// Largest relative difference between the tip's speed at the contact and the planned one without a warning.
const SPEED_TOLERANCE: f64 = 0.01;

/// The strike for which a path is searched.
pub(crate) struct StrikeTask<'a> {
    pub(crate) cell: &'a Cell,
    pub(crate) strike: &'a Strike,
    pub(crate) scene: Option<&'a Scene>,
    /// The speed of the draw-back (m/s).
    pub(crate) retract_m_s: f64,
}

/// The command for a path that keeps all limits.
pub(crate) fn command(
    task: &StrikeTask,
    mounted: &MountedArm,
    striker_path: &StrikerPath,
    solution: &IkSolution,
    path: CheckedPath,
) -> Command {
    let CheckedPath { phases, worst } = path;
    let begins_s = phases.iter().find(|p| p.name == PhaseName::Strike).map_or(0.0, |p| p.span_s()[0]);
    let contact_time_s = begins_s + striker_path.contact_time_s();
    let (run_up, stop) = (&striker_path.run_up, &striker_path.stop);
    let robot = task.cell.robot.clone().unwrap_or_default();
    let mut command = Command {
        version: 1,
        arm: mounted.arm.name.clone(),
        joints: mounted.arm.joint_names(),
        urdf: robot.urdf.clone(),
        robot: RobotSpec { urdf: None, ..robot },
        striker: mounted.striker.clone(),
        strike: task.strike.clone(),
        scene: task.scene.cloned(),
        stroke: Stroke {
            begin_m: striker_path.point(striker_path.begin_m),
            end_m: striker_path.point(striker_path.end_m),
            run_up_m: run_up.ramp_length(),
            stop_m: stop.ramp_length(),
            acceleration_m_s2: run_up.acceleration.max(stop.acceleration),
            draw_back_m_s: task.retract_m_s,
            contact_after_m: striker_path.contact_m,
            contact_time_s,
            contact_speed_m_s: 0.0,
            effective_mass_kg: 0.0,
            energy_j: 0.0,
            tool_yaw_rad: solution.yaw_rad,
        },
        phases,
        checks: worst.into_values().collect(),
        warnings: mounted.arm.warnings.clone(),
    };

    // Speed, effective mass (Eq. 8) and energy of the tip at the contact
    if let Some(state) = command.at(contact_time_s) {
        let direction = mounted.direction_in_base(striker_path.direction);
        let speed_m_s = direction.dot(&mounted.arm.tip_velocity(&state));
        let mobility = mounted.arm.tip_mobility(&state.q_rad);
        let mass_kg = mobility.map_or(0.0, |mobility| 1.0 / direction.dot(&(mobility * direction)));
        command.stroke.contact_speed_m_s = speed_m_s;
        command.stroke.effective_mass_kg = mass_kg;
        command.stroke.energy_j = mass_kg * speed_m_s * speed_m_s / 2.0;
    }
    let warnings = warnings(&command, mounted, striker_path);
    command.warnings.extend(warnings);
    command
}

fn warnings(command: &Command, mounted: &MountedArm, striker_path: &StrikerPath) -> Vec<String> {
    let mut warnings = Vec::new();
    let off = (command.stroke.contact_speed_m_s / command.strike.speed_m_s - 1.0).abs();
    if off > SPEED_TOLERANCE {
        warnings.push(format!("the tip's speed at the contact is off by {:.1} %", 100.0 * off));
    }
    if let Some(beyond_m) = command.overshoot_m() {
        warnings.push(format!(
            "the striker stops {:.0} mm past the planned end: it cannot stop earlier after the contact",
            1e3 * beyond_m
        ));
    }
    if command.scene.is_none() {
        warnings.push("the objects' positions are not known: only the arm's own limits were checked".into());
    } else if striker_path.contact_m.is_none() {
        warnings.push("the striker touches no object on its path".into());
    }
    if !mounted.arm.has_rotor_inertias() {
        warnings.push("no rotor inertias are known: the effective mass is a lower bound".into());
    }
    warnings
}
