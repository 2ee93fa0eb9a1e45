//! `breakshot plan`: the strike that singulates a pile.

use super::simulate;
use crate::args::PlanArgs;
use crate::{Outcome, console};
use breakshot::plan::{self, Plan};
use breakshot::{Result, files};

/// Plans and writes the plan.
pub(crate) fn run(args: &PlanArgs) -> Result<Outcome> {
    let (scene, properties, outcome) = simulate::world(&args.scene, &args.properties, &args.assumptions)?;
    let options = plan::Options {
        method: args.method.into(),
        scatter: args.scatter.scatter(),
        seed: args.seed,
        ..plan::Options::default()
    };
    let plan = plan::plan(&scene, &properties, &options)?;
    files::write_json(&args.output, &plan)?;
    if args.json {
        console::print_json(&plan)?;
    } else {
        print_summary(&plan);
        println!("Wrote {}", args.output.display());
    }
    Ok(outcome.and(Outcome::doubtful_if(plan.outcome != plan::Outcome::Found)))
}

/// What the plan is, in a few lines.
pub(crate) fn print_summary(plan: &Plan) {
    let word = match plan.outcome {
        plan::Outcome::Found => "found",
        plan::Outcome::BestEffort => "best effort",
        plan::Outcome::Unreachable => "unreachable",
    };
    println!("{word}: {}", plan.reason);
    if let Some(strike) = &plan.strike {
        println!(
            "strike {} from ({:.1}, {:.1}) mm along {:.1} deg at {:.3} m/s for {:.0} mm",
            strike.object.as_deref().unwrap_or("the pile"),
            strike.start_m.x * 1e3,
            strike.start_m.y * 1e3,
            strike.heading_rad.to_degrees(),
            strike.speed_m_s,
            strike.travel_m * 1e3
        );
    }
    let distances = plan.prediction.as_ref().and_then(|p| p.min_distance_m.zip(p.mean_distance_m));
    if let Some((least_m, mean_m)) = distances {
        let (least, mean) = (least_m * 1e3, mean_m * 1e3);
        println!("then the closest two centres are {least:.1} mm apart, all pairs {mean:.1} mm on average");
    }
}
