//! Every message between a driver and its controller lost, late, doubled, out of order and wrong in each field, at every step of
//! a strike, once and from then on; the user's interrupt at every step with every mishap of the stop.
//!
//! No run may end in "struck" that was not, none may claim a rest that is none, and once something is amiss the arm may move for
//! at most 200 ms before it brakes. `cargo xtask validate faults` makes all runs; a part of them is a test.

mod verdict;

use super::simulated::bridge::{self, changes_of};
use super::simulated::mock::mishap::{Injection, Mishap, Seen};
use super::simulated::mock::{self, wire_fields};
use super::simulated::{Interrupt, Peer, run};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;
use verdict::{Outcome, Verdict};

/// A run to be made.
struct Case {
    driver: &'static str,
    peer: Peer,
    fault: String,
    step: &'static str,
    injection: Option<Injection>,
    interrupt: Interrupt,
}

/// The steps of a strike, by the number of motions that have begun.
const STEPS: [&str; 6] = ["before", "approach", "lowering", "strike", "raising", "return home"];
/// Delays of late messages (ms).
const DELAYS_MS: [u64; 5] = [20, 100, 300, 1000, 3000];
/// How many messages of its kind a message out of order is behind.
const BEHIND: [usize; 2] = [1, 30];
/// Times of an interrupt after the begin of a motion (ms).
const INTERRUPTS_MS: [u64; 4] = [0, 60, 200, 450];

