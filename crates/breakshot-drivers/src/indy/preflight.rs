//! What is asked of the controller before anything moves.

use super::requests::{self, frame_from};
use super::{Indy, LARGEST_MESSAGE, link, violation_text};
use crate::fault::Trouble;
use crate::motion::{Motion, Motions};
use crate::preflight::Finding;
use crate::wire::{CollisionPolicyType, ControlData, Empty, GetMotionRes, OpState};
use breakshot::geometry::Vec2;
use breakshot::robot::{Arm, Command, Frame, JointState, PhaseName, Station};

/// The controller's own place of the tool may differ from ours by this (mm); half of it is its known half millimetre.
const PLACE_MM: f64 = 1.0;
/// The same for its turn (degrees).
const TURN_DEG: f64 = 0.1;
/// What the controller's tool may weigh more or less than ours (kg).
const TOOL_KG: f64 = 0.1;
/// The speed that the controller's own planner gives a line of the stroke's length, over what is asked.
const PREVIEW: f64 = 0.05;

impl Indy {
    pub(crate) async fn preflight(&self, command: &Command) -> Result<Vec<Finding>, Trouble> {
        let station = command.station().map_err(|error| Trouble::Refused {
            request: "the command's arm".into(),
            answer: error.to_string(),
        })?;
        let data = self.rtde.clone().get_control_data(Empty {}).await.map_err(link)?.into_inner();
        let mut findings = self.readiness(&data).await?;
        findings.extend(self.settings(command, &station).await?);
        findings.extend(self.kinematics(command, station.arm(), &data).await?);
        findings.extend(Motions::of(command).map(|motions| longest(&motions)));
        findings.push(self.preview(command, &station, &data).await);
        Ok(findings)
    }

    /// Whether the controller could move now.
    async fn readiness(&self, data: &ControlData) -> Result<Vec<Finding>, Trouble> {
        let op_state = data.op_state();
        let mut findings = vec![
            Finding::new(
                "robot connected to its controller",
                data.is_robot_connected,
                "true",
                data.is_robot_connected,
            ),
            Finding::new("operating state", op_state.as_str_name(), "OP_IDLE", op_state == OpState::OpIdle),
            Finding::note("the controller simulates", data.sim_mode),
        ];
        let violation = self.violation().await?;
        let holds = violation.violation_code == 0;
        let found = if holds { "none".into() } else { violation_text(&violation) };
        findings.push(Finding::new("violation", found, "none", holds));
        let servo = self.rtde.clone().get_servo_data(Empty {}).await.map_err(link)?.into_inner();
        let all_on = !servo.servo_actives.is_empty() && servo.servo_actives.iter().all(|&on| on);
        findings.push(Finding::new("servos on", format!("{:?}", servo.servo_actives), "all", all_on));
        let no_brake = !servo.brake_actives.iter().any(|&on| on);
        findings.push(Finding::new("brakes on", format!("{:?}", servo.brake_actives), "none", no_brake));
        let motion = self.rtde.clone().get_motion_data(Empty {}).await.map_err(link)?.into_inner();
        let ratio = motion.speed_ratio;
        findings.push(Finding::new("speed ratio", format!("{ratio} %"), "100 %", ratio == 100));
        let queued = motion.has_motion || motion.is_in_motion || motion.is_pausing;
        findings.push(Finding::new("motion under way or waiting", queued, "false", !queued));
        Ok(findings)
    }

