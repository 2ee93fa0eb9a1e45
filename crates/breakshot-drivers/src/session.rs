//! One strike, from the preflight checks to the return home, with the arm monitored throughout.

use crate::event_log::{Event, EventLog};
use crate::fault::Fault;
use crate::interlock;
use crate::job::Job;
use crate::motion::{Motion, Motions, largest_difference};
use crate::preflight::PreflightCheck;
use crate::progress::{ARRIVED_RAD, OFF_PATH_RAD, Progress};
use crate::report::{Ending, Report, StopReport};
use crate::robot::arm::{ArmState, Stop, StopAnswer};
use crate::robot::driver::{Driver, Robot};
use crate::stop_on_drop::{LAST_STOP, StopOnDrop};
use std::future::Future;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, timeout, timeout_at};

/// Largest deviation from home before the first motion (rad): the trajectory starts with this step.
const AT_HOME_RAD: f64 = 0.02;
/// Time in which the arm must come to rest after a stop.
const STANDSTILL: Duration = Duration::from_secs(1);
/// Time over which readings agree if the arm is at rest.
const REST: Duration = Duration::from_millis(50);
/// Largest difference of the readings of an arm at rest (rad): the sensors' noise.
const STILL_RAD: f64 = 1e-3;

/// Runs [`strike`] on its own runtime; Ctrl-C, SIGTERM, SIGHUP, SIGQUIT and a panic stop the arm.
///
/// # Errors
/// See [`strike`].
pub fn carry_out(driver: &Driver, job: &Job<'_>, log: &mut EventLog) -> Result<Report, Fault> {
    // Two workers: encoding a large message must not delay the next request of the arm's state.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.map_err(Fault::unreachable)?;
    let run = || runtime.block_on(strike(driver, job, log, interrupt_signal()));
    catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
        // The stop that the unwinding has requested needs the runtime.
        runtime.block_on(async { sleep(LAST_STOP).await });
        resume_unwind(panic)
    })
}

/// Completes on Ctrl-C, SIGTERM, SIGHUP (the terminal is closed) or SIGQUIT.
async fn interrupt_signal() {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let kinds = [SignalKind::terminate(), SignalKind::hangup(), SignalKind::quit()];
        if let [Ok(mut end), Ok(mut hangup), Ok(mut quit)] = kinds.map(signal) {
            tokio::select! {
                _ = tokio::signal::ctrl_c() => {}
                _ = end.recv() => {}
                _ = hangup.recv() => {}
                _ = quit.recv() => {}
            }
            return;
        }
    }
    // Without a signal handler the user could not stop the arm: an error counts as an interrupt.
    let _ = tokio::signal::ctrl_c().await;
}

/// Executes a command on a robot, or performs a dry run.
///
/// The order is: preflight checks, approach, second observation of the table, strike (sent once), return home. Every fault
/// during a motion ends in a stop; nothing is recovered, repeated or cleared. The arm is stopped when `interrupt` completes, and
/// when the future is dropped during a motion; only a run to the end reports the stop.
///
/// # Errors
/// A robot that cannot be reached; nothing has moved then.
pub async fn strike(
    driver: &Driver,
    job: &Job<'_>,
    log: &mut EventLog,
    interrupt: impl Future<Output = ()>,
) -> Result<Report, Fault> {
    log.note(Event::Begun {
        version: env!("CARGO_PKG_VERSION"),
        driver: driver.to_string(),
        hash: job.command.short_hash(),
        arm: job.command.arm.clone(),
        live: job.live,
    });
    let report = connected(driver, job, log, Box::pin(interrupt)).await;
    let outcome = match report.as_ref().map(|report| &report.ending) {
        Ok(Ending::Shown { .. }) => "shown",
        Ok(Ending::Struck { .. }) => "struck",
        Ok(Ending::Refused { .. }) => "refused",
        Ok(Ending::Stopped { .. }) => "stopped",
        Err(_) => "not reached",
    };
    log.note(Event::Ended { outcome });
    report
}

