//! The page of keys, made of the JSON Schema of a configuration: names, types, defaults and descriptions.

use serde_json::Value;
use std::fmt::Write as _;

/// The schema of the whole configuration.
pub struct Keys(pub Value);

/// A key of a section, or one of its choices.
struct Member<'a> {
    name: &'a str,
    schema: &'a Value,
    required: bool,
    doc: &'a str,
}

impl Keys {
    /// Sections of Markdown in reading order: what belongs to a section follows it.
    ///
    /// # Panics
    /// Where a key has no description.
    pub fn page(&self) -> String {
        let mut sections = vec![String::new()];
        let mut page = String::new();
        let mut next = 0;
        while next < sections.len() {
            let name = sections[next].clone();
            next += 1;
            let (text, mut found) = self.section(&name);
            page += &text;
            found.retain(|name| !sections.contains(name));
            found.dedup();
            sections.splice(next..next, found);
        }
        page
    }

    /// Names of all keys and words.
    pub fn names(&self) -> Vec<String> {
        let definitions = self.0["$defs"].as_object().expect("the schema has definitions");
        let items = std::iter::once(&self.0).chain(definitions.values());
        let names = items.flat_map(|item| {
            let members = members(item).into_iter().map(|member| member.name.to_owned());
            members.chain(words(item).into_iter().map(|(word, _)| word.to_owned()))
        });
        names.collect()
    }

    /// A definition by its name; the whole configuration has none.
    fn item(&self, name: &str) -> &Value {
        match name {
            "" => &self.0,
            _ => &self.0["$defs"][name],
        }
    }

    fn section(&self, name: &str) -> (String, Vec<String>) {
        let item = self.item(name);
        let choice = item.get("oneOf").is_some();
        let mut found = Vec::new();
        let mut text = format!("\n## {}\n\n{}\n\n", heading(name), cell(description(item)));
        text += if choice {
            "One of these keys:\n\n| key | value | meaning |\n|---|---|---|\n"
        } else {
            "| key | value | default | meaning |\n|---|---|---|---|\n"
        };
        for member in members(item) {
            let value = self.value(member.schema, &mut found);
            // A choice without a description of its own is described by what it holds.
            let held = reference(member.schema).map_or("", |held| description(self.item(held)));
            let doc = match member.doc {
                "" if choice => held,
                doc => doc,
            };
            assert!(!doc.is_empty(), "{name}.{} has no description", member.name);
            let default = if choice {
                String::new()
            } else {
                format!(" {} |", default(&member))
            };
            let doc = format!("{doc}{}", self.meanings(member.schema));
            writeln!(text, "| `{}` | {value} |{default} {} |", member.name, cell(&doc)).expect("a text grows");
        }
        (text, found)
    }

    /// What the words of a value mean, where that is said.
    fn meanings(&self, schema: &Value) -> String {
        let Some(name) = reference(schema) else {
            return String::new();
        };
        let described = words(self.item(name)).into_iter().filter(|(_, doc)| !doc.is_empty());
        described.fold(String::new(), |text, (word, doc)| format!("{text} `{word}`: {doc}"))
    }

    /// A type in words; sections that it refers to are added to `found`.
    fn value(&self, schema: &Value, found: &mut Vec<String>) -> String {
        if let Some(name) = reference(schema) {
            let words = words(self.item(name));
            if !words.is_empty() {
                let quoted: Vec<_> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
                return quoted.join(", ");
            }
            found.push(name.to_owned());
            let heading = heading(name).to_lowercase();
            return format!("[{heading}](#{})", heading.replace(' ', "-"));
        }
        if let Some(choices) = schema["anyOf"].as_array() {
            let choices: Vec<_> = choices.iter().filter(|choice| choice["type"] != "null").collect();
            return match choices.as_slice() {
                [only] => self.value(only, found),
                [one, list] if list["items"] == **one => {
                    format!("{}, or a list of one per axis", self.value(one, found))
                }
                several => several
                    .iter()
                    .map(|choice| self.value(choice, found))
                    .collect::<Vec<_>>()
                    .join(", or "),
            };
        }
        let kind = match &schema["type"] {
            Value::Array(kinds) => kinds[0].as_str(),
            kind => kind.as_str(),
        };
        match kind.unwrap_or_else(|| panic!("a key of no known type: {schema}")) {
            "array" => format!("list of {}", plural(self.value(&schema["items"], found))),
            "object" => format!("{} by name", plural(self.value(&schema["additionalProperties"], found))),
            "boolean" => "`true` or `false`".into(),
            "integer" => "whole number".into(),
            "string" => "text".into(),
            other => other.to_owned(),
        }
    }
}

