//! YAML text as a tree of nodes that know where they stand in the file. The YAML crate is named here and nowhere else.

use super::path::{Path, Step};
use crate::problem::Problem;
use saphyr_parser::{Event, Marker, Parser, ScalarStyle};
use std::collections::HashMap;

/// Deepest nesting of lists and mappings that is read.
const MAXIMUM_DEPTH: usize = 60;

/// Largest number of values that is read: no configuration is that long.
const MAXIMUM_NODES: usize = 100_000;

/// Problems beyond this number are not reported: by then the file is not what the user thinks it is.
pub const MAXIMUM_PROBLEMS: usize = 200;

/// Where a piece of a configuration comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Line and column of the file, counted from 1.
    File { line: usize, column: usize },
    /// A `--set` of the command line.
    CommandLine,
}

/// A value of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Node {
    pub place: Place,
    pub value: Value,
}

/// What a node holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Text as it was written without quotes: a number, a word, nothing.
    Plain(String),
    /// Text in quotes or in a block.
    Quoted(String),
    List(Vec<Node>),
    Mapping(Vec<Entry>),
    /// Stands for a value that was found wrong or missing, and reported.
    Hole,
}

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub key: String,
    pub place: Place,
    pub node: Node,
}

impl Node {
    /// Whether nothing was written, or `null`.
    pub fn is_empty(&self) -> bool {
        matches!(&self.value, Value::Plain(text) if matches!(text.as_str(), "" | "~" | "null" | "Null" | "NULL"))
    }

    /// The node below by one step.
    pub fn child(&self, step: &Step) -> Option<&Node> {
        match (&self.value, step) {
            (Value::Mapping(entries), step) => entries
                .iter()
                .find(|entry| step.is(&entry.key))
                .map(|entry| &entry.node),
            (Value::List(nodes), Step::Index(index)) => nodes.get(*index),
            _ => None,
        }
    }

    /// The node below by one step, to be changed.
    pub fn child_mut(&mut self, step: &Step) -> Option<&mut Node> {
        match (&mut self.value, step) {
            (Value::Mapping(entries), step) => entries
                .iter_mut()
                .find(|entry| step.is(&entry.key))
                .map(|entry| &mut entry.node),
            (Value::List(nodes), Step::Index(index)) => nodes.get_mut(*index),
            _ => None,
        }
    }

    /// Sets a key of a mapping; does nothing to other nodes.
    pub fn set(&mut self, key: &str, place: Place, node: Node) {
        if let Value::Mapping(entries) = &mut self.value {
            match entries.iter_mut().find(|entry| entry.key == key) {
                Some(entry) => entry.node = node,
                None => entries.push(Entry {
                    key: key.to_owned(),
                    place,
                    node,
                }),
            }
        }
    }

    /// Place of the deepest node along a path that exists: of its key where it has one.
    pub fn place_of(&self, path: &Path) -> Place {
        let mut node = self;
        let mut place = self.place;
        for step in &path.0 {
            let Some(child) = node.child(step) else { break };
            place = match (&node.value, child.place) {
                // An override of the value counts, though its key stands in the file.
                (_, Place::CommandLine) => Place::CommandLine,
                (Value::Mapping(entries), _) => entries
                    .iter()
                    .find(|entry| step.is(&entry.key))
                    .map_or(child.place, |entry| entry.place),
                _ => child.place,
            };
            node = child;
        }
        place
    }

    /// The value on one line, from which [`parse_value`] makes the same.
    pub fn flow(&self) -> String {
        match &self.value {
            Value::Plain(text) => text.clone(),
            Value::Quoted(text) => serde_json::Value::from(text.as_str()).to_string(),
            Value::List(nodes) => format!(
                "[{}]",
                nodes.iter().map(Node::flow_within).collect::<Vec<_>>().join(", ")
            ),
            Value::Mapping(entries) => {
                let entry = |entry: &Entry| {
                    let key = Node {
                        place: entry.place,
                        value: Value::Plain(entry.key.clone()),
                    };
                    format!("{}: {}", key.flow_within(), entry.node.flow_within())
                };
                format!("{{{}}}", entries.iter().map(entry).collect::<Vec<_>>().join(", "))
            }
            Value::Hole => String::new(),
        }
    }

