//! The parts of Foxglove's message schemas (<https://docs.foxglove.dev/docs/sdk/schemas>) that a recording uses.

use serde_json::{Map, Value, json};

/// An object with the given properties.
fn object(properties: &[(&str, Value)]) -> Value {
    let mut named = Map::new();
    named.extend(properties.iter().map(|(name, value)| ((*name).to_owned(), value.clone())));
    json!({ "type": "object", "properties": named })
}

fn list(items: &Value) -> Value {
    json!({ "type": "array", "items": items })
}

fn numbers(names: &[&str]) -> Value {
    let named: Vec<(&str, Value)> = names.iter().map(|name| (*name, json!({ "type": "number" }))).collect();
    object(&named)
}

fn text() -> Value {
    json!({ "type": "string" })
}

fn number() -> Value {
    json!({ "type": "number" })
}

fn time() -> Value {
    object(&[("sec", json!({ "type": "integer" })), ("nsec", json!({ "type": "integer" }))])
}

fn xyz() -> Value {
    numbers(&["x", "y", "z"])
}

fn pose() -> Value {
    object(&[("position", xyz()), ("orientation", numbers(&["x", "y", "z", "w"]))])
}

fn color() -> Value {
    numbers(&["r", "g", "b", "a"])
}

fn titled(title: &str, mut schema: Value) -> Value {
    schema["title"] = json!(title);
    schema
}

pub(crate) fn frame_transforms() -> Value {
    let transform = object(&[
        ("timestamp", time()),
        ("parent_frame_id", text()),
        ("child_frame_id", text()),
        ("translation", xyz()),
        ("rotation", numbers(&["x", "y", "z", "w"])),
    ]);
    titled("foxglove.FrameTransforms", object(&[("transforms", list(&transform))]))
}

pub(crate) fn joint_states() -> Value {
    let joint = object(&[
        ("name", text()),
        ("position", number()),
        ("velocity", number()),
        ("acceleration", number()),
        ("effort", number()),
    ]);
    titled("foxglove.JointStates", object(&[("timestamp", time()), ("joints", list(&joint))]))
}

pub(crate) fn pose_in_frame() -> Value {
    let fields = object(&[("timestamp", time()), ("frame_id", text()), ("pose", pose())]);
    titled("foxglove.PoseInFrame", fields)
}

pub(crate) fn log() -> Value {
    let fields = object(&[
        ("timestamp", time()),
        ("level", json!({ "type": "integer" })),
        ("message", text()),
        ("name", text()),
        ("file", text()),
        ("line", json!({ "type": "integer" })),
    ]);
    titled("foxglove.Log", fields)
}

pub(crate) fn scene_update() -> Value {
    let cylinder = object(&[
        ("pose", pose()),
        ("size", xyz()),
        ("bottom_scale", number()),
        ("top_scale", number()),
        ("color", color()),
    ]);
    let triangles = object(&[
        ("pose", pose()),
        ("points", list(&xyz())),
        ("color", color()),
        ("colors", list(&color())),
        ("indices", list(&json!({ "type": "integer" }))),
    ]);
    let none = list(&json!({ "type": "object" }));
    let entity = object(&[
        ("timestamp", time()),
        ("frame_id", text()),
        ("id", text()),
        ("lifetime", time()),
        ("frame_locked", json!({ "type": "boolean" })),
        ("metadata", none.clone()),
        ("arrows", none.clone()),
        ("cubes", none.clone()),
        ("spheres", none.clone()),
        ("cylinders", list(&cylinder)),
        ("lines", none.clone()),
        ("triangles", list(&triangles)),
        ("texts", none.clone()),
        ("models", none.clone()),
    ]);
    titled("foxglove.SceneUpdate", object(&[("deletions", none), ("entities", list(&entity))]))
}
