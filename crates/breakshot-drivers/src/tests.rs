//! Order and content of what is sent, on a clock that does not wait.

#[path = "../tests/mock/example.rs"]
#[allow(unreachable_pub, reason = "shared with the tests that stand outside")]
mod example;

use crate::robot::Robot;
use crate::session::Session;
use crate::sim::{Fault, Sim};
use crate::{Diary, Ending, Errand, Permission, Trouble, Watch, objections};
use breakshot::geometry::Point;
use breakshot::properties::Properties;
use breakshot::robot::Command;
use breakshot::scene::Scene;
use example::{OBSERVED_UNIX_S, command, just_after, scene};
use std::sync::atomic::{AtomicUsize, Ordering};

fn properties() -> Properties {
    let one = |mean: f64| serde_json::json!({ "mean": mean, "std": 0.01, "standard_error": 0.01, "interval_95": [mean, mean], "n": 5 });
    let value = serde_json::json!({
        "version": 1, "reference": "a", "friction": { "a": one(0.3) }, "striker_restitution": { "a": one(0.6) },
        "restitution": {}, "mass_ratio": { "a": one(1.0) }, "pair_mass_ratio": {}, "contact_friction": {},
        "warnings": [],
    });
    serde_json::from_value(value).expect("properties")
}

/// Runs a command on an arm of numbers; gives the end, what was sent, and the robot's motions in order.
async fn run(
    command: &Command,
    permission: Permission,
    look: &(dyn Fn() -> Result<Option<Scene>, String> + Sync),
    fault: Option<Fault>,
) -> (Ending, Vec<&'static str>) {
    let mut sim = Sim::new(command, &properties());
    sim.fault = fault;
    let robot = Robot::Sim(Box::new(sim));
    let errand =
        Errand { command, permission, live: true, look, now_unix_s: just_after, watch: Watch::default() };
    let mut diary = Diary::new(command, None, |_| ()).expect("an arm");
    let interrupt = Box::pin(std::future::pending());
    let mut session = Session { robot: &robot, errand: &errand, diary: &mut diary, interrupt };
    let ending = session.run().await.expect("a simulation is there").ending;
    let Robot::Sim(sim) = &robot else { unreachable!() };
    (ending, sim.told())
}

fn permission(command: &Command) -> Permission {
    Permission { hash: Some(command.short_hash()), allow_fast: false }
}

/// Nobody looks at the table again.
const NOBODY: &(dyn Fn() -> Result<Option<Scene>, String> + Sync) = &|| Ok(None);

#[tokio::test(start_paused = true)]
async fn a_strike_is_approached_carried_out_once_and_left() {
    let command = command(0.2);
    let (ending, told) = run(&command, permission(&command), NOBODY, None).await;
    assert_eq!(told, ["approach", "lowering", "strike", "raising", "way home"]);
    let Ending::Struck { simulated: Some(simulated) } = ending else { panic!("{ending:?}") };
    assert!((simulated.speed_m_s - 0.2).abs() < 1e-6, "{} m/s", simulated.speed_m_s);
    let [x, ..] = simulated.places["a"];
    // Eq. 24 and 26 for a central hit: (1 + e) v, then v^2 / (2 mu g).
    let way_m = (1.6_f64 * 0.2).powi(2) / (2.0 * 0.3 * 9.81);
    assert!((x - way_m * 0.3_f64.cos()).abs() < 1e-3, "{x} m, not {way_m} m along the heading");
}

#[tokio::test(start_paused = true)]
async fn without_the_right_hash_nothing_moves() {
    let command = command(0.2);
    for hash in [None, Some("00000000".to_owned())] {
        let (ending, told) = run(&command, Permission { hash, allow_fast: false }, NOBODY, None).await;
        let Ending::Refused { objections, .. } = ending else { panic!("{ending:?}") };
        assert!(objections[0].contains(&command.short_hash()), "{objections:?}");
        assert!(told.is_empty(), "{told:?}");
    }
}

