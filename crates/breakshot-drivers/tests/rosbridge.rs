//! The driver against a mock rosbridge that records every message and simulates an arm.

mod bridge;
mod mock;

use breakshot_drivers::{
    Driver, Ending, EventLog, Fault, Job, Permission, Report, Watchdog, rosbridge, strike,
};
use bridge::{Bridge, InjectedFault};
use mock::example::{command, just_after};
use std::time::Duration;

/// As in `indy.rs`.
const PATIENT: Watchdog = Watchdog {
    period: Duration::from_millis(10),
    silence: Duration::from_secs(20),
    grace: Duration::from_mins(1),
    pace: bridge::SPEEDUP,
};

/// Short, so that a silent link is detected quickly.
const BRISK: Watchdog = Watchdog { silence: Duration::from_millis(300), ..PATIENT };

async fn run(bridge: &Bridge, watchdog: Watchdog) -> Report {
    let command = command(0.2);
    let permission = Permission { hash: Some(command.short_hash()), allow_fast: false };
    let (observe, now_unix_s) = (&|| Ok(None), just_after);
    let job = Job { command: &command, permission, live: true, observe, now_unix_s, watchdog };
    let mut log = EventLog::new(&command, None, |_| ()).expect("an arm");
    let driver = Driver::Rosbridge(rosbridge::Address::of_host(bridge.host.clone()));
    strike(&driver, &job, &mut log, std::future::pending()).await.expect("the bridge is there")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_strike_is_five_goals_in_rosbridges_message_layout() {
    let bridge = Bridge::start(None).await;
    let report = run(&bridge, PATIENT).await;
    assert_eq!(report.ending, Ending::Struck { simulated: None });
    let messages = bridge.messages();
    let ops: Vec<&str> = messages.iter().filter_map(|message| message["op"].as_str()).collect();
    assert_eq!(
        ops,
        [
            "subscribe",
            "advertise",
            "call_service",
            "send_action_goal",
            "send_action_goal",
            "call_service",
            "send_action_goal",
            "send_action_goal",
            "send_action_goal"
        ]
    );
    for message in messages.iter().filter(|message| message["op"] == "send_action_goal") {
        assert_eq!(message["action"], "/joint_trajectory_controller/follow_joint_trajectory");
        assert_eq!(message["action_type"], "control_msgs/action/FollowJointTrajectory");
        let trajectory = &message["args"]["trajectory"];
        assert_eq!(trajectory["joint_names"].as_array().map(Vec::len), Some(6));
        let points = trajectory["points"].as_array().expect("points");
        assert!(points.len() > 10, "{} points", points.len());
        assert_eq!(points[0]["time_from_start"], serde_json::json!({ "sec": 0, "nanosec": 0 }));
        for key in ["positions", "velocities", "accelerations"] {
            assert_eq!(points[1][key].as_array().map(Vec::len), Some(6), "{key}");
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_aborted_goal_is_cancelled_and_the_joints_are_held_if_they_are_known() {
    let bridge = Bridge::start(Some(InjectedFault::Abort)).await;
    let Ending::Stopped { fault, motion, .. } = run(&bridge, PATIENT).await.ending else {
        panic!("not stopped")
    };
    assert_eq!(motion, "strike");
    assert!(matches!(&fault, Fault::Refused { answer, .. } if answer.contains("-4")), "{fault:?}");
    let mut messages = bridge.messages();
    messages.retain(|message| message["op"] != "call_service");
    let last: Vec<&str> = messages[5..].iter().filter_map(|message| message["op"].as_str()).collect();
    assert_eq!(last.first(), Some(&"cancel_action_goal"), "{last:?}");
    assert_eq!(messages[5]["id"], messages[4]["id"], "another goal was cancelled");
    // Where the machine is too busy for fresh joint states, the goal is only cancelled.
    let mut published = messages[6..].iter().filter(|message| message["op"] == "publish");
    assert!(published.all(|message| message["topic"] == "/joint_trajectory_controller/joint_trajectory"));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bridge_that_falls_silent_is_a_lost_link() {
    let bridge = Bridge::start(Some(InjectedFault::Silence)).await;
    let Ending::Stopped { fault, stop, .. } = run(&bridge, BRISK).await.ending else { panic!("not stopped") };
    assert!(matches!(fault, Fault::LostLink { .. }), "{fault:?}");
    assert_eq!(stop.confirmed_after_s, None);
}
