//! `breakshot estimate`: the properties of all objects from the clips of a campaign.

use crate::args::EstimateArgs;
use crate::commands::detection::track_folder::TrackFolder;
use crate::{Outcome, console};
use breakshot::campaign::{Campaign, Clip};
use breakshot::capture::Decoder;
use breakshot::cell::Cell;
use breakshot::estimate::{self, Advice, AdviceOptions, ClipTracks, Experiment};
use breakshot::object::Object;
use breakshot::properties::{Properties, SlipDamping, TangentialDamping, TangentialRestitution};
use breakshot::uncertain::Estimate;
use breakshot::warning::Warning;
use breakshot::{Error, Result, files, report};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Tracks all clips, estimates the properties and writes them.
pub(crate) fn run(args: &EstimateArgs) -> Result<Outcome> {
    let old = args.update.as_deref().map(files::load_properties).transpose()?;
    let campaign = files::load_campaign(&args.campaign)?;
    console::note(&campaign.notes);
    console::hint("`breakshot check CAMPAIGN` shows each film with what was found on it");
    let campaign = campaign.value;
    let options = estimate::Options { reference: args.reference.clone() };
    let (cell, objects) = (&campaign.cell, &campaign.objects);
    if let Some(old) = &old {
        let names: Vec<&str> = campaign.clips.iter().map(|clip| clip.name.as_str()).collect();
        estimate::check_update(old, &names, cell, objects, &options)?;
    }
    let (clips, unreadable) = match &args.tracks {
        Some(folder) => tracked_into(folder, &campaign, args.decoder.into())?,
        None => tracked(&campaign, args.decoder.into())?,
    };
    let mut properties =
        breakshot::campaign_properties(&campaign, old.as_ref(), &clips, unreadable, &options)?;
    console::warn_by_cause(&properties.warnings, &properties.causes, &args.output);
    let advice = advice(args, &properties, cell, objects)?;
    if let Some(folder) = &args.figures {
        write_figures(folder, &properties, objects)?;
    }
    files::write_json(&args.output, &properties)?;
    let advice_path = args.advice.clone().unwrap_or_else(|| args.output.with_file_name("advice.json"));
    if let Some(advice) = &advice {
        files::write_json(&advice_path, advice)?;
    }
    if args.json {
        // The evidence is only needed for later updates: the file contains it, the printed result does not.
        properties.evidence = None;
        console::print_json(&Printed { properties: &properties, advice: advice.as_ref() })?;
    } else {
        print_tables(&properties);
        println!("\n{}", readiness(&properties, objects));
        println!("Wrote {}", args.output.display());
        if let Some(advice) = &advice {
            print_advice(advice);
            println!("Wrote {}", advice_path.display());
        }
    }
    Ok(Outcome::doubtful_if(!properties.warnings.is_empty()))
}

/// The output of `--json`.
#[derive(serde::Serialize)]
struct Printed<'a> {
    #[serde(flatten)]
    properties: &'a Properties,
    #[serde(skip_serializing_if = "Option::is_none")]
    advice: Option<&'a Advice>,
}

/// The clips to film next, if they were requested.
fn advice(
    args: &EstimateArgs,
    properties: &Properties,
    cell: &Cell,
    objects: &[Object],
) -> Result<Option<Advice>> {
    let Some(clips) = args.advise else { return Ok(None) };
    let scene = args.scene.as_deref().map(files::load_scene).transpose()?;
    let scene = scene.as_ref().map(|loaded| &loaded.value);
    let options = AdviceOptions { clips: clips as usize, seed: args.seed, scene };
    estimate::advice(properties, cell, objects, &options).map(Some)
}

/// Writes Figs. 7, 8, 9 and Table 1, and prints a note for each figure without data.
fn write_figures(folder: &Path, properties: &Properties, objects: &[Object]) -> Result<()> {
    let figures = report::paper_figures(properties, &estimate::clip_values(properties)?, objects)?;
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    for file in &figures.files {
        files::write_whole(&folder.join(&file.name), file.text.as_bytes())?;
    }
    let missing = figures.missing.iter().map(|m| format!("not drawn: {m}"));
    console::note(&missing.collect::<Vec<_>>());
    Ok(())
}

/// Prints the clips to film next, the most useful first.
fn print_advice(advice: &Advice) {
    println!(
        "\nClips to film next. Predicted final positions now: {:.1} mm (1 standard deviation, mean of {} simulated strikes on piles)",
        advice.spread_m * 1e3,
        advice.piles
    );
    println!(
        "{:>3} {:<12} {:<12} {:>11} {:>11} {:>11}  most informative for",
        "", "strike", "into", "speed (m/s)", "offset (mm)", "then (mm)"
    );
    for (k, clip) in advice.clips.iter().enumerate() {
        let Experiment { strike, into, speed_m_s, offset_m } = &clip.experiment;
        let quantities: Vec<&str> = clip.reductions.iter().take(2).map(|t| t.quantity.as_str()).collect();
        println!(
            "{:>3} {strike:<12} {:<12} {speed_m_s:>11.2} {:>11.1} {:>11.2}  {}",
            k + 1,
            into.as_deref().unwrap_or("-"),
            offset_m * 1e3,
            clip.spread_m * 1e3,
            quantities.join(", ")
        );
    }
}