#[tokio::test(start_paused = true)]
async fn what_moved_during_the_approach_keeps_the_arm_from_striking() {
    let command = command(0.2);
    let looks = AtomicUsize::new(0);
    let look = || {
        let mut seen = scene();
        if looks.fetch_add(1, Ordering::Relaxed) > 0 {
            seen.placed[0].position_m = Point::new(0.0, 0.01);
        }
        Ok(Some(seen))
    };
    let (ending, told) = run(&command, permission(&command), &look, None).await;
    let Ending::Refused { objections, .. } = ending else { panic!("{ending:?}") };
    assert_eq!(objections, ["`a` lies 10.0 mm away from where it was planned for"]);
    assert_eq!(told, ["approach", "lowering"]);
}

#[tokio::test(start_paused = true)]
async fn trouble_in_any_motion_ends_in_a_stop_and_nothing_after_it() {
    let command = command(0.2);
    let all = ["approach", "lowering", "strike", "raising", "way home"];
    for (k, motion) in all.into_iter().enumerate() {
        let fault = Fault { motion, after_s: 0.1, trouble: Trouble::Collision };
        let (ending, told) = run(&command, permission(&command), NOBODY, Some(fault)).await;
        let Ending::Stopped { motion: during, trouble, .. } = ending else { panic!("{ending:?}") };
        assert_eq!((during.as_str(), trouble), (motion, Trouble::Collision));
        assert_eq!(told[..=k], all[..=k]);
        assert_eq!(told[k + 1..], ["stop"], "{motion}");
    }
}

/// The one objection against a command; none if there is none.
fn objection(command: &Command, allow_fast: bool, seen: Option<&Scene>, now_unix_s: f64) -> Option<String> {
    let permission = Permission { hash: None, allow_fast };
    let mut objections = objections(command, &permission, seen, now_unix_s);
    assert!(objections.len() < 2, "{objections:?}");
    objections.pop()
}

#[test]
fn a_fast_strike_needs_to_be_allowed() {
    let fast = command(0.6);
    let refused = objection(&fast, false, None, just_after()).expect("too fast");
    assert!(refused.contains("--allow-fast"), "{refused}");
    assert_eq!(objection(&fast, true, None, just_after()), None);
}

#[test]
fn what_the_samples_do_counts_not_what_the_file_says() {
    let mut lying = command(0.6);
    lying.strike.speed_m_s = 0.2;
    lying.stroke.contact_speed_m_s = 0.2;
    assert!(objection(&lying, false, None, just_after()).is_some());
}

#[test]
fn an_old_look_at_the_table_does_not_count() {
    let command = command(0.2);
    let asked = |now_unix_s: f64| objection(&command, false, None, now_unix_s);
    assert_eq!(asked(OBSERVED_UNIX_S + 59.0), None);
    assert!(asked(OBSERVED_UNIX_S + 61.0).expect("too old").contains("61 s ago"));
    assert!(asked(OBSERVED_UNIX_S - 60.0).expect("from the future").contains("from now"));
    assert!(asked(f64::NAN).is_some());
    let mut timeless = command.clone();
    timeless.scene.as_mut().expect("a scene").observed_unix_s = None;
    assert!(objection(&timeless, false, None, just_after()).is_some());
    timeless.scene = None;
    assert!(!objections(&timeless, &Permission::default(), None, just_after()).is_empty());
}

#[test]
fn a_fresh_look_takes_the_place_of_the_plans_own() {
    let command = command(0.2);
    let later = OBSERVED_UNIX_S + 500.0;
    let seen = Scene { observed_unix_s: Some(later - 5.0), ..scene() };
    assert_eq!(objection(&command, false, Some(&seen), later), None);
    let mut gone = seen.clone();
    gone.placed.clear();
    assert!(objection(&command, false, Some(&gone), later).expect("gone").contains("not on the table"));
    let mut more = seen.clone();
    more.placed.push(breakshot::scene::Placed { object: "a#2".into(), ..seen.placed[0].clone() });
    assert!(objection(&command, false, Some(&more), later).expect("new").contains("`a#2`"));
    let mut turned = seen;
    turned.placed[0].yaw_rad = 2.0;
    assert_eq!(
        objection(&command, false, Some(&turned), later),
        None,
        "a disc looks the same from all sides"
    );
}
