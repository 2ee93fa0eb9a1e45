//! `breakshot strike`: carries a command out, or shows what would happen.

use super::command::print_summary;
use crate::args::StrikeArgs;
use crate::{Outcome, console};
use breakshot::robot::Command;
use breakshot::scene::Scene;
use breakshot::{Error, Result, files};
use breakshot_drivers::{
    Diary, Driver, Ending, Errand, Event, Permission, Report, Watch, carry_out, indy, objections, rosbridge,
};
use std::path::PathBuf;
use std::time::SystemTime;

/// Without a robot: whether the command may be carried out; with one: what it says; with `--live`: the strike.
pub(crate) fn run(args: &StrikeArgs) -> Result<Outcome> {
    let command: Command = files::read_json(&args.command)?;
    command.check()?;
    if !args.json {
        print_summary(&command);
    }
    console::warn(&command.warnings);
    console::note(&command.safety_notes()?);
    let permission = Permission { hash: args.hash.clone(), allow_fast: args.allow_fast };
    let look = || match &args.scene {
        Some(path) => files::load_scene(path).map(|scene| Some(scene.value)).map_err(|e| e.to_string()),
        None => Ok(None),
    };
    let Some(name) = &args.driver else {
        let seen: Option<Scene> =
            args.scene.as_ref().map(|path| files::load_scene(path)).transpose()?.map(|s| s.value);
        let objections = objections(&command, &permission, seen.as_ref(), now_unix_s());
        return told(args, &command, &Report { findings: Vec::new(), ending: Ending::Shown { objections } });
    };
    let driver = driver(args, name)?;
    let log =
        args.log.clone().unwrap_or_else(|| PathBuf::from(format!("strike-{}.jsonl", command.short_hash())));
    let errand = Errand {
        command: &command,
        permission,
        live: args.live,
        look: &look,
        now_unix_s,
        watch: Watch::default(),
    };
    let mut diary = Diary::new(&command, Some(&log), tell)?;
    let report = carry_out(&driver, &errand, &mut diary);
    diary.finish()?;
    eprintln!("note: all of it is in {} and {}", log.display(), log.with_extension("mcap").display());
    match report {
        Ok(report) => told(args, &command, &report),
        Err(trouble) => {
            eprintln!("error: {name}: {trouble}; nothing was moved");
            Ok(Outcome::Failed)
        }
    }
}

fn driver(args: &StrikeArgs, name: &str) -> Result<Driver> {
    const NEEDED: &str = "`indy:HOST`, `indy:HOST:PORT`, `ros:HOST:PORT` or `sim`";
    let wrong = || Error::invalid("--driver", "robot", format!("`{name}`"), NEEDED);
    match name.split_once(':') {
        None if name == "sim" => {
            let needed = "--properties FILE: what the objects are like";
            let path = args.properties.as_ref();
            let path = path.ok_or_else(|| Error::invalid("--driver sim", "properties", "missing", needed))?;
            Ok(Driver::Sim(Box::new(files::load_properties(path)?)))
        }
        Some(("indy", host)) if !host.is_empty() => match host.split_once(':') {
            None => Ok(Driver::Indy(indy::Address::of_host(host))),
            Some((host, port)) => {
                let port = port.parse().map_err(|_| wrong())?;
                Ok(Driver::Indy(indy::Address::of_port(host, port)))
            }
        },
        Some(("ros", host)) if host.contains(':') => {
            let controller = args.controller.clone();
            Ok(Driver::Rosbridge(rosbridge::Address { controller, ..rosbridge::Address::of_host(host) }))
        }
        _ => Err(wrong()),
    }
}

fn now_unix_s() -> f64 {
    // A clock before 1970 makes every look at the table one from the future: refused.
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

/// What happens, while it happens.
fn tell(event: &Event) {
    match event {
        Event::Sent { motion, duration_s, .. } => eprintln!("{motion}: {duration_s:.1} s"),
        Event::Trouble { message, .. } => eprintln!("STOP: {message}"),
        _ => {}
    }
}

fn told(args: &StrikeArgs, command: &Command, report: &Report) -> Result<Outcome> {
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
    for finding in &report.findings {
        let sign = if finding.holds { "ok" } else { "NO" };
        let needed = if finding.holds { String::new() } else { format!("; needed: {}", finding.needed) };
        println!("  {sign}  {}: {}{needed}", finding.what, finding.found);
    }
    match &report.ending {
        Ending::Shown { objections } if objections.is_empty() => {
            let driver = args.driver.as_deref().unwrap_or("ROBOT");
            let hash = command.short_hash();
            println!("nothing was moved; to carry it out: --driver {driver} --live --hash {hash}");
        }
        Ending::Shown { objections } => {
            println!("nothing was moved, and nothing may be:");
            print_lines(objections);
        }
        Ending::Refused { objections, stands } => {
            println!("refused; the arm stands {stands}:");
            print_lines(objections);
        }
        Ending::Struck { simulated: None } => println!("struck, and back home"),
        Ending::Struck { simulated: Some(simulated) } => {
            println!("struck at {:.3} m/s in our own physics; at rest:", simulated.speed_m_s);
            for (object, [x, y, yaw]) in &simulated.places {
                println!(
                    "  {object:<10} {:>8.1} mm {:>8.1} mm {:>7.1} deg",
                    x * 1e3,
                    y * 1e3,
                    yaw.to_degrees()
                );
            }
            for violation in &simulated.violations {
                println!("  not as wanted: {violation}");
            }
        }
        Ending::Stopped { motion, trouble, stop } => {
            println!("STOPPED during the {motion}: {trouble}");
            println!("{}", stop.sentence());
            println!("nothing was recovered: look at the robot, then clear it at its own panel");
        }
    }
}

fn print_lines(reasons: &[String]) {
    for reason in reasons {
        println!("  {reason}");
    }
}
