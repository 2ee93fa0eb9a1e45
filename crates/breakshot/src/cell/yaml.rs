//! YAML text as a JSON value: what configuration files need of YAML.
//!
//! Anchors and aliases are errors: ROS and OpenCV write none, and a short file of nested aliases stands for a value
//! of any size.

use saphyr_parser::{Event, Parser, ScalarStyle};
use serde_json::{Map, Value};

/// The deepest nesting that is read; a `CameraInfo` file nests twice.
const MAX_DEPTH: usize = 32;

/// A sequence or mapping that has not ended.
enum Open {
    Sequence(Vec<Value>),
    /// With the key whose value comes next.
    Mapping(Map<String, Value>, Option<String>),
}

/// The first document in `text`; null for an empty text.
///
/// # Errors
/// One sentence with line and column: no YAML, an alias, a key that is not a scalar or stands twice, nesting deeper
/// than [`MAX_DEPTH`].
pub(crate) fn value(text: impl AsRef<str>) -> Result<Value, String> {
    let mut open: Vec<Open> = Vec::new();
    for event in Parser::new_from_str(text.as_ref()) {
        let (event, span) = event.map_err(|e| e.to_string())?;
        let at = |problem: &str| {
            format!("{problem} at line {} column {}", span.start.line(), span.start.col() + 1)
        };
        let ended = match event {
            Event::SequenceStart(..) | Event::MappingStart(..) if open.len() == MAX_DEPTH => {
                return Err(at(&format!("nesting deeper than {MAX_DEPTH}")));
            }
            Event::SequenceStart(..) => {
                open.push(Open::Sequence(Vec::new()));
                continue;
            }
            Event::MappingStart(..) => {
                open.push(Open::Mapping(Map::new(), None));
                continue;
            }
            Event::Alias(_) => return Err(at("an alias, which is not supported,")),
            Event::Scalar(scalar, style, ..) => match open.last_mut() {
                Some(Open::Mapping(map, None)) if map.contains_key(scalar.as_ref()) => {
                    return Err(at(&format!("a second key `{scalar}`")));
                }
                Some(Open::Mapping(_, key @ None)) => {
                    *key = Some(scalar.into_owned());
                    continue;
                }
                _ => scalar_value(&scalar, style),
            },
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some(Open::Sequence(items)) => Value::Array(items),
                Some(Open::Mapping(map, _)) => Value::Object(map),
                None => Value::Null,
            },
            _ => continue,
        };
        match open.last_mut() {
            None => return Ok(ended),
            Some(Open::Sequence(items)) => items.push(ended),
            Some(Open::Mapping(map, key)) => {
                let key = key.take().ok_or_else(|| at("a key that is not a scalar"))?;
                map.insert(key, ended);
            }
        }
    }
    Ok(Value::Null)
}

/// A scalar by YAML's core schema. What JSON has no number for (`.nan`, `.inf`) stays text.
fn scalar_value(scalar: &str, style: ScalarStyle) -> Value {
    if style != ScalarStyle::Plain {
        return scalar.into();
    }
    match scalar {
        "" | "~" | "null" | "Null" | "NULL" => return Value::Null,
        "true" | "True" | "TRUE" => return Value::Bool(true),
        "false" | "False" | "FALSE" => return Value::Bool(false),
        _ => {}
    }
    let number =
        |text: &str| text.parse::<i64>().map(Value::from).or_else(|_| text.parse::<f64>().map(Value::from));
    match number(scalar) {
        // Rust also reads `nan` and `inf`, which are text in YAML; serde_json turns them into null.
        Ok(number) if number.is_number() => number,
        _ => scalar.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::value;
    use proptest::prelude::*;
    use serde_json::json;

    #[test]
    fn block_and_flow_style_give_the_same_value() {
        let wanted = json!({"a": [1, -2.5, 3.0, 1e-4], "b": {"c": null, "d": "0.5", "e": true, "f": ".nan", "g": "nan"}});
        let block = "a:\n  - 1\n  - -2.5\n  - 3.\n  - 1.e-4\nb:\n  c: ~\n  d: '0.5'\n  e: true\n  f: .nan\n  g: nan\n";
        let flow =
            "---\n{a: [1, -2.5, 3., 1.0E-4], b: {c: , d: \"0.5\", e: True, f: .nan, g: nan}} # a comment\n";
        assert_eq!(value(block).expect("block style"), wanted);
        assert_eq!(value(flow).expect("flow style"), wanted);
        assert_eq!(value("").expect("nothing"), json!(null));
    }

    #[test]
    fn what_cannot_be_a_value_is_an_error_with_its_line() {
        let deep = "[".repeat(40);
        for (text, problem) in [
            ("a: [1, 2", "line"),
            ("a: &x [1]\nb: *x", "an alias, which is not supported, at line 2"),
            ("a: 1\na: 2", "a second key `a` at line 2 column 1"),
            ("? [1, 2]\n: 3", "a key that is not a scalar"),
            (deep.as_str(), "nesting deeper than 32 at line 1 column 33"),
        ] {
            let message = value(text).expect_err(text);
            assert!(message.contains(problem), "{text}: {message}");
        }
    }
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn any_text_is_a_value_or_an_error(text in "[-\\[\\]{}:,&*?|>%@`'\"# \\n\\ta-c0-9.!~]{0,60}") {
            let depth = |value: &serde_json::Value| value.to_string().matches(['[', '{']).count();
            if let Ok(value) = value(&text) {
                prop_assert!(depth(&value) <= text.len(), "{} from {}", value, text);
            }
        }
    }
}
