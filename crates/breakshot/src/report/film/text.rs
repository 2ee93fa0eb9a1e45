//! The numbers of a plan and of a comparison as short paragraphs: what it is, and its value.

use crate::plan::{Outcome, Plan};
use crate::verify::{GoalCheck, Report};

fn paragraph(title: &str, words: String) -> (String, String) {
    (title.to_owned(), words)
}

pub(super) fn of_plan(plan: &Plan) -> Vec<(String, String)> {
    let outcome = match plan.outcome {
        Outcome::Found => "found",
        Outcome::BestEffort => "best effort",
        Outcome::Unreachable => "unreachable",
    };
    let mut paragraphs = vec![paragraph("Plan", outcome.to_owned())];
    if let Some(strike) = &plan.strike {
        let object = strike.object.as_deref().unwrap_or("the pile");
        let heading = format!(
            "{object} at {:.3} m/s, heading {:.1}\u{b0}",
            strike.speed_m_s,
            strike.heading_rad.to_degrees()
        );
        paragraphs.push(paragraph("Strike", heading));
        let path = format!(
            "from ({:.1}, {:.1}) mm over {:.1} mm",
            strike.start_m.x * 1e3,
            strike.start_m.y * 1e3,
            strike.travel_m * 1e3
        );
        paragraphs.push(paragraph("Displacement of the striker", path));
    }
    if let Some(robustness) = &plan.robustness {
        let probability = format!(
            "{:.1} % \u{b1} {:.1} % in {} scenarios",
            100.0 * robustness.success_probability,
            100.0 * robustness.standard_error,
            robustness.samples
        );
        paragraphs.push(paragraph("Success probability (\u{b1} standard error)", probability));
    }
    if let Some(prediction) = &plan.prediction {
        let distances = prediction.min_distance_m.zip(prediction.mean_distance_m);
        paragraphs.extend(distances.map(|(least_m, mean_m)| {
            let words = format!("least {:.1} mm, mean {:.1} mm", least_m * 1e3, mean_m * 1e3);
            paragraph("Expected distances at rest", words)
        }));
    }
    if !plan.assumed.is_empty() {
        paragraphs
            .push(paragraph("Properties that no clip measured", format!("{} assumed", plan.assumed.len())));
    }
    paragraphs.push(paragraph("Reason", plan.reason.clone()));
    paragraphs
}

pub(super) fn of_report(report: &Report) -> Vec<(String, String)> {
    let goal = |check: &GoalCheck| {
        let distances = check.min_distance_m.zip(check.mean_distance_m);
        let distances = distances.map_or(String::new(), |(least_m, mean_m)| {
            format!("; least distance {:.1} mm, mean {:.1} mm", least_m * 1e3, mean_m * 1e3)
        });
        let reached = if check.fulfilled { "reached" } else { "not reached" };
        let violation = check.violations.first().map(|v| format!(" ({v})")).unwrap_or_default();
        format!("{reached}{violation}{distances}")
    };
    let mut paragraphs = vec![
        paragraph("Goal, filmed", goal(&report.goal.observed)),
        paragraph("Goal, simulated", goal(&report.goal.predicted)),
    ];
    if let Some(all) = report.summary.all {
        let words = format!(
            "mean {:.1} mm ({:.1} % of the mean distance), largest {:.1} mm",
            all.mean_m * 1e3,
            100.0 * all.relative,
            all.worst_m * 1e3
        );
        paragraphs.push(paragraph("Differences of the distances between pairs at rest", words));
    }
    let objects = report.objects.iter().map(|o| format!("{} {:.1} mm", o.object, o.position_error_m * 1e3));
    let objects: Vec<String> = objects.collect();
    if !objects.is_empty() {
        paragraphs.push(paragraph("Errors of the final positions", objects.join(", ")));
    }
    if report.alignment.is_none() {
        let words = "the struck object does not move in both: each was played from its own start";
        paragraphs.push(paragraph("Times", words.to_owned()));
    }
    paragraphs
}
