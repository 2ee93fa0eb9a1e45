//! One strike, from the first look at the robot to the way home, with an eye on the arm all the time.

use crate::arm::{ArmState, Stop};
use crate::event_log::{Diary, Event};
use crate::fault::Trouble;
use crate::interlock;
use crate::job::Errand;
use crate::motion::{Motion, Motions, farthest};
use crate::preflight::Finding;
use crate::report::{Ending, Report, StopAccount};
use crate::robot::{Driver, Robot};
use std::future::Future;
use std::pin::Pin;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout, timeout_at};

/// How far a joint may be from the path (rad): servos lag along the path, not beside it.
const OFF_PATH_RAD: f64 = 0.05;
/// An arm this near to a pose is there (rad).
const ARRIVED_RAD: f64 = 0.01;
/// The same before the first motion, which the arm would have to jump to.
const AT_HOME_RAD: f64 = 0.02;
/// How long an arm may take to come to rest after a stop.
const STANDSTILL: Duration = Duration::from_secs(1);

/// [`strike`] on a runtime of its own, stopped by Ctrl-C or by being asked to end.
///
/// # Errors
/// See [`strike`].
pub fn carry_out(driver: &Driver, errand: &Errand<'_>, diary: &mut Diary) -> Result<Report, Trouble> {
    // Two workers: a large message that is being written must not hold up the next look at the arm.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    runtime.map_err(Trouble::unreachable)?.block_on(strike(driver, errand, diary, interrupted()))
}

/// Ends when the user or the system wants the program to end.
async fn interrupted() {
    #[cfg(unix)]
    if let Ok(mut end) = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate()) {
        tokio::select! {
            _ = tokio::signal::ctrl_c() => {}
            _ = end.recv() => {}
        }
        return;
    }
    // Without a handler nobody could stop the arm: an error counts as a wish to stop.
    let _ = tokio::signal::ctrl_c().await;
}

/// Carries a command out on a robot, or only shows what would be done.
///
/// The arm is approached, the table looked at again, the strike sent once, and the arm brought home. Whatever goes
/// wrong while it moves ends in a stop; nothing is ever recovered, repeated or cleared. `interrupt` ends when the user
/// wants to stop. The future should be run to its end: dropping it midway stops nothing.
///
/// # Errors
/// A robot that cannot be reached before anything has moved.
pub async fn strike(
    driver: &Driver,
    errand: &Errand<'_>,
    diary: &mut Diary,
    interrupt: impl Future<Output = ()>,
) -> Result<Report, Trouble> {
    diary.note(Event::Begun {
        version: env!("CARGO_PKG_VERSION"),
        driver: driver.to_string(),
        hash: errand.command.short_hash(),
        arm: errand.command.arm.clone(),
        live: errand.live,
    });
    let robot = Robot::connect(driver, errand.command).await?;
    let mut session = Session { robot: &robot, errand, diary, interrupt: Box::pin(interrupt) };
    let report = session.run().await;
    let outcome = match report.as_ref().map(|report| &report.ending) {
        Ok(Ending::Shown { .. }) => "shown",
        Ok(Ending::Struck { .. }) => "struck",
        Ok(Ending::Refused { .. }) => "refused",
        Ok(Ending::Stopped { .. }) => "stopped",
        Err(_) => "not reached",
    };
    diary.note(Event::Ended { outcome });
    report
}

pub(crate) struct Session<'a, I> {
    pub(crate) robot: &'a Robot,
    pub(crate) errand: &'a Errand<'a>,
    pub(crate) diary: &'a mut Diary,
    pub(crate) interrupt: Pin<Box<I>>,
}

