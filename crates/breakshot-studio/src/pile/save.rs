//! Writes a pile into its scene file, or into a new one; comments and everything else in the file stay.

use super::request::{Cache, PileRequest};
use crate::project::Project;
use breakshot::scene::{Goal, KeepOut, Placed, Strike, Wall};
use breakshot::{Error, Result, files};
use serde::Deserialize;
use std::path::PathBuf;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, TableLike, Value, value};

/// A pile to be written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveRequest {
    pile: PileRequest,
    /// The file to write; that of the pile if not given.
    output: Option<String>,
}

/// Writes the poses and the goal of the pile.
///
/// # Errors
/// A pile that is not valid, a file that is not of the project or cannot be written.
pub(crate) fn save(project: &Project, cache: &Cache, request: &SaveRequest) -> Result<String> {
    let scene = cache.pile(project, &request.pile)?;
    let source = project.file(&request.pile.scene)?;
    let name = request.output.as_ref().unwrap_or(&request.pile.scene);
    let output = project.new_file(name)?;
    if output.parent() != source.parent() {
        return Err(Error::invalid(
            name,
            "the folder",
            "another one",
            "the folder of the scene that is shown",
        ));
    }
    let unreadable = |source| Error::Read { path: project_path(name), source };
    let text = std::fs::read_to_string(&source).map_err(unreadable)?;
    let syntax = |e: toml_edit::TomlError| Error::Syntax { path: source.clone(), problem: e.to_string() };
    let mut document: DocumentMut = text.parse().map_err(syntax)?;
    set_placed(&mut document, &scene.placed);
    if request.pile.walls.is_some() {
        set_walls(&mut document, &scene.walls);
    }
    if request.pile.keep_out.is_some() {
        set_keep_out(&mut document, &scene.keep_out);
    }
    set_goal(&mut document, &scene.goal);
    files::write_whole(&output, document.to_string().as_bytes())?;
    Ok(name.clone())
}

/// A strike to be written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SaveStrikeRequest {
    strike: Strike,
    output: String,
}

/// Writes a file with only the strike, for `breakshot simulate` and `breakshot command`.
///
/// # Errors
/// An impossible strike, a file that is not of the project or cannot be written.
pub(crate) fn save_strike(project: &Project, request: &SaveStrikeRequest) -> Result<String> {
    request.strike.check("the strike")?;
    let output = project.new_file(&request.output)?;
    if output.extension().is_none_or(|extension| extension != "json") {
        return Err(Error::invalid(
            &request.output,
            "the name",
            "not one of JSON",
            "a name that ends with .json",
        ));
    }
    files::write_json(&output, &request.strike)?;
    Ok(request.output.clone())
}

/// A scene without objects that is to be written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NewScene {
    cell: String,
    objects: String,
    output: String,
}

/// Writes a scene file without objects; one that exists is not replaced.
///
/// # Errors
/// A cell or objects that are not of the project or not valid, a name that is taken or not that of a scene beside them.
pub(crate) fn new_scene(project: &Project, request: &NewScene) -> Result<String> {
    let NewScene { cell, objects, output } = request;
    let path = is_new_scene(project, output)?;
    let cell_file = project.file(cell)?;
    project.check_cell(&cell_file)?;
    files::load_cell(&cell_file)?;
    files::load_objects(project.file(objects)?)?;
    let mut document = DocumentMut::new();
    document.insert("cell", value(cell));
    document.insert("objects", value(objects));
    files::write_whole(&path, document.to_string().as_bytes())?;
    Ok(output.clone())
}

/// The path of a scene file that does not exist yet.
///
/// # Errors
/// A name that is taken, or not that of a scene in the project's own folder.
pub(crate) fn is_new_scene(project: &Project, output: &str) -> Result<PathBuf> {
    let (path, is_toml) = (project.new_file(output)?, output.to_ascii_lowercase().ends_with(".toml"));
    if !is_toml || output.contains('/') {
        return Err(Error::invalid(
            output,
            "the name",
            "not such a name",
            "a name that ends with .toml, without a folder",
        ));
    }
    if path.exists() {
        return Err(Error::invalid(output, "the name", "taken", "the name of a new file"));
    }
    Ok(path)
}

