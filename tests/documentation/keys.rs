//! The keys of a configuration, read from the structs that receive them: names, types, defaults and doc comments.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A struct or enum of the configuration.
struct Item {
    doc: String,
    /// Whether every field has the default of `impl Default`.
    all_default: bool,
    is_enum: bool,
    /// How the variants of an enum are spelled: `snake_case` or `lowercase`.
    spelling: String,
    members: Vec<Member>,
}

/// A field or a variant.
struct Member {
    name: String,
    /// Type of a field, payload of a variant; empty for a plain word.
    kind: String,
    doc: String,
    default: Default,
}

enum Default {
    None,
    /// `#[serde(default)]`, or the default variant.
    OfType,
    Function(String),
}

/// Types by name, aliases, and the numbers of default functions and `impl Default`.
pub struct Keys {
    items: BTreeMap<String, Item>,
    aliases: BTreeMap<String, String>,
    values: BTreeMap<String, String>,
}

impl Keys {
    /// Reads the structs, enums and aliases of source files.
    pub fn read(sources: &[&str]) -> Self {
        let mut keys = Self {
            items: BTreeMap::new(),
            aliases: BTreeMap::new(),
            values: BTreeMap::new(),
        };
        sources.iter().for_each(|source| keys.read_source(source));
        keys
    }

    fn read_source(&mut self, source: &str) {
        let (mut doc, mut attributes) = (Vec::new(), String::new());
        let mut lines = source.lines();
        while let Some(line) = lines.next() {
            if let Some(text) = line.strip_prefix("///") {
                doc.push(text.trim().to_owned());
            } else if line.starts_with("#[") {
                attributes += line;
            } else {
                let block = || line.trim_end_matches(" {").split([' ', '<', '(']).collect::<Vec<_>>();
                if line.starts_with("pub struct ") || line.starts_with("pub enum ") {
                    let name = block()[2].to_owned();
                    let is_enum = line.starts_with("pub enum ");
                    let members = members(lines.by_ref().take_while(|line| *line != "}"));
                    let spelling = if attributes.contains("lowercase") {
                        "lowercase"
                    } else {
                        "snake_case"
                    };
                    let all_default = attributes.contains("deny_unknown_fields, default");
                    let doc = doc.join(" ").trim().to_owned();
                    let spelling = spelling.to_owned();
                    let item = Item {
                        doc,
                        all_default,
                        is_enum,
                        spelling,
                        members,
                    };
                    self.items.insert(name, item);
                } else if let Some((name, kind)) =
                    line.strip_prefix("pub type ").and_then(|rest| rest.split_once(" = "))
                {
                    self.aliases
                        .insert(name.to_owned(), kind.trim_end_matches(';').to_owned());
                } else if let Some(name) = line.strip_prefix("impl Default for ") {
                    self.read_defaults(
                        name.trim_end_matches(" {"),
                        lines.by_ref().take_while(|line| *line != "}"),
                    );
                } else if let Some(name) = line.strip_prefix("fn default_") {
                    let value = lines.next().unwrap_or_default().trim().to_owned();
                    self.values
                        .insert(format!("default_{}", name.split('(').next().unwrap_or("")), value);
                }
                (doc, attributes) = (Vec::new(), String::new());
            }
        }
    }

