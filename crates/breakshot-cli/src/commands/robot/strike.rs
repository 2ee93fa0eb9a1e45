//! `breakshot strike`: executes a command on a robot, or performs a dry run.

use super::command::print_summary;
use crate::args::StrikeArgs;
use crate::{Outcome, console};
use breakshot::robot::Command;
use breakshot::scene::Scene;
use breakshot::{Error, Result, files};
use breakshot_drivers::{
    Driver, Ending, Event, EventLog, Job, Permission, Report, Watchdog, carry_out, objections,
};
use std::path::PathBuf;
use std::time::SystemTime;

/// Without a robot: the interlock's objections; with a robot: also its preflight checks; with `--live`: the strike.
pub(crate) fn run(args: &StrikeArgs) -> Result<Outcome> {
    let command: Command = files::read_json(&args.command)?;
    command.check()?;
    if !args.json {
        print_summary(&command);
    }
    console::warn(&command.warnings);
    console::note(&command.safety_notes()?);
    let permission = Permission { hash: args.hash.clone(), allow_fast: args.allow_fast };
    let observe = || match &args.scene {
        Some(path) => files::load_scene(path).map(|scene| Some(scene.value)).map_err(|e| e.to_string()),
        None => Ok(None),
    };
    let Some(name) = &args.driver else {
        let observed: Option<Scene> =
            args.scene.as_ref().map(files::load_scene).transpose()?.map(|s| s.value);
        let objections = objections(&command, &permission, observed.as_ref(), now_unix_s());
        return reported(
            args,
            &command,
            &Report { checks: Vec::new(), ending: Ending::Shown { objections } },
        );
    };
    let driver = driver(args, name)?;
    let log_path = args.log.clone().unwrap_or_else(|| new_log(&command));
    let job = Job {
        command: &command,
        permission,
        live: args.live,
        observe: &observe,
        now_unix_s,
        watchdog: Watchdog::default(),
    };
    let mut log = EventLog::new(&command, Some(&log_path), print_event)?;
    let report = carry_out(&driver, &job, &mut log);
    log.finish()?;
    eprintln!("note: the log is in {} and {}", log_path.display(), log_path.with_extension("mcap").display());
    match report {
        Ok(report) => reported(args, &command, &report),
        Err(fault) => {
            eprintln!("error: {name}: {fault}; nothing was moved");
            Ok(Outcome::Failed)
        }
    }
}

fn driver(args: &StrikeArgs, name: &str) -> Result<Driver> {
    if name != "sim" {
        return Driver::on_network(name, &args.controller);
    }
    let needed = "--properties FILE: the objects' properties";
    let path = args.properties.as_ref();
    let path = path.ok_or_else(|| Error::invalid("--driver sim", "properties", "missing", needed))?;
    Ok(Driver::Sim(Box::new(files::load_properties(path)?)))
}

fn now_unix_s() -> f64 {
    // With a clock before 1970 every observation lies in the future, and the strike is refused.
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// The name of a log that does not exist: hash and time of the strike, and a number for a second one in the same second.
fn new_log(command: &Command) -> PathBuf {
    let name = format!("strike-{}-{}", command.short_hash(), utc(now_unix_s()));
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    let mut names = std::iter::once(name.clone()).chain(numbered).map(|name| PathBuf::from(name + ".jsonl"));
    let is_new = |path: &PathBuf| !path.exists() && !path.with_extension("mcap").exists();
    names.find(is_new).unwrap_or_else(|| PathBuf::from(name + ".jsonl"))
}

/// A time since 1970 (s) as a part of a file's name, such as `20261123T140501Z`.
fn utc(unix_s: f64) -> String {
    let seconds = unix_s as u64;
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // Years of 365.2425 days that begin on the first of March; the era begins on 0000-03-01.
    let day = days + 719_468;
    let (era, day) = (day / 146_097, day % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = era * 400 + year + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}{month:02}{day_of_month:02}T{hour:02}{minute:02}{second:02}Z")
}

/// Prints events as they happen.
fn print_event(event: &Event) {
    match event {
        Event::Sent { motion, duration_s, .. } => eprintln!("{motion}: {duration_s:.1} s"),
        Event::Fault { message, .. } => eprintln!("STOP: {message}"),
        _ => {}
    }
}

fn reported(args: &StrikeArgs, command: &Command, report: &Report) -> Result<Outcome> {
    if args.json {
        console::print_json(report)?;
    } else {
        print_report(args, command, report);
    }
    Ok(match &report.ending {
        Ending::Shown { objections } => Outcome::doubtful_if(!objections.is_empty()),
        Ending::Struck { simulated } => {
            Outcome::doubtful_if(simulated.as_ref().is_some_and(|s| !s.violations.is_empty()))
        }
        Ending::Refused { .. } => Outcome::Doubtful,
        Ending::Stopped { .. } => Outcome::Failed,
    })
}

fn print_report(args: &StrikeArgs, command: &Command, report: &Report) {
    for check in &report.checks {
        let sign = if check.holds { "ok" } else { "NO" };
        let needed = if check.holds { String::new() } else { format!("; needed: {}", check.needed) };
        println!("  {sign}  {}: {}{needed}", check.what, check.found);
    }
    match &report.ending {
        Ending::Shown { objections } if objections.is_empty() => {
            let driver = args.driver.as_deref().unwrap_or("ROBOT");
            let hash = command.short_hash();
            println!("nothing was moved; to execute it: --driver {driver} --live --hash {hash}");
        }
        Ending::Shown { objections } => {
            println!("nothing was moved; a live run would be refused:");
            print_lines(objections);
        }
        Ending::Refused { objections, arm_position } => {
            println!("refused; the arm is {arm_position}:");
            print_lines(objections);
        }
        Ending::Struck { simulated: None } => println!("struck; the arm is back home"),
        Ending::Struck { simulated: Some(simulated) } => {
            println!("struck at {:.3} m/s in the simulation; final poses:", simulated.speed_m_s);
            for (object, [x, y, yaw]) in &simulated.final_poses {
                println!(
                    "  {object:<10} {:>8.1} mm {:>8.1} mm {:>7.1} deg",
                    x * 1e3,
                    y * 1e3,
                    yaw.to_degrees()
                );
            }
            for violation in &simulated.violations {
                println!("  goal not met: {violation}");
            }
        }
        Ending::Stopped { motion, fault, stop } => {
            println!("STOPPED during the {motion}: {fault}");
            println!("{}", stop.sentence());
            println!("nothing was recovered: inspect the robot, then clear the fault at its own panel");
        }
    }
}

fn print_lines(reasons: &[String]) {
    for reason in reasons {
        println!("  {reason}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_in_a_name_is_utc() {
        for (unix_s, name) in [
            (0.0, "19700101T000000Z"),
            (951_782_399.5, "20000228T235959Z"),
            (951_782_400.0, "20000229T000000Z"),
            (1_790_000_000.0, "20260921T141320Z"),
            (4_107_542_400.0, "21000301T000000Z"),
        ] {
            assert_eq!(utc(unix_s), name);
        }
    }
}