pub(crate) fn project_path(name: &str) -> PathBuf {
    name.into()
}

/// A pair of numbers.
pub(crate) fn pair(numbers: [f64; 2]) -> Value {
    Value::Array(Array::from_iter(numbers))
}

/// Sets a number; one that is equal stays as it is written.
pub(crate) fn set(table: &mut dyn TableLike, key: &str, new: Value) {
    let same = |old: &Value| numbers(old) == numbers(&new) && old.type_name() == new.type_name();
    match table.get_mut(key).and_then(Item::as_value_mut) {
        Some(old) if same(old) => {}
        Some(old) => {
            let decor = old.decor().clone();
            *old = new;
            *old.decor_mut() = decor;
        }
        None => {
            table.insert(key, Item::Value(new));
        }
    }
}

/// The numbers and words of a value, to compare it.
fn numbers(value: &Value) -> Vec<String> {
    match value {
        Value::Array(array) => array.iter().flat_map(numbers).collect(),
        Value::Float(number) => vec![number.value().to_string()],
        #[allow(clippy::cast_precision_loss, reason = "lengths in metres")]
        Value::Integer(number) => vec![(*number.value() as f64).to_string()],
        Value::Boolean(word) => vec![word.value().to_string()],
        other => vec![other.to_string().trim().to_owned()],
    }
}

/// The placed objects: those that are in the file keep their place and comments, others follow.
fn set_placed(document: &mut DocumentMut, placed: &[Placed]) {
    let old = document.get("placed").and_then(Item::as_array_of_tables).cloned().unwrap_or_default();
    let name_of = |table: &Table| table.get("object").and_then(Item::as_str).map(str::to_owned);
    let mut tables = ArrayOfTables::new();
    let mut left: Vec<&Placed> = placed.iter().collect();
    for table in &old {
        let Some(k) = left.iter().position(|p| name_of(table).as_deref() == Some(p.object.as_str())) else {
            continue;
        };
        let mut table = table.clone();
        fill(&mut table, left.remove(k));
        tables.push(table);
    }
    for placed in left {
        let mut table = Table::new();
        table.insert("object", value(placed.object.as_str()));
        fill(&mut table, placed);
        tables.push(table);
    }
    if tables.is_empty() {
        document.remove("placed");
    } else {
        document.insert("placed", Item::ArrayOfTables(tables));
    }
}

fn fill(table: &mut Table, placed: &Placed) {
    set(table, "position_m", pair([placed.position_m.x, placed.position_m.y]));
    if placed.yaw_rad != 0.0 || table.contains_key("yaw_rad") {
        set(table, "yaw_rad", placed.yaw_rad.into());
    }
}

/// The entries of a list that have no names: each keeps its comments as long as there is one in its place.
fn set_entries<T>(document: &mut DocumentMut, key: &str, entries: &[T], fill: impl Fn(&mut Table, &T)) {
    let old = document.get(key).and_then(Item::as_array_of_tables).cloned().unwrap_or_default();
    let mut tables = ArrayOfTables::new();
    for (k, entry) in entries.iter().enumerate() {
        let mut table = old.get(k).cloned().unwrap_or_default();
        fill(&mut table, entry);
        tables.push(table);
    }
    if tables.is_empty() {
        document.remove(key);
    } else {
        document.insert(key, Item::ArrayOfTables(tables));
    }
}

fn set_walls(document: &mut DocumentMut, walls: &[Wall]) {
    set_entries(document, "walls", walls, |table, wall| {
        set(table, "from_m", pair([wall.from_m.x, wall.from_m.y]));
        set(table, "to_m", pair([wall.to_m.x, wall.to_m.y]));
        set(table, "restitution", wall.restitution.into());
    });
}

fn set_keep_out(document: &mut DocumentMut, areas: &[KeepOut]) {
    set_entries(document, "keep_out", areas, |table, area| {
        let points = area.points_m.iter().map(|point| pair([point.x, point.y]));
        set(table, "points_m", Value::Array(points.collect()));
    });
}