    /// As [`Node::flow`], within a list or mapping on one line: there some letters of a plain text have a meaning.
    fn flow_within(&self) -> String {
        let harmless = |letter: char| letter.is_alphanumeric() || "_.+-/ ".contains(letter);
        match &self.value {
            Value::Plain(text) if text.is_empty() => "null".to_owned(),
            Value::Plain(text) if !text.chars().all(harmless) => serde_json::Value::from(text.as_str()).to_string(),
            _ => self.flow(),
        }
    }

    /// What the node is, for a message.
    pub fn describe(&self) -> String {
        match &self.value {
            _ if self.is_empty() => "nothing".to_owned(),
            Value::Plain(text) | Value::Quoted(text) => format!("\"{}\"", shorten(text)),
            Value::List(nodes) => format!("a list of {}", nodes.len()),
            Value::Mapping(_) => "a mapping of keys".to_owned(),
            Value::Hole => "a wrong value".to_owned(),
        }
    }
}

impl Step {
    /// Whether the step names this key; a key may be a number.
    fn is(&self, key: &str) -> bool {
        match self {
            Step::Key(name) => name == key,
            Step::Index(index) => index.to_string() == key,
        }
    }
}

/// Enough of a text for a message.
pub fn shorten(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

/// Reads YAML text. Keys that appear twice, aliases and tags are reported and passed over; text that is not YAML is the
/// only problem reported.
///
/// # Errors
/// The text is not YAML, or not one mapping.
pub fn parse(file: &str, text: &str) -> Result<(Node, Vec<Problem>), Vec<Problem>> {
    parse_keys(file, text, "model, grid, materials")
}

/// Reads YAML text like [`parse`]; `keys` are examples of what the file may hold.
///
/// # Errors
/// The text is not YAML, or not one mapping.
pub fn parse_keys(file: &str, text: &str, keys: &str) -> Result<(Node, Vec<Problem>), Vec<Problem>> {
    let root = parse_value(file, text)?;
    match root {
        (
            Node {
                value: Value::Mapping(_),
                ..
            },
            _,
        ) => Ok(root),
        (node, _) if node.is_empty() => Err(vec![problem(
            file,
            None,
            "",
            "the file holds no configuration",
            &format!("keys such as {keys}"),
        )]),
        (node, _) => Err(vec![problem(
            file,
            Some(node.place),
            "",
            &format!("the file holds {} instead of keys", node.describe()),
            &format!("a mapping of keys: {keys}, ..."),
        )]),
    }
}

/// Reads YAML text that may be any one value.
pub fn parse_value(file: &str, text: &str) -> Result<(Node, Vec<Problem>), Vec<Problem>> {
    let mut builder = Builder {
        file,
        ..Builder::default()
    };
    for event in Parser::new_from_str(text) {
        match event {
            Ok((event, span)) => builder.event(event, span.start)?,
            Err(error) => {
                let place = place(*error.marker());
                let message = format!("this is not YAML: {}", error.info());
                return Err(vec![problem(file, Some(place), "", &message, "YAML 1.2")]);
            }
        }
    }
    let empty = Node {
        place: Place::File { line: 1, column: 1 },
        value: Value::Plain(String::new()),
    };
    Ok((builder.root.unwrap_or(empty), builder.problems))
}

fn place(marker: Marker) -> Place {
    Place::File {
        line: marker.line(),
        column: marker.col() + 1,
    }
}

fn problem(file: &str, place: Option<Place>, path: &str, message: &str, expected: &str) -> Problem {
    Problem {
        file: file.to_owned(),
        place: place.and_then(|place| match place {
            Place::File { line, column } => Some((line, column)),
            Place::CommandLine => None,
        }),
        path: path.to_owned(),
        message: message.to_owned(),
        expected: expected.to_owned(),
    }
}

/// A list or mapping that is being read.
struct Open {
    node: Node,
    /// Key of a mapping whose value comes next.
    key: Option<(String, Place)>,
    /// Keys of a mapping so far.
    known: HashMap<String, Place>,
}

/// Makes a tree of the parser's events.
#[derive(Default)]
struct Builder<'a> {
    file: &'a str,
    open: Vec<Open>,
    root: Option<Node>,
    nodes: usize,
    problems: Vec<Problem>,
}