    fn read_defaults<'a>(&mut self, name: &str, lines: impl Iterator<Item = &'a str>) {
        for line in lines {
            if let Some((key, value)) = line.trim().trim_end_matches(',').split_once(": ") {
                self.values.insert(format!("{name}.{key}"), value.to_owned());
            }
        }
    }

    /// Names of all keys, for a check that a page has them.
    pub fn names(&self) -> Vec<String> {
        let spell = |item: &Item, member: &Member| {
            if item.is_enum {
                spelled(&member.name, &item.spelling)
            } else {
                member.name.clone()
            }
        };
        let typed = |name: &str| name.ends_with("Keys") || name.ends_with("Name") || name == "ConfigFile";
        self.items
            .iter()
            .filter(|(name, _)| typed(name))
            .flat_map(|(_, item)| item.members.iter().map(|member| spell(item, member)))
            .collect()
    }

    /// Sections of Markdown in reading order, from the struct of the whole configuration.
    ///
    /// # Panics
    /// Where a key has no description.
    pub fn page(&self, root: &str) -> String {
        let mut sections = vec![root.to_owned()];
        let mut page = String::new();
        let mut next = 0;
        while next < sections.len() {
            let name = sections[next].clone();
            next += 1;
            let (text, mut found) = self.section(&name);
            page += &text;
            found.retain(|name| !sections.contains(name));
            found.dedup();
            // What belongs to a section follows it.
            sections.splice(next..next, found);
        }
        page
    }

    fn section(&self, name: &str) -> (String, Vec<String>) {
        let item = &self.items[name];
        let mut found = Vec::new();
        let mut text = format!("\n## {}\n\n{}\n\n", heading(name), cell(&item.doc));
        text += if item.is_enum {
            "One of these keys:\n\n| key | value | meaning |\n|---|---|---|\n"
        } else {
            "| key | value | default | meaning |\n|---|---|---|---|\n"
        };
        for member in &item.members {
            let key = if item.is_enum {
                spelled(&member.name, &item.spelling)
            } else {
                member.name.clone()
            };
            let value = self.value(&member.kind, &mut found);
            let doc = if item.is_enum && member.doc.is_empty() {
                self.items
                    .get(member.kind.as_str())
                    .map_or("", |item| item.doc.as_str())
            } else {
                &member.doc
            };
            assert!(!doc.is_empty(), "{name}::{} has no description", member.name);
            let default = if item.is_enum {
                String::new()
            } else {
                format!(" {} |", self.default(name, item, member))
            };
            let doc = format!("{doc}{}", self.words(&member.kind));
            writeln!(text, "| `{key}` | {value} |{default} {} |", cell(&doc)).expect("a text grows");
        }
        (text, found)
    }

    /// What the words of an enum mean, where that is said.
    fn words(&self, kind: &str) -> String {
        let Some(item) = self.items.get(kind).filter(|item| item.is_enum) else {
            return String::new();
        };
        let mut text = String::new();
        for variant in &item.members {
            if !variant.doc.is_empty() && variant.kind.is_empty() {
                let word = spelled(&variant.name, &item.spelling);
                write!(text, " `{word}`: {}", variant.doc).expect("a text grows");
            }
        }
        text
    }

    /// A type in words; sections that it refers to are added to `found`.
    fn value(&self, kind: &str, found: &mut Vec<String>) -> String {
        let kind = self.aliases.get(kind).map_or(kind, String::as_str);
        let inner = |wrapper: &str| kind.strip_prefix(wrapper).and_then(|rest| rest.strip_suffix('>'));
        if let Some(inner) = inner("Option<").or(inner("Box<")) {
            return self.value(inner, found);
        }
        if let Some(inner) = inner("OneOrPerAxis<") {
            return format!("{}, or a list of one per axis", self.value(inner, found));
        }
        if let Some((scalar, other)) = inner("ScalarOr<").and_then(|inner| inner.split_once(", ")) {
            return format!("{}, or {}", self.value(scalar, found), self.value(other, found));
        }
        if let Some(inner) = inner("Vec<") {
            let inner = self.value(inner, found);
            return format!("list of {}", if inner.contains("](") { inner } else { plural(&inner) });
        }
        if let Some(inner) = inner("BTreeMap<String, ") {
            let inner = self.value(inner, found);
            return format!("{} by name", if inner.contains("](") { inner } else { plural(&inner) });
        }
        match kind {
            "f64" => "number".into(),
            "usize" | "u32" => "whole number".into(),
            "String" => "text".into(),
            "bool" => "`true` or `false`".into(),
            _ => {
                let item = self
                    .items
                    .get(kind)
                    .unwrap_or_else(|| panic!("the type {kind} is not known"));
                if item.is_enum && item.members.iter().all(|variant| variant.kind.is_empty()) {
                    let word = |variant: &Member| format!("`{}`", spelled(&variant.name, &item.spelling));
                    item.members.iter().map(word).collect::<Vec<_>>().join(", ")
                } else {
                    found.push(kind.to_owned());
                    format!(
                        "[{}](#{})",
                        heading(kind).to_lowercase(),
                        heading(kind).to_lowercase().replace(' ', "-")
                    )
                }
            }
        }
    }

    fn default(&self, item_name: &str, item: &Item, member: &Member) -> String {
        let bare = |value: &str| value.trim_end_matches(".to_owned()").trim_matches('"').to_owned();
        let written = |value: &str| match value.rsplit_once("::") {
            Some((kind, variant)) if self.items.contains_key(kind) => {
                format!("`{}`", spelled(variant, &self.items[kind].spelling))
            }
            _ if value == "None" => "not set".into(),
            _ if value == "String::new()" => "empty".into(),
            _ => format!("`{}`", bare(value)),
        };
        if let Some(value) = self.values.get(&format!("{item_name}.{}", member.name)) {
            return written(value);
        }
        match &member.default {
            Default::Function(name) => written(&self.values[name]),
            _ if member.kind.starts_with("Option<") => "not set".into(),
            Default::None if !item.all_default => "required".into(),
            _ => self.default_of_type(&member.kind),
        }
    }

    fn default_of_type(&self, kind: &str) -> String {
        match self.items.get(kind) {
            Some(item) if item.is_enum => item
                .members
                .iter()
                .find(|variant| matches!(variant.default, Default::OfType))
                .map_or("required".into(), |variant| {
                    format!("`{}`", spelled(&variant.name, &item.spelling))
                }),
            Some(_) => "as below".into(),
            None => "empty".into(),
        }
    }
}

