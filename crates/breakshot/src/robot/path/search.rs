//! The joint path of a strike: approach, run-up, even stroke through the contact, stop, back.
//!
//! The striker stays upright and runs on a straight line at the strike's speed; the arm follows by inverse kinematics every
//! 2 ms, its speeds and accelerations by the Jacobian and its change.  All postures of the arm that reach the line are tried,
//! the one with most room and nearest to home first, and each run-up and stop from gentle to hard, until one keeps all limits.

use super::failure::{Attempted, Blame, Failure, Stage};
use super::joint_path::{Line, Path};
use super::limit_monitor::{TipBox, Watch};
use super::limits::{Check, Limits, Quantity};
use super::profile;
use super::safety::SLOW_M_S;
use super::striker_path::{Course, RUN_UPS_M_S2, STOPS_M_S2, contact_after_m};
use crate::cell::Cell;
use crate::error::Result;
use crate::robot::arm::ik_solution::Posture;
use crate::robot::arm::model::frame::Frame;
use crate::robot::arm::mounted_arm::Station;
use crate::robot::arm::self_collision::SelfCollision;
use crate::robot::command::{Answer, Command, Refusal, Stroke};
use crate::robot::phase::{Phase, PhaseName};
use crate::scene::{Scene, Strike};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// How high the tip hovers above its run-up before it comes down (m), and above the highest object.
const HOVER_M: f64 = 0.05;
/// How much higher a detour goes if the straight way is not free (m).
const DETOUR_M: f64 = 0.2;
/// Acceleration and jerk then (m/s2, m/s3).
const SLOW_M_S2: f64 = 0.8;
const SLOW_M_S3: f64 = 8.0;
/// Outside the workspace by this the striker may run (m): it starts behind objects that lie at the edge.
const BOX_MARGIN_M: f64 = 0.15;
/// Postures tried in full for each run-up and stop.
const POSTURES: usize = 6;
/// What a radian of way from home counts against room to the limits: arms that turn round are slow to get there.
const FAR_FROM_HOME_PER_RAD: f64 = 0.2;
/// Postures whose use of the limits differs by less rank in the order in which they were found.
const RANK_STEP: f64 = 1e-6;
/// The speed at the contact may differ from the plan's by this share.
const SPEED_TOLERANCE: f64 = 0.01;

/// What stays the same for all attempts.
pub(crate) struct Attempt<'a> {
    pub(crate) station: &'a Station,
    pub(crate) limits: &'a Limits,
    collision: SelfCollision,
    tip_box: TipBox,
    hover_m: f64,
    retract_m_s: f64,
    pub(crate) home: Vec<f64>,
}

/// See [`crate::robot::command()`].
pub(crate) fn command(
    cell: &Cell,
    strike: &Strike,
    scene: Option<&Scene>,
    limits: &Limits,
) -> Result<Answer> {
    let station = Station::of_cell(cell)?;
    let contact_m = match scene {
        Some(scene) => contact_after_m(strike, &station.striker, scene)?,
        None => None,
    };
    let place =
        strike.start_m + crate::geometry::Vec2::from_heading(strike.heading_rad) * contact_m.unwrap_or(0.0);
    let postures = station.postures(place, strike.heading_rad);
    let Some(home) = home(&station, cell) else {
        return Ok(refused("the arm's waiting pose above the middle of the workspace is out of its reach"));
    };
    if postures.is_empty() {
        let reason = format!(
            "the arm cannot hold the striker upright at ({:.3}, {:.3}) m on the table: out of its reach",
            place.x, place.y
        );
        return Ok(refused(reason));
    }
    let attempt = Attempt {
        station: &station,
        limits,
        collision: SelfCollision::of(&station.arm, station.striker.outer_radius_m()),
        tip_box: tip_box(cell),
        hover_m: station.strike_height_m + HOVER_M + highest_object_m(scene),
        retract_m_s: cell.striker.retract_speed_m_s.min(SLOW_M_S),
        home,
    };
    attempt.search((cell, strike, scene), contact_m, &postures)
}

fn refused(reason: impl Into<String>) -> Answer {
    Answer::Refused(Refusal { reason: reason.into(), part: None, fastest_m_s: None })
}

pub(crate) fn tip_box(cell: &Cell) -> TipBox {
    let (min, max) = (cell.workspace.min_m, cell.workspace.max_m);
    TipBox {
        low: [min.x - BOX_MARGIN_M, min.y - BOX_MARGIN_M],
        high: [max.x + BOX_MARGIN_M, max.y + BOX_MARGIN_M],
    }
}

