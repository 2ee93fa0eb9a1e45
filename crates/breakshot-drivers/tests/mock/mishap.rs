//! What can happen to a message on its way.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

use std::collections::BTreeMap;
use std::time::Duration;
use tokio::time::Instant;

/// What happens to a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mishap {
    Lost,
    Late(Duration),
    Doubled,
    /// In its place comes the message of its kind that was sent so many before.
    OutOfOrder(usize),
    /// The change of this number in one of its fields.
    Wrong(usize),
}

/// A mishap and the message that it happens to.
#[derive(Clone, Debug, PartialEq)]
pub struct Injection {
    /// The message's kind; `*` is any.
    pub kind: String,
    /// Its number among those of its kind, from zero.
    pub nth: usize,
    /// Whether it happens to all messages of the kind from then on.
    pub lasting: bool,
    pub mishap: Mishap,
}

/// A message that passed.
#[derive(Clone, Debug)]
pub struct Seen {
    pub kind: String,
    pub at: Instant,
    /// The motions that the arm had begun, and whether it moved.
    pub motions: usize,
    pub moves: bool,
    pub bytes: Vec<u8>,
}

/// All messages between a driver and a mock.
#[derive(Debug, Default)]
pub struct Messages {
    pub injection: Option<Injection>,
    counts: BTreeMap<String, usize>,
    /// All messages; with their bytes if `keep` is set.
    pub seen: Vec<Seen>,
    pub keep: bool,
    before: BTreeMap<String, Vec<Vec<u8>>>,
    /// When the mishap first happened.
    pub happened: Option<Instant>,
    /// The largest difference of a reported joint angle from the true one, at each instant of a wrong report (rad).
    pub misreported: Vec<(Instant, f64)>,
}

impl Messages {
    /// Takes a message; returns what happens to it.
    pub fn pass(&mut self, kind: &str, bytes: &[u8], (motions, moves): (usize, bool)) -> Option<Mishap> {
        {
            let (kind, bytes) = (kind.into(), if self.keep { bytes.to_vec() } else { Vec::new() });
            self.seen.push(Seen { kind, at: Instant::now(), motions, moves, bytes });
        }
        let injection = self.injection.as_ref()?;
        let mishap = injection.mishap;
        if let Mishap::OutOfOrder(_) = mishap {
            self.before.entry(kind.into()).or_default().push(bytes.to_vec());
        }
        if injection.kind != "*" && injection.kind != kind {
            return None;
        }
        let count = self.counts.entry(injection.kind.clone()).or_default();
        let nth = *count;
        *count += 1;
        let happens = nth == injection.nth || (injection.lasting && nth > injection.nth);
        // A message that none of its kind precedes comes in its order.
        let changes = match mishap {
            Mishap::OutOfOrder(count) => self.earlier(kind, count).is_some(),
            _ => true,
        };
        if !happens || !changes {
            return None;
        }
        self.happened.get_or_insert(Instant::now());
        Some(mishap)
    }

    /// Joint angles are reported that differ from the true ones (rad).
    pub fn report(&mut self, true_rad: &[f64], reported_rad: &[f64]) {
        let differences = true_rad.iter().zip(reported_rad).map(|(a, b)| (a - b).abs());
        let all = if true_rad.len() == reported_rad.len() { 0.0 } else { f64::INFINITY };
        self.misreported.push((Instant::now(), differences.fold(all, f64::max)));
    }

    /// The message of this kind that was sent so many before the latest one.
    pub fn earlier(&self, kind: &str, count: usize) -> Option<Vec<u8>> {
        let before = self.before.get(kind)?;
        before.get(before.len().checked_sub(count + 1)?).cloned()
    }
}
