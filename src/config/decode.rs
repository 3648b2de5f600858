//! A serde deserializer over the tree of a configuration that goes on after a problem.
//!
//! Serde stops at the first error and forgets where it was. Here a value of the wrong kind is reported with its place and
//! replaced by a stand-in, and so is a key that nobody knows; only a missing key ends a pass, and the next pass finds a
//! [`Value::Hole`] in its place, from which anything can be made. What comes out after a problem is good for finding more
//! problems, and for nothing else: [`Findings::sound`] tells which parts can be trusted.

use super::nearest::{did_you_mean, nearest};
use super::path::{Path, Step};
use super::source::Source;
use super::tree::{Entry, MAXIMUM_PROBLEMS, Node, Place, Value, shorten};
use crate::material::spec::KeyProblem;
use crate::problem::Problem;
use serde::de::value::StrDeserializer;
use serde::de::{self, DeserializeOwned, DeserializeSeed, IntoDeserializer, Visitor};
use std::cell::RefCell;
use std::fmt;

/// Name of the newtype that a deserializer is asked for where a scalar, or else a list or mapping, is accepted.
pub const SCALAR_OR: &str = "ScalarOr";

/// Name of the newtype that a deserializer is asked for where any value is accepted, and kept as text.
const FLOW_TEXT: &str = "FlowText";

/// Any value, as YAML text on one line: what may follow `--set KEY=`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct FlowText(pub String);

impl<'de> de::Deserialize<'de> for FlowText {
    fn deserialize<D: de::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = FlowText;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(out, "any value")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<FlowText, E> {
                Ok(FlowText(text.to_owned()))
            }
        }
        deserializer.deserialize_newtype_struct(FLOW_TEXT, Text)
    }
}

/// What was found wrong so far, and where.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    pub problems: Vec<Problem>,
    /// Paths of values that are not what the user meant: what follows from them is not worth a message.
    pub unsound: Vec<Path>,
    /// What can be run but may not be meant, in sentences.
    pub warnings: Vec<String>,
}

impl Findings {
    /// Adds a problem unless it lies at, above or below one that is known.
    pub fn add(&mut self, source: &Source, path: &Path, message: impl Into<String>, expected: impl Into<String>) {
        if !self.full() && self.sound(path) {
            let problem = source.problem_at(path, message.into(), expected.into());
            self.problems.push(problem);
        }
    }

    /// Adds what is wrong with the keys of the material at a path.
    pub fn add_keys(&mut self, source: &Source, path: &Path, problems: Vec<KeyProblem>) {
        for problem in problems {
            let place = if problem.key.is_empty() {
                path.clone()
            } else {
                path.key(problem.key)
            };
            self.add(source, &place, problem.message, problem.expected);
        }
    }

    /// Adds a problem that spoils the value at a path.
    fn push(&mut self, problem: Problem, spoiled: Path) {
        if !self.full() {
            self.problems.push(problem);
            self.unsound.push(spoiled);
        }
    }

    /// Puts the problems in order, each once: overrides first, then by line.
    pub fn sort(&mut self) {
        self.problems
            .sort_by_key(|problem| (problem.file != "--set", problem.place));
        self.problems.dedup();
    }

    /// Whether so much is wrong that no more is looked for.
    pub fn full(&self) -> bool {
        self.problems.len() >= MAXIMUM_PROBLEMS
    }

    /// Whether nothing is wrong at a path, above or below it.
    pub fn sound(&self, path: &Path) -> bool {
        !self.unsound.iter().any(|bad| bad.contains(path) || path.contains(bad))
    }

    /// Whether all names of the entries of a section were read: none of its entries is wrong as a whole or in its `name`.
    pub fn names_known(&self, section: &Path) -> bool {
        let hides_name = |bad: &Path| match bad.0.get(section.0.len()..) {
            None | Some([]) => bad.contains(section),
            Some([Step::Index(_)]) => section.contains(bad),
            Some([Step::Index(_), Step::Key(key)]) => key == "name" && section.contains(bad),
            _ => false,
        };
        !self.unsound.iter().any(hides_name)
    }
}

