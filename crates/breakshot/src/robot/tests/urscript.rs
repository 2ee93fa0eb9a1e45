//! The exported programs played through the arm model.

use super::*;

/// A motion of a URScript program: whether it is straight in joint space, its target (rad), acceleration and speed.
struct Move {
    joint_space: bool,
    target: Vec<f64>,
    acceleration: f64,
    speed: f64,
}

fn moves(script: &str) -> Vec<Move> {
    let lines = script.lines().map(str::trim);
    let lines = lines.filter(|line| line.starts_with("movej(") || line.starts_with("movel("));
    let number = |line: &str, key: &str| -> f64 {
        let value = line.split(key).nth(1).expect("a parameter");
        value.split([',', ')']).next().expect("a value").parse().expect("a number")
    };
    lines
        .map(|line| {
            let target = line.split(['[', ']']).nth(1).expect("a list").split(", ");
            Move {
                joint_space: line.starts_with("movej"),
                target: target.map(|q| q.parse().expect("an angle")).collect(),
                acceleration: number(line, "a="),
                speed: number(line, "v="),
            }
        })
        .collect()
}

/// The distance along a trapezoidal profile from rest to rest.
fn along(length: f64, each: &Move, time_s: f64) -> f64 {
    let (a, v) = (each.acceleration, each.speed.min((length * each.acceleration).sqrt()));
    let (ramp_s, total_s) = (v / a, length / v + v / a);
    if time_s < ramp_s {
        a * time_s * time_s / 2.0
    } else if time_s < total_s - ramp_s {
        v * (time_s - ramp_s / 2.0)
    } else {
        length - a * (total_s - time_s).max(0.0).powi(2) / 2.0
    }
}

/// The joint angles every 2 ms of a motion in joint space, as the controller plays it: the joint that moves most keeps the speed.
fn played(from: &[f64], each: &Move) -> Vec<Vec<f64>> {
    let offsets: Vec<f64> = from.iter().zip(&each.target).map(|(from, to)| to - from).collect();
    let most = offsets.iter().fold(0.0, |most: f64, offset| most.max(offset.abs()));
    let duration_s = most / each.speed + each.speed / each.acceleration;
    let samples = (0..=(duration_s / PLAYED_S).ceil() as usize).map(|k| {
        let fraction = along(most, each, PLAYED_S * k as f64) / most;
        from.iter().zip(&offsets).map(|(from, offset)| from + fraction * offset).collect()
    });
    samples.collect()
}

/// Time between two played samples (s).
const PLAYED_S: f64 = 0.002;

/// Commands of the example, and one whose arm goes around an object.
fn commands() -> Vec<Command> {
    let mut commands: Vec<Command> = [0.0, 1.0, 2.5].map(|heading| ready(&strike(heading, 0.4))).into();
    commands.push(with_detour());
    commands
}

/// A command whose approach passes a detour: the home pose is low, and a tall object stands between it and the run-up.
fn with_detour() -> Command {
    let cell = cell_at_home(pose_at(Point::new(0.12, 0.1), 0.1));
    let mut scene = Scene { cell: cell.clone(), ..scene() };
    scene.objects[0].height_m = 0.15;
    match command(&cell, &strike(0.0, 0.2), Some(&scene), &Options::default()).expect("an answer") {
        Answer::Ready(command) => *command,
        Answer::Refused(refusal) => panic!("refused: {refusal:?}"),
    }
}

#[test]
fn the_urscript_stays_on_the_checked_path_and_slow_outside_the_stroke() {
    let mut detours = 0;
    for command in commands() {
        let mounted = command.mounted_arm().expect("an arm");
        let script = command.urscript().expect("six joints");
        let mut at = command.phases[0].q_rad[0].clone();
        let stroke_end =
            command.phase(PhaseName::Strike).expect("a strike").q_rad.last().expect("samples").clone();
        let mut joint_moves = 0;
        for each in moves(&script) {
            if !each.joint_space {
                assert!(each.speed <= SLOW_M_S || same_pose(&each.target, &stroke_end), "{} m/s", each.speed);
                at = each.target;
                continue;
            }
            joint_moves += 1;
            let samples = played(&at, &each);
            for pair in samples.windows(2) {
                let [one, other] = [&pair[0], &pair[1]].map(|q| mounted.arm.tip(q).translation.vector);
                let speed_m_s = (other - one).norm() / PLAYED_S;
                assert!(speed_m_s <= SLOW_M_S, "the tip moves at {speed_m_s} m/s");
            }
            let path =
                [PhaseName::Approach, PhaseName::Home].map(|name| command.phase(name).expect("a phase"));
            for q in samples.iter().step_by(20) {
                let apart =
                    |sample: &Vec<f64>| sample.iter().zip(q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                let rows = path.iter().flat_map(|phase| &phase.q_rad);
                let off_rad = rows.map(apart).fold(f64::INFINITY, f64::min);
                assert!(off_rad < 0.005, "{off_rad} rad off the checked path");
            }
            at = each.target;
        }
        detours += joint_moves - 2;
        assert!(same_pose(&at, &command.phases[0].q_rad[0]), "the program does not end at home");
    }
    assert!(detours > 0, "no command has a detour");
}

fn same_pose(one: &[f64], other: &[f64]) -> bool {
    one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-8)
}

#[test]
fn a_ros_goal_carries_tolerances_for_every_joint() {
    let command = ready(&strike(0.3, 0.2));
    let goal = command.follow_joint_trajectory();
    for tolerances in [&goal.path_tolerance, &goal.goal_tolerance] {
        let names: Vec<&String> = tolerances.iter().map(|tolerance| &tolerance.name).collect();
        assert_eq!(names, command.joints.iter().collect::<Vec<_>>());
        assert!(
            tolerances.iter().all(|tolerance| (0.01..0.4).contains(&tolerance.position)),
            "{tolerances:?}"
        );
    }
    assert_eq!(goal.goal_time_tolerance, RosDuration::from_seconds(1.0));
}