fn highest_object_m(scene: Option<&Scene>) -> f64 {
    let Some(scene) = scene else { return 0.0 };
    let heights = scene.placed.iter().filter_map(|placed| scene.object(&placed.object).ok());
    heights.map(|object| object.height_m).fold(0.0, f64::max)
}

/// The waiting pose: the cell's, the maker's, or the tip well above the middle of the workspace.
fn home(station: &Station, cell: &Cell) -> Option<Vec<f64>> {
    /// Above what lies on the table and above the striker's own hovering (m).
    const HEIGHT_M: f64 = 0.3;
    if let Some(home) = &station.home_rad {
        return Some(home.clone());
    }
    let workspace = &cell.workspace;
    let middle = workspace.min_m + (workspace.max_m - workspace.min_m) / 2.0;
    let branches = station.arm.branches(&station.upright(middle, HEIGHT_M, 0.0));
    let room = |angles: &Vec<f64>| {
        let ends = angles.iter().zip(&station.arm.links);
        let margin = |(q, link): (&f64, &crate::robot::Link)| {
            let [low, high] = link.joint.range_rad;
            (q - low).min(high - q)
        };
        ends.map(margin).fold(f64::INFINITY, f64::min)
    };
    branches.into_iter().max_by(|a, b| room(a).total_cmp(&room(b)))
}

