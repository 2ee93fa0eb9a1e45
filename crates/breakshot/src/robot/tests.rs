mod urscript;

use super::*;
use crate::geometry::{Point, Vec2};
use crate::object::{Object, Shape};
use crate::scene::Placed;

/// A cell with an Indy 7.
fn cell() -> Cell {
    toml::from_str(include_str!("../../tests/data/arms/indy7_cell.toml")).expect("a cell")
}

fn scene() -> Scene {
    let object = Object {
        name: "a".into(),
        shape: Shape::Disc { radius_m: 0.03 },
        height_m: 0.04,
        marker: None,
        mass_kg: None,
        support: None,
    };
    Scene::on_free_table(
        cell(),
        vec![object],
        vec![Placed { object: "a".into(), position_m: Point::new(0.0, 0.0), yaw_rad: 0.0 }],
    )
}

fn strike(heading_rad: f64, speed_m_s: f64) -> Strike {
    let start_m = Point::ORIGIN - Vec2::from_heading(heading_rad) * 0.1;
    Strike { object: Some("a".into()), start_m, heading_rad, speed_m_s, travel_m: 0.08 }
}

fn ready(strike: &Strike) -> Command {
    match command(&cell(), strike, Some(&scene()), &Options::default()).expect("a cell with an arm") {
        Answer::Ready(command) => *command,
        Answer::Refused(refusal) => panic!("refused: {refusal:?}"),
    }
}

#[test]
fn the_tip_moves_straight_and_at_the_planned_speed_through_the_contact() {
    for heading_rad in [0.0, 1.0, 2.5, -1.2] {
        let strike = strike(heading_rad, 0.4);
        let command = ready(&strike);
        let mounted = MountedArm::of_cell(&cell()).expect("an arm");
        let speed_m_s = command.stroke.contact_speed_m_s;
        assert!((speed_m_s - 0.4).abs() < 0.004, "{speed_m_s} m/s at the contact");
        let phase = command.phase(PhaseName::Strike).expect("a strike");
        let direction = Vec2::from_heading(heading_rad);
        for q in &phase.q_rad {
            let (tip, height_m) = mounted.tip_on_table(q);
            let aside_m = direction.cross(tip - strike.start_m);
            assert!(
                aside_m.abs() < 1e-9 && (height_m - 0.01).abs() < 1e-9,
                "{aside_m} m off the line, {height_m} m high"
            );
        }
    }
}