/// Keys of a section, or its choices, in the order of the source.
fn members(item: &Value) -> Vec<Member<'_>> {
    let choices = item["oneOf"].as_array().map_or(&[][..], Vec::as_slice);
    let members = std::iter::once(item).chain(choices).flat_map(|holder| {
        let properties = holder["properties"].as_object().into_iter().flatten();
        properties.map(move |(name, schema)| Member {
            name,
            schema,
            required: is_required(holder, name),
            // That of a choice stands beside its only key.
            doc: match description(schema) {
                "" => description(holder),
                doc => doc,
            },
        })
    });
    members.collect()
}

/// Whether a key must be given, of the whole configuration for a run.
fn is_required(holder: &Value, name: &str) -> bool {
    let holder = holder["anyOf"].get(0).unwrap_or(holder);
    holder["required"]
        .as_array()
        .is_some_and(|keys| keys.iter().any(|key| key == name))
}

/// The words that a value may be, with their descriptions; none for anything but words.
fn words(item: &Value) -> Vec<(&str, &str)> {
    let choices = item["oneOf"]
        .as_array()
        .map_or(std::slice::from_ref(item), Vec::as_slice);
    let mut words = Vec::new();
    for choice in choices {
        let list = choice["enum"].as_array().into_iter().flatten();
        let found = list.chain(choice.get("const")).filter_map(Value::as_str);
        // The description of a plain list of words is that of the type.
        let doc = if choice.get("const").is_some() {
            description(choice)
        } else {
            ""
        };
        words.extend(found.map(|word| (word, doc)));
    }
    words
}

/// The definition that a value refers to, set or not.
fn reference(schema: &Value) -> Option<&str> {
    let direct = match schema["anyOf"].as_array().map(Vec::as_slice) {
        Some([only, null]) if null["type"] == "null" => only,
        _ => schema,
    };
    direct["$ref"].as_str()?.strip_prefix("#/$defs/")
}

fn description(schema: &Value) -> &str {
    schema["description"].as_str().unwrap_or("")
}

/// What holds where a key is not given.
fn default(member: &Member) -> String {
    match &member.schema["default"] {
        _ if member.required => "required".into(),
        Value::Null => "not set".into(),
        Value::String(text) if !text.is_empty() => format!("`{text}`"),
        Value::Object(keys) if !keys.is_empty() => "as below".into(),
        value @ (Value::Number(_) | Value::Bool(_)) => format!("`{value}`"),
        _ => "empty".into(),
    }
}

/// `RingSectorKeys` as a heading: `Ring sector`.
fn heading(name: &str) -> String {
    if name.is_empty() {
        return "The file".into();
    }
    let mut words = String::new();
    for letter in name.trim_end_matches("Keys").chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        if words.is_empty() {
            words.push(letter);
        } else {
            words.extend(letter.to_lowercase());
        }
    }
    words
}

/// Text for a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace("\n\n", " ").replace('\n', " ")
}

/// `number` and `list of numbers` as `numbers` and `lists of numbers`; links stay as they are.
fn plural(words: String) -> String {
    match words.strip_prefix("list of ") {
        _ if words.contains("](") => words,
        Some(rest) => format!("lists of {rest}"),
        None => format!("{words}s"),
    }
}
