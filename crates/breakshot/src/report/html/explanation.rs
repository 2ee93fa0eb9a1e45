//! What the difference between a film and its simulation may come from: where the objects leave their simulated motion, and what the
//! simulation had to assume.

use super::content::FilmedStrike;
use super::text::mm;
use crate::physics::Trajectory;
use crate::report::figures::escaped;
use crate::verify::{Alignment, Divergence, Report};

/// A list of reasons, in the order in which they are looked at: time, start, assumptions.
pub(super) fn explanation(film: &FilmedStrike) -> String {
    let mut items = film.report.alignment.as_ref().map(divergences).unwrap_or_default();
    items.extend(initial_poses(film.report));
    items.extend(film.trajectory.map(assumptions).unwrap_or_default());
    let items: String = items.iter().map(|item| format!("<li>{}</li>\n", escaped(item))).collect();
    if items.is_empty() {
        items
    } else {
        format!("<h4>What the difference may come from</h4>\n<ul>\n{items}</ul>\n")
    }
}

/// Where the objects leave their simulated motion, the earliest first: what happens later follows from it.
fn divergences(alignment: &Alignment) -> Vec<String> {
    let least = mm(Divergence::LEAST_M);
    if alignment.divergences.is_empty() {
        return vec![format!("No object ends more than {least} from its simulated motion.")];
    }
    let sentence = |divergence: &Divergence| {
        let Divergence { object, time_s, distance_m, last_impact, .. } = divergence;
        let reason = match last_impact {
            Some(impact) => format!(
                "its last simulated impact before that is {} at {:.3} s",
                impact.bodies.join(" hits "),
                impact.time_s
            ),
            None => "the simulation has no impact of it before that".into(),
        };
        format!(
            "{object} leaves its simulated motion for good at {time_s:.3} s ({} in that frame, more than {least}); {reason}.",
            mm(*distance_m)
        )
    };
    alignment.divergences.iter().map(sentence).collect()
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

/// The hit or miss on which the simulation depends most, and what it assumes.
fn assumptions(trajectory: &Trajectory) -> Vec<String> {
    let closest = trajectory.closest_near_miss.iter().map(|near| {
        let (what, margin) = if near.hit { ("hits", "an overlap") } else { ("misses", "a gap") };
        format!(
            "The simulation depends most on the moment {:.3} s, where {} with {margin} of {}.",
            near.time_s,
            near.bodies.join(&format!(" {what} ")),
            mm(near.margin_m)
        )
    });
    let notes =
        trajectory.notes.iter().map(|note| super::text::sentence(&format!("in the simulation, {note}")));
    let assumed = trajectory.assumed.iter().map(|assumed| super::text::sentence(&assumed.to_string()));
    closest.chain(notes).chain(assumed).collect()
}