/// Connects to the robot and runs the session; a damaged command is refused before.
async fn connected(
    driver: &Driver,
    job: &Job<'_>,
    log: &mut EventLog,
    mut interrupt: Pin<Box<impl Future<Output = ()>>>,
) -> Result<Report, Fault> {
    if let Err(error) = job.command.check() {
        let objections = vec![format!("the command is damaged: {error}")];
        log.note(Event::Objection { reason: objections[0].clone() });
        let ending = Ending::Refused { objections, arm_position: "at its initial pose" };
        return Ok(Report { checks: Vec::new(), ending });
    }
    let connection = Robot::connect(driver, job.command);
    let robot = Arc::new(limited(interrupt.as_mut(), "the connection", connection).await?);
    Session::new(robot, job, log, interrupt).run().await
}

/// Time limit of what precedes a motion.
const PATIENCE: Duration = Duration::from_secs(30);

/// The result of a request that moves nothing, unless the user interrupts it or it takes too long.
async fn limited<T>(
    interrupt: Pin<&mut impl Future<Output = ()>>,
    what: &str,
    request: impl Future<Output = Result<T, Fault>>,
) -> Result<T, Fault> {
    tokio::select! {
        biased;
        () = interrupt => Err(Fault::Interrupted),
        answer = timeout(PATIENCE, request) => answer.unwrap_or_else(|_| {
            Err(Fault::LostLink { silent_s: PATIENCE.as_secs_f64(), cause: format!("{what} takes too long") })
        }),
    }
}

pub(crate) struct Session<'a, I> {
    pub(crate) robot: Arc<Robot>,
    pub(crate) job: &'a Job<'a>,
    pub(crate) log: &'a mut EventLog,
    pub(crate) interrupt: Pin<Box<I>>,
    /// When the first observation was made (s since 1970).
    pub(crate) first_look_unix_s: Option<f64>,
    /// Whether the latest motion was sent, was not refused, and has not been seen to begin.
    pub(crate) may_begin: bool,
}

impl<'a, I: Future<Output = ()>> Session<'a, I> {
    pub(crate) fn new(
        robot: Arc<Robot>,
        job: &'a Job<'a>,
        log: &'a mut EventLog,
        interrupt: Pin<Box<I>>,
    ) -> Self {
        Self { robot, job, log, interrupt, first_look_unix_s: None, may_begin: false }
    }

    pub(crate) async fn run(&mut self) -> Result<Report, Fault> {
        let command = self.job.command;
        let mut objections = self.objections();
        let mut checks = self.preflight().await?;
        let state = self.state().await?;
        let home = command.at(0.0).map(|home| largest_difference(&home.q_rad, &state.q_rad));
        if let Some((joint, off_rad)) = home {
            let found = format!("joint `{}` is {off_rad:.4} rad away", command.joints[joint]);
            let needed = format!("at most {AT_HOME_RAD} rad");
            checks.push(PreflightCheck::new("arm at home", found, needed, off_rad <= AT_HOME_RAD));
        }
        checks.push(PreflightCheck::new("arm at rest", !state.moving, "true", !state.moving));
        for check in &checks {
            self.log.note(Event::PreflightCheck(check.clone()));
        }
        let unmet = checks.iter().filter(|check| !check.holds);
        objections.extend(unmet.map(|f| format!("{}: {}; needed: {}", f.what, f.found, f.needed)));
        let Some(motions) = Motions::of(command) else {
            objections.push("the command lacks a phase".into());
            return Ok(Report { checks, ending: self.refused(objections, "at its initial pose") });
        };
        if !self.job.live {
            return Ok(Report { checks, ending: Ending::Shown { objections } });
        }
        if self.job.permission.hash.is_none() {
            objections.push(format!("the hash is missing; this command's is `{}`", command.short_hash()));
        }
        if !objections.is_empty() {
            return Ok(Report { checks, ending: self.refused(objections, "at its initial pose") });
        }
        Ok(Report { checks, ending: self.execute_all(&motions).await })
    }