/// Makes a value of the tree of `source`; wrong and missing values are reported in `findings` and made up.
///
/// # Errors
/// There is more wrong than is worth going on for; `findings` say what.
pub fn decode<T: DeserializeOwned>(source: &Source, findings: &mut Findings) -> Result<T, ()> {
    let mut root = source.root().clone();
    let mut lasting = findings.clone();
    for _ in 0..MAXIMUM_PROBLEMS {
        let pass = RefCell::new(lasting.clone());
        let result = T::deserialize(Decoder {
            node: &root,
            path: Path::root(),
            source,
            findings: &pass,
        });
        let pass = pass.into_inner();
        let failure = match result {
            Ok(value) => {
                *findings = pass;
                return Ok(value);
            }
            Err(failure) => failure,
        };
        let (path, message, expected) = failure.place_and_message();
        // Reported once and kept for all later passes; the rest is found again by them. A missing key that was reported
        // as misspelled is not missing.
        if !pass.unsound.contains(&path) {
            lasting.problems.push(source.problem_at(&path, message, expected));
        }
        *findings = pass;
        findings.problems.clone_from(&lasting.problems);
        let Some(holder) = dig(&mut root, &path) else {
            return Err(());
        };
        *holder = Value::Hole;
        lasting.unsound.push(path);
    }
    Err(())
}

/// The value at a path, made where its mapping lacks it.
fn dig<'a>(root: &'a mut Node, path: &Path) -> Option<&'a mut Value> {
    let mut node = root;
    for step in &path.0 {
        if let Step::Key(key) = step
            && node.child(step).is_none()
        {
            let place = node.place;
            node.set(
                key,
                place,
                Node {
                    place,
                    value: Value::Hole,
                },
            );
        }
        node = node.child_mut(step)?;
    }
    Some(&mut node.value)
}

/// Why serde stopped.
#[derive(Debug)]
pub struct Failure {
    path: Option<Path>,
    kind: FailureKind,
}

#[derive(Debug)]
enum FailureKind {
    Missing(&'static str),
    /// A message, and what is accepted.
    Refused(String, String),
    Other(String),
}

impl Failure {
    /// Names the place where serde stopped, if it is not known yet.
    fn at(mut self, path: &Path) -> Failure {
        self.path.get_or_insert_with(|| path.clone());
        self
    }

    /// Place, message, and what is accepted there as far as serde knows.
    fn place_and_message(self) -> (Path, String, String) {
        let path = self.path.unwrap_or_default();
        match self.kind {
            FailureKind::Missing(key) => (path.key(key), "this key is missing".to_owned(), String::new()),
            FailureKind::Refused(message, accepted) => (path, message, accepted),
            FailureKind::Other(message) => (path, message, String::new()),
        }
    }

    fn refused(message: String, accepted: String) -> Failure {
        Failure {
            path: None,
            kind: FailureKind::Refused(message, accepted),
        }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            FailureKind::Missing(key) => write!(out, "missing key {key}"),
            FailureKind::Refused(message, _) | FailureKind::Other(message) => write!(out, "{message}"),
        }
    }
}

impl std::error::Error for Failure {}

impl de::Error for Failure {
    fn custom<T: fmt::Display>(message: T) -> Failure {
        Failure {
            path: None,
            kind: FailureKind::Other(message.to_string()),
        }
    }

    fn missing_field(field: &'static str) -> Failure {
        Failure {
            path: None,
            kind: FailureKind::Missing(field),
        }
    }

    fn unknown_variant(typed: &str, accepted: &'static [&'static str]) -> Failure {
        let hint = did_you_mean(nearest(typed, accepted.iter().copied()));
        let message = format!("\"{}\" is not accepted{hint}", shorten(typed));
        Failure::refused(message, accepted.join(", "))
    }

    fn invalid_type(found: de::Unexpected<'_>, expected: &dyn de::Expected) -> Failure {
        let found = match found {
            de::Unexpected::Seq => "a list".to_owned(),
            de::Unexpected::Map => "a mapping of keys".to_owned(),
            other => other.to_string(),
        };
        Failure::refused(format!("{found} is not accepted"), expected.to_string())
    }
}

