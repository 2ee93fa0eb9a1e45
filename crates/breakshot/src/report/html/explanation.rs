//! What may the difference between a film and its simulation come from?

use super::content::FilmedStrike;
use super::text::{mm, sentence};
use crate::physics::Trajectory;
use crate::report::figures::escaped;
use crate::verify::{Alignment, Divergence, Report};

/// What the difference may come from: where the objects leave their simulated motion, their initial poses, and what was assumed.
pub(super) fn explanation(film: &FilmedStrike) -> String {
    let mut items = film.report.alignment.as_ref().map(divergences).unwrap_or_default();
    items.extend(initial_poses(film.report));
    items.extend(film.trajectory.map(assumptions).unwrap_or_default());
    let items: String = items.iter().map(|item| format!("<li>{}</li>\n", escaped(item))).collect();
    let rule = film.report.alignment.as_ref().map_or(String::new(), |_| {
        format!(
            "<p>An object leaves its simulated motion where it is more than {} from it and stays so. The earliest comes first: what happens \
             later may follow from it.</p>\n",
            mm(Divergence::LEAST_M)
        )
    });
    if items.is_empty() {
        return items;
    }
    format!("<h4>What the difference may come from</h4>\n{rule}<ul>\n{items}</ul>\n")
}

/// Where the objects leave their simulated motion.
fn divergences(alignment: &Alignment) -> Vec<String> {
    if alignment.divergences.is_empty() {
        return vec!["No object leaves its simulated motion.".into()];
    }
    let left = |divergence: &Divergence| {
        let Divergence { object, time_s, distance_m, last_impact, .. } = divergence;
        let impact = match last_impact {
            Some(impact) => format!(", after {} ({:.3} s)", impact.bodies.join(" hits "), impact.time_s),
            None => "; the simulation has no impact of it before that".into(),
        };
        format!("{object} leaves its simulated motion at {time_s:.3} s ({}){impact}.", mm(*distance_m))
    };
    alignment.divergences.iter().map(left).collect()
}

/// How far the object that lay farthest from its pose in the scene lay from it.
fn initial_poses(report: &Report) -> Option<String> {
    let worst = report.objects.iter().max_by(|a, b| a.placement_error_m.total_cmp(&b.placement_error_m))?;
    Some(format!(
        "Before the strike {} lay {} from its position in the scene, from which the simulation starts; no other object lay farther from its own.",
        worst.object,
        mm(worst.placement_error_m)
    ))
}

/// The closest hit or miss, where small changes have the largest effect, and what the simulation assumes.
fn assumptions(trajectory: &Trajectory) -> Vec<String> {
    let closest = trajectory.closest_near_miss.iter().map(|near| {
        let (verb, margin) = if near.hit { (" hits ", "an overlap") } else { (" misses ", "a gap") };
        format!(
            "The closest hit or miss of the simulation, where small changes have the largest effect: {} at {:.3} s with {margin} of {}.",
            near.bodies.join(verb),
            near.time_s,
            mm(near.margin_m)
        )
    });
    let notes = trajectory.notes.iter().map(|note| sentence(&format!("in the simulation, {note}")));
    let assumed = trajectory.assumed.iter().map(|assumed| sentence(&assumed.to_string()));
    closest.chain(notes).chain(assumed).collect()
}