/// The distances of the goal; its other keys stay.
fn set_goal(document: &mut DocumentMut, goal: &Goal) {
    let given = document.get("goal").is_some();
    if !given && *goal == Goal::default() {
        return;
    }
    if !given {
        document.insert("goal", Item::Table(Table::new()));
    }
    let Some(table) = document.get_mut("goal").and_then(Item::as_table_mut) else { return };
    let standard = Goal::default();
    let mut put = |key: &str, new: Value, is_standard: bool| {
        if !is_standard || table.contains_key(key) {
            set(table, key, new);
        }
    };
    put("min_distance_m", goal.min_distance_m.into(), goal.min_distance_m == standard.min_distance_m);
    put("mean_distance_m", pair(goal.mean_distance_m), goal.mean_distance_m == standard.mean_distance_m);
    put("min_gap_m", goal.min_gap_m.into(), goal.min_gap_m == standard.min_gap_m);
    put("inside_workspace", goal.inside_workspace.into(), goal.inside_workspace == standard.inside_workspace);
}

#[cfg(test)]
mod tests {
    use super::*;
    use breakshot::geometry::Point;

    const TEXT: &str = "# A pile.\ncell = \"cell.toml\" # above\n\n[[placed]] # the first\nobject = \"a\"\n\
        position_m = [0.1, 0] # measured\n\n[[placed]]\nobject = \"b\"\nposition_m = [0.2, 0.0]\nyaw_rad = 1.5\n\n\
        [goal]\nmin_distance_m = 0.09 # Eq. 36\n";

    fn placed(object: &str, x: f64, y: f64, yaw_rad: f64) -> Placed {
        Placed { object: object.into(), position_m: Point::new(x, y), yaw_rad }
    }

    #[test]
    fn an_unchanged_pile_leaves_the_file_as_it_is() {
        let mut document: DocumentMut = TEXT.parse().unwrap();
        set_placed(&mut document, &[placed("a", 0.1, 0.0, 0.0), placed("b", 0.2, 0.0, 1.5)]);
        set_goal(&mut document, &Goal::default());
        assert_eq!(document.to_string(), TEXT);
    }

    #[test]
    fn walls_and_areas_are_written_and_comments_stay() {
        let text = format!(
            "{TEXT}\n[[walls]] # a shelf\nfrom_m = [0, 0.2] # left\nto_m = [0.3, 0.2]\nrestitution = 0.5\n"
        );
        let wall = |y: f64| Wall { from_m: Point::new(0.0, y), to_m: Point::new(0.3, y), restitution: 0.5 };
        let mut document: DocumentMut = text.parse().unwrap();
        set_walls(&mut document, &[wall(0.2)]);
        set_keep_out(&mut document, &[]);
        assert_eq!(document.to_string(), text, "an unchanged scene stays as it is written");
        let corners = [[0.1, 0.1], [0.2, 0.1], [0.2, 0.2]].map(|[x, y]| Point::new(x, y));
        set_walls(&mut document, &[wall(0.25), wall(-0.1)]);
        set_keep_out(&mut document, &[KeepOut { points_m: corners.to_vec() }]);
        let changed = document.to_string();
        for part in [
            "[[walls]] # a shelf",
            "[0.0, 0.25] # left",
            "[0.0, -0.1]",
            "[[keep_out]]\npoints_m = [[0.1, 0.1]",
        ] {
            assert!(changed.contains(part), "{part}: {changed}");
        }
        set_walls(&mut document, &[]);
        assert!(!document.to_string().contains("walls"), "{document}");
    }

    #[test]
    fn comments_stay_where_poses_change() {
        let mut document: DocumentMut = TEXT.parse().unwrap();
        set_placed(&mut document, &[placed("a", 0.15, -0.02, 0.5), placed("a#2", 0.3, 0.0, 0.0)]);
        set_goal(&mut document, &Goal { min_distance_m: 0.1, ..Goal::default() });
        let text = document.to_string();
        for part in
            ["# A pile.", "# above", "# the first", "[0.15, -0.02] # measured", "\"a#2\"", "0.1 # Eq. 36"]
        {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("\"b\"") && !text.contains("mean_distance_m"), "{text}");
    }
}