fn peers() -> [(&'static str, Peer); 3] {
    let deaf = bridge::Setup { ignores_cancel: true, ..bridge::Setup::default() };
    [
        ("Indy", Peer::Indy(mock::Setup::default())),
        ("rosbridge", Peer::Bridge(bridge::Setup::default())),
        ("rosbridge that ignores cancellations", Peer::Bridge(deaf)),
    ]
}

/// The number of changes of a message's fields.
fn changes(peer: &Peer, message: &Seen) -> usize {
    match peer {
        Peer::Indy(_) => wire_fields::changes(&message.bytes).len(),
        Peer::Bridge(_) => changes_of(&serde_json::from_slice(&message.bytes).expect("JSON")).len(),
    }
}

/// The messages to which mishaps happen: of each kind the first, the middle and the last one of each step; their numbers.
fn chosen(seen: &[Seen]) -> Vec<(usize, &Seen)> {
    let mut groups = BTreeMap::<(&str, usize, bool), Vec<(usize, &Seen)>>::new();
    let mut counts = BTreeMap::<&str, usize>::new();
    for message in seen {
        let nth = counts.entry(&message.kind).or_default();
        let group = groups.entry((&message.kind, message.motions, message.moves)).or_default();
        group.push((*nth, message));
        *nth += 1;
    }
    let mut chosen = Vec::new();
    for group in groups.into_values() {
        let last = group.len() - 1;
        let picked: BTreeSet<usize> = [0, last / 2, last].into();
        chosen.extend(picked.into_iter().map(|k| group[k]));
    }
    chosen
}

/// All runs with a mishap of one message.
fn mishaps(driver: &'static str, peer: &Peer) -> Vec<Case> {
    let clean = run(peer, None, None, true);
    assert_eq!(Verdict::of(&clean, None, None).outcome, Outcome::Struck, "{driver}: {:?}", clean.ending);
    let mut cases = Vec::new();
    for (nth, message) in chosen(&clean.seen) {
        let mut add = |fault: String, mishap: Mishap, kind: &str, nth: usize| {
            for lasting in [false, true] {
                let fault = if lasting { format!("{fault}, from then on") } else { fault.clone() };
                let injection = Injection { kind: kind.into(), nth, lasting, mishap };
                let (step, peer) = (STEPS[message.motions], peer.clone());
                cases.push(Case { driver, peer, fault, step, injection: Some(injection), interrupt: None });
            }
        };
        let kind = &message.kind;
        add("lost".into(), Mishap::Lost, kind, nth);
        for ms in DELAYS_MS {
            add(format!("{ms} ms late"), Mishap::Late(Duration::from_millis(ms)), kind, nth);
        }
        add("doubled".into(), Mishap::Doubled, kind, nth);
        for behind in BEHIND {
            add(format!("the one {behind} before"), Mishap::OutOfOrder(behind), kind, nth);
        }
        let at = clean.seen.iter().position(|seen| std::ptr::eq(seen, message)).unwrap_or(0);
        add("all messages lost".into(), Mishap::Lost, "*", at);
    }
    let mut wrong = BTreeSet::new();
    for (nth, message) in chosen(&clean.seen) {
        // One message of each kind and step, with all changes.
        if !wrong.insert((&message.kind, message.motions, message.moves)) {
            continue;
        }
        for k in 0..changes(peer, message) {
            for (fault, lasting) in [("wrong", false), ("wrong, from then on", true)] {
                let injection =
                    Injection { kind: message.kind.clone(), nth, lasting, mishap: Mishap::Wrong(k) };
                let (step, peer, injection) = (STEPS[message.motions], peer.clone(), Some(injection));
                cases.push(Case { driver, peer, fault: fault.into(), step, injection, interrupt: None });
            }
        }
    }
    cases
}

/// All runs that the user interrupts, with the mishaps of a stop.
fn interrupts(driver: &'static str, peer: &Peer) -> Vec<Case> {
    let kinds: &[&str] = match peer {
        Peer::Indy(_) => &["StopMotion request", "StopMotion answer"],
        Peer::Bridge(_) => &["cancel_action_goal request", "publish request"],
    };
    let mut mishaps = vec![Mishap::Lost, Mishap::Doubled];
    mishaps.extend(DELAYS_MS.map(|ms| Mishap::Late(Duration::from_millis(ms))));
    let mut cases = Vec::new();
    for (motions, step) in STEPS.iter().enumerate().skip(1) {
        for ms in INTERRUPTS_MS {
            let interrupt = Some((motions, Duration::from_millis(ms)));
            let mut add = |fault: String, injection: Option<Injection>| {
                cases.push(Case { driver, peer: peer.clone(), fault, step, injection, interrupt });
            };
            add("interrupt".into(), None);
            for kind in kinds {
                for mishap in &mishaps {
                    for lasting in [false, true] {
                        let injection = Injection { kind: (*kind).into(), nth: 0, lasting, mishap: *mishap };
                        let name = if lasting {
                            "interrupt, mishap of every stop"
                        } else {
                            "interrupt, mishap of a stop"
                        };
                        add(name.into(), Some(injection));
                    }
                }
            }
        }
    }
    cases
}

fn cases() -> Vec<Case> {
    let of = |(driver, peer): (&'static str, Peer)| {
        let mut cases = mishaps(driver, &peer);
        cases.extend(interrupts(driver, &peer));
        cases
    };
    peers().into_iter().flat_map(of).collect()
}

/// A row of the table.
#[derive(Default)]
struct Row {
    runs: usize,
    outcomes: BTreeMap<Outcome, usize>,
    /// Runs in which no stop took effect.
    unreachable: usize,
    /// Of the others that were stopped.
    longest_s: f64,
}

/// Makes these runs on all cores; prints the table; returns the runs and what was wrong.
fn judged(cases: &[Case]) -> (usize, Vec<String>) {
    let (next, rows, wrong) = (AtomicUsize::new(0), Mutex::default(), Mutex::new(Vec::new()));
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let run = run(&case.peer, case.injection.clone(), case.interrupt, false);
            if case.injection.is_some() && run.happened.is_none() {
                continue;
            }
            let verdict = Verdict::of(&run, case.injection.as_ref(), case.interrupt);
            let mut rows = rows.lock().unwrap_or_else(PoisonError::into_inner);
            for step in [case.step, "all"] {
                let rows: &mut BTreeMap<_, Row> = &mut rows;
                let row = rows.entry((case.driver, case.fault.clone(), step)).or_default();
                row.runs += 1;
                *row.outcomes.entry(verdict.outcome).or_default() += 1;
                if verdict.unreachable {
                    row.unreachable += 1;
                } else {
                    row.longest_s = row.longest_s.max(verdict.moved_s);
                }
            }
            if let Some(reason) = verdict.wrong {
                let injection = &case.injection;
                let text = format!(
                    "{}, {}, {}: {reason}; {injection:?} {:?}; {:?}",
                    case.driver, case.fault, case.step, case.interrupt, run.ending
                );
                wrong.lock().unwrap_or_else(PoisonError::into_inner).push(text);
            }
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let rows: BTreeMap<(&str, String, &str), Row> = rows.into_inner().unwrap_or_else(PoisonError::into_inner);
    print(&rows);
    let runs = rows.iter().filter(|((_, _, step), _)| *step == "all").map(|(_, row)| row.runs).sum();
    (runs, wrong.into_inner().unwrap_or_else(PoisonError::into_inner))
}

#[allow(clippy::print_stdout, reason = "the table of `cargo xtask validate faults`")]
fn print(rows: &BTreeMap<(&str, String, &str), Row>) {
    println!(
        "| driver | fault | step | runs | struck | stopped | refused | longest motion after it (ms) | out of reach |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for ((driver, fault, step), row) in rows {
        let count = |outcome| row.outcomes.get(&outcome).copied().unwrap_or(0);
        let [struck, stopped, refused] = [Outcome::Struck, Outcome::Stopped, Outcome::Refused].map(count);
        let (runs, ms) = (row.runs, row.longest_s * 1e3);
        println!(
            "| {driver} | {fault} | {step} | {runs} | {struck} | {stopped} | {refused} | {ms:.0} | {} |",
            row.unreachable
        );
    }
}

/// Every so manyth run.
fn every(stride: usize) -> Vec<Case> {
    cases().into_iter().step_by(stride).collect()
}

#[test]
fn no_mishap_of_a_message_ends_in_a_wrong_result_or_a_long_motion() {
    /// A prime number, so that all kinds of messages and mishaps have their turn.
    const STRIDE: usize = 251;
    let (runs, wrong) = judged(&every(STRIDE));
    assert!(wrong.is_empty(), "{} of {runs} runs:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
#[ignore = "thousands of runs: `cargo xtask validate faults`"]
#[allow(clippy::print_stdout, reason = "the table of `cargo xtask validate faults`")]
fn all_mishaps() {
    let stride = std::env::var("BREAKSHOT_FAULTS_EVERY").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let (runs, wrong) = judged(&every(stride));
    println!("\n{runs} runs; wrong results, wrong claims or motions longer than allowed: {}", wrong.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