impl Builder<'_> {
    fn event(&mut self, event: Event<'_>, start: Marker) -> Result<(), Vec<Problem>> {
        let place = place(start);
        match event {
            Event::Scalar(text, style, _, tag) => {
                self.refuse_tag(tag.is_some(), place);
                let text = text.into_owned();
                let value = if style == ScalarStyle::Plain {
                    Value::Plain(text)
                } else {
                    Value::Quoted(text)
                };
                self.finish(Node { place, value })?;
            }
            Event::SequenceStart(_, tag) => {
                self.refuse_tag(tag.is_some(), place);
                self.start(Node {
                    place,
                    value: Value::List(Vec::new()),
                })?;
            }
            Event::MappingStart(_, tag) => {
                self.refuse_tag(tag.is_some(), place);
                self.start(Node {
                    place,
                    value: Value::Mapping(Vec::new()),
                })?;
            }
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some(open) = self.open.pop() {
                    self.finish(open.node)?;
                }
            }
            Event::Alias(_) => {
                self.report(
                    place,
                    "YAML aliases are not accepted here",
                    "the value itself, written out",
                );
                self.finish(Node {
                    place,
                    value: Value::Hole,
                })?;
            }
            Event::DocumentStart(_) if self.root.is_some() => {
                return Err(self.fatal(place, "a second YAML document begins here", "one document"));
            }
            Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentStart(_) | Event::DocumentEnd => {}
        }
        Ok(())
    }

    fn start(&mut self, node: Node) -> Result<(), Vec<Problem>> {
        if self.open.len() == MAXIMUM_DEPTH {
            let expected = format!("at most {MAXIMUM_DEPTH} levels");
            return Err(self.fatal(node.place, "lists and mappings are nested too deeply", &expected));
        }
        self.open.push(Open {
            node,
            key: None,
            known: HashMap::new(),
        });
        Ok(())
    }

    /// Hands a complete node to the list or mapping that it belongs to.
    fn finish(&mut self, node: Node) -> Result<(), Vec<Problem>> {
        self.nodes += 1;
        if self.nodes > MAXIMUM_NODES {
            let expected = format!("at most {MAXIMUM_NODES} values");
            return Err(self.fatal(node.place, "the file is too long", &expected));
        }
        let Some(open) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        match (&mut open.node.value, open.key.take()) {
            (Value::List(nodes), _) => nodes.push(node),
            (Value::Mapping(entries), Some((key, place))) => match open.known.get(&key) {
                None => {
                    open.known.insert(key.clone(), place);
                    entries.push(Entry { key, place, node });
                }
                Some(first) => {
                    let message = format!("the key \"{}\" appears twice{}", shorten(&key), also_at(*first));
                    self.report_key(place, &key, &message);
                }
            },
            (_, None) => match node.value {
                Value::Plain(text) | Value::Quoted(text) => open.key = Some((text, node.place)),
                _ => {
                    open.key = Some((String::from("?"), node.place));
                    self.report(node.place, "a key is not a word", "a word as the key");
                }
            },
            _ => {}
        }
        Ok(())
    }

    fn refuse_tag(&mut self, tagged: bool, place: Place) {
        if tagged {
            self.report(place, "YAML tags are not accepted here", "the value without its tag");
        }
    }

    /// Path of what is being read.
    fn path(&self) -> Path {
        let mut path = Path::root();
        for open in &self.open {
            match (&open.node.value, &open.key) {
                (Value::List(nodes), _) => path = path.index(nodes.len()),
                (_, Some((key, _))) => path = path.key(key),
                _ => {}
            }
        }
        path
    }

    fn report(&mut self, place: Place, message: &str, expected: &str) {
        self.report_at(&self.path(), place, message, expected);
    }

    fn report_key(&mut self, place: Place, key: &str, message: &str) {
        self.report_at(&self.path().key(key), place, message, "each key once");
    }

    fn report_at(&mut self, path: &Path, place: Place, message: &str, expected: &str) {
        if self.problems.len() < MAXIMUM_PROBLEMS {
            let problem = problem(self.file, Some(place), &path.to_string(), message, expected);
            self.problems.push(problem);
        }
    }

    /// What was found so far, and last what ends the reading.
    fn fatal(&mut self, place: Place, message: &str, expected: &str) -> Vec<Problem> {
        self.problems.truncate(MAXIMUM_PROBLEMS - 1);
        self.report(place, message, expected);
        std::mem::take(&mut self.problems)
    }
}

