//! Which IK solution, run-up and stop give a joint path within all limits?
//!
//! The phases are approach, lowering, strike (run-up, constant speed through the contact, stop), draw-back, raising and
//! return. The striker stays upright and moves on a straight line at the strike's speed; the joint angles follow by inverse
//! kinematics every 2 ms, the joint velocities and accelerations by the Jacobian and its derivative. All IK solutions on the
//! line are ranked by their margin to the limits and their distance from home; for each, the run-ups are tried from gentle to
//! hard and the stops from hard to gentle, until one path keeps all limits.

use super::assembly::{self, StrikeTask};
use super::failure::{Attempted, Failure, Remedy, SearchStage};
use super::joint_path::{CheckedPath, JointPath, TipLine};
use super::limit_monitor::PathConstraints;
use super::limits::{FASTEST_M_S, Limits};
use super::profile::ProfileLimits;
use super::safety::SLOW_M_S;
use super::striker_path::{RUN_UP_ACCELERATIONS_M_S2, STOP_ACCELERATIONS_M_S2, StrikerPath, contact_after_m};
use crate::cell::Cell;
use crate::error::{Error, Result};
use crate::geometry::Vec2;
use crate::robot::arm::ik_solution::IkSolution;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::model::serial_arm::Link;
use crate::robot::arm::mounted_arm::MountedArm;
use crate::robot::command::{Answer, Refusal};
use crate::robot::phase::PhaseName;
use crate::scene::{Scene, Strike};
use crate::statistics::sorted_by_value;
use nalgebra::Vector3;

/// Height of the tip above the strike height and the highest object before it is lowered to the run-up (m).
const HOVER_M: f64 = 0.05;
/// Additional height of the detour if the direct joint-space motion breaks a limit (m).
const DETOUR_M: f64 = 0.2;
/// Acceleration of the straight transfers (m/s2).
const SLOW_M_S2: f64 = 0.8;
/// Jerk of the straight transfers (m/s3).
const SLOW_M_S3: f64 = 8.0;
/// Number of IK solutions for which full paths are computed.
const SOLUTIONS: usize = 6;
/// Weight of the distance from home in an IK solution's rank (1/rad), against the fraction of the limits that it uses.
const HOME_DISTANCE_WEIGHT_PER_RAD: f64 = 0.2;
/// Rounding of the rank: solutions with equal rounded ranks keep the order in which they were found.
const RANK_STEP: f64 = 1e-6;

/// One search: the strike, the arm and its constraints.
struct Search<'a> {
    task: StrikeTask<'a>,
    mounted: &'a MountedArm,
    constraints: PathConstraints<'a>,
    contact_m: Option<f64>,
    hover_m: f64,
    home: Vec<f64>,
}

impl MountedArm {
    /// The joint path of a strike with this arm, which is that of the cell; see [`crate::robot::command()`].
    ///
    /// # Errors
    /// See [`crate::robot::command()`].
    pub(crate) fn command(
        &self,
        cell: &Cell,
        strike: &Strike,
        scene: Option<&Scene>,
        limits: &Limits,
    ) -> Result<Answer> {
        strike.check("strike")?;
        if strike.speed_m_s > FASTEST_M_S {
            let needed = format!("at most {FASTEST_M_S} m/s");
            return Err(Error::invalid("strike", "speed_m_s", strike.speed_m_s, needed));
        }
        let contact_m = match scene {
            Some(scene) => contact_after_m(strike, &self.striker, scene)?,
            None => None,
        };
        let position = strike.start_m + Vec2::from_heading(strike.heading_rad) * contact_m.unwrap_or(0.0);
        let solutions = self.ik_solutions(position, strike.heading_rad);
        let Some(home) = home(self, cell) else {
            return Ok(refused("the home pose above the middle of the workspace is out of the arm's reach"));
        };
        if solutions.is_empty() {
            let reason = format!(
                "the arm cannot hold the striker upright at ({:.3}, {:.3}) m on the table: out of its reach",
                position.x, position.y
            );
            return Ok(refused(reason));
        }
        let search = Search {
            task: StrikeTask {
                cell,
                strike,
                scene,
                retract_m_s: cell.striker.retract_speed_m_s.min(SLOW_M_S),
            },
            mounted: self,
            constraints: PathConstraints::new(self, cell, scene, limits),
            contact_m,
            hover_m: self.strike_height_m + HOVER_M + highest_object_m(scene),
            home,
        };
        search.answer(&solutions)
    }
}

