//! Order and content of the requests, with paused time.

#[cfg(feature = "network")]
mod faults;
#[cfg(feature = "network")]
mod over_indy;
#[cfg(feature = "network")]
mod over_rosbridge;
#[cfg(feature = "network")]
mod simulated;

#[cfg(feature = "network")]
use simulated::mock::example;

#[cfg(not(feature = "network"))]
#[path = "../tests/mock/example.rs"]
#[allow(unreachable_pub, reason = "shared with the integration tests")]
mod example;

use crate::event_log::LogFile;
use crate::robot::driver::Robot;
use crate::robot::sim::{InjectedFault, Sim};
use crate::session::Session;
use crate::{Ending, Event, EventLog, Fault, Job, Permission, Watchdog, objections};
use breakshot::geometry::Point;
use breakshot::properties::Properties;
use breakshot::robot::Command;
use breakshot::scene::Scene;
use example::{OBSERVED_UNIX_S, command, just_after, scene};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

fn properties() -> Properties {
    let one = |mean: f64| serde_json::json!({ "mean": mean, "std": 0.01, "standard_error": 0.01, "interval_95": [mean, mean], "n": 5 });
    let value = serde_json::json!({
        "version": 1, "reference": "a", "friction": { "a": one(0.3) }, "striker_restitution": { "a": one(0.6) },
        "restitution": {}, "mass_ratio": { "a": one(1.0) }, "pair_mass_ratio": {}, "contact_friction": {},
        "warnings": [],
    });
    serde_json::from_value(value).expect("properties")
}

/// Runs a command on the simulated arm; returns the ending and the requests received in order.
async fn run(
    command: &Command,
    permission: Permission,
    observe: &(dyn Fn() -> Result<Option<Scene>, String> + Sync),
    injected: Option<InjectedFault>,
) -> (Ending, Vec<&'static str>) {
    let mut sim = Sim::new(command, &properties());
    sim.injected = injected;
    run_on(sim, command, permission, observe).await
}

/// A live run of a command.
fn job<'a>(
    command: &'a Command,
    permission: Permission,
    observe: &'a (dyn Fn() -> Result<Option<Scene>, String> + Sync),
) -> Job<'a> {
    Job { command, permission, live: true, observe, now_unix_s: just_after, watchdog: Watchdog::default() }
}

/// Runs a command on this arm.
async fn run_on(
    sim: Sim,
    command: &Command,
    permission: Permission,
    observe: &(dyn Fn() -> Result<Option<Scene>, String> + Sync),
) -> (Ending, Vec<&'static str>) {
    let robot = Arc::new(Robot::Sim(Box::new(sim)));
    let job = job(command, permission, observe);
    let mut log = EventLog::new(command, None, |_| ()).expect("an arm");
    let interrupt = Box::pin(std::future::pending());
    let mut session = Session::new(Arc::clone(&robot), &job, &mut log, interrupt);
    let ending = session.run().await.expect("a simulation is there").ending;
    (ending, received(&robot))
}

/// The requests that a simulated arm received.
fn received(robot: &Robot) -> Vec<&'static str> {
    match robot {
        Robot::Sim(sim) => sim.received(),
        #[cfg(feature = "network")]
        _ => Vec::new(),
    }
}

fn permission(command: &Command) -> Permission {
    Permission { hash: Some(command.short_hash()), allow_fast: false }
}

/// No new observation of the table.
const NO_OBSERVATION: &(dyn Fn() -> Result<Option<Scene>, String> + Sync) = &|| Ok(None);

#[tokio::test(start_paused = true)]
async fn a_strike_is_executed_once_between_approach_and_return() {
    let command = command(0.2);
    let (ending, received) = run(&command, permission(&command), NO_OBSERVATION, None).await;
    assert_eq!(received, ["approach", "lowering", "strike", "raising", "return home"]);
    let Ending::Struck { simulated: Some(simulated) } = ending else { panic!("{ending:?}") };
    assert!((simulated.speed_m_s - 0.2).abs() < 1e-6, "{} m/s", simulated.speed_m_s);
    let [x, ..] = simulated.final_poses["a"];
    // Eq. 24 and 26 for a central hit: (1 + e) v, then v^2 / (2 mu g).
    let distance_m = (1.6_f64 * 0.2).powi(2) / (2.0 * 0.3 * 9.81);
    assert!((x - distance_m * 0.3_f64.cos()).abs() < 1e-3, "{x} m, not {distance_m} m along the heading");
}