    /// Whether it is the arm of the command, and set up to look after itself.
    async fn settings(&self, command: &Command, station: &Station) -> Result<Vec<Finding>, Trouble> {
        let info = self.control.clone().get_control_info(Empty {}).await.map_err(link)?.into_inner();
        let device = self.device.clone().get_device_info(Empty {}).await.map_err(link)?.into_inner();
        let (model, wanted) = (plain(&info.robot_model), plain(&command.arm));
        let holds = !model.is_empty() && wanted.starts_with(&model);
        let mut findings = vec![
            Finding::note("controller version", &info.control_version),
            Finding::note("serial number", &device.robot_serial),
            Finding::new("robot model", &info.robot_model, &command.arm, holds),
            Finding::new(
                "joints",
                device.num_joints,
                command.joints.len().to_string(),
                device.num_joints as usize == command.joints.len(),
            ),
        ];
        let policy = self.config.clone().get_coll_policy(Empty {}).await.map_err(link)?.into_inner().policy();
        let holds = policy != CollisionPolicyType::CollNoDetect;
        findings.push(Finding::new("collision policy", policy.as_str_name(), "any that detects", holds));
        let level = self.config.clone().get_coll_sens_level(Empty {}).await.map_err(link)?.into_inner().level;
        findings.push(Finding::note("collision sensitivity (1 is the most sensitive)", level));
        let limits = self.config.clone().get_safety_limits(Empty {}).await.map_err(link)?.into_inner();
        let (limit_m_s, needed_m_s) = (f64::from(limits.tcp_speed_limit), command.strike.speed_m_s);
        let needed = format!("at least {needed_m_s:.3} m/s");
        let holds = limit_m_s >= needed_m_s;
        findings.push(Finding::new("tip speed limit", format!("{limit_m_s:.3} m/s"), needed, holds));
        let tool = self.config.clone().get_tool_property(Empty {}).await.map_err(link)?.into_inner();
        let (mass_kg, ours_kg) = (f64::from(tool.mass), station.arm().tool.mass_kg);
        let needed = format!("{ours_kg:.3} kg within {TOOL_KG} kg");
        let holds = (mass_kg - ours_kg).abs() <= TOOL_KG;
        findings.push(Finding::new("tool mass", format!("{mass_kg:.3} kg"), needed, holds));
        Ok(findings)
    }

    /// Whether the controller's kinematics is ours: where it says the tool is now, and where it would bring it in the strike.
    async fn kinematics(
        &self,
        command: &Command,
        arm: &Arm,
        data: &ControlData,
    ) -> Result<Vec<Finding>, Trouble> {
        let Some(frames) = Frames::of(data) else {
            return Ok(vec![Finding::new("the controller's frames", "missing", "six numbers each", false)]);
        };
        let ours = |q_rad: &[f64]| frames.tool(arm, q_rad);
        let q_rad = super::radians(&data.q);
        if q_rad.len() != arm.joint_count() {
            let found = format!("{} joint angles", q_rad.len());
            return Ok(vec![Finding::new("tool now", found, arm.joint_count().to_string(), false)]);
        }
        let mut findings = vec![compared("tool now", &data.p, &ours(&q_rad))];
        let contact = command.at(command.stroke.contact_time_s).map(|state| state.q_rad);
        let begin = command.phase(PhaseName::Strike).map(|phase| phase.q_rad[0].clone());
        for (what, pose) in [("tool before the run-up", begin), ("tool at the contact", contact)] {
            let Some(q_rad) = pose else { continue };
            let request = requests::forward_kinematics(&q_rad);
            let theirs = self.control.clone().forward_kinematics(request).await.map_err(link)?.into_inner();
            findings.push(compared(what, &theirs.tpos, &ours(&q_rad)));
        }
        Ok(findings)
    }

    /// What the controller's own planner makes of the stroke's line: good to know, for the trajectory sent is ours.
    async fn preview(&self, command: &Command, station: &Station, data: &ControlData) -> Finding {
        const WHAT: &str = "tip speed on the same line by the controller's planner";
        let (Some(phase), Some(frames)) = (command.phase(PhaseName::Strike), Frames::of(data)) else {
            return Finding::note(WHAT, "not asked");
        };
        let (arm, stroke) = (station.arm(), &command.stroke);
        let (from, to) = (&phase.q_rad[0], &phase.q_rad[phase.q_rad.len() - 1]);
        let speed_m_s = command.strike.speed_m_s;
        let request = requests::line_preview(
            &frames.tool(arm, from),
            &frames.tool(arm, to),
            speed_m_s,
            stroke.acceleration_m_s2,
        );
        let found = match self.control.clone().get_motion_l(request).await {
            Ok(answer) => fastest_m_s(&answer.into_inner(), station, (from, command.strike.heading_rad)),
            Err(status) => Err(format!("not told: {}", status.message())),
        };
        match found {
            Ok(m_s) if (m_s / speed_m_s - 1.0).abs() > PREVIEW => Finding::note(
                WHAT,
                format!("{m_s:.3} m/s, asked for {speed_m_s:.3}: 100 % is not 1 m/s here"),
            ),
            Ok(m_s) => Finding::note(WHAT, format!("{m_s:.3} m/s, asked for {speed_m_s:.3}")),
            Err(reason) => Finding::note(WHAT, reason),
        }
    }
}