/// The tracks of all readable clips, and a warning for each of the others.
///
/// Clips are processed in parallel; each is decoded frame by frame.
pub(crate) fn tracked(campaign: &Campaign, decoder: Decoder) -> Result<(Vec<ClipTracks>, Vec<Warning>)> {
    with_progress(campaign, |clip| breakshot::clip_tracks(campaign, clip, decoder))
}

/// As [`tracked`]; the tracks that are in the folder are used, the others are written to it.
fn tracked_into(
    folder: &Path,
    campaign: &Campaign,
    decoder: Decoder,
) -> Result<(Vec<ClipTracks>, Vec<Warning>)> {
    let folder = TrackFolder::new(folder, campaign, decoder)?;
    let unwritable = Mutex::new(None);
    let tracks = |clip: &Clip| match folder.tracks(clip) {
        Ok(found) => Ok(found.clip),
        // Not a reason to leave the clip out.
        Err(error @ Error::Write { .. }) => {
            *unwritable.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            Err(Error::Stopped)
        }
        Err(error) => Err(error),
    };
    let tracked = with_progress(campaign, tracks);
    match unwritable.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(error) => Err(error),
        None => tracked,
    }
}

fn with_progress(
    campaign: &Campaign,
    tracks: impl Fn(&Clip) -> Result<ClipTracks> + Sync + Send,
) -> Result<(Vec<ClipTracks>, Vec<Warning>)> {
    let bar = console::progress(campaign.clips.len(), "clips");
    let tracked = breakshot::campaign_tracks(campaign, |clip| {
        let tracks = tracks(clip);
        bar.inc(1);
        tracks
    });
    bar.finish_and_clear();
    tracked
}

/// A law that is at most as probable is not printed.
const MOST_DOUBTED: f64 = 0.8;
/// Missing values that are named one by one; further ones are counted.
const MOST_NAMED: usize = 4;

/// One sentence about what can be planned with these properties, and what is assumed for it.
fn readiness(properties: &Properties, objects: &[Object]) -> String {
    let names: Vec<&str> = objects.iter().map(|object| object.name.as_str()).collect();
    let mut missing = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let of_object = [
            ("friction", properties.friction(name)),
            ("restitution against the striker", properties.striker_restitution(name)),
            ("mass", properties.mass_ratio(name)),
        ];
        missing.extend(
            of_object.iter().filter(|(_, v)| v.is_err()).map(|(what, _)| format!("{what} of `{name}`")),
        );
        let others = names[..k].iter().filter(|other| properties.restitution(other, name).is_err());
        missing.extend(others.map(|other| format!("restitution of `{other}/{name}`")));
    }
    let piles = format!("`breakshot plan` can plan for piles of {}", names.join(", "));
    if missing.is_empty() {
        return format!("{piles}: all that it needs is measured.");
    }
    let more = missing.len().saturating_sub(MOST_NAMED);
    missing.truncate(MOST_NAMED);
    let and_more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{piles}; assumed until a clip measures them: {}{and_more}.", missing.join(", "))
}

/// Prints the properties as tables.
pub(crate) fn print_tables(properties: &Properties) {
    let mass = format!("mass over that of `{}`", properties.reference);
    let contact = of_contacts([properties.contact_friction.objects, properties.contact_friction.striker]);
    let TangentialRestitution { objects, striker } = properties.tangential_restitution;
    let tangential = of_contacts([objects, striker]);
    let tables = [
        ("friction on the table", &properties.friction),
        ("striker restitution", &properties.striker_restitution),
        ("restitution of a pair", &properties.restitution),
        (mass.as_str(), &properties.mass_ratio),
        ("friction of contacts", &contact),
        ("tangential restitution", &tangential),
        ("support, 1 = even weight", &properties.support),
    ];
    let filled = tables.into_iter().filter(|(_, values)| !values.is_empty());
    for (number, (title, values)) in filled.enumerate() {
        if number == 0 {
            println!("{LEGEND}");
        }
        println!("\n{}", table(title, values).join("\n"));
    }
    let TangentialDamping { objects, striker } = properties.tangential_damping;
    for (between, damping) in [("objects", objects), ("objects and the striker", striker)] {
        if let Some(sentence) = damping.and_then(|damping| damped(between, damping)) {
            println!("\n{sentence}");
        }
    }
    if let Some(tilt) = &properties.tilt {
        println!("\n{}", capitalized(&tilt.to_string()));
    }
}

