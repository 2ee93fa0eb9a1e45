//! The checks of the controller before the arm moves.

use super::requests::{self, frame_from};
use super::{Indy, LARGEST_MESSAGE, link, violation_text};
use crate::fault::Fault;
use crate::motion::{Motion, Motions};
use crate::preflight::PreflightCheck;
use crate::wire::{CollisionPolicyType, ControlData, Empty, GetMotionRes, OpState};
use breakshot::geometry::Vec2;
use breakshot::robot::{Arm, Command, Frame, JointState, MountedArm, PhaseName};
use tonic::body::Body;
use tonic::client::GrpcService;

/// Largest distance between the controller's tool position and ours (mm); 0.5 mm of it is a known offset.
const POSITION_MM: f64 = 1.0;
/// Largest rotation between the controller's tool frame and ours (degrees).
const ROTATION_DEG: f64 = 0.1;
/// Largest difference between the controller's tool mass and ours (kg).
const TOOL_KG: f64 = 0.1;
/// Largest relative difference between the previewed and the requested speed that is not reported.
const PREVIEW_TOLERANCE: f64 = 0.05;

impl<T: GrpcService<Body, ResponseBody = Body> + Clone> Indy<T> {
    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<PreflightCheck>, Fault> {
        let mounted = command.mounted_arm().map_err(|error| Fault::Refused {
            request: "the command's arm".into(),
            answer: error.to_string(),
        })?;
        let data = self.rtde.clone().get_control_data(Empty {}).await.map_err(link)?.into_inner();
        let mut checks = self.readiness(command, &data).await?;
        checks.extend(self.settings(command, &mounted).await?);
        checks.extend(self.kinematics(command, mounted.arm(), &data).await?);
        checks.extend(Motions::of(command).map(|motions| longest(&motions)));
        checks.push(self.preview(command, &mounted, &data).await);
        Ok(checks)
    }

    /// Checks that the controller is able to move now.
    async fn readiness(&self, command: &Command, data: &ControlData) -> Result<Vec<PreflightCheck>, Fault> {
        let op_state = data.op_state();
        let mut checks = vec![
            PreflightCheck::new(
                "robot connected to its controller",
                data.is_robot_connected,
                "true",
                data.is_robot_connected,
            ),
            PreflightCheck::new(
                "operating state",
                op_state.as_str_name(),
                "OP_IDLE",
                op_state == OpState::OpIdle,
            ),
            PreflightCheck::new(
                "the controller simulates",
                data.sim_mode,
                if self.simulated {
                    "true, for `indy-sim:HOST`"
                } else {
                    "false; `indy-sim:HOST` names one that does"
                },
                data.sim_mode == self.simulated,
            ),
        ];
        let violation = self.violation().await?;
        let holds = violation.violation_code == 0;
        let found = if holds { "none".into() } else { violation_text(&violation) };
        checks.push(PreflightCheck::new("violation", found, "none", holds));
        let servo = self.rtde.clone().get_servo_data(Empty {}).await.map_err(link)?.into_inner();
        let joints = command.joints.len();
        let all_on = servo.servo_actives.len() == joints && servo.servo_actives.iter().all(|&on| on);
        checks.push(PreflightCheck::new("servos on", format!("{:?}", servo.servo_actives), "all", all_on));
        let no_brake = servo.brake_actives.len() == joints && !servo.brake_actives.iter().any(|&on| on);
        checks.push(PreflightCheck::new("brakes on", format!("{:?}", servo.brake_actives), "none", no_brake));
        let motion = self.rtde.clone().get_motion_data(Empty {}).await.map_err(link)?.into_inner();
        let ratio = motion.speed_ratio;
        checks.push(PreflightCheck::new("speed ratio", format!("{ratio} %"), "100 %", ratio == 100));
        let queued = motion.has_motion || motion.is_in_motion || motion.is_pausing;
        checks.push(PreflightCheck::new("motion under way or waiting", queued, "false", !queued));
        Ok(checks)
    }

