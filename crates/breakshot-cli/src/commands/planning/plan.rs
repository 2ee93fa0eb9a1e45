//! `breakshot plan`: the strike that singulates a pile.

use super::simulate::{self, SimulationInputs};
use crate::args::PlanArgs;
use crate::planning::SurveyArgs;
use crate::{Outcome, console};
use breakshot::plan::{self, Aim, GridSize, Plan, Survey};
use breakshot::properties::Properties;
use breakshot::scene::{Scene, Strike};
use breakshot::{Result, files, report};

/// Plans the strike and writes the plan.
pub(crate) fn run(args: &PlanArgs) -> Result<Outcome> {
    let SimulationInputs { scene, properties, outcome, .. } =
        simulate::inputs(&args.scene, &args.properties, &args.assumptions)?;
    let aims: Vec<Aim> = args.proposals.as_deref().map(files::read_json).transpose()?.unwrap_or_default();
    let proposals = |_: &Scene| aims.clone();
    let options =
        plan::Options { proposals: Some(&proposals), remedies: true, ..args.planner.options(&scene.cell) };
    let SurveyArgs { survey: survey_file, map, .. } = &args.survey;
    if survey_file.is_some() || map.is_some() {
        let survey = survey(&scene, &properties, &options, &args.survey)?;
        if let Some(file) = survey_file {
            files::write_json(file, &survey)?;
        }
        if let Some(file) = map {
            files::write_whole(file, report::strike_map(&scene, &survey.strikes).as_bytes())?;
        }
    }
    let planning = console::activity("planning");
    let mut plan = plan::plan(&scene, &properties, &options)?;
    if args.strikes > 1 && plan.strike.is_some() {
        plan.then = following(&plan, &properties, &options, args.strikes as usize - 1)?;
    }
    planning.finish_and_clear();
    files::write_json(&args.output, &plan)?;
    if let Some(figure) = &args.figure {
        files::write_whole(figure, report::plan_figure(&plan).as_bytes())?;
    }
    if args.json {
        console::print_json(&plan)?;
    } else {
        print_summary(&plan);
        print_remedies(&plan);
        for (k, strike) in plan.then.iter().enumerate() {
            print_strike(&format!("strike {} of {}: ", k + 2, plan.then.len() + 1), strike);
        }
        for file in std::iter::once(&args.output).chain(&args.figure).chain(survey_file).chain(map) {
            println!("Wrote {}", file.display());
        }
    }
    Ok(outcome.and(Outcome::doubtful_if(plan.outcome != plan::Outcome::Found)))
}

fn survey(
    scene: &Scene,
    properties: &Properties,
    options: &plan::Options,
    args: &SurveyArgs,
) -> Result<Survey> {
    let size = GridSize { strikes: args.survey_strikes as usize, samples: args.survey_samples as usize };
    let evaluating = console::activity("evaluating strikes from all directions");
    let survey = plan::survey(scene, properties, options, size)?;
    evaluating.finish_and_clear();
    Ok(survey)
}

/// The strikes after the first, if each does exactly what is expected of it.
fn following(
    plan: &Plan,
    properties: &Properties,
    options: &plan::Options,
    most: usize,
) -> Result<Vec<Strike>> {
    let mut as_expected = |plan: &Plan, _: &mut Properties| Ok(plan::expected(plan));
    let left = plan::expected(plan);
    let options = plan::Options { seed: options.seed + 1, ..*options };
    let ended = plan::sequence(&left, &mut properties.clone(), &options, most, &mut as_expected)?;
    Ok(ended.plans.into_iter().filter_map(|plan| plan.strike).collect())
}

/// Prints the outcome, the strike and the predicted distances.
pub(crate) fn print_summary(plan: &Plan) {
    let word = match plan.outcome {
        plan::Outcome::Found => "found",
        plan::Outcome::BestEffort => "best effort",
        plan::Outcome::Unreachable => "unreachable",
    };
    println!("{word}: {}", plan.reason);
    if let Some(strike) = &plan.strike {
        print_strike("strike ", strike);
    }
    let distances = plan.prediction.as_ref().and_then(|p| p.min_distance_m.zip(p.mean_distance_m));
    if let Some((least_m, mean_m)) = distances {
        let (least, mean) = (least_m * 1e3, mean_m * 1e3);
        println!("predicted: least distance between centres {least:.1} mm, mean over all pairs {mean:.1} mm");
    }
}

/// Prints what would increase the success probability, if no strike was found.
fn print_remedies(plan: &Plan) {
    if plan.outcome == plan::Outcome::Found {
        return;
    }
    if plan.remedies.is_empty() {
        println!(
            "nothing that was tried would help much: walls, workspace, speeds, a second strike, better known properties"
        );
        return;
    }
    println!("what would help, and the success probability with it:");
    for remedy in &plan.remedies {
        println!("  {:>3.0} %  {}", remedy.success_probability * 100.0, remedy.change);
    }
}

fn print_strike(label: &str, strike: &Strike) {
    println!(
        "{label}{} from ({:.1}, {:.1}) mm, heading {:.1} deg, {:.3} m/s, travel {:.0} mm",
        strike.object.as_deref().unwrap_or("the pile"),
        strike.start_m.x * 1e3,
        strike.start_m.y * 1e3,
        strike.heading_rad.to_degrees(),
        strike.speed_m_s,
        strike.travel_m * 1e3
    );
}
