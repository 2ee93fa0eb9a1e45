//! The services of the mock controller, as in the proto file.

use super::Controller;
use breakshot_drivers::indy::requests::{FULL_SPEED_M_S, PERIOD_S, frame_from};
use breakshot_drivers::wire::{
    CollisionPolicy, CollisionPolicyType, CollisionSensLevel, ControlData, ControlInfo, DeviceInfo, Empty,
    ForwardKinematicsReq, ForwardKinematicsRes, GetMotionLReq, GetMotionRes, JointBaseType, MotionData,
    MoveJReq, MoveJointTrajReq, MoveLReq, OpState, Response, SafetyLimits, ServoData, StopCat, TargetP,
    TaskBaseType, ToolProperties, Vector, ViolationData,
};
use nalgebra::Vector6;
use prost::Message;
use server::config_server::{Config, ConfigServer};
use server::control_server::{Control, ControlServer};
use server::device_server::{Device, DeviceServer};
use server::rt_data_exchange_server::{RtDataExchange, RtDataExchangeServer};
use std::sync::Arc;
use tonic::transport::Server;
use tonic::transport::server::Router;
use tonic::{Request, Response as Reply, Status};

#[allow(clippy::pedantic, unreachable_pub, reason = "generated code")]
mod server {
    include!("../../proto/generated/rt_data_exchange_server.rs");
    include!("../../proto/generated/control_server.rs");
    include!("../../proto/generated/config_server.rs");
    include!("../../proto/generated/device_server.rs");
}

type Answer<T> = Result<Reply<T>, Status>;

/// The controller as shared by one service.
struct Service(Arc<Controller>);

impl Service {
    /// Serves a request; mishaps happen to it and to its answer. The controller processes it even if the client has given up.
    async fn serve<Q, A>(
        &self,
        name: &str,
        request: Request<Q>,
        answer: fn(&Controller, Q) -> Result<A, Status>,
    ) -> Answer<A>
    where
        Q: Message + Default + Clone + 'static,
        A: Message + Default + 'static,
    {
        let (controller, name) = (Arc::clone(&self.0), name.to_owned());
        let served = async move {
            let request = controller.passed(&format!("{name} request"), request.into_inner()).await?;
            let Some(requests) = request else { return Ok(None) };
            let mut first = None;
            for request in requests {
                let answer = answer(&controller, request)?;
                first.get_or_insert(answer);
            }
            controller.record(&name).await;
            let answer = controller.passed(&format!("{name} answer"), first.unwrap_or_default()).await?;
            Ok::<_, Status>(answer.and_then(|answers| answers.into_iter().next()))
        };
        match tokio::spawn(served).await.expect("nobody panics")? {
            Some(answer) => Ok(Reply::new(answer)),
            None => std::future::pending().await,
        }
    }
}

pub(super) fn router(controller: &Arc<Controller>) -> Router {
    let service = || Service(Arc::clone(controller));
    Server::builder()
        .add_service(RtDataExchangeServer::new(service()))
        .add_service(ControlServer::new(service()))
        .add_service(ConfigServer::new(service()))
        .add_service(DeviceServer::new(service()))
}

fn degrees(radians: &[f64]) -> Vec<f32> {
    radians.iter().map(|q| q.to_degrees() as f32).collect()
}

fn radians(degrees: &[f32]) -> Vec<f64> {
    degrees.iter().map(|&q| f64::from(q).to_radians()).collect()
}

fn done(accepted: bool) -> Response {
    let (code, msg) = if accepted { (0, "") } else { (-1, "the motion is not accepted") };
    Response { code, msg: msg.into() }
}

#[tonic::async_trait]
impl RtDataExchange for Service {
    async fn get_control_data(&self, request: Request<Empty>) -> Answer<ControlData> {
        self.serve("GetControlData", request, |controller, _| {
            let q_rad = controller.q_rad();
            let (_, moves) = controller.reported();
            let op_state = if moves { OpState::TrajMoving } else { controller.state().op_state };
            Ok(ControlData {
                op_state: op_state.into(),
                sim_mode: true,
                is_robot_connected: true,
                q: degrees(&q_rad),
                qdot: vec![0.0; 6],
                p: controller.pose(&q_rad),
                pdot: vec![0.0; 6],
                ref_frame: vec![0.0; 6],
                tool_frame: vec![0.0; 6],
                response: None,
            })
        })
        .await
    }

    async fn get_motion_data(&self, request: Request<Empty>) -> Answer<MotionData> {
        self.serve("GetMotionData", request, |controller, _| {
            let (_, is_moving) = controller.reported();
            Ok(MotionData {
                is_in_motion: is_moving,
                is_target_reached: !is_moving,
                has_motion: is_moving,
                speed_ratio: controller.setup.speed_ratio,
                ..MotionData::default()
            })
        })
        .await
    }

