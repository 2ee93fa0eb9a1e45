//! `breakshot objects`: drafts the objects file from a picture.

use crate::args::ObjectsArgs;
use crate::{Outcome, console};
use breakshot::capture::colours;
use breakshot::detect::{self, Draft, Drafted, Heights};
use breakshot::geometry::Point;
use breakshot::object::{Marker, Shape};
use breakshot::scene::Placed;
use breakshot::{Error, Result, files, report};
use std::fmt::Write;

/// Writes the draft, and the picture with the outlines drawn on it.
pub(crate) fn run(args: &ObjectsArgs) -> Result<Outcome> {
    let heights = heights(&args.heights)?;
    let cell = files::load_cell(&args.cell)?;
    let film = args.decoder.film(&args.photo, &cell)?;
    let draft = detect::draft(film, colours(&args.photo)?, &heights)?;
    console::warn(&draft.warnings);
    files::write_whole(&args.output, toml_text(&draft).as_bytes())?;
    files::load_objects(&args.output)?;
    if let Some(path) = &args.figure {
        let png = report::draft_figure(&draft).png().ok_or_else(|| Error::Write {
            path: path.clone(),
            source: std::io::Error::other("a picture without pixels"),
        })?;
        files::write_whole(path, &png)?;
    }
    if args.json {
        let placed = |drafted: &Drafted| Placed {
            object: drafted.object.name.clone(),
            position_m: drafted.pose.position,
            yaw_rad: drafted.pose.yaw_rad,
        };
        console::print_json(&draft.objects.iter().map(placed).collect::<Vec<_>>())?;
        return Ok(Outcome::doubtful_if(!draft.warnings.is_empty()));
    }
    print_table(&draft);
    for path in std::iter::once(&args.output).chain(&args.figure) {
        println!("Wrote {}", path.display());
    }
    println!("Fill in each height_m, and draft again with --height-m: outlines are measured at that height.");
    Ok(Outcome::doubtful_if(!draft.warnings.is_empty()))
}

/// `0.03` for all objects, `object_2=0.05` for one.
fn heights(words: &[String]) -> Result<Heights> {
    let mut heights = Heights::default();
    let number = |text: &str| {
        text.parse::<f64>().map_err(|_| {
            Error::invalid(
                "--height-m",
                "height",
                format!("`{text}`"),
                "metres, or NAME=METRES as in object_2=0.05",
            )
        })
    };
    for word in words {
        match word.split_once('=') {
            Some((name, height)) => {
                heights.named_m.insert(name.into(), number(height)?);
            }
            None => heights.default_m = number(word)?,
        }
    }
    Ok(heights)
}

fn print_table(draft: &Draft) {
    println!("{:<12} {:>9} {:>9} {:>10}  outline", "object", "x (mm)", "y (mm)", "edges (mm)");
    for Drafted { object, pose, rms_m, .. } in &draft.objects {
        let (x, y) = (pose.position.x * 1e3, pose.position.y * 1e3);
        println!("{:<12} {x:>9.2} {y:>9.2} {:>10.2}  {}", object.name, 1e3 * rms_m, outline(&object.shape));
    }
}

/// The outline in words.
fn outline(shape: &Shape) -> String {
    match shape {
        Shape::Disc { radius_m } => format!("disc of radius {:.1} mm", 1e3 * radius_m),
        Shape::Rectangle { size_m: [x, y] } => format!("rectangle of {:.1} x {:.1} mm", 1e3 * x, 1e3 * y),
        Shape::Polygon { points_m } => format!("polygon with {} corners", points_m.len()),
    }
}

fn toml_text(draft: &Draft) -> String {
    let mut text = String::from(
        "# Objects as one picture shows them, for `breakshot detect` and the other commands: check each line with a ruler.\n\
         # A picture shows no heights. Measure them, and draft again with --height-m NAME=METRES: outlines are measured at that height.\n",
    );
    for Drafted { object, rms_m, light_marker, pose } in &draft.objects {
        let (x, y) = (1e3 * pose.position.x, 1e3 * pose.position.y);
        let _ = write!(
            text,
            "\n[[objects]]\nname = \"{}\"  # at ({x:.0}, {y:.0}) mm in the picture; rename it\n\
             shape = {}  # its edges are {:.2} mm (rms) off\nheight_m = {}  # fill in: the height of the top above the table\n",
            object.name,
            shape_text(&object.shape),
            1e3 * rms_m,
            object.height_m,
        );
        let _ = match (&object.marker, light_marker) {
            (Some(marker), Some(light)) => {
                let ink = if *light { "lighter" } else { "darker" };
                writeln!(text, "marker = {}  # {ink} than the top", marker_text(marker))
            }
            _ => writeln!(text, "# no marker: it is found by its outline"),
        };
    }
    text
}

fn point_text(point: Point) -> String {
    format!("[{:.5}, {:.5}]", point.x, point.y)
}

fn shape_text(shape: &Shape) -> String {
    match shape {
        Shape::Disc { radius_m } => format!("{{ disc = {{ radius_m = {radius_m:.5} }} }}"),
        Shape::Rectangle { size_m: [x, y] } => format!("{{ rectangle = {{ size_m = [{x:.5}, {y:.5}] }} }}"),
        Shape::Polygon { points_m } => {
            let points: Vec<String> = points_m.iter().copied().map(point_text).collect();
            format!("{{ polygon = {{ points_m = [{}] }} }}", points.join(", "))
        }
    }
}

fn marker_text(marker: &Marker) -> String {
    let dot = marker.dot.map_or(String::new(), |dot| {
        format!(", dot = {{ radius_m = {:.5}, at_m = {} }}", dot.radius_m, point_text(dot.at_m))
    });
    format!("{{ shape = {}, at_m = {}{dot} }}", shape_text(&marker.shape), point_text(marker.at_m))
}
