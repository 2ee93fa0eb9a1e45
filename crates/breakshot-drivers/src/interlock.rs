//! May this command move the arm now?

use breakshot::robot::{Command, FASTEST_M_S, SLOW_M_S};
use breakshot::scene::Scene;

/// A look at the table counts for so long (s): people and fallen objects take longer to notice than that.
pub const FRESH_S: f64 = 60.0;
/// Clocks of camera and robot computers may differ by so much (s).
const CLOCKS_DIFFER_S: f64 = 5.0;
/// Objects that moved by less lie where they lay: the camera is good for a tenth of it (m).
const SAME_PLACE_M: f64 = 0.003;
/// The same for their turn (rad).
const SAME_YAW_RAD: f64 = 0.05;

/// What the user allows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Permission {
    /// The command's short hash, repeated by the user; without it nothing moves.
    pub hash: Option<String>,
    /// Whether the strike may be faster than 0.25 m/s.
    pub allow_fast: bool,
}

/// Why the command may not be carried out, one sentence each; none if it may.
///
/// `seen` is what was last seen on the table; without it the command's own scene must be fresh enough.
pub fn objections(
    command: &Command,
    permission: &Permission,
    seen: Option<&Scene>,
    now_unix_s: f64,
) -> Vec<String> {
    let mut objections = about_the_path(command);
    objections.extend(about_the_speed(command, permission));
    objections.extend(about_the_scene(command, seen, now_unix_s));
    if let Some(hash) = permission.hash.as_ref().filter(|hash| **hash != command.short_hash()) {
        objections.push(format!("the hash is `{hash}`; this command's is `{}`", command.short_hash()));
    }
    objections
}

fn about_the_path(command: &Command) -> Vec<String> {
    match command.checked_again() {
        Ok(checks) => {
            let broken = checks.iter().filter(|check| !check.holds());
            broken.map(|check| format!("the path breaks a limit: {}", check.sentence())).collect()
        }
        Err(error) => vec![format!("the path cannot be checked: {error}")],
    }
}

fn about_the_speed(command: &Command, permission: &Permission) -> Vec<String> {
    /// What the samples differ by from the speed they were planned with.
    const ROUNDING: f64 = 1.01;
    // What the path does counts, not what the file says about it.
    let [strike_m_s, else_m_s] = match command.tip_speeds_m_s() {
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
    if else_m_s > SLOW_M_S * ROUNDING {
        objections.push(format!(
            "the way there or back is {else_m_s:.3} m/s fast; allowed is at most {SLOW_M_S} m/s"
        ));
    }
    objections
}

fn about_the_scene(command: &Command, seen: Option<&Scene>, now_unix_s: f64) -> Vec<String> {
    let Some(planned) = &command.scene else {
        return vec!["the command does not say where the objects lie".into()];
    };
    let mut objections = Vec::new();
    match seen.unwrap_or(planned).observed_unix_s {
        None => objections.push("nothing says when the table was looked at (`observed_unix_s`)".into()),
        Some(observed_unix_s) => {
            let age_s = now_unix_s - observed_unix_s;
            if age_s > FRESH_S {
                objections.push(format!(
                    "the table was looked at {age_s:.0} s ago; needed: at most {FRESH_S:.0} s ago"
                ));
            } else if age_s.is_nan() || age_s < -CLOCKS_DIFFER_S {
                objections.push(format!("the table was looked at in {:.0} s from now", -age_s));
            }
        }
    }
    objections.extend(seen.into_iter().flat_map(|seen| moved(planned, seen)));
    objections
}

/// What lies elsewhere than planned for, is gone, or is new.
fn moved(planned: &Scene, seen: &Scene) -> Vec<String> {
    let mut moved = Vec::new();
    for placed in &planned.placed {
        let name = &placed.object;
        let Some(now) = seen.placed.iter().find(|now| now.object == *name) else {
            moved.push(format!("`{name}` is not on the table any more"));
            continue;
        };
        let away_m = now.position_m.distance(placed.position_m);
        if away_m.is_nan() || away_m > SAME_PLACE_M {
            moved.push(format!("`{name}` lies {:.1} mm away from where it was planned for", away_m * 1e3));
        }
        let turn_rad = turned_rad(planned, name, now.yaw_rad - placed.yaw_rad);
        if turn_rad.is_nan() || turn_rad > SAME_YAW_RAD {
            moved.push(format!("`{name}` is turned by {:.1} degrees", turn_rad.to_degrees()));
        }
    }
    for now in &seen.placed {
        if !planned.placed.iter().any(|placed| placed.object == now.object) {
            moved.push(format!("`{}` was not planned for", now.object));
        }
    }
    moved
}

/// How far an object is turned, up to what its outline looks the same at (rad).
fn turned_rad(scene: &Scene, name: &str, turn_rad: f64) -> f64 {
    let symmetry_rad = match scene.object(name) {
        Ok(object) if matches!(object.shape, breakshot::object::Shape::Disc { .. }) => return 0.0,
        Ok(object) => object.shape.rotation_symmetry_rad().unwrap_or(std::f64::consts::TAU),
        Err(_) => std::f64::consts::TAU,
    };
    let rest = turn_rad.rem_euclid(symmetry_rad);
    rest.min(symmetry_rad - rest)
}