    /// Checks the robot's model and its safety settings.
    async fn settings(&self, command: &Command, mounted: &MountedArm) -> Result<Vec<PreflightCheck>, Fault> {
        let info = self.control.clone().get_control_info(Empty {}).await.map_err(link)?.into_inner();
        let device = self.device.clone().get_device_info(Empty {}).await.map_err(link)?.into_inner();
        let holds = is_same_model(&info.robot_model, &command.arm);
        let mut checks = vec![
            PreflightCheck::note("controller version", &info.control_version),
            PreflightCheck::note("serial number", &device.robot_serial),
            PreflightCheck::new("robot model", &info.robot_model, &command.arm, holds),
            PreflightCheck::new(
                "joints",
                device.num_joints,
                command.joints.len().to_string(),
                device.num_joints as usize == command.joints.len(),
            ),
        ];
        let policy = self.config.clone().get_coll_policy(Empty {}).await.map_err(link)?.into_inner().policy();
        let holds = policy != CollisionPolicyType::CollNoDetect;
        checks.push(PreflightCheck::new("collision policy", policy.as_str_name(), "any that detects", holds));
        let level = self.config.clone().get_coll_sens_level(Empty {}).await.map_err(link)?.into_inner().level;
        checks.push(PreflightCheck::note("collision sensitivity (1 is the most sensitive)", level));
        let limits = self.config.clone().get_safety_limits(Empty {}).await.map_err(link)?.into_inner();
        let (limit_m_s, needed_m_s) = (f64::from(limits.tcp_speed_limit), command.strike.speed_m_s);
        let needed = format!("at least {needed_m_s:.3} m/s");
        let holds = limit_m_s >= needed_m_s;
        checks.push(PreflightCheck::new("tip speed limit", format!("{limit_m_s:.3} m/s"), needed, holds));
        let tool = self.config.clone().get_tool_property(Empty {}).await.map_err(link)?.into_inner();
        let (mass_kg, ours_kg) = (f64::from(tool.mass), mounted.arm().tool.mass_kg);
        let needed = format!("{ours_kg:.3} kg within {TOOL_KG} kg");
        let holds = (mass_kg - ours_kg).abs() <= TOOL_KG;
        checks.push(PreflightCheck::new("tool mass", format!("{mass_kg:.3} kg"), needed, holds));
        Ok(checks)
    }

    /// Compares the controller's forward kinematics with ours: now, before the run-up and at the contact.
    async fn kinematics(
        &self,
        command: &Command,
        arm: &Arm,
        data: &ControlData,
    ) -> Result<Vec<PreflightCheck>, Fault> {
        let Some(frames) = Frames::of(data) else {
            return Ok(vec![PreflightCheck::new(
                "the controller's frames",
                "missing",
                "six numbers each",
                false,
            )]);
        };
        let ours = |q_rad: &[f64]| frames.tool(arm, q_rad);
        let q_rad = super::radians(&data.q);
        if q_rad.len() != arm.joint_count() {
            let found = format!("{} joint angles", q_rad.len());
            return Ok(vec![PreflightCheck::new("tool now", found, arm.joint_count().to_string(), false)]);
        }
        let mut checks = vec![compared("tool now", &data.p, &ours(&q_rad))];
        let contact = command.at(command.stroke.contact_time_s).map(|state| state.q_rad);
        let begin = command.phase(PhaseName::Strike).map(|phase| phase.q_rad[0].clone());
        for (what, pose) in [("tool before the run-up", begin), ("tool at the contact", contact)] {
            let Some(q_rad) = pose else { continue };
            let request = requests::forward_kinematics(&q_rad);
            let theirs = self.control.clone().forward_kinematics(request).await.map_err(link)?.into_inner();
            checks.push(compared(what, &theirs.tpos, &ours(&q_rad)));
        }
        Ok(checks)
    }

    /// The tip speed that the controller's own planner gives for the stroke's line. Reported only: the trajectory that is
    /// sent is ours.
    async fn preview(&self, command: &Command, mounted: &MountedArm, data: &ControlData) -> PreflightCheck {
        const WHAT: &str = "tip speed on the same line by the controller's planner";
        let (Some(phase), Some(frames)) = (command.phase(PhaseName::Strike), Frames::of(data)) else {
            return PreflightCheck::note(WHAT, "not requested");
        };
        let (arm, stroke) = (mounted.arm(), &command.stroke);
        let (from, to) = (&phase.q_rad[0], &phase.q_rad[phase.q_rad.len() - 1]);
        let speed_m_s = command.strike.speed_m_s;
        let request = requests::line_preview(
            &frames.tool(arm, from),
            &frames.tool(arm, to),
            speed_m_s,
            stroke.acceleration_m_s2,
        );
        let found = match self.control.clone().get_motion_l(request).await {
            Ok(answer) => fastest_m_s(&answer.into_inner(), mounted, from, command.strike.heading_rad),
            Err(status) => Err(format!("not available: {}", status.message())),
        };
        match found {
            Ok(m_s) if (m_s / speed_m_s - 1.0).abs() > PREVIEW_TOLERANCE => PreflightCheck::note(
                WHAT,
                format!("{m_s:.3} m/s, requested {speed_m_s:.3}: 100 % is not 1 m/s on this controller"),
            ),
            Ok(m_s) => PreflightCheck::note(WHAT, format!("{m_s:.3} m/s, requested {speed_m_s:.3}")),
            Err(reason) => PreflightCheck::note(WHAT, reason),
        }
    }
}