#[tokio::test(start_paused = true)]
async fn without_the_right_hash_nothing_moves() {
    let command = command(0.2);
    for hash in [None, Some("00000000".to_owned())] {
        let (ending, received) =
            run(&command, Permission { hash, allow_fast: false }, NO_OBSERVATION, None).await;
        let Ending::Refused { objections, .. } = ending else { panic!("{ending:?}") };
        assert!(objections[0].contains(&command.short_hash()), "{objections:?}");
        assert!(received.is_empty(), "{received:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_object_that_moves_during_the_approach_prevents_the_strike() {
    let command = command(0.2);
    let observations = AtomicUsize::new(0);
    let observe = || {
        let mut observed = scene();
        if observations.fetch_add(1, Ordering::Relaxed) > 0 {
            observed.observed_unix_s = Some(OBSERVED_UNIX_S + 1.0);
            observed.placed[0].position_m = Point::new(0.0, 0.01);
        }
        Ok(Some(observed))
    };
    let (ending, received) = run(&command, permission(&command), &observe, None).await;
    let Ending::Refused { objections, .. } = ending else { panic!("{ending:?}") };
    assert_eq!(objections, ["`a` lies 10.0 mm away from where it was planned for"]);
    assert_eq!(received, ["approach", "lowering"]);
}

#[tokio::test(start_paused = true)]
async fn a_fault_in_any_motion_ends_in_a_stop_and_nothing_after_it() {
    let command = command(0.2);
    let all = ["approach", "lowering", "strike", "raising", "return home"];
    for (k, motion) in all.into_iter().enumerate() {
        let injected = InjectedFault { motion, after_s: 0.1, fault: Fault::Collision };
        let (ending, received) = run(&command, permission(&command), NO_OBSERVATION, Some(injected)).await;
        let Ending::Stopped { motion: during, fault, .. } = ending else { panic!("{ending:?}") };
        assert_eq!((during.as_str(), fault), (motion, Fault::Collision));
        assert_eq!(received[..=k], all[..=k]);
        assert_eq!(received[k + 1..], ["stop"], "{motion}");
    }
}

/// The only objection against a command, if there is one.
fn objection(
    command: &Command,
    allow_fast: bool,
    observed: Option<&Scene>,
    now_unix_s: f64,
) -> Option<String> {
    let permission = Permission { hash: None, allow_fast };
    let mut objections = objections(command, &permission, observed, now_unix_s);
    assert!(objections.len() < 2, "{objections:?}");
    objections.pop()
}

#[test]
fn a_fast_strike_needs_the_users_permission() {
    let fast = command(0.6);
    let refused = objection(&fast, false, None, just_after()).expect("too fast");
    assert!(refused.contains("--allow-fast"), "{refused}");
    assert_eq!(objection(&fast, true, None, just_after()), None);
}

#[test]
fn the_speed_limit_applies_to_the_samples_not_to_the_stated_speed() {
    let mut misstated = command(0.6);
    misstated.strike.speed_m_s = 0.2;
    misstated.stroke.contact_speed_m_s = 0.2;
    assert!(objection(&misstated, false, None, just_after()).is_some());
}

#[test]
fn an_observation_older_than_a_minute_is_refused() {
    let command = command(0.2);
    let check = |now_unix_s: f64| objection(&command, false, None, now_unix_s);
    assert_eq!(check(OBSERVED_UNIX_S + 59.0), None);
    assert!(check(OBSERVED_UNIX_S + 61.0).expect("too old").contains("61 s ago"));
    assert!(check(OBSERVED_UNIX_S - 60.0).expect("from the future").contains("from now"));
    assert!(check(f64::NAN).is_some());
    let mut timeless = command.clone();
    timeless.scene.as_mut().expect("a scene").observed_unix_s = None;
    assert!(objection(&timeless, false, None, just_after()).is_some());
    timeless.scene = None;
    assert!(!objections(&timeless, &Permission::default(), None, just_after()).is_empty());
}

#[test]
fn a_new_observation_replaces_the_one_in_the_command() {
    let command = command(0.2);
    let later = OBSERVED_UNIX_S + 500.0;
    let observed = Scene { observed_unix_s: Some(later - 5.0), ..scene() };
    assert_eq!(objection(&command, false, Some(&observed), later), None);
    let mut gone = observed.clone();
    gone.placed.clear();
    assert!(objection(&command, false, Some(&gone), later).expect("gone").contains("not on the table"));
    let mut more = observed.clone();
    more.placed.push(breakshot::scene::Placed { object: "a#2".into(), ..observed.placed[0].clone() });
    assert!(objection(&command, false, Some(&more), later).expect("new").contains("`a#2`"));
    let mut rotated = observed;
    rotated.placed[0].yaw_rad = 2.0;
    assert_eq!(
        objection(&command, false, Some(&rotated), later),
        None,
        "a disc is unchanged by any rotation"
    );
}

#[tokio::test(start_paused = true)]
async fn a_controller_that_is_faster_than_planned_is_stopped_in_its_first_motion() {
    let command = command(0.2);
    for speedup in [1.25, 2.0, 10.0] {
        let mut sim = Sim::new(&command, &properties());
        sim.speedup = speedup;
        let (ending, received) = run_on(sim, &command, permission(&command), NO_OBSERVATION).await;
        let Ending::Stopped { motion, fault, .. } = ending else { panic!("{speedup}: {ending:?}") };
        assert!(matches!(fault, Fault::Ahead { .. } | Fault::TooFast { .. }), "{speedup}: {fault:?}");
        assert_eq!((motion.as_str(), &received[..]), ("approach", &["approach", "stop"][..]), "{speedup}");
    }
    // Within the tolerance, and slower.
    for speedup in [1.02, 0.95] {
        let mut sim = Sim::new(&command, &properties());
        sim.speedup = speedup;
        let (ending, _) = run_on(sim, &command, permission(&command), NO_OBSERVATION).await;
        assert!(matches!(ending, Ending::Struck { .. }), "{speedup}: {ending:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_observation_that_is_not_repeated_prevents_the_strike() {
    let command = command(0.2);
    let (ending, received) = run(&command, permission(&command), &|| Ok(Some(scene())), None).await;
    let Ending::Refused { objections, .. } = ending else { panic!("{ending:?}") };
    assert!(objections[0].contains("not newer than the first"), "{objections:?}");
    assert_eq!(received, ["approach", "lowering"]);
}

#[test]
fn an_observation_of_another_table_is_refused() {
    type Change = fn(&mut Scene);

    let command = command(0.2);
    let changes: [(&str, Change); 4] = [
        ("base_from_table", |s| {
            let robot = s.cell.robot.as_mut().expect("a robot");
            robot.base_from_table.as_mut().expect("a pose").position_m[0] += 0.01;
        }),
        ("walls", |s| {
            let (from_m, to_m) = (Point::new(0.2, 0.2), Point::new(0.3, 0.2));
            s.walls.push(breakshot::scene::Wall { from_m, to_m, restitution: 0.4 });
        }),
        ("keep_out", |s| {
            let points_m = [[0.2, 0.1], [0.25, 0.1], [0.25, 0.15]].map(Point::from).to_vec();
            s.keep_out.push(breakshot::scene::KeepOut { points_m });
        }),
        ("[table]", |s| {
            let outline_m = [[-0.4, -0.3], [0.4, -0.3], [0.4, 0.3], [-0.4, 0.3]].map(Point::from).to_vec();
            s.cell.table = Some(breakshot::cell::Table { outline_m });
        }),
    ];
    for (word, change) in changes {
        let mut observed = scene();
        change(&mut observed);
        let refused = objection(&command, false, Some(&observed), just_after()).expect(word);
        assert!(refused.contains(word), "{refused}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_run_that_is_dropped_during_a_motion_stops_the_arm() {
    let command = command(0.2);
    let robot = Arc::new(Robot::Sim(Box::new(Sim::new(&command, &properties()))));
    let job = job(&command, permission(&command), NO_OBSERVATION);
    let mut log = EventLog::new(&command, None, |_| ()).expect("an arm");
    let interrupt = Box::pin(std::future::pending());
    let mut session = Session::new(Arc::clone(&robot), &job, &mut log, interrupt);
    assert!(tokio::time::timeout(Duration::from_secs(1), session.run()).await.is_err(), "it has ended");
    tokio::time::sleep(Duration::from_millis(10)).await;
    assert_eq!(received(&robot), ["approach", "stop"]);
}

#[tokio::test(start_paused = true)]
async fn a_damaged_command_is_refused_before_the_robot_is_asked() {
    let mut damaged = command(0.2);
    damaged.phases[2].qd_rad_s[30][1] += 0.1;
    let refused = objections(&damaged, &permission(&damaged), None, just_after());
    assert!(refused[0].contains("damaged") && refused[0].contains("qd_rad_s"), "{refused:?}");
    let job = job(&damaged, permission(&damaged), NO_OBSERVATION);
    let mut log = EventLog::new(&damaged, None, |_| ()).expect("an arm");
    let driver = crate::Driver::Sim(Box::new(properties()));
    let report = crate::strike(&driver, &job, &mut log, std::future::pending()).await.expect("no network");
    assert!(matches!(&report.ending, Ending::Refused { .. }), "{report:?}");
}

#[test]
fn poses_of_another_length_differ_without_bound() {
    use crate::motion::largest_difference;
    assert!(largest_difference(&[0.0; 6], &[0.0; 5]).1.is_infinite());
    assert!(largest_difference(&[], &[]).1.is_infinite());
}

/// A disk that takes nothing before it is released.
struct BlockedDisk {
    released: std::sync::mpsc::Receiver<()>,
    bytes: Arc<std::sync::Mutex<Vec<u8>>>,
}

impl std::io::Write for BlockedDisk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // After the release the sender is gone.
        let _ = self.released.recv();
        self.bytes.lock().expect("no writer panics").extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_disk_that_blocks_does_not_delay_the_events() {
    const EVENTS: usize = 3000;
    let (folder, command) = (tempfile::tempdir().expect("a folder"), command(0.2));
    let (release, released) = std::sync::mpsc::channel();
    let bytes = Arc::default();
    let disk = BlockedDisk { released, bytes: Arc::clone(&bytes) };
    let file = LogFile::over(folder.path().join("strike.jsonl"), disk);
    let mut log = EventLog::with(&command, Some(file), |_| ()).expect("an arm");
    let (done, is_done) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        for _ in 0..EVENTS {
            log.note(Event::State { q_rad: vec![0.0; 6], moving: true });
        }
        done.send(log).expect("the test waits");
    });
    let log = is_done.recv_timeout(Duration::from_mins(1)).expect("the disk delayed the events");
    assert!(bytes.lock().expect("no writer panics").is_empty());
    drop(release);
    log.finish().expect("a folder that can be written");
    let text = String::from_utf8(bytes.lock().expect("no writer panics").clone()).expect("text");
    assert_eq!(text.lines().count(), EVENTS);
}

#[test]
fn a_log_is_never_overwritten() {
    let (folder, command) = (tempfile::tempdir().expect("a folder"), command(0.2));
    let path = folder.path().join("strike.jsonl");
    EventLog::new(&command, Some(&path), |_| ()).expect("a log").finish().expect("written");
    let again = EventLog::new(&command, Some(&path), |_| ()).expect_err("it exists").to_string();
    assert!(again.contains("never overwritten"), "{again}");
    std::fs::remove_file(&path).expect("a file");
    let again = EventLog::new(&command, Some(&path), |_| ()).expect_err("its recording exists").to_string();
    assert!(again.contains("strike.mcap"), "{again}");
}