/// A finite number, as YAML and Rust agree to write it.
pub fn number(text: &str) -> Option<f64> {
    let plain = text
        .bytes()
        .all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    text.parse().ok().filter(|value: &f64| plain && value.is_finite())
}

/// Reads one node.
#[derive(Clone)]
struct Decoder<'a> {
    node: &'a Node,
    path: Path,
    source: &'a Source,
    findings: &'a RefCell<Findings>,
}

impl<'a> Decoder<'a> {
    fn below(&self, node: &'a Node, path: Path) -> Decoder<'a> {
        Decoder {
            node,
            path,
            source: self.source,
            findings: self.findings,
        }
    }

    /// Reports that the node is not what is accepted; a hole was reported before.
    fn refuse(&self, expected: &str) {
        let message = match self.node.value {
            Value::Hole => return,
            _ if self.node.is_empty() => "this key has no value".to_owned(),
            _ => format!("{} is not accepted", self.node.describe()),
        };
        self.report(message, expected);
    }

    fn report(&self, message: String, expected: &str) {
        let problem = self.source.problem_at(&self.path, message, expected.to_owned());
        self.findings.borrow_mut().push(problem, self.path.clone());
    }

    /// Text of a scalar that is not in quotes.
    fn plain(&self) -> Option<&'a str> {
        match &self.node.value {
            Value::Plain(text) => Some(text),
            _ => None,
        }
    }

    fn unsigned<'de, V: Visitor<'de>>(self, visitor: V, maximum: u64) -> Result<V::Value, Failure> {
        let read = self
            .plain()
            .filter(|text| text.bytes().all(|byte| byte.is_ascii_digit()));
        let value = read
            .and_then(|text| text.parse().ok())
            .filter(|value| *value <= maximum);
        if value.is_none() {
            self.refuse(&format!("a whole number from 0 to {maximum}"));
        }
        visitor
            .visit_u64(value.unwrap_or(1))
            .map_err(|failure: Failure| failure.at(&self.path))
    }

    /// Entries of a mapping whose keys are known; the others are reported. Keys without a value count as not given.
    fn known_entries(&self, entries: &'a [Entry], known: &'static [&'static str]) -> Vec<&'a Entry> {
        let is_known = |entry: &&Entry| known.contains(&entry.key.as_str());
        for entry in entries.iter().filter(|entry| !is_known(entry)) {
            if self.findings.borrow().full() {
                break;
            }
            let suggestion = nearest(&entry.key, known.iter().copied());
            let hint = did_you_mean(suggestion);
            let message = format!("unknown key \"{}\"{hint}", shorten(&entry.key));
            let mut problem = self
                .source
                .problem_at(&self.path.key(&entry.key), message, known.join(", "));
            problem.path = self.path.to_string();
            let spoiled = self.path.key(suggestion.unwrap_or(&entry.key));
            self.findings.borrow_mut().push(problem, spoiled);
        }
        entries
            .iter()
            .filter(is_known)
            .filter(|entry| !entry.node.is_empty())
            .collect()
    }
}

impl<'de> de::Deserializer<'de> for Decoder<'_> {
    type Error = Failure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let result = match &self.node.value {
            Value::Plain(text) => match number(text) {
                Some(number) => visitor.visit_f64(number),
                None => visitor.visit_str(text),
            },
            Value::Quoted(text) => visitor.visit_str(text),
            Value::List(_) => return self.deserialize_seq(visitor),
            Value::Mapping(_) => return self.deserialize_map(visitor),
            Value::Hole => visitor.visit_unit(),
        };
        result.map_err(|failure: Failure| failure.at(&self.path))
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let value = match self.plain() {
            Some("true") => Some(true),
            Some("false") => Some(false),
            _ => None,
        };
        if value.is_none() {
            self.refuse("true or false");
        }
        visitor
            .visit_bool(value.unwrap_or(false))
            .map_err(|failure: Failure| failure.at(&self.path))
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let value = self.plain().and_then(number);
        if value.is_none() {
            self.refuse("a number, such as 0.05 or 8.0e6");
        }
        visitor
            .visit_f64(value.unwrap_or(1.0))
            .map_err(|failure: Failure| failure.at(&self.path))
    }