    /// Executes all motions in order.
    async fn execute_all(&mut self, motions: &Motions) -> Ending {
        for motion in &motions.before {
            if let Err(fault) = self.execute(motion).await {
                return self.stopped(motion, fault).await;
            }
        }
        let mut objections = self.objections();
        match self.preflight().await {
            Ok(checks) => {
                for check in checks.into_iter().filter(|check| !check.holds) {
                    let PreflightCheck { what, found, needed, .. } = &check;
                    objections.push(format!("{what}: {found}; needed: {needed}"));
                    self.log.note(Event::PreflightCheck(check));
                }
            }
            Err(fault) => return self.stopped(&motions.strike, fault).await,
        }
        if !objections.is_empty() {
            return self.refused(objections, "lowered, before its run-up");
        }
        for motion in std::iter::once(&motions.strike).chain(&motions.after) {
            if let Err(fault) = self.execute(motion).await {
                return self.stopped(motion, fault).await;
            }
        }
        Ending::Struck { simulated: self.robot.simulated() }
    }

    /// The interlock's reasons against a motion, with a new observation of the table.
    fn objections(&mut self) -> Vec<String> {
        let job = self.job;
        match (job.observe)() {
            Ok(observed) => {
                let look_unix_s = observed.as_ref().and_then(|scene| scene.observed_unix_s);
                let mut objections = interlock::objections(
                    job.command,
                    &job.permission,
                    observed.as_ref(),
                    (job.now_unix_s)(),
                );
                if let (Some(first), Some(second)) = (self.first_look_unix_s, look_unix_s)
                    && second <= first
                {
                    objections.push(
                        "the second observation of the table is not newer than the first: `breakshot look` has to run again \
                         while the arm approaches"
                            .into(),
                    );
                }
                self.first_look_unix_s = look_unix_s;
                objections
            }
            Err(message) => vec![format!("the table cannot be observed: {message}")],
        }
    }

    fn refused(&mut self, objections: Vec<String>, arm_position: &'static str) -> Ending {
        for reason in &objections {
            self.log.note(Event::Objection { reason: reason.clone() });
        }
        Ending::Refused { objections, arm_position }
    }

    /// The robot's checks, which move nothing.
    async fn preflight(&mut self) -> Result<Vec<PreflightCheck>, Fault> {
        let checks = self.robot.preflight(self.job.command);
        limited(self.interrupt.as_mut(), "the preflight", checks).await
    }

    /// Sends a motion and monitors the arm to its end; a run that is dropped meanwhile stops the arm.
    async fn execute(&mut self, motion: &Motion) -> Result<(), Fault> {
        let dropped = StopOnDrop::new(&self.robot);
        let result = self.send_and_monitor(motion).await;
        dropped.release();
        result
    }

