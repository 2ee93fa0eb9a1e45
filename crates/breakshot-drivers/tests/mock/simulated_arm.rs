//! An arm that plays rows of joint angles and brakes on request, and remembers what it did.

#![allow(dead_code, unreachable_pub, reason = "each test uses a subset")]

use std::time::Duration;
use tokio::time::Instant;

/// A motion that the arm began.
#[derive(Clone, Debug)]
pub struct Played {
    /// Times (s) and joint angles (rad).
    times_s: Vec<f64>,
    rows: Vec<Vec<f64>>,
    pub begun: Instant,
    /// When a stop took effect.
    pub stopped: Option<Instant>,
    /// When the arm came to rest.
    pub ended: Option<Instant>,
}

/// The arm.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    q_rad: Vec<f64>,
    /// Ratio of simulated to real time.
    speedup: f64,
    /// Time in which it brakes.
    brakes: Duration,
    /// All motions in order.
    pub played: Vec<Played>,
}

impl Played {
    /// The path's time at an instant (s), and whether the arm still moves.
    fn path_s(&self, now: Instant, speedup: f64, brakes: Duration) -> (f64, bool) {
        let end_s = self.times_s[self.times_s.len() - 1];
        let running = |until: Instant| (until - self.begun).as_secs_f64() * speedup;
        let (path_s, moves) = match self.stopped {
            Some(stopped) if now >= stopped => {
                // The speed falls uniformly.
                let (whole_s, since_s) = (brakes.as_secs_f64(), (now - stopped).min(brakes).as_secs_f64());
                let braking_s = since_s - since_s * since_s / (2.0 * whole_s);
                (running(stopped) + speedup * braking_s, now - stopped < brakes)
            }
            _ => (running(now), true),
        };
        (path_s.min(end_s), moves && path_s < end_s)
    }

    fn at(&self, path_s: f64) -> Vec<f64> {
        let k = self.times_s.partition_point(|&t| t <= path_s).clamp(1, self.times_s.len() - 1);
        let (from_s, to_s) = (self.times_s[k - 1], self.times_s[k]);
        let fraction =
            if to_s > from_s { ((path_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0) } else { 1.0 };
        self.rows[k - 1].iter().zip(&self.rows[k]).map(|(a, b)| a + fraction * (b - a)).collect()
    }

    /// The joint angles at a time since its begin (rad), if it is not stopped.
    pub fn at_s(&self, since_s: f64) -> Vec<f64> {
        self.at(since_s)
    }

    /// The first and the last row.
    pub fn ends(&self) -> [&[f64]; 2] {
        [&self.rows[0], &self.rows[self.rows.len() - 1]]
    }

    /// The number of its rows.
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// Whether it came to its end without a stop.
    pub fn is_whole(&self) -> bool {
        self.ended.is_some() && self.stopped.is_none()
    }
}

impl SimulatedArm {
    pub fn new(q_rad: Vec<f64>, speedup: f64, brakes: Duration) -> Self {
        Self { q_rad, speedup, brakes, played: Vec::new() }
    }

    /// The joint angles now (rad), and whether the arm moves.
    pub fn now(&mut self) -> (Vec<f64>, bool) {
        let (now, speedup, brakes) = (Instant::now(), self.speedup, self.brakes);
        if let Some(played) = self.played.last_mut().filter(|played| played.ended.is_none()) {
            let (path_s, moves) = played.path_s(now, speedup, brakes);
            self.q_rad = played.at(path_s);
            if !moves {
                let own_end = played.begun
                    + Duration::from_secs_f64(played.times_s[played.times_s.len() - 1] / speedup);
                let end = played.stopped.map_or(own_end, |stopped| (stopped + brakes).min(own_end));
                played.ended = Some(end.min(now));
                // A stop that came after the end changed nothing.
                played.stopped = played.stopped.filter(|stopped| *stopped < end);
            }
            return (self.q_rad.clone(), moves);
        }
        (self.q_rad.clone(), false)
    }

    /// Begins a motion in place of the one under way.
    pub fn begin(&mut self, times_s: Vec<f64>, rows: Vec<Vec<f64>>) {
        self.now();
        self.halt();
        self.played.push(Played { times_s, rows, begun: Instant::now(), stopped: None, ended: None });
    }

    /// Brakes.
    pub fn stop(&mut self) {
        self.now();
        if let Some(played) = self.played.last_mut().filter(|played| played.ended.is_none()) {
            played.stopped.get_or_insert(Instant::now());
        }
    }

    /// Ends the motion under way at once.
    pub fn halt(&mut self) {
        self.now();
        if let Some(played) = self.played.last_mut().filter(|played| played.ended.is_none()) {
            played.stopped.get_or_insert(Instant::now());
            played.ended = Some(Instant::now());
        }
    }
}