fn also_at(place: Place) -> String {
    match place {
        Place::File { line, .. } => format!(", first on line {line}"),
        Place::CommandLine => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_know_their_line_and_column() {
        let (root, problems) = parse("a.yaml", "grid:\n  min: [0, 1]\n  basis: gimp\n").unwrap();
        assert!(problems.is_empty());
        assert_eq!(
            root.place_of(&Path::parse("grid.basis")),
            Place::File { line: 3, column: 3 }
        );
        assert_eq!(
            root.place_of(&Path::parse("grid.min[1]")),
            Place::File { line: 2, column: 12 }
        );
        assert_eq!(
            root.place_of(&Path::parse("grid.nowhere.at.all")),
            Place::File { line: 1, column: 1 }
        );
    }

    #[test]
    fn broken_text_is_one_problem_with_its_place() {
        let problems = parse("a.yaml", "grid:\n  min: [0, 1\nbasis: gimp\n").unwrap_err();
        assert_eq!(problems.len(), 1);
        assert!(problems[0].place.is_some_and(|(line, _)| line >= 2), "{}", problems[0]);
        assert!(problems[0].message.contains("not YAML"));
    }

    #[test]
    fn duplicates_aliases_and_tags_are_all_reported() {
        let (_, problems) = parse("a.yaml", "a: &x 1\na: 2\nb: *x\nc: !!float 1\n").unwrap();
        let messages: Vec<_> = problems.iter().map(ToString::to_string).collect();
        assert_eq!(messages.len(), 3, "{messages:?}");
        assert!(
            messages[0].starts_with("a.yaml:2:1: a: the key \"a\" appears twice, first on line 1"),
            "{messages:?}"
        );
        assert!(messages[1].contains("aliases"));
        assert!(messages[2].contains("tags"));
    }

    #[test]
    fn a_list_of_mistakes_ends() {
        let (_, problems) = parse("a.yaml", &format!("a: [{}]\n", "!t x,".repeat(90_000))).unwrap();
        assert_eq!(problems.len(), MAXIMUM_PROBLEMS);
        // What ends the reading is told last, however much was wrong before.
        let problems = parse("a.yaml", &format!("a: [{}]\n", "!t x,".repeat(2 * MAXIMUM_NODES))).unwrap_err();
        assert_eq!(problems.len(), MAXIMUM_PROBLEMS);
        assert!(problems[MAXIMUM_PROBLEMS - 1].message.contains("too long"));
    }

    #[test]
    fn deep_nesting_and_second_documents_end_in_a_problem() {
        assert!(parse("a.yaml", &"[".repeat(100_000)).is_err());
        assert!(parse("a.yaml", &"- ".repeat(10_000)).is_err());
        assert!(parse("a.yaml", "a: 1\n---\nb: 2\n").is_err());
        assert!(
            parse("a.yaml", "# nothing\n").unwrap_err()[0]
                .message
                .contains("no configuration")
        );
    }
}