fn refused(reason: impl Into<String>) -> Answer {
    Answer::Refused(Refusal { reason: reason.into(), part: None, fastest_m_s: None })
}

fn highest_object_m(scene: Option<&Scene>) -> f64 {
    let Some(scene) = scene else { return 0.0 };
    let heights = scene.placed.iter().filter_map(|placed| scene.object(&placed.object).ok());
    heights.map(|object| object.height_m).fold(0.0, f64::max)
}

/// The home pose: given by the cell or the maker, or with the tip above the middle of the workspace (rad).
fn home(mounted: &MountedArm, cell: &Cell) -> Option<Vec<f64>> {
    /// Height of the tip, above the objects and the hover height (m).
    const HEIGHT_M: f64 = 0.3;
    if let Some(home) = &mounted.home_rad {
        return Some(home.clone());
    }
    let workspace = &cell.workspace;
    let middle = workspace.min_m + (workspace.max_m - workspace.min_m) / 2.0;
    let branches = mounted.arm.branches(&mounted.upright(middle, HEIGHT_M, 0.0));
    let least_margin = |angles: &Vec<f64>| {
        let joints = angles.iter().zip(&mounted.arm.links);
        let margin = |(q, link): (&f64, &Link)| {
            let [low, high] = link.joint.range_rad;
            (q - low).min(high - q)
        };
        joints.map(margin).fold(f64::INFINITY, f64::min)
    };
    branches.into_iter().max_by(|a, b| least_margin(a).total_cmp(&least_margin(b)))
}

/// How much of the limits an IK solution uses along the strike's line.
struct LimitUsage {
    /// The largest fraction of a limit.
    fraction: f64,
    /// The tip speed at which the first joint reaches its speed limit (m/s).
    fastest_m_s: f64,
}

