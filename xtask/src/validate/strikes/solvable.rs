//! Is there a reliable strike?  The search uses the lab itself, without any model.
//!
//! A pile is robustly solvable if some strike singulates it in at least [`ENOUGH`] of [`REPEATS`] strikes with poses, speed and
//! heading off as in a robot cell.  Tried are variants of the planned strike and of its runner-up, and random strikes: what works
//! once is repeated.

use super::lab::{Lab, Variation};
use super::{Effort, friction_scale, is_free, random_strike, works};
use crate::splitmix::Draw;
use breakshot::geometry::wrapped_rad;
use breakshot::plan::Plan;
use breakshot::scene::{Scene, Strike};

/// Times a strike is repeated.
pub(super) const REPEATS: u64 = 10;
/// Successes among them that make a strike reliable.
const ENOUGH: usize = 8;
/// Strikes that are tried on a pile.
const TRIED: u64 = 60;
/// Largest rotation (rad) and relative change of speed of a variant.
const ROTATION_RAD: f64 = 0.3;
const SPEED: f64 = 0.25;

/// What was found about a pile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reliable {
    /// How many of the disturbed repeats of the planned strike worked.
    pub repeats: usize,
    /// Whether a strike was found that works in most repeats.
    pub solvable: bool,
}

/// Repeats the planned strike, and looks for others if it is not reliable; none if nothing is to be repeated.
pub(super) fn reliable(
    lab: &mut Lab,
    scene: &Scene,
    plan: &Plan,
    seed: u64,
    effort: Effort,
) -> Result<Option<Reliable>, String> {
    if effort == Effort::Once {
        return Ok(None);
    }
    let planned = plan.strike.as_ref().map_or(Ok(0), |strike| repeats(lab, scene, strike, 0))?;
    let solvable = planned >= ENOUGH || (effort == Effort::Search && another(lab, scene, plan, seed)?);
    Ok(Some(Reliable { repeats: planned, solvable }))
}

/// How often a strike works in disturbed repeats; given up as soon as `least` is out of reach.
fn repeats(lab: &mut Lab, scene: &Scene, strike: &Strike, least: usize) -> Result<usize, String> {
    let mut successes = 0;
    for k in 0..REPEATS {
        let left = (REPEATS - k) as usize;
        if successes + left < least {
            break;
        }
        let variation = Variation { friction_scale: friction_scale(k ^ 0xA11), seed: Some(k) };
        successes += usize::from(works(lab, scene, Some(strike), variation)?.0);
    }
    Ok(successes)
}

/// Whether any of many other strikes can be relied on.
fn another(lab: &mut Lab, scene: &Scene, plan: &Plan, seed: u64) -> Result<bool, String> {
    let mut draw = Draw::new(seed ^ 0x50_1BED);
    let runner_up = plan.robustness.as_ref().and_then(|r| r.runner_up.as_ref()).map(|r| &r.strike);
    let planned: Vec<&Strike> = plan.strike.iter().chain(runner_up).collect();
    let nominal = Variation { friction_scale: 1.0, seed: None };
    for k in 0..TRIED {
        let strike = match k as usize % (planned.len() + 1) {
            0 => random_strike(scene, draw.bits()),
            n => varied(scene, planned[n - 1], &mut draw),
        };
        let Some(strike) = strike else { continue };
        if works(lab, scene, Some(&strike), nominal)?.0 && repeats(lab, scene, &strike, ENOUGH)? >= ENOUGH {
            return Ok(true);
        }
    }
    Ok(false)
}

/// A strike rotated about the object that it strikes, and faster or slower; none if its path is not free.
fn varied(scene: &Scene, strike: &Strike, draw: &mut Draw) -> Option<Strike> {
    let target = scene.placed.iter().find(|p| Some(&p.object) == strike.object.as_ref())?;
    let rotation_rad = draw.between(-ROTATION_RAD, ROTATION_RAD);
    let [_, fastest_m_s] = scene.cell.striker.speed_range_m_s;
    let varied = Strike {
        start_m: target.position_m + (strike.start_m - target.position_m).rotated(rotation_rad),
        heading_rad: wrapped_rad(strike.heading_rad + rotation_rad),
        speed_m_s: (strike.speed_m_s * draw.between(1.0 - SPEED, 1.0 + SPEED)).min(fastest_m_s),
        ..strike.clone()
    };
    is_free(scene, &varied, varied.travel_m).then_some(varied)
}
