//! May this command move the arm now? The interlock lists the reasons against it.

use breakshot::robot::{Command, FASTEST_M_S, SLOW_M_S};
use breakshot::scene::Scene;

/// Largest age of an observation of the table (s).
pub const FRESH_S: f64 = 60.0;
/// Largest difference between the clocks of the camera's and the robot's computers (s).
const CLOCKS_DIFFER_S: f64 = 5.0;
/// Largest displacement of an object since planning (m): ten times the camera's error.
const SAME_POSITION_M: f64 = 0.003;
/// Largest rotation of an object since planning (rad).
const SAME_YAW_RAD: f64 = 0.05;

/// What the user permits.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Permission {
    /// The command's short hash, repeated by the user; nothing moves without it.
    pub hash: Option<String>,
    /// Whether the strike may exceed 0.25 m/s.
    pub allow_fast: bool,
}

/// The reasons for which the command must not be executed, one sentence each; empty if it may be.
///
/// `observed` is the latest observation of the table. Without it the command's own scene must be recent enough.
pub fn objections(
    command: &Command,
    permission: &Permission,
    observed: Option<&Scene>,
    now_unix_s: f64,
) -> Vec<String> {
    if let Err(error) = command.check() {
        return vec![format!("the command is damaged: {error}")];
    }
    let mut objections = path_objections(command);
    objections.extend(speed_objections(command, permission));
    objections.extend(scene_objections(command, observed, now_unix_s));
    if let Some(hash) = permission.hash.as_ref().filter(|hash| **hash != command.short_hash()) {
        objections.push(format!("the hash is `{hash}`; this command's is `{}`", command.short_hash()));
    }
    objections
}

fn path_objections(command: &Command) -> Vec<String> {
    match command.checked_again() {
        Ok(checks) => {
            let broken = checks.iter().filter(|check| !check.holds());
            broken.map(|check| format!("the path breaks a limit: {}", check.sentence())).collect()
        }
        Err(error) => vec![format!("the path cannot be checked: {error}")],
    }
}

fn speed_objections(command: &Command, permission: &Permission) -> Vec<String> {
    /// Largest ratio of the sampled speed to the planned speed.
    const ROUNDING: f64 = 1.01;
    // The speed is computed from the samples; the speed written in the file is not trusted.
    let [strike_m_s, other_m_s] = match command.tip_speeds_m_s() {
        Ok(speeds_m_s) => speeds_m_s,
        Err(error) => return vec![format!("the tip's speed cannot be checked: {error}")],
    };
    let mut objections = Vec::new();
    if permission.allow_fast && strike_m_s > FASTEST_M_S * ROUNDING {
        objections
            .push(format!("the strike is {strike_m_s:.3} m/s fast; allowed is at most {FASTEST_M_S} m/s"));
    }
    if !permission.allow_fast && strike_m_s > SLOW_M_S * ROUNDING {
        objections.push(format!(
            "the strike is {strike_m_s:.3} m/s fast; more than {SLOW_M_S} m/s needs --allow-fast and a cell without people"
        ));
    }
    if other_m_s > SLOW_M_S * ROUNDING {
        objections.push(format!(
            "the tip moves at {other_m_s:.3} m/s outside the strike; allowed is at most {SLOW_M_S} m/s"
        ));
    }
    objections
}

fn scene_objections(command: &Command, observed: Option<&Scene>, now_unix_s: f64) -> Vec<String> {
    let Some(planned) = &command.scene else {
        return vec!["the command has no scene: the objects' positions are not known".into()];
    };
    let mut objections = Vec::new();
    match observed.unwrap_or(planned).observed_unix_s {
        None => objections.push("the time of the observation is missing (`observed_unix_s`)".into()),
        Some(observed_unix_s) => {
            let age_s = now_unix_s - observed_unix_s;
            if age_s > FRESH_S {
                objections.push(format!(
                    "the table was observed {age_s:.0} s ago; needed: at most {FRESH_S:.0} s ago"
                ));
            } else if age_s.is_nan() || age_s < -CLOCKS_DIFFER_S {
                objections
                    .push(format!("the observation's time lies {:.0} s from now in the future", -age_s));
            }
        }
    }
    objections.extend(observed.into_iter().flat_map(|observed| changes(planned, observed)));
    objections.extend(observed.and_then(|observed| other_table(command, planned, observed)));
    objections
}

/// A sentence if the observation is of another table: another base pose, other walls or other areas to keep out of. A camera sees no
/// walls: an observation without any says nothing about them.
fn other_table(command: &Command, planned: &Scene, observed: &Scene) -> Option<String> {
    let base = |scene: &Scene| scene.cell.robot.as_ref().and_then(|robot| robot.base_from_table);
    let differs = if base(observed).is_some_and(|base| Some(base) != command.robot.base_from_table) {
        "`base_from_table`"
    } else if !observed.walls.is_empty() && observed.walls != planned.walls {
        "`[[walls]]`"
    } else if !observed.keep_out.is_empty() && observed.keep_out != planned.keep_out {
        "`[[keep_out]]`"
    } else if observed.cell.table != planned.cell.table {
        "`[table]`"
    } else {
        return None;
    };
    Some(format!("{differs} of the observed scene differs from that of the command: plan again"))
}

/// One sentence for each object that moved, is missing, or is new since planning.
fn changes(planned: &Scene, observed: &Scene) -> Vec<String> {
    let mut changes = Vec::new();
    for placed in &planned.placed {
        let name = &placed.object;
        let Some(now) = observed.placed.iter().find(|now| now.object == *name) else {
            changes.push(format!("`{name}` is not on the table any more"));
            continue;
        };
        let away_m = now.position_m.distance(placed.position_m);
        if away_m.is_nan() || away_m > SAME_POSITION_M {
            changes.push(format!("`{name}` lies {:.1} mm away from where it was planned for", away_m * 1e3));
        }
        let rotation_rad = rotation_modulo_symmetry_rad(planned, name, now.yaw_rad - placed.yaw_rad);
        if rotation_rad.is_nan() || rotation_rad > SAME_YAW_RAD {
            changes.push(format!("`{name}` is rotated by {:.1} degrees", rotation_rad.to_degrees()));
        }
    }
    for now in &observed.placed {
        if !planned.placed.iter().any(|placed| placed.object == now.object) {
            changes.push(format!("`{}` was not planned for", now.object));
        }
    }
    changes
}

/// The absolute rotation of an object modulo its outline's rotational symmetry (rad).
fn rotation_modulo_symmetry_rad(scene: &Scene, name: &str, rotation_rad: f64) -> f64 {
    let symmetry_rad = match scene.object(name) {
        Ok(object) if matches!(object.shape, breakshot::object::Shape::Disc { .. }) => return 0.0,
        Ok(object) => object.shape.rotation_symmetry_rad().unwrap_or(std::f64::consts::TAU),
        Err(_) => std::f64::consts::TAU,
    };
    let rest = rotation_rad.rem_euclid(symmetry_rad);
    rest.min(symmetry_rad - rest)
}