    fn deserialize_u64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        self.unsigned(visitor, u64::from(u32::MAX))
    }

    fn deserialize_u32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        self.unsigned(visitor, u64::from(u32::MAX))
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let text = match &self.node.value {
            Value::Plain(text) | Value::Quoted(text) if !self.node.is_empty() => text.as_str(),
            _ => {
                self.refuse("a text");
                "unknown"
            }
        };
        visitor
            .visit_str(text)
            .map_err(|failure: Failure| failure.at(&self.path))
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        self.deserialize_str(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let path = self.path.clone();
        let result = match self.node.value {
            Value::Hole => visitor.visit_none(),
            _ if self.node.is_empty() => visitor.visit_none(),
            _ => visitor.visit_some(self),
        };
        result.map_err(|failure: Failure| failure.at(&path))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, Failure> {
        let path = self.path.clone();
        let result = match self.node.value {
            _ if name == FLOW_TEXT => visitor.visit_string(self.node.flow()),
            Value::List(_) | Value::Mapping(_) if name == SCALAR_OR => visitor.visit_some(self),
            _ => visitor.visit_newtype_struct(self),
        };
        result.map_err(|failure: Failure| failure.at(&path))
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let nodes = match &self.node.value {
            Value::List(nodes) => nodes.as_slice(),
            _ => {
                if !self.node.is_empty() {
                    self.refuse("a list");
                }
                &[]
            }
        };
        let path = self.path.clone();
        visitor
            .visit_seq(ListAccess {
                list: self,
                nodes,
                next: 0,
            })
            .map_err(|failure: Failure| failure.at(&path))
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let entries = match &self.node.value {
            Value::Mapping(entries) => entries.iter().map(|entry| (entry.key.as_str(), &entry.node)).collect(),
            _ => {
                self.refuse("a mapping of keys");
                Vec::new()
            }
        };
        let path = self.path.clone();
        visitor
            .visit_map(MappingAccess::new(self, entries))
            .map_err(|failure: Failure| failure.at(&path))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        known: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        let path = self.path.clone();
        let entries = match &self.node.value {
            Value::Mapping(entries) => self
                .known_entries(entries, known)
                .iter()
                .map(|entry| (entry.key.as_str(), &entry.node))
                .collect(),
            _ => {
                self.refuse(&format!("a mapping of the keys {}", known.join(", ")));
                known.iter().map(|key| (*key, &HOLE)).collect()
            }
        };
        let decoder = Decoder { node: &HOLE, ..self };
        visitor
            .visit_map(MappingAccess::new(decoder, entries))
            .map_err(|failure: Failure| failure.at(&path))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        let path = self.path.clone();
        let access = VariantChoice::of(self, variants);
        visitor.visit_enum(access).map_err(|failure: Failure| failure.at(&path))
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i32 i64 u8 u16 f32 char bytes byte_buf unit unit_struct tuple tuple_struct identifier ignored_any
    }
}

/// Hands out the entries of a list.
struct ListAccess<'a> {
    list: Decoder<'a>,
    nodes: &'a [Node],
    next: usize,
}

impl<'de> de::SeqAccess<'de> for ListAccess<'_> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Failure> {
        let Some(node) = self.nodes.get(self.next) else {
            return Ok(None);
        };
        let path = self.list.path.index(self.next);
        self.next += 1;
        seed.deserialize(self.list.below(node, path)).map(Some)
    }
}

/// Hands out keys and values of a mapping.
struct MappingAccess<'a> {
    mapping: Decoder<'a>,
    entries: std::vec::IntoIter<(&'a str, &'a Node)>,
    value: Option<(&'a str, &'a Node)>,
}

impl<'a> MappingAccess<'a> {
    fn new(mapping: Decoder<'a>, entries: Vec<(&'a str, &'a Node)>) -> Self {
        MappingAccess {
            mapping,
            entries: entries.into_iter(),
            value: None,
        }
    }
}