/// A sentence about damped slip, if the impacts favour it over a constant tangential restitution.
fn damped(between: &str, SlipDamping { probability, exponent }: SlipDamping) -> Option<String> {
    let Estimate { mean, interval_95: [low, high], .. } = exponent;
    (probability > MOST_DOUBTED).then(|| {
        format!(
            "Impacts between {between} with restitution e leave the part e^p of the slip, with a probability of {:.0} %: p = {mean:.1} \
             (95 %: {low:.1} to {high:.1}).",
            100.0 * probability
        )
    })
}

/// The values of contacts between objects and with the striker, as far as they are given.
fn of_contacts([objects, striker]: [Option<Estimate>; 2]) -> BTreeMap<String, Estimate> {
    let named = [("between objects", objects), ("at the striker", striker)];
    named.into_iter().filter_map(|(name, value)| Some((name.to_owned(), value?))).collect()
}

/// A phrase as a sentence.
fn capitalized(phrase: &str) -> String {
    let mut letters = phrase.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

const LEGEND: &str = "All values are ratios without a unit. The true mean lies in the 95 % interval with that probability\n\
     (the mean +/- so many per cent); scatter is the standard deviation from clip to clip.";

/// The lines of one table.
fn table(title: &str, values: &BTreeMap<String, Estimate>) -> Vec<String> {
    let head = format!(
        "{title:<24} {:>8}  {:>16} {:>9} {:>9} {:>6}",
        "mean", "95 % interval", "+/- (%)", "scatter", "clips"
    );
    let row = |(name, e): (&String, &Estimate)| {
        let [low, high] = e.interval_95;
        let percent = 50.0 * (high - low) / e.mean.abs();
        // The reference's own mass is no measurement.
        let is_exact = low == high;
        let [interval, sure, scatter, clips] = if is_exact {
            ["by definition", "-", "-", "-"].map(str::to_owned)
        } else {
            let scatter = e.std.map_or("-".into(), |std| format!("{std:.4}"));
            [format!("{low:.4} .. {high:.4}"), format!("{percent:.1}"), scatter, e.n.to_string()]
        };
        format!("  {name:<22} {:>8.4}  {interval:>16} {sure:>9} {scatter:>9} {clips:>6}", e.mean)
    };
    std::iter::once(head).chain(values.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use breakshot::object::Shape;

    fn object(name: &str) -> Object {
        let shape = Shape::Disc { radius_m: 0.03 };
        Object { name: name.into(), shape, height_m: 0.03, marker: None, mass_kg: None, support: None }
    }

    #[test]
    fn a_table_gives_the_interval_and_how_sure_each_mean_is() {
        let value =
            Estimate { mean: 0.2, std: Some(0.01), standard_error: 0.002, interval_95: [0.196, 0.204], n: 5 };
        let values = [("a".to_owned(), Estimate::exact(1.0)), ("b".to_owned(), value)].into();
        let lines = table("friction on the table", &values);
        let words: Vec<Vec<&str>> = lines.iter().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(words[1], ["a", "1.0000", "by", "definition", "-", "-", "-"]);
        assert_eq!(words[2], ["b", "0.2000", "0.1960", "..", "0.2040", "2.0", "0.0100", "5"]);
        assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{lines:#?}");
    }

    #[test]
    fn damped_slip_is_printed_where_the_impacts_favour_it() {
        let law = SlipDamping { probability: 0.98, ..SlipDamping::assumed() };
        let sentence = damped("objects", law).unwrap();
        assert!(sentence.starts_with("Impacts between objects") && sentence.contains("98 %"), "{sentence}");
        assert_eq!(damped("objects", SlipDamping::assumed()), None);
    }

    #[test]
    fn what_is_assumed_for_a_plan_is_named() {
        let mut properties = Properties::default();
        let objects = ["a", "b", "c"].map(object);
        for name in ["a", "b", "c"] {
            properties.friction.insert(name.into(), Estimate::exact(0.2));
            properties.mass_ratio.insert(name.into(), Estimate::exact(1.0));
            properties.striker_restitution.insert(name.into(), Estimate::exact(0.5));
        }
        for pair in ["a/b", "a/c", "b/c"] {
            properties.restitution.insert(pair.into(), Estimate::exact(0.5));
        }
        let said = readiness(&properties, &objects);
        assert_eq!(said, "`breakshot plan` can plan for piles of a, b, c: all that it needs is measured.");
        properties.restitution.remove("b/c");
        properties.friction.remove("b");
        let said = readiness(&properties, &objects);
        assert!(
            said.ends_with("assumed until a clip measures them: friction of `b`, restitution of `b/c`."),
            "{said}"
        );
        properties.restitution.clear();
        properties.mass_ratio.clear();
        let said = readiness(&properties, &objects);
        assert!(said.ends_with(" and 3 more."), "{said}");
    }
}
