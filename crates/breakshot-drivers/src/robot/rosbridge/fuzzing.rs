//! Any messages of a rosbridge during a strike.

use super::joint_states::HOLD_S;
use super::{Goal, Shared};
use crate::motion::Motions;
use breakshot::robot::Command;

/// Receives messages, one a line, while the strike of a command is under way.
///
/// # Errors
/// In words, what the driver must not derive from any messages: a pose without numbers, a negative age, a hold that is not on the path.
pub(crate) fn received(command: &Command, messages: &str) -> Result<(), String> {
    let motion = Motions::of(command).ok_or("the command has no motions")?.strike;
    let mut shared = Shared::new(&command.joints);
    shared.goal = Some(Goal::new("goal".into(), &motion));
    for message in messages.lines() {
        shared.receive(message);
        if let Ok(Some((q_rad, age_s))) = shared.joint_states.latest() {
            let is_pose = q_rad.len() == command.joints.len() && q_rad.iter().all(|q| q.is_finite());
            if !is_pose || age_s.is_nan() || age_s < 0.0 {
                return Err(format!("the pose {q_rad:?}, {age_s} s old"));
            }
        }
        if let Some(period_s) = shared.joint_states.period_s()
            && !(period_s.is_finite() && period_s > 0.0)
        {
            return Err(format!("joint states {period_s} s apart"));
        }
        if let Some(hold) = shared.joint_states.hold(&motion) {
            let [least_s, most_s] = HOLD_S;
            if !(least_s..=most_s).contains(&hold.after_s) || !motion.phase.q_rad.contains(&hold.q_rad) {
                return Err(format!("held at {:?} after {} s", hold.q_rad, hold.after_s));
            }
        }
    }
    Ok(())
}