impl<'de> de::MapAccess<'de> for MappingAccess<'_> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Failure> {
        self.value = self.entries.next();
        let Some((key, _)) = self.value else { return Ok(None) };
        let key: StrDeserializer<'_, Failure> = key.into_deserializer();
        seed.deserialize(key).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Failure> {
        let (key, node) = self
            .value
            .take()
            .ok_or_else(|| de::Error::custom("a value was read before its key"))?;
        seed.deserialize(self.mapping.below(node, self.mapping.path.key(key)))
    }
}

/// One of several variants: a word, or a mapping of one key to what the variant holds.
struct VariantChoice<'a> {
    whole: Decoder<'a>,
    variant: &'static str,
    content: Option<(&'a Node, Path)>,
}

impl<'a> VariantChoice<'a> {
    fn of(whole: Decoder<'a>, variants: &'static [&'static str]) -> VariantChoice<'a> {
        let find = |name: &str| variants.iter().copied().find(|variant| *variant == name);
        let chosen = match &whole.node.value {
            Value::Plain(name) | Value::Quoted(name) => find(name).map(|variant| (variant, None)),
            Value::Mapping(entries) => match entries.as_slice() {
                [entry] => find(&entry.key).map(|variant| (variant, Some((&entry.node, whole.path.key(variant))))),
                _ => None,
            },
            _ => None,
        };
        if let Some((variant, content)) = chosen {
            return VariantChoice {
                whole,
                variant,
                content,
            };
        }
        Self::refuse(&whole, variants);
        // The first variant stands in, with nothing in it.
        VariantChoice {
            whole: Decoder { node: &HOLE, ..whole },
            variant: variants[0],
            content: None,
        }
    }

    fn refuse(whole: &Decoder<'a>, variants: &'static [&'static str]) {
        let accepted = variants.join(", ");
        let typed = match &whole.node.value {
            Value::Plain(name) | Value::Quoted(name) if !whole.node.is_empty() => name,
            Value::Mapping(entries) if entries.len() == 1 => &entries[0].key,
            Value::Mapping(_) => return whole.refuse(&format!("exactly one of the keys {accepted}")),
            _ => return whole.refuse(&accepted),
        };
        let hint = did_you_mean(nearest(typed, variants.iter().copied()));
        let message = format!("\"{}\" is not accepted{hint}", shorten(typed));
        whole.report(message, &accepted);
    }
}

/// Stands for what a refused variant holds.
static HOLE: Node = Node {
    place: Place::CommandLine,
    value: Value::Hole,
};

impl<'de> de::EnumAccess<'de> for VariantChoice<'_> {
    type Error = Failure;
    type Variant = Self;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Self), Failure> {
        let name: StrDeserializer<'_, Failure> = self.variant.into_deserializer();
        Ok((seed.deserialize(name)?, self))
    }
}

impl<'de> de::VariantAccess<'de> for VariantChoice<'_> {
    type Error = Failure;

    fn unit_variant(self) -> Result<(), Failure> {
        if self.content.is_some() {
            self.whole.refuse(&format!("the word {}", self.variant));
        }
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Failure> {
        let (node, path) = self.content.unwrap_or_else(|| {
            self.whole
                .refuse(&format!("{{{}: ..}} with its own values", self.variant));
            (&HOLE, self.whole.path.key(self.variant))
        });
        seed.deserialize(Decoder {
            node,
            path,
            source: self.whole.source,
            findings: self.whole.findings,
        })
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, _: V) -> Result<V::Value, Failure> {
        Err(de::Error::custom("a list is not accepted as the content of a variant"))
    }

    fn struct_variant<V: Visitor<'de>>(self, known: &'static [&'static str], visitor: V) -> Result<V::Value, Failure> {
        struct Keys<V>(&'static [&'static str], V);
        impl<'de, V: Visitor<'de>> DeserializeSeed<'de> for Keys<V> {
            type Value = V::Value;

            fn deserialize<D: de::Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
                deserializer.deserialize_struct("", self.0, self.1)
            }
        }
        self.newtype_variant_seed(Keys(known, visitor))
    }
}