impl Attempt<'_> {
    /// The first posture that some run-up and stop brings through all limits, the one with most room first.
    fn search(
        &self,
        (cell, strike, scene): (&Cell, &Strike, Option<&Scene>),
        contact_m: Option<f64>,
        postures: &[Posture],
    ) -> Result<Answer> {
        let mut nearest = Failure::new(Stage::Reach, "no posture of the arm reaches the whole line");
        let mut fastest_m_s: f64 = 0.0;
        let usual = Course::new(strike, contact_m, RUN_UPS_M_S2[1], STOPS_M_S2[0]);
        let mut ranked: Vec<(f64, &Posture)> = Vec::new();
        for posture in postures {
            match self.use_of_limits(&usual, posture) {
                Ok((share, speed_m_s)) => {
                    fastest_m_s = fastest_m_s.max(speed_m_s);
                    let rank = share + FAR_FROM_HOME_PER_RAD * distance_rad(&posture.angles, &self.home);
                    ranked.push(((rank / RANK_STEP).round(), posture));
                }
                Err(failure) => nearest = nearest.better(failure),
            }
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, posture) in ranked.into_iter().take(POSTURES) {
            let (mut run_ups, mut stops) = (RUN_UPS_M_S2.iter().peekable(), STOPS_M_S2.iter().peekable());
            while let (Some(&&run_up), Some(&&stop)) = (run_ups.peek(), stops.peek()) {
                let course = Course::new(strike, contact_m, run_up, stop);
                let obstacle = match scene {
                    Some(scene) => course.obstacle(&self.station.striker, scene)?,
                    None => None,
                };
                let attempt = match obstacle {
                    Some(what) => Err(Failure { blame: Blame::RunUp, ..Failure::new(Stage::Room, what) }),
                    None => self.carried_out(&course, posture),
                };
                match attempt {
                    Ok((phases, worst)) => {
                        let plan = Planned { cell, strike, scene, course: &course, posture };
                        return Ok(Answer::Ready(Box::new(self.told(&plan, phases, worst))));
                    }
                    Err(failure) => {
                        match failure.blame {
                            Blame::RunUp => drop(run_ups.next()),
                            Blame::Stop => drop(stops.next()),
                            Blame::Posture => run_ups = [].iter().peekable(),
                        }
                        nearest = nearest.better(failure);
                    }
                }
            }
        }
        let fastest_m_s = (fastest_m_s > 0.0).then_some(fastest_m_s);
        Ok(Answer::Refused(Refusal { reason: nearest.reason, part: nearest.part, fastest_m_s }))
    }

    /// A quick look along the line and above its start: the largest share of a limit that it needs, and the speed at which
    /// the first joint would reach its limit (m/s).
    fn use_of_limits(&self, course: &Course, posture: &Posture) -> Attempted<(f64, f64)> {
        /// Places looked at on the way to either end.
        const STEPS: u32 = 12;
        let anchor_m = course.contact_m.unwrap_or(0.0);
        let low_m = self.station.strike_height_m;
        let direction = self.station.direction_in_base(course.direction);
        let (mut share, mut fastest_m_s): (f64, f64) = (0.0, f64::INFINITY);
        let mut at = posture.clone();
        for end_m in [course.end_m, course.begin_m.min(course.back_m)] {
            at.angles.clone_from(&posture.angles);
            for k in 0..=STEPS {
                let along_m = anchor_m + (end_m - anchor_m) * f64::from(k) / f64::from(STEPS);
                let target = self.frame_at(course, along_m, low_m, at.yaw_rad);
                share = share.max(self.moved_to(&mut at, &target)?);
                let speed_m_s = self.limits.speed_share * self.station.straight_speed_m_s(&at, &direction);
                fastest_m_s = fastest_m_s.min(speed_m_s);
                share = share.max(course.up.speed / speed_m_s);
            }
        }
        for k in 1..=STEPS {
            let height_m = low_m + (self.hover_m - low_m) * f64::from(k) / f64::from(STEPS);
            let target = self.frame_at(course, course.begin_m, height_m, at.yaw_rad);
            share = share.max(self.moved_to(&mut at, &target)?);
        }
        Ok((share, fastest_m_s))
    }

    /// Moves a posture a little; gives the share of its joints' margins and of the condition number that it then uses.
    fn moved_to(&self, at: &mut Posture, target: &Frame) -> Attempted<f64> {
        let arm = &self.station.arm;
        at.angles = arm
            .descend(target, at.angles.clone(), at.still)
            .ok_or_else(|| Failure::new(Stage::Reach, "the strike's line leaves the arm's reach"))?;
        let mut share = arm.condition_number(&at.angles) / self.limits.condition_number;
        for (q, link) in at.angles.iter().zip(&arm.links) {
            let [low, high] = link.joint.range_rad;
            let margin_rad = (q - low).min(high - q);
            if margin_rad < self.limits.joint_margin_rad {
                let (part, excess) =
                    (format!("joint `{}`", link.joint.name), self.limits.joint_margin_rad - margin_rad);
                let reason = format!(
                    "{part} would come within {:.3} rad of the end of its range; allowed is at least {:.3} rad",
                    margin_rad.max(0.0),
                    self.limits.joint_margin_rad
                );
                return Err(Failure {
                    stage: Stage::Reach,
                    excess,
                    reason,
                    part: Some(part),
                    time_s: 0.0,
                    blame: Blame::Posture,
                });
            }
            share = share.max(self.limits.joint_margin_rad / margin_rad);
        }
        let mut watch = self.watch();
        watch.look_at_clearances(PhaseName::Strike, 0.0, &at.angles);
        watch.broken().map_or(Ok(share), |check| Err(Failure::of_check(Stage::Reach, check)))
    }

    fn frame_at(&self, course: &Course, along_m: f64, height_m: f64, yaw_rad: f64) -> Frame {
        self.station.upright(course.point(along_m), height_m, yaw_rad)
    }

    /// All phases for one posture, and the worst of each check; or why not.
    fn carried_out(
        &self,
        course: &Course,
        posture: &Posture,
    ) -> Attempted<(Vec<Phase>, BTreeMap<Quantity, Check>)> {
        let arm = &self.station.arm;
        let low_m = self.station.strike_height_m;
        let frame = |along_m: f64, height_m: f64| self.frame_at(course, along_m, height_m, posture.yaw_rad);
        let reach = |from: &[f64], target: Frame| {
            let angles = arm.descend(&target, from.to_vec(), posture.still);
            angles.ok_or_else(|| {
                Failure::new(Stage::Reach, "the start of the run-up is out of the arm's reach")
            })
        };
        let slow = profile::Limits { speed: SLOW_M_S, acceleration: SLOW_M_S2, jerk: SLOW_M_S3 };
        let back = profile::Limits { speed: self.retract_m_s, ..slow };
        let begin = reach(&posture.angles, frame(course.begin_m, low_m))?;
        let hover = reach(&begin, frame(course.begin_m, self.hover_m))?;
        let mut path = Path::new(self);
        // The strike first: it is what most often cannot be done.
        let stroke = Line {
            to_m: self.way_m(course, course.end_m - course.begin_m),
            profile: course.profile(),
            still: posture.still,
        };
        let touch_s = course.contact_time_s();
        path.check_alone(PhaseName::Strike, &path.line(&begin, &stroke)?, Stage::Strike).map_err(
            |failure| {
                let blame = if failure.time_s < touch_s { Blame::RunUp } else { Blame::Stop };
                Failure { blame, ..failure }
            },
        )?;
        // High above is a way round what stands beside the straight one; without one the straight way must do.
        let above =
            reach(&hover, frame(course.begin_m, self.hover_m + DETOUR_M)).unwrap_or_else(|_| hover.clone());
        path.joint_move(PhaseName::Approach, &self.home, (&above, &hover))?;
        let rise_m = self.hover_m - low_m;
        let up = self.station.base_from_table.rotation * Vector3::z();
        path.straight(PhaseName::Lower, (-up * rise_m, slow), posture.still)?;
        let struck = path.line(path.end(), &stroke)?;
        path.append(PhaseName::Strike, struck);
        path.straight(
            PhaseName::DrawBack,
            (self.way_m(course, course.back_m - course.end_m), back),
            posture.still,
        )?;
        path.straight(PhaseName::Raise, (up * rise_m, slow), posture.still)?;
        let raised = path.end().to_vec();
        path.joint_move(PhaseName::Home, &raised, (&above, &self.home))?;
        path.checked()
    }

    /// A way along the course in the base's frame.
    fn way_m(&self, course: &Course, length_m: f64) -> Vector3<f64> {
        self.station.direction_in_base(course.direction) * length_m
    }

    pub(crate) fn watch(&self) -> Watch<'_> {
        Watch {
            arm: &self.station.arm,
            table_from_base: self.station.base_from_table.inverse(),
            collision: &self.collision,
            limits: self.limits,
            tip_box: self.tip_box,
            worst: BTreeMap::new(),
        }
    }

    /// The command for phases that keep all limits.
    fn told(&self, plan: &Planned, phases: Vec<Phase>, worst: BTreeMap<Quantity, Check>) -> Command {
        let (station, course) = (self.station, plan.course);
        let begins_s = phases.iter().find(|p| p.name == PhaseName::Strike).map_or(0.0, |p| p.span_s()[0]);
        let contact_time_s = begins_s + course.contact_time_s();
        let mut command = Command {
            version: 1,
            arm: station.arm.name.clone(),
            joints: station.arm.joint_names(),
            robot: plan.cell.robot.clone().unwrap_or_default(),
            striker: station.striker.clone(),
            strike: plan.strike.clone(),
            scene: plan.scene.cloned(),
            stroke: Stroke {
                begin_m: course.point(course.begin_m),
                end_m: course.point(course.end_m),
                run_up_m: course.up.ramp_length(),
                stop_m: course.down.ramp_length(),
                acceleration_m_s2: course.up.acceleration.max(course.down.acceleration),
                draw_back_m_s: self.retract_m_s,
                contact_after_m: course.contact_m,
                contact_time_s,
                contact_speed_m_s: 0.0,
                effective_mass_kg: 0.0,
                energy_j: 0.0,
                tool_yaw_rad: plan.posture.yaw_rad,
            },
            phases,
            checks: worst.into_values().collect(),
            warnings: station.arm.warnings.clone(),
        };
        if let Some(state) = command.at(contact_time_s) {
            let direction = station.direction_in_base(course.direction);
            let speed_m_s = direction.dot(&station.arm.tip_velocity(&state));
            let mobility = station.arm.tip_mobility(&state.q_rad);
            let mass_kg = mobility.map_or(0.0, |mobility| 1.0 / direction.dot(&(mobility * direction)));
            command.stroke.contact_speed_m_s = speed_m_s;
            command.stroke.effective_mass_kg = mass_kg;
            command.stroke.energy_j = mass_kg * speed_m_s * speed_m_s / 2.0;
        }
        self.add_warnings(&mut command, course);
        command
    }

    fn add_warnings(&self, command: &mut Command, course: &Course) {
        let asked_m_s = command.strike.speed_m_s;
        let off = (command.stroke.contact_speed_m_s / asked_m_s - 1.0).abs();
        if off > SPEED_TOLERANCE {
            command.warnings.push(format!("the tip's speed at the contact is off by {:.1} %", 100.0 * off));
        }
        let beyond_m = course.end_m - command.strike.travel_m;
        if beyond_m > 0.001 {
            command.warnings.push(format!(
                "the striker stops {:.0} mm past the plan's end: it cannot stop sooner after the contact",
                1e3 * beyond_m
            ));
        }
        if command.scene.is_none() {
            command
                .warnings
                .push("where the objects lie is not known: only the arm's own limits were checked".into());
        } else if course.contact_m.is_none() {
            command.warnings.push("the striker touches no object on its way".into());
        }
        if self.station.arm.links.iter().all(|link| link.joint.armature_kg_m2 == 0.0) {
            command.warnings.push("no rotor inertias are known: the effective mass is a lower bound".into());
        }
    }
}

/// The farthest that any joint is away (rad).
fn distance_rad(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// What a command is made for.
struct Planned<'a> {
    cell: &'a Cell,
    strike: &'a Strike,
    scene: Option<&'a Scene>,
    course: &'a Course,
    posture: &'a Posture,
}