impl Search<'_> {
    /// The path of the first IK solution for which some run-up and stop keep all limits, or the reason of the best attempt.
    fn answer(&self, solutions: &[IkSolution]) -> Result<Answer> {
        let strike = self.task.strike;
        let mut nearest =
            Failure::new(SearchStage::Reach, "no joint configuration of the arm reaches the whole line");

        // Rank the solutions by a quick check
        let mut fastest_m_s: f64 = 0.0;
        let usual = StrikerPath::new(
            strike,
            self.contact_m,
            RUN_UP_ACCELERATIONS_M_S2[1],
            STOP_ACCELERATIONS_M_S2[0],
        );
        let mut ranked: Vec<(f64, &IkSolution)> = Vec::new();
        for solution in solutions {
            match self.limit_usage(&usual, solution) {
                Ok(usage) => {
                    fastest_m_s = fastest_m_s.max(usage.fastest_m_s);
                    let home_distance_rad = largest_difference_rad(&solution.angles, &self.home);
                    let rank = usage.fraction + HOME_DISTANCE_WEIGHT_PER_RAD * home_distance_rad;
                    ranked.push(((rank / RANK_STEP).round(), solution));
                }
                Err(failure) => nearest = nearest.better(failure),
            }
        }
        let ranked = sorted_by_value(ranked, |&(rank, _)| rank);

        // Try full paths
        for (_, solution) in ranked.into_iter().take(SOLUTIONS) {
            let mut run_ups = RUN_UP_ACCELERATIONS_M_S2.iter().peekable();
            let mut stops = STOP_ACCELERATIONS_M_S2.iter().peekable();
            while let (Some(&&run_up), Some(&&stop)) = (run_ups.peek(), stops.peek()) {
                let striker_path = StrikerPath::new(strike, self.contact_m, run_up, stop);
                let obstacle = match self.task.scene {
                    Some(scene) => striker_path.obstacle(&self.mounted.striker, scene)?,
                    None => None,
                };
                let attempt = match obstacle {
                    Some(reason) => Err(Failure {
                        remedy: Remedy::ShorterRunUp,
                        ..Failure::new(SearchStage::Obstacle, reason)
                    }),
                    None => self.joint_path(&striker_path, solution),
                };
                match attempt {
                    Ok(path) => {
                        let command =
                            assembly::command(&self.task, self.mounted, &striker_path, solution, path);
                        return Ok(Answer::Ready(Box::new(command)));
                    }
                    Err(failure) => {
                        match failure.remedy {
                            Remedy::ShorterRunUp => drop(run_ups.next()),
                            Remedy::SofterStop => drop(stops.next()),
                            Remedy::OtherSolution => run_ups = [].iter().peekable(),
                        }
                        nearest = nearest.better(failure);
                    }
                }
            }
        }
        let fastest_m_s = (fastest_m_s > 0.0).then_some(fastest_m_s);
        Ok(Answer::Refused(Refusal { reason: nearest.reason, part: nearest.part, fastest_m_s }))
    }

    /// A quick check at a few points of the line and above its start.
    fn limit_usage(&self, striker_path: &StrikerPath, solution: &IkSolution) -> Attempted<LimitUsage> {
        /// Number of intervals from the contact to either end of the line, and up to the hover height.
        const STEPS: u32 = 12;
        let anchor_m = striker_path.contact_m.unwrap_or(0.0);
        let low_m = self.mounted.strike_height_m;
        let direction = self.mounted.direction_in_base(striker_path.direction);
        let speed_fraction = self.constraints.limits.speed_fraction;
        let mut usage = LimitUsage { fraction: 0.0, fastest_m_s: f64::INFINITY };
        let mut at = solution.clone();

        // Along the line, from the contact to both ends
        for end_m in [striker_path.end_m, striker_path.begin_m.min(striker_path.back_m)] {
            at.angles.clone_from(&solution.angles);
            for k in 0..=STEPS {
                let along_m = anchor_m + (end_m - anchor_m) * f64::from(k) / f64::from(STEPS);
                let target = self.frame_at(striker_path, along_m, low_m, at.yaw_rad);
                usage.fraction = usage.fraction.max(self.step_to(&mut at, &target)?);
                let speed_m_s = speed_fraction * self.mounted.straight_speed_m_s(&at, &direction);
                usage.fastest_m_s = usage.fastest_m_s.min(speed_m_s);
                usage.fraction = usage.fraction.max(striker_path.run_up.speed / speed_m_s);
            }
        }

        // Up from the start of the run-up
        for k in 1..=STEPS {
            let height_m = low_m + (self.hover_m - low_m) * f64::from(k) / f64::from(STEPS);
            let target = self.frame_at(striker_path, striker_path.begin_m, height_m, at.yaw_rad);
            usage.fraction = usage.fraction.max(self.step_to(&mut at, &target)?);
        }
        Ok(usage)
    }

    /// Moves a solution to a nearby target; returns the fraction of the joint margins and of the condition number in use.
    fn step_to(&self, at: &mut IkSolution, target: &Frame) -> Attempted<f64> {
        let (arm, limits) = (self.constraints.arm, self.constraints.limits);
        at.angles = arm
            .descend(target, at.angles.clone(), at.fixed_joint)
            .ok_or_else(|| Failure::new(SearchStage::Reach, "the strike's line leaves the arm's reach"))?;
        let mut fraction = arm.condition_number(&at.angles) / limits.condition_number;
        for (q, link) in at.angles.iter().zip(&arm.links) {
            let [low, high] = link.joint.range_rad;
            let margin_rad = (q - low).min(high - q);
            if margin_rad < limits.joint_margin_rad {
                let part = format!("joint `{}`", link.joint.name);
                let reason = format!(
                    "{part} would come within {:.3} rad of the end of its range; allowed is at least {:.3} rad",
                    margin_rad.max(0.0),
                    limits.joint_margin_rad
                );
                let excess = limits.joint_margin_rad - margin_rad;
                return Err(Failure { excess, part: Some(part), ..Failure::new(SearchStage::Reach, reason) });
            }
            fraction = fraction.max(limits.joint_margin_rad / margin_rad);
        }
        let mut monitor = self.constraints.monitor();
        monitor.record_clearances(PhaseName::Strike, 0.0, &at.angles);
        let broken = monitor.broken();
        broken.map_or(Ok(fraction), |check| Err(Failure::of_check(SearchStage::Reach, check)))
    }

    fn frame_at(&self, striker_path: &StrikerPath, along_m: f64, height_m: f64, yaw_rad: f64) -> Frame {
        self.mounted.upright(striker_path.point(along_m), height_m, yaw_rad)
    }

    /// All phases for one IK solution, with the worst check of each quantity.
    fn joint_path(&self, striker_path: &StrikerPath, solution: &IkSolution) -> Attempted<CheckedPath> {
        let arm = &self.mounted.arm;
        let fixed = solution.fixed_joint;
        let low_m = self.mounted.strike_height_m;

        // Poses at the start of the run-up and above it
        let begin_m = striker_path.begin_m;
        let reach = |from: &[f64], height_m: f64| {
            let target = self.frame_at(striker_path, begin_m, height_m, solution.yaw_rad);
            let reason = "the start of the run-up is out of the arm's reach";
            let angles = arm.descend(&target, from.to_vec(), fixed);
            angles.ok_or_else(|| Failure::new(SearchStage::Reach, reason))
        };
        let begin = reach(&solution.angles, low_m)?;
        let hover = reach(&begin, self.hover_m)?;

        // The stroke alone first: it is the phase that most often breaks a limit
        let mut path = JointPath::new(&self.constraints, &self.home);
        let stroke = TipLine {
            to_m: self.displacement_m(striker_path, striker_path.end_m - begin_m),
            profile: striker_path.profile(),
            fixed_joint: fixed,
        };
        let contact_s = striker_path.contact_time_s();
        let with_remedy = |failure: Failure, strike_begins_s: f64| {
            let before_contact = failure.time_s < strike_begins_s + contact_s;
            let remedy = if before_contact { Remedy::ShorterRunUp } else { Remedy::SofterStop };
            Failure { remedy, ..failure }
        };
        path.check_phase(PhaseName::Strike, &path.line(&begin, &stroke)?, SearchStage::Strike)
            .map_err(|failure| with_remedy(failure, 0.0))?;

        // All phases in order
        // Without a reachable detour pose the detour is the direct motion.
        let above = reach(&hover, self.hover_m + DETOUR_M).unwrap_or_else(|_| hover.clone());
        let slow = ProfileLimits { speed: SLOW_M_S, acceleration: SLOW_M_S2, jerk: SLOW_M_S3 };
        let back = ProfileLimits { speed: self.task.retract_m_s, ..slow };
        let up = self.mounted.base_from_table.rotation * Vector3::z();
        let rise_m = self.hover_m - low_m;
        path.append_joint_move(PhaseName::Approach, &self.home, &above, &hover)?;
        path.append_line(PhaseName::Lower, -up * rise_m, slow, fixed)?;
        let samples = path.line(path.end(), &stroke)?;
        let begins_s = path.ends_s();
        let checks = path.check_phase(PhaseName::Strike, &samples, SearchStage::Whole);
        path.append(PhaseName::Strike, samples, checks.map_err(|failure| with_remedy(failure, begins_s))?);
        let draw_back_m = self.displacement_m(striker_path, striker_path.back_m - striker_path.end_m);
        path.append_line(PhaseName::DrawBack, draw_back_m, back, fixed)?;
        path.append_line(PhaseName::Raise, up * rise_m, slow, fixed)?;
        let raised = path.end().to_vec();
        path.append_joint_move(PhaseName::Home, &raised, &above, &self.home)?;
        Ok(path.checked())
    }

    /// A displacement along the striker's path in the base frame (m).
    fn displacement_m(&self, striker_path: &StrikerPath, length_m: f64) -> Vector3<f64> {
        self.mounted.direction_in_base(striker_path.direction) * length_m
    }
}

/// The largest difference of a joint angle between two poses (rad).
fn largest_difference_rad(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