    async fn get_servo_data(&self, request: Request<Empty>) -> Answer<ServoData> {
        self.serve("GetServoData", request, |controller, _| {
            let on = controller.setup.servos_on;
            Ok(ServoData { servo_actives: vec![on; 6], brake_actives: vec![!on; 6], response: None })
        })
        .await
    }

    async fn get_violation_data(&self, request: Request<Empty>) -> Answer<ViolationData> {
        self.serve("GetViolationData", request, |controller, _| {
            let violated = controller.state().op_state == OpState::OpViolate;
            // Bit 8: a joint is too fast.
            let (code, text) = if violated { (1 << 8, "Velocity Exceeded") } else { (0, "") };
            Ok(ViolationData { violation_code: code, violation_str: text.into(), ..ViolationData::default() })
        })
        .await
    }
}

#[tonic::async_trait]
impl Control for Service {
    async fn get_control_info(&self, request: Request<Empty>) -> Answer<ControlInfo> {
        self.serve("GetControlInfo", request, |controller, _| {
            let (control_version, robot_model) = ("mock".into(), controller.setup.model.clone());
            Ok(ControlInfo { control_version, robot_model, response: None })
        })
        .await
    }

    async fn forward_kinematics(
        &self,
        request: Request<ForwardKinematicsReq>,
    ) -> Answer<ForwardKinematicsRes> {
        self.serve("ForwardKinematics", request, |controller, request| {
            if request.jpos.len() != controller.arm.joint_count() {
                return Err(Status::invalid_argument("joints"));
            }
            let tpos = controller.pose(&radians(&request.jpos));
            Ok(ForwardKinematicsRes { tpos, response: None })
        })
        .await
    }

    async fn get_motion_l(&self, request: Request<GetMotionLReq>) -> Answer<GetMotionRes> {
        self.serve("GetMotionL", request, |controller, request| {
            let target = request.target_list.first().ok_or_else(|| Status::invalid_argument("no target"))?;
            let step_s = f64::from(request.time_step);
            let line = controller.line(target, request.vel_ratio, request.acc_ratio, step_s);
            let line = line.ok_or_else(|| Status::out_of_range("no such line"))?;
            let row = |values: Vec<f64>| Vector { values: values.iter().map(|x| x.to_degrees()).collect() };
            Ok(GetMotionRes {
                timestamp: (0..line.len()).map(|k| (step_s * k as f64) as f32).collect(),
                q_list: line.iter().map(|(q, _)| row(q.clone())).collect(),
                qdot_list: line.into_iter().map(|(_, qd)| row(qd)).collect(),
            })
        })
        .await
    }

    async fn move_j(&self, request: Request<MoveJReq>) -> Answer<Response> {
        self.serve("MoveJ", request, |controller, request| {
            let target = request.target.unwrap_or_default();
            let mut to = radians(&target.j_target);
            let from = controller.q_rad();
            if to.len() != from.len() {
                return Ok(done(false));
            }
            if target.base_type() == JointBaseType::RelativeJoint {
                to.iter_mut().zip(&from).for_each(|(to, from)| *to += from);
            }
            let displacement = |k: usize| (to[k] - from[k]).abs() / controller.arm.links[k].joint.speed_rad_s;
            let ratio = f64::from(request.vel_ratio).max(1.0) / 100.0;
            // The peak speed of a smooth step is 1.5 times its mean speed.
            let duration_s = 1.5 * (0..from.len()).map(displacement).fold(0.0, f64::max) / ratio + PERIOD_S;
            let count = (duration_s / PERIOD_S) as usize;
            let rows = (0..=count).map(|k| {
                let fraction = k as f64 / count.max(1) as f64;
                let eased = fraction * fraction * (3.0 - 2.0 * fraction);
                from.iter().zip(&to).map(|(from, to)| from + eased * (to - from)).collect()
            });
            Ok(done(controller.begin(rows.collect(), PERIOD_S)))
        })
        .await
    }

    async fn move_l(&self, request: Request<MoveLReq>) -> Answer<Response> {
        self.serve("MoveL", request, |controller, request| {
            let target = request.target.unwrap_or_default();
            let line =
                controller.line(&target, request.vel_ratio, request.acc_ratio, 0.001).unwrap_or_default();
            Ok(done(controller.begin(line.into_iter().map(|(q, _)| q).collect(), 0.001)))
        })
        .await
    }

    async fn move_joint_traj(&self, request: Request<MoveJointTrajReq>) -> Answer<Response> {
        self.serve("MoveJointTraj", request, |controller, request| {
            let rows: Vec<Vec<f64>> = request.q_list.into_iter().map(|row| row.values).collect();
            // A real controller refuses a jump; its servo error is up to half a degree.
            let near = |row: &Vec<f64>| {
                let q_rad = controller.q_rad();
                row.len() == q_rad.len() && row.iter().zip(&q_rad).all(|(a, b)| (a - b).abs() < 0.01)
            };
            let is_continuous = |pair: &[Vec<f64>]| {
                pair[0].len() == pair[1].len()
                    && pair[0].iter().zip(&pair[1]).all(|(a, b)| (a - b).abs() < 0.01)
            };
            Ok(done(
                rows.first().is_some_and(near)
                    && rows.windows(2).all(is_continuous)
                    && controller.begin(rows, PERIOD_S),
            ))
        })
        .await
    }