impl<I: Future<Output = ()>> Session<'_, I> {
    pub(crate) async fn run(&mut self) -> Result<Report, Trouble> {
        let command = self.errand.command;
        let mut objections = self.objections();
        let mut findings = self.robot.preflight(command).await?;
        let state = self.robot.state().await?;
        let home = command.at(0.0).map(|home| farthest(&home.q_rad, &state.q_rad));
        if let Some((joint, off_rad)) = home {
            let found = format!("joint `{}` is {off_rad:.4} rad away", command.joints[joint]);
            let needed = format!("at most {AT_HOME_RAD} rad");
            findings.push(Finding::new("arm at home", found, needed, off_rad <= AT_HOME_RAD));
        }
        findings.push(Finding::new("arm at rest", !state.moving, "true", !state.moving));
        for finding in &findings {
            self.diary.note(Event::Finding(finding.clone()));
        }
        let unmet = findings.iter().filter(|finding| !finding.holds);
        objections.extend(unmet.map(|f| format!("{}: {}; needed: {}", f.what, f.found, f.needed)));
        let Some(motions) = Motions::of(command) else {
            objections.push("the command lacks a phase".into());
            return Ok(Report { findings, ending: self.refused(objections, "as before") });
        };
        if !self.errand.live {
            return Ok(Report { findings, ending: Ending::Shown { objections } });
        }
        if self.errand.permission.hash.is_none() {
            objections.push(format!("the hash is missing; this command's is `{}`", command.short_hash()));
        }
        if !objections.is_empty() {
            return Ok(Report { findings, ending: self.refused(objections, "as before") });
        }
        Ok(Report { findings, ending: self.moved(&motions).await })
    }

    /// Sends all motions, one after the other.
    async fn moved(&mut self, motions: &Motions) -> Ending {
        for motion in &motions.before {
            if let Err(trouble) = self.carried_out(motion).await {
                return self.stopped(motion, trouble).await;
            }
        }
        let objections = self.objections();
        if !objections.is_empty() {
            return self.refused(objections, "low, before its run-up");
        }
        for motion in std::iter::once(&motions.strike).chain(&motions.after) {
            if let Err(trouble) = self.carried_out(motion).await {
                return self.stopped(motion, trouble).await;
            }
        }
        let simulated = match self.robot {
            Robot::Sim(sim) if sim.has_struck() => sim.simulated().ok(),
            Robot::Sim(_) | Robot::Indy(_) | Robot::Rosbridge(_) => None,
        };
        Ending::Struck { simulated }
    }

    /// What speaks against moving, the table looked at afresh.
    fn objections(&mut self) -> Vec<String> {
        let errand = self.errand;
        match (errand.look)() {
            Ok(seen) => interlock::objections(
                errand.command,
                &errand.permission,
                seen.as_ref(),
                (errand.now_unix_s)(),
            ),
            Err(message) => vec![format!("the table cannot be looked at: {message}")],
        }
    }

    fn refused(&mut self, objections: Vec<String>, stands: &'static str) -> Ending {
        for reason in &objections {
            self.diary.note(Event::Objection { reason: reason.clone() });
        }
        Ending::Refused { objections, stands }
    }

    /// Sends a motion and watches it to its end.
    async fn carried_out(&mut self, motion: &Motion) -> Result<(), Trouble> {
        let watch = self.errand.watch;
        let state = self.look().await?;
        self.on_path(motion, &state, ARRIVED_RAD, motion.start())?;
        let [from_rad, to_rad] = [motion.start(), motion.end()].map(<[f64]>::to_vec);
        let (name, duration_s) = (motion.name.to_owned(), motion.duration_s());
        self.diary.note(Event::Sent { motion: name.clone(), duration_s, from_rad, to_rad });
        let robot = self.robot;
        let mut sending = std::pin::pin!(timeout(watch.grace, robot.send(motion)));
        let (sent, mut is_accepted, mut has_moved) = (Instant::now(), false, false);
        let mut ticks = interval(watch.period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                () = self.interrupt.as_mut() => return Err(Trouble::Interrupted),
                answer = &mut sending, if !is_accepted => {
                    let silent_s = sent.elapsed().as_secs_f64();
                    let cause = format!("the {name} was never confirmed");
                    answer.map_err(|_| Trouble::LostLink { silent_s, cause })??;
                    is_accepted = true;
                }
                _ = ticks.tick() => {
                    let state = self.look().await?;
                    let elapsed_s = sent.elapsed().as_secs_f64();
                    self.on_path(motion, &state, OFF_PATH_RAD, &[])?;
                    has_moved |= state.moving || farthest(&state.q_rad, motion.start()).1 > AT_HOME_RAD;
                    let is_there = farthest(&state.q_rad, motion.end()).1 < ARRIVED_RAD && !state.moving;
                    if is_accepted && is_there && (has_moved || elapsed_s >= duration_s) {
                        self.diary.note(Event::Arrived { motion: name });
                        return Ok(());
                    }
                    if elapsed_s > duration_s + watch.grace.as_secs_f64() {
                        return Err(Trouble::Overdue { motion: name, after_s: elapsed_s, planned_s: duration_s });
                    }
                }
            }
        }
    }

    /// The arm now; a robot that stays silent, or is not well, is trouble.
    async fn look(&mut self) -> Result<ArmState, Trouble> {
        let watch = self.errand.watch;
        let asked = Instant::now();
        let deadline = asked + watch.silence;
        let mut cause = "it accepts what it is asked but does not answer".to_owned();
        loop {
            let answer = tokio::select! {
                biased;
                () = self.interrupt.as_mut() => return Err(Trouble::Interrupted),
                answer = timeout_at(deadline, self.robot.state()) => answer,
            };
            match answer {
                Ok(Ok(state)) => {
                    let (q_rad, moving) = (state.q_rad.clone(), state.moving);
                    self.diary.note(Event::State { q_rad, moving });
                    return Ok(state);
                }
                // A link may recover within its time; some robots know themselves for how long they were not heard.
                Ok(Err(Trouble::LostLink { cause: why, silent_s })) => {
                    let silent_s = silent_s.max(asked.elapsed().as_secs_f64());
                    cause = why;
                    if silent_s >= watch.silence.as_secs_f64() {
                        return Err(Trouble::LostLink { silent_s, cause });
                    }
                    sleep(watch.period).await;
                }
                Ok(Err(other)) => return Err(other),
                Err(_) => {
                    return Err(Trouble::LostLink { silent_s: asked.elapsed().as_secs_f64(), cause });
                }
            }
        }
    }

    /// An error if the arm is farther than this from the path, or from a pose if one is given.
    fn on_path(
        &self,
        motion: &Motion,
        state: &ArmState,
        allowed_rad: f64,
        pose: &[f64],
    ) -> Result<(), Trouble> {
        let (joint, off_rad) =
            if pose.is_empty() { motion.off_path(&state.q_rad) } else { farthest(pose, &state.q_rad) };
        // Written so that an angle that is no number counts as off.
        if off_rad <= allowed_rad && state.q_rad.iter().all(|q| q.is_finite()) {
            return Ok(());
        }
        let joint = self.errand.command.joints.get(joint).cloned().unwrap_or_default();
        Err(Trouble::OffPath { joint, off_rad })
    }

    /// Stops the arm and tells how that went.
    async fn stopped(&mut self, motion: &Motion, trouble: Trouble) -> Ending {
        let stop = self.stop().await;
        self.diary.note(Event::Trouble { message: trouble.to_string(), trouble: trouble.clone() });
        self.diary.note(Event::Stopped(stop.clone()));
        Ending::Stopped { motion: motion.name.into(), trouble, stop }
    }

    async fn stop(&mut self) -> StopAccount {
        let (known, silence) = (Instant::now(), self.errand.watch.silence);
        let mut account = StopAccount::default();
        let mut confirmed = timeout(silence, self.robot.stop(Stop::Smooth)).await;
        if !matches!(confirmed, Ok(Ok(()))) {
            account.braked = true;
            confirmed = timeout(silence, self.robot.stop(Stop::Brake)).await;
        }
        if matches!(confirmed, Ok(Ok(()))) {
            account.confirmed_after_s = Some(known.elapsed().as_secs_f64());
        }
        account.stands_after_s = self.standstill(known).await;
        if account.stands_after_s.is_none() && account.confirmed_after_s.is_some() && !account.braked {
            // Confirmed, but still moving: harder.
            account.braked = true;
            let _ = timeout(silence, self.robot.stop(Stop::Brake)).await;
            account.stands_after_s = self.standstill(known).await;
        }
        account.explanation = timeout(silence, self.robot.explanation()).await.ok().flatten();
        account
    }

    /// When two looks in a row find the arm in the same place (s since `known`).
    async fn standstill(&mut self, known: Instant) -> Option<f64> {
        /// Sensors flicker by less (rad).
        const STILL_RAD: f64 = 1e-3;
        let watch = self.errand.watch;
        let deadline = Instant::now() + STANDSTILL;
        let mut before: Option<Vec<f64>> = None;
        while Instant::now() < deadline {
            // A controller in trouble still tells where the arm is: `place` asks for nothing else.
            if let Ok(Ok(place)) = timeout(watch.silence, self.robot.place()).await {
                if before.is_some_and(|before| farthest(&before, &place).1 < STILL_RAD) {
                    return Some(known.elapsed().as_secs_f64());
                }
                before = Some(place);
            }
            sleep(2 * watch.period).await;
        }
        None
    }
}