    async fn send_and_monitor(&mut self, motion: &Motion) -> Result<(), Fault> {
        let watchdog = self.job.watchdog;
        let state = self.state().await?;
        self.check_deviation(motion, &state, ARRIVED_RAD, motion.start())?;
        let [from_rad, to_rad] = [motion.start(), motion.end()].map(<[f64]>::to_vec);
        let (name, duration_s) = (motion.name.to_owned(), motion.duration_s());
        self.log.note(Event::Sent { motion: name.clone(), duration_s, from_rad, to_rad });
        let robot = Arc::clone(&self.robot);
        let mut progress = Progress::new(motion, &self.job.command.joints, watchdog.pace);
        let mut sending = std::pin::pin!(timeout(watchdog.grace, robot.send(motion)));
        let (sent, mut is_accepted, mut moving_since) = (Instant::now(), false, None);
        self.may_begin = true;
        let unconfirmed = |silent: Duration| {
            let cause = format!("the {name} was not confirmed");
            Fault::LostLink { silent_s: silent.as_secs_f64(), cause }
        };
        let mut ticks = interval(watchdog.period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                () = self.interrupt.as_mut() => return Err(Fault::Interrupted),
                answer = &mut sending, if !is_accepted => {
                    let answer = answer.map_err(|_| unconfirmed(sent.elapsed()))?;
                    self.may_begin = matches!(answer, Ok(()) | Err(Fault::LostLink { .. }));
                    answer?;
                    is_accepted = true;
                    progress.accepted(sent.elapsed().as_secs_f64());
                }
                _ = ticks.tick() => {
                    let state = self.state().await?;
                    let elapsed_s = sent.elapsed().as_secs_f64();
                    self.check_deviation(motion, &state, OFF_PATH_RAD, &[])?;
                    if is_accepted && progress.has_begun(&state) {
                        self.may_begin = false;
                    }
                    progress.check(&state, elapsed_s)?;
                    // A motion that is under way has been accepted: its confirmation is lost.
                    if state.moving && !is_accepted {
                        let since = *moving_since.get_or_insert(Instant::now());
                        if since.elapsed() > watchdog.silence {
                            return Err(unconfirmed(sent.elapsed()));
                        }
                    }
                    let is_there = largest_difference(&state.q_rad, motion.end()).1 < ARRIVED_RAD && !state.moving;
                    if is_accepted && is_there && progress.has_ended() {
                        self.log.note(Event::Arrived { motion: name });
                        return Ok(());
                    }
                    if elapsed_s > duration_s + watchdog.grace.as_secs_f64() {
                        return Err(Fault::Overdue { motion: name, after_s: elapsed_s, planned_s: duration_s });
                    }
                }
            }
        }
    }

    /// The arm's state; a fault if the robot does not answer or reports one.
    async fn state(&mut self) -> Result<ArmState, Fault> {
        let watchdog = self.job.watchdog;
        let (asked, joints) = (Instant::now(), self.job.command.joints.len());
        let deadline = asked + watchdog.silence;
        let mut cause = "the robot accepts requests but does not answer".to_owned();
        loop {
            let requested = Instant::now();
            let answer = tokio::select! {
                biased;
                () = self.interrupt.as_mut() => return Err(Fault::Interrupted),
                answer = timeout_at(deadline, self.robot.state()) => answer,
            };
            match answer {
                Ok(Ok(state))
                    if state.q_rad.len() != joints || !state.q_rad.iter().all(|q| q.is_finite()) =>
                {
                    return Err(Fault::NoPose { found: format!("{:?}", state.q_rad), needed: joints });
                }
                Ok(Ok(mut state)) => {
                    state.age_s += requested.elapsed().as_secs_f64();
                    if state.age_s > watchdog.silence.as_secs_f64() {
                        let cause = format!("the latest joint angles are {:.2} s old", state.age_s);
                        return Err(Fault::LostLink { silent_s: state.age_s, cause });
                    }
                    let (q_rad, moving) = (state.q_rad.clone(), state.moving);
                    self.log.note(Event::State { q_rad, moving });
                    return Ok(state);
                }
                // A link may recover within the time limit; some drivers report the time since the last message themselves.
                Ok(Err(Fault::LostLink { cause: why, silent_s })) => {
                    let silent_s = silent_s.max(asked.elapsed().as_secs_f64());
                    cause = why;
                    if silent_s >= watchdog.silence.as_secs_f64() {
                        return Err(Fault::LostLink { silent_s, cause });
                    }
                    sleep(watchdog.period).await;
                }
                Ok(Err(other)) => return Err(other),
                Err(_) => {
                    return Err(Fault::LostLink { silent_s: asked.elapsed().as_secs_f64(), cause });
                }
            }
        }
    }

    /// An error if a joint deviates from the path by more than `allowed_rad`, or from `pose` if it is not empty.
    fn check_deviation(
        &self,
        motion: &Motion,
        state: &ArmState,
        allowed_rad: f64,
        pose: &[f64],
    ) -> Result<(), Fault> {
        let (joint, off_rad) = if pose.is_empty() {
            motion.off_path(&state.q_rad)
        } else {
            largest_difference(pose, &state.q_rad)
        };
        // A NaN angle fails the comparison and counts as a deviation.
        if off_rad <= allowed_rad && state.q_rad.iter().all(|q| q.is_finite()) {
            return Ok(());
        }
        let joint = self.job.command.joints.get(joint).cloned().unwrap_or_default();
        Err(Fault::OffPath { joint, off_rad })
    }

    /// Stops the arm and logs the fault and the stop.
    async fn stopped(&mut self, motion: &Motion, fault: Fault) -> Ending {
        self.log.note(Event::Fault { message: fault.to_string(), fault: fault.clone() });
        let mut stop = self.stop().await;
        if self.may_begin {
            self.watch_for_late_start(&mut stop).await;
        }
        self.log.note(Event::Stopped(stop.clone()));
        Ending::Stopped { motion: motion.name.into(), fault, stop }
    }

    async fn stop(&mut self) -> StopReport {
        let (known, watchdog) = (Instant::now(), self.job.watchdog);
        let mut report = StopReport::default();
        // A stop that fails is repeated, with brakes, for as long as the link may recover.
        let mut how = Stop::Smooth;
        let answer = loop {
            match timeout(watchdog.silence, self.robot.stop(how)).await {
                Ok(Ok(answer)) => break Some(answer),
                Ok(Err(_)) => sleep(watchdog.period).await,
                Err(_) => {}
            }
            if report.braked && known.elapsed() > STANDSTILL {
                break None;
            }
            how = Stop::Brake;
            report.braked = true;
        };
        if answer == Some(StopAnswer::Confirmed) {
            report.confirmed_after_s = Some(known.elapsed().as_secs_f64());
        }
        report.at_rest_after_s = self.standstill(known).await;
        if report.at_rest_after_s.is_none() && answer.is_some() && !report.braked {
            // The stop was answered, but the arm still moves: request the brakes.
            report.braked = true;
            let _ = timeout(watchdog.silence, self.robot.stop(Stop::Brake)).await;
            report.at_rest_after_s = self.standstill(known).await;
        }
        if answer == Some(StopAnswer::Asked) {
            // Only the arm's rest confirms a stop that is never answered.
            report.confirmed_after_s = report.at_rest_after_s;
        }
        report.explanation = timeout(watchdog.silence, self.robot.explanation()).await.ok().flatten();
        report
    }

    /// When readings that were measured one after the other agree (s since `known`).
    async fn standstill(&mut self, known: Instant) -> Option<f64> {
        let watchdog = self.job.watchdog;
        let deadline = Instant::now() + STANDSTILL;
        // The first reading of the arm at its present pose, and the latest time at which it was measured.
        let mut first: Option<(Instant, Vec<f64>)> = None;
        while Instant::now() < deadline {
            // A controller with a fault still reports joint angles: `reading` requests nothing else.
            let asked = Instant::now();
            let reading = timeout(watchdog.silence, self.robot.reading()).await;
            let reading = reading.ok().and_then(Result::ok).filter(|state| !state.moving);
            first = match (first, reading) {
                (Some((since, q_rad)), Some(state))
                    if largest_difference(&q_rad, &state.q_rad).1 < STILL_RAD =>
                {
                    // A robot may report the same reading again: its age grows.
                    let measured = asked.checked_sub(Duration::from_secs_f64(state.age_s));
                    if measured.is_some_and(|measured| measured >= since + REST) {
                        return Some(known.elapsed().as_secs_f64());
                    }
                    Some((since, q_rad))
                }
                (_, Some(state)) => {
                    let since = Instant::now().checked_sub(Duration::from_secs_f64(state.age_s));
                    since.map(|since| (since, state.q_rad))
                }
                (_, None) => None,
            };
            sleep(2 * watchdog.period).await;
        }
        None
    }

    /// A motion that was sent and not seen to begin may still begin, or the readings may be late: the arm is watched for as long
    /// as a confirmation may take, and stopped again if it moves.
    async fn watch_for_late_start(&mut self, report: &mut StopReport) {
        let (begun, watchdog) = (Instant::now(), self.job.watchdog);
        let mut rest: Option<Vec<f64>> = None;
        while begun.elapsed() < watchdog.grace {
            if let Ok(Ok(state)) = timeout(watchdog.silence, self.robot.reading()).await {
                let rest = rest.get_or_insert(state.q_rad.clone());
                if state.moving || largest_difference(rest, &state.q_rad).1 > 2.0 * STILL_RAD {
                    *report = self.stop().await;
                    return;
                }
            }
            sleep(watchdog.period).await;
        }
    }
}