/// The largest speed along a heading in a motion that the controller planned.
fn fastest_m_s(
    planned: &GetMotionRes,
    station: &Station,
    (start, heading_rad): (&[f64], f64),
) -> Result<f64, String> {
    let first = planned.q_list.first().ok_or("not told: an empty plan")?;
    // Vendor's documents do not tell the unit: the pose it must start from does.
    let near = |scale: f64| {
        let apart = first.values.iter().zip(start).map(|(a, b)| (a * scale - b).abs());
        first.values.len() == start.len() && apart.fold(0.0, f64::max) < 0.1
    };
    let unit = [1.0, 1.0_f64.to_radians()].into_iter().find(|&scale| near(scale));
    let unit = unit.ok_or("not told: the plan starts elsewhere")?;
    let along = Vec2::from_heading(heading_rad);
    let speeds = planned.q_list.iter().zip(&planned.qdot_list).map(|(q, qd)| {
        let scaled = |row: &[f64]| row.iter().map(|x| x * unit).collect::<Vec<_>>();
        let (q_rad, qd_rad_s) = (scaled(&q.values), scaled(&qd.values));
        if q_rad.len() != start.len() || qd_rad_s.len() != start.len() {
            return 0.0;
        }
        station.tip_velocity_on_table(&JointState { q_rad, qd_rad_s, qdd_rad_s2: Vec::new() }).dot(along)
    });
    Ok(speeds.fold(0.0, f64::max))
}

/// The frames in which the controller tells places: its reference in the base, its tool on the flange.
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

    /// The controller's tool in its reference, by our kinematics.
    fn tool(&self, arm: &Arm, q_rad: &[f64]) -> Frame {
        self.base_from_reference.inverse() * arm.flange_frame(q_rad) * self.flange_from_tool
    }
}

/// The controller's frame of the tool beside ours.
fn compared(what: &str, theirs_mm_deg: &[f32], ours: &Frame) -> Finding {
    let needed = format!("ours within {PLACE_MM} mm and {TURN_DEG} degrees");
    let Some(theirs) = frame_from(theirs_mm_deg) else {
        return Finding::new(what, "not told", needed, false);
    };
    let apart_mm = (theirs.translation.vector - ours.translation.vector).norm() * 1e3;
    let turn_deg = theirs.rotation.angle_to(&ours.rotation).to_degrees();
    let holds = apart_mm <= PLACE_MM && turn_deg <= TURN_DEG;
    Finding::new(what, format!("{apart_mm:.2} mm and {turn_deg:.3} degrees from ours"), needed, holds)
}

/// Whether every motion fits into one message.
fn longest(motions: &Motions) -> Finding {
    let longest_s = motions.all().map(Motion::duration_s).fold(0.0, f64::max);
    // Three rows a period, each of eight bytes a joint and four for their frame.
    let joints = motions.strike.start().len();
    let most_s = requests::PERIOD_S * (LARGEST_MESSAGE / (3 * (8 * joints + 4))) as f64;
    let needed = format!("at most {most_s:.1} s, what one message holds");
    Finding::new("longest motion", format!("{longest_s:.1} s"), needed, longest_s <= most_s)
}

/// A name without what people write differently.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_ascii_lowercase()
}