/// Fields or variants of a block, with their doc comments and defaults.
fn members<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<Member> {
    let mut members = Vec::new();
    let (mut doc, mut attributes) = (Vec::new(), String::new());
    for line in lines.map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            doc.push(text.trim());
        } else if line.starts_with("#[") {
            attributes += line;
        } else if !line.is_empty() {
            let line = line.trim_end_matches(',');
            let (name, kind) = match (line.strip_prefix("pub "), line.split_once('(')) {
                (Some(field), _) => field.split_once(": ").expect("a field has a type"),
                (None, Some((variant, payload))) => (variant, payload.trim_end_matches(')')),
                (None, None) => (line, ""),
            };
            let renamed = attributes
                .split_once("rename = \"")
                .and_then(|(_, rest)| rest.split('"').next());
            let function = attributes
                .split_once("default = \"")
                .and_then(|(_, rest)| rest.split('"').next());
            let default = match function {
                Some(name) => Default::Function(name.to_owned()),
                None if attributes.contains("default") => Default::OfType,
                None => Default::None,
            };
            members.push(Member {
                name: renamed.unwrap_or(name).to_owned(),
                kind: kind.to_owned(),
                doc: doc.join(" "),
                default,
            });
            (doc, attributes) = (Vec::new(), String::new());
        }
    }
    members
}

/// `RingSectorKeys` as a heading: `Ring sector`.
fn heading(name: &str) -> String {
    if name == "ConfigFile" {
        return "The file".into();
    }
    let words = spelled(name.trim_end_matches("Keys"), "snake_case").replace('_', " ");
    let (first, rest) = words.split_at(1);
    first.to_uppercase() + rest
}

/// The name of a variant as serde spells it.
fn spelled(name: &str, spelling: &str) -> String {
    let mut result = String::new();
    for (position, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && position > 0 && spelling == "snake_case" {
            result.push('_');
        }
        result.extend(letter.to_lowercase());
    }
    result
}

/// Text for a cell of a table.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace("  ", " ")
}

/// `number` and `list of numbers` as `numbers` and `lists of numbers`.
fn plural(words: &str) -> String {
    match words.strip_prefix("list of ") {
        Some(rest) => format!("lists of {rest}"),
        None if words == "text" => "texts".into(),
        None => format!("{words}s"),
    }
}