    async fn stop_motion(&self, request: Request<StopCat>) -> Answer<Response> {
        self.serve("StopMotion", request, |controller, request| {
            controller.stop(request.category);
            Ok(done(true))
        })
        .await
    }

    async fn recover(&self, request: Request<Empty>) -> Answer<Response> {
        self.serve("Recover", request, |controller, _| {
            controller.state().op_state = OpState::OpIdle;
            Ok(done(true))
        })
        .await
    }
}

impl Controller {
    /// A straight line to a pose (mm, deg) with a trapezoidal speed profile: joint angles and velocities, one row per step.
    fn line(&self, target: &TargetP, vel: f32, acc: f32, step_s: f64) -> Option<Vec<(Vec<f64>, Vec<f64>)>> {
        let mut q = self.q_rad();
        let from = if target.t_start.is_empty() { self.tool(&q) } else { frame_from(&target.t_start)? };
        let mut to = frame_from(&target.t_target)?;
        if target.base_type() == TaskBaseType::RelativeTask {
            to =
                nalgebra::Translation3::from(from.translation.vector + to.translation.vector) * from.rotation;
        }
        let displacement = to.translation.vector - from.translation.vector;
        let (length, speed) = (displacement.norm(), FULL_SPEED_M_S * f64::from(vel) / 100.0);
        let acceleration = speed * f64::from(acc) / 100.0;
        let ramp_s = (speed / acceleration).min((length / acceleration).sqrt());
        let duration_s = length / (acceleration * ramp_s) + ramp_s;
        let along = |t: f64| -> (f64, f64) {
            let left = duration_s - t;
            if t < ramp_s {
                (acceleration * t * t / 2.0, acceleration * t)
            } else if left < ramp_s {
                (length - acceleration * left * left / 2.0, acceleration * left)
            } else {
                (acceleration * ramp_s * (t - ramp_s / 2.0), acceleration * ramp_s)
            }
        };
        let mut rows = Vec::new();
        for k in 0..=(duration_s / step_s).ceil() as usize {
            let (along_m, speed_m_s) = along((k as f64 * step_s).min(duration_s));
            let mut frame = from;
            frame.translation.vector +=
                displacement / length * along_m - nalgebra::Vector3::z() * super::BASE_OFFSET_M;
            q = self.arm.inverse(&frame, &q)?;
            let v = displacement / length * speed_m_s;
            let twist = Vector6::new(v.x, v.y, v.z, 0.0, 0.0, 0.0);
            let (qd, _) = self.arm.joint_rates(&q, &twist, &Vector6::zeros(), None)?;
            rows.push((q.clone(), qd));
        }
        Some(rows)
    }
}

#[tonic::async_trait]
impl Config for Service {
    async fn get_coll_policy(&self, request: Request<Empty>) -> Answer<CollisionPolicy> {
        self.serve("GetCollPolicy", request, |controller, _| {
            let policy = if controller.setup.detects_collisions {
                CollisionPolicyType::CollStop
            } else {
                CollisionPolicyType::CollNoDetect
            };
            Ok(CollisionPolicy { policy: policy.into() })
        })
        .await
    }

    async fn get_coll_sens_level(&self, request: Request<Empty>) -> Answer<CollisionSensLevel> {
        self.serve("GetCollSensLevel", request, |_, _| Ok(CollisionSensLevel { level: 3 })).await
    }

    async fn get_safety_limits(&self, request: Request<Empty>) -> Answer<SafetyLimits> {
        self.serve("GetSafetyLimits", request, |controller, _| {
            Ok(SafetyLimits { tcp_speed_limit: controller.setup.tip_limit_m_s })
        })
        .await
    }

    async fn get_tool_property(&self, request: Request<Empty>) -> Answer<ToolProperties> {
        self.serve("GetToolProperty", request, |controller, _| {
            let later = controller.setup.tool_kg_later.filter(|_| controller.state().motions > 0);
            let mass = later.unwrap_or(controller.setup.tool_kg);
            Ok(ToolProperties { mass, ..ToolProperties::default() })
        })
        .await
    }
}

#[tonic::async_trait]
impl Device for Service {
    async fn get_device_info(&self, request: Request<Empty>) -> Answer<DeviceInfo> {
        self.serve("GetDeviceInfo", request, |_, _| {
            Ok(DeviceInfo { num_joints: 6, robot_serial: "mock".into(), ..DeviceInfo::default() })
        })
        .await
    }
}
