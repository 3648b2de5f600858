//! The resolved configuration as YAML: what was typed, with defaults filled in.

use super::file::{ConfigFile, OneOrPerAxis, PlacementName, ScalarOr, ShapeKeys};
use super::input::Files;
use serde_json::Value;
use std::fmt::Write;

/// Longest line on which a list or mapping is written in one piece.
const LINE_LENGTH: usize = 100;

/// Gauss points along an axis of a cell of a mesh, unless set.
pub const DEFAULT_POINTS_OF_MESH: OneOrPerAxis<usize> = ScalarOr::Scalar(2);

/// A tree that describes the same scene wherever it is stored; files are named absolutely.
pub fn resolved(config: &ConfigFile, files: &Files, directory: &str) -> Value {
    let mut config = config.clone();
    config.output.directory = Some(directory.to_owned());
    config.path = None;
    for body in &mut config.bodies {
        if let Some(ShapeKeys::Points(points)) = &mut body.shape {
            points.file = files.resolve(&points.file);
        }
        if body.mesh.is_some() {
            body.points_per_cell.get_or_insert(DEFAULT_POINTS_OF_MESH);
        }
        let placement = if body.mesh.is_some() {
            PlacementName::Gauss
        } else {
            PlacementName::Even
        };
        body.placement.get_or_insert(placement);
    }
    for material in config.materials.values_mut() {
        material.cone_fit = material.cone().map(|cone| cone.fit);
    }
    let first_stage = config.stages.first().map(|stage| stage.name.clone());
    let stages_of_boundary = config.boundary.iter_mut().map(|entry| &mut entry.stage);
    for stage in stages_of_boundary.chain(config.loads.iter_mut().map(|entry| &mut entry.stage)) {
        *stage = stage.take().or_else(|| first_stage.clone());
    }
    serde_json::to_value(&config).unwrap_or_default()
}

/// A tree as YAML.
pub fn text(tree: &Value) -> String {
    let mut text = String::new();
    for (key, value) in tree.as_object().into_iter().flatten() {
        block(&mut text, 0, &format!("{key}:"), value);
    }
    text
}

/// Writes a value after its key or dash, on as many lines as it needs.
fn block(text: &mut String, indent: usize, lead: &str, value: &Value) {
    let line = format!("{}{lead}", " ".repeat(indent));
    let flow = flow(value);
    // Sections of the file are always spread out.
    let spread = indent == 0 || line.len() + 1 + flow.len() > LINE_LENGTH;
    let _ = match value {
        Value::Null => Ok(()),
        Value::Object(entries) if spread && !entries.is_empty() => {
            let written = writeln!(text, "{line}");
            entries
                .iter()
                .for_each(|(key, value)| block(text, indent + 2, &format!("{}:", quote(key)), value));
            written
        }
        Value::Array(values) if spread && !values.is_empty() => {
            let written = writeln!(text, "{line}");
            values.iter().for_each(|value| list_entry(text, indent + 2, value));
            written
        }
        _ => writeln!(text, "{line} {flow}"),
    };
}

/// Writes an entry of a list; the first key of a mapping that needs several lines follows the dash.
fn list_entry(text: &mut String, indent: usize, value: &Value) {
    let long = indent + 2 + flow(value).len() > LINE_LENGTH;
    match value {
        Value::Object(entries) if long => {
            let begin = text.len();
            for (key, value) in entries {
                block(text, indent + 2, &format!("{}:", quote(key)), value);
            }
            // The dash takes the place of a blank.
            text.replace_range(begin + indent..=begin + indent, "-");
        }
        _ => block(text, indent, "-", value),
    }
}

/// A value on one line.
fn flow(value: &Value) -> String {
    match value {
        Value::String(word) => quote(word),
        Value::Array(values) => format!("[{}]", values.iter().map(flow).collect::<Vec<_>>().join(", ")),
        Value::Object(entries) => {
            let entries = entries.iter().filter(|(_, value)| !value.is_null());
            let entries: Vec<_> = entries
                .map(|(key, value)| format!("{}: {}", quote(key), flow(value)))
                .collect();
            format!("{{{}}}", entries.join(", "))
        }
        // YAML 1.1, as many scripts read it, knows exponents only after a decimal point.
        Value::Number(number) => match number.to_string() {
            text if text.contains('.') => text,
            text => text.replacen('e', ".0e", 1),
        },
        other => other.to_string(),
    }
}

/// A word as it is, any other text in quotes with everything unusual escaped.
fn quote(text: &str) -> String {
    let plain = text.starts_with(|letter: char| letter.is_ascii_alphabetic())
        && text
            .chars()
            .all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
        && !matches!(
            text.to_lowercase().as_str(),
            "null" | "true" | "false" | "yes" | "no" | "on" | "off" | "y" | "n"
        );
    if plain {
        return text.to_owned();
    }
    let mut quoted = String::from("\"");
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            ' '..='~' => quoted.push(letter),
            _ if letter.is_alphanumeric() => quoted.push(letter),
            _ => quoted.push_str(&format!("\\U{:08X}", u32::from(letter))),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::super::tree::{self, parse_value};
    use super::*;

    #[test]
    fn any_text_comes_back_as_it_was() {
        for text in [
            "",
            "word",
            "null",
            "0.5",
            "a: b # c",
            "\"\\\n\t\u{85}\u{7f}\u{2028}é日𝄞",
            " padded ",
            "{x}",
            "- y",
            "~",
        ] {
            let (node, problems) = parse_value("", &format!("[{}]", quote(text))).unwrap();
            assert!(problems.is_empty());
            let tree::Value::List(nodes) = node.value else { panic!() };
            let (tree::Value::Plain(read) | tree::Value::Quoted(read)) = &nodes[0].value else {
                panic!()
            };
            assert_eq!(read, text);
        }
    }
}