/// The tip's largest speed along a heading in a motion planned by the controller (m/s).
fn fastest_m_s(
    planned: &GetMotionRes,
    mounted: &MountedArm,
    start: &[f64],
    heading_rad: f64,
) -> Result<f64, String> {
    let first = planned.q_list.first().ok_or("not available: an empty plan")?;
    // The vendor's documents do not give the unit; it follows from the known start pose.
    let near = |scale: f64| {
        let apart = first.values.iter().zip(start).map(|(a, b)| (a * scale - b).abs());
        first.values.len() == start.len() && apart.fold(0.0, f64::max) < 0.1
    };
    let unit = [1.0, 1.0_f64.to_radians()].into_iter().find(|&scale| near(scale));
    let unit = unit.ok_or("not available: the plan starts at another pose")?;
    let along = Vec2::from_heading(heading_rad);
    let speeds = planned.q_list.iter().zip(&planned.qdot_list).map(|(q, qd)| {
        let scaled = |row: &[f64]| row.iter().map(|x| x * unit).collect::<Vec<_>>();
        let (q_rad, qd_rad_s) = (scaled(&q.values), scaled(&qd.values));
        if q_rad.len() != start.len() || qd_rad_s.len() != start.len() {
            return 0.0;
        }
        mounted.tip_velocity_on_table(&JointState { q_rad, qd_rad_s, qdd_rad_s2: Vec::new() }).dot(along)
    });
    Ok(speeds.fold(0.0, f64::max))
}

/// The frames of the controller's poses: the reference frame in the base, the tool frame on the flange.
struct Frames {
    base_from_reference: Frame,
    flange_from_tool: Frame,
}

impl Frames {
    fn of(data: &ControlData) -> Option<Self> {
        let (base_from_reference, flange_from_tool) =
            (frame_from(&data.ref_frame)?, frame_from(&data.tool_frame)?);
        Some(Self { base_from_reference, flange_from_tool })
    }

    /// The tool frame in the reference frame, by our kinematics.
    fn tool(&self, arm: &Arm, q_rad: &[f64]) -> Frame {
        self.base_from_reference.inverse() * arm.flange_frame(q_rad) * self.flange_from_tool
    }
}

/// Compares the controller's tool frame with ours.
fn compared(what: &str, theirs_mm_deg: &[f32], ours: &Frame) -> PreflightCheck {
    let needed = format!("ours within {POSITION_MM} mm and {ROTATION_DEG} degrees");
    let Some(theirs) = frame_from(theirs_mm_deg) else {
        return PreflightCheck::new(what, "not available", needed, false);
    };
    let apart_mm = (theirs.translation.vector - ours.translation.vector).norm() * 1e3;
    let rotation_deg = theirs.rotation.angle_to(&ours.rotation).to_degrees();
    let holds = apart_mm <= POSITION_MM && rotation_deg <= ROTATION_DEG;
    PreflightCheck::new(
        what,
        format!("{apart_mm:.2} mm and {rotation_deg:.3} degrees from ours"),
        needed,
        holds,
    )
}

/// Checks that the longest motion fits into one message.
fn longest(motions: &Motions) -> PreflightCheck {
    let longest_s = motions.all().map(Motion::duration_s).fold(0.0, f64::max);
    // Three rows per period; each has eight bytes per joint and four bytes of framing.
    let joints = motions.strike.start().len();
    let most_s = requests::PERIOD_S * (LARGEST_MESSAGE / (3 * (8 * joints + 4))) as f64;
    let needed = format!("at most {most_s:.1} s, the limit of one message");
    PreflightCheck::new("longest motion", format!("{longest_s:.1} s"), needed, longest_s <= most_s)
}

/// Whether the controller's model is the arm of a command. Controllers do not report the version of a model; the comparison of
/// the kinematics does.
fn is_same_model(reported: &str, arm: &str) -> bool {
    let model = arm.trim_end_matches("_published").trim_end_matches("_v2");
    !plain(model).is_empty() && plain(reported) == plain(model)
}

/// A name in lower case, letters and digits only.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_compared_whole() {
        assert!(is_same_model("Indy7", "indy7") && is_same_model("INDY-7", "indy7_v2_published"));
        for other in ["I", "Indy", "", "Indy71", "IndyRP2"] {
            assert!(!is_same_model(other, "indy7"), "`{other}`");
        }
    }
}