#[test]
fn the_velocities_are_the_slope_of_the_angles_and_all_phases_join_at_rest() {
    let command = ready(&strike(0.7, 0.5));
    let names: Vec<PhaseName> = command.phases.iter().map(|phase| phase.name).collect();
    assert_eq!(names, PhaseName::ALL);
    let mut before: Option<(f64, Vec<f64>)> = None;
    for phase in &command.phases {
        if let Some((time_s, q)) = &before {
            let apart = q.iter().zip(&phase.q_rad[0]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(apart < 1e-9, "{:?} starts {apart} rad away", phase.name);
            assert_eq!(*time_s, phase.time_s[0]);
        }
        for k in [0, phase.time_s.len() - 1] {
            let fastest = phase.qd_rad_s[k].iter().fold(0.0, |most: f64, qd| most.max(qd.abs()));
            assert!(fastest < 1e-6, "{:?} has {fastest} rad/s at its end {k}", phase.name);
        }
        for k in 1..phase.time_s.len() {
            let step_s = phase.time_s[k] - phase.time_s[k - 1];
            assert!(step_s > 0.0 && step_s <= 0.002 + 1e-12, "{step_s} s between samples");
            for joint in 0..6 {
                // The trapezoid rule is right to a sixth of the jerk times the step cubed.
                let slope = f64::midpoint(phase.qd_rad_s[k][joint], phase.qd_rad_s[k - 1][joint]);
                let moved = phase.q_rad[k][joint] - phase.q_rad[k - 1][joint];
                assert!((moved - slope * step_s).abs() < 1e-5, "{:?} joint {joint} jumps at {k}", phase.name);
            }
        }
        before = Some((phase.span_s()[1], phase.q_rad[phase.q_rad.len() - 1].clone()));
    }
}

#[test]
fn every_limit_is_checked_and_kept() {
    let command = ready(&strike(2.0, 0.5));
    assert_eq!(command.checks.len(), 10, "{:?}", command.checks);
    for check in &command.checks {
        assert!(check.holds(), "{}", check.sentence());
    }
}

fn refusal(strike: &Strike, scene: &Scene, limits: Limits) -> Refusal {
    match command(&cell(), strike, Some(scene), &Options { limits }).expect("a cell with an arm") {
        Answer::Ready(_) => panic!("not refused"),
        Answer::Refused(refusal) => refusal,
    }
}

#[test]
fn a_strike_too_fast_for_a_joint_is_refused_with_the_joint_and_a_feasible_speed() {
    let limits = Limits { speed_fraction: 0.15, ..Limits::default() };
    let refused = refusal(&strike(0.0, 0.9), &scene(), limits.clone());
    assert!(
        refused.reason.contains("joint `joint") && refused.reason.contains("speed"),
        "{}",
        refused.reason
    );
    let fastest_m_s = refused.fastest_m_s.expect("a speed");
    let slower = strike(0.0, fastest_m_s * 0.95);
    let answer = command(&cell(), &slower, Some(&scene()), &Options { limits }).expect("a cell with an arm");
    assert!(matches!(answer, Answer::Ready(_)), "{fastest_m_s} m/s: {answer:?}");
}

#[test]
fn an_obstacle_on_the_run_up_is_named() {
    let mut crowded = scene();
    let behind = Placed { object: "a#2".into(), position_m: Point::new(-0.16, 0.0), yaw_rad: 0.0 };
    crowded.placed.push(behind);
    let refused = refusal(&strike(0.0, 0.5), &crowded, Limits::default());
    assert!(refused.reason.contains("`a#2`"), "{}", refused.reason);
}

#[test]
fn a_start_out_of_reach_is_refused() {
    let mut far = strike(0.0, 0.3);
    far.start_m = Point::new(2.0, 2.0);
    let refused = refusal(&far, &scene(), Limits::default());
    assert!(refused.reason.contains("out of its reach"), "{}", refused.reason);
}

#[test]
fn a_heavy_tool_is_refused_with_the_overloaded_joint() {
    let mut heavy = cell();
    heavy.robot.as_mut().expect("an arm").tool_mass_kg = 60.0;
    let answer = command(&heavy, &strike(0.0, 0.3), Some(&scene()), &Options::default()).expect("an arm");
    let Answer::Refused(refused) = answer else { panic!("not refused") };
    assert!(refused.reason.contains("torque"), "{}", refused.reason);
}

#[test]
fn rotating_the_table_rotates_the_strike_and_changes_nothing_else() {
    let plain = ready(&strike(0.3, 0.4));
    let mut rotated_cell = cell();
    let robot = rotated_cell.robot.as_mut().expect("an arm");
    robot.base_from_table.as_mut().expect("a base pose").rpy_rad[2] += 1.0;
    let mut rotated = scene();
    rotated.cell = rotated_cell.clone();
    rotated_cell.workspace.min_m = Point::new(-0.4, -0.4);
    rotated_cell.workspace.max_m = Point::new(0.4, 0.4);
    let answer =
        command(&rotated_cell, &strike(0.3 - 1.0, 0.4), Some(&rotated), &Options::default()).expect("an arm");
    let Answer::Ready(rotated) = answer else { panic!("refused: {answer:?}") };
    let (one, other) = (plain.stroke.effective_mass_kg, rotated.stroke.effective_mass_kg);
    assert!((one - other).abs() < 1e-6, "{one} kg and {other} kg");
}

#[test]
fn the_hash_depends_on_the_scene_and_on_the_path() {
    let command = ready(&strike(0.3, 0.4));
    let mut moved = command.clone();
    moved.scene.as_mut().expect("a scene").placed[0].position_m.x += 1e-9;
    let mut altered = command.clone();
    altered.phases[2].q_rad[7][3] += 1e-12;
    let hashes = [&command, &moved, &altered].map(Command::short_hash);
    assert!(hashes[0] != hashes[1] && hashes[0] != hashes[2], "{hashes:?}");
    assert_eq!(hashes[0].len(), 8);
}

#[test]
fn a_command_survives_writing_and_reading() {
    let command = ready(&strike(0.3, 0.4));
    let text = serde_json::to_string(&command).expect("json");
    let again: Command = serde_json::from_str(&text).expect("what was just written");
    assert!(again == command, "the command changed in the round trip");
}

#[test]
fn the_ros_goal_contains_every_sample_time_once_in_order() {
    let command = ready(&strike(0.3, 0.4));
    let goal = command.follow_joint_trajectory();
    let times: Vec<u64> = goal
        .trajectory
        .points
        .iter()
        .map(|point| {
            point.time_from_start.sec as u64 * 1_000_000_000 + u64::from(point.time_from_start.nanosec)
        })
        .collect();
    assert!(times.is_sorted_by(|a, b| a < b), "times repeat or go back");
    let strike = command.phase(PhaseName::Strike).expect("a strike");
    for time_s in &strike.time_s {
        let ns = (time_s * 1e9).round() as u64;
        assert!(times.contains(&ns), "the instant {time_s} s of the strike is missing");
    }
    let end_ns = (command.duration_s() * 1e9).round() as u64;
    assert_eq!((times.first(), times.last()), (Some(&0), Some(&end_ns)));
    let yaml = crate::cell::yaml::value(goal.yaml()).expect("yaml");
    let read: FollowJointTrajectory = serde_json::from_value(yaml).expect("a goal");
    assert!(read == goal, "the goal changed in the round trip through YAML");
}

#[test]
fn the_urscript_strikes_at_the_planned_speed_and_reaches_it_before_the_contact() {
    let command = ready(&strike(0.3, 0.4));
    let script = command.urscript().expect("six joints");
    assert!(script.starts_with("def breakshot_strike():\n") && script.ends_with("end\n"), "{script}");
    assert_eq!(script.matches("movel(").count(), 4, "{script}");
    assert!(script.contains("v=0.4)"), "{script}");
    assert!(script.contains("popup("), "it starts anywhere: {script}");
    let stroke = &command.stroke;
    let ramp_m = 0.4 * 0.4 / (2.0 * stroke.acceleration_m_s2);
    let touch_m =
        stroke.begin_m.distance(command.strike.start_m) + stroke.contact_after_m.expect("a contact");
    let whole_m = stroke.begin_m.distance(stroke.end_m);
    assert!(
        ramp_m < touch_m && touch_m < whole_m - ramp_m,
        "{ramp_m} m to gain speed, contact after {touch_m} m"
    );
}

#[test]
fn the_recording_is_deterministic() {
    let command = ready(&strike(0.3, 0.4));
    let file = |command: &Command| command.recording(None).expect("an arm").finished();
    let bytes = file(&command);
    assert_eq!(bytes, file(&command.clone()));
    let text = String::from_utf8_lossy(&bytes);
    for word in ["foxglove.SceneUpdate", "foxglove.JointStates", "object/a", &command.short_hash()] {
        assert!(text.contains(word), "no `{word}` in the file");
    }
}

#[test]
fn the_notes_on_a_fast_strike_require_a_cell_without_people() {
    let slow = ready(&strike(0.3, 0.2)).safety_notes().expect("an arm").join(" ");
    let fast = ready(&strike(0.3, 0.7)).safety_notes().expect("an arm").join(" ");
    assert!(!slow.contains("clear of people") && fast.contains("clear of people"), "{slow} / {fast}");
    assert!(fast.contains("chest") && slow.contains("not a safety function"), "{slow} / {fast}");
}

#[test]
fn the_figure_of_the_impulse_geometry_is_well_formed() {
    let mounted = MountedArm::of_cell(&cell()).expect("an arm");
    let conditions = ImpulseConditions { object_mass_kg: 0.143, restitution: 0.7, speed_cap_m_s: 1.0 };
    let points = [[-0.1, -0.1], [0.1, 0.1]].map(|[x, y]| Point::new(x, y));
    let geometries: Vec<_> =
        points.iter().filter_map(|&point| mounted.impulse_geometry(point, &conditions)).collect();
    assert_eq!(geometries.len(), 2);
    let svg = impulse_figure(&geometries);
    roxmltree::Document::parse(&svg).expect("well-formed XML");
    assert!(!svg.contains("NaN"), "a number is missing");
    assert!(svg.contains("(c)"), "{svg}");
}

#[test]
fn the_impulse_map_has_a_curve_where_the_arm_reaches_and_a_cross_elsewhere() {
    let mut cell = cell();
    let conditions = ImpulseConditions { object_mass_kg: 0.143, restitution: 0.7, speed_cap_m_s: 1.0 };
    let map = |cell: &Cell| impulse_map(&MountedArm::of_cell(cell).expect("an arm"), cell, &conditions);
    let near = map(&cell);
    roxmltree::Document::parse(&near).expect("well-formed XML");
    assert!(!near.contains("NaN"), "{near}");
    cell.robot.as_mut().and_then(|robot| robot.base_from_table.as_mut()).expect("a pose").position_m[0] = 0.8;
    let far = map(&cell);
    let curves_and_crosses = |svg: &str| ["<polygon", "<path"].map(|tag| svg.matches(tag).count());
    let ([curves, crosses], [far_curves, far_crosses]) =
        (curves_and_crosses(&near), curves_and_crosses(&far));
    assert_eq!((curves + crosses, far_curves + far_crosses), (70, 70), "ten columns of seven rows");
    assert!(curves > far_curves && far_curves > 0, "{curves} and {far_curves} curves");
}

/// A modification that makes a command invalid.
type Damage = fn(&mut Command);

#[test]
fn a_damaged_command_is_refused_with_the_reason() {
    let command = ready(&strike(0.3, 0.4));
    command.check().expect("as it was planned");
    let damaged: [(&str, Damage); 7] = [
        ("rows", |c| drop(c.phases[2].q_rad.pop())),
        ("a row", |c| c.phases[1].qd_rad_s[3].truncate(5)),
        ("a row", |c| c.phases[4].qdd_rad_s2[3][0] = f64::NAN),
        ("off the integral", |c| c.phases[2].q_rad[40][1] += 0.001),
        ("s between two samples", |c| c.phases[2].time_s[40] = 0.0),
        ("phases", |c| drop(c.phases.remove(0))),
        ("joints", |c| c.joints[0] = "other".into()),
    ];
    for (word, damage) in damaged {
        let mut other = command.clone();
        damage(&mut other);
        let message = other.check().expect_err(word).to_string();
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn a_rechecked_command_has_the_same_checks_and_the_speeds_of_its_samples() {
    let command = ready(&strike(2.0, 0.5));
    let again = command.checked_again().expect("an arm and a scene");
    assert_eq!(again, command.checks);
    let [strike_m_s, else_m_s] = command.tip_speeds_m_s().expect("an arm");
    assert!((strike_m_s - 0.5).abs() < 0.005, "{strike_m_s} m/s in the strike");
    assert!(else_m_s <= SLOW_M_S * 1.01, "{else_m_s} m/s elsewhere");
}

/// The example's cell with another home pose.
fn cell_at_home(home_rad: Vec<f64>) -> Cell {
    let mut cell = cell();
    cell.robot.as_mut().expect("a robot").home_rad = Some(home_rad);
    cell
}

/// The joint angles with the striker upright at a point, its tip at this height (rad).
fn pose_at(point: Point, height_m: f64) -> Vec<f64> {
    let mounted = MountedArm::of_cell(&cell()).expect("an arm");
    let upright = mounted.upright(point, height_m, 0.0);
    let usual = mounted.home_rad.clone().expect("an Indy 7");
    let away = |q: &Vec<f64>| q.iter().zip(&usual).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let branches = mounted.arm.branches(&upright);
    branches.into_iter().min_by(|a, b| away(a).total_cmp(&away(b))).expect("in reach")
}

#[test]
fn a_home_pose_with_the_tip_below_the_table_is_refused() {
    let strike = strike(0.0, 0.2);
    for height_m in [-0.026, 0.003] {
        let cell = cell_at_home(pose_at(Point::new(-0.2, 0.1), height_m));
        let answer = command(&cell, &strike, Some(&scene()), &Options::default()).expect("an answer");
        let Answer::Refused(refusal) = answer else { panic!("{height_m} m: accepted") };
        assert!(refusal.reason.contains("the tool: height of its lowest edge"), "{}", refusal.reason);
    }
}

#[test]
fn a_low_home_pose_outside_the_box_is_refused_and_a_high_one_is_not() {
    let max = cell().workspace.max_m;
    let outside = Point::new(max.x + 0.155, 0.0);
    for (height_m, is_refused) in [(0.05, true), (0.2, false)] {
        let cell = cell_at_home(pose_at(outside, height_m));
        let answer =
            command(&cell, &strike(0.0, 0.2), Some(&scene()), &Options::default()).expect("an answer");
        match answer {
            Answer::Refused(refusal) if is_refused => {
                assert!(refusal.reason.contains("edge of the workspace"), "{}", refusal.reason);
            }
            Answer::Refused(refusal) => panic!("{height_m} m: {}", refusal.reason),
            Answer::Ready(_) => assert!(!is_refused, "{height_m} m: accepted"),
        }
    }
}

#[test]
fn a_sample_that_is_no_number_breaks_a_limit_wherever_it_is() {
    let command = ready(&strike(0.3, 0.2));
    for sample in [0, 5, 9] {
        let mut damaged = command.clone();
        damaged.phases[2].qdd_rad_s2[sample][1] = f64::NAN;
        let checks = damaged.checked_again().expect("an arm and a scene");
        assert!(checks.iter().any(|check| !check.holds()), "sample {sample}");
    }
}

#[test]
fn the_tool_goes_around_objects_in_joint_moves_too() {
    // Home is as low as the strike, and the object lies between it and the run-up.
    let cell = cell_at_home(pose_at(Point::new(0.12, 0.0), 0.02));
    let scene = Scene { cell: cell.clone(), ..scene() };
    let answer = command(&cell, &strike(0.0, 0.2), Some(&scene), &Options::default()).expect("an answer");
    let command = match answer {
        Answer::Ready(command) => command,
        Answer::Refused(refusal) => {
            assert!(refusal.reason.contains("distance from an object"), "{}", refusal.reason);
            return;
        }
    };
    let mounted = MountedArm::of_cell(&cell).expect("an arm");
    for name in [PhaseName::Approach, PhaseName::Home] {
        for q in &command.phase(name).expect("a phase").q_rad {
            let (tip, height_m) = mounted.tip_on_table(q);
            let distance_m = tip.distance(Point::ORIGIN) - 0.03 - mounted.striker.outer_radius_m();
            assert!(
                height_m > 0.04 || distance_m > -1e-9,
                "{distance_m} m from the object, {height_m} m high"
            );
        }
    }
    assert!(command.checked_again().expect("a scene").iter().all(LimitCheck::holds));
}

#[test]
fn the_hash_covers_everything_but_the_warnings() {
    let command = ready(&strike(0.3, 0.2));
    let hash = command.short_hash();
    let warned = Command { warnings: vec!["something".into()], ..command.clone() };
    assert_eq!(warned.short_hash(), hash);
    let text = serde_json::to_string(&command).expect("JSON");
    let read: Command = serde_json::from_str(&text).expect("a command");
    assert_eq!(read.short_hash(), hash, "the same after it was written and read");
    let changes: [&dyn Fn(&mut Command); 6] = [
        &|c| c.phases[2].qd_rad_s[10][3] += 1e-9,
        &|c| c.phases[2].qdd_rad_s2[10][3] += 1e-9,
        &|c| c.stroke.contact_time_s += 1e-9,
        &|c| c.robot.tool_mass_kg += 0.1,
        &|c| c.striker = Shape::Disc { radius_m: 0.5 },
        &|c| c.scene.as_mut().expect("a scene").cell.workspace.max_m.x += 1.0,
    ];
    for (k, change) in changes.iter().enumerate() {
        let mut changed = command.clone();
        change(&mut changed);
        assert_ne!(changed.short_hash(), hash, "change {k}");
    }
}

#[test]
fn velocities_and_accelerations_that_do_not_belong_to_the_angles_are_refused() {
    type Change = fn(&mut Phase);

    for heading_rad in [0.0, 1.0, 2.5, -1.2] {
        for speed_m_s in [0.1, 0.5] {
            ready(&strike(heading_rad, speed_m_s)).check().expect("its own command");
        }
    }
    let command = ready(&strike(0.3, 0.2));
    let changes: [(&str, Change); 3] = [
        ("qd_rad_s", |phase| phase.qd_rad_s[40][2] += 0.04),
        ("qdd_rad_s2", |phase| phase.qdd_rad_s2[40][2] += 5.0),
        ("qdd_rad_s2", |phase| phase.qdd_rad_s2[0][1] += 20.0),
    ];
    for (what, change) in changes {
        let mut changed = command.clone();
        change(&mut changed.phases[2]);
        let message = changed.check().expect_err("changed").to_string();
        assert!(message.contains(what) && message.contains("strike"), "{message}");
    }
}
